/* The formats that are read, one row each. */
#ifndef VOL_IMPORT_FORMATS_H
#define VOL_IMPORT_FORMATS_H

#include "import/readers.h"

typedef struct VolFormat {
    const char *name;
    bool (*is)(const VolBytes *bytes);
    VolStatus (*read)(const VolSource *source, VolSampled *out, VolError *err);
    bool named; /* the file gives its arrays names */
} VolFormat;

/* By the first of bytes that are not packed; NULL: none. */
const VolFormat *vol_format_of(const VolBytes *bytes);

#endif
