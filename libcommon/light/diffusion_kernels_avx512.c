/* Diffusion's heavy loops with AVX-512. */
#include "light/diffusion_tmpl.h"

const VolDiffusionKernels vol_diffusion_kernels_avx512 = {diffusion_transform, diffusion_solve, diffusion_preview_rows,
                                                    diffusion_preview_slice};
