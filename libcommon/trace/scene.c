#include "trace/scene.h"

#include <math.h>

#include "trace/index_ray.h"

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
    const VolVolume *volume = &scene->volume;
    double lo[3], hi[3];
    if (vol_volume_is_empty(volume))
        return false;
    IndexRay in_index = index_ray(vol_volume_to_index(volume), ray);
    vol_volume_domain(volume, lo, hi);
    for (int a = 0; a < 3; a++) {
        if (in_index.d[a] == 0) {
            if (!(in_index.o[a] >= lo[a] && in_index.o[a] <= hi[a]))
                return false;
            continue;
        }
        double first = plane_time(&in_index, a, lo[a]), second = plane_time(&in_index, a, hi[a]);
        ray->t0 = fmax(ray->t0, fmin(first, second));
        ray->t1 = fmin(ray->t1, fmax(first, second));
    }
    for (size_t i = 0; i < scene->clip_count; i++) {
        const VolClip *clip = &scene->clips[i];
        cut(vol_dot(clip->normal, ray->origin) - clip->d, vol_dot(clip->normal, ray->direction), &ray->t0, &ray->t1);
    }
    return ray->t0 < ray->t1;
}
