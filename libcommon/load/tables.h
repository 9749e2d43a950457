/* Pre-integration tables as EXR: parts `tf`, `integrals`, `full`, `full@2`, ... of 32-bit floats with the transfer
 * function itself in the header, so that everything else (isosurfaces, shading, exact integrals) follows from one
 * file.  Channels and attributes: pellucid-files(5). */
#ifndef VOL_LOAD_TABLES_H
#define VOL_LOAD_TABLES_H

#include "base/log.h"
#include "io/exr.h"
#include "tf/foreign.h"
#include "tf/preint.h"

typedef struct VolTables {
    char *json;             /* the transfer function's text */
    VolTf tf;
    VolTfCompiled compiled;
    VolPreint preint;       /* refers to `compiled`; no octaves: the file has no full table */
} VolTables;

enum { VOL_TABLES_TF = 1, VOL_TABLES_INTEGRALS = 2, VOL_TABLES_FULL = 4 };

/* `json`: NUL-terminated.  lo = hi = 0 in the options: the default range; step 0: particle_step. */
VolStatus vol_tables_build(const char *json, const char *name, VolPreintOptions options, const VolLog *log,
                           VolTables **out, VolError *err);
void vol_tables_free(VolTables *tables);

/* The parts whose bits are set.  VOL_BAD_INPUT where a number does not fit a float. */
VolStatus vol_tables_to_image(const VolTables *tables, unsigned parts, VolImage *image, VolError *err);

/* VOL_BAD_INPUT: no transfer function in the header or another than the tables were made from, another version, an
 * empty range, parts of different sizes, missing parts, channels or attributes, numbers that are not finite,
 * opacities that are none. */
VolStatus vol_tables_from_image(const VolImage *image, const char *name, const VolLog *log, VolTables **out,
                                VolError *err);

/* A transfer function of any kind: our JSON, other programs' files (`part` names one of several, or NULL), or
 * tables, for which *tables is not NULL and `tf` what they were made from. */
VolStatus vol_load_transfer_function(const VolBytes *bytes, const char *name, const char *part, const VolLog *log,
                                     VolTf *tf, VolTfUnits *units, VolTables **tables, VolError *err);

#endif
