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
 * segment that touches only bricks that are left out adds nothing: the values along it form one connected range in which
 * nothing can be seen (empty_space.c).  Segments between equal samples of a uniform stretch (samples_tmpl.h) are
 * equal, and what many of them send is a geometric series of what one does.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    trace_segments() */
#include "trace/segments_light_tmpl.h"

/* ---- Isosurfaces ---- */

static void cross_in_segment(Segments *k, unsigned i, const Isosurface *isosurface, SegmentEnd *at, unsigned features)
{
    ints lane = mask_of(1u << i);
    const Shading *sh = has_shading(k, features) ? shading_at(k, at, lane, features) : NULL;
    if (features & FEATURE_SHADED)
        check_shading(k, at, reals_all((real)isosurface->opacity), lane, features);
    cross_isosurface(&k->sum, &k->samples.packet, i, isosurface, at->cut[i], sh, features);
    end_opaque_segments(k, lane, features);
}

/* A part of a segment, of any length. */
static void add_part(Segments *k, SegmentEnd *a, SegmentEnd *b, unsigned i, double dl, bool full, unsigned features)
{
    Doubles length;
    memset(&length, 0, sizeof length);
    doubles_set(&length, (int)i, dl);
    if (dl > 0)
        add_segments(k, a, b, &length, ints_all(0), mask_of(1u << i), full, features);
}

/* One lane's segment, cut at the isosurfaces that it crosses. */
static void add_cut_segment(Segments *k, SegmentEnd *a, SegmentEnd *b, unsigned i, bool full, unsigned features)
{
    const TfTables *o = k->samples.packet.tables;
    SegmentEnd cuts[2], *from = a;
    ints lane = mask_of(1u << i), alive = k->samples.packet.alive;
    real va = a->field.v[i], vb = b->field.v[i];
    double ta = end_time(k, a, i), tb = end_time(k, b, i), t = ta;
    bool rising = vb > va;
    real value[LANES];
    /* A ray whose last brick is behind is not alive any more, but has this segment to go. */
    k->samples.packet.alive |= lane;
    for (size_t n = 0, next = 0; n < o->isosurface_count && k->samples.packet.alive[i]; n++) {
        const Isosurface *isosurface = &o->isosurfaces[rising ? n : o->falling[n]];
        if ((va < isosurface->value) == (vb < isosurface->value))
            continue;
        SegmentEnd *at = &cuts[next];
        next = 1 - next;
        *at = *b;
        at->cut[i] = ta + (tb - ta) * (double)((isosurface->value - va) / (vb - va));
        at->here = ints_all(0);
        at->iso = value;
        at->below = ints_all(rising ? -1 : 0);
        value[i] = isosurface->value;
        forget_light(at, ints_all(-1));
        find_end(o, reals_all(isosurface->value), full && o->lookup.entries, features, &at->field);
        add_part(k, from, at, i, at->cut[i] - t, full, features);
        if (k->samples.packet.alive[i])
            cross_in_segment(k, i, isosurface, at, features);
        from = at;
        t = at->cut[i];
    }
    if (k->samples.packet.alive[i])
        add_part(k, from, b, i, tb - t, full, features);
    k->samples.packet.alive &= ~lane | alive;
}

