/* Whether a grid has anything that can be seen: a cell of the domain with finite values at all its corners. */
#include <math.h>

#include "volume/grid_internal.h"

static bool corner_is_finite(const VolGrid *grid, const VolBrick *brick, int x, int y, int z)
{
    bool finite = true;
    for (int c = 0; c < vol_grid_planes(grid); c++)
        finite = finite && isfinite(vol_grid_held(grid, brick, c, x, y, z));
    return finite;
}

static bool cell_is_finite(const VolGrid *grid, const VolBrick *brick, int x, int y, int z)
{
    for (int n = 0; n < 8; n++)
        if (!corner_is_finite(grid, brick, x + (n >> 2), y + (n >> 1 & 1), z + (n & 1)))
            return false;
    return true;
}

/* The cells of a block at `at`, `size` a side, that lie in the domain: from first to last within it; false: none do. */
static bool cells_in_domain(const VolGrid *grid, const int32_t at[3], int32_t size, int32_t first[3], int32_t last[3])
{
    if (!vol_grid_in_domain(grid, at, size))
        return false;
    for (int a = 0; a < 3; a++) {
        int64_t base = (int64_t)at[a] * size;
        first[a] = grid->cell_min[a] > base ? (int32_t)(grid->cell_min[a] - base) : 0;
        last[a] = grid->cell_max[a] < base + size - 1 ? (int32_t)(grid->cell_max[a] - base) : size - 1;
    }
    return true;
}

/* Of the cells of a brick; where it is of few values, the first cell touches the fewest of them. */
static bool brick_has_cell(const VolGrid *grid, uint32_t number, const int32_t at[3])
{
    const VolBrick *brick = &grid->bricks[number];
    int32_t first[3], last[3];
    if (!cells_in_domain(grid, at, VOL_BRICK_CELLS, first, last))
        return false;
    if (brick->storage == VOL_NO_STORAGE)
        return cell_is_finite(grid, brick, first[0], first[1], first[2]);
    if (!brick->invalid)
        return true;
    for (int x = first[0]; x <= last[0]; x++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int z = first[2]; z <= last[2]; z++)
                if (cell_is_finite(grid, brick, x, y, z))
                    return true;
    return false;
}

static bool node_has_cell(const VolGrid *grid, const VolNode *node)
{
    if (!node->bricks)
        return vol_grid_in_domain(grid, node->at, VOL_NODE_CELLS) &&
               vol_grid_is_finite(grid, grid->bricks[node->octants[0]].uniform);
    for (int p = 0; p < VOL_NODE_ENTRIES; p++) {
        const int32_t at[3] = {node->at[0] * VOL_NODE_BRICKS + (p >> 8), node->at[1] * VOL_NODE_BRICKS + (p >> 4 & 15),
                               node->at[2] * VOL_NODE_BRICKS + (p & 15)};
        if (brick_has_cell(grid, node->bricks[p], at))
            return true;
    }
    return false;
}

/* How many cells of the domain lie in a block. */
static double cells_of(const VolGrid *grid, const int32_t at[3], int32_t size)
{
    int32_t first[3], last[3];
    double cells = 1;
    if (!cells_in_domain(grid, at, size, first, last))
        return 0;
    for (int a = 0; a < 3; a++)
        cells *= (double)last[a] - first[a] + 1;
    return cells;
}

bool vol_grid_has_cell(const VolGrid *grid)
{
    double beside = 1; /* cells in no node */
    for (int a = 0; a < 3; a++)
        beside *= (double)grid->cell_max[a] - grid->cell_min[a] + 1;
    for (size_t n = 0; n < grid->node_count; n++) {
        if (node_has_cell(grid, &grid->nodes[n]))
            return true;
        beside -= cells_of(grid, grid->nodes[n].at, VOL_NODE_CELLS);
    }
    for (size_t n = 0; n < grid->roots.count; n++) {
        const VolRoot *root = vol_cubes_item(&grid->roots, n);
        if (vol_grid_in_domain(grid, root->at, VOL_ROOT_CELLS) &&
            vol_grid_is_finite(grid, grid->bricks[root->octants[0]].uniform))
            return true;
    }
    return beside > 0 && vol_grid_is_finite(grid, grid->background);
}
