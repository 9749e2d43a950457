/* Where what is seen begins or ends at once: at knots that two nodes share, at isosurfaces. */
#ifndef VOL_TRACE_JUMPS_H
#define VOL_TRACE_JUMPS_H

#include <stdbool.h>
#include <stddef.h>

#include "tf/tf.h"

/* By how much what particles take from a ray or add to it, per unit of length, changes at a knot; 0 where all that can be
 * seen goes over from one interval to the next without a jump. */
double vol_jump_at_knot(const VolTfCompiled *tf, size_t knot);

/* What they take or add next to a value. */
double vol_particles_around(const VolTfCompiled *tf, double v);

/* Whether there are jumps or isosurfaces. */
bool vol_has_jumps(const VolTfCompiled *tf);

#endif
