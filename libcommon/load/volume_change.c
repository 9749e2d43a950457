/* How fast a field can change, from differences of neighbouring voxels: inside a cell the derivative along an axis is a mean of
 * the cell's four edges along it. */
#include <math.h>

#include "load/tables.h"

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

/* A brick repeats the first voxels of the next, so that all edges lie within bricks; one value has none. */
static void widen_by_brick(const VolGrid *grid, const VolBrick *brick, double most[3])
{
    enum { SIDE = VOL_BRICK_SIDE };
    size_t first = (size_t)brick->storage * VOL_BRICK_STRIDE;
    for (size_t i = 0; i < VOL_BRICK_VALUES; i++) {
        double v = value_at(grid, first + i);
        if (i / (SIDE * SIDE) + 1 < SIDE)
            widen(&most[0], v, value_at(grid, first + i + SIDE * SIDE));
        if (i / SIDE % SIDE + 1 < SIDE)
            widen(&most[1], v, value_at(grid, first + i + SIDE));
        if (i % SIDE + 1 < SIDE)
            widen(&most[2], v, value_at(grid, first + i + 1));
    }
}

double vol_volume_change(const VolGrid *grid, double length)
{
    double most[3] = {0}, change = 0, lo = INFINITY, hi = -INFINITY;
    for (size_t b = 0; b < grid->brick_count; b++) {
        const VolBrick *brick = &grid->bricks[b];
        if (brick->lo <= brick->hi) {
            lo = fmin(lo, brick->lo);
            hi = fmax(hi, brick->hi);
        }
        if (brick->storage != VOL_NO_STORAGE)
            widen_by_brick(grid, brick, most);
    }
    for (int a = 0; a < 3; a++) {
        const double(*m)[3] = grid->world_to_index.m;
        change += most[a] * vol_length(vol_vec3(m[0][a], m[1][a], m[2][a])) * length;
    }
    return lo <= hi ? fmin(change, hi - lo) : 0;
}
