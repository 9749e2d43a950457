/* Other programs' transfer functions: ParaView colour maps (JSON), 3D Slicer presets (XML), Inviwo .itf and Voreen .tfi
 * (XML), OSPRay .tfn.  The format is told by the content, never by the file's name.
 *
 *     char *file;
 *     const char *part;
 *     VolTf tf;
 *     VolTfUnits units;
 *     vol_tf_split_name(option, access(option, F_OK) == 0, &file, &part, err);     option: "presets.xml#CT-Bone"
 *     ... read `file` into `bytes` ...
 *     status = vol_tf_read(&bytes, file, part, &tf, &units, log, err);
 *     if (status == VOL_OK && units.relative)
 *         vol_tf_rescale(&tf, data_min, data_max);
 *     ... particle_step times the length of units.step, --particle-step, vol_tf_compile; vol_tf_free(&tf), free(file)
 *
 * What is made of them.  Opacities become particles (the list `scatter`), for the particle_step that the program takes for
 * the volume unless the file has one of its own; colours are decoded from sRGB to linear Rec.709.  Where a program blends
 * colours otherwise than linearly, in sRGB, HSV, Lab or Moreland's Msh, or opacities along a curve, nodes are put in
 * between, so that every channel and the opacity stay within 1e-3 of what the program shows. */
#ifndef VOL_TF_FOREIGN_H
#define VOL_TF_FOREIGN_H

#include "tf/tf.h"

/* "FILE#PART" -> "FILE" and "PART"; *part points into *file's allocation, is NULL where there is none, and both go with
 * free(*file).  `exists`: a file of the whole name is there, so that the '#' belongs to it.  The first '#' after the
 * last '/' counts. */
VolStatus vol_tf_split_name(const char *name, bool exists, char **file, const char **part, VolError *err);

/* What a file leaves to the volume that it is used for. */
typedef enum VolStepUnit {
    VOL_STEP_WORLD, /* world units: nothing is left */
    VOL_STEP_VOXEL, /* a voxel's edge */
    VOL_STEP_CELL,  /* the volume's diagonal over the cube root of its number of cells: a cubic cell's diagonal */
    VOL_STEP_BOX    /* the volume's edge, voxels counted whole */
} VolStepUnit;

typedef struct VolTfUnits {
    bool relative;    /* values are fractions of the data's range, to be stretched by vol_tf_rescale */
    VolStepUnit step; /* what particle_step counts */
} VolTfUnits;

/* Reads any kind, our own JSON included (as vol_tf_parse does).  `name` is for messages; `part` names one of several
 * transfer functions in the file and may be NULL where there is only one. */
VolStatus vol_tf_read(const VolBytes *bytes, const char *name, const char *part, VolTf *out, VolTfUnits *units,
                      const VolLog *log, VolError *err);

/* Values v become lo (1 - v) + hi v: nodes and isosurfaces, and a scalar_step that was not given.  lo, hi: finite; where
 * hi is not greater (all data is one value, that of v = 0) a range of max(1, |lo|) is taken. */
void vol_tf_rescale(VolTf *tf, double lo, double hi);

#endif
