/* Lights that stand somewhere, along a ray through a medium that is the same all the way: what arrives changes, and nothing
 * else does.  No normal is known there, and all that a light does is by its strength. */
#ifndef VOL_TRACE_FALL_OFF_H
#define VOL_TRACE_FALL_OFF_H

#include <stdbool.h>

#include "trace/scene.h"

/* Whether some light stands somewhere. */
bool vol_lights_fall_off(const VolScene *scene);

/* Where a part of the ray from t on must end, at `end` at the latest, for a quadrature of 8 nodes to see all lights as smooth
 * (rms 1e-9).  At least `blur` behind t, and kinks within that are overlooked: it is what places can be told apart by.
 * `nearest`: from nearer than that no light is any stronger. */
double vol_lights_even_until(const VolScene *scene, const VolRay *ray, double nearest, double t, double end, double blur);

/* What arrives of all lights, per channel: its mean over t0 to t1 where what lies in front hides it by exp(-depth[c] u), u
 * from 0 to 1 on the way. */
void vol_lights_mean(const VolScene *scene, const VolRay *ray, double nearest, double t0, double t1, const double depth[3],
                     double mean[3]);

#endif
