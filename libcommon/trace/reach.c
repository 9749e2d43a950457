/* Within a cell the field on the way is a cubic in u, from 0 to 1; where it turns and at the knots of the transfer function
 * the way is cut.  On each part extinction is linear in v, hence a cubic in u, and Simpson's rule is exact; soft surfaces'
 * extinction is linear in v, over which their depth is an integral, and the rule of the middle is exact. */
#include "trace/reach.h"

#include <math.h>
#include <string.h>

#include "base/fmath.h"

/* ---- The field ---- */

typedef struct Cell {
    double corner[8]; /* 4 x + 2 y + z */
    double lo, hi;
    bool finite;
} Cell;

static void corners_of(const VolGrid *grid, const int32_t at[3], Cell *out)
{
    const VolBrick *brick = &grid->bricks[vol_grid_brick_at(grid, at[0], at[1], at[2])];
    size_t first = (size_t)(((at[0] & 7) * VOL_BRICK_SIDE + (at[1] & 7)) * VOL_BRICK_SIDE + (at[2] & 7));
    out->lo = INFINITY, out->hi = -INFINITY, out->finite = true;
    for (int n = 0; n < 8; n++) {
        size_t place = first + (size_t)(((n >> 2) * VOL_BRICK_SIDE + (n >> 1 & 1)) * VOL_BRICK_SIDE + (n & 1));
        double v;
        if (brick->storage == VOL_NO_STORAGE)
            v = vol_grid_voxel(grid, at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1));
        else if (grid->is_double)
            v = ((const double *)grid->values)[(size_t)brick->storage * VOL_BRICK_STRIDE + place];
        else
            v = (double)((const float *)grid->values)[(size_t)brick->storage * VOL_BRICK_STRIDE + place];
        out->corner[n] = v;
        out->finite = out->finite && isfinite(v);
        out->lo = fmin(out->lo, v);
        out->hi = fmax(out->hi, v);
    }
}

static double mix(double a, double b, double t) { return fma(t, b - a, a); }

static double value_at(const Cell *cell, const double p[3])
{
    const double *c = cell->corner;
    double y0 = mix(mix(c[0], c[1], p[2]), mix(c[2], c[3], p[2]), p[1]);
    double y1 = mix(mix(c[4], c[5], p[2]), mix(c[6], c[7], p[2]), p[1]);
    return fmin(fmax(mix(y0, y1, p[0]), cell->lo), cell->hi);
}

/* ---- Surface cells ---- */

/* The depth of soft surfaces from lo to hi. */
static double surface_depth(const VolTfCompiled *tf, double lo, double hi)
{
    double sum = 0;
    for (size_t i = vol_tf_interval(tf, lo); i <= tf->knot_count && tf->intervals[i].v0 < hi && sum <= 1; i++) {
        const VolTfInterval *in = &tf->intervals[i];
        double a = fmax(lo, in->v0), b = fmin(hi, in->v1), middle = 0.5 * (a + b);
        if (in->has_surface)
            sum += (b - a) * fmax(fma(in->surface.b, middle - in->v_ref, in->surface.a), 0);
    }
    return sum;
}

bool vol_reach_is_surface(const VolScene *scene, double lo, double hi)
{
    const VolTfCompiled *tf = scene->tf;
    for (size_t n = 0; n < tf->isosurface_count; n++)
        if (lo < tf->isosurfaces[n].value && hi >= tf->isosurfaces[n].value)
            return true;
    return tf->has_surface && tf->model != VOL_MODEL_CLASSIC && lo < hi && surface_depth(tf, lo, hi) > 1;
}

/* ---- The way through a cell ---- */

typedef struct Way {
    const VolTfCompiled *tf;
    double a0, a1, a2, a3; /* v over u */
    double lo, hi;         /* which it never leaves */
    double length;         /* world units */
    double depth[3];       /* of all that was passed so far */
    double own;            /* the isosurface that the way begins on, or NAN; */
    bool own_ahead;        /* its crossing is still to come, and is left out */
} Way;

static double on_way(const Way *w, double u)
{
    return fmin(fmax(fma(fma(fma(w->a3, u, w->a2), u, w->a1), u, w->a0), w->lo), w->hi);
}

