/* monorange for C: range of a pixel, floor corners, pose and map, in memory that the caller gives.
 * Made from core/c/src by cbindgen: change it there. Units: m, rad, s, px; robot: x forward, y left;
 * pixel (0, 0) is the centre of the top-left pixel. Every object is NULL-safe and for one thread at a time. */

#ifndef MONORANGE_CORE_H
#define MONORANGE_CORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Bytes of memory for a range finder.
#define MONORANGE_RANGE_FINDER_BYTES 512

// Bytes of memory for an extractor of 320 × 240 pictures.
#define MONORANGE_EXTRACTOR_BYTES_320X240 (60 * 1024)

// Bytes of memory for a drive with 320 × 240 pictures and 32 landmarks.
#define MONORANGE_DRIVE_BYTES_320X240 (88 * 1024)

// Bytes of an error's text, with the zero at its end.
#define MONORANGE_ERROR_BYTES 160

// ROS' `plumb_bob`, OpenCV's default: distortion k1 k2 p1 p2 k3, then zeros.
#define MONORANGE_PLUMB_BOB 0

// OpenCV's rational model: k1 k2 p1 p2 k3 k4 k5 k6.
#define MONORANGE_RATIONAL 1

// Fisheye (Kannala and Brandt), ROS' `equidistant`: k1 k2 k3 k4, then zeros.
#define MONORANGE_EQUIDISTANT 2

// What became of a corner.
enum monorange_decision
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It corrected the state.
  MONORANGE_DECISION_UPDATE = 0,
  // It corrected the state through a landmark that is not yet confirmed.
  MONORANGE_DECISION_TENTATIVE = 1,
  // It began a landmark.
  MONORANGE_DECISION_BIRTH = 2,
  // It lay outside the gate.
  MONORANGE_DECISION_GATED = 3,
  // It was not used.
  MONORANGE_DECISION_REJECTED = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum monorange_decision monorange_decision;
#else
typedef uint32_t monorange_decision;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The filter's opinion of itself.
enum monorange_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No landmark was measured twice.
  MONORANGE_VERDICT_UNCHECKED = 0,
  // Errors are of the size that the covariance says.
  MONORANGE_VERDICT_CONSISTENT = 1,
  // Do not rely on it.
  MONORANGE_VERDICT_DOUBTFUL = 2,
  // The pose is not known.
  MONORANGE_VERDICT_LOST = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum monorange_verdict monorange_verdict;
#else
typedef uint32_t monorange_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a pixel sees.
enum monorange_sees
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // The floor.
  MONORANGE_SEES_FLOOR = 0,
  // Nothing of the floor: it looks at or above the horizon.
  MONORANGE_SEES_ABOVE_HORIZON = 1,
  // Nothing: it lies outside the picture.
  MONORANGE_SEES_OUTSIDE_IMAGE = 2,
  // Nothing: the lens model does not hold there.
  MONORANGE_SEES_OUTSIDE_LENS_MODEL = 3,
  // A pointer was null.
  MONORANGE_SEES_NOTHING = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum monorange_sees monorange_sees;
#else
typedef uint32_t monorange_sees;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Pose and map of a robot from its camera's pictures and its wheels.
typedef struct monorange_drive monorange_drive;

// Finds floor corners in a picture that comes row by row.
typedef struct monorange_extractor monorange_extractor;

// Pixels of the floor to ranges.
typedef struct monorange_range_finder monorange_range_finder;

// A camera's calibration.
typedef struct {
  // Of its pictures, px.
  uint32_t width;
  // Of its pictures, px.
  uint32_t height;
  // f_u, f_v, px.
  float focal[2];
  // c_u, c_v, px.
  float principal[2];
  // Between the axes, px a px of the ray; 0 nearly always.
  float skew;
  // `MONORANGE_PLUMB_BOB`, `MONORANGE_RATIONAL` or `MONORANGE_EQUIDISTANT`.
  uint32_t lens;
  // The lens' coefficients.
  float distortion[8];
} monorange_camera;

// How a camera sits on its robot.
typedef struct {
  // Of the lens above the floor, m.
  float height;
  // Positive downwards, rad.
  float tilt;
  // Positive where the camera's left side is up, rad.
  float roll;
  // Positive to the left, rad.
  float yaw;
  // The lens before the robot's origin, m.
  float forward;
  // The lens to the left of the robot's origin, m.
  float left;
} monorange_mount;

// A calibrated camera on its mount.
typedef struct {
  // The camera.
  monorange_camera camera;
  // The mount.
  monorange_mount mount;
  // Standard deviations of the mount; all zero: measured by hand, within 1 cm and 1°.
  monorange_mount mount_std;
} monorange_rig;

// A setting with a value of its own; `docs/settings.md` lists them all.
typedef struct {
  // For instance `association.caution`, with a zero at its end.
  const char *name;
  // A number; 0 or 1 for a switch; the place of a word, from 0, for a choice.
  float value;
} monorange_setting;

// What was wrong, in words: which value, what it was, what would be accepted.
typedef struct {
  // Ends with a zero.
  char text[MONORANGE_ERROR_BYTES];
} monorange_error;

// Where the robot is: in the world, which is its first pose.
typedef struct {
  // m.
  float x;
  // m.
  float y;
  // rad.
  float heading;
  // Of (x, y, heading), row by row.
  float covariance[9];
} monorange_pose;

// A corner of the last picture.
typedef struct {
  // Column, px.
  float u;
  // Row, px.
  float v;
  // m.
  float range;
  // rad.
  float bearing;
  // Number of its landmark, -1 for none.
  int64_t landmark;
  // What became of it.
  monorange_decision decision;
} monorange_observation;

