/* Diffusion as S 12 prints it: sweeps of Gauss-Seidel in index order that overwrite the right side.
 *
 *     L_v <- (L_v + sum_i s_i L_i) / (1 + sum_i s_i)      over the neighbours i of v
 *
 * With the light before the step kept as the right side this would approach the implicit step; as printed it approaches the
 * mean, more so with every sweep, and depends on the order of voxels.  For comparison with S. */
#ifndef VOL_LIGHT_GAUSS_SEIDEL_H
#define VOL_LIGHT_GAUSS_SEIDEL_H

#include "light/diffusion.h"

/* In place; neither cpu nor threads change a bit. */
VolStatus vol_relax_as_printed(const VolDiffusion *diffusion, int sweeps, VolError *err);

#endif
