/* Tracing rays: a kernel per estimator, precision and cpu level, all of the same bytes. */
#ifndef VOL_TRACE_TRACE_H
#define VOL_TRACE_TRACE_H

#include "trace/prepared.h"

/* What the rays met, and what of it was left out. */
typedef struct VolSkipped {
    uint64_t bricks_entered, blocks; /* visible bricks; invisible blocks of bricks, passed over in one step each */
    uint64_t cells_met;              /* cells or samples in the bricks entered, with something in them or not */
    uint64_t rays_ended;             /* early: nothing behind can be seen */
    uint64_t rays_in_double;         /* traced anew: float was not enough */
} VolSkipped;

/* What was made for some bricks: see bricks_tmpl.h. */
typedef struct VolBrickStore {
    void *numbers; /* of the kernel's precision */
    uint32_t *key;
    size_t places;
} VolBrickStore;

bool vol_brick_store_new(VolBrickStore *store, size_t places, size_t size); /* false: no memory; free it all the same */
void vol_brick_store_free(VolBrickStore *store);

/* All that the gradients of a brick follow from, where none of the bricks around it has storage: such are alike in many
 * places, as all along the faces of a tile. */
typedef struct VolSurroundings {
    uint32_t bricks[27];
    int32_t ends[6]; /* of the domain's voxels, from the brick's first, as far as they matter */
} VolSurroundings;

enum { VOL_SURROUNDINGS = 64 };

/* Those that were met last; they came by the numbers 1, 2, 3, ... */
typedef struct VolSurroundingsMet {
    VolSurroundings of[VOL_SURROUNDINGS];
    uint32_t number[VOL_SURROUNDINGS]; /* 0: none */
    uint32_t count;
    size_t last; /* place of the one that was asked for last */
} VolSurroundingsMet;

/* Bytes for what a kernel keeps of light grids: once, and of each light and each grid. */
enum { VOL_LIT_HEAD = 256, VOL_LIT_EACH = 1152 };

/* A thread's working memory, and what it counted. */
typedef struct VolScratch {
    VolBrickStore values;    /* VOL_BRICK_STRIDE numbers each */
    VolBrickStore gradients; /* three times as many */
    VolSurroundingsMet met;  /* whose gradients may be among them */
    void *zeros;             /* as large as one brick's gradients */
    struct VolGather *lit;   /* where the scene has light grids, for each of them */
    size_t lit_count;
    void *lit_room;          /* for what kernels keep of them: lit_tmpl.h */
    VolSkipped skipped;
    struct VolScratch *in_double; /* for rays that are traced anew, or NULL */
} VolScratch;

VolStatus vol_scratch_new(const VolPrepared *prepared, VolScratch *out, VolError *err);
void vol_scratch_free(VolScratch *scratch);

enum { VOL_PACKET = 16 };

/* Up to VOL_PACKET rays, already clipped; what comes out for one never depends on the others. */
typedef struct VolTraceCall {
    const VolPrepared *prepared;
    VolScratch *scratch;
    const VolTraceListener *listener; /* NULL: nobody */
    const VolRay *rays;
    size_t count;
    VolRadiance *out;
} VolTraceCall;

/* By the kernel for the scene's estimator, precision and cpu level; rays that it gives up, by the same in double. */
void vol_trace_rays(const VolTraceCall *call);

/* The kernels.  AVX-512 in float alone. */
typedef void VolTraceRays(const VolTraceCall *call);
VolTraceRays vol_exact_f32, vol_exact_f64, vol_direct_f32, vol_direct_f64, vol_segments_f32, vol_segments_f64;
VolTraceRays vol_exact_f32_avx2, vol_exact_f64_avx2, vol_direct_f32_avx2, vol_direct_f64_avx2, vol_segments_f32_avx2,
    vol_segments_f64_avx2;
VolTraceRays vol_exact_f32_avx512, vol_direct_f32_avx512, vol_segments_f32_avx512;

#endif
