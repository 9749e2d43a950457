#include "base/memory.h"

#include <inttypes.h>
#include <stdio.h>
#include <sys/resource.h>
#include <sys/sysinfo.h>

#include "base/cgroup.h"

static void lower(uint64_t *limit, uint64_t to)
{
    if (to < *limit)
        *limit = to;
}

static void heed_group(void *user, const char *folder)
{
    static const char *const files[] = {"memory.max", "memory.limit_in_bytes"}; /* version 2 ("max": none), version 1 */
    char line[64];
    uint64_t bytes;
    for (int i = 0; i < 2; i++)
        if (vol_cgroup_read(folder, files[i], line, sizeof line) && sscanf(line, "%" SCNu64, &bytes) == 1)
            lower(user, bytes);
}

uint64_t vol_memory_limit(void)
{
    uint64_t limit = UINT64_MAX;
    struct sysinfo info;
    struct rlimit address_space;
    if (sysinfo(&info) == 0)
        limit = ((uint64_t)info.totalram + info.totalswap) * info.mem_unit;
    vol_cgroup_walk("memory", heed_group, &limit);
    if (getrlimit(RLIMIT_AS, &address_space) == 0 && address_space.rlim_cur != RLIM_INFINITY)
        lower(&limit, address_space.rlim_cur);
    return limit;
}

VolStatus vol_memory_check(uint64_t bytes, const char *what, const char *advice, VolError *err)
{
    uint64_t limit = vol_memory_limit();
    if (bytes <= limit)
        return VOL_OK;
    return vol_fail(err, VOL_NOMEM, "%s takes %.3g GB of memory, there are %.3g GB: %s", what, (double)bytes / 1e9,
                    (double)limit / 1e9, advice);
}
