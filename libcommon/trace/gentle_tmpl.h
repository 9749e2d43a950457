/* Sub-intervals on which shading varies gently, for the exact estimator's quadrature.
 *
 * Shading is no polynomial.  It has kinks where the normal flips to face the viewer, where a light begins or ceases to shine
 * on the surface, where K's surfaceness begins and ends, at the edges of spots and where a light near by shines no brighter:
 * roots of quadratics, cubics, and for lights that stand somewhere quartics in the cell's s, as the gradient is a cubic and
 * the direction towards such a light grows with s.  Sub-intervals end at them.
 *
 * Between kinks it is analytic, and Gauss-Legendre converges as rho^(-2 nodes), rho that of the largest ellipse around the
 * sub-interval without a pole.  For a gradient a + b s the normal has poles at |s| = |a| / |b|, a light at distance D from
 * the middle has them at D.  So sub-intervals are halved until the gradients at their ends and middle show that no pole is
 * near, and until no light is nearer than 3/4 of their length (rho = 2.6): rms error of a shaded noise-like field 4e-5
 * without, 2e-8 with.  A highlight of shininess n is about exp(-n angle^2 / 2) of the angle between the normal and halfway
 * to the light: 18 degrees of it suit n = 32, and sharper ones take less in proportion to their width, near their middles.
 * The eye's own light with an n below 2 that is not whole has a branch point where the surface is seen edge on.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    take_gradients(), end_of_gentle_turn() */
#ifndef VOL_TRACE_GENTLE_TMPL_H
#define VOL_TRACE_GENTLE_TMPL_H

#include "trace/subintervals_tmpl.h"

/* The squared sine of the angle that sub-intervals suit, over that for blunt highlights. */
static inline real bluntness(const TfTables *tables)
{
    return tables->shininess > 32 ? (real)(32 / tables->shininess) : 1;
}

/* Whether highlights are roots of N.h, or nearly. */
static inline bool is_rooted(const TfTables *tables)
{
    return tables->shininess > 0 && tables->shininess < 2 && tables->shininess != 1;
}

/* ---- Cells whose shading is gentle all the way ---- */

/* f = m0 + m1 y + m2 y^2 + m3 y^3 with y = 2 s - 1, from -1 to 1 in the cell. */
ALWAYS_INLINE void about_middle(const Cubic *f, reals m[4])
{
    reals half = (real)0.5 * f->a1, quarter = (real)0.25 * f->a2;
    m[3] = (real)0.125 * f->a3;
    m[2] = reals_fma(reals_all(3), m[3], quarter);
    m[1] = reals_fma(reals_all(3), m[3], half + 2 * quarter);
    m[0] = f->a0 + half + quarter + m[3];
}

/* Whether all of the cell's gradients, about its middle m[n], are on the same side of a light: their product with `to` + y
 * `change` has no zero where |f1| + |f2| + |f3| + |f4| < `most` |f0|, `most` up to 1. */
static inline ints all_on_one_side(const reals m[4][3], const reals to[3], const reals change[3], real most)
{
    reals f0 = dot3(m[0], to), rest = reals_abs(dot3(m[3], change));
    for (int n = 1; n < 4; n++)
        rest += reals_abs(dot3(m[n], to) + dot3(m[n - 1], change));
    return (ints)(rest < most * reals_abs(f0));
}

/* Whether a light that stands somewhere is so far from the cell that it shines evenly on it.  Near the edges of spots it
 * never does. */
static inline ints shines_evenly(const Exact *k, const VolLight *light, const reals to[3])
{
    reals away = reals_sqrt(dot3(to, to)), least = reals_all((real)k->packet.prepared->nearest_light);
    reals clear = reals_max((real)0.75 * k->length, reals_fma(reals_all((real)0.5), k->length, least));
    return light->kind == VOL_LIGHT_SPOT ? (ints){0} : (ints)(away > clear);
}

/* Whether every normal of the cell lies within 26 degrees of every other, on the same side of the viewer and of each light,
 * and no gradient is much shorter than another: with the gradient m0 + m1 y + m2 y^2 + m3 y^3,
 * |m1| + |m2| + |m3| <= |m0| / 5 keeps all within 11.6 degrees of m0 and a fifth of its length. */
