/* Doubles that float puts on another side of a knot or an isosurface: a plateau at its value, or just beside it. */
#ifndef VOL_TRACE_SIDES_H
#define VOL_TRACE_SIDES_H

#include "base/status.h"
#include "tf/tf.h"
#include "volume/volume.h"

typedef struct VolSides VolSides;

VolStatus vol_sides_new(const VolTfCompiled *tf, VolSides **out, VolError *err);
void vol_sides_free(VolSides *sides);

/* Whether one of the part's values is such; of volumes of doubles. */
bool vol_sides_change(const VolSides *sides, const VolVolume *volume, size_t part);

#endif
