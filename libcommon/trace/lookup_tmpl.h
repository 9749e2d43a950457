/* What LANES segments add to the light of their rays, from tables over (v0, v1) or from integrals in one dimension: as
 * vol_preint_full_at and vol_preint_integrals_at (tf/preint.h has the equations), LANES at once.
 *
 * Optical depth is exact: M_s + mean(mu_p) dl.  Between knots extinction is linear in v, and its mean from v0 to v1 is that
 * of its ends.  A segment that runs over knots has three parts: up to the first knot, from the last knot on, and between
 * them, where prefix integrals are subtracted.  Knots are kept to twice the precision, so that a jump right beside v0
 * still counts for the fraction of the segment that lies before it, however small.
 *
 * Tables: four entries blended, linear on each of the two triangles of a cell that v0 = v1 cuts, then scaled so that the
 * opacities of the parts add up to the exact one.  With x and y the fractions of v0 and v1 within their bins the weights are
 *     entry       (i, j)                (i+1, j+1)    (i+1, j)         (i, j+1)
 *     elsewhere   (1 - x) (1 - y)       x y           x (1 - y)        (1 - x) y
 *     cut cells   min(1 - x, 1 - y)     min(x, y)     max(x - y, 0)    max(y - x, 0)
 * each computed from x, 1 - x and y - x as they were found, never as a difference of nearly equal numbers: entries of next
 * to no opacity keep all digits when they are scaled up, even among 4096 nodes.  What the table does not cover (beyond the
 * nodes or the band, dense bins, ends of rays, coloured attenuation) is integrated (pieces_tmpl.h).
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    look_up_full(), look_up_integrals(); of segment_ends_tmpl.h LookupEnd, SegmentParts, find_end(),
 *             something_between() */
#ifndef VOL_TRACE_LOOKUP_TMPL_H
#define VOL_TRACE_LOOKUP_TMPL_H

#include "trace/pieces_tmpl.h"

/* ---- Segments that run over knots ---- */

/* The first and the last knot on the way, for lanes whose ends lie in different intervals. */
typedef struct KnotsBetween {
    ints apart, rising, first, last;
    reals front, back; /* |change of v| up to the first and from the last */
    reals v[2], v_rest[2];
    reals extinction[2], surface[2]; /* at those knots, as seen from the ends */
} KnotsBetween;

/* The knot next to an end (0: the front) at v; returns the way to it, `up`wards or down. */
ALWAYS_INLINE reals load_knots(const TfTables *o, ints knot, ints up, reals v, int end, unsigned features, KnotsBetween *out)
{
    reals group[4] = {{0}};
    load_quads(&o->knots[0].v, knot * KNOT_REALS, group);
    reals way = (group[0] - v) + group[1];
    out->v[end] = group[0];
    out->v_rest[end] = group[1];
    out->extinction[end] = reals_select(up, group[2], group[3]);
    if (features & FEATURE_SURFACE) {
        load_quads(&o->knots[0].surface[0], knot * KNOT_REALS, group);
        out->surface[end] = reals_select(up, group[0], group[1]);
    }
    return reals_max(reals_select(up, way, -way), reals_all(0));
}

ALWAYS_INLINE void find_knots(const TfTables *o, const LookupEnd *a, const LookupEnd *b, ints apart, unsigned features,
                              KnotsBetween *out)
{
    ints rising = (ints)(a->interval < b->interval);
    out->apart = apart;
    out->rising = rising;
    out->first = apart & (a->interval + ~rising);
    out->last = apart & (b->interval + rising);
    out->front = load_knots(o, out->first, rising, a->v, 0, features, out);
    out->back = load_knots(o, out->last, ~rising, b->v, 1, features, out);
}

/* The integral between the first knot and the last of the number that stands `at` in VolTfIntegral. */
ALWAYS_INLINE reals between_knots(const TfTables *o, const KnotsBetween *k, size_t at)
{
    reals sum = reals_all(0);
    FOR_LANES(i, mask_bits(k->apart & (ints)(k->first != k->last))) {
        const double *from = (const double *)(const void *)((const char *)&o->at_knot[k->first[i]] + at);
        const double *to = (const double *)(const void *)((const char *)&o->at_knot[k->last[i]] + at);
        sum[i] = (real)fabs(*to - *from);
    }
    return sum;
}

/* ---- Optical depth and opacity ---- */