static inline ints is_steady(const Exact *k, const Cubic gradient[3])
{
    const VolScene *scene = k->packet.scene;
    reals m[4][3], to[3], change[3], none[3] = {{0}};
    for (int a = 0; a < 3; a++) {
        reals of_axis[4];
        about_middle(&gradient[a], of_axis);
        for (int n = 0; n < 4; n++)
            m[n][a] = of_axis[n];
    }
    reals around = reals_sqrt(dot3(m[1], m[1])) + reals_sqrt(dot3(m[2], m[2])) + reals_sqrt(dot3(m[3], m[3]));
    ints steady = (ints)(25 * around * around <= bluntness(k->packet.tables) * dot3(m[0], m[0]));
    steady &= all_on_one_side((const reals(*)[3])m, k->packet.view, none, is_rooted(k->packet.tables) ? (real)0.6 : 1);
    for (size_t n = 0; n < scene->light_count; n++) {
        const VolLight *light = &scene->lights[n];
        LightPath path;
        if (light->kind == VOL_LIGHT_HEAD)
            continue;
        Times begin = cell_times(k), middle = time_in_cell(k, &begin, reals_all((real)0.5));
        light_path(&k->packet, light, &path);
        towards_light(&k->packet, light, &path, &middle, to);
        for (int a = 0; a < 3; a++)
            change[a] = vol_light_stands(light) ? (real)0.5 * k->length * k->packet.view[a] : none[a];
        steady &= all_on_one_side((const reals(*)[3])m, to, change, 1);
        if (vol_light_stands(light))
            steady &= shines_evenly(k, light, to);
    }
    return steady;
}

/* The gradients of the cells of `mask`, scaled so that their squares neither overflow nor vanish. */
static inline void take_gradients(Exact *k, ints mask)
{
    ints wanted = mask & ~k->gradients_known;
    if (!any(wanted))
        return;
    Cubic world[3];
    reals largest = reals_all(0);
    traversal_gradients(&k->way, &k->packet, &k->place, wanted, world);
    for (int a = 0; a < 3; a++)
        largest = reals_max(largest, largest_term(&world[a]));
    reals scale = scale_for(largest);
    for (int a = 0; a < 3; a++) {
        Cubic fresh = {world[a].a0 * scale, world[a].a1 * scale, world[a].a2 * scale, world[a].a3 * scale};
        cubic_replace(&k->gradient[a], wanted, &fresh);
    }
    k->gradient_scale = reals_select(wanted, scale, k->gradient_scale);
    k->steady = ints_select(wanted, is_steady(k, k->gradient), k->steady);
    k->gradients_known |= wanted;
}

/* ---- Kinks ---- */

/* Of f at `count` ascending places between which it is monotone: the two around the first change of its sign, and whether
 * there is one.  What is no more than `none` has no sign. */
ALWAYS_INLINE ints first_change(int count, const reals *at, reals *f, reals none, ints mask, reals *lo, reals *hi)
{
    ints changed = {0}, sign_known = {0};
    for (int n = 0; n < count; n++) {
        ints known = (ints)(reals_abs(f[n]) > none);
        if (n > 0) {
            f[n] = reals_select(known, f[n], f[n - 1]);
            ints here = mask & ~changed & sign_known & (ints)(f[n] * f[n - 1] < 0);
            *lo = reals_select(here, at[n - 1], *lo);
            *hi = reals_select(here, at[n], *hi);
            changed |= here;
        }
        sign_known |= known;
    }
    return changed;
}

ALWAYS_INLINE reals sum_of_terms(const Cubic *f)
{
    return (reals_abs(f->a0) + reals_abs(f->a1)) + (reals_abs(f->a2) + reals_abs(f->a3));
}

