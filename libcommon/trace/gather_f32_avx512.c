/* Fields at points in float, with AVX-512. */
#include "trace/gather_tmpl.h"

void vol_gather_f32_avx512(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    gather_points(gather, points, count, out);
}
