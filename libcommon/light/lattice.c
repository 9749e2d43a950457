/* Point p along an axis lies at base + p h in the volume's index space.  The cells of the lattice that it is a corner of, or
 * that lie one voxel around, reach from p - 2 to p + 2: it counts if any cell of the volume between these places shows
 * something.  "Any" is taken axis by axis, along z, then y, then x. */
#include "light/lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"
#include "base/pool.h"

enum { SIDE = VOL_LIGHT_LEAF, MOST_POINTS = 65536, BLOCK = 16, REACH = 2 };

/* Which cells of a brick show something: bit (x*8 + y)*8 + z. */
typedef struct BrickCells {
    uint64_t bits[8];
} BrickCells;

typedef struct Marking {
    const VolScene *scene;
    const VolLight *light;
    VolLightLattice *lattice;
    double base[3], h[3];
    BrickCells *bricks; /* of each brick of the grid */
    size_t row;         /* cells along y and along z that points of a leaf reach, multiplied */
    unsigned char *rows;
    double spot_sine, diagonal;
} Marking;

/* ---- Cells of the volume ---- */

/* The voxels of a brick, 9^3 of them. */
static void brick_values(const VolGrid *grid, const VolBrick *brick, double values[VOL_BRICK_VALUES])
{
    size_t at = (size_t)brick->storage * VOL_BRICK_STRIDE;
    for (int n = 0; n < VOL_BRICK_VALUES; n++) {
        int x = n / (VOL_BRICK_SIDE * VOL_BRICK_SIDE), y = n / VOL_BRICK_SIDE % VOL_BRICK_SIDE, z = n % VOL_BRICK_SIDE;
        unsigned octant = (unsigned)(x == SIDE) << 2 | (unsigned)(y == SIDE) << 1 | (unsigned)(z == SIDE);
        if (brick->storage == VOL_NO_STORAGE)
            values[n] = brick->octants ? grid->octants[brick->octants - 1].value[octant] : brick->uniform;
        else
            values[n] = grid->is_double ? ((const double *)grid->values)[at + (size_t)n]
                                        : (double)((const float *)grid->values)[at + (size_t)n];
    }
}

static bool cell_shows(const VolTfCompiled *tf, const double *values, int x, int y, int z)
{
    double lo = INFINITY, hi = -INFINITY;
    for (int n = 0; n < 8; n++) {
        double v = values[((x + (n >> 2)) * VOL_BRICK_SIDE + y + (n >> 1 & 1)) * VOL_BRICK_SIDE + z + (n & 1)];
        if (!isfinite(v))
            return false;
        lo = fmin(lo, v);
        hi = fmax(hi, v);
    }
    return vol_tf_range_visible(tf, lo, hi);
}

enum { BRICKS_PER_ITEM = 64 };

static VolStatus mark_bricks(void *user, size_t index, int thread, VolError *err)
{
    (void)thread, (void)err;
    Marking *m = user;
    const VolGrid *grid = m->scene->volume.grid;
    size_t first = index * BRICKS_PER_ITEM, end = first + BRICKS_PER_ITEM;
    double values[VOL_BRICK_VALUES];
    for (size_t b = first; b < end && b < grid->brick_count; b++) {
        const VolBrick *brick = &grid->bricks[b];
        if (!vol_tf_range_visible(m->scene->tf, brick->lo, brick->hi))
            continue;
        if (vol_brick_is_uniform(brick)) {
            memset(m->bricks[b].bits, isfinite(brick->uniform) ? 0xff : 0, sizeof m->bricks[b].bits);
            continue;
        }
        brick_values(grid, brick, values);
        for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++)
            if (cell_shows(m->scene->tf, values, n / 64, n / 8 % 8, n % 8))
                m->bricks[b].bits[n / 64] |= UINT64_C(1) << n % 64;
    }
    return VOL_OK;
}

/* ---- Points of a leaf ---- */

typedef struct Reach {
    int32_t first[SIDE], last[SIDE]; /* cells of the volume that concern each point */
    int32_t lo, hi;                  /* all of them, within the domain */
} Reach;

static Reach reach_along(const Marking *m, int a, int32_t origin)
{
    const VolGrid *grid = m->scene->volume.grid;
    Reach r;
    for (int n = 0; n < SIDE; n++) {
        double least = m->base[a] + (origin + n - REACH) * m->h[a], most = m->base[a] + (origin + n + REACH) * m->h[a];
        r.first[n] = (int32_t)fmin(fmax(floor(least), grid->cell_min[a]), (double)grid->cell_max[a] + 1);
        r.last[n] = (int32_t)fmax(fmin(ceil(most) - 1, grid->cell_max[a]), (double)grid->cell_min[a] - 1);
    }
    r.lo = r.first[0];
    r.hi = r.last[SIDE - 1];
    return r;
}

