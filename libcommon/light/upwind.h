/* Convection of light as S prints it: the fixed point of the first-order upwind scheme, by one ordered sweep.
 *
 * sum_a w_a (T - T_a) + sigma T = 0 at every voxel, T_a the neighbour the light comes from along axis a, w_a = |u_a| / h_a;
 * before the box T = 1.  First order at best, 1/2 at the edges of shadows, and dense voxels let through 1 / (1 + sigma h)
 * rather than exp(-sigma h): for comparison with S; rays are better (S is stepped in time towards the same values).
 *
 * The light of a point spreads from the voxel nearest to it, where T = 1. */
#ifndef VOL_LIGHT_UPWIND_H
#define VOL_LIGHT_UPWIND_H

#include <stdbool.h>
#include <stdint.h>

#include "base/cpu.h"
#include "base/status.h"

typedef struct VolUpwind {
    int32_t n[3];            /* value (x, y, z) at (x n[1] + y) n[2] + z */
    double edge[3];          /* of a voxel along each axis, which are orthogonal; world units */
    bool from_point;         /* else parallel */
    double light[3];         /* a point: in index space; else the direction the light travels in, along the axes */
    const float *extinction; /* of every voxel, per world unit, >= 0 */
    float *transmittance;    /* out */
    int threads;
    VolCpu cpu;
} VolUpwind;

/* The same bits for any number of threads and at any cpu level. */
VolStatus vol_upwind(const VolUpwind *upwind, VolError *err);

#endif
