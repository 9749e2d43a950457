/* The direct estimator (Y 4.1): one classified sample in the middle of each step.
 *
 * From the entry into the domain the ray is cut into steps of length h, the last one shorter.  A step has the properties
 * of the field at its middle; the surface term uses |dv/dl| from the neighbouring samples (Y 11: central, one-sided at the
 * ends).  Second order in h where the transfer function is smooth on the scale of a step.  Isosurfaces are crossed between
 * neighbouring samples (at the ends: between the entry or exit and the nearest sample), in the place that linear
 * interpolation gives, and cut the step they lie in. */
#include "render/march_tmpl.h"

typedef struct Step {
    double end;
    real extinction[3], scatter[3], emit[3], surface[3]; /* per world unit */
    real normal[3]; /* weighted by the surface's extinction */
    bool nothing;
} Step;

static double middle(const March *m, size_t i)
{
    double a = fma((double)i, m->h, m->t0);
    double b = i + 1 == m->count ? m->t0 + m->length : fma((double)(i + 1), m->h, m->t0);
    return 0.5 * (a + b);
}

/* What lies at the middle of a step; `before` and `after` are its neighbours. */
static void classify(const March *m, Sample before, Sample here, Sample after, Step *step)
{
    const Optics *optics = m->optics;
    *step = (Step){.nothing = true, .end = step->end};
    if (!here.valid)
        return;
    const Interval *in = &optics->intervals[interval_of(optics, here.v, 0)];
    if (!in->visible)
        return;
    step->nothing = false;
    m->out->cells += 1;
    real x = here.v - in->ref;
    Shading sh;
    bool need_shading = m->scene->shaded && (in->has_surface || (optics->classic && in->has_scatter));
    if (need_shading)
        shade_here(m, here.t, &sh);
    for (int c = 0; c < 3; c++)
        step->extinction[c] = real_max(line_at(in->extinction[c < optics->channels ? c : 0], x), 0);
    real mu = real_max(line_at(in->scatter, x), 0), S = 0;
    if (need_shading && optics->classic)
        S = surfaceness_at(optics, in, &sh, x);
    for (int c = 0; c < 3; c++) {
        real factor = S > 0 ? real_fma(S, sh.k[c] + sh.b[c], 1 - S) : 1;
        step->scatter[c] = mu * line_at(in->scatter_color[c], x) * factor;
        step->emit[c] = line_at(in->emit[c], x);
        if (need_shading)
            step->normal[c] = mu * sh.normal[c];
    }
    if (in->has_surface) {
        Sample a = before.valid ? before : here, b = after.valid ? after : here;
        real slope = b.t > a.t ? real_abs(b.v - a.v) / (real)(b.t - a.t) : 0;
        real surface = slope * real_max(line_at(in->surface, x), 0);
        for (int c = 0; c < 3; c++) {
            real color = line_at(in->surface_color[c], x);
            step->surface[c] = surface * (need_shading ? real_fma(sh.k[c], color, sh.b[c]) : color);
            step->extinction[c] += surface;
            step->normal[c] = need_shading ? surface * sh.normal[c] : 0;
        }
    }
}

/* (1 - exp(-x)) / x */
static real attenuated(real x)
{
    if (x < (real)0.01)
        return real_fma(real_fma(real_fma(x, (real)(-1.0 / 24), (real)(1.0 / 6)), x, (real)-0.5), x, 1);
    return (1 - real_exp(-x)) / x;
}

