/* Where rays in float would be off by more than they may, and are traced in double instead. */
#ifndef VOL_TRACE_CONDITIONING_H
#define VOL_TRACE_CONDITIONING_H

#include "trace/scene.h"

/* Fills scene->ill_conditioned; NULL where float is enough everywhere. */
VolStatus vol_conditioning_prepare(VolScene *scene, VolError *err);

#endif
