/* See hzn_app.h. The stack of the task needs 56 KiB; the sensor is in static memory. */
#include "hzn_app.h"

#include <string.h>

#include "hzn.h"
#include "hzn_parameters.h"

/* C99 has no keyword for the alignment of a variable, so the sensor begins at the first aligned byte. */
static uint8 memory[HZN_WORKSPACE_SIZE + HZN_WORKSPACE_ALIGN - 1];
static HznSensor *sensor;
static CFE_SB_PipeId_t command_pipe;
static HZN_APP_Answer_t answer_message;
static HZN_APP_Housekeeping_t housekeeping;

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
    const size_t after = (uintptr_t)memory % HZN_WORKSPACE_ALIGN;
    uint8 *aligned = after == 0 ? memory : memory + (HZN_WORKSPACE_ALIGN - after);
    int32 code = hzn_open(aligned, HZN_WORKSPACE_SIZE, HZN_INTERFACE, &sensor);
    size_t i;
    for (i = 0; code == 0 && i < sizeof PARAMETERS / sizeof *PARAMETERS; i++) {
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

static CFE_Status_t subscribe(void) {
    static const uint32 MIDS[] = { HZN_APP_CMD_MID, HZN_APP_PICTURE_MID, HZN_APP_SEND_HK_MID };
    CFE_Status_t status = CFE_SUCCESS;
    size_t i;
    for (i = 0; status == CFE_SUCCESS && i < sizeof MIDS / sizeof *MIDS; i++) {
        status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(MIDS[i]), command_pipe);
    }
    return status;
}

static CFE_Status_t start(void) {
    CFE_Status_t status = CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
    if (status == CFE_SUCCESS) {
        status = CFE_SB_CreatePipe(&command_pipe, 4, "HZN_PIPE");
    }
    if (status == CFE_SUCCESS) {
        status = subscribe();
    }
    if (status == CFE_SUCCESS) {
        status = CFE_MSG_Init(CFE_MSG_PTR(answer_message.header), CFE_SB_ValueToMsgId(HZN_APP_ANSWER_MID),
                              sizeof answer_message);
    }
    if (status == CFE_SUCCESS) {
        status = CFE_MSG_Init(CFE_MSG_PTR(housekeeping.header), CFE_SB_ValueToMsgId(HZN_APP_HK_MID),
                              sizeof housekeeping);
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
    HznPicture picture;
    HznKnown known;
    HznAnswer answer;
    picture.pixels = message->pixels;
    picture.bytes = message->bytes;
    picture.width = message->width;
    picture.height = message->height;
    picture.stride = message->width;
    hzn_nothing_known(&known);
    known.altitude_m = message->altitude_m;
    housekeeping.last_status = hzn_process(sensor, &picture, &known, &answer);
    housekeeping.pictures++;
    housekeeping.answers += housekeeping.last_status == HZN_OK;
    if (housekeeping.last_status < 0) {
        housekeeping.refused++;
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: picture refused, error %d",
                          (int)housekeeping.last_status);
    }
    /* After an error the answer is cleared, so that no older direction is sent. */
    answer_message.status = housekeeping.last_status;
    memcpy(answer_message.axis, answer.axis, sizeof answer.axis);
    memcpy(answer_message.cov_rad2, answer.cov_rad2, sizeof answer.cov_rad2);
    answer_message.rms_px = answer.rms_px;
    answer_message.inliers = answer.inliers;
    answer_message.p_limb = answer.p_limb;
    answer_message.protection_rad = answer.protection_rad;
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(answer_message.header));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(answer_message.header), true);
}

static void send_housekeeping(void) {
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(housekeeping.header));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(housekeeping.header), true);
}

static void reset_counters(void) {
    housekeeping.commands = 0;
    housekeeping.rejected = 0;
    housekeeping.pictures = 0;
    housekeeping.answers = 0;
    housekeeping.refused = 0;
}

static void reject(uint32 mid, unsigned code, unsigned size) {
    housekeeping.rejected++;
    CFE_EVS_SendEvent(HZN_APP_COMMAND_EID, CFE_EVS_EventType_ERROR, "HZN: rejected message 0x%x, code %u, %u bytes",
                      (unsigned)mid, code, size);
}

static void carry_out(const CFE_SB_Buffer_t *buffer, CFE_MSG_Size_t size) {
    CFE_MSG_FcnCode_t code = 0;
    CFE_MSG_GetFcnCode(&buffer->Msg, &code);
    if (size != sizeof(HZN_APP_NoArgs_t)) {
        reject(HZN_APP_CMD_MID, (unsigned)code, (unsigned)size);
        return;
    }
    switch (code) {
        case HZN_APP_NOOP_CC:
            housekeeping.commands++;
            CFE_EVS_SendEvent(HZN_APP_NOOP_EID, CFE_EVS_EventType_INFORMATION, "HZN: NOOP, version %06x",
                              (unsigned)hzn_version());
            break;
        case HZN_APP_RESET_COUNTERS_CC:
            /* As in the applications of the cFS, this command itself is not counted. */
            reset_counters();
            CFE_EVS_SendEvent(HZN_APP_RESET_EID, CFE_EVS_EventType_INFORMATION, "HZN: counters reset");
            break;
        default:
            reject(HZN_APP_CMD_MID, (unsigned)code, (unsigned)size);
            break;
    }
}

static void take(const CFE_SB_Buffer_t *buffer) {
    CFE_SB_MsgId_t id = CFE_SB_INVALID_MSG_ID;
    CFE_MSG_Size_t size = 0;
    uint32 mid;
    CFE_MSG_GetMsgId(&buffer->Msg, &id);
    CFE_MSG_GetSize(&buffer->Msg, &size);
    mid = CFE_SB_MsgIdToValue(id);
    if (mid == HZN_APP_CMD_MID) {
        carry_out(buffer, size);
    } else if (mid == HZN_APP_SEND_HK_MID && size == sizeof(HZN_APP_NoArgs_t)) {
        send_housekeeping();
    } else if (mid == HZN_APP_PICTURE_MID && size == sizeof(HZN_APP_Picture_t)) {
        process((const HZN_APP_Picture_t *)buffer);
    } else {
        reject(mid, 0, (unsigned)size);
    }
}

void HZN_APP_Main(void) {
    uint32 run = CFE_ES_RunStatus_APP_RUN;
    if (start() != CFE_SUCCESS) {
        run = CFE_ES_RunStatus_APP_ERROR;
    }
    while (CFE_ES_RunLoop(&run)) {
        CFE_SB_Buffer_t *buffer = NULL;
        if (CFE_SB_ReceiveBuffer(&buffer, command_pipe, CFE_SB_PEND_FOREVER) == CFE_SUCCESS) {
            take(buffer);
        }
    }
    CFE_ES_ExitApp(run);
}
