/* Tables of every cpu level against each other.
 *
 *     test_preint_levels [--seed N]    random transfer functions N+1, N+2, ... (default 0; a failure names its seed)
 *     test_preint_levels --bench       milliseconds of building, against the scalar level */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/cpu.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"
#include "tests/unit/tf_help.h"
#include "tf/preint.h"
#include "tf/preint_private.h"

enum { TABLES = 300 };

static uint64_t first_seed;

static VolCpu best_level(void)
{
    VolCpu best;
    if (vol_cpu_choose("auto", &best, NULL))
        abort();
    return best;
}

static VolTfCompiled compiled_from(const char *text)
{
    VolTf tf;
    VolTfCompiled compiled;
    VolBytes bytes = {(unsigned char *)(uintptr_t)text, strlen(text)};
    if (vol_tf_parse(&bytes, "random", &tf, NULL, NULL) || vol_tf_compile(&tf, NULL, &compiled, NULL))
        abort();
    vol_tf_free(&tf);
    return compiled;
}

static VolPreint built(const VolTfCompiled *tf, VolPreintOptions options, VolCpu cpu, int threads)
{
    VolPreint tables;
    options.cpu = cpu;
    options.threads = threads;
    if (vol_preint_build(tf, &options, &tables, NULL))
        abort();
    return tables;
}

/* Few nodes and many, an even number and an odd one, bands, steps from almost nothing to what lets no light through, ranges
 * beyond all knots. */
static VolPreintOptions random_options(Random *r, const VolTfCompiled *tf)
{
    VolPreintOptions options = {.n = (size_t)(2 + random_below(r, random_below(r, 2) ? 8 : 200)), .change = INFINITY,
                                .step = exp2(random_in(r, -12, 10)), .octaves = (size_t)(1 + random_below(r, 3))};
    vol_preint_default_range(tf, &options.lo, &options.hi);
    double width = options.hi - options.lo;
    if (random_below(r, 3) == 0) {
        options.lo += random_in(r, -0.5, 0.4) * width;
        options.hi += random_in(r, -0.4, 0.5) * width;
    }
    if (random_below(r, 3) == 0)
        options.change = random_in(r, 0, 0.3) * width;
    return options;
}

static void compare_tables(uint64_t seed, const VolPreint *a, const VolPreint *b, const char *what)
{
    for (size_t o = 0; o < a->octave_count; o++) {
        size_t rows = a->octaves[o].band + 1, entries = rows * a->n - rows * (rows - 1) / 2;
        CHECK(b->octaves[o].band == a->octaves[o].band);
        for (int way = 0; way < 2; way++) {
            const float *x = way ? a->octaves[o].falling : a->octaves[o].rising;
            const float *y = way ? b->octaves[o].falling : b->octaves[o].rising;
            for (size_t i = 0; i < entries * a->floats; i++)
                if (memcmp(&x[i], &y[i], sizeof *x) != 0)
                    FAIL("seed %d octave %d way %d float %zu of %zu: %.9g, %.9g by %s", (int)seed, (int)o, way, i,
                         entries * a->floats, (double)x[i], (double)y[i], what);
        }
    }
}

static void every_level_gives_the_same_bytes(void)
{
    size_t shown = 0, all = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + TABLES; seed++) {
        Random r = {seed};
        char text[16384];
        random_tf(&r, 0, 0, text, sizeof text);
        VolTfCompiled tf = compiled_from(text);
        VolPreintOptions options = random_options(&r, &tf);
        VolPreint scalar = built(&tf, options, VOL_CPU_SCALAR, 1), best = built(&tf, options, best_level(), 1);
        VolPreint threads = built(&tf, options, best_level(), 1 + random_below(&r, 8));
        compare_tables(seed, &scalar, &best, vol_cpu_name(best_level()));
        compare_tables(seed, &scalar, &threads, "several threads");
        const float *last = vol_preint_entry(&scalar, &scalar.octaves[0], 0, scalar.octaves[0].band);
        for (size_t f = 0; f < scalar.floats; f++, all++)
            shown += last[f] > 0 && isfinite(last[f]);
        vol_preint_free(&scalar);
        vol_preint_free(&best);
        vol_preint_free(&threads);
        vol_tf_compiled_free(&tf);
    }
    printf("# %zu of %zu numbers looked at are above 0\n", shown, all);
    CHECK(shown > all / 4); /* tables of nothing would compare well */
}

