/* What the header of a NRRD says; internal to the folder. */
#ifndef VOL_IMPORT_NRRD_H
#define VOL_IMPORT_NRRD_H

#include "import/readers.h"

enum { NRRD_AXES = 16, NRRD_SPACE = 8, NRRD_FIELDS = 32 };

typedef enum NrrdKind { NRRD_UNKNOWN, NRRD_SPATIAL, NRRD_COMPONENTS, NRRD_TIME } NrrdKind;

typedef enum NrrdEncoding {
    NRRD_NONE, NRRD_RAW, NRRD_TEXT, NRRD_HEX, NRRD_GZIP, NRRD_BZIP2
} NrrdEncoding;

/* A field with one entry per axis (or per axis of space). */
typedef struct NrrdReals {
    int count; /* 0: the field is not there */
    double at[NRRD_AXES];
} NrrdReals;

/* The files beside the header: one name, a list of them, or a pattern with numbers. */
typedef struct NrrdFiles {
    char **names;
    int64_t *skips; /* SKIPLIST: bytes for each; NULL: `byte_skip` for all */
    size_t count;
    bool several;   /* a list or a pattern, of whatever length */
    char *pattern;
    int64_t first, step;
    int axes;       /* of the array that each file holds; 0: not said */
} NrrdFiles;

typedef struct NrrdHeader {
    const char *name;
    int axes, space_axes; /* 0: not said */
    int sizes_count, kinds_count, centers_count, directions_count;
    int64_t sizes[NRRD_AXES];
    NrrdKind kinds[NRRD_AXES];
    bool node[NRRD_AXES];      /* else samples lie in the middle of cells */
    NrrdReals spacings, mins, maxs, origin;
    double directions[NRRD_AXES][NRRD_SPACE];
    bool has_direction[NRRD_AXES];
    bool type_given, endian_given, big_endian;
    VolSample type;
    NrrdEncoding encoding;
    int64_t line_skip, byte_skip; /* byte_skip -1-N: the samples end N bytes before the data do */
    NrrdFiles files;
    int lines[NRRD_FIELDS];       /* that each field stands in, from 1; 0: in none */
} NrrdHeader;

/* Reads the fields; *at moves to the data that follow.  The header is freed by vol_nrrd_header_free, also on failure. */
VolStatus vol_nrrd_parse(NrrdHeader *h, const VolBytes *bytes, size_t *at, VolError *err);
void vol_nrrd_header_free(NrrdHeader *h);

#endif
