/* Where a value lies, and whether a range of values shows anything. */
#include "tf/tf.h"

size_t vol_tf_interval(const VolTfCompiled *compiled, double v)
{
    size_t below = 0, above = compiled->knot_count; /* knots[0 .. below-1] <= v < knots[above ..] */
    while (below < above) {
        size_t middle = below + (above - below) / 2;
        if (compiled->knots[middle] <= v)
            below = middle + 1;
        else
            above = middle;
    }
    return below;
}

static bool delta_within(const VolTfCompiled *compiled, double lo, double hi)
{
    size_t below = 0, above = compiled->isosurface_count;
    while (below < above) {
        size_t middle = below + (above - below) / 2;
        if (compiled->isosurfaces[middle].value < lo)
            below = middle + 1;
        else
            above = middle;
    }
    return below < compiled->isosurface_count && compiled->isosurfaces[below].value <= hi;
}

/* Particles at one value.  Inside an interval a line that is at least 0 and not 0 throughout is 0 nowhere, at its
 * beginning it may be. */
static bool particles_at(const VolTfInterval *interval, double v)
{
    if (v != interval->v_ref)
        return interval->has_scatter || interval->has_absorb || interval->has_emit;
    bool any = interval->scatter.a > 0;
    for (int c = 0; c < 3; c++)
        any |= interval->absorb[c].a > 0 || interval->emit[c].a > 0;
    return any;
}

bool vol_tf_range_visible(const VolTfCompiled *compiled, double lo, double hi)
{
    if (!(lo <= hi))
        return false;
    if (delta_within(compiled, lo, hi))
        return true;
    size_t first = vol_tf_interval(compiled, lo), last = vol_tf_interval(compiled, hi);
    const VolTfInterval *end = &compiled->intervals[last];
    /* [lo, hi] covers a stretch of every interval from the first on, but may only touch the last. */
    bool touches = lo == hi || (first < last && hi == end->v0);
    size_t stretches = touches ? last : last + 1;
    if (stretches > first && compiled->visible_before[stretches] > compiled->visible_before[first])
        return true;
    return touches && particles_at(end, hi);
}
