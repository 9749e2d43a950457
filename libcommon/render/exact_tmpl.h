/* The exact estimator: cell by cell, no step.
 *
 * Inside a cell the field on the ray is a cubic in s (cell_tmpl.h).  Between two knots of the transfer function extinction
 * is linear in v, hence a cubic in s whose integral, the optical depth, is known in closed form; a soft surface adds
 * |M(v(s)) - M(v(s_a))| on stretches where v is monotone, M being the prefix integral of its extinction per unit of v.
 * So the ray is cut at the cell's faces, at the knots and (for surfaces and isosurfaces) where v turns, and each piece
 * adds
 *     tau += tau(piece),     color += int q(s) exp(-(tau + tau(s))) ds
 * with q = c_scatter mu_scatter + e + c_surface mu_surface |v'(s)|, by Gauss-Legendre on stretches of optical depth at
 * most 1 (8 nodes in float, one vector: 4e-8 rms on white noise with spiky transfer functions,
 * where 4 leave 4e-6; 16 in double).  An isosurface is a factor exp(-mu_k) at its crossing.
 * Optical depth and colour are summed in double; exp(-tau) is taken anew for each node, so that no product of many
 * factors near 1 is ever formed.
 *
 * Compiled in four files of a few lines each: float and double, with and without AVX2's fused multiply-add. */
#include "render/pieces_tmpl.h"

/* ---- Isosurfaces ---- */

static void cross(RayState *r, Cell *cell, const Delta *delta, real s)
{
    VolRadiance *out = r->out;
    Shading sh;
    if (r->done)
        return;
    if (r->scene->shaded)
        shade_at(r, cell, s, &sh);
    for (int c = 0; c < 3; c++) {
        real color = delta->color[c];
        if (r->scene->shaded)
            color = real_fma(sh.k[c], color, sh.b[c]);
        double part = vol_exp(-out->tau[c < r->optics->channels ? c : 0]) * delta->opacity * (double)color;
        out->surface[c] += part;
        out->color[c] += part;
    }
    if (r->scene->shaded)
        for (int a = 0; a < 3; a++)
            out->normal[a] += vol_exp(-out->tau[0]) * delta->opacity * (double)sh.normal[a];
    for (int c = 0; c < r->optics->channels; c++)
        out->tau[c] += delta->mu;
    if (isinf(out->depth) && mean_transmittance(out->tau, r->optics->channels) <= 0.5)
        out->depth = cell->t0 + (double)(s * cell->length);
    if (r->scene->trace)
        report(r, cell, s, s, delta->mu, (size_t)(delta - r->optics->deltas), "isosurface");
    r->done = r->done || ray_is_dark(r);
}

/* ---- Cells ---- */

/* A stretch [sa, sb] on which v is monotone, from va to vb.  Knots and isosurfaces are met in the order of v.  The sides
 * from which isosurfaces are judged, da and db, agree with the neighbouring cells' (see trace_cell). */
static void monotone(RayState *r, Cell *cell, real sa, real sb, real va, real vb, real da, real db)
{
    const Optics *optics = r->optics;
    bool rising = vb > va || (vb == va && db > da);
    size_t j = rising ? interval_of(optics, va, r->interval) : interval_below(optics, va, r->interval);
    if (va == vb)
        j = interval_of(optics, va, r->interval);
    size_t n = optics->delta_count, k = 0;
    if (rising) /* first isosurface with da < value */
        while (k < n && !(da < optics->deltas[k].value))
            k++;
    else { /* the group of equal values that is met first: the highest with value <= da */
        k = n;
        while (k > 0 && !(da >= optics->deltas[k - 1].value))
            k--;
    }
    real s = sa;
    for (;;) {
        bool knot = false, iso = false;
        real knot_v = 0, iso_v = 0;
        if (rising && j < optics->knot_count)
            knot = (knot_v = optics->knots[j]) < vb;
        if (!rising && j > 0)
            knot = (knot_v = optics->knots[j - 1]) > vb;
        if (rising && k < n)
            iso = db >= (iso_v = optics->deltas[k].value);
        if (!rising && k > 0)
            iso = db < (iso_v = optics->deltas[k - 1].value);
        if (!knot && !iso)
            break;
        bool iso_first = iso && (!knot || (rising ? iso_v <= knot_v : iso_v >= knot_v));
        real next = solve_cubic(&cell->v, iso_first ? iso_v : knot_v, s, sb);
        integrate(r, cell, j, s, next);
        s = next;
        if (!iso_first) {
            j += rising ? 1 : (size_t)-1;
            continue;
        }
        size_t first = k, last = k; /* equal values in list order, whichever way v goes */
        if (rising) {
            while (last < n && optics->deltas[last].value == iso_v)
                last++;
            k = last;
        } else {
            while (first > 0 && optics->deltas[first - 1].value == iso_v)
                first--;
            k = first;
        }
        for (size_t i = first; i < last; i++)
            cross(r, cell, &optics->deltas[i], s);
    }
    integrate(r, cell, j, s, sb);
    r->interval = j;
}

