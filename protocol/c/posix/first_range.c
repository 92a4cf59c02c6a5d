/* The first range of a pixel, and where the robot is after a picture: `first_range SOCKET [PICTURE]`, the picture as 320 × 240 bytes.
 * `cargo xtask firmware run` gives a socket to try it on; a serial port works as well once `stty` has made it raw. */
#include "../monorange.h"
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

static int line;
static mo_client c;

static void write_line(void *unused, const uint8_t *bytes, size_t count) {
    (void)unused;
    while (count > 0) {
        ssize_t done = write(line, bytes, count);
        if (done <= 0) exit(3);
        bytes += done;
        count -= (size_t)done;
    }
}
/* The next message's kind; hello again after half a second without a word. */
static uint8_t next(void) {
    uint8_t byte, kind;
    struct pollfd ready = {0, POLLIN, 0};
    int silences = 0;
    for (ready.fd = line;;) {
        if (poll(&ready, 1, 500) == 0) {
            if (++silences > 60) exit(4);
            mo_hello(&c, 42);
            continue;
        }
        if (read(line, &byte, 1) != 1) exit(3);
        if ((kind = mo_receive(&c, byte))) return kind;
    }
}
/* Listens until a message of that kind comes; says what is refused. */
static void wait_for(uint8_t wanted) {
    uint8_t kind;
    mo_fault fault;
    while ((kind = next()) != wanted)
        if (kind == MO_FAULT && mo_read_fault(&c, &fault)) {
            fprintf(stderr, "fault %u, detail %u\n", (unsigned)fault.cause, (unsigned)fault.detail);
            exit(1);
        }
}
#define SEND(sent) while (!(sent)) next() /* without credit listen, and try again */

int main(int count, char **arguments) {
    static uint8_t picture[320 * 240];
    const mo_camera camera = {320, 240, {365, 365}, {160, 120}, 0, {0, 0, 0, 0, 0}};
    const mo_mount mount = {0.4f, 0.2f, 0, 0, 0, 0, {0.01f, 0.017f, 0.017f, 0.017f}};
    const mo_answers answers = {0, 0, 0};
    const mo_spot spots[] = {{0, {160, 200, 0, 0}}, {1, {90, 40, 130, 180, }}};
    struct sockaddr_un address = {AF_UNIX, ""};
    mo_info info;
    mo_pose pose;
    mo_ranged ranged;
    uint32_t request;
    uint16_t row;
    uint8_t number;

    if (count < 2) return 2;
    strncpy(address.sun_path, arguments[1], sizeof address.sun_path - 1);
    line = socket(AF_UNIX, SOCK_STREAM, 0);
    if (connect(line, (struct sockaddr *)&address, sizeof address)) return 2;
    mo_init(&c, write_line, NULL);
    mo_hello(&c, 42);
    do wait_for(MO_INFO);
    while (!mo_read_info(&c, &info) || info.nonce != 42);
    SEND(mo_configure(&c, &camera, &mount, 1, &answers, NULL, 0));
    do wait_for(MO_INFO);
    while (!mo_read_info(&c, &info) || !info.configured);
    printf("%s, run %u\n", info.board, info.runs);

    SEND(mo_range(&c, 7, 0.5f, spots, 2));
    wait_for(MO_RANGES);
    mo_read_ranges(&c, &request, &number);
    for (; number > 0 && mo_next_ranged(&c, &ranged); number--)
        printf("pixel %g %g: range %.9g m, bearing %.9g rad, variances %.9g %.9g\n", ranged.pixel[0], ranged.pixel[1], ranged.range,
               ranged.bearing, ranged.covariance[0], ranged.covariance[2]);

    if (count == 3) {
        FILE *file = fopen(arguments[2], "rb");
        if (!file || fread(picture, 1, sizeof picture, file) != sizeof picture) return 2;
        SEND(mo_frame_begin(&c, 1, 1000000, 0, 0, 320, 240));
        for (row = 0; row < 240; row += 3) SEND(mo_rows(&c, 1, row, picture + 320 * row, 3 * 320));
        SEND(mo_frame_end(&c, 1));
        wait_for(MO_POSE);
        mo_read_pose(&c, &pose);
        printf("frame %u: %u landmarks, predicted only %u\n", (unsigned)pose.frame, pose.landmarks, pose.predicted_only);
        SEND(mo_ask(&c, 0));
        do {
            mo_part part;
            mo_landmark mark;
            wait_for(MO_MAP);
            mo_read_part(&c, &part);
            while (part.count-- > 0 && mo_next_landmark(&c, &mark))
                printf("landmark %u: %.9g %.9g m, variances %.9g %.9g\n", (unsigned)mark.id, mark.position[0], mark.position[1],
                       mark.covariance[0], mark.covariance[2]);
        } while (0);
    }
    return 0;
}
