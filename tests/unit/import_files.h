/* Tiny foreign files for the tests of the importers: a growing block of bytes, a folder of its own, and the import
 * of what was put there. */
#ifndef TESTS_UNIT_IMPORT_FILES_H
#define TESTS_UNIT_IMPORT_FILES_H

#include <stdlib.h>
#include <unistd.h>
#include <zlib.h>

#include "import/import.h"
#include "io/in.h"
#include "test.h"

static char folder[256];

typedef struct Block {
    unsigned char data[1 << 16];
    size_t size;
} Block;

__attribute__((unused)) static void put(Block *b, const void *data, size_t size)
{
    if (b->size + size > sizeof b->data)
        abort();
    memcpy(b->data + b->size, data, size);
    b->size += size;
}

__attribute__((unused)) static void put_text(Block *b, const char *text) { put(b, text, strlen(text)); }

/* As a gzip or a zlib stream. */
__attribute__((unused)) static void put_packed(Block *b, const void *data, size_t size, bool gzip)
{
    z_stream z = {0};
    if (deflateInit2(&z, 9, Z_DEFLATED, gzip ? 31 : 15, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        abort();
    z.next_in = (Bytef *)(uintptr_t)data;
    z.avail_in = (uInt)size;
    z.next_out = b->data + b->size;
    z.avail_out = (uInt)(sizeof b->data - b->size);
    if (deflate(&z, Z_FINISH) != Z_STREAM_END)
        abort();
    b->size += z.total_out;
    deflateEnd(&z);
}

/* The low `size` bytes of v in either order. */
__attribute__((unused)) static void put_int(Block *b, uint64_t v, int size, bool big)
{
    for (int i = 0; i < size; i++) {
        unsigned char c = (unsigned char)(v >> 8 * (big ? size - 1 - i : i));
        put(b, &c, 1);
    }
}

__attribute__((unused)) static void put_f32(Block *b, float v, bool big)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    put_int(b, bits, 4, big);
}

/* Overwrites at a place: for headers with fixed offsets. */
__attribute__((unused)) static void set_int(Block *b, size_t at, uint64_t v, int size, bool big)
{
    size_t end = b->size;
    b->size = at;
    put_int(b, v, size, big);
    b->size = end;
}

__attribute__((unused)) static void set_f32(Block *b, size_t at, float v, bool big)
{
    size_t end = b->size;
    b->size = at;
    put_f32(b, v, big);
    b->size = end;
}

static const char *path_of(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

__attribute__((unused)) static void save(const char *name, const void *data, size_t size)
{
    FILE *file = fopen(path_of(name), "wb");
    if (!file || fwrite(data, 1, size, file) != size || fclose(file))
        FAIL("cannot write %s", path_of(name));
}

__attribute__((unused)) static void save_block(const char *name, const Block *b) { save(name, b->data, b->size); }

/* What "cut" holds: not written to disk, since there are thousands of them. */
static const unsigned char *cut_data;
static size_t cut_size;

static VolStatus read_file(void *user, const char *path, VolBytes *out, VolError *err)
{
    (void)user;
    size_t capacity = 0;
    const char *slash = strrchr(path, '/');
    if (strcmp(slash ? slash + 1 : path, "cut") == 0) {
        *out = (VolBytes){0};
        return vol_bytes_append(out, &capacity, cut_data, cut_size, err);
    }
    return vol_read_whole(path, false, out, err);
}

static const VolImportOptions plain = {.component = VOL_COMPONENT_DEFAULT};

/* Imports files of the folder, given by their names. */
static VolStatus import_files(const char *const *names, size_t count, const VolImportOptions *options,
                              VolImported *out, VolError *err)
{
    static char paths[32][512];
    const char *list[32];
    for (size_t i = 0; i < count; i++) {
        snprintf(paths[i], sizeof paths[i], "%s", path_of(names[i]));
        list[i] = paths[i];
    }
    const VolImportFiles files = {read_file, NULL};
    VolSampled image = {0};
    *out = (VolImported){0};
    VolStatus status = vol_import_open(list, count, options, &files, NULL, &image, err);
    if (!status)
        status = vol_import_convert(&image, names[0], options, out, err);
    vol_sampled_free(&image);
    return status;
}

static VolStatus import_file(const char *name, const VolImportOptions *options, VolImported *out, VolError *err)
{
    return import_files(&name, 1, options, out, err);
}

/* Imports and compares; `affine` are 12 numbers by rows. */
__attribute__((unused)) static void check_import(const char *name, const VolImportOptions *options,
                                                 VolVdbStore store, const int32_t dims[3], const double *affine,
                                                 const double *values)
{
    VolImported got;
    VolError err = {""};
    if (import_file(name, options ? options : &plain, &got, &err)) {
        FAIL("%s: %s", name, err.text);
        return;
    }
    if (got.store != store)
        FAIL("%s: stored as %d, not %d", name, (int)got.store, (int)store);
    size_t voxels = 1;
    for (int a = 0; a < 3; a++) {
        if (got.dims[a] != dims[a])
            FAIL("%s: size %d along %d, not %d", name, got.dims[a], a, dims[a]);
        voxels *= (size_t)dims[a];
    }
    for (int n = 0; affine && n < 12; n++)
        if (!(fabs(got.index_to_world.m[n / 3][n % 3] - affine[n]) <= 1e-6))
            FAIL("%s: affine [%d][%d] is %.9g, not %.9g", name, n / 3, n % 3, got.index_to_world.m[n / 3][n % 3],
                 affine[n]);
    for (size_t n = 0; !test_failed_checks && n < voxels; n++) {
        double v = got.single ? (double)got.single[n] : got.twice[n];
        if (v != values[n])
            FAIL("%s: value %zu is %.9g, not %.9g", name, n, v, values[n]);
    }
    vol_imported_free(&got);
}

/* The import is refused as bad input with a message that holds `text`. */
__attribute__((unused)) static void check_refused(const char *name, const VolImportOptions *options,
                                                  const char *text)
{
    VolImported got;
    VolError err = {""};
    VolStatus status = import_file(name, options ? options : &plain, &got, &err);
    if (status != VOL_BAD_INPUT || !strstr(err.text, text))
        FAIL("%s: status %d, message '%s', wanted '%s'", name, (int)status, err.text, text);
    vol_imported_free(&got);
}

/* Every prefix of the file is refused.  (VOL_IO: a name of a data file that was cut names no file.) */
__attribute__((unused)) static void check_cuts(const char *name, const VolImportOptions *options, const Block *b,
                                               size_t until)
{
    for (size_t n = 0; n < until; n++) {
        VolImported got;
        VolError err = {""};
        cut_data = b->data;
        cut_size = n;
        VolStatus status = import_file("cut", options ? options : &plain, &got, &err);
        if (status != VOL_BAD_INPUT && status != VOL_IO)
            FAIL("%s cut to %zu of %zu bytes is not refused", name, n, b->size);
        vol_imported_free(&got);
    }
}

/* Bytes changed at random: whatever comes of it, nothing worse than a refusal (sanitizers watch), and what is
 * accepted has places that can be inverted. */
__attribute__((unused)) static void check_damage(const VolImportOptions *options, const Block *b, int rounds)
{
    static Block damaged;
    uint64_t state = 88172645463325252u;
    for (int round = 0; round < rounds; round++) {
        damaged = *b;
        for (int n = 0; n <= round % 4; n++) {
            state ^= state << 13, state ^= state >> 7, state ^= state << 17; /* Marsaglia's xorshift */
            damaged.data[state % b->size] = (unsigned char)(state >> 32);
        }
        cut_data = damaged.data;
        cut_size = damaged.size;
        VolImported got;
        VolAffine inverse;
        VolError err = {""};
        VolStatus status = import_file("cut", options ? options : &plain, &got, &err);
        if (status ? !err.text[0] : !vol_affine_invert(&got.index_to_world, &inverse))
            FAIL("round %d: status %d, message '%s'", round, (int)status, err.text);
        vol_imported_free(&got);
    }
}

static void make_folder(void)
{
    const char *parent = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/vol-import-XXXXXX", parent ? parent : "/tmp");
    if (!mkdtemp(folder))
        abort();
}

/* The tests make no folders within. */
static void remove_folder(void)
{
    char command[512];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command))
        printf("# could not remove %s\n", folder);
}

#endif
