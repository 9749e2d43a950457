/* VDB files: what is written comes back, what is passed through stays as it was, what is damaged is named. */
#include <dirent.h>
#include <stdlib.h>

#include "tests/unit/vdb_help.h"

/* ---- helpers ---- */

static VolBytes load(const char *name)
{
    char path[4096];
    const char *tests = getenv("TESTS");
    snprintf(path, sizeof path, "%s/data/vdb/%s", tests ? tests : "tests", name);
    FILE *file = fopen(path, "rb");
    VolBytes bytes = {malloc(1 << 20), 0};
    if (file) {
        bytes.size = fread(bytes.data, 1, 1 << 20, file);
        fclose(file);
    }
    return bytes;
}

/* A small generator of repeatable numbers. */
static uint64_t random_state;
static uint32_t random_bits(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(random_state >> 33);
}

/* What a visit saw of a box of voxels, in doubles. */
typedef struct Seen {
    int32_t origin[3], dims[3];
    double *values; /* x fastest, 3 components */
    bool *active;
    VolVdbGridInfo info;
    int leaves, tiles, stop_after;
} Seen;

static Seen new_seen(const int32_t origin[3], const int32_t dims[3])
{
    size_t n = (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2];
    Seen seen = {{origin[0], origin[1], origin[2]}, {dims[0], dims[1], dims[2]}, calloc(n, 3 * sizeof(double)),
                 calloc(n, sizeof(bool)), {0}, 0, 0, -1};
    return seen;
}

static void free_seen(Seen *seen)
{
    free(seen->values);
    free(seen->active);
}

static size_t at(const Seen *seen, int32_t x, int32_t y, int32_t z)
{
    return ((size_t)(z - seen->origin[2]) * (size_t)seen->dims[1] + (size_t)(y - seen->origin[1])) *
               (size_t)seen->dims[0] + (size_t)(x - seen->origin[0]);
}

static bool inside(const Seen *seen, const int64_t p[3])
{
    for (int k = 0; k < 3; k++)
        if (p[k] < seen->origin[k] || p[k] >= (int64_t)seen->origin[k] + seen->dims[k])
            return false;
    return true;
}

static VolStatus see_begin(void *user, const VolVdbGridInfo *info, VolError *e)
{
    (void)e;
    Seen *seen = user;
    seen->info = *info;
    size_t n = (size_t)seen->dims[0] * (size_t)seen->dims[1] * (size_t)seen->dims[2];
    for (size_t i = 0; i < n; i++)
        memcpy(seen->values + 3 * i, info->background, 3 * sizeof(double));
    return VOL_OK;
}

static VolStatus see_leaf(void *user, const int32_t origin[3], const float *floats, const double *doubles,
                          const uint64_t active[8], VolError *e)
{
    Seen *seen = user;
    int components = vol_vdb_components(seen->info.value);
    if (seen->leaves++ == seen->stop_after)
        return vol_fail(e, VOL_NO, "seen enough");
    for (int n = 0; n < 512; n++) {
        int64_t p[3] = {origin[0] + n / 64, origin[1] + n / 8 % 8, origin[2] + n % 8};
        if (!inside(seen, p))
            continue;
        size_t i = at(seen, (int32_t)p[0], (int32_t)p[1], (int32_t)p[2]);
        seen->active[i] = active[n / 64] >> (n % 64) & 1;
        for (int c = 0; c < components; c++)
            seen->values[3 * i + (size_t)c] = floats ? (double)floats[n * components + c] : doubles[n * components + c];
    }
    return VOL_OK;
}

static VolStatus see_tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                          VolError *e)
{
    (void)e;
    Seen *seen = user;
    seen->tiles++;
    for (int32_t z = seen->origin[2]; z < seen->origin[2] + seen->dims[2]; z++)
        for (int32_t y = seen->origin[1]; y < seen->origin[1] + seen->dims[1]; y++)
            for (int32_t x = seen->origin[0]; x < seen->origin[0] + seen->dims[0]; x++) {
                if (x < origin[0] || x - size >= origin[0] || y < origin[1] || y - size >= origin[1] || z < origin[2] ||
                    z - size >= origin[2])
                    continue;
                memcpy(seen->values + 3 * at(seen, x, y, z), value, 3 * sizeof(double));
                seen->active[at(seen, x, y, z)] = active;
            }
    return VOL_OK;
}

static const VolVdbVisitor float_visitor = {see_begin, see_float, NULL, see_tile};
static const VolVdbVisitor double_visitor = {see_begin, NULL, see_double, see_tile};

/* Visits grid `index` over a box; frees nothing but what it made when the visit fails. */
static Seen see(const VolVdb *vdb, size_t index, const int32_t origin[3], const int32_t dims[3])
{
    Seen seen = new_seen(origin, dims);
    OK(vol_vdb_visit(vdb, index, &double_visitor, &seen, &err));
    return seen;
}

static VolStatus ignore_leaf(void *user, const int32_t origin[3], const float *values, const uint64_t active[8],
                             VolError *e)
{
    (void)origin, (void)e;
    float *sum = user;
    for (int n = 0; n < 512; n++) /* so that a sanitizer sees every value read */
        *sum += active[n / 64] >> (n % 64) & 1 ? values[n] : 0;
    return VOL_OK;
}

static const VolVdbVisitor ignoring = {NULL, ignore_leaf, NULL, NULL};

/* Opens, visits all grids and passes all on; the first failure's status. */
static VolStatus use_all(const VolBytes *bytes, size_t size)
{
    VolVdb *vdb = NULL;
    float sum = 0;
    VolStatus status = vol_vdb_open(copy_of(bytes, size), "test", &vdb, &err);
    if (status)
        return status;
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    for (size_t i = 0; i < vol_vdb_count(vdb) && !status; i++) {
        if (vol_vdb_components(vol_vdb_value(vol_vdb_entry(vdb, i))))
            status = vol_vdb_visit(vdb, i, &ignoring, &sum, &err);
        if (!status)
            status = vol_vdb_pass_grid(writer, vdb, i, &err);
    }
    vol_vdb_writer_free(writer);
    vol_vdb_close(vdb);
    return status;
}

/* ---- writing and reading back ---- */

static double sample(int i, int j, int k, int c, VolVdbStore store)
{
    int n = i * 7 + j * 31 + k * 101 + c * 13;
    if (store == VOL_STORE_INT32)
        return n * 1000 - 50000;
    if (store == VOL_STORE_DOUBLE)
        return n / 3.0;
    if (store == VOL_STORE_HALF)
        return (n % 512 - 200) / 16.0; /* exact in half */
    return (double)((float)n / 7.0f);
}

enum { NX = 13, NY = 10, NZ = 21 };
static const int32_t box_origin[3] = {-5, 3, -17}, box_dims[3] = {NX, NY, NZ};

static VolBytes write_dense(VolVdbStore store, VolVdbCompression compression, const VolAffine *transform)
{
    static double values[NX * NY * NZ * 3];
    int components = store == VOL_STORE_VEC3S ? 3 : 1;
    for (int k = 0; k < NZ; k++)
        for (int j = 0; j < NY; j++)
            for (int i = 0; i < NX; i++)
                for (int c = 0; c < components; c++)
                    values[((k * NY + j) * NX + i) * components + c] = sample(i, j, k, c, store);
    VolVdbWriter *writer = new_writer(compression);
    VolVdbNewGrid grid = {.name = "density", .store = store, .index_to_world = *transform, .background = {2, 3, 4}};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_dense_double(writer, box_origin, box_dims, values, &err));
    OK(vol_vdb_end_grid(writer, &err));
    return finish(writer);
}

