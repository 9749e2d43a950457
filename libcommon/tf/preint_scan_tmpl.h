/* A diagonal of the full table by a windowed scan, compiled once per cpu level.
 *
 * Entry (i, j), k = |j - i|: the value runs from node i to node j over the step, through k bins, each taking h =
 * step / k.  All entries of one k are made of the same leaves, n - 1 bins run through in h, by the composition of
 * segments
 *
 *     T = Ta Tb    A0 = a.A0 + Ta b.A0    A1 = a.A1 + Ta (b.A1 + La b.A0)    L = La + Lb       (colours likewise)
 *
 * where A0 is surfaces' opacity, A1 its first moment about the front, so that Y 22's back weight is A1 / L and the
 * front weight the rest.  Composition is associative, but cannot be undone: dividing by the transmittance of what
 * leaves the window loses all digits where it is small.  Van Herk and Gil-Werman's way needs no division: the leaves
 * are cut into blocks of k; a window is the end of one block (a suffix, scanned from the right) followed by the
 * beginning of the next (a prefix, scanned from the left).  Three compositions per entry, O(n^2) for the table.
 *
 * A leaf is good to fourth order where the properties are linear, second at worst; where a whole step is spent on
 * few bins these are cut at knots.  Over optical depth, x = tau / t in [0, 1], what surfaces contribute, f = ds /
 * dtau, is taken as linear with the exact mean and first moment,
 *     int f e^-tau dtau = S m0 + F (m1 - m0/2),     m_j = int x^j e^-tx dx,     F = 12 (int x ds - S/2),
 * the slope limited so that f lies in [0, 1]; particles are the rest, so that opacities add up exactly; colours
 * likewise.  The position is w = x + kappa x (1 - x), kappa from its mean.
 *
 * Upwards and downwards lie side by side.  Leaves are made for two bins at once, a quantity a vector; composing takes two
 * quantities of one state at once, all sharing one transmittance.  No lane depends on another, and nothing is fused or
 * contracted: the same bits at any cpu level and on any number of threads. */
#ifndef VOL_TF_PREINT_SCAN_TMPL_H
#define VOL_TF_PREINT_SCAN_TMPL_H

#include "tf/preint_private.h"

#include <string.h>

typedef float Floats __attribute__((vector_size(16)));

/* Nothing is seen through 1e-100, but the products of such numbers would be denormal, which is slow. */
ALWAYS_INLINE reals visible(reals t) { return reals_select(reals_below(t, reals_all(1e-100)), reals_all(0), t); }

/* m_j = int_0^1 x^j e^-tx dx.  Upwards by (j m_{j-1} - e^-t) / t where t is large; where small that cancels: there
 * m_3 by its series and the others downwards. */
typedef struct Moments {
    reals t, m0, m1, m2, m3; /* t = e^-t */
} Moments;

ALWAYS_INLINE Moments moments_of(reals t)
{
    static const double c[] = {1.0 / (4 + 13) / 6227020800.0, 1.0 / (4 + 12) / 479001600.0, 1.0 / (4 + 11) / 39916800.0,
                               1.0 / (4 + 10) / 3628800.0, 1.0 / (4 + 9) / 362880.0, 1.0 / (4 + 8) / 40320.0,
                               1.0 / (4 + 7) / 5040.0, 1.0 / (4 + 6) / 720.0, 1.0 / (4 + 5) / 120.0, 1.0 / (4 + 4) / 24.0,
                               1.0 / (4 + 3) / 6.0, 1.0 / (4 + 2) / 2.0, 1.0 / (4 + 1), 1.0 / 4};
    ints small = reals_below(t, reals_all(0.5));
    reals e = reals_exp_unfused(t), s = -reals_min(t, reals_all(0.5)), p = reals_all(c[0]);
#pragma GCC unroll 13
    for (int i = 1; i < 14; i++)
        p = p * s + reals_all(c[i]);
    reals up = reals_all(1) / reals_max(t, reals_all(0.5));
    reals u0 = (reals_all(1) - e) * up, u1 = (u0 - e) * up, u2 = (reals_all(2) * u1 - e) * up,
        u3 = (reals_all(3) * u2 - e) * up;
    reals d2 = (e - s * p) * reals_all(1.0 / 3), d1 = (e - s * d2) * reals_all(0.5), d0 = e - s * d1;
    return (Moments){e, reals_select(small, d0, u0), reals_select(small, d1, u1), reals_select(small, d2, u2),
                     reals_select(small, p, u3)};
}

/* Of a couple of bins; not a state yet: one quantity a vector. */
typedef struct Leaf {
    reals t;
    Light light[4];
} Leaf;

