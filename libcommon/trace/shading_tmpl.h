/* Blinn-Phong with the normal turned to the viewer, for LANES rays:
 *     sum_k RGB_k (k_d c max(0, N.l) + k_s max(0, N.h)^n [N.l > 0]) + k_a c sum_k RGB_k
 * Where the gradient is 0 there is no normal and the ambient term stands alone.
 *
 * Of sharp highlights float would lose more than it keeps: n is the shininess, and rounding u of N.h becomes n u.  With
 * q = 1 - N.h = |N - h|^2 / 2, h of length 1, they are exp(n log(1 - q)); what rounds is |N - h|, hence n q rounds to
 * 2 sqrt(n q) sqrt(n) u, of which exp(-n q) leaves at most 0.9 sqrt(n) u.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Shading, shade_scaled(), shade_lanes(), shade_evenly(), surfaceness_of(), classic_factors(); halfway_to(),
 *             HIGHLIGHTS_SHARP;
 *             may_be_unsure(), doubt_of(); in float has_no_side() */
#ifndef VOL_TRACE_SHADING_TMPL_H
#define VOL_TRACE_SHADING_TMPL_H

#include "base/fmath.h"
#include "trace/lit_tmpl.h"

/* Diffuse-plus-ambient factor (multiplies the base colour) and highlight (added), per channel. */
typedef struct Shading {
    reals k[3], b[3];
    reals normal[3]; /* unit, turned to the viewer; 0 where there is none */
    reals gradient;  /* its length, per world unit */
} Shading;

/* Gradients shaded together, at several places on each ray: side by side their long chains of operations overlap. */
enum { SHADINGS_MOST = 16 };

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

/* The same of what reaches the surface, without the ambient term. */
ALWAYS_INLINE void add_reaching(const TfTables *tables, reals nl, reals shine, const reals rgb[3], Shading *out)
{
    reals zero = reals_all(0), diffuse = tables->diffuse * reals_max(nl, zero);
    shine = reals_where((ints)(nl > 0), tables->specular * shine);
    for (int c = 0; c < 3; c++) {
        out->k[c] = reals_fma(rgb[c], diffuse, out->k[c]);
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

/* What light grids leave to be done when all lights have been added: `sent` is what all of them together send there.
 * Ambient light is the indirect; without a grid of that, what lights send, unshadowed.  Of a total each light has the part
 * that it has of `sent` (S 3): as if all were sent, times what is there of it. */
MAYBE_UNUSED static void settle_ambient(const RayPacket *packet, int count, const LitPlaces *places, reals sent[][3],
                                        Shading *out)
{
    const VolScene *scene = packet->scene;
    const real ambient = packet->tables->ambient;
    const reals zero = reals_all(0);
    const bool total = scene->lit->total, has_indirect = scene->lit->grid_count > vol_lit_direct_count(scene);
    reals around[SHADINGS_MOST][3];
    if (has_indirect)
        lit_around(packet, count, places, around);
    else
        memcpy(around, sent, sizeof around);
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            reals there = around[i][c];
            if (!total) {
                out[i].k[c] = reals_fma(reals_all(ambient), there, out[i].k[c]);
                continue;
            }
            ints some = (ints)(sent[i][c] > 0);
            reals part = there / reals_select(some, sent[i][c], reals_all(1));
            out[i].k[c] = reals_select(some, out[i].k[c] * part, ambient * there);
            out[i].b[c] = reals_select(some, out[i].b[c] * part, zero);
        }
}

/* Gradients in world space, scaled so that their squares neither overflow nor vanish, so long after `begin`; the times
 * matter to lights that stand somewhere.  `places`: where in light grids they are; NULL: all light is there. */
ALWAYS_INLINE void shade_scaled(const RayPacket *packet, int count, const reals gradient[][3], const Times *begin,
                                const reals *after, const LitPlaces *places, Shading *out)
{
    const bool shadowed = places && !packet->scene->lit->total;
    reals sent[SHADINGS_MOST][3], T[SHADINGS_MOST][3];
    if (places)
        memset(sent, 0, sizeof sent);
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
        if (shadowed)
            lit_direct(packet, n, count, places, T);
        for (int i = 0; i < count; i++) {
            reals rgb[3];
            for (int c = 0; c < 3; c++)
                rgb[c] = (real)light->rgb[c] * scale[i];
            for (int c = 0; c < 3 && places; c++) {
                sent[i][c] += rgb[c];
                rgb[c] = shadowed ? rgb[c] * T[i][c] : rgb[c];
            }
            if (shadowed)
                add_reaching(tables, nl[i], shine[i], rgb, &out[i]);
            else
                add_light(tables, nl[i], shine[i], rgb, &out[i]);
        }
    }
    if (places)
        settle_ambient(packet, count, places, sent, out);
}

/* `gradient` in world space, at those times. */
static inline void shade_lanes(const RayPacket *packet, const reals gradient[3], const Times *times, const LitPlaces *places,
                               Shading *out)
{
    reals scale = scale_for(reals_max(reals_abs(gradient[0]), reals_max(reals_abs(gradient[1]), reals_abs(gradient[2]))));
    reals scaled[1][3] = {{gradient[0] * scale, gradient[1] * scale, gradient[2] * scale}}, zero = reals_all(0);
    shade_scaled(packet, 1, scaled, times, &zero, places, out);
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

/* Where surfaces are not shaded: the light there, whatever their normals are. */
MAYBE_UNUSED static void light_evenly(const RayPacket *packet, int count, const LitPlaces *places, Shading *out)
{
    reals there[SHADINGS_MOST][3];
    lit_evenly(packet, count, places, there);
    for (int i = 0; i < count; i++) {
        out[i] = (Shading){.gradient = reals_all(0)};
        memcpy(out[i].k, there[i], sizeof out[i].k);
    }
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

/* K 11: E ((1 - S) L + f_s S), as a factor of the scattering colour; L the light on what scatters, `lit`, or 1. */
ALWAYS_INLINE void classic_factors(reals S, const Shading *sh, const reals *lit, reals factor[3])
{
    for (int c = 0; c < 3; c++)
        factor[c] = reals_fma(S, sh->k[c] + sh->b[c], lit ? (1 - S) * lit[c] : 1 - S);
}

#endif
