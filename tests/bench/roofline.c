/* What this machine can do at best for a ray marcher:  roofline [RUNS]
 *
 * One line per kernel and number of threads (1, 2): name, threads, rate of all threads together, unit.  The rate is the
 * median of RUNS runs (default 7) after one that does not count.
 *
 *   dram-read        GB/s   8-wide loads over 512 MiB with software prefetch
 *   exp              G/s    exp by range reduction and a polynomial of degree 5, relative error 2e-7
 *   sample-pairs     M/s    trilinear samples of a volume of 32^3 floats (128 KiB: stays in the second-level cache); two
 *                           neighbours in x come with one 64-bit load
 *   sample-gathers   M/s    the same by eight gathers
 *   classify         M/s    sample-pairs, a look-up in a transfer function of 1024 RGBA entries, and `over`
 *   preintegrated    M/s    sample-pairs, a look-up in a table of 256 x 256 RGBA entries (1 MiB) by the values at the front
 *                           and the back of each step, and `over`
 *   march-pairs      M/s    trilinear samples of a volume of 256^3 floats (64 MiB), x fastest, in no other order
 *   march-gathers    M/s    the same by eight gathers
 *
 * A packet is eight neighbouring rays, 0.21 voxel apart, marched half a voxel at a time along a random axis, a little
 * oblique, from face to face: 2 (side - 2) steps that all lie inside.  Each step of each ray is one sample; nothing is
 * skipped or cut short, nothing is shaded.  What is found in the tables is what one step adds: no exp is needed per
 * sample.  Half of a volume's values are smooth, half noise, so that looks into the tables lie as far apart as in
 * pictures of noisy data. */
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if defined __x86_64__ && !defined ROOFLINE_PLAIN /* which can be defined to try the C kernels */
#include <immintrin.h>
#define HAVE_AVX2 1
#define AVX2 __attribute__((target("avx2,fma")))
#define AVX2_INLINE AVX2 __attribute__((always_inline)) static inline
#endif
#define INLINE __attribute__((always_inline)) static inline

enum { DENSE = 256, CACHED = 32, ENTRIES = 1024, NODES = 256, MOST_RUNS = 99 };
static const size_t BIG = (size_t)1 << 27; /* floats: 512 MiB */

static float *dense, *cached, *big, *line, *square;

typedef enum Load { PAIRS, GATHERS } Load;
typedef enum Classify { NONE, LINE, SQUARE } Classify;

/* A kernel does at least `work` units as thread `id` of `threads`; it returns how many it did and what it found, which
 * must be used somewhere lest the compiler leaves the work out. */
typedef double Kernel(int id, int threads, double work, float *found);

static uint32_t next_random(uint32_t *state) { return *state = *state * 1664525u + 1013904223u; }
static float next_fraction(uint32_t *state) { return (float)(next_random(state) >> 8) * (1.0f / 16777216.0f); }

/* Where the first ray of a packet begins, how rays lie beside each other, and how far a step goes, in voxels.  Along the
 * main axis 0.01 + (2 (side - 2) - 1) / 2 < side - 2; across it side / 2 - 4 + 7 x 0.21 + 0.2 x 2 (side - 2) < side - 2. */
typedef struct Packet {
    float start[3], beside[3], step[3];
} Packet;

static Packet next_packet(uint32_t *state, int side)
{
    Packet packet;
    int main_axis = (int)((next_random(state) >> 10) % 3);
    for (int k = 0; k < 3; k++) {
        float slope = next_fraction(state), place = next_fraction(state);
        packet.step[k] = k == main_axis ? 0.5f : 0.2f * slope;
        packet.start[k] = k == main_axis ? 0.01f : place * ((float)side * 0.5f - 4);
        packet.beside[k] = k == main_axis ? 0 : 0.21f;
    }
    return packet;
}

/* ---- plain C, where there is no AVX2 ------------------------------------------------------------------------------- */

static double plain_read(int id, int threads, double work, float *found)
{
    size_t share = BIG / (size_t)threads / 8 * 8;
    const float *from = big + share * (size_t)id;
    float sums[8] = {0};
    double done = 0;
    for (; done < work; done += (double)share * 4)
        for (size_t i = 0; i < share; i += 8)
            for (int k = 0; k < 8; k++)
                sums[k] += from[i + (size_t)k];
    for (int k = 0; k < 8; k++)
        *found += sums[k];
    return done;
}

