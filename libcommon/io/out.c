#define _GNU_SOURCE /* mkostemp */
#include "io/out.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- temporaries that exist now, for the signal handler ---- */

/* A program writes one or two files.  The handler unlinks what is LIVE: there, and under its final name. */
#define MAX_TEMPORARIES 4
enum { FREE, RESERVED, LIVE };

static struct {
    atomic_int state;
    char path[4096];
} temporaries[MAX_TEMPORARIES];

void vol_unlink_temporaries(void)
{
    for (int i = 0; i < MAX_TEMPORARIES; i++)
        if (atomic_load(&temporaries[i].state) == LIVE)
            unlink(temporaries[i].path);
}

static int reserve_slot(void)
{
    for (int i = 0; i < MAX_TEMPORARIES; i++) {
        int expected = FREE;
        if (atomic_compare_exchange_strong(&temporaries[i].state, &expected, RESERVED))
            return i;
    }
    return -1;
}

/* ---- where the output goes ---- */

typedef struct Target {
    bool direct; /* written to as it stands */
    int fd;      /* of a direct one; -1: to be opened */
    char *path;  /* of a file: symbolic links followed, so that the link stays; allocated */
} Target;

VolStatus vol_refuse_output_terminal(const char *name, VolError *err)
{
    return vol_fail(err, VOL_USAGE, "refusing to write '%s': it is a terminal; use -o FILE, a pipe or --force", name);
}

static VolStatus refuse_terminal(int fd, const char *name, VolOutOptions options, VolError *err)
{
    if (options.binary && !options.allow_terminal && isatty(fd))
        return vol_refuse_output_terminal(name, err);
    return VOL_OK;
}

static VolStatus check_folder(const char *path, VolError *err)
{
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) : 0;
    char *folder = !slash ? vol_copy_text(".") : vol_format_text("%.*s", length ? (int)length : 1, path);
    if (!folder)
        return vol_fail_memory(err, length);
    struct stat info;
    VolStatus status = VOL_OK;
    if (stat(folder, &info) != 0)
        status = vol_fail(err, VOL_IO, "cannot write '%s': its folder: %s", path, strerror(errno));
    else if (!S_ISDIR(info.st_mode))
        status = vol_fail(err, VOL_IO, "cannot write '%s': '%s' is not a folder", path, folder);
    else if (access(folder, W_OK) != 0)
        status = vol_fail(err, VOL_IO, "cannot write '%s': its folder: %s", path, strerror(errno));
    free(folder);
    return status;
}

static VolStatus look_at(const char *path, VolOutOptions options, Target *target, VolError *err)
{
    *target = (Target){.fd = -1};
    if (!strcmp(path, "-") || !strcmp(path, "/dev/stdout")) {
        target->direct = true;
        target->fd = STDOUT_FILENO;
        return refuse_terminal(STDOUT_FILENO, "stdout", options, err);
    }
    if (!*path)
        return vol_fail(err, VOL_USAGE, "cannot write '': an output needs a name");
    struct stat info;
    bool there = stat(path, &info) == 0;
    if (there && S_ISDIR(info.st_mode))
        return vol_fail(err, VOL_IO, "cannot write '%s': %s", path, strerror(EISDIR));
    if (there && !S_ISREG(info.st_mode)) {
        target->direct = true;
        return VOL_OK;
    }
    target->path = there ? realpath(path, NULL) : vol_copy_text(path);
    if (!target->path)
        return there ? vol_fail_errno(err, errno, "cannot write", path) : vol_fail_memory(err, strlen(path));
    return check_folder(target->path, err);
}

VolStatus vol_check_output(const char *path, VolOutOptions options, VolError *err)
{
    Target target;
    VolStatus status = look_at(path, options, &target, err);
    free(target.path);
    return status;
}

/* ---- writing ---- */

static VolStatus write_all(int fd, const char *name, const unsigned char *data, size_t size, VolError *err)
{
    while (size) {
        size_t piece = size < (1u << 30) ? size : 1u << 30; /* Linux writes at most 2 GiB at once */
        ssize_t wrote = write(fd, data, piece);
        if (wrote < 0 && errno == EINTR)
            continue;
        if (wrote < 0)
            return vol_fail(err, VOL_IO, "cannot write '%s': %s", name, strerror(errno));
        data += wrote;
        size -= (size_t)wrote;
    }
    return VOL_OK;
}

