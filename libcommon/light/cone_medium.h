/* What a volume lets through between the planes of `cone`. */
#ifndef VOL_LIGHT_CONE_MEDIUM_H
#define VOL_LIGHT_CONE_MEDIUM_H

#include "light/cone.h"
#include "light/depths.h"

typedef struct VolConeMedium {
    VolTfCompiled *transport;
    VolDepths depths;
    int channels; /* 3 where `transport` is coloured, else 1: of VolCone, too */
} VolConeMedium;

/* `samples`: steps per voxel of the scene's grid (depths.h).  The scene outlives this.  vol_cone_medium_free() is to follow
 * whatever comes of it. */
VolStatus vol_cone_medium_new(const VolScene *scene, int samples, int threads, VolConeMedium *out, VolError *err);
void vol_cone_medium_free(VolConeMedium *medium);

/* For VolCone.pass, a VolConeMedium being its `user`. */
VolConePass vol_cone_medium_pass;

#endif