INLINE float plain_exp1(float x)
{
    float t = fmaxf(x, -87) * 1.44269504f, whole = nearbyintf(t), f = t - whole;
    float p = ((((1.33390e-3f * f + 9.61816e-3f) * f + 5.55035e-2f) * f + 2.402265e-1f) * f + 6.931472e-1f) * f + 1;
    int32_t bits;
    memcpy(&bits, &p, sizeof bits);
    bits += (int32_t)whole * (1 << 23);
    memcpy(&p, &bits, sizeof p);
    return p;
}

static double plain_exp(int id, int threads, double work, float *found)
{
    (void)threads;
    float x[4] = {-0.1f * (float)(id + 1), -1.1f, -2.3f, -3.7f};
    double done = 0;
    for (; done < work; done += 4)
        for (int k = 0; k < 4; k++) {
            *found += plain_exp1(x[k]);
            x[k] -= 1e-6f;
        }
    return done;
}

INLINE double plain_march(int id, double work, Classify classify, int side, const float *volume, float *found)
{
    uint32_t state = 12345u + (uint32_t)id;
    int steps = 2 * (side - 2);
    size_t row = (size_t)side, slice = row * row;
    double done = 0;
    for (; done < work; done += 8.0 * steps) {
        Packet packet = next_packet(&state, side);
        for (int ray = 0; ray < 8; ray++) {
            float at[3], passed = 1, colour[3] = {0};
            size_t front = 0;
            for (int k = 0; k < 3; k++)
                at[k] = packet.start[k] + packet.beside[k] * (float)ray;
            for (int step = 0; step < steps; step++) {
                size_t i = (size_t)at[0], j = (size_t)at[1], m = (size_t)at[2];
                float u = at[0] - (float)i, v = at[1] - (float)j, w = at[2] - (float)m;
                const float *p = volume + i + j * row + m * slice, *q = p + slice;
                float a = p[0] + u * (p[1] - p[0]), b = p[row] + u * (p[row + 1] - p[row]);
                float c = q[0] + u * (q[1] - q[0]), d = q[row] + u * (q[row + 1] - q[row]);
                float near = a + v * (b - a), value = near + w * (c + v * (d - c) - near);
                for (int k = 0; k < 3; k++)
                    at[k] += packet.step[k];
                if (classify == NONE) {
                    *found += value;
                    continue;
                }
                size_t back = (size_t)(value * (NODES - 1) + 0.5f);
                const float *rgba = classify == LINE ? line + 4 * (size_t)(value * (ENTRIES - 1))
                                                     : square + 4 * (back + NODES * front);
                front = back;
                for (int k = 0; k < 3; k++)
                    colour[k] += passed * rgba[k];
                passed -= passed * rgba[3];
            }
            *found += colour[0] + colour[1] + colour[2] + passed;
        }
    }
    return done;
}

#define PLAIN(name, classify, side, volume) \
    static double name(int id, int threads, double work, float *found) \
    { \
        (void)threads; \
        return plain_march(id, work, classify, side, volume, found); \
    }
PLAIN(plain_sample, NONE, CACHED, cached)
PLAIN(plain_classify, LINE, CACHED, cached)
PLAIN(plain_preintegrated, SQUARE, CACHED, cached)
PLAIN(plain_dense, NONE, DENSE, dense)

/* ---- AVX2 ---------------------------------------------------------------------------------------------------------- */
#ifdef HAVE_AVX2

AVX2_INLINE __m256 lerp8(__m256 a, __m256 b, __m256 t) { return _mm256_fmadd_ps(t, _mm256_sub_ps(b, a), a); }

AVX2_INLINE float sum8(__m256 v)
{
    float lanes[8], sum = 0;
    _mm256_storeu_ps(lanes, v);
    for (int i = 0; i < 8; i++)
        sum += lanes[i];
    return sum;
}

AVX2 static double avx2_read(int id, int threads, double work, float *found)
{
    size_t share = BIG / (size_t)threads / 64 * 64;
    const float *from = big + share * (size_t)id;
    __m256 sums[4] = {_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps()};
    double done = 0;
    for (; done < work; done += (double)share * 4)
        for (size_t i = 0; i < share; i += 64) {
            for (size_t line_ = 0; line_ < 64; line_ += 16)
                _mm_prefetch((const char *)(from + i + 1024 + line_), _MM_HINT_T0);
            for (size_t k = 0; k < 4; k++) {
                sums[k] = _mm256_add_ps(sums[k], _mm256_load_ps(from + i + 8 * k));
                sums[k] = _mm256_add_ps(sums[k], _mm256_load_ps(from + i + 8 * k + 32));
            }
        }
    for (int k = 0; k < 4; k++)
        *found += sum8(sums[k]);
    return done;
}

