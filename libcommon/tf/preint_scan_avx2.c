/* Diagonals of tables, with AVX2. */
#include "tf/preint_scan_tmpl.h"

void vol_preint_diagonal_avx2(const VolPreint *tables, const VolPreintTable *table, const Bins *bins, size_t k, int channel,
                              State *leaves, State *suffix)
{
    diagonal(tables, table, bins, k, channel, leaves, suffix);
}