/* Whether an isosurface's value lies between lo and hi (closed). */
static bool meets_isosurface(const Optics *optics, real lo, real hi)
{
    for (size_t k = 0; k < optics->delta_count; k++)
        if (optics->deltas[k].value >= lo && optics->deltas[k].value <= hi)
            return true;
    return false;
}

/* `fresh` and `exit`: the field at the cell's ends, kept within the corners of the faces they lie on.  Isosurfaces are
 * judged by these: neighbouring cells then agree on each side of a face, and a crossing is counted once, whatever rounding
 * does to the cubics. */
static void trace_cell(RayState *r, Cell *cell, real fresh, real exit)
{
    const Optics *optics = r->optics;
    const Cubic *v = &cell->v;
    cubic_range(v, &cell->lo, &cell->hi);
    real entry = r->carry_t == cell->t0 ? r->carry : fresh;
    bool isosurfaces = optics->delta_count && meets_isosurface(optics, real_min(cell->lo, real_min(entry, exit)),
                                                               real_max(cell->hi, real_max(entry, exit)));
    size_t j = interval_of(optics, cell->lo, r->interval);
    const Interval *in = &optics->intervals[j];
    r->interval = j;
    bool one_interval = cell->hi < in->v1;
    if (one_interval && !isosurfaces && !in->visible)
        return;
    if (one_interval && !isosurfaces && !in->has_surface) {
        integrate(r, cell, j, 0, 1);
        return;
    }
    real turns[2];
    int count = turning_points(v, turns);
    real sa = 0, va = v->a0, da = entry;
    for (int i = 0; i <= count && !r->done; i++) {
        bool last = i == count;
        real sb = last ? 1 : turns[i], vb = cubic_at(v, sb);
        monotone(r, cell, sa, sb, va, vb, da, last ? exit : vb);
        sa = sb;
        va = da = vb;
    }
}

static bool all_finite(const real c[8])
{
    real sum = 0;
    for (int n = 0; n < 8; n++)
        sum += c[n] * 0;
    return sum == 0;
}

/* A brick of one value: one stretch, unless shading asks for the neighbours' gradients. */
static void trace_uniform(RayState *r, const BrickSpan *span, const VolBrick *brick)
{
    Cell cell = {.v = {(real)brick->uniform, 0, 0, 0}, .t0 = span->t0, .length = (real)(span->t1 - span->t0)};
    for (int n = 0; n < 8; n++)
        cell.corners[n] = cell.v.a0;
    for (int a = 0; a < 3; a++)
        cell.at[a] = span->origin[a];
    trace_cell(r, &cell, cell.v.a0, cell.v.a0);
    r->carry = cell.v.a0;
    r->carry_t = span->t1;
}

/* Where the ray reaches the next face across an axis.  The brick's own faces are none: where it leaves the brick, `end`
 * says, and a cell beyond is never entered whatever rounding makes of a slanting ray. */
static inline real next_face(int32_t at, real e, real d, real inv)
{
    if (d == 0 || at == (d > 0 ? VOL_BRICK_CELLS - 1 : 0))
        return INFINITY;
    return ((real)(at + (d > 0)) - e) * inv;
}

