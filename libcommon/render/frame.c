#include "render/frame.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"
#include "base/pool.h"

enum { TILE = 16 };
#define FAR_AWAY 1e10

static void backdrop_at(const VolFrame *frame, int64_t x, int64_t y, double out[3])
{
    const float *picture = frame->backdrop.picture;
    for (int c = 0; c < 3; c++)
        out[c] = picture ? (double)picture[(y * frame->camera->width + x) * 3 + c] : frame->backdrop.color[c];
}

static double larger(double a, double b) { return a > b ? a : b; }

/* The largest colour and optical depth of rays. */
typedef struct Strongest {
    double light, optical_depth;
} Strongest;

static void add_strength(Strongest *most, const VolRadiance *got)
{
    for (int c = 0; c < 3; c++) {
        most->light = larger(got->color[c], most->light);
        most->optical_depth = larger(got->optical_depth[c], most->optical_depth);
    }
}

static double strength(const Strongest *most) { return larger(most->light, -vol_expm1(-most->optical_depth)); }

/* What a ray brought, added to its pixel's sums. */
static void add_ray(const VolFrame *frame, const VolRay *ray, const VolRadiance *got, const double behind[3],
                    VolPixelValue *sum, double *depths, int *deep)
{
    double transmittance = 1, alpha = 0;
    for (int c = 0; c < 3; c++) {
        if (frame->prepared->scene->tf->coloured || c == 0) {
            transmittance = got->optical_depth[c] > 0 ? vol_exp(-got->optical_depth[c]) : 1;
            alpha = got->optical_depth[c] > 0 ? -vol_expm1(-got->optical_depth[c]) : 0;
        }
        sum->color[c] += got->color[c] + transmittance * behind[c];
        sum->alpha[c] += alpha;
        for (int n = 0; n < VOL_SUMS; n++)
            sum->sum[n][c] += got->sum[n][c];
    }
    sum->cells += got->cells;
    if (isfinite(got->depth)) {
        *depths += got->depth * vol_dot(ray->direction, frame->camera->forward);
        ++*deep;
    }
}

/* Rays on their way through a kernel together, VOL_PACKET at most. */
typedef struct RayBatch {
    const VolFrame *frame;
    VolScratch *scratch;
    VolFrameCounts *counts;
    VolRay rays[VOL_PACKET];
    VolRadiance *results[VOL_PACKET];
    size_t count;
} RayBatch;

static void batch_flush(RayBatch *p)
{
    VolRadiance got[VOL_PACKET];
    VolTraceCall call = {.prepared = p->frame->prepared, .scratch = p->scratch, .listener = p->frame->listener,
                         .rays = p->rays, .count = p->count, .out = got};
    if (p->count)
        vol_trace_rays(&call);
    for (size_t i = 0; i < p->count; i++) {
        *p->results[i] = got[i];
        p->counts->cells += (uint64_t)got[i].cells;
    }
    p->count = 0;
}

static void batch_add(RayBatch *p, const VolRay *ray, VolRadiance *result)
{
    const VolPrepared *prepared = p->frame->prepared;
    const VolScene *scene = prepared->scene;
    VolRay clipped = *ray;
    p->counts->rays++;
    *result = (VolRadiance){.depth = INFINITY};
    if (!vol_ray_clip(scene, &clipped)) {
        p->counts->rays_missed++;
        return;
    }
    bool sees = vol_ray_meets_visible(prepared, &clipped);
    if (scene->estimator != VOL_ESTIMATE_EXACT)
        p->counts->steps += (uint64_t)ceil((clipped.t1 - clipped.t0) / scene->step);
    if (!sees) {
        p->counts->rays_missed++;
        return;
    }
    p->rays[p->count] = clipped;
    p->results[p->count++] = result;
    if (p->count == VOL_PACKET)
        batch_flush(p);
}

/* Neighbouring pixels, whose rays travel together. */
enum { BLOCK_WIDTH = 4, BLOCK_HEIGHT = 4, BLOCK_PIXELS = BLOCK_WIDTH * BLOCK_HEIGHT };

typedef struct Block {
    int64_t x[BLOCK_PIXELS], y[BLOCK_PIXELS]; /* of the picture */
    size_t index[BLOCK_PIXELS];
    VolPixelValue values[BLOCK_PIXELS];
    int count;
} Block;

