/* The lengths that other programs' opacities hold for, of a volume. */
#include <math.h>

#include "base/fmath.h"
#include "load/volume.h"

/* Of cells between voxel centres: their diagonal if they were cubes. */
static double cell_diagonal(const VolGrid *grid)
{
    double squares = 0, cells = 1;
    for (int a = 0; a < 3; a++) {
        const double *m = grid->index_to_world.m[a];
        double count = (double)grid->voxel_max[a] - grid->voxel_min[a];
        squares += count * count * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
        cells *= fmax(count, 1);
    }
    return squares > 0 ? sqrt(squares) / vol_cbrt(cells) : grid->voxel;
}

double vol_volume_step(const VolGrid *grid, VolStepUnit unit)
{
    double voxels = unit == VOL_STEP_BOX ? 1 : 0, size = vol_cbrt(fabs(vol_affine_determinant(&grid->index_to_world)));
    switch (unit) {
    case VOL_STEP_WORLD:
        return 1;
    case VOL_STEP_VOXEL:
        return size;
    case VOL_STEP_CELL:
        return cell_diagonal(grid);
    case VOL_STEP_BOX:
        for (int a = 0; a < 3; a++)
            voxels *= (double)grid->voxel_max[a] - grid->voxel_min[a] + 1;
        return size * vol_cbrt(voxels);
    }
    return 1;
}
