/* What the files of EXR share: a library context that works on memory, keeps its last message for us instead of
 * printing it, and hands out zeroed memory (so that a damaged chunk can never show us somebody else's bytes). */
#ifndef VOL_IO_EXR_PRIVATE_H
#define VOL_IO_EXR_PRIVATE_H

#include <openexr.h>

#include "io/exr.h"

typedef struct VolExrStream {
    const unsigned char *in; /* reading */
    size_t in_size;
    VolBytes out; /* writing: grows; holes left by seeks are zero until filled */
    size_t out_capacity;
} VolExrStream;

/* Reading where `in` is set, else writing. */
exr_context_initializer_t vol_exr_initializer(VolExrStream *stream);

/* Whether this thread ran out of memory within the library since vol_exr_initializer.  (Its decoders also return "out of
 * memory" for damaged data.) */
bool vol_exr_out_of_memory(void);

/* The library's last message on this thread in our grammar (lower case, one line, no full stop), or the code's standard
 * text. */
const char *vol_exr_why(exr_result_t code);
void vol_exr_forget_message(void);

/* Room in `out` for `size` bytes. */
bool vol_exr_reserve(VolExrStream *stream, size_t size);

/* What ZIP and ZIPS are packed with, by one thread. */
typedef struct VolExrZip {
    struct libdeflate_compressor *compressor;
    unsigned char *predicted, *packed;
} VolExrZip;

VolStatus vol_exr_zip_new(size_t values, VolExrZip *zip, VolError *err); /* for chunks of at most so many */
void vol_exr_zip_free(VolExrZip *zip);

/* Packs a chunk into zip->packed and returns how many bytes it takes; 0: not less than before. */
size_t vol_exr_zip(VolExrZip *zip, const void *bytes, size_t size);

/* Grows the list by one zeroed channel without pixels, at its place in the order. */
VolStatus vol_part_insert_channel(VolPart *part, const char *name, VolPixel store, VolChannel **out, VolError *err);

/* Grows the list by one attribute, or clears the one of that name. */
VolStatus vol_part_new_attr(VolPart *part, const char *name, VolAttrType type, VolAttr **out, VolError *err);

#endif
