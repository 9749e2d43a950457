/* Where light is solved: the points of a lattice along the volume's axes.
 *
 * A point counts if it is a corner of a cell of the lattice in which the transfer function shows something, or lies one
 * voxel of the lattice around such corners; inside the box that covers the domain; and for a spot within its cone or no
 * farther from it than the longest diagonal of a voxel, so that all that is read within the cone is there. */
#ifndef VOL_LIGHT_LATTICE_H
#define VOL_LIGHT_LATTICE_H

#include <stdint.h>

#include "base/status.h"
#include "trace/scene.h"

enum { VOL_LIGHT_LEAF = 8, VOL_LIGHT_LEAF_POINTS = 512 };

/* Points origin + (n / 64, n / 8 % 8, n % 8); bit n of `active`. */
typedef struct VolLightLeaf {
    int32_t origin[3]; /* multiples of 8 */
    uint64_t active[8];
} VolLightLeaf;

typedef struct VolLightLattice {
    VolAffine index_to_world; /* its points lie at integers */
    int32_t lo[3], hi[3];     /* the box around the domain, inclusive */
    VolLightLeaf *leaves;     /* ascending by origin, x first; none without an active point */
    size_t leaf_count;
    uint64_t points; /* active ones */
} VolLightLattice;

/* `resolution` 0: the volume's own voxels; else so many points along the domain's longest extent, at least 2 along any axis,
 * the outermost on the domain's corners.  VOL_USAGE: more than 65536.  vol_light_lattice_free() is to follow whatever comes
 * of it. */
VolStatus vol_light_lattice_new(const VolScene *scene, const VolLight *light, int64_t resolution, int threads,
                                VolLightLattice *out, VolError *err);
void vol_light_lattice_free(VolLightLattice *lattice);

static inline bool vol_light_leaf_has(const VolLightLeaf *leaf, int n) { return leaf->active[n / 64] >> n % 64 & 1; }

/* World space. */
VolVec3 vol_light_point(const VolLightLattice *lattice, const VolLightLeaf *leaf, int n);

#endif
