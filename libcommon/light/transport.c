#include "light/transport.h"

#include <string.h>

static bool is_nothing(VolLinear line) { return line.a == 0 && line.b == 0; }

static bool is_same(VolLinear a, VolLinear b) { return a.a == b.a && a.b == b.b; }

static void set_interval(VolTfCompiled *tf, VolTfInterval *in)
{
    in->scatter = (VolLinear){0, 0};
    in->has_scatter = in->has_absorb = in->has_emit = false;
    for (int c = 0; c < 3; c++) {
        in->absorb[c] = in->transport[c];
        in->emit[c] = (VolLinear){0, 0};
        in->has_absorb = in->has_absorb || !is_nothing(in->absorb[c]);
        tf->coloured = tf->coloured || !is_same(in->absorb[c], in->absorb[0]);
    }
    tf->has_absorb = tf->has_absorb || in->has_absorb;
}

static void *copy_of(const void *from, size_t count, size_t size, bool *enough)
{
    void *to = vol_alloc(count, size);
    *enough = *enough && to;
    if (to && count)
        memcpy(to, from, count * size);
    return to;
}

VolStatus vol_transport_of(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err)
{
    const size_t knots = tf->knot_count;
    bool enough = true;
    *out = *tf;
    out->knots = copy_of(tf->knots, knots, sizeof *tf->knots, &enough);
    out->intervals = copy_of(tf->intervals, knots + 1, sizeof *tf->intervals, &enough);
    out->isosurfaces = copy_of(tf->isosurfaces, tf->isosurface_count, sizeof *tf->isosurfaces, &enough);
    out->visible_before = copy_of(tf->visible_before, knots + 2, sizeof *tf->visible_before, &enough);
    if (!enough)
        return vol_fail_memory(err, (knots + 1) * sizeof *tf->intervals);
    out->has_scatter = out->has_absorb = out->has_emit = out->coloured = false;
    out->max_emit = 0;
    for (size_t i = 0; i <= knots; i++) {
        VolTfInterval *in = &out->intervals[i];
        set_interval(out, in);
        out->visible_before[i + 1] = out->visible_before[i] + (in->has_absorb || in->has_surface);
    }
    return VOL_OK;
}