static void check_dense(const VolBytes *bytes, VolVdbStore store, VolVdbValue value)
{
    VolVdb *vdb = open_copy(bytes);
    if (!vdb)
        return;
    CHECK(vol_vdb_value(vol_vdb_entry(vdb, 0)) == value);
    int32_t origin[3] = {-10, 0, -30}, dims[3] = {30, 20, 40};
    Seen seen = see(vdb, 0, origin, dims);
    CHECK(seen.info.value == value);
    CHECK(seen.info.active_voxels == NX * NY * NZ);
    for (int k = 0; k < 3; k++)
        CHECK(seen.info.box_min[k] == box_origin[k] && seen.info.box_max[k] == box_origin[k] + box_dims[k] - 1);
    int components = vol_vdb_components(value);
    for (int32_t z = -30; z < 10; z++)
        for (int32_t y = 0; y < 20; y++)
            for (int32_t x = -10; x < 20; x++) {
                int i = x + 5, j = y - 3, k = z + 17;
                bool in = i >= 0 && i < NX && j >= 0 && j < NY && k >= 0 && k < NZ;
                size_t n = at(&seen, x, y, z);
                CHECK(seen.active[n] == in);
                for (int c = 0; c < components; c++)
                    CHECK(seen.values[3 * n + (size_t)c] == (in ? sample(i, j, k, c, store) : 2.0 + c));
            }
    const VolVdbMetaList *meta = &vol_vdb_entry(vdb, 0)->meta;
    int32_t lo[3] = {0}, hi[3] = {0};
    CHECK(vol_meta_find(meta, "vol:domain") && vol_meta_find(meta, "vol:domainMin") && vol_meta_find(meta, "vol:domainMax"));
    if (vol_meta_find(meta, "vol:domainMin")) {
        CHECK(vol_meta_vec3i(vol_meta_find(meta, "vol:domainMin"), lo));
        CHECK(vol_meta_vec3i(vol_meta_find(meta, "vol:domainMax"), hi));
        CHECK(lo[0] == -5 && lo[1] == 3 && lo[2] == -17 && hi[0] == 7 && hi[1] == 12 && hi[2] == 3);
    }
    free_seen(&seen);
    vol_vdb_close(vdb);
}

static void test_dense_of_every_type(void)
{
    static const struct {
        VolVdbStore store;
        VolVdbValue value;
    } types[] = {{VOL_STORE_FLOAT, VOL_VALUE_FLOAT}, {VOL_STORE_HALF, VOL_VALUE_HALF}, {VOL_STORE_DOUBLE, VOL_VALUE_DOUBLE},
                 {VOL_STORE_INT32, VOL_VALUE_INT32}, {VOL_STORE_VEC3S, VOL_VALUE_VEC3S}};
    for (size_t t = 0; t < sizeof types / sizeof types[0]; t++)
        for (VolVdbCompression compression = VOL_COMPRESS_NONE; compression <= VOL_COMPRESS_BLOSC; compression++) {
            VolBytes bytes = write_dense(types[t].store, compression, &unit);
            check_dense(&bytes, types[t].store, types[t].value);
            vol_bytes_free(&bytes);
        }
}

static void test_special_floats(void)
{
    uint32_t patterns[8] = {0x7fc00001, 0x80000000, 0x00000001, 0x7f800000, 0xff800000, 0x7f7fffff, 0x3f800000, 0};
    float values[512], *got;
    for (int n = 0; n < 512; n++)
        memcpy(&values[n], &patterns[n * 5 % 8], sizeof values[n]);
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    VolVdbNewGrid grid = {.name = "odd", .index_to_world = unit};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_dense(writer, (int32_t[]){0, 0, 0}, (int32_t[]){8, 8, 8}, values, &err));
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    Seen seen = new_seen((int32_t[]){0, 0, 0}, (int32_t[]){8, 8, 8});
    OK(vol_vdb_visit(vdb, 0, &float_visitor, &seen, &err));
    got = values; /* doubles lose no bit that matters: compare as floats, NaN by being NaN */
    for (size_t n = 0; n < 512; n++) {
        float back = (float)seen.values[3 * n];
        CHECK(isnan(got[n]) ? isnan(back) : memcmp(&back, &got[n], sizeof back) == 0);
    }
    free_seen(&seen);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static VolBytes write_leaves(void)
{
    float values[512];
    uint64_t active[8];
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    VolVdbNewGrid grid = {.name = "leaves", .index_to_world = unit, .background = {0.5}, .grid_class = "level set"};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    random_state = 7;
    for (int leaf = 0; leaf < 4; leaf++) {
        for (int n = 0; n < 512; n++)
            values[n] = (float)(random_bits() % 1000);
        for (int x = 0; x < 8; x++)
            active[x] = leaf == 3 ? 0 : (uint64_t)random_bits() << 32 | random_bits();
        OK(vol_vdb_put_leaf(writer, (int32_t[]){8 * leaf, -8, 16}, values, active, &err));
    }
    OK(vol_vdb_put_tile(writer, (int32_t[]){0, 16, 16}, 8, (double[]){7, 0, 0}, true, &err));
    OK(vol_vdb_put_tile(writer, (int32_t[]){8, 16, 16}, 8, (double[]){-0.5, 0, 0}, false, &err));
    OK(vol_vdb_put_tile(writer, (int32_t[]){128, 0, 0}, 128, (double[]){8, 0, 0}, true, &err));
    OK(vol_vdb_put_tile(writer, (int32_t[]){-4096, 0, 0}, 4096, (double[]){9, 0, 0}, true, &err));
    OK(vol_vdb_put_tile(writer, (int32_t[]){4096, 0, 0}, 4096, (double[]){-9, 0, 0}, false, &err));
    OK(vol_vdb_end_grid(writer, &err));
    return finish(writer);
}

static void test_leaves_and_tiles(void)
{
    VolBytes bytes = write_leaves();
    VolVdb *vdb = open_copy(&bytes);
    Seen seen = see(vdb, 0, (int32_t[]){-8, -8, 16}, (int32_t[]){48, 40, 8});
    CHECK(seen.info.level_set && seen.info.background[0] == 0.5 && !seen.info.empty);
    CHECK(seen.leaves == 4 && seen.tiles == 5 && seen.info.leaves == 4 && seen.info.active_tiles == 3);
    CHECK(seen.info.box_min[0] == -4096 && seen.info.box_max[0] == 255);
    uint64_t voxels = 512 + 128ull * 128 * 128 + 4096ull * 4096 * 4096;
    random_state = 7;
    for (int leaf = 0; leaf < 4; leaf++) {
        double values[512];
        uint64_t active[8];
        for (int n = 0; n < 512; n++)
            values[n] = (double)(random_bits() % 1000);
        for (int x = 0; x < 8; x++)
            active[x] = leaf == 3 ? 0 : (uint64_t)random_bits() << 32 | random_bits();
        for (int n = 0; n < 512; n++) {
            size_t i = at(&seen, 8 * leaf + n / 64, -8 + n / 8 % 8, 16 + n % 8);
            CHECK(seen.values[3 * i] == values[n]); /* inactive ones too */
            CHECK(seen.active[i] == (active[n / 64] >> (n % 64) & 1));
            voxels += seen.active[i];
        }
    }
    CHECK(seen.info.active_voxels == voxels);
    CHECK(seen.values[3 * at(&seen, 3, 20, 20)] == 7 && seen.active[at(&seen, 3, 20, 20)]);
    CHECK(seen.values[3 * at(&seen, 9, 20, 20)] == -0.5 && !seen.active[at(&seen, 9, 20, 20)]);
    CHECK(seen.values[3 * at(&seen, -1, 0, 20)] == 9 && seen.values[3 * at(&seen, 20, 20, 20)] == 0.5);
    free_seen(&seen);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static void test_constant_boxes_are_small(void)
{
    float *values = calloc(64 * 64 * 64, sizeof *values);
    for (int n = 0; n < 64 * 64 * 64; n++)
        values[n] = 0.25f;
    values[5] = 1;
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    VolVdbNewGrid grid = {.name = "flat", .index_to_world = unit};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_dense(writer, (int32_t[]){0, 0, 0}, (int32_t[]){64, 64, 64}, values, &err));
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes bytes = finish(writer);
    CHECK(bytes.size < 30000);
    VolVdb *vdb = open_copy(&bytes);
    Seen seen = see(vdb, 0, (int32_t[]){0, 0, 0}, (int32_t[]){64, 64, 64});
    CHECK(seen.leaves == 1 && seen.tiles == 511 && seen.info.active_voxels == 64 * 64 * 64);
    for (size_t n = 0; n < 64 * 64 * 64; n++)
        CHECK(seen.values[3 * n] == (double)values[n] && seen.active[n]);
    free_seen(&seen);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
    free(values);
}

