/* Inputs are read into memory of our own and never mapped: a mapping, private or not, shows what others write to the file,
 * so that what has been checked might no longer be what is used, and raises SIGBUS where the file is cut. */
#include "io/in.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"

const char *vol_input_name(const char *path) { return strcmp(path, "-") ? path : "stdin"; }

/* How much of a regular file is left to read; 0: not known. */
static size_t size_left(int fd, const struct stat *info)
{
    off_t at = S_ISREG(info->st_mode) ? lseek(fd, 0, SEEK_CUR) : -1;
    return at >= 0 && info->st_size > at ? (size_t)(info->st_size - at) : 0;
}

/* One read(2) into the room behind out->size; *got is 0 at the end. */
static VolStatus read_piece(int fd, const char *name, VolBytes *out, size_t capacity, size_t *got, VolError *err)
{
    enum { MOST = 1 << 30 }; /* Linux reads less than 2 GiB at once */
    size_t room = capacity - out->size;
    ssize_t n;
    do
        n = read(fd, out->data + out->size, room < MOST ? room : MOST);
    while (n < 0 && errno == EINTR);
    *got = n > 0 ? (size_t)n : 0;
    out->size += *got;
    return n < 0 ? vol_fail_errno(err, errno, "cannot read", name) : VOL_OK;
}

/* The block becomes `capacity` bytes large. */
static VolStatus resize(VolBytes *out, size_t capacity, VolError *err)
{
    unsigned char *moved = vol_resize(out->data, capacity, 1);
    if (!moved)
        return vol_fail_memory(err, capacity);
    out->data = moved;
    return VOL_OK;
}

/* Of a file as much as it held at first, so that one that somebody adds to has an end. */
static VolStatus read_expected(int fd, const char *name, size_t expected, VolBytes *out, VolError *err)
{
    size_t got = 1;
    VolStatus status = expected > VOL_WORTH_A_CHECK ? vol_check_memory((double)expected, err) : VOL_OK;
    if (status)
        return vol_fail_within(err, status, "cannot read '%s'", name);
    status = resize(out, expected, err);
    while (!status && got && out->size < expected)
        status = read_piece(fd, name, out, expected, &got, err);
    if (!status && out->size < expected)
        status = vol_fail(err, VOL_IO, "cannot read '%s': it was cut to %zu bytes while it was read", name, out->size);
    return status;
}

static VolStatus read_to_end(int fd, const char *name, VolBytes *out, VolError *err)
{
    size_t capacity = 1 << 16, got = 1;
    VolStatus status = resize(out, capacity, err);
    while (!status && got) {
        if (out->size == capacity)
            status = resize(out, capacity *= 2, err);
        if (!status)
            status = read_piece(fd, name, out, capacity, &got, err);
    }
    return status ? status : resize(out, out->size, err);
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
    size_t left = size_left(fd, &info);
    VolStatus status = left ? read_expected(fd, name, left, out, err) : read_to_end(fd, name, out, err);
    if (status)
        vol_bytes_free(out);
    return status;
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
