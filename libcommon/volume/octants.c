/* Settles what stands in the last layers of bricks, which they share with the bricks above.
 *
 * A block of one value (a brick, a node, a root) among others of one value ends in the values of the seven blocks above it,
 * so that eight numbers say all, however large it is: its octants.  Only where leaves lie above do bricks get storage.
 * Bricks made of equal octants are one brick, wherever they are.
 *
 * First the roots, then the nodes, those below what there is included; then the bricks of nodes that have leaves or small
 * tiles in them, or above them.  A block's own value never changes, so that the order does not matter. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "volume/grid_internal.h"

static bool same(double a, double b) { return a == b || (isnan(a) && isnan(b)); }

/* ---- Shared bricks ---- */

/* Found as if it were a cube at a place that is a hash of its octants. */
typedef struct SharedBrick {
    int32_t at[3];
    uint32_t number;
} SharedBrick;

static VolStatus add_octants(VolGridBuilder *builder, const double values[8], uint32_t *place, VolError *err)
{
    VolGrid *grid = builder->grid;
    if (grid->octant_count == builder->octant_capacity) {
        size_t grown = builder->octant_capacity ? 2 * builder->octant_capacity : 64;
        VolOctants *octants = grown < INT32_MAX / 2 ? vol_resize(grid->octants, grown, sizeof *octants) : NULL;
        if (!octants)
            return vol_fail_memory(err, grown * sizeof *octants);
        grid->octants = octants;
        builder->octant_capacity = grown;
    }
    memcpy(grid->octants[grid->octant_count].value, values, sizeof grid->octants->value);
    *place = (uint32_t)++grid->octant_count;
    return VOL_OK;
}

static void set_octants(VolBrick *brick, uint32_t place) { brick->octants = place & (INT32_MAX >> 1); }

static void key_of(const double values[8], int32_t at[3])
{
    uint64_t h[2] = {1, 2};
    for (int k = 0; k < 8; k++) {
        uint64_t bits;
        memcpy(&bits, &values[k], sizeof bits);
        for (int n = 0; n < 2; n++) {
            h[n] = (h[n] ^ bits) * 0x9e3779b97f4a7c15u;
            h[n] ^= h[n] >> 29;
        }
    }
    at[0] = (int32_t)(uint32_t)h[0];
    at[1] = (int32_t)(uint32_t)(h[0] >> 32);
    at[2] = (int32_t)(uint32_t)h[1];
}

