/* base/: hash, cpu, pool, stats, plugin, memory, messages, maps. */
#include <jansson.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "base/cpu.h"
#include "base/hash.h"
#include "base/log.h"
#include "base/mem.h"
#include "base/memory.h"
#include "base/plugin.h"
#include "base/pool.h"
#include "base/printable.h"
#include "base/refusals.h"
#include "base/stats.h"
#include "base/status.h"
#include "base/vec.h"
#include "tests/unit/test.h"

/* ---- hash ---- */

static void hash_of(const void *data, size_t size, size_t piece, char hex[33])
{
    VolHash hash;
    uint64_t digest[2];
    vol_hash_begin(&hash);
    for (size_t at = 0; at < size; at += piece)
        vol_hash_add(&hash, (const char *)data + at, piece < size - at ? piece : size - at);
    vol_hash_end(&hash, digest);
    vol_hash_hex(digest, hex);
}

static void test_hash_pieces(void)
{
    unsigned char data[1000];
    char whole[33], pieces[33];
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (unsigned char)(i * i + 7);
    for (size_t size = 0; size < 70; size++)
        for (size_t piece = 1; piece < 40; piece++) {
            hash_of(data, size, 1000, whole);
            hash_of(data, size, piece, pieces);
            CHECK_TEXT(pieces, whole);
        }
    /* Written into files (UUIDs, argsHash): must never change. */
    hash_of("", 0, 1, whole);
    CHECK_TEXT(whole, "ffc7cfcc663fe2a40f401a8a72ac10fa");
    hash_of(data, sizeof data, 1000, whole);
    CHECK_TEXT(whole, "06c338e496ba844866b8e20c568072a0");
}

static int bits_set(const char *a, const char *b)
{
    int count = 0;
    for (int i = 0; i < 32; i++) {
        int x = (a[i] <= '9' ? a[i] - '0' : a[i] - 'a' + 10) ^ (b[i] <= '9' ? b[i] - '0' : b[i] - 'a' + 10);
        count += __builtin_popcount((unsigned)x);
    }
    return count;
}

/* Every bit of the input changes about half of the output's; lengths of zeros all differ. */
static void test_hash_spread(void)
{
    unsigned char data[48] = {0};
    char before[33], after[33], lengths[49][33];
    hash_of(data, sizeof data, 48, before);
    double sum = 0;
    for (size_t bit = 0; bit < 8 * sizeof data; bit++) {
        data[bit / 8] ^= (unsigned char)(1u << bit % 8);
        hash_of(data, sizeof data, 48, after);
        data[bit / 8] ^= (unsigned char)(1u << bit % 8);
        int changed = bits_set(before, after);
        sum += changed;
        if (changed < 36 || changed > 92) /* 64 +- 5 sigma */
            FAIL("bit %zu changes %d bits of 128", bit, changed);
    }
    CHECK_NEAR(sum / (8 * sizeof data), 64, 0.03, 0);
    for (size_t n = 0; n <= 48; n++) {
        hash_of(data, n, 48, lengths[n]);
        for (size_t m = 0; m < n; m++)
            CHECK(strcmp(lengths[n], lengths[m]) != 0);
    }
}

/* ---- cpu ---- */

static void test_cpu(void)
{
    VolCpu cpu = VOL_CPU_NEON;
    VolError err;
    CHECK(vol_cpu_choose("scalar", &cpu, &err) == VOL_OK && cpu == VOL_CPU_SCALAR);
    CHECK(vol_cpu_choose("auto", &cpu, &err) == VOL_OK && strstr(vol_cpu_list(), vol_cpu_name(cpu)));
    CHECK(vol_cpu_choose("sse4", &cpu, &err) == VOL_USAGE && strstr(err.text, vol_cpu_list()));
    const char *missing = strstr(vol_cpu_list(), "neon") ? "avx2" : "neon";
    CHECK(vol_cpu_choose(missing, &cpu, &err) == VOL_USAGE && strstr(err.text, vol_cpu_list()));
    CHECK(vol_thread_count(7) == 7);
    CHECK(vol_thread_count(0) >= 1 && vol_thread_count(0) <= sysconf(_SC_NPROCESSORS_ONLN));
}

/* ---- pool ---- */

enum { ITEMS = 5000 };

typedef struct Job {
    atomic_int done[ITEMS];
    atomic_int threads_seen[8];
    size_t fails_from; /* items fails_from, +3, +6.. fail */
} Job;

static VolStatus job_item(void *user, size_t index, int thread, VolError *err)
{
    Job *job = user;
    atomic_fetch_add(&job->done[index], 1);
    atomic_fetch_add(&job->threads_seen[thread], 1);
    if (index >= job->fails_from && (index - job->fails_from) % 3 == 0)
        return vol_fail(err, VOL_BAD_INPUT, "item %zu", index);
    return VOL_OK;
}

