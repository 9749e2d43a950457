/* Analytic fields: values against closed forms, noise's laws, and the grids written from them. */
#include "test.h"

#include <stdlib.h>

#include "base/fmath.h"
#include "procedural/field_vdb.h"
#include "procedural/noise.h"

static VolFieldCase make(const char *name, const char *const *assignments)
{
    VolFieldCase field = {0};
    VolError err = {""};
    if (vol_field_find(name, &field, &err))
        FAIL("%s", err.text);
    for (; assignments && *assignments; assignments++)
        if (vol_field_set(&field, *assignments, &err))
            FAIL("%s", err.text);
    return field;
}

static double at(const char *name, const char *const *assignments, double x, double y, double z)
{
    VolFieldCase field = make(name, assignments);
    return field.field ? vol_field_value(&field, vol_vec3(x, y, z)) : NAN;
}

static void test_simple_fields(void)
{
    CHECK_NEAR(at("constant", (const char *[]){"value=0.3", NULL}, 5, 6, 7), 0.3, 0, 0);
    CHECK_NEAR(at("ramp", (const char *[]){"gx=2", "gy=-1", "gz=3", "offset=0.5", NULL}, 1, 2, 3), 9.5, 0, 0);
    CHECK_NEAR(at("radius", NULL, 3, 4, 12), 13, 0, 0);
    CHECK_NEAR(at("radius", (const char *[]){"cx=3", "radius=5", NULL}, 3, 4, 0), -1, 0, 0);
    CHECK_NEAR(at("r2", NULL, 1, 2, 3), 14, 0, 0);
    CHECK_NEAR(at("gaussian", (const char *[]){"s=0.5", "value=3", NULL}, 0, 0.5, 0), 3 * exp(-0.5), 1e-15, 0);
    CHECK_NEAR(at("atmosphere", (const char *[]){"t0=0", "height=0.5", "value=2", NULL}, 9, 9, 1), 2 * exp(-2),
               1e-15, 0);
    CHECK_NEAR(at("atmosphere", (const char *[]){"axis=0", "t0=0", "height=0.5", NULL}, 1, 9, 9), exp(-2), 1e-15,
               0);
    CHECK_NEAR(at("wave", (const char *[]){"kx=3", "value=2", "offset=1", NULL}, 1e6 + 0.5, 0, 0), -1, 0, 1e-12);
}

static void test_steps(void)
{
    CHECK_NEAR(at("sphere", NULL, 0.75, 0, 0), 1, 0, 0);
    CHECK_NEAR(at("sphere", NULL, 0.7500001, 0, 0), 0, 0, 0);
    const char *const soft[] = {"radius=1", "edge=0.5", "value=4", NULL};
    CHECK_NEAR(at("sphere", soft, 1, 0, 0), 2, 0, 0);
    CHECK_NEAR(at("sphere", soft, 0.75, 0, 0), 4, 0, 0);
    CHECK_NEAR(at("sphere", soft, 0, 1.25, 0), 0, 0, 0);
    CHECK_NEAR(at("torus", (const char *[]){"edge=0", NULL}, 0.6, 0, 0.25), 1, 0, 0);
    CHECK_NEAR(at("torus", (const char *[]){"edge=0", NULL}, 0, 0, 0), 0, 0, 0);
    CHECK_NEAR(at("slab", NULL, 0, 0, 0.5), 1, 0, 0);
    CHECK_NEAR(at("slab", NULL, 0, 0, 0.51), 0, 0, 0);
    const char *const three[] = {"start=0",  "length1=1", "value1=1", "length2=0.5",
                                 "value2=2", "length3=2", "value3=3", NULL};
    const double z[] = {-0.1, 0, 0.99, 1, 1.49, 1.5, 3.49, 3.5}, want[] = {0, 1, 1, 2, 2, 3, 3, 0};
    for (int i = 0; i < 8; i++)
        CHECK_NEAR(at("slabs", three, 0, 0, z[i]), want[i], 0, 0);
}

/* Where the formula gives round numbers, and one place more. */
static void test_marschner_lobb(void)
{
    CHECK_NEAR(at("marschner-lobb", NULL, 0, 0, 0), 0.6, 1e-15, 0); /* rho(0) = cos 12 pi = 1 */
    CHECK_NEAR(at("marschner-lobb", NULL, 0, 0, 1), 0.2, 1e-15, 0);
    CHECK_NEAR(at("marschner-lobb", NULL, 0, 0, -1), 1, 1e-15, 0);
    CHECK_NEAR(at("marschner-lobb", NULL, 1, 0, 0), 0.6, 1e-14, 0); /* rho(1) = cos 0 = 1 */
    double r = 0.3, rho = cos(2 * 3.14159265358979323846 * 6 * cos(3.14159265358979323846 * r / 2));
    CHECK_NEAR(at("marschner-lobb", NULL, 0, r, 0), (1 + 0.25 * (1 + rho)) / 2.5, 1e-13, 0);
}