/* Cells (x, y, z) of the slice: true where they show something. */
static bool fill_slice(const Marking *m, int32_t x, const Reach *ry, const Reach *rz, unsigned char *slice)
{
    const VolGrid *grid = m->scene->volume.grid;
    const int32_t ny = ry->hi - ry->lo + 1, nz = rz->hi - rz->lo + 1;
    bool any = false;
    memset(slice, 0, (size_t)ny * (size_t)nz);
    for (int32_t by = ry->lo >> 3; by <= ry->hi >> 3; by++)
        for (int32_t bz = rz->lo >> 3; bz <= rz->hi >> 3; bz++) {
            uint64_t bits = m->bricks[vol_grid_brick_number(grid, x >> 3, by, bz)].bits[x & 7];
            if (!bits)
                continue;
            any = true;
            for (int n = 0; n < 64; n++) {
                int32_t y = by * 8 + n / 8 - ry->lo, z = bz * 8 + n % 8 - rz->lo;
                if (bits >> n & 1 && y >= 0 && y < ny && z >= 0 && z < nz)
                    slice[(size_t)y * (size_t)nz + (size_t)z] = 1;
            }
        }
    return any;
}

/* The points (y, z) of a leaf that reach any marked cell of the slice. */
static uint64_t points_of_slice(const Reach *ry, const Reach *rz, const unsigned char *slice)
{
    const int32_t nz = rz->hi - rz->lo + 1;
    uint64_t out = 0;
    for (int32_t y = ry->lo; y <= ry->hi; y++) {
        const unsigned char *row = slice + (size_t)(y - ry->lo) * (size_t)nz;
        unsigned along = 0;
        for (int n = 0; n < SIDE; n++)
            if (rz->first[n] <= rz->last[n] &&
                memchr(row + rz->first[n] - rz->lo, 1, (size_t)(rz->last[n] - rz->first[n] + 1)))
                along |= 1u << n;
        for (int n = 0; n < SIDE && along; n++)
            if (y >= ry->first[n] && y <= ry->last[n])
                out |= (uint64_t)along << 8 * n;
    }
    return out;
}

/* How far a place is from a spot's cone: 0 or less within. */
static double distance_to_cone(const Marking *m, VolVec3 place)
{
    const VolLight *light = m->light;
    VolVec3 way = vol_sub(place, light->position);
    double along = vol_dot(way, light->direction), all = vol_dot(way, way);
    double across = sqrt(fmax(all - along * along, 0));
    if (along * light->cos_edge + across * m->spot_sine < 0)
        return sqrt(all);
    return across * light->cos_edge - along * m->spot_sine;
}

static void leave_out_dark(const Marking *m, VolLightLeaf *leaf)
{
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++)
        if (vol_light_leaf_has(leaf, n) && distance_to_cone(m, vol_light_point(m->lattice, leaf, n)) > m->diagonal)
            leaf->active[n / 64] &= ~(UINT64_C(1) << n % 64);
}

static void leave_out_beyond(const VolLightLattice *lattice, VolLightLeaf *leaf)
{
    const int32_t *lo = lattice->lo, *hi = lattice->hi, *o = leaf->origin;
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++) {
        const int32_t p[3] = {o[0] + n / 64, o[1] + n / 8 % 8, o[2] + n % 8};
        for (int a = 0; a < 3; a++)
            if (p[a] < lo[a] || p[a] > hi[a])
                leaf->active[n / 64] &= ~(UINT64_C(1) << n % 64);
    }
}

static VolStatus mark_leaf(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    Marking *m = user;
    VolLightLeaf *leaf = &m->lattice->leaves[index];
    unsigned char *slice = m->rows + (size_t)thread * m->row;
    Reach r[3];
    for (int a = 0; a < 3; a++) {
        r[a] = reach_along(m, a, leaf->origin[a]);
        if (r[a].lo > r[a].hi)
            return VOL_OK;
    }
    for (int32_t x = r[0].lo; x <= r[0].hi; x++) {
        uint64_t points = fill_slice(m, x, &r[1], &r[2], slice) ? points_of_slice(&r[1], &r[2], slice) : 0;
        for (int n = 0; n < SIDE && points; n++)
            if (x >= r[0].first[n] && x <= r[0].last[n])
                leaf->active[n] |= points;
    }
    leave_out_beyond(m->lattice, leaf);
    if (m->light->kind == VOL_LIGHT_SPOT)
        leave_out_dark(m, leaf);
    return VOL_OK;
}

