/* Names of open descriptors, such as /dev/fd/63 from a shell's <(..): their numbers say nothing of what is behind them. */
#ifndef VOL_BASE_DESCRIPTOR_H
#define VOL_BASE_DESCRIPTOR_H

#include <stddef.h>

/* Length of such a name at the start of `text`, 0 where there is none: /dev/stdin, /dev/stdout, /dev/stderr, /dev/fd/N,
 * /proc/self/fd/N, /proc/PID/fd/N and the like, slashes doubled or not.  *fd (may be NULL): its number in this process,
 * -1 where it is another's. */
size_t vol_descriptor_name(const char *text, int *fd);

#endif
