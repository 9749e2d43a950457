/* What makes a volume visible: a transfer function (ours, another program's, or pre-integration tables), fitted to the
 * volume at hand, with the tables that an estimator needs. */
#ifndef VOL_LOAD_LOOK_H
#define VOL_LOAD_LOOK_H

#include "grid/grid.h"
#include "load/tables.h"
#include "tf/preint.h"

typedef struct VolLook {
    VolTf tf;
    VolTables *tables; /* as read, or NULL */
    VolTfUnits units;  /* what tf leaves to the volume */

    /* After vol_look_fit: */
    VolTfCompiled compiled;
    VolPreint preint; /* octave_count 0: none */
    VolTfIntegrals integrals;
    bool has_integrals;
    double unit; /* of the field as it is now, in units of the field as it was: a power of two, mostly 1 */
} VolLook;

typedef struct VolLookSettings {
    double particle_step, scalar_step; /* 0: the file's */
    bool full, integrals;              /* what the estimator needs */
    double step;                       /* world units, for `full` */
    size_t nodes;                      /* of tables made here */
    int threads;
    VolCpu cpu;
} VolLookSettings;

/* `part`: which of several transfer functions in the file, or NULL. */
VolStatus vol_look_read(const VolBytes *bytes, const char *name, const char *part, const VolLog *log, VolLook *out,
                        VolError *err);

/* Settles what a transfer function left to the volume: relative values are stretched over the grid's range, and
 * particle_step becomes world units. */
void vol_look_settle(VolTf *tf, VolTfUnits units, const VolGrid *grid, const VolLog *log);

/* Settles, applies the settings, compiles, and makes the tables: those that were read are used as they are unless a setting
 * changes what they hold (a note then says that they are made anew).  Where the nodes lie far from 1, the grid and
 * everything here are taken to other units. */
VolStatus vol_look_fit(VolLook *look, VolGrid *grid, const VolLookSettings *settings, const VolLog *log, VolError *err);
void vol_look_free(VolLook *look);

/* More steps than this a ray should not take: a second, and that for each. */
#define VOL_MOST_STEPS 1e8

/* How many steps of this length (world units) a ray through the whole volume takes at most; what is far from all that the
 * volume holds is passed in one. */
double vol_look_steps(const VolGrid *grid, double step);

/* Between which values anything changes, isosurfaces left out: beyond, all is as at the ends.  False: nothing does. */
bool vol_look_varies(const VolTfCompiled *tf, double *from, double *to);

/* The transfer function and the tables in force. */
const VolTfCompiled *vol_look_compiled(const VolLook *look);
const VolPreint *vol_look_preint(const VolLook *look);

#endif
