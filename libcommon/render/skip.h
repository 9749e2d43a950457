/* Which bricks a ray need not enter: found once per scene from the ranges of their values. */
#ifndef VOL_RENDER_SKIP_H
#define VOL_RENDER_SKIP_H

#include "render/scene.h"

/* Fills brick_visible, levels, background_visible, the box around what is visible and the counts.  Without
 * scene->skip all bricks that hold any value are entered. */
VolStatus vol_skip_prepare(VolScene *scene, VolError *err);
void vol_skip_release(VolScene *scene);

#endif
