/* Diffusion among blanks and occluders: conjugate gradients, preconditioned by the exact step on the whole box.
 *
 * A = I + sum_a s_a K_a over the voxels inside, faces to others left out.  The preconditioner B^-1 puts a residual into the
 * box, 0 elsewhere, solves there, and takes the voxels inside: symmetric and positive; B is A plus what the light would
 * exchange with the voxels left out, so that only modes that see the boundaries are left to iterate for.
 *
 * Rows of A sum to 1 and only its diagonal is positive, so that no entry of A^-1 is negative and its rows sum to 1, too:
 * the largest |residual| bounds the error of every voxel.  In float it could not fall below 12 s 2^-24, hence doubles; the
 * preconditioner is in float, and not quite the same linear map every time: directions are made conjugate to the last one
 * explicitly (beta = -(z, A p) / (p, A p)).
 *
 * Sums are those of slices, in order, each of four interleaved ones: the same bits for any number of threads. */
#include <math.h>
#include <stdlib.h>

#include "base/mem.h"
#include "base/pool.h"
#include "light/diffusion_private.h"

enum { MOST_ITERATIONS = 4000 };

/* Bits of a voxel: it is inside; so is its neighbour below, above it along each axis, and inside the box. */
enum { INSIDE = 1, BELOW = 2, ABOVE = 4, ALL_INSIDE = 127 }; /* along axis a BELOW << 2 a, ABOVE << 2 a */

typedef struct Solver {
    int32_t n[3];
    size_t step[3], slice; /* from a voxel to the next along each axis; voxels of a slice */
    uint8_t *bits;
    double s[3];
    double *x, *r, *p, *ap; /* solution, residual, direction, A p */
    float *z;               /* B^-1 r */
    double *sum[2], *largest; /* of slices */
    double alpha, beta;
    int threads;
} Solver;

static VolStatus find_faces(void *user, size_t i, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const VolDiffusion *d = ((void **)user)[0];
    Solver *solver = ((void **)user)[1];
    int32_t at[3] = {(int32_t)i, 0, 0};
    size_t v = i * solver->slice;
    for (at[1] = 0; at[1] < d->n[1]; at[1]++)
        for (at[2] = 0; at[2] < d->n[2]; at[2]++, v++) {
            unsigned bits = d->medium[v] == VOL_MEDIUM_INSIDE;
            for (int a = 0; bits && a < 3; a++) {
                if (at[a] > 0 && d->medium[v - solver->step[a]] == VOL_MEDIUM_INSIDE)
                    bits |= (unsigned)BELOW << 2 * a;
                if (at[a] < d->n[a] - 1 && d->medium[v + solver->step[a]] == VOL_MEDIUM_INSIDE)
                    bits |= (unsigned)ABOVE << 2 * a;
            }
            solver->bits[v] = (uint8_t)bits;
        }
    return VOL_OK;
}

/* (A p) at voxel v */
static double applied(const Solver *s, const double *p, size_t v)
{
    const unsigned bits = s->bits[v];
    double here = p[v], sum = here;
    if (bits == ALL_INSIDE) {
        for (int a = 0; a < 3; a++)
            sum += s->s[a] * ((here - p[v - s->step[a]]) + (here - p[v + s->step[a]]));
        return sum;
    }
    for (int a = 0; a < 3; a++) {
        double out = 0;
        if (bits & (unsigned)BELOW << 2 * a)
            out += here - p[v - s->step[a]];
        if (bits & (unsigned)ABOVE << 2 * a)
            out += here - p[v + s->step[a]];
        sum += s->s[a] * out;
    }
    return sum;
}

static double total(const double *sums, int32_t count)
{
    double sum = 0;
    for (int32_t i = 0; i < count; i++)
        sum += sums[i];
    return sum;
}

/* ---- Steps of an iteration, slice by slice ---- */

/* p = z + beta p */
static VolStatus turn(void *user, size_t i, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    Solver *s = user;
    for (size_t v = i * s->slice; v < (i + 1) * s->slice; v++)
        s->p[v] = s->bits[v] ? (double)s->z[v] + s->beta * s->p[v] : 0;
    return VOL_OK;
}

/* A p, (p, A p) and (r, p) */
static VolStatus apply(void *user, size_t i, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    Solver *s = user;
    double energy[4] = {0}, along[4] = {0};
    for (size_t v = i * s->slice; v < (i + 1) * s->slice; v++) {
        if (!s->bits[v])
            continue;
        double p = s->p[v], ap = applied(s, s->p, v);
        s->ap[v] = ap;
        energy[v & 3] += p * ap;
        along[v & 3] += s->r[v] * p;
    }
    s->sum[0][i] = total(energy, 4);
    s->sum[1][i] = total(along, 4);
    return VOL_OK;
}

/* x += alpha p, r -= alpha A p */
static VolStatus advance(void *user, size_t i, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    Solver *s = user;
    double largest = 0;
    for (size_t v = i * s->slice; v < (i + 1) * s->slice; v++) {
        s->x[v] += s->alpha * s->p[v];
        s->r[v] -= s->alpha * s->ap[v];
        s->z[v] = (float)s->r[v];
        largest = fmax(largest, fabs(s->r[v]));
    }
    s->largest[i] = largest;
    return VOL_OK;
}

