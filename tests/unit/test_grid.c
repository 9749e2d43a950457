/* Bricks against the voxels they were made from: values, shared layers, ranges, gradients. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"
#include "volume/grid_internal.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

static const VolAffine identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

/* What a brick holds at (x, y, z), 0..8. */
static double held(const VolGrid *grid, uint32_t number, int x, int y, int z)
{
    return vol_grid_held(grid, &grid->bricks[number], 0, x, y, z);
}

static bool same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

/* Every voxel of every cell of the domain: the brick's copy equals the voxel, and lies within the brick's range. */
static void check_bricks(const VolGrid *grid)
{
    for (int32_t x = grid->cell_min[0]; x <= grid->cell_max[0] + 1; x++)
        for (int32_t y = grid->cell_min[1]; y <= grid->cell_max[1] + 1; y++)
            for (int32_t z = grid->cell_min[2]; z <= grid->cell_max[2] + 1; z++)
                for (int n = 0; n < 8; n++) {
                    int32_t v[3] = {x, y, z}, cell[3] = {x - (n >> 2), y - (n >> 1 & 1), z - (n & 1)};
                    bool inside = true;
                    for (int a = 0; a < 3; a++)
                        inside = inside && cell[a] >= grid->cell_min[a] && cell[a] <= grid->cell_max[a];
                    if (!inside)
                        continue;
                    uint32_t number = vol_grid_brick_at(grid, cell[0], cell[1], cell[2]);
                    int at[3];
                    for (int a = 0; a < 3; a++)
                        at[a] = v[a] - (cell[a] & ~7);
                    double want = vol_grid_voxel(grid, x, y, z), got = held(grid, number, at[0], at[1], at[2]);
                    const VolBrick *brick = &grid->bricks[number];
                    if (!same(got, want))
                        FAIL("voxel %d %d %d: brick holds %g, voxel is %g", x, y, z, got, want);
                    if (isfinite(want) ? !(want >= brick->lo && want <= brick->hi) : !brick->invalid)
                        FAIL("voxel %d %d %d: %g outside the brick's range %g to %g", x, y, z, want, brick->lo, brick->hi);
                }
}

static void bricks_repeat_their_voxels(void)
{
    for (uint64_t seed = 1; seed <= 200; seed++) {
        Random r = {seed};
        RandomScene s;
        memset(&s, 0, sizeof s);
        s.grid = random_grid(&r, 0, &s);
        check_bricks(s.grid);
        vol_grid_free(s.grid);
    }
}

/* A volume of one large tile with a leaf at its corner. */
static void large_tiles_are_not_unfolded(void)
{
    VolGridSource source = {.index_to_world = identity, .background = 0, .box_min = {0, 0, 0}, .box_max = {511, 511, 511}};
    VolGridBuilder *builder;
    VolGrid *grid;
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int32_t x = 0; x < 512; x += 128)
        for (int32_t y = 0; y < 512; y += 128)
            for (int32_t z = 0; z < 512; z += 128)
                if (x || y || z)
                    CHECK(vol_grid_tile(builder, (int32_t[3]){x, y, z}, 128, 0.5, true, NULL) == VOL_OK);
    float values[512];
    uint64_t active[8];
    memset(active, 0xff, sizeof active);
    for (int n = 0; n < 512; n++)
        values[n] = (float)n;
    CHECK(vol_grid_leaf(builder, (int32_t[3]){120, 120, 120}, values, NULL, active, NULL) == VOL_OK);
    CHECK(vol_grid_finish(builder, &grid, NULL) == VOL_OK);
    CHECK(grid->stored_bricks < 10 && grid->brick_count < 200); /* what touches the leaf; a few that many faces share */
    CHECK(vol_grid_voxel(grid, 300, 400, 500) == 0.5);
    CHECK(vol_grid_voxel(grid, 120, 120, 121) == 1);
    CHECK(vol_grid_voxel(grid, 512, 5, 5) == 0);
    for (int n = 0; n < 9; n++) { /* the leaf's brick ends in the tile's values */
        uint32_t brick = vol_grid_brick_at(grid, 120, 120, 120);
        CHECK(held(grid, brick, 8, n, n) == vol_grid_voxel(grid, 128, 120 + n, 120 + n));
    }
    uint32_t edge = vol_grid_brick_at(grid, 504, 130, 130);
    CHECK(held(grid, edge, 8, 0, 0) == 0 && held(grid, edge, 7, 0, 0) == 0.5);
    vol_grid_free(grid);
}

