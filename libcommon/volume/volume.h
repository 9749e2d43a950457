/* A volume of any kind, as those see it who do not run through it: where it is, how large, what values it holds.  What it
 * is made of, its kind's own header says (grid.h), for the code that builds it and for the traversal that rays take.
 *
 * Index space is the volume's own: of a grid, its voxels lie at integers. */
#ifndef VOL_VOLUME_VOLUME_H
#define VOL_VOLUME_VOLUME_H

#include "volume/grid.h"

typedef enum VolVolumeKind { VOL_VOLUME_NONE, VOL_VOLUME_GRID } VolVolumeKind;

/* A handle: copies are of the same volume. */
typedef struct VolVolume {
    VolVolumeKind kind;
    VolGrid *grid;
} VolVolume;

static inline VolVolume vol_volume_of_grid(VolGrid *grid) { return (VolVolume){VOL_VOLUME_GRID, grid}; }
void vol_volume_free(VolVolume *volume);

/* ---- Where it is ---- */

bool vol_volume_is_empty(const VolVolume *volume); /* there is nothing to be seen, whatever the transfer function */

/* The box of its domain, closed, in index space; corner n (bits 0, 1, 2: at the end along x, y, z) in world space. */
void vol_volume_domain(const VolVolume *volume, double lo[3], double hi[3]);
VolVec3 vol_volume_corner(const VolVolume *volume, int n);

const VolAffine *vol_volume_to_world(const VolVolume *volume);
const VolAffine *vol_volume_to_index(const VolVolume *volume);

double vol_volume_voxel(const VolVolume *volume); /* shortest edge of a voxel, world units: the `v` of lengths like 0.5v */
void vol_volume_voxels(const VolVolume *volume, int32_t lo[3], int32_t hi[3]); /* those that carry values, inclusive */

/* No straight line runs farther than this, world units, through what the volume holds. */
double vol_volume_longest_way(const VolVolume *volume);

/* ---- What it holds ---- */

bool vol_volume_range(const VolVolume *volume, double *lo, double *hi); /* of finite values; false: there are none */
bool vol_volume_is_double(const VolVolume *volume); /* its values are doubles, else floats */

/* A bound of the change of the value along any straight line of this length (world units) in the domain: the largest
 * differences between neighbouring voxels along each axis, times the cells passed along it; at most the values' range. */
double vol_volume_change(const VolVolume *volume, double length);

/* All values times 2^exponent; those that would not be finite any more become the largest that are. */
void vol_volume_rescale(VolVolume *volume, int exponent);

/* false: a value that is NaN or infinite lies at every place, or beside it, and nothing can be seen. */
bool vol_volume_has_cell(const VolVolume *volume);

typedef struct VolVolumeCounts {
    uint64_t active_voxels, bad_voxels; /* bad: NaN or infinite, inside the domain */
    size_t parts, stored_parts;         /* stored: value by value */
} VolVolumeCounts;

VolVolumeCounts vol_volume_counts(const VolVolume *volume);

/* ---- Parts: of a grid, its bricks ---- */

/* Of the finite values inside the domain that lie in a part or on its boundary; lo > hi: there are none. */
void vol_volume_part_range(const VolVolume *volume, size_t part, double *lo, double *hi);

/* The values of a part, each at least once; of volumes of doubles. */
const double *vol_volume_part_values(const VolVolume *volume, size_t part, size_t *count);

#endif
