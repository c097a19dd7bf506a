/* Sends the sample two pictures and commands, good ones and bad ones, and checks what comes back. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "../hzn_app.h"
#include "picture.h"

/* A message of any kind. */
typedef union {
    CFE_SB_Buffer_t buffer;
    HZN_APP_Picture_t picture;
    HZN_APP_NoArgs_t no_args;
} Message;

enum { MESSAGES = 9 };
static Message messages[MESSAGES];
static int sent, events, errors, answers, good;
static HZN_APP_Housekeeping_t reports[2];
static int reported;

bool CFE_ES_RunLoop(uint32 *run) {
    return *run == CFE_ES_RunStatus_APP_RUN && sent < MESSAGES;
}
void CFE_ES_ExitApp(uint32 run) {
    (void)run;
}
CFE_Status_t CFE_EVS_Register(const void *filters, uint16 count, uint16 scheme) {
    (void)filters, (void)count, (void)scheme;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_EVS_SendEvent(uint16 id, uint16 type, const char *format, ...) {
    va_list list;
    va_start(list, format);
    printf("event %u (type %u): ", id, type);
    vprintf(format, list);
    printf("\n");
    va_end(list);
    events++;
    errors += type == CFE_EVS_EventType_ERROR;
    return CFE_SUCCESS;
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
CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **buffer, CFE_SB_PipeId_t pipe, int32 timeout) {
    (void)pipe, (void)timeout;
    *buffer = &messages[sent++].buffer;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *message, bool increment) {
    (void)increment;
    if (message->id == HZN_APP_HK_MID) {
        reports[reported++] = *(const HZN_APP_Housekeeping_t *)message;
    } else {
        const HZN_APP_Answer_t *answer = (const HZN_APP_Answer_t *)message;
        answers++;
        printf("answer: status %d, axis %.4f %.4f %.4f, %u inliers\n", (int)answer->status, answer->axis[0],
               answer->axis[1], answer->axis[2], (unsigned)answer->inliers);
        good += answer->status == 0 ? fabsf(answer->axis[1] - LIMB_SIN) < 0.002f
                                    : answer->status == -5 && isnan(answer->axis[0]);
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

static void add_picture(int i, uint32 width) {
    HZN_APP_Picture_t *message = &messages[i].picture;
    CFE_MSG_Init(CFE_MSG_PTR(message->header), CFE_SB_ValueToMsgId(HZN_APP_PICTURE_MID), sizeof *message);
    message->pixels = picture;
    message->bytes = sizeof picture;
    message->width = width;
    message->height = PICTURE_HEIGHT;
    message->altitude_m = (float)NAN;
}

static void add_command(int i, uint32 mid, uint16 code, size_t size) {
    CFE_MSG_Init(&messages[i].buffer.Msg, CFE_SB_ValueToMsgId(mid), size);
    messages[i].buffer.Msg.code = code;
}

int main(void) {
    const HZN_APP_Housekeeping_t *first = &reports[0], *second = &reports[1];
    const size_t size = sizeof(HZN_APP_NoArgs_t);
    draw_picture();
    add_picture(0, PICTURE_WIDTH);
    add_picture(1, 100);
    add_command(2, HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size);
    add_command(3, HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size + 1);
    add_command(4, HZN_APP_CMD_MID, 99, size);
    add_command(5, 0x1FFF, 0, size);
    add_command(6, HZN_APP_SEND_HK_MID, 0, size);
    add_command(7, HZN_APP_CMD_MID, HZN_APP_RESET_COUNTERS_CC, size);
    add_command(8, HZN_APP_SEND_HK_MID, 0, size);
    HZN_APP_Main();
    /* The start, NOOP and the reset are events without an error; the small picture and three messages are errors. */
    if (answers != 2 || good != 2 || reported != 2 || events != 7 || errors != 4) {
        return 1;
    }
    if (first->pictures != 2 || first->answers != 1 || first->refused != 1 || first->last_status != -5 ||
        first->commands != 1 || first->rejected != 3) {
        return 2;
    }
    return second->pictures == 0 && second->commands == 0 && second->rejected == 0 ? 0 : 3;
}
