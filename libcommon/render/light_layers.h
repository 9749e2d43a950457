/* The parts of the scattered light, one for each light and one for what is indirect: the picture once more for each of them,
 * with no other light in it. */
#ifndef VOL_RENDER_LIGHT_LAYERS_H
#define VOL_RENDER_LIGHT_LAYERS_H

#include "render/frame.h"
#include "trace/lit.h"

typedef struct VolLightLayers {
    struct VolLightLayer *layers;
    VolFramePass *passes; /* of a frame */
    size_t count;
} VolLightLayers;

/* The layers `direct` and `indirect` of the scene, where they are asked for; `number` is that of each of its lights, and
 * those of one number are one layer.  VOL_USAGE: there are no light grids, they hold the total alone, or there are more than
 * VOL_PASSES.  Whatever comes of it, vol_light_layers_free() is to follow. */
VolStatus vol_light_layers_make(const VolScene *scene, const int *number, VolLightLayers *out, VolError *err);
void vol_light_layers_free(VolLightLayers *layers);

#endif
