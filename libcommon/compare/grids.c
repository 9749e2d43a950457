/* Grids: what they are, then voxel by voxel.
 *
 * The same voxels may be stored as leaves in one file and as tiles in the other, so trees are not compared but the function
 * from voxels to values.  The first grid is kept in memory, the second streams past:
 *
 *   - a leaf of the second is compared with the leaf, tile or background of the first that lies there;
 *   - leaves of the first that met none are compared with the tile or background of the second;
 *   - tiles against the tile of the same size or larger that lies there, else the rest of the tile that finer cubes of the
 *     other left over, against the other's background. */
#include "compare/grid_index.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compare/compare.h"

typedef struct Side {
    VolVdbGridInfo info;
    VolGridIndex index; /* of the second grid: tiles alone */
} Side;

typedef struct GridPair {
    const VolTolerance *tolerance;
    int components;
    Side side[2];
    VolDeviation deviation;
    uint64_t states; /* voxels active in one grid alone */
    int64_t state_at[3];
} GridPair;

/* ---- Values -------------------------------------------------------------------------------------------------------- */

static void compare_voxel(GridPair *pair, const double *a, bool a_active, const double *b, bool b_active, uint64_t weight,
                          const int64_t at[3])
{
    for (int c = 0; c < pair->components; c++)
        vol_deviation_add(&pair->deviation, pair->tolerance, a[c], b[c], weight, at);
    if (a_active != b_active) {
        if (pair->states == 0)
            memcpy(pair->state_at, at, sizeof pair->state_at);
        pair->states += weight;
    }
}

static bool bit(const uint64_t active[8], int n) { return active[n >> 6] >> (n & 63) & 1; }

/* A step of 0 through `a_values` stands for a constant. */
typedef struct Block {
    const double *values;
    int step;
    const uint64_t *active; /* NULL: `all` tells */
    bool all;
} Block;

static Block constant(const double *value, bool active) { return (Block){.values = value, .all = active}; }

static Block leaf_block(const GridPair *pair, const double *values, const uint64_t *active)
{
    return (Block){.values = values, .step = pair->components, .active = active};
}

static void compare_blocks(GridPair *pair, const int32_t origin[3], Block a, Block b)
{
    for (int n = 0; n < 512; n++) {
        const int64_t at[3] = {origin[0] + (n >> 6), origin[1] + (n >> 3 & 7), origin[2] + (n & 7)};
        compare_voxel(pair, a.values + n * a.step, a.active ? bit(a.active, n) : a.all, b.values + n * b.step,
                      b.active ? bit(b.active, n) : b.all, 1, at);
    }
}

/* What the grid has at a leaf's place; a tile there is told that this much of it has been compared. */
static Block at_leaf(const GridPair *pair, int side, const int32_t origin[3])
{
    VolCube *cube = vol_grid_index_find(&pair->side[side].index, origin, 8);
    if (!cube)
        return constant(pair->side[side].info.background, false);
    if (cube->values) {
        cube->done = true;
        return leaf_block(pair, cube->values, cube->active);
    }
    cube->covered += 512;
    return constant(cube->value, cube->tile_active);
}

/* ---- The visits ---------------------------------------------------------------------------------------------------- */

static VolStatus keep_tile(Side *side, const int32_t origin[3], int32_t size, const double value[3], bool active,
                           VolError *err)
{
    VolCube *cube = vol_grid_index_add(&side->index, origin, size);
    if (!cube)
        return vol_fail_memory(err, sizeof *cube);
    memcpy(cube->value, value, sizeof cube->value);
    cube->tile_active = active;
    return VOL_OK;
}

static VolStatus begin_a(void *user, const VolVdbGridInfo *info, VolError *err)
{
    (void)err;
    ((GridPair *)user)->side[0].info = *info;
    return VOL_OK;
}

static VolStatus leaf_a(void *user, const int32_t origin[3], const double *values, const uint64_t active[8], VolError *err)
{
    GridPair *pair = user;
    size_t size = 512 * (size_t)pair->components * sizeof *values;
    VolCube *cube = vol_grid_index_add(&pair->side[0].index, origin, 8);
    if (!cube || !(cube->values = vol_alloc(size, 1)))
        return vol_fail_memory(err, size);
    memcpy(cube->values, values, size);
    memcpy(cube->active, active, sizeof cube->active);
    return VOL_OK;
}

static VolStatus tile_a(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                        VolError *err)
{
    return keep_tile(&((GridPair *)user)->side[0], origin, size, value, active, err);
}

static VolStatus begin_b(void *user, const VolVdbGridInfo *info, VolError *err)
{
    (void)err;
    ((GridPair *)user)->side[1].info = *info;
    return VOL_OK;
}

static VolStatus leaf_b(void *user, const int32_t origin[3], const double *values, const uint64_t active[8], VolError *err)
{
    (void)err;
    GridPair *pair = user;
    compare_blocks(pair, origin, at_leaf(pair, 0, origin), leaf_block(pair, values, active));
    return VOL_OK;
}

static VolStatus tile_b(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                        VolError *err)
{
    return keep_tile(&((GridPair *)user)->side[1], origin, size, value, active, err);
}

