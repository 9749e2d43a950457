/* Which bricks a ray need not enter: found once per scene from the ranges of their values. */
#ifndef VOL_TRACE_EMPTY_SPACE_H
#define VOL_TRACE_EMPTY_SPACE_H

#include "trace/scene.h"

/* Fills brick_visible, levels, background_visible, the box around what is visible and the counts.  Without
 * scene->skip all bricks that hold any value are entered. */
VolStatus vol_empty_space_prepare(VolScene *scene, VolError *err);
void vol_empty_space_release(VolScene *scene);

#endif
