/* What a ray needs to know, prepared once, constant while rendering. */
#ifndef VOL_TRACE_SCENE_H
#define VOL_TRACE_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/cpu.h"
#include "base/status.h"
#include "base/vec.h"
#include "volume/grid.h"
#include "tf/preint.h"
#include "tf/tf.h"

typedef enum VolLightKind { VOL_LIGHT_HEAD, VOL_LIGHT_SUN, VOL_LIGHT_POINT, VOL_LIGHT_SPOT } VolLightKind;

typedef struct VolLight {
    VolLightKind kind;
    VolVec3 position;  /* points and spots */
    VolVec3 direction; /* unit, in which the light travels: suns and spots */
    double rgb[3];
    double cos_edge, cos_full; /* spots: dark beyond the first, full within the second */
} VolLight;

/* Keeps n.x >= d; n as the user gave it. */
typedef struct VolClip {
    VolVec3 normal;
    double d;
} VolClip;

typedef enum VolEstimator {
    VOL_ESTIMATE_EXACT,
    VOL_ESTIMATE_FULL,
    VOL_ESTIMATE_INTEGRALS,
    VOL_ESTIMATE_DIRECT
} VolEstimator;

typedef enum VolLayer {
    VOL_LAYER_Z = 1,
    VOL_LAYER_NORMAL = 2,
    VOL_LAYER_SURFACE = 4,
    VOL_LAYER_SCATTER = 8,
    VOL_LAYER_EMIT = 16,
    VOL_LAYER_STEPS = 32
} VolLayer;

/* The same tables in float and in double: see tf_tables_tmpl.h. */
typedef struct VolTfTablesF32 VolTfTablesF32;
typedef struct VolTfTablesF64 VolTfTablesF64;

/* One stretch of a ray, for `--probe -v`. */
typedef struct VolTraceStep {
    double t0, t1, v0, v1, optical_depth; /* tau: of the first channel, of this stretch alone */
    size_t interval;
    const char *what; /* "particles", "surface", "isosurface" */
} VolTraceStep;

/* In `brick_visible`: ENTERED though nothing is in it, for a test or for what lies beyond its holes. */
enum { VOL_BRICK_LEFT_OUT, VOL_BRICK_ENTERED, VOL_BRICK_SEEN };

/* In `levels`: a block of 2^level bricks a side, aligned, is invisible; or the brick is to be entered. */
enum { VOL_NODE_LEVEL = 4, VOL_WIDE = 254, VOL_VISIBLE = 255 };

typedef struct VolScene {
    const VolGrid *grid;
    const VolTfCompiled *tf;
    const VolLight *lights;
    size_t light_count;
    const VolClip *clips;
    size_t clip_count;
    VolEstimator estimator;
    double step;         /* world units, for estimators that march */
    const VolPreint *preint;         /* of `tf`, for FULL */
    const VolTfIntegrals *integrals; /* of `tf`, for INTEGRALS */
    bool precise;
    bool skip;           /* leave out what is invisible; off only to test that it changes nothing */
    unsigned layers;     /* VolLayer bits */
    double background_max; /* largest channel of what lies behind */
    VolCpu cpu;
    void (*trace)(void *user, const VolTraceStep *step); /* one thread only */
    void *trace_user;
    double unit;         /* of the field here, in units of the user's field; 0 is 1 */

    /* Prepared by vol_scene_prepare. */
    VolTfTablesF32 *tables32;
    VolTfTablesF64 *tables64;
    uint8_t *brick_visible; /* one per brick of the grid: VOL_BRICK_... */
    uint8_t *empty_levels;        /* 16^3 per node with bricks of its own: VOL_VISIBLE, or the invisible block around each */
    uint8_t *ill_conditioned; /* one per brick: float is not enough there (conditioning.c); NULL: nowhere */
    bool background_visible;
    int32_t visible_min[3], visible_max[3]; /* bricks: the box around the visible ones */
    int margin;             /* bricks at the faces of a block of one value that are entered one by one; -1: all are */
    bool shaded;            /* hybrid or classic with something to shade */
    double termination_opacity;    /* rays end where what may still come is below this; set before, or 0: by the precision */
    double termination_depth;      /* the optical depth for that, where nothing is emitted */
    double color_bound;     /* largest radiance any surface or particle can send */
    uint64_t bricks_visible, bricks_skipped;
} VolScene;

