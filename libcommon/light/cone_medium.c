#include "light/cone_medium.h"

#include <math.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "light/transport.h"

struct VolConeSamples {
    VolGather gather;
    VolVec3 *points; /* of a row's rays */
    double *values;
    size_t *first;   /* sample of each ray, and behind the last; a ray that meets nothing has none */
    double *length;  /* of a ray's steps */
    size_t rays, points_room;
};

VolStatus vol_cone_medium_new(const VolScene *scene, int samples, int threads, VolConeMedium *out, VolError *err)
{
    size_t count = threads < 1 ? 1 : (size_t)threads;
    *out = (VolConeMedium){.scene = scene, .samples = samples};
    VolStatus status = vol_transport_of(scene->tf, &out->transport, err);
    if (status == VOL_OK)
        status = vol_tf_integrals_new(&out->transport, &out->integrals, err);
    if (status != VOL_OK)
        return status;
    out->channels = out->transport.coloured ? 3 : 1;
    if (!(out->of_thread = vol_alloc_zero(count, sizeof *out->of_thread)))
        return vol_fail_memory(err, count * sizeof *out->of_thread);
    for (size_t t = 0; status == VOL_OK && t < count; t++) {
        const VolGrid *grid = scene->volume.grid;
        status = vol_gather_new(grid, scene->cpu, grid->is_double, &out->of_thread[t].gather, err);
        out->threads++;
    }
    return status;
}

void vol_cone_medium_free(VolConeMedium *medium)
{
    for (int t = 0; t < medium->threads; t++) {
        VolConeSamples *s = &medium->of_thread[t];
        vol_gather_free(&s->gather);
        free(s->points);
        free(s->values);
        free(s->first);
        free(s->length);
    }
    free(medium->of_thread);
    vol_tf_integrals_free(&medium->integrals);
    vol_tf_compiled_free(&medium->transport);
    *medium = (VolConeMedium){0};
}

/* ---- Samples ---- */

static VolStatus want_rays(VolConeSamples *s, size_t rays, VolError *err)
{
    if (rays <= s->rays)
        return VOL_OK;
    size_t *first = vol_resize(s->first, rays + 1, sizeof *first);
    s->first = first ? first : s->first;
    double *length = vol_resize(s->length, rays, sizeof *length);
    s->length = length ? length : s->length;
    if (!first || !length)
        return vol_fail_memory(err, rays * sizeof *length);
    s->rays = rays;
    return VOL_OK;
}

static VolStatus want_points(VolConeSamples *s, size_t count, VolError *err)
{
    if (count <= s->points_room)
        return VOL_OK;
    size_t room = count + count / 2;
    VolVec3 *points = vol_resize(s->points, room, sizeof *points);
    s->points = points ? points : s->points;
    double *values = vol_resize(s->values, room, sizeof *values);
    s->values = values ? values : s->values;
    if (!points || !values)
        return vol_fail_memory(err, room * (sizeof *points + sizeof *values));
    s->points_room = room;
    return VOL_OK;
}

/* Places the samples of ray j: where it enters, where it leaves, and between. */
static VolStatus place_ray(const VolConeMedium *m, const VolConePlanes *p, double k, double i, size_t j, VolConeSamples *s,
                           VolError *err)
{
    VolVec3 from = vol_cone_place(p, k, i, (double)j), way = vol_sub(vol_cone_place(p, k + 1, i, (double)j), from);
    double length = vol_length(way);
    size_t first = s->first[j];
    s->first[j + 1] = first;
    if (!(length > 0))
        return VOL_OK;
    VolRay ray = {from, vol_scale(way, 1 / length), 0, length};
    if (!vol_ray_clip(m->scene, &ray))
        return VOL_OK;
    double voxel = vol_volume_voxel(&m->scene->volume);
    double steps = ceil(fmax(fmin(m->samples * (ray.t1 - ray.t0) / voxel, 1e6), 1));
    VolStatus status = want_points(s, first + (size_t)steps + 1, err);
    if (status != VOL_OK)
        return status;
    s->length[j] = (ray.t1 - ray.t0) / steps;
    for (size_t n = 0; n <= (size_t)steps; n++)
        s->points[first + n] = vol_along(from, ray.t0 + (double)n * s->length[j], ray.direction);
    s->first[j + 1] = first + (size_t)steps + 1;
    return VOL_OK;
}

/* ---- Optical depth ---- */

static void add_isosurfaces(const VolTfCompiled *tf, double v0, double v1, double depth[3])
{
    for (size_t n = 0; n < tf->isosurface_count; n++) {
        const VolIsosurface *iso = &tf->isosurfaces[n];
        for (int c = 0; c < 3 && (v0 < iso->value) != (v1 < iso->value); c++)
            depth[c] += iso->optical_depth;
    }
}

static void add_step(const VolConeMedium *m, double v0, double v1, double length, double depth[3])
{
    double lo = fmin(v0, v1), hi = fmax(v0, v1);
    if (!isfinite(v0) || !isfinite(v1) || !vol_tf_range_visible(&m->transport, lo, hi))
        return;
    add_isosurfaces(&m->transport, v0, v1, depth);
    if (hi - lo > 0) {
        VolTfIntegral sum;
        vol_tf_integrals_between(&m->integrals, lo, hi, &sum);
        for (int c = 0; c < 3; c++)
            depth[c] += sum.surface + sum.particle[c] / (hi - lo) * length;
    } else {
        VolTfSample at;
        vol_tf_sample(&m->transport, v0, &at);
        for (int c = 0; c < 3; c++)
            depth[c] += at.particle[c] * length;
    }
}

VolStatus vol_cone_medium_pass(void *user, const VolConePlanes *planes, int32_t k, int32_t i, int thread,
                               float *const passed[3], VolError *err)
{
    const VolConeMedium *m = user;
    VolConeSamples *s = &m->of_thread[thread];
    const size_t rays = (size_t)planes->size[1];
    VolStatus status = want_rays(s, rays, err);
    if (status == VOL_OK)
        s->first[0] = 0;
    for (size_t j = 0; status == VOL_OK && j < rays; j++)
        status = place_ray(m, planes, k, i, j, s, err);
    if (status != VOL_OK)
        return status;
    if (s->first[rays])
        vol_gather(&s->gather, s->points, s->first[rays], s->values);
    for (size_t j = 0; j < rays; j++) {
        double depth[3] = {0};
        for (size_t n = s->first[j]; n + 1 < s->first[j + 1]; n++)
            add_step(m, s->values[n], s->values[n + 1], s->length[j], depth);
        for (int c = 0; c < m->channels; c++)
            passed[c][j] = depth[c] > 0 ? (float)vol_exp(-depth[c]) : 1;
    }
    return VOL_OK;
}
