/* Double-double arithmetic: a number as the unevaluated sum hi + lo of two doubles with |lo| <= ulp(hi)/2, about 106 bits.
 * Used within base/ where a result must be right to the last bit.  Built on two facts of binary floating point:
 * the error of a sum is a double and so is that of a product (the latter is one fma). */
#ifndef VOL_BASE_DD_H
#define VOL_BASE_DD_H

#include <math.h>

typedef struct VolDd {
    double hi, lo;
} VolDd;

/* a + b exactly, |a| >= |b| or a == 0. */
static inline VolDd vol_dd_quick_sum(double a, double b)
{
    double s = a + b;
    return (VolDd){s, b - (s - a)};
}

/* a + b exactly. */
static inline VolDd vol_dd_sum(double a, double b)
{
    double s = a + b, t = s - a;
    return (VolDd){s, (a - (s - t)) + (b - t)};
}

/* a * b exactly (save underflow). */
static inline VolDd vol_dd_product(double a, double b)
{
    double p = a * b;
    return (VolDd){p, fma(a, b, -p)};
}

static inline VolDd vol_dd_add(VolDd a, VolDd b)
{
    VolDd s = vol_dd_sum(a.hi, b.hi), t = vol_dd_sum(a.lo, b.lo);
    s = vol_dd_quick_sum(s.hi, s.lo + t.hi);
    return vol_dd_quick_sum(s.hi, s.lo + t.lo);
}

static inline VolDd vol_dd_negate(VolDd a) { return (VolDd){-a.hi, -a.lo}; }

static inline VolDd vol_dd_mul(VolDd a, VolDd b)
{
    VolDd p = vol_dd_product(a.hi, b.hi);
    return vol_dd_quick_sum(p.hi, p.lo + (a.hi * b.lo + a.lo * b.hi));
}

static inline VolDd vol_dd_scale(VolDd a, double power_of_two)
{
    return (VolDd){a.hi * power_of_two, a.lo * power_of_two};
}

static inline VolDd vol_dd_div(VolDd a, VolDd b)
{
    double q = a.hi / b.hi;
    VolDd back = vol_dd_product(q, b.hi);
    double rest = ((a.hi - back.hi) - back.lo) + (a.lo - q * b.lo);
    return vol_dd_quick_sum(q, rest / b.hi);
}

static inline VolDd vol_dd_sqrt(VolDd a) /* a > 0 */
{
    double s = sqrt(a.hi), rest = fma(-s, s, a.hi) + a.lo;
    return vol_dd_quick_sum(s, rest / (2 * s));
}

#endif
