/* What the DICOM files (dicom_file.c, dicom_check.c) and the stack of their slices (dicom_stack.c, dicom.c) know of
 * each other; internal to the folder. */
#ifndef VOL_IMPORT_DICOM_H
#define VOL_IMPORT_DICOM_H

#include "import/readers.h"

/* Where an image lies and how its samples are scaled: said once for a file, or frame by frame. */
typedef struct DicomPlace {
    double spacing[2]; /* between rows, between columns */
    double thickness, between;
    double position[3], orientation[6];
    bool has_position;
    double slope, intercept;
    char stack[20];        /* Stack ID, "" where there is none */
    int64_t time;          /* Temporal Position Index or Identifier */
    uint32_t dimension[6]; /* the first of the Dimension Index Values, 0 beyond them */
} DicomPlace;

typedef enum DicomSample { DICOM_INTEGER, DICOM_FLOAT, DICOM_DOUBLE } DicomSample;

/* Modality LUT, as the file has it. */
typedef struct DicomLut {
    bool there, described;
    uint16_t entries, first, bits; /* 0 entries are 65536 */
    bool is_signed, big, swapped;  /* the first value; words; bytes, two of them in a big-endian word */
    const unsigned char *data;     /* within the file's bytes */
    size_t size;
} DicomLut;

typedef struct DicomFile {
    const char *name;
    char series[80], number[16], description[80]; /* trimmed */
    char syntax[80], photometric[20];
    char kind[80]; /* SOP Class UID */
    uint32_t rows, columns, frames;
    uint32_t bits_allocated, bits_stored, high_bit, samples;
    DicomSample sample;
    bool is_signed, big_endian;
    bool swapped;        /* 8 bits each, two of them in a big-endian word */
    bool encapsulated, mosaic, cine, real_world;
    const char *varies;  /* what else than the slice differs from frame to frame; NULL: nothing */
    int64_t instance;
    bool has_instance;
    uint32_t private_block; /* of Siemens' elements in group 19; 0: none */
    DicomPlace common;
    DicomLut lut;        /* goes before slope and intercept */
    DicomPlace *each;    /* of every frame, owned; NULL: `common` holds for all */
    size_t each_count;
    bool frames_placed;  /* positions are those of frames, not of the first one, */
    bool groups_placed;  /* and come from functional groups */
    double *offsets;     /* of the frames along the normal (RT Dose), owned */
    size_t offset_count;
    const unsigned char *pixels; /* within the file's bytes; NULL: no image */
    size_t pixel_bytes;
} DicomFile;

/* Where the groups of elements begin: behind a preamble and a mark, or at once.  False: the bytes are no DICOM. */
bool vol_dicom_start(const VolBytes *bytes, size_t *start);

/* Unpacks what follows the first group where that group says that it is deflated. */
VolStatus vol_dicom_unpack(VolBytes *bytes, const char *name, VolError *err);

/* Reads the data elements as far as the pixels; of bytes that are unpacked. */
VolStatus vol_dicom_parse(const VolBytes *bytes, const char *name, DicomFile *out, VolError *err);
void vol_dicom_free(DicomFile *file);

/* Whether the pixels are uncompressed, grey, of a known size, all there, and slices. */
VolStatus vol_dicom_check(const DicomFile *file, VolError *err);

/* Whether the table can be applied; the value that it gives to a stored one. */
VolStatus vol_dicom_check_lut(const DicomFile *f, VolError *err);
double vol_dicom_mapped(const DicomFile *f, double stored);

typedef struct DicomSlice {
    const DicomFile *file;
    const DicomPlace *place;
    uint32_t frame;
    double depth; /* along the normal, or the number in the series */
    int64_t slot; /* which voxel along k */
} DicomSlice;

typedef struct DicomStack {
    DicomSlice *slices;  /* time by time, in order of depth */
    size_t count, times; /* `count` slices at each time */
    bool placed;         /* by positions */
    int64_t slots;       /* voxels along k, missing slices included */
} DicomStack;

/* Puts the slices in order and finds what is missing; `stack->count` are all of them at first. */
VolStatus vol_dicom_order(DicomStack *stack, const VolSource *source, VolError *err);
void vol_dicom_affine(const DicomStack *stack, const VolLog *log, VolAffine *out);

#endif
