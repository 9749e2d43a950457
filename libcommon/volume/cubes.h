/* Cubes of one size, found by their coordinates. */
#ifndef VOL_VOLUME_CUBES_H
#define VOL_VOLUME_CUBES_H

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

/* Zeros: none yet, `stride` aside. */
typedef struct VolCubes {
    size_t stride;      /* of the items, each of which begins with int32_t at[3] */
    unsigned char *items;
    size_t count, capacity;
    uint32_t *slots;    /* item + 1, 0: free; linear probing; at most half full */
    size_t slot_count;  /* a power of two */
} VolCubes;

void *vol_cubes_find(const VolCubes *cubes, const int32_t at[3]); /* NULL: there is none */

/* The cube at `at`, made of zeros where there is none yet.  Pointers to others die. */
VolStatus vol_cubes_add(VolCubes *cubes, const int32_t at[3], void **out, VolError *err);

static inline void *vol_cubes_item(const VolCubes *cubes, size_t n) { return cubes->items + n * cubes->stride; }

static inline size_t vol_cubes_number(const VolCubes *cubes, const void *item)
{
    return (size_t)((const unsigned char *)item - cubes->items) / cubes->stride;
}

void vol_cubes_free(VolCubes *cubes);

/* Well mixed. */
static inline size_t vol_cubes_hash(int32_t x, int32_t y, int32_t z)
{
    uint64_t h = (uint64_t)(uint32_t)x * 0x9e3779b97f4a7c15u;
    h = (h ^ (uint64_t)(uint32_t)y) * 0xc2b2ae3d27d4eb4fu;
    h = (h ^ (uint64_t)(uint32_t)z) * 0x165667b19e3779f9u;
    return (size_t)(h ^ h >> 29);
}

#endif
