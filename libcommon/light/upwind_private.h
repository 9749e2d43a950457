/* Between the upwind sweep and its loops, compiled per cpu level from upwind_tmpl.h. */
#ifndef VOL_LIGHT_UPWIND_PRIVATE_H
#define VOL_LIGHT_UPWIND_PRIVATE_H

#include <stdbool.h>
#include <stdint.h>

/* Rows that do not depend on each other, side by side. */
enum { VOL_UPWIND_ROWS = 8 };

typedef struct VolUpwindRow {
    const float *before, *beside; /* where the light comes from along axes 0 and 1 */
    const float *extinction;
    float *to;
    float weight[2], across; /* along axes 0 and 1; a point: the squared distance across the row */
} VolUpwindRow;

/* Along axis 2, which all rows share: count voxels from `first` on in steps of +1 or -1. */
typedef struct VolUpwindWay {
    int32_t first, count;
    int step;
    bool from_voxel; /* light comes to the first from the voxel before it; else from before the box */
    bool from_point;
    float weight, edge; /* a sun's; a voxel's */
    int32_t source;     /* a point's */
} VolUpwindWay;

typedef void VolUpwindRows(const VolUpwindWay *way, const VolUpwindRow *rows, int count);
VolUpwindRows vol_upwind_rows, vol_upwind_rows_avx2, vol_upwind_rows_avx512;

#endif
