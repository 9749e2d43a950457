/* Lights that stand somewhere, along a ray through a medium that is the same all the way: what arrives changes, and nothing
 * else does.  No normal is known there, and all that a light does is by its strength. */
#ifndef VOL_TRACE_FALL_OFF_H
#define VOL_TRACE_FALL_OFF_H

#include "trace/scene.h"

/* What arrives of all lights, per channel: its mean over t0 to t1 where what lies in front hides it by exp(-depth[c] u), u
 * from 0 to 1 on the way.  `nearest`: from nearer than that no light is any stronger. */
void vol_lights_mean(const VolScene *scene, const VolRay *ray, double nearest, double t0, double t1, const double depth[3],
                     double mean[3]);

#endif
