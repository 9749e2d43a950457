#include "volume/cubes.h"

#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

/* The slot that names the cube at `at`, or the free one where it belongs. */
static size_t slot_of(const VolCubes *cubes, const int32_t at[3])
{
    size_t mask = cubes->slot_count - 1, slot = vol_cubes_hash(at[0], at[1], at[2]) & mask;
    while (cubes->slots[slot] && memcmp(vol_cubes_item(cubes, cubes->slots[slot] - 1), at, 3 * sizeof *at) != 0)
        slot = (slot + 1) & mask;
    return slot;
}

void *vol_cubes_find(const VolCubes *cubes, const int32_t at[3])
{
    if (!cubes->count)
        return NULL;
    size_t slot = slot_of(cubes, at);
    return cubes->slots[slot] ? vol_cubes_item(cubes, cubes->slots[slot] - 1) : NULL;
}

static VolStatus grow(VolCubes *cubes, VolError *err)
{
    size_t capacity = cubes->capacity ? 2 * cubes->capacity : 16;
    unsigned char *items = vol_resize(cubes->items, capacity, cubes->stride);
    if (!items)
        return vol_fail_memory(err, capacity * cubes->stride);
    cubes->items = items;
    uint32_t *slots = capacity < UINT32_MAX / 4 ? vol_alloc_zero(2 * capacity, sizeof *slots) : NULL;
    if (!slots)
        return vol_fail_memory(err, 2 * capacity * sizeof *slots);
    free(cubes->slots);
    cubes->slots = slots;
    cubes->slot_count = 2 * capacity;
    cubes->capacity = capacity;
    for (size_t n = 0; n < cubes->count; n++)
        slots[slot_of(cubes, vol_cubes_item(cubes, n))] = (uint32_t)n + 1;
    return VOL_OK;
}

VolStatus vol_cubes_add(VolCubes *cubes, const int32_t at[3], void **out, VolError *err)
{
    *out = vol_cubes_find(cubes, at);
    if (*out)
        return VOL_OK;
    VolStatus status = cubes->count == cubes->capacity ? grow(cubes, err) : VOL_OK;
    if (status)
        return status;
    *out = memset(vol_cubes_item(cubes, cubes->count), 0, cubes->stride);
    memcpy(*out, at, 3 * sizeof *at);
    cubes->slots[slot_of(cubes, at)] = (uint32_t)++cubes->count;
    return VOL_OK;
}

void vol_cubes_free(VolCubes *cubes)
{
    free(cubes->items);
    free(cubes->slots);
    cubes->items = NULL;
    cubes->slots = NULL;
    cubes->count = cubes->capacity = cubes->slot_count = 0;
}
