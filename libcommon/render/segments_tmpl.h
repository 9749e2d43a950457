/* The pre-integrated estimators (Y 4.2): the ray is cut into steps of length h from the entry into the domain, the last one
 * shorter; between neighbouring samples the field is taken to run linearly, and what such a segment adds comes from
 *     full        tables over (v0, v1): Y 21-23, surfaces shaded at both ends and blended by their weights
 *     integrals   integrals in one dimension: Y 16-20, no attenuation within the segment of one part by another
 * Second order in h, whatever the transfer function does between the samples.  Isosurfaces are in neither: a segment is
 * cut where it crosses one.
 *
 * The classic model (K 11) and the layers divide the particles' part between scattering and emission as their sources
 * divide by Simpson's rule over the segment. */
#include "render/march_tmpl.h"
#include "tf/preint.h"

typedef struct SegmentEnd {
    double t;
    real v;
    bool valid;
    bool shaded; /* `shading` has been computed */
    Shading shading;
} SegmentEnd;

static SegmentEnd end_at(const March *m, double t)
{
    Sample s = sample_at(m, t);
    return (SegmentEnd){.t = t, .v = s.v, .valid = s.valid};
}

static const Shading *shading_at(const March *m, SegmentEnd *end)
{
    if (!end->shaded)
        shade_here(m, end->t, &end->shading);
    end->shaded = true;
    return &end->shading;
}

/* How the particles' source at v divides. */
static void sources_at(const Optics *optics, real v, double scatter[3], double emit[3])
{
    const Interval *in = &optics->intervals[interval_of(optics, v, 0)];
    real x = v - in->ref, mu = in->has_scatter ? real_max(line_at(in->scatter, x), 0) : 0;
    for (int c = 0; c < 3; c++) {
        scatter[c] = (double)(mu * line_at(in->scatter_color[c], x));
        emit[c] = in->has_emit ? (double)line_at(in->emit[c], x) : 0;
    }
}

/* Fraction of the particles' light in a segment that is scattered, per channel. */
static void scattered_fraction(const Optics *optics, real v0, real v1, double out[3])
{
    double s[3][3], e[3][3];
    if (!optics->emission) {
        out[0] = out[1] = out[2] = 1;
        return;
    }
    sources_at(optics, v0, s[0], e[0]);
    sources_at(optics, (real)0.5 * (v0 + v1), s[1], e[1]);
    sources_at(optics, v1, s[2], e[2]);
    for (int c = 0; c < 3; c++) {
        double scatter = s[0][c] + 4 * s[1][c] + s[2][c], emit = e[0][c] + 4 * e[1][c] + e[2][c];
        out[c] = emit == 0 ? 1 : scatter / (scatter + emit);
    }
}

static real surfaceness_of(const Optics *optics, const Shading *shading, real v)
{
    const Interval *in = &optics->intervals[interval_of(optics, v, 0)];
    return surfaceness_at(optics, in, shading, v - in->ref);
}

/* K 11 at both ends of a segment, averaged: the factor of what it scatters. */
static void classic_average(const March *m, SegmentEnd *a, SegmentEnd *b, double factor[3])
{
    SegmentEnd *ends[2] = {a, b};
    for (int c = 0; c < 3; c++)
        factor[c] = 0;
    for (int i = 0; i < 2; i++) {
        const Shading *sh = shading_at(m, ends[i]);
        real S = surfaceness_of(m->optics, sh, ends[i]->v);
        for (int c = 0; c < 3; c++)
            factor[c] += 0.5 * (double)real_fma(S, sh->k[c] + sh->b[c], 1 - S);
    }
}

/* What a segment adds, seen from its front. */
typedef struct SegmentLight {
    double scatter[3], emit[3], surface[3], normal[3];
    double depth[3]; /* optical depth */
} SegmentLight;