AVX2_INLINE __m256 exp8(__m256 x)
{
    __m256 t = _mm256_mul_ps(_mm256_max_ps(x, _mm256_set1_ps(-87)), _mm256_set1_ps(1.44269504f));
    __m256 whole = _mm256_round_ps(t, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
    __m256 f = _mm256_sub_ps(t, whole), p = _mm256_set1_ps(1.33390e-3f);
    p = _mm256_fmadd_ps(p, f, _mm256_set1_ps(9.61816e-3f));
    p = _mm256_fmadd_ps(p, f, _mm256_set1_ps(5.55035e-2f));
    p = _mm256_fmadd_ps(p, f, _mm256_set1_ps(2.402265e-1f));
    p = _mm256_fmadd_ps(p, f, _mm256_set1_ps(6.931472e-1f));
    p = _mm256_fmadd_ps(p, f, _mm256_set1_ps(1.0f));
    __m256i power = _mm256_slli_epi32(_mm256_cvtps_epi32(whole), 23);
    return _mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(p), power));
}

AVX2 static double avx2_exp(int id, int threads, double work, float *found)
{
    (void)threads;
    __m256 x[4] = {_mm256_set1_ps(-0.1f * (float)(id + 1)), _mm256_set1_ps(-1.1f), _mm256_set1_ps(-2.3f),
                   _mm256_set1_ps(-3.7f)};
    __m256 sum = _mm256_setzero_ps(), less = _mm256_set1_ps(1e-6f);
    double done = 0;
    for (; done < work; done += 32)
        for (int k = 0; k < 4; k++) {
            sum = _mm256_add_ps(sum, exp8(x[k]));
            x[k] = _mm256_sub_ps(x[k], less);
        }
    *found += sum8(sum);
    return done;
}

/* Two pairs of neighbours in x, each as one number of 64 bits that is aligned to 32. */
AVX2_INLINE __m128d pair2(const float *p, const float *q)
{
    double low;
    memcpy(&low, p, sizeof low);
    return _mm_loadh_pd(_mm_set_sd(low), (const double *)(const void *)q);
}

AVX2_INLINE __m256d pair4(const float *p, const int *at)
{
    __m128d low = pair2(p + at[0], p + at[1]), high = pair2(p + at[4], p + at[5]);
    return _mm256_insertf128_pd(_mm256_castpd128_pd256(low), high, 1);
}

/* Interpolated in x: neighbours come together in eight loads of 64 bits. */
AVX2_INLINE __m256 row_pairs(const float *p, const int *at, __m256 u)
{
    __m256 low = _mm256_castpd_ps(pair4(p, at)), high = _mm256_castpd_ps(pair4(p, at + 2));
    return lerp8(_mm256_shuffle_ps(low, high, 0x88), _mm256_shuffle_ps(low, high, 0xdd), u);
}

AVX2_INLINE __m256 row_gathers(const float *p, __m256i at, __m256 u)
{
    return lerp8(_mm256_i32gather_ps(p, at, 4), _mm256_i32gather_ps(p + 1, at, 4), u);
}

AVX2_INLINE __m256 trilinear8(Load load, const float *p, __m256i at, int side, __m256 u, __m256 v, __m256 w)
{
    int row = side, slice = side * side;
    __m256 a, b, c, d;
    if (load == GATHERS) {
        a = row_gathers(p, at, u);
        b = row_gathers(p + row, at, u);
        c = row_gathers(p + slice, at, u);
        d = row_gathers(p + slice + row, at, u);
    } else {
        int offsets[8] __attribute__((aligned(32)));
        _mm256_store_si256((__m256i *)(void *)offsets, at);
        a = row_pairs(p, offsets, u);
        b = row_pairs(p + row, offsets, u);
        c = row_pairs(p + slice, offsets, u);
        d = row_pairs(p + slice + row, offsets, u);
    }
    return lerp8(lerp8(a, b, v), lerp8(c, d, v), w);
}

AVX2_INLINE __m256 entry2(const float *table, const int *at)
{
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_load_ps(table + at[0])), _mm_load_ps(table + at[4]), 1);
}

