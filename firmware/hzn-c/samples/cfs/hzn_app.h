/* A cFS application with the horizon sensor: a picture comes as a message with a pointer, the answer goes out as telemetry. */
#ifndef HZN_APP_H
#define HZN_APP_H

#include "cfe.h"

/* Message IDs of this mission; take them from its own table. */
#define HZN_APP_PICTURE_MID CFE_SB_ValueToMsgId(0x18C1)
#define HZN_APP_ANSWER_MID CFE_SB_ValueToMsgId(0x08C1)

/* Numbers of events. */
#define HZN_APP_INIT_EID 1
#define HZN_APP_ERROR_EID 2

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

/* The answer. Without a direction (status not 0) the numbers are NaN. */
typedef struct {
    CFE_MSG_TelemetryHeader_t header;
    int32 status;
    float axis[3];
    float cov_rad2[6];
    float rms_px;
    uint32 inliers;
} HZN_APP_Answer_t;

void HZN_APP_Main(void);

#endif
