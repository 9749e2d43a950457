/* Blinn-Phong with the normal turned to the viewer, for LANES rays:
 *     sum_k RGB_k (k_d c max(0, N.l) + k_s max(0, N.h)^n [N.l > 0]) + k_a c sum_k RGB_k
 * Where the gradient is 0 there is no normal and the ambient term stands alone.
 *
 * Beside a light that stands somewhere, far from the eye, float would lose its direction in the distance: the light's place
 * is kept as the ray's nearest approach to it, and times in two parts.  A spot's cone may be far narrower than float tells
 * directions apart: how far a place is beside the axis comes from the ray's nearest approach to the axis, and 1 minus the
 * cosine from that, sin^2 / (1 + cos).
 *
 * Of sharp highlights float would lose more than it keeps: n is the shininess, and rounding u of N.h becomes n u.  With
 * q = 1 - N.h = |N - h|^2 / 2, h of length 1, they are exp(n log(1 - q)); what rounds is |N - h|, hence n q rounds to
 * 2 sqrt(n q) sqrt(n) u, of which exp(-n q) leaves at most 0.9 sqrt(n) u.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Shading, shade_scaled(), shade_lanes(), shade_evenly(), surfaceness_of(), classic_factors(); Times,
 *             times_of(), time_of(), LightPath, light_path(), towards_light(), halfway_to(), HIGHLIGHTS_SHARP;
 *             may_be_unsure(), doubt_of(); in float has_no_side() */
#ifndef VOL_TRACE_SHADING_TMPL_H
#define VOL_TRACE_SHADING_TMPL_H

#include "base/fmath.h"
#include "trace/packet_tmpl.h"

/* Diffuse-plus-ambient factor (multiplies the base colour) and highlight (added), per channel. */
typedef struct Shading {
    reals k[3], b[3];
    reals normal[3]; /* unit, turned to the viewer; 0 where there is none */
    reals gradient;  /* its length, per world unit */
} Shading;

ALWAYS_INLINE reals dot3(const reals a[3], const reals b[3])
{
    return reals_fma(a[2], b[2], reals_fma(a[1], b[1], a[0] * b[0]));
}

/* Gradients shaded together, at several places on each ray: side by side their long chains of operations overlap. */
enum { SHADINGS_MOST = 16 };

/* ---- Where lights are ---- */

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

/* Halfway between that direction and the viewer's: unit, or 0 where they are opposite. */
ALWAYS_INLINE void halfway_to(const RayPacket *packet, const reals l[3], reals h[3])
{
    for (int a = 0; a < 3; a++)
        h[a] = l[a] + packet->view[a];
    reals hh = dot3(h, h), zero = reals_all(0);
    reals scale = reals_select((ints)(hh > 0), 1 / reals_sqrt(hh), zero);
    for (int a = 0; a < 3; a++)
        h[a] *= scale;
}

/* ---- Highlights ---- */

/* From this shininess on, in float, highlights are computed from 1 - N.h. */
#define HIGHLIGHTS_SHARP 64

static inline bool is_sharp(const TfTables *tables)
{
    return sizeof(real) == sizeof(float) && tables->shininess >= HIGHLIGHTS_SHARP;
}

/* (1 - q)^n for q >= 0: log(1 - q) = -2 artanh(q / (2 - q)), whose series is good to rounding for q up to 0.3; beyond, all
 * is below 1e-9 and the truncated sum keeps it there. */
ALWAYS_INLINE void sharp_highlights(int count, reals *q, double n)
{
    static const real c[] = {(real)(1.0 / 13), (real)(1.0 / 11), (real)(1.0 / 9), (real)(1.0 / 7), (real)(1.0 / 5),
                             (real)(1.0 / 3)};
    for (int i = 0; i < count; i++) {
        reals x = reals_min(q[i], reals_all(1)), z = x / (2 - x), zz = z * z, p = reals_all(c[0]);
        for (unsigned k = 1; k < sizeof c / sizeof *c; k++)
            p = reals_fma(p, zz, reals_all(c[k]));
        q[i] = reals_exp((real)(-2 * n) * reals_fma(z * zz, p, z));
    }
}

/* x^n for x in [0, 1], `count` times; whole exponents by squaring, from the highest bit down. */
ALWAYS_INLINE void highlights(int count, reals *x, double n)
{
    ints lit[SHADINGS_MOST];
    reals power[SHADINGS_MOST];
    bool whole = n == floor(n) && n >= 1 && n < 65536;
    for (int i = 0; i < count; i++) {
        lit[i] = (ints)(x[i] > 0);
        power[i] = x[i];
    }
    if (whole) {
        unsigned e = (unsigned)n;
        for (unsigned bit = 1u << (31 - __builtin_clz(e)) >> 1; bit; bit >>= 1)
            for (int i = 0; i < count; i++) {
                power[i] *= power[i];
                if (e & bit)
                    power[i] *= x[i];
            }
    }
    for (int i = 0; i < count; i++) {
        FOR_LANES(k, whole ? 0 : mask_bits(lit[i]))
            power[i][k] = (real)vol_pow((double)x[i][k], n);
        x[i] = reals_select(lit[i], power[i], reals_all(n == 0 ? 1 : 0));
    }
}

