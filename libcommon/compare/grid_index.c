#include "compare/grid_index.h"

#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

/* Cubes lie at multiples of their size. */
static int32_t corner(int32_t v, int32_t size) { return (int32_t)((uint32_t)v & ~(uint32_t)(size - 1)); }

static size_t first_slot(const VolGridIndex *index, const int32_t o[3], int32_t size)
{
    uint64_t h = (uint32_t)o[0] * UINT64_C(0x9e3779b97f4a7c15);
    h = (h ^ h >> 29 ^ (uint32_t)o[1]) * UINT64_C(0xbf58476d1ce4e5b9);
    h = (h ^ h >> 32 ^ (uint32_t)o[2]) * UINT64_C(0x94d049bb133111eb);
    return (size_t)(h ^ h >> 31 ^ (uint32_t)size) & (index->slot_count - 1);
}

/* The slot that holds this cube, or the free one where it belongs. */
static uint32_t *slot_of(const VolGridIndex *index, const int32_t origin[3], int32_t size)
{
    for (size_t at = first_slot(index, origin, size);; at = (at + 1) & (index->slot_count - 1)) {
        uint32_t *slot = &index->slots[at];
        if (*slot == 0)
            return slot;
        const VolCube *cube = &index->cubes[*slot - 1];
        if (cube->size == size && memcmp(cube->origin, origin, sizeof cube->origin) == 0)
            return slot;
    }
}

static bool grow(VolGridIndex *index)
{
    size_t capacity = index->capacity ? 2 * index->capacity : 64;
    VolCube *cubes = vol_resize(index->cubes, capacity, sizeof *cubes);
    if (!cubes)
        return false;
    index->cubes = cubes;
    uint32_t *slots = capacity < UINT32_MAX / 4 ? vol_alloc_zero(2 * capacity, sizeof *slots) : NULL;
    if (!slots)
        return false;
    free(index->slots);
    index->slots = slots;
    index->slot_count = 2 * capacity;
    index->capacity = capacity;
    for (size_t i = 0; i < index->count; i++)
        *slot_of(index, cubes[i].origin, cubes[i].size) = (uint32_t)i + 1;
    return true;
}

VolCube *vol_grid_index_add(VolGridIndex *index, const int32_t origin[3], int32_t size)
{
    if (index->count == index->capacity && !grow(index))
        return NULL;
    VolCube *cube = &index->cubes[index->count++];
    *cube = (VolCube){.size = size};
    memcpy(cube->origin, origin, sizeof cube->origin);
    *slot_of(index, origin, size) = (uint32_t)index->count;
    return cube;
}

VolCube *vol_grid_index_find(const VolGridIndex *index, const int32_t voxel[3], int32_t min_size)
{
    static const int32_t sizes[] = {8, 128, 4096};
    for (int s = 0; s < 3 && index->slot_count; s++) {
        if (sizes[s] < min_size)
            continue;
        int32_t origin[3];
        for (int i = 0; i < 3; i++)
            origin[i] = corner(voxel[i], sizes[s]);
        uint32_t slot = *slot_of(index, origin, sizes[s]);
        if (slot)
            return &index->cubes[slot - 1];
    }
    return NULL;
}

void vol_grid_index_free(VolGridIndex *index)
{
    for (size_t i = 0; i < index->count; i++)
        free(index->cubes[i].values);
    free(index->cubes);
    free(index->slots);
    *index = (VolGridIndex){0};
}