/* Along d, the whole cell's way in index space, from p. */
static void expand(const Cell *cell, const double p[3], const double d[3], Way *out)
{
    const double *c = cell->corner;
    double kx = c[4] - c[0], ky = c[2] - c[0], kz = c[1] - c[0];
    double kxy = (c[6] - c[4]) - ky, kxz = (c[5] - c[4]) - kz, kyz = (c[3] - c[2]) - kz;
    double kq = ((c[7] - c[6]) - (c[5] - c[4])) - kyz;
    double yz0 = p[1] * p[2], yz1 = p[1] * d[2] + d[1] * p[2], yz2 = d[1] * d[2];
    double A0 = kyz * yz0 + (kz * p[2] + ky * p[1]), A1 = kyz * yz1 + (kz * d[2] + ky * d[1]), A2 = kyz * yz2;
    double B0 = kq * yz0 + (kxz * p[2] + (kxy * p[1] + kx)), B1 = kq * yz1 + (kxz * d[2] + kxy * d[1]), B2 = kq * yz2;
    out->a0 = c[0] + (B0 * p[0] + A0);
    out->a1 = B0 * d[0] + (B1 * p[0] + A1);
    out->a2 = B1 * d[0] + (B2 * p[0] + A2);
    out->a3 = B2 * d[0];
    out->lo = cell->lo, out->hi = cell->hi;
}

static double extinction_at(const VolTfInterval *in, int c, double v)
{
    double x = v - in->v_ref, scatter = fma(in->scatter.b, x, in->scatter.a);
    return fmax(scatter + fma(in->absorb[c].b, x, in->absorb[c].a), 0);
}

/* From ua to ub, on which v is monotone and in one interval. */
static void add_part(Way *w, double ua, double ub, double va, double vb)
{
    double middle = on_way(w, 0.5 * (ua + ub));
    const VolTfInterval *in = &w->tf->intervals[vol_tf_interval(w->tf, va == vb ? va : 0.5 * (va + vb))];
    double surface = 0;
    if (in->has_surface && w->tf->model != VOL_MODEL_CLASSIC)
        surface = fabs(vb - va) * fmax(fma(in->surface.b, 0.5 * (va + vb) - in->v_ref, in->surface.a), 0);
    for (int c = 0; c < 3; c++) {
        double particles = 0;
        if (in->has_scatter || in->has_absorb)
            particles = (extinction_at(in, c, va) + 4 * extinction_at(in, c, middle) + extinction_at(in, c, vb)) / 6;
        w->depth[c] += particles * (ub - ua) * w->length + surface;
    }
}

/* Where v, monotone from ua to ub, takes a value between those at the ends. */
static double place_of(const Way *w, double value, double ua, double ub, bool rising)
{
    for (int n = 0; n < 60 && ua < ub; n++) {
        double middle = 0.5 * (ua + ub);
        if ((on_way(w, middle) < value) == rising)
            ua = middle;
        else
            ub = middle;
    }
    return ub;
}

static void cross_isosurfaces(Way *w, double va, double vb)
{
    bool leaves_own = w->own_ahead && (va < w->own) != (vb < w->own);
    for (size_t n = 0; n < w->tf->isosurface_count; n++) {
        const VolIsosurface *iso = &w->tf->isosurfaces[n];
        if ((va < iso->value) == (vb < iso->value) || (leaves_own && iso->value == w->own))
            continue;
        for (int c = 0; c < 3; c++)
            w->depth[c] += iso->optical_depth;
    }
    w->own_ahead = w->own_ahead && !leaves_own;
}

/* From ua to ub, on which v is monotone. */
static void add_leg(Way *w, double ua, double ub, double va, double vb)
{
    const VolTfCompiled *tf = w->tf;
    bool rising = vb > va;
    double lo = fmin(va, vb), hi = fmax(va, vb);
    size_t first = 0, past;
    while (first < tf->knot_count && tf->knots[first] <= lo)
        first++;
    for (past = first; past < tf->knot_count && tf->knots[past] < hi;)
        past++;
    for (size_t n = 0; n < past - first; n++) {
        double knot = tf->knots[rising ? first + n : past - 1 - n], u = place_of(w, knot, ua, ub, rising);
        add_part(w, ua, u, va, knot);
        ua = u;
        va = knot;
    }
    add_part(w, ua, ub, va, vb);
}

/* Where v turns, ascending, within (0, 1); how many. */
static int turns_of(const Way *w, double out[2])
{
    double a = 3 * w->a3, b = w->a2, c = w->a1, square = b * b - a * c, at[2];
    int count = 0;
    if (!(square > 0))
        return 0;
    double q = -(b + copysign(sqrt(square), b));
    at[0] = a != 0 ? q / a : INFINITY;
    at[1] = q != 0 ? c / q : INFINITY;
    if (at[0] > at[1]) {
        double first = at[1];
        at[1] = at[0];
        at[0] = first;
    }
    for (int n = 0; n < 2; n++)
        if (at[n] > 0 && at[n] < 1)
            out[count++] = at[n];
    return count;
}

