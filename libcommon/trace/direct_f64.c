/* The direct estimator in double, for any machine. */
#define VOL_DOUBLE
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/direct_tmpl.h"

void vol_direct_f64(const VolTraceCall *call)
{
    trace_direct(call);
}