static void trace_brick(RayState *r, const BrickSpan *span, const double direction[3])
{
    const VolGrid *grid = r->scene->grid;
    const VolBrick *brick = &grid->bricks[span->brick];
    bool uniform = brick->storage == VOL_NO_STORAGE;
    if (uniform && !(r->optics->classic && r->scene->shaded)) {
        trace_uniform(r, span, brick);
        return;
    }
    real e[3], d[3], inv[3], next[3];
    int32_t at[3];
    real end = (real)(span->t1 - span->t0);
    for (int a = 0; a < 3; a++) {
        e[a] = real_clamp((real)span->e[a], 0, VOL_BRICK_CELLS);
        d[a] = (real)direction[a];
        inv[a] = d[a] == 0 ? 0 : 1 / d[a];
        at[a] = (int32_t)(d[a] < 0 ? real_ceil(e[a]) - 1 : real_floor(e[a]));
        at[a] = at[a] < 0 ? 0 : at[a] > 7 ? 7 : at[a];
        next[a] = next_face(at[a], e[a], d[a], inv[a]);
    }
    real u0 = 0;
    unsigned entered = 0; /* axes through whose plane this cell was entered */
    while (!r->done) {
        real u1 = real_min(real_min(next[0], next[1]), real_min(next[2], end));
        bool inside = u1 < end;
        if (u1 > u0) {
            Cell cell;
            cell.has_gradients = cell.counted = false;
            cell.t0 = span->t0 + (double)u0;
            cell.length = u1 - u0;
            real exit_point[3];
            for (int a = 0; a < 3; a++) {
                real p = real_fma(u0, d[a], e[a] - (real)at[a]);
                cell.p[a] = entered >> a & 1 ? (d[a] > 0 ? 0 : 1) : real_clamp(p, 0, 1);
                cell.d[a] = d[a] * cell.length;
                cell.at[a] = span->origin[a] + at[a];
                bool at_face = inside ? next[a] <= u1 : span->exit_axes >> a & 1;
                exit_point[a] = at_face ? (d[a] > 0 ? 1 : 0) : (real)0.5;
            }
            if (uniform)
                for (int n = 0; n < 8; n++)
                    cell.corners[n] = (real)brick->uniform;
            else
                load_corners(grid, brick, at, cell.corners);
            if (!brick->holes || all_finite(cell.corners)) {
                cell.v = expand_cell(cell.corners, cell.p, cell.d);
                real fresh = 0, exit = 0;
                if (r->optics->delta_count) {
                    fresh = clamp_to_corners(cell.v.a0, cell.corners, cell.p);
                    exit = clamp_to_corners(cubic_at(&cell.v, 1), cell.corners, exit_point);
                }
                trace_cell(r, &cell, fresh, exit);
                r->carry = exit;
                r->carry_t = inside ? span->t0 + (double)u1 : span->t1;
            }
        }
        if (!inside)
            break;
        entered = 0;
        for (int a = 0; a < 3; a++)
            if (next[a] <= u1) {
                at[a] += d[a] > 0 ? 1 : -1;
                next[a] = next_face(at[a], e[a], d[a], inv[a]);
                entered |= 1u << a;
            }
        u0 = u1;
    }
}

static void trace_exact(const VolScene *scene, const VolRay *ray, VolRadiance *out)
{
    *out = (VolRadiance){.depth = INFINITY};
    RayState r = {.scene = scene, .optics = SCENE_OPTICS(scene), .ray = ray, .out = out, .carry_t = NAN};
    r.tau_stop = vol_scene_stop_depth(scene, ray->t1 - ray->t0);
    r.view[0] = (real)-ray->direction.x;
    r.view[1] = (real)-ray->direction.y;
    r.view[2] = (real)-ray->direction.z;
    Walk walk;
    BrickSpan span = {0};
    walk_begin(&walk, scene, ray);
    while (!r.done && walk_next(&walk, &span))
        trace_brick(&r, &span, walk.d);
}
