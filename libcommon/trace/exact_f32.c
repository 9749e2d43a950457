/* The exact estimator in float, for any machine. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/exact_tmpl.h"

void vol_exact_f32(const VolTraceCall *call)
{
    trace_exact(call);
}
