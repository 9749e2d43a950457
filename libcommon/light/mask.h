/* Volumes with a mask, as meshes leave behind: blanks, where nothing attenuates, and occluders, which let nothing through.
 *
 * Cells with a blank corner are empty.  An occluder ends half-way between a voxel of it and one that is none. */
#ifndef VOL_LIGHT_MASK_H
#define VOL_LIGHT_MASK_H

#include "tf/tf.h"
#include "trace/prepared.h"

enum { VOL_MASK_BLANK = 0, VOL_MASK_OCCLUDER = 2 };

typedef struct VolLightMask {
    VolVolume volume; /* the scene's without its blanks; kind NONE: there are none */
    VolGrid *occluders; /* 1 in them, else 0; NULL: there are none */
    VolTfCompiled wall;
    VolScene scene;       /* of the occluders alone */
    VolPrepared prepared; /* of that */
} VolLightMask;

/* `mask` has a value for each voxel of the scene's volume: VOL_BAD_INPUT where its voxels lie elsewhere.  The mask is not
 * needed afterwards, and `out` not moved.  vol_light_mask_free() is to follow whatever comes of it. */
VolStatus vol_light_mask_new(const VolScene *scene, const VolGrid *mask, int threads, VolLightMask *out, VolError *err);
void vol_light_mask_free(VolLightMask *mask);

/* Whether the voxel nearest to a place is an occluder's. */
bool vol_light_mask_hides(const VolLightMask *mask, VolVec3 place);

#endif
