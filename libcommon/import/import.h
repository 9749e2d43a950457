/* Other people's volumes become voxels with an affine transform. */
#ifndef VOL_IMPORT_IMPORT_H
#define VOL_IMPORT_IMPORT_H

#include "base/log.h"
#include "import/sampled.h"
#include "io/vdb.h"

/* How readers get at files: the file named first and those that it refers to.  The caller keeps account of what
 * was read (for the history) and of stdin. */
typedef struct VolImportFiles {
    VolStatus (*read)(void *user, const char *path, VolBytes *out, VolError *err);
    void *user;
} VolImportFiles;

enum { VOL_COMPONENT_MAGNITUDE = -1, VOL_COMPONENT_DEFAULT = -2 };

typedef struct VolImportOptions {
    const char *array;  /* NULL: the active or only one.  DICOM: series UID, number or description */
    int64_t component;  /* 0.., VOL_COMPONENT_MAGNITUDE; DEFAULT: the only one, else the magnitude */
    int64_t time_step;  /* 0.. */
    bool spacing_given, origin_given;
    VolVec3 spacing, origin; /* replace lengths of the index axes, place of voxel (0,0,0) */
    bool fill_gaps;     /* missing DICOM slices become NaN */
    bool raw;           /* the files are samples alone: */
    int64_t dims[3];    /*   with dims (dims[2] 0: one slice per file) */
    VolSample type;
    bool big_endian;
    int64_t header;     /*   bytes skipped at the start of every file */
} VolImportOptions;

/* Opens operands (files, one folder of DICOM, or slices); what a file is, its bytes tell. */
VolStatus vol_import_open(const char *const *paths, size_t count, const VolImportOptions *options,
                          const VolImportFiles *files, const VolLog *log, VolSampled *out, VolError *err);

/* "NIfTI", "DICOM", ...: what vol_import_open would read it as, gzip and bzip2 looked through; NULL: nothing it knows. */
const char *vol_import_format(const VolBytes *bytes);

/* What a file is that its reader did not expect, for messages. */
typedef struct VolForeign {
    const char *what;   /* "it is .vtu (a VTK unstructured grid)"; NULL: nothing that is known */
    const char *advice; /* ": vol-import does not read it in this version", or "" */
    bool mesh;          /* a volume or mesh, if not one that is read */
} VolForeign;

/* Of what vol_import_format does not know.  `name`, if given, tells where the bytes do not. */
VolForeign vol_import_foreign(const VolBytes *bytes, const char *name);

/* The image converted: x fastest, one of the two arrays. */
typedef struct VolImported {
    int32_t dims[3];
    VolAffine index_to_world;
    VolVdbStore store;   /* FLOAT for samples that a float holds exactly (u8, i8, u16, i16, f32, and these scaled),
                          * INT32 for i32, DOUBLE for the rest */
    float *single;       /* FLOAT */
    double *twice;       /* DOUBLE, INT32 */
    uint64_t non_finite;
    double largest;      /* magnitude of a finite value */
    uint64_t inexact;    /* 64-bit integers beyond 2^53 */
    bool spacing_made[3]; /* neither file nor options give a spacing along the axis: it is 1 */
} VolImported;

/* Picks component and time step and converts.  Releases the image's bytes. */
VolStatus vol_import_convert(VolSampled *image, const char *name, const VolImportOptions *options,
                             VolImported *out, VolError *err);
void vol_imported_free(VolImported *imported);

/* Writes the voxels as a dense box. */
VolStatus vol_import_write(const VolImported *imported, const char *grid_name, const VolVdbMetaList *grid_meta,
                           VolVdbWriter *writer, VolError *err);

/* "A.%d", 3, 5 -> A.3 A.4 A.5: the one printf conversion %d or %0Nd of a pattern.  VOL_USAGE on another. */
VolStatus vol_fill_slice_number(const char *pattern, int64_t number, char **out, VolError *err);

#endif