/* Mean extinction of the particles, and optical depth of the surfaces. */
ALWAYS_INLINE void grey_depths(const TfTables *o, const LookupEnd *a, const LookupEnd *b, ints mask, unsigned features,
                               reals *particles, reals *surface)
{
    const real half = (real)0.5;
    reals change = reals_abs(b->v - a->v);
    *particles = half * (a->extinction + b->extinction);
    *surface = reals_all(0);
    if (features & FEATURE_SURFACE)
        *surface = half * change * (a->surface + b->surface);
    ints apart = mask & (ints)(a->interval != b->interval);
    if (!any(apart))
        return;
    KnotsBetween k;
    find_knots(o, a, b, apart, features, &k);
    reals sum = half * (k.front * (a->extinction + k.extinction[0]) + k.back * (b->extinction + k.extinction[1]));
    sum += between_knots(o, &k, offsetof(VolTfIntegral, particle));
    *particles = reals_select(apart, sum / change, *particles);
    if (features & FEATURE_SURFACE) {
        sum = half * (k.front * (a->surface + k.surface[0]) + k.back * (b->surface + k.surface[1]));
        sum += between_knots(o, &k, offsetof(VolTfIntegral, surface));
        *surface = reals_select(apart, sum, *surface);
    }
}

/* ---- Tables ---- */

/* The weights of (i, j), (i + 1, j + 1), (i + 1, j), (i, j + 1), and where in the table these entries begin; the last
 * two side by side with the first. */
typedef struct Corners {
    ints at, above, below;
    reals weight[4];
} Corners;

/* The lanes of `mask` that the table covers. */
ALWAYS_INLINE ints find_corners(const Lookup *t, const LookupEnd *a, const LookupEnd *b, ints mask, Corners *out)
{
    const reals zero = reals_all(0);
    ints diagonal = b->node - a->node, side = (ints)(diagonal < 0), away = (diagonal ^ side) - side;
    mask &= (ints)(reals_min(a->v, b->v) >= t->lo) & (ints)(reals_max(a->v, b->v) <= t->hi);
    if (t->reach) {
        mask &= (ints)(away <= gather_ints(t->reach, a->node & mask));
        mask &= (ints)(away <= gather_ints(t->reach, b->node & mask));
    } else {
        mask &= (ints)(away < t->band);
    }
    ints cut = (ints)(diagonal == 0);
    reals along = (b->v - a->v) * t->scale;
    out->weight[0] = reals_select(cut, reals_min(a->rest, b->rest), a->rest * b->rest);
    out->weight[1] = reals_select(cut, reals_min(a->x, b->x), a->x * b->x);
    out->weight[2] = reals_select(cut, reals_max(-along, zero), a->x * b->rest);
    out->weight[3] = reals_select(cut, reals_max(along, zero), a->rest * b->x);
    ints at = ((diagonal + t->band) * t->stride + a->node) * (4 * t->parts);
    const lane_int row = 4 * t->parts * t->stride, entry = 4 * t->parts;
    out->at = at & mask;
    out->below = (at - (row - entry)) & mask;
    out->above = (at + row) & mask;
    return mask;
}

/* Four numbers per lane, blended from the table's corners. */
ALWAYS_INLINE void blend_entries(const real *table, lane_int entry, const Corners *k, reals out[4])
{
    lane_int at[LANES], above[LANES], below[LANES];
    reals row[4];
    memcpy(at, &k->at, sizeof at);
    memcpy(above, &k->above, sizeof above);
    memcpy(below, &k->below, sizeof below);
    for (int i = 0; i < 4; i++) {
        row[i] = spread_in_quads(k->weight[0], i) * load_quad_row(table, at, i);
        row[i] = reals_fma(spread_in_quads(k->weight[1], i), load_quad_row(table + entry, at, i), row[i]);
        row[i] = reals_fma(spread_in_quads(k->weight[2], i), load_quad_row(table, below, i), row[i]);
        row[i] = reals_fma(spread_in_quads(k->weight[3], i), load_quad_row(table, above, i), row[i]);
    }
    transpose_quads(row, out);
}

