/* See hzn_app.h. The sensor is in static memory; cfe_es_startup_line.scr has the stack that the task needs. */
#include "hzn_app.h"

#include <string.h>

#include "hzn.h"

/* C99 has no keyword for the alignment of a variable, so the sensor begins at the first aligned byte. */
static uint8 memory[HZN_WORKSPACE_SIZE + HZN_WORKSPACE_ALIGN - 1];
static HznSensor *sensor;
static CFE_SB_PipeId_t command_pipe;
static CFE_TBL_Handle_t table;
/* The last table that was not refused. */
static HZN_APP_Table_t in_use;
static HZN_APP_Answer_t answer_message;
static HZN_APP_Housekeeping_t housekeeping;

/* Puts parameters into use. If one is refused, the sensor keeps those that it has. */
static int32 set_parameters(const HZN_APP_Table_t *from) {
    int32 code = HZN_OK;
    size_t i;
    for (i = 0; code == HZN_OK && i < HZN_APP_PARAMETERS && from->parameters[i].number != 0; i++) {
        const HZN_APP_Parameter_t *one = &from->parameters[i];
        code = one->number > UINT16_MAX ? HZN_UNKNOWN_PARAMETER : hzn_set(sensor, (uint16)one->number, one->value);
    }
    if (code == HZN_OK) {
        code = hzn_apply(sensor);
    }
    if (code != HZN_OK) {
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: error %d, parameter %u", (int)code,
                          (unsigned)hzn_refused(sensor));
    }
    return code;
}

/* Takes the parameters from the table. */
static CFE_Status_t read_table(void) {
    void *address = NULL;
    CFE_Status_t status = CFE_TBL_GetAddress(&address, table);
    if (status != CFE_SUCCESS && status != CFE_TBL_INFO_UPDATED) {
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: no table, status 0x%08x", (unsigned)status);
        return status;
    }
    housekeeping.parameters_status = set_parameters((const HZN_APP_Table_t *)address);
    housekeeping.refused_parameter = hzn_refused(sensor);
    if (housekeeping.parameters_status == HZN_OK) {
        in_use = *(const HZN_APP_Table_t *)address;
    }
    CFE_TBL_ReleaseAddress(table);
    return housekeeping.parameters_status == HZN_OK ? CFE_SUCCESS : CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
}

/* Opens the sensor, with the defaults of all parameters. */
static int32 open_sensor(void) {
    const size_t after = (uintptr_t)memory % HZN_WORKSPACE_ALIGN;
    uint8 *aligned = after == 0 ? memory : memory + (HZN_WORKSPACE_ALIGN - after);
    const int32 code = hzn_open(aligned, HZN_WORKSPACE_SIZE, HZN_INTERFACE, &sensor);
    if (code != HZN_OK) {
        CFE_EVS_SendEvent(HZN_APP_ERROR_EID, CFE_EVS_EventType_ERROR, "HZN: not opened, error %d", (int)code);
    }
    return code;
}

/* Lets the cFE load a new table, if the ground has sent one. */
static void manage_table(void) {
    if (CFE_TBL_Manage(table) == CFE_TBL_INFO_UPDATED && read_table() == CFE_SUCCESS) {
        CFE_EVS_SendEvent(HZN_APP_PARAMETERS_EID, CFE_EVS_EventType_INFORMATION, "HZN: new parameters");
    }
}

static CFE_Status_t subscribe(void) {
    const uint32 mids[] = { HZN_APP_CMD_MID, HZN_APP_PICTURE_MID, HZN_APP_SEND_HK_MID };
    CFE_Status_t status = CFE_SUCCESS;
    size_t i;
    for (i = 0; status == CFE_SUCCESS && i < sizeof mids / sizeof *mids; i++) {
        status = CFE_SB_Subscribe(CFE_SB_ValueToMsgId(mids[i]), command_pipe);
    }
    return status;
}

static CFE_Status_t load_table(void) {
    CFE_Status_t status =
        CFE_TBL_Register(&table, HZN_APP_TABLE, sizeof(HZN_APP_Table_t), CFE_TBL_OPT_DEFAULT, NULL);
    if (status == CFE_SUCCESS) {
        status = CFE_TBL_Load(table, CFE_TBL_SRC_FILE, HZN_APP_TABLE_FILE);
    }
    return status;
}

