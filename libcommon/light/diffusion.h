/* One implicit step of diffusion on a box of voxels (S, with steady convection before it).
 *
 * (I + sum_a s_a K_a) L = L0, K_a the second difference along axis a with zero flux at the faces, s_a = D t / h_a^2: for
 * every cosine mode a factor 1 / (1 + 4 sum_a s_a sin^2(pi k_a / 2 n_a)).  Light is neither lost nor made: sums stay, and
 * no value leaves the range of L0, to within the errors below.
 *
 * Fields are floats, value (x, y, z) at (x n[1] + y) n[2] + z.  The same bits for any number of threads and at any cpu
 * level. */
#ifndef VOL_LIGHT_DIFFUSION_H
#define VOL_LIGHT_DIFFUSION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/cpu.h"
#include "base/status.h"

enum { VOL_DIFFUSION_CHANNELS = 3, VOL_DIFFUSION_LONGEST = 1 << 16 };

/* What a voxel is to diffusion: zero flux at the faces of any that is not VOL_MEDIUM_INSIDE, whose value stays. */
typedef enum VolMedium { VOL_MEDIUM_BLANK = 0, VOL_MEDIUM_INSIDE = 1, VOL_MEDIUM_OCCLUDER = 2 } VolMedium;

typedef struct VolDiffusion {
    int32_t n[3];                         /* 1..VOL_DIFFUSION_LONGEST each; else VOL_BAD_INPUT */
    int channels;                         /* 1..VOL_DIFFUSION_CHANNELS */
    float *field[VOL_DIFFUSION_CHANNELS]; /* L0, finite; then L */
    double s[VOL_DIFFUSION_CHANNELS][3];  /* of each channel, along each axis; >= 0 */
    const uint8_t *medium;                /* VolMedium of each voxel; NULL: all are inside */
    int threads;
    VolCpu cpu;
} VolDiffusion;

/* Exact: errors of at most 1e-5 of the largest |L0| for s up to 100, 1e-4 up to 1e6.  With a medium `residual`, unless
 * NULL, becomes a bound on the error in units of the largest |L0| before rounding to float: at most 2e-6 for s up to 100
 * and 2e-5 beyond, unless 4000 iterations were not enough. */
VolStatus vol_diffuse(const VolDiffusion *diffusion, double *residual, VolError *err);

/* One axis after the other: another operator, several times quicker, that comes near where s is small. */
VolStatus vol_diffuse_preview(const VolDiffusion *diffusion, VolError *err);

#endif