static void compare_left_over_leaves(GridPair *pair)
{
    const VolGridIndex *index = &pair->side[0].index;
    for (size_t i = 0; i < index->count; i++) {
        VolCube *leaf = &index->cubes[i];
        if (leaf->values && !leaf->done)
            compare_blocks(pair, leaf->origin, leaf_block(pair, leaf->values, leaf->active), at_leaf(pair, 1, leaf->origin));
    }
}

static uint64_t volume(const VolCube *cube) { return (uint64_t)cube->size * (uint64_t)cube->size * (uint64_t)cube->size; }

/* A tile of `side` against a constant of the other grid, for so many of its voxels. */
static void compare_tile(GridPair *pair, int side, const VolCube *tile, const double *other, bool other_active,
                         uint64_t weight)
{
    const int64_t at[3] = {tile->origin[0], tile->origin[1], tile->origin[2]};
    if (side == 0)
        compare_voxel(pair, tile->value, tile->tile_active, other, other_active, weight, at);
    else
        compare_voxel(pair, other, other_active, tile->value, tile->tile_active, weight, at);
}

/* Tiles that lie in a tile of the other grid. */
static void compare_nested_tiles(GridPair *pair, int side)
{
    const VolGridIndex *index = &pair->side[side].index;
    for (size_t i = 0; i < index->count; i++) {
        VolCube *tile = &index->cubes[i];
        if (tile->values || tile->done)
            continue;
        VolCube *other = vol_grid_index_find(&pair->side[!side].index, tile->origin, tile->size);
        if (!other || other->values)
            continue; /* finer cubes, or nothing */
        compare_tile(pair, side, tile, other->value, other->tile_active, volume(tile));
        tile->done = true;
        other->covered += volume(tile);
        other->done = other->done || other->size == tile->size;
    }
}

static void compare_left_over_tiles(GridPair *pair, int side)
{
    const VolGridIndex *index = &pair->side[side].index;
    for (size_t i = 0; i < index->count; i++) {
        VolCube *tile = &index->cubes[i];
        if (!tile->values && !tile->done && volume(tile) > tile->covered)
            compare_tile(pair, side, tile, pair->side[!side].info.background, false, volume(tile) - tile->covered);
    }
}

static VolStatus compare_values(GridPair *pair, const VolVdb *a, size_t i, const VolVdb *b, size_t j, VolError *err)
{
    const VolVdbVisitor keep = {.begin = begin_a, .leaf_double = leaf_a, .tile = tile_a};
    const VolVdbVisitor compare = {.begin = begin_b, .leaf_double = leaf_b, .tile = tile_b};
    VolStatus status = vol_vdb_visit(a, i, &keep, pair, err);
    if (!status)
        status = vol_vdb_visit(b, j, &compare, pair, err);
    if (status)
        return status;
    compare_left_over_leaves(pair);
    compare_nested_tiles(pair, 0);
    compare_nested_tiles(pair, 1);
    compare_left_over_tiles(pair, 0);
    compare_left_over_tiles(pair, 1);
    return VOL_OK;
}

/* ---- What the grids are -------------------------------------------------------------------------------------------- */

/* Of a kind that has no matrix (a frustum's, or an unknown one): by its bytes. */
static bool same_map(VolVdbSide a, VolVdbSide b, const VolVdbEntry *ea, const VolVdbEntry *eb)
{
    return strcmp(ea->map, eb->map) == 0 && ea->map_size == eb->map_size &&
           memcmp(a.bytes + ea->map_offset, b.bytes + eb->map_offset, ea->map_size) == 0;
}

static VolStatus compare_transforms(VolVdbSide a, VolVdbSide b, const VolVdbEntry *ea, const VolVdbEntry *eb,
                                    VolReport *report, VolError *err)
{
    if (ea->transform_known != eb->transform_known)
        return vol_report(report, err, "grid '%s': transform: of another kind", ea->name);
    if (!ea->transform_known && !same_map(a, b, ea, eb))
        return vol_report(report, err, "grid '%s': transform: '%s' and '%s' that are not the same", ea->name, ea->map,
                          eb->map);
    for (int row = 0; row < 4 && ea->transform_known; row++)
        for (int column = 0; column < 3; column++) {
            double va = ea->index_to_world.m[row][column], vb = eb->index_to_world.m[row][column];
            if (!(va == vb))
                return vol_report(report, err, "grid '%s': transform: row %d, column %d is %.17g and %.17g", ea->name, row,
                                  column, va, vb);
        }
    return VOL_OK;
}

static VolStatus report_background(const GridPair *pair, const char *name, VolReport *report, VolError *err)
{
    const VolVdbGridInfo *a = &pair->side[0].info, *b = &pair->side[1].info;
    VolDeviation deviation = {0};
    for (int c = 0; c < pair->components; c++)
        vol_deviation_add(&deviation, pair->tolerance, a->background[c], b->background[c], 1, (const int64_t[3]){0});
    if (vol_deviation_passes(&deviation, pair->tolerance))
        return VOL_OK;
    if (pair->components == 1)
        return vol_report(report, err, "grid '%s': background: %.9g and %.9g", name, a->background[0], b->background[0]);
    return vol_report(report, err, "grid '%s': background: %.9g,%.9g,%.9g and %.9g,%.9g,%.9g", name, a->background[0],
                      a->background[1], a->background[2], b->background[0], b->background[1], b->background[2]);
}

