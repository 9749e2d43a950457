/* A diagonal of the full table by a windowed scan.
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
 * Upwards and downwards are the two lanes of a pair.  No contraction and one order of operations: the same bits at
 * any cpu level and on any number of threads. */
#include "tf/preint_private.h"

#include <stdint.h>

/* The number of colours is a constant at every call: its loops are unrolled. */
#define INLINE static inline __attribute__((always_inline))

typedef int64_t Mask __attribute__((vector_size(16)));

static inline Pair pair(double x) { return (Pair){x, x}; }

static inline Pair choose(Mask mask, Pair yes, Pair no) { return (Pair)((mask & (Mask)yes) | (~mask & (Mask)no)); }
static inline Pair least(Pair a, Pair b) { return choose(a < b, a, b); }
static inline Pair most(Pair a, Pair b) { return choose(a > b, a, b); }
static inline Pair within(Pair x, Pair bound) { return most(least(x, bound), -bound); }

/* exp(-t), t >= 0: Cody-Waite reduction, Taylor polynomial; below 2 ulp, never 0. */
static inline Pair exp_minus(Pair t)
{
    const Pair magic = pair(0x1.8p52);
    Pair x = most(-t, pair(-708));
    Pair shifted = x * pair(0x1.71547652b82fep0) + magic, n = shifted - magic;
    Pair r = (x - n * pair(0x1.62e42feep-1)) - n * pair(0x1.a39ef35793c76p-33);
    static const double c[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0,
                               1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5};
    Pair p = pair(c[0]);
#pragma GCC unroll 12
    for (int i = 1; i < 12; i++)
        p = p * r + pair(c[i]);
    p = (r * r * p + r) + pair(1);
    return (Pair)((Mask)p + (((Mask)shifted - (Mask)magic) << 52));
}

/* Nothing is seen through 1e-100, but the products of such numbers would be denormal, which is slow. */
static inline Pair visible(Pair t) { return choose(t < pair(1e-100), pair(0), t); }

/* m_j = int_0^1 x^j e^-tx dx.  Upwards by (j m_{j-1} - e^-t) / t where t is large; where small that cancels: there
 * m_3 by its series and the others downwards. */
typedef struct Moments {
    Pair t, m0, m1, m2, m3; /* t = e^-t */
} Moments;

static inline Moments moments_of(Pair t)
{
    static const double c[] = {1.0 / (4 + 13) / 6227020800.0, 1.0 / (4 + 12) / 479001600.0, 1.0 / (4 + 11) / 39916800.0,
                               1.0 / (4 + 10) / 3628800.0, 1.0 / (4 + 9) / 362880.0, 1.0 / (4 + 8) / 40320.0,
                               1.0 / (4 + 7) / 5040.0, 1.0 / (4 + 6) / 720.0, 1.0 / (4 + 5) / 120.0, 1.0 / (4 + 4) / 24.0,
                               1.0 / (4 + 3) / 6.0, 1.0 / (4 + 2) / 2.0, 1.0 / (4 + 1), 1.0 / 4};
    Mask small = t < pair(0.5);
    Pair e = exp_minus(t), s = -least(t, pair(0.5)), p = pair(c[0]);
#pragma GCC unroll 13
    for (int i = 1; i < 14; i++)
        p = p * s + pair(c[i]);
    Pair up = pair(1) / most(t, pair(0.5));
    Pair u0 = (pair(1) - e) * up, u1 = (u0 - e) * up, u2 = (pair(2) * u1 - e) * up, u3 = (pair(3) * u2 - e) * up;
    Pair d2 = (e - s * p) * pair(1.0 / 3), d1 = (e - s * d2) * pair(0.5), d0 = e - s * d1;
    return (Moments){e, choose(small, d0, u0), choose(small, d1, u1), choose(small, d2, u2), choose(small, p, u3)};
}

INLINE void leaf(const Bin *bin, Pair h, int first, int colors, State *out)
{
    Pair tp = h * bin->particle, t = bin->surface + tp;
    Moments m = moments_of(t);
    Mask some = t > pair(1e-200);
    Pair over_t = choose(some, pair(1) / choose(some, t, pair(1)), pair(0)), slope = pair(12) * over_t;

    /* The slopes' limit keeps what surfaces and particles show in proportion to what they hide. */
    Pair mixed = slope * (h * bin->mixed), f = within(mixed, pair(2) * least(bin->surface, tp));
    Pair limited = choose(mixed != f, f / choose(mixed != f, mixed, pair(1)), pair(1));
    Pair kappa = within(pair(6) * over_t * (bin->where_s + h * bin->where_p), pair(1));

    Pair d1 = m.m1 - pair(0.5) * m.m0, d2 = m.m2 - pair(0.5) * m.m1, d3 = m.m3 - pair(0.5) * m.m2;
    Pair w0 = m.m1 + kappa * (m.m1 - m.m2), w1 = d2 + kappa * (d2 - d3);
    Pair alpha = t * m.m0;
    out->t = visible(m.t);
    out->a0 = most(least(bin->surface * m.m0 + f * d1, alpha), pair(0));
    out->p0 = alpha - out->a0;
    out->a1 = least(most(bin->surface * w0 + f * w1, pair(0)), out->a0);
#pragma GCC unroll 3
    for (int c = 0; c < colors; c++) {
        const BinColor *color = &bin->color[first + c];
        Pair g = slope * (color->surface_on_s + h * color->surface_on_p) * limited;
        Pair q = slope * h * (color->source_on_s + h * color->source_on_p) * limited, source = h * color->source;
        g = within(g, pair(2) * color->surface);
        q = within(q, pair(2) * source);
        out->c0[c] = most(color->surface * m.m0 + g * d1, pair(0));
        out->c1[c] = least(most(color->surface * w0 + g * w1, pair(0)), out->c0[c]);
        out->q[c] = most(source * m.m0 + q * d1, pair(0));
    }
}

