/* Rows of the upwind scheme for any machine. */
#include "light/upwind_tmpl.h"

void vol_upwind_rows(const VolUpwindWay *way, const VolUpwindRow *rows, int count) { upwind_rows(way, rows, count); }