static void test_pool(void)
{
    static Job job;
    VolError err;
    for (int threads = 0; threads <= 8; threads++) {
        memset(&job, 0, sizeof job);
        job.fails_from = SIZE_MAX;
        CHECK(vol_parallel(threads, ITEMS, job_item, &job, &err) == VOL_OK);
        for (int i = 0; i < ITEMS; i++)
            if (job.done[i] != 1)
                FAIL("item %d was run %d times", i, job.done[i]);
        for (int t = threads < 1 ? 1 : threads; t < 8; t++)
            CHECK(job.threads_seen[t] == 0);
    }
    CHECK(vol_parallel(4, 0, job_item, &job, &err) == VOL_OK);
}

static void test_pool_failure(void)
{
    static Job job;
    for (int round = 0; round < 200; round++) {
        VolError err;
        memset(&job, 0, sizeof job);
        job.fails_from = (size_t)round;
        char want[32];
        snprintf(want, sizeof want, "item %d", round);
        CHECK(vol_parallel(4, ITEMS, job_item, &job, &err) == VOL_BAD_INPUT);
        CHECK_TEXT(err.text, want);
        CHECK(job.done[ITEMS - 1] == 0); /* the loop ended */
    }
}

/* ---- stats ---- */

static void test_stats(void)
{
    VolStats *stats = vol_stats_new();
    VolBytes bytes;
    VolError err;
    vol_stats_count(stats, "skipped.leaves", 3);
    vol_stats_count(stats, "skipped.leaves", 4);
    vol_stats_count(stats, "skipped.rays", UINT64_MAX);
    vol_stats_real(stats, "largest", 0.1);
    vol_stats_real(stats, "bad", NAN);
    vol_stats_text(stats, "a.b.c", "x\"y");
    vol_stats_stage(stats, "read");
    usleep(20000);
    vol_stats_stage(stats, "render");
    CHECK(vol_stats_write(stats, &bytes, &err) == VOL_OK);
    CHECK(bytes.size > 2 && bytes.data[bytes.size - 1] == '\n');
    json_t *root = json_loadb((const char *)bytes.data, bytes.size, 0, NULL), *skipped = json_object_get(root, "skipped");
    json_t *seconds = json_object_get(root, "seconds");
    CHECK(json_integer_value(json_object_get(skipped, "leaves")) == 7);
    CHECK(json_integer_value(json_object_get(skipped, "rays")) == INT64_MAX);
    CHECK_NEAR(json_real_value(json_object_get(root, "largest")), 0.1, 1e-8, 0);
    CHECK(json_is_null(json_object_get(root, "bad")));
    json_t *deep = json_object_get(json_object_get(json_object_get(root, "a"), "b"), "c");
    CHECK(json_is_string(deep) && !strcmp(json_string_value(deep), "x\"y"));
    CHECK(json_integer_value(json_object_get(root, "peak_memory_bytes")) > 100000);
    double render = json_real_value(json_object_get(seconds, "render"));
    double read = json_real_value(json_object_get(seconds, "read"));
    CHECK(render >= 0.02 && read >= 0 && json_real_value(json_object_get(seconds, "total")) >= render + read);
    json_decref(root);
    vol_bytes_free(&bytes);
    vol_stats_free(stats);
}

static void test_stats_none(void)
{
    VolBytes bytes;
    vol_stats_count(NULL, "a", 1);
    vol_stats_real(NULL, "a", 1);
    vol_stats_text(NULL, "a", "b");
    vol_stats_stage(NULL, "a");
    vol_stats_free(NULL);
    CHECK(vol_stats_write(NULL, &bytes, NULL) == VOL_OK && bytes.size == 0);
}

/* ---- plugin ---- */

static void test_plugin_missing(void)
{
    const void *table = NULL;
    VolError err;
    CHECK(vol_plugin("nosuch", &table, &err) == VOL_BAD_INPUT);
    CHECK(strstr(err.text, "'nosuch'") && strstr(err.text, "pellucid-nosuch.so") && strstr(err.text, "No such file"));
    setenv("PELLUCID_ADAPTERS", "/nowhere", 1);
    CHECK(vol_plugin("nosuch", &table, &err) == VOL_BAD_INPUT && strstr(err.text, "/nowhere/pellucid-nosuch.so"));
    unsetenv("PELLUCID_ADAPTERS");
}

/* ---- memory ---- */

