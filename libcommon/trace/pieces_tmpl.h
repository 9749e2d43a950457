/* What LANES segments add to the light of their rays, by the definition (as vol_preint_segment; tf/preint.h has the
 * equations): for those that no table covers.
 *
 * A segment is cut where it runs over knots.  On such a span extinction is linear in the place u, and optical depth
 * quadratic.  Spans are cut into pieces of optical depth 1 at most, and on a piece, x from 0 to 1, all that is asked for is
 * made of four integrals,
 *     m_k = int x^k exp(-(rate x + bend x^2 / 2)) dx,  k = 0 ... 3
 * since amounts, colours and the place along the segment are linear in x, and the longest product is of three of them.
 * Gauss-Legendre quadrature of the m_k is exact but for rounding.  What spans and pieces add is summed in double: a transfer
 * function of many knots costs no digits.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    look_up_pieces() */
#ifndef VOL_TRACE_PIECES_TMPL_H
#define VOL_TRACE_PIECES_TMPL_H

#include "trace/segment_ends_tmpl.h"

/* Behind that optical depth nothing is seen. */
#define PIECES_DARK (sizeof(real) == sizeof(float) ? 24 : 44)
#define PIECE_DEPTH 1 /* reals_exp_short() knows no more */
/* Amounts per segment; their squares are numbers still.  Such segments are opaque many times over. */
#define AMOUNT_MOST ((real)1e18)

/* A part of each lane's segment within one interval.  Its properties are lines [0] + [1] u, u from 0 at its front to 1 at
 * its back; amounts per unit of the segment. */
typedef struct Span {
    reals share, before, behind; /* of the segment: the span's, what is in front of it, what begins with it */
    reals extinction[3][2], scatter[2], scatter_color[3][2], emit[3][2], surface[2], surface_color[3][2];
} Span;

typedef struct PieceSums {
    Doubles depth[3], particles_a[3], particles_c[3];
    Doubles front_a[3], front_c[3], back_a[3], back_c[3];
} PieceSums;

/* ---- Spans ---- */

/* One end of a span: v + rest. */
typedef struct SpanEnd {
    reals v, rest;
} SpanEnd;

/* The segment's own end, at v, where `own`, else that knot. */
ALWAYS_INLINE SpanEnd end_of_span(const TfTables *o, reals v, ints own, ints knot)
{
    reals group[4] = {v};
    if (any(~own))
        load_quads(&o->knots[0].v, (knot & ~own) * KNOT_REALS, group);
    return (SpanEnd){reals_select(own, v, group[0]), reals_where(~own, group[1])};
}

/* From the line over the interval to that over the span, from x0 to x1. */
ALWAYS_INLINE void follow(const reals in[2], reals x0, reals x1, reals per, reals most, reals out[2])
{
    const reals zero = reals_all(0);
    out[0] = reals_min(per * reals_max(property_at(in, x0), zero), most);
    out[1] = reals_min(per * reals_max(property_at(in, x1), zero), most) - out[0];
}

ALWAYS_INLINE void follow_amounts(const Properties *in, reals x0, reals x1, reals length, reals change, unsigned features,
                                  Span *out)
{
    const reals most = reals_all(AMOUNT_MOST);
    for (int c = 0; c < channels_of(features); c++)
        follow(in->extinction[c], x0, x1, length, most, out->extinction[c]);
    follow(in->scatter, x0, x1, length, most, out->scatter);
    if (features & FEATURE_SURFACE)
        follow(in->surface, x0, x1, change, most, out->surface);
}

ALWAYS_INLINE void follow_colors(const Properties *in, reals x0, reals x1, reals length, unsigned features, Span *out)
{
    const reals one = reals_all(1), most = reals_all(INFINITY);
    for (int c = 0; c < 3; c++) {
        follow(in->scatter_color[c], x0, x1, one, most, out->scatter_color[c]);
        if (features & FEATURE_EMIT)
            follow(in->emit[c], x0, x1, length, most, out->emit[c]);
        if (features & FEATURE_SURFACE)
            follow(in->surface_color[c], x0, x1, one, most, out->surface_color[c]);
    }
}