/* ---- Tiles of every size ---- */

enum { ROOT = 4096, NODE = 128 };

static double hashed(uint64_t seed, int32_t x, int32_t y, int32_t z, int size)
{
    Random r = {seed ^ vol_cubes_hash(x, y, z) * 2654435761u ^ (uint64_t)size << 56};
    return random_unit(&r);
}

/* What there is of one size at a place: a tile of one of a few values, 0: nothing, or NAN: smaller things. */
static double piece(uint64_t seed, const int32_t v[3], int size)
{
    double u = hashed(seed, v[0] & -size, v[1] & -size, v[2] & -size, size);
    if (size == 1)
        return floor(u * 4) / 4;
    return u < 0.4 ? NAN : u < 0.5 ? 0 : u < 0.7 ? 0.5 : u < 0.9 ? 0.25 : 0.75;
}

/* Within two nodes of where the eight roots meet: elsewhere there is nothing smaller than they. */
static bool is_near(const int32_t v[3])
{
    bool near = true;
    for (int a = 0; a < 3; a++)
        near = near && v[a] >= ROOT - 2 * NODE && v[a] < ROOT + 2 * NODE;
    return near;
}

static double wanted(uint64_t seed, const int32_t v[3], int32_t side)
{
    static const int sizes[] = {ROOT, NODE, 8, 1};
    for (int n = 0; n < 4; n++) {
        double value = piece(seed, v, sizes[n]);
        for (int a = 0; a < 3; a++)
            if (v[a] < 0 || v[a] >= side)
                return 0;
        if (!isnan(value))
            return value;
        if (!is_near(v))
            return 0;
    }
    return NAN;
}

static void put_piece(VolGridBuilder *builder, uint64_t seed, const int32_t at[3])
{
    float values[512];
    uint64_t active[8];
    double tile = piece(seed, at, 8);
    memset(active, 0xff, sizeof active);
    for (int n = 0; n < 512; n++)
        values[n] = (float)piece(seed, (int32_t[3]){at[0] + (n >> 6), at[1] + (n >> 3 & 7), at[2] + (n & 7)}, 1);
    if (isnan(tile))
        CHECK(vol_grid_leaf(builder, at, values, NULL, active, NULL) == VOL_OK);
    else
        CHECK(vol_grid_tile(builder, at, 8, tile, true, NULL) == VOL_OK);
}

/* What lies in a cube of `size`: a tile, or nodes or bricks. */
static void put_pieces(VolGridBuilder *builder, uint64_t seed, const int32_t at[3], int size)
{
    int part = size == ROOT ? NODE : 8;
    double tile = piece(seed, at, size);
    if (!isnan(tile)) {
        CHECK(vol_grid_tile(builder, at, size, tile, true, NULL) == VOL_OK);
        return;
    }
    for (int32_t x = at[0]; x < at[0] + size; x += part)
        for (int32_t y = at[1]; y < at[1] + size; y += part)
            for (int32_t z = at[2]; z < at[2] + size; z += part) {
                const int32_t p[3] = {x, y, z};
                if (part == NODE && is_near(p))
                    put_pieces(builder, seed, p, NODE);
                else if (part == 8)
                    put_piece(builder, seed, p);
            }
}

