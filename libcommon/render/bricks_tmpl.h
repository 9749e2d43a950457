/* A brick's voxels in the kernel's precision, and the gradients at its voxels.
 *
 * Where the pool holds what the kernel needs, a brick's voxels are read in place.  Otherwise (another precision, or one
 * value throughout), and for gradients, a thread keeps what it made for the bricks that it met last.  A place in that
 * store is given to another brick only while no lane is in it.
 * Include reals.h first. */
#ifndef VOL_RENDER_BRICKS_TMPL_H
#define VOL_RENDER_BRICKS_TMPL_H

#include "grid/grid.h"
#include "render/reals.h"
#include "render/scene.h"

enum { BRICK_APRON = VOL_BRICK_SIDE + 2 };

/* Room that any lane may load corners from. */
static inline const real *scratch_zeros(const VolScratch *scratch) { return scratch->zeros; }

enum { STORE_NOBODY = 0 }; /* for what is not to be found again */

/* The place of `key` in the store, its own (true) or one that no lane is in (false). */
static inline bool store_place(VolBrickStore *store, size_t size, const real *const in_use[LANES], uint32_t key,
                               real **place)
{
    real *all = store->numbers;
    size_t first = key % (store->places - LANES), chosen = SIZE_MAX;
    for (size_t n = 0; n <= LANES; n++) {
        size_t at = first + n;
        if (key != STORE_NOBODY && store->key[at] == key) {
            *place = all + at * size;
            return true;
        }
        bool taken = false;
        for (int i = 0; i < LANES; i++)
            taken = taken || in_use[i] == all + at * size;
        if (!taken && chosen == SIZE_MAX)
            chosen = at;
    }
    store->key[chosen] = key;
    *place = all + chosen * size;
    return false;
}

static inline const real *brick_values(const VolGrid *grid, VolScratch *scratch, const real *const in_use[LANES],
                                       uint32_t number)
{
    const VolBrick *brick = &grid->bricks[number];
    bool stored = brick->storage != VOL_NO_STORAGE;
    size_t at = stored ? (size_t)brick->storage * VOL_BRICK_STRIDE : 0;
    if (stored && grid->is_double == (sizeof(real) == sizeof(double)))
        return (const real *)grid->values + at;
    real *out;
    if (store_place(&scratch->values, VOL_BRICK_STRIDE, in_use, number + 1, &out))
        return out;
    for (size_t n = 0; n < VOL_BRICK_VALUES; n++)
        out[n] = (real)(!stored            ? brick->uniform
                        : grid->is_double ? ((const double *)grid->values)[at + n]
                                          : (double)((const float *)grid->values)[at + n]);
    return out;
}

/* ---- Gradients ---- */

/* Along one axis, voxels -1 to 9 of a brick as the field sees them: kept within a box; outside a sparse one there is
 * background. */
typedef struct AxisPlaces {
    int brick[BRICK_APRON]; /* 0: the brick below, 1: this one, 2: the one above */
    int local[BRICK_APRON];
    bool outside[BRICK_APRON];
    real weight[VOL_BRICK_SIDE]; /* of the difference at each voxel: 1/2, at a box's faces 1 */
} AxisPlaces;

static inline void axis_places(const VolGrid *grid, int a, int32_t origin, AxisPlaces *out)
{
    int32_t lo = grid->voxel_min[a], hi = grid->voxel_max[a];
    bool box = grid->domain == VOL_DOMAIN_BOX;
    for (int n = 0; n < BRICK_APRON; n++) {
        int32_t voxel = origin + n - 1, inside = voxel < lo ? lo : voxel > hi ? hi : voxel;
        out->outside[n] = !box && inside != voxel;
        voxel = box ? inside : voxel;
        int32_t from = voxel - (origin - VOL_BRICK_CELLS);
        /* Voxels far outside belong to cells that no ray enters. */
        from = from < 0 ? 0 : from > 3 * VOL_BRICK_CELLS - 1 ? 3 * VOL_BRICK_CELLS - 1 : from;
        out->brick[n] = from >> 3;
        out->local[n] = from & 7;
    }
    for (int n = 0; n < VOL_BRICK_SIDE; n++) {
        int32_t voxel = origin + n;
        int span = box ? (voxel > lo) + (voxel < hi) : 2;
        out->weight[n] = span ? (real)1 / (real)span : 0;
    }
}

/* Eight voxels along z of a brick, from a place among its voxels. */
static inline void copy_row(const VolGrid *grid, const VolBrick *brick, size_t place, real out[VOL_BRICK_CELLS])
{
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE + place;
    if (brick->storage == VOL_NO_STORAGE) {
        for (int n = 0; n < VOL_BRICK_CELLS; n++)
            out[n] = (real)brick->uniform;
    } else if (grid->is_double == (sizeof(real) == sizeof(double))) {
        memcpy(out, (const real *)grid->values + at, VOL_BRICK_CELLS * sizeof *out);
    } else if (grid->is_double) {
        for (int n = 0; n < VOL_BRICK_CELLS; n++)
            out[n] = (real)((const double *)grid->values)[at + (size_t)n];
    } else {
        for (int n = 0; n < VOL_BRICK_CELLS; n++)
            out[n] = (real)((const float *)grid->values)[at + (size_t)n];
    }
}

