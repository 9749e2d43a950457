/* The direct estimator in float, with AVX-512. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/direct_tmpl.h"

void vol_direct_f32_avx512(const VolTraceCall *call)
{
    trace_direct(call);
}