/* All of the cell's way, the field at whose entry is `entry`; returns the field at its exit. */
static double pass_cell(Way *w, double entry, double exit)
{
    double turn[2], u = 0, v = entry;
    int count = turns_of(w, turn);
    for (int n = 0; n <= count; n++) {
        double to = n < count ? turn[n] : 1, next = n < count ? on_way(w, to) : exit;
        cross_isosurfaces(w, v, next);
        add_leg(w, u, to, v, next);
        u = to;
        v = next;
    }
    return v;
}

/* The way begins at v, the isosurface's value but for rounding, or for an estimator's step.  It is to be on the side that it
 * leaves for; where it is not yet, a crossing that is not one lies ahead. */
static void begin_on_isosurface(Way *w, double v)
{
    double slope = w->a1 != 0 ? w->a1 : w->a2 != 0 ? w->a2 : w->a3;
    w->own_ahead = slope != 0 && (v < w->own) != (slope < 0);
}

/* ---- From cell to cell ---- */

typedef struct Walk {
    const VolGrid *grid;
    double o[3], d[3]; /* index space, d per world unit */
    int32_t at[3];     /* the cell */
    double t, last;    /* where it begins; where nothing is left between there and the light */
} Walk;

/* How far along the way to go: to the light, the domain's end, the nearest clip plane. */
static double end_of_way(const VolScene *scene, VolVec3 point, VolVec3 to, double distance)
{
    VolRay ray = {point, to, 0, distance};
    return vol_ray_clip(scene, &ray) ? ray.t1 : 0;
}

static void begin_walk(Walk *w, VolVec3 point, VolVec3 to)
{
    VolVec3 o = vol_apply(&w->grid->world_to_index, point), d = vol_apply_linear(&w->grid->world_to_index, to);
    const double from[3] = {o.x, o.y, o.z}, along[3] = {d.x, d.y, d.z};
    for (int a = 0; a < 3; a++) {
        double whole = floor(from[a]);
        bool below = along[a] < 0 && whole == from[a];
        double at = fmin(fmax(below ? whole - 1 : whole, w->grid->cell_min[a]), w->grid->cell_max[a]);
        w->o[a] = from[a];
        w->d[a] = along[a];
        w->at[a] = (int32_t)at;
    }
    w->t = 0;
}

/* Where the way leaves the cell, and through which axes. */
static double exit_of(const Walk *w, bool through[3])
{
    double t[3], least = INFINITY;
    for (int a = 0; a < 3; a++) {
        double face = w->at[a] + (w->d[a] > 0);
        t[a] = w->d[a] != 0 ? fmax((face - w->o[a]) / w->d[a], w->t) : INFINITY;
        least = fmin(least, t[a]);
    }
    for (int a = 0; a < 3; a++)
        through[a] = t[a] == least;
    return least;
}

static void place_in_cell(const Walk *w, double t, double p[3])
{
    for (int a = 0; a < 3; a++)
        p[a] = fmin(fmax(fma(t, w->d[a], w->o[a] - w->at[a]), 0), 1);
}

/* Follows the way through surface cells; false: it begins in none.  Adds to the depth; w->t is where it ends. */
static bool follow(const VolScene *scene, Walk *w, double own, double depth[3])
{
    Way way = {.tf = scene->tf, .own = own};
    double v = NAN;
    bool any = false;
    while (w->t < w->last || !any) {
        Cell cell;
        bool through[3];
        double p[3], q[3], d[3];
        corners_of(w->grid, w->at, &cell);
        if (!cell.finite || !vol_reach_is_surface(scene, cell.lo, cell.hi))
            break;
        double end = exit_of(w, through), to = fmin(end, w->last);
        place_in_cell(w, w->t, p);
        place_in_cell(w, to, q);
        for (int a = 0; a < 3; a++)
            d[a] = q[a] - p[a];
        expand(&cell, p, d, &way);
        way.length = to - w->t;
        if (!any) {
            v = value_at(&cell, p);
            begin_on_isosurface(&way, v);
        }
        if (to > w->t)
            v = pass_cell(&way, v, value_at(&cell, q));
        any = true;
        w->t = to;
        if (!(end < w->last))
            break;
        for (int a = 0; a < 3; a++)
            w->at[a] += through[a] ? (w->d[a] > 0 ? 1 : -1) : 0;
    }
    memcpy(depth, way.depth, sizeof way.depth);
    return any;
}