/* Adds the step's own properties from the cursor to t. */
static void advance(March *m, const Step *step, double t)
{
    VolRadiance *out = m->out;
    if (!(t > m->cursor) || m->done)
        return;
    double dl = t - m->cursor;
    m->cursor = t;
    if (step->nothing)
        return;
    for (int c = 0; c < 3; c++) {
        int ch = c < m->optics->channels ? c : 0;
        real tau = step->extinction[ch] * (real)dl;
        real through = real_exp((real)-out->tau[ch]) * attenuated(tau) * (real)dl;
        real scatter = through * step->scatter[c], emit = through * step->emit[c], surface = through * step->surface[c];
        out->scatter[c] += (double)scatter;
        out->emit[c] += (double)emit;
        out->surface[c] += (double)surface;
        out->color[c] += (double)((scatter + emit) + surface);
        if (c == 0)
            for (int a = 0; a < 3; a++)
                out->normal[a] += (double)(through * step->normal[a]);
    }
    double before[3] = {out->tau[0], out->tau[1], out->tau[2]};
    for (int c = 0; c < m->optics->channels; c++)
        out->tau[c] += (double)(step->extinction[c] * (real)dl);
    if (isinf(out->depth) && march_transmittance(m) <= 0.5) {
        double lo = 0, hi = dl;
        for (int i = 0; i < 40; i++) {
            double mid = 0.5 * (lo + hi), sum = 0;
            for (int c = 0; c < m->optics->channels; c++)
                sum += vol_exp(-(before[c] + (double)step->extinction[c] * mid));
            if (sum / m->optics->channels > 0.5)
                lo = mid;
            else
                hi = mid;
        }
        out->depth = t - dl + hi;
    }
    if (m->scene->trace) {
        VolTraceStep s = {t - dl, t, 0, 0, (double)(step->extinction[0] * (real)dl), 0, "particles"};
        m->scene->trace(m->scene->trace_user, &s);
    }
    m->done = march_is_dark(m);
}

/* The isosurfaces between two neighbouring samples, in the order of the ray. */
static void cross_between(March *m, Sample a, Sample b, const Step *first, const Step *second)
{
    const Optics *optics = m->optics;
    if (!a.valid || !b.valid)
        return;
    bool rising = b.v > a.v;
    size_t n = optics->delta_count;
    for (size_t i = 0; i < n; i++) {
        size_t k = rising ? i : optics->falling[i];
        real value = optics->deltas[k].value;
        if ((a.v < value) == (b.v < value))
            continue;
        double t = a.t + (b.t - a.t) * (double)((value - a.v) / (b.v - a.v));
        if (first)
            advance(m, first, fmin(t, first->end));
        if (second && (!first || t > first->end))
            advance(m, second, t);
        cross_at(m, &optics->deltas[k], t);
    }
}

/* First step whose middle lies beyond t. */
static size_t first_beyond(const March *m, double t, size_t at_least)
{
    double i = floor((t - m->t0) / m->h - 0.5);
    size_t n = i < (double)at_least ? at_least : i > (double)m->count ? m->count : (size_t)i;
    while (n < m->count && middle(m, n) <= t)
        n++;
    return n;
}

/* From step i on, the steps whose middles lie in invisible bricks are passed over. */
static size_t pass_invisible(March *m, size_t i)
{
    while (i < m->count) {
        double t = middle(m, i), until = invisible_until(m, t);
        if (until == t)
            return i;
        i = first_beyond(m, until, i + 1);
    }
    return i;
}

static void march(March *m)
{
    Sample entry = sample_at(m, m->t0), exit = sample_at(m, m->t0 + m->length);
    Sample before = entry, here = {0};
    Step last = {.nothing = true, .end = m->t0}, step;
    size_t known = SIZE_MAX; /* the step that `here` belongs to */
    bool isosurfaces = m->optics->delta_count > 0;
    for (size_t i = 0; i < m->count && !m->done; i++) {
        /* Isosurfaces are looked for between all neighbours; without them invisible stretches are passed over. */
        size_t next = isosurfaces ? i : pass_invisible(m, i);
        if (next != i) {
            i = next;
            if (i == m->count)
                break;
            before = i ? sample_at(m, middle(m, i - 1)) : entry;
            known = SIZE_MAX;
            last = (Step){.nothing = true, .end = i ? step_end(m, i - 1) : m->t0};
            m->cursor = last.end;
        }
        if (known != i)
            here = sample_at(m, middle(m, i));
        Sample after = i + 1 < m->count ? sample_at(m, middle(m, i + 1)) : exit;
        step.end = step_end(m, i);
        classify(m, before, here, after, &step);
        if (isosurfaces)
            cross_between(m, before, here, i ? &last : NULL, &step);
        advance(m, &last, last.end);
        last = step;
        before = here;
        here = after;
        known = i + 1;
    }
    if (m->count && isosurfaces && !m->done)
        cross_between(m, before, exit, &last, NULL);
    advance(m, &last, last.end);
}

static void trace_direct(const VolScene *scene, const VolRay *ray, VolRadiance *out)
{
    March m;
    begin_march(&m, scene, ray, out);
    march(&m);
}
