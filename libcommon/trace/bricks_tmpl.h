/* A brick's voxels in the kernel's precision, and the gradients at its voxels.
 *
 * Where the pool holds what the kernel needs, a brick's voxels are read in place.  Otherwise (another precision, or one
 * value throughout), and for gradients, a thread keeps what it made for the bricks that it met last.  A place in that
 * store is given to another brick only while no lane is in it.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    brick_planes(), brick_values(), brick_gradients(), steepest_of(), scratch_zeros() */
#ifndef VOL_TRACE_BRICKS_TMPL_H
#define VOL_TRACE_BRICKS_TMPL_H

#include "simd/reals.h"
#include "trace/trace.h"
#include "volume/grid.h"

enum { BRICK_HALO = VOL_BRICK_SIDE + 2 };

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

/* A brick's planes where the pool holds them as the kernel needs them, else NULL. */
static inline const real *pooled_planes(const VolGrid *grid, const VolBrick *brick, int planes)
{
    if (brick->storage == VOL_NO_STORAGE || grid->is_double != (sizeof(real) == sizeof(double)))
        return NULL;
    return (const real *)grid->values + (size_t)brick->storage * (size_t)planes * VOL_BRICK_STRIDE;
}

/* A plane of a brick of one value, or of one in each octant. */
static inline void unfold_brick(const VolGrid *grid, const VolBrick *brick, int plane, real *out)
{
    real value[8];
    for (int k = 0; k < 8; k++) {
        double single = brick->octants ? grid->octants[brick->octants - 1].value[k] : brick->uniform;
        value[k] = (real)vol_grid_in_plane(grid, single, plane);
    }
    for (int x = 0; x < VOL_BRICK_SIDE; x++)
        for (int y = 0; y < VOL_BRICK_SIDE; y++) {
            int k = x / VOL_BRICK_CELLS * 4 + y / VOL_BRICK_CELLS * 2;
            for (int z = 0; z < VOL_BRICK_CELLS; z++)
                *out++ = value[k];
            *out++ = value[k + 1];
        }
}

/* A brick's voxels, plane after plane; `store` is for bricks of this grid alone. */
static inline const real *brick_planes(const VolGrid *grid, VolBrickStore *store, const real *const in_use[LANES],
                                       uint32_t number, int planes)
{
    const VolBrick *brick = &grid->bricks[number];
    const real *pooled = pooled_planes(grid, brick, planes);
    if (pooled)
        return pooled;
    real *out;
    if (store_place(store, (size_t)planes * VOL_BRICK_STRIDE, in_use, number + 1, &out))
        return out;
    for (int c = 0; c < planes; c++) {
        real *plane = out + c * VOL_BRICK_STRIDE;
        size_t at = ((size_t)brick->storage * (size_t)planes + (size_t)c) * VOL_BRICK_STRIDE;
        if (brick->storage == VOL_NO_STORAGE)
            unfold_brick(grid, brick, c, plane);
        else
            for (size_t n = 0; n < VOL_BRICK_VALUES; n++)
                plane[n] = (real)(grid->is_double ? ((const double *)grid->values)[at + n]
                                                  : (double)((const float *)grid->values)[at + n]);
    }
    return out;
}

static inline const real *brick_values(const VolGrid *grid, VolScratch *scratch, const real *const in_use[LANES],
                                       uint32_t number)
{
    return brick_planes(grid, &scratch->values, in_use, number, 1);
}

/* ---- Gradients ---- */

/* Along one axis, voxels -1 to 9 of a brick as the field sees them: kept within a box; outside a sparse one there is
 * background. */
typedef struct AxisPlaces {
    int brick[BRICK_HALO]; /* 0: the brick below, 1: this one, 2: the one above */
    int local[BRICK_HALO];
    bool outside[BRICK_HALO];
    real weight[VOL_BRICK_SIDE]; /* of the difference at each voxel: 1/2, at a box's faces 1 */
} AxisPlaces;

