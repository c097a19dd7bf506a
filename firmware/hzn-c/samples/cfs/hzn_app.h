/* A cFS application with the horizon sensor: a picture comes as a message with a pointer, and the answer goes out as
   telemetry. Commands do nothing (NOOP) or set the counters to zero; housekeeping is sent when the scheduler asks for
   it. The parameters of the sensor are a table, which can be loaded in flight. */
#ifndef HZN_APP_H
#define HZN_APP_H

#include "cfe.h"
#include "cfe_core_api_base_msgids.h"
#include "hzn_app_tbl.h"

/* Message IDs. The cFE adds the numbers below (its topics) to the bases of the processor. No application of the bundle
   of NASA has these IDs; CF has 0x08C2. Take numbers that are free in your mission. The ground must not be able to send
   pictures, because they have a pointer: let the command ingest of the mission refuse HZN_APP_PICTURE_MID. */
#define HZN_APP_CMD_MID CFE_PLATFORM_CMD_TOPICID_TO_MIDV(0xC0)
#define HZN_APP_PICTURE_MID CFE_PLATFORM_CMD_TOPICID_TO_MIDV(0xC1)
#define HZN_APP_SEND_HK_MID CFE_PLATFORM_CMD_TOPICID_TO_MIDV(0xC2)
#define HZN_APP_HK_MID CFE_PLATFORM_TLM_TOPICID_TO_MIDV(0xC0)
#define HZN_APP_ANSWER_MID CFE_PLATFORM_TLM_TOPICID_TO_MIDV(0xC1)

/* Number in the performance log, whose time is that from a message to the wait for the next one. */
#define HZN_APP_PERF_ID 92

/* Messages that wait: the pictures share the pipe with the commands. */
#define HZN_APP_PIPE_DEPTH 10

/* Function codes of HZN_APP_CMD_MID. Neither has arguments. */
#define HZN_APP_NOOP_CC 0
#define HZN_APP_RESET_COUNTERS_CC 1

/* Numbers of events. */
#define HZN_APP_INIT_EID 1
/* The sensor could not be opened, or parameters were refused. */
#define HZN_APP_ERROR_EID 2
#define HZN_APP_NOOP_EID 3
#define HZN_APP_RESET_EID 4
/* A message was rejected. */
#define HZN_APP_COMMAND_EID 5
/* A picture was refused. After 16 of these the cFE sends no more until the counters are reset. */
#define HZN_APP_PICTURE_EID 6
/* Bits of the sensor's memory had changed, and it was opened again. */
#define HZN_APP_REOPENED_EID 7
#define HZN_APP_PARAMETERS_EID 8
#define HZN_APP_PIPE_EID 9

/* A picture in memory that its sender does not change until the answer comes. */
typedef struct {
    CFE_MSG_CommandHeader_t header;
    const uint8 *pixels;
    uint32 bytes;
    uint32 width;
    uint32 height;
    /* NaN: not known. */
    float altitude_m;
    /* Middle of the exposure. The application copies it to the answer. */
    CFE_TIME_SysTime_t exposure;
} HZN_APP_Picture_t;

/* A message without arguments. */
typedef struct {
    CFE_MSG_CommandHeader_t header;
} HZN_APP_NoArgs_t;

/* The answer. Without a direction (status not 0) the numbers are NaN. */
typedef struct {
    CFE_MSG_TelemetryHeader_t header;
    CFE_TIME_SysTime_t exposure;
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
    /* Times that the sensor was opened again, because bits of its memory had changed. */
    uint8 reopened;
    uint8 spare;
    /* Pictures, answers to them, and pictures that were refused with an error. */
    uint32 pictures;
    uint32 answers;
    uint32 refused;
    int32 last_status;
    /* 0, or the error with which the last table of parameters was refused, and its parameter. */
    int32 parameters_status;
    uint32 refused_parameter;
} HZN_APP_Housekeeping_t;

void HZN_APP_Main(void);

#endif
