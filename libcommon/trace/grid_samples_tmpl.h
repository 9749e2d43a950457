/* Samples of a grid: runs of them in a brick, LANES side by side, and places one by one.
 *
 * In a run they lie at local positions p = e + j step, j counted from the run's first.  e is computed in double from the
 * ray, the brick and the run's first sample alone, then moved by rounding errors until both ends of the run lie inside the
 * brick: p runs monotonically, so that no sample needs to be kept inside afterwards.
 *
 * What a ray sees that lies in a plane of voxels is interpolated within that plane alone.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    SamplePlaces, Place; of the contract in traversal.h: what concerns samples and places */
#ifndef VOL_TRACE_GRID_SAMPLES_TMPL_H
#define VOL_TRACE_GRID_SAMPLES_TMPL_H

#include "trace/grid_rays_tmpl.h"

typedef struct SamplePlaces {
    ints offset;   /* of the cell's first corner among the brick's voxels */
    reals f[3];    /* within the cell, in [0, 1] */
} SamplePlaces;

/* ---- Runs ---- */

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

static inline void traversal_set_step(Traversal *w, const RayPacket *l, double h)
{
    (void)l;
    for (size_t i = 0; i < LANES; i++)
        for (int a = 0; a < 3; a++)
            w->step[a][i] = (real)(h * w->walk[i].ray.d[a]);
}

/* Where the run that begins at t, in the brick at `origin`, has its sample 0. */
static inline void place_run(const Traversal *w, const RayPacket *l, unsigned i, const int32_t origin[3], double t,
                             real last, real e[3])
{
    const IndexRay *ray = &w->walk[i].ray;
    for (int a = 0; a < 3; a++) {
        double x = fma(t, ray->d[a], ray->o[a] - origin[a]);
        e[a] = settle_run(l->scene->volume.grid, a, origin[a], x, last, w->step[a][i]);
    }
}

/* Whether e and `end` lie in the brick that begins at `origin`, and in the domain: as settle_run looks at it. */
ALWAYS_INLINE bool is_settled(const Traversal *w, axes origin, local_axes e, local_axes end)
{
    local_axes lo = local_max(__builtin_convertvector(w->domain_min - origin, local_axes), local_all(0));
    local_axes hi = __builtin_convertvector(w->domain_max - origin, local_axes);
    local_axes top = local_min((local_axes)((local_mask)hi - 1), local_all(VOL_BRICK_CELLS * (1 - REAL_EPSILON / 2)));
    local_axes least = local_min(e, end), most = local_max(e, end);
    return local_all_set((local_mask)(hi > lo) & (local_mask)(least >= lo) & (local_mask)(most <= top));
}

/* On a stretch of one value it does not matter where. */
static inline void traversal_begin_run(Traversal *w, const RayPacket *l, unsigned i, double t, real last)
{
    const Walk *walk = &w->walk[i];
    axes origin = axes_of(w->in.origin[0][i], w->in.origin[1][i], w->in.origin[2][i]);
    local_axes e = __builtin_convertvector(axes_fma(axes_all(t), walk->d, walk->o - origin), local_axes);
    local_axes hd = local_of(w->step[0][i], w->step[1][i], w->step[2][i]);
    if (w->uniform[i]) {
        e = local_all(0);
    } else if (__builtin_expect(!is_settled(w, origin, e, local_fma(local_all(last), hd, e)), 0)) {
        int32_t first[3];
        real moved[3];
        brick_origin(w, i, first);
        place_run(w, l, i, first, t, last, moved);
        e = local_of(moved[0], moved[1], moved[2]);
    }
    for (int a = 0; a < 3; a++)
        w->run[a][i] = e[a];
}

/* As traversal_begin_run, for the lanes of `mask`. */
ALWAYS_INLINE void traversal_begin_runs(Traversal *w, const RayPacket *l, ints mask, const double t[LANES], reals last)
{
    const VolGrid *grid = l->scene->volume.grid;
    ints settled = ints_all(-1);
    for (int a = 0; a < 3; a++) {
        wide from[PARTS], first[PARTS], past[PARTS];
        for (int n = 0; n < PARTS; n++) {
            wide origin = get_part(w->in.origin[a], n);
            from[n] = wide_fma(get_part(t, n), get_part(w->packet.d[a], n), get_part(w->packet.o[a], n) - origin);
            first[n] = grid->domain_min[a] - origin;
            past[n] = grid->domain_max[a] - origin;
        }
        reals lo = reals_max(reals_joined(first), reals_all(0)), hi = reals_joined(past);
        reals top = reals_min((reals)((ints)hi - 1), reals_all(VOL_BRICK_CELLS * (1 - REAL_EPSILON / 2)));
        reals e = reals_where(~w->uniform, reals_joined(from)), end = reals_fma(last, w->step[a], e);
        settled &= (ints)(hi > lo) & (ints)(reals_min(e, end) >= lo) & (ints)(reals_max(e, end) <= top);
        w->run[a] = reals_select(mask, e, w->run[a]);
    }
    ints unsettled = mask & ~settled & ~w->uniform;
    FOR_LANES(i, mask_bits(unsettled))
        traversal_begin_run(w, l, i, t[i], last[i]);
}

