/* A host's end of the monorange serial protocol, version 1: ../SPEC.md. C99 and C++, no heap, no dependency.
 *
 * A `mo_client` holds one frame each way and what is in flight, 2.4 kB. Give it a function that writes to the line, and each byte
 * that comes:
 *
 *     kind = mo_receive(&client, byte);      // 0, or the kind of a message that is now whole
 *     if (kind == MO_POSE && mo_read_pose(&client, &pose)) ...
 *
 * What sends returns 1, or 0 where there is no credit for it yet: listen, and try again. Numbers go over the line as IEEE 754 floats,
 * which `float` must be. Units: SI and radians, microseconds, pixels of the camera. */
#ifndef MONORANGE_H
#define MONORANGE_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MO_VERSION 1
#define MO_MAX_PAYLOAD 1024
#define MO_MAX_LINE 1039 /* with both zeros */
#define MO_IN_FLIGHT 32  /* frames; a send beyond them waits for credit */

enum { /* host to device */
    MO_HELLO = 0x01, MO_CONFIGURE, MO_ODOMETRY, MO_FRAME_BEGIN, MO_ROWS, MO_FRAME_END, MO_CORNERS, MO_RESET,
    MO_SAVE_STATE, MO_RESTORE_STATE, MO_TIME_SYNC, MO_ASK, MO_RANGE, MO_TEXT, MO_ATTITUDE
};
enum { /* device to host */
    MO_INFO = 0x81, MO_OBSERVATIONS, MO_POSE, MO_MAP, MO_STATISTICS, MO_CREDIT, MO_FAULT, MO_LAST_PANIC, MO_STATE,
    MO_TIME, MO_RANGES
};

typedef struct {
    void (*write)(void *line, const uint8_t *bytes, size_t count);
    void *line;
    uint8_t out[MO_MAX_LINE]; /* a frame on its way out, encoded as it grows */
    uint16_t out_length, out_block, out_payload;
    uint32_t out_checksum;
    uint8_t in[MO_MAX_LINE - 2]; /* what came since the last zero; then the frame in it */
    uint16_t in_length, payload_length, at;
    uint16_t sequence, heard;
    uint8_t has_heard, short_of;
    uint32_t damaged; /* pieces that were no frame */
    uint16_t granted, flying;
    struct { uint16_t sequence, bytes; } flight[MO_IN_FLIGHT];
} mo_client;

typedef struct { uint16_t width, height; float focal[2], principal[2], skew, distortion[5]; } mo_camera;
typedef struct { float height, tilt, roll, yaw, forward, left, std[4]; } mo_mount;
typedef struct { uint8_t observations; uint16_t map_every, statistics_every; } mo_answers;
typedef struct { float pixel[2], covariance[3]; uint8_t brighter[2]; } mo_corner;
typedef struct { uint8_t is_box; float at[4]; /* u, v; or left, top, right, bottom */ } mo_spot;

typedef struct {
    uint32_t nonce, state_bytes;
    uint8_t firmware[3], reset_count, configured, runs, configurations, resets;
    char board[32];
    uint16_t max_width, max_height, max_landmarks, max_corners, window;
} mo_info;
typedef struct {
    uint32_t frame;
    uint64_t time_us;
    float position[2], heading, covariance[6];
    uint8_t reset_count, predicted_only;
    uint16_t landmarks;
} mo_pose;
typedef struct { uint32_t frame; uint16_t first, total, count; } mo_part; /* of observations, or of the map */
typedef struct {
    float pixel[2], range, bearing, covariance[3], nis; /* nis: NaN without an innovation */
    uint32_t landmark;
    uint8_t has_landmark, decision; /* 0 update, 1 birth, 2 gated, 3 tentative, 4 rejected */
} mo_observation;
typedef struct {
    uint32_t id, seen;
    float position[2], covariance[3];
    uint8_t confirmed;
    uint64_t first_us, last_us;
} mo_landmark;
typedef struct { uint32_t cause, detail; } mo_fault;
typedef struct { float pixel[2]; uint8_t sight; float range, bearing, covariance[3]; } mo_ranged; /* sight: 0 the floor */

