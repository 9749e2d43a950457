/* Light that was solved before, taken from the VDB that it was written to. */
#ifndef VOL_LOAD_REUSE_H
#define VOL_LOAD_REUSE_H

#include "io/vdb.h"

/* Looks for a grid light.K.PART (any K; `part`: "direct") that says of itself all that `wanted` says in light:method,
 * light:spec, light:clip, light:options, light:volume and light:tf, none of which may be missing.  If there is one it goes
 * into the writer as `name`, with the metadata `wanted` and its own domain: the bytes that solving anew would give. */
VolStatus vol_reuse_light(const VolVdb *lit, const char *part, const VolVdbMetaList *wanted, const char *name,
                          VolVdbWriter *writer, bool *found, VolError *err);

#endif
