/* The lengths that other programs' opacities hold for, of a volume. */
#include <math.h>

#include "base/fmath.h"
#include "load/appearance.h"

/* Of cells between voxel centres: their diagonal if they were cubes. */
static double cell_diagonal(const VolVolume *volume)
{
    double squares = 0, cells = 1;
    int32_t lo[3], hi[3];
    vol_volume_voxels(volume, lo, hi);
    for (int a = 0; a < 3; a++) {
        const double *m = vol_volume_to_world(volume)->m[a];
        double count = (double)hi[a] - lo[a];
        squares += count * count * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
        cells *= fmax(count, 1);
    }
    return squares > 0 ? sqrt(squares) / vol_cbrt(cells) : vol_volume_voxel(volume);
}

double vol_step_of_unit(const VolVolume *volume, VolStepUnit unit)
{
    double voxels = unit == VOL_STEP_BOX ? 1 : 0, size = vol_cbrt(fabs(vol_affine_determinant(vol_volume_to_world(volume))));
    int32_t lo[3], hi[3];
    switch (unit) {
    case VOL_STEP_WORLD:
        return 1;
    case VOL_STEP_VOXEL:
        return size;
    case VOL_STEP_CELL:
        return cell_diagonal(volume);
    case VOL_STEP_BOX:
        vol_volume_voxels(volume, lo, hi);
        for (int a = 0; a < 3; a++)
            voxels *= (double)hi[a] - lo[a] + 1;
        return size * vol_cbrt(voxels);
    }
    return 1;
}
