/* Makes the constants of simd/reals.h:  chebyshev exp|phi TERMS
 *
 * Chebyshev's interpolant of exp(-x) or phi(x) = (1 - exp(-x)) / x on [0, 1] with so many terms, as a polynomial in
 * y = x - 1/2, highest power first; behind it its largest relative error.
 *
 * At the zeros x_k = 1/2 + cos((2k + 1) pi / 2n) / 2 of T_n(2 y) the coefficients of T_j are c_j = (2 - [j = 0]) / n times
 * the sum of f(x_k) T_j(2 y_k); T_j by T_{j+1}(z) = 2 z T_j(z) - T_{j-1}(z). */
#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Turning 1e-9 out of sums of numbers near 1 takes 34 digits. */
#if LDBL_MANT_DIG >= 113
typedef long double Wide;
#else
typedef __float128 Wide;
#endif

enum { MOST = 32, SERIES = 40 };

/* phi(x) = sum (-x)^k / (k + 1)!, exp(-x) = 1 - x phi(x), cos x by its series about 0; |x| <= 1, or pi for the cosine. */
static Wide phi(Wide x)
{
    Wide sum = 0, term = 1;
    for (int k = 0; k < SERIES; k++) {
        term /= k + 1;
        sum += term;
        term *= -x;
    }
    return sum;
}
static Wide exp_minus(Wide x) { return 1 - x * phi(x); }
static Wide cosine(Wide x)
{
    Wide sum = 0, term = 1;
    for (int k = 0; k < 2 * SERIES; k += 2) {
        sum += term;
        term *= -x * x / ((k + 1) * (k + 2));
    }
    return sum;
}
static Wide magnitude(Wide x) { return x < 0 ? -x : x; }

/* The interpolant's coefficients of T_0 ... T_(n-1). */
static void interpolate(Wide (*f)(Wide), int n, Wide c[MOST])
{
    const Wide pi = (Wide)3.14159265358979323846264L - (Wide)5.0165576126683320235e-20L;
    for (int j = 0; j < n; j++) {
        c[j] = 0;
        for (int k = 0; k < n; k++) {
            int turn = j * (2 * k + 1) % (4 * n); /* of 4 n: whole turns are left out */
            Wide x = cosine((2 * k + 1) * pi / (2 * n)), to = cosine((turn > 2 * n ? 4 * n - turn : turn) * pi / (2 * n));
            c[j] += f(0.5L + 0.5L * x) * to;
        }
        c[j] *= (Wide)(j ? 2 : 1) / n;
    }
}

/* From T_j(2 y) to powers of y. */
static void to_powers(const Wide c[MOST], int n, Wide power[MOST])
{
    Wide before[MOST] = {1}, here[MOST] = {0, 2};
    memset(power, 0, MOST * sizeof *power);
    for (int j = 0; j < n; j++) {
        Wide next[MOST] = {0};
        for (int i = 0; i < MOST; i++) {
            power[i] += c[j] * before[i];
            next[i] = (i ? 4 * here[i - 1] : 0) - before[i];
        }
        memcpy(before, here, sizeof before);
        memcpy(here, next, sizeof here);
    }
}

int main(int argc, char **argv)
{
    int n = argc == 3 ? atoi(argv[2]) : 0;
    if (n < 1 || n >= MOST || (strcmp(argv[1], "exp") != 0 && strcmp(argv[1], "phi") != 0)) {
        fprintf(stderr, "usage: chebyshev exp|phi TERMS\n");
        return 2;
    }
    Wide (*f)(Wide) = argv[1][0] == 'e' ? exp_minus : phi;
    Wide c[MOST], power[MOST], worst = 0;
    interpolate(f, n, c);
    to_powers(c, n, power);
    for (int i = n - 1; i >= 0; i--)
        printf("%.20Lg\n", (long double)power[i]);
    for (int k = 0; k <= 4096; k++) {
        Wide x = k / 4096.0L, y = x - 0.5L, p = 0;
        for (int i = n - 1; i >= 0; i--)
            p = p * y + power[i];
        Wide error = magnitude(p / f(x) - 1);
        worst = error > worst ? error : worst;
    }
    printf("# error %.3Lg\n", (long double)worst);
    return 0;
}
