/* Blinn-Phong with the normal turned to the viewer, for LANES rays:
 *     sum_k RGB_k (k_d c max(0, N.l) + k_s max(0, N.h)^n [N.l > 0]) + k_a c sum_k RGB_k
 * Where the gradient is 0 there is no normal and the ambient term stands alone.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Shading, shade_scaled(), shade_lanes(), shade_evenly(), towards_light(), surfaceness_of(), classic_factors() */
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

/* Towards a light that is not the viewer's own, at t on each ray; of any length. */
static inline void towards_light(const RayPacket *packet, const VolLight *light, reals t, reals to[3])
{
    if (light->kind == VOL_LIGHT_SUN) {
        to[0] = reals_all((real)-light->direction.x);
        to[1] = reals_all((real)-light->direction.y);
        to[2] = reals_all((real)-light->direction.z);
        return;
    }
    real from[3][LANES];
    for (size_t i = 0; i < LANES; i++) {
        VolVec3 light_from = vol_sub(light->position, packet->rays[i < packet->count ? i : 0].origin);
        from[0][i] = (real)light_from.x;
        from[1][i] = (real)light_from.y;
        from[2][i] = (real)light_from.z;
    }
    for (int a = 0; a < 3; a++) {
        memcpy(&to[a], from[a], sizeof to[a]);
        to[a] = reals_fma(t, packet->view[a], to[a]);
    }
}

/* Direction towards a light that stands somewhere, at t on each ray; returns how much of its strength arrives there. */
static inline reals arriving_from(const RayPacket *packet, const VolLight *light, reals t, reals l[3])
{
    reals to[3];
    towards_light(packet, light, t, to);
    reals r = reals_sqrt(dot3(to, to)), least = reals_all((real)packet->prepared->nearest_light);
    ints away = (ints)(r > 0);
    for (int a = 0; a < 3; a++)
        l[a] = reals_select(away, to[a] / r, reals_all(0));
    reals reach = reals_max(r, least);
    reals scale = 1 / (reach * reach);
    if (light->kind != VOL_LIGHT_SPOT)
        return scale;
    reals c = reals_all(0);
    const double axis[3] = {light->direction.x, light->direction.y, light->direction.z};
    for (int a = 0; a < 3; a++)
        c = reals_fma(l[a], reals_all((real)-axis[a]), c);
    reals s = (c - (real)light->cos_edge) / (real)(light->cos_full - light->cos_edge);
    s = reals_clamp(s, 0, 1);
    return scale * (s * s * (3 - 2 * s));
}

/* Cosines of the normal with the direction towards a light that is not the viewer's own, and with what lies halfway between
 * light and viewer; returns how much of its strength arrives. */
ALWAYS_INLINE reals cosines(const RayPacket *packet, const VolLight *light, const reals n[3], reals t, reals *nl, reals *nh)
{
    const reals *view = packet->view;
    reals scale = reals_all(1), l[3];
    if (light->kind == VOL_LIGHT_SUN)
        towards_light(packet, light, t, l);
    else
        scale = arriving_from(packet, light, t, l);
    reals h[3] = {l[0] + view[0], l[1] + view[1], l[2] + view[2]};
    reals hh = dot3(h, h);
    *nl = dot3(n, l);
    *nh = reals_select((ints)(hh > 0), dot3(n, h) / reals_sqrt(hh), reals_all(0));
    return scale;
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

/* Gradients in world space, scaled so that their squares neither overflow nor vanish; at t on each ray. */
ALWAYS_INLINE void shade_scaled(const RayPacket *packet, int count, const reals gradient[][3], const reals *t, Shading *out)
{
    const TfTables *tables = packet->tables;
    reals nv[SHADINGS_MOST];
    for (int i = 0; i < count; i++)
        nv[i] = face_viewer(packet, gradient[i], &out[i]);
    for (size_t n = 0; n < packet->scene->light_count; n++) {
        const VolLight *light = &packet->scene->lights[n];
        reals nl[SHADINGS_MOST], nh[SHADINGS_MOST], scale[SHADINGS_MOST];
        for (int i = 0; i < count; i++) {
            nl[i] = nh[i] = nv[i];
            scale[i] = reals_all(1);
            if (light->kind != VOL_LIGHT_HEAD)
                scale[i] = cosines(packet, light, out[i].normal, t[i], &nl[i], &nh[i]);
            nh[i] = reals_min(nh[i], reals_all(1));
        }
        highlights(count, nh, tables->shininess);
        for (int i = 0; i < count; i++) {
            reals rgb[3];
            for (int c = 0; c < 3; c++)
                rgb[c] = (real)light->rgb[c] * scale[i];
            add_light(tables, nl[i], nh[i], rgb, &out[i]);
        }
    }
}

/* `gradient` in world space, at t on each ray. */
static inline void shade_lanes(const RayPacket *packet, const reals gradient[3], reals t, Shading *out)
{
    reals scale = scale_for(reals_max(reals_abs(gradient[0]), reals_max(reals_abs(gradient[1]), reals_abs(gradient[2]))));
    reals scaled[1][3] = {{gradient[0] * scale, gradient[1] * scale, gradient[2] * scale}};
    shade_scaled(packet, 1, scaled, &t, out);
    out->gradient /= scale;
}

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
