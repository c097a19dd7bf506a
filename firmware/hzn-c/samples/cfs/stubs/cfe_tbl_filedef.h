/* The description of a table, with the lengths of the cFE: a text that is too long does not compile; see cfe.h. */
#ifndef CFE_TBL_FILEDEF_H
#define CFE_TBL_FILEDEF_H

#include "common_types.h"

typedef struct {
    char ObjectName[64];
    char TableName[40];
    char Description[32];
    char TgtFilename[20];
    uint32 ObjectSize;
} CFE_TBL_FileDef_t;

#define CFE_TBL_FILEDEF(object, table, description, file) \
    CFE_TBL_FileDef_t CFE_TBL_FileDef = { #object "\0", #table "\0", #description "\0", #file "\0", sizeof(object) };

#endif
