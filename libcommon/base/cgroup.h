/* Control groups of this process, as the kernel shows them in files (versions 1 and 2). */
#ifndef VOL_BASE_CGROUP_H
#define VOL_BASE_CGROUP_H

#include <stdbool.h>
#include <stddef.h>

/* Calls visit with the folder of our group and those of all above it, up to the mount; `controllers`: its names in version 1
 * ("cpu", "cpu,cpuacct"), a NULL at their end; it is mounted under the first. */
void vol_cgroup_folders(const char *const *controllers, void (*visit)(void *user, const char *folder), void *user);

/* First line of a file; false where it cannot be read. */
bool vol_read_line(const char *path, char *line, size_t size);

#endif