/* The segments that end at `back`. */
ALWAYS_INLINE void close_segments(Segments *k, ints mask, bool full, unsigned features)
{
    SegmentEnd *a = k->front, *b = k->back;
    mask &= a->valid & b->valid;
    if (features & FEATURE_ISO) {
        const TfTables *o = k->samples.packet.tables;
        ints before = count_up_to(o->isosurface_values, o->isosurface_count, a->field.v, false);
        ints cut = mask & (ints)(before != count_up_to(o->isosurface_values, o->isosurface_count, b->field.v, false));
        mask &= ~cut;
        FOR_LANES(i, mask_bits(cut))
            add_cut_segment(k, a, b, i, full, features);
    }
    if (any(mask))
        add_segments(k, a, b, &k->length, k->own, mask, full, features);
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

static Sample sample_number(const Samples *s, unsigned i, double n)
{
    Place place = place_of_sample(s, i, n);
    return sample_at(s, &place);
}

/* Takes lane i on into its next run of samples.  Sample `done` is the last that it has seen. */
static void enter_run(Segments *k, unsigned i)
{
    Samples *s = &k->samples;
    bool begun = s->way.in_stretch[i];
    double done = begun ? s->next[i] - 1 : -1;
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
enum { FEATURES_OF_PLACES = FEATURE_SHADED | FEATURE_ISO | FEATURE_EXTRA | FEATURE_LIT };

ALWAYS_INLINE void number_back(Segments *k, ints here)
{
    k->back->here = here;
    forget_light(k->back, ints_all(-1));
    for (int n = 0; n < PARTS; n++)
        set_part(k->back->number, n, get_part(k->front->number, n) + get_part(k->samples.stands_for, n));
}

/* The lanes of `heads` begin anew. */
static void start_fronts(Segments *k, bool table, unsigned features)
{
    const Samples *s = &k->samples;
    SegmentEnd *a = k->front;
    if (!any(k->heads))
        return;
    find_end(s->packet.tables, reals_select(k->heads, k->head_v, a->field.v), table, features, &a->field);
    a->valid = ints_select(k->heads, k->head_valid, a->valid);
    forget_light(a, k->heads);
    FOR_LANES(i, mask_bits(k->heads))
        a->number[i] = s->first[i] - 1;
}

/* Places in light grids count from the runs' first samples. */
static void move_to_runs(Segments *k, unsigned lanes)
{
    double t[LANES];
    FOR_LANES(i, lanes)
        t[i] = sample_time(&k->samples, i, k->samples.first[i]);
    lit_move(&k->samples.packet, mask_of(lanes), t);
}

/* Every lane that is in no run goes on until it is, or its ray has ended. */
static void enter_runs(Segments *k, bool full, unsigned features)
{
    Samples *s = &k->samples;
    bool table = full && s->packet.tables->lookup.entries;
    for (;;) {
        unsigned wanted = mask_bits(s->packet.alive & ~s->visiting);
        if (!wanted)
            return;
        k->tails = k->heads = ints_all(0);
        FOR_LANES(i, wanted)
            enter_run(k, i);
        if (any(k->tails)) {
            find_end(s->packet.tables, k->back->field.v, table, features, &k->back->field);
            number_back(k, ints_all(0));
            close_segments(k, k->tails, full, features);
        }
        start_fronts(k, table, features);
        if (features & FEATURE_LIT && s->packet.lit)
            move_to_runs(k, wanted & mask_bits(s->visiting));
        FOR_LANES(i, wanted & mask_bits(s->visiting))
            if (!k->own[i] || s->first[i] >= s->last[i])
                set_length(k, i, s->first[i]);
    }
}

static void segments_begin(Segments *k, const VolTraceCall *call, size_t first)
{
    CLEAR_FROM(k, ends);
    samples_begin(&k->samples, call, first, 0, false);
    k->front = &k->ends[0];
    k->back = &k->ends[1];
    for (int i = 0; i < LANES; i++)
        k->ends[0].cut[i] = k->ends[1].cut[i] = NAN;
}

ALWAYS_INLINE void march_segments(Segments *k, bool full, unsigned features)
{
    Samples *s = &k->samples;
    const TfTables *o = s->packet.tables;
    const bool table = full && o->lookup.entries;
    for (;;) {
        enter_runs(k, full, features);
        if (!any(s->packet.alive))
            break;
        int steps = samples_in_step(s, false);
        for (int n = 0; n < steps; n++) {
            SegmentEnd *end = k->back;
            reals v = samples_value(s, false, &end->place, &end->valid);
            find_end(o, v, table, features, &end->field);
            if (features & FEATURES_OF_PLACES)
                number_back(k, s->visiting);
            close_segments(k, s->visiting, full, features);
            k->back = k->front;
            k->front = end;
            s->j += 1;
        }
        samples_passed(s, steps);
    }
    store_sums(&k->sum, &s->packet);
}

static void full_lit(void *k) { march_segments(k, true, FEATURE_EMIT | FEATURE_LIT); }
static void full_particles(void *k) { march_segments(k, true, FEATURE_EMIT); }
static void full_surfaces(void *k) { march_segments(k, true, FEATURE_EMIT | FEATURE_SURFACE); }
static void full_shaded_surfaces(void *k) { march_segments(k, true, FEATURE_EMIT | FEATURE_SURFACE | FEATURE_SHADED); }
static void full_shaded_isosurfaces(void *k) { march_segments(k, true, FEATURE_EMIT | FEATURE_ISO | FEATURE_SHADED); }
static void full_unshaded(void *k) { march_segments(k, true, ALL_FEATURES); }
static void full_shaded(void *k) { march_segments(k, true, ALL_FEATURES | FEATURE_SHADED); }
static void full_classic(void *k) { march_segments(k, true, ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC); }
static void integrals_particles(void *k) { march_segments(k, false, 0); }
static void integrals_unshaded(void *k) { march_segments(k, false, ALL_FEATURES); }
static void integrals_shaded(void *k) { march_segments(k, false, ALL_FEATURES | FEATURE_SHADED); }
static void integrals_classic(void *k) { march_segments(k, false, ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC); }

static void trace_segments(const VolTraceCall *call)
{
    static const FeaturesKernel by_tables[] = {{FEATURE_EMIT, full_particles},
                                               {FEATURE_EMIT | FEATURE_LIT, full_lit},
                                               {FEATURE_EMIT | FEATURE_SURFACE, full_surfaces},
                                               {FEATURE_EMIT | FEATURE_SURFACE | FEATURE_SHADED, full_shaded_surfaces},
                                               {FEATURE_EMIT | FEATURE_ISO | FEATURE_SHADED, full_shaded_isosurfaces},
                                               {ALL_FEATURES, full_unshaded},
                                               {ALL_FEATURES | FEATURE_SHADED, full_shaded},
                                               {ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, full_classic}};
    static const FeaturesKernel by_integrals[] = {{0, integrals_particles},
                                                  {ALL_FEATURES, integrals_unshaded},
                                                  {ALL_FEATURES | FEATURE_SHADED, integrals_shaded},
                                                  {ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, integrals_classic}};
    bool full = call->prepared->scene->estimator == VOL_ESTIMATE_FULL;
    const FeaturesKernel *kernel = full ? kernel_for(call, by_tables, sizeof by_tables / sizeof *by_tables)
                                        : kernel_for(call, by_integrals, sizeof by_integrals / sizeof *by_integrals);
    for (size_t i = 0; i < call->count; i += LANES) {
        Segments k;
        segments_begin(&k, call, i);
        kernel->trace(&k);
    }
}
