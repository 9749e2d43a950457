/* Samples of the field at equal steps along a ray packet, for the estimators that march.
 *
 * Ray i is cut from t0 into steps of length h, the last one shorter.  Sample n lies at t = t0 + (n + shift) h, the last one
 * where the estimator says (shift 1/2: the middles of the steps; shift 0: their ends).  It belongs to the stretch with
 * t0 <= t < t1; to the last stretch also where t is the ray's end.
 *
 * Samples come in runs: at most RUN_MOST in one stretch.  The ray's last sample is a run of its own, as its distance from
 * the others differs.  What a sample is does not depend on the stretches that were entered before, nor on how it is reached:
 * in a run, or one by one through place_of_sample(), which finds the run that the sample belongs to and gives the same bits.
 *
 * On a uniform stretch all samples are equal.  Its first and its last are runs of their own, next to which others may lie;
 * those between are one run with a single sample, which stands for all of them.
 *
 *     samples_begin(&s, call, first, shift);
 *     for (;;) {
 *         FOR_LANES(i, mask_bits(s.packet.alive & ~s.visiting))
 *             samples_enter(&s, i);                  // first sample: s.first[i], number: s.left[i] (0: none there)
 *         if (!any(s.packet.alive))
 *             break;
 *         int steps = samples_in_step(&s);           // that all visiting lanes have left
 *         for (int k = 0; k < steps; k++) {
 *             reals v = samples_value(&s, &at, &valid);  // all lanes; only those of s.visiting mean something
 *             ...                                    // samples_gradients(&s, &at, mask, gradient) where needed
 *             s.j += 1;
 *         }
 *         samples_passed(&s, steps);                 // lanes with none left are visiting no more
 *     }
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    Samples and the functions above; Sample, sample_at(), place_of_sample(), place_of_time(), gradient_at();
 *             sample_time(), sample_gap(), step_begin(), is_end(), samples_beside() */
#ifndef VOL_TRACE_SAMPLES_TMPL_H
#define VOL_TRACE_SAMPLES_TMPL_H

#include VOL_TRAVERSAL

#include "trace/accumulate_tmpl.h"

enum { RUN_MOST = 32 }; /* samples: sums and products in float over a run stay short, however small the step */

typedef struct Samples {
    RayPacket packet;
    Traversal way;
    double h, per_h, shift;
    double t0[LANES], t1[LANES]; /* the ray's ends */
    double steps[LANES];         /* how many, >= 1 */
    double last[LANES];          /* number of the last sample, and where it lies */
    double last_t[LANES];

    /* The stretch that a lane is in: samples stretch_first <= n < stretch_past. */
    double stretch_first[LANES], stretch_past[LANES];

    /* The run of samples that a lane is in. */
    ints visiting;
    double first[LANES];         /* number of its first sample */
    Doubles stands_for;          /* so many samples each of them is: more than 1 on uniform stretches, */
    bool equals;                 /* where some lane is on one: `stands_for` is to be looked at */
    ints left;                   /* samples from the next one on */
    ints end_first;              /* the first is an end of the ray, to be judged: see is_end */
    reals j;                     /* the next sample's number in the run */
} Samples;

/* ---- Numbers and places on the ray ---- */

/* Where step n begins; n = steps: the ray's end. */
static inline double step_begin(const Samples *s, unsigned i, double n)
{
    return n >= s->steps[i] ? s->t1[i] : fma(n, s->h, s->t0[i]);
}

/* Where sample n lies; before the first the ray's beginning, after the last its end. */
static inline double sample_time(const Samples *s, unsigned i, double n)
{
    if (n >= s->last[i])
        return n > s->last[i] ? s->t1[i] : s->last_t[i];
    return n < 0 ? s->t0[i] : fma(n + s->shift, s->h, s->t0[i]);
}

/* Its distance from the sample before it: h exactly wherever it is meant to be. */
static inline real sample_gap(const Samples *s, unsigned i, double n)
{
    return (real)(n > 0 && n < s->last[i] ? s->h : sample_time(s, i, n) - sample_time(s, i, n - 1));
}

