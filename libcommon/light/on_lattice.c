#include "light/on_lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "light/cone_medium.h"
#include "light/pde.h"
#include "light/strength.h"

static double nearest_of(const VolScene *scene) { return 0.5 * vol_volume_voxel(&scene->volume); }

/* ---- Cone ---- */

enum { LEAF_ROWS = VOL_LIGHT_LEAF * VOL_LIGHT_LEAF };

/* Rows of leaves in which a point counts. */
static size_t list_rows(const VolLightLattice *lattice, VolConeRow *rows)
{
    size_t count = 0;
    for (size_t i = 0; i < lattice->leaf_count; i++) {
        const VolLightLeaf *leaf = &lattice->leaves[i];
        for (int r = 0; r < LEAF_ROWS; r++) {
            if (!(leaf->active[r / 8] >> r % 8 * 8 & 255))
                continue;
            rows[count++] = (VolConeRow){.first = {leaf->origin[0] + r / 8, leaf->origin[1] + r % 8, leaf->origin[2]},
                                         .count = VOL_LIGHT_LEAF,
                                         .at = i * VOL_LIGHT_LEAF_POINTS + (size_t)r * VOL_LIGHT_LEAF};
        }
    }
    return count;
}

/* RGB with fall-off but without a spot's profile, which is in `passed` already. */
static void color_leaf(const VolLightLattice *lattice, size_t i, const VolLight *light, double nearest,
                       const float *const passed[3], float *out)
{
    const VolLightLeaf *leaf = &lattice->leaves[i];
    VolLight without = *light;
    if (without.kind == VOL_LIGHT_SPOT)
        without.kind = VOL_LIGHT_POINT;
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++) {
        size_t at = i * VOL_LIGHT_LEAF_POINTS + (size_t)n;
        bool counts = vol_light_leaf_has(leaf, n);
        double strength = counts ? vol_light_strength(&without, vol_light_point(lattice, leaf, n), nearest) : 0;
        for (int c = 0; c < 3; c++)
            out[3 * at + (size_t)c] = counts ? (float)(light->rgb[c] * strength * (double)passed[c][at]) : 0;
    }
}

static VolStatus place_planes(const VolScene *scene, const VolLight *light, const VolLightLattice *lattice,
                              const VolConeOptions *options, VolConePlanes *planes, VolCone *cone, VolError *err)
{
    double tangent = vol_tan(options->angle * (3.14159265358979323846 / 360));
    VolConeDomain domain = {.index_to_world = *vol_volume_to_world(&scene->volume)};
    vol_volume_domain(&scene->volume, domain.lo, domain.hi);
    cone->rate = 0.5 * options->blur_length * tangent * tangent;
    if (!options->as_printed)
        return vol_cone_planes(light, &domain, vol_affine_voxel(&lattice->index_to_world), cone->rate, planes, err);
    VolStatus status = vol_cone_slices(light, &domain, planes, err);
    VolVec3 normal = vol_cross(planes->across[0], planes->across[1]);
    cone->taps = tangent * planes->step * fabs(vol_dot(planes->along, normal)) / vol_length(normal);
    return status;
}

VolStatus vol_cone_on_lattice(const VolScene *scene, const VolLight *light, const VolLightLattice *lattice,
                              const VolConeOptions *options, float *out, VolError *err)
{
    enum { SAMPLES = 2 };
    const size_t points = lattice->leaf_count * VOL_LIGHT_LEAF_POINTS;
    VolConePlanes planes;
    VolConeMedium medium = {0};
    VolConeRow *rows = vol_alloc(lattice->leaf_count, LEAF_ROWS * sizeof *rows);
    float *passed = vol_alloc_zero(points, 3 * sizeof *passed);
    VolCone cone = {.planes = &planes, .light = light, .index_to_world = lattice->index_to_world, .rows = rows,
                    .pass = vol_cone_medium_pass, .user = &medium, .threads = options->threads};
    VolStatus status = rows && passed ? VOL_OK : vol_fail_memory(err, points * 3 * sizeof *passed);
    if (status == VOL_OK && points) {
        status = place_planes(scene, light, lattice, options, &planes, &cone, err);
        cone.row_count = list_rows(lattice, rows);
        if (status == VOL_OK)
            status = vol_cone_medium_new(scene, SAMPLES, options->threads, &medium, err);
        cone.channels = medium.channels;
        for (int c = 0; c < 3; c++)
            cone.out[c] = passed + (c < cone.channels ? points * (size_t)c : 0);
        if (status == VOL_OK)
            status = vol_cone_solve(&cone, err);
        const float *const each[3] = {cone.out[0], cone.out[1], cone.out[2]};
        for (size_t i = 0; i < lattice->leaf_count && status == VOL_OK; i++)
            color_leaf(lattice, i, light, nearest_of(scene), each, out);
    }
    vol_cone_medium_free(&medium);
    free(rows);
    free(passed);
    return status;
}

