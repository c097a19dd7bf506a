/* hzn: a horizon sensor. Made by cbindgen from firmware/hzn-c; do not edit.

   Memory. The caller owns all memory; the library has no heap and no global state. The memory of a sensor begins at a multiple
   of HZN_WORKSPACE_ALIGN, stays where it is as long as the sensor is used (it must not be copied or moved), and needs no
   closing: it is free for other uses after the last call.

   Threads and interrupts. Calls with different sensors may run at the same time, each with its own memory. Calls with one
   sensor must not overlap: the library has no locks, so that tasks which share a sensor need one of their own, and an interrupt
   must not use a sensor that it may have interrupted. The function that hzn_process_rows calls must not use its sensor. A
   task that is interrupted by others needs no care.

   Errors. A negative number is an error, after which nothing has changed; 0 to 7 is the status of a picture. */

#ifndef HZN_H
#define HZN_H

#include <stddef.h>
#include <stdint.h>

// A pointer is null.
#define HZN_NULL (-1)

// The memory is too small or not aligned.
#define HZN_MEMORY (-2)

// No parameter has this number.
#define HZN_UNKNOWN_PARAMETER (-3)

// A parameter cannot have this value, or the combination of the parameters is refused.
#define HZN_REFUSED (-4)

// The picture has no pixels, another size than the camera, an impossible stride, or fewer bytes than its size needs.
#define HZN_PICTURE (-5)

// A value in HznKnown is impossible, or a part of a vector is NaN.
#define HZN_KNOWN (-6)

// There is no sensor at this pointer: it was not opened, or bits of its memory have changed since the last call. It
// must be opened again.
#define HZN_NOT_OPEN (-7)

// The program was compiled with the header of another version of this library.
#define HZN_OTHER_INTERFACE (-8)

// The parameters need the whole picture in memory, or the camera has more than 1920 columns or 1080 rows.
#define HZN_NO_ROWS (-9)

// next_row ended the picture.
#define HZN_ROWS_ENDED (-10)

// Status: a direction was found.
#define HZN_OK 0

// Status: no edge in the picture is a limb of the body.
#define HZN_NO_LIMB 1

// Status: the picture is too dark.
#define HZN_TOO_DARK 2

// Status: the picture is too bright.
#define HZN_TOO_BRIGHT 3

// Status: no edge has enough points.
#define HZN_TOO_FEW_POINTS 4

// Status: two different directions fit about equally well.
#define HZN_AMBIGUOUS 5

// Status: a direction was found and refused.
#define HZN_REJECTED 6

// Status: lists were full or the work budget was used up.
#define HZN_TRUNCATED 7

// Version of the structures and functions of this header. hzn_open compares it with that of the library.
#define HZN_INTERFACE 4

// Bytes that a sensor needs which fits 2048 points of an edge, on every machine.
#define HZN_WORKSPACE_SIZE 114688

// Bytes that a sensor needs which fits 608 points of an edge: enough for the default of edge_points.keep_points,
// 600. Of a longer list, dropped in the answer counts the border pixels that are left out.
#define HZN_WORKSPACE_SIZE_608 61440

// Alignment that a sensor needs, bytes.
#define HZN_WORKSPACE_ALIGN 16

// Bytes that a rig needs in addition to its sensors, on every machine; it has the alignment of a sensor.
#define HZN_RIG_SIZE 16384

// Largest number of heads of a rig.
#define HZN_RIG_HEADS 4

// Bytes that the rows of a picture need, on every machine; they have the alignment of a sensor.
#define HZN_ROWS_SIZE 147456

// A rig. Its content is hidden: only pointers to it are passed.
typedef struct HznRig HznRig;

// A sensor. Its content is hidden: only pointers to it are passed.
typedef struct HznSensor HznSensor;

