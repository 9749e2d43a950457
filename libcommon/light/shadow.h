/* How much of a light reaches the points of a lattice: transmittance T (K 6), alone, without RGB, fall-off or profile.
 *
 * The way from a point to the light is followed through all that attenuates, an isosurface being a factor 1 - opacity at
 * each crossing; the point's own value is the way's first: a point at or above an isosurface's value is behind it.  What
 * clip planes cut away attenuates nothing.  At the light itself T is 1, in and behind
 * occluders 0. */
#ifndef VOL_LIGHT_SHADOW_H
#define VOL_LIGHT_SHADOW_H

#include "light/lattice.h"
#include "light/mask.h"
#include "trace/trace.h"

typedef struct VolShadow {
    const VolPrepared *prepared; /* of a scene whose termination_opacity is vol_shadow_termination() */
    const VolLight *light;       /* not a headlight */
    const VolLightLattice *lattice;
    const VolLightMask *mask;    /* occluders, or NULL */
    double absorption; /* optical depth counts so many times; >= 0.  What is opaque stays so. */
    int threads;
    float *T; /* per leaf 512 times `channels`, interleaved; 1 at points that do not count */
} VolShadow;

typedef struct VolShadowCounts {
    uint64_t rays, missed; /* missed: known to meet nothing that attenuates */
    double cells;
} VolShadowCounts;

/* 3 where attenuation is coloured, else 1. */
int vol_shadow_channels(const VolScene *scene);

/* Rays in the dark may end where what is left counts for nothing. */
double vol_shadow_termination(double absorption);

/* One exact ray from every point.  The same bits for any number of threads and at any cpu level. */
VolStatus vol_shadow_rays(const VolShadow *shadow, VolShadowCounts *counts, VolError *err);

#endif