static void test_memory(void)
{
    CHECK(vol_alloc(SIZE_MAX / 2, 3) == NULL);
    CHECK(vol_alloc_zero(SIZE_MAX / 2, 3) == NULL);
    CHECK(vol_alloc_aligned(64, SIZE_MAX / 2, 3) == NULL);
    CHECK(vol_resize(NULL, SIZE_MAX / 2, 3) == NULL);
    void *empty = vol_alloc(0, 8), *aligned = vol_alloc_aligned(64, 3, 5);
    CHECK(empty && aligned && (uintptr_t)aligned % 64 == 0);
    free(empty);
    free(aligned);
    unsigned char *large = vol_alloc(5, 1 << 20);
    CHECK(large && (uintptr_t)large % (1 << 21) == 0);
    memset(large, 7, 5 << 20);
    large = vol_resize(large, 9, 1 << 20);
    CHECK(large && large[0] == 7 && large[(5 << 20) - 1] == 7);
    memset(large + (5 << 20), 8, 4 << 20);
    large = vol_resize(large, 5, 1 << 20);
    CHECK(large && large[0] == 7 && large[(5 << 20) - 1] == 7);
    free(large);
    unsigned char *used = vol_alloc(1, 7 << 18); /* its place is likely to be given out again */
    CHECK(used && (uintptr_t)used % (1 << 21) == 0);
    memset(used, 9, 7 << 18);
    free(used);
    unsigned char *zero = vol_alloc_zero(1, 7 << 18);
    CHECK(zero && zero[0] == 0 && memcmp(zero, zero + 1, (7 << 18) - 1) == 0);
    free(zero);
    char *text = vol_format_text("%s-%d", "a", 5);
    CHECK_TEXT(text, "a-5");
    free(text);
}

static void test_bytes(void)
{
    VolBytes bytes = {0};
    size_t capacity = 0;
    for (int i = 0; i < 1000; i++)
        CHECK(vol_bytes_append(&bytes, &capacity, "abc", 3, NULL) == VOL_OK);
    CHECK(bytes.size == 3000 && capacity >= 3000 && !memcmp(bytes.data + 2997, "abc", 3));
    CHECK(vol_bytes_append(&bytes, &capacity, "", SIZE_MAX, NULL) == VOL_NOMEM);
    vol_bytes_free(&bytes);
    CHECK(!bytes.data && !bytes.size);
}

/* ---- messages ---- */

static void remember(void *user, VolSeverity severity, const char *line)
{
    snprintf(user, 100, "%d %s", (int)severity, line);
}

static void test_messages(void)
{
    VolError err = {""};
    CHECK(vol_fail(&err, VOL_NO, "bad '%s'", "a\nb\033") == VOL_NO);
    CHECK_TEXT(err.text, "bad 'a\\x0ab\\x1b'");
    CHECK(vol_fail_within(&err, VOL_IO, "line %d", 3) == VOL_IO);
    CHECK_TEXT(err.text, "line 3: bad 'a\\x0ab\\x1b'");
    CHECK(vol_fail(NULL, VOL_NOMEM, "x") == VOL_NOMEM);
    char said[100] = "";
    VolLog log = {remember, said}, mute = {NULL, NULL};
    vol_warn(&log, "%d leaves", 3);
    CHECK_TEXT(said, "1 3 leaves");
    vol_note(&log, "x");
    CHECK_TEXT(said, "0 x");
    vol_warn(&mute, "y");
    vol_warn(NULL, "y");
    CHECK_TEXT(said, "0 x");
}

static void check_printable(const char *text, const char *want)
{
    char once[64], twice[64];
    CHECK(vol_printable(once, sizeof once, text) == strlen(want));
    CHECK_TEXT(once, want);
    vol_printable(twice, sizeof twice, once);
    CHECK_TEXT(twice, want);
}

static void test_printable(void)
{
    check_printable("", "");
    check_printable("a \\ ~", "a \\ ~");
    check_printable("\303\251 \342\202\254 \360\237\214\212", "\303\251 \342\202\254 \360\237\214\212");
    check_printable("\001\t\n\r\033\177", "\\x01\\x09\\x0a\\x0d\\x1b\\x7f");
    check_printable("\377\200a", "\\xff\\x80a");
    check_printable("\302\233m \302\240", "\\xc2\\x9bm \302\240");           /* CSI; a space that does not break */
    check_printable("\300\257 \301\277", "\\xc0\\xaf \\xc1\\xbf");           /* longer than they need be */
    check_printable("\340\200\257", "\\xe0\\x80\\xaf");
    check_printable("\360\200\200\257", "\\xf0\\x80\\x80\\xaf");
    check_printable("\355\240\200", "\\xed\\xa0\\x80");                      /* half a pair */
    check_printable("\364\220\200\200", "\\xf4\\x90\\x80\\x80");             /* beyond the last */
    check_printable("\303", "\\xc3");
    check_printable("\342\202x", "\\xe2\\x82x");
    check_printable("\360\237\214", "\\xf0\\x9f\\x8c");
    char small[6];
    CHECK(vol_printable(small, sizeof small, "abc\303\251d") == 5);
    CHECK_TEXT(small, "abc\303\251");
    CHECK(vol_printable(small, sizeof small, "abcd\303\251") == 4);
    CHECK(vol_printable(small, sizeof small, "ab\377") == 2);
    CHECK(vol_printable(small, 1, "ab") == 0);
}