// The prior of a picture. NaN means that a value is not known; of a vector all numbers are known, or none.
// hzn_nothing_known fills it with NaN.
typedef struct {
  // Altitude in metres: geodetic for the Earth, above the radius for other bodies.
  float altitude_m;
  // Position of the camera in the fixed frame of the body (for the Earth ECEF), metres. If it is known, the altitude
  // is not used.
  float position_m[3];
  // Rate of rotation of the camera in the camera frame, rad/s: for a rolling shutter, and to move the attitude and
  // the Sun to the exposure.
  float rate_rad_s[3];
  // Attitude: unit quaternion, scalar first, from the camera frame to the fixed frame of the body (for the Earth
  // ECEF). With a position, an answer that contradicts it is refused (parameter 130).
  float attitude_wxyz[4];
  // 1-sigma of the attitude about the worst axis, rad; NaN: 5 degrees.
  float attitude_sigma_rad;
  // Direction to the Sun in the camera frame, of any length. A limb that it does not light is refused (parameter
  // 131).
  float sun[3];
  // Time from the attitude and the Sun to the exposure, s; NaN: 0. Both are moved by the rate, if it is known.
  float attitude_age_s;
  // The attitude and the Sun are not used if they are further from the exposure than this, s; NaN: they do not
  // expire. 0, less than 0 and infinity are refused.
  float attitude_expires_s;
  // axis of the last answer. With parameter 132, an answer that is too far from it is refused.
  float last_axis[3];
  // cov_rad2 of that answer. Both are given, or none.
  float last_cov_rad2[6];
  // Time from the exposure of that answer to this one, s.
  float last_age_s;
  // Temperature of the camera, °C, for a lens that changes with it (parameters 24 to 28).
  float camera_temperature_c;
} HznKnown;

// A picture: one byte per pixel, row by row.
typedef struct {
  // The first pixel of the first row.
  const uint8_t *pixels;
  // Readable bytes from pixels on.
  size_t bytes;
  // Columns.
  uint32_t width;
  // Rows.
  uint32_t height;
  // Bytes from the start of a row to the start of the next.
  size_t stride;
} HznPicture;

// A candidate edge.
typedef struct {
  // Number of the candidate, from 0.
  uint32_t number;
  // Border pixels.
  uint32_t length_px;
  // Edge points.
  uint32_t points;
  // Edge points that fit the limb.
  uint32_t inliers;
  // RMS distance of the inliers from the limb, px; NaN without a fit.
  float rms_px;
  // Verdict: a number of hzn_verdicts.h.
  uint8_t verdict;
} HznEdge;

// The answer to a picture. Without a direction (status not 0) the values from axis to rms_px and those from
// p_limb on are NaN, and inliers is 0. After a call that returns an error, status is 255 and every other number
// is NaN or 0.
typedef struct {
  // Unit vector to the body, camera frame (x right, y down, z forward).
  float axis[3];
  // Covariance of axis: xx, xy, xz, yy, yz, zz, rad².
  float cov_rad2[6];
  // The same direction in the fixed frame of the body (for the Earth ECEF); NaN without a position.
  float axis_fixed[3];
  // The same direction in the vehicle's frame; NaN without a mounting.
  float axis_vehicle[3];
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
  // Status: the value that hzn_process returned.
  uint8_t status;
  // The last stage that was entered.
  uint8_t stage;
  // Number of candidates in edges.
  uint8_t listed;
  // Attitude and Sun of HznKnown: 0 not given, 1 used, 2 expired and not used.
  uint8_t attitude;
  // The first candidates, and the chosen one.
  HznEdge edges[16];
  // Probability that the edge of the answer is the limb, which parameter 135 is compared with; NaN for bodies
  // without air.
  float p_limb;
  // Angle that the error of axis exceeds with the probability of parameter 105 if the edge is the limb, rad; NaN
  // without p_limb.
  float protection_rad;
  // The part of cov_rad2 whose error is the same in the next picture while the geometry stays. A mean of n answers
  // has the covariance cov_common_rad2 + (cov_rad2 - cov_common_rad2) / n.
  float cov_common_rad2[6];
} HznAnswer;

