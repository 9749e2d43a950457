/* How fast a field can change, from differences of neighbouring voxels: inside a cell the derivative along an axis
 * is a mean of the cell's four edges along it. */
#include <math.h>

#include "volume/grid.h"

static double value_at(const VolGrid *grid, size_t i)
{
    return grid->is_double ? ((const double *)grid->values)[i] : (double)((const float *)grid->values)[i];
}

static void widen(double *most, double a, double b)
{
    double d = fabs(b - a); /* with a NaN or an infinity: the cells around are empty */
    if (isfinite(d) && d > *most)
        *most = d;
}

/* A brick repeats the first voxels of the next, so that all edges lie within bricks; one value has none.  Only what
 * cells of the domain use counts. */
static void widen_by_brick(const VolGrid *grid, const VolBrick *brick, const int32_t base[3], double most[3])
{
    enum { SIDE = VOL_BRICK_SIDE };
    static const size_t next[3] = {SIDE * SIDE, SIDE, 1};
    int first[3], last[3];
    for (int a = 0; a < 3; a++) {
        first[a] = grid->cell_min[a] > base[a] ? grid->cell_min[a] - base[a] : 0;
        last[a] = grid->cell_max[a] + 1 < base[a] + SIDE - 1 ? grid->cell_max[a] + 1 - base[a] : SIDE - 1;
    }
    size_t storage = (size_t)brick->storage * VOL_BRICK_STRIDE;
    for (int x = first[0]; x <= last[0]; x++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int z = first[2]; z <= last[2]; z++) {
                const int at[3] = {x, y, z};
                size_t i = storage + (size_t)((x * SIDE + y) * SIDE + z);
                for (int a = 0; a < 3; a++)
                    if (at[a] < last[a])
                        widen(&most[a], value_at(grid, i), value_at(grid, i + next[a]));
            }
}

/* A brick of octants, the last layers along the axes of `beyond` (by octant) being outside the domain. */
static void widen_by_octants(const VolGrid *grid, const VolBrick *brick, int beyond, double most[3])
{
    const double *v = grid->octants[brick->octants - 1].value;
    for (int k = 0; k < 8; k++)
        for (int a = 0; a < 3 && !(k & beyond); a++)
            if (!((k | beyond) & 4 >> a))
                widen(&most[a], v[k], v[k | 4 >> a]);
}

/* All of a brick of floats without holes, inside the domain: the same, quicker.  A difference of floats is rounded, to
 * what is at most half a unit in the last place less. */
static void widen_by_floats(const float *v, double most[3])
{
    enum { SIDE = VOL_BRICK_SIDE };
    float along_x = 0, along_y = 0, along_z = 0;
    for (int x = 0; x < SIDE - 1; x++)
        for (int y = 0; y < SIDE - 1; y++) {
            const float *row = v + (x * SIDE + y) * SIDE;
            for (int z = 0; z < SIDE - 1; z++) {
                float dx = fabsf(row[z + SIDE * SIDE] - row[z]), dy = fabsf(row[z + SIDE] - row[z]);
                float dz = fabsf(row[z + 1] - row[z]);
                along_x = dx > along_x ? dx : along_x;
                along_y = dy > along_y ? dy : along_y;
                along_z = dz > along_z ? dz : along_z;
            }
        }
    most[0] = fmax(most[0], (double)along_x * (1 + 0x1p-23));
    most[1] = fmax(most[1], (double)along_y * (1 + 0x1p-23));
    most[2] = fmax(most[2], (double)along_z * (1 + 0x1p-23));
}

/* Edges on the far faces are the next bricks' to look at: there must be such bricks in the domain. */
static bool is_plain(const VolGrid *grid, const VolBrick *brick, const int32_t base[3])
{
    bool plain = !grid->is_double && !brick->invalid;
    for (int a = 0; a < 3; a++)
        plain = plain && base[a] >= grid->cell_min[a] && base[a] + VOL_BRICK_CELLS <= grid->cell_max[a];
    return plain;
}

static int last_layers_outside(const VolGrid *grid, const int32_t base[3])
{
    int beyond = 0;
    for (int a = 0; a < 3; a++)
        beyond |= grid->cell_max[a] + 1 < base[a] + VOL_BRICK_CELLS ? 4 >> a : 0;
    return beyond;
}

static void widen_by_node(const VolGrid *grid, const VolNode *node, double most[3])
{
    for (int p = 0; node->bricks && p < VOL_NODE_ENTRIES; p++) {
        const VolBrick *brick = &grid->bricks[node->bricks[p]];
        const int32_t base[3] = {(node->at[0] * VOL_NODE_BRICKS + (p >> 8)) * VOL_BRICK_CELLS,
                                 (node->at[1] * VOL_NODE_BRICKS + (p >> 4 & 15)) * VOL_BRICK_CELLS,
                                 (node->at[2] * VOL_NODE_BRICKS + (p & 15)) * VOL_BRICK_CELLS};
        if (brick->storage == VOL_NO_STORAGE && (!brick->octants || brick->shared))
            continue;
        if (brick->octants)
            widen_by_octants(grid, brick, last_layers_outside(grid, base), most);
        else if (is_plain(grid, brick, base))
            widen_by_floats((const float *)grid->values + (size_t)brick->storage * VOL_BRICK_STRIDE, most);
        else
            widen_by_brick(grid, brick, base, most);
    }
}

double vol_grid_change(const VolGrid *grid, double length)
{
    double most[3] = {0}, change = 0, lo = INFINITY, hi = -INFINITY;
    for (size_t b = 0; b < grid->brick_count; b++) {
        if (grid->bricks[b].lo <= grid->bricks[b].hi) {
            lo = fmin(lo, grid->bricks[b].lo);
            hi = fmax(hi, grid->bricks[b].hi);
        }
        if (grid->bricks[b].octants && grid->bricks[b].shared)
            widen_by_octants(grid, &grid->bricks[b], 0, most);
    }
    for (size_t n = 0; n < grid->node_count; n++)
        widen_by_node(grid, &grid->nodes[n], most);
    for (int a = 0; a < 3; a++) {
        const double(*m)[3] = grid->world_to_index.m;
        change += most[a] * vol_length(vol_vec3(m[0][a], m[1][a], m[2][a])) * length;
    }
    return lo <= hi ? fmin(change, hi - lo) : 0;
}
