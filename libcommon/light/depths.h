/* Optical depths of short ways through a grid, by samples.
 *
 * Between samples the value runs linearly: particles and surfaces are exact for that, to second order in the step;
 * isosurfaces are crossed as the values say.  Nothing attenuates beyond the domain and clip planes, nor beside a value that
 * is not finite. */
#ifndef VOL_LIGHT_DEPTHS_H
#define VOL_LIGHT_DEPTHS_H

#include "tf/preint.h"
#include "trace/gather.h"
#include "trace/scene.h"

typedef struct VolDepthSamples VolDepthSamples; /* a thread's */

typedef struct VolDepths {
    const VolScene *scene; /* its grid and clip planes */
    VolTfIntegrals integrals;
    int samples; /* steps per voxel of the grid; of a way at least one */
    VolDepthSamples *of_thread;
    int threads;
} VolDepths;

/* Scene and transfer function, which is for the scene's grid, outlive this.  vol_depths_free() is to follow whatever comes
 * of it. */
VolStatus vol_depths_new(const VolScene *scene, const VolTfCompiled *tf, int samples, int threads, VolDepths *out,
                         VolError *err);
void vol_depths_free(VolDepths *depths);

/* From from[i] to to[i], per channel: depth[i], 0..INFINITY. */
VolStatus vol_depths_between(const VolDepths *depths, int thread, const VolVec3 *from, const VolVec3 *to, size_t count,
                             double (*depth)[3], VolError *err);

#endif
