/* Lights as rays see them on their way.
 *
 * Beside a light that stands somewhere, far from the eye, float would lose its direction in the distance: the light's place
 * is kept as the ray's nearest approach to it, and times in two parts.  A spot's cone may be far narrower than float tells
 * directions apart: how far a place is beside the axis comes from the ray's nearest approach to the axis, and 1 minus the
 * cosine from that, sin^2 / (1 + cos).
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    dot3(); Times, times_of(), time_of(), LightPath, light_path(), towards_light(), off_axis(), arriving_from() */
#ifndef VOL_TRACE_LIGHT_PATHS_TMPL_H
#define VOL_TRACE_LIGHT_PATHS_TMPL_H

#include "trace/packet_tmpl.h"

ALWAYS_INLINE reals dot3(const reals a[3], const reals b[3])
{
    return reals_fma(a[2], b[2], reals_fma(a[1], b[1], a[0] * b[0]));
}

/* t + rest, on each ray. */
typedef struct Times {
    reals t, rest;
} Times;

static inline Times times_of(const double t[LANES])
{
    real part[2][LANES];
    Times times;
    for (int i = 0; i < LANES; i++) {
        part[0][i] = (real)t[i];
        part[1][i] = (real)(t[i] - (double)part[0][i]);
    }
    memcpy(&times.t, part[0], sizeof times.t);
    memcpy(&times.rest, part[1], sizeof times.rest);
    return times;
}

/* The same time on all. */
ALWAYS_INLINE Times time_of(double t)
{
    real near = (real)t;
    return (Times){reals_all(near), reals_all((real)(t - (double)near))};
}

ALWAYS_INLINE reals time_since(const Times *now, const Times *then) { return (now->t - then->t) + (now->rest - then->rest); }

/* A light other than the viewer's own as rays see it on their way: of a sun, where it comes from; of what stands somewhere,
 * how far to the side rays pass it, and when.  Of a spot also how far its axis, when, and how they move away from it. */
typedef struct LightPath {
    reals side[3];
    Times nearest;
    reals off_axis[3], drift[3];
    Times nearest_axis;
} LightPath;

/* One coordinate of vectors, one per ray. */
static inline reals coordinate(const VolVec3 v[LANES], int a)
{
    real out[LANES];
    reals all;
    for (int i = 0; i < LANES; i++)
        out[i] = (real)(a == 0 ? v[i].x : a == 1 ? v[i].y : v[i].z);
    memcpy(&all, out, sizeof all);
    return all;
}

/* The axis of a spot, as rays pass it. */
static inline void axis_path(const RayPacket *packet, const VolLight *light, LightPath *out)
{
    VolVec3 off[LANES], drift[LANES];
    double t[LANES];
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &packet->rays[i < packet->count ? i : 0];
        VolVec3 from = vol_sub(ray->origin, light->position), axis = light->direction;
        from = vol_sub(from, vol_scale(axis, vol_dot(from, axis)));
        drift[i] = vol_sub(ray->direction, vol_scale(axis, vol_dot(ray->direction, axis)));
        double square = vol_dot(drift[i], drift[i]);
        t[i] = square > 0 ? -vol_dot(from, drift[i]) / square : 0;
        off[i] = vol_add(from, vol_scale(drift[i], t[i]));
    }
    out->nearest_axis = times_of(t);
    for (int a = 0; a < 3; a++) {
        out->off_axis[a] = coordinate(off, a);
        out->drift[a] = coordinate(drift, a);
    }
}

static inline void light_path(const RayPacket *packet, const VolLight *light, LightPath *out)
{
    *out = (LightPath){.nearest = {{0}}};
    if (!vol_light_stands(light)) {
        const double from[3] = {-light->direction.x, -light->direction.y, -light->direction.z};
        for (int a = 0; a < 3; a++)
            out->side[a] = reals_all((real)from[a]);
        return;
    }
    VolVec3 side[LANES];
    double t[LANES];
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &packet->rays[i < packet->count ? i : 0];
        VolVec3 from = vol_sub(light->position, ray->origin);
        t[i] = vol_dot(from, ray->direction);
        side[i] = vol_sub(from, vol_scale(ray->direction, t[i]));
    }
    out->nearest = times_of(t);
    for (int a = 0; a < 3; a++)
        out->side[a] = coordinate(side, a);
    if (light->kind == VOL_LIGHT_SPOT)
        axis_path(packet, light, out);
}

/* Towards the light, of any length. */
ALWAYS_INLINE void towards_light(const RayPacket *packet, const VolLight *light, const LightPath *path, const Times *times,
                                 reals to[3])
{
    memcpy(to, path->side, sizeof path->side);
    if (!vol_light_stands(light))
        return;
    reals past = time_since(times, &path->nearest);
    for (int a = 0; a < 3; a++)
        to[a] = reals_fma(past, packet->view[a], to[a]);
}

/* How far from the axis of a spot. */
ALWAYS_INLINE void off_axis(const LightPath *path, const Times *times, reals off[3])
{
    reals past = time_since(times, &path->nearest_axis);
    for (int a = 0; a < 3; a++)
        off[a] = reals_fma(past, path->drift[a], path->off_axis[a]);
}

/* What a spot sends in the direction -l, its distance r: smoothly from nothing at the edge to all. */
ALWAYS_INLINE reals spot_strength(const VolLight *light, const LightPath *path, const Times *times, const reals l[3],
                                  reals r)
{
    const double axis[3] = {light->direction.x, light->direction.y, light->direction.z};
    reals off[3], c = reals_all(0);
    for (int a = 0; a < 3; a++)
        c = reals_fma(l[a], reals_all((real)-axis[a]), c);
    off_axis(path, times, off);
    reals q = reals_select((ints)(c > 0), dot3(off, off) / (r * r * (1 + c)), 1 - c);
    reals s = ((real)(1 - light->cos_edge) - q) / (real)(light->cos_full - light->cos_edge);
    s = reals_clamp(s, 0, 1);
    return s * s * (3 - 2 * s);
}

/* Its direction; returns how much of its strength arrives. */
ALWAYS_INLINE reals arriving_from(const RayPacket *packet, const VolLight *light, const LightPath *path, const Times *times,
                                  reals l[3])
{
    reals to[3];
    towards_light(packet, light, path, times, to);
    if (!vol_light_stands(light)) {
        memcpy(l, to, sizeof to);
        return reals_all(1);
    }
    reals r = reals_sqrt(dot3(to, to)), least = reals_all((real)packet->prepared->nearest_light);
    ints away = (ints)(r > 0);
    for (int a = 0; a < 3; a++)
        l[a] = reals_select(away, to[a] / r, reals_all(0));
    reals reach = reals_max(r, least);
    reals scale = 1 / (reach * reach);
    return light->kind == VOL_LIGHT_SPOT ? scale * spot_strength(light, path, times, l, r) : scale;
}

#endif
