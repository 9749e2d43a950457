/* What the adapter to VTK offers (`pellucid_vtk_adapter` in pellucid-vtk.so). */
#ifndef VOL_ADAPTERS_VTK_H
#define VOL_ADAPTERS_VTK_H

#include <stddef.h>

#define VOL_VTK_ADAPTER_VERSION 1

/* An image's geometry and one of its arrays, x fastest, components interleaved, in the machine's byte order. */
typedef struct VolVtkImage {
    long long dims[3];      /* of the samples: points, or cells where the array belongs to cells */
    double index_to_world[4][3]; /* rows, as VolAffine */
    const char *sample;     /* "u8", "i8", "u16", ... */
    long long components, times;
    void *data;             /* from malloc */
    size_t size;
} VolVtkImage;

typedef struct VolVtkAdapter {
    int version;
    const char *library; /* "VTK 9.1.0" */
    /* A .vti (xml != 0) or a legacy file of structured points, whole in memory.  `array` NULL: the active scalars,
     * else the only array.  0: done; 1: bad input (`why` says, and lists the arrays where one is missing); 2: out
     * of memory; 3: what VTK said when it read the file. */
    int (*read_image)(const void *bytes, size_t size, int xml, const char *array, long long time_step,
                      VolVtkImage *out, char *why, size_t why_size);
} VolVtkAdapter;

#endif
