#include "render/scene.h"

#include <math.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "render/optics.h"

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

static void set_bounds(VolScene *scene)
{
    const VolTfCompiled *tf = scene->tf;
    bool classic = tf->model == VOL_MODEL_CLASSIC;
    scene->shaded = tf->model == VOL_MODEL_HYBRID ? tf->has_surface || tf->delta_count : classic && tf->has_scatter;
    scene->color_bound = tf->max_color;
    if (scene->shaded)
        scene->color_bound = fmax(tf->max_color, classic ? tf->max_color * shaded_bound(scene, 1)
                                                         : shaded_bound(scene, tf->max_color));
    scene->stop_opacity = scene->precise ? 0x1p-60 : 0x1p-28;
}

static void mark_visible(VolScene *scene)
{
    const VolGrid *grid = scene->grid;
    for (size_t b = 0; b < grid->brick_count; b++) {
        const VolBrick *brick = &grid->bricks[b];
        bool visible = brick->lo <= brick->hi && (!scene->skip || vol_tf_range_visible(scene->tf, brick->lo, brick->hi));
        scene->brick_visible[b] = visible;
        scene->bricks_visible += visible;
    }
    scene->bricks_skipped = grid->brick_count - scene->bricks_visible;
    scene->background_visible = scene->brick_visible[0];
    for (size_t n = 0; n < grid->node_count; n++) {
        const VolNode *node = &grid->nodes[n];
        bool visible = !node->bricks && scene->brick_visible[node->uniform];
        for (size_t i = 0; node->bricks && i < VOL_NODE_ENTRIES && !visible; i++)
            visible = scene->brick_visible[node->bricks[i]];
        scene->node_visible[n] = visible;
    }
}

VolStatus vol_scene_prepare(VolScene *scene, VolError *err)
{
    scene->brick_visible = vol_alloc(scene->grid->brick_count, 1);
    scene->node_visible = vol_alloc(scene->grid->node_count, 1);
    if (!scene->brick_visible || !scene->node_visible)
        return vol_fail_memory(err, scene->grid->brick_count);
    set_bounds(scene);
    mark_visible(scene);
    return scene->precise ? vol_optics_f64_new(scene->tf, &scene->optics64, err)
                          : vol_optics_f32_new(scene->tf, &scene->optics32, err);
}

void vol_scene_release(VolScene *scene)
{
    free(scene->brick_visible);
    free(scene->node_visible);
    vol_optics_f32_free(scene->optics32);
    vol_optics_f64_free(scene->optics64);
    scene->brick_visible = scene->node_visible = NULL;
    scene->optics32 = NULL;
    scene->optics64 = NULL;
}

double vol_scene_stop_depth(const VolScene *scene, double length)
{
    double most = fmax(fmax(1, scene->color_bound), fmax(scene->background_max, scene->tf->max_emit * length));
    return isfinite(most) ? vol_log(most / scene->stop_opacity) : INFINITY;
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
    VolVec3 o = vol_apply(&grid->world_to_index, ray->origin);
    VolVec3 d = vol_apply_linear(&grid->world_to_index, ray->direction);
    double os[3] = {o.x, o.y, o.z}, ds[3] = {d.x, d.y, d.z};
    if (grid->empty)
        return false;
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

VolTraceRay *vol_kernel(const VolScene *scene)
{
    enum { EXACT, DIRECT, SEGMENTS };
    static VolTraceRay *const plain[2][3] = {{vol_exact_f32, vol_direct_f32, vol_segments_f32},
                                             {vol_exact_f64, vol_direct_f64, vol_segments_f64}};
    int kind = scene->estimator == VOL_ESTIMATE_EXACT ? EXACT : scene->estimator == VOL_ESTIMATE_DIRECT ? DIRECT : SEGMENTS;
#if defined(__x86_64__)
    static VolTraceRay *const avx2[2][3] = {{vol_exact_f32_avx2, vol_direct_f32_avx2, vol_segments_f32_avx2},
                                            {vol_exact_f64_avx2, vol_direct_f64_avx2, vol_segments_f64_avx2}};
    if (scene->cpu == VOL_CPU_AVX2 || scene->cpu == VOL_CPU_AVX512)
        return avx2[scene->precise][kind];
#endif
    return plain[scene->precise][kind];
}