static bool same_states(const State *a, const State *b, size_t count, size_t lights)
{
    for (size_t i = 0; i < count; i++)
        if (memcmp(&a[i].t, &b[i].t, sizeof a->t) != 0 || memcmp(a[i].light, b[i].light, lights * sizeof *a->light) != 0)
            return false;
    return true;
}

/* Floats hide most of what doubles differ in: the states that diagonals are made of, to the last bit. */
static void every_level_works_with_the_same_doubles(void)
{
    VolPreintDiagonal *fast = vol_preint_diagonal;
#if defined(__x86_64__)
    if (vol_cpu_runs_avx2(best_level()))
        fast = vol_preint_diagonal_avx2;
#endif
    for (uint64_t seed = first_seed + 1; seed <= first_seed + TABLES; seed++) {
        Random r = {seed};
        char text[16384];
        VolPreint tables;
        Bins bins;
        random_tf(&r, 0, 0, text, sizeof text);
        VolTfCompiled tf = compiled_from(text);
        VolPreintOptions options = random_options(&r, &tf);
        VolPreintCut how = {(size_t)(1 + random_below(&r, 5)), random_below(&r, 2) ? SIZE_MAX : 0};
        size_t n = options.n, k = 1 + (size_t)random_below(&r, (int)n - 1);
        options.change = INFINITY;
        State *a = vol_alloc_aligned(64, 4 * n, sizeof *a), *b = a + 2 * n;
        if (!a || vol_preint_allocate(&tf, &options, NULL, &tables, NULL) || vol_preint_bins(&tables, 0, how, &bins, NULL))
            abort();
        vol_preint_diagonal(&tables, &tables.octaves[0], &bins, k, 0, a, a + n);
        fast(&tables, &tables.octaves[0], &bins, k, 0, b, b + n);
        size_t lights = tf.coloured ? 1 : 2;
        if (!same_states(a, b, n - 1, lights))
            FAIL("seed %d: leaves differ on diagonal %zu of %zu nodes", (int)seed, k, n);
        if (!same_states(a + n, b + n, k, lights))
            FAIL("seed %d: suffixes differ on diagonal %zu of %zu nodes", (int)seed, k, n);
        free(a);
        vol_preint_bins_free(&bins);
        vol_preint_free(&tables);
        vol_tf_compiled_free(&tf);
    }
}

/* ---- Bench ---- */

static double milliseconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static void bench(void)
{
    static const char *const texts[][2] = {
        {"grey", HEAD ", \"scatter\": [[0, 0], [0.4, 0.2, [0.1, 0.5, 1]], [1, 0.1]], "
                      "\"surface\": [[0.3, 0], [0.5, 0.3, [1, 0.5, 0]], [1, 0.1]]}"},
        {"coloured", HEAD ", \"scatter\": [[0, 0], [1, 0.2]], \"absorb\": [[0, 0.1, [1, 0, 0]], [1, 0.3, [0, 0.5, 1]]], "
                          "\"surface\": [[0.3, 0], [0.5, 0.3, [1, 0.5, 0]], [1, 0.1]]}"}};
    const VolCpu level[2] = {best_level(), VOL_CPU_SCALAR};
    for (int i = 0; i < 2; i++)
        for (size_t n = 256; n <= 1024; n *= 4) {
            VolTfCompiled tf = compiled_from(texts[i][1]);
            VolPreintOptions options = {.hi = 1, .n = n, .step = 0.5, .octaves = 1, .change = INFINITY};
            double least[2] = {INFINITY, INFINITY};
            for (int run = 0; run < 20; run++)
                for (int l = 0; l < 2; l++) {
                    double begin = milliseconds(CLOCK_PROCESS_CPUTIME_ID);
                    VolPreint tables = built(&tf, options, level[l], 1);
                    vol_preint_free(&tables);
                    least[l] = fmin(least[l], milliseconds(CLOCK_PROCESS_CPUTIME_ID) - begin);
                }
            printf("%-8s %4zu nodes %7.2f ms of one processor, scalar %7.2f: %4.1f times\n", texts[i][0], n, least[0],
                   least[1], least[1] / least[0]);
            vol_tf_compiled_free(&tf);
        }
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--bench") == 0) {
        bench();
        return 0;
    }
    if (argc == 3 && strcmp(argv[1], "--seed") == 0)
        first_seed = strtoull(argv[2], NULL, 10);
    printf("# seeds from %llu\n", (unsigned long long)first_seed + 1);
    RUN(every_level_gives_the_same_bytes);
    RUN(every_level_works_with_the_same_doubles);
    return test_end();
}
