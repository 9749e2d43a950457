/* Cells of a grid under a ray packet, in the order of each ray.
 *
 * Where isosurfaces are to be met, the field at a cell's ends is kept within the corners of the faces that they lie on:
 * neighbouring cells agree on each side of a face, and a crossing is counted once, whatever rounding does.  A ray that lies
 * in a plane of voxels sees the voxels of that plane alone, whichever cell beside it is visited: the others of the cell are
 * replaced by them.  In double a place that lies in an edge or a voxel but for rounding lies there, and a field that is at
 * an isosurface's value in that voxel alone is met; in float such rays are given up where it matters (blur_tmpl.h).
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    CellPlace; of the contract in traversal.h: what concerns cells */
#ifndef VOL_TRACE_GRID_CELLS_TMPL_H
#define VOL_TRACE_GRID_CELLS_TMPL_H

#include "trace/grid_rays_tmpl.h"
#include "trace/traversal.h"

typedef struct CellPlace {
    reals p[3], step[3]; /* local entry point, and from it to the exit */
    ints offset;         /* of the cell's first corner among the brick's voxels */
    ints faces;          /* that it is left through, a bit for each axis; times 8, those that it is entered through */
} CellPlace;

/* In double soft surfaces too are judged by ends on which neighbouring cells agree: beside a value of 1e30 what rounding
 * leaves of a face of zeros would hide a layer of surfaces from one and show it to the other. */
static inline bool judges_ends(unsigned features)
{
#ifdef VOL_DOUBLE
    return features & FEATURE_SURFACE;
#else
    (void)features;
    return false;
#endif
}

/* The first cell of lane i in the brick that it has entered; `single`: the brick is one.
 *
 * Of the brick and the domain's own faces none is ever reached: where the ray leaves the brick, `end` says, and a cell
 * beyond is never entered whatever rounding makes of a slanting ray. */
ALWAYS_INLINE void begin_cells(Traversal *w, unsigned i, const BrickSpan *span, bool single)
{
    const local_axes zero = local_all(0), top = local_all(VOL_BRICK_CELLS - 1);
    local_axes d = local_of(w->d[0][i], w->d[1][i], w->d[2][i]), inv = local_of(w->inv[0][i], w->inv[1][i], w->inv[2][i]);
    local_axes e = local_min(local_max(__builtin_convertvector(span->e, local_axes), zero), local_all(VOL_BRICK_CELLS));
    local_mask up = (local_mask)(d > 0), down = (local_mask)(d < 0);
    local_axes floor = __builtin_convertvector(__builtin_convertvector(e, local_mask), local_axes); /* e is not below 0 */
    local_axes before = floor - local_select((local_mask)(floor == e), local_all(1), zero);
    local_axes high = local_min(__builtin_convertvector(w->cell_max - span->origin, local_axes), top);
    local_axes low = local_max(__builtin_convertvector(w->cell_min - span->origin, local_axes), zero);
    local_axes last = local_select(up, high, low);
    /* A ray that enters where the domain ends but for rounding is in its last cell, not beyond it. */
    local_axes at = local_max(local_select(down, before, floor), local_select(down, last, zero));
    at = local_min(at, local_select(up, last, top));
    local_axes next = (at + local_select(up, local_all(1), zero) - e) * inv;
    local_mask never = ~(up | down) | (local_mask)(at == last);
    next = local_select(never, local_all(INFINITY), next);
    axes whole = (span->e + axes_all(0x1.8p52)) - axes_all(0x1.8p52);
    local_mask through = (local_mask)(at + local_select(down, local_all(1), zero) == e) & (up | down);
    through &= (local_mask)(__builtin_convertvector(whole - span->e, local_axes) == zero);
    for (int a = 0; a < 3; a++) {
        w->e[a][i] = e[a];
        w->at[a][i] = at[a];
        w->last[a][i] = last[a];
        w->next[a][i] = single ? INFINITY : next[a];
        w->entered[a][i] = (lane_int)through[a];
        w->exit_axes[a][i] = (lane_int)span->exit_axes[a];
    }
}

/* A brick of one value counts as one cell where nothing lights what is in it from place to place, as the classic model and
 * light grids do. */
static inline bool traversal_enter_cells(Traversal *w, RayPacket *l, unsigned i, unsigned features)
{
    BrickSpan span;
    if (!enter_brick(w, l, i, true, &span))
        return false;
    bool uniform = vol_brick_is_uniform(&l->scene->volume.grid->bricks[span.brick]);
    begin_cells(w, i, &span, span.wide || (uniform && !(features & FEATURE_CLASSIC) && !l->lit));
    w->u[i] = 0;
    w->end[i] = (real)(span.t1 - span.t0);
    if (features & FEATURE_ISO || judges_ends(features))
        w->carried[i] = w->carry_t[i] == span.t0 ? -1 : 0;
    return true;
}

