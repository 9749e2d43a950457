/* Where rays in float would be off by more than they may, and are traced in double instead. */
#ifndef VOL_RENDER_CONDITIONING_H
#define VOL_RENDER_CONDITIONING_H

#include "render/scene.h"

/* Fills scene->ill_conditioned; NULL where float is enough everywhere. */
VolStatus vol_conditioning_prepare(VolScene *scene, VolError *err);

#endif
