/* Leaves of a VDB as they are unpacked: however inactive values were kept, whatever the compression, over threads. */
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/vdb_help.h"

static const struct {
    const char *name;
    VolVdbStore store;
    int components;
} stores[] = {{"float", VOL_STORE_FLOAT, 1}, {"half", VOL_STORE_HALF, 1}, {"double", VOL_STORE_DOUBLE, 1},
              {"int32", VOL_STORE_INT32, 1}, {"vec3s", VOL_STORE_VEC3S, 3}};
enum { STORES = sizeof stores / sizeof *stores };

/* How the inactive voxels of a leaf are filled: a background of 2 (4, 6), its negative, up to three other values. */
enum { BACKGROUND, NEGATED, BOTH, ONE, ONE_AND_BACKGROUND, ONE_AND_NEGATED, TWO, THREE, NONE_INACTIVE, ALL_INACTIVE, FILLS };

enum { LEAVES = 640, SIDE = 8 }; /* more than a thread takes at a time */

static uint32_t mix(uint32_t a, uint32_t b)
{
    uint32_t h = a * 2654435761u ^ (b + 1) * 2246822519u;
    h = (h ^ h >> 15) * 3266489917u;
    return h ^ h >> 13;
}

static bool active_at(int leaf, int n)
{
    int fill = leaf % FILLS;
    return fill == NONE_INACTIVE || (fill != ALL_INACTIVE && mix((uint32_t)leaf, (uint32_t)n) % 3 != 0);
}

/* All are exact in half and in int32. */
static double value_at(int leaf, int n, int c)
{
    int other = (int)(mix((uint32_t)n, (uint32_t)leaf + 7) % 3);
    double background = 2.0 * (c + 1);
    if (active_at(leaf, n))
        return (double)(mix((uint32_t)(leaf * 3 + c), (uint32_t)n) % 1024) - 300;
    switch (leaf % FILLS) {
    case NEGATED: return -background;
    case BOTH: return other ? background : -background;
    case ONE: return 11 + c;
    case ONE_AND_BACKGROUND: return other ? 12 + c : background;
    case ONE_AND_NEGATED: return other ? 13 + c : -background;
    case TWO: return other ? 14 + c : 33 - c;
    case THREE: return 20 + 8 * other + c;
    default: return background;
    }
}

static void origin_of(int leaf, int32_t origin[3])
{
    origin[0] = 8 * (leaf / (SIDE * SIDE)) - 16;
    origin[1] = 8 * (leaf / SIDE % SIDE) - 24;
    origin[2] = 8 * (leaf % SIDE) + 4096 - 32; /* over two nodes of the root */
}

static int leaf_at(const int32_t origin[3])
{
    return ((origin[0] + 16) / 8 * SIDE + (origin[1] + 24) / 8) * SIDE + (origin[2] - 4096 + 32) / 8;
}

static VolBytes write(VolVdbStore store, int components, VolVdbCompression compression)
{
    VolVdbWriter *writer = new_writer(compression);
    VolVdbNewGrid grid = {.name = "density", .store = store, .index_to_world = unit, .background = {2, 4, 6}};
    OK(vol_vdb_begin_grid(writer, &grid, &err));
    for (int leaf = 0; leaf < LEAVES; leaf++) {
        double values[512 * 3];
        uint64_t active[8] = {0};
        int32_t origin[3];
        for (int n = 0; n < 512; n++) {
            active[n / 64] |= (uint64_t)active_at(leaf, n) << (n % 64);
            for (int c = 0; c < components; c++)
                values[n * components + c] = value_at(leaf, n, c);
        }
        origin_of(leaf, origin);
        OK(vol_vdb_put_leaf_double(writer, origin, values, active, &err));
    }
    OK(vol_vdb_put_tile(writer, (int32_t[]){-8, 800, 0}, 8, (double[]){7, 8, 9}, true, &err));
    OK(vol_vdb_end_grid(writer, &err));
    return finish(writer);
}

/* ---- a visitor that checks each leaf ---- */

typedef struct Check {
    int components;
    pthread_mutex_t lock; /* guards what follows */
    int placed, tiles, shown[LEAVES], shown_all, wrong;
    int stop_at; /* leaf that fails; -1: none */
} Check;

static VolStatus see_leaf(void *user, const int32_t origin[3], const float *floats, const double *doubles,
                          const uint64_t active[8], VolError *e)
{
    Check *check = user;
    int leaf = leaf_at(origin), wrong = 0;
    if (leaf < 0 || leaf >= LEAVES)
        return vol_fail(e, VOL_NO, "no such leaf");
    if (leaf == check->stop_at)
        return vol_fail(e, VOL_NO, "leaf %d is not wanted", leaf);
    for (int n = 0; n < 512; n++) {
        wrong += (active[n / 64] >> (n % 64) & 1) != active_at(leaf, n);
        for (int c = 0; c < check->components; c++) {
            int i = n * check->components + c;
            wrong += (floats ? (double)floats[i] : doubles[i]) != value_at(leaf, n, c);
        }
    }
    pthread_mutex_lock(&check->lock);
    check->shown[leaf]++;
    check->shown_all++;
    check->wrong += wrong;
    pthread_mutex_unlock(&check->lock);
    return VOL_OK;
}

static VolStatus place(void *user, const int32_t origin[3], VolError *e)
{
    Check *check = user;
    (void)e;
    CHECK(leaf_at(origin) >= 0 && leaf_at(origin) < LEAVES);
    CHECK(check->shown_all == 0); /* nothing is shown before all is placed */
    check->placed++;
    return VOL_OK;
}

