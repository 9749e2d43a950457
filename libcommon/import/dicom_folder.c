/* A folder without DICOM images may be the one above them, as archives and CDs have it: patient, study, series. */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "import/dicom.h"

typedef struct Search {
    char *found[4]; /* folders that hold DICOM, by name */
    size_t count;   /* of all that were found */
    int entries;    /* that may still be looked at */
} Search;

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

/* Directories of media (DICOMDIR) are no images. */
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
        } else if (S_ISREG(info.st_mode) && !dicom && files < 16 && strcmp(list[i]->d_name, "DICOMDIR") != 0) {
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

VolStatus vol_fail_no_dicom(const char *path, VolError *err)
{
    Search search = {.entries = 20000};
    const size_t room = sizeof search.found / sizeof *search.found;
    char list[700] = "";
    size_t used = 0;
    search_folder(path, 8, &search);
    for (size_t i = 0; i < room; i++) {
        const char *found = search.found[i];
        int n = found ? snprintf(list + used, sizeof list - used, "%s'%s'", used ? ", " : "", found) : 0;
        used = used + (size_t)n < sizeof list ? used + (size_t)n : sizeof list - 1;
        free(search.found[i]);
    }
    if (search.count == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': there is no DICOM file with an image in the folder",
                        path);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': there is no DICOM file with an image in the folder itself, but in "
                    "sub-folders; give one of them: %s%s",
                    path, list, search.count > room ? ", ..." : "");
}