/* `valid`: of `mask`, and not beside an invalid voxel. */
ALWAYS_INLINE reals traversal_samples(const Traversal *w, const RayPacket *l, reals j, ints mask, bool bounded,
                                      SamplePlaces *at, ints *valid)
{
    reals cell[3], corners[8];
    (void)l;
    for (int a = 0; a < 3; a++) {
        reals p = reals_fma(j, w->step[a], w->run[a]);
        cell[a] = reals_trunc(p);
        at->f[a] = p - cell[a];
    }
    reals place = reals_fma(reals_fma(cell[0], reals_all(9), cell[1]), reals_all(9), cell[2]);
    at->offset = __builtin_convertvector(place, ints) & mask;
    load_corners_of(w->values, at->offset, corners);
    *valid = mask;
    if (__builtin_expect(any(w->invalid & mask), 0))
        *valid &= ~w->invalid | all_finite(corners);
    if (__builtin_expect(w->some_in_plane, 0))
        collapse_in_planes(w, corners, at->f);
    reals v = interpolate_cell(corners, at->f), least = w->lo, most = w->hi;
    /* Never beyond what the brick was judged by; nor beyond the cell's corners, where less than that can be seen. */
    if (bounded) {
        range_of_corners(corners, &least, &most);
        least = reals_max(least, w->lo); /* beside an invalid voxel it is no number */
        most = reals_min(most, w->hi);
    }
    return reals_min(reals_max(v, least), most);
}

/* For `mask` of the lanes; the others: 0. */
static inline reals traversal_sample_gradients(Traversal *w, const RayPacket *l, const SamplePlaces *at, ints mask,
                                               reals out[3])
{
    reals corners[8], g[3];
    ints offset = at->offset & mask;
    need_gradients(w, l, mask);
    for (int a = 0; a < 3; a++) {
        load_corners_of(w->gradients, offset + a * VOL_BRICK_STRIDE, corners);
        if (__builtin_expect(w->some_in_plane, 0))
            collapse_in_planes(w, corners, at->f);
        g[a] = reals_select(mask, interpolate_cell(corners, at->f), reals_all(0));
    }
    world_gradients(&l->scene->volume.grid->world_to_index, g, out);
    return w->steepest;
}

/* ---- Places ---- */

/* A place on a ray, in the brick that it belongs to. */
typedef struct Place {
    double t;
    bool is_end; /* of the ray */
    uint32_t brick;
    int32_t origin[3];
    int offset;    /* of the cell's first corner among the brick's voxels */
    int face;      /* from there to that of the face, edge or corner that the ray lies in; 0: in none, or the first */
    int step[3];   /* from that to the others; 0 across such a face */
    real f[3];
} Place;

static const int voxel_step[3] = {VOL_BRICK_SIDE * VOL_BRICK_SIDE, VOL_BRICK_SIDE, 1};

static inline void traversal_find(const Traversal *w, const RayPacket *l, unsigned i, double t, Place *out, double *t0,
                                  double *t1)
{
    const VolGrid *grid = l->scene->volume.grid;
    const VolRay *world = &l->rays[i];
    const IndexRay *ray = &w->walk[i].ray;
    double inside = t < world->t1 ? t : nextafter(world->t1, -INFINITY); /* the ray's end belongs to the brick before it */
    int32_t at[3];
    *t0 = world->t0;
    *t1 = world->t1;
    for (int a = 0; a < 3; a++) {
        at[a] = brick_at_time(ray, a, inside, grid->cell_min[a] >> 3, grid->cell_max[a] >> 3);
        double low = (double)at[a] * VOL_BRICK_CELLS, high = low + VOL_BRICK_CELLS;
        out->origin[a] = at[a] * VOL_BRICK_CELLS;
        if (ray->d[a] == 0)
            continue;
        double entry = plane_time(ray, a, ray->d[a] > 0 ? low : high);
        double exit = plane_time(ray, a, ray->d[a] > 0 ? high : low);
        *t0 = entry > *t0 ? entry : *t0;
        *t1 = exit < *t1 ? exit : *t1;
    }
    out->t = t;
    out->is_end = false;
    out->brick = vol_grid_brick_number(grid, at[0], at[1], at[2]);
}

static inline void set_cell(const IndexRay *ray, Place *place, const real p[3])
{
    place->offset = place->face = 0;
    for (int a = 0; a < 3; a++) {
        int cell = (int)p[a];
        bool in_plane = lies_in_plane(ray, a);
        place->f[a] = p[a] - (real)cell;
        place->offset += cell * voxel_step[a];
        place->face += in_plane && place->f[a] > (real)0.5 ? voxel_step[a] : 0;
        place->step[a] = in_plane ? 0 : voxel_step[a];
    }
}