static VolStatus write_direct(const char *path, int fd, const void *data, size_t size, VolOutOptions options,
                              VolError *err)
{
    if (fd >= 0)
        return write_all(fd, "stdout", data, size, err);
    fd = open(path, O_WRONLY | O_CLOEXEC | O_NOCTTY);
    if (fd < 0)
        return vol_fail_errno(err, errno, "cannot write", path);
    VolStatus status = refuse_terminal(fd, path, options, err);
    if (status == VOL_OK)
        status = write_all(fd, path, data, size, err);
    if (close(fd) != 0 && status == VOL_OK)
        status = vol_fail_errno(err, errno, "cannot write", path);
    return status;
}

/* The mode a new file would have got: umask can only be read by setting it, which is not safe in a program with threads,
 * so /proc is asked first. */
static mode_t default_mode(void)
{
    unsigned mask = 0;
    bool found = false;
    char line[128];
    FILE *file = fopen("/proc/self/status", "re");
    while (file && !found && fgets(line, sizeof line, file))
        found = sscanf(line, "Umask: %o", &mask) == 1;
    if (file)
        fclose(file);
    if (!found) {
        mask = umask(022);
        umask((mode_t)mask);
    }
    return 0666 & ~(mode_t)mask;
}

/* "/a/b.exr" -> "/a/.b.exr.vol-XXXXXX"; long names are cut to what a folder entry may be. */
static bool name_temporary(char *out, size_t size, const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *name = slash ? slash + 1 : path;
    int length = snprintf(out, size, "%.*s.%.200s.vol-XXXXXX", (int)(name - path), path, name);
    return length > 0 && (size_t)length < size;
}

/* Makes the file and declares it live, with no signal in between that would leave it behind. */
static int make_temporary(int slot)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    int fd = mkostemp(temporaries[slot].path, O_CLOEXEC), errnum = errno;
    if (fd >= 0)
        atomic_store(&temporaries[slot].state, LIVE);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = errnum;
    return fd;
}

static VolStatus fill_temporary(int fd, const char *path, const void *data, size_t size, VolError *err)
{
    VolStatus status = write_all(fd, path, data, size, err);
    if (status == VOL_OK && fchmod(fd, default_mode()) != 0)
        status = vol_fail_errno(err, errno, "cannot write", path);
    if (close(fd) != 0 && status == VOL_OK) /* network file systems report a full disk here */
        status = vol_fail_errno(err, errno, "cannot write", path);
    return status;
}

/* An output that is there goes with exit code 0: from here on no signal ends the program. */
static bool put_in_place(const char *temporary, const char *path)
{
    sigset_t all, before;
    sigfillset(&all);
    sigdelset(&all, SIGPIPE); /* comes of writing elsewhere alone */
    pthread_sigmask(SIG_BLOCK, &all, &before);
    if (rename(temporary, path) == 0)
        return true;
    int errnum = errno;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = errnum;
    return false;
}

static VolStatus write_file(const Target *target, const char *path, const void *data, size_t size, VolError *err)
{
    int slot = reserve_slot();
    if (slot < 0)
        return vol_fail(err, VOL_IO, "cannot write '%s': too many files at once", path);
    char *temporary = temporaries[slot].path;
    VolStatus status = VOL_OK;
    if (!name_temporary(temporary, sizeof temporaries->path, target->path)) {
        atomic_store(&temporaries[slot].state, FREE);
        return vol_fail(err, VOL_IO, "cannot write '%s': %s", path, strerror(ENAMETOOLONG));
    }
    int fd = make_temporary(slot);
    if (fd < 0) {
        status = vol_fail_errno(err, errno, "cannot write", path);
    } else {
        status = fill_temporary(fd, path, data, size, err);
        if (status == VOL_OK && !put_in_place(temporary, target->path))
            status = vol_fail_errno(err, errno, "cannot write", path);
        if (status != VOL_OK)
            unlink(temporary);
    }
    atomic_store(&temporaries[slot].state, FREE);
    return status;
}

VolStatus vol_write_whole(const char *path, const void *data, size_t size, VolOutOptions options, VolError *err)
{
    Target target;
    VolStatus status = look_at(path, options, &target, err);
    if (status == VOL_OK)
        status = target.direct ? write_direct(path, target.fd, data, size, options, err)
                               : write_file(&target, path, data, size, err);
    free(target.path);
    return status;
}
