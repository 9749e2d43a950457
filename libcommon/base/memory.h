/* How much memory can still be had, so that what needs more says so before it takes any: the system gives more than there
 * is, and kills who uses it. */
#ifndef VOL_BASE_MEMORY_H
#define VOL_BASE_MEMORY_H

#include "base/status.h"

/* Bytes that this process can still take: of the machine (with what it can swap), of its control groups, of its address
 * space (ulimit -v and -d); infinity where nothing tells. */
double vol_memory_available(void);

/* What the control group of this folder leaves, of version 1 or 2. */
double vol_group_memory_left(const char *folder);

enum { VOL_WORTH_A_CHECK = 1 << 26 }; /* to look takes some 100 us */

/* VOL_NOMEM where `bytes` are more than that: "about 34 GB of memory are needed, 22 GB are available". */
VolStatus vol_check_memory(double bytes, VolError *err);

#endif
