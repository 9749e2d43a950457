/* The direct estimator in float, for any machine. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/direct_tmpl.h"

void vol_direct_f32(const VolTraceCall *call)
{
    trace_direct(call);
}