// A landmark of the map.
typedef struct {
  // Its number, the same for ever.
  uint32_t id;
  // Whether it has been seen often enough.
  bool confirmed;
  // In the world, m; NaN while only its bearing is known.
  float x;
  // In the world, m.
  float y;
  // m².
  float var_x;
  // m².
  float cov_xy;
  // m².
  float var_y;
} monorange_landmark;

// A floor corner: where an upright edge meets the floor.
typedef struct {
  // Column, px.
  float u;
  // Row, px.
  float v;
  // px².
  float var_u;
  // px².
  float cov_uv;
  // px².
  float var_v;
} monorange_corner;

// Covariance of (range, bearing).
typedef struct {
  // m².
  float var_range;
  // m rad.
  float cov_range_bearing;
  // rad².
  float var_bearing;
} monorange_range_covariance;

// The point of the floor that a pixel sees.
typedef struct {
  // From the robot's origin, m.
  float range;
  // From the robot's x axis, positive to the left, rad.
  float bearing;
  // Forward, m.
  float x;
  // To the left, m.
  float y;
  // From the pixel's noise.
  monorange_range_covariance noise;
  // From what the mount is not known to; common to all pixels.
  monorange_range_covariance systematic;
} monorange_sighting;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Bytes of memory for a drive with pictures of this size and a map of so many landmarks.
size_t monorange_drive_bytes(uint32_t width, uint32_t height, uint32_t landmarks);

// A drive at the world's origin with an empty map for so many landmarks, in `memory` of `monorange_drive_bytes`; null, and why, for a rig or a
// setting that cannot be. `settings` has `count` of them; every other has its default.
//
// # Safety
// Nothing else uses the memory while the drive is in use. `settings` points to `count` settings whose names end with a zero.
monorange_drive *monorange_drive_start(const monorange_rig *rig,
                                       const monorange_setting *settings,
                                       size_t count,
                                       uint32_t landmarks,
                                       void *memory,
                                       size_t bytes,
                                       monorange_error *error);

// What the wheels say: forward speed (m/s) and turn rate (rad/s) for `seconds` up to the time `until` (s).
bool monorange_drive_velocity(monorange_drive *drive,
                              double until,
                              float v,
                              float omega,
                              float seconds,
                              monorange_error *error);

// What the wheels say: a step forward and left (m) and its turn (rad), in `seconds` up to the time `until` (s).
bool monorange_drive_increment(monorange_drive *drive,
                               double until,
                               float forward,
                               float left,
                               float turn,
                               float seconds,
                               monorange_error *error);

// A picture begins.
void monorange_drive_begin(monorange_drive *drive);

// Takes its next row: as many grey pixels as the camera is wide.
//
// # Safety
// `pixels` points to so many bytes.
bool monorange_drive_row(monorange_drive *drive, const uint8_t *pixels, monorange_error *error);

// Ends the picture, which was taken at `time` (s): the pose and the map are of that time now.
bool monorange_drive_finish(monorange_drive *drive, double time, monorange_error *error);

// Where the robot is.
bool monorange_drive_pose(const monorange_drive *drive, monorange_pose *pose);

// The corners of the last picture, `room` at most; returns how many there are.
//
// # Safety
// `observations` points to room for so many.
int32_t monorange_drive_observations(const monorange_drive *drive,
                                     monorange_observation *observations,
                                     size_t room);

// The landmarks, `room` at most; returns how many there are.
//
// # Safety
// `landmarks` points to room for so many.
int32_t monorange_drive_landmarks(const monorange_drive *drive,
                                  monorange_landmark *landmarks,
                                  size_t room);

// How far the filter's own figures can be believed.
monorange_verdict monorange_drive_verdict(const monorange_drive *drive);

// Bytes of memory for an extractor of pictures of this size.
size_t monorange_extractor_bytes(uint32_t width, uint32_t height);

// An extractor in `memory` of `monorange_extractor_bytes`; null, and why, for a rig that cannot be.
//
// # Safety
// Nothing else uses the memory while the extractor is in use.
monorange_extractor *monorange_extractor_start(const monorange_rig *rig,
                                               void *memory,
                                               size_t bytes,
                                               monorange_error *error);

// A picture begins.
void monorange_extractor_begin(monorange_extractor *extractor);

// Takes its next row: as many grey pixels as the camera is wide.
//
// # Safety
// `pixels` points to so many bytes.
bool monorange_extractor_row(monorange_extractor *extractor,
                             const uint8_t *pixels,
                             monorange_error *error);

// Ends the picture: `room` corners at most are written to `corners`. Returns how many were found, -1 for an error.
//
// # Safety
// `corners` points to room for so many.
int32_t monorange_extractor_finish(monorange_extractor *extractor,
                                   monorange_corner *corners,
                                   size_t room,
                                   monorange_error *error);

// A range finder in `memory` of `MONORANGE_RANGE_FINDER_BYTES`; null, and why, for a rig that cannot be.
//
// # Safety
// Nothing else uses the memory while the range finder is in use.
monorange_range_finder *monorange_range_finder_start(const monorange_rig *rig,
                                                     void *memory,
                                                     size_t bytes,
                                                     monorange_error *error);

// Range and bearing of the floor that the pixel (u, v) sees, whose noise has the standard deviation `pixel_std` (px) in both directions.
monorange_sees monorange_sight(const monorange_range_finder *finder,
                               float u,
                               float v,
                               float pixel_std,
                               monorange_sighting *sighting);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* MONORANGE_CORE_H */
