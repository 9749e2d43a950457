/* The light grids of a VDB, as light-solve writes them: light.K.direct, light.K.J.direct, light.K.indirect, light.total. */
#ifndef VOL_LOAD_LIGHT_GRIDS_H
#define VOL_LOAD_LIGHT_GRIDS_H

#include "base/log.h"
#include "io/vdb.h"
#include "trace/lit.h"

typedef struct VolLightGrids {
    VolLight *lights;  /* as their grids say, in the order of K and J; of a total, those that it is the sum of */
    int *number;       /* K of each */
    size_t light_count;
    VolGrid **grids;   /* as in `lit` */
    VolLit lit;        /* grid_count 0: the VDB has none */
    char *tf, *volume, *clip; /* what the first of them says that it was solved for; NULL: nothing */
} VolLightGrids;

/* Whether the VDB has any. */
bool vol_has_light_grids(const VolVdb *vdb);

/* Before the volume is loaded.  A light without light:spec, values that are not finite, a total beside direct or indirect
 * light: VOL_BAD_INPUT.  Whatever comes of it, vol_light_grids_free() is to follow. */
VolStatus vol_load_light_grids(const VolVdb *vdb, int threads, const VolLog *log, VolLightGrids *out, VolError *err);

/* VOL_BAD_INPUT: a grid does not cover the volume's domain. */
VolStatus vol_light_grids_check(const VolLightGrids *grids, const VolVolume *volume, VolError *err);

void vol_light_grids_free(VolLightGrids *grids);

#endif