static VolStatus tile(void *user, const int32_t origin[3], int32_t size, const double value[3], bool active, VolError *e)
{
    Check *check = user;
    (void)e;
    check->tiles++;
    CHECK(origin[0] == -8 && origin[1] == 800 && size == 8 && active && value[0] == 7);
    CHECK(check->components == 1 ? value[1] == 0 : value[1] == 8 && value[2] == 9);
    return VOL_OK;
}

static Check new_check(int components)
{
    return (Check){.components = components, .lock = PTHREAD_MUTEX_INITIALIZER, .stop_at = -1};
}

static void visit_all(const VolVdb *vdb, int components, bool doubles, int threads)
{
    Check check = new_check(components);
    VolVdbVisitor visitor = {NULL, doubles ? NULL : see_float, doubles ? see_double : NULL, tile,
                             threads ? place : NULL, threads};
    OK(vol_vdb_visit(vdb, 0, &visitor, &check, &err));
    CHECK(check.placed == (threads ? LEAVES : 0) && check.tiles == 1 && check.wrong == 0);
    for (int leaf = 0; leaf < LEAVES; leaf++)
        CHECK(check.shown[leaf] == 1);
}

static void leaves_come_back_as_they_were(void)
{
    for (int s = 0; s < STORES; s++)
        for (VolVdbCompression compression = VOL_COMPRESS_NONE; compression <= VOL_COMPRESS_BLOSC; compression++) {
            VolBytes bytes = write(stores[s].store, stores[s].components, compression);
            VolVdb *vdb = open_copy(&bytes);
            vol_bytes_free(&bytes);
            if (!vdb)
                return;
            for (int threads = 0; threads <= 3; threads++)
                visit_all(vdb, stores[s].components, threads % 2 == 0, threads);
            vol_vdb_close(vdb);
        }
}

/* What has been used is gone, what is still to be used is not, wherever in memory the file begins. */
static void a_last_visit_gives_memory_back_behind_itself(void)
{
    enum { LARGE_PAGE = 1 << 21 };
    static const unsigned char zeros[4096];
    VolBytes bytes = write(VOL_STORE_VEC3S, 3, VOL_COMPRESS_NONE);
    CHECK(bytes.size > LARGE_PAGE);
    for (int threads = 1; threads <= 3; threads++)
        for (int aligned = 0; aligned <= 1; aligned++) {
            VolBytes copy = {aligned ? vol_alloc_aligned(LARGE_PAGE, bytes.size, 1) : malloc(bytes.size), bytes.size};
            VolVdb *vdb = NULL;
            Check check = new_check(3);
            VolVdbVisitor visitor = {NULL, see_float, NULL, tile, place, threads, true};
            memcpy(copy.data, bytes.data, bytes.size);
            OK(vol_vdb_open(copy, "test", &vdb, &err));
            OK(vol_vdb_visit(vdb, 0, &visitor, &check, &err));
            CHECK(check.placed == LEAVES && check.shown_all == LEAVES && check.tiles == 1 && check.wrong == 0);
            CHECK(memcmp(copy.data + bytes.size / 2, zeros, sizeof zeros) == 0);
            vol_vdb_close(vdb);
        }
    vol_bytes_free(&bytes);
}

static void the_first_leaf_that_fails_ends_the_visit(void)
{
    VolBytes bytes = write(VOL_STORE_FLOAT, 1, VOL_COMPRESS_ZIP);
    VolVdb *vdb = open_copy(&bytes);
    vol_bytes_free(&bytes);
    for (int threads = 0; threads <= 3; threads++) {
        Check check = new_check(1);
        VolVdbVisitor visitor = {NULL, see_float, NULL, NULL, threads ? place : NULL, threads};
        check.stop_at = 77;
        CHECK(vol_vdb_visit(vdb, 0, &visitor, &check, &err) == VOL_NO);
        CHECK_TEXT(err.text, "leaf 77 is not wanted");
    }
    vol_vdb_close(vdb);
}

/* A bit turned in a compressed block: zlib always finds it; Blosc may not, but nothing may break. */
static void damaged_blocks(void)
{
    for (VolVdbCompression compression = VOL_COMPRESS_ZIP; compression <= VOL_COMPRESS_BLOSC; compression++) {
        int damaged = 0;
        VolBytes bytes = write(VOL_STORE_DOUBLE, 1, compression);
        for (size_t n = 0; n < 60; n++) {
            size_t where = bytes.size - 1 - mix((uint32_t)n, 5) % (bytes.size / 2);
            VolBytes copy = copy_of(&bytes, bytes.size);
            VolVdb *vdb = NULL;
            Check check = new_check(1);
            VolVdbVisitor visitor = {NULL, see_float, NULL, NULL, place, 2};
            copy.data[where] ^= (unsigned char)(1u << n % 8);
            VolStatus status = vol_vdb_open(copy, "test", &vdb, &err);
            if (!status)
                status = vol_vdb_visit(vdb, 0, &visitor, &check, &err);
            CHECK(status == VOL_OK || status == VOL_BAD_INPUT);
            damaged += status && strstr(err.text, "damaged VDB 'test': grid 'density': byte ") &&
                       strstr(err.text, "a compressed block is damaged");
            vol_vdb_close(vdb);
        }
        CHECK(compression == VOL_COMPRESS_ZIP ? damaged > 40 : damaged > 0);
        vol_bytes_free(&bytes);
    }
}

int main(void)
{
    RUN(leaves_come_back_as_they_were);
    RUN(a_last_visit_gives_memory_back_behind_itself);
    RUN(the_first_leaf_that_fails_ends_the_visit);
    RUN(damaged_blocks);
    return test_end();
}
