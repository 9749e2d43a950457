#include "trace/lit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

VolStatus vol_lit_begin(size_t grid_count, VolLit *out, VolError *err)
{
    *out = (VolLit){.grid_count = grid_count};
    out->grids = vol_alloc_zero(grid_count, sizeof *out->grids);
    out->lattice = vol_alloc_zero(grid_count, sizeof *out->lattice);
    return out->grids && out->lattice ? VOL_OK : vol_fail_memory(err, grid_count * sizeof *out->lattice);
}

static bool is_near(VolVec3 v, VolVec3 to)
{
    const double near = 1e-6;
    return fabs(v.x - to.x) < near && fabs(v.y - to.y) < near && fabs(v.z - to.z) < near;
}

/* Whether a grid has its voxels in the places of these, but for a whole number of them. */
static bool is_shifted(const VolAffine *index_to_world, const VolGrid *grid)
{
    static const VolVec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    VolVec3 origin = vol_apply(&grid->world_to_index, vol_apply(index_to_world, (VolVec3){0, 0, 0}));
    bool shifted = is_near(origin, vol_vec3(nearbyint(origin.x), nearbyint(origin.y), nearbyint(origin.z)));
    for (int a = 0; a < 3; a++)
        shifted = shifted && is_near(vol_apply_linear(&grid->world_to_index, vol_apply_linear(index_to_world, axis[a])),
                                     axis[a]);
    return shifted;
}

void vol_lit_settle(VolLit *lit, const VolVolume *volume)
{
    lit->apart = false;
    for (size_t n = 0; n < lit->grid_count; n++) {
        size_t like = 0;
        while (memcmp(&lit->grids[like]->index_to_world, &lit->grids[n]->index_to_world, sizeof(VolAffine)) != 0)
            like++;
        lit->lattice[n] = like;
        lit->apart = lit->apart || (like == n && !is_shifted(vol_volume_to_world(volume), lit->grids[n]));
    }
}

void vol_lit_free(VolLit *lit)
{
    free(lit->grids);
    free(lit->lattice);
    *lit = (VolLit){0};
}

static double most_of(const VolGrid *grid)
{
    double lo, hi;
    return vol_grid_range(grid, &lo, &hi) ? fmax(fabs(lo), fabs(hi)) : 0;
}

double vol_lit_bound(const VolScene *scene, double sent, bool scattered)
{
    const VolLit *lit = scene->lit;
    double transmittance = 1, indirect = 0;
    for (size_t n = 0; n < lit->grid_count; n++) {
        if (n < vol_lit_direct_count(scene))
            transmittance = fmax(transmittance, most_of(lit->grids[n]));
        else
            indirect += most_of(lit->grids[n]);
    }
    return sent * transmittance * (scattered ? vol_phase_most(&lit->phase) : 1) + indirect;
}
