/* Holds monorange.h against the test vectors of SPEC.md: `vectors ../SPEC.md`. */
#include "../monorange.h"
#include <stdio.h>
#include <stdlib.h>

static char text[1 << 17];
static uint8_t wanted[2048], sent[2048];
static size_t wanted_length, sent_length;
static int failures, checks;
static mo_client c;

static void take(void *line, const uint8_t *bytes, size_t count) {
    (void)line;
    memcpy(sent, bytes, count);
    sent_length = count;
}
/* Finds the vector of a kind: the bytes of its line. */
static void vector(int kind) {
    char heading[16];
    const char *at = strstr(text, "<!-- vectors: begin -->");
    unsigned byte;
    int read;
    snprintf(heading, sizeof heading, "### 0x%02x\n", kind);
    wanted_length = 0;
    if (at) at = strstr(at, heading);
    if (at) at = strstr(at, "\nline\n");
    if (!at) {
        printf("0x%02x: SPEC.md has no vector\n", kind);
        exit(2);
    }
    for (at += 6; sscanf(at, "%2x%n", &byte, &read) == 1; at += read) wanted[wanted_length++] = (uint8_t)byte;
}
static void check(int holds, int kind, const char *what) {
    checks++;
    if (!holds) {
        failures++;
        printf("0x%02x: %s\n", kind, what);
    }
}
/* What was sent last is the vector. */
static void same(int kind, int was_sent) {
    vector(kind);
    check(was_sent && sent_length == wanted_length && !memcmp(sent, wanted, sent_length), kind, "other bytes are sent");
}
/* The vector's message, heard byte by byte. */
static void hear(int kind) {
    size_t i;
    uint8_t heard = 0;
    vector(kind);
    for (i = 0; i < wanted_length; i++) heard = mo_receive(&c, wanted[i]);
    check(heard == kind, kind, "is not heard");
}
static void ready(uint16_t sequence) {
    c.sequence = sequence;
    c.granted = 4096;
    c.flying = 0;
}

