/* What a volume lets through between the planes of `cone`, by samples along each ray. */
#ifndef VOL_LIGHT_CONE_MEDIUM_H
#define VOL_LIGHT_CONE_MEDIUM_H

#include "light/cone.h"
#include "tf/preint.h"
#include "trace/gather.h"

typedef struct VolConeSamples VolConeSamples; /* a thread's */

typedef struct VolConeMedium {
    const VolScene *scene; /* its grid, transfer function and clip planes */
    VolTfCompiled transport;
    VolTfIntegrals integrals;
    int channels; /* 3 where `transport` is coloured, else 1: of VolCone, too */
    int samples;  /* steps per voxel of the grid; between planes at least as many */
    VolConeSamples *of_thread;
    int threads;
} VolConeMedium;

/* The scene outlives this.  vol_cone_medium_free() is to follow whatever comes of it. */
VolStatus vol_cone_medium_new(const VolScene *scene, int samples, int threads, VolConeMedium *out, VolError *err);
void vol_cone_medium_free(VolConeMedium *medium);

/* For VolCone.pass, a VolConeMedium being its `user`.  Between samples the value runs linearly: particles' and surfaces'
 * optical depths are exact for that, to second order in the step; isosurfaces are crossed as the values say.  Nothing
 * attenuates beyond the domain and clip planes, nor beside a value that is not finite. */
VolConePass vol_cone_medium_pass;

#endif
