/* The pre-integrated estimators (Y 4.2): the ray is cut into steps of length h from the entry into the domain, the last one
 * shorter; between neighbouring samples the field is taken to run linearly, and what such a segment adds comes from
 *     full        tables over (v0, v1): Y 21-23, surfaces shaded at both ends and blended by their weights
 *     integrals   integrals in one dimension: Y 16-20, no attenuation within the segment of one part by another
 * Second order in h, whatever the transfer function does between the samples.  Isosurfaces are in neither: a segment is
 * cut where it crosses one.
 *
 * The classic model (K 11) and the layers divide the particles' part between scattering and emission as their sources
 * divide by Simpson's rule over the segment.
 *
 * A segment is done when its back end comes up in a visit to the brick that holds it; a ray's first sample in a brick closes
 * the segment that led there, and where the ray goes on into a brick that is left out, one more sample closes the last.  A
 * segment that touches bricks alone that are left out adds nothing: what it runs through is one connected range of values
 * in which nothing can be seen (skip.c). */
#include "render/lookup_tmpl.h"
#include "render/samples_tmpl.h"

/* One end of each lane's segment, and its shading once that was asked for. */
typedef struct SegmentEnd {
    LookupEnd field;
    ints valid;           /* there is one, and not in a hole */
    Doubles number;       /* of the sample, */
    double cut[LANES];    /* or where on the ray an isosurface cuts; else NAN */
    ints here;            /* the sample lies in the brick that the lane is in: */
    SamplePlaces place;
    ints shaded;
    Shading shading;
} SegmentEnd;

typedef struct Segments {
    Samples samples;
    SegmentEnd ends[2], *front, *back;
    bool lit_from_places;       /* some light stands somewhere */
    Doubles length;             /* of the segments of this run, world units */
    ints own;                   /* these are of the scene's step */
    ints tails;                 /* segments that are to be closed by a sample in another brick: `back` */
    ints heads;                 /* lanes in whose run the first segment begins in another brick: */
    reals head_v;
    ints head_valid;
    Doubles tau[3], color[3], surface[3], scatter[3], emit[3], normal[3];
    reals depth_so_far[3];      /* tau, rounded */
    ints cells;
} Segments;

/* What layers and classic shading ask about a segment's light. */
typedef struct SegmentLight {
    reals scatter[3], emit[3], surface[3], normal[3];
} SegmentLight;

static inline double end_time(const Segments *k, const SegmentEnd *end, unsigned i)
{
    return isnan(end->cut[i]) ? sample_time(&k->samples, i, doubles_lane(&end->number, (int)i)) : end->cut[i];
}

/* ---- Shading ---- */

static void shade_lanes_at(Segments *k, const SegmentEnd *end, ints mask, Shading *out)
{
    Samples *s = &k->samples;
    reals gradient[3], t = reals_all(0);
    ints here = mask & end->here;
    samples_gradients(s, &end->place, here, gradient);
    FOR_LANES(i, mask_bits(mask & ~here)) {
        bool cut = !isnan(end->cut[i]);
        Place place = cut ? place_of_time(s, i, end->cut[i]) : place_of_sample(s, i, doubles_lane(&end->number, (int)i));
        real g[3];
        gradient_at(s, &place, g);
        for (int a = 0; a < 3; a++)
            gradient[a][i] = g[a];
    }
    if (k->lit_from_places)
        FOR_LANES(i, mask_bits(mask))
            t[i] = (real)end_time(k, end, i);
    shade_lanes(&s->lanes, gradient, t, out);
}

static void shading_replace(Shading *old, ints mask, const Shading *by)
{
    for (int c = 0; c < 3; c++) {
        old->k[c] = reals_select(mask, by->k[c], old->k[c]);
        old->b[c] = reals_select(mask, by->b[c], old->b[c]);
        old->normal[c] = reals_select(mask, by->normal[c], old->normal[c]);
    }
    old->gradient = reals_select(mask, by->gradient, old->gradient);
}

