/* The exact estimator in double, for any machine. */
#define VOL_DOUBLE
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/exact_tmpl.h"

void vol_exact_f64(const VolTraceCall *call)
{
    trace_exact(call);
}
