/* The smallest thing that rays can run through: a box of one value, BOX_VALUE, as long as each clipped ray.  It keeps the
 * contract of trace/traversal.h, and shows how little that takes. */
#ifndef TESTS_UNIT_BOX_TRAVERSAL_H
#define TESTS_UNIT_BOX_TRAVERSAL_H

#include "trace/traversal.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"

typedef struct Traversal {
    bool together;
    ints in_stretch, shows, entered;
    reals lo, hi;
    double begin[LANES], end[LANES];
} Traversal;
typedef struct CellPlace { char none; } CellPlace, SamplePlaces;
typedef struct Place { double t; bool is_end; } Place;
#define CONTRACT static inline
#define WAY const Traversal *w, const RayPacket *l

CONTRACT const double *stretch_begin(const Traversal *w) { return w->begin; }
CONTRACT const double *stretch_end(const Traversal *w) { return w->end; }
CONTRACT ints stretch_is_uniform(const Traversal *w) { return ints_all(0); }
CONTRACT void traversal_begin(Traversal *w, const RayPacket *l, bool may_wait)
{
    *w = (Traversal){.lo = reals_all(BOX_VALUE), .hi = reals_all(BOX_VALUE)};
    for (size_t i = 0; i < l->count; i++)
        w->begin[i] = l->rays[i].t0, w->end[i] = l->rays[i].t1;
}
CONTRACT bool traversal_enter_samples(Traversal *w, RayPacket *l, unsigned i)
{
    l->alive[i] = w->in_stretch[i] = w->shows[i] = ~w->entered[i];
    w->entered[i] = -1;
    return l->alive[i];
}
CONTRACT bool traversal_enter_cells(Traversal *w, RayPacket *l, unsigned i, unsigned f)
{
    return traversal_enter_samples(w, l, i);
}

/* Never asked for: the rays are not `together`. */
CONTRACT void traversal_visit_samples(Traversal *w, RayPacket *l, ints mask) {}
CONTRACT void traversal_begin_runs(WAY, ints mask, const double *t, reals last) {}

CONTRACT ints traversal_next_cells(Traversal *w, RayPacket *l, ints mask, bool bounded, unsigned f, Cell *out, CellPlace *at)
{
    const reals v = w->lo;
    *out = (Cell){.v = {.a0 = v}, .lo = v, .hi = v, .least = v, .most = v, .entry = v, .exit = v};
    for (int i = 0; i < LANES; i++)
        out->length[i] = (real)(w->end[i] - w->begin[i]);
    w->in_stretch &= ~mask;
    return mask;
}
CONTRACT void traversal_keep_cells(CellPlace *kept, ints mask, const CellPlace *from, unsigned f) {}
CONTRACT void traversal_sure_range(WAY, const CellPlace *at, reals s, ints mask, reals *lo, reals *hi) {}
CONTRACT void traversal_gradients(WAY, const CellPlace *at, ints mask, Cubic out[3]) { memset(out, 0, 3 * sizeof *out); }

CONTRACT void traversal_set_step(WAY, double h) {}
CONTRACT void traversal_begin_run(WAY, unsigned i, double t, real last) {}
CONTRACT reals traversal_samples(WAY, reals j, ints mask, bool bounded, SamplePlaces *at, ints *valid)
{
    *valid = mask;
    return w->lo;
}
CONTRACT reals traversal_sample_gradients(WAY, const SamplePlaces *at, ints mask, reals g[3])
{
    memset(g, 0, 3 * sizeof *g);
    return g[0];
}

CONTRACT void traversal_find(WAY, unsigned i, double t, Place *out, double *begin, double *end)
{
    *out = (Place){.t = t};
    *begin = w->begin[i], *end = w->end[i];
}
CONTRACT void traversal_place_in_run(WAY, unsigned i, double first_t, real last, real j, Place *out) {}
CONTRACT void traversal_place_at(WAY, unsigned i, Place *out) {}
CONTRACT void traversal_settle_end(WAY, unsigned i, Place *out) { out->is_end = true; }
CONTRACT real traversal_value(WAY, const Place *at, bool bounded, bool *valid) { return *valid = true, BOX_VALUE; }
CONTRACT real traversal_gradient(WAY, const Place *at, real out[3]) { return out[0] = out[1] = out[2] = 0; }

#endif
