/* Steps of the direct estimator (direct_tmpl.h has the derivation): their light, and those that depend on their own sample
 * alone.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    March, Step, Fed; particles_of(), note_step(), end_opaque_marches();
 *             add_particles(), sum_runs() */
#ifndef VOL_TRACE_DIRECT_STEPS_TMPL_H
#define VOL_TRACE_DIRECT_STEPS_TMPL_H

#include "trace/samples_tmpl.h"

/* A sample with what its step needs. */
typedef struct Fed {
    reals v, before;     /* the field; the distance from the sample before it */
    ints valid;          /* not in a hole */
    ints own;            /* a step belongs to it that may be something */
    ints interval, isosurfaces_below; /* of the transfer function; isosurfaces up to v */
    reals lit[3];        /* the light on what scatters, where there are light grids */
    reals length;        /* of the step */
    reals gradient[3], steepest; /* world space, where the step is shaded; of those that it comes from */
    Doubles number;
} Fed;

typedef struct March {
    Samples s;
    reals length;                /* of the run's steps */
    Accumulator sum;

    /* Steps that depend on their own sample alone: within the run. */
    reals transmittance[3];            /* transmittance of what lies before the sample */
    reals run_optical_depth[3], run_color[3];
    ints intervals_seen;         /* bit j: interval j is something; for few knots */

    /* Steps that wait for the next sample. */
    reals before;                /* distance from the run's next sample to the one before it */
    Fed last;                    /* fed last, where `waiting` */
    ints waiting, valid_before;
    reals v_before;              /* the sample's before that */
    ints isosurfaces_before;
    double cursor[LANES];        /* the steps are added up to here */
} March;

/* Per world unit. */
typedef struct Step {
    reals extinction[3], scatter[3], emit[3], surface[3], normal[3];
} Step;

/* ---- What only layers and traces ask for ---- */

typedef struct StepSoFar {
    const Step *step;
    const double *before; /* optical depth in front of it */
    double length;
    int channels;
} StepSoFar;

MAYBE_UNUSED static void depth_of_step(const void *part, unsigned i, double u, double optical_depth[3])
{
    const StepSoFar *s = part;
    for (int c = 0; c < s->channels; c++)
        optical_depth[c] = s->before[c] + (double)s->step->extinction[c][i] * (s->length * u);
}

/* A part of a step of lane i, from t on, behind `before`. */
MAYBE_UNUSED static void note_step(March *m, unsigned i, const Step *step, double t, real length, const double before[3],
                                   int channels)
{
    RayPacket *l = &m->s.packet;
    StepSoFar so_far = {step, before, (double)length, channels};
    tell(l, &(VolTraceStep){t, t + so_far.length, 0, 0, (double)step->extinction[0][i] * so_far.length, 0, "particles"});
    if (!wants_depth(l, i))
        return;
    double share = share_up_to_half(depth_of_step, &so_far, i, channels);
    if (share <= 1)
        l->out[i].depth = t + share * so_far.length;
}

/* ---- Steps that depend on their own sample alone ---- */

ALWAYS_INLINE void particles_of(const Properties *in, reals x, unsigned features, Step *step)
{
    const reals zero = reals_all(0);
    reals scatter = reals_max(property_at(in->scatter, x), zero);
    for (int c = 0; c < channels_of(features); c++)
        step->extinction[c] = reals_max(property_at(in->extinction[c], x), zero);
    for (int c = 0; c < 3; c++) {
        step->scatter[c] = scatter * property_at(in->scatter_color[c], x);
        step->emit[c] = features & FEATURE_EMIT ? property_at(in->emit[c], x) : zero;
    }
}

/* As intervals_visible, without a look into memory for each lane where there are few. */
ALWAYS_INLINE ints seen_intervals(const March *m, const TfTables *o, ints j)
{
    if (o->knot_count <= FEW_KNOTS)
        return m->intervals_seen << (8 * sizeof(lane_int) - 1 - j) < 0;
    return intervals_visible(o, j);
}

