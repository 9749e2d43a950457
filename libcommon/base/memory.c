#include "base/memory.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/cgroup.h"

/* The sum of the lines "NAME: VALUE kB" or "NAME VALUE" of a file whose names are given; infinity where there are none. */
static double sum_of_lines(const char *path, const char *const *names)
{
    FILE *file = fopen(path, "re");
    char line[256], name[64];
    double sum = 0, value;
    bool found = false;
    while (file && fgets(line, sizeof line, file)) {
        if (sscanf(line, "%63[^: ]%*[: ]%lf", name, &value) != 2)
            continue;
        for (const char *const *wanted = names; *wanted; wanted++)
            if (!strcmp(*wanted, name)) {
                sum += value * (strstr(line, " kB") ? 1024 : 1);
                found = true;
            }
    }
    if (file)
        fclose(file);
    return found ? sum : INFINITY;
}

static double number_in(const char *folder, const char *name)
{
    char path[4352], line[64];
    double value;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return vol_read_line(path, line, sizeof line) && sscanf(line, "%lf", &value) == 1 ? value : INFINITY; /* "max" */
}

double vol_group_memory_left(const char *folder)
{
    static const char *const droppable[] = {"inactive_file", "active_file", NULL}; /* pages of files */
    double limit = number_in(folder, "memory.max"), used = number_in(folder, "memory.current");
    char path[4352];
    if (!isfinite(limit)) {
        limit = number_in(folder, "memory.limit_in_bytes");
        used = number_in(folder, "memory.usage_in_bytes");
    }
    if (!isfinite(limit) || !isfinite(used) || limit > 0x1p62)
        return INFINITY;
    snprintf(path, sizeof path, "%s/memory.stat", folder);
    double files = sum_of_lines(path, droppable);
    return fmax(0, limit - used + (isfinite(files) ? fmin(files, used) : 0));
}

static void look_at_group(void *user, const char *folder)
{
    double *left = user;
    *left = fmin(*left, vol_group_memory_left(folder));
}

/* What a limit leaves of it, where `taken` pages are. */
static double limit_left(int resource, double taken)
{
    struct rlimit limit;
    if (getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY)
        return INFINITY;
    return fmax(0, (double)limit.rlim_cur - taken * (double)sysconf(_SC_PAGESIZE));
}

/* Of the address space, and of what is written to in it (which statm counts with the stack). */
static double address_space_left(void)
{
    double all, data;
    char line[128];
    if (!vol_read_line("/proc/self/statm", line, sizeof line) ||
        sscanf(line, "%lf %*s %*s %*s %*s %lf", &all, &data) != 2)
        return INFINITY;
    return fmin(limit_left(RLIMIT_AS, all), limit_left(RLIMIT_DATA, data));
}

double vol_memory_available(void)
{
    static const char *const machine[] = {"MemAvailable", "SwapFree", NULL}, *const groups[] = {"memory", NULL};
    double left = fmin(sum_of_lines("/proc/meminfo", machine), address_space_left());
    vol_cgroup_folders(groups, look_at_group, &left);
    return left;
}

/* "3.4 GB" */
static void say_bytes(double bytes, char text[32])
{
    static const char *const units[] = {"kB", "MB", "GB", "TB", "PB", "EB"};
    size_t unit = 0;
    double value = bytes / 1000;
    while (value >= 999.5 && unit + 1 < sizeof units / sizeof *units) {
        value /= 1000;
        unit++;
    }
    snprintf(text, 32, "%.*f %s", value < 9.95 ? 1 : 0, value, units[unit]);
}

VolStatus vol_check_memory(double bytes, VolError *err)
{
    double left = vol_memory_available();
    char needed[32], available[32];
    if (bytes <= left)
        return VOL_OK;
    say_bytes(bytes, needed);
    say_bytes(left, available);
    return vol_fail(err, VOL_NOMEM, "about %s of memory are needed, %s are available", needed, available);
}
