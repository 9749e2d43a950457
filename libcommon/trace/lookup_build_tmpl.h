/* The tables that lookup_tmpl.h reads, made from the transfer function's; once for float, once for double.
 *
 * An entry is a group of four numbers per part: colour and opacity, of the particles, and where there are soft surfaces of
 * those seen with the shading at the front and at the back.  Entry (i, j) stands on diagonal j - i in column i, so that
 * (i, j) and (i + 1, j + 1) are neighbours, and what values that change little need lies close together. */
#ifndef VOL_TRACE_LOOKUP_BUILD_TMPL_H
#define VOL_TRACE_LOOKUP_BUILD_TMPL_H

#include <math.h>
#include <stdlib.h>

#include "base/mem.h"
#include "trace/tf_tables_tmpl.h"

/* Beyond this many bytes the band is made narrower. */
#define LOOKUP_MOST_BYTES ((size_t)64 << 20)

static void free_lookup(TfTables *o)
{
    free(o->knots);
    free(o->lookup.entries);
    free(o->lookup.reach);
}

/* The table whose step is the scene's. */
static const VolPreintTable *table_of_step(const VolPreint *preint, double step)
{
    for (size_t o = 0; o < preint->octave_count; o++)
        if (preint->octaves[o].step == step)
            return &preint->octaves[o];
    return NULL;
}

static void fill_entry(const VolPreint *preint, const VolPreintTable *table, size_t i, size_t j, int32_t parts, real *out)
{
    const float *entry = vol_preint_entry(preint, table, i, j);
    for (int32_t p = 0; p < parts; p++) {
        int32_t kind = parts == 1 ? 2 : (p + 2) % 3; /* particles, front, back: in VolPreint front, back, particles */
        for (int c = 0; c < 3; c++)
            *out++ = (real)entry[3 + 3 * kind + c];
        *out++ = (real)entry[kind];
    }
}

/* What bins with a surface too dense for them are good for, if there are any. */
static bool find_reach(const VolPreint *preint, Lookup *t)
{
    bool any = false;
    for (size_t i = 0; i < preint->n && preint->dense; i++)
        any = any || preint->dense[i];
    if (!any)
        return true;
    t->reach = vol_alloc(preint->n, sizeof *t->reach);
    for (size_t i = 0; i < preint->n && t->reach; i++)
        t->reach[i] = preint->dense[i] ? -1 : t->band - 1;
    return t->reach != NULL;
}

/* Values that float cannot tell from the outermost nodes are left out. */
static void set_places(const VolPreint *preint, Lookup *t)
{
    double scale = (double)(preint->n - 1) / (preint->hi - preint->lo), offset = -preint->lo * scale;
    t->lo = real_at_or_above(preint->lo);
    t->hi = -real_at_or_above(-preint->hi);
    t->scale = (real)scale;
    t->scale_rest = (real)real_rest(scale, t->scale);
    t->offset = (real)nearbyint(offset);
    t->offset_rest = (real)real_rest(offset, t->offset);
    t->offset_low = (real)real_rest(real_rest(offset, t->offset), t->offset_rest);
}

static VolStatus build_table(const VolPreint *preint, const VolPreintTable *table, Lookup *t, unsigned features,
                             VolError *err)
{
    size_t n = preint->n, parts = features & FEATURE_SURFACE ? 3 : 1, stride = n + 4, size = 4 * parts * sizeof(real);
    size_t most = (LOOKUP_MOST_BYTES / (stride * size) - 1) / 2, band = table->band < most ? table->band : most;
    *t = (Lookup){.parts = (int32_t)parts, .stride = (int32_t)stride, .nodes = (int32_t)n, .band = (int32_t)band};
    set_places(preint, t);
    /* One more for the neighbours of the last: loads never leave the table. */
    t->entries = vol_alloc_zero((2 * band + 1) * stride + 1, size);
    if (!t->entries || !find_reach(preint, t))
        return vol_fail_memory(err, (2 * band + 1) * stride * size);
    for (size_t k = 0; k <= band; k++)
        for (size_t i = 0; i + k < n; i++) {
            fill_entry(preint, table, i, i + k, t->parts, t->entries + ((band + k) * stride + i) * 4 * parts);
            fill_entry(preint, table, i + k, i, t->parts, t->entries + ((band - k) * stride + i + k) * 4 * parts);
        }
    return VOL_OK;
}

static double line_value(VolLinear line, double x) { return fmax(line.a + line.b * x, 0); }

static VolStatus build_knots(const VolTfCompiled *tf, TfTables *o, VolError *err)
{
    o->knots = vol_alloc(tf->knot_count + 1, sizeof *o->knots); /* never empty: may be loaded from */
    if (!o->knots)
        return vol_fail_memory(err, tf->knot_count * sizeof *o->knots);
    o->knots[tf->knot_count] = (Knot){0};
    for (size_t k = 0; k < tf->knot_count; k++) {
        Knot *knot = &o->knots[k];
        double v = tf->knots[k];
        *knot = (Knot){.v = real_at_or_above(v)};
        knot->v_rest = (real)real_rest(v, knot->v);
        for (size_t side = 0; side < 2; side++) {
            const VolTfInterval *in = &tf->intervals[k + side];
            double x = v - in->v_ref;
            knot->extinction[side] = (real)(line_value(in->scatter, x) + line_value(in->absorb[0], x));
            knot->surface[side] = (real)line_value(in->surface, x);
        }
    }
    return VOL_OK;
}

static VolStatus build_lookup(const VolScene *scene, TfTables *o, VolError *err)
{
    bool full = scene->preint && scene->preint->integrals.tf;
    const VolTfIntegrals *integrals = full ? &scene->preint->integrals : scene->integrals;
    if (!integrals || !integrals->tf)
        return VOL_OK;
    o->at_knot = integrals->at_knot;
    VolStatus status = build_knots(scene->tf, o, err);
    bool tables = full && scene->preint->octave_count && !scene->tf->coloured;
    const VolPreintTable *table = tables ? table_of_step(scene->preint, scene->step) : NULL;
    o->other_steps = tables && !table;
    if (!status && table)
        status = build_table(scene->preint, table, &o->lookup, o->features, err);
    return status;
}

#endif
