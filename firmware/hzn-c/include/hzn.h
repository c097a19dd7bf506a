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

// A parameter cannot have this value, or the combination of the parameters is refused.
#define HZN_REFUSED -4

// The picture has no pixels, an impossible size or stride, or fewer bytes than its size needs.
#define HZN_PICTURE -5

// The altitude or the position in `HznKnown` is impossible.
#define HZN_KNOWN -6

// A sensor. Its content is hidden: only pointers to it are passed.
typedef struct HznSensor HznSensor;

// A picture: one byte per pixel, row by row.
typedef struct {
  // The first pixel of the first row.
  const uint8_t *pixels;
  // Readable bytes from `pixels` on.
  size_t bytes;
  // Columns.
  uint32_t width;
  // Rows.
  uint32_t height;
  // Bytes from the start of a row to the start of the next.
  size_t stride;
} HznPicture;

// The prior of a picture. NaN means that a value is not known.
typedef struct {
  // Altitude in metres: geodetic for the Earth, above the radius for other bodies.
  float altitude_m;
  // Position of the camera in ECEF, metres. If it is known, the altitude is not used.
  float position_m[3];
  // Rate of rotation of the camera in the camera frame, rad/s; it has an effect only with a rolling shutter.
  float rate_rad_s[3];
} HznKnown;

// The answer to a picture. Without a direction (status not 0) the values from `axis` to `rms_px` are NaN and `inliers`
// is 0.
typedef struct {
  // Unit vector to the body, camera frame (x right, y down, z forward).
  float axis[3];
  // Covariance of `axis`: xx, xy, xz, yy, yz, zz, rad².
  float cov_rad2[6];
  // The same direction in ECEF; NaN without a position.
  float axis_ecef[3];
  // Half-angle of the free fit, rad.
  float half_angle_rad;
  // Altitude from the free fit, m; NaN for Sun and Moon.
  float altitude_m;
  // 1-sigma of the altitude, m.
  float altitude_sigma_m;
  // RMS distance of the inliers from the limb, px.
  float rms_px;
  // Number of edge points that carry the answer.
  uint32_t inliers;
  // Number of edge points of the chosen edge.
  uint32_t edge_points;
  // Number of edges that were candidates.
  uint32_t candidates;
  // Number of border pixels left out because lists were full.
  uint32_t dropped;
  // Threshold between dark and lit, counts.
  uint16_t level;
  // Status: the value that `hzn_process` returned.
  uint8_t status;
  // The last stage that was entered.
  uint8_t stage;
} HznAnswer;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the number of bytes that a sensor needs.
size_t hzn_workspace_size(void);

// Returns the alignment that a sensor needs, in bytes.
size_t hzn_workspace_align(void);

// Makes a sensor in `memory`, with every parameter at its default, and writes a pointer to it to `out`.
//
// # Safety
// `memory` is null or has `bytes` writable bytes that nothing else uses as long as the sensor is used. `out` is null
// or writable.
int32_t hzn_open(uint8_t *memory,
                 size_t bytes,
                 HznSensor **out);

// Sets a parameter by its number. The value is in use after the next `hzn_apply`.
//
// # Safety
// `sensor` is null or from `hzn_open`.
int32_t hzn_set(HznSensor *sensor, uint16_t number, double value);

// Writes the value of a parameter, as it was set last, to `value`.
//
// # Safety
// `sensor` is null or from `hzn_open`. `value` is null or writable.
int32_t hzn_get(const HznSensor *sensor, uint16_t number, double *value);

// Puts the parameters that were set into use, all or none. If they are refused, the sensor does not change and the
// values that were set are lost.
//
// # Safety
// `sensor` is null or from `hzn_open`.
int32_t hzn_apply(HznSensor *sensor);

// Finds the limb. Every valid picture gets a status, which is returned, and an answer in `out`.
//
// # Safety
// `sensor` is null or from `hzn_open`. `picture` is null, or its `pixels` have `bytes` readable bytes. `known` is null
// (nothing is known) or readable. `out` is null or writable.
int32_t hzn_process(HznSensor *sensor,
                    const HznPicture *picture,
                    const HznKnown *known,
                    HznAnswer *out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HZN_H */