/* The lanes of `mask` that the table covers; the others of `out` are finite, but mean nothing. */
ALWAYS_INLINE ints look_up_table(const TfTables *o, const LookupEnd *a, const LookupEnd *b, ints mask, unsigned features,
                                 real length, SegmentParts *out)
{
    const Lookup *t = &o->lookup;
    /* A general kernel has code for surfaces, but the table of a scene without any has no room for them. */
    const bool surfaces = features & FEATURE_SURFACE && t->parts == 3;
    const lane_int entry = surfaces ? 12 : 4;
    reals group[3][4] = {{{0}}}, particles, surface;
    Corners corners;
    ints known = find_corners(t, a, b, mask, &corners);
    for (int p = 0; p < entry / 4; p++)
        blend_entries(t->entries + 4 * p, entry, &corners, group[p]);
    grey_depths(o, a, b, known, features, &particles, &surface);
    reals depth = particles * length;
    if (features & FEATURE_SURFACE)
        depth += surface;
    for (int c = 0; c < 3; c++)
        out->optical_depth[c] = depth;
    reals sum = group[0][3];
    if (surfaces)
        sum += group[1][3] + group[2][3];
    /* Emission alone has no opacity to be scaled by. */
    reals some = reals_select((ints)(sum > 0), sum, reals_all(1)), passed;
    reals factor = reals_select((ints)(sum > 0), depth * reals_phi(depth, &passed) / some, reals_all(1));
    for (int c = 0; c < 3; c++)
        out->particles_c[c] = group[0][c] * factor;
    out->particles_a = group[0][3] * factor;
    if (features & FEATURE_SURFACE) {
        for (int c = 0; c < 3; c++) {
            out->front_c[c] = group[1][c] * factor;
            out->back_c[c] = group[2][c] * factor;
        }
        for (int c = 0; c < 3; c++) {
            out->front_a[c] = group[1][3] * factor;
            out->back_a[c] = group[2][3] * factor;
        }
    }
    return known;
}

/* One lane's, of the scene's step, by tables of other steps. */
static void look_up_one(const VolScene *scene, const LookupEnd *a, const LookupEnd *b, unsigned i, SegmentParts *out)
{
    VolPreintSegment s;
    vol_preint_full_at(scene->preint, (double)a->v[i], (double)b->v[i], scene->step, &s);
    for (int c = 0; c < 3; c++) {
        out->optical_depth[c][i] = (real)s.depth[c];
        out->front_c[c][i] = (real)s.fw_c[c];
        out->front_a[c][i] = (real)s.fw_a[c];
        out->back_c[c][i] = (real)s.bw_c[c];
        out->back_a[c][i] = (real)s.bw_a[c];
        out->particles_c[c][i] = (real)s.p_c[c];
    }
    out->particles_a[i] = (real)s.p_a[0];
}

/* ---- Integrals in one dimension ---- */

/* Y 16: of surfaces integrals over |dv|, of particles means over the segment. */
typedef struct Integrals {
    reals surface, surface_color[3], where; /* where: of (v - v0) / (v1 - v0), weighted by the surface */
    reals extinction[3], source[3];
} Integrals;

/* v + rest, at u from 0 at the segment's front to 1 at its back. */
typedef struct StretchEnd {
    reals v, rest, u;
} StretchEnd;

