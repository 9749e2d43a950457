/* What LANES segments send, shaded and composited, for the pre-integrated estimators (segments_tmpl.h has the derivation).
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    Segments, SegmentEnd, add_segments(), shading_at(), end_time(), end_opaque_segments() */
#ifndef VOL_TRACE_SEGMENTS_LIGHT_TMPL_H
#define VOL_TRACE_SEGMENTS_LIGHT_TMPL_H

#include "trace/lookup_tmpl.h"
#include "trace/samples_tmpl.h"

/* One end of each lane's segment, and its shading once that was asked for. */
typedef struct SegmentEnd {
    LookupEnd field;
    ints valid;           /* there is one, and not in a hole */
    double number[LANES]; /* of the sample, */
    double cut[LANES];    /* or where on the ray an isosurface cuts; else NAN */
    const real *iso;      /* its value, and whether it is seen from below; NULL: this is no cut */
    ints below;
    ints here;            /* the sample lies in the brick that the lane is in: */
    SamplePlaces place;
    ints shaded;
    Shading shading;
    reals steepest; /* of the gradients nearby */
    ints lit_known;
    reals lit[3];   /* where there are light grids, the light on what scatters */
} SegmentEnd;

typedef struct Segments {
    Samples samples;
    SegmentEnd ends[2], *front, *back;
    Doubles length;             /* of the segments of this run, world units */
    ints own;                   /* these are of the scene's step */
    ints tails;                 /* segments that are to be closed by a sample in another brick: `back` */
    ints heads;                 /* lanes in whose run the first segment begins in another brick: */
    reals head_v;
    ints head_valid;
    Accumulator sum;
} Segments;

static inline double end_time(const Segments *k, const SegmentEnd *end, unsigned i)
{
    return isnan(end->cut[i]) ? sample_time(&k->samples, i, end->number[i]) : end->cut[i];
}

/* ---- Shading ---- */

static inline Place place_of_end(const Segments *k, const SegmentEnd *end, unsigned i)
{
    bool cut = !isnan(end->cut[i]);
    return cut ? place_of_time(&k->samples, i, end->cut[i]) : place_of_sample(&k->samples, i, end->number[i]);
}

/* For lights that stand somewhere. */
static Times end_times(const Segments *k, const SegmentEnd *end, ints mask)
{
    double t[LANES] = {0};
    if (__builtin_expect(!k->samples.packet.prepared->lit_from_places, 1))
        return time_of(0);
    FOR_LANES(i, mask_bits(mask))
        t[i] = end_time(k, end, i);
    return times_of(t);
}

/* Where ends are in light grids. */
static reals lit_places(const Segments *k, const SegmentEnd *end, ints mask)
{
    double t[LANES] = {0};
    FOR_LANES(i, mask_bits(mask))
        t[i] = end_time(k, end, i);
    return lit_place(&k->samples.packet, mask, t);
}

/* The light on what scatters at these ends, looked up where it was not yet. */
static const reals *light_at(Segments *k, SegmentEnd *end, ints mask)
{
    ints wanted = mask & ~end->lit_known;
    if (any(wanted)) {
        reals at = lit_places(k, end, wanted), fresh[1][3];
        lit_on_particles(&k->samples.packet, 1, &at, wanted, fresh);
        for (int c = 0; c < 3; c++)
            end->lit[c] = reals_select(wanted, fresh[0][c], end->lit[c]);
        end->lit_known |= wanted;
    }
    return end->lit;
}

/* What one end of a segment has seen of light is not known of another. */
static inline void forget_light(SegmentEnd *end, ints mask)
{
    end->shaded &= ~mask;
    end->lit_known &= ~mask;
}