/* `colors` is a constant at every call: its loops are unrolled, here and below. */
ALWAYS_INLINE void leaf(const Bin *bin, reals h, const Moments *moments, int first, int colors, Leaf *out)
{
    const Moments m = *moments;
    reals tp = h * bin->particle, t = bin->surface + tp;
    ints some = reals_below(reals_all(1e-200), t);
    reals over_t = reals_select(some, reals_all(1) / reals_select(some, t, reals_all(1)), reals_all(0)),
        slope = reals_all(12) * over_t;

    /* The slopes' limit keeps what surfaces and particles show in proportion to what they hide. */
    reals mixed = slope * (h * bin->mixed), f = reals_within(mixed, reals_all(2) * reals_min(bin->surface, tp));
    ints beyond = reals_below(f, mixed) | reals_below(mixed, f);
    reals limited = reals_all(1);
    if (any(beyond))
        limited = reals_select(beyond, f / reals_select(beyond, mixed, reals_all(1)), limited);
    reals kappa = reals_within(reals_all(6) * over_t * (bin->where_s + h * bin->where_p), reals_all(1));

    reals d1 = m.m1 - reals_all(0.5) * m.m0, d2 = m.m2 - reals_all(0.5) * m.m1, d3 = m.m3 - reals_all(0.5) * m.m2;
    reals w0 = m.m1 + kappa * (m.m1 - m.m2), w1 = d2 + kappa * (d2 - d3);
    reals alpha = t * m.m0, surface = reals_max(reals_min(bin->surface * m.m0 + f * d1, alpha), reals_all(0));
    out->t = visible(m.t);
    out->light[0] = (Light){surface, reals_min(reals_max(bin->surface * w0 + f * w1, reals_all(0)), surface),
                            alpha - surface};
#pragma GCC unroll 3
    for (int c = 0; c < colors; c++) {
        const BinColor *color = &bin->color[first + c];
        reals g = slope * (color->surface_on_s + h * color->surface_on_p) * limited;
        reals q = slope * h * (color->source_on_s + h * color->source_on_p) * limited, source = h * color->source;
        g = reals_within(g, reals_all(2) * color->surface);
        q = reals_within(q, reals_all(2) * source);
        surface = reals_max(color->surface * m.m0 + g * d1, reals_all(0));
        out->light[1 + c] = (Light){surface, reals_min(reals_max(color->surface * w0 + g * w1, reals_all(0)), surface),
                                    reals_max(source * m.m0 + q * d1, reals_all(0))};
    }
}

/* a, `length` bins long, and b seen through its transmittance t */
ALWAYS_INLINE Light seen_through(const Light *a, reals t, reals length, const Light *b)
{
    return (Light){a->all + t * b->all, a->moment + t * (b->moment + length * b->all), a->particles + t * b->particles};
}

/* a, `length` bins long, followed by b; `out` may be a or b */
ALWAYS_INLINE void compose(const State *a, reals length, const State *b, int lights, State *out)
{
    reals t = a->t;
#pragma GCC unroll 2
    for (int l = 0; l < lights; l++)
        out->light[l] = seen_through(&a->light[l], t, length, &b->light[l]);
    out->t = visible(t * b->t);
}

/* One more piece of a couple: what lies before it, `length` bins long, becomes part of it; its moments, in its own
 * length so far, are in bins from here on. */
ALWAYS_INLINE void append(Leaf *before, reals *length, reals share, int colors, Leaf *piece)
{
    for (int i = 0; i <= colors; i++) {
        piece->light[i].moment *= share;
        piece->light[i] = seen_through(&before->light[i], before->t, *length, &piece->light[i]);
    }
    piece->t = visible(before->t * piece->t);
    *length += share;
    *before = *piece;
}

/* The bins of a couple part, quantities come together. */
ALWAYS_INLINE void states_of(const Leaf *couple, int lights, State states[2])
{
#pragma GCC unroll 2
    for (int i = 0; i < 2; i++) {
        states[i].t = reals_halves(couple->t, couple->t, i);
#pragma GCC unroll 2
        for (int l = 0; l < lights; l++) {
            const Light *a = &couple->light[2 * l], *b = a + 1;
            states[i].light[l] = (Light){reals_halves(a->all, b->all, i), reals_halves(a->moment, b->moment, i),
                                         reals_halves(a->particles, b->particles, i)};
        }
    }
}

/* Polynomials wait for their last term most of the time: the moments of some pieces first, then what is made of them. */
ALWAYS_INLINE void make_leaves(const Bins *bins, size_t couples, reals h, int first, int colors, State *leaves)
{
    enum { SOME = 16 };
    Moments moments[SOME];
    for (size_t couple = 0, p = 0; couple < couples; couple++) {
        Leaf all, before;
        reals length = reals_all(0);
        size_t end = bins->first[couple + 1];
        bool cut = end > p + 1;
        if (cut)
            before = (Leaf){.t = reals_all(1)};
        for (; p < end; p++) {
            if (p % SOME == 0)
                for (size_t i = p; i < p + SOME && i < bins->first[couples]; i++)
                    moments[i - p] = moments_of(bins->pieces[i].surface + h * bins->pieces[i].particle);
            leaf(&bins->pieces[p], h, &moments[p % SOME], first, colors, &all);
            if (cut)
                append(&before, &length, bins->share[p], colors, &all);
        }
        states_of(&all, (1 + colors) / 2, &leaves[2 * couple]);
    }
}

