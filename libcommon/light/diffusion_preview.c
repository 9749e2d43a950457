/* Locally one-dimensional diffusion: (1 + s_1 K_1)^-1 (1 + s_0 K_0)^-1 (1 + s_2 K_2)^-1 L0, tridiagonal systems along lines,
 * by pivots that nothing is subtracted from (diffusion_tmpl.h).  On a box all lines of an axis have the same. */
#include <math.h>
#include <stdlib.h>

#include "base/mem.h"
#include "base/pool.h"
#include "light/diffusion_private.h"

/* ---- Boxes ---- */

static VolStatus pivots_new(int n, double s, VolPivots *out, VolError *err)
{
    *out = (VolPivots){.n = n, .share = vol_alloc((size_t)n, sizeof(float)), .over = vol_alloc((size_t)n, sizeof(float))};
    if (!out->share || !out->over)
        return vol_fail_memory(err, (size_t)n * sizeof(float));
    for (double excess = 1, share = 0, i = 0; (int)i < n; i++) {
        excess = 1 + share * excess;
        double coupling = (int)i < n - 1 ? s : 0, over = 1 / (excess + coupling);
        share = coupling * over;
        out->share[(int)i] = (float)share;
        out->over[(int)i] = (float)over;
    }
    return VOL_OK;
}

typedef struct Preview {
    const VolDiffusion *d;
    const VolDiffusionKernels *kernels;
    VolPivots pivots[VOL_DIFFUSION_CHANNELS][3];
    float *work;
    double *line; /* masked: two lines of numbers for every thread */
    size_t work_size;
    int axis; /* masked: that lines lie along */
} Preview;

static VolStatus preview_rows(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Preview *p = user;
    size_t rows = (size_t)p->d->n[1], c = index / rows;
    p->kernels->preview_rows(p->d->n, p->pivots[c], p->d->field[c], (int)(index % rows),
                             p->work + (size_t)thread * p->work_size);
    return VOL_OK;
}

static VolStatus preview_slice(void *user, size_t index, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const Preview *p = user;
    size_t slices = (size_t)p->d->n[0], c = index / slices, slice = index % slices;
    p->kernels->preview_slice(p->d->n, &p->pivots[c][1],
                              p->d->field[c] + slice * (size_t)p->d->n[1] * (size_t)p->d->n[2]);
    return VOL_OK;
}

static VolStatus preview_box(Preview *p, VolError *err)
{
    const VolDiffusion *d = p->d;
    size_t threads = d->threads < 1 ? 1 : (size_t)d->threads, length = (size_t)d->n[2];
    VolStatus status = VOL_OK;
    for (int c = 0; c < d->channels; c++)
        for (int a = 0; status == VOL_OK && a < 3; a++)
            status = pivots_new(d->n[a], fmin(d->s[c][a], VOL_DIFFUSION_FASTEST), &p->pivots[c][a], err);
    p->work_size = ((size_t)d->n[0] * length + VOL_MOST_LANES) / VOL_MOST_LANES * VOL_MOST_LANES + length * VOL_MOST_LANES;
    if (status == VOL_OK && !(p->work = vol_alloc_aligned(64, threads * p->work_size, sizeof *p->work)))
        status = vol_fail_memory(err, threads * p->work_size * sizeof *p->work);
    if (status == VOL_OK)
        status = vol_parallel(d->threads, (size_t)d->channels * (size_t)d->n[1], preview_rows, p, err);
    if (status == VOL_OK)
        status = vol_parallel(d->threads, (size_t)d->channels * (size_t)d->n[0], preview_slice, p, err);
    for (int c = 0; c < d->channels; c++)
        for (int a = 0; a < 3; a++) {
            free(p->pivots[c][a].share);
            free(p->pivots[c][a].over);
        }
    free(p->work);
    return status;
}

/* ---- Among blanks and occluders: each line has its own ---- */

static bool is_inside(const uint8_t *medium, size_t v) { return !medium || medium[v] == VOL_MEDIUM_INSIDE; }

/* In place; `share` and `part` have room for n numbers. */
static void solve_line(float *f, const uint8_t *medium, size_t step, int n, double s, double *share, double *part)
{
    double excess = 1, y = 0, passed = 0;
    for (int i = 0; i < n; i++) {
        size_t v = (size_t)i * step;
        double coupling = i < n - 1 && is_inside(medium, v) && is_inside(medium, v + step) ? s : 0;
        excess = 1 + passed * excess;
        y = (double)f[v] + passed * y;
        double over = 1 / (excess + coupling);
        share[i] = passed = coupling * over;
        part[i] = y * over;
    }
    double x = 0;
    for (int i = n - 1; i >= 0; i--) {
        x = part[i] + share[i] * x;
        if (is_inside(medium, (size_t)i * step))
            f[(size_t)i * step] = (float)x;
    }
}

/* Of lines along p->axis: `index` is a channel and a plane of them. */
static VolStatus preview_masked_plane(void *user, size_t index, int thread, VolError *err)
{
    (void)err;
    const Preview *p = user;
    const VolDiffusion *d = p->d;
    const size_t step[3] = {(size_t)d->n[1] * (size_t)d->n[2], (size_t)d->n[2], 1};
    const int axis = p->axis, across = axis == 0 ? 1 : 0, along = 3 - axis - across;
    size_t planes = (size_t)d->n[across], c = index / planes, first = index % planes * step[across];
    double *share = p->line + (size_t)thread * p->work_size, *part = share + d->n[axis];
    for (int i = 0; i < d->n[along]; i++) {
        size_t v = first + (size_t)i * step[along];
        solve_line(d->field[c] + v, d->medium ? d->medium + v : NULL, step[axis], d->n[axis],
                   fmin(d->s[c][axis], VOL_DIFFUSION_FASTEST), share, part);
    }
    return VOL_OK;
}

static VolStatus preview_masked(Preview *p, VolError *err)
{
    static const int order[3] = {2, 0, 1};
    const VolDiffusion *d = p->d;
    size_t threads = d->threads < 1 ? 1 : (size_t)d->threads, channels = (size_t)d->channels;
    for (int a = 0; a < 3; a++)
        p->work_size = 2 * (size_t)d->n[a] > p->work_size ? 2 * (size_t)d->n[a] : p->work_size;
    if (!(p->line = vol_alloc(threads * p->work_size, sizeof *p->line)))
        return vol_fail_memory(err, threads * p->work_size * sizeof *p->line);
    VolStatus status = VOL_OK;
    for (int i = 0; status == VOL_OK && i < 3; i++) {
        p->axis = order[i];
        status = vol_parallel(d->threads, channels * (size_t)d->n[p->axis == 0 ? 1 : 0], preview_masked_plane, p, err);
    }
    free(p->line);
    return status;
}

VolStatus vol_diffuse_preview(const VolDiffusion *diffusion, VolError *err)
{
    Preview p = {.d = diffusion, .kernels = vol_diffusion_kernels_for(diffusion->cpu)};
    /* Vectors reach over VOL_MOST_LANES slices by 32-bit offsets. */
    bool far = (int64_t)diffusion->n[1] * diffusion->n[2] > INT32_MAX / VOL_MOST_LANES;
    VolStatus status = vol_diffusion_check(diffusion, err);
    if (status != VOL_OK)
        return status;
    return diffusion->medium || far ? preview_masked(&p, err) : preview_box(&p, err);
}
