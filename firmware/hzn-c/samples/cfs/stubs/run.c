/* Sends the sample pictures, commands and tables of parameters, good ones and bad ones, and checks what comes back.

   The application is included, so that bits of its memory can be changed. */
#include "../hzn_app.c"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "cfe_tbl_filedef.h"
#include "hzn_parameters.h"
#include "picture.h"

/* The table that the build of the cFS makes a file of, and its description. */
extern HZN_APP_Table_t Parameters;
extern CFE_TBL_FileDef_t CFE_TBL_FileDef;

/* A message of any kind. */
typedef union {
    CFE_SB_Buffer_t buffer;
    HZN_APP_Picture_t picture;
    HZN_APP_NoArgs_t no_args;
} Message;

enum { MESSAGES = 32, REPORTS = 4 };
static Message messages[MESSAGES];
static int added, sent, answers, good, reported, started_measuring, stopped_measuring;
static uint32 ended_with;
/* Events by their numbers; 0 is the system log. */
static int events[HZN_APP_PIPE_EID + 1];
static HZN_APP_Housekeeping_t reports[REPORTS];
/* The table that the ground loads, and whether the application has not read it yet. */
static HZN_APP_Table_t loaded;
static bool is_loaded, is_new;
static bool is_filtered;

bool CFE_ES_RunLoop(uint32 *run) {
    return *run == CFE_ES_RunStatus_APP_RUN;
}
void CFE_ES_ExitApp(uint32 run) {
    ended_with = run;
}
void CFE_ES_PerfLogAdd(uint32 marker, uint32 is_exit) {
    (void)marker;
    *(is_exit ? &stopped_measuring : &started_measuring) += 1;
}
CFE_Status_t CFE_ES_WriteToSysLog(const char *format, ...) {
    va_list list;
    va_start(list, format);
    printf("system log: ");
    vprintf(format, list);
    va_end(list);
    events[0]++;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_EVS_Register(const void *filters, uint16 count, uint16 scheme) {
    const CFE_EVS_BinFilter_t *filter = filters;
    (void)scheme;
    is_filtered = count == 1 && filter->EventID == HZN_APP_PICTURE_EID && filter->Mask == CFE_EVS_FIRST_16_STOP;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_EVS_ResetAllFilters(void) {
    return CFE_SUCCESS;
}
CFE_Status_t CFE_EVS_SendEvent(uint16 id, uint16 type, const char *format, ...) {
    va_list list;
    va_start(list, format);
    printf("event %u (type %u): ", id, type);
    vprintf(format, list);
    printf("\n");
    va_end(list);
    events[id]++;
    return CFE_SUCCESS;
}
int32 CFE_PSP_MemValidateRange(cpuaddr address, size_t size, uint32 type) {
    (void)type;
    /* This computer has memory at the picture alone. */
    return address >= (cpuaddr)picture && address + size <= (cpuaddr)(picture + sizeof picture)
               ? CFE_PSP_SUCCESS
               : CFE_PSP_INVALID_MEM_ADDR;
}
CFE_Status_t CFE_SB_CreatePipe(CFE_SB_PipeId_t *pipe, uint16 depth, const char *name) {
    (void)depth, (void)name;
    *pipe = 1;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_Subscribe(CFE_SB_MsgId_t id, CFE_SB_PipeId_t pipe) {
    (void)id, (void)pipe;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *handle, const char *name, size_t size, uint16 options,
                              CFE_TBL_CallbackFuncPtr_t validate) {
    (void)options, (void)validate;
    *handle = 1;
    /* The name in the file is that of the application in the startup line, and that of the table. */
    return strcmp(name, strchr(CFE_TBL_FileDef.TableName, '.') + 1) == 0 && size == CFE_TBL_FileDef.ObjectSize
               ? CFE_SUCCESS
               : CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
}
CFE_Status_t CFE_TBL_Load(CFE_TBL_Handle_t handle, int source, const void *data) {
    const char *file = strrchr(data, '/');
    (void)handle, (void)source;
    return is_loaded && strcmp(file + 1, CFE_TBL_FileDef.TgtFilename) == 0 ? CFE_SUCCESS : CFE_TBL_ERR_FILE_NOT_FOUND;
}
CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t handle) {
    (void)handle;
    return is_new ? CFE_TBL_INFO_UPDATED : CFE_SUCCESS;
}
CFE_Status_t CFE_TBL_GetAddress(void **address, CFE_TBL_Handle_t handle) {
    (void)handle;
    *address = &loaded;
    return is_new ? CFE_TBL_INFO_UPDATED : CFE_SUCCESS;
}
CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t handle) {
    (void)handle;
    is_new = false;
    return CFE_SUCCESS;
}
/* Puts a parameter into the table that the ground loads next. */
static void load(size_t i, uint32 number, double value) {
    loaded.parameters[i].number = number;
    loaded.parameters[i].value = value;
    is_new = true;
}

CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **buffer, CFE_SB_PipeId_t pipe, int32 timeout) {
    (void)pipe, (void)timeout;
    if (sent == added) {
        return CFE_SB_PIPE_RD_ERR;
    }
    *buffer = &messages[sent++].buffer;
    /* Before the last pictures, a bit changes, once with a table that was refused and once without. */
    if ((*buffer)->Msg.code == 77) {
        memory[1000] ^= 4;
    }
    if ((*buffer)->Msg.code == 78) {
        load(0, HZN_CAMERA_WIDTH, -1);
    }
    if ((*buffer)->Msg.code == 79) {
        load(0, HZN_CAMERA_WIDTH, PICTURE_WIDTH);
    }
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *message, bool increment) {
    (void)increment;
    if (message->id == HZN_APP_HK_MID) {
        reports[reported++ % REPORTS] = *(const HZN_APP_Housekeeping_t *)message;
    } else {
        const HZN_APP_Answer_t *answer = (const HZN_APP_Answer_t *)message;
        answers++;
        printf("answer: status %d, axis %.4f %.4f %.4f, %u inliers\n", (int)answer->status, answer->axis[0],
               answer->axis[1], answer->axis[2], (unsigned)answer->inliers);
        good += answer->exposure.Seconds == (uint32)answers &&
                (answer->status == HZN_OK ? fabsf(answer->axis[1] - LIMB_SIN) < 0.002f
                                          : answer->status == HZN_PICTURE && isnan(answer->axis[0]));
    }
    return CFE_SUCCESS;
}
void CFE_SB_TimeStampMsg(CFE_MSG_Message_t *message) {
    (void)message;
}
CFE_Status_t CFE_MSG_Init(CFE_MSG_Message_t *message, CFE_SB_MsgId_t id, CFE_MSG_Size_t size) {
    message->id = id.Value;
    message->size = size;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetMsgId(const CFE_MSG_Message_t *message, CFE_SB_MsgId_t *id) {
    id->Value = message->id;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetFcnCode(const CFE_MSG_Message_t *message, CFE_MSG_FcnCode_t *code) {
    *code = message->code;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *message, CFE_MSG_Size_t *size) {
    *size = message->size;
    return CFE_SUCCESS;
}

static void add(uint32 mid, uint16 code, size_t size) {
    CFE_MSG_Init(&messages[added].buffer.Msg, CFE_SB_ValueToMsgId(mid), size);
    messages[added++].buffer.Msg.code = code;
}

static void add_picture(uint32 width, uint16 code) {
    static uint32 pictures;
    HZN_APP_Picture_t *message = &messages[added].picture;
    message->pixels = picture;
    message->bytes = sizeof picture;
    message->width = width;
    message->height = PICTURE_HEIGHT;
    message->altitude_m = (float)NAN;
    message->exposure.Seconds = ++pictures;
    add(HZN_APP_PICTURE_MID, code, sizeof *message);
}

static void add_messages(void) {
    const size_t size = sizeof(HZN_APP_NoArgs_t);
    draw_picture();
    add_picture(PICTURE_WIDTH, 0);
    add_picture(100, 0);
    add(HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size);
    add(HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size + 1);
    add(HZN_APP_CMD_MID, 99, size);
    add(0x1FFF, 0, size);
    /* A picture whose pixels are nowhere. */
    add(HZN_APP_PICTURE_MID, 0, sizeof(HZN_APP_Picture_t));
    add(HZN_APP_SEND_HK_MID, 0, size);
    add(HZN_APP_CMD_MID, HZN_APP_RESET_COUNTERS_CC, size);
    /* A table that is refused comes after this report, and the next one says it. */
    add(HZN_APP_SEND_HK_MID, 78, size);
    add_picture(PICTURE_WIDTH, 77);
    add(HZN_APP_SEND_HK_MID, 79, size);
    add_picture(PICTURE_WIDTH, 77);
    add(HZN_APP_SEND_HK_MID, 0, size);
}

int main(void) {
    const HZN_APP_Housekeeping_t *first = &reports[0], *second = &reports[1], *third = &reports[2], *last = &reports[3];
    HZN_APP_Main();
    /* Without its table the application does not start. */
    if (ended_with != CFE_ES_RunStatus_APP_ERROR || events[0] != 1 || events[HZN_APP_INIT_EID] != 0) {
        return 1;
    }
    loaded = Parameters;
    is_loaded = true;
    add_messages();
    HZN_APP_Main();
    /* The end of the messages is an error of the pipe, and ends the application. */
    if (answers != 4 || good != 4 || reported != 4 || events[HZN_APP_PIPE_EID] != 1 ||
        ended_with != CFE_ES_RunStatus_APP_ERROR || started_measuring != stopped_measuring || !is_filtered) {
        return 2;
    }
    if (events[HZN_APP_INIT_EID] != 1 || events[HZN_APP_NOOP_EID] != 1 || events[HZN_APP_RESET_EID] != 1 ||
        events[HZN_APP_COMMAND_EID] != 4 || events[HZN_APP_PICTURE_EID] != 1 || events[HZN_APP_REOPENED_EID] != 2 ||
        events[HZN_APP_PARAMETERS_EID] != 1 || events[HZN_APP_ERROR_EID] != 1) {
        return 3;
    }
    if (first->pictures != 2 || first->answers != 1 || first->refused != 1 || first->last_status != HZN_PICTURE ||
        first->commands != 1 || first->rejected != 4) {
        return 4;
    }
    if (second->pictures != 0 || second->commands != 0 || second->rejected != 0) {
        return 5;
    }
    if (third->parameters_status != HZN_REFUSED || third->refused_parameter != HZN_CAMERA_WIDTH ||
        third->reopened != 1 || third->answers != 1) {
        return 6;
    }
    return last->parameters_status == HZN_OK && last->refused_parameter == 0 && last->reopened == 2 ? 0 : 7;
}
