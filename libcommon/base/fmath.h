/* Elementary functions in double whose results are the same bits on every machine and at every cpu level: the C library's
 * own differ between hosts with and without fused multiply-add.  At most 1 ulp from exact (pow: 2); exact at the obvious
 * points (exp 0, log 1, pow x 0); infinities, NaN and denormals as C's Annex F has them.
 * For set-up work; kernels have vector forms of their own in render/. */
#ifndef VOL_BASE_FMATH_H
#define VOL_BASE_FMATH_H

double vol_exp(double x);
double vol_expm1(double x);
double vol_log(double x);
double vol_log1p(double x);
double vol_pow(double x, double y);
double vol_sin(double x);
double vol_cos(double x);
double vol_tan(double x);
double vol_asin(double x);
double vol_acos(double x);
double vol_atan2(double y, double x);
double vol_cbrt(double x);

#endif