/* Fills the prepared part: needs grid, tf, lights, precise, skip, estimator, step. */
VolStatus vol_scene_prepare(VolScene *scene, VolError *err);
void vol_scene_release(VolScene *scene);

/* The terms that the scene is without, hence the kernel too: "surfaces, emission, ..." into `out`. */
void vol_scene_features_skipped(const VolScene *scene, char *out, size_t size);

/* ---- One ray ---- */

typedef struct VolRay {
    VolVec3 origin, direction; /* world, unit */
    double t0, t1;             /* from the eye or the eye's plane to infinity */
} VolRay;

typedef struct VolRadiance {
    double color[3];   /* what the volume sends, background left out */
    double optical_depth[3];     /* optical depth of the whole ray, per channel; INFINITY behind something opaque */
    double surface[3], scatter[3], emit[3];
    double normal[3];  /* sum over surfaces of weight times unit normal turned to the viewer */
    double depth;      /* t where alpha passes 0.5, or INFINITY */
    double cells;      /* cells or samples that were integrated */
    uint64_t given_up; /* 1: the ray met a brick for which float is not enough, and nothing else here means anything */
} VolRadiance;

/* Cuts the ray's [t0, t1] to the domain and the clip planes; false: nothing left. */
bool vol_ray_clip(const VolScene *scene, VolRay *ray);

/* Whether a clipped ray meets the box around the visible bricks. */
bool vol_ray_meets_visible(const VolScene *scene, const VolRay *ray);

/* Optical depth beyond which a ray of that length can be given up: what is still to come, seen through it, is below
 * stop_opacity.  With T the transmittance reached and L the length, dropping the rest changes a pixel by at most
 * T (max(1, largest radiance, background) + largest emission x L). */
double vol_scene_termination_depth(const VolScene *scene, double length);

/* What the rays met, and what of it was left out. */
typedef struct VolSkipped {
    uint64_t bricks_entered, blocks; /* visible bricks; invisible blocks of bricks, passed over in one step each */
    uint64_t cells_met;              /* cells or samples in the bricks entered, with something in them or not */
    uint64_t rays_ended;             /* early: nothing behind can be seen */
    uint64_t rays_in_double;         /* traced anew: float was not enough */
} VolSkipped;

/* ---- Kernels ---- */

/* What was made for some bricks: see bricks_tmpl.h. */
typedef struct VolBrickStore {
    void *numbers; /* of the kernel's precision */
    uint32_t *key;
    size_t places;
} VolBrickStore;

/* A thread's working memory, and what it counted. */
typedef struct VolScratch {
    VolBrickStore values;    /* VOL_BRICK_STRIDE numbers each */
    VolBrickStore gradients; /* three times as many */
    void *zeros;             /* as large as one brick's gradients */
    VolSkipped skipped;
    struct VolScratch *in_double; /* for rays that are traced anew, or NULL */
} VolScratch;

enum { VOL_PACKET = 16 };

VolStatus vol_scratch_new(const VolScene *scene, VolScratch *out, VolError *err);
void vol_scratch_free(VolScratch *scratch);

/* Up to VOL_PACKET rays, already clipped; what comes out for one never depends on the others.  One kernel per precision
 * and cpu level, all of the same bytes; AVX-512 in float alone. */
typedef void VolTraceRays(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count,
                          VolRadiance *out);
VolTraceRays vol_exact_f32, vol_exact_f64, vol_direct_f32, vol_direct_f64, vol_segments_f32, vol_segments_f64;
VolTraceRays vol_exact_f32_avx2, vol_exact_f64_avx2, vol_direct_f32_avx2, vol_direct_f64_avx2, vol_segments_f32_avx2,
    vol_segments_f64_avx2;
VolTraceRays vol_exact_f32_avx512, vol_direct_f32_avx512, vol_segments_f32_avx512;

/* By the kernel for the scene's estimator, precision and cpu level; those that it gives up, by the same in double. */
void vol_trace_rays(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out);

#endif
