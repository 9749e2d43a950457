#include "base/refusals.h"

#include <jansson.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/mem.h"

static atomic_size_t refusals;

size_t vol_refusals(void) { return atomic_load(&refusals); }

void vol_count_refusal(void) { atomic_fetch_add(&refusals, 1); }

void *vol_library_alloc(size_t size) { return vol_alloc(size, 1); }

void *vol_library_alloc_zero(size_t size) { return vol_alloc_zero(size, 1); }

void *vol_library_resize(void *old, size_t size) { return vol_resize(old, size, 1); }

void *vol_zlib_alloc(void *opaque, unsigned count, unsigned size)
{
    (void)opaque;
    return vol_alloc(count, size);
}

void vol_zlib_free(void *opaque, void *block)
{
    (void)opaque;
    free(block);
}

void vol_watch_jansson(void) { json_set_alloc_funcs(vol_library_alloc, free); }

bool vol_memory_is_short(size_t size)
{
    void *block = vol_alloc(size, 1);
    free(block);
    return !block;
}
