#include "io/in.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

const char *vol_input_name(const char *path) { return strcmp(path, "-") ? path : "stdin"; }

static VolStatus read_to_end(int fd, const char *name, VolBytes *out, VolError *err)
{
    enum { BLOCK = 1 << 16 };
    size_t capacity = 0;
    VolStatus status = VOL_OK;
    unsigned char *block = vol_alloc(BLOCK, 1);
    if (!block)
        return vol_fail_memory(err, BLOCK);
    while (status == VOL_OK) {
        ssize_t got = read(fd, block, BLOCK);
        if (got == 0)
            break;
        if (got > 0)
            status = vol_bytes_append(out, &capacity, block, (size_t)got, err);
        else if (errno != EINTR)
            status = vol_fail_errno(err, errno, "cannot read", name);
    }
    free(block);
    if (status == VOL_OK && !out->data) { /* empty: a valid block of no bytes */
        out->data = vol_alloc(0, 1);
        status = out->data ? VOL_OK : vol_fail_memory(err, 0);
    }
    if (status != VOL_OK)
        vol_bytes_free(out);
    return status;
}

/* Private, so that what we read stays what it was even if we write into it. */
static bool map_file(int fd, off_t size, VolBytes *out)
{
    void *data = mmap(NULL, (size_t)size, PROT_READ | PROT_WRITE, MAP_PRIVATE, fd, 0);
    if (data == MAP_FAILED)
        return false;
    *out = (VolBytes){.data = data, .size = (size_t)size, .mapped = true};
    return true;
}

VolStatus vol_refuse_input_terminal(const char *name, VolError *err)
{
    return vol_fail(err, VOL_USAGE, "refusing to read '%s': it is a terminal; name a file, use a pipe or --force", name);
}

static VolStatus read_open(int fd, const char *name, bool allow_terminal, VolBytes *out, VolError *err)
{
    struct stat info;
    if (fstat(fd, &info) != 0)
        return vol_fail_errno(err, errno, "cannot read", name);
    if (S_ISDIR(info.st_mode))
        return vol_fail(err, VOL_IO, "cannot read '%s': %s", name, strerror(EISDIR));
    if (!allow_terminal && S_ISCHR(info.st_mode) && isatty(fd))
        return vol_refuse_input_terminal(name, err);
    /* stdin may stand in the middle of a file; only a reading from its start may be a mapping. */
    if (S_ISREG(info.st_mode) && info.st_size > 0 && lseek(fd, 0, SEEK_CUR) == 0 && map_file(fd, info.st_size, out))
        return VOL_OK;
    return read_to_end(fd, name, out, err);
}

VolStatus vol_read_whole(const char *path, bool allow_terminal, VolBytes *out, VolError *err)
{
    *out = (VolBytes){0};
    bool standard = !strcmp(path, "-");
    int fd = standard ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return vol_fail_errno(err, errno, "cannot open", path);
    VolStatus status = read_open(fd, vol_input_name(path), allow_terminal, out, err);
    if (!standard)
        close(fd);
    return status;
}

VolKind vol_kind(const VolBytes *bytes)
{
    const unsigned char *p = bytes->data;
    size_t size = bytes->size;
    if (size == 0)
        return VOL_KIND_EMPTY;
    if (size >= 8 && !memcmp(p, " BDV\0\0\0\0", 8))
        return VOL_KIND_VDB;
    if (size >= 4 && !memcmp(p, "\x76\x2f\x31\x01", 4))
        return VOL_KIND_EXR;
    size_t i = size >= 3 && !memcmp(p, "\xef\xbb\xbf", 3) ? 3 : 0;
    while (i < size && (p[i] == ' ' || p[i] == '\t' || p[i] == '\n' || p[i] == '\r'))
        i++;
    return i < size && (p[i] == '{' || p[i] == '[') ? VOL_KIND_JSON : VOL_KIND_OTHER;
}
