/* Blinn-Phong with the normal turned to the viewer:
 *     sum_k RGB_k (k_d c max(0, N.l) + k_s max(0, N.h)^n [N.l > 0]) + k_a c sum_k RGB_k
 * Where the gradient is 0 there is no normal and the ambient term stands alone.  Include real.h and optics_tmpl.h first. */
#ifndef VOL_RENDER_SHADE_TMPL_H
#define VOL_RENDER_SHADE_TMPL_H

#include "base/fmath.h"
#include "render/scene.h"

/* Diffuse-plus-ambient factor (multiplies the base colour) and highlight (added), per channel. */
typedef struct Shading {
    real k[3], b[3];
    real normal[3]; /* unit, turned to the viewer; 0 where there is none */
    real gradient;  /* its length, per world unit */
} Shading;

/* x^n for x in [0, 1]; whole exponents by squaring. */
static inline real highlight(real x, double n)
{
    if (!(x > 0))
        return n == 0 ? 1 : 0;
    if (n == floor(n) && n >= 0 && n < 65536) {
        unsigned e = (unsigned)n;
        real power = 1, square = x;
        for (; e; e >>= 1, square *= square)
            if (e & 1)
                power *= square;
        return power;
    }
    return (real)vol_pow((double)x, n);
}

static inline real dot3(const real a[3], const real b[3])
{
    return real_fma(a[2], b[2], real_fma(a[1], b[1], a[0] * b[0]));
}

/* World gradient from index-space gradient: g_world_i = sum_j d(index_j)/d(world_i) g_j (inverse transpose). */
static inline void world_gradient(const VolAffine *world_to_index, const real g[3], real out[3])
{
    for (int i = 0; i < 3; i++) {
        const double *m = world_to_index->m[i];
        out[i] = real_fma((real)m[2], g[2], real_fma((real)m[1], g[1], (real)m[0] * g[0]));
    }
}

/* K 11's S: by table, or by the gradient's magnitude from 0 at g0 to 1 at g1. */
static inline real surfaceness_at(const Optics *optics, const Interval *in, const Shading *sh, real x)
{
    real S = line_at(in->surfaceness, x);
    if (optics->gradient_surfaceness) {
        real width = optics->g1 - optics->g0;
        S = width > 0 ? (sh->gradient - optics->g0) / width : (sh->gradient >= optics->g1 ? 1 : 0);
    }
    return real_clamp(S, 0, 1);
}

/* Light k at `position`: direction towards it and what arrives. */
static inline void arriving(const VolScene *scene, const VolLight *light, VolVec3 position, const real view[3], real l[3],
                            real rgb[3])
{
    double scale = 1;
    VolVec3 to = vol_scale(light->direction, -1);
    if (light->kind == VOL_LIGHT_POINT || light->kind == VOL_LIGHT_SPOT) {
        to = vol_sub(light->position, position);
        double r = vol_length(to), least = 0.5 * scene->grid->voxel;
        to = r > 0 ? vol_scale(to, 1 / r) : vol_vec3(0, 0, 0);
        double reach = r < least ? least : r;
        scale = 1 / (reach * reach);
        if (light->kind == VOL_LIGHT_SPOT) {
            double c = -vol_dot(to, light->direction);
            double s = (c - light->cos_edge) / (light->cos_full - light->cos_edge);
            s = s < 0 ? 0 : s > 1 ? 1 : s;
            scale *= s * s * (3 - 2 * s);
        }
    }
    l[0] = (real)to.x;
    l[1] = (real)to.y;
    l[2] = (real)to.z;
    if (light->kind == VOL_LIGHT_HEAD)
        for (int i = 0; i < 3; i++)
            l[i] = view[i];
    for (int i = 0; i < 3; i++)
        rgb[i] = (real)(light->rgb[i] * scale);
}

static inline void add_light(const Optics *optics, const real n[3], const real view[3], const real l[3],
                             const real rgb[3], Shading *out)
{
    real nl = dot3(n, l);
    if (!(nl > 0))
        return;
    real h[3] = {l[0] + view[0], l[1] + view[1], l[2] + view[2]};
    real hh = dot3(h, h);
    real nh = hh > 0 ? dot3(n, h) / real_sqrt(hh) : 0;
    real shine = optics->specular * highlight(real_min(nh, 1), optics->shininess);
    for (int c = 0; c < 3; c++) {
        out->k[c] = real_fma(rgb[c] * optics->diffuse, nl, out->k[c]);
        out->b[c] = real_fma(rgb[c], shine, out->b[c]);
    }
}

/* `gradient` in world space; `view` = minus the ray's direction; `position` in world space. */
static inline void shade(const VolScene *scene, const Optics *optics, const real gradient[3], const real view[3],
                         VolVec3 position, Shading *out)
{
    /* Scaled by the largest component first, so that the square neither overflows nor vanishes. */
    real largest = real_max(real_abs(gradient[0]), real_max(real_abs(gradient[1]), real_abs(gradient[2])));
    real n[3] = {0, 0, 0};
    out->gradient = 0;
    if (largest > 0) {
        for (int i = 0; i < 3; i++)
            n[i] = gradient[i] / largest;
        real length = real_sqrt(dot3(n, n));
        real side = dot3(n, view) < 0 ? -1 / length : 1 / length;
        for (int i = 0; i < 3; i++)
            n[i] *= side;
        out->gradient = length * largest;
    }
    for (int c = 0; c < 3; c++) {
        out->k[c] = out->b[c] = 0;
        out->normal[c] = n[c];
    }
    for (size_t i = 0; i < scene->light_count; i++) {
        real l[3], rgb[3];
        arriving(scene, &scene->lights[i], position, view, l, rgb);
        for (int c = 0; c < 3; c++)
            out->k[c] = real_fma(optics->ambient, rgb[c], out->k[c]);
        if (largest > 0)
            add_light(optics, n, view, l, rgb, out);
    }
}

#endif
