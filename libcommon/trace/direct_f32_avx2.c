/* The direct estimator in float, with AVX2 and fused multiply-add. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/direct_tmpl.h"

void vol_direct_f32_avx2(const VolTraceCall *call)
{
    trace_direct(call);
}
