#include "tf/attenuation.h"

#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "base/mem.h"

static void *copy_of(const void *from, size_t count, size_t size, bool *enough)
{
    void *to = vol_alloc(count, size);
    *enough = *enough && to;
    if (to && count)
        memcpy(to, from, count * size);
    return to;
}

static void make_black(VolTfInterval *in)
{
    for (int c = 0; c < 3; c++)
        in->scatter_color[c] = in->surface_color[c] = in->emit[c] = (VolLinear){0, 0};
    in->surfaceness = (VolLinear){1, 0};
    in->has_emit = false;
}

VolStatus vol_tf_compiled_copy(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err)
{
    const size_t knots = tf->knot_count;
    bool enough = true;
    *out = *tf;
    out->knots = copy_of(tf->knots, knots, sizeof *tf->knots, &enough);
    out->intervals = copy_of(tf->intervals, knots + 1, sizeof *tf->intervals, &enough);
    out->isosurfaces = copy_of(tf->isosurfaces, tf->isosurface_count, sizeof *tf->isosurfaces, &enough);
    out->visible_before = copy_of(tf->visible_before, knots + 2, sizeof *tf->visible_before, &enough);
    if (enough)
        return VOL_OK;
    vol_tf_compiled_free(out);
    return vol_fail_memory(err, (knots + 1) * sizeof *tf->intervals);
}

VolStatus vol_tf_attenuation_of(const VolTfCompiled *tf, VolTfCompiled *out, VolError *err)
{
    VolStatus status = vol_tf_compiled_copy(tf, out, err);
    if (status)
        return status;
    out->model = VOL_MODEL_UNSHADED;
    out->surfaceness_by_gradient = out->has_emit = false;
    out->max_color = out->max_emit = 0;
    for (size_t i = 0; i <= out->knot_count; i++) {
        VolTfInterval *in = &out->intervals[i];
        make_black(in);
        out->visible_before[i + 1] = out->visible_before[i] + (in->has_scatter || in->has_absorb || in->has_surface);
    }
    for (size_t i = 0; i < out->isosurface_count; i++)
        memset(out->isosurfaces[i].color, 0, sizeof out->isosurfaces[i].color);
    return VOL_OK;
}

static void add_reals(VolHash *hash, const double *numbers, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        double number = numbers[i] + 0.0; /* -0 is 0 */
        vol_hash_add(hash, &number, sizeof number);
    }
}

static VolStatus add_list(VolHash *hash, const VolTf *tf, VolTfList list, VolError *err)
{
    VolTfExtinctionNode *nodes = NULL;
    size_t count = 0;
    VolStatus status = vol_tf_extinction_nodes(tf, list, &nodes, &count, err);
    if (status)
        return status;
    const double head[2] = {list, (double)count};
    add_reals(hash, head, 2);
    for (size_t i = 0; i < count; i++) {
        add_reals(hash, &nodes[i].v, 1);
        add_reals(hash, nodes[i].extinction, 3);
    }
    free(nodes);
    return VOL_OK;
}

VolStatus vol_tf_attenuation_hash(const VolTf *tf, uint64_t out[2], VolError *err)
{
    static const VolTfList lists[] = {VOL_TF_SCATTER, VOL_TF_ABSORB, VOL_TF_TRANSPORT, VOL_TF_SURFACE};
    VolHash hash;
    VolStatus status = VOL_OK;
    vol_hash_begin(&hash);
    size_t count = tf->model == VOL_MODEL_CLASSIC ? 3 : 4; /* the classic model has no surfaces of their own */
    for (size_t i = 0; i < count && !status; i++)
        status = add_list(&hash, tf, lists[i], err);
    for (size_t i = 0; i < tf->isosurface_count && !status; i++) {
        const double one[2] = {tf->isosurfaces[i].value, tf->isosurfaces[i].opacity};
        if (one[1] > 0)
            add_reals(&hash, one, 2);
    }
    vol_hash_end(&hash, out);
    return status;
}
