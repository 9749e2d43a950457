/* Doubles that float puts on another side of a knot or an isosurface: a plateau at its value, or just beside it. */
#ifndef VOL_TRACE_SIDES_H
#define VOL_TRACE_SIDES_H

#include "base/status.h"
#include "volume/grid.h"
#include "tf/tf.h"

typedef struct VolSides VolSides;

VolStatus vol_sides_new(const VolTfCompiled *tf, VolSides **out, VolError *err);
void vol_sides_free(VolSides *sides);

/* Whether one of the brick's values is such; of grids of doubles. */
bool vol_sides_change(const VolSides *sides, const VolGrid *grid, const VolBrick *brick);

#endif
