/* Samples of the field at equal steps along LANES rays, for the estimators that march.
 *
 * Ray i is cut from t0 into steps of length h, the last one shorter.  Sample n lies at t = t0 + (n + shift) h, the last one
 * where the estimator says (shift 1/2: the middles of the steps; shift 0: their ends).  It belongs to the brick with
 * t0 <= t < t1; to the last brick also where t is the ray's end.
 *
 * Samples come in runs: at most RUN_MOST in one brick, at local positions p = e + j hd, j counted from the run's first.  e
 * is computed in double from the ray, the brick and the run's first sample alone, then moved by rounding errors until both
 * ends of the run lie inside the brick: p runs monotonically, so that no sample needs to be kept inside afterwards.  The
 * ray's last sample is a run of its own, as its distance from the others differs.  What a sample is therefore does not
 * depend on the bricks that were entered before, nor on how it is reached: in a run, or one by one through
 * place_of_sample(), which finds the run that the sample belongs to and gives the same bits.
 *
 * On a wide stretch (walk.h) all samples are equal.  Its first and its last are runs of their own, next to which others
 * may lie; those between are one run with a single sample, which stands for all of them.
 *
 *     samples_begin(&s, scene, scratch, rays, count, out, shift);
 *     for (;;) {
 *         FOR_LANES(i, mask_bits(s.lanes.alive & ~s.visiting))
 *             samples_enter(&s, i);                  // first sample: s.first[i], number: s.left[i] (0: none in that brick)
 *         if (!any(s.lanes.alive))
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
 * Include reals.h first. */
#ifndef VOL_TRACE_SAMPLES_TMPL_H
#define VOL_TRACE_SAMPLES_TMPL_H

#include "trace/trilinear_tmpl.h"
#include "trace/properties_tmpl.h"
#include "trace/shading_tmpl.h"

enum { RUN_MOST = 32 }; /* samples: sums and products in float over a run stay short, however small the step */

