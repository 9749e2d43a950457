/* Other programs' transfer functions: ParaView colour maps (JSON), 3D Slicer presets (XML), Inviwo .itf and Voreen .tfi
 * (XML), OSPRay .tfn.  The format is told by the content, never by the file's name.
 *
 *     char *file;
 *     const char *part;
 *     VolTf tf;
 *     bool relative;
 *     vol_tf_split_name(option, access(option, F_OK) == 0, &file, &part, err);     option: "presets.xml#CT-Bone"
 *     ... read `file` into `bytes` ...
 *     status = vol_tf_read(&bytes, file, part, &tf, &relative, log, err);
 *     if (status == VOL_OK && relative)
 *         vol_tf_rescale(&tf, data_min, data_max);
 *     ... --particle-step, vol_tf_compile; vol_tf_free(&tf), free(file)
 *
 * What is made of them.  Opacities become particles (the list `scatter`), for a particle_step of 1 world unit unless the
 * file has one of its own; colours are decoded from sRGB to linear Rec.709.  Where a program blends colours otherwise than
 * linearly, in sRGB, HSV, Lab or Moreland's Msh, or opacities along a curve, nodes are put in between, so that every
 * channel and the opacity stay within 1e-3 of what the program shows. */
#ifndef VOL_TF_FOREIGN_H
#define VOL_TF_FOREIGN_H

#include "tf/tf.h"

/* "FILE#PART" -> "FILE" and "PART"; *part points into *file's allocation, is NULL where there is none, and both go with
 * free(*file).  `exists`: a file of the whole name is there, so that the '#' belongs to it.  The first '#' after the
 * last '/' counts. */
VolStatus vol_tf_split_name(const char *name, bool exists, char **file, const char **part, VolError *err);

/* Reads any kind, our own JSON included (as vol_tf_parse does).  `name` is for messages; `part` names one of several
 * transfer functions in the file and may be NULL where there is only one.
 * *relative: the values are fractions of the data's range, to be stretched by vol_tf_rescale. */
VolStatus vol_tf_read(const VolBytes *bytes, const char *name, const char *part, VolTf *out, bool *relative,
                      const VolLog *log, VolError *err);

/* Values v become lo (1 - v) + hi v: nodes and isosurfaces, and a scalar_step that was not given.  lo, hi: finite; where
 * hi is not greater (all data is one value, that of v = 0) a range of max(1, |lo|) is taken. */
void vol_tf_rescale(VolTf *tf, double lo, double hi);

#endif
