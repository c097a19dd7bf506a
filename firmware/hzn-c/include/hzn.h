/* hzn: a horizon sensor. Made by cbindgen from firmware/hzn-c; do not edit. */

#ifndef HZN_H
#define HZN_H

#include <stddef.h>
#include <stdint.h>

// A pointer is null.
#define HZN_NULL -1

// The memory is too small or not aligned.
#define HZN_MEMORY -2

// No parameter has this number.
#define HZN_UNKNOWN_PARAMETER -3

// A parameter cannot have this value, or they do not go together.
#define HZN_REFUSED -4

// The picture is smaller than it says.
#define HZN_PICTURE -5

// What is known about the picture cannot be.
#define HZN_KNOWN -6

// A sensor. Opaque: only pointers to it are passed around.
typedef struct HznSensor HznSensor;

// A picture: one byte a pixel, row by row.
typedef struct {
  // The first pixel of the first row.
  const uint8_t *pixels;
  // Bytes from `pixels` on that may be read.
  size_t bytes;
  // Columns.
  uint32_t width;
  // Rows.
  uint32_t height;
  // Bytes from the start of a row to the start of the next.
  size_t stride;
} HznPicture;

// What is known about a picture besides it. NaN: not known.
typedef struct {
  // Altitude in metres: geodetic for the Earth, else above the radius.
  float altitude_m;
  // Position of the camera in ECEF, metres. It beats the altitude.
  float position_m[3];
  // Rate of rotation of the camera in its own axes, rad/s; it counts with a rolling shutter.
  float rate_rad_s[3];
} HznKnown;

// The answer to a picture. Without a direction (status not 0) its numbers are NaN and 0.
typedef struct {
  // Unit vector to the body, camera frame (x right, y down, z forward).
  float axis[3];
  // Its covariance: xx, xy, xz, yy, yz, zz, rad².
  float cov_rad2[6];
  // The same direction in ECEF; NaN without a position.
  float axis_ecef[3];
  // Half-angle of the free fit, rad.
  float half_angle_rad;
  // Altitude from the free fit, m; NaN for Sun and Moon.
  float altitude_m;
  // Its 1-sigma, m.
  float altitude_sigma_m;
  // RMS distance of the inliers from the limb, px.
  float rms_px;
  // Edge points that carry the answer.
  uint32_t inliers;
  // Points of the chosen edge.
  uint32_t edge_points;
  // Edges that were candidates.
  uint32_t candidates;
  // Border pixels left out because lists were full.
  uint32_t dropped;
  // Level between dark and lit, counts.
  uint16_t level;
  // Status, as returned.
  uint8_t status;
  // The last stage that was entered.
  uint8_t stage;
} HznAnswer;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Bytes that a sensor needs.
size_t hzn_workspace_size(void);

// Alignment that a sensor needs, in bytes.
size_t hzn_workspace_align(void);

// Makes a sensor with every parameter at its default in `memory`, and gives it in `out`.
//
// # Safety
// `memory` is null or holds `bytes` writable bytes that nobody else uses as long as the sensor is used; `out` is null
// or writable.
int32_t hzn_open(uint8_t *memory,
                 size_t bytes,
                 HznSensor **out);

// Sets a parameter by its number. It holds from the next `hzn_apply` on.
//
// # Safety
// `sensor` is null or from `hzn_open`.
int32_t hzn_set(HznSensor *sensor, uint16_t number, double value);

// Gives a parameter as it was set last.
//
// # Safety
// `sensor` is null or from `hzn_open`; `value` is null or writable.
int32_t hzn_get(const HznSensor *sensor, uint16_t number, double *value);

// Takes the parameters that were set, all or none: refused, the sensor stays as it was and what was set is forgotten.
//
// # Safety
// `sensor` is null or from `hzn_open`.
int32_t hzn_apply(HznSensor *sensor);

// Finds the limb. Any picture gives a status, and an answer in `out`.
//
// # Safety
// `sensor` is null or from `hzn_open`; `picture` is null or its `pixels` hold `bytes` readable bytes; `known` is null
// (nothing is known) or readable; `out` is null or writable.
int32_t hzn_process(HznSensor *sensor,
                    const HznPicture *picture,
                    const HznKnown *known,
                    HznAnswer *out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HZN_H */
