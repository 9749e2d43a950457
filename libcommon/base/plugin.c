#include "base/plugin.h"

#include <dlfcn.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/mem.h"
#include "base/pool.h"

#define MAX_PLUGINS 8

static struct {
    char name[32];
    const void *table;
} loaded[MAX_PLUGINS];
static size_t loaded_count;
static pthread_mutex_t loaded_lock = PTHREAD_MUTEX_INITIALIZER;

/* Folder of the running program, without the last slash; false where /proc does not tell. */
static bool program_folder(char *folder, size_t size)
{
    ssize_t length = readlink("/proc/self/exe", folder, size - 1);
    if (length <= 0 || (size_t)length >= size - 1)
        return false;
    folder[length] = 0;
    char *slash = strrchr(folder, '/');
    if (!slash)
        return false;
    *slash = 0;
    return true;
}

/* The file to load: the first that exists, else the first that was looked for (for the message).  Programs lie in bin/
 * beside lib/; test programs lie in tests/ and tests/tools/. */
static char *find(const char *name)
{
    const char *override = getenv("PELLUCID_ADAPTERS");
    if (override && *override)
        return vol_format_text("%s/pellucid-%s.so", override, name);
    char folder[4096];
    if (!program_folder(folder, sizeof folder))
        return vol_format_text("pellucid-%s.so", name);
    static const char *const places[] = {"../lib/pellucid", "../../lib/pellucid"};
    char *first = NULL;
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct stat info;
        char *path = vol_format_text("%s/%s/pellucid-%s.so", folder, places[i], name);
        if (!path || stat(path, &info) == 0) {
            free(first);
            return path;
        }
        if (first)
            free(path);
        else
            first = path;
    }
    return first;
}

static const char *volatile in_dlopen;

const char *vol_plugin_being_loaded(void) { return in_dlopen; }

/* Never unloaded: C++ libraries keep threads and destructors of their own. */
static void *open_library(const char *path, const char *name)
{
    in_dlopen = name;
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    in_dlopen = NULL;
    return library;
}

/* What glibc's loader says where it gets no memory. */
static bool tells_of_memory(const char *why)
{
    static const char *const words[] = {"allocate", "out of memory", "cannot create shared object descriptor",
                                        "failed to map segment", "cannot map"};
    bool found = false;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        found |= strstr(why, words[i]) != NULL;
    return found;
}

/* Behind OpenVDB and OpenImageIO stands log4cplus, which starts threads while it is loaded and ends the program where it
 * cannot. */
static VolStatus check_threads(const char *name, VolError *err)
{
    enum { THREADS_OF_LOG4CPLUS = 4 };
    if (strcmp(name, "vdb") && strcmp(name, "image"))
        return VOL_OK;
    VolStatus status = vol_threads_can_start(THREADS_OF_LOG4CPLUS, err);
    return status ? vol_fail_within(err, status, "cannot load adapter '%s'", name) : VOL_OK;
}

static VolStatus load(const char *name, const void **table, VolError *err)
{
    VolStatus status = check_threads(name, err);
    if (status)
        return status;
    char *path = find(name);
    if (!path)
        return vol_fail_memory(err, 0);
    void *library = open_library(path, name);
    if (!library) /* what it says for want of memory is not always that */
        library = open_library(path, name);
    free(path);
    if (!library) {
        const char *why = dlerror();
        return vol_fail(err, tells_of_memory(why) ? VOL_NOMEM : VOL_BAD_INPUT, "cannot load adapter '%s': %s", name, why);
    }
    char symbol[64];
    snprintf(symbol, sizeof symbol, "pellucid_%s_adapter", name);
    *table = dlsym(library, symbol);
    if (!*table)
        return vol_fail(err, VOL_BAD_INPUT, "cannot use adapter '%s': %s", name, dlerror());
    return VOL_OK;
}

static VolStatus load_once(const char *name, const void **table, VolError *err)
{
    for (size_t i = 0; i < loaded_count; i++)
        if (!strcmp(loaded[i].name, name)) {
            *table = loaded[i].table;
            return VOL_OK;
        }
    VolStatus status = load(name, table, err);
    if (status == VOL_OK && loaded_count < MAX_PLUGINS && strlen(name) < sizeof loaded->name) {
        memcpy(loaded[loaded_count].name, name, strlen(name) + 1);
        loaded[loaded_count++].table = *table;
    }
    return status;
}

VolStatus vol_plugin(const char *name, const void **table, VolError *err)
{
    pthread_mutex_lock(&loaded_lock);
    VolStatus status = load_once(name, table, err);
    pthread_mutex_unlock(&loaded_lock);
    return status;
}
