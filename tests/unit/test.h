/* A test program prints TAP and returns 0 if all went well.
 *
 *     int main(void) { RUN(test_inverse); RUN(test_slab); return test_end(); }
 *
 * Inside a test: CHECK(condition), CHECK_NEAR(got, want, rel, abs), CHECK_TEXT(got, want), FAIL("why %d", n).
 * A test goes on after a failed check; the first failure of each is shown.  SKIP("why"), where it cannot be run, makes it
 * neither pass nor fail. */
#ifndef TESTS_UNIT_TEST_H
#define TESTS_UNIT_TEST_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static int test_number, test_failures, test_failed_checks;
static char test_why[512];
static const char *test_skipped;

__attribute__((format(printf, 3, 4), unused)) static void test_fail(const char *file, int line, const char *format, ...)
{
    if (test_failed_checks++)
        return;
    int n = snprintf(test_why, sizeof test_why, "%s:%d: ", file, line);
    va_list args;
    va_start(args, format);
    vsnprintf(test_why + n, sizeof test_why - (size_t)n, format, args);
    va_end(args);
}

__attribute__((unused)) static void test_near(const char *file, int line, const char *what, double got, double want,
                                              double rel, double abs_floor)
{
    double bound = fmax(abs_floor, rel * fabs(want));
    if (!(fabs(got - want) <= bound) && !(isinf(want) && got == want))
        test_fail(file, line, "%s: got %.17g, want %.17g, off by %.3g, allowed %.3g", what, got, want,
                  fabs(got - want), bound);
}

__attribute__((unused)) static void test_run(const char *name, void (*test)(void))
{
    test_failed_checks = 0;
    test_skipped = NULL;
    test();
    test_number++;
    if (test_failed_checks) {
        test_failures++;
        printf("not ok %d - %s\n# %s (%d failed checks)\n", test_number, name, test_why, test_failed_checks);
    } else if (test_skipped) {
        printf("ok %d - %s # SKIP %s\n", test_number, name, test_skipped);
    } else {
        printf("ok %d - %s\n", test_number, name);
    }
    fflush(stdout);
}

__attribute__((unused)) static int test_end(void)
{
    printf("1..%d\n", test_number);
    return test_failures != 0;
}

#define RUN(test) test_run(#test, test)
#define FAIL(...) test_fail(__FILE__, __LINE__, __VA_ARGS__)
#define SKIP(why) ((void)(test_skipped = (why)))
#define CHECK(condition) ((condition) ? (void)0 : test_fail(__FILE__, __LINE__, "%s", #condition))
#define CHECK_NEAR(got, want, rel, abs_floor) test_near(__FILE__, __LINE__, #got, got, want, rel, abs_floor)
#define CHECK_TEXT(got, want) \
    (strcmp(got, want) == 0 ? (void)0 : test_fail(__FILE__, __LINE__, "%s: got '%s', want '%s'", #got, got, want))

#endif
