/* What the transfer function has where the rays are: intervals found, and the lines of their properties loaded.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    count_up_to(), intervals_of(), intervals_around(), intervals_visible(); Properties, load_properties(),
 *             load_interval(), property_at(); particles_at(), range_shows(); channels_of() */
#ifndef VOL_TRACE_PROPERTIES_TMPL_H
#define VOL_TRACE_PROPERTIES_TMPL_H

#include "simd/reals.h"
#include "trace/tf_tables_tmpl.h"

/* ---- Searching the transfer function ---- */

/* How many of n ascending numbers are <= v (or < v, where `below`). */
ALWAYS_INLINE ints count_up_to(const real *sorted, size_t n, reals v, bool below)
{
    ints found = {0};
    if (n <= FEW_KNOTS) {
        for (size_t k = 0; k < n; k++)
            found -= below ? (ints)(v > sorted[k]) : (ints)(v >= sorted[k]);
        return found;
    }
    for (int i = 0; i < LANES; i++) {
        size_t lo = 0, hi = n;
        while (lo < hi) {
            size_t mid = (lo + hi) / 2;
            if (below ? sorted[mid] < v[i] : sorted[mid] <= v[i])
                lo = mid + 1;
            else
                hi = mid;
        }
        found[i] = (lane_int)lo;
    }
    return found;
}

/* The intervals that hold v: how many knots are <= v. */
ALWAYS_INLINE ints intervals_of(const TfTables *o, reals v)
{
    if (o->knot_count <= FEW_KNOTS)
        return count_up_to(o->edges + 1, o->knot_count, v, false);
    reals place = reals_clamp((v - o->bucket_lo) * o->bucket_scale, 0, KNOT_BUCKETS - 1);
    ints j = gather_ints(o->buckets, __builtin_convertvector(place, ints));
    for (int steps = o->bucket_steps; steps > 0; steps--) {
        /* Beside a hole v may be infinite: nothing is above the last edge. */
        ints above = (ints)(gather_reals(o->edges + 1, j) <= v) & (ints)(j < (lane_int)o->knot_count);
        j -= above;
        if (steps > 1 && !any(above))
            break;
    }
    return j;
}

/* Both ends' of a range. */
ALWAYS_INLINE void intervals_around(const TfTables *o, reals lo, reals hi, ints *low, ints *high)
{
    if (o->knot_count > FEW_KNOTS) {
        *low = intervals_of(o, lo);
        *high = intervals_of(o, hi);
        return;
    }
    ints a = {0}, b = {0};
    for (size_t k = 1; k <= o->knot_count; k++) {
        reals knot = reals_all(o->edges[k]);
        a -= (ints)(lo >= knot);
        b -= (ints)(hi >= knot);
    }
    *low = a;
    *high = b;
}

/* Per interval: whether anything is in it. */
ALWAYS_INLINE ints intervals_visible(const TfTables *o, ints j) { return (ints)(gather_ints(o->next_visible, j) == j); }

/* ---- Properties ---- */

/* How many channels extinction has in a kernel with these terms. */
ALWAYS_INLINE int channels_of(unsigned features) { return features & FEATURE_COLOURED ? 3 : 1; }

/* What an interval has, [..][0] + [..][1] x, x = v - ref. */
typedef struct Properties {
    reals ref, extinction[3][2], has_surface;
    reals scatter[2], scatter_color[3][2], emit[3][2], surfaceness[2], surface[2], surface_color[3][2];
} Properties;

ALWAYS_INLINE ints next_visible_of(const TfTables *o, ints interval)
{
    return few_intervals(o) ? pick_ints(o->few.next_visible, interval) : gather_ints(o->next_visible, interval);
}

/* Four numbers of each lane's interval, from number `at` on. */
ALWAYS_INLINE void load_interval(const TfTables *o, ints interval, int at, reals out[4])
{
    if (few_intervals(o))
        for (int n = 0; n < 4; n++)
            out[n] = pick_reals(o->few.numbers[at + n], interval);
    else
        load_quads(&o->intervals[0].ref + at, interval * INTERVAL_REALS, out);
}

