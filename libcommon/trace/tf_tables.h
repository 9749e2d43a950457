/* The kernels' tables, one kind per precision. */
#ifndef VOL_TRACE_TF_TABLES_H
#define VOL_TRACE_TF_TABLES_H

#include "trace/prepared.h"

VolStatus vol_tf_tables_f32_new(const VolScene *scene, VolTfTablesF32 **out, VolError *err);
void vol_tf_tables_f32_free(VolTfTablesF32 *tables);
VolStatus vol_tf_tables_f64_new(const VolScene *scene, VolTfTablesF64 **out, VolError *err);
void vol_tf_tables_f64_free(VolTfTablesF64 *tables);

#endif