// What the heads of a rig share, and their mounts. hzn_rig_usual fills it.
typedef struct {
  // Probability of a false alarm of the check of each head by the others, for each epoch.
  double false_alarm;
  // Probability that the error exceeds protection_rad, if at most one head is wrong.
  double misleading;
  // 1-sigma of a tilt of the limb that all heads share, km; NaN: it follows from the half-angle.
  float limb_tilt_sigma_km;
  // 1-sigma of the limb height that each head has for itself, km.
  float limb_own_sigma_km;
  // Distance along the limb at which the correlation of that height has fallen to exp(-1/2), km.
  float limb_own_length_km;
  // 1-sigma of the attitude of the rig on the vehicle about each axis, rad.
  float sigma_rad;
  // Quaternion from each camera to the vehicle, scalar first; NaN: there is no such head.
  float q_vehicle_from_camera_wxyz[4][4];
  // Covariance of each mount: xx, xy, xz, yy, yz, zz of a small rotation about the axes of the vehicle, rad².
  float mount_cov_rad2[4][6];
  // Number of the limb that each head sees, 0 to 3: heads of different bands see limbs of different heights.
  uint32_t limb_groups[4];
} HznRigSetup;

// The joint answer of a rig. A set of heads has the bit 2^k for head k. Without a direction (status not 0) its numbers
// are NaN. After a call that returns an error, status is 255.
typedef struct {
  // Middle of the exposures that are used, s, from the instant of the heads' times; NaN: not known.
  double time_s;
  // Unit vector to the body, vehicle's frame.
  float axis_vehicle[3];
  // Covariance of axis_vehicle: xx, xy, xz, yy, yz, zz, rad².
  float cov_rad2[6];
  // Half-angle of the limb, rad.
  float half_angle_rad;
  // Angle by which the axis moves without the head that agrees least, rad; NaN with one head.
  float separation_rad;
  // Largest such angle that the covariance allows, rad.
  float separation_limit_rad;
  // Angle that the error exceeds with the probability misleading, if at most one head is wrong, rad; NaN with one
  // head.
  float protection_rad;
  // Status: the value that hzn_rig_join returned.
  uint8_t status;
  // Heads that have a picture.
  uint8_t heads_seen;
  // Heads that have an answer and a mount.
  uint8_t heads_answered;
  // Heads that are in the joint answer.
  uint8_t heads_used;
  // Heads that the check excluded.
  uint8_t heads_excluded;
} HznRigAnswer;

// The structures have the sizes that they have in the library. C99 cannot check this.
#if defined(__cplusplus)
#define HZN_ASSERT static_assert
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define HZN_ASSERT _Static_assert
#else
#define HZN_ASSERT(condition, message) struct HznSensor
#endif
HZN_ASSERT(sizeof(HznKnown) == 112, "the size of HznKnown");
HZN_ASSERT(sizeof(HznPicture) == 3 * sizeof(size_t) + 8, "the size of HznPicture");
HZN_ASSERT(sizeof(HznEdge) == 24, "the size of HznEdge");
HZN_ASSERT(sizeof(HznAnswer) == 516, "the size of HznAnswer");
HZN_ASSERT(sizeof(HznRigSetup) == 208, "the size of HznRigSetup");
HZN_ASSERT(sizeof(HznRigAnswer) == 72, "the size of HznRigAnswer");
#undef HZN_ASSERT

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the number of bytes that a sensor needs which fits 2048 points of an edge.
size_t hzn_workspace_size(void);

// Returns the alignment that a sensor needs, in bytes.
size_t hzn_workspace_align(void);

// Returns the version of the library: major, minor and patch in one byte each, from the second byte on.
uint32_t hzn_version(void);

// Makes a sensor in memory, with every parameter at its default, and writes a pointer to it to out. interface
// is HZN_INTERFACE. The sensor fits 2048 points of an edge if bytes is HZN_WORKSPACE_SIZE or more, and 608
// points if it is less, but at least HZN_WORKSPACE_SIZE_608.
//
// Safety:
// memory is null or has bytes writable bytes that nothing else uses as long as the sensor is used. out is null
// or writable.
int32_t hzn_open(uint8_t *memory,
                 size_t bytes,
                 uint32_t interface,
                 HznSensor **out);

