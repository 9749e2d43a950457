/* The control groups that this process is in. */
#ifndef VOL_BASE_CGROUP_H
#define VOL_BASE_CGROUP_H

#include <stdbool.h>
#include <stddef.h>

/* Calls `visit` with the folder of our group, and of each above it, that has the limits of `controller` ("cpu", "memory"),
 * whether of version 1 or 2. */
void vol_cgroup_walk(const char *controller, void (*visit)(void *user, const char *folder), void *user);

/* First line of the file `name` in a folder; false where it cannot be read. */
bool vol_cgroup_read(const char *folder, const char *name, char *line, size_t size);

#endif
