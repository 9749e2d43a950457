/* Steps of the direct estimator that wait for the next sample: soft surfaces need |dv/dl|, isosurfaces lie between samples
 * (direct_tmpl.h has the derivation).
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    feed_next(), come_to(), come_to_end() */
#ifndef VOL_TRACE_DIRECT_WAITING_TMPL_H
#define VOL_TRACE_DIRECT_WAITING_TMPL_H

#include "trace/direct_steps_tmpl.h"

/* What scatters in the classic model, and surfaces in the others, is shaded. */
ALWAYS_INLINE ints shaded_intervals(const TfTables *o, ints interval, unsigned features)
{
    ints first = interval * INTERVAL_REALS;
    reals scatter[2] = {{0}};
    if (features & FEATURE_CLASSIC) {
        scatter[0] = gather_reals(&o->intervals[0].scatter.a, first);
        scatter[1] = gather_reals(&o->intervals[0].scatter.b, first);
    }
    return needs_gradient(gather_reals(&o->intervals[0].has_surface, first), scatter, features);
}

/* When the samples that wait are passed, for lights that stand somewhere. */
static Times times_waiting(const March *m)
{
    double t[LANES];
    if (__builtin_expect(!m->s.packet.prepared->lit_from_places, 1))
        return time_of(0);
    for (int i = 0; i < LANES; i++)
        t[i] = sample_time(&m->s, (unsigned)i, doubles_lane(&m->last.number, i));
    return times_of(t);
}

/* Where they are in light grids. */
static reals place_waiting(const March *m, ints mask)
{
    double t[LANES] = {0};
    FOR_LANES(i, mask_bits(mask))
        t[i] = sample_time(&m->s, i, doubles_lane(&m->last.number, (int)i));
    return lit_place(&m->s.packet, mask, t);
}

/* Steps that are many equal ones, through a constant medium: lights that stand somewhere by their mean over all of it. */
MAYBE_UNUSED static void shade_long_steps(const March *m, ints mask, const Step *step, Shading *sh)
{
    const RayPacket *l = &m->s.packet;
    FOR_LANES(i, mask_bits(mask)) {
        double begin = step_begin(&m->s, i, doubles_lane(&m->last.number, (int)i)), length = (double)m->last.length[i];
        double depth[3], mean[3];
        for (int c = 0; c < 3; c++)
            depth[c] = (double)step->extinction[c < l->tables->channels ? c : 0][i] * length;
        vol_lights_mean(l->scene, &l->rays[i], l->prepared->nearest_light, begin, begin + length, depth, mean);
        shade_evenly(l->tables, i, mean, sh);
    }
}

static void end_marches(March *m, ints lost)
{
    give_up(&m->s.packet, lost);
    m->s.visiting &= ~lost;
    m->waiting &= ~lost;
}

/* Ends rays of `mask` on which rounding of the shading of the sample that waits shows, in what is `shown` of it. */
MAYBE_UNUSED static void end_unsure_marches(March *m, const Shading *sh, reals shown, ints mask, unsigned features)
{
    Samples *s = &m->s;
    const Times times = times_waiting(m);
    reals steepest = m->last.steepest, doubt = doubt_of(&s->packet, sh, steepest, &times);
    ints lost = where_doubt_shows(&m->sum, doubt, shown, mask, features);
    if (!any(lost))
        return;
    FOR_LANES(i, mask_bits(lost)) { /* the gradients that it comes from may be less steep */
        Place place = place_of_sample(s, i, doubles_lane(&m->last.number, (int)i));
        real g[3];
        steepest[i] = traversal_gradient(&s->way, &s->packet, &place, g);
    }
    doubt = doubt_of(&s->packet, sh, steepest, &times);
    end_marches(m, where_doubt_shows(&m->sum, doubt, shown, lost, features));
}

