/* The pre-integrated estimators in float, for any machine. */
#define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
#include "trace/segments_tmpl.h"

void vol_segments_f32(const VolTraceCall *call)
{
    trace_segments(call);
}