static CFE_Status_t start(void) {
    CFE_EVS_BinFilter_t filters[] = { { HZN_APP_PICTURE_EID, CFE_EVS_FIRST_16_STOP } };
    CFE_Status_t status = CFE_EVS_Register(filters, sizeof filters / sizeof *filters, CFE_EVS_EventFilter_BINARY);
    if (status == CFE_SUCCESS) {
        status = CFE_SB_CreatePipe(&command_pipe, HZN_APP_PIPE_DEPTH, "HZN_PIPE");
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
    if (status == CFE_SUCCESS) {
        status = load_table();
    }
    if (status == CFE_SUCCESS) {
        status = open_sensor() == HZN_OK ? read_table() : CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
    }
    if (status == CFE_SUCCESS) {
        CFE_EVS_SendEvent(HZN_APP_INIT_EID, CFE_EVS_EventType_INFORMATION, "HZN: started, version %06x",
                          (unsigned)hzn_version());
    } else {
        /* The system log works without the services that may have failed. */
        CFE_ES_WriteToSysLog("HZN: start failed, status 0x%08x\n", (unsigned)status);
    }
    return status;
}

/* Finds the limb. A sensor whose memory has changed is opened again, and gets the picture once more. */
static int32 find(const HznPicture *picture, const HznKnown *known, HznAnswer *answer) {
    int32 status = hzn_process(sensor, picture, known, answer);
    if (status == HZN_NOT_OPEN || sensor == NULL) {
        housekeeping.reopened++;
        CFE_EVS_SendEvent(HZN_APP_REOPENED_EID, CFE_EVS_EventType_ERROR, "HZN: memory has changed, opened again");
        if (open_sensor() == HZN_OK && set_parameters(&in_use) == HZN_OK) {
            status = hzn_process(sensor, picture, known, answer);
        } else {
            /* Without its parameters, the sensor would give directions for another camera. */
            sensor = NULL;
        }
    }
    return status;
}

/* Returns whether the pixels are in the memory of this computer. */
static bool is_readable(const HZN_APP_Picture_t *message) {
    return CFE_PSP_MemValidateRange((cpuaddr)message->pixels, message->bytes, CFE_PSP_MEM_ANY) == CFE_PSP_SUCCESS;
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
    housekeeping.last_status = find(&picture, &known, &answer);
    housekeeping.pictures++;
    housekeeping.answers += housekeeping.last_status == HZN_OK;
    if (housekeeping.last_status < 0) {
        housekeeping.refused++;
        CFE_EVS_SendEvent(HZN_APP_PICTURE_EID, CFE_EVS_EventType_ERROR, "HZN: picture refused, error %d",
                          (int)housekeeping.last_status);
    }
    /* After an error the answer is cleared, so that no older direction is sent. */
    answer_message.exposure = message->exposure;
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
    manage_table();
}

static void reset_counters(void) {
    housekeeping.commands = 0;
    housekeeping.rejected = 0;
    housekeeping.reopened = 0;
    housekeeping.pictures = 0;
    housekeeping.answers = 0;
    housekeeping.refused = 0;
    /* Refused pictures are events again. */
    CFE_EVS_ResetAllFilters();
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
    } else if (mid == HZN_APP_PICTURE_MID && size == sizeof(HZN_APP_Picture_t) &&
               is_readable((const HZN_APP_Picture_t *)buffer)) {
        process((const HZN_APP_Picture_t *)buffer);
    } else {
        reject(mid, 0, (unsigned)size);
    }
}

void HZN_APP_Main(void) {
    uint32 run = CFE_ES_RunStatus_APP_RUN;
    CFE_ES_PerfLogEntry(HZN_APP_PERF_ID);
    if (start() != CFE_SUCCESS) {
        run = CFE_ES_RunStatus_APP_ERROR;
    }
    while (CFE_ES_RunLoop(&run)) {
        CFE_SB_Buffer_t *buffer = NULL;
        CFE_Status_t status;
        CFE_ES_PerfLogExit(HZN_APP_PERF_ID);
        status = CFE_SB_ReceiveBuffer(&buffer, command_pipe, CFE_SB_PEND_FOREVER);
        CFE_ES_PerfLogEntry(HZN_APP_PERF_ID);
        if (status == CFE_SUCCESS) {
            take(buffer);
        } else {
            /* Without an end, this loop would take all the time of the tasks below. */
            CFE_EVS_SendEvent(HZN_APP_PIPE_EID, CFE_EVS_EventType_ERROR, "HZN: no messages, status 0x%08x; the end",
                              (unsigned)status);
            run = CFE_ES_RunStatus_APP_ERROR;
        }
    }
    CFE_ES_PerfLogExit(HZN_APP_PERF_ID);
    CFE_ES_ExitApp(run);
}
