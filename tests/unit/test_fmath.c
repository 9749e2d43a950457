/* Own elementary functions against the C library's long double ones, whose error is far below a double's ulp. */
#include "base/fmath.h"

#include <float.h>
#include <stdbool.h>
#include <stdint.h>

#include "tests/unit/test.h"

enum { SAMPLES = 200000 };

static uint64_t state = 0x853c49e6748fea9b;

static uint64_t random_bits(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state * UINT64_C(0x2545f4914f6cdd1d);
}

static double uniform(double lo, double hi) { return lo + (hi - lo) * ((double)(random_bits() >> 11) * 0x1p-53); }

/* Sign, exponent and mantissa all random: sizes from 2^lo to 2^hi. */
static double any_size(int lo, int hi)
{
    double m = ldexp(uniform(1, 2), (int)floor(uniform(lo, hi)));
    return random_bits() & 1 ? m : -m;
}

/* |got - want| in ulps of a double near `want`. */
static double ulps(double got, long double want)
{
    if (isnan(got) || isnan(want))
        return isnan(got) && isnan(want) ? 0 : 1e300;
    double rounded = (double)want;
    if (isinf(got) || isinf(rounded))
        return got == rounded ? 0 : 1e300;
    int e;
    frexp(rounded, &e);
    double ulp = rounded == 0 || e < -1021 ? 0x1p-1074 : ldexp(1, e - 53);
    return (double)(fabsl((long double)got - want) / (long double)ulp);
}

/* The largest error so far, and where it was. */
typedef struct Worst {
    double off, x, y;
} Worst;

static void note(Worst *worst, double off, double x, double y)
{
    if (off > worst->off)
        *worst = (Worst){off, x, y};
}

typedef struct Case {
    const char *name;
    double (*own)(double);
    long double (*theirs)(long double);
    double bound; /* ulps; 0.5 is the least possible */
} Case;

static void check_range(const Case *c, double lo, double hi)
{
    Worst worst = {0};
    for (int i = 0; i < SAMPLES; i++) {
        double x = uniform(lo, hi);
        note(&worst, ulps(c->own(x), c->theirs((long double)x)), x, 0);
    }
    if (worst.off > c->bound)
        FAIL("%s(%a): %.3f ulp", c->name, worst.x, worst.off);
}

static void check_sizes(const Case *c, int lo, int hi, bool positive)
{
    Worst worst = {0};
    for (int i = 0; i < SAMPLES; i++) {
        double x = any_size(lo, hi);
        if (positive)
            x = fabs(x);
        note(&worst, ulps(c->own(x), c->theirs((long double)x)), x, 0);
    }
    if (worst.off > c->bound)
        FAIL("%s(%a): %.3f ulp", c->name, worst.x, worst.off);
}

static void test_exp(void)
{
    static const Case exp_case = {"exp", vol_exp, expl, 0.55}, expm1_case = {"expm1", vol_expm1, expm1l, 0.65};
    check_range(&exp_case, -1, 1);
    check_range(&exp_case, -707, 710);
    check_range(&expm1_case, -0.4, 0.4);
    check_range(&expm1_case, -2, 2);
    check_range(&expm1_case, -50, 80);
    check_range(&expm1_case, 80, 710);
    check_sizes(&exp_case, -1074, 10, false);
    check_sizes(&expm1_case, -1074, 10, false);
    for (double x = -746; x < -707; x += 0.0137) /* denormal results: rounded twice */
        if (ulps(vol_exp(x), expl((long double)x)) > 1)
            FAIL("exp(%a): %.3f ulp", x, ulps(vol_exp(x), expl((long double)x)));
}

static void test_log(void)
{
    static const Case log_case = {"log", vol_log, logl, 0.55}, log1p_case = {"log1p", vol_log1p, log1pl, 0.55};
    check_range(&log_case, 0.5, 2);
    check_range(&log_case, 0.999, 1.001);
    check_range(&log_case, 0, 1000);
    check_sizes(&log_case, -1074, 1024, true);
    check_range(&log1p_case, -1, 1);
    check_range(&log1p_case, -0.001, 0.001);
    check_range(&log1p_case, 0, 1e6);
    check_sizes(&log1p_case, -1074, 0, false);
    check_sizes(&log1p_case, -10, 1024, true);
}

