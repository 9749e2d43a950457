/* Files that are slices together: those that are named, or a folder's.
 *
 * A folder without DICOM images may be the one above them, as archives and CDs have it: patient, study, series. */
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#include "import/dicom.h"

typedef struct Search {
    char *found[4]; /* folders that hold DICOM, by name */
    size_t count;   /* of all that were found */
    int entries;    /* that may still be looked at */
} Search;

/* ---- Folders that hold DICOM ---- */

static bool holds_dicom(const char *path)
{
    unsigned char head[132];
    VolBytes bytes = {head, 0};
    FILE *file = fopen(path, "rb");
    if (file) {
        bytes.size = fread(head, 1, sizeof head, file);
        fclose(file);
    }
    return vol_is_dicom(&bytes);
}

static int not_hidden(const struct dirent *entry) { return entry->d_name[0] != '.'; }

enum { DEPTH = 8 };

/* Directories of media (DICOMDIR) are no images; the files of the outermost folder were looked at already. */
static void search_folder(const char *path, int depth, Search *search)
{
    struct dirent **list = NULL;
    int count = scandir(path, &list, not_hidden, alphasort), files = 0;
    bool dicom = false;
    for (int i = 0; i < count; i++) {
        char *name = search->entries > 0 ? vol_format_text("%s/%s", path, list[i]->d_name) : NULL;
        struct stat info;
        search->entries--;
        if (!name || stat(name, &info) != 0) {
            /* passed over */
        } else if (S_ISDIR(info.st_mode) && depth > 0) {
            search_folder(name, depth - 1, search);
        } else if (S_ISREG(info.st_mode) && depth < DEPTH && !dicom && files < 16 &&
                   strcmp(list[i]->d_name, "DICOMDIR") != 0) {
            files++;
            dicom = holds_dicom(name);
        }
        free(name);
        free(list[i]);
    }
    free(list);
    const size_t room = sizeof search->found / sizeof *search->found;
    if (dicom && search->count++ < room)
        search->found[search->count - 1] = vol_copy_text(path);
}

/* "cannot import" a folder without images, of which so many files are DICOM: names its sub-folders that hold DICOM. */
static VolStatus fail_no_images(const char *path, size_t files, VolError *err)
{
    Search search = {.entries = 20000};
    const size_t room = sizeof search.found / sizeof *search.found;
    char list[700] = "", why[100] = "there is no DICOM file with an image in the folder";
    size_t used = 0;
    search_folder(path, DEPTH, &search);
    for (size_t i = 0; i < room; i++) {
        const char *found = search.found[i];
        int n = found ? snprintf(list + used, sizeof list - used, "%s'%s'", used ? ", " : "", found) : 0;
        used = used + (size_t)n < sizeof list ? used + (size_t)n : sizeof list - 1;
        free(search.found[i]);
    }
    if (files)
        snprintf(why, sizeof why, "none of the %zu DICOM files in the folder holds pixels", files);
    if (search.count == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s", path, why);
    return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s%s: give one of them: %s%s", path, why,
                    files ? ", but those in sub-folders may" : " itself, but in sub-folders", list,
                    search.count > room ? ", ..." : "");
}

/* ---- Files that are no DICOM ---- */

/* A file of a folder that is passed over, unless it is a slice that was damaged. */
typedef struct Stray {
    const char *path, *what;
    bool blank;    /* no byte of it says anything */
    size_t behind; /* so many DICOM files come before it, by name */
} Stray;

static void look_at_stray(const VolBytes *bytes, Stray *stray)
{
    size_t n = 0;
    while (n < bytes->size && bytes->data[n] == 0)
        n++;
    stray->blank = n == bytes->size;
    stray->what = bytes->size == 0 ? "is empty" : stray->blank ? "holds only zeros" : "is not DICOM";
}

static const char *last_part(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* Behind the last dot; numbers are no ending. */
static const char *ending(const char *name)
{
    const char *dot = strrchr(name, '.');
    for (const char *c = dot ? dot : ""; *c; c++)
        if (isalpha((unsigned char)*c))
            return dot + 1;
    return "";
}

static bool counts(char c) { return (c >= '0' && c <= '9') || c == '.'; }

/* Whether the names of two files say that they belong together: by their ending, or because they differ only in
 * numbers. */
static bool named_alike(const char *a, const char *b)
{
    const char *s = last_part(a), *t = last_part(b);
    if (*ending(s) && strcasecmp(ending(s), ending(t)) == 0)
        return true;
    while (*s && *t) {
        if (counts(*s) && counts(*t)) {
            while (counts(*s))
                s++;
            while (counts(*t))
                t++;
        } else if (*s++ != *t++) {
            return false;
        }
    }
    return !*s && !*t;
}

/* Whoever copies a series expects that a slice that did not arrive is missed. */
static VolStatus judge_strays(const Stray *strays, size_t count, const char *const *names, size_t kept,
                              const VolSource *source, VolError *err)
{
    for (size_t i = 0; i < count; i++) {
        const Stray *s = &strays[i];
        const char *before = s->behind > 0 ? names[s->behind - 1] : NULL;
        const char *after = s->behind < kept ? names[s->behind] : NULL;
        const char *like = before && named_alike(s->path, before) ? before
                           : after && named_alike(s->path, after) ? after
                                                                  : NULL;
        const char *beside = before ? before : after;
        if (like)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import '%s': '%s' %s, but named as '%s', which is DICOM: replace it, or move it "
                            "elsewhere",
                            source->name, s->path, s->what, like);
        if (s->blank && beside && !*ending(last_part(s->path)) && !*ending(last_part(beside)))
            vol_warn(source->log, "passed over '%s': it %s", s->path, s->what);
        else
            vol_note(source->log, "passed over '%s': not DICOM", s->path);
    }
    return VOL_OK;
}