static void particles_light(const March *m, SegmentEnd *a, SegmentEnd *b, const double color[3], double opacity,
                            SegmentLight *out)
{
    double fraction[3], factor[3] = {1, 1, 1};
    bool any = false;
    for (int c = 0; c < 3; c++)
        any = any || color[c] != 0;
    if (!any)
        return;
    scattered_fraction(m->optics, a->v, b->v, fraction);
    if (m->optics->classic && m->scene->shaded) {
        classic_average(m, a, b, factor);
        for (int i = 0; i < 3; i++)
            out->normal[i] += 0.5 * opacity * (double)(a->shading.normal[i] + b->shading.normal[i]);
    }
    for (int c = 0; c < 3; c++) {
        out->scatter[c] = fraction[c] * factor[c] * color[c];
        out->emit[c] = (1 - fraction[c]) * color[c];
    }
}

static void add_surface(SegmentLight *out, const Shading *sh, const double color[3], const double opacity[3])
{
    for (int c = 0; c < 3; c++)
        out->surface[c] += sh ? (double)sh->k[c] * color[c] + (double)sh->b[c] * opacity[c] : color[c];
    for (int i = 0; i < 3 && sh; i++)
        out->normal[i] += opacity[0] * (double)sh->normal[i];
}

static void light_of_full(const March *m, SegmentEnd *a, SegmentEnd *b, SegmentLight *out)
{
    VolPreintSegment s;
    double dl = b->t - a->t;
    /* Pieces cut by isosurfaces and the ray's end are few and of any length: integrated by definition. */
    if (fabs(dl - m->h) > 0x1p-30 * m->h)
        vol_preint_segment(m->scene->tf, (double)a->v, (double)b->v, dl, &s);
    else
        vol_preint_full_at(m->scene->preint, (double)a->v, (double)b->v, dl, &s);
    bool shaded = m->scene->shaded && !m->optics->classic;
    if (s.fw_a[0] > 0 || s.bw_a[0] > 0) {
        add_surface(out, shaded ? shading_at(m, a) : NULL, s.fw_c, s.fw_a);
        add_surface(out, shaded ? shading_at(m, b) : NULL, s.bw_c, s.bw_a);
    }
    particles_light(m, a, b, s.p_c, s.p_a[0], out);
    for (int c = 0; c < 3; c++)
        out->depth[c] = s.depth[c];
}

static void light_of_integrals(const March *m, SegmentEnd *a, SegmentEnd *b, SegmentLight *out)
{
    VolPreintApproximation s;
    vol_preint_integrals_at(m->scene->integrals, (double)a->v, (double)b->v, b->t - a->t, &s);
    if (s.surface_a[0] > 0) {
        Shading at;
        if (m->scene->shaded && !m->optics->classic) { /* Y 20: shading at the value that stands for all surfaces */
            real w = b->v == a->v ? (real)0.5 : ((real)s.v_c - a->v) / (b->v - a->v);
            const Shading *front = shading_at(m, a), *back = shading_at(m, b);
            for (int i = 0; i < 3; i++) {
                at.k[i] = real_fma(w, back->k[i] - front->k[i], front->k[i]);
                at.b[i] = real_fma(w, back->b[i] - front->b[i], front->b[i]);
                at.normal[i] = real_fma(w, back->normal[i] - front->normal[i], front->normal[i]);
            }
            add_surface(out, &at, s.surface_c, s.surface_a);
        } else {
            add_surface(out, NULL, s.surface_c, s.surface_a);
        }
    }
    particles_light(m, a, b, s.particle_c, s.particle_a[0], out);
    for (int c = 0; c < 3; c++)
        out->depth[c] = s.depth[c];
}

static double mean3(const double v[3]) { return (v[0] + v[1] + v[2]) / 3; }

