/* The data elements of one DICOM file that say what and where its pixels are; internal to the folder. */
#ifndef VOL_IMPORT_DICOM_H
#define VOL_IMPORT_DICOM_H

#include "import/readers.h"

typedef struct DicomSlice {
    const char *name;
    char series[80], number[16], description[80]; /* trimmed */
    uint32_t rows, columns, frames;               /* rows 0: no image */
    uint32_t bits_allocated, bits_stored, high_bit, samples;
    bool is_signed, big_endian;
    double spacing[2];     /* between rows, between columns */
    double thickness, between;
    double position[3], orientation[6];
    bool has_position;
    int64_t instance;
    double slope, intercept;
    const unsigned char *pixels; /* within the file's bytes */
    size_t pixel_bytes;
    double depth;          /* for sorting */
} DicomSlice;

/* Checks that the pixels are uncompressed, grey, of a known size, and all there. */
VolStatus vol_dicom_parse(const VolBytes *bytes, const char *name, DicomSlice *out, VolError *err);

#endif
