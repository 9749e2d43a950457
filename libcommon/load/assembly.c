#include "load/assembly.h"

#include <math.h>
#include <stdlib.h>

#include "base/mem.h"
#include "base/number.h"
#include "trace/lights.h"

VolStatus vol_assemble_appearance(VolAssembly *assembly, const VolAppearanceSettings *settings, const VolLog *log,
                                  VolError *err)
{
    VolScene *scene = &assembly->scene;
    VolAppearance *appearance = &assembly->appearance;
    VolStatus status = vol_appearance_fit(appearance, &assembly->volume, settings, log, err);
    scene->volume = assembly->volume;
    scene->unit = appearance->unit;
    scene->tf = vol_appearance_compiled(appearance);
    scene->preint = vol_appearance_preint(appearance);
    scene->integrals = &appearance->integrals;
    return status;
}

VolStatus vol_assemble_lights(VolAssembly *assembly, const char *const *specs, size_t count, VolError *err)
{
    assembly->lights = vol_alloc(count ? count : 1, sizeof *assembly->lights);
    if (!assembly->lights)
        return vol_fail_memory(err, count * sizeof *assembly->lights);
    for (size_t i = 0; i < count; i++) {
        VolStatus status = vol_light_parse(specs[i], &assembly->lights[i], err);
        if (status)
            return status;
    }
    if (!count)
        assembly->lights[0] = vol_light_head();
    assembly->scene.lights = assembly->lights;
    assembly->scene.light_count = count ? count : 1;
    return VOL_OK;
}

VolStatus vol_assemble_light_grids(VolAssembly *assembly, VolError *err)
{
    VolLightGrids *grids = &assembly->light_grids;
    VolStatus status = vol_light_grids_check(grids, &assembly->volume, err);
    if (status || !grids->lit.grid_count)
        return status;
    vol_lit_settle(&grids->lit, &assembly->volume);
    grids->lit.phase = vol_phase_of(&assembly->appearance.tf);
    assembly->scene.lights = grids->lights;
    assembly->scene.light_count = grids->light_count;
    assembly->scene.lit = &grids->lit;
    return VOL_OK;
}

VolStatus vol_assemble_clips(VolAssembly *assembly, const char *const *planes, size_t count, VolError *err)
{
    assembly->clips = vol_alloc(count, sizeof *assembly->clips);
    if (!assembly->clips)
        return vol_fail_memory(err, count * sizeof *assembly->clips);
    for (size_t i = 0; i < count; i++) {
        double v[4];
        if (vol_parse_reals(planes[i], v, 4, 4) != 4)
            return vol_fail(err, VOL_USAGE, "--clip '%s': want NX,NY,NZ,D", planes[i]);
        if (v[0] == 0 && v[1] == 0 && v[2] == 0)
            return vol_fail(err, VOL_USAGE, "--clip '%s': its normal has no length", planes[i]);
        assembly->clips[i] = (VolClip){{v[0], v[1], v[2]}, v[3]};
    }
    assembly->scene.clips = assembly->clips;
    assembly->scene.clip_count = count;
    return VOL_OK;
}

/* Values of another magnitude than the nodes': a transfer function for numbers from 0 to 1 on those of a scanner. */
static bool far_apart(double lo, double hi, double from, double to)
{
    enum { FAR = 100 };
    return from < to && fmax(fabs(lo), fabs(hi)) >= FAR * fmax(fabs(from), fabs(to));
}

bool vol_assembly_explains_nothing(const VolAssembly *assembly, const VolLog *log)
{
    const VolTfCompiled *tf = assembly->scene.tf;
    double lo, hi, from = INFINITY, to = -INFINITY;
    const double unit = assembly->scene.unit;
    bool varies = vol_appearance_varies(tf, &from, &to) || tf->isosurface_count > 0;
    if (tf->isosurface_count > 0) {
        from = fmin(from, tf->isosurfaces[0].value);
        to = fmax(to, tf->isosurfaces[tf->isosurface_count - 1].value);
    }
    bool any = vol_volume_range(&assembly->volume, &lo, &hi), shown = any && vol_tf_range_visible(tf, lo, hi);
    lo *= unit, hi *= unit, from *= unit, to *= unit;
    if (vol_volume_is_empty(&assembly->volume))
        return true; /* said when it was loaded */
    if (!any)
        vol_warn(log, "no finite voxel in the grid: nothing to see");
    else if (!vol_volume_has_cell(&assembly->volume))
        vol_warn(log, "every cell of the grid has a corner that is NaN or infinite: nothing to see");
    else if (!shown)
        vol_warn(log, "the transfer function shows nothing in the data's range %g to %g", lo, hi);
    else if (varies && (from > hi || to < lo))
        vol_warn(log, "the transfer function's nodes, %g to %g, lie beyond the data's range %g to %g", from, to, lo, hi);
    else if (varies && !tf->isosurface_count && far_apart(lo, hi, from, to))
        vol_warn(log, "the data's values, %g to %g, lie far outside the transfer function's nodes, %g to %g: %s", lo, hi,
                 from, to, "is it for other data?");
    else
        return false;
    return true;
}

void vol_assembly_free(VolAssembly *assembly)
{
    vol_volume_free(&assembly->volume);
    vol_appearance_free(&assembly->appearance);
    vol_light_grids_free(&assembly->light_grids);
    free(assembly->lights);
    free(assembly->clips);
    *assembly = (VolAssembly){0};
}
