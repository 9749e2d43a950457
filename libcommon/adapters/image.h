/* What the adapter to OpenImageIO offers (`pellucid_image_adapter` in pellucid-image.so). */
#ifndef VOL_ADAPTERS_IMAGE_H
#define VOL_ADAPTERS_IMAGE_H

#include <stddef.h>

#define VOL_IMAGE_ADAPTER_VERSION 2

typedef struct VolImageAdapterPixels {
    int width, height, channels;
    float *data; /* interleaved, row 0 on top; from malloc */
    float scale; /* the value that stands for 1: 255, 65535, ..; 1 for floating point.  `data` is not divided by it. */
    int alpha;   /* index of the alpha channel, or -1 */
    int encoded; /* 1: colours are sRGB-encoded; 0: linear, or not known to be anything else */
    int unassociated; /* 1: colours are not multiplied by alpha */
} VolImageAdapterPixels;

typedef struct VolImageAdapter {
    int version;
    /* 0: done; 1: bad input (`why` says); 2: out of memory.  `format` is OpenImageIO's name. */
    int (*read)(const void *bytes, size_t size, const char *format, VolImageAdapterPixels *out, char *why,
                size_t why_size);
    /* 8-bit sRGB; *out is from malloc. */
    int (*encode_png)(const unsigned char *rgb, int width, int height, unsigned char **out, size_t *out_size, char *why,
                      size_t why_size);
} VolImageAdapter;

#endif