/* The shading at these ends, computed where it was not yet. */
static const Shading *shading_at(Segments *k, SegmentEnd *end, ints mask)
{
    ints wanted = mask & ~end->shaded;
    if (any(wanted)) {
        Shading fresh;
        shade_lanes_at(k, end, wanted, &fresh);
        shading_replace(&end->shading, wanted, &fresh);
        end->shaded |= wanted;
    }
    return &end->shading;
}

/* ---- What a segment sends ---- */

/* How the particles' source at v divides, added with a weight. */
ALWAYS_INLINE void add_sources(const Optics *o, reals v, ints interval, real weight, reals scatter[3], reals emit[3])
{
    reals in[4] = {{0}}, s[8] = {{0}}, e[8] = {{0}};
    load_interval(o, interval, AT_PARTICLES, in);
    load_interval(o, interval, AT_SCATTER, s);
    load_interval(o, interval, AT_SCATTER + 4, s + 4);
    load_interval(o, interval, AT_EMIT, e);
    load_interval(o, interval, AT_EMIT + 4, e + 4);
    reals x = v - in[0], mu = weight * reals_max(reals_line(s[0], s[1], x), reals_all(0));
    for (int c = 0; c < 3; c++) {
        scatter[c] = reals_fma(mu, reals_line(s[2 + 2 * c], s[3 + 2 * c], x), scatter[c]);
        emit[c] += weight * reals_line(e[2 * c], e[2 * c + 1], x);
    }
}

/* Fraction of the particles' light that is scattered, per channel. */
static void scattered_fractions(const Optics *o, const LookupEnd *a, const LookupEnd *b, unsigned terms, reals out[3])
{
    reals scatter[3] = {0}, emit[3] = {0}, one = reals_all(1);
    for (int c = 0; c < 3; c++)
        out[c] = one;
    if (!(terms & TERM_EMIT))
        return;
    reals middle = (real)0.5 * (a->v + b->v);
    add_sources(o, a->v, a->interval, 1, scatter, emit);
    add_sources(o, middle, intervals_of(o, middle), 4, scatter, emit);
    add_sources(o, b->v, b->interval, 1, scatter, emit);
    for (int c = 0; c < 3; c++) {
        ints some = (ints)(emit[c] != 0);
        out[c] = reals_select(some, scatter[c] / reals_select(some, scatter[c] + emit[c], one), one);
    }
}

/* K 11 at both ends, averaged: the factor of what a segment scatters. */
static void classic_average(Segments *k, SegmentEnd *a, SegmentEnd *b, const SegmentParts *parts, ints mask,
                            reals factor[3], SegmentLight *light)
{
    const Optics *o = k->samples.lanes.optics;
    SegmentEnd *ends[2] = {a, b};
    for (int c = 0; c < 3; c++)
        factor[c] = reals_all(0);
    for (int n = 0; n < 2; n++) {
        const Shading *sh = shading_at(k, ends[n], mask);
        reals in[4] = {{0}}, line[4] = {{0}}, one_end[3];
        load_interval(o, ends[n]->field.interval, AT_PARTICLES, in);
        load_interval(o, ends[n]->field.interval, AT_EMIT + 4, line);
        reals S = surfaceness_of(o, reals_line(line[2], line[3], ends[n]->field.v - in[0]), sh);
        classic_factors(S, sh, one_end);
        for (int c = 0; c < 3; c++) {
            factor[c] += (real)0.5 * one_end[c];
            reals normal = (real)0.5 * parts->particles_a * sh->normal[c];
            light->normal[c] += reals_select(mask, normal, reals_all(0));
        }
    }
}

ALWAYS_INLINE void particles_light(Segments *k, SegmentEnd *a, SegmentEnd *b, const SegmentParts *parts, ints mask,
                                   unsigned terms, SegmentLight *light)
{
    const Optics *o = k->samples.lanes.optics;
    if (!(terms & (TERM_CLASSIC | TERM_EXTRA))) {
        for (int c = 0; c < 3; c++)
            light->scatter[c] = parts->particles_c[c];
        return;
    }
    reals fraction[3], factor[3] = {reals_all(1), reals_all(1), reals_all(1)};
    scattered_fractions(o, &a->field, &b->field, terms, fraction);
    if (terms & TERM_CLASSIC) {
        ints some = {0};
        for (int c = 0; c < 3; c++)
            some |= mask & (ints)(parts->particles_c[c] != 0);
        if (any(some))
            classic_average(k, a, b, parts, some, factor, light);
    }
    for (int c = 0; c < 3; c++) {
        light->scatter[c] = fraction[c] * factor[c] * parts->particles_c[c];
        light->emit[c] = (1 - fraction[c]) * parts->particles_c[c];
    }
}

