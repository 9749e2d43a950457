/* Diffusion on a whole box: what channels share, and the loops over threads. */
#include "light/diffusion_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/pool.h"

static const double pi = 3.14159265358979323846;

const VolDiffusionKernels *vol_diffusion_kernels_for(VolCpu cpu)
{
#if defined(__x86_64__)
    if (cpu == VOL_CPU_AVX512)
        return &vol_diffusion_kernels_avx512;
    if (vol_cpu_runs_avx2(cpu))
        return &vol_diffusion_kernels_avx2;
#endif
    (void)cpu;
    return &vol_diffusion_kernels;
}

static size_t most(size_t a, size_t b) { return a > b ? a : b; }

VolStatus vol_box_solver_new(const int32_t n[3], int threads, VolCpu cpu, VolBoxSolver *out, VolError *err)
{
    *out = (VolBoxSolver){.kernels = vol_diffusion_kernels_for(cpu), .threads = threads < 1 ? 1 : threads};
    size_t work = (size_t)n[0] * 2 * VOL_MODES;
    for (int a = 0; a < 3; a++)
        out->n[a] = n[a];
    for (int a = 1; a < 3; a++) {
        VolStatus status = vol_cosine_new(n[a], &out->cosine[a], err);
        if (status != VOL_OK)
            return status;
        size_t lines = 2 * (size_t)(n[1] > n[2] ? n[1] : n[2]);
        work = most(work, (lines + vol_cosine_work(&out->cosine[a])) * VOL_MOST_LANES);
    }
    out->work_size = work;
    out->work = vol_alloc_aligned(64, work * (size_t)out->threads, sizeof *out->work);
    return out->work ? VOL_OK : vol_fail_memory(err, work * (size_t)out->threads * sizeof *out->work);
}

void vol_box_solver_free(VolBoxSolver *solver)
{
    for (int a = 1; a < 3; a++)
        vol_cosine_free(&solver->cosine[a]);
    free(solver->work);
    *solver = (VolBoxSolver){0};
}

VolStatus vol_box_eigen_new(const VolBoxSolver *solver, const double s[3], VolBoxEigen *out, VolError *err)
{
    *out = (VolBoxEigen){.s = (float)fmin(s[0], VOL_DIFFUSION_FASTEST)};
    for (int a = 1; a < 3; a++) {
        size_t n = (size_t)solver->n[a];
        if (!(out->eigen[a] = vol_alloc(n, sizeof(float))))
            return vol_fail_memory(err, n * sizeof(float));
        for (size_t k = 0; k < n; k++) {
            double sine = vol_sin(pi * (double)k / (2.0 * (double)n));
            out->eigen[a][k] = (float)(4 * fmin(s[a], VOL_DIFFUSION_FASTEST) * sine * sine);
        }
    }
    return VOL_OK;
}

void vol_box_eigen_free(VolBoxEigen *eigen)
{
    for (int a = 1; a < 3; a++)
        free(eigen->eigen[a]);
    *eigen = (VolBoxEigen){0};
}

/* ---- The three stages ---- */

typedef struct Job {
    const VolBoxSolver *solver;
    VolModes modes[VOL_DIFFUSION_CHANNELS];
    float *const *field;
    bool inverse;
} Job;

static VolStatus transform_slice(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Job *job = user;
    const VolBoxSolver *s = job->solver;
    size_t slices = (size_t)s->n[0], channel = index / slices, slice = index % slices;
    s->kernels->transform(&job->modes[channel], job->field[channel] + slice * (size_t)s->n[1] * (size_t)s->n[2],
                          job->inverse, s->work + (size_t)thread * s->work_size);
    return VOL_OK;
}

static VolStatus solve_row(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Job *job = user;
    const VolBoxSolver *s = job->solver;
    size_t rows = (size_t)s->n[1], channel = index / rows;
    for (int first = 0; first < s->n[2]; first += VOL_MODES) {
        int left = s->n[2] - first;
        s->kernels->solve(&job->modes[channel], job->field[channel], (int)(index % rows), first,
                          left < VOL_MODES ? left : VOL_MODES, s->work + (size_t)thread * s->work_size);
    }
    return VOL_OK;
}

VolStatus vol_box_solve(const VolBoxSolver *solver, const VolBoxEigen *eigen, float *const *field, int channels,
                        VolError *err)
{
    Job job = {.solver = solver, .field = field};
    for (int c = 0; c < channels; c++) {
        VolModes *m = &job.modes[c];
        *m = (VolModes){.s = eigen[c].s};
        for (int a = 0; a < 3; a++) {
            m->n[a] = solver->n[a];
            m->cosine[a] = &solver->cosine[a];
            m->eigen[a] = eigen[c].eigen[a];
        }
    }
    size_t slices = (size_t)channels * (size_t)solver->n[0], rows = (size_t)channels * (size_t)solver->n[1];
    VolStatus status = vol_parallel(solver->threads, slices, transform_slice, &job, err);
    if (status == VOL_OK)
        status = vol_parallel(solver->threads, rows, solve_row, &job, err);
    job.inverse = true;
    return status == VOL_OK ? vol_parallel(solver->threads, slices, transform_slice, &job, err) : status;
}

static VolStatus diffuse_box(const VolDiffusion *d, VolError *err)
{
    VolBoxSolver solver;
    VolBoxEigen eigen[VOL_DIFFUSION_CHANNELS] = {0};
    VolStatus status = vol_box_solver_new(d->n, d->threads, d->cpu, &solver, err);
    for (int c = 0; status == VOL_OK && c < d->channels; c++)
        status = vol_box_eigen_new(&solver, d->s[c], &eigen[c], err);
    if (status == VOL_OK)
        status = vol_box_solve(&solver, eigen, d->field, d->channels, err);
    for (int c = 0; c < d->channels; c++)
        vol_box_eigen_free(&eigen[c]);
    vol_box_solver_free(&solver);
    return status;
}

VolStatus vol_diffusion_check(const VolDiffusion *diffusion, VolError *err)
{
    for (int a = 0; a < 3; a++)
        if (diffusion->n[a] < 1 || diffusion->n[a] > VOL_DIFFUSION_LONGEST)
            return vol_fail(err, VOL_BAD_INPUT, "diffusion on a box of %d x %d x %d voxels: at most %d along an axis",
                            (int)diffusion->n[0], (int)diffusion->n[1], (int)diffusion->n[2], VOL_DIFFUSION_LONGEST);
    return VOL_OK;
}

static bool is_moved(const VolDiffusion *d, int c)
{
    bool moved = false;
    for (int a = 0; a < 3; a++)
        moved = moved || (d->s[c][a] > 0 && d->n[a] > 1);
    return moved;
}

VolStatus vol_diffuse(const VolDiffusion *diffusion, double *residual, VolError *err)
{
    VolStatus status = vol_diffusion_check(diffusion, err);
    if (status != VOL_OK)
        return status;
    if (residual)
        *residual = 0;
    VolDiffusion some = *diffusion; /* channels that change */
    some.channels = 0;
    for (int c = 0; c < diffusion->channels; c++) {
        if (!is_moved(diffusion, c))
            continue;
        some.field[some.channels] = diffusion->field[c];
        memcpy(some.s[some.channels++], diffusion->s[c], sizeof some.s[0]);
    }
    if (!some.channels)
        return VOL_OK;
    return some.medium ? vol_diffuse_masked(&some, residual, err) : diffuse_box(&some, err);
}