/* Seven of a leaf's eight layers: it must not become a tile, even where the values are the background's. */
static void test_inactive_layer_stays_inactive(void)
{
    float values[8 * 8 * 7];
    for (int n = 0; n < 8 * 8 * 7; n++)
        values[n] = 2;
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    VolVdbNewGrid grid = {.name = "layers", .index_to_world = unit, .background = {2}};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_dense(writer, (int32_t[]){0, 0, 0}, (int32_t[]){8, 8, 7}, values, &err));
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    Seen seen = see(vdb, 0, (int32_t[]){0, 0, 0}, (int32_t[]){8, 8, 8});
    CHECK(seen.info.active_voxels == 8 * 8 * 7 && seen.info.box_max[2] == 6);
    free_seen(&seen);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

/* What follows a scale in the file: its size, inverse, inverse squared, half the inverse.  Others rely on them. */
static void test_what_follows_a_scale(void)
{
    static const VolAffine mirrored = {{{-2, 0, 0}, {0, 4, 0}, {0, 0, 0.5}, {0, 0, 0}}};
    static const double want[15] = {-2, 4, 0.5, 2, 4, 0.5, -0.5, 0.25, 2, 0.25, 0.0625, 4, -0.25, 0.125, 1};
    VolBytes bytes = write_dense(VOL_STORE_FLOAT, VOL_COMPRESS_BLOSC, &mirrored);
    size_t found = 0;
    for (size_t i = 0; i + 12 + sizeof want <= bytes.size && !found; i++)
        if (memcmp(bytes.data + i, "\x8\0\0\0ScaleMap", 12) == 0)
            found = i + 12;
    CHECK(found && memcmp(bytes.data + found, want, sizeof want) == 0);
    vol_bytes_free(&bytes);
}