/* What the lanes of `mask` have in that interval, on their way up or down (`rising`). */
ALWAYS_INLINE void take_span(const TfTables *o, const LookupEnd *a, const LookupEnd *b, reals length, ints interval,
                             ints rising, ints mask, unsigned features, Span *out)
{
    const reals one = reals_all(1);
    ints first = ~mask | (ints)(interval == a->interval), last = ~mask | (ints)(interval == b->interval);
    SpanEnd from = end_of_span(o, a->v, first, interval + rising), to = end_of_span(o, b->v, last, interval + ~rising);
    reals change = reals_abs(b->v - a->v), whole = reals_select((ints)(change > 0), change, one);
    out->share = reals_select(first & last, one, reals_abs((to.v - from.v) + (to.rest - from.rest)) / whole);
    out->before = reals_abs((from.v - a->v) + from.rest) / whole;
    out->behind = reals_select(first, one, reals_abs((b->v - from.v) - from.rest) / whole);
    Properties in;
    load_properties(o, interval, mask, features, &in);
    /* Other lanes add 0 times what they have: it must be a number. */
    reals x0 = reals_where(mask, (from.v - in.ref) + from.rest), x1 = reals_where(mask, (to.v - in.ref) + to.rest);
    follow_amounts(&in, x0, x1, length, change, features, out);
    follow_colors(&in, x0, x1, length, features, out);
}

/* ---- Pieces ---- */

/* The integrals m_k. */
ALWAYS_INLINE void moments_of(reals rate, reals bend, reals m[4])
{
    for (int k = 0; k < 4; k++)
        m[k] = reals_all(0);
#pragma GCC unroll 16
    for (int n = 0; n < GAUSS; n++) {
        const real x = gauss_x[n], w = gauss_w[n];
        reals passed = reals_exp_short(reals_fma(bend, reals_all((real)0.5 * x * x), rate * x));
        m[0] = reals_fma(passed, reals_all(w), m[0]);
        m[1] = reals_fma(passed, reals_all(w * x), m[1]);
        m[2] = reals_fma(passed, reals_all(w * x * x), m[2]);
        m[3] = reals_fma(passed, reals_all(w * x * x * x), m[3]);
    }
}

/* A piece from u on, d long: the span's line in x; out[k] becomes the integral of it times what m[k] is of. */
ALWAYS_INLINE void times_line(const reals line[2], reals u, reals d, const reals m[], int count, reals out[])
{
    reals front = reals_line(line[0], line[1], u), slope = line[1] * d;
    for (int k = 0; k < count; k++)
        out[k] = reals_fma(front, m[k], slope * m[k + 1]);
}

ALWAYS_INLINE void add_line(const reals line[2], reals u, reals d, const reals m[2], Doubles *sum)
{
    reals all[1];
    times_line(line, u, d, m, 1, all);
    doubles_add(sum, all[0]);
}

/* The light of the channels c0 to c1-1; m: the moments of what passes to the front of the segment. */
ALWAYS_INLINE void add_piece(const Span *sp, reals u, reals d, const reals m[4], unsigned features, int c0, int c1,
                             PieceSums *sum)
{
    reals scatter[2], surface[3], front[2], back[2];
    add_line(sp->extinction[c0], u, d, m, &sum->particles_a[c0]);
    times_line(sp->scatter, u, d, m, 2, scatter);
    for (int c = c0; c < c1; c++) {
        add_line(sp->scatter_color[c], u, d, scatter, &sum->particles_c[c]);
        if (features & FEATURE_EMIT)
            add_line(sp->emit[c], u, d, m, &sum->particles_c[c]);
    }
    if (!(features & FEATURE_SURFACE))
        return;
    const reals to_front[2] = {sp->behind, -sp->share}, to_back[2] = {sp->before, sp->share};
    times_line(sp->surface, u, d, m, 3, surface);
    times_line(to_front, u, d, surface, 2, front);
    times_line(to_back, u, d, surface, 2, back);
    doubles_add(&sum->front_a[c0], front[0]);
    doubles_add(&sum->back_a[c0], back[0]);
    for (int c = c0; c < c1; c++) {
        add_line(sp->surface_color[c], u, d, front, &sum->front_c[c]);
        add_line(sp->surface_color[c], u, d, back, &sum->back_c[c]);
    }
}

