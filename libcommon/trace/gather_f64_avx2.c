/* Fields at points in double, with AVX2 and fused multiply-add. */
#define VOL_DOUBLE
#include "trace/gather_tmpl.h"

void vol_gather_f64_avx2(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    gather_points(gather, points, count, out);
}
