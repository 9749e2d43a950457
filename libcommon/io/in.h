/* Reading whole inputs into memory that nobody else writes to; what a file is, its first bytes tell. */
#ifndef VOL_IO_IN_H
#define VOL_IO_IN_H

#include "base/mem.h"
#include "base/status.h"

typedef enum VolKind { VOL_KIND_OTHER, VOL_KIND_VDB, VOL_KIND_EXR, VOL_KIND_JSON, VOL_KIND_EMPTY } VolKind;

/* `path` "-" is stdin.  A terminal on stdin is refused (VOL_USAGE) unless `allow_terminal`.  A file that gets shorter
 * meanwhile: VOL_IO. */
VolStatus vol_read_whole(const char *path, bool allow_terminal, VolBytes *out, VolError *err);

/* VOL_USAGE with the message for a terminal as input. */
VolStatus vol_refuse_input_terminal(const char *name, VolError *err);

/* By magic number, never by name.  JSON: the first byte that is no white space (nor a UTF-8 BOM) is '{' or '['. */
VolKind vol_kind(const VolBytes *bytes);

/* The name to use in messages and in the history: "stdin" for "-", else the path as typed. */
const char *vol_input_name(const char *path);

#endif
