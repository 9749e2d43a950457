/* From a VDB stream to the field that rays use: picks the grid, settles its domain, decodes nothing else. */
#ifndef VOL_LOAD_VOLUME_H
#define VOL_LOAD_VOLUME_H

#include "base/log.h"
#include "base/status.h"
#include "grid/grid.h"
#include "io/vdb.h"

/* `grid_name` NULL: "density", else the only scalar grid.  `keep_double`: values that float cannot hold (double and
 * integer grids) are kept in double.  Not scalar, empty, singular transform: VOL_BAD_INPUT.  Voxels that are NaN or
 * infinite: one warning with their number.  What comes out does not depend on `threads`. */
VolStatus vol_load_volume(const VolVdb *vdb, const char *grid_name, bool keep_double, int threads, const VolLog *log,
                          VolGrid **out, VolError *err);

#endif
