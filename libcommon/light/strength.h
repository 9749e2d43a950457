/* How much of a light's RGB arrives where nothing is in the way. */
#ifndef VOL_LIGHT_STRENGTH_H
#define VOL_LIGHT_STRENGTH_H

#include "trace/scene.h"

/* What a spot sends this way, from 0 beyond its edge smoothly to 1 within; other lights: 1. */
double vol_spot_profile(const VolLight *light, VolVec3 way);

/* With fall-off: a light that stands somewhere shines no brighter than from the distance `nearest`. */
double vol_light_strength(const VolLight *light, VolVec3 place, double nearest);

#endif