/* The number of the first sample at or behind t; last + 1: none. */
static inline double first_sample(const Samples *s, unsigned i, double t)
{
    double x = (t - s->t0[i]) * s->per_h - s->shift, n = ceil(x), last = s->last[i];
    /* Well away from any sample, rounding decides nothing. */
    if (n > 0 && n < last && n - x > 1e-3 && n - x < 1 - 1e-3 && n < 1e9)
        return n;
    n = n < 0 ? 0 : n > last ? last : n;
    while (n > 0 && sample_time(s, i, n - 1) >= t)
        n--;
    while (n <= last && sample_time(s, i, n) < t)
        n++;
    return n;
}

/* As first_sample, for the end of a stretch. */
static inline double sample_behind(const Samples *s, unsigned i, double t)
{
    return t >= s->t1[i] ? s->last[i] + 1 : first_sample(s, i, t);
}

static inline void samples_begin(Samples *s, const VolTraceCall *call, size_t first, double shift)
{
    memset(s, 0, sizeof *s);
    packet_begin(&s->packet, call, first);
    traversal_begin(&s->way, &s->packet);
    s->h = call->prepared->scene->step;
    s->per_h = 1 / s->h;
    s->shift = shift;
    traversal_set_step(&s->way, &s->packet, s->h);
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &s->packet.rays[i < s->packet.count ? i : 0];
        /* A last step shorter than rounding is none. */
        double steps = ceil((ray->t1 - ray->t0) / s->h * (1 - 0x1p-40));
        s->t0[i] = ray->t0;
        s->t1[i] = ray->t1;
        s->steps[i] = steps < 1 ? 1 : steps;
        s->last[i] = shift > 0 ? s->steps[i] - 1 : s->steps[i];
        s->last_t[i] = fma(shift, ray->t1 - step_begin(s, (unsigned)i, s->last[i]), step_begin(s, (unsigned)i, s->last[i]));
        s->stretch_past[i] = -1;
        doubles_set(&s->stands_for, (int)i, 1);
    }
}

/* Whether sample n is an end of the ray.  There the field is judged as `exact` judges it: on a face of the domain by that
 * face's voxels alone, so that all estimators agree on the surfaces that lie in it. */
static inline bool is_end(const Samples *s, unsigned i, double n)
{
    return s->shift > 0 ? n < 0 || n > s->last[i] : n <= 0 || n >= s->last[i];
}

/* ---- Runs ---- */

/* A run's first sample, and how many there are. */
typedef struct Run {
    double first, count;
} Run;

/* The run that sample n belongs to, in a stretch with samples [first, past). */
static inline Run run_of_sample(const Samples *s, unsigned i, double first, double past, double n)
{
    double last = s->last[i];
    if (n < 0 || n >= last) /* alone */
        return (Run){n, 1};
    if (n - first >= RUN_MOST)
        first += floor((n - first) / RUN_MOST) * RUN_MOST;
    double count = (past < last ? past : last) - first;
    return (Run){first, count > RUN_MOST ? RUN_MOST : count};
}

/* How many samples of a uniform stretch sample n stands for. */
static inline double equals_of_sample(const Samples *s, unsigned i, double n)
{
    double last = s->stretch_past[i] - 1;
    return n > s->stretch_first[i] && n < last ? last - n : 1;
}

static inline void start_run(Samples *s, unsigned i, double n)
{
    bool uniform = stretch_is_uniform(&s->way, i);
    Run run = uniform ? (Run){n, 1} : run_of_sample(s, i, s->stretch_first[i], s->stretch_past[i], n);
    double stands_for = uniform ? equals_of_sample(s, i, n) : 1;
    traversal_begin_run(&s->way, &s->packet, i, sample_time(s, i, run.first), (real)(run.count - 1));
    doubles_set(&s->stands_for, (int)i, stands_for);
    s->equals = s->equals || stands_for > 1;
    s->first[i] = run.first;
    s->left[i] = (lane_int)run.count;
    s->j[i] = 0;
    s->visiting[i] = -1;
    s->end_first[i] = s->packet.tables->jumps && !uniform && is_end(s, i, run.first) ? -1 : 0;
    s->packet.scratch->skipped.cells_met += (uint64_t)(run.count * stands_for);
}

/* Takes lane i to its next run of samples, in the stretch that it is in or the next one with something in it.  left[i] = 0:
 * that one has none, and the lane is not visiting.  false, and the lane is not alive any more: there is none. */
