/* One reader per format, each from bytes to a VolSampled; internal to the folder. */
#ifndef VOL_IMPORT_READERS_H
#define VOL_IMPORT_READERS_H

#include "import/import.h"

typedef struct VolSource {
    const char *name; /* for messages, and for the folder that detached data lie in */
    VolBytes *bytes;  /* the reader takes them over when it keeps them, else the caller frees them */
    const VolImportOptions *options;
    const VolImportFiles *files;
    const VolLog *log;
} VolSource;

bool vol_is_nifti(const VolBytes *bytes);
VolStatus vol_read_nifti(const VolSource *source, VolSampled *out, VolError *err);

bool vol_is_nrrd(const VolBytes *bytes);
VolStatus vol_read_nrrd(const VolSource *source, VolSampled *out, VolError *err);

bool vol_is_metaimage(const VolBytes *bytes);
VolStatus vol_read_metaimage(const VolSource *source, VolSampled *out, VolError *err);

bool vol_is_mrc(const VolBytes *bytes);
VolStatus vol_read_mrc(const VolSource *source, VolSampled *out, VolError *err);

bool vol_is_inviwo_dat(const VolBytes *bytes);
VolStatus vol_read_inviwo_dat(const VolSource *source, VolSampled *out, VolError *err);

bool vol_is_vtk_xml(const VolBytes *bytes);
bool vol_is_vtk_legacy(const VolBytes *bytes);
/* What a VTK file holds where that is no image (".vtu (a VTK unstructured grid)"), else NULL. */
const char *vol_vtk_mesh(const VolBytes *bytes);
VolStatus vol_read_vtk_xml(const VolSource *source, VolSampled *out, VolError *err);
VolStatus vol_read_vtk_legacy(const VolSource *source, VolSampled *out, VolError *err);

/* What bytes of no format that is read seem to be ("it is an Exodus mesh (netCDF)"), by their name (NULL: none) where
 * nothing else tells; NULL: unknown. */
const char *vol_import_unread(const VolBytes *bytes, const char *name);

/* "cannot import" bytes of no format that is read. */
VolStatus vol_refuse_unread(const VolBytes *bytes, const char *name, VolError *err);

bool vol_is_dicom(const VolBytes *bytes);
/* Takes the bytes of all files over; `images` of them have pixels. */
VolStatus vol_read_dicom(VolBytes *bytes, const char *const *names, size_t count, const VolSource *source,
                         VolSampled *out, size_t *images, VolError *err);
/* Several files that are slices, or those of a folder, in which files of other kinds are passed over. */
VolStatus vol_read_dicom_files(const char *const *paths, size_t count, const VolSource *source, VolSampled *out,
                               VolError *err);
VolStatus vol_read_dicom_folder(const char *path, const VolSource *source, VolSampled *out, VolError *err);

/* Samples alone, in one file or one slice per file. */
VolStatus vol_read_raw(const VolSource *source, const char *const *names, size_t count, VolSampled *out,
                       VolError *err);

/* ---- Shared by the readers of text headers ---- */

/* The next line of a text header, its end (\n or \r\n) taken off, as allocated text; *at moves behind it.
 * NULL text: no further line (or no memory: then VOL_NOMEM). */
VolStatus vol_next_line(const VolBytes *bytes, size_t *at, char **line, VolError *err);
char *vol_trim(char *text);
/* Numbers separated by white space, commas or brackets; the count, or -1 if something else is between them or
 * there are more than max. */
int vol_scan_reals(const char *text, double *out, int max);

/* Whether `word` is one of the choices "this|that|the other". */
bool vol_one_of(const char *word, const char *choices);
/* The type among whose spellings ("short|int16", by VolSample; NULL: none) `word` is; false: none of them. */
bool vol_sample_spelt(const char *word, const char *const spellings[VOL_SAMPLE_F64 + 1], VolSample *out);

/* Reads the file `data_name` that lies beside `header_name` (or at its absolute path). */
VolStatus vol_read_beside(const VolSource *source, const char *data_name, VolBytes *out, VolError *err);

/* A file of samples alone that is packed (gzip, bzip2) is unpacked, unless its size is `wanted` already: then its first
 * bytes are samples that look like a mark. */
VolStatus vol_unpack_samples(VolBytes *bytes, uint64_t wanted, const char *name, VolError *err);

/* Reads files, each of which holds an equal share of the samples, one after the other; `skip` bytes of each are
 * passed over (-1: what comes before the last `share` bytes). */
VolStatus vol_read_slices(const VolSource *source, const char *const *names, size_t count, size_t share,
                          int64_t skip, bool beside, VolBytes *out, VolError *err);

#endif
