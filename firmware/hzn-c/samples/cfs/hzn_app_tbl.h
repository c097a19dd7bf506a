/* The table of the parameters of the sensor. */
#ifndef HZN_APP_TBL_H
#define HZN_APP_TBL_H

#include "common_types.h"

/* Name of the table in the application, and the file that is loaded at the start. */
#define HZN_APP_TABLE "Parameters"
#define HZN_APP_TABLE_FILE "/cf/hzn_app_tbl.tbl"

/* Largest number of parameters in the table. */
#define HZN_APP_PARAMETERS 32

/* A parameter of hzn_parameters.h. The number 0 ends the table. */
typedef struct {
    uint32 number;
    uint32 spare;
    double value;
} HZN_APP_Parameter_t;

typedef struct {
    HZN_APP_Parameter_t parameters[HZN_APP_PARAMETERS];
} HZN_APP_Table_t;

#endif