int main(int count, char **arguments) {
    const mo_camera camera = {320, 240, {365.0f, 365.5f}, {145.75f, 114.5f}, 0, {-0.25f, 0.375f, -0.005f, -0.002f, 0}};
    const mo_mount mount = {0.4f, 0.2f, 0, 0, 0.05f, 0, {0.005f, 0.0055f, 0.006f, 0.0065f}};
    const mo_answers answers = {1, 10, 300};
    const uint8_t settings[] = {2, 46, 0, 0, 0x90, 0x40, 14, 0xc8, 1, 7, 1}, pixels[] = {0, 1, 0, 255, 17, 0, 0, 4};
    const uint8_t chunk[] = {0xac, 2, 0xc0, 7, 0xc3, 7, 0xf8, 0xac, 0xd1, 0x91, 1, 3, 1, 0, 2};
    const mo_corner corner = {{100.5f, 180.25f}, {0.25f, -0.125f, 0.5f}, {1, 0}};
    const mo_spot spots[] = {{0, {100.5f, 180.25f, 0, 0}}, {1, {20, 60, 40, 200.5f}}};
    mo_info info;
    mo_pose pose;
    mo_part part;
    mo_observation seen;
    mo_landmark mark;
    mo_fault fault;
    mo_ranged ranged;
    uint32_t request, i;
    uint8_t number, big[MO_MAX_PAYLOAD + 1];
    FILE *file = count == 2 ? fopen(arguments[1], "rb") : NULL;
    if (!file || !fread(text, 1, sizeof text - 1, file)) return 2;

    mo_init(&c, take, NULL);
    ready(254), same(MO_HELLO, mo_hello(&c, 0xdeadbeef));
    ready(255), same(MO_CONFIGURE, mo_configure(&c, &camera, &mount, 1, &answers, settings, sizeof settings));
    ready(256), same(MO_ODOMETRY, mo_speed(&c, 1100000, 0.1f, 0.5f, -0.25f));
    ready(257), same(MO_FRAME_BEGIN, mo_frame_begin(&c, 300, 1100000, 0, 40, 320, 200));
    ready(258), same(MO_ROWS, mo_rows(&c, 300, 6, pixels, sizeof pixels));
    ready(259), same(MO_FRAME_END, mo_frame_end(&c, 300));
    ready(260), same(MO_CORNERS, mo_corners(&c, 301, 1200000, &corner, 1));
    ready(261), same(MO_RESET, mo_reset(&c, 0));
    ready(262), same(MO_SAVE_STATE, mo_save_state(&c));
    ready(263), same(MO_RESTORE_STATE, mo_restore_state(&c, chunk, sizeof chunk));
    ready(264), same(MO_TIME_SYNC, mo_time_sync(&c, 1700000000000000u));
    ready(265), same(MO_ASK, mo_ask(&c, 1));
    ready(266), same(MO_RANGE, mo_range(&c, 41, 1.5f, spots, 2));
    ready(267), same(MO_TEXT, mo_text(&c, 1));
    ready(268), same(MO_ATTITUDE, mo_attitude(&c, 0.03125f, -0.015625f, 0.003f));

    hear(MO_INFO);
    check(mo_read_info(&c, &info) && info.nonce == 0xdeadbeef && info.firmware[1] == 1 && !strcmp(info.board, "mps2-an500") &&
              info.reset_count == 0x13 && !info.configured && info.max_width == 320 && info.max_height == 240 &&
              info.max_landmarks == 32 && info.max_corners == 32 && info.window == 4096 && info.state_bytes == 12000 &&
              info.runs == 1 && info.configurations == 2 && info.resets == 3, MO_INFO, "is read otherwise");
    hear(MO_OBSERVATIONS);
    check(mo_read_part(&c, &part) && part.frame == 300 && part.first == 0 && part.total == 2 && part.count == 2, MO_OBSERVATIONS, "part");
    check(mo_next_observation(&c, &seen) && seen.pixel[1] == 180.25f && seen.range == 2.5f && seen.bearing == -0.125f &&
              seen.covariance[0] == 0.01f && seen.has_landmark && seen.landmark == 7 && seen.decision == 0 && seen.nis == 1.5f,
          MO_OBSERVATIONS, "the first");
    check(mo_next_observation(&c, &seen) && !seen.has_landmark && seen.decision == 3 && seen.nis != seen.nis, MO_OBSERVATIONS, "the second");
    hear(MO_POSE);
    check(mo_read_pose(&c, &pose) && pose.frame == 300 && pose.time_us == 1100000 && pose.position[0] == 0.05f && pose.heading == -0.025f &&
              pose.covariance[5] == 1e-5f && pose.reset_count == 0x13 && !pose.predicted_only && pose.landmarks == 12, MO_POSE, "is read otherwise");
    hear(MO_MAP);
    check(mo_read_part(&c, &part) && part.count == 1 && mo_next_landmark(&c, &mark) && mark.id == 7 && mark.position[1] == -1.25f &&
              mark.covariance[2] == 0.02f && mark.seen == 12 && mark.confirmed && mark.first_us == 1000000 && mark.last_us == 2100000,
          MO_MAP, "is read otherwise");
    check(!mo_next_landmark(&c, &mark), MO_MAP, "there is no second landmark");
    hear(MO_STATISTICS);
    hear(MO_FAULT);
    check(mo_read_fault(&c, &fault) && fault.cause == 4 && fault.detail == 299, MO_FAULT, "is read otherwise");
    hear(MO_LAST_PANIC);
    hear(MO_STATE);
    hear(MO_TIME);
    hear(MO_RANGES);
    check(mo_read_ranges(&c, &request, &number) && request == 41 && number == 2 && mo_next_ranged(&c, &ranged) && ranged.sight == 0 &&
              ranged.range == 2.5f && ranged.bearing == 0.25f && ranged.covariance[2] == 0.001f && mo_next_ranged(&c, &ranged) &&
              ranged.sight == 1 && ranged.pixel[1] == 200.5f, MO_RANGES, "is read otherwise");

    /* Credit: what was taken off the line is free again, and what is not in flight can be sent. */
    ready(510);
    for (i = 0; i < 5; i++) mo_ask(&c, 0); /* 510 to 514 */
    check(c.flying == 5, MO_CREDIT, "five in flight");
    hear(MO_CREDIT); /* up to 513, 4096 bytes */
    check(c.flying == 1 && c.flight[0].sequence == 514 && c.granted == 4096, MO_CREDIT, "one is left");
    for (i = 0; i < 1000 && mo_ask(&c, 0); i++) {}
    check(i == MO_IN_FLIGHT - 1, MO_CREDIT, "beyond the list nothing is sent");
    c.granted = 32, c.flying = 0, sent_length = 0;
    memset(big, 0xaa, sizeof big);
    check(!mo_rows(&c, 1, 0, big, 64) && sent_length == 0, MO_CREDIT, "beyond credit nothing is sent");

    /* The longest frame fits, and no longer one is sent. */
    ready(1);
    check(mo_restore_state(&c, big, MO_MAX_PAYLOAD) && sent_length <= MO_MAX_LINE, MO_RESTORE_STATE, "1024 bytes");
    ready(2);
    check(!mo_restore_state(&c, big, MO_MAX_PAYLOAD + 1), MO_RESTORE_STATE, "1025 bytes");

    /* A flipped bit anywhere is no message; neither is noise; and the next one is heard. */
    vector(MO_POSE);
    for (i = 1; i + 1 < wanted_length; i++) {
        size_t k;
        uint8_t heard = 0, bit = (uint8_t)(1 << i % 8);
        vector(MO_POSE);
        wanted[i] ^= bit;
        for (k = 0; k < wanted_length; k++) heard |= mo_receive(&c, wanted[k]);
        check(!heard, MO_POSE, "a damaged frame is heard");
    }
    for (i = 0; i < 100000; i++) mo_receive(&c, (uint8_t)(i * 2654435761u >> 13));
    for (i = 0; i < 40000; i++) mo_receive(&c, 1);
    mo_receive(&c, 0);
    hear(MO_POSE);
    printf("%d checks, %d failures\n", checks, failures);
    return failures != 0;
}
