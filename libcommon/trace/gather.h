/* Fields at points: light and colour, wherever they are asked for.
 *
 * Between voxels a field is trilinear.  Beyond its box a box's values go on as they are at its faces; outside a sparse field
 * there is its background (vol_grid_voxel).  NaN where a corner of the cell is not finite. */
#ifndef VOL_TRACE_GATHER_H
#define VOL_TRACE_GATHER_H

#include "base/cpu.h"
#include "trace/trace.h"
#include "volume/grid.h"

/* A thread's working memory for one field. */
typedef struct VolGather {
    const VolGrid *field; /* outlives this */
    VolBrickStore store;
    VolCpu cpu;
    bool precise; /* in double */
} VolGather;

/* Whatever comes of it, vol_gather_free() is to follow. */
VolStatus vol_gather_new(const VolGrid *field, VolCpu cpu, bool precise, VolGather *out, VolError *err);
void vol_gather_free(VolGather *gather);

/* The field at points of world space: a number each, of RGB three.  The same bits at any cpu level, whatever the points'
 * order; points beside one another, one behind the other, are quickest. */
void vol_gather(VolGather *gather, const VolVec3 *points, size_t count, double *out);

/* The kernels.  AVX-512 in float alone. */
typedef void VolGatherPoints(VolGather *gather, const VolVec3 *points, size_t count, double *out);
VolGatherPoints vol_gather_f32, vol_gather_f32_avx2, vol_gather_f32_avx512, vol_gather_f64, vol_gather_f64_avx2;

#endif