/* Checksum, four bits at a time: the table is 64 bytes. */
static inline uint32_t mo_crc(uint32_t crc, uint8_t byte) {
    static const uint32_t table[16] = {
        0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
        0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    crc = crc >> 4 ^ table[(crc ^ byte) & 15];
    return crc >> 4 ^ table[(crc ^ byte >> 4) & 15];
}

/* ---- A frame out: COBS as it grows. `out_block` is the place of the code byte of the block that is open. */
static inline void mo_put_coded(mo_client *c, uint8_t byte) {
    if (c->out_length - c->out_block == 255) { /* a block of 254 bytes is full */
        c->out[c->out_block] = 255;
        c->out_block = c->out_length++;
    }
    if (byte) {
        c->out[c->out_length++] = byte;
    } else {
        c->out[c->out_block] = (uint8_t)(c->out_length - c->out_block);
        c->out_block = c->out_length++;
    }
}
static inline void mo_u8(mo_client *c, uint8_t byte) {
    if (c->out_payload >= 4 + MO_MAX_PAYLOAD) { c->out_payload = 0xffff; return; } /* too long: not sent */
    c->out_payload++;
    c->out_checksum = mo_crc(c->out_checksum, byte);
    mo_put_coded(c, byte);
}
static inline void mo_begin(mo_client *c, uint8_t kind) {
    c->out[0] = 0;
    c->out_block = 1;
    c->out_length = 2;
    c->out_payload = 0;
    c->out_checksum = 0xffffffffu;
    mo_u8(c, MO_VERSION);
    mo_u8(c, kind);
    mo_u8(c, (uint8_t)c->sequence);
    mo_u8(c, (uint8_t)(c->sequence >> 8));
}
static inline void mo_uint(mo_client *c, uint64_t number) { /* LEB128 */
    for (; number > 127; number >>= 7) mo_u8(c, (uint8_t)(number | 128));
    mo_u8(c, (uint8_t)number);
}
static inline void mo_f32(mo_client *c, float number) {
    uint32_t bits;
    int i;
    memcpy(&bits, &number, 4);
    for (i = 0; i < 4; i++) mo_u8(c, (uint8_t)(bits >> 8 * i));
}
static inline void mo_f32s(mo_client *c, const float *numbers, int count) {
    while (count-- > 0) mo_f32(c, *numbers++);
}
static inline void mo_bytes(mo_client *c, const uint8_t *bytes, size_t count) {
    mo_uint(c, count);
    while (count-- > 0) mo_u8(c, *bytes++);
}
/* Ends the frame and sends it if there is credit. */
static inline int mo_send(mo_client *c) {
    uint32_t sum = ~c->out_checksum, used = 0;
    uint16_t i;
    if (c->out_payload == 0xffff) return 0;
    for (i = 0; i < 4; i++) mo_put_coded(c, (uint8_t)(sum >> 8 * i));
    c->out[c->out_block] = (uint8_t)(c->out_length - c->out_block);
    c->out[c->out_length++] = 0;
    for (i = 0; i < c->flying; i++) used += c->flight[i].bytes;
    if (c->flying == MO_IN_FLIGHT || used + c->out_length > c->granted) return 0;
    c->flight[c->flying].sequence = c->sequence++;
    c->flight[c->flying++].bytes = c->out_length;
    c->write(c->line, c->out, c->out_length);
    return 1;
}

/* ---- Messages out */
static inline void mo_init(mo_client *c, void (*write)(void *, const uint8_t *, size_t), void *line) {
    memset(c, 0, sizeof *c);
    c->write = write;
    c->line = line;
    c->granted = 32;
}
/* Who is there? First, and after half a second without a word; what was in flight counts as lost. `nonce` comes back in Info. */
static inline int mo_hello(mo_client *c, uint32_t nonce) {
    c->flying = 0;
    mo_begin(c, MO_HELLO);
    mo_uint(c, nonce);
    return mo_send(c);
}
/* `settings` as SPEC.md has them: none for the defaults. Answered by Info, after a Fault where it is refused. */
static inline int mo_configure(mo_client *c, const mo_camera *camera, const mo_mount *mount, uint8_t binning,
                               const mo_answers *answers, const uint8_t *settings, size_t count) {
    const float parameters[6] = {mount->height, mount->tilt, mount->roll, mount->yaw, mount->forward, mount->left};
    mo_begin(c, MO_CONFIGURE);
    mo_uint(c, camera->width);
    mo_uint(c, camera->height);
    mo_f32s(c, camera->focal, 2);
    mo_f32s(c, camera->principal, 2);
    mo_f32(c, camera->skew);
    mo_f32s(c, camera->distortion, 5);
    mo_f32s(c, parameters, 6);
    mo_f32s(c, mount->std, 4);
    mo_u8(c, binning);
    mo_u8(c, answers->observations);
    mo_uint(c, answers->map_every);
    mo_uint(c, answers->statistics_every);
    while (count-- > 0) mo_u8(c, *settings++);
    return mo_send(c);
}
static inline int mo_speed(mo_client *c, uint64_t until_us, float seconds, float speed, float turn) {
    const float motion[2] = {speed, turn};
    mo_begin(c, MO_ODOMETRY);
    mo_uint(c, until_us);
    mo_f32(c, seconds);
    mo_uint(c, 0);
    mo_f32s(c, motion, 2);
    return mo_send(c);
}
static inline int mo_moved(mo_client *c, uint64_t until_us, float seconds, float forward, float left, float turn) {
    const float motion[3] = {forward, left, turn};
    mo_begin(c, MO_ODOMETRY);
    mo_uint(c, until_us);
    mo_f32(c, seconds);
    mo_uint(c, 1);
    mo_f32s(c, motion, 3);
    return mo_send(c);
}
/* How the robot leans when the next picture is taken, rad: nose down and left side up are positive. */
static inline int mo_attitude(mo_client *c, float pitch, float roll, float std) {
    const float lean[3] = {pitch, roll, std};
    mo_begin(c, MO_ATTITUDE);
    mo_f32s(c, lean, 3);
    return mo_send(c);
}
static inline int mo_frame_begin(mo_client *c, uint32_t frame, uint64_t time_us, uint16_t left, uint16_t top,
                                 uint16_t width, uint16_t height) {
    mo_begin(c, MO_FRAME_BEGIN);
    mo_uint(c, frame);
    mo_uint(c, time_us);
    mo_uint(c, left);
    mo_uint(c, top);
    mo_uint(c, width);
    mo_uint(c, height);
    return mo_send(c);
}
/* Whole rows, `count` pixels in all: at most 1014. */
static inline int mo_rows(mo_client *c, uint32_t frame, uint16_t row, const uint8_t *pixels, size_t count) {
    mo_begin(c, MO_ROWS);
    mo_uint(c, frame);
    mo_uint(c, row);
    mo_bytes(c, pixels, count);
    return mo_send(c);
}
static inline int mo_frame_end(mo_client *c, uint32_t frame) {
    mo_begin(c, MO_FRAME_END);
    mo_uint(c, frame);
    return mo_send(c);
}
static inline int mo_corners(mo_client *c, uint32_t frame, uint64_t time_us, const mo_corner *corners, uint8_t count) {
    mo_begin(c, MO_CORNERS);
    mo_uint(c, frame);
    mo_uint(c, time_us);
    mo_uint(c, count);
    for (; count > 0; count--, corners++) {
        mo_f32s(c, corners->pixel, 2);
        mo_f32s(c, corners->covariance, 3);
        mo_u8(c, corners->brighter[0]);
        mo_u8(c, corners->brighter[1]);
    }
    return mo_send(c);
}
/* How far is what stands on the floor there? At most 32 spots; std_px 0 for the setting's. Pose and map stay as they are. */
static inline int mo_range(mo_client *c, uint32_t request, float std_px, const mo_spot *spots, uint8_t count) {
    mo_begin(c, MO_RANGE);
    mo_uint(c, request);
    mo_f32(c, std_px);
    mo_uint(c, count);
    for (; count > 0; count--, spots++) {
        mo_uint(c, spots->is_box ? 1 : 0);
        mo_f32s(c, spots->at, spots->is_box ? 4 : 2);
    }
    return mo_send(c);
}
/* Messages of one number or none: Reset (0 pose and map, 1 the device), Ask (0 map, 1 statistics), Text (0 answers in frames, 1 in lines of
 * text that a person can read, 2 in both), TimeSync, SaveState. */
static inline int mo_reset(mo_client *c, uint8_t what) { mo_begin(c, MO_RESET); mo_uint(c, what); return mo_send(c); }
static inline int mo_ask(mo_client *c, uint8_t what) { mo_begin(c, MO_ASK); mo_uint(c, what); return mo_send(c); }
static inline int mo_text(mo_client *c, uint8_t what) { mo_begin(c, MO_TEXT); mo_uint(c, what); return mo_send(c); }
static inline int mo_time_sync(mo_client *c, uint64_t us) { mo_begin(c, MO_TIME_SYNC); mo_uint(c, us); return mo_send(c); }
static inline int mo_save_state(mo_client *c) { mo_begin(c, MO_SAVE_STATE); return mo_send(c); }
/* A chunk of State back as it came: its payload, which is RestoreState's. */
static inline int mo_restore_state(mo_client *c, const uint8_t *payload, size_t count) {
    mo_begin(c, MO_RESTORE_STATE);
    while (count-- > 0) mo_u8(c, *payload++);
    return mo_send(c);
}

/* ---- Fields in: beyond the payload they are 0, and `short_of` is set. */
static inline uint8_t mo_get_u8(mo_client *c) {
    if (c->at < c->payload_length) return c->in[4 + c->at++];
    c->short_of = 1;
    return 0;
}
static inline uint64_t mo_get_uint(mo_client *c) {
    uint64_t number = 0;
    int shift = 0;
    uint8_t byte;
    do {
        byte = mo_get_u8(c);
        if (shift < 64) number |= (uint64_t)(byte & 127) << shift;
        shift += 7;
    } while (byte & 128);
    return number;
}
static inline float mo_get_f32(mo_client *c) {
    uint32_t bits = 0;
    float number;
    int i;
    for (i = 0; i < 4; i++) bits |= (uint32_t)mo_get_u8(c) << 8 * i;
    memcpy(&number, &bits, 4);
    return number;
}
static inline void mo_get_f32s(mo_client *c, float *numbers, int count) {
    while (count-- > 0) *numbers++ = mo_get_f32(c);
}
static inline void mo_from_start(mo_client *c) { c->at = 0; c->short_of = 0; }

/* ---- Messages in: 1 where all was there. */
static inline int mo_read_info(mo_client *c, mo_info *info) {
    uint32_t length, i;
    int whole;
    mo_from_start(c);
    info->nonce = (uint32_t)mo_get_uint(c);
    for (i = 0; i < 3; i++) info->firmware[i] = mo_get_u8(c);
    length = (uint32_t)mo_get_uint(c);
    memset(info->board, 0, sizeof info->board);
    for (i = 0; i < length && !c->short_of; i++) {
        char letter = (char)mo_get_u8(c);
        if (i + 1 < sizeof info->board) info->board[i] = letter;
    }
    info->reset_count = mo_get_u8(c);
    info->configured = mo_get_u8(c);
    info->max_width = (uint16_t)mo_get_uint(c);
    info->max_height = (uint16_t)mo_get_uint(c);
    info->max_landmarks = (uint16_t)mo_get_uint(c);
    info->max_corners = (uint16_t)mo_get_uint(c);
    info->window = (uint16_t)mo_get_uint(c);
    info->state_bytes = (uint32_t)mo_get_uint(c);
    whole = !c->short_of;
    info->runs = mo_get_u8(c); /* later fields: 0 where the device is older */
    info->configurations = mo_get_u8(c);
    info->resets = mo_get_u8(c);
    return whole;
}
static inline int mo_read_pose(mo_client *c, mo_pose *pose) {
    mo_from_start(c);
    pose->frame = (uint32_t)mo_get_uint(c);
    pose->time_us = mo_get_uint(c);
    mo_get_f32s(c, pose->position, 2);
    pose->heading = mo_get_f32(c);
    mo_get_f32s(c, pose->covariance, 6);
    pose->reset_count = mo_get_u8(c);
    pose->predicted_only = mo_get_u8(c);
    pose->landmarks = (uint16_t)mo_get_uint(c);
    return !c->short_of;
}
/* Begins Observations or a Map: `count` times mo_next_observation or mo_next_landmark follow. */
static inline int mo_read_part(mo_client *c, mo_part *part) {
    mo_from_start(c);
    part->frame = (uint32_t)mo_get_uint(c);
    part->first = (uint16_t)mo_get_uint(c);
    part->total = (uint16_t)mo_get_uint(c);
    part->count = (uint16_t)mo_get_uint(c);
    return !c->short_of;
}
static inline int mo_next_observation(mo_client *c, mo_observation *one) {
    const uint32_t nan_bits = 0x7fc00000;
    mo_get_f32s(c, one->pixel, 2);
    one->range = mo_get_f32(c);
    one->bearing = mo_get_f32(c);
    mo_get_f32s(c, one->covariance, 3);
    one->has_landmark = mo_get_u8(c);
    one->landmark = one->has_landmark ? (uint32_t)mo_get_uint(c) : 0;
    one->decision = (uint8_t)mo_get_uint(c);
    if (mo_get_u8(c)) one->nis = mo_get_f32(c);
    else memcpy(&one->nis, &nan_bits, 4);
    return !c->short_of;
}
static inline int mo_next_landmark(mo_client *c, mo_landmark *one) {
    one->id = (uint32_t)mo_get_uint(c);
    mo_get_f32s(c, one->position, 2);
    mo_get_f32s(c, one->covariance, 3);
    one->seen = (uint32_t)mo_get_uint(c);
    one->confirmed = mo_get_u8(c);
    one->first_us = mo_get_uint(c);
    one->last_us = mo_get_uint(c);
    return !c->short_of;
}
/* Begins Ranges: `count` times mo_next_ranged follow. */
static inline int mo_read_ranges(mo_client *c, uint32_t *request, uint8_t *count) {
    mo_from_start(c);
    *request = (uint32_t)mo_get_uint(c);
    *count = (uint8_t)mo_get_uint(c);
    return !c->short_of;
}
static inline int mo_next_ranged(mo_client *c, mo_ranged *one) {
    mo_get_f32s(c, one->pixel, 2);
    one->sight = (uint8_t)mo_get_uint(c);
    one->range = mo_get_f32(c);
    one->bearing = mo_get_f32(c);
    mo_get_f32s(c, one->covariance, 3);
    return !c->short_of;
}
static inline int mo_read_fault(mo_client *c, mo_fault *fault) {
    mo_from_start(c);
    fault->cause = (uint32_t)mo_get_uint(c);
    fault->detail = (uint32_t)mo_get_uint(c);
    return !c->short_of;
}

/* ---- Bytes in */
static inline uint16_t mo_decode(mo_client *c) { /* COBS in place; the length, or 0 */
    uint16_t from = 0, to = 0, i;
    while (from < c->in_length) {
        uint8_t code = c->in[from++];
        if (from + code - 1 > c->in_length) return 0;
        for (i = 1; i < code; i++) c->in[to++] = c->in[from++];
        if (code < 255 && from < c->in_length) c->in[to++] = 0;
    }
    return to;
}
/* Takes a byte of the line; returns the kind of the message that it completes, or 0. The message stands until the next byte. */
static inline uint8_t mo_receive(mo_client *c, uint8_t byte) {
    uint16_t length, i, kept = 0, sequence;
    uint32_t sum = 0xffffffffu, sent = 0;
    if (byte) { /* beyond the longest frame bytes are counted only */
        if (c->in_length < sizeof c->in) c->in[c->in_length] = byte;
        if (c->in_length <= sizeof c->in) c->in_length++;
        return 0;
    }
    if (c->in_length == 0) return 0;
    length = c->in_length <= sizeof c->in ? mo_decode(c) : 0;
    c->in_length = 0;
    c->damaged++;
    if (length < 8) return 0;
    for (i = 0; i < length - 4; i++) sum = mo_crc(sum, c->in[i]);
    for (i = 0; i < 4; i++) sent |= (uint32_t)c->in[length - 4 + i] << 8 * i;
    if (~sum != sent || c->in[0] != MO_VERSION) return 0;
    c->damaged--;
    sequence = (uint16_t)(c->in[2] | c->in[3] << 8);
    if (c->has_heard && c->heard == sequence) return 0; /* it came twice */
    c->has_heard = 1;
    c->heard = sequence;
    c->payload_length = (uint16_t)(length - 8);
    mo_from_start(c);
    if (c->in[1] == MO_CREDIT) {
        sequence = (uint16_t)mo_get_uint(c);
        c->granted = (uint16_t)mo_get_uint(c);
        for (i = 0; i < c->flying; i++) /* those after `sequence` are still in flight */
            if ((uint16_t)(c->flight[i].sequence - sequence - 1) < 0x7fff) c->flight[kept++] = c->flight[i];
        c->flying = kept;
        mo_from_start(c);
    }
    return c->in[1];
}
#endif