/* Where f changes its sign first between sa and sb, else sb; what is 0 but for rounding has none. */
static reals cubic_limit(const Cubic *f, reals sa, reals sb, ints mask)
{
    reals none = 4 * REAL_EPSILON * sum_of_terms(f);
    reals turn[2], values[4], lo = sa, hi = sb;
    turning_points(f, &turn[0], &turn[1]);
    /* Between these f is monotone: no pair of zeros stays unseen. */
    const reals at[4] = {sa, reals_min(reals_max(turn[0], sa), sb), reals_min(reals_max(turn[1], sa), sb), sb};
    for (int n = 0; n < 4; n++)
        values[n] = cubic_at(f, at[n]);
    ints crossed = first_change(4, at, values, none, mask, &lo, &hi);
    if (!any(crossed))
        return sb;
    reals zero = solve_cubic(f, reals_all(0), lo, hi, crossed);
    return reals_select(crossed & (ints)(zero > sa), zero, sb);
}

ALWAYS_INLINE reals quartic_at(const Cubic *low, reals a4, reals s)
{
    Cubic rest = {low->a1, low->a2, low->a3, a4};
    return reals_fma(cubic_at(&rest, s), s, low->a0);
}

/* The same for f + a4 s^4. */
static reals quartic_limit(const Cubic *f, reals a4, reals sa, reals sb, ints mask)
{
    enum { HALVINGS = sizeof(real) == sizeof(float) ? 24 : 53 };
    const Cubic slope = {f->a1, 2 * f->a2, 3 * f->a3, 4 * a4};
    reals none = 4 * REAL_EPSILON * (sum_of_terms(f) + reals_abs(a4));
    reals turn[2], values[5], lo = sa, hi = sb;
    turning_points(&slope, &turn[0], &turn[1]);
    /* Between these the slope is monotone, and has one zero at most, where f turns. */
    const reals bend[4] = {sa, reals_min(reals_max(turn[0], sa), sb), reals_min(reals_max(turn[1], sa), sb), sb};
    reals at[5] = {sa, sa, sa, sa, sb};
    for (int n = 0; n < 3; n++)
        at[n + 1] = solve_cubic(&slope, reals_all(0), bend[n], bend[n + 1], mask);
    for (int n = 0; n < 5; n++)
        values[n] = quartic_at(f, a4, at[n]);
    ints crossed = first_change(5, at, values, none, mask, &lo, &hi), below = (ints)(quartic_at(f, a4, lo) < 0);
    for (int n = 0; n < HALVINGS && any(crossed); n++) {
        reals middle = (real)0.5 * (lo + hi);
        ints before = ~(below ^ (ints)(quartic_at(f, a4, middle) < 0));
        lo = reals_select(before, middle, lo);
        hi = reals_select(before, hi, middle);
    }
    return reals_select(crossed & (ints)(hi > sa), hi, sb);
}

/* The gradient's product with `to`, along the cell. */
ALWAYS_INLINE Cubic side_of(const Exact *k, const reals to[3])
{
    const Cubic *g = k->gradient;
    return (Cubic){dot3((reals[]){g[0].a0, g[1].a0, g[2].a0}, to), dot3((reals[]){g[0].a1, g[1].a1, g[2].a1}, to),
                   dot3((reals[]){g[0].a2, g[1].a2, g[2].a2}, to), dot3((reals[]){g[0].a3, g[1].a3, g[2].a3}, to)};
}

/* Where a light at a + b s begins or ceases to shine on the surface. */
static reals shine_limit(const Exact *k, const reals a[3], const reals b[3], reals sa, reals sb, ints mask)
{
    Cubic here = side_of(k, a), change = side_of(k, b);
    Cubic f = {here.a0, here.a1 + change.a0, here.a2 + change.a1, here.a3 + change.a2};
    return quartic_limit(&f, change.a3, sa, sb, mask);
}

/* Where its distance passes the one within which it shines no brighter, and where the ray enters or leaves the cones of a
 * spot: (a + b s)^2 = r^2, and with u + v s the way from the axis (u + v s)^2 = sin^2 (a + b s)^2. */
