/* What the adapter to VTK offers (`pellucid_vtk_adapter` in pellucid-vtk.so). */
#ifndef VOL_ADAPTERS_VTK_H
#define VOL_ADAPTERS_VTK_H

#include <stddef.h>

#define VOL_VTK_ADAPTER_VERSION 2

enum { VOL_VTK_DONE = 0, VOL_VTK_BAD = 1, VOL_VTK_NO_MEMORY = 2 };

typedef struct VolVtkAdapter {
    int version;
    const char *library; /* "VTK 9.1.0" */
    /* A block that was packed by VTK's LZ4 or (lzma != 0) LZMA compressor; sizes up to INT_MAX.  VOL_VTK_BAD: it does
     * not unpack to exactly `out_size` bytes. */
    int (*unpack)(int lzma, const void *in, size_t in_size, void *out, size_t out_size);
} VolVtkAdapter;

#endif