/* ---- maps ---- */

static void test_affine(void)
{
    VolAffine a = {{{2, 0.5, 0}, {0, 3, 0.25}, {0.1, 0, 1}, {7, -2, 5}}}, inverse;
    CHECK(vol_affine_invert(&a, &inverse));
    VolVec3 p = vol_vec3(1.5, -2.25, 3), back = vol_apply(&inverse, vol_apply(&a, p));
    CHECK_NEAR(back.x, p.x, 1e-14, 0);
    CHECK_NEAR(back.y, p.y, 1e-14, 0);
    CHECK_NEAR(back.z, p.z, 1e-14, 0);
    CHECK_NEAR(vol_affine_determinant(&a), 2 * 3 * 1 + 0.5 * 0.25 * 0.1, 1e-15, 0);
    CHECK_NEAR(vol_affine_voxel(&a), sqrt(1.01), 1e-15, 0);
    VolAffine flat = {{{1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 0}}};
    CHECK(!vol_affine_invert(&flat, &inverse));
}

/* ---- what is left of memory ---- */

static void write_line(const char *folder, const char *name, const char *line)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    CHECK(file && fputs(line, file) >= 0 && fclose(file) == 0);
}

static void test_memory_left(void)
{
    char folder[] = "/tmp/pellucid-group-XXXXXX", remove[64];
    VolError err = {""};
    CHECK(mkdtemp(folder) != NULL);
    CHECK(isinf(vol_group_memory_left(folder))); /* nothing tells */
    write_line(folder, "memory.limit_in_bytes", "9223372036854771712\n");
    write_line(folder, "memory.usage_in_bytes", "1000\n");
    CHECK(isinf(vol_group_memory_left(folder)));
    write_line(folder, "memory.limit_in_bytes", "5000\n");
    CHECK(vol_group_memory_left(folder) == 4000);
    write_line(folder, "memory.max", "max\n");
    CHECK(vol_group_memory_left(folder) == 4000);
    write_line(folder, "memory.max", "8000\n");
    write_line(folder, "memory.current", "7000\n");
    CHECK(vol_group_memory_left(folder) == 1000);
    write_line(folder, "memory.stat", "anon 100\ninactive_file 500\nactive_file 20\nfile 90000\n");
    CHECK(vol_group_memory_left(folder) == 1520);
    write_line(folder, "memory.current", "9000\n");
    CHECK(vol_group_memory_left(folder) == 0);
    snprintf(remove, sizeof remove, "rm -r %s", folder);
    CHECK(system(remove) == 0);

    CHECK(vol_memory_available() > 0);
    CHECK(vol_check_memory(1, &err) == VOL_OK);
    CHECK(vol_check_memory(3.4e18, &err) == VOL_NOMEM);
    CHECK(strncmp(err.text, "about 3.4 EB of memory are needed, ", 35) == 0);
    CHECK(vol_alloc(SIZE_MAX / 4, 1) == NULL && vol_refusals() > 0);
}

/* ulimit -v and -d, less what the process has already. */
static void test_limits(void)
{
#ifdef __SANITIZE_ADDRESS__
    SKIP("AddressSanitizer ends where it gets no memory");
#else
    static const int kinds[] = {RLIMIT_AS, RLIMIT_DATA};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        struct rlimit before, low;
        VolError err;
        CHECK(getrlimit(kinds[i], &before) == 0);
        size_t taken = (size_t)60 << 20, limit = (size_t)100 << 20;
        low = before;
        low.rlim_cur = limit;
        void *block = mmap(NULL, taken, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        CHECK(block != MAP_FAILED);
        CHECK(setrlimit(kinds[i], &low) == 0);
        double left = vol_memory_available();
        VolStatus status = vol_check_memory(50e6, &err);
        CHECK(setrlimit(kinds[i], &before) == 0);
        CHECK(left <= (double)(limit - taken) && (left > 0 || kinds[i] == RLIMIT_AS));
        CHECK(status == VOL_NOMEM);
        munmap(block, taken);
    }
#endif
}

int main(void)
{
    RUN(test_hash_pieces);
    RUN(test_hash_spread);
    RUN(test_cpu);
    RUN(test_pool);
    RUN(test_pool_failure);
    RUN(test_stats);
    RUN(test_stats_none);
    RUN(test_plugin_missing);
    RUN(test_memory);
    RUN(test_memory_left);
    RUN(test_bytes);
    RUN(test_messages);
    RUN(test_printable);
    RUN(test_affine);
    RUN(test_limits);
    return test_end();
}