static void test_transforms(void)
{
    static const VolAffine transforms[] = {
        {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}},
        {{{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {0, 0, 0}}},
        {{{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {1e6, -3, 0.7}}},
        {{{3.2, 0, 0}, {0, 3.2, 0}, {0, 0, 1.5}, {0, 0, 0}}},
        {{{-1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {5, 0, 0}}},                           /* mirrored */
        {{{-2, 0, 0}, {0, -2, 0}, {0, 0, -2}, {0, 0, 0}}},
        {{{1, 0.3, 0}, {0, 2, 0.1}, {-0.7, 0, 3}, {0.1, 0.2, 0.3}}},               /* sheared */
        {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, 0}}},                           /* turned */
        {{{1e-7, 0, 0}, {0, 1e-7, 0}, {0, 0, 1e-7}, {0, 0, 0}}},
    };
    for (size_t t = 0; t < sizeof transforms / sizeof transforms[0]; t++) {
        VolBytes bytes = write_dense(VOL_STORE_FLOAT, VOL_COMPRESS_BLOSC, &transforms[t]);
        VolVdb *vdb = open_copy(&bytes);
        const VolVdbEntry *entry = vol_vdb_entry(vdb, 0);
        CHECK(entry->transform_known);
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 3; j++)
                CHECK(entry->index_to_world.m[i][j] == transforms[t].m[i][j]);
        vol_vdb_close(vdb);
        vol_bytes_free(&bytes);
    }
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    VolVdbNewGrid grid = {.name = "flat", .index_to_world = {{{1, 0, 0}, {2, 0, 0}, {0, 0, 1}, {0, 0, 0}}}};
    CHECK(vol_vdb_begin_grid(writer, &grid, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot write grid 'flat': its transform is singular or not finite");
    vol_vdb_writer_free(writer);
}

static void test_values_that_do_not_fit(void)
{
    static const struct {
        VolVdbStore store;
        double value;
    } cases[] = {{VOL_STORE_HALF, 70000}, {VOL_STORE_FLOAT, 1e39}, {VOL_STORE_INT32, NAN}, {VOL_STORE_INT32, 3e9},
                 {VOL_STORE_VEC3S, -1e40}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
        VolVdbNewGrid grid = {.name = "g", .store = cases[i].store, .index_to_world = unit};
        double values[3] = {cases[i].value, 0, 0};
        OK(vol_vdb_begin_grid(writer, &grid, &err));
        CHECK(vol_vdb_put_dense_double(writer, (int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1}, values, &err) == VOL_BAD_INPUT);
        CHECK(strstr(err.text, "cannot write grid 'g': value ") == err.text);
        vol_vdb_writer_free(writer);
    }
}

static void test_misuse_of_the_writer(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    VolBytes bytes;
    float value = 1;
    int32_t zero[3] = {0}, one[3] = {1, 1, 1}, edge[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1}, odd[3] = {4, 0, 0};
    VolVdbNewGrid grid = {.name = "g", .index_to_world = unit};
    CHECK(vol_vdb_finish(writer, &bytes, &err) == VOL_USAGE);
    CHECK(vol_vdb_put_dense(writer, zero, one, &value, &err) == VOL_USAGE);
    CHECK(vol_vdb_end_grid(writer, &err) == VOL_USAGE);
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    CHECK(vol_vdb_begin_grid(writer, &grid, &err) == VOL_USAGE);
    CHECK(vol_vdb_finish(writer, &bytes, &err) == VOL_USAGE);
    CHECK(vol_vdb_put_dense(writer, zero, zero, &value, &err) == VOL_BAD_INPUT);
    CHECK(vol_vdb_put_dense(writer, edge, two, &value, &err) == VOL_BAD_INPUT);
    CHECK(vol_vdb_put_tile(writer, odd, 8, (double[]){1, 0, 0}, true, &err) == VOL_USAGE);
    CHECK(vol_vdb_put_tile(writer, zero, 16, (double[]){1, 0, 0}, true, &err) == VOL_USAGE);
    vol_vdb_writer_free(writer);
}

/* ---- metadata ---- */

static void test_metadata_of_every_kind(void)
{
    static const struct {
        const char *name, *type, *text;
        uint32_t size;
        unsigned char bytes[32];
    } kinds[] = {
        {"a", "string", "h\xc3\xa9 ?", 5, "h\xc3\xa9 \x07"},
        {"b", "bool", "true", 1, {1}},
        {"c", "int32", "-2", 4, {0xfe, 0xff, 0xff, 0xff}},
        {"d", "int64", "4294967296", 8, {0, 0, 0, 0, 1}},
        {"e", "float", "0.1", 4, {0xcd, 0xcc, 0xcc, 0x3d}},
        {"f", "double", "0.1", 8, {0x9a, 0x99, 0x99, 0x99, 0x99, 0x99, 0xb9, 0x3f}},
        {"g", "vec3i", "1 2 -1", 12, {1, 0, 0, 0, 2, 0, 0, 0, 0xff, 0xff, 0xff, 0xff}},
        {"h", "vec2s", "1 0.5", 8, {0, 0, 0x80, 0x3f, 0, 0, 0, 0x3f}},
        {"i", "vec3d", "0 0 2", 24, {[22] = 0, [23] = 0x40}},
        {"j", "somebody's own", "(somebody's own, 3 bytes)", 3, {9, 8, 7}},
        {"k", "string", "", 0, {0}},
    };
    enum { KINDS = sizeof kinds / sizeof kinds[0] };
    VolVdbMetaList list = {0};
    for (size_t i = KINDS; i-- > 0;)
        OK(vol_meta_set(&list, kinds[i].name, kinds[i].type, kinds[i].bytes, kinds[i].size, &err));
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    OK(vol_meta_copy(vol_vdb_writer_file_meta(writer), &list, &err));
    OK(vol_meta_set_text(vol_vdb_writer_file_meta(writer), "creator", "a test", &err));
    VolVdbNewGrid grid = {.name = "g", .index_to_world = unit, .meta = list};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    vol_meta_free(&list);
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    const VolVdbMetaList *lists[2] = {vol_vdb_file_meta(vdb), &vol_vdb_entry(vdb, 0)->meta};
    for (int l = 0; l < 2; l++)
        for (size_t i = 0; i < KINDS; i++) {
            const VolVdbMeta *meta = vol_meta_find(lists[l], kinds[i].name);
            CHECK(meta != NULL);
            if (!meta)
                continue;
            CHECK_TEXT(meta->type, kinds[i].type);
            CHECK(meta->size == kinds[i].size && memcmp(meta->bytes, kinds[i].bytes, meta->size) == 0);
            char *text = vol_meta_text(meta);
            CHECK_TEXT(text, kinds[i].text);
            free(text);
        }
    CHECK(vol_meta_find(lists[0], "creator") != NULL && lists[0]->count == KINDS + 1);
    char *class_text = vol_meta_text(vol_meta_find(lists[1], "class"));
    CHECK_TEXT(class_text, "fog volume");
    free(class_text);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static void test_metadata_lists(void)
{
    VolVdbMetaList list = {0};
    char name[16];
    for (int i = 0; i < 100; i++) {
        snprintf(name, sizeof name, "k%d", i);
        OK(vol_meta_set_text(&list, name, "old", &err));
        OK(vol_meta_set_text(&list, name, "new", &err));
    }
    CHECK(list.count == 100);
    for (int i = 0; i < 100; i += 2) {
        snprintf(name, sizeof name, "k%d", i);
        vol_meta_remove(&list, name);
    }
    vol_meta_remove(&list, "not there");
    CHECK(list.count == 50 && !vol_meta_find(&list, "k98") && vol_meta_find(&list, "k99"));
    CHECK_TEXT(list.items[0].name, "k1");
    OK(vol_meta_set_text(&list, "more", "", &err));
    CHECK(list.count == 51);
    vol_meta_free(&list);
}

/* ---- names ---- */

static void put_small(VolVdbWriter *writer, const char *name, VolVdbStore store, float value)
{
    VolVdbNewGrid grid = {.name = name, .store = store, .index_to_world = unit};
    float values[3] = {value, value, value};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_dense(writer, (int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1}, values, &err));
    OK(vol_vdb_end_grid(writer, &err));
}

static double value_of(const VolVdb *vdb, size_t index)
{
    Seen seen = see(vdb, index, (int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1});
    double value = seen.values[0];
    free_seen(&seen);
    return value;
}

static void test_finding_grids(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "v", VOL_STORE_VEC3S, 1);
    put_small(writer, "heat", VOL_STORE_FLOAT, 2);
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    size_t index = 99;
    CHECK(vol_vdb_find(vdb, NULL, &index, &err) == VOL_OK && index == 1); /* the only scalar one */
    CHECK(vol_vdb_find(vdb, "v", &index, &err) == VOL_OK && index == 0);
    CHECK(vol_vdb_find(vdb, "density", &index, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "no grid 'density' in 'test': it holds v (vec3s), heat (float)");
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);

    writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "a", VOL_STORE_HALF, 1);
    put_small(writer, "b", VOL_STORE_DOUBLE, 2);
    bytes = finish(writer);
    vdb = open_copy(&bytes);
    CHECK(vol_vdb_find(vdb, NULL, &index, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot choose a grid of 'test': it holds a (float as half), b (double); name one by --grid");
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

/* Light and masks lie beside a volume. */
static void test_grids_beside(void)
{
    static const char *const beside[] = {"light.0.direct", "light.12.3.direct", "light.total", "level0.light.total", "mask"};
    static const char *const volumes[] = {"light", "light.", "lights.0", "light.totals", "masks", ""};
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    for (size_t i = 0; i < sizeof beside / sizeof *beside; i++) {
        CHECK(vol_vdb_is_beside(beside[i]));
        put_small(writer, beside[i], VOL_STORE_FLOAT, 1);
    }
    for (size_t i = 0; i < sizeof volumes / sizeof *volumes; i++)
        CHECK(!vol_vdb_is_beside(volumes[i]));
    put_small(writer, "heat", VOL_STORE_FLOAT, 2);
    put_small(writer, "light.1.direct", VOL_STORE_FLOAT, 3);
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    size_t index = 99;
    CHECK(vol_vdb_find(vdb, NULL, &index, &err) == VOL_OK && value_of(vdb, index) == 2);
    CHECK(vol_vdb_find(vdb, "light.0.direct", &index, &err) == VOL_OK && value_of(vdb, index) == 1);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

/* Unnamed grids are ''; a name that looks like a number of another is a name all the same. */
static void test_odd_names(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "", VOL_STORE_FLOAT, 1);
    put_small(writer, "a", VOL_STORE_FLOAT, 2);
    put_small(writer, "a[1]", VOL_STORE_FLOAT, 3);
    put_small(writer, "a", VOL_STORE_FLOAT, 4);
    put_small(writer, "", VOL_STORE_FLOAT, 5);
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    size_t index = 99;
    const struct {
        const char *name;
        size_t index;
    } rows[] = {{"", 0}, {"''", 0}, {"''[1]", 4}, {"[1]", 4}, {"a", 1}, {"a[1]", 2}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        CHECK(vol_vdb_find(vdb, rows[i].name, &index, &err) == VOL_OK && index == rows[i].index);
    CHECK(vol_vdb_find(vdb, "b", &index, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "it holds '' (float), a (float), a[1] (float), a[1] (float), ''[1] (float)"));
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static void test_duplicate_names(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "density", VOL_STORE_FLOAT, 1);
    put_small(writer, "other", VOL_STORE_FLOAT, 2);
    put_small(writer, "density", VOL_STORE_FLOAT, 3);
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    size_t index = 99;
    CHECK_TEXT(vol_vdb_entry(vdb, 0)->unique_name, "density\x1e""0");
    CHECK_TEXT(vol_vdb_entry(vdb, 1)->unique_name, "other");
    CHECK_TEXT(vol_vdb_entry(vdb, 2)->unique_name, "density\x1e""1");
    CHECK_TEXT(vol_vdb_entry(vdb, 2)->name, "density");
    CHECK(vol_vdb_find(vdb, NULL, &index, &err) == VOL_OK && index == 0);
    CHECK(vol_vdb_find(vdb, "density[0]", &index, &err) == VOL_OK && index == 0);
    CHECK(vol_vdb_find(vdb, "density[1]", &index, &err) == VOL_OK && index == 2);
    CHECK(vol_vdb_find(vdb, "other[0]", &index, &err) == VOL_OK && index == 1);
    CHECK(vol_vdb_find(vdb, "density[2]", &index, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "no grid 'density[2]' in 'test': it holds density (float), other (float), density[1] (float)");
    static const char *const wrong[] = {"density[]", "density[1", "[1]", "density[-1]", "density[x]", ""};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        CHECK(vol_vdb_find(vdb, wrong[i], &index, &err) == VOL_BAD_INPUT);
    CHECK(vol_vdb_namesakes(vdb, 2) == 2 && vol_vdb_namesakes(vdb, 1) == 1);
    CHECK(value_of(vdb, 0) == 1 && value_of(vdb, 2) == 3);

    writer = new_writer(VOL_COMPRESS_BLOSC); /* one of them, together with a new one of its name */
    OK(vol_vdb_pass_grid(writer, vdb, 2, &err));
    put_small(writer, "density", VOL_STORE_FLOAT, 4);
    OK(vol_vdb_pass_grid(writer, vdb, 2, &err));
    VolBytes mixed = finish(writer);
    VolVdb *back = open_copy(&mixed);
    CHECK_TEXT(vol_vdb_entry(back, 0)->unique_name, "density\x1e""1");
    CHECK_TEXT(vol_vdb_entry(back, 1)->unique_name, "density\x1e""0");
    CHECK_TEXT(vol_vdb_entry(back, 2)->unique_name, "density\x1e""2");
    CHECK(value_of(back, 0) == 3 && value_of(back, 1) == 4 && value_of(back, 2) == 3);
    vol_vdb_close(back);
    vol_vdb_close(vdb);
    vol_bytes_free(&mixed);
    vol_bytes_free(&bytes);
}

/* ---- passing through; streams; instances ---- */

static VolBytes pass_all(const VolVdb *vdb)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    OK(vol_meta_copy(vol_vdb_writer_file_meta(writer), vol_vdb_file_meta(vdb), &err));
    for (size_t i = 0; i < vol_vdb_count(vdb); i++)
        OK(vol_vdb_pass_grid(writer, vdb, i, &err));
    return finish(writer);
}

static void test_passing_is_exact(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    OK(vol_meta_set_text(vol_vdb_writer_file_meta(writer), "creator", "a test", &err));
    put_small(writer, "density", VOL_STORE_HALF, 1);
    put_small(writer, "density", VOL_STORE_VEC3S, 3);
    put_small(writer, "x", VOL_STORE_INT32, 3);
    VolBytes bytes = finish(writer);
    VolVdb *vdb = open_copy(&bytes);
    VolBytes again = pass_all(vdb);
    CHECK(again.size == bytes.size && memcmp(again.data, bytes.data, bytes.size) == 0);
    vol_vdb_close(vdb);
    vol_bytes_free(&again);
    vol_bytes_free(&bytes);
}

static void test_same_grids_same_bytes(void)
{
    VolBytes a = write_leaves(), b = write_leaves(), c = write_dense(VOL_STORE_FLOAT, VOL_COMPRESS_BLOSC, &unit);
    CHECK(a.size == b.size && memcmp(a.data, b.data, a.size) == 0);
    CHECK(memcmp(a.data + 21, c.data + 21, 36) != 0); /* another content, another UUID */
    for (int i = 0; i < 36; i++) {
        int character = a.data[21 + i];
        bool dash = i == 8 || i == 13 || i == 18 || i == 23;
        CHECK(dash ? character == '-' : strchr("0123456789abcdef", character) != NULL);
    }
    vol_bytes_free(&a);
    vol_bytes_free(&b);
    vol_bytes_free(&c);
}

/* stream.vdb is what openvdb::io::Stream wrote for eight grids: `density` (20 voxels, sheared), `again` (an instance of
 * it), `flags` (bool), `count` (int64), `where` (mask), `v` (vec3d, empty), `points` (empty), `density` (half tile). */
static void test_a_stream_of_openvdb(void)
{
    VolBytes bytes = load("stream.vdb");
    VolVdb *vdb = open_copy(&bytes);
    if (!vdb)
        return;
    CHECK(vol_vdb_count(vdb) == 8);
    Seen parent = see(vdb, 0, (int32_t[]){8, 16, 24}, (int32_t[]){8, 8, 8});
    Seen instance = see(vdb, 1, (int32_t[]){8, 16, 24}, (int32_t[]){8, 8, 8});
    for (int i = 0; i < 20; i++)
        CHECK(parent.values[3 * at(&parent, i % 5 + 8, i / 5 + 16, i % 3 + 24)] == 0.5 * i);
    CHECK(memcmp(parent.values, instance.values, 512 * 3 * sizeof(double)) == 0);
    CHECK(parent.info.index_to_world.m[0][1] == 0.5 && parent.info.index_to_world.m[3][2] == 6);
    CHECK(instance.info.index_to_world.m[0][0] == 0.5 && instance.info.index_to_world.m[0][1] == 0);
    CHECK_TEXT(vol_vdb_entry(vdb, 1)->instance_of, vol_vdb_entry(vdb, 0)->unique_name);
    free_seen(&parent);
    free_seen(&instance);

    Seen flags = see(vdb, 2, (int32_t[]){4095, 0, 0}, (int32_t[]){2, 1, 1});
    CHECK(flags.info.value == VOL_VALUE_BOOL && flags.values[0] == 0 && flags.values[3] == 1 && flags.active[1]);
    free_seen(&flags);
    Seen counts = see(vdb, 3, (int32_t[]){-1, 0, 4096}, (int32_t[]){1, 1, 1});
    CHECK(counts.info.value == VOL_VALUE_INT64 && counts.values[0] == 1234567890123.0 && counts.tiles == 2);
    free_seen(&counts);
    Seen where = see(vdb, 4, (int32_t[]){0, 4096, 0}, (int32_t[]){1, 1, 1});
    CHECK(where.info.value == VOL_VALUE_MASK && where.active[0] && where.info.active_voxels == 4096ull * 4096 * 4096);
    free_seen(&where);
    Seen v = see(vdb, 5, (int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1});
    CHECK(v.info.value == VOL_VALUE_VEC3D && v.info.empty && v.values[0] == 1 && v.values[1] == 2 && v.values[2] == 3);
    free_seen(&v);
    CHECK(vol_vdb_value(vol_vdb_entry(vdb, 6)) == VOL_VALUE_POINTS);
    CHECK(vol_vdb_visit(vdb, 6, &ignoring, NULL, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "Tree_ptdataidx32_5_4_3") != NULL);
    CHECK(vol_vdb_value(vol_vdb_entry(vdb, 7)) == VOL_VALUE_HALF && value_of(vdb, 7) == 2.5);

    VolBytes passed = pass_all(vdb);
    VolVdb *file = open_copy(&passed);
    VolBytes again = pass_all(file);
    CHECK(passed.size == again.size && memcmp(passed.data, again.data, passed.size) == 0);
    for (size_t i = 0; i < 8; i++) {
        CHECK_TEXT(vol_vdb_entry(file, i)->unique_name, vol_vdb_entry(vdb, i)->unique_name);
        CHECK(vol_vdb_entry(file, i)->size == vol_vdb_entry(vdb, i)->size);
        CHECK(memcmp(passed.data + vol_vdb_entry(file, i)->offset, bytes.data + vol_vdb_entry(vdb, i)->offset,
                     vol_vdb_entry(vdb, i)->size) == 0);
    }
    CHECK_TEXT(vol_vdb_entry(file, 1)->instance_of, vol_vdb_entry(file, 0)->unique_name);
    vol_bytes_free(&passed);
    vol_bytes_free(&again);
    vol_vdb_close(file);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static void test_an_instance_without_its_parent(void)
{
    VolBytes bytes = load("stream.vdb");
    VolVdb *vdb = open_copy(&bytes);
    if (!vdb)
        return;
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_NONE);
    OK(vol_vdb_pass_grid(writer, vdb, 1, &err));
    VolBytes alone = finish(writer);
    VolVdb *back = open_copy(&alone);
    CHECK_TEXT(vol_vdb_entry(back, 0)->instance_of, "");
    CHECK_TEXT(vol_vdb_entry(back, 0)->name, "again");
    Seen seen = see(back, 0, (int32_t[]){8, 16, 24}, (int32_t[]){8, 8, 8});
    CHECK(seen.info.active_voxels == 20 && seen.values[3 * at(&seen, 9, 16, 25)] == 0.5);
    CHECK(seen.info.index_to_world.m[1][1] == 0.5);
    free_seen(&seen);
    vol_vdb_close(back);
    vol_vdb_close(vdb);
    vol_bytes_free(&alone);
    vol_bytes_free(&bytes);
}

/* ---- types that are read but not written: files put together by hand ---- */

static VolBytes hand;
static size_t hand_capacity;
static void hand_bytes(const void *data, size_t size) { OK(vol_bytes_append(&hand, &hand_capacity, data, size, &err)); }
static void hand_u32(uint32_t v) { hand_bytes(&v, 4); }
static void hand_u64(uint64_t v) { hand_bytes(&v, 8); }
static void hand_text(const char *text)
{
    hand_u32((uint32_t)strlen(text));
    hand_bytes(text, strlen(text));
}
static void hand_zeros(size_t n)
{
    static const unsigned char zeros[8192];
    hand_bytes(zeros, n);
}

/* One grid of one leaf at 8,0,-8 in which voxel n (n % 3 == 0: active) holds values + n * size; uncompressed. */
static VolBytes by_hand(const char *type, uint32_t version, const void *values, size_t size)
{
    bool is_bool = strcmp(type, "Tree_bool_5_4_3") == 0, is_mask = strcmp(type, "Tree_mask_5_4_3") == 0;
    static const unsigned char magic[8] = {0x20, 0x42, 0x44, 0x56}, all_values = 6;
    unsigned char bits[64] = {0}, mask[64] = {0};
    const int32_t origin[3] = {8, 0, -8}, root_origin[3] = {0, 0, -4096};
    hand = (VolBytes){0};
    hand_capacity = 0;
    for (int n = 0; n < 512; n++) {
        if (n % 3 == 0)
            mask[n / 8] |= (unsigned char)(1 << n % 8);
        if ((is_bool || is_mask) && ((const unsigned char *)values)[n])
            bits[n / 8] |= (unsigned char)(1 << n % 8);
    }
    hand_bytes(magic, 8);
    hand_u32(version), hand_u32(10), hand_u32(0);
    hand_bytes("\0" "00000000-0000-0000-0000-000000000000", 37);
    hand_u32(0), hand_u32(1);
    hand_text("g"), hand_text(type), hand_text("");
    hand_u64(0), hand_u64(0), hand_u64(0);
    hand_u32(0), hand_u32(0);
    hand_text("TranslationMap");
    for (int k = 0; k < 3; k++)
        hand_bytes(&(double){k + 1}, 8);
    hand_u32(1);
    hand_zeros(size);
    hand_u32(0), hand_u32(1);
    hand_bytes(root_origin, 12);
    const size_t children[2] = {511, (1u << 8) + 15}; /* entry 0,0,31 of 32^3; entry 1,0,15 of 16^3 */
    for (int level = 0; level < 2; level++) {
        size_t entries = level == 0 ? 32768 : 4096;
        size_t child = level == 0 ? 31 : children[1];
        unsigned char *child_mask = calloc(entries / 8, 1);
        child_mask[child / 8] = (unsigned char)(1 << child % 8);
        hand_bytes(child_mask, entries / 8);
        free(child_mask);
        hand_zeros(entries / 8);
        hand_bytes(&all_values, 1);
        for (size_t left = entries * size; left;) {
            size_t part = left < 8192 ? left : 8192;
            hand_zeros(part);
            left -= part;
        }
    }
    hand_bytes(is_mask ? bits : mask, 64);
    if (is_mask) {
        hand_bytes(bits, 64);
        hand_bytes(origin, 12);
    } else if (is_bool) {
        hand_bytes(mask, 64);
        hand_bytes(origin, 12);
        hand_bytes(bits, 64);
    } else {
        hand_bytes(mask, 64);
        hand_bytes(&all_values, 1);
        hand_bytes(values, 512 * size);
    }
    return hand;
}

static void check_by_hand(const char *type, VolVdbValue value, const void *values, size_t size,
                          double (*want)(int n, int c))
{
    VolBytes bytes = by_hand(type, value == VOL_VALUE_HALF ? 225 : 222, values, size);
    VolVdb *vdb = open_copy(&bytes);
    vol_bytes_free(&bytes);
    if (!vdb)
        return;
    Seen seen = see(vdb, 0, (int32_t[]){8, 0, -8}, (int32_t[]){8, 8, 8});
    CHECK(seen.info.value == value && seen.info.leaves == 1 && seen.info.index_to_world.m[3][1] == 2);
    for (int n = 0; n < 512; n++) {
        size_t i = at(&seen, 8 + n / 64, n / 8 % 8, n % 8 - 8);
        for (int c = 0; c < vol_vdb_components(value); c++)
            if (seen.values[3 * i + (size_t)c] != want(n, c))
                FAIL("%s: voxel %d component %d: got %g, want %g", type, n, c, seen.values[3 * i + (size_t)c], want(n, c));
        CHECK(seen.active[i] == (value == VOL_VALUE_MASK ? want(n, 0) != 0 : n % 3 == 0));
    }
    free_seen(&seen);
    vol_vdb_close(vdb);
}

static double want_number(int n, int c) { return n * 3 + c; }
static double want_bit(int n, int c) { return (n * 7 + c) % 5 < 2; }
static double want_half(int n, int c) { return n % 2 + c ? -2.0 : 1.0; }

static void test_every_type_that_is_read(void)
{
    static int64_t i64[512];
    static int32_t i32[512 * 3];
    static double d[512 * 3];
    static unsigned char bits[512];
    static uint16_t half[512];
    for (int n = 0; n < 512; n++) {
        i64[n] = (int64_t)want_number(n, 0);
        bits[n] = want_bit(n, 0) != 0;
        half[n] = n % 2 ? 0xc000 : 0x3c00;
        for (int c = 0; c < 3; c++) {
            i32[3 * n + c] = (int32_t)want_number(n, c);
            d[3 * n + c] = want_number(n, c);
        }
    }
    check_by_hand("Tree_int64_5_4_3", VOL_VALUE_INT64, i64, 8, want_number);
    check_by_hand("Tree_vec3i_5_4_3", VOL_VALUE_VEC3I, i32, 12, want_number);
    check_by_hand("Tree_vec3d_5_4_3", VOL_VALUE_VEC3D, d, 24, want_number);
    check_by_hand("Tree_bool_5_4_3", VOL_VALUE_BOOL, bits, 1, want_bit);
    check_by_hand("Tree_mask_5_4_3", VOL_VALUE_MASK, bits, 1, want_bit);
    check_by_hand("Tree_half_5_4_3", VOL_VALUE_HALF, half, 2, want_half);
}

static void test_half_trees_keep_their_version(void)
{
    static uint16_t half[512];
    VolBytes bytes = by_hand("Tree_half_5_4_3", 225, half, 2);
    VolVdb *vdb = open_copy(&bytes);
    VolBytes passed = pass_all(vdb);
    CHECK(passed.data[8] == 225);
    CHECK(use_all(&passed, passed.size) == VOL_OK);
    vol_vdb_close(vdb);
    vol_bytes_free(&passed);
    vol_bytes_free(&bytes);
}

/* ---- types that are not read ---- */

static void replace_text(VolBytes *bytes, const char *from, const char *to)
{
    size_t n = strlen(from);
    for (size_t i = 0; i + n <= bytes->size; i++)
        if (memcmp(bytes->data + i, from, n) == 0) {
            memcpy(bytes->data + i, to, n);
            return;
        }
    FAIL("no '%s' to replace", from);
}

static void test_unknown_types_pass(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "trunc", VOL_STORE_INT32, 1);
    put_small(writer, "density", VOL_STORE_FLOAT, 2);
    VolBytes bytes = finish(writer);
    replace_text(&bytes, "Tree_int32_5_4_3", "Tree_int32_trnc4");
    VolVdb *vdb = open_copy(&bytes);
    size_t index = 99;
    CHECK(vol_vdb_find(vdb, NULL, &index, &err) == VOL_OK && index == 1 && value_of(vdb, 1) == 2);
    CHECK(vol_vdb_value(vol_vdb_entry(vdb, 0)) == VOL_VALUE_OTHER);
    CHECK(vol_vdb_visit(vdb, 0, &ignoring, NULL, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot read grid 'trunc' of 'test': its type Tree_int32_trnc4 is not one of numbers");
    VolBytes passed = pass_all(vdb);
    CHECK(passed.size == bytes.size && memcmp(passed.data + 57, bytes.data + 57, bytes.size - 57) == 0);
    vol_vdb_close(vdb);
    vol_bytes_free(&passed);

    bytes.data[20] = 0; /* as a stream: nobody knows where it ends */
    CHECK(vol_vdb_open(bytes, "test", &vdb, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "grid 'trunc'") && strstr(err.text, "Tree_int32_trnc4"));
}

static void test_maps_that_are_not_affine(void)
{
    VolBytes bytes = write_dense(VOL_STORE_FLOAT, VOL_COMPRESS_BLOSC, &unit);
    replace_text(&bytes, "UniformScaleMap", "SomebodysOwnMap");
    VolVdb *vdb = open_copy(&bytes);
    CHECK(!vol_vdb_entry(vdb, 0)->transform_known);
    CHECK(vol_vdb_visit(vdb, 0, &ignoring, NULL, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot read grid 'density' of 'test': its transform 'SomebodysOwnMap' is of an unknown kind");
    VolBytes passed = pass_all(vdb);
    CHECK(passed.size == bytes.size && memcmp(passed.data + 57, bytes.data + 57, bytes.size - 57) == 0);
    vol_vdb_close(vdb);
    vol_bytes_free(&passed);
    vol_bytes_free(&bytes);
}

/* ---- visitors ---- */

static void test_visitor_ends_the_visit(void)
{
    VolBytes bytes = write_dense(VOL_STORE_DOUBLE, VOL_COMPRESS_BLOSC, &unit);
    VolVdb *vdb = open_copy(&bytes);
    Seen seen = new_seen((int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1});
    seen.stop_after = 2;
    CHECK(vol_vdb_visit(vdb, 0, &float_visitor, &seen, &err) == VOL_NO && seen.leaves == 3);
    CHECK_TEXT(err.text, "seen enough");
    free_seen(&seen);
    vol_vdb_close(vdb);
    vol_bytes_free(&bytes);
}

static void test_library_version(void)
{
    const char *version = vol_vdb_library_version();
    CHECK(version && strncmp(version, "OpenVDB ", 8) == 0);
}

/* ---- damage ---- */

static void expect_damage(VolBytes bytes, const char *message)
{
    VolVdb *vdb = NULL;
    VolStatus status = vol_vdb_open(bytes, "f", &vdb, &err);
    if (status != VOL_BAD_INPUT || !strstr(err.text, message))
        FAIL("want '%s', got %d '%s'", message, status, status ? err.text : "");
    vol_vdb_close(vdb);
}

static VolBytes patched(const VolBytes *bytes, size_t where, const void *data, size_t size)
{
    VolBytes copy = copy_of(bytes, bytes->size);
    memcpy(copy.data + where, data, size);
    return copy;
}

static void test_damaged_containers(void)
{
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    put_small(writer, "density", VOL_STORE_FLOAT, 1);
    VolBytes good = finish(writer);
    static const unsigned char zero[8], ones[8] = {255, 255, 255, 255, 255, 255, 255, 255}, big[8] = {0, 0, 0, 0x7f};
    /* 57 metadata count, 61 grids, 65 name, 76 type, 96 parent, 100 blob, 108 buffers, 116 end, 124 the blob */
    expect_damage((VolBytes){malloc(1), 0}, "not a VDB 'f': it is empty");
    expect_damage(patched(&good, 0, "x", 1), "not a VDB 'f': it does not begin with a VDB's magic number");
    expect_damage(patched(&good, 8, "\xdd", 1), "byte 8: file version 221, can read 222 to 225");
    expect_damage(patched(&good, 20, "\2", 1), "byte 20: the flag for offsets is 2");
    expect_damage(patched(&good, 57, big, 4), "byte 57: 2130706432 metadata in ");
    expect_damage(patched(&good, 61, zero, 4), "byte 61: no grids");
    expect_damage(patched(&good, 61, ones, 4), "byte 61: 4294967295 grids in ");
    expect_damage(patched(&good, 65, ones, 4), "byte 69: a grid's name takes 4294967295 bytes");
    expect_damage(patched(&good, 70, "\n", 1), "byte 70: control character 10 in a grid's name");
    expect_damage(patched(&good, 70, zero, 1), "byte 70: control character 0 in a grid's name");
    expect_damage(patched(&good, 100, zero, 8), "byte 100, grid 'density': offsets 0, ");
    expect_damage(patched(&good, 108, ones, 8), "byte 100, grid 'density': offsets 124, -1, ");
    expect_damage(patched(&good, 116, big, 8),
                  "byte 100, grid 'density': the grid ends at byte 2130706432, the file at byte ");
    expect_damage(patched(&good, 124, "\xff", 1), "byte 124, grid 'density': unknown compression 255");
    VolBytes longer = {calloc(good.size + 3, 1), good.size + 3};
    memcpy(longer.data, good.data, good.size);
    expect_damage(longer, ": 3 bytes behind the last grid");
    vol_bytes_free(&good);
}

/* The tree of by_hand(), from its end: 512 values, their form, the leaf's mask in the buffers, in the topology. */
static void test_damaged_trees(void)
{
    static int64_t values[512];
    VolBytes good = by_hand("Tree_int64_5_4_3", 224, values, 8);
    size_t form = good.size - 512 * 8 - 1, mask = form - 64, tiles = 0;
    for (size_t i = 0; i + 14 < good.size && !tiles; i++)
        if (memcmp(good.data + i, "TranslationMap", 14) == 0)
            tiles = i + 14 + 24 + 4 + 8;
    CHECK(use_all(&good, good.size) == VOL_OK);
    expect_damage(patched(&good, tiles - 12, "\2", 1), "2 buffers per tree");
    expect_damage(patched(&good, tiles, "\1", 1), "bytes behind the last grid");
    expect_damage(patched(&good, tiles + 4, "\2", 1), "a multiple of 4096");
    expect_damage(patched(&good, tiles + 8, "\1", 1), "node origin 1 is not a multiple of 4096");
    expect_damage(patched(&good, form, "\7", 1), "unknown form 7 of a node's values");
    expect_damage(patched(&good, mask, "\xff", 1), "a leaf's mask differs from the one at byte");
    vol_bytes_free(&good);
}

static void test_boxes_that_lie(void)
{
    static const int32_t inverted[2][3] = {{100, 100, 100}, {-100, -100, -100}}, huge[2][3] = {{0, 0, 0}, {9, 9, 9}},
                         overflowing[2][3] = {{INT32_MIN, 0, 0}, {INT32_MAX, 0, 0}};
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    VolVdbNewGrid grid = {.name = "g", .index_to_world = unit};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes good = finish(writer);
    VolVdb *vdb = open_copy(&good);
    Seen seen = see(vdb, 0, (int32_t[]){0, 0, 0}, (int32_t[]){1, 1, 1});
    CHECK(seen.info.empty && seen.info.active_voxels == 0);
    free_seen(&seen);
    vol_vdb_close(vdb);
    size_t max = 0, min = 0; /* where the two values are: 12 name bytes.., type, size */
    for (size_t i = 0; i + 13 < good.size; i++) {
        max = memcmp(good.data + i, "file_bbox_max", 13) == 0 ? i + 13 + 4 + 5 + 4 : max;
        min = memcmp(good.data + i, "file_bbox_min", 13) == 0 ? i + 13 + 4 + 5 + 4 : min;
    }
    const int32_t(*lies[3])[3] = {inverted, huge, overflowing};
    const char *messages[3] = {"grid 'g': its active box runs from 100 to -100", "but its tree is empty",
                               "to 2147483647,0,0, but its tree is empty"};
    for (int i = 0; i < 3; i++) {
        VolBytes bad = patched(&good, min, lies[i][0], 12);
        memcpy(bad.data + max, lies[i][1], 12);
        expect_damage(bad, messages[i]);
    }
    vol_bytes_free(&good);
}

/* As sound as any, but too large for us. */
static void test_boxes_too_large(void)
{
    static const float values[512] = {1};
    static const uint64_t active[8] = {1};
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_BLOSC);
    VolVdbNewGrid grid = {.name = "g", .index_to_world = unit};
    VolVdb *vdb;
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    OK(vol_vdb_put_leaf(writer, (int32_t[]){0, -2000000000, 0}, values, active, &err));
    OK(vol_vdb_put_leaf(writer, (int32_t[]){0, 2000000000, 0}, values, active, &err));
    OK(vol_vdb_end_grid(writer, &err));
    VolBytes bytes = finish(writer);
    CHECK(vol_vdb_open(bytes, "far", &vdb, &err) == VOL_BAD_INPUT);
    CHECK_TEXT(err.text, "cannot read VDB 'far': grid 'g': its active box runs from -2000000000 to 2000000000: "
                         "voxels so far apart are not supported");
}

/* Every file there is damaged, or (the empty ones) a sound grid of nothing. */
static void test_damaged_files(void)
{
    char path[4096];
    const char *tests = getenv("TESTS");
    snprintf(path, sizeof path, "%s/data/damaged", tests ? tests : "tests");
    DIR *folder = opendir(path);
    int count = 0;
    for (struct dirent *entry; folder && (entry = readdir(folder)) != NULL;) {
        if (!strstr(entry->d_name, ".vdb"))
            continue;
        char name[300];
        snprintf(name, sizeof name, "../damaged/%.255s", entry->d_name);
        VolBytes bytes = load(name);
        VolStatus status = use_all(&bytes, bytes.size), want = strstr(name, "bbox-empty") ? VOL_OK : VOL_BAD_INPUT;
        if (status != want)
            FAIL("%s: status %d", name, status);
        vol_bytes_free(&bytes);
        count++;
    }
    if (folder)
        closedir(folder);
    CHECK(count >= 14);
}

/* Files of several kinds for the tests below: a stream, a file, and one whose blocks are not compressed. */
static VolBytes specimen(int kind)
{
    if (kind == 0)
        return load("stream.vdb");
    if (kind == 1)
        return write_leaves();
    VolVdbWriter *writer = new_writer(VOL_COMPRESS_ZIP);
    put_small(writer, "density", VOL_STORE_HALF, 1);
    put_small(writer, "v", VOL_STORE_VEC3S, 3);
    return finish(writer);
}

static void test_cut_at_every_byte(void)
{
    for (int kind = 0; kind < 3; kind++) {
        VolBytes bytes = specimen(kind);
        CHECK(use_all(&bytes, bytes.size) == VOL_OK);
        for (size_t size = 0; size < bytes.size; size++) {
            VolStatus status = use_all(&bytes, size);
            if (status != VOL_BAD_INPUT)
                FAIL("kind %d cut at byte %zu of %zu: status %d", kind, size, bytes.size, status);
        }
        vol_bytes_free(&bytes);
    }
}

/* Whatever is overwritten: either it is found, or what is left is still a file. */
static void test_overwritten_bytes(void)
{
    random_state = 20221;
    int found = 0;
    for (int kind = 0; kind < 3; kind++) {
        VolBytes bytes = specimen(kind);
        for (int round = 0; round < 3000; round++) {
            VolBytes bad = copy_of(&bytes, bytes.size);
            for (uint32_t n = 0; n <= random_bits() % 3; n++) {
                /* half of them among the first bytes of something, where the lengths are */
                size_t where = random_bits() % bad.size;
                if (round % 2)
                    where = (where & ~(size_t)1023) + random_bits() % 300;
                if (where < bad.size)
                    bad.data[where] = (unsigned char)(random_bits() % 4 ? random_bits() : random_bits() % 2 * 255);
            }
            VolStatus status = use_all(&bad, bad.size);
            if (status != VOL_OK && status != VOL_BAD_INPUT)
                FAIL("kind %d round %d: status %d %s", kind, round, status, err.text);
            found += status == VOL_BAD_INPUT;
            vol_bytes_free(&bad);
        }
        vol_bytes_free(&bytes);
    }
    CHECK(found > 1000);
}

int main(void)
{
    RUN(test_dense_of_every_type);
    RUN(test_special_floats);
    RUN(test_leaves_and_tiles);
    RUN(test_constant_boxes_are_small);
    RUN(test_inactive_layer_stays_inactive);
    RUN(test_what_follows_a_scale);
    RUN(test_transforms);
    RUN(test_values_that_do_not_fit);
    RUN(test_misuse_of_the_writer);
    RUN(test_metadata_of_every_kind);
    RUN(test_metadata_lists);
    RUN(test_finding_grids);
    RUN(test_grids_beside);
    RUN(test_duplicate_names);
    RUN(test_odd_names);
    RUN(test_passing_is_exact);
    RUN(test_same_grids_same_bytes);
    RUN(test_a_stream_of_openvdb);
    RUN(test_an_instance_without_its_parent);
    RUN(test_every_type_that_is_read);
    RUN(test_half_trees_keep_their_version);
    RUN(test_unknown_types_pass);
    RUN(test_maps_that_are_not_affine);
    RUN(test_visitor_ends_the_visit);
    RUN(test_library_version);
    RUN(test_damaged_containers);
    RUN(test_damaged_trees);
    RUN(test_boxes_that_lie);
    RUN(test_boxes_too_large);
    RUN(test_damaged_files);
    RUN(test_cut_at_every_byte);
    RUN(test_overwritten_bytes);
    return test_end();
}
