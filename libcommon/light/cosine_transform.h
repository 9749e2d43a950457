/* Cosine transforms of lines of any length, in float.
 *
 *     forward   X_k = 1/n sum_j x_j cos(pi k (2j + 1) / 2n)
 *     inverse   x_j = X_0 + 2 sum_{k > 0} X_k cos(pi k (2j + 1) / 2n)
 *
 * A plan holds what lines of one length share; the transforms themselves, many lines side by side, are compiled per cpu
 * level (cosine_transform_tmpl.h). */
#ifndef VOL_LIGHT_COSINE_TRANSFORM_H
#define VOL_LIGHT_COSINE_TRANSFORM_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

/* Of prime factors up to this a Fourier transform is made as it is; those of lengths with larger ones by convolution. */
enum { VOL_FOURIER_RADIX = 31 };

/* A complex Fourier transform of any length whose prime factors are at most VOL_FOURIER_RADIX. */
typedef struct VolFourier {
    int n, passes;
    int radix[32];   /* of each pass; their product is n */
    float *twiddles; /* pass after pass: exp(-2 pi i p k / (radix m)), p = 0..m-1, k = 1..radix-1: re, im */
    float *roots[VOL_FOURIER_RADIX + 1]; /* of odd radices r: cos, sin of 2 pi j / r, j = 0..r-1 */
} VolFourier;

typedef struct VolCosine {
    int n;
    VolFourier fourier;     /* of length n, or of the convolution */
    float *chirp;           /* exp(-pi i j^2 / n), j = 0..n-1: re, im; NULL: no convolution */
    float *chirp_transform; /* of the convolution's other factor, divided by its length */
    float *rotation;        /* cos, sin of pi k / 2n, k = 0..n-1 */
} VolCosine;

/* n >= 1.  vol_cosine_free() is to follow whatever comes of it. */
VolStatus vol_cosine_new(int n, VolCosine *out, VolError *err);
void vol_cosine_free(VolCosine *plan);

/* Vectors of `lanes` numbers that a transform needs as working memory. */
static inline size_t vol_cosine_work(const VolCosine *plan) { return 4 * (size_t)plan->fourier.n; }

#endif
