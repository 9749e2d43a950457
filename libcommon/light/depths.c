#include "light/depths.h"

#include <math.h>
#include <stdlib.h>

#include "base/mem.h"

struct VolDepthSamples {
    VolGather gather;
    VolVec3 *points; /* of all ways */
    double *values;
    size_t *first;   /* sample of each way, and behind the last; a way that meets nothing has none */
    double *length;  /* of a way's steps */
    size_t ways, room;
};

VolStatus vol_depths_new(const VolScene *scene, const VolTfCompiled *tf, int samples, int threads, VolDepths *out,
                         VolError *err)
{
    size_t count = threads < 1 ? 1 : (size_t)threads;
    *out = (VolDepths){.scene = scene, .samples = samples};
    VolStatus status = vol_tf_integrals_new(tf, &out->integrals, err);
    if (status != VOL_OK)
        return status;
    if (!(out->of_thread = vol_alloc_zero(count, sizeof *out->of_thread)))
        return vol_fail_memory(err, count * sizeof *out->of_thread);
    for (size_t t = 0; status == VOL_OK && t < count; t++) {
        const VolGrid *grid = scene->volume.grid;
        status = vol_gather_new(grid, scene->cpu, grid->is_double, &out->of_thread[t].gather, err);
        out->threads++;
    }
    return status;
}

void vol_depths_free(VolDepths *depths)
{
    for (int t = 0; t < depths->threads; t++) {
        VolDepthSamples *s = &depths->of_thread[t];
        vol_gather_free(&s->gather);
        free(s->points);
        free(s->values);
        free(s->first);
        free(s->length);
    }
    free(depths->of_thread);
    vol_tf_integrals_free(&depths->integrals);
    *depths = (VolDepths){0};
}

/* ---- Samples ---- */

static VolStatus want_ways(VolDepthSamples *s, size_t ways, VolError *err)
{
    if (ways <= s->ways && s->first)
        return VOL_OK;
    size_t *first = vol_resize(s->first, ways + 1, sizeof *first);
    s->first = first ? first : s->first;
    double *length = vol_resize(s->length, ways, sizeof *length);
    s->length = length ? length : s->length;
    if (!first || !length)
        return vol_fail_memory(err, ways * sizeof *length);
    s->ways = ways;
    return VOL_OK;
}

static VolStatus want_points(VolDepthSamples *s, size_t count, VolError *err)
{
    if (count <= s->room)
        return VOL_OK;
    size_t room = count + count / 2;
    VolVec3 *points = vol_resize(s->points, room, sizeof *points);
    s->points = points ? points : s->points;
    double *values = vol_resize(s->values, room, sizeof *values);
    s->values = values ? values : s->values;
    if (!points || !values)
        return vol_fail_memory(err, room * (sizeof *points + sizeof *values));
    s->room = room;
    return VOL_OK;
}

/* Places the samples of way i: where it enters, where it leaves, and between. */
static VolStatus place_way(const VolDepths *d, VolVec3 from, VolVec3 to, size_t i, VolDepthSamples *s, VolError *err)
{
    VolVec3 way = vol_sub(to, from);
    double length = vol_length(way);
    size_t first = s->first[i];
    s->first[i + 1] = first;
    if (!(length > 0))
        return VOL_OK;
    VolRay ray = {from, vol_scale(way, 1 / length), 0, length};
    if (!vol_ray_clip(d->scene, &ray))
        return VOL_OK;
    double voxels = (ray.t1 - ray.t0) / vol_volume_voxel(&d->scene->volume);
    double steps = ceil(fmax(fmin(d->samples * voxels, 1e6), 1));
    VolStatus status = want_points(s, first + (size_t)steps + 1, err);
    if (status != VOL_OK)
        return status;
    s->length[i] = (ray.t1 - ray.t0) / steps;
    for (size_t n = 0; n <= (size_t)steps; n++)
        s->points[first + n] = vol_along(from, ray.t0 + (double)n * s->length[i], ray.direction);
    s->first[i + 1] = first + (size_t)steps + 1;
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

static void add_step(const VolTfIntegrals *integrals, double v0, double v1, double length, double depth[3])
{
    double lo = fmin(v0, v1), hi = fmax(v0, v1);
    if (!isfinite(v0) || !isfinite(v1) || !vol_tf_range_visible(integrals->tf, lo, hi))
        return;
    add_isosurfaces(integrals->tf, v0, v1, depth);
    if (hi - lo > 0) {
        VolTfIntegral sum;
        vol_tf_integrals_between(integrals, lo, hi, &sum);
        for (int c = 0; c < 3; c++)
            depth[c] += sum.surface + sum.particle[c] / (hi - lo) * length;
    } else {
        VolTfSample at;
        vol_tf_sample(integrals->tf, v0, &at);
        for (int c = 0; c < 3; c++)
            depth[c] += at.particle[c] * length;
    }
}

VolStatus vol_depths_between(const VolDepths *depths, int thread, const VolVec3 *from, const VolVec3 *to, size_t count,
                             double (*depth)[3], VolError *err)
{
    VolDepthSamples *s = &depths->of_thread[thread];
    VolStatus status = want_ways(s, count, err);
    if (status == VOL_OK)
        s->first[0] = 0;
    for (size_t i = 0; status == VOL_OK && i < count; i++)
        status = place_way(depths, from[i], to[i], i, s, err);
    if (status != VOL_OK)
        return status;
    if (s->first[count])
        vol_gather(&s->gather, s->points, s->first[count], s->values);
    for (size_t i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++)
            depth[i][c] = 0;
        for (size_t n = s->first[i]; n + 1 < s->first[i + 1]; n++)
            add_step(&depths->integrals, s->values[n], s->values[n + 1], s->length[i], depth[i]);
    }
    return VOL_OK;
}