static inline void axis_places(const VolGrid *grid, int a, int32_t origin, AxisPlaces *out)
{
    int32_t lo = grid->voxel_min[a], hi = grid->voxel_max[a];
    bool box = grid->domain == VOL_DOMAIN_BOX;
    for (int n = 0; n < BRICK_HALO; n++) {
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

/* A brick and the 26 around it, [(x*3 + y)*3 + z]. */
static inline void bricks_around(const VolGrid *grid, const int32_t origin[3], uint32_t numbers[27], const VolBrick *out[27])
{
    const int32_t b[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    for (int n = 0; n < 27; n++) {
        numbers[n] = vol_grid_brick_number(grid, b[0] + n / 9 - 1, b[1] + n / 3 % 3 - 1, b[2] + n % 3 - 1);
        out[n] = &grid->bricks[numbers[n]];
    }
}

/* The voxels from -1 to 9 along each axis, [(x*11 + y)*11 + z]. */
static inline void gather_halo(const VolGrid *grid, const VolBrick *const bricks[27], const AxisPlaces places[3], real *out)
{
    enum { BACKGROUND = 3 * VOL_BRICK_CELLS };
    real line[BACKGROUND + 1] = {0}; /* three bricks' voxels, and what is outside */
    line[BACKGROUND] = (real)grid->background;
    int from[BRICK_HALO];
    for (int z = 0; z < BRICK_HALO; z++)
        from[z] = places[2].outside[z] ? BACKGROUND : places[2].brick[z] * VOL_BRICK_CELLS + places[2].local[z];
    for (int x = 0; x < BRICK_HALO; x++)
        for (int y = 0; y < BRICK_HALO; y++) {
            bool outside = places[0].outside[x] || places[1].outside[y];
            const VolBrick *const *row = bricks + places[0].brick[x] * 9 + places[1].brick[y] * 3;
            size_t place = (size_t)((places[0].local[x] * 9 + places[1].local[y]) * 9);
            for (int b = 0; b < 3 && !outside; b++)
                copy_row(grid, row[b], place, line + b * VOL_BRICK_CELLS);
            for (int z = 0; z < BRICK_HALO; z++)
                *out++ = line[outside ? BACKGROUND : from[z]];
        }
}

/* The same where none of the bricks has storage: the rows within a brick are alike. */
static inline void gather_blocks(const VolGrid *grid, const VolBrick *const bricks[27], const AxisPlaces places[3],
                                 real *out)
{
    enum { OUTSIDE = 3, ROW = BRICK_HALO };
    const real *known[OUTSIDE + 1][OUTSIDE + 1] = {{NULL}};
    real line[OUTSIDE + 1];
    line[OUTSIDE] = (real)grid->background;
    for (int x = 0; x < ROW; x++)
        for (int y = 0; y < ROW; y++, out += ROW) {
            int bx = places[0].outside[x] ? OUTSIDE : places[0].brick[x];
            int by = places[1].outside[y] ? OUTSIDE : places[1].brick[y];
            bool outside = bx == OUTSIDE || by == OUTSIDE;
            if (known[bx][by]) {
                memcpy(out, known[bx][by], ROW * sizeof *out);
                continue;
            }
            for (int b = 0; b < 3; b++)
                line[b] = outside ? line[OUTSIDE] : (real)bricks[bx * 9 + by * 3 + b]->uniform;
            for (int z = 0; z < ROW; z++)
                out[z] = line[places[2].outside[z] ? OUTSIDE : places[2].brick[z]];
            known[bx][by] = out;
        }
}

static inline bool none_is_stored(const VolBrick *const bricks[27])
{
    bool none = true;
    for (int n = 0; n < 27; n++)
        none = none && bricks[n]->storage == VOL_NO_STORAGE;
    return none;
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
static inline void differences_along(const real *halo, int step, const real weight[VOL_BRICK_SIDE], int axis, real *out)
{
    for (int x = 0; x < VOL_BRICK_SIDE; x++)
        for (int y = 0; y < VOL_BRICK_SIDE; y++, out += VOL_BRICK_SIDE) {
            const real *row = halo + ((x + 1) * BRICK_HALO + y + 1) * BRICK_HALO + 1;
            for (int z = 0; z <= VOL_BRICK_SIDE - 8; z++) {
                eight change = load_eight(row + z + step) - load_eight(row + z - step);
                change *= axis == 2 ? load_eight(weight + z) : weight[axis == 0 ? x : y] - (eight){0};
                memcpy(out + z, &change, sizeof change);
            }
        }
}

static inline void differences_beside_invalid(const real *halo, int step, const real weight[VOL_BRICK_SIDE], int axis,
                                              real *out)
{
    for (int x = 0; x < VOL_BRICK_SIDE; x++)
        for (int y = 0; y < VOL_BRICK_SIDE; y++) {
            const real *row = halo + ((x + 1) * BRICK_HALO + y + 1) * BRICK_HALO + 1;
            for (int z = 0; z < VOL_BRICK_SIDE; z++)
                *out++ = difference(row[z - step], row[z], row[z + step], weight[axis == 0 ? x : axis == 1 ? y : z]);
        }
}

static inline bool all_are_valid(const real halo[BRICK_HALO * BRICK_HALO * BRICK_HALO])
{
    enum { COUNT = BRICK_HALO * BRICK_HALO * BRICK_HALO };
    eight sum = load_eight(halo + COUNT - 8) * 0;
    for (int i = 0; i + 8 <= COUNT; i += 8)
        sum += load_eight(halo + i) * 0;
    real all = 0;
    for (int i = 0; i < 8; i++)
        all += sum[i];
    return all == 0;
}

static const int place_step[3] = {VOL_BRICK_SIDE * VOL_BRICK_SIDE, VOL_BRICK_SIDE, 1};

/* Where the pool holds the voxels of a brick without invalid ones, at brick coordinates; else SIZE_MAX. */
static inline size_t whole_brick(const VolGrid *grid, const int32_t at[3])
{
    const VolBrick *brick = &grid->bricks[vol_grid_brick_number(grid, at[0], at[1], at[2])];
    return brick->invalid || brick->storage == VOL_NO_STORAGE ? SIZE_MAX : (size_t)brick->storage * VOL_BRICK_STRIDE;
}

/* Voxels in the pool, whose precision need not be the kernel's. */
ALWAYS_INLINE real stored(const void *pool, bool doubles, size_t at)
{
    return (real)(doubles ? ((const double *)pool)[at] : (double)((const float *)pool)[at]);
}

ALWAYS_INLINE eight eight_stored(const void *pool, bool doubles, size_t at)
{
    typedef float floats __attribute__((vector_size(8 * sizeof(float))));
    typedef double others __attribute__((vector_size(8 * sizeof(double))));
    if (doubles) {
        others row;
        memcpy(&row, (const double *)pool + at, sizeof row);
        return __builtin_convertvector(row, eight);
    }
    floats row;
    memcpy(&row, (const float *)pool + at, sizeof row);
    return __builtin_convertvector(row, eight);
}

/* Half the changes along an axis, eight at a time, from the places before and behind. */
ALWAYS_INLINE void store_changes(const void *pool, bool doubles, size_t before, size_t after, real *out)
{
    eight change = (eight_stored(pool, doubles, after) - eight_stored(pool, doubles, before)) * (real)0.5;
    memcpy(out, &change, sizeof change);
}

/* Differences along an axis from a brick's own voxels and the nearest planes of the bricks below and above. */
ALWAYS_INLINE void differences_among_bricks(const void *pool, bool doubles, size_t here, size_t below, size_t above,
                                            int axis, real *out)
{
    const size_t step = (size_t)place_step[axis], last = VOL_BRICK_CELLS * step;
    const size_t across = (size_t)place_step[axis == 0 ? 1 : 0];
    /* All in one sweep; at the first and the last plane it leaves numbers without meaning, which the loop below replaces. */
    for (size_t i = step; i < VOL_BRICK_VALUES - step; i += 8)
        store_changes(pool, doubles, here + i - step, here + i + step, out + i);
    size_t before = below + last - step, after = above + step;
    for (int row = 0; row < VOL_BRICK_SIDE; row++, here += across, before += across, after += across, out += across) {
        for (size_t z = 0; axis < 2 && z <= VOL_BRICK_SIDE - 8; z++) {
            store_changes(pool, doubles, before + z, here + step + z, out + z);
            store_changes(pool, doubles, here + last - step + z, after + z, out + last + z);
        }
        for (size_t n = 0; axis == 2 && n < (size_t)place_step[0]; n += VOL_BRICK_SIDE) {
            out[n] = (stored(pool, doubles, here + n + step) - stored(pool, doubles, before + n)) * (real)0.5;
            out[n + last] =
                (stored(pool, doubles, after + n) - stored(pool, doubles, here + n + last - step)) * (real)0.5;
        }
    }
}

ALWAYS_INLINE void differences_along_axes(const void *pool, bool doubles, size_t here, const size_t below[3],
                                          const size_t above[3], real *out)
{
    for (int a = 0; a < 3; a++)
        differences_among_bricks(pool, doubles, here, below[a], above[a], a, out + a * VOL_BRICK_STRIDE);
}

/* The gradients of a brick well inside the domain, if the bricks beside it have voxels, too: most are such, and the rest of
 * what lies around them is not needed. */
static inline bool gradients_in_place(const VolGrid *grid, const int32_t origin[3], real *out)
{
    int32_t at[3] = {origin[0] >> 3, origin[1] >> 3, origin[2] >> 3};
    size_t here = whole_brick(grid, at), below[3], above[3];
    for (int a = 0; a < 3; a++) {
        if (here == SIZE_MAX || origin[a] <= grid->voxel_min[a] || origin[a] + VOL_BRICK_SIDE > grid->voxel_max[a])
            return false;
        at[a]--;
        below[a] = whole_brick(grid, at);
        at[a] += 2;
        above[a] = whole_brick(grid, at);
        at[a]--;
        if (below[a] == SIZE_MAX || above[a] == SIZE_MAX)
            return false;
    }
    if (grid->is_double)
        differences_along_axes(grid->values, true, here, below, above, out);
    else
        differences_along_axes(grid->values, false, here, below, above, out);
    return true;
}

/* A key for gradients in these surroundings: the same for the same ones, as long as they are remembered. */
static inline uint32_t key_of_surroundings(const VolGrid *grid, VolSurroundingsMet *met, const uint32_t numbers[27],
                                           const int32_t origin[3])
{
    VolSurroundings here;
    memcpy(here.bricks, numbers, sizeof here.bricks);
    for (int a = 0; a < 3; a++) {
        int64_t lo = (int64_t)grid->voxel_min[a] - origin[a], hi = (int64_t)grid->voxel_max[a] - origin[a];
        here.ends[2 * a] = (int32_t)(lo < -2 ? -2 : lo > BRICK_HALO ? BRICK_HALO : lo);
        here.ends[2 * a + 1] = (int32_t)(hi < -2 ? -2 : hi > BRICK_HALO ? BRICK_HALO : hi);
    }
    size_t at = met->last;
    for (size_t n = 0; n < VOL_SURROUNDINGS; n++, at = (at + 1) % VOL_SURROUNDINGS)
        if (met->number[at] && memcmp(&met->of[at], &here, sizeof here) == 0)
            break; /* after all of them `at` is where it began */
    if (!met->number[at] || memcmp(&met->of[at], &here, sizeof here) != 0) {
        at = met->count++ % VOL_SURROUNDINGS;
        met->of[at] = here;
        met->number[at] = met->count;
    }
    met->last = at;
    return UINT32_MAX - met->number[at]; /* no brick has it */
}

/* No gradient of the brick is larger along axis a; it stands behind that plane's numbers. */
static inline real steepest_of(const real *gradients, int a) { return gradients[a * VOL_BRICK_STRIDE + VOL_BRICK_VALUES]; }

static inline void note_steepest(real *gradients)
{
    typedef lane_int eight_ints __attribute__((vector_size(8 * sizeof(lane_int))));
    const lane_int magnitude = (lane_int)(((uint64_t)1 << (8 * sizeof(lane_int) - 1)) - 1); /* without the sign's bit */
    for (int a = 0; a < 3; a++) {
        real *along = gradients + a * VOL_BRICK_STRIDE, all = real_abs(along[VOL_BRICK_VALUES - 1]);
        eight_ints most = {0}; /* of numbers that are not negative, the larger has the larger bits */
        for (int n = 0; n + 8 <= VOL_BRICK_VALUES; n += 8) {
            eight_ints bits = (eight_ints)load_eight(along + n) & magnitude, greater = bits > most;
            most = (bits & greater) | (most & ~greater);
        }
        eight each = (eight)most;
        for (int n = 0; n < 8; n++)
            all = real_max(all, each[n]);
        along[VOL_BRICK_VALUES] = all;
    }
}

static inline const real *brick_gradients(const VolGrid *grid, VolScratch *scratch, const real *const in_use[LANES],
                                          uint32_t number, const int32_t origin[3])
{
    AxisPlaces places[3];
    const VolBrick *bricks[27];
    uint32_t key = number + 1, numbers[27];
    real halo[BRICK_HALO * BRICK_HALO * BRICK_HALO], *out;
    /* A brick of one value may stand in many places, with other neighbours in each. */
    const bool shared = grid->bricks[number].shared;
    if (shared) {
        bricks_around(grid, origin, numbers, bricks);
        key = none_is_stored(bricks) ? key_of_surroundings(grid, &scratch->met, numbers, origin) : STORE_NOBODY;
    }
    if (store_place(&scratch->gradients, 3 * VOL_BRICK_STRIDE, in_use, key, &out))
        return out;
    if (gradients_in_place(grid, origin, out)) {
        note_steepest(out);
        return out;
    }
    for (int a = 0; a < 3; a++)
        axis_places(grid, a, origin[a], &places[a]);
    if (!shared)
        bricks_around(grid, origin, numbers, bricks);
    if (none_is_stored(bricks))
        gather_blocks(grid, bricks, places, halo);
    else
        gather_halo(grid, bricks, places, halo);
    bool finite = all_are_valid(halo);
    static const int step[3] = {BRICK_HALO * BRICK_HALO, BRICK_HALO, 1};
    for (int a = 0; a < 3; a++) {
        real *along = out + a * VOL_BRICK_STRIDE;
        if (finite)
            differences_along(halo, step[a], places[a].weight, a, along);
        else
            differences_beside_invalid(halo, step[a], places[a].weight, a, along);
    }
    note_steepest(out);
    return out;
}

#endif
