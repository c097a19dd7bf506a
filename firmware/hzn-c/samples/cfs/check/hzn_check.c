/* Tests hzn_app in the cFS: an application that stands for the camera, the ground and the scheduler.

   It sends pictures and commands over the software bus, good ones and bad ones, and compares the answers and the
   housekeeping. The last event is "HZN_CHECK: passed", or what is wrong. Then it resets the processor, which ends the
   cFS on a workstation. Do not fly it. */
#include <math.h>
#include <string.h>

#include "hzn.h"
#include "hzn_app.h"
#include "picture.h"

static CFE_SB_PipeId_t pipe;
static HZN_APP_Answer_t answer;
static HZN_APP_Housekeeping_t housekeeping;

/* A message of any kind. */
typedef union {
    CFE_MSG_Message_t message;
    HZN_APP_Picture_t picture;
    HZN_APP_NoArgs_t no_args;
} Message;

static void send_command(uint32 mid, CFE_MSG_FcnCode_t code, size_t size) {
    static Message command;
    memset(&command, 0, sizeof command);
    CFE_MSG_Init(&command.message, CFE_SB_ValueToMsgId(mid), size);
    CFE_MSG_SetFcnCode(&command.message, code);
    CFE_SB_TransmitMsg(&command.message, true);
}

/* Waits for one message, and keeps it. */
static bool receive(void) {
    CFE_SB_Buffer_t *buffer = NULL;
    CFE_SB_MsgId_t id = CFE_SB_INVALID_MSG_ID;
    if (CFE_SB_ReceiveBuffer(&buffer, pipe, 5000) != CFE_SUCCESS) {
        return false;
    }
    CFE_MSG_GetMsgId(&buffer->Msg, &id);
    if (CFE_SB_MsgIdToValue(id) == HZN_APP_ANSWER_MID) {
        memcpy(&answer, buffer, sizeof answer);
    } else {
        memcpy(&housekeeping, buffer, sizeof housekeeping);
    }
    return true;
}

static bool send_picture(uint32 width, uint32 second) {
    static Message command;
    memset(&command, 0, sizeof command);
    CFE_MSG_Init(&command.message, CFE_SB_ValueToMsgId(HZN_APP_PICTURE_MID), sizeof command.picture);
    command.picture.pixels = picture;
    command.picture.bytes = sizeof picture;
    command.picture.width = width;
    command.picture.height = PICTURE_HEIGHT;
    command.picture.altitude_m = (float)NAN;
    command.picture.exposure.Seconds = second;
    CFE_SB_TransmitMsg(&command.message, true);
    return receive() && answer.exposure.Seconds == second;
}

static bool ask_for_housekeeping(void) {
    send_command(HZN_APP_SEND_HK_MID, 0, sizeof(HZN_APP_NoArgs_t));
    return receive();
}

static bool is_limb(void) {
    return answer.status == HZN_OK && fabs((double)(answer.axis[1] - LIMB_SIN)) < 0.002;
}

/* Noise that a picture of clouds could have, but with more edges: the most work, and the deepest calls. */
static void draw_clouds(void) {
    uint32 state = 1;
    size_t i;
    for (i = 0; i < sizeof picture; i++) {
        state = state * 1664525u + 1013904223u;
        picture[i] = (uint8)((i / 6 + i / PICTURE_WIDTH / 6) % 2 == 0 ? 200 + (state >> 28) : 20 + (state >> 28));
    }
}

static const char *check(void) {
    const size_t size = sizeof(HZN_APP_NoArgs_t);
    draw_picture();
    if (!send_picture(PICTURE_WIDTH, 1) || !is_limb()) {
        return "no limb";
    }
    CFE_EVS_SendEvent(2, CFE_EVS_EventType_INFORMATION, "HZN_CHECK: status %d, axis %.4f %.4f %.4f, %u inliers",
                      (int)answer.status, (double)answer.axis[0], (double)answer.axis[1], (double)answer.axis[2],
                      (unsigned)answer.inliers);
    if (!send_picture(100, 2) || answer.status != HZN_PICTURE || !isnan(answer.axis[0])) {
        return "a picture of another size was not refused";
    }
    draw_clouds();
    if (!send_picture(PICTURE_WIDTH, 3) || answer.status <= HZN_OK) {
        return "a checkerboard has a limb";
    }
    send_command(HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size);
    send_command(HZN_APP_CMD_MID, HZN_APP_NOOP_CC, size + 1);
    send_command(HZN_APP_CMD_MID, 99, size);
    send_command(HZN_APP_PICTURE_MID, 0, size);
    if (!ask_for_housekeeping() || housekeeping.pictures != 3 || housekeeping.answers != 1 ||
        housekeeping.refused != 1 || housekeeping.commands != 1 || housekeeping.rejected != 3) {
        return "housekeeping is wrong";
    }
    CFE_EVS_SendEvent(2, CFE_EVS_EventType_INFORMATION,
                      "HZN_CHECK: housekeeping %u pictures, %u answers, %u refused, %u commands, %u rejected",
                      (unsigned)housekeeping.pictures, (unsigned)housekeeping.answers, (unsigned)housekeeping.refused,
                      (unsigned)housekeeping.commands, (unsigned)housekeeping.rejected);
    send_command(HZN_APP_CMD_MID, HZN_APP_RESET_COUNTERS_CC, size);
    if (!ask_for_housekeeping() || housekeeping.pictures != 0 || housekeeping.commands != 0) {
        return "the counters were not reset";
    }
    draw_picture();
    return send_picture(PICTURE_WIDTH, 4) && is_limb() ? NULL : "no limb after the checkerboard";
}

void HZN_CHECK_Main(void) {
    const char *wrong = "the software bus refuses a call";
    CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY);
    CFE_ES_WaitForSystemState(CFE_ES_SystemState_OPERATIONAL, 10000);
    if (CFE_SB_CreatePipe(&pipe, 10, "HZN_CHECK") == CFE_SUCCESS &&
        CFE_SB_Subscribe(CFE_SB_ValueToMsgId(HZN_APP_ANSWER_MID), pipe) == CFE_SUCCESS &&
        CFE_SB_Subscribe(CFE_SB_ValueToMsgId(HZN_APP_HK_MID), pipe) == CFE_SUCCESS) {
        wrong = check();
    }
    CFE_EVS_SendEvent(1, wrong == NULL ? CFE_EVS_EventType_INFORMATION : CFE_EVS_EventType_ERROR, "HZN_CHECK: %s",
                      wrong == NULL ? "passed" : wrong);
    /* The events are printed by another task. */
    OS_TaskDelay(500);
    CFE_ES_ResetCFE(CFE_PSP_RST_TYPE_POWERON);
}
