/* Where rays in float would be off by more than they may, and are traced in double instead. */
#ifndef VOL_TRACE_CONDITIONING_H
#define VOL_TRACE_CONDITIONING_H

#include "trace/empty_space.h"
#include "trace/scene.h"

/* One number per part of the volume: 1 where float is not enough; NULL where it is everywhere. */
VolStatus vol_conditioning_judge(const VolScene *scene, const VolEmptySpace *space, bool shaded, uint8_t **out,
                                 VolError *err);

#endif