/* ---- pde ---- */

/* All points of a lattice's box, each light's transmittances there. */
typedef struct Box {
    VolLightLattice lattice;
    int32_t leaves[3], first[3]; /* along each axis; the first leaf's origin */
    int channels;
    float **T;
    size_t light_count;
} Box;

static int32_t leaf_origin(int32_t x) { return x & ~(VOL_LIGHT_LEAF - 1); }

/* Of the leaf at `origin`: points within the box. */
static void activate(const VolLightLattice *lattice, VolLightLeaf *leaf)
{
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++) {
        const int32_t at[3] = {leaf->origin[0] + n / 64, leaf->origin[1] + n / 8 % 8, leaf->origin[2] + n % 8};
        bool inside = true;
        for (int a = 0; a < 3; a++)
            inside = inside && at[a] >= lattice->lo[a] && at[a] <= lattice->hi[a];
        if (inside)
            leaf->active[n / 64] |= (uint64_t)1 << n % 64;
    }
}

static VolStatus box_new(const VolLightLattice *lattice, size_t lights, Box *box, VolError *err)
{
    size_t count = 1;
    *box = (Box){.lattice = *lattice, .light_count = lights};
    for (int a = 0; a < 3; a++) {
        box->first[a] = leaf_origin(lattice->lo[a]);
        box->leaves[a] = (leaf_origin(lattice->hi[a]) - box->first[a]) / VOL_LIGHT_LEAF + 1;
        count *= (size_t)box->leaves[a];
    }
    box->lattice.leaf_count = count;
    box->lattice.leaves = vol_alloc_zero(count, sizeof *box->lattice.leaves);
    box->T = vol_alloc_zero(lights, sizeof *box->T);
    if (!box->lattice.leaves || !box->T)
        return vol_fail_memory(err, count * sizeof *box->lattice.leaves);
    for (size_t i = 0; i < count; i++) {
        VolLightLeaf *leaf = &box->lattice.leaves[i];
        size_t z = i % (size_t)box->leaves[2], y = i / (size_t)box->leaves[2] % (size_t)box->leaves[1];
        const size_t at[3] = {i / (size_t)box->leaves[2] / (size_t)box->leaves[1], y, z};
        for (int a = 0; a < 3; a++)
            leaf->origin[a] = box->first[a] + (int32_t)at[a] * VOL_LIGHT_LEAF;
        activate(lattice, leaf);
    }
    return VOL_OK;
}

static void box_free(Box *box)
{
    for (size_t k = 0; box->T && k < box->light_count; k++)
        free(box->T[k]);
    free(box->T);
    free(box->lattice.leaves);
}

/* Where a point's values stand. */
static size_t box_at(const Box *box, const int32_t at[3])
{
    const int32_t x = at[0] - box->first[0], y = at[1] - box->first[1], z = at[2] - box->first[2];
    size_t leaf = ((size_t)(x / 8) * (size_t)box->leaves[1] + (size_t)(y / 8)) * (size_t)box->leaves[2] + (size_t)(z / 8);
    return leaf * VOL_LIGHT_LEAF_POINTS + (size_t)(x % 8 * 64 + y % 8 * 8 + z % 8);
}

static VolStatus box_row(void *user, size_t light, int32_t x, int32_t y, int thread, float *const t[3], VolError *err)
{
    (void)thread;
    (void)err;
    const Box *box = user;
    const int32_t *lo = box->lattice.lo, length = box->lattice.hi[2] - lo[2] + 1;
    for (int32_t z = 0; z < length; z++) {
        size_t at = box_at(box, (int32_t[3]){lo[0] + x, lo[1] + y, lo[2] + z}) * (size_t)box->channels;
        for (int c = 0; c < 3; c++)
            t[c][z] = box->T[light][at + (box->channels == 3 ? (size_t)c : 0)];
    }
    return VOL_OK;
}

static VolStatus cast_shadows(const VolPrepared *prepared, const VolPdeOptions *options, Box *box, VolError *err)
{
    VolStatus status = VOL_OK;
    size_t points = box->lattice.leaf_count * VOL_LIGHT_LEAF_POINTS;
    box->channels = vol_shadow_channels(prepared->scene);
    for (size_t k = 0; status == VOL_OK && k < options->light_count; k++) {
        VolShadowCounts counts = {0};
        box->T[k] = vol_alloc(points, (size_t)box->channels * sizeof **box->T);
        VolShadow shadow = {.prepared = prepared, .light = &options->lights[k], .lattice = &box->lattice,
                            .mask = options->occluders, .absorption = options->absorption,
                            .threads = options->threads, .T = box->T[k]};
        status = shadow.T ? vol_shadow_rays(&shadow, &counts, err) : vol_fail_memory(err, points * sizeof **box->T);
    }
    return status;
}

