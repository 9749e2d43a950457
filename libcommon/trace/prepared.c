#include "trace/prepared.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "trace/conditioning.h"
#include "trace/fall_off.h"
#include "trace/tf_tables.h"

/* Largest radiance that the lights can make of base colour `color`. */
static double shaded_bound(const VolPrepared *p, double color)
{
    const VolScene *scene = p->scene;
    const VolTfCompiled *tf = scene->tf;
    double bound = 0;
    for (int c = 0; c < 3; c++) {
        double light = 0;
        for (size_t i = 0; i < scene->light_count; i++) {
            const VolLight *l = &scene->lights[i];
            bool falls_off = l->kind == VOL_LIGHT_POINT || l->kind == VOL_LIGHT_SPOT;
            light += falls_off ? l->rgb[c] / (p->nearest_light * p->nearest_light) : l->rgb[c];
        }
        bound = fmax(bound, light * ((tf->ambient + tf->diffuse) * color + tf->specular));
    }
    return bound;
}

/* `emitted`: a bound on what emission may still send, beside what is reflected and seen through. */
static double depth_to_end_at(const VolPrepared *p, double emitted)
{
    double most = fmax(1, fmax(p->color_bound, p->scene->background_max)) + emitted;
    return isfinite(most) ? vol_log(most / p->termination_opacity) : INFINITY;
}

static void set_bounds(VolPrepared *p)
{
    const VolScene *scene = p->scene;
    const VolTfCompiled *tf = scene->tf;
    bool classic = tf->model == VOL_MODEL_CLASSIC;
    p->shaded = tf->model == VOL_MODEL_HYBRID ? tf->has_surface || tf->isosurface_count : classic && tf->has_scatter;
    p->nearest_light = 0.5 * vol_volume_voxel(&scene->volume);
    p->color_bound = tf->max_color;
    if (p->shaded)
        p->color_bound = fmax(tf->max_color, classic ? tf->max_color * shaded_bound(p, 1)
                                                     : shaded_bound(p, tf->max_color));
    p->termination_opacity = scene->termination_opacity;
    if (p->termination_opacity == 0)
        p->termination_opacity = scene->precise ? 0x1p-60 : 0x1p-28;
    p->termination_depth = depth_to_end_at(p, 0);
}

VolStatus vol_scene_prepare(const VolScene *scene, VolPrepared *out, VolError *err)
{
    *out = (VolPrepared){.scene = scene};
    set_bounds(out);
    out->lit_from_places = vol_lights_fall_off(scene);
    out->space.margin = out->shaded ? 1 : 0; /* gradients may differ from 0 there */
    VolStatus status = vol_empty_space_find(scene, &out->space, err);
    if (!status && !scene->precise)
        status = vol_conditioning_judge(scene, &out->space, out->shaded, &out->ill_conditioned, err);
    out->gives_up = out->ill_conditioned || (!scene->precise && scene->estimator == VOL_ESTIMATE_EXACT);
    if (!status && !scene->precise)
        status = vol_tf_tables_f32_new(scene, &out->tables32, err);
    if (!status && (scene->precise || out->gives_up))
        status = vol_tf_tables_f64_new(scene, &out->tables64, err);
    return status;
}

void vol_prepared_free(VolPrepared *prepared)
{
    vol_empty_space_free(&prepared->space);
    free(prepared->ill_conditioned);
    vol_tf_tables_f32_free(prepared->tables32);
    vol_tf_tables_f64_free(prepared->tables64);
    *prepared = (VolPrepared){0};
}

void vol_features_skipped(const VolPrepared *prepared, char *out, size_t size)
{
    const VolTfCompiled *tf = prepared->scene->tf;
    const struct {
        bool present;
        const char *name;
    } features[] = {{tf->has_surface, "surfaces"},  {tf->isosurface_count > 0, "isosurfaces"},
                    {prepared->shaded, "shading"},  {tf->coloured, "coloured attenuation"},
                    {tf->has_emit, "emission"},     {prepared->scene->layers != 0, "layers"}};
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; i < sizeof features / sizeof *features && used < size; i++)
        if (!features[i].present) {
            int n = snprintf(out + used, size - used, "%s%s", used ? ", " : "", features[i].name);
            used += n > 0 ? (size_t)n : 0;
        }
}

double vol_termination_depth(const VolPrepared *prepared, double length)
{
    const VolTfCompiled *tf = prepared->scene->tf;
    return tf->max_emit > 0 ? depth_to_end_at(prepared, tf->max_emit * length) : prepared->termination_depth;
}

bool vol_ray_meets_visible(const VolPrepared *prepared, const VolRay *ray)
{
    return vol_empty_space_is_left(prepared->scene, &prepared->space, ray);
}