static void test_cbrt(void)
{
    static const Case c = {"cbrt", vol_cbrt, cbrtl, 0.55};
    check_sizes(&c, -1074, 1024, false);
    CHECK(vol_cbrt(-27) == -3 && vol_cbrt(0.125) == 0.5);
}

static void test_pow(void)
{
    Worst worst = {0};
    for (int i = 0; i < 4 * SAMPLES; i++) {
        double x, y;
        if (i & 1) {
            x = uniform(0.5, 2);
            y = uniform(-1000, 1000);
        } else {
            x = fabs(any_size(-1074, 1024));
            y = uniform(-1, 1) * 740 / (fabs(log(x)) + 1e-3);
        }
        long double want = powl((long double)x, (long double)y);
        if ((double)want < DBL_MIN) /* denormal results are rounded twice: below */
            continue;
        note(&worst, ulps(vol_pow(x, y), want), x, y);
    }
    if (worst.off > 0.6)
        FAIL("pow(%a, %a): %.3f ulp", worst.x, worst.y, worst.off);
    for (double y = -1022; y > -1080; y -= 0.01)
        if (ulps(vol_pow(2, y), powl(2, (long double)y)) > 1)
            FAIL("pow(2, %a): %.3f ulp", y, ulps(vol_pow(2, y), powl(2, (long double)y)));
    for (int n = -1074; n <= 1023; n++)
        CHECK(vol_pow(2, n) == ldexp(1, n));
    for (int n = -20; n <= 20; n++)
        CHECK(vol_pow(-3, n) == pow(-3, n));
}

/* Annex F of the C standard, F.10.4.4. */
static void test_pow_edges(void)
{
    static const double values[] = {0.0, -0.0, 1, -1, 2, -2, 3, -3, 0.5, -0.5, 1.5, -1.5, 0x1p53, -0x1p53, 0x1p53 - 1,
                                    1e300, -1e300, INFINITY, -INFINITY, NAN, 0x1p-1074, -0x1p-1074, 1e-300};
    enum { N = sizeof values / sizeof *values };
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double got = vol_pow(values[i], values[j]), want = pow(values[i], values[j]);
            if (ulps(got, (long double)want) > 1 || (!isnan(want) && signbit(got) != signbit(want)))
                FAIL("pow(%a, %a) = %a, not %a", values[i], values[j], got, want);
        }
}

static void test_circular(void)
{
    static const Case cases[] = {{"sin", vol_sin, sinl, 0.55}, {"cos", vol_cos, cosl, 0.55}, {"tan", vol_tan, tanl, 0.55}};
    for (int i = 0; i < 3; i++) {
        check_range(&cases[i], -1, 1);
        check_range(&cases[i], -10, 10);
        check_range(&cases[i], -1e6, 1e6);
        check_range(&cases[i], -1e9, 1e9);
        check_sizes(&cases[i], -1074, 20, false);
        check_sizes(&cases[i], 19, 63, false);
        check_sizes(&cases[i], 20, 1024, false);
    }
}

/* Doubles next to multiples of pi/2, where the reduction cancels most; 6381956970095103 x 2^797 is the worst of all. */
static void test_circular_near_multiples(void)
{
    static const Case cases[] = {{"sin", vol_sin, sinl, 0.55}, {"cos", vol_cos, cosl, 0.55}, {"tan", vol_tan, tanl, 0.55}};
    for (int i = 0; i < 3; i++)
        for (long n = 1; n < 4000000; n = n * 5 / 4 + 1) {
            double x = (double)((long double)n * 1.57079632679489661923132169163975144L);
            double off = ulps(cases[i].own(x), cases[i].theirs((long double)x));
            if (off > cases[i].bound)
                FAIL("%s(%a): %.3f ulp", cases[i].name, x, off);
        }
    double x = ldexp(6381956970095103.0, 797);
    CHECK(ulps(vol_cos(x), -4.68716592425462761112e-19L) < 1); /* Muller, Elementary Functions, table of worst cases */
    CHECK(vol_sin(x) == 1 || vol_sin(x) == -1);
}

