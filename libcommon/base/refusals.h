/* Memory that was asked for and not given.  Libraries may carry on without it, with a key less in their JSON or an attribute
 * less in their image, so every refusal is counted, and a run that saw one does not end well. */
#ifndef VOL_BASE_REFUSALS_H
#define VOL_BASE_REFUSALS_H

#include <stdbool.h>
#include <stddef.h>

size_t vol_refusals(void); /* of the whole process, in mem.h's functions and in those below; async-signal-safe */
void vol_count_refusal(void);

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
