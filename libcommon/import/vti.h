/* VTK's image files: what the elements of a .vti say, and the samples of one array of one piece.  Internal to the folder.
 *
 * Read here and not by VTK 9.1, whose readers take sizes, offsets and types on trust: what no piece gives is memory that
 * nobody wrote, an array of another type is read as the first piece's, and a segmentation fault ends the program where an
 * array of cells is too short.  Only LZ4 and LZMA are unpacked by VTK. */
#ifndef VOL_IMPORT_VTI_H
#define VOL_IMPORT_VTI_H

#include "import/vtk_words.h"
#include "import/readers.h"

typedef enum VtiPacking { VTI_PLAIN, VTI_ZLIB, VTI_LZ4, VTI_LZMA } VtiPacking;

typedef struct VtiArray {
    size_t piece;
    bool cells;
    char *name, *type, *steps; /* name and type "" where not given; steps NULL: of every time step */
    int64_t components;
    bool binary;               /* in the element: base64, else text */
    bool appended;             /* after the elements, at `offset` */
    int64_t offset;
    size_t begin;              /* the byte after the element's tag */
} VtiArray;

typedef struct VtiPiece {
    int64_t extent[6];
    bool placed;               /* the extent is six numbers */
    char *scalars[2];          /* names of the active scalars of points, of cells; NULL: none */
    size_t first_array;        /* its arrays begin here, and end before those of the next piece */
} VtiPiece;

typedef struct Vti {
    const VolBytes *bytes;
    const char *file;          /* its name, for messages */
    bool big_endian;
    size_t word;               /* bytes of the numbers before binary data: 4 or 8 */
    VtiPacking packing;
    VtiPiece whole;            /* its `scalars` are those of an image without pieces */
    double origin[3], spacing[3], direction[9];
    int64_t times;             /* 0: time is not spoken of */
    VtiPiece *pieces;
    size_t piece_count, piece_capacity;
    VtiArray *arrays;
    size_t array_count, array_capacity;
    bool has_appended, appended_raw;
    size_t appended;           /* the first byte that offset 0 means */
} Vti;

/* VOL_BAD_INPUT where the file is no image, cut short or not well-formed. */
VolStatus vol_vti_parse(const VolBytes *bytes, const char *file, Vti *out, VolError *err);
void vol_vti_free(Vti *vti);

/* Up to `max` whole numbers of 32 bits, or reals (`out` may be NULL), between white space; how many there were before
 * something else. */
int vol_vti_integers(const char *text, int64_t *out, int max);
int vol_vti_reals(const char *text, double *out, int max);

/* What a message calls the array: "array 's' (points) of piece 2 (extent 0 1 0 1 0 3)". */
const char *vol_vti_array_name(const Vti *vti, const VtiArray *array, char *text, size_t size);

/* Whether the samples are bits, eight in a byte; they become bytes. */
bool vol_vti_bits(const VtiArray *array);

/* Whether the file holds `count` samples of the array, without unpacking them: room for them can then be taken. */
VolStatus vol_vti_find(const Vti *vti, const VtiArray *array, VolSample type, uint64_t count, VolError *err);

/* Then the samples, in the byte order of the file. */
VolStatus vol_vti_get(const Vti *vti, const VtiArray *array, VolSample type, size_t count, unsigned char *out,
                      VolError *err);

/* One array, put together from the pieces. */
VolStatus vol_vti_image(const Vti *vti, const VolImportOptions *options, VolSampled *out, VolError *err);

#endif