static void box_text(const VolVdbGridInfo *info, char text[100])
{
    const int32_t *lo = info->box_min, *hi = info->box_max;
    if (info->empty)
        snprintf(text, 100, "none");
    else
        snprintf(text, 100, "(%d,%d,%d)-(%d,%d,%d)", lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]);
}

static VolStatus report_extent(const GridPair *pair, const char *name, VolReport *report, VolError *err)
{
    const VolVdbGridInfo *a = &pair->side[0].info, *b = &pair->side[1].info;
    char text_a[100], text_b[100];
    box_text(a, text_a);
    box_text(b, text_b);
    VolStatus status = VOL_OK;
    if (strcmp(text_a, text_b) != 0)
        status = vol_report(report, err, "grid '%s': active box: %s and %s", name, text_a, text_b);
    if (!status && a->active_voxels != b->active_voxels)
        status = vol_report(report, err, "grid '%s': active voxels: %llu and %llu", name,
                            (unsigned long long)a->active_voxels, (unsigned long long)b->active_voxels);
    if (!status && pair->states)
        status = vol_report(report, err, "grid '%s': %llu voxels active in one alone, the first at %lld,%lld,%lld", name,
                            (unsigned long long)pair->states, (long long)pair->state_at[0], (long long)pair->state_at[1],
                            (long long)pair->state_at[2]);
    return status;
}

static VolStatus compare_bytes(VolVdbSide a, VolVdbSide b, const VolVdbEntry *ea, const VolVdbEntry *eb, VolReport *report,
                               VolError *err)
{
    if (ea->size == eb->size && memcmp(a.bytes + ea->offset, b.bytes + eb->offset, ea->size) == 0)
        return VOL_OK;
    return vol_report(report, err, "grid '%s': of type '%s', which is compared as bytes: they differ", ea->name, ea->type);
}

static VolStatus compare_pair(VolVdbSide a, size_t i, VolVdbSide b, size_t j, const VolTolerance *tolerance,
                              VolReport *report, VolError *err)
{
    const VolVdbEntry *ea = vol_vdb_entry(a.vdb, i), *eb = vol_vdb_entry(b.vdb, j);
    VolStatus status = compare_transforms(a, b, ea, eb, report, err);
    if (status)
        return status;
    if (strcmp(ea->type, eb->type) != 0)
        return vol_report(report, err, "grid '%s': type: '%s' and '%s'", ea->name, ea->type, eb->type);
    GridPair pair = {.tolerance = tolerance, .components = vol_vdb_components(vol_vdb_value(ea))};
    if (pair.components == 0 || !ea->map_size || !eb->map_size) /* what cannot be unpacked */
        return compare_bytes(a, b, ea, eb, report, err);
    if (!status)
        status = compare_values(&pair, a.vdb, i, b.vdb, j, err);
    if (!status)
        status = report_background(&pair, ea->name, report, err);
    if (!status)
        status = report_extent(&pair, ea->name, report, err);
    char what[600];
    snprintf(what, sizeof what, "grid '%.512s'", ea->name);
    if (!status)
        status = vol_deviation_report(&pair.deviation, tolerance, what, 3, report, err);
    vol_grid_index_free(&pair.side[0].index);
    vol_grid_index_free(&pair.side[1].index);
    return status;
}

/* The n-th grid of this name, or the count where there is none. */
static size_t nth_of_name(const VolVdb *vdb, const char *name, size_t n)
{
    size_t i = 0;
    for (; i < vol_vdb_count(vdb); i++)
        if (strcmp(vol_vdb_entry(vdb, i)->name, name) == 0 && n-- == 0)
            break;
    return i;
}

static size_t partner(const VolVdb *own, size_t i, const VolVdb *other)
{
    const char *name = vol_vdb_entry(own, i)->name;
    size_t before = 0;
    for (size_t k = 0; k < i; k++)
        before += strcmp(vol_vdb_entry(own, k)->name, name) == 0;
    return nth_of_name(other, name, before);
}

VolStatus vol_compare_grids(VolVdbSide a, VolVdbSide b, const VolTolerance *tolerance, VolReport *report, VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < vol_vdb_count(a.vdb) && !status; i++) {
        size_t j = partner(a.vdb, i, b.vdb);
        if (j < vol_vdb_count(b.vdb))
            status = compare_pair(a, i, b, j, tolerance, report, err);
        else
            status = vol_report(report, err, "grid '%s': only in the first", vol_vdb_entry(a.vdb, i)->name);
    }
    for (size_t j = 0; j < vol_vdb_count(b.vdb) && !status; j++)
        if (partner(b.vdb, j, a.vdb) == vol_vdb_count(a.vdb))
            status = vol_report(report, err, "grid '%s': only in the second", vol_vdb_entry(b.vdb, j)->name);
    return status;
}
