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
 * in which nothing can be seen (skip.c).  Segments between equal samples of a wide stretch (samples_tmpl.h) are equal, and
 * what many of them send is a geometric series of what one does. */
#include "render/segments_light_tmpl.h"

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
        doubles_set(&k->sums.color[c], (int)i, doubles_lane(&k->sums.color[c], (int)i) + part);
        if (sh)
            out->normal[c] += vol_exp(-tau[0]) * delta->opacity * (double)sh->normal[c][i];
    }
    for (int c = 0; c < channels_of(terms); c++) {
        tau[c] += delta->mu;
        doubles_set(&k->sums.tau[c], (int)i, tau[c]);
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
        k->back->number.part[n] = k->front->number.part[n] + k->samples.stands_for.part[n];
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
    store_sums(&k->sums, &s->lanes);
}

static void full_particles(void *k) { march(k, true, TERM_EMIT); }
static void full_surfaces(void *k) { march(k, true, TERM_EMIT | TERM_SURFACE); }
static void full_shaded_surfaces(void *k) { march(k, true, TERM_EMIT | TERM_SURFACE | TERM_SHADED); }
static void full_shaded_isosurfaces(void *k) { march(k, true, TERM_EMIT | TERM_ISO | TERM_SHADED); }
static void full_unshaded(void *k) { march(k, true, TERMS_ALL); }
static void full_shaded(void *k) { march(k, true, TERMS_ALL | TERM_SHADED); }
static void full_classic(void *k) { march(k, true, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }
static void integrals_particles(void *k) { march(k, false, 0); }
static void integrals_unshaded(void *k) { march(k, false, TERMS_ALL); }
static void integrals_shaded(void *k) { march(k, false, TERMS_ALL | TERM_SHADED); }
static void integrals_classic(void *k) { march(k, false, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }

static void trace_segments(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    static const TermsKernel by_tables[] = {{TERM_EMIT, full_particles},
                                            {TERM_EMIT | TERM_SURFACE, full_surfaces},
                                            {TERM_EMIT | TERM_SURFACE | TERM_SHADED, full_shaded_surfaces},
                                            {TERM_EMIT | TERM_ISO | TERM_SHADED, full_shaded_isosurfaces},
                                            {TERMS_ALL, full_unshaded},
                                            {TERMS_ALL | TERM_SHADED, full_shaded},
                                            {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, full_classic}};
    static const TermsKernel by_integrals[] = {{0, integrals_particles},
                                               {TERMS_ALL, integrals_unshaded},
                                               {TERMS_ALL | TERM_SHADED, integrals_shaded},
                                               {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, integrals_classic}};
    const TermsKernel *kernel = kernel_for(scene, scene->estimator == VOL_ESTIMATE_FULL ? by_tables : by_integrals);
    for (size_t i = 0; i < count; i += LANES) {
        Segments k;
        segments_begin(&k, scene, scratch, rays + i, count - i < LANES ? count - i : LANES, out + i);
        kernel->trace(&k);
    }
}
