/* Random numbers by counters: published values, pinned values, evenness and independence along every argument. */
#include "test.h"

#include "base/random.h"

/* The known answers that are published with Philox 4x32-10. */
static void test_known_answers(void)
{
    static const struct {
        uint32_t counter[4], key[2], want[4];
    } known[] = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff},
         {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };
    for (size_t n = 0; n < sizeof known / sizeof *known; n++) {
        uint32_t got[4];
        vol_random_block(known[n].counter, known[n].key, got);
        CHECK(memcmp(got, known[n].want, sizeof got) == 0);
    }
}

/* The order of words and arguments: files made with a seed stay what they are. */
static void test_pinned(void)
{
    CHECK(vol_random_at(0, 0, 0, 0) == (0x6627e8d5 + 0.5) * 0x1p-32);
    CHECK(vol_random_at(0, 0, 0, 3) == (0x9b00dbd8 + 0.5) * 0x1p-32);
    CHECK(vol_random_at(0x299f31d0a4093822, 0x85a308d3243f6a88, 0x13198a2e, 4 * (uint64_t)0x03707344 + 1) ==
          (0x94fdcceb + 0.5) * 0x1p-32);
}

static void test_a_stream_is_its_numbers(void)
{
    for (uint64_t first = 0; first < 6; first++) {
        VolRandom random = vol_random(7, 1u << 20, 3, first);
        for (uint64_t n = first; n < first + 20; n++)
            CHECK(vol_random_next(&random) == vol_random_at(7, 1u << 20, 3, n));
    }
}

enum { COUNT = 100000, BINS = 64 };

/* Argument `axis` runs, the others stand: seed, place, sample, dimension. */
static double along(int axis, uint64_t n)
{
    uint64_t at[4] = {5, 17, 2, 9};
    at[axis] = n;
    return vol_random_at(at[0], at[1], (uint32_t)at[2], at[3]);
}

/* Each statistic, of deviation 1, within 4. */
static void test_even(void)
{
    for (int axis = 0; axis < 4; axis++) {
        double sum = 0, squares = 0, chi = 0, bins[BINS] = {0};
        for (uint64_t n = 0; n < COUNT; n++) {
            double u = along(axis, n);
            CHECK(u > 0 && u < 1);
            sum += u - 0.5;
            squares += (u - 0.5) * (u - 0.5) - 1.0 / 12;
            bins[(int)(u * BINS)]++;
        }
        for (int b = 0; b < BINS; b++)
            chi += (bins[b] - (double)COUNT / BINS) * (bins[b] - (double)COUNT / BINS) / ((double)COUNT / BINS);
        CHECK_NEAR(sum / sqrt(COUNT / 12.0), 0, 0, 4);
        CHECK_NEAR(squares / sqrt(COUNT / 180.0), 0, 0, 4);
        CHECK_NEAR((chi - (BINS - 1)) / sqrt(2.0 * (BINS - 1)), 0, 0, 4);
    }
}

/* Of neighbours along each argument, at distances 1 to 8. */
static void test_uncorrelated(void)
{
    for (int axis = 0; axis < 4; axis++)
        for (uint64_t distance = 1; distance <= 8; distance++) {
            double sum = 0;
            for (uint64_t n = 0; n < COUNT / 4; n++)
                sum += (along(axis, n) - 0.5) * (along(axis, n + distance) - 0.5);
            CHECK_NEAR(sum * 12 / sqrt(COUNT / 4.0), 0, 0, 4);
        }
}

int main(void)
{
    RUN(test_known_answers);
    RUN(test_pinned);
    RUN(test_a_stream_is_its_numbers);
    RUN(test_even);
    RUN(test_uncorrelated);
    return test_end();
}