/* Cells around a point: their bricks hold what was put there. */
static void check_around(const VolGrid *grid, uint64_t seed, const int32_t middle[3])
{
    enum { REACH = 10 };
    for (int n = 0; n < 8 * REACH * REACH * REACH; n++) {
        const int32_t cell[3] = {middle[0] - REACH + n % (2 * REACH), middle[1] - REACH + n / (2 * REACH) % (2 * REACH),
                                 middle[2] - REACH + n / (4 * REACH * REACH)};
        uint32_t number = vol_grid_brick_at(grid, cell[0], cell[1], cell[2]);
        const VolBrick *brick = &grid->bricks[number];
        for (int k = 0; k < 8; k++) {
            const int32_t v[3] = {cell[0] + (k >> 2), cell[1] + (k >> 1 & 1), cell[2] + (k & 1)};
            double want = wanted(seed, v, 2 * ROOT);
            double got = held(grid, number, v[0] - (cell[0] & ~7), v[1] - (cell[1] & ~7), v[2] - (cell[2] & ~7));
            if (want != got || want < brick->lo || want > brick->hi)
                FAIL("seed %d, voxel %d %d %d: %g for %g, brick from %g to %g", (int)seed, v[0], v[1], v[2], got, want,
                     brick->lo, brick->hi);
        }
    }
}

static void blocks_end_in_what_lies_beside_them(void)
{
    for (uint64_t seed = 1; seed <= 6; seed++) {
        VolGridSource source = {.index_to_world = identity, .box_max = {2 * ROOT - 1, 2 * ROOT - 1, 2 * ROOT - 1}};
        VolGridBuilder *builder;
        VolGrid *grid;
        if (vol_grid_begin(&source, &builder, NULL))
            abort();
        for (int k = 0; k < 8; k++)
            put_pieces(builder, seed, (int32_t[3]){(k >> 2) * ROOT, (k >> 1 & 1) * ROOT, (k & 1) * ROOT}, ROOT);
        CHECK(vol_grid_finish(builder, &grid, NULL) == VOL_OK);
        for (int n = 0; n < 27; n++) { /* where eight nodes meet, among them the roots' corner */
            const int32_t at[3] = {ROOT + (n % 3 - 1) * NODE, ROOT + (n / 3 % 3 - 1) * NODE, ROOT + (n / 9 - 1) * NODE};
            check_around(grid, seed, at);
        }
        for (int a = 0; a < 3; a++) { /* the roots' faces and edges, far from all else, and the domain's corners */
            int32_t at[3] = {1000, 1000, 1000}, edge[3] = {ROOT, ROOT, ROOT};
            at[a] = ROOT;
            edge[a] = 7000;
            check_around(grid, seed, at);
            check_around(grid, seed, edge);
        }
        vol_grid_free(grid);
    }
}

