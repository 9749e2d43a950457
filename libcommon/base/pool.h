/* A loop spread over threads.  Work items are handed out one by one in ascending order; results must not depend on who
 * runs them. */
#ifndef VOL_BASE_POOL_H
#define VOL_BASE_POOL_H

#include <stddef.h>

#include "base/status.h"

/* Runs item(user, index, thread) for index 0..count-1 on `threads` threads (the caller's is one; thread is 0..threads-1).
 * The first item that fails (the lowest index among those that did) ends the loop; its status and message are returned.
 * VOL_NOMEM where threads cannot be made. */
VolStatus vol_parallel(int threads, size_t count,
                       VolStatus (*item)(void *user, size_t index, int thread, VolError *err), void *user,
                       VolError *err);

/* VOL_NOMEM where so many, 16 at most, cannot be started beside those that there are. */
VolStatus vol_threads_can_start(int count, VolError *err);

#endif