static void shade_lanes_at(Segments *k, SegmentEnd *end, ints mask, unsigned features, Shading *out)
{
    Samples *s = &k->samples;
    const bool is_lit = features & FEATURE_LIT && s->packet.lit;
    const reals at = is_lit ? lit_places(k, end, mask) : reals_all(0);
    const bool follows = !(features & FEATURE_CLASSIC) || end->iso;
    const LitPlaces places = {&at, mask, follows ? mask : ints_all(0), end->iso, end->below};
    if (!(features & FEATURE_SHADED)) {
        light_evenly(&s->packet, 1, &places, out);
        return;
    }
    Times times = end_times(k, end, mask);
    ints here = mask & end->here;
    reals gradient[3], steepest = traversal_sample_gradients(&s->way, &s->packet, &end->place, here, gradient);
    FOR_LANES(i, mask_bits(mask & ~here)) {
        Place place = place_of_end(k, end, i);
        real g[3];
        steepest[i] = traversal_gradient(&s->way, &s->packet, &place, g);
        for (int a = 0; a < 3; a++)
            gradient[a][i] = g[a];
    }
    end->steepest = reals_select(mask, steepest, end->steepest);
    shade_lanes(&s->packet, gradient, &times, is_lit ? &places : NULL, out);
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

/* Whether surfaces have a shading: where they are shaded, or lit all the same. */
ALWAYS_INLINE bool has_shading(const Segments *k, unsigned features)
{
    return features & FEATURE_SHADED || (features & FEATURE_LIT && k->samples.packet.lit);
}

/* The shading at these ends, computed where it was not yet. */
static const Shading *shading_at(Segments *k, SegmentEnd *end, ints mask, unsigned features)
{
    ints wanted = mask & ~end->shaded;
    if (any(wanted)) {
        Shading fresh;
        shade_lanes_at(k, end, wanted, features, &fresh);
        shading_replace(&end->shading, wanted, &fresh);
        end->shaded |= wanted;
    }
    return &end->shading;
}

/* ---- What a segment sends ---- */

/* How the particles' source at v divides, added with a weight. */
ALWAYS_INLINE void add_sources(const TfTables *o, reals v, ints interval, real weight, reals scatter[3], reals emit[3])
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
static void scattered_fractions(const TfTables *o, const LookupEnd *a, const LookupEnd *b, unsigned features, reals out[3])
{
    reals scatter[3] = {0}, emit[3] = {0}, one = reals_all(1);
    for (int c = 0; c < 3; c++)
        out[c] = one;
    if (!(features & FEATURE_EMIT))
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

/* Segments that stand for many equal ones: lights that stand somewhere by their mean over all of them. */
MAYBE_UNUSED static void shade_equals(const Segments *k, const SegmentEnd *a, const SegmentEnd *b, const SegmentParts *parts,
                                      ints mask, Shading *sh)
{
    const RayPacket *l = &k->samples.packet;
    FOR_LANES(i, mask_bits(mask & (ints)(samples_beside(&k->samples, mask) > 0))) {
        double t0 = end_time(k, a, i), t1 = end_time(k, b, i), depth[3], mean[3];
        for (int c = 0; c < 3; c++)
            depth[c] = (double)parts->optical_depth[c < l->tables->channels ? c : 0][i] * k->samples.stands_for[i];
        vol_lights_mean(l->scene, &l->rays[i], l->prepared->nearest_light, t0, t1, depth, mean);
        shade_evenly(l->tables, i, mean, sh);
    }
}

/* Ends rays of `mask` on which rounding of the shading at `end` shows, in what is `shown` of it. */
MAYBE_UNUSED static void end_unsure_segments(Segments *k, const SegmentEnd *end, reals shown, ints mask, unsigned features)
{
    Samples *s = &k->samples;
    const Times times = end_times(k, end, mask);
    reals steepest = end->steepest, doubt = doubt_of(&s->packet, &end->shading, steepest, &times);
    ints lost = where_doubt_shows(&k->sum, doubt, shown, mask, features);
    if (!any(lost))
        return;
    FOR_LANES(i, mask_bits(lost)) { /* the gradients that it comes from may be less steep */
        Place place = place_of_end(k, end, i);
        real g[3];
        steepest[i] = traversal_gradient(&s->way, &s->packet, &place, g);
    }
    doubt = doubt_of(&s->packet, &end->shading, steepest, &times);
    lost = where_doubt_shows(&k->sum, doubt, shown, lost, features);
    give_up(&s->packet, lost);
    s->visiting &= ~lost;
}

ALWAYS_INLINE void check_shading(Segments *k, const SegmentEnd *end, reals shown, ints mask, unsigned features)
{
    ints unsure = may_be_unsure(&k->samples.packet, &end->shading, end->steepest, shown, mask);
    if (__builtin_expect(any(unsure), 0))
        end_unsure_segments(k, end, shown, unsure, features);
}

/* K 11 at both ends, averaged: the factor of what a segment scatters. */
static void classic_average(Segments *k, SegmentEnd *a, SegmentEnd *b, const SegmentParts *parts, ints mask,
                            unsigned features, reals factor[3], Light *light)
{
    const TfTables *o = k->samples.packet.tables;
    SegmentEnd *ends[2] = {a, b};
    for (int c = 0; c < 3; c++)
        factor[c] = reals_all(0);
    const bool even = k->samples.packet.prepared->lit_from_places && k->samples.equals;
    Shading equals;
    for (int n = 0; n < 2; n++) {
        const Shading *sh = shading_at(k, ends[n], mask, features);
        check_shading(k, ends[n], parts->particles_a, mask, features);
        if (__builtin_expect(even, 0)) {
            equals = *sh;
            shade_equals(k, a, b, parts, mask, &equals);
            sh = &equals;
        }
        reals in[4] = {{0}}, line[4] = {{0}}, one_end[3];
        load_interval(o, ends[n]->field.interval, AT_PARTICLES, in);
        load_interval(o, ends[n]->field.interval, AT_EMIT + 4, line);
        const bool is_lit = features & FEATURE_LIT && k->samples.packet.lit;
        classic_factors_at(o, ends[n]->field.v - in[0], line + 2, sh, is_lit ? light_at(k, ends[n], mask) : NULL, one_end);
        for (int c = 0; c < 3; c++) {
            factor[c] += (real)0.5 * one_end[c];
            reals normal = (real)0.5 * parts->particles_a * sh->normal[c];
            light->normal[c] += reals_select(mask, normal, reals_all(0));
        }
    }
}

/* The light on what scatters, averaged over both ends of a segment. */
static void light_average(Segments *k, SegmentEnd *a, SegmentEnd *b, ints mask, reals factor[3])
{
    const reals *front = light_at(k, a, mask), *back = light_at(k, b, mask);
    for (int c = 0; c < 3; c++)
        factor[c] = (real)0.5 * (front[c] + back[c]);
}

ALWAYS_INLINE void particles_light(Segments *k, SegmentEnd *a, SegmentEnd *b, const SegmentParts *parts, ints mask,
                                   unsigned features, Light *light)
{
    const TfTables *o = k->samples.packet.tables;
    const bool is_lit = features & FEATURE_LIT && k->samples.packet.lit;
    if (!(features & FEATURE_CLASSIC) && !(features & FEATURE_EXTRA && k->samples.packet.extra) && !is_lit) {
        for (int c = 0; c < 3; c++)
            light->scatter[c] = parts->particles_c[c];
        return;
    }
    reals fraction[3], factor[3] = {reals_all(1), reals_all(1), reals_all(1)};
    scattered_fractions(o, &a->field, &b->field, features, fraction);
    ints some = {0};
    for (int c = 0; c < 3; c++)
        some |= mask & (ints)(parts->particles_c[c] * fraction[c] != 0);
    if (features & FEATURE_CLASSIC && any(some))
        classic_average(k, a, b, parts, some, features, factor, light);
    else if (is_lit && any(some))
        light_average(k, a, b, some, factor);
    for (int c = 0; c < 3; c++) {
        light->scatter[c] = fraction[c] * factor[c] * parts->particles_c[c];
        light->emit[c] = (1 - fraction[c]) * parts->particles_c[c];
    }
}

ALWAYS_INLINE void add_surface(const Shading *sh, const reals color[3], const reals opacity[3], unsigned features,
                               Light *light)
{
    for (int c = 0; c < 3; c++) {
        if (sh && !(features & FEATURE_CLASSIC))
            light->surface[c] += shaded_color(sh, c, color[c], opacity[features & FEATURE_COLOURED ? c : 0]);
        else
            light->surface[c] += color[c];
    }
    for (int i = 0; i < 3 && features & FEATURE_SHADED && features & FEATURE_EXTRA; i++)
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
                                  unsigned features, Light *light)
{
    const Shading *front = NULL, *back = NULL;
    Shading between;
    ints some = mask & (full ? (ints)(parts->front_a[0] > 0) | (ints)(parts->back_a[0] > 0) : (ints)(parts->front_a[0] > 0));
    if (!any(some))
        return;
    if (has_shading(k, features)) {
        front = shading_at(k, a, some, features);
        back = shading_at(k, b, some, features);
        if (features & FEATURE_SHADED) {
            check_shading(k, a, parts->front_a[0], some, features);
            check_shading(k, b, full ? parts->back_a[0] : parts->front_a[0], some, features);
        }
        if (!full) {
            mix_shading(front, back, parts->where, &between);
            front = &between;
        }
    }
    add_surface(front, parts->front_c, parts->front_a, features, light);
    if (full)
        add_surface(back, parts->back_c, parts->back_a, features, light);
    for (int c = 0; c < 3; c++)
        light->surface[c] = reals_select(some, light->surface[c], reals_all(0));
}

/* ---- Compositing ---- */

static inline void end_opaque_segments(Segments *k, ints mask, unsigned features)
{
    k->samples.visiting &= ~terminate_rays(&k->sum, &k->samples.packet, mask & k->samples.packet.alive, features);
}

typedef struct SegmentSoFar {
    double before[3], own[3]; /* optical depth in front of it, and its own, in which depth grows evenly */
    int channels;
} SegmentSoFar;

MAYBE_UNUSED static void depth_of_segment(const void *part, unsigned i, double u, double optical_depth[3])
{
    const SegmentSoFar *s = part;
    (void)i;
    for (int c = 0; c < s->channels; c++)
        optical_depth[c] = fma(u, s->own[c], s->before[c]);
}

/* What only layers and listeners ask for. */
MAYBE_UNUSED static void note_segment(Segments *k, const SegmentEnd *a, const SegmentEnd *b, const SegmentParts *parts,
                                      unsigned i, unsigned features)
{
    RayPacket *l = &k->samples.packet;
    double t0 = end_time(k, a, i), t1 = end_time(k, b, i);
    SegmentSoFar so_far = {.channels = channels_of(features)};
    optical_depths_of(&k->sum, i, features, so_far.before);
    for (int c = 0; c < so_far.channels; c++)
        so_far.own[c] = (so_far.before[c] + (double)parts->optical_depth[c][i]) - so_far.before[c];
    if (wants_depth(l, i)) {
        double share = share_up_to_half(depth_of_segment, &so_far, i, so_far.channels);
        if (share <= 1)
            l->out[i].depth = t0 + (t1 - t0) * share;
    }
    tell(l, &(VolTraceStep){t0, t1, (double)a->field.v[i], (double)b->field.v[i], (double)parts->optical_depth[0][i], 0,
                            "segment"});
}

/* Light as it comes through what is in front. */
ALWAYS_INLINE void composite(Segments *k, const Light *light, ints mask, unsigned features)
{
    reals transmittance[3], zero = reals_all(0);
    Light seen;
    for (int c = 0; c < channels_of(features); c++)
        transmittance[c] = reals_select(mask, reals_exp(-k->sum.reached[c]), zero);
    for (int c = 0; c < 3; c++) {
        reals T = transmittance[features & FEATURE_COLOURED ? c : 0], all = light->scatter[c];
        if (features & (FEATURE_CLASSIC | FEATURE_EXTRA | FEATURE_LIT))
            all += light->emit[c];
        if (features & FEATURE_SURFACE)
            all += light->surface[c];
        all *= T; /* 0 where not `mask` */
        if (features & (FEATURE_CLASSIC | FEATURE_EXTRA | FEATURE_LIT))
            all = reals_select(mask, all, zero);
        doubles_add(&k->sum.color[c], all);
        seen.scatter[c] = reals_select(mask, T * light->scatter[c], zero);
        seen.emit[c] = reals_select(mask, T * light->emit[c], zero);
        seen.surface[c] = reals_select(mask, T * light->surface[c], zero);
        seen.normal[c] = reals_select(mask, transmittance[0] * light->normal[c], zero);
    }
    add_layers(&k->sum, &k->samples.packet, &seen, features);
}

/* The light of m equal segments, one behind the other, is that of one times this: the sum of exp(-n depth) over n < m. */
static double sent_by_equals(double depth, double m)
{
    double one = vol_expm1(-depth);
    return one < 0 ? vol_expm1(-m * depth) / one : m;
}

/* The segments that stand for many equal ones. */
static void add_equals(Segments *k, SegmentParts *parts, Light *light, ints mask, unsigned features)
{
    ints beside = samples_beside(&k->samples, mask);
    k->sum.cells += beside;
    FOR_LANES(i, mask_bits((ints)(beside > 0))) {
        double m = k->samples.stands_for[i];
        real sent[3];
        for (int c = 0; c < channels_of(features); c++) {
            sent[c] = (real)sent_by_equals((double)parts->optical_depth[c][i], m);
            parts->optical_depth[c][i] = (real)((double)parts->optical_depth[c][i] * m);
        }
        for (int c = 0; c < 3; c++) {
            real more = sent[features & FEATURE_COLOURED ? c : 0];
            light->scatter[c][i] *= more;
            light->emit[c][i] *= more;
            light->surface[c][i] *= more;
            light->normal[c][i] *= sent[0];
        }
    }
}

/* The segments from a to b of the lanes of `mask`, without isosurfaces, behind what is there. */
ALWAYS_INLINE void add_segments(Segments *k, SegmentEnd *a, SegmentEnd *b, const Doubles *length, ints own, ints mask,
                                bool full, unsigned features)
{
    const VolPrepared *prepared = k->samples.packet.prepared;
    SegmentParts parts;
    Light light;
    mask &= something_between(k->samples.packet.tables, &a->field, &b->field, features);
    if (!any(mask))
        return;
    k->sum.cells -= mask;
    if (full)
        look_up_full(prepared, &a->field, &b->field, length, own, mask, features, &parts);
    else
        look_up_integrals(prepared, &a->field, &b->field, doubles_round(length), mask, features, &parts);
    for (int c = 0; c < 3; c++)
        light.emit[c] = light.surface[c] = light.normal[c] = reals_all(0);
    particles_light(k, a, b, &parts, mask, features, &light);
    if (features & FEATURE_SURFACE)
        surfaces_light(k, a, b, &parts, mask, full, features, &light);
    if (__builtin_expect(k->samples.equals, 0))
        add_equals(k, &parts, &light, mask, features);
    composite(k, &light, mask, features);
    if (features & FEATURE_EXTRA && k->samples.packet.extra)
        FOR_LANES(i, mask_bits(mask))
            note_segment(k, a, b, &parts, i, features);
    for (int c = 0; c < channels_of(features); c++)
        doubles_add(&k->sum.optical_depth[c], reals_select(mask, parts.optical_depth[c], reals_all(0)));
    end_opaque_segments(k, mask, features);
}

#endif