static void test_inverse(void)
{
    static const Case asin_case = {"asin", vol_asin, asinl, 0.55}, acos_case = {"acos", vol_acos, acosl, 0.55};
    check_range(&asin_case, -1, 1);
    check_range(&acos_case, -1, 1);
    check_range(&asin_case, 0.999999, 1);
    check_range(&acos_case, 0.999999, 1);
    check_range(&acos_case, -1, -0.999999);
    check_sizes(&asin_case, -1074, 0, false);
    check_sizes(&acos_case, -1074, 0, false);
    Worst worst = {0};
    for (int i = 0; i < 4 * SAMPLES; i++) {
        double x = i & 1 ? uniform(-1, 1) : any_size(-1074, 1024), y = i & 2 ? uniform(-1, 1) : any_size(-1074, 1024);
        long double want = atan2l((long double)y, (long double)x);
        note(&worst, fabsl(want) < (long double)DBL_MIN ? 0 : ulps(vol_atan2(y, x), want), x, y);
    }
    if (worst.off > 0.55)
        FAIL("atan2(%a, %a): %.3f ulp", worst.y, worst.x, worst.off);
}

static void test_atan2_edges(void)
{
    static const double values[] = {0.0, -0.0, 1, -1, INFINITY, -INFINITY, NAN, 0x1p-1074, -0x1p-1074, DBL_MAX, -DBL_MAX,
                                    DBL_MIN, 1e-300, -1e300};
    enum { N = sizeof values / sizeof *values };
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            double got = vol_atan2(values[i], values[j]), want = atan2(values[i], values[j]);
            if (ulps(got, (long double)want) > 1 || (!isnan(want) && signbit(got) != signbit(want)))
                FAIL("atan2(%a, %a) = %a, not %a", values[i], values[j], got, want);
        }
}

static void check_edge(const char *name, double (*own)(double), double (*theirs)(double), double x)
{
    double got = own(x), want = theirs(x);
    if (ulps(got, (long double)want) > 1 || (!isnan(want) && signbit(got) != signbit(want)))
        FAIL("%s(%a) = %a, not %a", name, x, got, want);
}

static void test_edges(void)
{
    static const double values[] = {0.0, -0.0, 1, -1, INFINITY, -INFINITY, NAN, 0x1p-1074, -0x1p-1074, DBL_MAX, -DBL_MAX,
                                    DBL_MIN, 709.782712893384, 709.7827128933841, -745.1332191019411,
                                    -745.1332191019412, 1 + DBL_EPSILON, 1 - DBL_EPSILON / 2};
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        double x = values[i];
        check_edge("exp", vol_exp, exp, x);
        check_edge("expm1", vol_expm1, expm1, x);
        check_edge("log", vol_log, log, x);
        check_edge("log1p", vol_log1p, log1p, x);
        check_edge("sin", vol_sin, sin, x);
        check_edge("cos", vol_cos, cos, x);
        check_edge("tan", vol_tan, tan, x);
        check_edge("asin", vol_asin, asin, x);
        check_edge("acos", vol_acos, acos, x);
        check_edge("cbrt", vol_cbrt, cbrt, x);
    }
    CHECK(vol_exp(0) == 1 && vol_log(1) == 0 && vol_cos(0) == 1 && vol_acos(1) == 0);
}

int main(void)
{
    RUN(test_exp);
    RUN(test_log);
    RUN(test_cbrt);
    RUN(test_pow);
    RUN(test_pow_edges);
    RUN(test_circular);
    RUN(test_circular_near_multiples);
    RUN(test_inverse);
    RUN(test_atan2_edges);
    RUN(test_edges);
    return test_end();
}