/* ---- Light grids at a point ---- */

/* The eight voxels around a point, and how much of each there is in it. */
static void voxels_around(const VolGrid *grid, VolVec3 point, int32_t at[3], double weight[8])
{
    VolVec3 index = vol_apply(&grid->world_to_index, point);
    const double x[3] = {index.x, index.y, index.z};
    double f[3];
    for (int a = 0; a < 3; a++) {
        double inside = fmin(fmax(x[a], grid->cell_min[a]), grid->cell_max[a] + 1.0);
        inside = grid->domain == VOL_DOMAIN_BOX ? inside : fmin(fmax(x[a], -0x1p30), 0x1p30);
        at[a] = (int32_t)floor(inside);
        f[a] = inside - at[a];
    }
    for (int n = 0; n < 8; n++)
        weight[n] = (n >> 2 ? f[0] : 1 - f[0]) * (n >> 1 & 1 ? f[1] : 1 - f[1]) * (n & 1 ? f[2] : 1 - f[2]);
}

static void voxel_of(const VolGrid *grid, const int32_t at[3], int n, double rgb[3])
{
    if (grid->is_rgb)
        vol_grid_voxel_rgb(grid, at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1), rgb);
    else
        rgb[0] = rgb[1] = rgb[2] = vol_grid_voxel(grid, at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1));
}

static void grid_at(const VolGrid *grid, VolVec3 point, double rgb[3])
{
    int32_t at[3];
    double weight[8];
    voxels_around(grid, point, at, weight);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int n = 0; n < 8; n++) {
        double voxel[3];
        if (weight[n] == 0)
            continue;
        voxel_of(grid, at, n, voxel);
        for (int c = 0; c < 3; c++)
            rgb[c] = fma(weight[n], voxel[c], rgb[c]);
    }
}

bool vol_reach(const VolScene *scene, VolVec3 point, size_t n, double own, double T[3])
{
    const VolLight *light = &scene->lights[n];
    VolVec3 to = vol_scale(light->direction, -1);
    double distance = INFINITY, depth[3], there[3] = {1, 1, 1};
    if (vol_light_stands(light)) {
        to = vol_sub(light->position, point);
        distance = vol_length(to);
        to = distance > 0 ? vol_scale(to, 1 / distance) : vol_vec3(1, 0, 0);
    }
    Walk walk = {.grid = scene->volume.grid, .last = end_of_way(scene, point, to, distance)};
    begin_walk(&walk, point, to);
    if (!follow(scene, &walk, own, depth))
        return false;
    if (walk.t < walk.last)
        grid_at(scene->lit->grids[n], vol_along(point, walk.t, to), there);
    for (int c = 0; c < 3; c++)
        T[c] = there[c] * vol_exp(-depth[c]);
    return true;
}

/* ---- On the viewer's side ---- */

static double field_at(const VolGrid *grid, VolVec3 point)
{
    double rgb[3];
    grid_at(grid, point, rgb);
    return rgb[0];
}

/* Whether voxel n around `at` of the light's lattice lies below the value. */
static bool lies_below(const VolGrid *light, const VolGrid *field, const int32_t at[3], int n, double value)
{
    VolVec3 index = vol_vec3(at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1));
    return field_at(field, vol_apply(&light->index_to_world, index)) < value;
}

static void add_around(const VolGrid *light, const VolGrid *field, VolVec3 point, double value, bool below, double rgb[3])
{
    int32_t at[3];
    double weight[8], sum = 0;
    bool seen[8];
    voxels_around(light, point, at, weight);
    for (int n = 0; n < 8; n++) {
        seen[n] = weight[n] > 0 && lies_below(light, field, at, n, value) == below;
        sum += seen[n] ? weight[n] : 0;
    }
    for (int n = 0; n < 8; n++) {
        double voxel[3], share = sum > 0 ? (seen[n] ? weight[n] / sum : 0) : weight[n];
        if (share == 0)
            continue;
        voxel_of(light, at, n, voxel);
        for (int c = 0; c < 3; c++)
            rgb[c] = fma(share, voxel[c], rgb[c]);
    }
}

void vol_reach_around(const VolScene *scene, VolVec3 point, double value, bool below, double rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (size_t n = vol_lit_direct_count(scene); n < scene->lit->grid_count; n++)
        add_around(scene->lit->grids[n], scene->volume.grid, point, value, below, rgb);
}