static void test_noise(void)
{
    double lo = 1, hi = -1, sum = 0;
    for (int i = 0; i < 20000; i++) {
        VolVec3 x = {i * 0.173 - 900, i * 0.31 - 3000, i * 0.057};
        double v = vol_noise(7, x);
        lo = fmin(lo, v);
        hi = fmax(hi, v);
        sum += v;
    }
    CHECK(lo >= -1 && hi <= 1 && lo < -0.6 && hi > 0.6);
    CHECK_NEAR(sum / 20000, 0, 0, 0.02);
    CHECK(vol_noise(7, vol_vec3(3, -4, 5)) == 0);
    CHECK(vol_noise(7, vol_vec3(0.3, 0.4, 0.5)) != vol_noise(8, vol_vec3(0.3, 0.4, 0.5)));
    CHECK(vol_noise(7, vol_vec3(1e300, 0, 0)) == 0);
    /* C2: across a cell's face value and first differences agree. */
    double h = 1e-5, before = vol_noise(1, vol_vec3(2 - h, 0.3, 0.7)), here = vol_noise(1, vol_vec3(2, 0.3, 0.7)),
           after = vol_noise(1, vol_vec3(2 + h, 0.3, 0.7));
    CHECK_NEAR(after - here, here - before, 0, 1e-9);
    /* The sum stays within its bound and its first octave is the noise itself. */
    CHECK(vol_fbm(3, vol_vec3(0.1, 0.2, 0.3), 1, 2, 0.5) == vol_noise(3, vol_vec3(0.1, 0.2, 0.3)));
}

/* Pinned bits: a change of the noise changes every volume made with it. */
static void test_noise_is_pinned(void)
{
    CHECK_NEAR(vol_noise(0, vol_vec3(0.25, 0.5, 0.75)), 0.033084392547607422, 0, 0);
    CHECK_NEAR(vol_fbm(42, vol_vec3(-1.3, 2.7, 0.1), 5, 2, 0.5), -0.088311822207055274, 0, 0);
}

static void test_errors(void)
{
    VolFieldCase field;
    VolError err = {""};
    CHECK(vol_field_find("teapot", &field, &err) == VOL_USAGE);
    CHECK(strstr(err.text, "marschner-lobb") != NULL);
    CHECK(vol_field_find("gaussian", &field, &err) == VOL_OK);
    CHECK(vol_field_set(&field, "radius=1", &err) == VOL_USAGE);
    CHECK(strstr(err.text, "there are cx, cy, cz, s, value") != NULL);
    CHECK(vol_field_set(&field, "s=0", &err) == VOL_USAGE);
    CHECK(vol_field_set(&field, "s=1e999", &err) == VOL_USAGE);
    CHECK(vol_field_set(&field, "s=1x", &err) == VOL_USAGE);
    CHECK(vol_field_set(&field, "s", &err) == VOL_USAGE);
    CHECK(vol_field_find("noise", &field, &err) == VOL_OK);
    CHECK(vol_field_set(&field, "octaves=2.5", &err) == VOL_USAGE);
}

static void test_extent(void)
{
    const int32_t dims[3] = {5, 1, 2};
    VolAffine a = vol_field_extent(dims, vol_vec3(-1, 2, 0), vol_vec3(1, 6, 3));
    VolVec3 first = vol_apply(&a, vol_vec3(0, 0, 0)), last = vol_apply(&a, vol_vec3(4, 0, 1));
    CHECK(first.x == -1 && first.y == 4 && first.z == 0);
    CHECK(last.x == 1 && last.y == 4 && last.z == 3);
    CHECK(a.m[1][1] == 4);
}

/* ---- The grid ---- */

typedef struct Seen {
    const VolFieldCase *field;
    VolAffine transform;
    uint64_t active, wrong;
    VolVdbGridInfo info;
} Seen;

static VolStatus see_begin(void *user, const VolVdbGridInfo *info, VolError *err)
{
    (void)err;
    ((Seen *)user)->info = *info;
    return VOL_OK;
}

static VolStatus see_leaf(void *user, const int32_t origin[3], const double *values, const uint64_t active[8],
                          VolError *err)
{
    (void)err;
    Seen *seen = user;
    for (int n = 0; n < 512; n++) {
        if (!(active[n / 64] >> n % 64 & 1))
            continue;
        VolVec3 x =
            vol_apply(&seen->transform, vol_vec3(origin[0] + n / 64, origin[1] + n / 8 % 8, origin[2] + n % 8));
        seen->active++;
        seen->wrong += values[n] == vol_field_value(seen->field, x) ? 0 : 1;
    }
    return VOL_OK;
}