/* Where the entries of a diagonal go: window i is entry `i` upwards, and the i-th from the end downwards. */
typedef struct Row {
    float *rising, *falling;
    size_t floats, channel; /* of attenuation */
    reals over_k;
} Row;

/* What an entry holds of one light: in front, at the back, of particles. */
typedef struct Entry {
    Floats front, back, particles;
} Entry;

ALWAYS_INLINE Entry entry_of(const Light *light, reals over_k)
{
    reals back = reals_min(light->moment * over_k, light->all);
    return (Entry){__builtin_convertvector(light->all - back, Floats), __builtin_convertvector(back, Floats),
                   __builtin_convertvector(light->particles, Floats)};
}

/* Grey: each of opacity, R, G, B. */
ALWAYS_INLINE void put_grey(float *to, Floats front, Floats back, Floats particles)
{
    Floats opacity = __builtin_shufflevector(front, back, 0, 4, 1, 1);
    Floats out[3] = {__builtin_shufflevector(opacity, particles, 0, 1, 4, 2),
                     __builtin_shufflevector(front, back, 2, 3, 5, 6),
                     __builtin_shufflevector(back, particles, 3, 5, 6, 7)};
    memcpy(to, out, sizeof out);
}

/* One of three channels: opacity and colour, upwards (way 0) or downwards (1). */
ALWAYS_INLINE void put_channel(float *to, const Entry *e, int way)
{
    to[0] = e->front[way];
    to[3] = e->back[way];
    to[6] = e->particles[way];
    to[9] = e->front[2 + way];
    to[12] = e->back[2 + way];
    to[15] = e->particles[2 + way];
}

ALWAYS_INLINE void put(const Row *row, size_t i, size_t last, const State *s, int lights)
{
    float *up = row->rising + i * row->floats, *down = row->falling + (last - i) * row->floats;
    Entry a = entry_of(&s->light[0], row->over_k);
    if (lights == 1) {
        put_channel(up + row->channel, &a, 0);
        put_channel(down + row->channel, &a, 1);
        return;
    }
    Entry b = entry_of(&s->light[1], row->over_k);
#define WAY(field, i) __builtin_shufflevector(a.field, b.field, i, i + 2, i + 4, i + 6)
    put_grey(up, WAY(front, 0), WAY(back, 0), WAY(particles, 0));
    put_grey(down, WAY(front, 1), WAY(back, 1), WAY(particles, 1));
#undef WAY
}

ALWAYS_INLINE void scan(const Row *row, const Bins *bins, size_t bin_count, size_t k, double h, int first, int colors,
                 State *leaves, State *suffix)
{
    const int lights = (1 + colors) / 2;
    make_leaves(bins, (bin_count + 1) / 2, reals_all(h), first, colors, leaves);
    size_t last = bin_count - k;
    for (size_t block = 0; block <= last; block += k) {
        suffix[k - 1] = leaves[block + k - 1];
        for (size_t i = k - 1; i-- > 0;)
            compose(&leaves[block + i], reals_all(1), &suffix[i + 1], lights, &suffix[i]);
        put(row, block, last, &suffix[0], lights);

        State prefix = leaves[0], window;
        size_t end = block + k <= last ? block + k : last + 1;
        for (size_t i = block + 1; i < end; i++) {
            size_t ahead = i - block; /* bins of the window that lie in the next block */
            if (ahead == 1)
                prefix = leaves[block + k];
            else
                compose(&prefix, reals_all((double)(ahead - 1)), &leaves[i + k - 1], lights, &prefix);
            compose(&suffix[ahead], reals_all((double)(k - ahead)), &prefix, lights, &window);
            put(row, i, last, &window, lights);
        }
    }
}

ALWAYS_INLINE void diagonal(const VolPreint *tables, const VolPreintTable *table, const Bins *bins, size_t k, int channel,
                     State *leaves, State *suffix)
{
    Row row = {.rising = vol_preint_entry(tables, table, 0, k), .falling = vol_preint_entry(tables, table, k, 0),
               .floats = tables->floats, .channel = (size_t)channel, .over_k = reals_all(1 / (double)k)};
    double h = table->step / (double)k;
    if (tables->channels == 1)
        scan(&row, bins, tables->n - 1, k, h, 0, 3, leaves, suffix);
    else
        scan(&row, bins, tables->n - 1, k, h, channel, 1, leaves, suffix);
}

#endif
