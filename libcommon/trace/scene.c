#include "trace/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "trace/conditioning.h"
#include "trace/tf_tables.h"
#include "trace/empty_space.h"
#include "trace/walk.h"

/* Largest radiance that the lights can make of base colour `color`. */
static double shaded_bound(const VolScene *scene, double color)
{
    const VolTfCompiled *tf = scene->tf;
    double bound = 0;
    for (int c = 0; c < 3; c++) {
        double light = 0;
        for (size_t i = 0; i < scene->light_count; i++) {
            const VolLight *l = &scene->lights[i];
            bool falls_off = l->kind == VOL_LIGHT_POINT || l->kind == VOL_LIGHT_SPOT;
            double nearest = 0.5 * scene->grid->voxel;
            light += falls_off ? l->rgb[c] / (nearest * nearest) : l->rgb[c];
        }
        bound = fmax(bound, light * ((tf->ambient + tf->diffuse) * color + tf->specular));
    }
    return bound;
}

/* `emitted`: a bound on what emission may still send, beside what is reflected and seen through. */
static double termination_depth(const VolScene *scene, double emitted)
{
    double most = fmax(1, fmax(scene->color_bound, scene->background_max)) + emitted;
    return isfinite(most) ? vol_log(most / scene->termination_opacity) : INFINITY;
}

static void set_bounds(VolScene *scene)
{
    const VolTfCompiled *tf = scene->tf;
    bool classic = tf->model == VOL_MODEL_CLASSIC;
    scene->shaded = tf->model == VOL_MODEL_HYBRID ? tf->has_surface || tf->isosurface_count : classic && tf->has_scatter;
    scene->color_bound = tf->max_color;
    if (scene->shaded)
        scene->color_bound = fmax(tf->max_color, classic ? tf->max_color * shaded_bound(scene, 1)
                                                         : shaded_bound(scene, tf->max_color));
    if (scene->termination_opacity == 0)
        scene->termination_opacity = scene->precise ? 0x1p-60 : 0x1p-28;
    scene->termination_depth = termination_depth(scene, 0);
}

/* What is of one value is crossed in one stretch, bricks beside other values aside where gradients are asked for.  With
 * nothing but particles' colours at stake, which the classic model lights by ambient light too: where such light comes
 * from a place, it changes on the way. */
static int margin_of_blocks(const VolScene *scene)
{
    bool changes = false;
    for (size_t i = 0; i < scene->light_count; i++)
        changes = changes || scene->lights[i].kind == VOL_LIGHT_POINT || scene->lights[i].kind == VOL_LIGHT_SPOT;
    if (changes && scene->tf->model == VOL_MODEL_CLASSIC)
        return -1;
    return scene->shaded ? 1 : 0;
}

VolStatus vol_scene_prepare(VolScene *scene, VolError *err)
{
    set_bounds(scene);
    scene->margin = margin_of_blocks(scene);
    VolStatus status = vol_empty_space_prepare(scene, err);
    if (!status && !scene->precise)
        status = vol_conditioning_prepare(scene, err);
    if (!status && !scene->precise)
        status = vol_tf_tables_f32_new(scene, &scene->tables32, err);
    if (!status && (scene->precise || scene->ill_conditioned))
        status = vol_tf_tables_f64_new(scene, &scene->tables64, err);
    return status;
}

void vol_scene_release(VolScene *scene)
{
    scene->termination_opacity = 0; /* prepared anew it may be of another precision */
    vol_empty_space_release(scene);
    free(scene->ill_conditioned);
    scene->ill_conditioned = NULL;
    vol_tf_tables_f32_free(scene->tables32);
    vol_tf_tables_f64_free(scene->tables64);
    scene->tables32 = NULL;
    scene->tables64 = NULL;
}

void vol_scene_features_skipped(const VolScene *scene, char *out, size_t size)
{
    const VolTfCompiled *tf = scene->tf;
    const struct {
        bool present;
        const char *name;
    } features[] = {{tf->has_surface, "surfaces"},      {tf->isosurface_count > 0, "isosurfaces"},
                 {scene->shaded, "shading"},         {tf->coloured, "coloured attenuation"},
                 {tf->has_emit, "emission"},         {scene->layers != 0, "layers"}};
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; i < sizeof features / sizeof *features && used < size; i++)
        if (!features[i].present) {
            int n = snprintf(out + used, size - used, "%s%s", used ? ", " : "", features[i].name);
            used += n > 0 ? (size_t)n : 0;
        }
}

double vol_scene_termination_depth(const VolScene *scene, double length)
{
    if (!(scene->tf->max_emit > 0))
        return scene->termination_depth;
    return termination_depth(scene, scene->tf->max_emit * length);
}

/* Cuts [t0, t1] to a + b t >= 0. */
static void cut(double a, double b, double *t0, double *t1)
{
    if (b > 0)
        *t0 = fmax(*t0, -a / b);
    else if (b < 0)
        *t1 = fmin(*t1, -a / b);
    else if (a < 0)
        *t1 = -INFINITY;
}

bool vol_ray_clip(const VolScene *scene, VolRay *ray)
{
    const VolGrid *grid = scene->grid;
    double os[3], ds[3];
    if (grid->empty)
        return false;
    walk_ray(grid, ray, os, ds);
    for (int a = 0; a < 3; a++) {
        if (ds[a] == 0) {
            if (!(os[a] >= grid->domain_min[a] && os[a] <= grid->domain_max[a]))
                return false;
            continue;
        }
        /* The same formula as the walk through bricks uses, so that both meet the faces at the same t. */
        double inverse = 1 / ds[a];
        double first = (grid->domain_min[a] - os[a]) * inverse, second = (grid->domain_max[a] - os[a]) * inverse;
        ray->t0 = fmax(ray->t0, fmin(first, second));
        ray->t1 = fmin(ray->t1, fmax(first, second));
    }
    for (size_t i = 0; i < scene->clip_count; i++) {
        const VolClip *clip = &scene->clips[i];
        cut(vol_dot(clip->normal, ray->origin) - clip->d, vol_dot(clip->normal, ray->direction), &ray->t0, &ray->t1);
    }
    return ray->t0 < ray->t1;
}

