/* What the transfer function has where LANES rays are: the terms of the intervals that hold their values.
 * Include packet_tmpl.h first. */
#ifndef VOL_TRACE_PROPERTIES_TMPL_H
#define VOL_TRACE_PROPERTIES_TMPL_H

#include "base/fmath.h"
#include "trace/packet_tmpl.h"

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

/* Whether anything can be seen of the values from lo to hi, which lie in the intervals `low` and `high`.  They cover a
 * stretch of every interval but perhaps the last: `touching`, hi is that one's lower end and no more. */
ALWAYS_INLINE ints range_shows(const TfTables *o, reals lo, reals hi, ints low, ints high, ints touching, unsigned features)
{
    ints first = next_visible_of(o, low), shows = (ints)(first <= high);
    ints point = (ints)(first == high) & (touching | (ints)(lo == hi));
    if (any(point))
        shows &= ~point | particles_at(o, high, hi, features);
    return shows;
}

/* ---- What rays have gathered ---- */

typedef struct Sums {
    Doubles optical_depth[3], color[3], surface[3], scatter[3], emit[3], normal[3];
    ints cells;
} Sums;

/* Into the rays' results, to what may be there already. */
static inline void store_sums(const Sums *sums, const RayPacket *l)
{
    for (size_t i = 0; i < l->count; i++) {
        VolRadiance *out = &l->out[i];
        out->cells = (double)sums->cells[i];
        for (int c = 0; c < 3; c++) {
            out->color[c] += doubles_lane(&sums->color[c], (int)i);
            out->surface[c] += doubles_lane(&sums->surface[c], (int)i);
            out->scatter[c] += doubles_lane(&sums->scatter[c], (int)i);
            out->emit[c] += doubles_lane(&sums->emit[c], (int)i);
            out->normal[c] += doubles_lane(&sums->normal[c], (int)i);
            out->optical_depth[c] = c < l->tables->channels ? doubles_lane(&sums->optical_depth[c], (int)i) : 0;
        }
    }
}

/* ---- Kernels ---- */

/* One per set of terms: those that a scene is without cost nothing. */
typedef struct FeaturesKernel {
    unsigned features;
    void (*trace)(void *packet);
} FeaturesKernel;

/* The first whose terms are enough; what is shaded, and how, must be the same. */
static inline const FeaturesKernel *kernel_for(const VolScene *scene, const FeaturesKernel *kernels)
{
    unsigned features = SCENE_TABLES(scene)->features | (scene->layers || scene->trace ? FEATURE_EXTRA : 0u);
    while (features & ~kernels->features || (features ^ kernels->features) & (FEATURE_SHADED | FEATURE_CLASSIC))
        kernels++;
    return kernels;
}

static inline double mean_transmittance(const double optical_depth[3], int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; c++)
        sum += vol_exp(-optical_depth[c]);
    return sum / channels;
}

#endif