ALWAYS_INLINE void add_surface(const Shading *sh, const reals color[3], const reals opacity[3], unsigned terms,
                               SegmentLight *light)
{
    for (int c = 0; c < 3; c++) {
        if (terms & TERM_SHADED && !(terms & TERM_CLASSIC))
            light->surface[c] += reals_fma(sh->k[c], color[c], sh->b[c] * opacity[terms & TERM_COLOURED ? c : 0]);
        else
            light->surface[c] += color[c];
    }
    for (int i = 0; i < 3 && terms & TERM_SHADED && terms & TERM_EXTRA; i++)
        light->normal[i] = reals_fma(opacity[0], sh->normal[i], light->normal[i]);
}

/* Y 20: shading at the value that stands for all surfaces. */
static void mix_shading(const Shading *front, const Shading *back, reals w, Shading *out)
{
    for (int i = 0; i < 3; i++) {
        out->k[i] = reals_mix(front->k[i], back->k[i], w);
        out->b[i] = reals_mix(front->b[i], back->b[i], w);
        out->normal[i] = reals_mix(front->normal[i], back->normal[i], w);
    }
}

ALWAYS_INLINE void surfaces_light(Segments *k, SegmentEnd *a, SegmentEnd *b, const SegmentParts *parts, ints mask, bool full,
                                  unsigned terms, SegmentLight *light)
{
    const Shading *front = NULL, *back = NULL;
    Shading between;
    ints some = mask & (full ? (ints)(parts->front_a[0] > 0) | (ints)(parts->back_a[0] > 0) : (ints)(parts->front_a[0] > 0));
    if (!any(some))
        return;
    if (terms & TERM_SHADED) {
        front = shading_at(k, a, some);
        back = shading_at(k, b, some);
        if (!full)
            mix_shading(front, back, parts->where, &between);
    }
    add_surface(full ? front : &between, parts->front_c, parts->front_a, terms, light);
    if (full)
        add_surface(back, parts->back_c, parts->back_a, terms, light);
    for (int c = 0; c < 3; c++)
        light->surface[c] = reals_select(some, light->surface[c], reals_all(0));
}

/* ---- Compositing ---- */

static void taus_of(const Segments *k, unsigned i, unsigned terms, double tau[3])
{
    for (int c = 0; c < channels_of(terms); c++)
        tau[c] = doubles_lane(&k->tau[c], (int)i);
}

/* Lanes through which nothing can be seen any more have ended. */
ALWAYS_INLINE void end_dark(Segments *k, ints mask, unsigned terms)
{
    Lanes *l = &k->samples.lanes;
    reals least = reals_all(INFINITY);
    for (int c = 0; c < channels_of(terms); c++) {
        k->depth_so_far[c] = doubles_round(&k->tau[c]);
        least = reals_min(k->depth_so_far[c], least);
    }
    ints dark = mask & l->alive & (ints)(least > l->tau_stop);
    if (!any(dark))
        return;
    l->scratch->skipped.rays_ended += (unsigned)__builtin_popcount(mask_bits(dark));
    l->alive &= ~dark;
    k->samples.visiting &= ~dark;
}

/* What only layers and traces ask for: after `before`, the optical depth up to the segment. */
static void note_segment(Segments *k, const SegmentEnd *a, const SegmentEnd *b, const SegmentParts *parts, unsigned i,
                         unsigned terms)
{
    const VolScene *scene = k->samples.lanes.scene;
    VolRadiance *out = &k->samples.lanes.out[i];
    double before[3], after[3], t0 = end_time(k, a, i), t1 = end_time(k, b, i);
    taus_of(k, i, terms, before);
    for (int c = 0; c < channels_of(terms); c++)
        after[c] = before[c] + (double)parts->depth[c][i];
    if (scene->layers & VOL_LAYER_Z && isinf(out->depth)) {
        double from = mean_transmittance(before, channels_of(terms)), to = mean_transmittance(after, channels_of(terms));
        double share = to > 0 ? vol_log(from / 0.5) / vol_log(from / to) : 0.5;
        if (to <= 0.5)
            out->depth = t0 + (t1 - t0) * fmin(fmax(share, 0), 1);
    }
    if (scene->trace) {
        VolTraceStep step = {t0, t1, (double)a->field.v[i], (double)b->field.v[i], (double)parts->depth[0][i], 0, "segment"};
        scene->trace(scene->trace_user, &step);
    }
}

