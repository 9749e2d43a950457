/* From a VDB stream to the field that rays use: picks the grid, settles its domain, decodes nothing else. */
#ifndef VOL_LOAD_VOLUME_H
#define VOL_LOAD_VOLUME_H

#include "base/log.h"
#include "base/status.h"
#include "volume/grid.h"
#include "io/vdb.h"
#include "tf/foreign.h"

/* `grid_name` NULL: "density", else the only scalar grid.  Grids of doubles or integers are kept in double where float does
 * not hold all of their values, with `keep_double` always.  Not scalar, singular transform: VOL_BAD_INPUT.  Nothing active,
 * several grids of that name, voxels that are NaN or infinite: a warning each.  What comes out does not depend on `threads`.
 * Nothing else can be read from the VDB afterwards: its memory is given back on the way. */
VolStatus vol_load_volume(const VolVdb *vdb, const char *grid_name, bool keep_double, int threads, const VolLog *log,
                          VolGrid **out, VolError *err);

/* The world length of one step of the unit, as other programs have it (pellucid-files(5)).  Where it depends on the
 * direction - voxels or volumes that are not cubes - that of the cube of the same size. */
double vol_volume_step(const VolGrid *grid, VolStepUnit unit);

#endif