static void ray_of(const VolFrame *frame, const Block *block, int pixel, int sample, VolRay *ray)
{
    int n = frame->samples;
    vol_camera_ray(frame->camera, (double)block->x[pixel] + (sample % n + 0.5) / n,
                   (double)block->y[pixel] + (sample / n + 0.5) / n, ray);
}

/* The same rays through another scene; `scratch` is for that. */
static void add_pass(const VolFrame *frame, size_t pass, VolScratch *scratch, const VolRay *rays, Block *block)
{
    VolFrame other = *frame;
    VolFrameCounts counts = {0};
    VolRadiance results[BLOCK_PIXELS];
    other.prepared = frame->passes[pass].prepared;
    other.listener = NULL;
    RayBatch batch = {.frame = &other, .scratch = scratch, .counts = &counts};
    for (int p = 0; p < block->count; p++)
        batch_add(&batch, &rays[p], &results[p]);
    batch_flush(&batch);
    for (int p = 0; p < block->count; p++)
        for (int c = 0; c < 3; c++)
            block->values[p].pass[pass][c] += results[p].sum[VOL_SUM_SCATTER][c];
}

static void finish_pixel(const VolFrame *frame, VolPixelValue *out, double depths, int deep)
{
    int n = frame->samples;
    double weight = 1.0 / ((double)n * n);
    for (int c = 0; c < 3; c++) {
        out->color[c] *= weight;
        out->alpha[c] *= weight;
        for (int s = 0; s < VOL_SUMS; s++)
            out->sum[s][c] *= weight;
        for (size_t pass = 0; pass < frame->pass_count; pass++)
            out->pass[pass][c] *= weight;
    }
    bool coloured = frame->prepared->scene->tf->coloured;
    out->mean_alpha = coloured ? (out->alpha[0] + out->alpha[1] + out->alpha[2]) / 3 : out->alpha[0];
    out->depth = 2 * deep >= n * n ? depths / deep : FAR_AWAY; /* of the samples that are opaque enough, if most are */
}

/* The first sample of every pixel, then the second of every pixel, and so on.  `scratch`: the scene's, then each pass's. */
static void render_block(const VolFrame *frame, VolScratch *scratch, Block *block, VolFrameCounts *counts)
{
    RayBatch batch = {.frame = frame, .scratch = scratch, .counts = counts};
    double behind[BLOCK_PIXELS][3], depths[BLOCK_PIXELS] = {0};
    int deep[BLOCK_PIXELS] = {0};
    Strongest strongest = {0};
    for (int p = 0; p < block->count; p++) {
        backdrop_at(frame, block->x[p], block->y[p], behind[p]);
        block->values[p] = (VolPixelValue){0};
    }
    for (int sample = 0; sample < frame->samples * frame->samples; sample++) {
        VolRadiance results[BLOCK_PIXELS];
        VolRay rays[BLOCK_PIXELS];
        for (int p = 0; p < block->count; p++) {
            ray_of(frame, block, p, sample, &rays[p]);
            batch_add(&batch, &rays[p], &results[p]);
        }
        batch_flush(&batch);
        for (int p = 0; p < block->count; p++) {
            add_ray(frame, &rays[p], &results[p], behind[p], &block->values[p], &depths[p], &deep[p]);
            add_strength(&strongest, &results[p]);
        }
        for (size_t pass = 0; pass < frame->pass_count; pass++)
            add_pass(frame, pass, &scratch[1 + pass], rays, block);
    }
    counts->strongest = larger(strength(&strongest), counts->strongest);
    for (int p = 0; p < block->count; p++)
        finish_pixel(frame, &block->values[p], depths[p], deep[p]);
}

static void add_skipped(VolSkipped *sum, const VolSkipped *some)
{
    sum->bricks_entered += some->bricks_entered;
    sum->blocks += some->blocks;
    sum->cells_met += some->cells_met;
    sum->rays_ended += some->rays_ended;
    sum->rays_in_double += some->rays_in_double;
}

/* A thread's: of the scene, then of each pass. */
static VolStatus new_scratches(const VolFrame *frame, VolScratch *out, VolError *err)
{
    VolStatus status = vol_scratch_new(frame->prepared, &out[0], err);
    for (size_t pass = 0; pass < frame->pass_count && !status; pass++)
        status = vol_scratch_new(frame->passes[pass].prepared, &out[1 + pass], err);
    return status;
}

