/* Indirect light that follows the light's own way, attenuated by `transport` and blurred as it goes (K 12).
 *
 * From plane to plane, I_{k+1} = T_k Blur(I_k): T_k is what the medium lets through on the way along each ray, per channel.
 * The blur's variance along each of two axes across the light grows by `rate` times the path, whatever the planes'
 * distance: blur_length tan^2(angle / 2) / 2.  Planes stand across the light: of a sun across its direction, of a spot
 * across its axis, of a point across the direction to the domain's middle; rays of the latter two spread, and with them what
 * was blurred before.  I is 1 before the domain, a spot's profile there, and is as it was there beyond the planes' edges. */
#ifndef VOL_LIGHT_CONE_H
#define VOL_LIGHT_CONE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "base/vec.h"
#include "trace/scene.h"

/* Lattice points (i, j) of plane k = 0..count, i = low[0]..low[0]+size[0]-1: of a sun
 *     origin + (first + k step) along + i across[0] + j across[1],
 * of a light that stands somewhere
 *     origin + (first + k step) (along + i across[0] + j across[1]). */
typedef struct VolConePlanes {
    bool spreads;
    VolVec3 origin, along, across[2];
    double first, step;
    int32_t count, low[2], size[2];
    double to_plane[3][3]; /* from origin on: multiples of along, across[0], across[1] */
} VolConePlanes;

/* The box of a domain, in index space. */
typedef struct VolConeDomain {
    VolAffine index_to_world;
    double lo[3], hi[3];
} VolConeDomain;

/* Planes and lattice points about `voxel` apart around the domain, with a margin for the blur.  VOL_USAGE where a light that
 * stands somewhere lies in the domain or sees it under more than 90 degrees. */
VolStatus vol_cone_planes(const VolLight *light, const VolConeDomain *domain, double voxel, double rate, VolConePlanes *out,
                          VolError *err);

/* K's as printed: slices of voxels across the axis that the light follows most, a voxel apart, one for every voxel. */
VolStatus vol_cone_slices(const VolLight *light, const VolConeDomain *domain, VolConePlanes *out, VolError *err);

/* Lattice point number (i, j), from 0 on, of plane k, whole or not. */
VolVec3 vol_cone_place(const VolConePlanes *planes, double k, double i, double j);

/* Voxels (first[0], first[1], first[2] + m) of a light lattice, m = 0..count-1, whose values go to out[at + m]. */
typedef struct VolConeRow {
    int32_t first[3], count;
    size_t at;
} VolConeRow;

/* Fills passed[c][j], the transmittance from plane k to k+1 along the rays of lattice points (i, j). */
typedef VolStatus VolConePass(void *user, const VolConePlanes *planes, int32_t k, int32_t i, int thread,
                              float *const passed[3], VolError *err);

typedef struct VolCone {
    const VolConePlanes *planes;
    const VolLight *light;
    const float *start; /* I before the domain, size[0] x size[1]; NULL: the light's */
    double rate;        /* world units */
    double taps;        /* as printed, K 9: instead, four taps this far away, world units; 0: not */
    int channels;       /* 1 or 3 */
    VolConePass *pass;
    void *user;
    VolAffine index_to_world; /* of the light lattice */
    const VolConeRow *rows;
    size_t row_count;
    float *out[3]; /* I: without RGB and fall-off */
    int threads;
} VolCone;

/* The same bits for any number of threads. */
VolStatus vol_cone_solve(const VolCone *cone, VolError *err);

#endif