/* Light as it comes through what is in front. */
ALWAYS_INLINE void composite(Segments *k, const SegmentLight *light, ints mask, unsigned terms)
{
    reals through[3], zero = reals_all(0);
    for (int c = 0; c < channels_of(terms); c++)
        through[c] = reals_select(mask, reals_exp(-k->depth_so_far[c]), zero);
    for (int c = 0; c < 3; c++) {
        reals T = through[terms & TERM_COLOURED ? c : 0], all = light->scatter[c];
        if (terms & (TERM_CLASSIC | TERM_EXTRA))
            all += light->emit[c];
        if (terms & TERM_SURFACE)
            all += light->surface[c];
        all *= T; /* 0 where not `mask` */
        doubles_add(&k->color[c], terms & (TERM_CLASSIC | TERM_EXTRA) ? reals_select(mask, all, zero) : all);
        if (terms & TERM_EXTRA) {
            doubles_add(&k->scatter[c], reals_select(mask, T * light->scatter[c], zero));
            doubles_add(&k->emit[c], reals_select(mask, T * light->emit[c], zero));
            doubles_add(&k->surface[c], reals_select(mask, T * light->surface[c], zero));
            doubles_add(&k->normal[c], reals_select(mask, through[0] * light->normal[c], zero));
        }
    }
}

/* The segments from a to b of the lanes of `mask`, without isosurfaces, behind what is there. */
ALWAYS_INLINE void add_segments(Segments *k, SegmentEnd *a, SegmentEnd *b, const Doubles *length, ints own, ints mask,
                                bool full, unsigned terms)
{
    const VolScene *scene = k->samples.lanes.scene;
    SegmentParts parts;
    SegmentLight light;
    mask &= something_between(k->samples.lanes.optics, &a->field, &b->field);
    if (!any(mask))
        return;
    k->cells -= mask;
    if (full)
        look_up_full(scene, &a->field, &b->field, length, own, mask, terms, &parts);
    else
        look_up_integrals(scene, &a->field, &b->field, doubles_round(length), mask, terms, &parts);
    for (int c = 0; c < 3; c++)
        light.emit[c] = light.surface[c] = light.normal[c] = reals_all(0);
    particles_light(k, a, b, &parts, mask, terms, &light);
    if (terms & TERM_SURFACE)
        surfaces_light(k, a, b, &parts, mask, full, terms, &light);
    composite(k, &light, mask, terms);
    if (terms & TERM_EXTRA)
        FOR_LANES(i, mask_bits(mask))
            note_segment(k, a, b, &parts, i, terms);
    for (int c = 0; c < channels_of(terms); c++)
        doubles_add(&k->tau[c], reals_select(mask, parts.depth[c], reals_all(0)));
    end_dark(k, mask, terms);
}

/* ---- Isosurfaces ---- */

