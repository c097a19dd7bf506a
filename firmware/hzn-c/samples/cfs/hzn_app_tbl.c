/* The parameters at the start: those that the camera of the mission needs. All others have their defaults. */
#include "cfe_tbl_filedef.h"
#include "hzn_app_tbl.h"
#include "hzn_parameters.h"

HZN_APP_Table_t Parameters = { {
    { HZN_CAMERA_WIDTH, 0, 320 },
    { HZN_CAMERA_HEIGHT, 0, 240 },
    { HZN_CAMERA_FX_PX, 0, 300 },
    { HZN_CAMERA_FY_PX, 0, 300 },
    { HZN_CAMERA_CX_PX, 0, 159.5 },
    { HZN_CAMERA_CY_PX, 0, 119.5 },
    { HZN_BODY_ALTITUDE_KM, 0, 400 },
    { 0, 0, 0 },
} };

CFE_TBL_FILEDEF(Parameters, HZN_APP.Parameters, Horizon sensor parameters, hzn_app_tbl.tbl)
