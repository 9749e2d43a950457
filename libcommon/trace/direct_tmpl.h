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
 * connected range with nothing in it, and no isosurface lies between two samples that no visible brick separates
 * (empty_space.c sees to those whose shared voxels are all invalid).
 *
 * Compiled in files of a few lines each, one per precision and cpu level; and once more for each set of features that a
 * scene may be without.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    trace_direct() */
#include "trace/direct_waiting_tmpl.h"

/* ---- Rays ---- */

enum { FEATURES_THAT_WAIT = FEATURE_SURFACE | FEATURE_ISO | FEATURE_SHADED };

/* Places in light grids count from the run's first sample. */
static inline void move_to_run(Samples *s, unsigned i)
{
    double t[LANES];
    t[i] = sample_time(s, i, s->first[i]);
    lit_move(&s->packet, mask_of(1u << i), t);
}

/* Lane i goes on to its next run of samples. */
static inline void enter(March *m, unsigned i, unsigned features)
{
    Samples *s = &m->s;
    if (!samples_enter(s, i)) {
        if (features & FEATURES_THAT_WAIT)
            come_to_end(m, i, features);
        return;
    }
    double first = s->first[i];
    bool alone = first >= s->last[i];
    m->length[i] = (real)(alone ? s->t1[i] - step_begin(s, i, first) : s->h * s->stands_for[i]);
    if (features & FEATURES_THAT_WAIT && (s->left[i] > 0 || features & FEATURE_ISO)) {
        m->before[i] = sample_gap(s, i, first);
        if (first == s->stretch_first[i]) /* else it follows the last one */
            come_to(m, i, first, features);
        s->visiting[i] &= s->packet.alive[i];
    }
    if (features & FEATURE_LIT && s->packet.lit)
        move_to_run(s, i);
}

/* The rays go on together. */
ALWAYS_INLINE void enter_together(March *m)
{
    Samples *s = &m->s;
    ints mask = s->packet.alive;
    samples_visit(s, mask);
    mask &= s->packet.alive;
    wide lengths[PARTS];
    wide_mask is_last[PARTS];
    for (int n = 0; n < PARTS; n++) {
        lengths[n] = get_part(s->stands_for, n) * s->h;
        is_last[n] = (wide_mask)(get_part(s->first, n) >= get_part(s->last, n));
    }
    m->length = reals_select(mask, reals_joined(lengths), m->length);
    FOR_LANES(i, mask_bits(mask & masks_joined(is_last)))
        m->length[i] = (real)(s->t1[i] - step_begin(s, i, s->first[i]));
}

ALWAYS_INLINE void march_samples(March *m, unsigned features, bool together)
{
    Samples *s = &m->s;
    for (;;) {
        if (together) {
            while (any(s->packet.alive) && !any(s->visiting))
                enter_together(m);
        } else {
            FOR_LANES(i, mask_bits(s->packet.alive & ~s->visiting))
                enter(m, i, features);
        }
        if (!any(s->packet.alive))
            break;
        int steps = samples_in_step(s, together);
        for (int k = 0; k < steps; k++) {
            if (features & FEATURES_THAT_WAIT)
                feed_next(m, features);
            else
                add_particles(m, features, together);
            s->j += 1;
        }
        ints ended = samples_passed(s, steps);
        if (!(features & FEATURES_THAT_WAIT) && any(ended))
            sum_runs(m, ended, features);
    }
    store_sums(&m->sum, &s->packet);
}

static void march_particles_together(void *m) { march_samples(m, 0, true); }
static void march_emission_together(void *m) { march_samples(m, FEATURE_EMIT | FEATURE_COLOURED, true); }
static void march_particles(void *m) { march_samples(m, 0, false); }
static void march_emission(void *m) { march_samples(m, FEATURE_EMIT | FEATURE_COLOURED, false); }
static void march_alone(void *m) { march_samples(m, FEATURE_EMIT | FEATURE_COLOURED | FEATURE_EXTRA, false); }
static void march_lit(void *m) { march_samples(m, FEATURE_LIT, false); }
static void march_surfaces(void *m) { march_samples(m, FEATURE_SURFACE, false); }
static void march_shaded_surfaces(void *m) { march_samples(m, FEATURE_SURFACE | FEATURE_SHADED, false); }
static void march_shaded_isosurfaces(void *m) { march_samples(m, FEATURE_ISO | FEATURE_SHADED, false); }
static void march_unshaded(void *m) { march_samples(m, ALL_FEATURES, false); }
static void march_shaded(void *m) { march_samples(m, ALL_FEATURES | FEATURE_SHADED, false); }
static void march_classic(void *m) { march_samples(m, ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, false); }

static void trace_direct(const VolTraceCall *call)
{
    static const FeaturesKernel kernels[] = {{0, march_particles},
                                             {FEATURE_EMIT | FEATURE_COLOURED, march_emission},
                                             {FEATURE_LIT, march_lit},
                                             {FEATURE_EMIT | FEATURE_COLOURED | FEATURE_EXTRA, march_alone},
                                             {FEATURE_SURFACE, march_surfaces},
                                             {FEATURE_SURFACE | FEATURE_SHADED, march_shaded_surfaces},
                                             {FEATURE_ISO | FEATURE_SHADED, march_shaded_isosurfaces},
                                             {ALL_FEATURES, march_unshaded},
                                             {ALL_FEATURES | FEATURE_SHADED, march_shaded},
                                             {ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, march_classic}};
    /* The first of them once more, for rays that are near one another: lanes wait, and a brick is entered once for all.
     * Where samples cost more, as where an interval has to be searched among many, waiting costs more than that saves. */
    static const FeaturesKernel together[] = {{0, march_particles_together},
                                              {FEATURE_EMIT | FEATURE_COLOURED, march_emission_together}};
    const FeaturesKernel *kernel = kernel_for(call, kernels, sizeof kernels / sizeof *kernels);
    size_t number = (size_t)(kernel - kernels);
    bool may_wait = number < sizeof together / sizeof *together && PREPARED_TABLES(call->prepared)->knot_count <= FEW_KNOTS;
    for (size_t i = 0; i < call->count; i += LANES) {
        March m;
        CLEAR_FROM(&m, length);
        samples_begin(&m.s, call, i, 0.5, may_wait);
        for (int c = 0; c < 3; c++)
            m.transmittance[c] = reals_all(1);
        m.intervals_seen = bits_of_seen(m.s.packet.tables);
        (m.s.way.together ? &together[number] : kernel)->trace(&m);
    }
}