/* All of a span, for the channels c0 to c1-1, which share their extinction. */
ALWAYS_INLINE void add_span(const Span *sp, ints mask, unsigned features, int c0, int c1, PieceSums *sum)
{
    const reals zero = reals_all(0), one = reals_all(1);
    reals front = sp->extinction[c0][0], slope = sp->extinction[c0][1], u = zero, tau = doubles_round(&sum->depth[c0]);
    if (features & FEATURE_SURFACE) {
        front += sp->surface[0];
        slope += sp->surface[1];
    }
    front *= sp->share;
    slope *= sp->share;
    doubles_add(&sum->depth[c0], reals_where(mask, reals_fma(slope, reals_all((real)0.5), front)));
    for (ints left = mask & (ints)(tau < PIECES_DARK); any(left);) {
        reals rate = reals_max(reals_line(front, slope, u), zero), d = one - u, m[4];
        ints cut = left & (ints)(d * reals_fma((real)0.5 * slope, d, rate) > PIECE_DEPTH);
        if (any(cut)) {
            /* rate d + slope d^2 / 2 = PIECE_DEPTH */
            reals root = reals_sqrt(reals_max(reals_fma(rate, rate, 2 * PIECE_DEPTH * slope), zero));
            d = reals_select(cut, reals_min(2 * PIECE_DEPTH / (rate + root), d), d);
        }
        moments_of(rate * d, slope * d * d, m);
        reals weight = reals_where(left, reals_exp(-tau) * sp->share * d);
        for (int k = 0; k < 4; k++)
            m[k] *= weight;
        add_piece(sp, u, d, m, features, c0, c1, sum);
        tau += PIECE_DEPTH;
        u += d;
        left = cut & (ints)(tau < PIECES_DARK);
    }
}

/* ---- Segments ---- */

/* `channel`: of opacity. */
ALWAYS_INLINE void put_channel(const PieceSums *sum, ints mask, int c, int channel, unsigned features, SegmentParts *out)
{
    out->optical_depth[c] = reals_select(mask, doubles_round(&sum->depth[channel]), out->optical_depth[c]);
    out->particles_c[c] = reals_select(mask, doubles_round(&sum->particles_c[c]), out->particles_c[c]);
    if (!(features & FEATURE_SURFACE))
        return;
    out->front_c[c] = reals_select(mask, doubles_round(&sum->front_c[c]), out->front_c[c]);
    out->front_a[c] = reals_select(mask, doubles_round(&sum->front_a[channel]), out->front_a[c]);
    out->back_c[c] = reals_select(mask, doubles_round(&sum->back_c[c]), out->back_c[c]);
    out->back_a[c] = reals_select(mask, doubles_round(&sum->back_a[channel]), out->back_a[c]);
}

/* Replaces the lanes of `mask` in `out`.  One for all kernels: tables cover most segments, and this is long. */
static __attribute__((noinline)) void look_up_pieces(const TfTables *o, const LookupEnd *a, const LookupEnd *b, reals length,
                                                     ints mask, unsigned features, SegmentParts *out)
{
    const bool grey = !(features & FEATURE_COLOURED);
    ints interval = a->interval & mask, rising = (ints)(a->interval < b->interval);
    PieceSums sum;
    memset(&sum, 0, sizeof sum);
    for (ints left = mask; any(left);) {
        Span span;
        take_span(o, a, b, length, interval, rising, left, features, &span);
        if (grey)
            add_span(&span, left, features, 0, 3, &sum);
        for (int c = 0; c < 3 && !grey; c++)
            add_span(&span, left, features, c, c + 1, &sum);
        left &= (ints)(interval != b->interval);
        interval += left & ~(2 * rising);
    }
    for (int c = 0; c < 3; c++)
        put_channel(&sum, mask, c, grey ? 0 : c, features, out);
    out->particles_a = reals_select(mask, doubles_round(&sum.particles_a[0]), out->particles_a);
}

#endif
