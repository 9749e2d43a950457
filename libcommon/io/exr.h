/* EXR images in memory, read and written with OpenEXRCore alone (scan lines and tiles, single and multi-part, float, half
 * and uint channels, data windows, any compression the library has; deep parts are refused by name).
 * EXR cannot be streamed, so both directions work on a memory buffer: pipes and files give the same bytes. */
#ifndef VOL_IO_EXR_H
#define VOL_IO_EXR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/mem.h"
#include "base/status.h"

typedef struct VolBox2 {
    int32_t x0, y0, x1, y1; /* inclusive */
} VolBox2;

static inline size_t vol_box2_width(VolBox2 b) { return (size_t)((int64_t)b.x1 - b.x0 + 1); }
static inline size_t vol_box2_height(VolBox2 b) { return (size_t)((int64_t)b.y1 - b.y0 + 1); }

typedef enum VolPixel { VOL_PIXEL_FLOAT, VOL_PIXEL_HALF, VOL_PIXEL_UINT } VolPixel;

typedef struct VolChannel {
    char *name;     /* "R", "normal.X", ... */
    VolPixel store; /* how the file holds it */
    float *data;    /* width x height of the part's data window, row 0 on top; uint: converted, exact below 2^24 */
    uint32_t *whole; /* uint that was read: as it is; else NULL.  Written in place of `data` */
} VolChannel;

static inline double vol_channel_value(const VolChannel *channel, size_t i)
{
    return channel->whole ? (double)channel->whole[i] : (double)channel->data[i];
}

typedef enum VolAttrType { VOL_ATTR_TEXT, VOL_ATTR_INT, VOL_ATTR_FLOAT, VOL_ATTR_DOUBLE, VOL_ATTR_V3F, VOL_ATTR_M44F,
                           VOL_ATTR_CHROMATICITIES, VOL_ATTR_OTHER } VolAttrType;

typedef struct VolAttr {
    char *name;
    VolAttrType type;
    char *text;        /* TEXT */
    double number[16]; /* the others, in order */
} VolAttr;

typedef struct VolPart {
    char *name; /* may be NULL in a single-part file */
    VolBox2 data_window, display_window;
    double pixel_aspect, screen_width, screen_center[2];
    VolChannel *channels; /* sorted by name, as the file has them */
    size_t channel_count;
    VolAttr *attrs; /* everything but the standard required ones */
    size_t attr_count;
} VolPart;

typedef struct VolImage {
    VolPart *parts;
    size_t part_count;
} VolImage;

typedef enum VolExrCompression { VOL_EXR_NONE, VOL_EXR_ZIPS, VOL_EXR_ZIP, VOL_EXR_PIZ } VolExrCompression;

/* Damage: VOL_BAD_INPUT, naming part and byte or line.  Sizes are checked against the bytes before memory is taken. */
VolStatus vol_exr_read(const VolBytes *bytes, const char *name, VolImage *out, VolError *err);

/* Header only: `data` of the channels is NULL. */
VolStatus vol_exr_read_header(const VolBytes *bytes, const char *name, VolImage *out, VolError *err);

/* HALF channels are clamped to +-65504; the number of clamped values is added to *clamped (may be NULL).  The bytes do not
 * depend on `threads`. */
VolStatus vol_exr_write(const VolImage *image, VolExrCompression compression, int threads, VolBytes *out,
                        uint64_t *clamped, VolError *err);

void vol_image_free(VolImage *image);

/* Building.  All return VOL_NOMEM on want of memory. */
VolStatus vol_image_add_part(VolImage *image, const char *name, VolBox2 data, VolBox2 display, VolPart **out,
                             VolError *err);
VolStatus vol_part_add_channel(VolPart *part, const char *name, VolPixel store, VolChannel **out,
                               VolError *err); /* zeroed; keeps the order sorted: pointers to other channels die */
VolChannel *vol_part_channel(const VolPart *part, const char *name); /* NULL: none */
const VolAttr *vol_part_attr(const VolPart *part, const char *name);
size_t vol_attr_numbers(VolAttrType type); /* how many of number[] count: 1, 3, 8, 16; 0 for TEXT and OTHER */
VolStatus vol_part_set_text(VolPart *part, const char *name, const char *text, VolError *err);
VolStatus vol_part_set_numbers(VolPart *part, const char *name, VolAttrType type, const double *numbers, VolError *err);

#endif