ALWAYS_INLINE void check_step_shading(March *m, const Shading *sh, reals shown, ints mask, unsigned features)
{
    ints unsure = may_be_unsure(&m->s.packet, sh, m->last.steepest, shown, mask);
    if (__builtin_expect(any(unsure), 0))
        end_unsure_marches(m, sh, shown, unsure, features);
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
ALWAYS_INLINE void classify(March *m, const Fed *next, ints next_valid, ints seen, unsigned features, Step *step)
{
    const TfTables *o = m->s.packet.tables;
    const reals zero = reals_all(0);
    Properties in;
    Shading sh;
    load_properties(o, m->last.interval, seen, features, &in);
    reals x = m->last.v - in.ref;
    const bool is_lit = features & FEATURE_LIT && m->s.packet.lit;
    const reals at = is_lit ? place_waiting(m, seen) : zero;
    const LitPlaces places = {&at, seen, features & FEATURE_CLASSIC ? ints_all(0) : seen, NULL, {0}};
    ints surface = seen & (ints)(in.has_surface > 0), shaded = {0};
    *step = (Step){0};
    particles_of(&in, x, features, step);
    if (features & FEATURE_SHADED) {
        shaded = seen & shaded_intervals(o, m->last.interval, features);
        if (any(shaded)) {
            Times times = times_waiting(m);
            shade_lanes(&m->s.packet, m->last.gradient, &times, is_lit ? &places : NULL, &sh);
        }
    } else if (features & FEATURE_SURFACE && is_lit && any(surface)) {
        light_evenly(&m->s.packet, 1, &places, &sh);
    }
    if (features & FEATURE_CLASSIC && any(shaded)) {
        if (m->s.packet.prepared->lit_from_places)
            shade_long_steps(m, shaded & (ints)(m->last.length > (real)(1.5 * m->s.h)), step, &sh);
        reals scatter = reals_max(property_at(in.scatter, x), zero), factor[3];
        check_step_shading(m, &sh, scatter * m->last.length, shaded, features);
        classic_factors_at(o, x, in.surfaceness, &sh, is_lit ? m->last.lit : NULL, factor);
        for (int c = 0; c < 3; c++) {
            step->scatter[c] = reals_select(shaded, step->scatter[c] * factor[c], step->scatter[c]);
            step->normal[c] = reals_where(shaded, scatter * sh.normal[c]);
        }
    } else if (is_lit) {
        for (int c = 0; c < 3; c++)
            step->scatter[c] *= m->last.lit[c];
    }
    if (features & FEATURE_SURFACE && any(surface)) {
        reals dense = slopes(m, next, next_valid) * reals_max(property_at(in.surface, x), zero);
        dense = reals_where(surface, dense);
        if (features & FEATURE_SHADED && !(features & FEATURE_CLASSIC))
            check_step_shading(m, &sh, dense * m->last.length, surface, features);
        for (int c = 0; c < channels_of(features); c++)
            step->extinction[c] += dense;
        for (int c = 0; c < 3; c++) {
            reals color = property_at(in.surface_color[c], x);
            if (features & FEATURE_SHADED) {
                color = reals_where(surface, shaded_color(&sh, c, color, reals_all(1)));
                step->normal[c] = reals_select(surface, dense * sh.normal[c], step->normal[c]);
            } else if (is_lit) {
                color *= reals_where(surface, sh.k[c]);
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
ALWAYS_INLINE void add_steps(March *m, const Step *step, ints mask, reals length, unsigned features)
{
    reals light[3];
    length = reals_where(mask, length);
    if (features & FEATURE_EXTRA && m->s.packet.extra)
        FOR_LANES(i, mask_bits(mask)) {
            double optical_depth[3] = {0};
            for (int c = 0; c < channels_of(features); c++)
                optical_depth[c] = doubles_lane(&m->sum.optical_depth[c], (int)i);
            note_step(m, i, step, m->cursor[i], length[i], optical_depth, channels_of(features));
        }
    for (int c = 0; c < channels_of(features); c++) {
        reals depth = step->extinction[c] * length, passed;
        light[c] = reals_exp(-doubles_round(&m->sum.optical_depth[c])) * reals_phi(depth, &passed) * length;
        doubles_add(&m->sum.optical_depth[c], depth);
    }
    Light seen;
    for (int c = 0; c < 3; c++) {
        reals transmittance = light[features & FEATURE_COLOURED ? c : 0];
        seen.scatter[c] = transmittance * step->scatter[c];
        seen.emit[c] = transmittance * step->emit[c];
        seen.surface[c] = transmittance * step->surface[c];
        if (features & FEATURE_SHADED)
            seen.normal[c] = light[0] * step->normal[c];
        doubles_add(&m->sum.color[c], (seen.scatter[c] + seen.emit[c]) + seen.surface[c]);
    }
    add_layers(&m->sum, &m->s.packet, &seen, features);
    end_opaque_marches(m, mask, features);
}

/* ---- Isosurfaces ---- */

static void cross_between_samples(March *m, unsigned i, const Isosurface *isosurface, double t, bool rising,
                                  unsigned features)
{
    RayPacket *l = &m->s.packet;
    Shading sh;
    const bool is_lit = features & FEATURE_LIT && l->lit;
    const reals at = is_lit ? reals_all((real)(t - l->lit->base[i])) : reals_all(0);
    real value[LANES];
    value[i] = isosurface->value;
    const LitPlaces places = {&at, mask_of(1u << i), mask_of(1u << i), value, ints_all(rising ? -1 : 0)};
    if (features & FEATURE_SHADED) {
        Place place = place_of_time(&m->s, i, t);
        real there[3];
        real steepest = traversal_gradient(&m->s.way, l, &place, there);
        reals gradient[3] = {reals_all(there[0]), reals_all(there[1]), reals_all(there[2])};
        Times times = time_of(t);
        shade_lanes(l, gradient, &times, is_lit ? &places : NULL, &sh);
        reals opacity = reals_all((real)isosurface->opacity);
        ints unsure = may_be_unsure(l, &sh, reals_all(steepest), opacity, mask_of(1u << i));
        if (__builtin_expect(any(unsure), 0)) {
            reals doubt = doubt_of(l, &sh, reals_all(steepest), &times);
            end_marches(m, where_doubt_shows(&m->sum, doubt, opacity, unsure, features));
        }
    } else if (is_lit) {
        light_evenly(l, 1, &places, &sh);
    }
    cross_isosurface(&m->sum, l, i, isosurface, t, features & FEATURE_SHADED || is_lit ? &sh : NULL, features);
    end_opaque_marches(m, mask_of(1u << i), features);
}

/* The step that lane i waits for, up to t. */
static void add_until(March *m, unsigned i, const Step *step, double t, unsigned features)
{
    if (!(t > m->cursor[i]))
        return;
    add_steps(m, step, mask_of(1u << i) & m->waiting, reals_all((real)(t - m->cursor[i])), features);
    m->cursor[i] = t;
}

/* The isosurfaces between two neighbouring samples that lie in (from, to], in the order of the ray. */
static void cross_between(March *m, unsigned i, Sample a, Sample b, double from, double to, const Step *step,
                          unsigned features)
{
    const TfTables *o = m->s.packet.tables;
    bool rising = b.v > a.v;
    for (size_t n = 0; n < o->isosurface_count && m->waiting[i]; n++) {
        const Isosurface *isosurface = &o->isosurfaces[rising ? n : o->falling[n]];
        if ((a.v < isosurface->value) == (b.v < isosurface->value))
            continue;
        double t = fmin(fma(b.t - a.t, (double)((isosurface->value - a.v) / (b.v - a.v)), a.t), b.t);
        if (t <= from || t > to)
            continue;
        add_until(m, i, step, t, features);
        if (m->waiting[i])
            cross_between_samples(m, i, isosurface, t, rising, features);
    }
}

/* The step that lane i waits for, cut at isosurfaces: of those on the way from the sample before it the ones that the step
 * before it did not reach, of those on the way to the next the ones up to its own end. */
static void cross_step(March *m, unsigned i, const Fed *next, bool next_valid, const Step *step, unsigned features)
{
    const Samples *s = &m->s;
    double n = doubles_lane(&m->last.number, (int)i);
    double begin = n < 0 ? s->t0[i] : step_begin(s, i, n), end = step_begin(s, i, n + 1);
    Sample here = {sample_time(s, i, n), m->last.v[i], m->last.valid[i]};
    m->cursor[i] = begin;
    if (here.valid && m->valid_before[i])
        cross_between(m, i, (Sample){sample_time(s, i, n - 1), m->v_before[i], true}, here, begin, INFINITY, step, features);
    if (here.valid && next_valid)
        cross_between(m, i, here, (Sample){sample_time(s, i, n + 1), next->v[i], true}, -INFINITY, end, step, features);
    add_until(m, i, step, end, features);
}

/* ---- Feeding samples ---- */

/* The steps of the samples that wait, now that the next is known (where next_valid). */
ALWAYS_INLINE void complete(March *m, const Fed *next, ints mask, unsigned features)
{
    const TfTables *o = m->s.packet.tables;
    const Fed *here = &m->last;
    ints seen = mask & here->own & here->valid & intervals_visible(o, here->interval), cut = {0};
    ints next_valid = next->valid & mask;
    if (features & FEATURE_ISO)
        cut = mask & here->valid & ((m->valid_before & (ints)(m->isosurfaces_before != here->isosurfaces_below)) |
                                    (next_valid & (ints)(next->isosurfaces_below != here->isosurfaces_below)));
    if (!any(seen | cut))
        return;
    Step step = {0};
    if (any(seen))
        classify(m, next, next_valid, seen, features, &step);
    m->sum.cells -= seen;
    if (features & FEATURE_EXTRA && m->s.packet.extra)
        FOR_LANES(i, mask_bits(seen))
            m->cursor[i] = step_begin(&m->s, i, doubles_lane(&here->number, (int)i));
    if (features & FEATURE_ISO)
        FOR_LANES(i, mask_bits(cut))
            cross_step(m, i, next, next_valid[i], &step, features);
    if (any(seen & ~cut))
        add_steps(m, &step, seen & ~cut, here->length, features);
}

ALWAYS_INLINE void replace_fed(Fed *old, const Fed *by, ints mask, unsigned features)
{
    old->v = reals_select(mask, by->v, old->v);
    old->before = reals_select(mask, by->before, old->before);
    old->valid = ints_select(mask, by->valid, old->valid);
    old->own = ints_select(mask, by->own, old->own);
    old->interval = ints_select(mask, by->interval, old->interval);
    old->isosurfaces_below = ints_select(mask, by->isosurfaces_below, old->isosurfaces_below);
    old->length = reals_select(mask, by->length, old->length);
    for (int a = 0; a < 3 && features & FEATURE_SHADED; a++)
        old->gradient[a] = reals_select(mask, by->gradient[a], old->gradient[a]);
    if (features & FEATURE_SHADED)
        old->steepest = reals_select(mask, by->steepest, old->steepest);
    FOR_LANES(i, mask_bits(mask))
        doubles_set(&old->number, (int)i, doubles_lane(&by->number, (int)i));
}

ALWAYS_INLINE void feed(March *m, const Fed *next, ints mask, unsigned features)
{
    ints followed = mask & m->waiting;
    if (any(followed))
        complete(m, next, followed, features);
    mask &= m->s.packet.alive;
    m->v_before = reals_select(mask, m->last.v, m->v_before);
    m->valid_before = ints_select(mask, m->last.valid & m->waiting, m->valid_before);
    m->isosurfaces_before = ints_select(mask, m->last.isosurfaces_below, m->isosurfaces_before);
    replace_fed(&m->last, next, mask, features);
    for (int c = 0; c < 3 && features & FEATURE_LIT && m->s.packet.lit; c++)
        m->last.lit[c] = reals_select(mask, next->lit[c], m->last.lit[c]);
    m->waiting |= mask;
}

/* The visiting lanes' next sample. */
ALWAYS_INLINE void feed_next(March *m, unsigned features)
{
    Samples *s = &m->s;
    const TfTables *o = s->packet.tables;
    SamplePlaces at;
    Fed next;
    next.v = samples_value(s, false, &at, &next.valid);
    next.own = s->way.shows;
    next.interval = intervals_of(o, next.v);
    next.before = m->before;
    next.length = m->length;
    next.isosurfaces_below = (ints){0};
    if (features & FEATURE_ISO)
        next.isosurfaces_below = count_up_to(o->isosurface_values, o->isosurface_count, next.v, false);
    if (features & FEATURE_SHADED) {
        ints shaded = next.valid & s->way.shows & intervals_visible(o, next.interval);
        shaded &= shaded_intervals(o, next.interval, features);
        for (int a = 0; a < 3; a++)
            next.gradient[a] = reals_all(0);
        next.steepest = reals_all(0);
        if (any(shaded))
            next.steepest = traversal_sample_gradients(&s->way, &s->packet, &at, shaded, next.gradient);
    }
    if (features & FEATURE_LIT && s->packet.lit) {
        reals place = s->j * (real)s->h;
        ints seen = next.valid & s->way.shows & intervals_visible(o, next.interval);
        if (any(seen))
            lit_on_particles(&s->packet, 1, &place, seen, &next.lit);
    }
    for (int i = 0; i < LANES; i++)
        doubles_set(&next.number, i, s->first[i] + (double)s->j[i]);
    feed(m, &next, s->visiting, features);
    if (__builtin_expect(s->equals, 0)) /* the others will be counted as they are completed */
        m->sum.cells += samples_beside(s, s->visiting & next.valid & next.own & intervals_visible(o, next.interval));
    m->before = reals_all((real)s->h);
}

/* Sample n of lane i, in a brick with nothing in it, or an end of the ray: a neighbour, no more. */
static void feed_neighbour(March *m, unsigned i, double n, unsigned features)
{
    Place place = place_of_sample(&m->s, i, n);
    Sample sample = sample_at(&m->s, &place);
    const TfTables *o = m->s.packet.tables;
    Fed next = {.v = reals_all(sample.v), .valid = ints_all(sample.valid ? -1 : 0)};
    next.before = reals_all(sample_gap(&m->s, i, n));
    next.isosurfaces_below = count_up_to(o->isosurface_values, o->isosurface_count, next.v, false);
    doubles_set(&next.number, (int)i, n);
    feed(m, &next, mask_of(1u << i), features);
}

/* The step that lane i waits for has no next sample that matters. */
static void stop_waiting(March *m, unsigned i, unsigned features)
{
    Fed none = {0};
    if (m->waiting[i])
        complete(m, &none, mask_of(1u << i), features);
    m->waiting[i] = 0;
}

/* Lane i has come to sample `first` of a brick, after its last one or after a stretch that is left out. */
static void come_to(March *m, unsigned i, double first, unsigned features)
{
    if (m->waiting[i] && doubles_lane(&m->last.number, (int)i) + 1 < first)
        feed_neighbour(m, i, doubles_lane(&m->last.number, (int)i) + 1, features);
    if (m->waiting[i] && doubles_lane(&m->last.number, (int)i) + 1 < first)
        stop_waiting(m, i, features);
    if (m->s.packet.alive[i] && !m->waiting[i])
        feed_neighbour(m, i, first - 1, features);
}

/* Behind the last brick. */
static void come_to_end(March *m, unsigned i, unsigned features)
{
    if (!m->waiting[i])
        return;
    m->s.packet.alive[i] = -1;
    feed_neighbour(m, i, doubles_lane(&m->last.number, (int)i) + 1, features);
    stop_waiting(m, i, features);
    m->s.packet.alive[i] = 0;
}

#endif