/* (z, A p) */
static VolStatus project(void *user, size_t i, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    Solver *s = user;
    double sum[4] = {0};
    for (size_t v = i * s->slice; v < (i + 1) * s->slice; v++)
        sum[v & 3] += (double)s->z[v] * s->ap[v];
    s->sum[0][i] = total(sum, 4);
    return VOL_OK;
}

/* ---- The iteration ---- */

static double largest_of(const Solver *s)
{
    double largest = 0;
    for (int32_t i = 0; i < s->n[0]; i++)
        largest = fmax(largest, s->largest[i]);
    return largest;
}

/* From r = L0, x = 0, in units of the largest |L0|. */
static VolStatus iterate(Solver *s, const VolBoxSolver *box, const VolBoxEigen *eigen, double bound, double *residual,
                         VolError *err)
{
    const size_t slices = (size_t)s->n[0];
    s->beta = 0;
    *residual = 1;
    for (int i = 0; i < MOST_ITERATIONS && *residual > bound; i++) {
        VolStatus status = vol_box_solve(box, eigen, &s->z, 1, err);
        if (status == VOL_OK && i > 0) {
            double energy = total(s->sum[0], s->n[0]);
            status = vol_parallel(s->threads, slices, project, s, err);
            s->beta = -total(s->sum[0], s->n[0]) / energy;
        }
        if (status == VOL_OK)
            status = vol_parallel(s->threads, slices, turn, s, err);
        if (status == VOL_OK)
            status = vol_parallel(s->threads, slices, apply, s, err);
        if (status != VOL_OK)
            return status;
        s->alpha = total(s->sum[1], s->n[0]) / total(s->sum[0], s->n[0]);
        if ((status = vol_parallel(s->threads, slices, advance, s, err)) != VOL_OK)
            return status;
        *residual = largest_of(s);
    }
    return VOL_OK;
}

static void solver_free(Solver *s)
{
    double *const numbers[] = {s->x, s->r, s->p, s->ap, s->sum[0], s->sum[1], s->largest};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        free(numbers[i]);
    free(s->bits);
    free(s->z);
}

static VolStatus solver_new(const VolDiffusion *d, Solver *s, VolError *err)
{
    const size_t slice = (size_t)d->n[1] * (size_t)d->n[2], slices = (size_t)d->n[0];
    *s = (Solver){.n = {d->n[0], d->n[1], d->n[2]}, .step = {slice, (size_t)d->n[2], 1}, .slice = slice,
                  .threads = d->threads};
    double **const numbers[] = {&s->x, &s->r, &s->p, &s->ap};
    double **const sums[] = {&s->sum[0], &s->sum[1], &s->largest};
    bool enough = (s->bits = vol_alloc(slices, slice)) && (s->z = vol_alloc(slices, slice * sizeof *s->z));
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        enough = enough && (*numbers[i] = vol_alloc_zero(slices, slice * sizeof(double)));
    for (size_t i = 0; i < sizeof sums / sizeof *sums; i++)
        enough = enough && (*sums[i] = vol_alloc_zero(slices, sizeof(double)));
    if (!enough)
        return vol_fail_memory(err, slices * slice * (4 * sizeof(double) + sizeof(float) + 1));
    void *both[2] = {(void *)d, s};
    return vol_parallel(d->threads, slices, find_faces, both, err);
}

static VolStatus diffuse_channel(const VolDiffusion *d, int channel, const VolBoxSolver *box, Solver *s, double *residual,
                                 VolError *err)
{
    const size_t count = (size_t)d->n[0] * s->slice;
    const double *rate = d->s[channel];
    float *field = d->field[channel];
    double largest = 0;
    for (size_t v = 0; v < count; v++)
        largest = s->bits[v] ? fmax(largest, fabs((double)field[v])) : largest;
    if (largest == 0) /* nothing to spread */
        return VOL_OK;
    for (size_t v = 0; v < count; v++) {
        s->x[v] = s->p[v] = s->ap[v] = 0;
        s->r[v] = s->bits[v] ? (double)field[v] / largest : 0;
        s->z[v] = (float)s->r[v];
    }
    for (int a = 0; a < 3; a++)
        s->s[a] = fmin(rate[a], VOL_DIFFUSION_FASTEST);
    bool stiff = fmax(rate[0], fmax(rate[1], rate[2])) > 100;
    VolBoxEigen eigen;
    VolStatus status = vol_box_eigen_new(box, rate, &eigen, err);
    if (status == VOL_OK)
        status = iterate(s, box, &eigen, stiff ? 2e-5 : 2e-6, residual, err);
    vol_box_eigen_free(&eigen);
    for (size_t v = 0; status == VOL_OK && v < count; v++)
        if (s->bits[v])
            field[v] = (float)(s->x[v] * largest);
    return status;
}

VolStatus vol_diffuse_masked(const VolDiffusion *diffusion, double *residual, VolError *err)
{
    Solver solver;
    VolBoxSolver box = {0};
    VolStatus status = solver_new(diffusion, &solver, err);
    if (status == VOL_OK)
        status = vol_box_solver_new(diffusion->n, diffusion->threads, diffusion->cpu, &box, err);
    for (int c = 0; status == VOL_OK && c < diffusion->channels; c++) {
        double bound = 0;
        status = diffuse_channel(diffusion, c, &box, &solver, &bound, err);
        if (residual)
            *residual = fmax(*residual, bound);
    }
    vol_box_solver_free(&box);
    solver_free(&solver);
    return status;
}
