#include <math.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/pool.h"
#include "light/shadow.h"

typedef struct Rays {
    const VolShadow *shadow;
    int channels;
    bool occluded;           /* there are occluders */
    VolScratch *scratch;     /* of each thread: for the scene, then for the occluders */
    VolShadowCounts *counts; /* likewise */
} Rays;

typedef struct Packet {
    VolRay rays[VOL_PACKET];
    int point[VOL_PACKET];
    size_t count;
} Packet;

int vol_shadow_channels(const VolScene *scene) { return scene->tf->coloured ? 3 : 1; }

/* T^S falls below float's rounding at an optical depth of 17 / S. */
double vol_shadow_termination(double absorption)
{
    enum { DEPTH = 20, MOST = 690 };
    return vol_exp(-fmin(absorption > 0 ? DEPTH / fmin(absorption, 1) : MOST, MOST));
}

/* From a point to the light; false: it is there already. */
static bool ray_to_light(const VolLight *light, VolVec3 point, VolRay *out)
{
    *out = (VolRay){point, vol_scale(light->direction, -1), 0, INFINITY};
    if (!vol_light_stands(light))
        return true;
    VolVec3 way = vol_sub(light->position, point);
    double length = vol_length(way);
    if (!(length > 0))
        return false;
    out->direction = vol_scale(way, 1 / length);
    out->t1 = length;
    return true;
}

static float transmittance(double optical_depth, double absorption)
{
    return isinf(optical_depth) ? 0 : (float)vol_exp(-absorption * optical_depth);
}

static void trace_packet(const Rays *r, Packet *packet, float *T, int thread)
{
    VolRadiance out[VOL_PACKET];
    const VolTraceCall call = {.prepared = r->shadow->prepared, .scratch = &r->scratch[2 * thread], .rays = packet->rays,
                               .count = packet->count, .out = out};
    if (packet->count)
        vol_trace_rays(&call);
    for (size_t i = 0; i < packet->count; i++) {
        for (int c = 0; c < r->channels; c++)
            T[packet->point[i] * r->channels + c] = transmittance(out[i].optical_depth[c], r->shadow->absorption);
        r->counts[thread].cells += out[i].cells;
    }
    r->counts[thread].rays += packet->count;
    packet->count = 0;
}

/* Whether an occluder stands between a point and the light. */
static bool is_occluded(const Rays *r, VolVec3 point, int thread)
{
    const VolLightMask *mask = r->shadow->mask;
    VolRay ray;
    VolRadiance out;
    if (vol_light_mask_hides(mask, point))
        return true;
    if (!ray_to_light(r->shadow->light, point, &ray) || !vol_ray_clip(&mask->scene, &ray) ||
        !vol_ray_meets_visible(&mask->prepared, &ray))
        return false;
    vol_trace_rays(&(VolTraceCall){.prepared = &mask->prepared, .scratch = &r->scratch[2 * thread + 1], .rays = &ray,
                                   .count = 1, .out = &out});
    return isinf(out.optical_depth[0]);
}

static void hide_occluded(const Rays *r, const VolLightLeaf *leaf, float *T, int thread)
{
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++)
        if (vol_light_leaf_has(leaf, n) && is_occluded(r, vol_light_point(r->shadow->lattice, leaf, n), thread))
            for (int c = 0; c < r->channels; c++)
                T[n * r->channels + c] = 0;
}

static VolStatus trace_leaf(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Rays *r = user;
    const VolShadow *shadow = r->shadow;
    const VolLightLeaf *leaf = &shadow->lattice->leaves[index];
    float *T = shadow->T + index * VOL_LIGHT_LEAF_POINTS * (size_t)r->channels;
    Packet packet = {.count = 0};
    for (int n = 0; n < VOL_LIGHT_LEAF_POINTS; n++) {
        VolRay *ray = &packet.rays[packet.count];
        for (int c = 0; c < r->channels; c++)
            T[n * r->channels + c] = 1;
        if (!vol_light_leaf_has(leaf, n))
            continue;
        if (!ray_to_light(shadow->light, vol_light_point(shadow->lattice, leaf, n), ray) ||
            !vol_ray_clip(shadow->prepared->scene, ray) || !vol_ray_meets_visible(shadow->prepared, ray)) {
            r->counts[thread].missed++;
            continue;
        }
        packet.point[packet.count++] = n;
        if (packet.count == VOL_PACKET)
            trace_packet(r, &packet, T, thread);
    }
    trace_packet(r, &packet, T, thread);
    if (r->occluded)
        hide_occluded(r, leaf, T, thread);
    return VOL_OK;
}

static void add_counts(const Rays *r, VolShadowCounts *counts)
{
    for (int t = 0; t < r->shadow->threads; t++) {
        counts->rays += r->counts[t].rays;
        counts->missed += r->counts[t].missed;
        counts->cells += r->counts[t].cells; /* whole numbers: in any order the same */
    }
}

VolStatus vol_shadow_rays(const VolShadow *shadow, VolShadowCounts *counts, VolError *err)
{
    const size_t threads = (size_t)shadow->threads;
    Rays r = {.shadow = shadow, .channels = vol_shadow_channels(shadow->prepared->scene),
              .occluded = shadow->mask && shadow->mask->occluders};
    r.scratch = vol_alloc_zero(2 * threads, sizeof *r.scratch);
    r.counts = vol_alloc_zero(threads, sizeof *r.counts);
    VolStatus status = r.scratch && r.counts ? VOL_OK : vol_fail_memory(err, 2 * threads * sizeof *r.scratch);
    for (size_t t = 0; t < threads && !status; t++) {
        status = vol_scratch_new(shadow->prepared, &r.scratch[2 * t], err);
        if (!status && r.occluded)
            status = vol_scratch_new(&shadow->mask->prepared, &r.scratch[2 * t + 1], err);
    }
    if (!status)
        status = vol_parallel(shadow->threads, shadow->lattice->leaf_count, trace_leaf, &r, err);
    if (!status)
        add_counts(&r, counts);
    for (size_t i = 0; i < 2 * threads && r.scratch; i++)
        vol_scratch_free(&r.scratch[i]);
    free(r.scratch);
    free(r.counts);
    return status;
}
