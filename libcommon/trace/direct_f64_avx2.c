/* The direct estimator in double, with AVX2 and fused multiply-add. */
#define VOL_DOUBLE
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/direct_tmpl.h"

void vol_direct_f64_avx2(const VolTraceCall *call)
{
    trace_direct(call);
}
