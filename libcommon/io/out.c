#define _GNU_SOURCE /* mkostemp */
#include "io/out_target.h"

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

static VolStatus write_direct(const VolOutput *output, VolError *err)
{
    const char *name = output->name;
    if (output->target.fd >= 0)
        return write_all(output->target.fd, name, output->data, output->size, err);
    int fd = open(output->target.path, O_WRONLY | O_CLOEXEC | O_NOCTTY);
    if (fd < 0)
        return vol_fail_errno(err, errno, "cannot write", name);
    VolStatus status = vol_target_refuse_terminal(fd, name, output->options, err);
    if (status == VOL_OK)
        status = write_all(fd, name, output->data, output->size, err);
    if (close(fd) != 0 && status == VOL_OK)
        status = vol_fail_errno(err, errno, "cannot write", name);
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

/* As the file that it replaces, where there is one; its owner and group as far as we may. */
static bool set_mode(int fd, const char *path)
{
    struct stat info;
    if (stat(path, &info) != 0)
        return fchmod(fd, default_mode()) == 0;
    if (fchown(fd, (uid_t)-1, info.st_gid) == 0 && fchown(fd, info.st_uid, (gid_t)-1) != 0)
        errno = 0; /* only root may give files away */
    return fchmod(fd, info.st_mode & 0777) == 0;
}

static VolStatus fill_temporary(int fd, const VolOutput *output, const void *data, size_t size, VolError *err)
{
    VolStatus status = write_all(fd, output->name, data, size, err);
    if (status == VOL_OK && !set_mode(fd, output->target.path))
        status = vol_fail_errno(err, errno, "cannot write", output->name);
    if (close(fd) != 0 && status == VOL_OK) /* network file systems report a full disk here */
        status = vol_fail_errno(err, errno, "cannot write", output->name);
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

static void give_up_temporary(VolOutput *output, bool exists)
{
    if (exists)
        unlink(temporaries[output->temporary].path);
    atomic_store(&temporaries[output->temporary].state, FREE);
    output->temporary = -1;
}

static VolStatus prepare_file(VolOutput *output, const void *data, size_t size, VolError *err)
{
    output->temporary = reserve_slot();
    if (output->temporary < 0)
        return vol_fail(err, VOL_IO, "cannot write '%s': too many files at once", output->name);
    int errnum = ENAMETOOLONG, fd = -1;
    if (name_temporary(temporaries[output->temporary].path, sizeof temporaries->path, output->target.path)) {
        fd = make_temporary(output->temporary);
        errnum = errno;
    }
    if (fd < 0) {
        give_up_temporary(output, false);
        return vol_fail_errno(err, errnum, "cannot write", output->name);
    }
    return fill_temporary(fd, output, data, size, err);
}

VolStatus vol_output_prepare(VolOutput *output, const char *path, const void *data, size_t size, VolOutOptions options,
                             VolError *err)
{
    *output = (VolOutput){.options = options, .data = data, .size = size, .temporary = -1};
    VolStatus status = vol_target_find(path, options, &output->target, err);
    if (status) {
        vol_output_free(output);
        return status;
    }
    output->name = vol_copy_text(output->target.fd == STDOUT_FILENO ? "stdout" : path);
    if (!output->name)
        status = vol_fail_memory(err, strlen(path));
    else if (!output->target.direct)
        status = prepare_file(output, data, size, err);
    if (status)
        vol_output_free(output);
    return status;
}

VolStatus vol_output_commit(VolOutput *output, VolError *err)
{
    if (output->target.direct)
        return write_direct(output, err);
    if (!put_in_place(temporaries[output->temporary].path, output->target.path))
        return vol_fail_errno(err, errno, "cannot write", output->name);
    give_up_temporary(output, false);
    return VOL_OK;
}

void vol_output_free(VolOutput *output)
{
    if (output->temporary >= 0)
        give_up_temporary(output, true);
    vol_target_free(&output->target);
    free(output->name);
    *output = (VolOutput){.temporary = -1};
}

VolStatus vol_write_whole(const char *path, const void *data, size_t size, VolOutOptions options, VolError *err)
{
    VolOutput output;
    VolStatus status = vol_output_prepare(&output, path, data, size, options, err);
    if (status)
        return status;
    status = vol_output_commit(&output, err);
    vol_output_free(&output);
    return status;
}
