/* The direct estimator (Y 4.1): one classified sample in the middle of each step.
 *
 * From the entry into the domain the ray is cut into steps of length h, the last one shorter.  A step has the properties
 * of the field at its middle; within it
 *     color += exp(-tau) q (1 - exp(-x)) / x h,   tau += x,   x = extinction h,
 * q = c_scatter mu_scatter + e + c_surface mu_surface |dv/dl|, |dv/dl| from the neighbouring samples (Y 11: central,
 * one-sided at the ends and beside holes).  Second order in h where the transfer function is smooth on the scale of a step.
 * Isosurfaces are crossed between neighbouring samples (at the ends: between the entry or exit and the nearest sample), in
 * the place that linear interpolation gives, and cut the step they lie in.
 *
 * Equal steps, one behind the other, are one long step of the same properties: where the field is constant over a wide
 * stretch, what lies between its first sample and its last is added in one go.
 *
 * Two ways through the samples.  Where a step depends on its own sample alone, it is added as its sample comes; sums are
 * taken in float within a run of samples, in double from run to run.  Where it depends on its neighbours, a step waits for
 * the next sample: samples are `fed` one after the other, and what a lane holds is the last one, waiting, and its
 * predecessor's value.  Next to stretches that are left out the neighbours are looked up one by one.  What lies farther
 * inside such a stretch cannot matter: touching invisible bricks share the voxels between them, their ranges form one
 * connected range with nothing in it, and no isosurface lies between two samples that no visible brick separates (skip.c
 * sees to those whose shared voxels are all holes).
 *
 * Compiled in files of a few lines each, one per precision and cpu level; and once more for each set of terms that a scene
 * may be without. */
#include "render/direct_waiting_tmpl.h"

/* ---- Rays ---- */

enum { TERMS_WAIT = TERM_SURFACE | TERM_ISO | TERM_SHADED };

/* Lane i goes on to its next run of samples. */
static inline void enter(March *m, unsigned i, unsigned terms)
{
    Samples *s = &m->s;
    if (!samples_enter(s, i)) {
        if (terms & TERMS_WAIT)
            come_to_end(m, i, terms);
        return;
    }
    double first = s->first[i];
    bool alone = first >= s->last[i];
    m->length[i] = (real)(alone ? s->t1[i] - step_begin(s, i, first) : s->h * doubles_lane(&s->stands_for, (int)i));
    if (terms & TERMS_WAIT && (s->left[i] > 0 || terms & TERM_ISO)) {
        m->before[i] = sample_gap(s, i, first);
        if (first == s->brick_first[i]) /* else it follows the last one */
            come_to(m, i, first, terms);
        s->visiting[i] &= s->lanes.alive[i];
    }
}

ALWAYS_INLINE void march(March *m, unsigned terms)
{
    Samples *s = &m->s;
    for (;;) {
        FOR_LANES(i, mask_bits(s->lanes.alive & ~s->visiting))
            enter(m, i, terms);
        if (!any(s->lanes.alive))
            break;
        int steps = samples_in_step(s);
        for (int k = 0; k < steps; k++) {
            if (terms & TERMS_WAIT)
                feed_next(m, terms);
            else
                add_particles(m, terms);
            s->j += 1;
        }
        ints ended = samples_passed(s, steps);
        if (!(terms & TERMS_WAIT) && any(ended))
            sum_runs(m, ended, terms);
    }
    store_sums(&m->sums, &s->lanes);
}

static void march_particles(void *m) { march(m, 0); }
static void march_emission(void *m) { march(m, TERM_EMIT | TERM_COLOURED); }
static void march_alone(void *m) { march(m, TERM_EMIT | TERM_COLOURED | TERM_EXTRA); }
static void march_surfaces(void *m) { march(m, TERM_SURFACE); }
static void march_shaded_surfaces(void *m) { march(m, TERM_SURFACE | TERM_SHADED); }
static void march_shaded_isosurfaces(void *m) { march(m, TERM_ISO | TERM_SHADED); }
static void march_unshaded(void *m) { march(m, TERMS_ALL); }
static void march_shaded(void *m) { march(m, TERMS_ALL | TERM_SHADED); }
static void march_classic(void *m) { march(m, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }

static void trace_direct(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    static const TermsKernel kernels[] = {{0, march_particles},
                                          {TERM_EMIT | TERM_COLOURED, march_emission},
                                          {TERM_EMIT | TERM_COLOURED | TERM_EXTRA, march_alone},
                                          {TERM_SURFACE, march_surfaces},
                                          {TERM_SURFACE | TERM_SHADED, march_shaded_surfaces},
                                          {TERM_ISO | TERM_SHADED, march_shaded_isosurfaces},
                                          {TERMS_ALL, march_unshaded},
                                          {TERMS_ALL | TERM_SHADED, march_shaded},
                                          {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, march_classic}};
    const TermsKernel *kernel = kernel_for(scene, kernels);
    for (size_t i = 0; i < count; i += LANES) {
        March m;
        memset(&m, 0, sizeof m);
        samples_begin(&m.s, scene, scratch, rays + i, count - i < LANES ? count - i : LANES, out + i, 0.5);
        for (int c = 0; c < 3; c++)
            m.through[c] = reals_all(1);
        m.intervals_seen = bits_of_seen(m.s.lanes.optics);
        kernel->trace(&m);
    }
}
