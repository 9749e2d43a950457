/* Light of all sources as one field that has spread (S): L0 = sum_k RGB_k T_k with fall-off, then one implicit step of
 * diffusion of the whole D t.
 *
 * The lattice is a box along orthogonal axes.  Voxels of it that are blank or occluders take no part in diffusion: light
 * crosses blanks as the transmittances say, and L stays L0 there; occluders are dark. */
#ifndef VOL_LIGHT_PDE_H
#define VOL_LIGHT_PDE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "light/diffusion.h"
#include "trace/scene.h"

/* The transmittance from a light to voxels (x, y, 0..n[2]-1) of the lattice, per channel. */
typedef VolStatus VolPdeTransmittance(void *user, size_t light, int32_t x, int32_t y, int thread, float *const t[3],
                                      VolError *err);

typedef struct VolPde {
    VolAffine index_to_world; /* of the lattice: voxels (0, 0, 0) to n - 1 */
    int32_t n[3];
    const VolLight *lights;
    size_t light_count;
    double nearest;       /* lights shine no brighter than from this distance */
    double spread[3];     /* D t of each channel, world units squared */
    double absorption;    /* T^absorption; what is 0 stays 0 */
    const uint8_t *medium; /* VolMedium of each voxel; NULL: all are inside */
    bool preview;
    VolPdeTransmittance *transmittance; /* NULL: as S prints it, upwind through the scene's medium, and `sweeps` of S 12 */
    void *user;
    const VolScene *scene;
    int sweeps;
    float *total[3]; /* out: of all voxels, z fastest */
    int threads;
    VolCpu cpu;
} VolPde;

/* VOL_USAGE where axes are not orthogonal; `residual` as of vol_diffuse(). */
VolStatus vol_pde_solve(const VolPde *pde, double *residual, VolError *err);

#endif