static void cross(Segments *k, unsigned i, const Delta *delta, SegmentEnd *at, unsigned terms)
{
    Lanes *l = &k->samples.lanes;
    VolRadiance *out = &l->out[i];
    double tau[3];
    taus_of(k, i, terms, tau);
    const Shading *sh = terms & TERM_SHADED ? shading_at(k, at, mask_of(1u << i)) : NULL;
    for (int c = 0; c < 3; c++) {
        real color = sh ? real_fma(sh->k[c][i], delta->color[c], sh->b[c][i]) : delta->color[c];
        double part = vol_exp(-tau[c < channels_of(terms) ? c : 0]) * delta->opacity * (double)color;
        out->surface[c] += part;
        doubles_set(&k->color[c], (int)i, doubles_lane(&k->color[c], (int)i) + part);
        if (sh)
            out->normal[c] += vol_exp(-tau[0]) * delta->opacity * (double)sh->normal[c][i];
    }
    for (int c = 0; c < channels_of(terms); c++) {
        tau[c] += delta->mu;
        doubles_set(&k->tau[c], (int)i, tau[c]);
    }
    if (isinf(out->depth) && mean_transmittance(tau, channels_of(terms)) <= 0.5)
        out->depth = at->cut[i];
    if (l->scene->trace) {
        VolTraceStep step = {at->cut[i], at->cut[i], (double)delta->value, (double)delta->value, delta->mu,
                             (size_t)(delta - l->optics->deltas), "isosurface"};
        l->scene->trace(l->scene->trace_user, &step);
    }
    end_dark(k, mask_of(1u << i), terms);
}

/* A part of a segment, of any length. */
static void add_part(Segments *k, SegmentEnd *a, SegmentEnd *b, unsigned i, double dl, bool full, unsigned terms)
{
    Doubles length;
    memset(&length, 0, sizeof length);
    doubles_set(&length, (int)i, dl);
    if (dl > 0)
        add_segments(k, a, b, &length, ints_all(0), mask_of(1u << i), full, terms);
}

/* One lane's segment, cut at the isosurfaces that it crosses. */
static void add_cut_segment(Segments *k, SegmentEnd *a, SegmentEnd *b, unsigned i, bool full, unsigned terms)
{
    const Optics *o = k->samples.lanes.optics;
    SegmentEnd cuts[2], *from = a;
    ints lane = mask_of(1u << i), alive = k->samples.lanes.alive;
    real va = a->field.v[i], vb = b->field.v[i];
    double ta = end_time(k, a, i), tb = end_time(k, b, i), t = ta;
    bool rising = vb > va;
    /* A ray whose last brick is behind is not alive any more, but has this segment to go. */
    k->samples.lanes.alive |= lane;
    for (size_t n = 0, next = 0; n < o->delta_count && k->samples.lanes.alive[i]; n++) {
        const Delta *delta = &o->deltas[rising ? n : o->falling[n]];
        if ((va < delta->value) == (vb < delta->value))
            continue;
        SegmentEnd *at = &cuts[next];
        next = 1 - next;
        *at = *b;
        at->cut[i] = ta + (tb - ta) * (double)((delta->value - va) / (vb - va));
        at->here = at->shaded = ints_all(0);
        find_end(o, reals_all(delta->value), full && o->lookup.entries, terms, &at->field);
        add_part(k, from, at, i, at->cut[i] - t, full, terms);
        if (k->samples.lanes.alive[i])
            cross(k, i, delta, at, terms);
        from = at;
        t = at->cut[i];
    }
    if (k->samples.lanes.alive[i])
        add_part(k, from, b, i, tb - t, full, terms);
    k->samples.lanes.alive &= ~lane | alive;
}

/* The segments that end at `back`. */
ALWAYS_INLINE void close_segments(Segments *k, ints mask, bool full, unsigned terms)
{
    SegmentEnd *a = k->front, *b = k->back;
    mask &= a->valid & b->valid;
    if (terms & TERM_ISO) {
        const Optics *o = k->samples.lanes.optics;
        ints before = count_up_to(o->delta_values, o->delta_count, a->field.v, false);
        ints cut = mask & (ints)(before != count_up_to(o->delta_values, o->delta_count, b->field.v, false));
        mask &= ~cut;
        FOR_LANES(i, mask_bits(cut))
            add_cut_segment(k, a, b, i, full, terms);
    }
    if (any(mask))
        add_segments(k, a, b, &k->length, k->own, mask, full, terms);
}

/* ---- Rays ---- */

/* What ends at sample n is as long as the scene's step, or the ray's last. */
static void set_length(Segments *k, unsigned i, double n)
{
    const Samples *s = &k->samples;
    bool last = n >= s->last[i];
    double length = last ? sample_time(s, i, n) - sample_time(s, i, n - 1) : s->h;
    k->own[i] = fabs(length - s->h) <= 0x1p-30 * s->h ? -1 : 0;
    doubles_set(&k->length, (int)i, k->own[i] ? s->h : length);
}

