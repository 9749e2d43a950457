/* Results of functions that can fail.
 *
 * A function that can fail returns VolStatus and takes a `VolError *err` as its last parameter; on anything but VOL_OK
 * it has written one line there: what 'subject': why.  No full stop, no program name: the caller's shell adds those.
 * The values are the exit codes of the programs, so that main() returns what it was given. */
#ifndef VOL_BASE_STATUS_H
#define VOL_BASE_STATUS_H

typedef enum VolStatus {
    VOL_OK = 0,
    VOL_NO = 1,        /* the answer is no: files differ, a frame has a hole */
    VOL_USAGE = 2,     /* bad command line */
    VOL_BAD_INPUT = 3, /* damaged, missing or contradictory input */
    VOL_IO = 4,        /* the operating system could not read or write; trying again may help */
    VOL_NOMEM = 5      /* out of memory or threads */
} VolStatus;

typedef struct VolError {
    char text[1024];
} VolError;

/* Writes the message (made printable, see printable.h, and cut at the buffer's end) and returns `status`.
 * `err` may be NULL. */
VolStatus vol_fail(VolError *err, VolStatus status, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* "why" for errno values after a failed system call; VOL_NOMEM for ENOMEM, else VOL_IO. */
VolStatus vol_fail_errno(VolError *err, int errnum, const char *what, const char *subject);

/* Puts `prefix: ` before the message already in err, for a caller who knows more of the context. */
VolStatus vol_fail_within(VolError *err, VolStatus status, const char *prefix_format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