/* Several volumes are a mistake of the command line, a damaged slice is one of the file. */
static VolStatus refuse_operand(const char *path, const VolBytes *bytes, VolError *err)
{
    const char *format = vol_import_format(bytes);
    Stray stray;
    look_at_stray(bytes, &stray);
    if (format)
        return vol_fail(err, VOL_USAGE,
                        "'%s' is %s, not DICOM: several inputs are slices of a DICOM series, or raw slices with --dims and "
                        "--type",
                        path, format);
    if (vol_import_foreign(bytes, path).what)
        return vol_refuse_unread(bytes, path, err);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': it %s: several inputs are slices of a DICOM series, or raw slices with --dims and "
                    "--type",
                    path, stray.what);
}

/* ---- The files of a series ---- */

typedef struct Series {
    VolBytes *bytes; /* owned, as the lists are */
    const char **names;
    size_t kept;
    Stray *strays;
    size_t stray_count;
} Series;

static VolStatus read_files(const char *const *paths, size_t count, bool folder, const VolSource *source, Series *series,
                            VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; !status && i < count; i++) {
        VolBytes *bytes = &series->bytes[series->kept];
        status = source->files->read(source->files->user, paths[i], bytes, err);
        if (status)
            break;
        series->names[series->kept] = paths[i];
        if (vol_is_dicom(bytes)) {
            series->kept++;
            continue;
        }
        if (folder) {
            Stray *stray = &series->strays[series->stray_count++];
            *stray = (Stray){.path = paths[i], .behind = series->kept};
            look_at_stray(bytes, stray);
        } else {
            status = refuse_operand(paths[i], bytes, err);
        }
        vol_bytes_free(bytes);
    }
    return status;
}

static VolStatus read_series(const char *const *paths, size_t count, bool folder, const VolSource *source, VolSampled *out,
                             VolError *err)
{
    Series series = {.bytes = vol_alloc_zero(count, sizeof *series.bytes),
                     .names = vol_alloc_zero(count, sizeof *series.names),
                     .strays = vol_alloc_zero(count, sizeof *series.strays)};
    VolStatus status = VOL_OK;
    if (!series.bytes || !series.names || !series.strays)
        status = vol_fail_memory(err, count * sizeof *series.bytes);
    if (!status)
        status = read_files(paths, count, folder, source, &series, err);
    if (!status)
        status = judge_strays(series.strays, series.stray_count, series.names, series.kept, source, err);
    if (!status) {
        size_t images;
        status = vol_read_dicom(series.bytes, series.names, series.kept, source, out, &images, err);
        if (status == VOL_BAD_INPUT && folder && images == 0)
            status = fail_no_images(source->name, series.kept, err);
        series.kept = 0; /* taken over */
    }
    for (size_t i = 0; series.bytes && i < series.kept; i++)
        vol_bytes_free(&series.bytes[i]);
    free(series.bytes);
    free(series.names);
    free(series.strays);
    return status;
}

VolStatus vol_read_dicom_files(const char *const *paths, size_t count, const VolSource *source, VolSampled *out,
                               VolError *err)
{
    return read_series(paths, count, false, source, out, err);
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

/* The regular files of a folder, sorted by name, so that messages and ties do not depend on the file system. */
static VolStatus list_folder(const char *path, char ***out, size_t *count, VolError *err)
{
    DIR *folder = opendir(path);
    if (!folder)
        return vol_fail_errno(err, errno, "cannot open", path);
    VolStatus status = VOL_OK;
    char **names = NULL;
    size_t n = 0;
    for (struct dirent *entry; !status && (entry = readdir(folder));) {
        char *name = vol_format_text("%s/%s", path, entry->d_name);
        char **longer = name ? vol_resize(names, n + 1, sizeof *names) : NULL;
        struct stat info;
        if (!longer) {
            status = vol_fail_memory(err, (n + 1) * sizeof *names);
        } else {
            names = longer;
            if (entry->d_name[0] != '.' && stat(name, &info) == 0 && S_ISREG(info.st_mode)) {
                names[n++] = name;
                name = NULL;
            }
        }
        free(name);
    }
    closedir(folder);
    if (n)
        qsort(names, n, sizeof *names, by_name);
    *out = names;
    *count = n;
    return status;
}

VolStatus vol_read_dicom_folder(const char *path, const VolSource *source, VolSampled *out, VolError *err)
{
    char **names = NULL;
    size_t count = 0;
    VolStatus status = list_folder(path, &names, &count, err);
    if (!status)
        status = read_series((const char *const *)names, count, true, source, out, err);
    for (size_t i = 0; i < count; i++)
        free(names[i]);
    free(names);
    return status;
}
