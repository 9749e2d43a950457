/* Writing whole outputs: a file appears complete or not at all.
 *
 * Regular files are written to a temporary beside the target (`.NAME.vol-XXXXXX`), given the mode the umask allows and
 * renamed.  "-", FIFOs, /dev/null, /dev/stdout and other non-regular targets are written directly. */
#ifndef VOL_IO_OUT_H
#define VOL_IO_OUT_H

#include "base/mem.h"
#include "base/status.h"

typedef struct VolOutOptions {
    bool binary;         /* refuse a terminal (VOL_USAGE) */
    bool allow_terminal; /* --force */
} VolOutOptions;

/* Once a file is in place the calling thread keeps all signals blocked: it is meant to be the last thing that a program
 * does. */
VolStatus vol_write_whole(const char *path, const void *data, size_t size, VolOutOptions options, VolError *err);

/* Checks before any work is done that binary output would not go to a terminal and that the target's folder exists. */
VolStatus vol_check_output(const char *path, VolOutOptions options, VolError *err);

/* VOL_USAGE with the message for binary output to a terminal. */
VolStatus vol_refuse_output_terminal(const char *name, VolError *err);

/* Async-signal-safe: unlinks temporaries that exist now.  For signal handlers. */
void vol_unlink_temporaries(void);

#endif