/* Adds a stretch that lies in one interval.  Simpson's rule is exact. */
ALWAYS_INLINE void add_stretch(const TfTables *o, ints interval, const StretchEnd *from, const StretchEnd *to, reals change,
                               unsigned features, Integrals *sum)
{
    const reals zero = reals_all(0);
    reals particles[4] = {{0}}, scatter[8] = {{0}}, emit[8] = {{0}}, surface[8] = {{0}}, rest[4] = {{0}};
    load_interval(o, interval, AT_PARTICLES, particles);
    load_interval(o, interval, AT_SCATTER, scatter);
    load_interval(o, interval, AT_SCATTER + 4, scatter + 4);
    if (features & FEATURE_EMIT) {
        load_interval(o, interval, AT_EMIT, emit);
        load_interval(o, interval, AT_EMIT + 4, emit + 4);
    }
    if (features & FEATURE_SURFACE) {
        load_interval(o, interval, AT_SURFACE, surface);
        load_interval(o, interval, AT_SURFACE + 4, surface + 4);
    }
    if (features & FEATURE_COLOURED)
        load_interval(o, interval, AT_REST, rest);
    reals share = reals_max(to->u - from->u, zero), place[3], at[3];
    place[0] = (from->v - particles[0]) + from->rest;
    place[2] = (to->v - particles[0]) + to->rest;
    place[1] = (real)0.5 * (place[0] + place[2]);
    at[0] = from->u, at[1] = (real)0.5 * (from->u + to->u), at[2] = to->u;
    Integrals here;
    memset(&here, 0, sizeof here);
    for (int n = 0; n < 3; n++) {
        const real weight = n == 1 ? 4 : 1;
        reals x = place[n], mu = weight * reals_max(reals_line(scatter[0], scatter[1], x), zero);
        here.extinction[0] = reals_fma(reals_max(reals_line(particles[1], particles[2], x), zero), reals_all(weight),
                                       here.extinction[0]);
        for (int c = 1; c < 3 && features & FEATURE_COLOURED; c++)
            here.extinction[c] = reals_fma(reals_max(reals_line(rest[2 * c - 2], rest[2 * c - 1], x), zero),
                                           reals_all(weight), here.extinction[c]);
        for (int c = 0; c < 3; c++) {
            here.source[c] = reals_fma(mu, reals_max(reals_line(scatter[2 + 2 * c], scatter[3 + 2 * c], x), zero),
                                       here.source[c]);
            if (features & FEATURE_EMIT)
                here.source[c] = reals_fma(reals_max(reals_line(emit[2 * c], emit[2 * c + 1], x), zero), reals_all(weight),
                                           here.source[c]);
        }
        if (features & FEATURE_SURFACE) {
            reals dense = weight * reals_max(reals_line(surface[0], surface[1], x), zero);
            here.surface += dense;
            here.where = reals_fma(dense, at[n], here.where);
            for (int c = 0; c < 3; c++)
                here.surface_color[c] = reals_fma(dense,
                                                  reals_max(reals_line(surface[2 + 2 * c], surface[3 + 2 * c], x), zero),
                                                  here.surface_color[c]);
        }
    }
    reals sixth = share * (real)(1.0 / 6), change_sixth = change * sixth;
    for (int c = 0; c < 3; c++) {
        sum->extinction[c] = reals_fma(here.extinction[c], sixth, sum->extinction[c]);
        sum->source[c] = reals_fma(here.source[c], sixth, sum->source[c]);
        sum->surface_color[c] = reals_fma(here.surface_color[c], change_sixth, sum->surface_color[c]);
    }
    sum->surface = reals_fma(here.surface, change_sixth, sum->surface);
    sum->where = reals_fma(here.where, change_sixth, sum->where);
}

/* Adds what lies between the first knot and the last. */
ALWAYS_INLINE void add_between(const TfTables *o, const KnotsBetween *k, const LookupEnd *a, const LookupEnd *b,
                               unsigned features, Integrals *sum)
{
    FOR_LANES(i, mask_bits(k->apart & (ints)(k->first != k->last))) {
        bool up = k->rising[i];
        const VolTfIntegral *from = &o->at_knot[up ? k->first[i] : k->last[i]];
        const VolTfIntegral *to = &o->at_knot[up ? k->last[i] : k->first[i]];
        double way = (double)b->v[i] - (double)a->v[i], per = 1 / fabs(way);
        for (int c = 0; c < (features & FEATURE_COLOURED ? 3 : 1); c++)
            sum->extinction[c][i] += (real)((to->particle[c] - from->particle[c]) * per);
        for (int c = 0; c < 3; c++)
            sum->source[c][i] += (real)((to->source[c] - from->source[c]) * per);
        if (features & FEATURE_SURFACE) {
            double surface = to->surface - from->surface;
            sum->surface[i] += (real)surface;
            sum->where[i] += (real)((to->value - from->value - surface * (double)a->v[i]) / way);
            for (int c = 0; c < 3; c++)
                sum->surface_color[c][i] += (real)(to->surface_color[c] - from->surface_color[c]);
        }
    }
}

