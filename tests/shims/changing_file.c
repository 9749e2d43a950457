/* LD_PRELOAD: somebody else writes to the file CHANGING_FILE while the program reads it.  CHANGING_HOW:
 *   cut       to half its length, once its size has been asked for
 *   cut-late  to half, once it has been read or mapped
 *   scribble  0xff over its second half, once it has been read or mapped
 *   grow      by its own length, whenever it is read */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

static bool is_ours(int fd)
{
    struct stat a, b;
    const char *path = getenv("CHANGING_FILE");
    int (*next)(int, struct stat *);
    *(void **)&next = dlsym(RTLD_NEXT, "fstat");
    return path && next(fd, &a) == 0 && stat(path, &b) == 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

static void change(int fd, const char *moment)
{
    static bool done;
    const char *how = getenv("CHANGING_HOW");
    struct stat info;
    bool grow = how && !strcmp(how, "grow");
    if (!how || (done && !grow) || strcmp(moment, strcmp(how, "cut") ? "read" : "size") || !is_ours(fd))
        return;
    done = true;
    int out = open(getenv("CHANGING_FILE"), O_WRONLY);
    if (out < 0 || fstat(out, &info) != 0)
        abort();
    off_t half = info.st_size / 2;
    if (!strncmp(how, "cut", 3) && ftruncate(out, half) != 0)
        abort();
    for (off_t at = half; !strcmp(how, "scribble") && at < info.st_size; at++)
        if (pwrite(out, "\xff", 1, at) != 1)
            abort();
    if (grow && ftruncate(out, 2 * info.st_size) != 0)
        abort();
    close(out);
}

int fstat(int fd, struct stat *info)
{
    int (*next)(int, struct stat *);
    *(void **)&next = dlsym(RTLD_NEXT, "fstat");
    int result = next(fd, info);
    change(fd, "size");
    return result;
}

ssize_t read(int fd, void *to, size_t size)
{
    ssize_t (*next)(int, void *, size_t);
    *(void **)&next = dlsym(RTLD_NEXT, "read");
    ssize_t got = next(fd, to, size);
    change(fd, "read");
    return got;
}

void *mmap(void *place, size_t size, int protection, int flags, int fd, off_t offset)
{
    void *(*next)(void *, size_t, int, int, int, off_t);
    *(void **)&next = dlsym(RTLD_NEXT, "mmap");
    void *block = next(place, size, protection, flags, fd, offset);
    if (fd >= 0)
        change(fd, "read");
    return block;
}
