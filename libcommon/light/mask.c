#include "light/mask.h"

#include <math.h>
#include <string.h>

#include "base/mem.h"

enum { SIDE = 8, VOXELS = SIDE * SIDE * SIDE };

/* What of a voxel's value and its mask becomes its value. */
typedef double Rule(double value, double mask);

static double without_blanks(double value, double mask) { return mask == VOL_MASK_BLANK ? (double)NAN : value; }
static double occluder(double value, double mask)
{
    (void)value;
    return mask == VOL_MASK_OCCLUDER;
}

/* Whether some voxel's mask is `kind`. */
static bool has_kind(const VolGrid *grid, const VolGrid *mask, int kind)
{
    const int32_t *lo = grid->voxel_min, *hi = grid->voxel_max;
    for (int32_t x = lo[0]; x <= hi[0]; x++)
        for (int32_t y = lo[1]; y <= hi[1]; y++)
            for (int32_t z = lo[2]; z <= hi[2]; z++)
                if (vol_grid_voxel(mask, x, y, z) == kind)
                    return true;
    return false;
}

static VolStatus put_leaf(const VolGrid *grid, const VolGrid *mask, Rule *rule, const int32_t origin[3],
                          VolGridBuilder *builder, VolError *err)
{
    double values[VOXELS];
    float narrow[VOXELS];
    uint64_t active[SIDE] = {0};
    for (int n = 0; n < VOXELS; n++) {
        const int32_t at[3] = {origin[0] + n / 64, origin[1] + n / 8 % 8, origin[2] + n % 8};
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && at[a] >= grid->voxel_min[a] && at[a] <= grid->voxel_max[a];
        values[n] = inside ? rule(vol_grid_voxel(grid, at[0], at[1], at[2]), vol_grid_voxel(mask, at[0], at[1], at[2]))
                           : 0;
        narrow[n] = (float)values[n];
        active[n / 64] |= (uint64_t)inside << n % 64;
    }
    return vol_grid_leaf(builder, origin, grid->is_double ? NULL : narrow, grid->is_double ? values : NULL, active, err);
}

/* A grid with the domain of `grid`. */
static VolStatus remade(const VolGrid *grid, const VolGrid *mask, Rule *rule, double background, int threads, VolGrid **out,
                        VolError *err)
{
    VolGridSource source = {.index_to_world = grid->index_to_world, .background = background,
                            .box = grid->domain == VOL_DOMAIN_BOX, .as_double = grid->is_double,
                            .active_voxels = grid->active_voxels, .threads = threads};
    VolGridBuilder *builder;
    memcpy(source.box_min, grid->voxel_min, sizeof source.box_min);
    memcpy(source.box_max, grid->voxel_max, sizeof source.box_max);
    VolStatus status = vol_grid_begin(&source, &builder, err);
    if (status)
        return status;
    for (int32_t x = grid->voxel_min[0] & ~7; x <= grid->voxel_max[0] && !status; x += SIDE)
        for (int32_t y = grid->voxel_min[1] & ~7; y <= grid->voxel_max[1] && !status; y += SIDE)
            for (int32_t z = grid->voxel_min[2] & ~7; z <= grid->voxel_max[2] && !status; z += SIDE)
                status = put_leaf(grid, mask, rule, (const int32_t[3]){x, y, z}, builder, err);
    if (!status)
        return vol_grid_finish(builder, out, err);
    vol_grid_builder_free(builder);
    return status;
}

static VolStatus check_places(const VolGrid *grid, const VolGrid *mask, VolError *err)
{
    for (int n = 0; n < 8; n++) {
        const VolVec3 corner = {n & 1 ? grid->voxel_max[0] : grid->voxel_min[0],
                                n & 2 ? grid->voxel_max[1] : grid->voxel_min[1],
                                n & 4 ? grid->voxel_max[2] : grid->voxel_min[2]};
        VolVec3 apart = vol_sub(vol_apply(&grid->index_to_world, corner), vol_apply(&mask->index_to_world, corner));
        if (!(vol_length(apart) <= 1e-3 * grid->voxel))
            return vol_fail(err, VOL_BAD_INPUT, "the voxels of grid 'mask' are not those of the volume");
    }
    return VOL_OK;
}

/* An opaque isosurface around the occluders. */
static VolStatus build_wall(const VolScene *scene, VolLightMask *out, VolError *err)
{
    VolTf tf = vol_tf_defaults();
    VolTfIsosurface wall = {.value = 0.5, .opacity = 1, .color_given = true};
    tf.isosurfaces = &wall;
    tf.isosurface_count = 1;
    tf.model = VOL_MODEL_UNSHADED;
    tf.scalar_step = 1;
    VolStatus status = vol_tf_compile(&tf, NULL, &out->wall, err);
    if (status)
        return status;
    out->scene = *scene;
    out->scene.volume = vol_volume_of_grid(out->occluders);
    out->scene.tf = &out->wall;
    out->scene.unit = 1;
    return vol_scene_prepare(&out->scene, &out->prepared, err);
}

VolStatus vol_light_mask_new(const VolScene *scene, const VolGrid *mask, int threads, VolLightMask *out, VolError *err)
{
    const VolGrid *grid = scene->volume.grid;
    *out = (VolLightMask){0};
    if (grid->empty)
        return VOL_OK;
    VolStatus status = check_places(grid, mask, err);
    if (!status && has_kind(grid, mask, VOL_MASK_BLANK)) {
        VolGrid *masked;
        status = remade(grid, mask, without_blanks, grid->background, threads, &masked, err);
        if (!status)
            out->volume = vol_volume_of_grid(masked);
    }
    if (!status && has_kind(grid, mask, VOL_MASK_OCCLUDER)) {
        status = remade(grid, mask, occluder, 0, threads, &out->occluders, err);
        if (!status)
            status = build_wall(scene, out, err);
    }
    return status;
}

void vol_light_mask_free(VolLightMask *mask)
{
    if (mask->volume.kind)
        vol_volume_free(&mask->volume);
    vol_prepared_free(&mask->prepared);
    if (mask->wall.intervals)
        vol_tf_compiled_free(&mask->wall);
    vol_grid_free(mask->occluders);
    *mask = (VolLightMask){0};
}

bool vol_light_mask_hides(const VolLightMask *mask, VolVec3 place)
{
    const VolGrid *grid = mask->occluders;
    if (!grid)
        return false;
    VolVec3 at = vol_apply(&grid->world_to_index, place);
    return vol_grid_voxel(grid, (int32_t)floor(at.x + 0.5), (int32_t)floor(at.y + 0.5), (int32_t)floor(at.z + 0.5)) == 1;
}
