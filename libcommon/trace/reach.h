/* How much light reaches a surface through what lies close before it.
 *
 * Between voxels a light grid is trilinear, but the transmittance beside a surface is not: it falls within one cell from
 * what comes to the surface to what comes through it.  So the way from a point of a surface to the light is followed through
 * surface cells, in double and to rounding: those whose corners lie on both sides of an isosurface, or across whose corners'
 * range the depth of soft surfaces exceeds 1.  Where the first other cell begins, the grid is asked. */
#ifndef VOL_TRACE_REACH_H
#define VOL_TRACE_REACH_H

#include "trace/lit.h"

/* Whether cells whose corners range from lo to hi are surface cells. */
bool vol_reach_is_surface(const VolScene *scene, double lo, double hi);

/* Transmittance from a point of world space to light n of the scene, per channel.  `own`: the value of the isosurface that
 * the point lies on, whose crossing there is left out; NAN: it lies on none.  False, and `T` is as it was: the point lies in
 * no surface cell. */
bool vol_reach(const VolScene *scene, VolVec3 point, size_t n, double own, double T[3]);

/* The scene's indirect light, or the total, at a point of an isosurface: of the corners around it in each light grid, those
 * alone count that lie on the viewer's side of `value`, below it or not; all of them, if none does. */
void vol_reach_around(const VolScene *scene, VolVec3 point, double value, bool below, double rgb[3]);

#endif
