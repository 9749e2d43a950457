#include "base/refusals.h"

#include <jansson.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/mem.h"

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

/* An ordinary block, so that whoever gets it releases it as any other. */
static void *_Atomic reserve;
enum { RESERVE_BYTES = 1 << 16 };

/* jansson asserts in places that what it asked for is there: after a refusal it goes on with what was put aside, and the
 * count tells. */
static void *alloc_for_jansson(size_t size)
{
    void *block = vol_alloc(size, 1);
    return block || size > RESERVE_BYTES ? block : atomic_exchange(&reserve, NULL);
}

void vol_watch_jansson(void)
{
    static atomic_flag watched = ATOMIC_FLAG_INIT;
    if (atomic_flag_test_and_set(&watched))
        return;
    atomic_store(&reserve, vol_alloc(RESERVE_BYTES, 1));
    json_set_alloc_funcs(alloc_for_jansson, free);
}

bool vol_memory_is_short(size_t size)
{
    void *block = vol_alloc(size, 1);
    free(block);
    return !block;
}
