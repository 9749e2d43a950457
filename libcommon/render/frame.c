#include "render/frame.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/pool.h"

enum { TILE = 32 };
#define FAR_AWAY 1e10

static void backdrop_at(const VolFrame *frame, int64_t x, int64_t y, double out[3])
{
    const float *picture = frame->backdrop.picture;
    for (int c = 0; c < 3; c++)
        out[c] = picture ? (double)picture[(y * frame->camera->width + x) * 3 + c] : frame->backdrop.color[c];
}

/* One ray added to the pixel's sums. */
static void add_ray(const VolFrame *frame, VolTraceRay *kernel, double x, double y, const double behind[3],
                    VolPixelValue *sum, double *depths, int *deep, VolFrameCounts *counts)
{
    const VolScene *scene = frame->scene;
    VolRay ray;
    VolRadiance got = {.depth = INFINITY};
    vol_camera_ray(frame->camera, x, y, &ray);
    counts->rays++;
    if (vol_ray_clip(scene, &ray))
        kernel(scene, &ray, &got);
    else
        counts->rays_missed++;
    counts->cells += (uint64_t)got.cells;
    for (int c = 0; c < 3; c++) {
        double tau = got.tau[scene->tf->coloured ? c : 0];
        sum->color[c] += got.color[c] + vol_exp(-tau) * behind[c];
        sum->alpha[c] += -vol_expm1(-tau);
        sum->normal[c] += got.normal[c];
        sum->surface[c] += got.surface[c];
        sum->scatter[c] += got.scatter[c];
        sum->emit[c] += got.emit[c];
    }
    sum->cells += got.cells;
    if (isfinite(got.depth)) {
        *depths += got.depth * vol_dot(ray.direction, frame->camera->forward);
        ++*deep;
    }
}

void vol_frame_pixel(const VolFrame *frame, int64_t x, int64_t y, VolPixelValue *out, VolFrameCounts *counts)
{
    VolTraceRay *kernel = vol_kernel(frame->scene);
    int n = frame->samples, deep = 0;
    double behind[3], depths = 0, weight = 1.0 / ((double)n * n);
    backdrop_at(frame, x, y, behind);
    *out = (VolPixelValue){0};
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            add_ray(frame, kernel, (double)x + (i + 0.5) / n, (double)y + (j + 0.5) / n, behind, out, &depths, &deep,
                    counts);
    for (int c = 0; c < 3; c++) {
        out->color[c] *= weight;
        out->alpha[c] *= weight;
        out->normal[c] *= weight;
        out->surface[c] *= weight;
        out->scatter[c] *= weight;
        out->emit[c] *= weight;
    }
    out->mean_alpha = frame->scene->tf->coloured ? (out->alpha[0] + out->alpha[1] + out->alpha[2]) / 3 : out->alpha[0];
    out->depth = 2 * deep >= n * n ? depths / deep : FAR_AWAY; /* of the samples that are opaque enough, if most are */
}

typedef struct Job {
    const VolFrame *frame;
    int64_t x0, y0, width, height, tiles_across;
    VolPixelValue *out;
    VolFrameCounts *counts;
    void (*progress)(void *, double);
    void *user;
    pthread_mutex_t lock;
    size_t tiles, tiles_done;
} Job;

static VolStatus render_tile(void *user, size_t index, int thread, VolError *err)
{
    Job *job = user;
    VolFrameCounts counts = {0};
    int64_t tx = (int64_t)index % job->tiles_across * TILE, ty = (int64_t)index / job->tiles_across * TILE;
    int64_t x1 = tx + TILE < job->width ? tx + TILE : job->width, y1 = ty + TILE < job->height ? ty + TILE : job->height;
    (void)thread;
    (void)err;
    for (int64_t y = ty; y < y1; y++)
        for (int64_t x = tx; x < x1; x++)
            vol_frame_pixel(job->frame, job->x0 + x, job->y0 + y, &job->out[y * job->width + x], &counts);
    pthread_mutex_lock(&job->lock);
    job->counts->rays += counts.rays;
    job->counts->rays_missed += counts.rays_missed;
    job->counts->cells += counts.cells;
    job->tiles_done++;
    if (job->progress)
        job->progress(job->user, (double)job->tiles_done / (double)job->tiles);
    pthread_mutex_unlock(&job->lock);
    return VOL_OK;
}

VolStatus vol_frame_render(const VolFrame *frame, int64_t x0, int64_t y0, int64_t width, int64_t height, int threads,
                           void (*progress)(void *user, double fraction), void *user, VolPixelValue *out,
                           VolFrameCounts *counts, VolError *err)
{
    Job job = {.frame = frame, .x0 = x0, .y0 = y0, .width = width, .height = height, .out = out, .counts = counts,
               .tiles_across = (width + TILE - 1) / TILE, .progress = progress, .user = user};
    job.tiles = (size_t)(job.tiles_across * ((height + TILE - 1) / TILE));
    *counts = (VolFrameCounts){0};
    pthread_mutex_init(&job.lock, NULL);
    VolStatus status = vol_parallel(threads, job.tiles, render_tile, &job, err);
    pthread_mutex_destroy(&job.lock);
    return status;
}
