/* A field of one number or of RGB, at one point per lane, anywhere: gather.h says what it is there.
 *
 * A point is a cell, by its first voxel, and a place within the cell.  The cell is a whole number at any precision, so that
 * far from the origin of index space no place is lost to rounding.  Each lane keeps the brick that it was in last: while its
 * points stay there, no brick is looked up.  What a lane is told depends on its point alone.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    Gather, gather_begin(), gather_split(), gather_number(), gather_rgb(), gather_points() */
#ifndef VOL_TRACE_GATHER_TMPL_H
#define VOL_TRACE_GATHER_TMPL_H

#include "trace/bricks_tmpl.h"
#include "trace/gather.h"
#include "trace/trilinear_tmpl.h"

typedef struct Gather {
    const VolGrid *field;
    VolBrickStore *store;

    /* The brick that each lane was in last. */
    const real *values[LANES]; /* its planes; anything that may be loaded from, where there is none yet */
    ints first[3];             /* its first cell */
    ints known, invalid;       /* there is one; it has voxels that are not finite */
} Gather;

static inline void gather_begin(Gather *g, VolGather *from)
{
    memset(g, 0, sizeof *g);
    g->field = from->field;
    g->store = &from->store;
    for (int i = 0; i < LANES; i++)
        g->values[i] = from->store.numbers;
}

/* The cell and the place in it of index-space coordinate `from` + x, along one axis. */
ALWAYS_INLINE void gather_split(ints from, reals x, ints *cell, reals *f)
{
    const real far = 0x1p30; /* no field reaches there */
    x = reals_clamp(x, -far, far);
    reals whole = reals_trunc(x);
    whole -= reals_where((ints)(x < whole), reals_all(1));
    *cell = from + __builtin_convertvector(whole, ints);
    *f = x - whole;
}

/* ---- Bricks ---- */

static inline void gather_enter(Gather *g, unsigned i, const ints cell[3])
{
    const VolGrid *field = g->field;
    const int32_t at[3] = {(int32_t)cell[0][i] >> 3, (int32_t)cell[1][i] >> 3, (int32_t)cell[2][i] >> 3};
    uint32_t number = vol_grid_brick_number(field, at[0], at[1], at[2]);
    g->values[i] = brick_planes(field, g->store, g->values, number, vol_grid_planes(field));
    for (int a = 0; a < 3; a++)
        g->first[a][i] = at[a] * VOL_BRICK_CELLS;
    g->known[i] = -1;
    g->invalid[i] = -(lane_int)field->bricks[number].invalid;
}

/* Of `cell`, whose lanes of `mask` lie in the field's domain: the places of its first corners in each lane's brick. */
ALWAYS_INLINE ints gather_offsets(Gather *g, const ints cell[3], ints mask)
{
    ints local[3], missing = mask & ~g->known;
    for (int a = 0; a < 3; a++) {
        local[a] = cell[a] - g->first[a];
        missing |= mask & (ints)((local[a] & -VOL_BRICK_CELLS) != 0);
    }
    if (__builtin_expect(any(missing), 0)) {
        FOR_LANES(i, mask_bits(missing))
            gather_enter(g, i, cell);
        for (int a = 0; a < 3; a++)
            local[a] = cell[a] - g->first[a];
    }
    ints row = (local[0] << 3) + local[0] + local[1]; /* 9 x + y */
    return ((row << 3) + row + local[2]) & mask;
}

/* Takes points into the domain: beyond a box to its faces.  Those that lie in it then: others see the background. */
ALWAYS_INLINE ints gather_inside(const VolGrid *field, ints cell[3], reals f[3], ints mask)
{
    ints beyond = mask & ~mask;
    for (int a = 0; a < 3; a++) {
        ints least = ints_all(field->cell_min[a]), most = ints_all(field->cell_max[a]);
        ints below = (ints)(cell[a] < least), above = (ints)(cell[a] > most);
        cell[a] = ints_select(below, least, ints_select(above, most, cell[a]));
        f[a] = reals_select(below, reals_all(0), reals_select(above, reals_all(1), f[a]));
        beyond |= below | above;
    }
    return field->domain == VOL_DOMAIN_BOX ? mask : mask & ~beyond;
}

/* ---- Values ---- */

ALWAYS_INLINE reals gather_plane(const Gather *g, ints offset, const reals f[3], ints inside, int plane)
{
    reals corners[8];
    load_corners_of(g->values, offset + plane * VOL_BRICK_STRIDE, corners);
    reals v = interpolate_cell(corners, f);
    if (__builtin_expect(any(g->invalid & inside), 0))
        v = reals_select(~g->invalid | all_finite(corners), v, reals_all(NAN));
    return reals_select(inside, v, reals_all((real)vol_grid_in_plane(g->field, g->field->background, plane)));
}

/* The planes of the field at cells and places, 0 to 1, in them; lanes out of `mask` receive anything. */
ALWAYS_INLINE void gather_planes(Gather *g, const ints cell[3], const reals f[3], ints mask, int planes, reals out[])
{
    ints at[3] = {cell[0], cell[1], cell[2]};
    reals place[3] = {f[0], f[1], f[2]};
    ints inside = gather_inside(g->field, at, place, mask), offset = gather_offsets(g, at, inside);
    for (int c = 0; c < planes; c++)
        out[c] = gather_plane(g, offset, place, inside, c);
}

/* Of a scalar field. */
ALWAYS_INLINE reals gather_number(Gather *g, const ints cell[3], const reals f[3], ints mask)
{
    reals v;
    gather_planes(g, cell, f, mask, 1, &v);
    return v;
}

/* Of any field: a number is grey. */
ALWAYS_INLINE void gather_rgb(Gather *g, const ints cell[3], const reals f[3], ints mask, reals out[3])
{
    if (g->field->is_rgb) {
        gather_planes(g, cell, f, mask, 3, out);
    } else {
        out[0] = gather_number(g, cell, f, mask);
        out[1] = out[2] = out[0];
    }
}

/* ---- Many points ---- */

/* A point of world space into lane i. */
static inline void gather_place(const VolGrid *field, VolVec3 point, unsigned i, ints cell[3], reals f[3])
{
    VolVec3 index = vol_apply(&field->world_to_index, point);
    const double x[3] = {index.x, index.y, index.z};
    for (int a = 0; a < 3; a++) {
        double inside = x[a] > -0x1p30 ? x[a] < 0x1p30 ? x[a] : 0x1p30 : -0x1p30, whole = __builtin_floor(inside);
        cell[a][i] = (lane_int)whole;
        f[a][i] = (real)(inside - whole);
    }
}

static inline void gather_points(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    Gather g;
    ints cell[3] = {ints_all(0), ints_all(0), ints_all(0)};
    reals f[3] = {reals_all(0), reals_all(0), reals_all(0)}, v[3];
    const int planes = vol_grid_planes(gather->field);
    gather_begin(&g, gather);
    for (size_t first = 0; first < count; first += LANES) {
        unsigned some = count - first < LANES ? (unsigned)(count - first) : LANES;
        for (unsigned i = 0; i < some; i++)
            gather_place(gather->field, points[first + i], i, cell, f);
        gather_rgb(&g, cell, f, mask_of((1u << some) - 1), v);
        for (unsigned i = 0; i < some; i++)
            for (int c = 0; c < planes; c++)
                *out++ = (double)v[c][i];
    }
}

#endif
