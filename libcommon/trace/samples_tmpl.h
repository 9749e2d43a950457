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
 *         int steps = samples_in_step(&s, together); // that all visiting lanes have left
 *         for (int k = 0; k < steps; k++) {
 *             reals v = samples_value(&s, together, &at, &valid); // all lanes; only those of s.visiting mean something
 *             ...                                    // samples_gradients(&s, &at, mask, gradient) where needed
 *             s.j += 1;
 *         }
 *         samples_passed(&s, steps);                 // lanes with none left are visiting no more
 *     }
 *
 * Where rays go `together`, those with no samples left wait until all have none, and then
 *
 *     samples_visit(&s, s.packet.alive);
 *
 * takes them on in place of samples_enter; s.active says which are at a sample of theirs.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    Samples and the functions above; Sample, sample_at(), place_of_sample(), place_of_time(), gradient_at();
 *             sample_time(), sample_gap(), step_begin(), is_end(), samples_beside() */
#ifndef VOL_TRACE_SAMPLES_TMPL_H
#define VOL_TRACE_SAMPLES_TMPL_H

#include VOL_TRAVERSAL

#include "simd/wide.h"
#include "trace/accumulate_tmpl.h"
#include "trace/fall_off.h"

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
    ints visiting, active;       /* active: sample j is in it, too */
    double first[LANES];         /* number of its first sample, */
    double next[LANES];          /* and of the first behind it */
    reals count;
    double stands_for[LANES];    /* so many samples each of them is: more than 1 on uniform stretches, */
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

