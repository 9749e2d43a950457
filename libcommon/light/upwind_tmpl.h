/* Rows of the upwind scheme side by side.
 *
 * What a row takes from its neighbours is computed by vectors along it, T = own + carried T_2; then the recurrence along it,
 * each of whose steps waits for the one before, for up to VOL_UPWIND_ROWS rows at once.  Nothing is fused: the same bits on
 * any machine.
 *
 * PARAMETERS  none: in float
 * PROVIDES    upwind_rows() */
#ifndef VOL_LIGHT_UPWIND_TMPL_H
#define VOL_LIGHT_UPWIND_TMPL_H

#include "light/upwind_private.h"
#include "simd/reals.h"

enum { STRETCH = 64 }; /* of rows, whose coefficients are at hand */

typedef struct Coefficients {
    float own[VOL_UPWIND_ROWS][STRETCH], carried[VOL_UPWIND_ROWS][STRETCH], t[VOL_UPWIND_ROWS][STRETCH];
} Coefficients;

ALWAYS_INLINE reals load_lanes(const float *from)
{
    reals a;
    memcpy(&a, from, sizeof a);
    return a;
}

/* Of LANES voxels from z on.  Of a point all weights are multiplied by its distance. */
ALWAYS_INLINE void weigh(const VolUpwindWay *way, const VolUpwindRow *row, int32_t z, const float *before,
                         const float *beside, const float *extinction, float *own, float *carried)
{
    reals along = reals_all(way->weight), depth = load_lanes(extinction);
    if (way->from_point) {
        float ramp[LANES];
        for (int l = 0; l < LANES; l++)
            ramp[l] = (float)(z + l - way->source);
        reals away = load_lanes(ramp);
        along = reals_max(away, -away);
        away = away * reals_all(way->edge);
        depth = depth * reals_sqrt(away * away + reals_all(row->across));
    }
    reals all = (reals_all(row->weight[0]) + reals_all(row->weight[1])) + along, whole = all + depth;
    reals from = reals_all(row->weight[0]) * load_lanes(before) + reals_all(row->weight[1]) * load_lanes(beside);
    ints here = (ints)(all == reals_all(0)); /* the light's own voxel */
    whole = reals_select(here, reals_all(1), whole);
    from = reals_select(here, reals_all(1), from);
    reals over = reals_all(1) / whole, first = from * over, rest = along * over;
    first = reals_select((ints)(first < reals_all(1e-30f)), reals_all(0), first); /* denormal numbers are slow */
    memcpy(own, &first, sizeof first);
    memcpy(carried, &rest, sizeof rest);
}

ALWAYS_INLINE void weigh_stretch(const VolUpwindWay *way, const VolUpwindRow *row, int32_t begin, int32_t count, float *own,
                                 float *carried)
{
    int32_t i = 0, z = begin;
    for (; i + LANES <= count; i += LANES, z += LANES)
        weigh(way, row, z, row->before + z, row->beside + z, row->extinction + z, own + i, carried + i);
    if (i == count)
        return;
    float some[3][LANES] = {0};
    size_t bytes = (size_t)(count - i) * sizeof(float);
    memcpy(some[0], row->before + z, bytes);
    memcpy(some[1], row->beside + z, bytes);
    memcpy(some[2], row->extinction + z, bytes);
    weigh(way, row, z, some[0], some[1], some[2], own + i, carried + i);
}

/* `rows` is a constant at every call. */
ALWAYS_INLINE void run(Coefficients *c, int rows, int32_t first, int32_t count, int step, float last[VOL_UPWIND_ROWS])
{
    float t[VOL_UPWIND_ROWS];
    memcpy(t, last, sizeof t);
    for (int32_t i = 0, z = first; i < count; i++, z += step) {
#pragma GCC unroll 8
        for (int r = 0; r < rows; r++) {
            t[r] = c->own[r][z] + c->carried[r][z] * t[r];
            c->t[r][z] = t[r];
        }
    }
    memcpy(last, t, sizeof t);
}

static inline void upwind_rows(const VolUpwindWay *way, const VolUpwindRow *rows, int count)
{
    Coefficients c;
    float last[VOL_UPWIND_ROWS] = {0};
    for (int r = 0; r < count; r++)
        last[r] = way->from_voxel ? rows[r].to[way->first - way->step] : 1;
    for (int32_t done = 0; done < way->count; done += STRETCH) {
        int32_t some = way->count - done < STRETCH ? way->count - done : STRETCH;
        int32_t begin = way->step > 0 ? way->first + done : way->first - done - some + 1;
        int32_t first = way->step > 0 ? 0 : some - 1;
        for (int r = 0; r < count; r++)
            weigh_stretch(way, &rows[r], begin, some, c.own[r], c.carried[r]);
        if (count > 4)
            run(&c, VOL_UPWIND_ROWS, first, some, way->step, last);
        else if (count > 1)
            run(&c, 4, first, some, way->step, last);
        else
            run(&c, 1, first, some, way->step, last);
        for (int r = 0; r < count; r++)
            memcpy(rows[r].to + begin, c.t[r], (size_t)some * sizeof(float));
    }
}

#endif
