/* Optical tables in float. */
#include "trace/tf_tables.h"
#include "simd/real.h"

#include "trace/tf_tables_build_tmpl.h"

VolStatus vol_tf_tables_f32_new(const VolScene *scene, VolTfTablesF32 **out, VolError *err)
{
    *out = vol_alloc_zero(1, sizeof **out);
    if (!*out)
        return vol_fail_memory(err, sizeof **out);
    VolStatus status = build_tf_tables(scene, &(*out)->o, err);
    if (status) {
        free(*out);
        *out = NULL;
    }
    return status;
}

void vol_tf_tables_f32_free(VolTfTablesF32 *tables)
{
    if (tables)
        free_tf_tables(&tables->o);
    free(tables);
}
