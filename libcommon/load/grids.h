/* From a VDB stream to the fields that rays use: picks the grid, settles its domain, decodes nothing else. */
#ifndef VOL_LOAD_GRIDS_H
#define VOL_LOAD_GRIDS_H

#include "base/log.h"
#include "base/status.h"
#include "io/vdb.h"
#include "volume/volume.h"

/* `grid_name` NULL: "density", else the only scalar grid.  Grids of doubles or integers are kept in double where float does
 * not hold all of their values, with `keep_double` always.  Not scalar, singular transform: VOL_BAD_INPUT.  Nothing active,
 * several grids of that name, voxels that are NaN or infinite: a warning each.  What comes out does not depend on `threads`.
 * Nothing else can be read from the VDB afterwards: its memory is given back on the way. */
VolStatus vol_load_volume(const VolVdb *vdb, const char *grid_name, bool keep_double, int threads, const VolLog *log,
                          VolVolume *out, VolError *err);

/* A field that lies beside the volume: light, colour.  vec3s: RGB in float; scalar: as a volume is loaded, in float where
 * that holds all values.  Faults and warnings are those of volumes.  The VDB can still be read. */
VolStatus vol_load_field(const VolVdb *vdb, const char *grid_name, int threads, const VolLog *log, VolGrid **out,
                         VolError *err);

#endif