/* ---- Leaves ---- */

/* The range of nodes that cells concerning the leaves from `from` to `to` lie in shows something, perhaps. */
static bool block_may_show(const Marking *m, const int32_t from[3], const int32_t to[3])
{
    const VolGrid *grid = m->scene->volume.grid;
    int32_t lo[3], hi[3];
    if (grid->roots.count || m->bricks[0].bits[0])
        return true;
    for (int a = 0; a < 3; a++) {
        lo[a] = reach_along(m, a, from[a]).lo >> 7;
        hi[a] = reach_along(m, a, to[a]).hi >> 7;
    }
    for (int32_t x = lo[0]; x <= hi[0]; x++)
        for (int32_t y = lo[1]; y <= hi[1]; y++)
            for (int32_t z = lo[2]; z <= hi[2]; z++)
                if (vol_grid_node(grid, x, y, z))
                    return true;
    return false;
}

static VolStatus add_leaf(VolLightLattice *lattice, size_t *capacity, const int32_t origin[3], VolError *err)
{
    if (lattice->leaf_count == *capacity) {
        size_t more = *capacity ? 2 * *capacity : 1024;
        VolLightLeaf *leaves = vol_resize(lattice->leaves, more, sizeof *leaves);
        if (!leaves)
            return vol_fail_memory(err, more * sizeof *leaves);
        lattice->leaves = leaves;
        *capacity = more;
    }
    VolLightLeaf *leaf = &lattice->leaves[lattice->leaf_count++];
    *leaf = (VolLightLeaf){0};
    memcpy(leaf->origin, origin, sizeof leaf->origin);
    return VOL_OK;
}

/* Origins of the leaves of one block, as far as the box goes. */
static VolStatus add_block(Marking *m, size_t *capacity, const int32_t from[3], const int32_t to[3], VolError *err)
{
    VolStatus status = VOL_OK;
    if (!block_may_show(m, from, to))
        return VOL_OK;
    for (int32_t x = from[0]; x <= to[0] && !status; x += SIDE)
        for (int32_t y = from[1]; y <= to[1] && !status; y += SIDE)
            for (int32_t z = from[2]; z <= to[2] && !status; z += SIDE)
                status = add_leaf(m->lattice, capacity, (const int32_t[3]){x, y, z}, err);
    return status;
}

static VolStatus add_leaves(Marking *m, VolError *err)
{
    enum { STEP = BLOCK * SIDE };
    const VolLightLattice *lattice = m->lattice;
    int32_t first[3], last[3];
    size_t capacity = 0;
    VolStatus status = VOL_OK;
    for (int a = 0; a < 3; a++) {
        first[a] = lattice->lo[a] & ~(SIDE - 1);
        last[a] = lattice->hi[a] & ~(SIDE - 1);
    }
    for (int32_t x = first[0]; x <= last[0] && !status; x += STEP)
        for (int32_t y = first[1]; y <= last[1] && !status; y += STEP)
            for (int32_t z = first[2]; z <= last[2] && !status; z += STEP) {
                const int32_t from[3] = {x, y, z};
                int32_t to[3];
                for (int a = 0; a < 3; a++)
                    to[a] = from[a] + STEP - SIDE < last[a] ? from[a] + STEP - SIDE : last[a];
                status = add_block(m, &capacity, from, to, err);
            }
    return status;
}

static int compare_leaves(const void *a, const void *b)
{
    const int32_t *x = ((const VolLightLeaf *)a)->origin, *y = ((const VolLightLeaf *)b)->origin;
    for (int i = 0; i < 3; i++)
        if (x[i] != y[i])
            return x[i] < y[i] ? -1 : 1;
    return 0;
}

static void keep_active(VolLightLattice *lattice)
{
    size_t kept = 0;
    for (size_t i = 0; i < lattice->leaf_count; i++) {
        unsigned points = 0;
        for (int n = 0; n < 8; n++)
            points += (unsigned)__builtin_popcountll(lattice->leaves[i].active[n]);
        lattice->points += points;
        if (points)
            lattice->leaves[kept++] = lattice->leaves[i];
    }
    lattice->leaf_count = kept;
    if (kept)
        qsort(lattice->leaves, kept, sizeof *lattice->leaves, compare_leaves);
}

