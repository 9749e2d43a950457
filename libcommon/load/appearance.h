/* What makes a volume visible: a transfer function (ours, another program's, or pre-integration tables), fitted to the
 * volume at hand, with the tables that an estimator needs. */
#ifndef VOL_LOAD_APPEARANCE_H
#define VOL_LOAD_APPEARANCE_H

#include "load/tables.h"
#include "tf/preint.h"
#include "volume/volume.h"

typedef struct VolAppearance {
    VolTf tf;
    VolTables *tables; /* as read, or NULL */
    VolTfUnits units;  /* what tf leaves to the volume */

    /* After vol_appearance_fit: */
    VolTfCompiled compiled;
    VolPreint preint; /* octave_count 0: none */
    VolTfIntegrals integrals;
    bool has_integrals;
    double unit; /* of the field as it is now, in units of the field as it was: a power of two, mostly 1 */
} VolAppearance;

typedef struct VolAppearanceSettings {
    double particle_step, scalar_step; /* 0: the file's */
    bool full, integrals;              /* what the estimator needs */
    double step;                       /* world units, for `full` */
    size_t nodes;                      /* of tables made here */
    int threads;
    VolCpu cpu;
} VolAppearanceSettings;

/* `part`: which of several transfer functions in the file, or NULL. */
VolStatus vol_appearance_read(const VolBytes *bytes, const char *name, const char *part, const VolLog *log,
                              VolAppearance *out, VolError *err);

/* Settles what a transfer function left to the volume: relative values are stretched over the volume's range, and
 * particle_step becomes world units. */
void vol_appearance_settle(VolTf *tf, VolTfUnits units, const VolVolume *volume, const VolLog *log);

/* Settles, applies the settings, compiles, and makes the tables: those that were read are used as they are unless a setting
 * changes what they hold (a note then says that they are made anew).  Where the nodes lie far from 1, the volume and
 * everything here are taken to other units. */
VolStatus vol_appearance_fit(VolAppearance *appearance, VolVolume *volume, const VolAppearanceSettings *settings,
                             const VolLog *log, VolError *err);
void vol_appearance_free(VolAppearance *appearance);

/* More steps than this a ray should not take: a second, and that for each. */
#define VOL_MOST_STEPS 1e8

/* How many steps of this length (world units) a ray through the whole volume takes at most; what is far from all that the
 * volume holds is passed in one. */
double vol_appearance_steps(const VolVolume *volume, double step);

/* The world length of one step of the unit, as other programs have it (pellucid-files(5)).  Where it depends on the
 * direction - voxels or volumes that are not cubes - that of the cube of the same size. */
double vol_step_of_unit(const VolVolume *volume, VolStepUnit unit);

/* Between which values anything changes, isosurfaces left out: beyond, all is as at the ends.  False: nothing does. */
bool vol_appearance_varies(const VolTfCompiled *tf, double *from, double *to);

/* The transfer function and the tables in force. */
const VolTfCompiled *vol_appearance_compiled(const VolAppearance *appearance);
const VolPreint *vol_appearance_preint(const VolAppearance *appearance);

#endif