/* The voxels from -1 to 9 along each axis, [(x*11 + y)*11 + z]. */
static inline void gather_apron(const VolGrid *grid, const int32_t origin[3], const AxisPlaces places[3], real *out)
{
    enum { BACKGROUND = 3 * VOL_BRICK_CELLS };
    const VolBrick *bricks[27];
    for (int n = 0; n < 27; n++) {
        int32_t at[3] = {(origin[0] >> 3) + n / 9 - 1, (origin[1] >> 3) + n / 3 % 3 - 1, (origin[2] >> 3) + n % 3 - 1};
        bricks[n] = &grid->bricks[vol_grid_brick_at(grid, at[0] * 8, at[1] * 8, at[2] * 8)];
    }
    real line[BACKGROUND + 1] = {0}; /* three bricks' voxels, and what is outside */
    line[BACKGROUND] = (real)grid->background;
    int from[BRICK_APRON];
    for (int z = 0; z < BRICK_APRON; z++)
        from[z] = places[2].outside[z] ? BACKGROUND : places[2].brick[z] * VOL_BRICK_CELLS + places[2].local[z];
    for (int x = 0; x < BRICK_APRON; x++)
        for (int y = 0; y < BRICK_APRON; y++) {
            bool outside = places[0].outside[x] || places[1].outside[y];
            const VolBrick *const *row = bricks + places[0].brick[x] * 9 + places[1].brick[y] * 3;
            size_t place = (size_t)((places[0].local[x] * 9 + places[1].local[y]) * 9);
            for (int b = 0; b < 3 && !outside; b++)
                copy_row(grid, row[b], place, line + b * VOL_BRICK_CELLS);
            for (int z = 0; z < BRICK_APRON; z++)
                *out++ = line[outside ? BACKGROUND : from[z]];
        }
}

/* Central differences by index step, one-sided at a box's faces and beside what is not finite. */
static inline real difference(real before, real here, real after, real weight)
{
    if (isfinite(before) && isfinite(after))
        return (after - before) * weight;
    if (!isfinite(here) || (!isfinite(before) && !isfinite(after)))
        return 0;
    return isfinite(before) ? here - before : after - here;
}

/* Of a row of 9 voxels, the first eight or the last. */
typedef real eight __attribute__((vector_size(8 * sizeof(real))));

ALWAYS_INLINE eight load_eight(const real *from)
{
    eight row;
    memcpy(&row, from, sizeof row);
    return row;
}

/* Where all is finite. */
static inline void differences_along(const real *apron, int step, const real weight[VOL_BRICK_SIDE], int axis, real *out)
{
    for (int x = 0; x < VOL_BRICK_SIDE; x++)
        for (int y = 0; y < VOL_BRICK_SIDE; y++, out += VOL_BRICK_SIDE) {
            const real *row = apron + ((x + 1) * BRICK_APRON + y + 1) * BRICK_APRON + 1;
            for (int z = 0; z <= VOL_BRICK_SIDE - 8; z++) {
                eight change = load_eight(row + z + step) - load_eight(row + z - step);
                change *= axis == 2 ? load_eight(weight + z) : weight[axis == 0 ? x : y] - (eight){0};
                memcpy(out + z, &change, sizeof change);
            }
        }
}

static inline void differences_beside_holes(const real *apron, int step, const real weight[VOL_BRICK_SIDE], int axis,
                                            real *out)
{
    for (int x = 0; x < VOL_BRICK_SIDE; x++)
        for (int y = 0; y < VOL_BRICK_SIDE; y++) {
            const real *row = apron + ((x + 1) * BRICK_APRON + y + 1) * BRICK_APRON + 1;
            for (int z = 0; z < VOL_BRICK_SIDE; z++)
                *out++ = difference(row[z - step], row[z], row[z + step], weight[axis == 0 ? x : axis == 1 ? y : z]);
        }
}

static inline bool none_is_a_hole(const real apron[BRICK_APRON * BRICK_APRON * BRICK_APRON])
{
    enum { COUNT = BRICK_APRON * BRICK_APRON * BRICK_APRON };
    eight sum = load_eight(apron + COUNT - 8) * 0;
    for (int i = 0; i + 8 <= COUNT; i += 8)
        sum += load_eight(apron + i) * 0;
    real all = 0;
    for (int i = 0; i < 8; i++)
        all += sum[i];
    return all == 0;
}

static inline const real *brick_gradients(const VolGrid *grid, VolScratch *scratch, const real *const in_use[LANES],
                                          uint32_t number, const int32_t origin[3])
{
    AxisPlaces places[3];
    real apron[BRICK_APRON * BRICK_APRON * BRICK_APRON], *out;
    /* A brick of one value may stand in many places, with other neighbours in each. */
    bool shared = grid->bricks[number].storage == VOL_NO_STORAGE;
    uint32_t key = shared ? STORE_NOBODY : number + 1;
    if (store_place(&scratch->gradients, 3 * VOL_BRICK_STRIDE, in_use, key, &out))
        return out;
    for (int a = 0; a < 3; a++)
        axis_places(grid, a, origin[a], &places[a]);
    gather_apron(grid, origin, places, apron);
    bool finite = none_is_a_hole(apron);
    static const int step[3] = {BRICK_APRON * BRICK_APRON, BRICK_APRON, 1};
    for (int a = 0; a < 3; a++) {
        real *along = out + a * VOL_BRICK_STRIDE;
        if (finite)
            differences_along(apron, step[a], places[a].weight, a, along);
        else
            differences_beside_holes(apron, step[a], places[a].weight, a, along);
    }
    return out;
}

#endif
