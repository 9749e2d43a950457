/* Rays, what they bring back, and what they can be asked to tell on the way. */
#ifndef VOL_TRACE_RAY_H
#define VOL_TRACE_RAY_H

#include <stddef.h>
#include <stdint.h>

#include "base/vec.h"
#include "trace/layers.h"

typedef struct VolRay {
    VolVec3 origin, direction; /* world, unit */
    double t0, t1;             /* from the eye or the eye's plane to infinity */
} VolRay;

typedef struct VolRadiance {
    double color[3];         /* what the volume sends, background left out */
    double optical_depth[3]; /* of the whole ray, per channel; INFINITY behind something opaque */
    double sum[VOL_SUMS][3]; /* the layers that are sums over the ray */
    double depth;            /* t where alpha passes 0.5, or INFINITY */
    double cells;            /* cells or samples that were integrated */
    uint64_t given_up;       /* 1: float is not enough somewhere on the ray, and nothing else here means anything */
} VolRadiance;

/* One part of a ray, for `--probe -v`. */
typedef struct VolTraceStep {
    double t0, t1, v0, v1, optical_depth; /* of the first channel, of this part alone */
    size_t interval;
    const char *what; /* "particles", "surface", "isosurface" */
} VolTraceStep;

/* Who wants to hear of each part: one thread only. */
typedef struct VolTraceListener {
    void (*step)(void *user, const VolTraceStep *step);
    void *user;
} VolTraceListener;

#endif