/* Of unit normals n and unit h: what the highlight is computed from. */
ALWAYS_INLINE reals highlight_argument(const reals n[3], const reals h[3], bool sharp)
{
    if (!sharp)
        return reals_min(dot3(n, h), reals_all(1));
    reals off[3] = {n[0] - h[0], n[1] - h[1], n[2] - h[2]};
    return (real)0.5 * dot3(off, off);
}

/* `shine` is the highlight of the unit light. */
ALWAYS_INLINE void add_light(const TfTables *tables, reals nl, reals shine, const reals rgb[3], Shading *out)
{
    reals zero = reals_all(0), diffuse = tables->diffuse * reals_max(nl, zero);
    shine = reals_where((ints)(nl > 0), tables->specular * shine);
    for (int c = 0; c < 3; c++) {
        out->k[c] = reals_fma(rgb[c], diffuse + tables->ambient, out->k[c]);
        out->b[c] = reals_fma(rgb[c], shine, out->b[c]);
    }
}

#ifdef VOL_DOUBLE
enum { REAL_MANTISSA = 52, REAL_BIAS = 1023 };
#else
enum { REAL_MANTISSA = 23, REAL_BIAS = 127 };
#endif

/* The power of two that brings a length near 1. */
ALWAYS_INLINE reals scale_for(reals length)
{
    const lane_int one = (lane_int)1 << REAL_MANTISSA, largest = 2 * REAL_BIAS - 1;
    ints exponent = (ints)length & ((2 * REAL_BIAS + 1) * one);
    exponent = ints_select((ints)(exponent > largest * one), ints_all(largest * one), exponent);
    return (reals)(2 * REAL_BIAS * one - exponent);
}

/* The normal, and its product with `view`; nothing of lights yet. */
ALWAYS_INLINE reals face_viewer(const RayPacket *packet, const reals gradient[3], Shading *out)
{
    reals square = dot3(gradient, gradient), facing = dot3(gradient, packet->view);
    ints known = (ints)(square > 0);
    reals length = reals_sqrt(reals_select(known, square, reals_all(1)));
    reals side = reals_where(known, 1 / length);
    side = reals_select((ints)(facing < 0), -side, side);
    out->gradient = reals_where(known, length);
    for (int c = 0; c < 3; c++) {
        out->normal[c] = gradient[c] * side;
        out->k[c] = out->b[c] = reals_all(0);
    }
    return facing * side;
}

/* N.l of one light, what its highlight is computed from, and how much of its strength arrives. */
ALWAYS_INLINE reals lit_by(const RayPacket *packet, const VolLight *light, const LightPath *path, const Times *times,
                           const reals normal[3], bool sharp, reals *nl, reals *highlight)
{
    reals l[3], h[3], scale = arriving_from(packet, light, path, times, l);
    halfway_to(packet, l, h);
    *nl = dot3(normal, l);
    *highlight = highlight_argument(normal, h, sharp);
    return scale;
}

/* Gradients in world space, scaled so that their squares neither overflow nor vanish, so long after `begin`; the times
 * matter to lights that stand somewhere. */
ALWAYS_INLINE void shade_scaled(const RayPacket *packet, int count, const reals gradient[][3], const Times *begin,
                                const reals *after, Shading *out)
{
    const TfTables *tables = packet->tables;
    const bool sharp = is_sharp(tables);
    reals nv[SHADINGS_MOST];
    for (int i = 0; i < count; i++)
        nv[i] = face_viewer(packet, gradient[i], &out[i]);
    for (size_t n = 0; n < packet->scene->light_count; n++) {
        const VolLight *light = &packet->scene->lights[n];
        const bool head = light->kind == VOL_LIGHT_HEAD;
        LightPath path;
        reals nl[SHADINGS_MOST], shine[SHADINGS_MOST], scale[SHADINGS_MOST];
        if (!head)
            light_path(packet, light, &path);
        for (int i = 0; i < count; i++) {
            nl[i] = nv[i];
            scale[i] = reals_all(1);
            if (head) {
                shine[i] = sharp ? highlight_argument(out[i].normal, packet->view, true) : reals_min(nv[i], scale[i]);
            } else {
                const Times times = {begin->t, begin->rest + after[i]};
                scale[i] = lit_by(packet, light, &path, &times, out[i].normal, sharp, &nl[i], &shine[i]);
            }
        }
        if (sharp)
            sharp_highlights(count, shine, tables->shininess);
        else
            highlights(count, shine, tables->shininess);
        for (int i = 0; i < count; i++) {
            reals rgb[3];
            for (int c = 0; c < 3; c++)
                rgb[c] = (real)light->rgb[c] * scale[i];
            add_light(tables, nl[i], shine[i], rgb, &out[i]);
        }
    }
}