static inline void traversal_place_in_run(const Traversal *w, const RayPacket *l, unsigned i, double first_t, real last,
                                          real j, Place *out)
{
    real e[3], p[3];
    place_run(w, l, i, out->origin, first_t, last, e);
    for (int a = 0; a < 3; a++)
        p[a] = real_fma(j, w->step[a][i], e[a]);
    set_cell(&w->walk[i].ray, out, p);
}

static inline void traversal_place_at(const Traversal *w, const RayPacket *l, unsigned i, Place *out)
{
    const IndexRay *ray = &w->walk[i].ray;
    real p[3];
    for (int a = 0; a < 3; a++) {
        double x = fma(out->t, ray->d[a], ray->o[a] - out->origin[a]);
        p[a] = settle_run(l->scene->volume.grid, a, out->origin[a], x, 0, 0);
    }
    set_cell(ray, out, p);
}

/* An end of the ray that lies in planes of voxels but for rounding, as those of the domain's faces, lies in them. */
static inline void traversal_settle_end(const Traversal *w, const RayPacket *l, unsigned i, Place *place)
{
    const IndexRay *ray = &w->walk[i].ray;
    (void)l;
    for (int a = 0; a < 3; a++) {
        double x = fma(place->t, ray->d[a], ray->o[a] - place->origin[a]);
        double plane = floor(x + 0.5), cell = (place->offset / voxel_step[a]) % VOL_BRICK_SIDE;
        if (fabs(x - plane) <= coordinate_blur(ray, a, plane + place->origin[a]))
            x = plane;
        place->f[a] = real_clamp((real)(x - cell), 0, 1);
    }
    place->is_end = true;
}

/* As interpolate_cell, for one; and the range of the corners. */
static inline real interpolate_place(const real *voxels, const Place *place, bool *finite, real *least, real *most)
{
    static const int cell[4] = {0, VOL_BRICK_SIDE, VOL_BRICK_SIDE * VOL_BRICK_SIDE, (VOL_BRICK_SIDE + 1) * VOL_BRICK_SIDE};
    const real *first = voxels + place->offset, *at = first + place->face, *f = place->f;
    const int x = place->step[0], y = place->step[1], row[4] = {0, y, x, x + y};
    real z[4], sum = 0;
    *least = *most = at[0];
    for (int r = 0; r < 4; r++) {
        real a = at[row[r]], b = at[row[r] + place->step[2]];
        z[r] = real_fma(f[2], b - a, a);
        sum += first[cell[r]] * 0 + first[cell[r] + 1] * 0;
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
    const real *at = voxels + place->offset + place->face, *f = place->f;
    real v = 0, least = INFINITY, most = -INFINITY;
    for (int n = 0; n < 8; n++) {
        real x = n >> 2 ? f[0] : 1 - f[0], y = n >> 1 & 1 ? f[1] : 1 - f[1], z = n & 1 ? f[2] : 1 - f[2];
        real weight = x * y * z;
        real corner = at[(n >> 2) * place->step[0] + (n >> 1 & 1) * place->step[1] + (n & 1) * place->step[2]];
        if (weight == 0)
            continue;
        v = real_fma(weight, corner, v);
        least = real_min(least, corner);
        most = real_max(most, corner);
    }
    return real_min(real_max(v, least), most);
}

static inline real traversal_value(const Traversal *w, const RayPacket *l, const Place *place, bool bounded, bool *valid)
{
    const VolBrick *brick = &l->scene->volume.grid->bricks[place->brick];
    *valid = brick->lo <= brick->hi;
    if (!*valid)
        return 0;
    real least, most;
    const real *voxels = brick_values(l->scene->volume.grid, l->scratch, w->values, place->brick);
    real v = interpolate_place(voxels, place, valid, &least, &most);
    if (bounded && place->is_end && *valid)
        return judge_place(voxels, place);
    return real_min(real_max(v, bounded ? least : (real)brick->lo), bounded ? most : (real)brick->hi);
}

/* In world space. */
static inline real traversal_gradient(const Traversal *w, const RayPacket *l, const Place *place, real out[3])
{
    const VolGrid *grid = l->scene->volume.grid;
    const real *voxels = brick_gradients(grid, l->scratch, w->gradients, place->brick, place->origin);
    real g[3], steepest[3], least, most;
    bool finite;
    for (int a = 0; a < 3; a++) {
        g[a] = interpolate_place(voxels + a * VOL_BRICK_STRIDE, place, &finite, &least, &most);
        steepest[a] = real_max(real_abs(least), real_abs(most));
    }
    for (int i = 0; i < 3; i++) {
        const double *m = grid->world_to_index.m[i];
        out[i] = real_fma((real)m[2], g[2], real_fma((real)m[1], g[1], (real)m[0] * g[0]));
    }
    return world_steepest(&grid->world_to_index, steepest);
}

#endif