/* Eight RGBA entries at the offsets `at`, transposed, put over what was composited so far. */
AVX2_INLINE void over8(const float *table, __m256i at, __m256 colour[3], __m256 *passed)
{
    int offsets[8] __attribute__((aligned(32)));
    _mm256_store_si256((__m256i *)(void *)offsets, at);
    __m256 a = entry2(table, offsets), b = entry2(table, offsets + 1);
    __m256 c = entry2(table, offsets + 2), d = entry2(table, offsets + 3);
    __m256 ab_low = _mm256_unpacklo_ps(a, b), ab_high = _mm256_unpackhi_ps(a, b);
    __m256 cd_low = _mm256_unpacklo_ps(c, d), cd_high = _mm256_unpackhi_ps(c, d);
    colour[0] = _mm256_fmadd_ps(*passed, _mm256_shuffle_ps(ab_low, cd_low, 0x44), colour[0]);
    colour[1] = _mm256_fmadd_ps(*passed, _mm256_shuffle_ps(ab_low, cd_low, 0xee), colour[1]);
    colour[2] = _mm256_fmadd_ps(*passed, _mm256_shuffle_ps(ab_high, cd_high, 0x44), colour[2]);
    *passed = _mm256_fnmadd_ps(*passed, _mm256_shuffle_ps(ab_high, cd_high, 0xee), *passed);
}

/* Instantiated below with constant arguments. */
AVX2_INLINE double march8(int id, double work, Load load, Classify classify, int side, const float *volume, float *found)
{
    uint32_t state = 12345u + (uint32_t)id;
    int steps = 2 * (side - 2);
    __m256 sum = _mm256_setzero_ps(), ray = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7), half = _mm256_set1_ps(0.5f);
    __m256 last_node = _mm256_set1_ps(NODES - 1), last_entry = _mm256_set1_ps(ENTRIES - 1);
    double done = 0;
    for (; done < work; done += 8.0 * steps) {
        Packet packet = next_packet(&state, side);
        __m256 at[3], step[3], passed = _mm256_set1_ps(1);
        __m256 colour[3] = {_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps()};
        __m256i front = _mm256_setzero_si256();
        for (int k = 0; k < 3; k++) {
            at[k] = _mm256_fmadd_ps(ray, _mm256_set1_ps(packet.beside[k]), _mm256_set1_ps(packet.start[k]));
            step[k] = _mm256_set1_ps(packet.step[k]);
        }
        for (int s = 0; s < steps; s++) {
            __m256i cell[3];
            __m256 place[3];
            for (int k = 0; k < 3; k++) { /* nothing is negative: truncation is floor */
                cell[k] = _mm256_cvttps_epi32(at[k]);
                place[k] = _mm256_sub_ps(at[k], _mm256_cvtepi32_ps(cell[k]));
                at[k] = _mm256_add_ps(at[k], step[k]);
            }
            __m256i rows = _mm256_mullo_epi32(cell[2], _mm256_set1_epi32(side));
            rows = _mm256_mullo_epi32(_mm256_add_epi32(rows, cell[1]), _mm256_set1_epi32(side));
            __m256 value =
                trilinear8(load, volume, _mm256_add_epi32(rows, cell[0]), side, place[0], place[1], place[2]);
            if (classify == NONE) {
                sum = _mm256_add_ps(sum, value);
            } else if (classify == LINE) {
                __m256i entry = _mm256_cvttps_epi32(_mm256_mul_ps(value, last_entry));
                over8(line, _mm256_slli_epi32(entry, 2), colour, &passed);
            } else {
                __m256i back = _mm256_cvttps_epi32(_mm256_fmadd_ps(value, last_node, half));
                __m256i entry = _mm256_add_epi32(back, _mm256_slli_epi32(front, 8));
                over8(square, _mm256_slli_epi32(entry, 2), colour, &passed);
                front = back;
            }
        }
        sum = _mm256_add_ps(sum, _mm256_add_ps(_mm256_add_ps(colour[0], colour[1]), _mm256_add_ps(colour[2], passed)));
    }
    *found += sum8(sum);
    return done;
}

#define MARCH8(name, load, classify, side, volume) \
    AVX2 static double name(int id, int threads, double work, float *found) \
    { \
        (void)threads; \
        return march8(id, work, load, classify, side, volume, found); \
    }
MARCH8(avx2_sample_pairs, PAIRS, NONE, CACHED, cached)
MARCH8(avx2_sample_gathers, GATHERS, NONE, CACHED, cached)
MARCH8(avx2_classify, PAIRS, LINE, CACHED, cached)
MARCH8(avx2_preintegrated, PAIRS, SQUARE, CACHED, cached)
MARCH8(avx2_march_pairs, PAIRS, NONE, DENSE, dense)
MARCH8(avx2_march_gathers, GATHERS, NONE, DENSE, dense)