static void read_leaf(const VolPde *pde, const VolLightLattice *lattice, size_t i, float *out)
{
    const VolLightLeaf *leaf = &lattice->leaves[i];
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++) {
        bool counts = vol_light_leaf_has(leaf, n);
        size_t x = (size_t)(leaf->origin[0] + n / 64 - lattice->lo[0]);
        size_t y = (size_t)(leaf->origin[1] + n / 8 % 8 - lattice->lo[1]);
        size_t v = (x * (size_t)pde->n[1] + y) * (size_t)pde->n[2] + (size_t)(leaf->origin[2] + n % 8 - lattice->lo[2]);
        for (size_t c = 0; c < 3; c++)
            out[3 * (i * VOL_LIGHT_LEAF_POINTS + (size_t)n) + c] = counts ? pde->total[c][v] : 0;
    }
}

/* What the mask's nearest voxel says of each of the box's. */
static void read_mask(const VolPde *pde, const VolGrid *mask, uint8_t *medium)
{
    size_t v = 0;
    for (int32_t x = 0; x < pde->n[0]; x++)
        for (int32_t y = 0; y < pde->n[1]; y++)
            for (int32_t z = 0; z < pde->n[2]; z++) {
                VolVec3 at = vol_apply(&mask->world_to_index, vol_apply(&pde->index_to_world, vol_vec3(x, y, z)));
                double value = vol_grid_voxel(mask, (int32_t)floor(at.x + 0.5), (int32_t)floor(at.y + 0.5),
                                              (int32_t)floor(at.z + 0.5));
                medium[v++] = value == VOL_MASK_BLANK      ? VOL_MEDIUM_BLANK
                              : value == VOL_MASK_OCCLUDER ? VOL_MEDIUM_OCCLUDER
                                                           : VOL_MEDIUM_INSIDE;
            }
}

static VolStatus spread_in_box(const VolPrepared *prepared, const VolLightLattice *lattice, const VolPdeOptions *options,
                               Box *box, VolPde *pde, double *residual, VolError *err)
{
    VolVec3 corner = vol_apply(&lattice->index_to_world, vol_vec3(lattice->lo[0], lattice->lo[1], lattice->lo[2]));
    const double origin[3] = {corner.x, corner.y, corner.z};
    size_t voxels = 1;
    memcpy(pde->index_to_world.m[3], origin, sizeof origin);
    memcpy(pde->spread, options->spread, sizeof pde->spread);
    for (int a = 0; a < 3; a++) {
        pde->n[a] = lattice->hi[a] - lattice->lo[a] + 1;
        voxels *= (size_t)pde->n[a];
    }
    for (int c = 0; c < 3; c++)
        if (!(pde->total[c] = vol_alloc(voxels, sizeof *pde->total[c])))
            return vol_fail_memory(err, voxels * sizeof *pde->total[c]);
    uint8_t *medium = options->mask ? vol_alloc(voxels, 1) : NULL;
    if (options->mask && !medium)
        return vol_fail_memory(err, voxels);
    if (medium)
        read_mask(pde, options->mask, medium);
    pde->medium = medium;
    VolStatus status = options->as_printed ? VOL_OK : cast_shadows(prepared, options, box, err);
    if (status == VOL_OK)
        status = vol_pde_solve(pde, residual, err);
    free(medium);
    return status;
}

VolStatus vol_pde_on_lattice(const VolPrepared *prepared, const VolLightLattice *lattice, const VolPdeOptions *options,
                             float *out, double *residual, VolError *err)
{
    Box box;
    const VolScene *scene = prepared->scene;
    VolPde pde = {.index_to_world = lattice->index_to_world, .lights = options->lights, .light_count = options->light_count,
                  .nearest = nearest_of(scene), .absorption = options->as_printed ? options->absorption : 1,
                  .preview = options->preview, .transmittance = options->as_printed ? NULL : box_row, .user = &box,
                  .scene = scene, .sweeps = options->sweeps, .threads = options->threads, .cpu = scene->cpu};
    if (residual)
        *residual = 0;
    if (!lattice->leaf_count)
        return VOL_OK;
    VolStatus status = box_new(lattice, options->light_count, &box, err);
    if (status == VOL_OK)
        status = spread_in_box(prepared, lattice, options, &box, &pde, residual, err);
    for (size_t i = 0; i < lattice->leaf_count && status == VOL_OK; i++)
        read_leaf(&pde, lattice, i, out);
    for (int c = 0; c < 3; c++)
        free(pde.total[c]);
    box_free(&box);
    return status;
}
