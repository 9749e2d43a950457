/* What the adapter to Blosc offers (`pellucid_blosc_adapter` in pellucid-blosc.so): reading does without OpenVDB, whose
 * libraries take longer to load than many a volume. */
#ifndef VOL_ADAPTERS_BLOSC_H
#define VOL_ADAPTERS_BLOSC_H

#include <stddef.h>

typedef enum VolBloscResult { VOL_BLOSC_DONE, VOL_BLOSC_DAMAGED, VOL_BLOSC_NO_MEMORY } VolBloscResult;

typedef struct VolBloscAdapter {
    const char *version; /* "Blosc 1.21.3" */
    /* Done only where the block is sound and holds exactly `to_size` bytes.  Safe to call from several threads at once. */
    VolBloscResult (*decompress)(const void *from, size_t size, void *to, size_t to_size);
} VolBloscAdapter;

#endif
