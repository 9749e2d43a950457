/* Between the files that make up diffusion. */
#ifndef VOL_LIGHT_DIFFUSION_PRIVATE_H
#define VOL_LIGHT_DIFFUSION_PRIVATE_H

#include "light/diffusion.h"
#include "light/diffusion_kernels.h"

/* Larger s are taken as this: products of it with any length are floats still. */
#define VOL_DIFFUSION_FASTEST 1e30

VolStatus vol_diffusion_check(const VolDiffusion *diffusion, VolError *err);

const VolDiffusionKernels *vol_diffusion_kernels_for(VolCpu cpu);

/* The exact step on the whole box, whatever s. */
typedef struct VolBoxSolver {
    const VolDiffusionKernels *kernels;
    int n[3], threads;
    VolCosine cosine[3]; /* of axes 1 and 2 */
    float *work;         /* work_size numbers for every thread */
    size_t work_size;
} VolBoxSolver;

/* What depends on s. */
typedef struct VolBoxEigen {
    float s, *eigen[3];
} VolBoxEigen;

/* Each _free() is to follow whatever comes of _new(). */
VolStatus vol_box_solver_new(const int32_t n[3], int threads, VolCpu cpu, VolBoxSolver *out, VolError *err);
void vol_box_solver_free(VolBoxSolver *solver);
VolStatus vol_box_eigen_new(const VolBoxSolver *solver, const double s[3], VolBoxEigen *out, VolError *err);
void vol_box_eigen_free(VolBoxEigen *eigen);

/* Channel c of `field` in place, by eigen[c]. */
VolStatus vol_box_solve(const VolBoxSolver *solver, const VolBoxEigen *eigen, float *const *field, int channels,
                        VolError *err);

VolStatus vol_diffuse_masked(const VolDiffusion *diffusion, double *residual, VolError *err);

#endif
