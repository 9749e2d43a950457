/* Fields at points in double, for any machine. */
#define VOL_DOUBLE
#include "trace/gather_tmpl.h"

void vol_gather_f64(VolGather *gather, const VolVec3 *points, size_t count, double *out)
{
    gather_points(gather, points, count, out);
}