/* `gradient` in world space, at those times. */
static inline void shade_lanes(const RayPacket *packet, const reals gradient[3], const Times *times, Shading *out)
{
    reals scale = scale_for(reals_max(reals_abs(gradient[0]), reals_max(reals_abs(gradient[1]), reals_abs(gradient[2]))));
    reals scaled[1][3] = {{gradient[0] * scale, gradient[1] * scale, gradient[2] * scale}}, zero = reals_all(0);
    shade_scaled(packet, 1, scaled, times, &zero, out);
    out->gradient /= scale;
}

/* ---- What float cannot tell ---- */

#ifdef VOL_DOUBLE

MAYBE_UNUSED static inline ints may_be_unsure(const RayPacket *packet, const Shading *sh, reals steepest, reals shown,
                                              ints mask)
{
    (void)packet, (void)sh, (void)steepest, (void)shown, (void)mask;
    return ints_all(0);
}
MAYBE_UNUSED static inline reals doubt_of(const RayPacket *packet, const Shading *sh, reals steepest, const Times *times)
{
    (void)packet, (void)sh, (void)steepest, (void)times;
    return reals_all(0);
}

#else

/* Whether unit normals n, known to an angle of `turn`, may lie on either side of the viewer or of a light: a highlight
 * begins at once there, and light falls on the other side. */
static inline ints has_no_side(const RayPacket *packet, const reals n[3], reals turn, const Times *times)
{
    const VolScene *scene = packet->scene;
    ints unsure = (ints)(reals_abs(dot3(n, packet->view)) <= turn);
    for (size_t i = 0; i < scene->light_count; i++) {
        LightPath path;
        reals to[3];
        if (scene->lights[i].kind == VOL_LIGHT_HEAD)
            continue;
        light_path(packet, &scene->lights[i], &path);
        towards_light(packet, &scene->lights[i], &path, times, to);
        reals towards = dot3(n, to);
        unsure |= (ints)(towards * towards <= turn * turn * dot3(to, to));
    }
    return unsure;
}

/* Gradients interpolated from some as large as `steepest` are known to about so much of that: */
#define GRADIENT_ROUNDOFF (4 * UNIT_ROUNDOFF)

/* Highlights that are roots of N.h change by as much as its own share of it. */
static inline bool has_steep_highlights(const TfTables *tables) { return tables->shininess > 0 && tables->shininess < 1; }

/* Those of `mask` whose shading rounding may have put off by so much that it shows, in what is `shown` of it. */
MAYBE_UNUSED ALWAYS_INLINE ints may_be_unsure(const RayPacket *packet, const Shading *sh, reals steepest, reals shown,
                                              ints mask)
{
    ints unsure = (ints)(GRADIENT_ROUNDOFF * steepest * shown > (real)BLUR_LIMIT * sh->gradient);
    if (packet->prepared->lit_aside || has_steep_highlights(packet->tables))
        unsure = (ints)(shown > (real)BLUR_LIMIT);
    return mask & unsure & (ints)(steepest > 0);
}

/* How far it may have been put off: short gradients are not known in their direction. */
MAYBE_UNUSED static reals doubt_of(const RayPacket *packet, const Shading *sh, reals steepest, const Times *times)
{
    const reals one = reals_all(1);
    reals doubt = GRADIENT_ROUNDOFF * steepest / sh->gradient, turn = doubt + 8 * UNIT_ROUNDOFF;
    if (has_steep_highlights(packet->tables))
        doubt = turn / reals_max(reals_abs(dot3(sh->normal, packet->view)), turn);
    if (packet->prepared->lit_aside)
        doubt = reals_select(has_no_side(packet, sh->normal, turn, times), one, doubt);
    doubt = reals_select((ints)(sh->gradient > 0), reals_min(doubt, one), one);
    return reals_where((ints)(steepest > 0), doubt);
}

#endif

/* Lane i where there is no normal: ambient light alone. */
MAYBE_UNUSED static void shade_evenly(const TfTables *tables, unsigned i, const double arriving[3], Shading *out)
{
    for (int c = 0; c < 3; c++) {
        out->k[c][i] = tables->ambient * (real)arriving[c];
        out->b[c][i] = out->normal[c][i] = 0;
    }
    out->gradient[i] = 0;
}

/* K 11's S: by table (a + b x), or by the gradient's magnitude from 0 at g0 to 1 at g1. */
ALWAYS_INLINE reals surfaceness_of(const TfTables *tables, reals table, const Shading *sh)
{
    reals S = table;
    if (tables->gradient_surfaceness) {
        real width = tables->g1 - tables->g0;
        S = width > 0 ? (sh->gradient - tables->g0) / width
                      : reals_select((ints)(sh->gradient >= tables->g1), reals_all(1), reals_all(0));
    }
    return reals_clamp(S, 0, 1);
}

/* K 11: E ((1 - S) + f_s S), as a factor of the scattering colour. */
ALWAYS_INLINE void classic_factors(reals S, const Shading *sh, reals factor[3])
{
    for (int c = 0; c < 3; c++)
        factor[c] = reals_fma(S, sh->k[c] + sh->b[c], 1 - S);
}

#endif