// Sets a parameter by its number. The value is in use after the next hzn_apply.
//
// Safety:
// sensor is null or from hzn_open.
int32_t hzn_set(HznSensor *sensor, uint16_t number, double value);

// Writes the value of a parameter, as it was set last, to value.
//
// Safety:
// sensor is null or from hzn_open. value is null or writable.
int32_t hzn_get(const HznSensor *sensor, uint16_t number, double *value);

// Puts the parameters that were set into use, all or none. If they are refused, the sensor does not change and the
// values that were set are lost.
//
// Safety:
// sensor is null or from hzn_open.
int32_t hzn_apply(HznSensor *sensor);

// Returns the number of the parameter that hzn_set or hzn_apply refused last; 0: none, or the sensor is not open.
// Of a parameter with several numbers, such as the corners of a mask, this is the first.
//
// Safety:
// sensor is null or from hzn_open.
uint16_t hzn_refused(const HznSensor *sensor);

// Sets every value to NaN: nothing is known. Fill in what is known afterwards.
//
// Safety:
// known is null or writable.
int32_t hzn_nothing_known(HznKnown *known);

// Finds the limb. Every valid picture gets a status, which is returned, and an answer in out.
//
// Safety:
// sensor is null or from hzn_open. picture is null, or its pixels have bytes readable bytes. known is null
// (nothing is known) or readable. out is null or writable.
int32_t hzn_process(HznSensor *sensor,
                    const HznPicture *picture,
                    const HznKnown *known,
                    HznAnswer *out);

// Writes the usual values to setup: those of a rig.toml that has none, with exact mounts. The quaternions are NaN: a
// head without one has no part in the joint answer.
//
// Safety:
// setup is null or writable.
int32_t hzn_rig_usual(HznRigSetup *setup);

// Makes a rig in memory and writes a pointer to it to out. interface is HZN_INTERFACE. The sensors of the
// heads are opened by hzn_open, each in memory of its own. A setup with an impossible number is
// refused.
//
// Safety:
// memory is null or has bytes writable bytes that nothing else uses as long as the rig is used. setup is null or
// readable. out is null or writable.
int32_t hzn_rig_open(uint8_t *memory,
                     size_t bytes,
                     uint32_t interface,
                     const HznRigSetup *setup,
                     HznRig **out);

// Finds the limb in the picture of head head, 0 to 3, as hzn_process does, and keeps the
// answer for the epoch; it replaces an earlier one of this head. time_s is the middle of the exposure in seconds
// from any instant that all heads share; NaN: it is not known, and the picture counts as triggered with the others.
//
// Safety:
// rig is null or from hzn_rig_open. The others are as for hzn_process.
int32_t hzn_rig_process(HznRig *rig,
                        uint32_t head,
                        double time_s,
                        HznSensor *sensor,
                        const HznPicture *picture,
                        const HznKnown *known,
                        HznAnswer *out);

// Joins the answers of the heads since the last call and begins the next epoch. Returns 0 and the direction in out;
// 1 if no head has an answer; 6 if the heads contradict each other or do not determine a direction.
//
// Safety:
// rig is null or from hzn_rig_open. out is null or writable.
int32_t hzn_rig_join(HznRig *rig,
                     HznRigAnswer *out);

// Finds the limb in a picture that comes row by row. next_row writes the next row, width bytes, and returns 0; any
// other number ends the picture, and hzn_process_rows returns HZN_ROWS_ENDED. context can take the number, which
// would look like a status here. The threshold must be fixed, or that of the picture before.
//
// Safety:
// sensor is null or from hzn_open. memory is null or has bytes writable bytes, which have no other use during
// the call. known is null (nothing is known) or readable. out is null or writable. next_row writes width
// bytes.
int32_t hzn_process_rows(HznSensor *sensor,
                         uint8_t *memory,
                         size_t bytes,
                         int32_t (*next_row)(void *context, uint8_t *row, size_t width),
                         void *context,
                         const HznKnown *known,
                         HznAnswer *out);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HZN_H */
