#include "io/out_target.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/descriptor.h"

VolStatus vol_refuse_output_terminal(const char *name, VolError *err)
{
    return vol_fail(err, VOL_USAGE, "refusing to write '%s': it is a terminal; use -o FILE, a pipe or --force", name);
}

VolStatus vol_target_refuse_terminal(int fd, const char *name, VolOutOptions options, VolError *err)
{
    if (options.binary && !options.allow_terminal && isatty(fd))
        return vol_refuse_output_terminal(name, err);
    return VOL_OK;
}

/* ---- files ---- */

/* The folder of a path, allocated. */
static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    int length = slash == path ? 1 : (int)(slash - path);
    return slash ? vol_format_text("%.*s", length, path) : vol_copy_text(".");
}

static const char *name_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static VolStatus check_folder(const char *path, VolError *err)
{
    char *folder = folder_of(path);
    if (!folder)
        return vol_fail_memory(err, strlen(path));
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

/* What the link at `path` names, seen from here; NULL with errno where there is no link (EINVAL, ENOENT). */
static char *follow_once(const char *path)
{
    char text[4096];
    ssize_t length = readlink(path, text, sizeof text - 1);
    if (length < 0)
        return NULL;
    text[length] = 0;
    int before = text[0] == '/' ? 0 : (int)(name_of(path) - path);
    char *next = vol_format_text("%.*s%s", before, path, text);
    if (!next)
        errno = ENOMEM;
    return next;
}

/* realpath() for a file that need not be there yet. */
static char *follow(const char *path)
{
    enum { MOST = 40 }; /* as Linux has it */
    char *real = realpath(path, NULL), *at = real ? real : vol_copy_text(path);
    for (int links = 0; at && !real; links++) {
        char *next = follow_once(at);
        if (!next && errno != ENOMEM)
            break; /* not a link: here it will be */
        free(at);
        at = next;
        if (links == MOST) {
            free(at);
            errno = ELOOP;
            return NULL;
        }
    }
    if (!at)
        errno = ENOMEM;
    return at;
}

static VolStatus find_file(const char *path, VolTarget *out, VolError *err)
{
    struct stat info;
    bool there = stat(path, &info) == 0;
    if (there && S_ISDIR(info.st_mode))
        return vol_fail(err, VOL_IO, "cannot write '%s': %s", path, strerror(EISDIR));
    if (there && !S_ISREG(info.st_mode)) {
        out->direct = true;
        out->path = vol_copy_text(path);
        return out->path ? VOL_OK : vol_fail_memory(err, strlen(path));
    }
    out->path = follow(path);
    return out->path ? check_folder(out->path, err) : vol_fail_errno(err, errno, "cannot write", path);
}

/* ---- what users name ---- */

VolStatus vol_target_find(const char *path, VolOutOptions options, VolTarget *out, VolError *err)
{
    struct stat info;
    *out = (VolTarget){.fd = -1};
    if (!*path)
        return vol_fail(err, VOL_USAGE, "cannot write '': an output needs a name");
    if (!strcmp(path, "-"))
        out->fd = STDOUT_FILENO;
    else if (vol_descriptor_name(path, &out->fd) != strlen(path))
        out->fd = -1;
    if (out->fd < 0)
        return find_file(path, out, err);
    out->direct = true;
    const char *name = out->fd == STDOUT_FILENO ? "stdout" : path;
    if (fstat(out->fd, &info) != 0)
        return vol_fail_errno(err, errno, "cannot write", name);
    return vol_target_refuse_terminal(out->fd, name, options, err);
}

void vol_target_free(VolTarget *target)
{
    free(target->path);
    *target = (VolTarget){.fd = -1};
}

static bool look(const VolTarget *target, struct stat *info)
{
    return (target->fd >= 0 ? fstat(target->fd, info) : stat(target->path, info)) == 0;
}

/* Two entries of one name in one folder; links of two names are replaced one by one. */
static bool same_entry(const char *a, const char *b)
{
    struct stat info[2];
    char *folder[2] = {folder_of(a), folder_of(b)};
    bool same = folder[0] && folder[1] && !strcmp(name_of(a), name_of(b)) && stat(folder[0], &info[0]) == 0 &&
                stat(folder[1], &info[1]) == 0 && info[0].st_dev == info[1].st_dev && info[0].st_ino == info[1].st_ino;
    free(folder[0]);
    free(folder[1]);
    return same;
}

/* What goes into /dev/null or to a terminal may come from anywhere. */
static bool same_target(const VolTarget *a, const VolTarget *b)
{
    struct stat info[2];
    if (!a->direct && !b->direct)
        return same_entry(a->path, b->path);
    return look(a, &info[0]) && look(b, &info[1]) && !S_ISCHR(info[0].st_mode) && info[0].st_dev == info[1].st_dev &&
           info[0].st_ino == info[1].st_ino;
}

bool vol_same_output(const char *a, const char *b)
{
    VolTarget target[2];
    bool found = vol_target_find(a, (VolOutOptions){0}, &target[0], NULL) == VOL_OK;
    bool both = vol_target_find(b, (VolOutOptions){0}, &target[1], NULL) == VOL_OK && found;
    bool same = both && same_target(&target[0], &target[1]);
    vol_target_free(&target[0]);
    vol_target_free(&target[1]);
    return same;
}

VolStatus vol_check_output(const char *path, VolOutOptions options, VolError *err)
{
    VolTarget target;
    VolStatus status = vol_target_find(path, options, &target, err);
    vol_target_free(&target);
    return status;
}
