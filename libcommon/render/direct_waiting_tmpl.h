/* Steps of the direct estimator that wait for the next sample: soft surfaces need |dv/dl|, isosurfaces lie between samples
 * (direct_tmpl.h has the derivation).  Include reals.h first. */
#ifndef VOL_RENDER_DIRECT_WAITING_TMPL_H
#define VOL_RENDER_DIRECT_WAITING_TMPL_H

#include "render/direct_steps_tmpl.h"

/* What scatters in the classic model, and surfaces in the others, is shaded. */
ALWAYS_INLINE ints shaded_intervals(const Optics *o, ints interval, unsigned terms)
{
    ints first = interval * INTERVAL_REALS;
    ints shaded = (ints)(gather_reals(&o->intervals[0].has_surface, first) > 0);
    if (terms & TERM_CLASSIC)
        shaded |= (ints)(gather_reals(&o->intervals[0].scatter.a, first) != 0) |
                  (ints)(gather_reals(&o->intervals[0].scatter.b, first) != 0);
    return shaded;
}

/* t of the samples that wait, for lights that stand somewhere. */
static reals times_waiting(const March *m)
{
    reals t;
    for (int i = 0; i < LANES; i++)
        t[i] = (real)sample_time(&m->s, (unsigned)i, doubles_lane(&m->last.number, i));
    return t;
}

/* |dv/dl| at the samples that wait, from their neighbours. */
ALWAYS_INLINE reals slopes(const March *m, const Fed *next, ints next_valid)
{
    const Fed *here = &m->last;
    reals a = reals_select(m->valid_before, m->v_before, here->v), b = reals_select(next_valid, next->v, here->v);
    reals run = reals_where(m->valid_before, here->before) + reals_where(next_valid, next->before);
    return reals_where((ints)(run > 0), reals_abs(b - a) / run);
}

/* The properties of the steps that wait; all 0 in lanes other than `seen`. */
ALWAYS_INLINE void classify(March *m, const Fed *next, ints next_valid, ints seen, unsigned terms, Step *step)
{
    const Optics *o = m->s.lanes.optics;
    const reals zero = reals_all(0);
    Optic in;
    Shading sh;
    load_optics(o, m->last.interval, seen, terms, &in);
    reals x = m->last.v - in.ref;
    ints surface = seen & (ints)(in.has_surface > 0), shaded = {0};
    *step = (Step){0};
    particles_of(&in, x, terms, step);
    if (terms & TERM_SHADED) {
        shaded = seen & shaded_intervals(o, m->last.interval, terms);
        if (any(shaded))
            shade_lanes(&m->s.lanes, m->last.gradient, times_waiting(m), &sh);
    }
    if (terms & TERM_CLASSIC && any(shaded)) {
        reals S = surfaceness_of(o, line_of_optic(in.surfaceness, x), &sh), factor[3];
        reals scatter = reals_max(line_of_optic(in.scatter, x), zero);
        classic_factors(S, &sh, factor);
        for (int c = 0; c < 3; c++) {
            step->scatter[c] = reals_select(shaded, step->scatter[c] * factor[c], step->scatter[c]);
            step->normal[c] = reals_where(shaded, scatter * sh.normal[c]);
        }
    }
    if (terms & TERM_SURFACE && any(surface)) {
        reals dense = slopes(m, next, next_valid) * reals_max(line_of_optic(in.surface, x), zero);
        dense = reals_where(surface, dense);
        for (int c = 0; c < channels_of(terms); c++)
            step->extinction[c] += dense;
        for (int c = 0; c < 3; c++) {
            reals color = line_of_optic(in.surface_color[c], x);
            if (terms & TERM_SHADED) {
                color = reals_where(surface, reals_fma(sh.k[c], color, sh.b[c]));
                step->normal[c] = reals_select(surface, dense * sh.normal[c], step->normal[c]);
            }
            step->surface[c] = dense * color;
        }
    }
    for (int c = 0; c < 3; c++) {
        step->extinction[c] = reals_where(seen, step->extinction[c]);
        step->scatter[c] = reals_where(seen, step->scatter[c]);
        step->emit[c] = reals_where(seen, step->emit[c]);
        step->surface[c] = reals_where(surface, step->surface[c]);
    }
}