static reals falloff_limit(const Exact *k, const VolLight *light, const reals a[3], const reals b[3], reals sa, reals sb,
                           ints mask)
{
    const real least = (real)k->packet.prepared->nearest_light;
    reals zero = reals_all(0), aa = dot3(a, a), ab = 2 * dot3(a, b), bb = dot3(b, b);
    Cubic f = {aa - least * least, ab, bb, zero};
    sb = cubic_limit(&f, sa, sb, mask);
    if (light->kind != VOL_LIGHT_SPOT)
        return sb;
    const double edges[2] = {light->cos_edge, light->cos_full};
    reals u[3], v[3];
    Times begin = cell_times(k);
    LightPath path;
    light_path(&k->packet, light, &path);
    off_axis(&path, &begin, u);
    for (int i = 0; i < 3; i++)
        v[i] = k->length * path.drift[i];
    for (int n = 0; n < 2; n++) {
        real square = (real)((1 - edges[n]) * (1 + edges[n]));
        f = (Cubic){dot3(u, u) - square * aa, 2 * dot3(u, v) - square * ab, dot3(v, v) - square * bb, zero};
        sb = cubic_limit(&f, sa, sb, mask);
    }
    return sb;
}

/* The light's direction a + b s along the cell. */
static inline void direction_in_cell(const Exact *k, const VolLight *light, reals a[3], reals b[3])
{
    LightPath path;
    Times begin = cell_times(k);
    light_path(&k->packet, light, &path);
    towards_light(&k->packet, light, &path, &begin, a);
    for (int i = 0; i < 3; i++)
        b[i] = vol_light_stands(light) ? k->length * k->packet.view[i] : reals_all(0);
}

/* Where the normal flips to face the viewer, or a light's kinks are, between sa and sb, else sb. */
static inline reals kink_limit(const Exact *k, reals sa, reals sb, ints mask)
{
    const VolScene *scene = k->packet.scene;
    Cubic f = side_of(k, k->packet.view);
    sb = cubic_limit(&f, sa, sb, mask);
    for (size_t n = 0; n < scene->light_count; n++) {
        const VolLight *light = &scene->lights[n];
        reals a[3], b[3];
        if (light->kind == VOL_LIGHT_HEAD)
            continue;
        direction_in_cell(k, light, a, b);
        f = side_of(k, a);
        if (!vol_light_stands(light)) {
            sb = cubic_limit(&f, sa, sb, mask);
            continue;
        }
        sb = shine_limit(k, a, b, sa, sb, mask);
        sb = falloff_limit(k, light, a, b, sa, sb, mask);
    }
    return sb;
}

/* |gradient|^2 - square, along the cell. */
ALWAYS_INLINE reals length_beyond(const Exact *k, reals s, reals square)
{
    reals g[3];
    gradients_at(k, s, g);
    return dot3(g, g) - square;
}

/* Surfaceness by gradient magnitude (K 11) has a kink at either end of its ramp.  The first place between sa and sb where
 * the magnitude passes one of these ends, else sb.  The squared magnitude is nearly a parabola, whose vertex reveals a
 * pair of passages that the values at sa and sb do not show. */
static reals ramp_limit(const Exact *k, real magnitude, reals sa, reals sb, ints mask)
{
    enum { HALVINGS = sizeof(real) == sizeof(float) ? 24 : 53 };
    reals edge = magnitude * k->gradient_scale, square = edge * edge, half = (real)0.5 * (sb - sa), middle = sa + half;
    /* Begin just beyond sa: at sa itself, the last passage, rounding would decide. */
    reals ahead = reals_fma(half, reals_all((real)0x1p-10), sa);
    reals fa = length_beyond(k, ahead, square), fm = length_beyond(k, middle, square), fb = length_beyond(k, sb, square);
    reals vertex = middle - (real)0.5 * half * (fb - fa) / ((fa - fm) + (fb - fm));
    ints below = (ints)(fa < 0), inside = mask & (ints)(vertex > ahead) & (ints)(vertex < sb);
    vertex = reals_select(inside, vertex, middle);
    reals fv = length_beyond(k, vertex, square);
    ints dips = mask & (below ^ (ints)(fv < 0)), passed = dips | (mask & (below ^ (ints)(fb < 0)));
    reals lo = ahead, hi = reals_select(dips, vertex, sb);
    for (int n = 0; n < HALVINGS && any(passed); n++) {
        middle = (real)0.5 * (lo + hi);
        ints before = ~(below ^ (ints)(length_beyond(k, middle, square) < 0));
        lo = reals_select(before, middle, lo);
        hi = reals_select(before, hi, middle);
    }
    return reals_select(passed, hi, sb);
}