typedef struct Samples {
    RayPacket packet;
    double h, per_h, shift;
    double t0[LANES], t1[LANES]; /* the ray's ends */
    double steps[LANES];         /* how many, >= 1 */
    double last[LANES];          /* number of the last sample, and where it lies */
    double last_t[LANES];

    /* The brick that a lane is in: samples brick_first <= n < brick_end. */
    double brick_first[LANES], brick_end[LANES];
    ints visible;                /* it is, and not merely entered */
    reals lo, hi;                /* range of its voxels */

    /* The run of samples that a lane is in. */
    ints visiting;
    double first[LANES];         /* number of its first sample */
    Doubles stands_for;          /* so many samples each of them is: more than 1 on wide stretches, */
    bool equals;                 /* where some lane is on one: `stands_for` is to be looked at */
    ints left;                   /* samples from the next one on */
    ints end_first;              /* the first is an end of the ray, to be judged: see is_end */
    reals e[3], hd[3], j;        /* the next sample lies at e + j hd from the brick's first voxel */
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

/* As first_sample, for the end of a brick. */
static inline double sample_behind(const Samples *s, unsigned i, double t)
{
    return t >= s->t1[i] ? s->last[i] + 1 : first_sample(s, i, t);
}

static inline void samples_begin(Samples *s, const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count,
                                 VolRadiance *out, double shift)
{
    memset(s, 0, sizeof *s);
    packet_begin(&s->packet, scene, scratch, rays, count, out);
    s->h = scene->step;
    s->per_h = 1 / scene->step;
    s->shift = shift;
    for (size_t i = 0; i < LANES; i++) {
        const VolRay *ray = &rays[i < count ? i : 0];
        /* A last step shorter than rounding is none. */
        double steps = ceil((ray->t1 - ray->t0) / s->h * (1 - 0x1p-40));
        s->t0[i] = ray->t0;
        s->t1[i] = ray->t1;
        s->steps[i] = steps < 1 ? 1 : steps;
        s->last[i] = shift > 0 ? s->steps[i] - 1 : s->steps[i];
        s->last_t[i] = fma(shift, ray->t1 - step_begin(s, (unsigned)i, s->last[i]), step_begin(s, (unsigned)i, s->last[i]));
        s->brick_end[i] = -1;
        doubles_set(&s->stands_for, (int)i, 1);
        for (int a = 0; a < 3; a++)
            s->hd[a][i] = (real)(s->h * s->packet.walk[i].d[a]);
    }
}

/* Whether sample n is an end of the ray.  There the field is judged as `exact` judges it: on a face of the domain by that
 * face's voxels alone, so that all estimators agree on the surfaces that lie in it. */
static inline bool is_end(const Samples *s, unsigned i, double n)
{
    return s->shift > 0 ? n < 0 || n > s->last[i] : n <= 0 || n >= s->last[i];
}

/* ---- Runs ---- */

typedef struct Run {
    double first;
    int32_t count;
    real e[3];
} Run;

static real move_run(real e, real last, real hd, real lo, real top)
{
    const real ulp = VOL_BRICK_CELLS * REAL_EPSILON;
    e = real_clamp(e, lo, top);
    real end = real_fma(last, hd, e);
    if (end > top) {
        e -= end - top;
        while (real_fma(last, hd, e) > top)
            e -= ulp;
    } else if (end < lo) {
        e += lo - end;
        while (real_fma(last, hd, e) < lo)
            e += ulp;
    }
    return real_clamp(e, lo, top);
}

/* x from `first`, the brick's first voxel along axis a, moved so that x + j hd, j = 0 ... last, rounded as the samples are,
 * lies inside the brick and the domain; at the far face just before it, where there is a cell. */
static inline real settle_run(const VolGrid *grid, int a, double first, double x, real last, real hd)
{
    const real before_face = VOL_BRICK_CELLS * (1 - REAL_EPSILON / 2);
    real e = (real)x, end = real_fma(last, hd, e), lo = 0, top = before_face;
    if (__builtin_expect(first < grid->domain_min[a], 0))
        lo = (real)(grid->domain_min[a] - first);
    if (__builtin_expect(first + VOL_BRICK_CELLS > grid->domain_max[a], 0)) {
        real hi = (real)(grid->domain_max[a] - first);
        top = hi > lo ? real_below(hi) : lo;
    }
    if (__builtin_expect(e >= lo && e <= top && end >= lo && end <= top, 1))
        return e;
    return move_run(e, last, hd, lo, top);
}

/* The run that sample n belongs to, in the brick at `origin` with samples [first, end). */
static inline void run_of_sample(const Samples *s, unsigned i, const int32_t origin[3], double first, double end, double n,
                                 Run *run)
{
    const RayPacket *l = &s->packet;
    const VolGrid *grid = l->scene->grid;
    const Walk *w = &l->walk[i];
    double last = s->last[i], count;
    if (n < 0 || n >= last) { /* alone */
        first = n;
        count = 1;
    } else {
        if (n - first >= RUN_MOST)
            first += floor((n - first) / RUN_MOST) * RUN_MOST;
        count = (end < last ? end : last) - first;
        count = count > RUN_MOST ? RUN_MOST : count;
    }
    run->first = first;
    run->count = (int32_t)count;
    double t = sample_time(s, i, first);
    for (int a = 0; a < 3; a++) {
        double x = fma(t, w->d[a], w->o[a] - origin[a]);
        run->e[a] = settle_run(grid, a, origin[a], x, (real)(count - 1), s->hd[a][i]);
    }
}

/* The run that begins with sample n of a wide stretch; where in a brick of one value it lies does not matter. */
static inline double run_of_equals(const Samples *s, unsigned i, double n, Run *run)
{
    double last = s->brick_end[i] - 1;
    *run = (Run){.first = n, .count = 1};
    return n > s->brick_first[i] && n < last ? last - n : 1;
}

static inline void start_run(Samples *s, unsigned i, double n)
{
    Run run;
    double stands_for = 1;
    if (s->packet.span[i].wide)
        stands_for = run_of_equals(s, i, n, &run);
    else
        run_of_sample(s, i, s->packet.span[i].origin, s->brick_first[i], s->brick_end[i], n, &run);
    doubles_set(&s->stands_for, (int)i, stands_for);
    s->equals = s->equals || stands_for > 1;
    s->first[i] = run.first;
    s->left[i] = run.count;
    s->j[i] = 0;
    for (int a = 0; a < 3; a++)
        s->e[a][i] = run.e[a];
    s->visiting[i] = -1;
    s->end_first[i] = s->packet.tables->jumps && !s->packet.span[i].wide && is_end(s, i, run.first) ? -1 : 0;
    s->packet.scratch->skipped.cells_met += (uint64_t)(run.count * stands_for);
}

/* Takes lane i to its next run of samples, in the brick that it is in or the next visible one.  left[i] = 0: that brick
 * has none, and the lane is not visiting.  false, and the lane is dead: there is no brick. */
static inline bool samples_enter(Samples *s, unsigned i)
{
    RayPacket *l = &s->packet;
    double next = s->first[i] + (double)s->left[i];
    if (l->in_brick[i] && next < s->brick_end[i]) {
        start_run(s, i, next);
        return true;
    }
    double end = l->in_brick[i] ? l->span[i].t1 : -INFINITY;
    if (!packet_enter_brick(l, i, false, false))
        return false;
    const BrickSpan *span = &l->span[i];
    const VolBrick *brick = &l->scene->grid->bricks[span->brick];
    s->lo[i] = (real)brick->lo;
    s->hi[i] = (real)brick->hi;
    s->visible[i] = l->scene->brick_visible[span->brick] == VOL_BRICK_SEEN ? -1 : 0;
    s->brick_first[i] = span->t0 == end ? s->brick_end[i] : first_sample(s, i, span->t0);
    s->brick_end[i] = sample_behind(s, i, span->t1);
    s->first[i] = s->brick_first[i];
    s->left[i] = 0;
    if (s->brick_first[i] < s->brick_end[i])
        start_run(s, i, s->brick_first[i]);
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

/* ---- Samples in a run ---- */

typedef struct SamplePlaces {
    ints offset;   /* of the cell's first corner among the brick's voxels */
    reals f[3];    /* within the cell, in [0, 1] */
} SamplePlaces;

static void judge_ends_of_rays(Samples *s, ints mask, reals *v);

/* The field at each visiting lane's sample j.  `valid`: visiting, and not in a hole. */
ALWAYS_INLINE reals samples_value(Samples *s, SamplePlaces *at, ints *valid)
{
    const RayPacket *l = &s->packet;
    reals cell[3], corners[8];
    for (int a = 0; a < 3; a++) {
        reals p = reals_fma(s->j, s->hd[a], s->e[a]);
        cell[a] = reals_trunc(p);
        at->f[a] = p - cell[a];
    }
    reals place = reals_fma(reals_fma(cell[0], reals_all(9), cell[1]), reals_all(9), cell[2]);
    at->offset = __builtin_convertvector(place, ints) & s->visiting;
    load_corners_of(l->values, at->offset, corners);
    *valid = s->visiting;
    if (__builtin_expect(any(l->invalid & s->visiting), 0))
        *valid &= ~l->invalid | all_finite(corners);
    reals v = interpolate_cell(corners, at->f), least = s->lo, most = s->hi;
    /* Never beyond what the brick was judged by; nor beyond the cell's corners, where less than that can be seen. */
    if (l->tables->jumps) {
        range_of_corners(corners, &least, &most);
        least = reals_max(least, s->lo); /* beside a hole it is no number */
        most = reals_min(most, s->hi);
    }
    v = reals_min(reals_max(v, least), most);
    ints ends = s->end_first & s->visiting & (ints)(s->j == 0);
    if (__builtin_expect(any(ends), 0))
        judge_ends_of_rays(s, ends, &v);
    return v;
}

/* The gradient of the field in world space, for `mask` of the visiting lanes; the others: 0. */
static inline void samples_gradients(Samples *s, const SamplePlaces *at, ints mask, reals out[3])
{
    reals corners[8], g[3];
    ints offset = at->offset & mask;
    packet_need_gradients(&s->packet, mask);
    for (int a = 0; a < 3; a++) {
        load_corners_of(s->packet.gradients, offset + a * VOL_BRICK_STRIDE, corners);
        g[a] = reals_select(mask, interpolate_cell(corners, at->f), reals_all(0));
    }
    world_gradients(&s->packet.scene->grid->world_to_index, g, out);
}

/* ---- The transfer function at samples ---- */

ALWAYS_INLINE reals property_at(const reals line[2], reals x) { return reals_fma(line[1], x, line[0]); }
/* ---- Samples one by one ---- */

/* A place on ray i, in the brick that it belongs to. */
typedef struct Place {
    double t;
    uint32_t brick;
    int32_t origin[3];
    int offset;
    real f[3];
    bool is_end; /* of the ray */
} Place;

typedef struct Sample {
    double t;
    real v;
    bool valid; /* false: a hole */
} Sample;

/* The brick that holds ray i at t, and the stretch of the ray in it. */
static inline void brick_around(const Samples *s, unsigned i, double t, Place *out, double *t0, double *t1)
{
    const VolGrid *grid = s->packet.scene->grid;
    Walk w = s->packet.walk[i];
    for (int a = 0; a < 3; a++) {
        w.at_min[a] = grid->cell_min[a] >> 3;
        w.at_max[a] = grid->cell_max[a] >> 3;
    }
    w.t = t < s->t1[i] ? t : nextafter(s->t1[i], -INFINITY); /* the ray's end belongs to the brick before it */
    walk_locate(&w);
    *t0 = s->t0[i];
    *t1 = s->t1[i];
    for (int a = 0; a < 3; a++) {
        out->origin[a] = w.at[a] * VOL_BRICK_CELLS;
        *t1 = fmin(*t1, w.ahead[a]);
        if (w.d[a] != 0)
            *t0 = fmax(*t0, walk_plane(&w, a, (w.d[a] > 0 ? w.at[a] : w.at[a] + 1) * VOL_BRICK_CELLS));
    }
    out->t = t;
    out->brick = vol_grid_brick_number(grid, w.at[0], w.at[1], w.at[2]);
}

static inline void set_cell(Place *place, const real p[3])
{
    int cell[3];
    for (int a = 0; a < 3; a++) {
        cell[a] = (int)p[a];
        place->f[a] = p[a] - (real)cell[a];
    }
    place->is_end = false;
    place->offset = (cell[0] * 9 + cell[1]) * 9 + cell[2];
}

/* An end of the ray that lies on faces of the domain but for rounding lies on them. */
static inline void settle_end(const Samples *s, unsigned i, Place *place)
{
    const VolGrid *grid = s->packet.scene->grid;
    const Walk *w = &s->packet.walk[i];
    int cell[3];
    for (int a = 0; a < 3; a++) {
        double x = fma(place->t, w->d[a], w->o[a] - place->origin[a]), near = 0x1p-48 * (fabs(w->o[a]) + fabs(x) + 8);
        double lo = grid->domain_min[a] - place->origin[a], hi = grid->domain_max[a] - place->origin[a];
        bool far = lo < hi && hi >= 1 && hi <= VOL_BRICK_CELLS, first = lo >= 0 && lo < VOL_BRICK_CELLS;
        cell[a] = (place->offset / (a == 0 ? 81 : a == 1 ? 9 : 1)) % 9;
        if (far && (fabs(x - hi) <= near || (real)x == (real)hi)) {
            cell[a] = (int)hi - 1;
            place->f[a] = 1;
        } else if (first && (fabs(x - lo) <= near || (real)x == (real)lo)) {
            cell[a] = (int)lo;
            place->f[a] = 0;
        }
    }
    place->is_end = true;
    place->offset = (cell[0] * 9 + cell[1]) * 9 + cell[2];
}

/* Sample n; -1 and last + 1: the ray's ends. */
static inline Place place_of_sample(const Samples *s, unsigned i, double n)
{
    Place place;
    Run run;
    double t0, t1;
    real p[3];
    brick_around(s, i, sample_time(s, i, n), &place, &t0, &t1);
    run_of_sample(s, i, place.origin, first_sample(s, i, t0), sample_behind(s, i, t1), n, &run);
    for (int a = 0; a < 3; a++)
        p[a] = real_fma((real)(n - run.first), s->hd[a][i], run.e[a]);
    set_cell(&place, p);
    if (is_end(s, i, n))
        settle_end(s, i, &place);
    return place;
}

/* Any t on the ray. */
static inline Place place_of_time(const Samples *s, unsigned i, double t)
{
    const VolGrid *grid = s->packet.scene->grid;
    const Walk *w = &s->packet.walk[i];
    Place place;
    double t0, t1;
    real p[3];
    brick_around(s, i, t, &place, &t0, &t1);
    for (int a = 0; a < 3; a++) {
        double x = fma(t, w->d[a], w->o[a] - place.origin[a]);
        p[a] = settle_run(grid, a, place.origin[a], x, 0, 0);
    }
    set_cell(&place, p);
    return place;
}

/* As interpolate_cell, for one; and the range of the corners. */
static inline real interpolate_place(const real *voxels, const Place *place, bool *finite, real *least, real *most)
{
    static const int row[4] = {0, 9, 81, 90};
    const real *at = voxels + place->offset, *f = place->f;
    real z[4], sum = 0;
    *least = *most = at[0];
    for (int r = 0; r < 4; r++) {
        real a = at[row[r]], b = at[row[r] + 1];
        z[r] = real_fma(f[2], b - a, a);
        sum += a * 0 + b * 0;
        *least = real_min(*least, real_min(a, b));
        *most = real_max(*most, real_max(a, b));
    }
    real y0 = real_fma(f[1], z[1] - z[0], z[0]), y1 = real_fma(f[1], z[3] - z[2], z[2]);
    *finite = sum == 0;
    return real_fma(f[0], y1 - y0, y0);
}

/* The field there, of nothing but the corners that carry weight. */
static inline real judge_place(const real *voxels, const Place *place)
{
    const real *at = voxels + place->offset, *f = place->f;
    real v = 0, least = INFINITY, most = -INFINITY;
    for (int n = 0; n < 8; n++) {
        real x = n >> 2 ? f[0] : 1 - f[0], y = n >> 1 & 1 ? f[1] : 1 - f[1], z = n & 1 ? f[2] : 1 - f[2];
        real weight = x * y * z, corner = at[(n >> 2) * 81 + (n >> 1 & 1) * 9 + (n & 1)];
        if (weight == 0)
            continue;
        v = real_fma(weight, corner, v);
        least = real_min(least, corner);
        most = real_max(most, corner);
    }
    return real_min(real_max(v, least), most);
}

/* The field there. */
static inline Sample sample_at(Samples *s, const Place *place)
{
    RayPacket *l = &s->packet;
    const VolBrick *brick = &l->scene->grid->bricks[place->brick];
    Sample sample = {.t = place->t, .valid = brick->lo <= brick->hi};
    if (!sample.valid)
        return sample;
    bool finite;
    real least, most;
    const real *voxels = brick_values(l->scene->grid, l->scratch, l->values, place->brick);
    real v = interpolate_place(voxels, place, &finite, &least, &most);
    bool jumps = l->tables->jumps;
    sample.valid = finite;
    sample.v = real_min(real_max(v, jumps ? least : (real)brick->lo), jumps ? most : (real)brick->hi);
    if (place->is_end && finite && jumps)
        sample.v = judge_place(voxels, place);
    return sample;
}

/* Puts the ends of rays among the samples of `mask` right. */
static void judge_ends_of_rays(Samples *s, ints mask, reals *v)
{
    FOR_LANES(i, mask_bits(mask)) {
        Place place = place_of_sample(s, i, s->first[i]);
        Sample sample = sample_at(s, &place);
        if (sample.valid)
            (*v)[i] = sample.v;
    }
}

/* The gradient there, in world space. */
static inline void gradient_at(Samples *s, const Place *place, real out[3])
{
    RayPacket *l = &s->packet;
    const VolGrid *grid = l->scene->grid;
    const real *voxels = brick_gradients(grid, l->scratch, l->gradients, place->brick, place->origin);
    real g[3], least, most;
    bool finite;
    for (int a = 0; a < 3; a++)
        g[a] = interpolate_place(voxels + a * VOL_BRICK_STRIDE, place, &finite, &least, &most);
    for (int i = 0; i < 3; i++) {
        const double *m = grid->world_to_index.m[i];
        out[i] = real_fma((real)m[2], g[2], real_fma((real)m[1], g[1], (real)m[0] * g[0]));
    }
}

#endif