static Sample sample_number(Samples *s, unsigned i, double n)
{
    Place place = place_of_sample(s, i, n);
    return sample_at(s, &place);
}

/* Takes lane i on into its next run of samples.  Sample `done` is the last that it has seen. */
static void enter_run(Segments *k, unsigned i)
{
    Samples *s = &k->samples;
    bool begun = s->lanes.in_brick[i];
    double done = begun ? s->first[i] - 1 : -1;
    bool entered = samples_enter(s, i), follows = entered && begun && s->first[i] - 1 == done;
    if (begun && !follows && done >= 0 && done < s->last[i]) {
        Sample tail = sample_number(s, i, done + 1);
        k->tails[i] = -1;
        k->back->field.v[i] = tail.v;
        k->back->valid[i] = tail.valid ? -1 : 0;
        set_length(k, i, done + 1);
    }
    k->front->here[i] = 0;
    if (!entered || follows)
        return;
    Sample head = {0};
    if (s->first[i] > 0)
        head = sample_number(s, i, s->first[i] - 1);
    k->heads[i] = -1;
    k->head_v[i] = head.v;
    k->head_valid[i] = head.valid ? -1 : 0;
}

/* What is asked about ends of segments beside the field. */
enum { TERMS_OF_PLACES = TERM_SHADED | TERM_ISO | TERM_EXTRA };

ALWAYS_INLINE void number_back(Segments *k, ints here)
{
    k->back->here = here;
    k->back->shaded = ints_all(0);
    for (int n = 0; n < LANES / 4; n++)
        k->back->number.part[n] = k->front->number.part[n] + 1;
}

/* The lanes of `heads` begin anew. */
static void start_fronts(Segments *k, bool table, unsigned terms)
{
    const Samples *s = &k->samples;
    SegmentEnd *a = k->front;
    if (!any(k->heads))
        return;
    find_end(s->lanes.optics, reals_select(k->heads, k->head_v, a->field.v), table, terms, &a->field);
    a->valid = ints_select(k->heads, k->head_valid, a->valid);
    a->shaded &= ~k->heads;
    FOR_LANES(i, mask_bits(k->heads))
        doubles_set(&a->number, (int)i, s->first[i] - 1);
}

/* Every lane that is in no run goes on until it is, or its ray has ended. */
static void enter_runs(Segments *k, bool full, unsigned terms)
{
    Samples *s = &k->samples;
    bool table = full && s->lanes.optics->lookup.entries;
    for (;;) {
        unsigned wanted = mask_bits(s->lanes.alive & ~s->visiting);
        if (!wanted)
            return;
        k->tails = k->heads = ints_all(0);
        FOR_LANES(i, wanted)
            enter_run(k, i);
        if (any(k->tails)) {
            find_end(s->lanes.optics, k->back->field.v, table, terms, &k->back->field);
            number_back(k, ints_all(0));
            close_segments(k, k->tails, full, terms);
        }
        start_fronts(k, table, terms);
        FOR_LANES(i, wanted & mask_bits(s->visiting))
            set_length(k, i, s->first[i]);
    }
}

static void segments_begin(Segments *k, const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count,
                           VolRadiance *out)
{
    memset(k, 0, sizeof *k);
    samples_begin(&k->samples, scene, scratch, rays, count, out, 0);
    k->front = &k->ends[0];
    k->back = &k->ends[1];
    for (int i = 0; i < LANES; i++)
        k->ends[0].cut[i] = k->ends[1].cut[i] = NAN;
    for (size_t n = 0; n < scene->light_count; n++)
        k->lit_from_places |= scene->lights[n].kind == VOL_LIGHT_POINT || scene->lights[n].kind == VOL_LIGHT_SPOT;
}

