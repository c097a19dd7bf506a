/* A cFS application with the horizon sensor: a picture comes as a message with a pointer, the answer goes out as telemetry.
   Commands do nothing (NOOP) or set the counters to zero; housekeeping is sent when the scheduler asks for it. */
#ifndef HZN_APP_H
#define HZN_APP_H

#include "cfe.h"

/* Message IDs of this mission; take them from its own table. */
#define HZN_APP_CMD_MID 0x18C0
#define HZN_APP_PICTURE_MID 0x18C1
#define HZN_APP_SEND_HK_MID 0x18C2
#define HZN_APP_HK_MID 0x08C0
#define HZN_APP_ANSWER_MID 0x08C1

/* Function codes of HZN_APP_CMD_MID. Neither has arguments. */
#define HZN_APP_NOOP_CC 0
#define HZN_APP_RESET_COUNTERS_CC 1

/* Numbers of events. */
#define HZN_APP_INIT_EID 1
#define HZN_APP_ERROR_EID 2
#define HZN_APP_NOOP_EID 3
#define HZN_APP_RESET_EID 4
#define HZN_APP_COMMAND_EID 5

/* A picture in memory that its sender does not change until the answer comes. */
typedef struct {
    CFE_MSG_CommandHeader_t header;
    const uint8 *pixels;
    uint32 bytes;
    uint32 width;
    uint32 height;
    /* NaN: not known. */
    float altitude_m;
} HZN_APP_Picture_t;

/* A message without arguments. */
typedef struct {
    CFE_MSG_CommandHeader_t header;
} HZN_APP_NoArgs_t;

/* The answer. Without a direction (status not 0) the numbers are NaN. */
typedef struct {
    CFE_MSG_TelemetryHeader_t header;
    int32 status;
    float axis[3];
    float cov_rad2[6];
    float rms_px;
    uint32 inliers;
    float p_limb;
    float protection_rad;
} HZN_APP_Answer_t;

/* Housekeeping. */
typedef struct {
    CFE_MSG_TelemetryHeader_t header;
    uint8 commands;
    uint8 rejected;
    uint8 spare[2];
    /* Pictures, answers to them, and pictures that were refused with an error. */
    uint32 pictures;
    uint32 answers;
    uint32 refused;
    int32 last_status;
} HZN_APP_Housekeeping_t;

void HZN_APP_Main(void);

#endif