/* On to the neighbouring cell, or out of the brick. */
ALWAYS_INLINE void pass_cells(Traversal *w, ints mask, reals u1, ints inside)
{
    ints going = mask & inside;
    for (int a = 0; a < 3; a++) {
        ints through = going & (ints)(w->next[a] <= u1);
        reals at = w->at[a] + reals_where(through, w->sign[a]);
        reals face = (at + w->upper[a] - w->e[a]) * w->inv[a];
        face = reals_select((ints)(at == w->last[a]), reals_all(INFINITY), face);
        w->at[a] = at;
        w->next[a] = reals_select(through, face, w->next[a]);
        w->entered[a] = ints_select(going, through, w->entered[a]);
    }
    w->u = reals_select(going, u1, w->u);
    w->in_stretch &= ~(mask & ~inside);
}

/* Places within cells, in [0, 1]: what lies in a plane of voxels but for rounding lies in it.  In float that is not so:
 * where it matters, blur_tmpl.h gives rays up. */
ALWAYS_INLINE reals settled_in_planes(const Traversal *w, reals x)
{
#ifdef VOL_DOUBLE
    x = reals_where((ints)(x > w->blur), x);
    x = reals_select((ints)(1 - x > w->blur), x, reals_all(1));
#else
    (void)w;
#endif
    return x;
}

/* Where a ray meets two planes in an edge, rounding may leave a cell between them, in which v has no turns. */
ALWAYS_INLINE void straighten_slivers(const Traversal *w, ints mask, const CellPlace *cell, Cubic *v)
{
#ifdef VOL_DOUBLE
    reals longest = reals_max(reals_max(reals_abs(cell->step[0]), reals_abs(cell->step[1])), reals_abs(cell->step[2]));
    ints slivers = mask & (ints)(longest <= w->blur);
    if (any(slivers))
        cubic_replace(v, slivers, &(Cubic){.a0 = v->a0});
#else
    (void)w, (void)mask, (void)cell, (void)v;
#endif
}

/* The field at cells' ends, kept within the corners of the faces that the ends lie on. */
MAYBE_UNUSED static void judge_ends(Traversal *w, ints mask, const reals corners[8], CellPlace *cell, reals u1, ints inside,
                                    reals *entry, reals *exit)
{
    reals there[3];
    cell->faces = (ints){0};
    for (int a = 0; a < 3; a++) {
        ints at_face = ints_select(inside, (ints)(w->next[a] <= u1), w->exit_axes[a]);
        cell->faces |= (at_face & 1 << a) | (w->entered[a] & 8 << a);
        there[a] = reals_select(at_face, w->upper[a], settled_in_planes(w, reals_clamp(cell->p[a] + cell->step[a], 0, 1)));
    }
    *exit = judge_at(corners, there);
    *entry = w->carry;
    if (any(mask & ~w->carried))
        *entry = reals_select(w->carried, w->carry, judge_at(corners, cell->p));
    w->carry = reals_select(mask, *exit, w->carry);
    w->carried |= mask;
    FOR_LANES(i, mask_bits(mask & ~inside))
        w->carry_t[i] = w->in.past[i];
}

ALWAYS_INLINE ints traversal_next_cells(Traversal *w, const RayPacket *l, ints mask, bool bounded, unsigned features,
                                        Cell *out, CellPlace *place)
{
    const reals one = reals_all(1);
    reals u1 = reals_min(reals_min(w->next[0], w->next[1]), reals_min(w->next[2], w->end));
    ints inside = (ints)(u1 < w->end), ahead = mask & (ints)(u1 > w->u), met = ahead;
    reals length = u1 - w->u, corners[8], lo, hi;
    for (int a = 0; a < 3; a++) {
        reals x = reals_clamp(reals_fma(w->u, w->d[a], w->e[a] - w->at[a]), 0, 1);
        place->p[a] = reals_select(w->entered[a], one - w->upper[a], x);
        place->step[a] = w->d[a] * length;
    }
    reals first = reals_fma(reals_fma(w->at[0], reals_all(9), w->at[1]), reals_all(9), w->at[2]);
    place->offset = __builtin_convertvector(first, ints);
    load_corners_of(w->values, place->offset, corners);
    if (any(w->invalid))
        met &= ~w->invalid | all_finite(corners);
    if (__builtin_expect(w->some_in_plane, 0))
        collapse_in_planes(w, corners, place->p);
    Cubic v = expand_cell(corners, place->p, place->step);
    cubic_range(&v, &lo, &hi);
    reals entry = v.a0, exit = cubic_at(&v, one);
    out->least = lo, out->most = hi;
    if (bounded) {
        range_of_corners(corners, &out->least, &out->most);
        lo = reals_min(reals_max(lo, out->least), out->most);
        hi = reals_min(reals_max(hi, out->least), out->most);
        entry = reals_min(reals_max(entry, out->least), out->most);
        exit = reals_min(reals_max(exit, out->least), out->most);
    }
    if (features & FEATURE_ISO || judges_ends(features)) {
        out->begins = met & ~w->carried;
        judge_ends(w, met, corners, place, u1, inside, &entry, &exit);
        straighten_slivers(w, met, place, &v);
        lo = reals_min(lo, reals_min(entry, exit));
        hi = reals_max(hi, reals_max(entry, exit));
        w->carried &= met | ~ahead;
    }
    out->v = v;
    out->begin = w->u;
    out->length = length;
    out->lo = lo, out->hi = hi;
    out->entry = entry, out->exit = exit;
    pass_cells(w, mask, u1, inside);
    (void)l;
    return met;
}