static void store_results(Segments *k)
{
    for (size_t i = 0; i < k->samples.lanes.count; i++) {
        VolRadiance *out = &k->samples.lanes.out[i];
        out->cells = (double)k->cells[i];
        for (int c = 0; c < 3; c++) {
            out->color[c] = doubles_lane(&k->color[c], (int)i);
            out->surface[c] += doubles_lane(&k->surface[c], (int)i);
            out->scatter[c] = doubles_lane(&k->scatter[c], (int)i);
            out->emit[c] = doubles_lane(&k->emit[c], (int)i);
            out->normal[c] += doubles_lane(&k->normal[c], (int)i);
            out->tau[c] = c < k->samples.lanes.optics->channels ? doubles_lane(&k->tau[c], (int)i) : 0;
        }
    }
}

ALWAYS_INLINE void march(Segments *k, bool full, unsigned terms)
{
    Samples *s = &k->samples;
    const Optics *o = s->lanes.optics;
    const bool table = full && o->lookup.entries;
    for (;;) {
        enter_runs(k, full, terms);
        if (!any(s->lanes.alive))
            break;
        int steps = samples_in_step(s);
        for (int n = 0; n < steps; n++) {
            SegmentEnd *end = k->back;
            reals v = samples_value(s, &end->place, &end->valid);
            find_end(o, v, table, terms, &end->field);
            if (terms & TERMS_OF_PLACES)
                number_back(k, s->visiting);
            close_segments(k, s->visiting, full, terms);
            k->back = k->front;
            k->front = end;
            s->j += 1;
        }
        samples_passed(s, steps);
    }
    store_results(k);
}

/* A kernel per set of terms: those that a scene is without cost nothing. */
enum { TERMS_ALL = TERM_SURFACE | TERM_COLOURED | TERM_EMIT | TERM_ISO | TERM_EXTRA };
static void full_particles(Segments *k) { march(k, true, TERM_EMIT); }
static void full_surfaces(Segments *k) { march(k, true, TERM_EMIT | TERM_SURFACE); }
static void full_shaded_surfaces(Segments *k) { march(k, true, TERM_EMIT | TERM_SURFACE | TERM_SHADED); }
static void full_shaded_isosurfaces(Segments *k) { march(k, true, TERM_EMIT | TERM_ISO | TERM_SHADED); }
static void full_unshaded(Segments *k) { march(k, true, TERMS_ALL); }
static void full_shaded(Segments *k) { march(k, true, TERMS_ALL | TERM_SHADED); }
static void full_classic(Segments *k) { march(k, true, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }
static void integrals_particles(Segments *k) { march(k, false, 0); }
static void integrals_unshaded(Segments *k) { march(k, false, TERMS_ALL); }
static void integrals_shaded(Segments *k) { march(k, false, TERMS_ALL | TERM_SHADED); }
static void integrals_classic(Segments *k) { march(k, false, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }

static void trace_segments(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    typedef struct Kernel {
        unsigned terms;
        void (*trace)(Segments *k);
    } Kernel;
    static const Kernel by_tables[] = {{TERM_EMIT, full_particles},
                                       {TERM_EMIT | TERM_SURFACE, full_surfaces},
                                       {TERM_EMIT | TERM_SURFACE | TERM_SHADED, full_shaded_surfaces},
                                       {TERM_EMIT | TERM_ISO | TERM_SHADED, full_shaded_isosurfaces},
                                       {TERMS_ALL, full_unshaded},
                                       {TERMS_ALL | TERM_SHADED, full_shaded},
                                       {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, full_classic}};
    static const Kernel by_integrals[] = {{0, integrals_particles},
                                          {TERMS_ALL, integrals_unshaded},
                                          {TERMS_ALL | TERM_SHADED, integrals_shaded},
                                          {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, integrals_classic}};
    unsigned terms = SCENE_OPTICS(scene)->terms | (scene->layers || scene->trace ? TERM_EXTRA : 0u);
    const unsigned model = TERM_SHADED | TERM_CLASSIC; /* the others are nothing where a scene has none */
    const Kernel *kernel = scene->estimator == VOL_ESTIMATE_FULL ? by_tables : by_integrals;
    while (terms & ~kernel->terms || (terms ^ kernel->terms) & model)
        kernel++;
    for (size_t i = 0; i < count; i += LANES) {
        Segments k;
        segments_begin(&k, scene, scratch, rays + i, count - i < LANES ? count - i : LANES, out + i);
        kernel->trace(&k);
    }
}
