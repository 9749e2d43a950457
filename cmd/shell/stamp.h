/* What every VDB and EXR that we write says of its making. */
#ifndef CMD_SHELL_STAMP_H
#define CMD_SHELL_STAMP_H

#include "cmd/shell/program.h"
#include "io/exr.h"
#include "io/vdb.h"

/* File metadata: vol:history (`prior`, which may be NULL, and this run's line; not with --no-history), vol:argsHash
 * (of the options that matter and the inputs' digests), vol:frame with --frame, and the pairs of --set. */
VolStatus run_stamp_vdb(const Run *run, const char *prior, const uint64_t (*input_digests)[2], size_t inputs,
                        VolVdbMetaList *file_meta, VolError *err);

/* Grid metadata: creator = "PROGRAM VERSION". */
VolStatus run_stamp_grid(const Run *run, VolVdbMetaList *grid_meta, VolError *err);

/* Attributes of every part: Software, vol:history, vol:argsHash, imageCounter with --frame, and the pairs of --set. */
VolStatus run_stamp_exr(const Run *run, const char *prior, const uint64_t (*input_digests)[2], size_t inputs,
                        VolImage *image, VolError *err);

#endif