static inline void samples_begin(Samples *s, const VolTraceCall *call, size_t first, double shift, bool may_wait)
{
    CLEAR_FROM(s, h);
    packet_begin(&s->packet, call, first);
    lit_begin(&s->packet);
    traversal_begin(&s->way, &s->packet, may_wait);
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
        s->stands_for[i] = 1;
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

/* The run whose first sample is n. */
ALWAYS_INLINE void start_run(Samples *s, unsigned i, double n)
{
    bool uniform = stretch_is_uniform(&s->way)[i];
    double past = s->stretch_past[i], last = s->last[i], count = (past < last ? past : last) - n;
    double stands_for = uniform ? equals_of_sample(s, i, n) : 1;
    count = uniform || n >= last ? 1 : count > RUN_MOST ? RUN_MOST : count;
    traversal_begin_run(&s->way, &s->packet, i, sample_time(s, i, n), (real)(count - 1));
    s->stands_for[i] = stands_for;
    s->equals = s->equals || stands_for > 1;
    s->first[i] = n;
    s->next[i] = n + count * stands_for;
    s->left[i] = (lane_int)count;
    s->j[i] = 0;
    s->visiting[i] = -1;
    s->end_first[i] = s->packet.tables->jumps && !uniform && is_end(s, i, n) ? -1 : 0;
    s->packet.scratch->skipped.cells_met += (uint64_t)(count * stands_for);
}

/* Lane i has come to its next stretch with something in it; `before`: where the last one ended. */
ALWAYS_INLINE void number_stretch(Samples *s, unsigned i, double before)
{
    double begin = stretch_begin(&s->way)[i];
    s->stretch_first[i] = begin == before ? s->stretch_past[i] : first_sample(s, i, begin);
    s->stretch_past[i] = sample_behind(s, i, stretch_end(&s->way)[i]);
}

/* Takes lane i to its next run of samples, in the stretch that it is in or the next one with something in it.  left[i] = 0:
 * that one has none, and the lane is not visiting.  false, and the lane is not alive any more: there is none. */
static inline bool samples_enter(Samples *s, unsigned i)
{
    Traversal *w = &s->way;
    double next = s->next[i];
    if (!w->in_stretch[i] || !(next < s->stretch_past[i])) {
        double before = w->in_stretch[i] ? stretch_end(w)[i] : -INFINITY;
        if (!traversal_enter_samples(w, &s->packet, i))
            return false;
        number_stretch(s, i, before);
        next = s->stretch_first[i];
    }
    if (next < s->stretch_past[i]) {
        start_run(s, i, next);
    } else {
        s->first[i] = s->next[i] = next;
        s->left[i] = 0;
    }
    return true;
}

/* ---- Runs of rays together ---- */

/* How many samples the runs have that begin with samples `first`, and how many of the ray's each of them stands for. */
ALWAYS_INLINE wide run_lengths(const Samples *s, int n, wide first, wide_mask uniform, wide *stands_for)
{
    wide past = get_part(s->stretch_past, n), last = get_part(s->last, n), one = wide_all(1);
    wide_mask inner = uniform & (wide_mask)(first > get_part(s->stretch_first, n));
    wide count = wide_min(wide_min(past, last) - first, wide_all(RUN_MOST));
    *stands_for = wide_select(inner, wide_max(past - 1 - first, one), one);
    return wide_select(uniform | (wide_mask)(first >= last), one, count);
}

/* The lanes of `mask` begin the runs whose first samples are `next`. */
ALWAYS_INLINE void start_runs(Samples *s, ints mask)
{
    double t[LANES];
    ints uniform = stretch_is_uniform(&s->way);
    wide counts[PARTS], met = wide_all(0);
    for (int n = 0; n < PARTS; n++) {
        wide_mask part = mask_part(mask, n);
        wide first = get_part(s->next, n), stands_for;
        wide time = wide_fma(first + s->shift, wide_all(s->h), get_part(s->t0, n));
        time = wide_select((wide_mask)(first >= get_part(s->last, n)), get_part(s->last_t, n), time);
        set_part(t, n, time);
        counts[n] = run_lengths(s, n, first, mask_part(uniform, n), &stands_for);
        wide many = counts[n] * stands_for;
        met += wide_where(part, many);
        put_part(s->first, n, part, first);
        put_part(s->next, n, part, first + many);
        put_part(s->stands_for, n, part, stands_for);
        s->equals = s->equals || wide_bits(part & (wide_mask)(stands_for > 1));
    }
    s->count = reals_select(mask, reals_joined(counts), s->count);
    traversal_begin_runs(&s->way, &s->packet, mask, t, s->count - 1);
    s->left = ints_select(mask, __builtin_convertvector(s->count, ints), s->left);
    s->j = reals_where(~mask, s->j);
    s->visiting |= mask;
    s->end_first &= ~mask;
    if (s->packet.tables->jumps)
        FOR_LANES(i, mask_bits(mask & ~uniform))
            s->end_first[i] = is_end(s, i, s->first[i]) ? -1 : 0;
    s->packet.scratch->skipped.cells_met += (uint64_t)wide_sum(met);
}

/* As first_sample, for lanes of `mask`. */
ALWAYS_INLINE wide first_samples(const Samples *s, int n, wide_mask mask, wide t)
{
    wide x = (t - get_part(s->t0, n)) * s->per_h - s->shift, number = wide_ceil(x), early = number - x;
    wide_mask sure = (wide_mask)(number > 0) & (wide_mask)(number < wide_min(get_part(s->last, n), wide_all(1e9)));
    sure &= (wide_mask)(wide_max(early, 1 - early) < 1 - 1e-3);
    FOR_LANES(i, wide_bits(mask & ~sure))
        number[i] = first_sample(s, PART * (unsigned)n + i, t[i]);
    return number;
}

/* The lanes of `mask` have entered a stretch, from one that ended at `before` where they were in one. */
ALWAYS_INLINE void number_samples(Samples *s, ints mask, ints were_in_one, const double before[LANES])
{
    wide_mask some[PARTS] = {{0}};
    for (int n = 0; n < PARTS; n++) {
        wide_mask part = mask_part(mask, n);
        if (PARTS > 1 && !wide_bits(part))
            continue;
        wide begin = get_part(stretch_begin(&s->way), n), end = get_part(stretch_end(&s->way), n);
        wide first = get_part(s->stretch_past, n), past = get_part(s->last, n) + 1;
        wide_mask apart = part & ~(mask_part(were_in_one, n) & (wide_mask)(begin == get_part(before, n)));
        wide_mask inside = part & (wide_mask)(end < get_part(s->t1, n));
        if (wide_bits(apart))
            first = wide_select(apart, first_samples(s, n, apart, begin), first);
        past = wide_select(inside, first_samples(s, n, inside, end), past);
        put_part(s->stretch_first, n, part, first);
        put_part(s->stretch_past, n, part, past);
        put_part(s->first, n, part, first);
        put_part(s->next, n, part, first);
        some[n] = part & (wide_mask)(first < past);
    }
    ints starting = masks_joined(some);
    s->left &= ~mask;
    if (any(starting))
        start_runs(s, starting);
}

/* Takes the lanes of `mask` to their next runs of samples, in the stretches that they are in or the next with something in
 * them.  left[i] = 0: that one has none, and the lane is not visiting.  Where there is no further one, the lane is not alive
 * any more. */
ALWAYS_INLINE void samples_visit(Samples *s, ints mask)
{
    Traversal *w = &s->way;
    ints were_in_one = w->in_stretch;
    wide_mask has_more[PARTS];
    for (int n = 0; n < PARTS; n++)
        has_more[n] = (wide_mask)(get_part(s->next, n) < get_part(s->stretch_past, n));
    ints more = mask & were_in_one & masks_joined(has_more), rest = mask & ~more;
    if (any(more))
        start_runs(s, more);
    if (!any(rest))
        return;
    double before[LANES];
    memcpy(before, stretch_end(w), sizeof before);
    traversal_visit_samples(w, &s->packet, rest);
    number_samples(s, rest & s->packet.alive, were_in_one, before);
}

/* ---- On the way ---- */

/* How many samples those that the lanes of `mask` are at stand for, beside themselves. */
static ints samples_beside(const Samples *s, ints mask)
{
    ints count = ints_all(0);
    FOR_LANES(i, mask_bits(mask))
        count[i] = (lane_int)fmin(s->stands_for[i] - 1, INT32_MAX / 2);
    return count;
}

/* How many samples to take before asking anew: as many as every visiting lane has left, or where lanes wait for one another
 * any of them. */
ALWAYS_INLINE int samples_in_step(const Samples *s, bool together)
{
    ints left = s->left | ~s->visiting; /* of the others: -1 */
    uint32_t least = UINT32_MAX;
    int32_t most = 0;
    for (int i = 0; i < LANES; i++) {
        least = (uint32_t)left[i] < least ? (uint32_t)left[i] : least;
        most = (int32_t)left[i] > most ? (int32_t)left[i] : most;
    }
    return together ? most : least == UINT32_MAX ? 0 : (int)least;
}

/* After `steps` samples: the lanes that have none left. */
ALWAYS_INLINE ints samples_passed(Samples *s, int steps)
{
    s->left -= steps & s->visiting;
    ints ended = s->visiting & (ints)(s->left <= 0);
    s->left &= ~ended;
    s->visiting &= ~ended;
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

/* The field at each active lane's sample j.  `valid`: active, and there is one. */
ALWAYS_INLINE reals samples_value(Samples *s, bool together, SamplePlaces *at, ints *valid)
{
    s->active = together ? s->visiting & (ints)(s->j < s->count) : s->visiting;
    reals v = traversal_samples(&s->way, &s->packet, s->j, s->active, s->packet.tables->jumps, at, valid);
    ints ends = s->end_first & s->active & (ints)(s->j == 0);
    if (__builtin_expect(any(ends), 0))
        judge_ends_of_rays(s, ends, &v);
    return v;
}

#endif
