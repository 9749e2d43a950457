/* Fields at points in float, for any machine. */
#include "trace/gather_tmpl.h"

void vol_gather_f32(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    gather_points(gather, points, count, out);
}
