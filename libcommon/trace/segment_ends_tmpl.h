/* The ends of LANES segments, what the transfer function has there and between them, and what segments are found to add.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    LookupEnd, SegmentParts, find_end(), something_between() */
#ifndef VOL_TRACE_SEGMENT_ENDS_TMPL_H
#define VOL_TRACE_SEGMENT_ENDS_TMPL_H

#include "trace/properties_tmpl.h"
#include "tf/preint.h"

/* One end of each lane's segment. */
typedef struct LookupEnd {
    reals v;
    ints interval;
    reals extinction, surface; /* there; of the first channel */
    ints node;                 /* the bin that v lies in; how far beyond its lower node, in [0, 1], */
    reals x, rest;             /* and before its upper one: 1 - x, small ones not rounded away */
} LookupEnd;

/* Opacities and premultiplied colours, as in VolPreintSegment.  Integrals: all surfaces stand in the first group. */
typedef struct SegmentParts {
    reals optical_depth[3];
    reals front_c[3], front_a[3], back_c[3], back_a[3];
    reals particles_c[3], particles_a;
    reals where; /* integrals: the place of the surface that stands for all, 0 at the front, 1 at the back */
} SegmentParts;

/* ---- Ends ---- */

/* Extinction at v in its interval. */
ALWAYS_INLINE void find_extinction(const TfTables *o, unsigned features, LookupEnd *e)
{
    reals group[4], zero = reals_all(0);
    load_interval(o, e->interval, AT_PARTICLES, group);
    reals x = e->v - group[0];
    e->extinction = reals_max(reals_line(group[1], group[2], x), zero);
    if (features & FEATURE_SURFACE) {
        load_interval(o, e->interval, AT_SURFACE, group);
        e->surface = reals_max(reals_line(group[0], group[1], x), zero);
    }
}

ALWAYS_INLINE void find_place(const Lookup *t, reals v, LookupEnd *out)
{
    reals product = v * t->scale;
    reals low = reals_fma(v, reals_all(t->scale_rest), reals_fma(v, reals_all(t->scale), -product) + t->offset_low);
    reals place = reals_clamp(((product + t->offset) + t->offset_rest) + low, 0, (real)(t->nodes - 2));
    out->node = __builtin_convertvector(place, ints);
    reals whole = __builtin_convertvector(out->node, reals) - t->offset;
    reals high = (product - whole) + t->offset_rest;
    out->x = reals_clamp(high + low, 0, 1);
    out->rest = reals_clamp((1 - high) - low, 0, 1);
}

/* `table`: the ends' places in it are wanted too. */
ALWAYS_INLINE void find_end(const TfTables *o, reals v, bool table, unsigned features, LookupEnd *out)
{
    out->v = v;
    out->interval = intervals_of(o, v);
    find_extinction(o, features, out);
    if (table)
        find_place(&o->lookup, v, out);
}

/* Whether the transfer function shows anything between the ends: the rule for bricks (vol_tf_range_visible), so that leaving
 * out an invisible brick never leaves out a segment that would have added something. */
ALWAYS_INLINE ints something_between(const TfTables *o, const LookupEnd *a, const LookupEnd *b, unsigned features)
{
    ints rising = (ints)(a->interval < b->interval), touching = {0};
    ints low = ints_select(rising, a->interval, b->interval), high = ints_select(rising, b->interval, a->interval);
    reals lo = reals_min(a->v, b->v), hi = reals_max(a->v, b->v);
    ints perhaps = (ints)(low < high) & (ints)(next_visible_of(o, low) == high);
    if (any(perhaps)) {
        reals knot[4];
        load_quads(&o->knots[0].v, ((high - 1) & perhaps) * KNOT_REALS, knot);
        touching = perhaps & (ints)(hi == knot[0]) & (ints)(knot[1] == 0);
    }
    return range_shows(o, lo, hi, low, high, touching, features);
}

#endif
