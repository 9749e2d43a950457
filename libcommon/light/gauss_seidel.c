#include "light/gauss_seidel.h"

#include <math.h>

#include "base/pool.h"
#include "light/diffusion_private.h"

typedef struct Relaxation {
    const VolDiffusion *of;
    int sweeps;
} Relaxation;

static bool is_inside(const VolDiffusion *d, size_t v) { return !d->medium || d->medium[v] == VOL_MEDIUM_INSIDE; }

static void relax_voxel(const VolDiffusion *d, float *field, const double s[3], const int32_t at[3], size_t v)
{
    const size_t step[3] = {(size_t)d->n[1] * (size_t)d->n[2], (size_t)d->n[2], 1};
    double sum = (double)field[v], weight = 1;
    if (!is_inside(d, v))
        return;
    for (int a = 0; a < 3; a++) {
        if (at[a] > 0 && is_inside(d, v - step[a])) {
            sum += s[a] * (double)field[v - step[a]];
            weight += s[a];
        }
        if (at[a] < d->n[a] - 1 && is_inside(d, v + step[a])) {
            sum += s[a] * (double)field[v + step[a]];
            weight += s[a];
        }
    }
    field[v] = (float)(sum / weight);
}

static VolStatus relax_channel(void *user, size_t channel, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const Relaxation *r = user;
    const VolDiffusion *d = r->of;
    double s[3];
    for (int a = 0; a < 3; a++)
        s[a] = fmin(d->s[channel][a], VOL_DIFFUSION_FASTEST);
    for (int sweep = 0; sweep < r->sweeps; sweep++) {
        int32_t at[3];
        size_t v = 0;
        for (at[0] = 0; at[0] < d->n[0]; at[0]++)
            for (at[1] = 0; at[1] < d->n[1]; at[1]++)
                for (at[2] = 0; at[2] < d->n[2]; at[2]++)
                    relax_voxel(d, d->field[channel], s, at, v++);
    }
    return VOL_OK;
}

VolStatus vol_relax_as_printed(const VolDiffusion *diffusion, int sweeps, VolError *err)
{
    Relaxation r = {diffusion, sweeps};
    return vol_parallel(diffusion->threads, (size_t)diffusion->channels, relax_channel, &r, err);
}
