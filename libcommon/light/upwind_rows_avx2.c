/* Rows of the upwind scheme with AVX2. */
#include "light/upwind_tmpl.h"

void vol_upwind_rows_avx2(const VolUpwindWay *way, const VolUpwindRow *rows, int count) { upwind_rows(way, rows, count); }