/* Adds `length` of the steps of `mask`. */
ALWAYS_INLINE void add_steps(March *m, const Step *step, ints mask, reals length, unsigned terms)
{
    reals light[3];
    length = reals_where(mask, length);
    if (terms & TERM_EXTRA)
        FOR_LANES(i, mask_bits(mask)) {
            double tau[3] = {0};
            for (int c = 0; c < channels_of(terms); c++)
                tau[c] = doubles_lane(&m->sums.tau[c], (int)i);
            note_stretch(m, i, step, m->cursor[i], length[i], tau, channels_of(terms));
        }
    for (int c = 0; c < channels_of(terms); c++) {
        reals depth = step->extinction[c] * length, passed;
        light[c] = reals_exp(-doubles_round(&m->sums.tau[c])) * attenuated(depth, &passed) * length;
        doubles_add(&m->sums.tau[c], depth);
    }
    for (int c = 0; c < 3; c++) {
        reals through = light[terms & TERM_COLOURED ? c : 0];
        reals scatter = through * step->scatter[c], emit = through * step->emit[c], surface = through * step->surface[c];
        doubles_add(&m->sums.color[c], (scatter + emit) + surface);
        if (terms & TERM_EXTRA) {
            doubles_add(&m->sums.scatter[c], scatter);
            doubles_add(&m->sums.emit[c], emit);
            doubles_add(&m->sums.surface[c], surface);
            if (terms & TERM_SHADED)
                doubles_add(&m->sums.normal[c], light[0] * step->normal[c]);
        }
    }
    end_dark(m, mask, terms);
}

/* ---- Isosurfaces ---- */

static void cross(March *m, unsigned i, const Delta *delta, double t, unsigned terms)
{
    VolRadiance *out = &m->s.lanes.out[i];
    Shading sh;
    double tau[3] = {0};
    int channels = channels_of(terms);
    if (terms & TERM_SHADED) {
        Place place = place_of_time(&m->s, i, t);
        real there[3];
        gradient_at(&m->s, &place, there);
        reals gradient[3] = {reals_all(there[0]), reals_all(there[1]), reals_all(there[2])};
        shade_lanes(&m->s.lanes, gradient, reals_all((real)t), &sh);
    }
    for (int c = 0; c < channels; c++)
        tau[c] = doubles_lane(&m->sums.tau[c], (int)i);
    for (int c = 0; c < 3; c++) {
        real color = terms & TERM_SHADED ? real_fma(sh.k[c][i], delta->color[c], sh.b[c][i]) : delta->color[c];
        double part = vol_exp(-tau[c < channels ? c : 0]) * delta->opacity * (double)color;
        out->surface[c] += part;
        doubles_set(&m->sums.color[c], (int)i, doubles_lane(&m->sums.color[c], (int)i) + part);
        if (terms & TERM_SHADED)
            out->normal[c] += vol_exp(-tau[0]) * delta->opacity * (double)sh.normal[c][i];
    }
    for (int c = 0; c < channels; c++) {
        tau[c] += delta->mu;
        doubles_set(&m->sums.tau[c], (int)i, tau[c]);
    }
    if (isinf(out->depth) && mean_transmittance(tau, channels) <= 0.5)
        out->depth = t;
    if (m->s.lanes.scene->trace) {
        VolTraceStep traced = {t, t, (double)delta->value, (double)delta->value, delta->mu,
                               (size_t)(delta - m->s.lanes.optics->deltas), "isosurface"};
        m->s.lanes.scene->trace(m->s.lanes.scene->trace_user, &traced);
    }
    end_dark(m, mask_of(1u << i), terms);
}

/* The step that lane i waits for, up to t. */
static void add_until(March *m, unsigned i, const Step *step, double t, unsigned terms)
{
    if (!(t > m->cursor[i]))
        return;
    add_steps(m, step, mask_of(1u << i) & m->waiting, reals_all((real)(t - m->cursor[i])), terms);
    m->cursor[i] = t;
}

