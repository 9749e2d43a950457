/* The range of a brick's values, once for float and once for double: REAL is the type, RANGE(name) makes a name. */

/* Of all 9^3 voxels of a plane, eight at a time; false where one is not finite, which this cannot leave out. */
static bool RANGE(plane_range)(const REAL *values, double *least, double *most)
{
    enum { LANES = 8, BODY = VOL_BRICK_VALUES / LANES * LANES };
    REAL lo[LANES], hi[LANES], strange[LANES] = {0};
    for (int l = 0; l < LANES; l++)
        lo[l] = hi[l] = values[l];
    for (int n = 0; n < BODY; n += LANES)
        for (int l = 0; l < LANES; l++) {
            REAL v = values[n + l];
            lo[l] = v < lo[l] ? v : lo[l];
            hi[l] = v > hi[l] ? v : hi[l];
            strange[l] += v - v; /* 0, or NaN for good */
        }
    for (int n = BODY; n < VOL_BRICK_VALUES; n++) {
        lo[0] = values[n] < lo[0] ? values[n] : lo[0];
        hi[0] = values[n] > hi[0] ? values[n] : hi[0];
        strange[0] += values[n] - values[n];
    }
    for (int l = 1; l < LANES; l++) {
        lo[0] = lo[l] < lo[0] ? lo[l] : lo[0];
        hi[0] = hi[l] > hi[0] ? hi[l] : hi[0];
        strange[0] += strange[l];
    }
    *least = (double)lo[0] + 0.0; /* never -0: which zero it is would depend on the order */
    *most = (double)hi[0] + 0.0;
    return strange[0] == 0;
}

/* Likewise of all planes. */
static bool RANGE(whole_range)(const REAL *values, int planes, VolBrick *brick)
{
    bool finite = RANGE(plane_range)(values, &brick->lo, &brick->hi);
    for (int c = 1; c < planes && finite; c++) {
        double lo, hi;
        finite = RANGE(plane_range)(values + c * VOL_BRICK_STRIDE, &lo, &hi);
        brick->lo = fmin(brick->lo, lo);
        brick->hi = fmax(brick->hi, hi);
    }
    return finite;
}

/* Of the finite voxels that cells inside the domain use; how many of the brick's own are not finite. */
static uint64_t RANGE(range)(const VolGrid *grid, const REAL *values, const int32_t at[3], VolBrick *brick)
{
    int first[3], last[3], planes = vol_grid_planes(grid);
    uint64_t bad = 0;
    for (int a = 0; a < 3; a++) {
        int32_t base = at[a] * VOL_BRICK_CELLS;
        first[a] = grid->cell_min[a] > base ? grid->cell_min[a] - base : 0;
        last[a] = grid->cell_max[a] + 1 < base + 8 ? grid->cell_max[a] + 1 - base : 8;
    }
    brick->lo = INFINITY;
    brick->hi = -INFINITY;
    for (int x = first[0]; x <= last[0]; x++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int z = first[2]; z <= last[2]; z++) {
                bool finite = true;
                for (int c = 0; c < planes; c++) {
                    double v = (double)values[c * VOL_BRICK_STRIDE + (x * VOL_BRICK_SIDE + y) * VOL_BRICK_SIDE + z];
                    finite = finite && isfinite(v);
                    brick->lo = isfinite(v) && v < brick->lo ? v : brick->lo;
                    brick->hi = isfinite(v) && v > brick->hi ? v : brick->hi;
                }
                if (finite)
                    continue;
                brick->invalid = true;
                const int32_t voxel[3] = {at[0] * 8 + x, at[1] * 8 + y, at[2] * 8 + z};
                bool own = x < 8 && y < 8 && z < 8;
                for (int a = 0; a < 3; a++)
                    own = own && voxel[a] >= grid->voxel_min[a] && voxel[a] <= grid->voxel_max[a];
                bad += own;
            }
    brick->lo += 0.0;
    brick->hi += 0.0;
    return bad;
}
