/* The exact estimator in float, with AVX2 and fused multiply-add. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/exact_tmpl.h"

void vol_exact_f32_avx2(const VolTraceCall *call)
{
    trace_exact(call);
}