static bool store_new(VolBrickStore *store, size_t places, size_t size)
{
    store->numbers = vol_alloc(places, size);
    store->key = vol_alloc_zero(places, sizeof *store->key);
    store->places = places;
    return store->numbers && store->key;
}

bool vol_ray_meets_visible(const VolScene *scene, const VolRay *ray)
{
    Walk walk;
    walk_begin(&walk, scene, ray);
    return walk.t < walk.end;
}

static VolStatus scratch_of_precision(const VolScene *scene, size_t real_size, VolScratch *out, VolError *err)
{
    enum { VALUES = 64, GRADIENTS = 256 };
    size_t size = real_size * VOL_BRICK_STRIDE;
    *out = (VolScratch){0};
    out->zeros = vol_alloc_zero(3, size);
    bool made = out->zeros && store_new(&out->values, VALUES, size) &&
                (!scene->shaded || store_new(&out->gradients, GRADIENTS, 3 * size));
    return made ? VOL_OK : vol_fail_memory(err, GRADIENTS * 3 * size);
}

VolStatus vol_scratch_new(const VolScene *scene, VolScratch *out, VolError *err)
{
    VolStatus status = scratch_of_precision(scene, scene->precise ? sizeof(double) : sizeof(float), out, err);
    if (!status && scene->ill_conditioned) {
        out->in_double = vol_alloc_zero(1, sizeof *out->in_double);
        status = out->in_double ? scratch_of_precision(scene, sizeof(double), out->in_double, err)
                                : vol_fail_memory(err, sizeof *out->in_double);
    }
    if (status)
        vol_scratch_free(out);
    return status;
}

void vol_scratch_free(VolScratch *scratch)
{
    if (scratch->in_double)
        vol_scratch_free(scratch->in_double);
    free(scratch->in_double);
    free(scratch->values.numbers);
    free(scratch->values.key);
    free(scratch->gradients.numbers);
    free(scratch->gradients.key);
    free(scratch->zeros);
    *scratch = (VolScratch){0};
}

static VolTraceRays *kernel_of(const VolScene *scene, bool precise)
{
    enum { EXACT, DIRECT, SEGMENTS };
    static VolTraceRays *const plain[2][3] = {{vol_exact_f32, vol_direct_f32, vol_segments_f32},
                                             {vol_exact_f64, vol_direct_f64, vol_segments_f64}};
    int kind = scene->estimator == VOL_ESTIMATE_EXACT ? EXACT : scene->estimator == VOL_ESTIMATE_DIRECT ? DIRECT : SEGMENTS;
#if defined(__x86_64__)
    static VolTraceRays *const avx2[2][3] = {{vol_exact_f32_avx2, vol_direct_f32_avx2, vol_segments_f32_avx2},
                                            {vol_exact_f64_avx2, vol_direct_f64_avx2, vol_segments_f64_avx2}};
    static VolTraceRays *const avx512[3] = {vol_exact_f32_avx512, vol_direct_f32_avx512, vol_segments_f32_avx512};
    if (scene->cpu == VOL_CPU_AVX512 && !precise)
        return avx512[kind];
    if (vol_cpu_runs_avx2(scene->cpu))
        return avx2[precise][kind];
#endif
    return plain[precise][kind];
}

/* Adds what the rays met in double to the thread's counts. */
static void take_counts(VolScratch *scratch)
{
    VolSkipped *sum = &scratch->skipped, *some = &scratch->in_double->skipped;
    sum->bricks_entered += some->bricks_entered;
    sum->blocks += some->blocks;
    sum->cells_met += some->cells_met;
    sum->rays_ended += some->rays_ended;
    *some = (VolSkipped){0};
}

static void trace_in_double(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    VolRay again[VOL_PACKET];
    VolRadiance got[VOL_PACKET];
    size_t place[VOL_PACKET], given_up = 0;
    for (size_t i = 0; i < count; i++)
        if (out[i].given_up) {
            again[given_up] = rays[i];
            place[given_up++] = i;
        }
    if (!given_up)
        return;
    scratch->skipped.rays_in_double += given_up;
    kernel_of(scene, true)(scene, scratch->in_double, again, given_up, got);
    for (size_t n = 0; n < given_up; n++)
        out[place[n]] = got[n];
    take_counts(scratch);
}

/* A trace tells one way of a ray, not also the one that was given up: only what is kept is traced aloud. */
static void trace_aloud(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    VolScene silent = *scene;
    silent.trace = NULL;
    for (size_t i = 0; i < count; i++) {
        kernel_of(scene, false)(&silent, scratch, &rays[i], 1, &out[i]);
        if (!out[i].given_up)
            kernel_of(scene, false)(scene, scratch, &rays[i], 1, &out[i]);
    }
    trace_in_double(scene, scratch, rays, count, out);
}

void vol_trace_rays(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    if (scene->trace && scene->ill_conditioned) {
        trace_aloud(scene, scratch, rays, count, out);
        return;
    }
    kernel_of(scene, scene->precise)(scene, scratch, rays, count, out);
    if (scene->ill_conditioned)
        trace_in_double(scene, scratch, rays, count, out);
}