/* The isosurfaces between two neighbouring samples that lie in (from, to], in the order of the ray. */
static void cross_between(March *m, unsigned i, Sample a, Sample b, double from, double to, const Step *step,
                          unsigned terms)
{
    const Optics *o = m->s.lanes.optics;
    bool rising = b.v > a.v;
    for (size_t n = 0; n < o->delta_count && m->waiting[i]; n++) {
        const Delta *delta = &o->deltas[rising ? n : o->falling[n]];
        if ((a.v < delta->value) == (b.v < delta->value))
            continue;
        double t = fmin(fma(b.t - a.t, (double)((delta->value - a.v) / (b.v - a.v)), a.t), b.t);
        if (t <= from || t > to)
            continue;
        add_until(m, i, step, t, terms);
        if (m->waiting[i])
            cross(m, i, delta, t, terms);
    }
}

/* The step that lane i waits for, cut at isosurfaces: of those on the way from the sample before it the ones that the step
 * before it did not reach, of those on the way to the next the ones up to its own end. */
static void cross_step(March *m, unsigned i, const Fed *next, bool next_valid, const Step *step, unsigned terms)
{
    const Samples *s = &m->s;
    double n = doubles_lane(&m->last.number, (int)i);
    double begin = n < 0 ? s->t0[i] : step_begin(s, i, n), end = step_begin(s, i, n + 1);
    Sample here = {sample_time(s, i, n), m->last.v[i], m->last.valid[i]};
    m->cursor[i] = begin;
    if (here.valid && m->valid_before[i])
        cross_between(m, i, (Sample){sample_time(s, i, n - 1), m->v_before[i], true}, here, begin, INFINITY, step, terms);
    if (here.valid && next_valid)
        cross_between(m, i, here, (Sample){sample_time(s, i, n + 1), next->v[i], true}, -INFINITY, end, step, terms);
    add_until(m, i, step, end, terms);
}

/* ---- Feeding samples ---- */

/* The steps of the samples that wait, now that the next is known (where next_valid). */
ALWAYS_INLINE void complete(March *m, const Fed *next, ints mask, unsigned terms)
{
    const Optics *o = m->s.lanes.optics;
    const Fed *here = &m->last;
    ints seen = mask & here->own & here->valid & intervals_visible(o, here->interval), cut = {0};
    ints next_valid = next->valid & mask;
    if (terms & TERM_ISO)
        cut = mask & here->valid & ((m->valid_before & (ints)(m->isosurfaces_before != here->isosurfaces)) |
                                    (next_valid & (ints)(next->isosurfaces != here->isosurfaces)));
    if (!any(seen | cut))
        return;
    Step step = {0};
    if (any(seen))
        classify(m, next, next_valid, seen, terms, &step);
    m->sums.cells -= seen;
    if (terms & TERM_EXTRA)
        FOR_LANES(i, mask_bits(seen))
            m->cursor[i] = step_begin(&m->s, i, doubles_lane(&here->number, (int)i));
    if (terms & TERM_ISO)
        FOR_LANES(i, mask_bits(cut))
            cross_step(m, i, next, next_valid[i], &step, terms);
    if (any(seen & ~cut))
        add_steps(m, &step, seen & ~cut, here->length, terms);
}

ALWAYS_INLINE void replace_fed(Fed *old, const Fed *by, ints mask, unsigned terms)
{
    old->v = reals_select(mask, by->v, old->v);
    old->before = reals_select(mask, by->before, old->before);
    old->valid = ints_select(mask, by->valid, old->valid);
    old->own = ints_select(mask, by->own, old->own);
    old->interval = ints_select(mask, by->interval, old->interval);
    old->isosurfaces = ints_select(mask, by->isosurfaces, old->isosurfaces);
    old->length = reals_select(mask, by->length, old->length);
    for (int a = 0; a < 3 && terms & TERM_SHADED; a++)
        old->gradient[a] = reals_select(mask, by->gradient[a], old->gradient[a]);
    FOR_LANES(i, mask_bits(mask))
        doubles_set(&old->number, (int)i, doubles_lane(&by->number, (int)i));
}