ALWAYS_INLINE void load_group(const TfTables *o, ints interval, bool same, lane_int first, int at, reals out[4])
{
    if (!same)
        load_interval(o, interval, at, out);
    else
        for (int n = 0; n < 4; n++)
            out[n] = reals_all((&o->intervals[first].ref)[at + n]);
}

ALWAYS_INLINE void take_lines(const reals g[4], reals a[2], reals b[2])
{
    a[0] = g[0], a[1] = g[1], b[0] = g[2], b[1] = g[3];
}

ALWAYS_INLINE reals property_at(const reals line[2], reals x) { return reals_fma(line[1], x, line[0]); }

/* For the lanes of `mask`; the others may get another lane's. */
ALWAYS_INLINE void load_properties(const TfTables *o, ints interval, ints mask, unsigned features, Properties *out)
{
    lane_int first = 0;
    bool same = false;
    if (!few_intervals(o)) {
        first = interval[__builtin_ctz(mask_bits(mask))];
        same = !any(mask & (ints)(interval != first));
    }
    reals g[4];
#define GROUP(at) load_group(o, interval, same, first, at, g)
    GROUP(AT_PARTICLES);
    out->ref = g[0], out->extinction[0][0] = g[1], out->extinction[0][1] = g[2], out->has_surface = g[3];
    GROUP(AT_SCATTER);
    take_lines(g, out->scatter, out->scatter_color[0]);
    GROUP(AT_SCATTER + 4);
    take_lines(g, out->scatter_color[1], out->scatter_color[2]);
    if (features & (FEATURE_EMIT | FEATURE_CLASSIC)) {
        GROUP(AT_EMIT);
        take_lines(g, out->emit[0], out->emit[1]);
        GROUP(AT_EMIT + 4);
        take_lines(g, out->emit[2], out->surfaceness);
    }
    if (features & FEATURE_SURFACE) {
        GROUP(AT_SURFACE);
        take_lines(g, out->surface, out->surface_color[0]);
        GROUP(AT_SURFACE + 4);
        take_lines(g, out->surface_color[1], out->surface_color[2]);
    }
    if (features & FEATURE_COLOURED) {
        GROUP(AT_REST);
        take_lines(g, out->extinction[1], out->extinction[2]);
    }
#undef GROUP
}

/* Whether there are particles where the field is v, in that interval: what can be seen of a single value. */
static inline ints particles_at(const TfTables *o, ints interval, reals v, unsigned features)
{
    reals in[4], g[4];
    load_interval(o, interval, AT_PARTICLES, in);
    reals x = v - in[0];
    ints some = (ints)(reals_line(in[1], in[2], x) > 0);
    if (features & FEATURE_COLOURED) {
        load_interval(o, interval, AT_REST, g);
        some |= (ints)(reals_line(g[0], g[1], x) > 0) | (ints)(reals_line(g[2], g[3], x) > 0);
    }
    if (features & FEATURE_EMIT) {
        load_interval(o, interval, AT_EMIT, g);
        some |= (ints)(reals_line(g[0], g[1], x) != 0) | (ints)(reals_line(g[2], g[3], x) != 0);
        load_interval(o, interval, AT_EMIT + 4, g);
        some |= (ints)(reals_line(g[0], g[1], x) != 0);
    }
    return some;
}

/* Whether anything can be seen of the values from lo to hi, which lie in the intervals `low` and `high`.  `touching`: of the
 * last interval they hold only its lower end, hi itself, and none of its inside. */
ALWAYS_INLINE ints range_shows(const TfTables *o, reals lo, reals hi, ints low, ints high, ints touching, unsigned features)
{
    ints first = next_visible_of(o, low), shows = (ints)(first <= high);
    ints point = (ints)(first == high) & (touching | (ints)(lo == hi));
    if (any(point))
        shows &= ~point | particles_at(o, high, hi, features);
    return shows;
}

#endif