/* Whether the gradient's length, which is a root, changes so much that it has a branch point nearby. */
ALWAYS_INLINE ints is_uneven(const reals a[3], const reals m[3], const reals b[3])
{
    reals aa = dot3(a, a), mm = dot3(m, m), bb = dot3(b, b);
    return (ints)(reals_max(reals_max(aa, bb), mm) > 4 * reals_min(reals_min(aa, bb), mm));
}

/* ---- What turns too far ---- */

/* Whether the normal turns by more than 18 degrees from a to b. */
ALWAYS_INLINE ints turns(const reals a[3], const reals b[3])
{
    reals aa = dot3(a, a), bb = dot3(b, b), ab = dot3(a, b);
    return (ints)(ab < 0) | (ints)(ab * ab < (real)0.9 * aa * bb);
}

/* Whether the gradient bends so much that it may all but vanish in between: the second difference against the middle. */
ALWAYS_INLINE ints bends(const reals a[3], const reals m[3], const reals b[3])
{
    reals second[3];
    for (int i = 0; i < 3; i++)
        second[i] = (a[i] - m[i]) + (b[i] - m[i]);
    return (ints)(dot3(second, second) > (real)0.1 * dot3(m, m));
}

/* Whether the normal does most of its turning near the end where the gradient is shorter: the gradient's length changes
 * much, and its direction with it; a stretch up to 4 times as long as the way to the pole will do.  Turns of less than half
 * a degree do not matter. */
ALWAYS_INLINE ints turns_at_an_end(const reals a[3], const reals b[3], real bluntness)
{
    reals aa = dot3(a, a), bb = dot3(b, b), ab = dot3(a, b);
    ints uneven = (ints)(aa > 25 * bb) | (ints)(bb > 25 * aa);
    return uneven & (ints)(ab * ab < (1 - (real)0.0001 * bluntness) * aa * bb);
}

/* Unit, towards the viewer; 0 where there is no gradient. */
ALWAYS_INLINE void unit_normal(const RayPacket *packet, const reals gradient[3], reals n[3])
{
    reals square = dot3(gradient, gradient), side = reals_where((ints)(square > 0), 1 / reals_sqrt(square));
    side = reals_select((ints)(dot3(gradient, packet->view) < 0), -side, side);
    for (int a = 0; a < 3; a++)
        n[a] = gradient[a] * side;
}

