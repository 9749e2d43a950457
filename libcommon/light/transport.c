#include "light/transport.h"

#include "tf/attenuation.h"

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

VolStatus vol_transport_of(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err)
{
    VolStatus status = vol_tf_compiled_copy(tf, out, err);
    if (status)
        return status;
    out->has_scatter = out->has_absorb = out->has_emit = out->coloured = false;
    out->max_emit = 0;
    for (size_t i = 0; i <= out->knot_count; i++) {
        VolTfInterval *in = &out->intervals[i];
        set_interval(out, in);
        out->visible_before[i + 1] = out->visible_before[i] + (in->has_absorb || in->has_surface);
    }
    return VOL_OK;
}