ALWAYS_INLINE void feed(March *m, const Fed *next, ints mask, unsigned terms)
{
    ints followed = mask & m->waiting;
    if (any(followed))
        complete(m, next, followed, terms);
    mask &= m->s.lanes.alive;
    m->v_before = reals_select(mask, m->last.v, m->v_before);
    m->valid_before = ints_select(mask, m->last.valid & m->waiting, m->valid_before);
    m->isosurfaces_before = ints_select(mask, m->last.isosurfaces, m->isosurfaces_before);
    replace_fed(&m->last, next, mask, terms);
    m->waiting |= mask;
}

/* The visiting lanes' next sample. */
ALWAYS_INLINE void feed_next(March *m, unsigned terms)
{
    Samples *s = &m->s;
    const Optics *o = s->lanes.optics;
    SamplePlaces at;
    Fed next;
    next.v = samples_value(s, &at, &next.valid);
    next.own = s->visible;
    next.interval = intervals_of(o, next.v);
    next.before = m->before;
    next.length = m->length;
    next.isosurfaces = (ints){0};
    if (terms & TERM_ISO)
        next.isosurfaces = count_up_to(o->delta_values, o->delta_count, next.v, false);
    if (terms & TERM_SHADED) {
        ints shaded = next.valid & s->visible & intervals_visible(o, next.interval);
        shaded &= shaded_intervals(o, next.interval, terms);
        for (int a = 0; a < 3; a++)
            next.gradient[a] = reals_all(0);
        if (any(shaded))
            samples_gradients(s, &at, shaded, next.gradient);
    }
    for (int i = 0; i < LANES; i++)
        doubles_set(&next.number, i, s->first[i] + (double)s->j[i]);
    feed(m, &next, s->visiting, terms);
    if (__builtin_expect(s->equals, 0)) /* the others will be counted as they are completed */
        m->sums.cells += samples_beside(s, s->visiting & next.valid & next.own & intervals_visible(o, next.interval));
    m->before = reals_all((real)s->h);
}

/* Sample n of lane i, in a brick with nothing in it, or an end of the ray: a neighbour, no more. */
static void feed_neighbour(March *m, unsigned i, double n, unsigned terms)
{
    Place place = place_of_sample(&m->s, i, n);
    Sample sample = sample_at(&m->s, &place);
    const Optics *o = m->s.lanes.optics;
    Fed next = {.v = reals_all(sample.v), .valid = ints_all(sample.valid ? -1 : 0)};
    next.before = reals_all(sample_gap(&m->s, i, n));
    next.isosurfaces = count_up_to(o->delta_values, o->delta_count, next.v, false);
    doubles_set(&next.number, (int)i, n);
    feed(m, &next, mask_of(1u << i), terms);
}

/* The step that lane i waits for has no next sample that matters. */
static void stop_waiting(March *m, unsigned i, unsigned terms)
{
    Fed none = {0};
    if (m->waiting[i])
        complete(m, &none, mask_of(1u << i), terms);
    m->waiting[i] = 0;
}

/* Lane i has come to sample `first` of a brick, after its last one or after a stretch that is left out. */
static void come_to(March *m, unsigned i, double first, unsigned terms)
{
    if (m->waiting[i] && doubles_lane(&m->last.number, (int)i) + 1 < first)
        feed_neighbour(m, i, doubles_lane(&m->last.number, (int)i) + 1, terms);
    if (m->waiting[i] && doubles_lane(&m->last.number, (int)i) + 1 < first)
        stop_waiting(m, i, terms);
    if (m->s.lanes.alive[i] && !m->waiting[i])
        feed_neighbour(m, i, first - 1, terms);
}

/* Behind the last brick. */
static void come_to_end(March *m, unsigned i, unsigned terms)
{
    if (!m->waiting[i])
        return;
    m->s.lanes.alive[i] = -1;
    feed_neighbour(m, i, doubles_lane(&m->last.number, (int)i) + 1, terms);
    stop_waiting(m, i, terms);
    m->s.lanes.alive[i] = 0;
}

#endif