/* One piece without isosurfaces, composited behind what is there. */
static void add_segment(March *m, SegmentEnd *a, SegmentEnd *b)
{
    VolRadiance *out = m->out;
    SegmentLight light = {0};
    if (m->done || !(b->t > a->t))
        return;
    if (m->scene->estimator == VOL_ESTIMATE_FULL)
        light_of_full(m, a, b, &light);
    else
        light_of_integrals(m, a, b, &light);
    bool nothing = true;
    double before = mean3(m->through);
    for (int c = 0; c < 3; c++) {
        double T = m->through[c];
        double parts[3] = {T * light.scatter[c], T * light.emit[c], T * light.surface[c]};
        out->scatter[c] += parts[0];
        out->emit[c] += parts[1];
        out->surface[c] += parts[2];
        out->color[c] += (parts[0] + parts[1]) + parts[2];
        nothing = nothing && light.depth[c] == 0 && light.emit[c] == 0;
    }
    for (int i = 0; i < 3; i++)
        out->normal[i] += m->through[0] * light.normal[i];
    if (nothing)
        return;
    out->cells += 1;
    double passed = vol_exp(-light.depth[0]);
    for (int c = 0; c < 3; c++) {
        out->tau[c] += light.depth[c];
        m->through[c] *= light.depth[c] == light.depth[0] ? passed : vol_exp(-light.depth[c]);
    }
    double after = mean3(m->through);
    if (isinf(out->depth) && after <= 0.5) {
        double share = after > 0 ? vol_log(before / 0.5) / vol_log(before / after) : 0.5;
        out->depth = a->t + (b->t - a->t) * fmin(fmax(share, 0), 1);
    }
    if (m->scene->trace) {
        VolTraceStep s = {a->t, b->t, (double)a->v, (double)b->v, light.depth[0], 0, "segment"};
        m->scene->trace(m->scene->trace_user, &s);
    }
    m->done = march_is_dark(m);
}

/* A step, cut at the isosurfaces that it crosses. */
static void add_step(March *m, SegmentEnd *a, SegmentEnd *b)
{
    const Optics *optics = m->optics;
    if (!a->valid || !b->valid)
        return;
    SegmentEnd cuts[2], *from = a;
    bool rising = b->v > a->v;
    int next = 0;
    for (size_t i = 0; i < optics->delta_count && !m->done; i++) {
        const Delta *delta = &optics->deltas[rising ? i : optics->falling[i]];
        if ((a->v < delta->value) == (b->v < delta->value))
            continue;
        double u = (double)((delta->value - a->v) / (b->v - a->v));
        SegmentEnd *at = &cuts[next];
        next = 1 - next;
        *at = (SegmentEnd){.t = a->t + (b->t - a->t) * u, .v = delta->value, .valid = true};
        add_segment(m, from, at);
        cross_at(m, delta, at->t);
        from = at;
    }
    add_segment(m, from, b);
}

/* From step i on, the steps that lie in one invisible brick from end to end are passed over. */
static size_t pass_invisible_steps(March *m, size_t i)
{
    while (i < m->count) {
        double t = fma((double)i, m->h, m->t0), until = invisible_until(m, t);
        size_t next = i;
        while (next < m->count && step_end(m, next) <= until && until > t) {
            size_t leap = (size_t)((until - t) / m->h); /* all but the last of them at once */
            next = leap > next - i + 1 && step_end(m, i + leap - 1) <= until ? i + leap : next + 1;
        }
        if (next == i)
            return i;
        i = next;
    }
    return i;
}

static void trace_segments(const VolScene *scene, const VolRay *ray, VolRadiance *out)
{
    March m;
    begin_march(&m, scene, ray, out);
    SegmentEnd ends[2];
    size_t known = SIZE_MAX; /* the step whose beginning `ends[known % 2]` is */
    for (size_t i = 0; i < m.count && !m.done; i++) {
        i = pass_invisible_steps(&m, i);
        if (i == m.count)
            break;
        SegmentEnd *a = &ends[i % 2], *b = &ends[1 - i % 2];
        if (known != i)
            *a = end_at(&m, fma((double)i, m.h, m.t0));
        *b = end_at(&m, step_end(&m, i));
        known = i + 1;
        add_step(&m, a, b);
    }
}