ALWAYS_INLINE void traversal_keep_cells(CellPlace *kept, ints mask, const CellPlace *from, unsigned features)
{
    if (!(features & (FEATURE_SHADED | FEATURE_ISO)))
        return;
    if (features & FEATURE_ISO)
        kept->faces = ints_select(mask, from->faces, kept->faces);
    for (int a = 0; a < 3; a++) {
        kept->p[a] = reals_select(mask, from->p[a], kept->p[a]);
        kept->step[a] = reals_select(mask, from->step[a], kept->step[a]);
    }
    kept->offset = ints_select(mask, from->offset, kept->offset);
}

#ifndef VOL_DOUBLE

/* Places in a cell are known to about 32 u of its side: u = 2^-24, from the brick's entry it is up to 8 sides long. */
#define PLACE_BLUR ((real)0x1p-18)

/* Whether a place x in the cell lies in the planes `in_face`, one at the most, and so far from all others, as it would in
 * double.  The flatter a ray meets a plane, the less is known of where. */
ALWAYS_INLINE ints place_is_sure(const Traversal *w, const CellPlace *cell, const reals x[3], const ints in_face[3])
{
    reals across = reals_all(0);
    ints faces = {0}, away = ints_all(-1);
    for (int a = 0; a < 3; a++) {
        across += reals_where(in_face[a], reals_abs(cell->step[a]));
        faces -= in_face[a];
    }
    across = reals_select((ints)(faces == 0), reals_all(1), across);
    for (int a = 0; a < 3; a++) {
        reals blur = PLACE_BLUR * (across + reals_abs(cell->step[a])), room = reals_min(x[a], 1 - x[a]) * across;
        away &= in_face[a] | w->in_plane[a] | (ints)(room > blur);
    }
    return away & (ints)(faces <= 1);
}

MAYBE_UNUSED static void traversal_sure_range(const Traversal *w, const RayPacket *l, const CellPlace *cell, reals s,
                                              ints mask, reals *lo, reals *hi)
{
    reals corners[8], x[3], least, most, none = reals_all(INFINITY);
    ints faces = ints_select((ints)(s == 0), cell->faces >> 3, cell->faces & (ints)(s == 1)), in_face[3];
    (void)l;
    for (int a = 0; a < 3; a++) {
        x[a] = reals_fma(s, cell->step[a], cell->p[a]);
        in_face[a] = (ints)((faces & 1 << a) != 0);
    }
    ints sure = place_is_sure(w, cell, x, in_face), narrow = mask & sure & (ints)((faces & 7) != 0) & (ints)(*lo < *hi);
    if (any(narrow)) {
        load_corners_of(w->values, cell->offset & mask, corners);
        if (w->some_in_plane)
            collapse_in_planes(w, corners, cell->p);
        for (int a = 0; a < 3; a++)
            collapse_cell(corners, a, in_face[a], (ints)(x[a] > (real)0.5));
        range_of_corners(corners, &least, &most);
        *lo = reals_select(narrow, least, *lo);
        *hi = reals_select(narrow, most, *hi);
    }
    *lo = reals_select(sure, *lo, -none);
    *hi = reals_select(sure, *hi, none);
}

#endif

/* The gradient is trilinear in the cell as the field is: a cubic along the ray, per component. */
static inline void traversal_gradients(Traversal *w, const RayPacket *l, const CellPlace *cell, ints mask, Cubic out[3])
{
    reals corners[8], g[3][4];
    need_gradients(w, l, mask);
    ints offset = cell->offset & mask;
    for (int a = 0; a < 3; a++) {
        load_corners_of(w->gradients, offset + a * VOL_BRICK_STRIDE, corners);
        Cubic v = expand_cell(corners, cell->p, cell->step);
        ints vanishing = (ints)(reals_abs(v.a0) < (real)0x1p-16 * (reals_abs(v.a1) + reals_abs(v.a2) + reals_abs(v.a3)));
        if (any(mask & vanishing)) /* where the face has no gradient, none that rounding left behind */
            v.a0 = reals_select(vanishing, interpolate_cell(corners, cell->p), v.a0);
        g[a][0] = v.a0, g[a][1] = v.a1, g[a][2] = v.a2, g[a][3] = v.a3;
    }
    for (int n = 0; n < 4; n++) {
        reals index[3] = {g[0][n], g[1][n], g[2][n]}, world[3];
        world_gradients(&l->scene->volume.grid->world_to_index, index, world);
        for (int a = 0; a < 3; a++)
            *(n == 0 ? &out[a].a0 : n == 1 ? &out[a].a1 : n == 2 ? &out[a].a2 : &out[a].a3) = world[a];
    }
}

#endif
