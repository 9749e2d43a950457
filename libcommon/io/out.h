/* Writing whole outputs: a file appears complete or not at all.
 *
 * Regular files are written to a temporary beside the target (`.NAME.vol-XXXXXX`) and renamed; the mode is that of the file
 * that was there, else what the umask allows.  "-", descriptors' names (/dev/stdout, /dev/fd/3), FIFOs, /dev/null and other
 * targets that are no regular files are written directly. */
#ifndef VOL_IO_OUT_H
#define VOL_IO_OUT_H

#include "base/mem.h"
#include "base/status.h"

typedef struct VolOutOptions {
    bool binary;         /* refuse a terminal (VOL_USAGE) */
    bool allow_terminal; /* --force */
} VolOutOptions;

typedef struct VolTarget {
    bool direct; /* written to as it stands */
    int fd;      /* of a direct one that is open; -1: to be opened */
    char *path;  /* allocated; of a file: links followed */
} VolTarget;

/* An output in two halves, so that a program with several has all of them or none: whatever can fail for want of room
 * fails before any is in place. */
typedef struct VolOutput {
    VolTarget target;
    VolOutOptions options;
    char *name;       /* for messages */
    const void *data; /* of a direct one: the caller's until it is committed */
    size_t size;
    int temporary;    /* which; -1: none */
} VolOutput;

VolStatus vol_output_prepare(VolOutput *output, const char *path, const void *data, size_t size, VolOutOptions options,
                             VolError *err);

/* Once a file is in place the calling thread keeps all signals blocked: it is meant to be the last thing that a program
 * does. */
VolStatus vol_output_commit(VolOutput *output, VolError *err);
void vol_output_free(VolOutput *output); /* a temporary that was not committed goes; not needed after a failed prepare */

/* Both halves at once. */
VolStatus vol_write_whole(const char *path, const void *data, size_t size, VolOutOptions options, VolError *err);

/* Checks before any work is done that binary output would not go to a terminal and that the target's folder exists. */
VolStatus vol_check_output(const char *path, VolOutOptions options, VolError *err);

/* Whether one of them would overwrite the other or be mixed with it.  Terminals and /dev/null: no. */
bool vol_same_output(const char *a, const char *b);

/* VOL_USAGE with the message for binary output to a terminal. */
VolStatus vol_refuse_output_terminal(const char *name, VolError *err);

/* Async-signal-safe: unlinks temporaries that exist now.  For signal handlers. */
void vol_unlink_temporaries(void);

#endif
