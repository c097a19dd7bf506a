/* Just enough of the cFE (version 7) to compile and run the sample without it; see stubs/run.c. */
#ifndef CFE_H
#define CFE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef uint8_t uint8;
typedef uint16_t uint16;
typedef uint32_t uint32;
typedef int32_t int32;
typedef int32 CFE_Status_t;
typedef uint32 CFE_SB_PipeId_t;
typedef size_t CFE_MSG_Size_t;
typedef struct { uint32 Value; } CFE_SB_MsgId_t;
typedef uint16 CFE_MSG_FcnCode_t;
typedef struct { uint32 id; size_t size; uint16 code; } CFE_MSG_Message_t;
typedef struct { CFE_MSG_Message_t Msg; } CFE_MSG_CommandHeader_t;
typedef struct { CFE_MSG_Message_t Msg; } CFE_MSG_TelemetryHeader_t;
typedef union { CFE_MSG_Message_t Msg; uint64_t align; } CFE_SB_Buffer_t;

#define CFE_SUCCESS 0
#define CFE_STATUS_EXTERNAL_RESOURCE_FAIL (-1)
#define CFE_SB_PEND_FOREVER (-1)
#define CFE_SB_INVALID_MSG_ID ((CFE_SB_MsgId_t){ 0 })
#define CFE_SB_ValueToMsgId(value) ((CFE_SB_MsgId_t){ value })
#define CFE_SB_MsgIdToValue(id) ((id).Value)
#define CFE_MSG_PTR(header) (&(header).Msg)
enum { CFE_ES_RunStatus_APP_RUN = 1, CFE_ES_RunStatus_APP_ERROR = 3 };
enum { CFE_EVS_EventFilter_BINARY = 0 };
enum { CFE_EVS_EventType_INFORMATION = 2, CFE_EVS_EventType_ERROR = 3 };

bool CFE_ES_RunLoop(uint32 *run);
void CFE_ES_ExitApp(uint32 run);
CFE_Status_t CFE_EVS_Register(const void *filters, uint16 count, uint16 scheme);
CFE_Status_t CFE_EVS_SendEvent(uint16 id, uint16 type, const char *format, ...);
CFE_Status_t CFE_SB_CreatePipe(CFE_SB_PipeId_t *pipe, uint16 depth, const char *name);
CFE_Status_t CFE_SB_Subscribe(CFE_SB_MsgId_t id, CFE_SB_PipeId_t pipe);
CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **buffer, CFE_SB_PipeId_t pipe, int32 timeout);
CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *message, bool increment);
void CFE_SB_TimeStampMsg(CFE_MSG_Message_t *message);
CFE_Status_t CFE_MSG_Init(CFE_MSG_Message_t *message, CFE_SB_MsgId_t id, CFE_MSG_Size_t size);
CFE_Status_t CFE_MSG_GetMsgId(const CFE_MSG_Message_t *message, CFE_SB_MsgId_t *id);
CFE_Status_t CFE_MSG_GetFcnCode(const CFE_MSG_Message_t *message, CFE_MSG_FcnCode_t *code);
CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *message, CFE_MSG_Size_t *size);

#endif
