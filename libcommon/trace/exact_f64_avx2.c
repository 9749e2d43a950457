/* The exact estimator in double, with AVX2 and fused multiply-add. */
#define VOL_DOUBLE
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/exact_tmpl.h"

void vol_exact_f64_avx2(const VolTraceCall *call)
{
    trace_exact(call);
}