static VolStatus see_tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active,
                          VolError *err)
{
    (void)user, (void)origin, (void)size, (void)value, (void)active;
    return vol_fail(err, VOL_BAD_INPUT, "unexpected tile");
}

static VolBytes write_box(const VolFieldCase *field, const VolFieldBox *box, int threads)
{
    VolVdbWriter *writer = NULL;
    VolFieldCounts counts;
    VolBytes bytes = {0};
    VolError err = {""};
    if (vol_vdb_writer_new(VOL_COMPRESS_BLOSC, &writer, &err) ||
        vol_field_write(field, box, threads, writer, &counts, &err) || vol_vdb_finish(writer, &bytes, &err))
        FAIL("%s", err.text);
    vol_vdb_writer_free(writer);
    return bytes;
}

static Seen read_back(VolBytes bytes, const VolFieldCase *field, VolVdbMetaList *meta)
{
    VolVdb *vdb = NULL;
    VolError err = {""};
    Seen seen = {.field = field};
    const VolVdbVisitor visitor = {.begin = see_begin, .leaf_double = see_leaf, .tile = see_tile};
    if (vol_vdb_open(bytes, "test", &vdb, &err)) {
        FAIL("%s", err.text);
        return seen;
    }
    seen.transform = vol_vdb_entry(vdb, 0)->index_to_world;
    if (vol_meta_copy(meta, &vol_vdb_entry(vdb, 0)->meta, &err) || vol_vdb_visit(vdb, 0, &visitor, &seen, &err))
        FAIL("%s", err.text);
    vol_vdb_close(vdb);
    return seen;
}

static void test_dense_grid(void)
{
    VolFieldCase field = make("noise", NULL);
    VolFieldBox box = {.grid = "density", .dims = {9, 16, 3}, .store = VOL_STORE_DOUBLE};
    box.index_to_world =
        (VolAffine){{{0.5, 0.1, 0}, {0, 0.25, 0}, {0, 0.3, -1}, {1, 2, 3}}}; /* sheared, mirrored */
    VolBytes one = write_box(&field, &box, 1), two = write_box(&field, &box, 2);
    CHECK(one.size == two.size && memcmp(one.data, two.data, one.size) == 0);
    vol_bytes_free(&two);
    VolVdbMetaList meta = {0};
    Seen seen = read_back(one, &field, &meta);
    CHECK(memcmp(&seen.transform, &box.index_to_world, sizeof seen.transform) == 0);
    CHECK(seen.active == 9 * 16 * 3 && seen.wrong == 0);
    CHECK(seen.info.value == VOL_VALUE_DOUBLE);
    int32_t v[3] = {0};
    const VolVdbMeta *last = vol_meta_find(&meta, "vol:domainMax");
    CHECK(last && vol_meta_vec3i(last, v) && v[0] == 8 && v[1] == 15 && v[2] == 2);
    CHECK(vol_meta_find(&meta, "vol:domain") != NULL);
    vol_meta_free(&meta);
}

static void test_sparse_grid(void)
{
    VolFieldCase field = make("gaussian", (const char *[]){"s=0.1", NULL});
    VolFieldBox box = {
        .grid = "density", .dims = {64, 64, 64}, .store = VOL_STORE_DOUBLE, .sparse = true, .threshold = 1e-3};
    box.index_to_world = vol_field_extent(box.dims, vol_vec3(-1, -1, -1), vol_vec3(1, 1, 1));
    VolVdbMetaList meta = {0};
    Seen seen = read_back(write_box(&field, &box, 2), &field, &meta);
    CHECK(seen.wrong == 0);
    /* The value exceeds the threshold for r < 0.3717 = 11.71 voxels around 31.5.  Of the 4^3 leaves around the
     * centre those with two or three far coordinates begin at sqrt(2 8.5^2 + 0.5^2) = 12.03 voxels: 8 corners and
     * 24 edges fall out. */
    CHECK(seen.active == 32 * 512);
    CHECK(vol_meta_find(&meta, "vol:domain") == NULL);
    vol_meta_free(&meta);
}

int main(void)
{
    RUN(test_simple_fields);
    RUN(test_steps);
    RUN(test_marschner_lobb);
    RUN(test_noise);
    RUN(test_noise_is_pinned);
    RUN(test_errors);
    RUN(test_extent);
    RUN(test_dense_grid);
    RUN(test_sparse_grid);
    return test_end();
}
