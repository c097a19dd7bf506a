/* Just enough of the cFE (version 7) to compile and run the sample without it; see stubs/run.c. */
#ifndef CFE_H
#define CFE_H

#include "common_types.h"

typedef int32 CFE_Status_t;
typedef uint32 CFE_SB_PipeId_t;
typedef int16_t CFE_TBL_Handle_t;
typedef int32 (*CFE_TBL_CallbackFuncPtr_t)(void *table);
typedef struct { uint32 Seconds, Subseconds; } CFE_TIME_SysTime_t;
typedef struct { uint16 EventID, Mask; } CFE_EVS_BinFilter_t;
typedef size_t CFE_MSG_Size_t;
typedef struct { uint32 Value; } CFE_SB_MsgId_t;
typedef uint16 CFE_MSG_FcnCode_t;
typedef struct { uint32 id; size_t size; uint16 code; } CFE_MSG_Message_t;
typedef struct { CFE_MSG_Message_t Msg; } CFE_MSG_CommandHeader_t;
typedef struct { CFE_MSG_Message_t Msg; } CFE_MSG_TelemetryHeader_t;
typedef union { CFE_MSG_Message_t Msg; uint64_t align; } CFE_SB_Buffer_t;

#define CFE_SUCCESS 0
#define CFE_STATUS_EXTERNAL_RESOURCE_FAIL (-1)
#define CFE_SB_PIPE_RD_ERR (-2)
#define CFE_TBL_ERR_FILE_NOT_FOUND (-3)
#define CFE_TBL_INFO_UPDATED 0x4c00000E
#define CFE_PSP_SUCCESS 0
#define CFE_PSP_INVALID_MEM_ADDR (-24)
#define CFE_PSP_MEM_ANY 1
#define CFE_TBL_OPT_DEFAULT 0
#define CFE_EVS_FIRST_16_STOP 0xFFF0
#define CFE_SB_PEND_FOREVER (-1)
#define CFE_SB_INVALID_MSG_ID ((CFE_SB_MsgId_t){ 0 })
#define CFE_SB_ValueToMsgId(value) ((CFE_SB_MsgId_t){ value })
#define CFE_SB_MsgIdToValue(id) ((id).Value)
#define CFE_MSG_PTR(header) (&(header).Msg)
enum { CFE_ES_RunStatus_APP_RUN = 1, CFE_ES_RunStatus_APP_ERROR = 3 };
enum { CFE_EVS_EventFilter_BINARY = 0 };
enum { CFE_EVS_EventType_INFORMATION = 2, CFE_EVS_EventType_ERROR = 3 };
enum { CFE_TBL_SRC_FILE = 0 };

#define CFE_ES_PerfLogEntry(id) CFE_ES_PerfLogAdd(id, 0)
#define CFE_ES_PerfLogExit(id) CFE_ES_PerfLogAdd(id, 1)
void CFE_ES_PerfLogAdd(uint32 marker, uint32 is_exit);
CFE_Status_t CFE_ES_WriteToSysLog(const char *format, ...);
int32 CFE_PSP_MemValidateRange(cpuaddr address, size_t size, uint32 type);
CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *handle, const char *name, size_t size, uint16 options,
                              CFE_TBL_CallbackFuncPtr_t validate);
CFE_Status_t CFE_TBL_Load(CFE_TBL_Handle_t handle, int source, const void *data);
CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t handle);
CFE_Status_t CFE_TBL_GetAddress(void **table, CFE_TBL_Handle_t handle);
CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t handle);
bool CFE_ES_RunLoop(uint32 *run);
void CFE_ES_ExitApp(uint32 run);
CFE_Status_t CFE_EVS_Register(const void *filters, uint16 count, uint16 scheme);
CFE_Status_t CFE_EVS_ResetAllFilters(void);
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
