/* Sends the sample a picture with a limb and one of the wrong size, and checks what comes back. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "../hzn_app.h"
#include "picture.h"

static HZN_APP_Picture_t messages[2];
static int sent, events, answers, good;

bool CFE_ES_RunLoop(uint32 *run) {
    return *run == CFE_ES_RunStatus_APP_RUN && sent < 2;
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
    *buffer = (CFE_SB_Buffer_t *)&messages[sent++];
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *message, bool increment) {
    const HZN_APP_Answer_t *answer = (const HZN_APP_Answer_t *)message;
    (void)increment;
    answers++;
    printf("answer: status %d, axis %.4f %.4f %.4f, %u inliers\n", (int)answer->status, answer->axis[0], answer->axis[1],
           answer->axis[2], (unsigned)answer->inliers);
    good += answer->status == 0 ? fabsf(answer->axis[1] - LIMB_SIN) < 0.002f : answer->status == -5 && isnan(answer->axis[0]);
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
CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *message, CFE_MSG_Size_t *size) {
    *size = message->size;
    return CFE_SUCCESS;
}

int main(void) {
    draw_picture();
    for (int i = 0; i < 2; i++) {
        CFE_MSG_Init(CFE_MSG_PTR(messages[i].header), HZN_APP_PICTURE_MID, sizeof messages[i]);
        messages[i].pixels = picture;
        messages[i].bytes = sizeof picture;
        messages[i].width = i == 0 ? PICTURE_WIDTH : 100;
        messages[i].height = PICTURE_HEIGHT;
        messages[i].altitude_m = NAN;
    }
    HZN_APP_Main();
    return answers == 2 && good == 2 && events == 2 ? 0 : 1;
}