static void free_scratches(const VolFrame *frame, VolScratch *scratch)
{
    for (size_t n = 0; n <= frame->pass_count; n++)
        vol_scratch_free(&scratch[n]);
}

VolStatus vol_frame_pixel(const VolFrame *frame, int64_t x, int64_t y, VolPixelValue *out, VolError *err)
{
    VolScratch *scratch = vol_alloc_zero(1 + frame->pass_count, sizeof *scratch);
    VolFrameCounts counts = {0};
    if (!scratch)
        return vol_fail_memory(err, (1 + frame->pass_count) * sizeof *scratch);
    VolStatus status = new_scratches(frame, scratch, err);
    Block block = {.x = {x}, .y = {y}, .count = 1};
    if (!status)
        render_block(frame, scratch, &block, &counts);
    *out = block.values[0];
    free_scratches(frame, scratch);
    free(scratch);
    return status;
}

/* A job under way. */
typedef struct Work {
    const VolFrameJob *job;
    VolFrameCounts *counts;
    VolScratch *scratch; /* of each thread, one for the scene and one for each pass */
    pthread_mutex_t lock;
    int64_t tiles_across;
    size_t tiles, tiles_done;
} Work;

static void count_tile(Work *work, const VolFrameCounts *counts)
{
    const VolFrameJob *job = work->job;
    pthread_mutex_lock(&work->lock);
    work->counts->rays += counts->rays;
    work->counts->rays_missed += counts->rays_missed;
    work->counts->cells += counts->cells;
    work->counts->steps += counts->steps;
    work->counts->strongest = fmax(work->counts->strongest, counts->strongest);
    work->tiles_done++;
    if (job->progress)
        job->progress(job->progress_user, (double)work->tiles_done / (double)work->tiles);
    pthread_mutex_unlock(&work->lock);
}

static VolStatus render_tile(void *user, size_t index, int thread, VolError *err)
{
    Work *work = user;
    const VolFrameJob *job = work->job;
    VolFrameCounts counts = {0};
    int64_t tx = (int64_t)index % work->tiles_across * TILE, ty = (int64_t)index / work->tiles_across * TILE;
    int64_t x1 = tx + TILE < job->width ? tx + TILE : job->width, y1 = ty + TILE < job->height ? ty + TILE : job->height;
    (void)err;
    for (int64_t y = ty; y < y1; y += BLOCK_HEIGHT)
        for (int64_t x = tx; x < x1; x += BLOCK_WIDTH) {
            Block block = {.count = 0};
            for (int n = 0; n < BLOCK_PIXELS; n++) {
                int64_t px = x + n % BLOCK_WIDTH, py = y + n / BLOCK_WIDTH;
                if (px >= x1 || py >= y1)
                    continue;
                block.x[block.count] = job->x0 + px;
                block.y[block.count] = job->y0 + py;
                block.index[block.count++] = (size_t)(py * job->width + px);
            }
            render_block(job->frame, &work->scratch[(size_t)thread * (1 + job->frame->pass_count)], &block, &counts);
            for (int n = 0; n < block.count; n++)
                job->put(job->put_user, block.index[n], &block.values[n]);
        }
    count_tile(work, &counts);
    return VOL_OK;
}

VolStatus vol_frame_render(const VolFrameJob *job, VolFrameCounts *counts, VolError *err)
{
    size_t threads = (size_t)job->threads;
    Work work = {.job = job, .counts = counts, .tiles_across = (job->width + TILE - 1) / TILE};
    work.tiles = (size_t)(work.tiles_across * ((job->height + TILE - 1) / TILE));
    *counts = (VolFrameCounts){0};
    const size_t each = 1 + job->frame->pass_count;
    work.scratch = vol_alloc_zero(threads * each, sizeof *work.scratch);
    VolStatus status = work.scratch ? VOL_OK : vol_fail_memory(err, threads * each * sizeof *work.scratch);
    for (size_t i = 0; i < threads && !status; i++)
        status = new_scratches(job->frame, &work.scratch[i * each], err);
    pthread_mutex_init(&work.lock, NULL);
    if (!status)
        status = vol_parallel(job->threads, work.tiles, render_tile, &work, err);
    pthread_mutex_destroy(&work.lock);
    for (size_t i = 0; i < threads && work.scratch; i++) {
        add_skipped(&counts->skipped, &work.scratch[i * each].skipped);
        free_scratches(job->frame, &work.scratch[i * each]);
    }
    free(work.scratch);
    return status;
}
