#include "base/cgroup.h"

#include <stdio.h>
#include <string.h>

bool vol_cgroup_read(const char *folder, const char *name, char *line, size_t size)
{
    char path[4352];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "re");
    if (!file)
        return false;
    bool read = fgets(line, (int)size, file) != NULL;
    fclose(file);
    return read;
}

/* A group and those above it, up to where the hierarchy is mounted. */
static void walk_up(const char *mount, const char *group, void (*visit)(void *user, const char *folder), void *user)
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

/* Whether the list, separated by commas, has this controller. */
static bool has_controller(const char *list, const char *controller)
{
    size_t length = strlen(controller);
    for (const char *at = list; at; at = strchr(at, ',')) {
        at += *at == ',';
        if (strncmp(at, controller, length) == 0 && (at[length] == 0 || at[length] == ','))
            return true;
    }
    return false;
}

void vol_cgroup_walk(const char *controller, void (*visit)(void *user, const char *folder), void *user)
{
    FILE *file = fopen("/proc/self/cgroup", "re");
    char line[4096], mount[64];
    if (!file)
        return;
    snprintf(mount, sizeof mount, "/sys/fs/cgroup/%s", controller);
    while (fgets(line, sizeof line, file)) { /* "4:cpu,cpuacct:/group", of version 2 "0::/group" */
        line[strcspn(line, "\n")] = 0;
        char *controllers = strchr(line, ':');
        char *group = controllers ? strchr(controllers + 1, ':') : NULL;
        if (!group)
            continue;
        *group++ = 0;
        controllers++;
        if (!*controllers)
            walk_up("/sys/fs/cgroup", group, visit, user);
        else if (has_controller(controllers, controller))
            walk_up(mount, group, visit, user);
    }
    fclose(file);
}
