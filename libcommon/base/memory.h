/* How much memory there is to take: asked before much is taken, for a system that grants what it has not ends the process
 * that uses it. */
#ifndef VOL_BASE_MEMORY_H
#define VOL_BASE_MEMORY_H

#include <stdint.h>

#include "base/status.h"

/* The least of what the machine has (with swap), its control groups allow and `ulimit -v` allows; bytes. */
uint64_t vol_memory_limit(void);

/* VOL_NOMEM where `bytes` are more than that: "WHAT takes 160 GB of memory, there are 24 GB: ADVICE". */
VolStatus vol_memory_check(uint64_t bytes, const char *what, const char *advice, VolError *err);

#endif