/* ---- The lattice ---- */

static VolStatus settle(Marking *m, int64_t resolution, VolError *err)
{
    const VolVolume *volume = &m->scene->volume;
    const VolAffine *world = vol_volume_to_world(volume);
    VolLightLattice *lattice = m->lattice;
    double lo[3], hi[3], extent[3], longest = 0;
    if (resolution && (resolution < 2 || resolution > MOST_POINTS))
        return vol_fail(err, VOL_USAGE, "a lattice of %lld points: want 2 to %d", (long long)resolution, MOST_POINTS);
    vol_volume_domain(volume, lo, hi);
    for (int a = 0; a < 3; a++) {
        extent[a] = (hi[a] - lo[a]) * vol_length(vol_vec3(world->m[a][0], world->m[a][1], world->m[a][2]));
        longest = fmax(longest, extent[a]);
    }
    for (int a = 0; a < 3; a++) {
        double count = fmax(2, floor((double)resolution * extent[a] / longest + 0.5));
        m->base[a] = resolution ? lo[a] : 0;
        m->h[a] = resolution ? (hi[a] - lo[a]) / (count - 1) : 1;
        lattice->lo[a] = resolution ? 0 : (int32_t)floor(lo[a]);
        lattice->hi[a] = resolution ? (int32_t)count - 1 : (int32_t)ceil(hi[a]);
    }
    VolVec3 first = vol_apply(world, vol_vec3(m->base[0], m->base[1], m->base[2]));
    lattice->index_to_world = (VolAffine){{{0}, {0}, {0}, {first.x, first.y, first.z}}};
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            lattice->index_to_world.m[a][b] = m->h[a] * world->m[a][b];
    return VOL_OK;
}

static void settle_spot(Marking *m)
{
    const double(*v)[3] = m->lattice->index_to_world.m;
    m->spot_sine = sqrt(fmax(1 - m->light->cos_edge * m->light->cos_edge, 0));
    for (int n = 0; n < 4; n++) {
        double sy = n & 1 ? -1 : 1, sz = n & 2 ? -1 : 1;
        m->diagonal = fmax(m->diagonal, vol_length(vol_vec3(v[0][0] + sy * v[1][0] + sz * v[2][0],
                                                            v[0][1] + sy * v[1][1] + sz * v[2][1],
                                                            v[0][2] + sy * v[1][2] + sz * v[2][2])));
    }
}

/* The most cells that the points of one leaf reach along an axis. */
static size_t most_reached(const Marking *m, int a)
{
    const VolGrid *grid = m->scene->volume.grid;
    double cells = fmin((SIDE + 2 * REACH) * m->h[a] + 3, (double)grid->cell_max[a] - grid->cell_min[a] + 2);
    return (size_t)cells;
}

VolStatus vol_light_lattice_new(const VolScene *scene, const VolLight *light, int64_t resolution, int threads,
                                VolLightLattice *out, VolError *err)
{
    const VolGrid *grid = scene->volume.grid;
    Marking m = {.scene = scene, .light = light, .lattice = out};
    *out = (VolLightLattice){0};
    VolStatus status = settle(&m, resolution, err);
    if (status || grid->empty)
        return status;
    settle_spot(&m);
    m.row = most_reached(&m, 1) * most_reached(&m, 2);
    m.bricks = vol_alloc_zero(grid->brick_count, sizeof *m.bricks);
    m.rows = vol_alloc((size_t)threads, m.row);
    if (!m.bricks || !m.rows)
        status = vol_fail_memory(err, grid->brick_count * sizeof *m.bricks + (size_t)threads * m.row);
    if (!status)
        status = vol_parallel(threads, (grid->brick_count + BRICKS_PER_ITEM - 1) / BRICKS_PER_ITEM, mark_bricks, &m, err);
    if (!status)
        status = add_leaves(&m, err);
    if (!status)
        status = vol_parallel(threads, out->leaf_count, mark_leaf, &m, err);
    if (!status)
        keep_active(out);
    free(m.bricks);
    free(m.rows);
    return status;
}

void vol_light_lattice_free(VolLightLattice *lattice)
{
    free(lattice->leaves);
    *lattice = (VolLightLattice){0};
}

VolVec3 vol_light_point(const VolLightLattice *lattice, const VolLightLeaf *leaf, int n)
{
    const int32_t *o = leaf->origin;
    return vol_apply(&lattice->index_to_world, vol_vec3(o[0] + n / 64, o[1] + n / 8 % 8, o[2] + n % 8));
}
