/* `cone` and `pde` at the points of a lattice. */
#ifndef VOL_LIGHT_ON_LATTICE_H
#define VOL_LIGHT_ON_LATTICE_H

#include "light/lattice.h"
#include "light/shadow.h"

typedef struct VolConeOptions {
    double angle;       /* full, degrees, 0..180 */
    double blur_length; /* world units */
    bool as_printed;
    int threads;
} VolConeOptions;

/* Indirect light, RGB and fall-off included: per leaf 512 times 3, interleaved; 0 at points that do not count. */
VolStatus vol_cone_on_lattice(const VolScene *scene, const VolLight *light, const VolLightLattice *lattice,
                              const VolConeOptions *options, float *out, VolError *err);

typedef struct VolPdeOptions {
    const VolLight *lights;
    size_t light_count;
    double spread[3]; /* D t of each channel, world units squared */
    double absorption;
    bool preview, as_printed;
    int sweeps; /* as printed */
    const VolGrid *mask; /* 0 blank, 2 occluder, by the nearest voxel; NULL: all are inside */
    const VolLightMask *occluders; /* of it */
    int threads;
} VolPdeOptions;

/* Light of all lights at the points of `lattice`, which no spot has cut: as above.  Solved in all of the lattice's box. */
VolStatus vol_pde_on_lattice(const VolPrepared *prepared, const VolLightLattice *lattice, const VolPdeOptions *options,
                             float *out, double *residual, VolError *err);

#endif