/* From moments in its own length to moments in bins. */
INLINE void shorten(State *s, Pair share, int colors)
{
    s->a1 *= share;
    for (int c = 0; c < colors; c++)
        s->c1[c] *= share;
}

/* a, `length` bins long, followed by b; `out` may be a or b */
INLINE void compose(const State *a, Pair length, const State *b, int colors, State *out)
{
    Pair t = a->t, a0 = a->a0 + t * b->a0, a1 = a->a1 + t * (b->a1 + length * b->a0), p0 = a->p0 + t * b->p0;
#pragma GCC unroll 3
    for (int c = 0; c < colors; c++) {
        Pair c0 = a->c0[c] + t * b->c0[c], c1 = a->c1[c] + t * (b->c1[c] + length * b->c0[c]);
        out->q[c] = a->q[c] + t * b->q[c];
        out->c0[c] = c0;
        out->c1[c] = c1;
    }
    out->t = visible(t * b->t);
    out->a0 = a0;
    out->a1 = a1;
    out->p0 = p0;
}

/* A bin, piece by piece; moments in bins. */
INLINE void bin_leaf(const Bins *bins, size_t b, Pair h, int first, int colors, State *out)
{
    size_t begin = bins->first[b], end = bins->first[b + 1];
    leaf(&bins->pieces[begin], h, first, colors, out);
    if (end == begin + 1)
        return;
    Pair length = bins->share[begin];
    State piece;
    shorten(out, length, colors);
    for (size_t i = begin + 1; i < end; i++) {
        leaf(&bins->pieces[i], h, first, colors, &piece);
        shorten(&piece, bins->share[i], colors);
        compose(out, length, &piece, colors, out);
        length += bins->share[i];
    }
}

/* Where the entries of a diagonal go: window i is entry `i` upwards, and the i-th from the end downwards. */
typedef struct Row {
    float *rising, *falling;
    size_t floats, channels, channel;
    Pair over_k;
} Row;

static inline void put_opacity(const Row *row, float *entry, double all, double back, double particles)
{
    float *to = entry + row->channel;
    to[0] = (float)(all - back);
    to[row->channels] = (float)back;
    to[2 * row->channels] = (float)particles;
}

static inline void put_color(const Row *row, float *entry, size_t color, double all, double back, double particles)
{
    float *to = entry + 3 * row->channels + color;
    to[0] = (float)(all - back);
    to[3] = (float)back;
    to[6] = (float)particles;
}

INLINE void put(const Row *row, size_t i, size_t last, const State *s, int first, int colors)
{
    float *up = row->rising + i * row->floats, *down = row->falling + (last - i) * row->floats;
    Pair back = least(s->a1 * row->over_k, s->a0);
    put_opacity(row, up, s->a0[0], back[0], s->p0[0]);
    put_opacity(row, down, s->a0[1], back[1], s->p0[1]);
#pragma GCC unroll 3
    for (int c = 0; c < colors; c++) {
        back = least(s->c1[c] * row->over_k, s->c0[c]);
        put_color(row, up, (size_t)(first + c), s->c0[c][0], back[0], s->q[c][0]);
        put_color(row, down, (size_t)(first + c), s->c0[c][1], back[1], s->q[c][1]);
    }
}

INLINE void scan(const Row *row, const Bins *bins, size_t bin_count, size_t k, double h, int first, int colors,
                 State *leaves, State *suffix)
{
    for (size_t b = 0; b < bin_count; b++)
        bin_leaf(bins, b, pair(h), first, colors, &leaves[b]);
    size_t last = bin_count - k;
    for (size_t block = 0; block <= last; block += k) {
        suffix[k - 1] = leaves[block + k - 1];
        for (size_t i = k - 1; i-- > 0;)
            compose(&leaves[block + i], pair(1), &suffix[i + 1], colors, &suffix[i]);
        put(row, block, last, &suffix[0], first, colors);

        State prefix = leaves[0], window;
        size_t end = block + k <= last ? block + k : last + 1;
        for (size_t i = block + 1; i < end; i++) {
            size_t ahead = i - block; /* bins of the window that lie in the next block */
            if (ahead == 1)
                prefix = leaves[block + k];
            else
                compose(&prefix, pair((double)(ahead - 1)), &leaves[i + k - 1], colors, &prefix);
            compose(&suffix[ahead], pair((double)(k - ahead)), &prefix, colors, &window);
            put(row, i, last, &window, first, colors);
        }
    }
}

void vol_preint_diagonal(const VolPreint *tables, const VolPreintTable *table, const Bins *bins, size_t k, int channel,
                         State *leaves, State *suffix)
{
    Row row = {.rising = vol_preint_entry(tables, table, 0, k), .falling = vol_preint_entry(tables, table, k, 0),
               .floats = tables->floats, .channels = (size_t)tables->channels, .channel = (size_t)channel,
               .over_k = pair(1 / (double)k)};
    double h = table->step / (double)k;
    if (tables->channels == 1)
        scan(&row, bins, tables->n - 1, k, h, 0, 3, leaves, suffix);
    else
        scan(&row, bins, tables->n - 1, k, h, channel, 1, leaves, suffix);
}
