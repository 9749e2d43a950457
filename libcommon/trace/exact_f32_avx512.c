/* The exact estimator in float, with AVX-512. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/exact_tmpl.h"

void vol_exact_f32_avx512(const VolTraceCall *call)
{
    trace_exact(call);
}
