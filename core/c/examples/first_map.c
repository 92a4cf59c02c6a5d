/* The core in C: the range of a pixel, the corners of a picture, and a map of two pictures. The same program runs on a computer and, with
 * board.c in place of an operating system, on a Cortex-M7 (QEMU's mps2-an500); it prints the same bits. */
#include "monorange_core.h"
#include "platform.h"

enum { WIDTH = 320, HEIGHT = 240 };

static uint64_t memory[(MONORANGE_RANGE_FINDER_BYTES + MONORANGE_DRIVE_BYTES_320X240) / 8];

static const monorange_rig rig = {
    .camera = {.width = WIDTH, .height = HEIGHT, .focal = {365, 365}, .principal = {160, 120}},
    .mount = {.height = 0.4f, .tilt = 0.2f},
};

static void number(const char *before, float value) {
    uint32_t bits;
    char text[12], *end = text + sizeof text - 1;
    int32_t thousandths = (int32_t)(value * 1000 + (value < 0 ? -0.5f : 0.5f));
    uint32_t rest = thousandths < 0 ? (uint32_t)-thousandths : (uint32_t)thousandths;
    *end = 0;
    for (int digit = 0; digit < 4 || rest > 0; digit++, rest /= 10) {
        if (digit == 3) *--end = '.';
        *--end = (char)('0' + rest % 10);
    }
    put(before);
    put(value < 0 ? " -" : " ");
    put(end);
    /* And every bit of it. */
    __builtin_memcpy(&bits, &value, sizeof bits);
    for (int nibble = 0; nibble < 8; nibble++) text[nibble] = "0123456789abcdef"[bits >> (28 - 4 * nibble) & 15];
    text[8] = 0;
    put(" (");
    put(text);
    put(")");
}

/* A wall's edge that stands on the floor, a little nearer in every picture. */
static void row_of(int picture, int v, uint8_t *row) {
    for (int u = 0; u < WIDTH; u++) row[u] = v > 140 + picture ? 60 : u > 160 ? 180 : 120;
}

static int failed(const monorange_error *error) {
    put("error: ");
    put(error->text);
    put("\n");
    return 1;
}

int main(void) {
    monorange_error error;
    char *place = (char *)memory;

    /* 1. A pixel of the floor. */
    monorange_range_finder *finder =
        monorange_range_finder_start(&rig, place, MONORANGE_RANGE_FINDER_BYTES, &error);
    if (!finder) return failed(&error);
    monorange_sighting seen;
    if (monorange_sight(finder, 160, 200, 0.5f, &seen) != MONORANGE_SEES_FLOOR) return 1;
    number("pixel (160, 200): range", seen.range);
    number(" m, variance", seen.noise.var_range);
    put("\n");

    /* 2. The corners of a picture, row by row. */
    place += MONORANGE_RANGE_FINDER_BYTES;
    monorange_extractor *extractor =
        monorange_extractor_start(&rig, place, MONORANGE_EXTRACTOR_BYTES_320X240, &error);
    if (!extractor) return failed(&error);
    uint8_t row[WIDTH];
    monorange_corner corners[8];
    monorange_extractor_begin(extractor);
    for (int v = 0; v < HEIGHT; v++) {
        row_of(0, v, row);
        if (!monorange_extractor_row(extractor, row, &error)) return failed(&error);
    }
    int found = monorange_extractor_finish(extractor, corners, 8, &error);
    if (found < 0) return failed(&error);
    for (int index = 0; index < found && index < 8; index++) {
        number("corner at u", corners[index].u);
        number(", v", corners[index].v);
        put("\n");
    }

    /* 3. A drive, in the extractor's memory, which is done. */
    static const monorange_setting settings[] = {{"association.confirm", 2}};
    monorange_drive *drive = monorange_drive_start(
        &rig, settings, 1, 32, place, MONORANGE_DRIVE_BYTES_320X240, &error);
    if (!drive) return failed(&error);
    for (int picture = 0; picture < 4; picture++) {
        double time = 0.1 * picture;
        if (picture > 0 && !monorange_drive_velocity(drive, time, 0.2f, 0, 0.1f, &error)) return failed(&error);
        monorange_drive_begin(drive);
        for (int v = 0; v < HEIGHT; v++) {
            row_of(picture, v, row);
            if (!monorange_drive_row(drive, row, &error)) return failed(&error);
        }
        if (!monorange_drive_finish(drive, time, &error)) return failed(&error);
    }
    monorange_pose pose;
    monorange_landmark landmarks[32];
    monorange_drive_pose(drive, &pose);
    number("pose: x", pose.x);
    number(" m, y", pose.y);
    number(" m, heading", pose.heading);
    put(" rad\n");
    int known = monorange_drive_landmarks(drive, landmarks, 32);
    for (int index = 0; index < known && index < 32; index++) {
        put(landmarks[index].confirmed ? "confirmed landmark" : "tentative landmark");
        number(" at x", landmarks[index].x);
        number(" m, y", landmarks[index].y);
        number(" m, variance of x", landmarks[index].var_x);
        put("\n");
    }
    return 0;
}
