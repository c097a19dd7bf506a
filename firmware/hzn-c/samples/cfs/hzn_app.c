/* See hzn_app.h. The stack of the task needs 48 KiB; the sensor is in static memory. */
#include "hzn_app.h"

#include <math.h>
#include <string.h>

#include "hzn.h"
#include "hzn_parameters.h"

static _Alignas(HZN_WORKSPACE_ALIGN) uint8 memory[HZN_WORKSPACE_SIZE];
static HznSensor *sensor;
static CFE_SB_PipeId_t pipe;
static HZN_APP_Answer_t answer_message;

/* The camera of this mission; a table of the cFS could hold it. */
static const struct {
    uint16_t number;
    double value;
} PARAMETERS[] = {
    { HZN_CAMERA_WIDTH, 320 },    { HZN_CAMERA_HEIGHT, 240 },  { HZN_CAMERA_FX_PX, 300 },
    { HZN_CAMERA_FY_PX, 300 },    { HZN_CAMERA_CX_PX, 159.5 }, { HZN_CAMERA_CY_PX, 119.5 },
    { HZN_BODY_ALTITUDE_KM, 400 },
};

static int32 make_sensor(void) {
    int32_t code = hzn_open(memory, sizeof memory, HZN_INTERFACE, &sensor);
    for (size_t i = 0; code == 0 && i < sizeof PARAMETERS / sizeof *PARAMETERS; i++) {
        code = hzn_set(sensor, PARAMETERS[i].number, PARAMETERS[i].value);
    }
    if (code == 0) {
        code = hzn_apply(sensor);
    }
    if (code != 0) {
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: error %d, parameter %u", (int)code,
                          (unsigned)hzn_refused(sensor));
    }
    return code;
}

static CFE_Status_t start(void) {
    CFE_Status_t status = CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
    if (status == CFE_SUCCESS) {
        status = CFE_SB_CreatePipe(&pipe, 4, "HZN_PIPE");
    }
    if (status == CFE_SUCCESS) {
        status = CFE_SB_Subscribe(HZN_APP_PICTURE_MID, pipe);
    }
    if (status == CFE_SUCCESS) {
        status = CFE_MSG_Init(CFE_MSG_PTR(answer_message.header), HZN_APP_ANSWER_MID, sizeof answer_message);
    }
    if (status == CFE_SUCCESS && make_sensor() != 0) {
        status = CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
    }
    if (status == CFE_SUCCESS) {
        CFE_EVS_SendEvent(HZN_APP_INIT_EID, CFE_EVS_EventType_INFORMATION, "HZN: version %06x", (unsigned)hzn_version());
    }
    return status;
}

static void process(const HZN_APP_Picture_t *message) {
    const HznPicture picture = { message->pixels, message->bytes, message->width, message->height, message->width };
    const HznKnown known = {
        .altitude_m = message->altitude_m,
        .position_m = { NAN, NAN, NAN },
        .rate_rad_s = { NAN, NAN, NAN },
    };
    HznAnswer answer;
    answer_message.status = hzn_process(sensor, &picture, &known, &answer);
    if (answer_message.status < 0) {
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: picture refused, error %d",
                          (int)answer_message.status);
    }
    /* After an error the answer is cleared, so that no older direction is sent. */
    memcpy(answer_message.axis, answer.axis, sizeof answer.axis);
    memcpy(answer_message.cov_rad2, answer.cov_rad2, sizeof answer.cov_rad2);
    answer_message.rms_px = answer.rms_px;
    answer_message.inliers = answer.inliers;
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(answer_message.header));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(answer_message.header), true);
}

void HZN_APP_Main(void) {
    uint32 run = CFE_ES_RunStatus_APP_RUN;
    if (start() != CFE_SUCCESS) {
        run = CFE_ES_RunStatus_APP_ERROR;
    }
    while (CFE_ES_RunLoop(&run)) {
        CFE_SB_Buffer_t *buffer = NULL;
        CFE_SB_MsgId_t id = CFE_SB_INVALID_MSG_ID;
        CFE_MSG_Size_t size = 0;
        if (CFE_SB_ReceiveBuffer(&buffer, pipe, CFE_SB_PEND_FOREVER) != CFE_SUCCESS) {
            continue;
        }
        CFE_MSG_GetMsgId(&buffer->Msg, &id);
        CFE_MSG_GetSize(&buffer->Msg, &size);
        if (CFE_SB_MsgIdToValue(id) == CFE_SB_MsgIdToValue(HZN_APP_PICTURE_MID) && size == sizeof(HZN_APP_Picture_t)) {
            process((const HZN_APP_Picture_t *)buffer);
        }
    }
    CFE_ES_ExitApp(run);
}
