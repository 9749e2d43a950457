#include "base/cgroup.h"

#include <stdio.h>
#include <string.h>

bool vol_read_line(const char *path, char *line, size_t size)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return false;
    bool read = fgets(line, (int)size, file) != NULL;
    fclose(file);
    return read;
}

static void visit_upwards(const char *mount, const char *group, void (*visit)(void *user, const char *folder), void *user)
{
    char folder[4200];
    snprintf(folder, sizeof folder, "%s%s", mount, group);
    for (;;) {
        visit(user, folder);
        char *slash = strrchr(folder, '/');
        if (!slash || (size_t)(slash - folder) < strlen(mount))
            return;
        *slash = 0;
    }
}

static bool named(const char *const *controllers, const char *name)
{
    while (*controllers && strcmp(*controllers, name))
        controllers++;
    return *controllers;
}

void vol_cgroup_folders(const char *const *controllers, void (*visit)(void *user, const char *folder), void *user)
{
    FILE *file = fopen("/proc/self/cgroup", "re");
    if (!file)
        return;
    char line[4096], mount[64];
    snprintf(mount, sizeof mount, "/sys/fs/cgroup/%s", controllers[0]);
    while (fgets(line, sizeof line, file)) { /* "4:memory:/group", in version 2 "0::/group" */
        line[strcspn(line, "\n")] = 0;
        char *names = strchr(line, ':');
        char *group = names ? strchr(names + 1, ':') : NULL;
        if (!group)
            continue;
        *group++ = 0;
        if (!*++names)
            visit_upwards("/sys/fs/cgroup", group, visit, user);
        else if (named(controllers, names))
            visit_upwards(mount, group, visit, user);
    }
    fclose(file);
}