static ints bits_of_seen(const TfTables *o)
{
    lane_int bits = 0;
    for (size_t j = 0; j <= o->knot_count && j <= FEW_KNOTS; j++)
        bits |= (lane_int)interval_visible(o, j) << j;
    return ints_all(bits);
}

ALWAYS_INLINE void add_particles(March *m, unsigned features, bool together)
{
    const TfTables *o = m->s.packet.tables;
    SamplePlaces at;
    ints valid;
    reals v = samples_value(&m->s, together, &at, &valid);
    ints interval = intervals_of(o, v), seen = valid & m->s.way.shows & seen_intervals(m, o, interval);
    if (!any(seen))
        return;
    Properties in;
    Step step;
    load_properties(o, interval, seen, features, &in);
    particles_of(&in, v - in.ref, features, &step);
    if (features & FEATURE_LIT && m->s.packet.lit) {
        reals place = m->s.j * (real)m->s.h, lit[1][3];
        lit_on_particles(&m->s.packet, 1, &place, seen, lit);
        for (int c = 0; c < 3; c++)
            step.scatter[c] *= lit[0][c];
    }
    m->sum.cells -= seen;
    if (__builtin_expect(m->s.equals, 0))
        m->sum.cells += samples_beside(&m->s, seen);
    reals length = reals_where(seen, m->length), light[3];
    if (features & FEATURE_EXTRA && m->s.packet.extra)
        FOR_LANES(i, mask_bits(seen)) {
            double optical_depth[3] = {0};
            for (int c = 0; c < channels_of(features); c++)
                optical_depth[c] = doubles_lane(&m->sum.optical_depth[c], (int)i) + (double)m->run_optical_depth[c][i];
            note_step(m, i, &step, step_begin(&m->s, i, m->s.first[i] + (double)m->s.j[i]), length[i], optical_depth,
                         channels_of(features));
        }
    for (int c = 0; c < channels_of(features); c++) {
        reals depth = step.extinction[c] * length, passed;
        light[c] = m->transmittance[c] * reals_phi(depth, &passed) * length;
        m->transmittance[c] *= passed;
        m->run_optical_depth[c] += depth;
    }
    for (int c = 0; c < 3; c++) {
        reals transmittance = light[features & FEATURE_COLOURED ? c : 0];
        reals all = features & FEATURE_EMIT ? step.scatter[c] + step.emit[c] : step.scatter[c];
        m->run_color[c] = reals_fma(transmittance, reals_where(seen, all), m->run_color[c]);
        if (features & FEATURE_EXTRA && m->s.packet.extra) {
            doubles_add(&m->sum.sum[VOL_SUM_SCATTER][c], reals_where(seen, transmittance * step.scatter[c]));
            doubles_add(&m->sum.sum[VOL_SUM_EMIT][c], reals_where(seen, transmittance * step.emit[c]));
        }
    }
}

static inline void end_opaque_marches(March *m, ints mask, unsigned features)
{
    ints opaque = terminate_rays(&m->sum, &m->s.packet, mask, features);
    m->s.visiting &= ~opaque;
    m->waiting &= ~opaque;
}

ALWAYS_INLINE void sum_runs(March *m, ints ended, unsigned features)
{
    for (int c = 0; c < 3; c++) {
        doubles_add(&m->sum.color[c], reals_where(ended, m->run_color[c]));
        m->run_color[c] = reals_where(~ended, m->run_color[c]);
    }
    for (int c = 0; c < channels_of(features); c++) {
        doubles_add(&m->sum.optical_depth[c], reals_where(ended, m->run_optical_depth[c]));
        m->run_optical_depth[c] = reals_where(~ended, m->run_optical_depth[c]);
        m->transmittance[c] = reals_select(ended, reals_exp(-doubles_round(&m->sum.optical_depth[c])), m->transmittance[c]);
    }
    end_opaque_marches(m, ended, features);
}

#endif
