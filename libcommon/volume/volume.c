#include "volume/volume.h"

void vol_volume_free(VolVolume *volume)
{
    vol_grid_free(volume->grid);
    *volume = (VolVolume){VOL_VOLUME_NONE};
}

bool vol_volume_is_empty(const VolVolume *volume) { return volume->grid->empty; }

void vol_volume_domain(const VolVolume *volume, double lo[3], double hi[3])
{
    for (int a = 0; a < 3; a++) {
        lo[a] = volume->grid->domain_min[a];
        hi[a] = volume->grid->domain_max[a];
    }
}

VolVec3 vol_volume_corner(const VolVolume *volume, int n)
{
    double lo[3], hi[3];
    vol_volume_domain(volume, lo, hi);
    VolVec3 index = {n & 1 ? hi[0] : lo[0], n & 2 ? hi[1] : lo[1], n & 4 ? hi[2] : lo[2]};
    return vol_apply(vol_volume_to_world(volume), index);
}

const VolAffine *vol_volume_to_world(const VolVolume *volume) { return &volume->grid->index_to_world; }
const VolAffine *vol_volume_to_index(const VolVolume *volume) { return &volume->grid->world_to_index; }

double vol_volume_voxel(const VolVolume *volume) { return volume->grid->voxel; }

void vol_volume_voxels(const VolVolume *volume, int32_t lo[3], int32_t hi[3])
{
    for (int a = 0; a < 3; a++) {
        lo[a] = volume->grid->voxel_min[a];
        hi[a] = volume->grid->voxel_max[a];
    }
}

/* The longest diagonal of a box in index space, in world units. */
static double diagonal(const VolAffine *to_world, const double size[3])
{
    double longest = 0;
    for (int i = 0; i < 4; i++) {
        VolVec3 corner = vol_vec3(size[0], i & 1 ? -size[1] : size[1], i & 2 ? -size[2] : size[2]);
        longest = fmax(longest, vol_length(vol_apply_linear(to_world, corner)));
    }
    return longest;
}

double vol_volume_longest_way(const VolVolume *volume)
{
    const VolGrid *grid = volume->grid;
    const double node[3] = {VOL_NODE_CELLS, VOL_NODE_CELLS, VOL_NODE_CELLS};
    double all[3];
    for (int a = 0; a < 3; a++)
        all[a] = grid->domain_max[a] - grid->domain_min[a];
    double nodes = (double)grid->node_count + (double)grid->roots.count * VOL_ROOT_NODES;
    return fmin(diagonal(&grid->index_to_world, all), nodes * diagonal(&grid->index_to_world, node));
}

bool vol_volume_range(const VolVolume *volume, double *lo, double *hi) { return vol_grid_range(volume->grid, lo, hi); }
bool vol_volume_is_double(const VolVolume *volume) { return volume->grid->is_double; }
void vol_volume_rescale(VolVolume *volume, int exponent) { vol_grid_rescale(volume->grid, exponent); }
double vol_volume_change(const VolVolume *volume, double length) { return vol_grid_change(volume->grid, length); }

bool vol_volume_has_cell(const VolVolume *volume) { return vol_grid_has_cell(volume->grid); }

VolVolumeCounts vol_volume_counts(const VolVolume *volume)
{
    const VolGrid *grid = volume->grid;
    return (VolVolumeCounts){grid->active_voxels, grid->bad_voxels, grid->brick_count, grid->stored_bricks};
}

void vol_volume_part_range(const VolVolume *volume, size_t part, double *lo, double *hi)
{
    *lo = volume->grid->bricks[part].lo;
    *hi = volume->grid->bricks[part].hi;
}

const double *vol_volume_part_values(const VolVolume *volume, size_t part, size_t *count)
{
    const VolGrid *grid = volume->grid;
    const VolBrick *brick = &grid->bricks[part];
    *count = 1;
    if (vol_brick_is_uniform(brick))
        return &brick->uniform;
    if (brick->octants) {
        *count = 8;
        return grid->octants[brick->octants - 1].value;
    }
    *count = VOL_BRICK_VALUES;
    return (const double *)grid->values + (size_t)brick->storage * VOL_BRICK_STRIDE;
}
