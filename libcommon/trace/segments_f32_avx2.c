/* The pre-integrated estimators in float, with AVX2 and fused multiply-add. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/segments_tmpl.h"

void vol_segments_f32_avx2(const VolTraceCall *call)
{
    trace_segments(call);
}