static inline bool samples_enter(Samples *s, unsigned i)
{
    Traversal *w = &s->way;
    double next = s->first[i] + (double)s->left[i];
    if (w->in_stretch[i] && next < s->stretch_past[i]) {
        start_run(s, i, next);
        return true;
    }
    double end = w->in_stretch[i] ? stretch_end(w, i) : -INFINITY;
    if (!traversal_enter_samples(w, &s->packet, i))
        return false;
    s->stretch_first[i] = stretch_begin(w, i) == end ? s->stretch_past[i] : first_sample(s, i, stretch_begin(w, i));
    s->stretch_past[i] = sample_behind(s, i, stretch_end(w, i));
    s->first[i] = s->stretch_first[i];
    s->left[i] = 0;
    if (s->stretch_first[i] < s->stretch_past[i])
        start_run(s, i, s->stretch_first[i]);
    return true;
}

/* How many samples those that the lanes of `mask` are at stand for, beside themselves. */
static ints samples_beside(const Samples *s, ints mask)
{
    ints count = ints_all(0);
    FOR_LANES(i, mask_bits(mask))
        count[i] = (lane_int)fmin(doubles_lane(&s->stands_for, (int)i) - 1, INT32_MAX / 2);
    return count;
}

/* How many samples every visiting lane has left. */
ALWAYS_INLINE int samples_in_step(const Samples *s)
{
    ints left = s->left | ~s->visiting; /* of the others: -1 */
    uint32_t least = UINT32_MAX;
    for (int i = 0; i < LANES; i++)
        least = (uint32_t)left[i] < least ? (uint32_t)left[i] : least;
    return least == UINT32_MAX ? 0 : (int)least;
}

/* After `steps` samples of all visiting lanes. */
ALWAYS_INLINE ints samples_passed(Samples *s, int steps)
{
    s->left -= steps & s->visiting;
    ints ended = s->visiting & (ints)(s->left == 0);
    s->visiting &= ~ended;
    FOR_LANES(i, mask_bits(ended))
        s->first[i] += (double)s->j[i] * doubles_lane(&s->stands_for, (int)i);
    s->equals = false; /* such a run is of one sample */
    return ended;
}

/* ---- Samples one by one ---- */

typedef struct Sample {
    double t;
    real v;
    bool valid;
} Sample;

/* Sample n; -1 and last + 1: the ray's ends. */
static inline Place place_of_sample(const Samples *s, unsigned i, double n)
{
    Place place;
    double t0, t1;
    traversal_find(&s->way, &s->packet, i, sample_time(s, i, n), &place, &t0, &t1);
    Run run = run_of_sample(s, i, first_sample(s, i, t0), sample_behind(s, i, t1), n);
    traversal_place_in_run(&s->way, &s->packet, i, sample_time(s, i, run.first), (real)(run.count - 1),
                           (real)(n - run.first), &place);
    if (is_end(s, i, n))
        traversal_settle_end(&s->way, &s->packet, i, &place);
    return place;
}

/* Any t on the ray. */
static inline Place place_of_time(const Samples *s, unsigned i, double t)
{
    Place place;
    double t0, t1;
    traversal_find(&s->way, &s->packet, i, t, &place, &t0, &t1);
    traversal_place_at(&s->way, &s->packet, i, &place);
    return place;
}

static inline Sample sample_at(const Samples *s, const Place *place)
{
    Sample sample = {.t = place->t};
    sample.v = traversal_value(&s->way, &s->packet, place, s->packet.tables->jumps, &sample.valid);
    return sample;
}

/* ---- Samples in a run ---- */

/* Puts the ends of rays among the samples of `mask` right. */
MAYBE_UNUSED static void judge_ends_of_rays(const Samples *s, ints mask, reals *v)
{
    FOR_LANES(i, mask_bits(mask)) {
        Place place = place_of_sample(s, i, s->first[i]);
        Sample sample = sample_at(s, &place);
        if (sample.valid)
            (*v)[i] = sample.v;
    }
}

/* The field at each visiting lane's sample j.  `valid`: visiting, and there is one. */
ALWAYS_INLINE reals samples_value(Samples *s, SamplePlaces *at, ints *valid)
{
    reals v = traversal_samples(&s->way, &s->packet, s->j, s->visiting, s->packet.tables->jumps, at, valid);
    ints ends = s->end_first & s->visiting & (ints)(s->j == 0);
    if (__builtin_expect(any(ends), 0))
        judge_ends_of_rays(s, ends, &v);
    return v;
}

#endif
