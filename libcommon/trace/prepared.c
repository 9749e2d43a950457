#include "trace/prepared.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "tf/limits.h"
#include "trace/conditioning.h"
#include "trace/lit.h"
#include "trace/tf_tables.h"

/* The most that all lights together send to any place, in any channel. */
static double sent_bound(const VolPrepared *p)
{
    const VolScene *scene = p->scene;
    double bound = 0;
    for (int c = 0; c < 3; c++) {
        double light = 0;
        for (size_t i = 0; i < scene->light_count; i++) {
            const VolLight *l = &scene->lights[i];
            light += vol_light_stands(l) ? l->rgb[c] / (p->nearest_light * p->nearest_light) : l->rgb[c];
        }
        bound = fmax(bound, light);
    }
    return bound;
}

/* Largest radiance that the lights can make of base colour `color`. */
static double shaded_bound(const VolPrepared *p, double color)
{
    const VolTfCompiled *tf = p->scene->tf;
    double light = sent_bound(p);
    if (p->scene->lit) /* ambient light may be the indirect, or what is sent */
        light = fmax(light, vol_lit_bound(p->scene, light, false));
    return light * ((tf->ambient + tf->diffuse) * color + tf->specular);
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
    for (size_t i = 0; i < scene->light_count; i++) {
        p->lit_aside = p->lit_aside || scene->lights[i].kind != VOL_LIGHT_HEAD;
        p->lit_from_places = p->lit_from_places || vol_light_stands(&scene->lights[i]);
    }
    p->nearest_light = 0.5 * vol_volume_voxel(&scene->volume);
    p->color_bound = tf->max_color;
    if (p->shaded)
        p->color_bound = fmax(tf->max_color, classic ? tf->max_color * shaded_bound(p, 1)
                                                     : shaded_bound(p, tf->max_color));
    if (scene->lit)
        p->color_bound = fmax(p->color_bound, tf->max_color * vol_lit_bound(scene, sent_bound(p), true));
    p->termination_opacity = scene->termination_opacity;
    if (p->termination_opacity == 0)
        p->termination_opacity = scene->precise ? 0x1p-60 : 0x1p-28;
    p->termination_depth = depth_to_end_at(p, 0);
}

/* ---- What floats can hold ---- */

#define MOST_NUMBER 1e36
/* Of all of a ray, the background included. */
#define BRIGHTEST_PIXEL (0.99 * FLT_MAX)

/* How far a place is from the box around the domain. */
static double distance_to_domain(const VolVolume *volume, VolVec3 place)
{
    const double at[3] = {place.x, place.y, place.z};
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, square = 0;
    for (int n = 0; n < 8; n++) {
        VolVec3 corner = vol_volume_corner(volume, n);
        const double c[3] = {corner.x, corner.y, corner.z};
        for (int a = 0; a < 3; a++) {
            lo[a] = fmin(lo[a], c[a]);
            hi[a] = fmax(hi[a], c[a]);
        }
    }
    for (int a = 0; a < 3; a++) {
        double beside = fmax(fmax(lo[a] - at[a], at[a] - hi[a]), 0);
        square += beside * beside;
    }
    return sqrt(square);
}

/* The most light that can come to a place of the domain; INFINITY: float does not hold it. */
static double brightest_light(const VolPrepared *p)
{
    const VolScene *scene = p->scene;
    double sum[3] = {0};
    for (size_t i = 0; i < scene->light_count; i++) {
        const VolLight *light = &scene->lights[i];
        double scale = 1;
        if (vol_light_stands(light)) {
            double nearest = fmax(p->nearest_light, distance_to_domain(&scene->volume, light->position));
            scale = 1 / (nearest * nearest);
        }
        for (int c = 0; c < 3; c++)
            sum[c] += scale <= MOST_NUMBER ? light->rgb[c] * scale : INFINITY;
    }
    return fmax(sum[0], fmax(sum[1], sum[2]));
}

/* The most scattering extinction, per world unit. */
static double densest(const VolTfCompiled *tf)
{
    double most = 0;
    for (size_t i = 0; i <= tf->knot_count; i++) {
        const VolTfInterval *in = &tf->intervals[i];
        double width = in->v1 - in->v0;
        most = fmax(most, fmax(in->scatter.a, isfinite(width) ? in->scatter.a + in->scatter.b * width : 0));
    }
    return most;
}

/* No pixel may be infinite, nor anything on the way to it. */
static VolStatus check_brightness(const VolPrepared *p, VolError *err)
{
    const VolTfCompiled *tf = p->scene->tf;
    double light = p->shaded ? brightest_light(p) : 0, shading = tf->ambient + tf->diffuse + tf->specular;
    double lit = p->shaded ? light * shading * fmax(1, tf->max_color) : 0, most = fmax(tf->max_color, fmax(light, lit));
    if (p->scene->lit) {
        lit = fmax(lit, vol_lit_bound(p->scene, brightest_light(p), true) * fmax(1, shading) * fmax(1, tf->max_color));
        most = fmax(most, lit);
    }
    double way = vol_volume_is_empty(&p->scene->volume) ? 0 : vol_volume_longest_way(&p->scene->volume);
    if (!(most <= VOL_BRIGHTEST))
        return vol_fail(err, light > 1 ? VOL_USAGE : VOL_BAD_INPUT,
                        "colours and lights make places as bright as %.3g, more than %g: a picture could not hold it", most,
                        VOL_BRIGHTEST);
    if (!(densest(tf) * fmax(tf->max_color, p->scene->lit || tf->model == VOL_MODEL_CLASSIC ? lit : 0) <= MOST_NUMBER))
        return vol_fail(err, VOL_BAD_INPUT, "particles scatter more than %g per world unit: a picture could not hold it",
                        MOST_NUMBER);
    double emitted = tf->max_emit * way;
    if (emitted > 0 && !(emitted + most + p->scene->background_max <= BRIGHTEST_PIXEL))
        return vol_fail(err, VOL_BAD_INPUT, "a ray through the volume meets emission of %.3g: a picture could not hold it",
                        emitted);
    return VOL_OK;
}

VolStatus vol_scene_prepare(const VolScene *scene, VolPrepared *out, VolError *err)
{
    *out = (VolPrepared){.scene = scene};
    set_bounds(out);
    out->space.margin = scene->lit ? VOL_ROOT_CELLS : out->shaded ? 1 : 0; /* gradients may differ from 0 there */
    VolStatus status = check_brightness(out, err);
    if (!status)
        status = vol_empty_space_find(scene, &out->space, err);
    if (!status && !scene->precise)
        status = vol_conditioning_judge(scene, &out->space, out->shaded, &out->ill_conditioned, err);
    out->gives_up = out->ill_conditioned ||
                    (!scene->precise && (out->shaded || scene->estimator == VOL_ESTIMATE_EXACT));
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
                    {tf->has_emit, "emission"},     {prepared->scene->layers != 0, "layers"},
                    {prepared->scene->lit != NULL, "light grids"}};
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
