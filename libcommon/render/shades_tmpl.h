/* Blinn-Phong with the normal turned to the viewer, for LANES rays:
 *     sum_k RGB_k (k_d c max(0, N.l) + k_s max(0, N.h)^n [N.l > 0]) + k_a c sum_k RGB_k
 * Where the gradient is 0 there is no normal and the ambient term stands alone.  Include lanes_tmpl.h first. */
#ifndef VOL_RENDER_SHADES_TMPL_H
#define VOL_RENDER_SHADES_TMPL_H

#include "base/fmath.h"
#include "render/lanes_tmpl.h"

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

/* x^n for x in [0, 1]; whole exponents by squaring. */
static inline reals highlights(reals x, double n)
{
    ints lit = (ints)(x > 0);
    reals dark = reals_all(n == 0 ? 1 : 0);
    if (n == floor(n) && n >= 0 && n < 65536) {
        unsigned e = (unsigned)n;
        reals power = reals_all(1), square = x;
        for (; e; e >>= 1, square *= square)
            if (e & 1)
                power *= square;
        return reals_select(lit, power, dark);
    }
    FOR_LANES(i, mask_bits(lit))
        x[i] = (real)vol_pow((double)x[i], n);
    return reals_select(lit, x, dark);
}

/* World gradient from index-space gradient: g_world_i = sum_j d(index_j)/d(world_i) g_j (inverse transpose). */
ALWAYS_INLINE void world_gradients(const VolAffine *world_to_index, const reals g[3], reals out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *m = world_to_index->m[i];
        out[i] = reals_fma(reals_all((real)m[2]), g[2], reals_fma(reals_all((real)m[1]), g[1], (real)m[0] * g[0]));
    }
}

/* What arrives from a light that stands somewhere, at t on each ray. */
static inline void arriving_from(const Lanes *lanes, const VolLight *light, reals t, reals l[3], reals *scale)
{
    real from[3][LANES];
    reals to[3];
    for (size_t i = 0; i < LANES; i++) {
        VolVec3 light_from = vol_sub(light->position, lanes->rays[i < lanes->count ? i : 0].origin);
        from[0][i] = (real)light_from.x;
        from[1][i] = (real)light_from.y;
        from[2][i] = (real)light_from.z;
    }
    for (int a = 0; a < 3; a++) {
        memcpy(&to[a], from[a], sizeof to[a]);
        to[a] = reals_fma(t, lanes->view[a], to[a]);
    }
    reals r = reals_sqrt(dot3(to, to)), least = reals_all((real)(0.5 * lanes->scene->grid->voxel));
    ints away = (ints)(r > 0);
    for (int a = 0; a < 3; a++)
        l[a] = reals_select(away, to[a] / r, reals_all(0));
    reals reach = reals_max(r, least);
    *scale = 1 / (reach * reach);
    if (light->kind != VOL_LIGHT_SPOT)
        return;
    reals c = reals_all(0);
    const double axis[3] = {light->direction.x, light->direction.y, light->direction.z};
    for (int a = 0; a < 3; a++)
        c = reals_fma(l[a], reals_all((real)-axis[a]), c);
    reals s = (c - (real)light->cos_edge) / (real)(light->cos_full - light->cos_edge);
    s = reals_clamp(s, 0, 1);
    *scale *= s * s * (3 - 2 * s);
}

/* Direction towards a light, and its strength there. */
ALWAYS_INLINE void arriving(const Lanes *lanes, const VolLight *light, reals t, reals l[3], reals rgb[3])
{
    reals scale = reals_all(1);
    if (light->kind == VOL_LIGHT_HEAD) {
        for (int a = 0; a < 3; a++)
            l[a] = lanes->view[a];
    } else if (light->kind == VOL_LIGHT_SUN) {
        l[0] = reals_all((real)-light->direction.x);
        l[1] = reals_all((real)-light->direction.y);
        l[2] = reals_all((real)-light->direction.z);
    } else {
        arriving_from(lanes, light, t, l, &scale);
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = (real)light->rgb[c] * scale;
}

ALWAYS_INLINE void add_light(const Optics *optics, const reals n[3], const reals view[3], const reals l[3],
                             const reals rgb[3], Shading *out)
{
    reals nl = dot3(n, l), zero = reals_all(0);
    ints lit = (ints)(nl > 0);
    reals h[3] = {l[0] + view[0], l[1] + view[1], l[2] + view[2]};
    reals hh = dot3(h, h);
    reals nh = reals_select((ints)(hh > 0), dot3(n, h) / reals_sqrt(hh), zero);
    reals shine = optics->specular * highlights(reals_min(nh, reals_all(1)), optics->shininess);
    for (int c = 0; c < 3; c++) {
        out->k[c] = reals_fma(reals_select(lit, rgb[c] * optics->diffuse, zero), reals_max(nl, zero), out->k[c]);
        out->b[c] = reals_fma(rgb[c], reals_select(lit, shine, zero), out->b[c]);
    }
}

/* `gradient` in world space, at t on each ray. */
static inline void shade_lanes(const Lanes *lanes, const reals gradient[3], reals t, Shading *out)
{
    const Optics *optics = lanes->optics;
    /* Scaled by the largest component first, so that the square neither overflows nor vanishes. */
    reals zero = reals_all(0);
    reals largest = reals_max(reals_abs(gradient[0]), reals_max(reals_abs(gradient[1]), reals_abs(gradient[2])));
    ints known = (ints)(largest > 0);
    reals n[3], divisor = reals_select(known, largest, reals_all(1));
    for (int i = 0; i < 3; i++)
        n[i] = gradient[i] / divisor;
    reals length = reals_sqrt(dot3(n, n));
    reals side = 1 / reals_select(known, length, reals_all(1));
    side = reals_select((ints)(dot3(n, lanes->view) < 0), -side, side);
    out->gradient = reals_select(known, length * largest, zero);
    for (int c = 0; c < 3; c++) {
        n[c] = reals_select(known, n[c] * side, zero);
        out->normal[c] = n[c];
        out->k[c] = out->b[c] = zero;
    }
    for (size_t i = 0; i < lanes->scene->light_count; i++) {
        reals l[3], rgb[3];
        arriving(lanes, &lanes->scene->lights[i], t, l, rgb);
        for (int c = 0; c < 3; c++)
            out->k[c] = reals_fma(reals_all(optics->ambient), rgb[c], out->k[c]);
        add_light(optics, n, lanes->view, l, rgb, out);
    }
}

/* K 11's S: by table (a + b x), or by the gradient's magnitude from 0 at g0 to 1 at g1. */
ALWAYS_INLINE reals surfaceness_of(const Optics *optics, reals table, const Shading *sh)
{
    reals S = table;
    if (optics->gradient_surfaceness) {
        real width = optics->g1 - optics->g0;
        S = width > 0 ? (sh->gradient - optics->g0) / width
                      : reals_select((ints)(sh->gradient >= optics->g1), reals_all(1), reals_all(0));
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
