/* Functions of simd/reals.h and trace/cubic_tmpl.h against long double, in the precision that the including file chose. */
#ifndef TESTS_UNIT_SIMD_CHECKS_H
#define TESTS_UNIT_SIMD_CHECKS_H

#include <math.h>
#include <stdio.h>

#include "simd/reals.h"
#include "tests/unit/test.h"
#include "trace/cubic_tmpl.h"

enum { POINTS = 200000 };

static double worst_of(reals (*f)(reals), long double (*want)(long double), double from, double to)
{
    double worst = 0;
    for (int k = 0; k < POINTS; k += LANES) {
        reals x;
        for (int i = 0; i < LANES; i++)
            x[i] = (real)(from + (to - from) * (k + i) / (POINTS - 1));
        reals got = f(x);
        for (int i = 0; i < LANES; i++)
            worst = fmax(worst, (double)fabsl((long double)got[i] / want((long double)x[i]) - 1));
    }
    return worst / (double)REAL_EPSILON;
}

static reals exp_of(reals x) { return reals_exp(x); }
static reals exp_short_of(reals x) { return reals_exp_short(x); }
static reals phi_of(reals x)
{
    reals passed;
    return reals_phi(x, &passed);
}
static reals passed_of(reals x)
{
    reals passed;
    reals_phi(x, &passed);
    return passed;
}
static long double exp_minus(long double x) { return expl(-x); }
static long double phi(long double x) { return x == 0 ? 1 : -expm1l(-x) / x; }

/* In units of the last place of 1. */
static void exponentials_are_as_good_as_promised(void)
{
    double whole = worst_of(exp_of, expl, -80, 0), near = worst_of(exp_short_of, exp_minus, 0, 1);
    double thin = worst_of(phi_of, phi, 0, 1), dense = worst_of(phi_of, phi, 1, 80);
    double through = worst_of(passed_of, exp_minus, 0, 1);
    printf("# exp %.2f, exp_short %.2f, phi %.2f and %.2f, exp beside it %.2f units\n", whole, near, thin, dense, through);
    CHECK(whole < 1.5 && near < 1.5 && thin < 1 && dense < 2.5 && through < 3);
}

static uint64_t random_state = 1;
static double random_unit(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) * 0x1p-53;
}

/* v of a cubic that has been solved for `target` is that but for the rounding of its terms. */
static void roots_are_roots(void)
{
    double worst = 0;
    for (int n = 0; n < POINTS; n += LANES) {
        Cubic v;
        reals turn[2], target = {0}, lo = {0}, hi = {0};
        double scale = pow(10, 6 * random_unit() - 3), offset = random_unit() < 0.5 ? 0 : 10 * random_unit();
        for (int i = 0; i < LANES; i++) {
            v.a0[i] = (real)(scale * (offset + random_unit()));
            v.a1[i] = (real)(scale * (2 * random_unit() - 1));
            v.a2[i] = (real)(scale * (random_unit() < 0.2 ? 0 : 4 * random_unit() - 2));
            v.a3[i] = (real)(scale * (random_unit() < 0.2 ? 0 : 4 * random_unit() - 2));
        }
        turning_points(&v, &turn[0], &turn[1]);
        for (int i = 0; i < LANES; i++) {
            int leg = (int)(3 * random_unit());
            lo[i] = leg == 0 ? 0 : turn[leg - 1][i];
            hi[i] = leg == 2 ? 1 : turn[leg][i];
        }
        reals from = cubic_at(&v, lo), to = cubic_at(&v, hi);
        for (int i = 0; i < LANES; i++)
            target[i] = (real)((double)from[i] + ((double)to[i] - (double)from[i]) * random_unit());
        reals s = solve_cubic(&v, target, lo, hi, ints_all(-1));
        for (int i = 0; i < LANES; i++) {
            long double x = (long double)s[i], sum = 0;
            sum = fabsl((long double)v.a0[i]) + fabsl((long double)target[i]) + fabsl((long double)v.a1[i]) +
                  fabsl((long double)v.a2[i]) + fabsl((long double)v.a3[i]);
            long double at = (((long double)v.a3[i] * x + (long double)v.a2[i]) * x + (long double)v.a1[i]) * x;
            worst = fmax(worst, (double)(fabsl(at + (long double)v.a0[i] - (long double)target[i]) / sum));
            CHECK(s[i] >= lo[i] && s[i] <= hi[i]);
        }
    }
    printf("# a root's value is off by %.2f units of its terms at most\n", worst / (double)REAL_EPSILON);
    CHECK(worst < 2 * (double)REAL_EPSILON);
}

int main(void)
{
    RUN(exponentials_are_as_good_as_promised);
    RUN(roots_are_roots);
    return test_end();
}

#endif