ALWAYS_INLINE void look_up_integrals(const VolPrepared *prepared, const LookupEnd *a, const LookupEnd *b, reals length,
                                     ints mask, unsigned features, SegmentParts *out)
{
    const TfTables *o = PREPARED_TABLES(prepared);
    const reals zero = reals_all(0), one = reals_all(1), half = reals_all((real)0.5);
    reals change = reals_abs(b->v - a->v);
    ints apart = mask & (ints)(a->interval != b->interval);
    Integrals sum;
    memset(&sum, 0, sizeof sum);
    StretchEnd front = {a->v, zero, zero}, back = {b->v, zero, one};
    if (!any(apart)) {
        add_stretch(o, a->interval, &front, &back, change, features, &sum);
    } else {
        KnotsBetween k;
        find_knots(o, a, b, apart, 0, &k);
        reals some = reals_select(apart, change, one);
        StretchEnd first = {reals_select(apart, k.v[0], b->v), reals_select(apart, k.v_rest[0], zero),
                            reals_select(apart, k.front / some, one)};
        StretchEnd last = {k.v[1], k.v_rest[1], reals_select(apart, one - k.back / some, one)};
        add_stretch(o, a->interval, &front, &first, change, features, &sum);
        add_stretch(o, b->interval, &last, &back, change, features, &sum);
        add_between(o, &k, a, b, features, &sum);
    }
    for (int c = 0; c < (features & FEATURE_COLOURED ? 3 : 1); c++)
        out->optical_depth[c] = reals_fma(sum.extinction[c], length, sum.surface);
    for (int c = 0; c < 3; c++) {
        int channel = features & FEATURE_COLOURED ? c : 0;
        reals passed, phi = reals_phi(out->optical_depth[channel], &passed);
        out->particles_c[c] = sum.source[c] * length * phi;
        if (c == 0)
            out->particles_a = sum.extinction[0] * length * phi;
        if (features & FEATURE_SURFACE) {
            out->front_a[c] = sum.surface * phi;
            out->front_c[c] = sum.surface_color[c] * phi;
        }
    }
    if (features & FEATURE_SURFACE) {
        ints some = (ints)(sum.surface > 0);
        reals where = sum.where / reals_select(some, sum.surface, one);
        out->where = reals_select(some & (ints)(change > 0), reals_clamp(where, 0, 1), half);
    }
}

/* ---- Full tables, and what lies beyond them ---- */

/* The lanes of `mask` whose segments lie below the first knot or above the last and meet no surface.  Nothing depends on v
 * there: tables do not reach so far, and need not, since the integrals are exact. */
ALWAYS_INLINE ints look_up_beyond(const VolPrepared *prepared, const LookupEnd *a, const LookupEnd *b, reals length,
                                  ints mask, unsigned features, SegmentParts *out)
{
    const TfTables *o = PREPARED_TABLES(prepared);
    const reals zero = reals_all(0);
    ints end = (ints)(a->interval == 0) | (ints)(a->interval == (lane_int)o->knot_count);
    ints beyond = mask & end & (ints)(a->interval == b->interval);
    if (!any(beyond))
        return beyond;
    beyond &= (ints)(gather_reals(&o->intervals[0].has_surface, (a->interval & beyond) * INTERVAL_REALS) == 0);
    SegmentParts parts;
    memset(&parts, 0, sizeof parts);
    look_up_integrals(prepared, a, b, length, beyond, features & ~(unsigned)FEATURE_SURFACE, &parts);
    for (int c = 0; c < 3; c++) {
        reals depth = parts.optical_depth[features & FEATURE_COLOURED ? c : 0];
        out->optical_depth[c] = reals_select(beyond, depth, out->optical_depth[c]);
        out->particles_c[c] = reals_select(beyond, parts.particles_c[c], out->particles_c[c]);
        out->front_c[c] = reals_select(beyond, zero, out->front_c[c]);
        out->front_a[c] = reals_select(beyond, zero, out->front_a[c]);
        out->back_c[c] = reals_select(beyond, zero, out->back_c[c]);
        out->back_a[c] = reals_select(beyond, zero, out->back_a[c]);
    }
    out->particles_a = reals_select(beyond, parts.particles_a, out->particles_a);
    return beyond;
}

/* Segments of the scene's own step (`own`) or of any length. */
ALWAYS_INLINE void look_up_full(const VolPrepared *prepared, const LookupEnd *a, const LookupEnd *b, const Doubles *length,
                                ints own, ints mask, unsigned features, SegmentParts *out)
{
    const VolScene *scene = prepared->scene;
    const TfTables *o = PREPARED_TABLES(prepared);
    ints known = {0};
    if (o->lookup.entries)
        known = look_up_table(o, a, b, mask & own, features, (real)scene->step, out);
    else
        memset(out, 0, sizeof *out);
    if (!any(mask & ~known))
        return;
    reals lengths = reals_select(own, reals_all((real)scene->step), doubles_round(length));
    known |= look_up_beyond(prepared, a, b, lengths, mask & ~known, features, out);
    if (o->other_steps) {
        FOR_LANES(i, mask_bits(mask & own & ~known))
            look_up_one(scene, a, b, i, out);
        known |= own;
    }
    if (any(mask & ~known))
        look_up_pieces(o, a, b, lengths, mask & ~known, features, out);
}

#endif