static bool have_avx2(void) { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
#define EITHER(plain, avx2) plain, avx2
#else
static bool have_avx2(void) { return false; }
#define EITHER(plain, avx2) plain, plain
#endif

/* ---- the runs ------------------------------------------------------------------------------------------------------ */

static const struct {
    const char *name;
    Kernel *plain, *avx2;
    double work, unit;
    const char *unit_name;
} kernels[] = {
    {"dram-read", EITHER(plain_read, avx2_read), 1e9, 1e9, "GB/s"},
    {"exp", EITHER(plain_exp, avx2_exp), 3e8, 1e9, "G/s"},
    {"sample-pairs", EITHER(plain_sample, avx2_sample_pairs), 4e7, 1e6, "M/s"},
    {"sample-gathers", EITHER(plain_sample, avx2_sample_gathers), 4e7, 1e6, "M/s"},
    {"classify", EITHER(plain_classify, avx2_classify), 4e7, 1e6, "M/s"},
    {"preintegrated", EITHER(plain_preintegrated, avx2_preintegrated), 4e7, 1e6, "M/s"},
    {"march-pairs", EITHER(plain_dense, avx2_march_pairs), 4e7, 1e6, "M/s"},
    {"march-gathers", EITHER(plain_dense, avx2_march_gathers), 4e7, 1e6, "M/s"},
};

typedef struct Job {
    Kernel *kernel;
    int id, threads;
    double work, done;
    float found;
} Job;

static volatile float sink;

static void *do_job(void *data)
{
    Job *job = data;
    job->done = job->kernel(job->id, job->threads, job->work, &job->found);
    return NULL;
}

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Units per second of both threads together, or of this one alone. */
static double rate(Kernel *kernel, int threads, double work)
{
    Job here = {.kernel = kernel, .threads = threads, .work = work}, there = here;
    there.id = 1;
    pthread_t other;
    double begin = seconds_now();
    if (threads == 2 && pthread_create(&other, NULL, do_job, &there) != 0) {
        fprintf(stderr, "roofline: cannot start a thread\n");
        exit(1);
    }
    do_job(&here);
    if (threads == 2)
        pthread_join(other, NULL);
    double seconds = seconds_now() - begin;
    sink = here.found + there.found;
    return (here.done + there.done) / seconds;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static float *floats(size_t count)
{
    void *memory = NULL;
    if (posix_memalign(&memory, 64, (count + 2048) * sizeof(float)) != 0) {
        fprintf(stderr, "roofline: out of memory\n");
        exit(1);
    }
    memset(memory, 0, (count + 2048) * sizeof(float));
    return memory;
}

/* Between 0 and 1: a slow wave over the volume and noise in equal parts. */
static float *volume_of(int side)
{
    size_t count = (size_t)side * (size_t)side * (size_t)side;
    float *volume = floats(count);
    uint32_t state = 1;
    for (size_t i = 0; i < count; i++) {
        float z = (float)(i / ((size_t)side * (size_t)side)) / (float)side, wave = 4 * z * (1 - z);
        volume[i] = 0.5f * wave + 0.5f * next_fraction(&state);
    }
    return volume;
}

static float *table_of(size_t entries)
{
    float *table = floats(4 * entries);
    for (size_t i = 0; i < 4 * entries; i++)
        table[i] = 0.001f;
    return table;
}

int main(int argc, char **argv)
{
    long runs = argc > 1 ? strtol(argv[1], NULL, 10) : 7;
    if (argc > 2 || runs < 1 || runs > MOST_RUNS) {
        fprintf(stderr, "usage: roofline [RUNS]\n");
        return 2;
    }
    dense = volume_of(DENSE);
    cached = volume_of(CACHED);
    line = table_of(ENTRIES);
    square = table_of((size_t)NODES * NODES);
    big = floats(BIG);
    bool avx2 = have_avx2();
    for (size_t k = 0; k < sizeof kernels / sizeof kernels[0]; k++)
        for (int threads = 1; threads <= 2; threads++) {
            double rates[MOST_RUNS];
            Kernel *kernel = avx2 ? kernels[k].avx2 : kernels[k].plain;
            rate(kernel, threads, kernels[k].work);
            for (long run = 0; run < runs; run++)
                rates[run] = rate(kernel, threads, kernels[k].work) / kernels[k].unit;
            qsort(rates, (size_t)runs, sizeof rates[0], by_size);
            printf("%s %d %.5g %s\n", kernels[k].name, threads, rates[runs / 2], kernels[k].unit_name);
            fflush(stdout);
        }
    return 0;
}
