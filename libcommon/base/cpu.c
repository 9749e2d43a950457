#define _GNU_SOURCE /* CPU_COUNT_S */
#include "base/cpu.h"

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/cgroup.h"

static const char *const names[] = {"scalar", "avx2", "avx512", "neon"};

static bool machine_has(VolCpu cpu)
{
#if defined __x86_64__
    if (cpu == VOL_CPU_AVX2)
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (cpu == VOL_CPU_AVX512)
        return machine_has(VOL_CPU_AVX2) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
#elif defined __aarch64__
    if (cpu == VOL_CPU_NEON)
        return true;
#endif
    return cpu == VOL_CPU_SCALAR;
}

const char *vol_cpu_name(VolCpu cpu) { return names[cpu]; }

const char *vol_cpu_list(void)
{
    if (machine_has(VOL_CPU_AVX512))
        return "scalar,avx2,avx512";
    if (machine_has(VOL_CPU_AVX2))
        return "scalar,avx2";
    return machine_has(VOL_CPU_NEON) ? "scalar,neon" : "scalar";
}

static VolCpu best(void)
{
    static const VolCpu order[] = {VOL_CPU_AVX512, VOL_CPU_AVX2, VOL_CPU_NEON};
    for (size_t i = 0; i < sizeof order / sizeof *order; i++)
        if (machine_has(order[i]))
            return order[i];
    return VOL_CPU_SCALAR;
}

VolStatus vol_cpu_choose(const char *name, VolCpu *out, VolError *err)
{
    if (!strcmp(name, "auto")) {
        *out = best();
        return VOL_OK;
    }
    for (VolCpu cpu = VOL_CPU_SCALAR; cpu <= VOL_CPU_NEON; cpu++) {
        if (strcmp(name, names[cpu]))
            continue;
        if (!machine_has(cpu))
            return vol_fail(err, VOL_USAGE, "cannot use cpu level '%s': this machine has %s", name, vol_cpu_list());
        *out = cpu;
        return VOL_OK;
    }
    return vol_fail(err, VOL_USAGE, "unknown cpu level '%s': auto or one of %s", name, vol_cpu_list());
}

/* ---- threads ---- */

static int affinity_count(void)
{
    /* The kernel refuses (EINVAL) a mask smaller than its own: grow until it fits. */
    for (int cpus = 1024; cpus <= 1 << 20; cpus *= 2) {
        cpu_set_t *set = CPU_ALLOC((size_t)cpus);
        if (!set)
            break;
        size_t size = CPU_ALLOC_SIZE((size_t)cpus);
        int count = sched_getaffinity(0, size, set) == 0 ? CPU_COUNT_S(size, set) : -errno;
        CPU_FREE(set);
        if (count > 0)
            return count;
        if (count != -EINVAL)
            break;
    }
    long online = sysconf(_SC_NPROCESSORS_ONLN);
    return online > 0 && online < 1 << 20 ? (int)online : 1;
}

static int rounded_up(double quota, double period, int limit)
{
    if (!(quota > 0) || !(period > 0) || quota / period >= limit)
        return limit;
    int whole = (int)(quota / period);
    return whole < quota / period ? whole + 1 : whole;
}

static int quota_of_folder(const char *folder, int limit)
{
    char path[4352], line[128];
    double quota, period;
    snprintf(path, sizeof path, "%s/cpu.max", folder); /* version 2: "QUOTA PERIOD" or "max PERIOD" */
    if (vol_read_line(path, line, sizeof line) && sscanf(line, "%lf %lf", &quota, &period) == 2)
        return rounded_up(quota, period, limit);
    snprintf(path, sizeof path, "%s/cpu.cfs_quota_us", folder); /* version 1: -1 where there is no limit */
    if (!vol_read_line(path, line, sizeof line) || sscanf(line, "%lf", &quota) != 1)
        return limit;
    snprintf(path, sizeof path, "%s/cpu.cfs_period_us", folder);
    if (!vol_read_line(path, line, sizeof line) || sscanf(line, "%lf", &period) != 1)
        return limit;
    return rounded_up(quota, period, limit);
}

static void look_at_group(void *user, const char *folder)
{
    int *limit = user;
    *limit = quota_of_folder(folder, *limit);
}

int vol_thread_count(int wanted)
{
    static const char *const controllers[] = {"cpu", "cpu,cpuacct", NULL};
    if (wanted > 0)
        return wanted;
    int limit = affinity_count();
    vol_cgroup_folders(controllers, look_at_group, &limit);
    return limit;
}