static VolGrid *ramp(bool box, const int32_t lo[3], const int32_t hi[3], double gx, double gy, double gz, bool wide)
{
    VolGridSource source = {.index_to_world = identity, .box = box, .as_double = wide};
    memcpy(source.box_min, lo, sizeof source.box_min);
    memcpy(source.box_max, hi, sizeof source.box_max);
    VolGridBuilder *builder;
    VolGrid *grid;
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (int32_t x = lo[0] & ~7; x <= hi[0]; x += 8)
        for (int32_t y = lo[1] & ~7; y <= hi[1]; y += 8)
            for (int32_t z = lo[2] & ~7; z <= hi[2]; z += 8) {
                double values[512];
                float narrow[512];
                uint64_t active[8];
                memset(active, 0xff, sizeof active);
                for (int n = 0; n < 512; n++) {
                    values[n] = gx * (x + (n >> 6)) + gy * (y + (n >> 3 & 7)) + gz * (z + (n & 7));
                    narrow[n] = (float)values[n];
                }
                if (vol_grid_leaf(builder, (int32_t[3]){x, y, z}, wide ? NULL : narrow, wide ? values : NULL, active, NULL))
                    abort();
            }
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

static void gradients_are_central_and_one_sided_at_faces(void)
{
    const int32_t lo[3] = {-3, 5, 7}, hi[3] = {12, 20, 22};
    VolGrid *grid = ramp(true, lo, hi, 0.25, -0.5, 2, false);
    for (int n = 0; n < 27; n++) {
        int32_t at[3];
        for (int a = 0, d = n; a < 3; a++, d /= 3)
            at[a] = d % 3 == 0 ? lo[a] : d % 3 == 1 ? hi[a] : lo[a] + 3;
        double g[3];
        vol_grid_voxel_gradient(grid, at[0], at[1], at[2], g);
        CHECK(g[0] == 0.25 && g[1] == -0.5 && g[2] == 2);
    }
    vol_grid_free(grid);
}

static void a_box_of_one_voxel_is_constant_along_it(void)
{
    for (int32_t base = -9; base <= 9; base++) {
        const int32_t lo[3] = {base, 2, base}, hi[3] = {base, 12, base};
        VolGrid *grid = ramp(true, lo, hi, 0.25, 0.5, 2, false);
        double g[3];
        check_bricks(grid);
        CHECK(grid->thin[0] && !grid->thin[1] && grid->thin[2]);
        CHECK(grid->domain_min[0] == base - 0.5 && grid->domain_max[2] == base + 0.5);
        CHECK(grid->cell_min[0] == base - 1 && grid->cell_max[0] == base);
        vol_grid_voxel_gradient(grid, base, 5, base, g);
        CHECK(g[0] == 0 && g[1] == 0.5 && g[2] == 0);
        vol_grid_free(grid);
    }
}

static void doubles_are_kept(void)
{
    const int32_t lo[3] = {0, 0, 0}, hi[3] = {9, 9, 9};
    VolGrid *grid = ramp(true, lo, hi, 0x1p-40 + 1, 0, 0, true);
    CHECK(vol_grid_voxel(grid, 1, 3, 9) == 0x1p-40 + 1);
    check_bricks(grid);
    vol_grid_free(grid);
}

/* ---- threads ---- */

/* The blocks of 8^3 voxels that a random grid's domain touches, as leaves. */
typedef struct Blocks {
    const VolGrid *from;
    VolGridBuilder *builder;
    int32_t lo[3];
    size_t dims[3], count;
} Blocks;

static void origin_of(const Blocks *blocks, size_t n, int32_t origin[3])
{
    origin[0] = blocks->lo[0] + 8 * (int32_t)(n / (blocks->dims[1] * blocks->dims[2]));
    origin[1] = blocks->lo[1] + 8 * (int32_t)(n / blocks->dims[2] % blocks->dims[1]);
    origin[2] = blocks->lo[2] + 8 * (int32_t)(n % blocks->dims[2]);
}

static VolStatus put_block(void *user, size_t index, int thread, VolError *err)
{
    const Blocks *blocks = user;
    const VolGrid *from = blocks->from;
    int32_t origin[3];
    float values[512];
    uint64_t active[8] = {0};
    (void)thread;
    origin_of(blocks, index, origin);
    for (int n = 0; n < 512; n++) {
        const int32_t at[3] = {origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && at[a] >= from->voxel_min[a] && at[a] <= from->voxel_max[a];
        values[n] = inside ? (float)vol_grid_voxel(from, at[0], at[1], at[2]) : -7;
        if (inside)
            active[n >> 6] |= (uint64_t)1 << (n & 63);
    }
    return vol_grid_leaf(blocks->builder, origin, values, NULL, active, err);
}

/* Over threads leaves are placed first, and come in whatever order the threads take. */
static VolGrid *rebuild(const VolGrid *from, bool wide, int threads)
{
    VolGridSource source = {.index_to_world = identity, .background = from->background, .as_double = wide,
                            .box = from->domain == VOL_DOMAIN_BOX, .threads = threads};
    Blocks blocks = {.from = from, .count = 1};
    VolGrid *grid;
    for (int a = 0; a < 3; a++) {
        source.box_min[a] = from->voxel_min[a];
        source.box_max[a] = from->voxel_max[a];
        blocks.lo[a] = from->voxel_min[a] & ~7;
        blocks.dims[a] = (size_t)((from->voxel_max[a] >> 3) - (from->voxel_min[a] >> 3)) + 1;
        blocks.count *= blocks.dims[a];
    }
    if (vol_grid_begin(&source, &blocks.builder, NULL))
        abort();
    for (size_t n = 0; n < blocks.count && threads > 1; n++) {
        int32_t origin[3];
        origin_of(&blocks, n, origin);
        CHECK(vol_grid_place(blocks.builder, origin, NULL) == VOL_OK);
    }
    CHECK(vol_parallel(threads, blocks.count, put_block, &blocks, NULL) == VOL_OK);
    if (vol_grid_finish(blocks.builder, &grid, NULL))
        abort();
    return grid;
}

static void check_same_grid(const VolGrid *a, const VolGrid *b)
{
    size_t size = a->is_double ? sizeof(double) : sizeof(float);
    CHECK(a->brick_count == b->brick_count && a->stored_bricks == b->stored_bricks && a->node_count == b->node_count);
    CHECK(a->bad_voxels == b->bad_voxels);
    if (a->brick_count != b->brick_count || a->stored_bricks != b->stored_bricks || a->node_count != b->node_count)
        return;
    CHECK(memcmp(a->values, b->values, a->stored_bricks * VOL_BRICK_STRIDE * size) == 0);
    for (size_t n = 0; n < a->brick_count; n++) {
        const VolBrick *p = &a->bricks[n], *q = &b->bricks[n];
        CHECK(p->lo == q->lo && p->hi == q->hi && p->uniform == q->uniform && p->storage == q->storage &&
              p->invalid == q->invalid);
    }
    for (size_t n = 0; n < a->node_count; n++)
        CHECK(memcmp(a->nodes[n].at, b->nodes[n].at, sizeof a->nodes[n].at) == 0 &&
              memcmp(a->nodes[n].bricks, b->nodes[n].bricks, VOL_NODE_ENTRIES * sizeof(uint32_t)) == 0);
}

static void threads_build_the_same_grid(void)
{
    for (uint64_t seed = 1; seed <= 60; seed++) {
        Random r = {seed};
        RandomScene s;
        memset(&s, 0, sizeof s);
        s.grid = random_grid(&r, 0, &s);
        VolGrid *one = rebuild(s.grid, seed % 2, 1), *four = rebuild(s.grid, seed % 2, 4);
        check_bricks(one);
        check_same_grid(one, four);
        CHECK(one->bad_voxels == s.grid->bad_voxels);
        vol_grid_free(one);
        vol_grid_free(four);
        vol_grid_free(s.grid);
    }
}

/* ---- finding nodes ---- */

/* One leaf in each of the nodes at `at`. */
static VolGrid *leaves_in_nodes(const int32_t (*at)[3], size_t count)
{
    VolGridSource source = {.index_to_world = identity};
    VolGridBuilder *builder;
    VolGrid *grid;
    float values[512];
    uint64_t active[8];
    memset(active, 0xff, sizeof active);
    for (int a = 0; a < 3; a++) {
        source.box_min[a] = INT32_MAX;
        source.box_max[a] = INT32_MIN;
        for (size_t n = 0; n < count; n++) {
            int32_t lo = at[n][a] * VOL_NODE_CELLS;
            source.box_min[a] = lo < source.box_min[a] ? lo : source.box_min[a];
            source.box_max[a] = lo + 127 > source.box_max[a] ? lo + 127 : source.box_max[a];
        }
    }
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    for (size_t n = 0; n < count; n++) {
        const int32_t origin[3] = {at[n][0] * VOL_NODE_CELLS + 64, at[n][1] * VOL_NODE_CELLS + 64,
                                   at[n][2] * VOL_NODE_CELLS + 64};
        for (int i = 0; i < 512; i++)
            values[i] = (float)(n + 1);
        CHECK(vol_grid_leaf(builder, origin, values, NULL, active, NULL) == VOL_OK);
    }
    if (vol_grid_finish(builder, &grid, NULL))
        abort();
    return grid;
}

static void the_table_and_the_hash_find_the_same_nodes(void)
{
    Random r = {1};
    for (int round = 0; round < 20; round++) {
        int32_t at[40][3], base[3];
        for (int a = 0; a < 3; a++)
            base[a] = random_below(&r, 2000) - 1000;
        for (int n = 0; n < 40; n++)
            for (int a = 0; a < 3; a++)
                at[n][a] = base[a] + random_below(&r, 6);
        VolGrid *grid = leaves_in_nodes((const int32_t(*)[3])at, 40);
        CHECK(grid->table && !grid->hash);
        CHECK(vol_grid_rehash(grid, 1024, NULL) == VOL_OK);
        size_t found = 0;
        for (int32_t x = base[0] - 2; x < base[0] + 8; x++)
            for (int32_t y = base[1] - 2; y < base[1] + 8; y++)
                for (int32_t z = base[2] - 2; z < base[2] + 8; z++) {
                    const VolNode *node = vol_grid_node(grid, x, y, z);
                    CHECK(node == vol_grid_hashed_node(grid, x, y, z));
                    CHECK(!node || (node->at[0] == x && node->at[1] == y && node->at[2] == z));
                    found += node != NULL;
                }
        CHECK(found == grid->node_count && found > 20);
        static const int32_t far[] = {INT32_MIN / 128, -1, 0, 1, INT32_MAX / 128}; /* of where the nodes are, around */
        for (int n = 0; n < 125; n++) {
            int32_t x = far[n % 5], y = far[n / 5 % 5], z = far[n / 25];
            CHECK(vol_grid_node(grid, x, y, z) == vol_grid_hashed_node(grid, x, y, z));
        }
        vol_grid_free(grid);
    }
}

/* Two leaves so far apart that a table would be huge. */
static void distant_leaves_are_hashed(void)
{
    static const int32_t at[2][3] = {{-500, 3, 400}, {900, -700, 5}};
    VolGrid *grid = leaves_in_nodes(at, 2);
    CHECK(!grid->table && grid->hash && grid->node_count == 2);
    for (int n = 0; n < 2; n++)
        CHECK(vol_grid_voxel(grid, at[n][0] * 128 + 66, at[n][1] * 128 + 65, at[n][2] * 128 + 71) == n + 1);
    CHECK(vol_grid_voxel(grid, 0, 0, 0) == 0);
    check_same_grid(grid, grid);
    vol_grid_free(grid);
}

/* ---- the pool ---- */

static void the_pool_is_aligned_and_may_be_read_past_its_end(void)
{
    for (int wide = 0; wide < 2; wide++)
        for (int32_t side = 1; side <= 200; side = 2 * side + 5) {
            const int32_t lo[3] = {0, 0, 0}, hi[3] = {side, side, side};
            VolGrid *grid = ramp(true, lo, hi, 1, 2, 3, wide);
            size_t bytes = grid->stored_bricks * VOL_BRICK_STRIDE * (wide ? 8 : 4);
            const unsigned char *end = (const unsigned char *)grid->values + bytes;
            CHECK((uintptr_t)grid->values % ((size_t)1 << 21) == 0);
            CHECK(bytes + 64 <= grid->pool.bytes);
            for (int n = 0; n < 64; n++)
                CHECK(end[n] == 0);
            check_bricks(grid);
            vol_grid_free(grid);
        }
}

static void what_cannot_be_served_is_refused(void)
{
    VolGridBuilder *builder;
    VolError err;
    VolGridSource flat = {.box_max = {1, 1, 1}};
    CHECK(vol_grid_begin(&flat, &builder, &err) == VOL_BAD_INPUT);
    VolGridSource far = {.index_to_world = identity, .box_max = {INT32_MAX, 1, 1}};
    CHECK(vol_grid_begin(&far, &builder, &err) == VOL_BAD_INPUT);
    VolGridSource inverted = {.index_to_world = identity, .box_min = {2, 0, 0}, .box_max = {1, 1, 1}};
    CHECK(vol_grid_begin(&inverted, &builder, &err) == VOL_BAD_INPUT);
}

int main(void)
{
    RUN(bricks_repeat_their_voxels);
    RUN(large_tiles_are_not_unfolded);
    RUN(blocks_end_in_what_lies_beside_them);
    RUN(gradients_are_central_and_one_sided_at_faces);
    RUN(a_box_of_one_voxel_is_constant_along_it);
    RUN(doubles_are_kept);
    RUN(threads_build_the_same_grid);
    RUN(the_table_and_the_hash_find_the_same_nodes);
    RUN(distant_leaves_are_hashed);
    RUN(the_pool_is_aligned_and_may_be_read_past_its_end);
    RUN(what_cannot_be_served_is_refused);
    return test_end();
}