/* The brick that holds these octants, for all places that want it. */
static VolStatus shared_brick(VolGridBuilder *builder, const double values[8], uint32_t *number, VolError *err)
{
    static const int32_t nowhere[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    VolGrid *grid = builder->grid;
    SharedBrick *shared;
    void *found;
    int32_t at[3];
    uint32_t place;
    key_of(values, at);
    builder->shared_octants.stride = sizeof *shared;
    /* To the next place, if another's octants have this one. */
    for (;; at[2] = (int32_t)((uint32_t)at[2] + 1)) {
        VolStatus status = vol_cubes_add(&builder->shared_octants, at, &found, err);
        if (status)
            return status;
        shared = found;
        if (!shared->number)
            break;
        *number = shared->number;
        if (memcmp(grid->octants[grid->bricks[*number].octants - 1].value, values, sizeof grid->octants->value) == 0)
            return VOL_OK;
    }
    VolStatus status = add_octants(builder, values, &place, err);
    if (!status)
        status = vol_grid_new_brick(builder, nowhere, values[0], number, err);
    if (status)
        return status;
    set_octants(&grid->bricks[*number], place);
    shared->number = *number;
    return VOL_OK;
}

/* ---- Blocks of one value ---- */

/* The axes along which the block above the one at `at` lies beyond the voxels of a box: nothing of it is ever seen. */
static unsigned beyond_box(const VolGrid *grid, const int32_t at[3], int32_t size)
{
    unsigned beyond = 0;
    for (int a = 0; a < 3 && grid->domain == VOL_DOMAIN_BOX; a++)
        beyond |= (unsigned)(((int64_t)at[a] + 1) * size > grid->voxel_max[a]) << (2 - a);
    return beyond;
}

/* The bricks of a block of one value, by octant: `number` holds its own value, values[k] that of the block in octant k. */
static VolStatus octants_of_block(VolGridBuilder *builder, uint32_t number, const double values[8], unsigned beyond,
                                  uint32_t octants[8], VolError *err)
{
    double v[8];
    VolStatus status = VOL_OK;
    for (unsigned k = 0; k < 8; k++)
        v[k] = values[k & ~beyond];
    for (unsigned m = 0; m < 8 && !status; m++) {
        double ends[8];
        bool differs = false;
        for (unsigned k = 0; k < 8; k++) {
            ends[k] = v[k & m];
            differs = differs || !same(ends[k], v[0]);
        }
        octants[m] = number;
        if (differs)
            status = shared_brick(builder, ends, &octants[m], err);
    }
    return status;
}

static uint32_t root_brick(const VolGrid *grid, const int32_t at[3])
{
    const VolRoot *root = vol_grid_root(grid, at[0], at[1], at[2]);
    return root ? root->octants[0] : 0;
}

static VolStatus settle_root(VolGridBuilder *builder, size_t n, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolRoot *root = vol_cubes_item(&grid->roots, n);
    double values[8];
    for (int k = 0; k < 8; k++) {
        int step[3];
        vol_grid_step(k, step);
        const int32_t above[3] = {root->at[0] + step[0], root->at[1] + step[1], root->at[2] + step[2]};
        values[k] = grid->bricks[root_brick(grid, above)].uniform;
    }
    return octants_of_block(builder, root->octants[0], values, beyond_box(grid, root->at, VOL_ROOT_CELLS), root->octants,
                            err);
}

static VolStatus settle_roots(VolGridBuilder *builder, VolError *err)
{
    VolGrid *grid = builder->grid;
    size_t count = grid->roots.count;
    VolStatus status = VOL_OK;
    for (size_t n = 0; n < count && !status; n++)
        for (int k = 1; k < 8 && !status; k++) {
            int step[3];
            void *below;
            vol_grid_step(k, step);
            const VolRoot *root = vol_cubes_item(&grid->roots, n);
            const int32_t at[3] = {root->at[0] - step[0], root->at[1] - step[1], root->at[2] - step[2]};
            if (vol_grid_in_domain(grid, at, VOL_ROOT_CELLS))
                status = vol_cubes_add(&grid->roots, at, &below, err);
        }
    for (size_t n = 0; n < grid->roots.count && !status; n++)
        status = settle_root(builder, n, err);
    return status;
}

/* ---- Nodes ---- */

/* What a node is before anything is settled: leaves and small tiles, or a brick that stands for all of it. */
typedef struct NodeBefore {
    const uint32_t *bricks; /* NULL: none */
    uint32_t number;
} NodeBefore;

static NodeBefore node_before(const VolGrid *grid, const int32_t at[3])
{
    const VolNode *node = vol_grid_node(grid, at[0], at[1], at[2]);
    if (node)
        return (NodeBefore){node->bricks, node->octants[0]};
    enum { SHIFT = VOL_ROOT_LOG2 - VOL_NODE_LOG2 };
    return (NodeBefore){NULL, root_brick(grid, (int32_t[3]){at[0] >> SHIFT, at[1] >> SHIFT, at[2] >> SHIFT})};
}

static bool voxel_differs(const VolGrid *grid, const VolBrick *brick, int x, int y, int z, double value)
{
    bool differs = false;
    for (int c = 0; c < vol_grid_planes(grid); c++)
        differs = differs || !(vol_grid_held(grid, brick, c, x, y, z) == vol_grid_in_plane(grid, value, c));
    return differs;
}

/* Whether some voxel that brick `number` shares with its neighbour `step` below differs from `value`. */
static bool layer_differs(const VolGrid *grid, uint32_t number, const int step[3], double value)
{
    const VolBrick *brick = &grid->bricks[number];
    if (brick->storage == VOL_NO_STORAGE)
        return !(brick->uniform == value);
    for (int x = 0; x < (step[0] ? 1 : 8); x++)
        for (int y = 0; y < (step[1] ? 1 : 8); y++)
            for (int z = 0; z < (step[2] ? 1 : 8); z++)
                if (voxel_differs(grid, brick, x, y, z, value))
                    return true;
    return false;
}

/* Whether the node one `step` below may end in something else than its own value. */
static bool differs_below(const VolGrid *grid, const VolNode *node, const int step[3])
{
    const int32_t at[3] = {node->at[0] - step[0], node->at[1] - step[1], node->at[2] - step[2]};
    double value = grid->bricks[node_before(grid, at).number].uniform;
    if (grid->roots.count || !node->bricks)
        return grid->roots.count || !same(grid->bricks[node->octants[0]].uniform, value);
    for (int x = 0; x < (step[0] ? 1 : VOL_NODE_BRICKS); x++)
        for (int y = 0; y < (step[1] ? 1 : VOL_NODE_BRICKS); y++)
            for (int z = 0; z < (step[2] ? 1 : VOL_NODE_BRICKS); z++)
                if (layer_differs(grid, node->bricks[(x * 16 + y) * 16 + z], step, value))
                    return true;
    return false;
}

static VolStatus make_nodes_below(VolGridBuilder *builder, VolError *err)
{
    VolGrid *grid = builder->grid;
    size_t count = grid->node_count;
    VolStatus status = VOL_OK;
    for (size_t n = 0; n < count && !status; n++)
        for (int k = 1; k < 8 && !status; k++) {
            int step[3];
            VolNode *below;
            vol_grid_step(k, step);
            const VolNode *node = &grid->nodes[n];
            const int32_t at[3] = {node->at[0] - step[0], node->at[1] - step[1], node->at[2] - step[2]};
            if (vol_grid_in_domain(grid, at, VOL_NODE_CELLS) && differs_below(grid, node, step))
                status = vol_grid_make_node(builder, at, &below, err);
        }
    return status;
}

/* ---- Bricks ---- */

/* The node that is being settled and the seven above it, as they were. */
typedef struct Neighbours {
    NodeBefore node[8];
    bool detailed; /* some of them has bricks of its own */
    uint32_t stored; /* bricks stored from here on were of one value before */
} Neighbours;

static void look_around(const VolGrid *grid, const int32_t at[3], Neighbours *out)
{
    out->detailed = false;
    for (int k = 0; k < 8; k++) {
        int step[3];
        vol_grid_step(k, step);
        out->node[k] = node_before(grid, (int32_t[3]){at[0] + step[0], at[1] + step[1], at[2] + step[2]});
        out->detailed = out->detailed || out->node[k].bricks;
    }
}

/* The brick at a place of the node, 0 to 16 along each axis: 16 is the next node's. */
static inline uint32_t brick_before(const Neighbours *around, int x, int y, int z)
{
    const NodeBefore *node = &around->node[x >> 4 << 2 | y >> 4 << 1 | z >> 4];
    return node->bricks ? node->bricks[((x & 15) * 16 + (y & 15)) * 16 + (z & 15)] : node->number;
}

static bool was_stored(const VolBrick *brick, uint32_t stored)
{
    return brick->storage != VOL_NO_STORAGE && brick->storage < stored;
}

/* The values that the brick at place p ends in, or false: they are not one in each octant. */
static bool ends_of_brick(const VolGrid *grid, const Neighbours *around, const int p[3], unsigned beyond, double values[8])
{
    values[0] = grid->bricks[brick_before(around, p[0], p[1], p[2])].uniform;
    for (unsigned k = 1; k < 8; k++) {
        int step[3];
        vol_grid_step((int)(k & ~beyond), step);
        uint32_t above = brick_before(around, p[0] + step[0], p[1] + step[1], p[2] + step[2]);
        values[k] = grid->bricks[above].uniform;
        if (!was_stored(&grid->bricks[above], around->stored) || !(k & ~beyond))
            continue;
        if (layer_differs(grid, above, step, values[0]))
            return false;
        values[k] = values[0];
    }
    return true;
}

/* A brick of one value gets storage, or octants, or stays as it is. */
static VolStatus settle_brick(VolGridBuilder *builder, const Neighbours *around, const int32_t at[3], const int p[3],
                              uint32_t *entry, VolError *err)
{
    VolGrid *grid = builder->grid;
    double values[8];
    bool differs = false, owned = !grid->bricks[*entry].shared;
    uint32_t own;
    if (!ends_of_brick(grid, around, p, owned ? 0 : beyond_box(grid, at, VOL_BRICK_CELLS), values)) {
        VolStatus status = vol_grid_own_brick(builder, at, &own, err);
        return status ? status : vol_grid_store_brick(builder, own, err);
    }
    for (int k = 1; k < 8; k++)
        differs = differs || !same(values[k], values[0]);
    if (!differs)
        return VOL_OK;
    if (!owned)
        return shared_brick(builder, values, entry, err);
    VolStatus status = add_octants(builder, values, &own, err);
    if (!status)
        set_octants(&grid->bricks[*entry], own);
    return status;
}

/* Whether the seven above the brick at a place inside a node are the same one. */
static bool alike_above(const uint32_t *entry)
{
    enum { X = VOL_NODE_BRICKS * VOL_NODE_BRICKS, Y = VOL_NODE_BRICKS, Z = 1 };
    static const int above[7] = {Z, Y, Y + Z, X, X + Z, X + Y, X + Y + Z};
    bool alike = true;
    for (int k = 0; k < 7; k++)
        alike = alike && entry[above[k]] == *entry;
    return alike;
}

static VolStatus settle_bricks(VolGridBuilder *builder, size_t number, const Neighbours *around, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolNode node = grid->nodes[number];
    bool only_last = !node.bricks; /* of one value: what is not last ends in it */
    VolStatus status = vol_grid_detail_node(&node, err);
    grid->nodes[number] = node;
    for (int n = 0; n < VOL_NODE_ENTRIES && !status; n++) {
        const int p[3] = {n >> 8, n >> 4 & 15, n & 15};
        uint32_t *entry = &node.bricks[n];
        bool inner = p[0] < 15 && p[1] < 15 && p[2] < 15;
        if ((only_last && inner) || was_stored(&grid->bricks[*entry], around->stored))
            continue;
        if (inner && alike_above(entry))
            continue;
        const int32_t at[3] = {node.at[0] * 16 + p[0], node.at[1] * 16 + p[1], node.at[2] * 16 + p[2]};
        if (vol_grid_in_domain(grid, at, VOL_BRICK_CELLS))
            status = settle_brick(builder, around, at, p, entry, err);
    }
    return status;
}

static VolStatus settle_node(VolGridBuilder *builder, size_t n, Neighbours *around, VolError *err)
{
    VolGrid *grid = builder->grid;
    VolNode *node = &grid->nodes[n];
    double values[8];
    for (int k = 0; k < 8; k++)
        values[k] = grid->bricks[around->node[k].number].uniform;
    return octants_of_block(builder, node->octants[0], values, beyond_box(grid, node->at, VOL_NODE_CELLS), node->octants,
                            err);
}

/* Nodes with bricks of their own, or below such, are left for the second round: it gives bricks to some. */
static VolStatus settle_nodes(VolGridBuilder *builder, VolError *err)
{
    VolGrid *grid = builder->grid;
    Neighbours around = {.stored = (uint32_t)grid->stored_bricks};
    uint8_t *detailed = vol_alloc(grid->node_count, 1);
    if (!detailed)
        return vol_fail_memory(err, grid->node_count);
    VolStatus status = VOL_OK;
    for (size_t n = 0; n < grid->node_count && !status; n++) {
        look_around(grid, grid->nodes[n].at, &around);
        detailed[n] = around.detailed;
        if (!around.detailed)
            status = settle_node(builder, n, &around, err);
    }
    for (size_t n = 0; n < grid->node_count && !status; n++)
        if (detailed[n]) {
            look_around(grid, grid->nodes[n].at, &around);
            status = settle_bricks(builder, n, &around, err);
            grid->nodes[n].detail = (uint32_t)grid->detail_count++;
        }
    free(detailed);
    return status;
}

/* ---- All ---- */

static VolStatus mark_occupied(VolGrid *grid, VolError *err)
{
    enum { SHIFT = VOL_ROOT_LOG2 - VOL_NODE_LOG2, ROOT = 1 << SHIFT };
    VolStatus status = VOL_OK;
    for (size_t n = 0; n < grid->roots.count && !status; n++) {
        const int32_t *at = ((const VolRoot *)vol_cubes_item(&grid->roots, n))->at;
        status = vol_grid_occupy(grid, (int32_t[3]){at[0] * ROOT, at[1] * ROOT, at[2] * ROOT}, SHIFT, err);
    }
    for (size_t n = 0; n < grid->node_count && !status; n++) {
        const int32_t *at = grid->nodes[n].at;
        VolRoot *root = vol_cubes_find(&grid->roots, (int32_t[3]){at[0] >> SHIFT, at[1] >> SHIFT, at[2] >> SHIFT});
        if (root)
            root->has_nodes = true;
        status = vol_grid_occupy(grid, at, 1, err);
    }
    return status;
}

VolStatus vol_grid_settle_last_layers(VolGridBuilder *builder, VolError *err)
{
    VolStatus status = settle_roots(builder, err);
    if (!status)
        status = make_nodes_below(builder, err);
    if (!status)
        status = settle_nodes(builder, err);
    return status ? status : mark_occupied(builder->grid, err);
}
