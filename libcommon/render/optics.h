/* The kernels' tables, one kind per precision. */
#ifndef VOL_RENDER_OPTICS_H
#define VOL_RENDER_OPTICS_H

#include "render/scene.h"

VolStatus vol_optics_f32_new(const VolScene *scene, VolOpticsF32 **out, VolError *err);
void vol_optics_f32_free(VolOpticsF32 *optics);
VolStatus vol_optics_f64_new(const VolScene *scene, VolOpticsF64 **out, VolError *err);
void vol_optics_f64_free(VolOpticsF64 *optics);

#endif
