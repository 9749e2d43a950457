/* Diffusion's heavy loops for any machine. */
#include "light/diffusion_tmpl.h"

const VolDiffusionKernels vol_diffusion_kernels = {diffusion_transform, diffusion_solve, diffusion_preview_rows,
                                                    diffusion_preview_slice};
