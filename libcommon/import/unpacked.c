/* The memory that unpacking takes. */
#include "base/memory.h"
#include "import/sampled.h"

VolStatus vol_append_unpacked(VolBytes *bytes, size_t *capacity, const void *data, size_t size, const char *name,
                              VolError *err)
{
    /* A few bytes may unpack to more than the machine has: look before every doubling. */
    if (size > *capacity - bytes->size && *capacity >= VOL_WORTH_A_CHECK) {
        VolStatus status = vol_check_memory((double)*capacity, err);
        if (status)
            return vol_fail_within(err, status, "cannot read '%s'", name);
    }
    return vol_bytes_append(bytes, capacity, data, size, err);
}
