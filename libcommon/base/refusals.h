/* Memory for libraries: what they were not given is counted (refused.h). */
#ifndef VOL_BASE_REFUSALS_H
#define VOL_BASE_REFUSALS_H

#include <stdbool.h>
#include <stddef.h>

#include "base/refused.h"

/* Allocators to hand to libraries; what they give is released with free(). */
void *vol_library_alloc(size_t size);
void *vol_library_alloc_zero(size_t size);
void *vol_library_resize(void *old, size_t size);
void *vol_zlib_alloc(void *opaque, unsigned count, unsigned size);
void vol_zlib_free(void *opaque, void *block);

/* jansson's memory comes from mem.h from now on; the first refusal is counted but made good from a reserve, as jansson
 * aborts over some. */
void vol_watch_jansson(void);

/* For libraries that take none of these and report want of memory as damage: whether they will hardly have had `size`
 * bytes. */
bool vol_memory_is_short(size_t size);

#endif
