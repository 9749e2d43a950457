/* What a ray needs to know, prepared once, constant while rendering. */
#ifndef VOL_RENDER_SCENE_H
#define VOL_RENDER_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/cpu.h"
#include "base/status.h"
#include "base/vec.h"
#include "grid/grid.h"
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

/* The same tables in float and in double: see optics_tmpl.h. */
typedef struct VolOpticsF32 VolOpticsF32;
typedef struct VolOpticsF64 VolOpticsF64;

/* One stretch of a ray, for `--probe -v`. */
typedef struct VolTraceStep {
    double t0, t1, v0, v1, tau; /* tau: of the first channel, of this stretch alone */
    size_t interval;
    const char *what; /* "particles", "surface", "isosurface" */
} VolTraceStep;

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

    /* Prepared by vol_scene_prepare. */
    VolOpticsF32 *optics32;
    VolOpticsF64 *optics64;
    uint8_t *brick_visible; /* one per brick of the grid */
    uint8_t *node_visible;  /* one per node */
    bool background_visible;
    bool shaded;            /* hybrid or classic with something to shade */
    double stop_opacity;    /* rays end where what may still come is below this */
    double color_bound;     /* largest radiance any surface or particle can send */
    uint64_t bricks_visible, bricks_skipped;
} VolScene;

/* Fills the prepared part: needs grid, tf, lights, precise, skip. */
VolStatus vol_scene_prepare(VolScene *scene, VolError *err);
void vol_scene_release(VolScene *scene);

/* ---- One ray ---- */

typedef struct VolRay {
    VolVec3 origin, direction; /* world, unit */
    double t0, t1;             /* from the eye or the eye's plane to infinity */
} VolRay;

typedef struct VolRadiance {
    double color[3];   /* what the volume sends, background left out */
    double tau[3];     /* optical depth of the whole ray, per channel; INFINITY behind something opaque */
    double surface[3], scatter[3], emit[3];
    double normal[3];  /* sum over surfaces of weight times unit normal turned to the viewer */
    double depth;      /* t where alpha passes 0.5, or INFINITY */
    double cells;      /* cells or samples that were integrated */
} VolRadiance;

/* Cuts the ray's [t0, t1] to the domain and the clip planes; false: nothing left. */
bool vol_ray_clip(const VolScene *scene, VolRay *ray);

/* Optical depth beyond which a ray of that length can be given up: what is still to come, seen through it, is below
 * stop_opacity.  With T the transmittance reached and L the length, dropping the rest changes a pixel by at most
 * T max(1, largest radiance, background, largest emission x L). */
double vol_scene_stop_depth(const VolScene *scene, double length);

/* Rays already clipped.  One kernel per precision and cpu level, all of the same bytes. */
typedef void VolTraceRay(const VolScene *scene, const VolRay *ray, VolRadiance *out);
VolTraceRay vol_exact_f32, vol_exact_f64, vol_direct_f32, vol_direct_f64, vol_segments_f32, vol_segments_f64;
VolTraceRay vol_exact_f32_avx2, vol_exact_f64_avx2, vol_direct_f32_avx2, vol_direct_f64_avx2, vol_segments_f32_avx2,
    vol_segments_f64_avx2;

/* The kernel for the scene's estimator, precision and cpu level. */
VolTraceRay *vol_kernel(const VolScene *scene);

#endif
