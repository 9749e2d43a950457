/* The pre-integrated estimators in double, for any machine. */
#define VOL_DOUBLE
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/segments_tmpl.h"

void vol_segments_f64(const VolTraceCall *call)
{
    trace_segments(call);
}
