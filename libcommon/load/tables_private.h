/* Within load/: the layout of tables in EXR, shared by writing and reading. */
#ifndef VOL_LOAD_TABLES_PRIVATE_H
#define VOL_LOAD_TABLES_PRIVATE_H

#include "load/tables.h"

#define VOL_TABLES_VERSION 1
#define VOL_TABLES_OUT_OF_BAND (-1.0f) /* no opacity */

/* One channel: its name, and where it lies in an entry of the full table or among the numbers of a 1D part. */
typedef struct VolPlane {
    char name[16];
    size_t offset;
} VolPlane;

enum { VOL_MOST_PLANES = 32 };

/* The number of planes; `channels` 1 or 3. */
size_t vol_planes_full(int channels, VolPlane planes[VOL_MOST_PLANES]);
size_t vol_planes_tf(int channels, VolPlane planes[VOL_MOST_PLANES]);        /* offsets: doubles in VolTfSample */
size_t vol_planes_integrals(int channels, VolPlane planes[VOL_MOST_PLANES]); /* doubles in VolTfIntegral */

/* "full", "full@2", "full@4", ... */
void vol_octave_name(size_t octave, char name[32]);

void vol_json_digest(const char *json, char hex[33]);

#endif
