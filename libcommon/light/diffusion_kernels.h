/* The heavy loops of diffusion, compiled per cpu level from diffusion_tmpl.h. */
#ifndef VOL_LIGHT_DIFFUSION_KERNELS_H
#define VOL_LIGHT_DIFFUSION_KERNELS_H

#include "light/cosine_transform.h"
#include "light/diffusion.h"

/* Columns of a row that are solved together. */
enum { VOL_MODES = 64, VOL_MOST_LANES = 16 };

/* Transforms along axes 1 and 2, modes along axis 0 solved as tridiagonal systems. */
typedef struct VolModes {
    int n[3];
    const VolCosine *cosine[3]; /* of axes 1 and 2 */
    float s;                    /* along axis 0 */
    const float *eigen[3];      /* of axes 1 and 2: 4 s_a sin^2(pi k / 2 n_a) */
} VolModes;

/* Pivots of (1 + s K), which are the same for all lines: y_i = f_i + share[i-1] y_{i-1}, x_i = over[i] y_i + share[i]
 * x_{i+1}. */
typedef struct VolPivots {
    int n;
    float *share, *over;
} VolPivots;

typedef struct VolDiffusionKernels {
    /* A slice of n[1] x n[2] numbers to its coefficients or back. */
    void (*transform)(const VolModes *modes, float *slice, bool inverse, float *work);
    /* Coefficients (., row, first..first+count-1), count <= VOL_MODES; `field` is all of them. */
    void (*solve)(const VolModes *modes, float *field, int row, int first, int count, float *work);
    /* The preview: voxels (., row, .) along axes 2 and 0; a slice along axis 1. */
    void (*preview_rows)(const int n[3], const VolPivots pivots[3], float *field, int row, float *work);
    void (*preview_slice)(const int n[3], const VolPivots *pivots, float *slice);
} VolDiffusionKernels;

extern const VolDiffusionKernels vol_diffusion_kernels, vol_diffusion_kernels_avx2, vol_diffusion_kernels_avx512;

#endif
