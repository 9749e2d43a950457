/* A picture: rays through pixels, gathered into channels. */
#ifndef VOL_RENDER_FRAME_H
#define VOL_RENDER_FRAME_H

#include <stdint.h>

#include "base/status.h"
#include "render/camera.h"
#include "trace/trace.h"

/* What lies behind the volume: one colour, or a picture of the frame's size (RGB, interleaved, row 0 on top). */
typedef struct VolBackdrop {
    double color[3];
    const float *picture; /* NULL: the colour */
} VolBackdrop;

enum { VOL_PASSES = 33 };

typedef struct VolPixelValue {
    double color[3]; /* premultiplied, background composited in */
    double alpha[3]; /* the volume's own, per channel */
    double mean_alpha;
    double depth;    /* along the view axis; 1e10 where alpha never passes 0.5 */
    double sum[VOL_SUMS][3];
    double cells;
    double pass[VOL_PASSES][3];
} VolPixelValue;

/* The same picture of another scene, of which the scattered light is wanted alone. */
typedef struct VolFramePass {
    const VolPrepared *prepared;
    char names[3][24]; /* of its channels */
} VolFramePass;

typedef struct VolFrame {
    const VolPrepared *prepared;
    const VolTraceListener *listener; /* for vol_frame_pixel; or NULL */
    const VolCamera *camera;
    VolBackdrop backdrop;
    int samples; /* N: the centres of N x N strata, box filter */
    const VolFramePass *passes;
    size_t pass_count; /* VOL_PASSES at most */
} VolFrame;

typedef struct VolFrameCounts {
    uint64_t rays, rays_missed, cells;
    uint64_t steps; /* of the estimators that march: from where the rays enter to where they leave */
    VolSkipped skipped;
    double strongest; /* the largest opacity or colour that a ray has from the volume itself */
} VolFrameCounts;

/* One pixel of the picture, whatever part of it is being made. */
VolStatus vol_frame_pixel(const VolFrame *frame, int64_t x, int64_t y, VolPixelValue *out, VolError *err);

/* Where finished pixels go: number `index` (row by row) of those being made.  Called by all threads, once per pixel. */
typedef void VolPixelPut(void *user, size_t index, const VolPixelValue *pixel);

/* Pixels x0 <= x < x0 + width, likewise y, and who is to have them. */
typedef struct VolFrameJob {
    const VolFrame *frame;
    int64_t x0, y0, width, height;
    int threads;
    VolPixelPut *put;
    void *put_user;
    void (*progress)(void *user, double fraction); /* NULL, or called under a lock with 0..1 */
    void *progress_user;
} VolFrameJob;

/* Spread over threads by tiles; what comes out does not depend on their number. */
VolStatus vol_frame_render(const VolFrameJob *job, VolFrameCounts *counts, VolError *err);

#endif