ALWAYS_INLINE reals chord(const reals a[3], const reals b[3])
{
    reals off[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return reals_sqrt(dot3(off, off));
}

/* Beside a sub-interval's ends and middle: where a light is halfway to the viewer. */
typedef struct Halfway {
    reals at[3][3];
} Halfway;

ALWAYS_INLINE void halfway_along(const Exact *k, const VolLight *light, const reals s[3], Halfway *out)
{
    LightPath path;
    Times begin = cell_times(k);
    bool head = light->kind == VOL_LIGHT_HEAD;
    light_path(&k->packet, light, &path);
    for (int i = 0; i < 3; i++) {
        reals l[3] = {k->packet.view[0], k->packet.view[1], k->packet.view[2]};
        Times times = time_in_cell(k, &begin, s[i]);
        if (!head)
            arriving_from(&k->packet, light, &path, &times, l);
        halfway_to(&k->packet, l, out->at[i]);
    }
}

/* Whether, beside a highlight sharper than 32, the normal or what lies halfway to a light turns too far for it.  On the unit
 * sphere exp(-n chord^2 / 2) is below 1e-9 from a chord of sqrt(41 / n) on; what is between the places looked at is no
 * further from them than they are from each other. */
static ints turns_in_highlight(const Exact *k, const reals s[3], const reals gradients[3][3])
{
    const VolScene *scene = k->packet.scene;
    const TfTables *tables = k->packet.tables;
    const real most = (real)sqrt(0.1 * 32 / tables->shininess), reach = (real)sqrt(41 / tables->shininess);
    reals normal[3][3];
    ints rough = {0};
    for (int i = 0; i < 3; i++)
        unit_normal(&k->packet, gradients[i], normal[i]);
    reals turned = reals_max(chord(normal[0], normal[1]), chord(normal[1], normal[2]));
    for (size_t n = 0; n < scene->light_count; n++) {
        Halfway half;
        halfway_along(k, &scene->lights[n], s, &half);
        reals moves = turned + reals_max(chord(half.at[0], half.at[1]), chord(half.at[1], half.at[2]));
        reals off = reals_min(chord(normal[0], half.at[0]),
                              reals_min(chord(normal[1], half.at[1]), chord(normal[2], half.at[2])));
        rough |= (ints)(moves > most) & (ints)(off < reach + moves);
    }
    return rough;
}

/* Whether a light is nearer to the middle m of sub-intervals than 3/4 of their length. */
static ints is_beside_light(const Exact *k, reals m, reals length)
{
    const VolScene *scene = k->packet.scene;
    ints beside = {0};
    for (size_t n = 0; n < scene->light_count && k->packet.prepared->lit_from_places; n++) {
        LightPath path;
        reals to[3];
        if (!vol_light_stands(&scene->lights[n]))
            continue;
        Times begin = cell_times(k), middle = time_in_cell(k, &begin, m);
        light_path(&k->packet, &scene->lights[n], &path);
        towards_light(&k->packet, &scene->lights[n], &path, &middle, to);
        reals clear = (real)0.75 * length * k->length;
        beside |= (ints)(dot3(to, to) < clear * clear);
    }
    return beside;
}

/* Whether the angle to the viewer has a cosine more than 4 times as large at a as at b, or the other way round. */
ALWAYS_INLINE ints leans(const reals view[3], const reals a[3], const reals b[3])
{
    reals to_a = dot3(a, view), to_b = dot3(b, view), aa = to_a * to_a * dot3(b, b), bb = to_b * to_b * dot3(a, a);
    return (ints)(aa > 16 * bb) | (ints)(bb > 16 * aa);
}

/* Whether shading is too lively between s[0] and s[2] for one sub-interval; s[1] is their middle. */
ALWAYS_INLINE ints is_lively(const Exact *k, const reals s[3], const reals g[3][3])
{
    const TfTables *o = k->packet.tables;
    const real blunt = bluntness(o);
    ints lively = turns(g[0], g[1]) | turns(g[1], g[2]) | bends(g[0], g[1], g[2]) | turns_at_an_end(g[0], g[2], blunt);
    if (o->classic && o->gradient_surfaceness)
        lively |= is_uneven(g[0], g[1], g[2]);
    lively |= is_beside_light(k, s[1], s[2] - s[0]);
    if (is_rooted(o))
        lively |= leans(k->packet.view, g[0], g[2]);
    if (blunt < 1)
        lively |= turns_in_highlight(k, s, g);
    return lively;
}

/* How far from sa towards sb one sub-interval may go. */
static reals turn_limit(const Exact *k, reals sa, reals sb, ints mask)
{
    const TfTables *o = k->packet.tables;
    reals g[3][3], s[3] = {sa};
    if (o->classic && o->gradient_surfaceness) {
        sb = ramp_limit(k, o->g0, sa, sb, mask);
        sb = ramp_limit(k, o->g1, sa, sb, mask);
    }
    mask &= ~k->steady;
    if (!any(mask))
        return sb;
    sb = kink_limit(k, sa, sb, mask);
    gradients_at(k, sa, g[0]);
    gradients_at(k, sb, g[2]);
    for (int halvings = 0; halvings < 16; halvings++) {
        s[1] = (real)0.5 * (sa + sb);
        s[2] = sb;
        mask &= (ints)(s[1] > sa) & (ints)(s[1] < sb);
        gradients_at(k, s[1], g[1]);
        mask &= is_lively(k, s, (const reals(*)[3])g);
        if (!any(mask))
            break;
        sb = reals_select(mask, s[1], sb);
        for (int a = 0; a < 3; a++)
            g[2][a] = reals_select(mask, g[1][a], g[2][a]);
    }
    return sb;
}

/* The same in u of the segment: exactly 1 where it is the segment's end. */
static reals end_of_gentle_turn(const Exact *k, ints mask)
{
    reals whole = k->stop - k->s, from = reals_fma(whole, k->done, k->s), to = turn_limit(k, from, k->stop, mask);
    reals u = reals_min((to - k->s) / whole, reals_all(1));
    return reals_select((ints)(to < k->stop) & (ints)(u > k->done), u, reals_all(1));
}

#endif
