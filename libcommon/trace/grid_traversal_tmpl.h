/* Grids as estimators see them: keeps the contract of traversal.h.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    the contract */
#ifndef VOL_TRACE_GRID_TRAVERSAL_TMPL_H
#define VOL_TRACE_GRID_TRAVERSAL_TMPL_H

#include "trace/grid_cells_tmpl.h"
#include "trace/grid_rays_tmpl.h"
#include "trace/grid_samples_tmpl.h"

#endif
