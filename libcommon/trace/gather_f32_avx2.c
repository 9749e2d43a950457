/* Fields at points in float, with AVX2 and fused multiply-add. */
#include "trace/gather_tmpl.h"

void vol_gather_f32_avx2(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    gather_points(gather, points, count, out);
}
