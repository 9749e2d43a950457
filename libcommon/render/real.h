/* The few operations that the ray kernels are written in, in float or in double (VOL_DOUBLE).
 *
 * A kernel's body is compiled once per precision and cpu level from the same text: multiply-adds are always explicit, so
 * that every level rounds alike.  exp is ours: Cody-Waite reduction and a Taylor polynomial, below 1 ulp (double) and
 * 1.5 ulp (float) for arguments <= 0, exactly 0 below the smallest normal number. */
#ifndef VOL_RENDER_REAL_H
#define VOL_RENDER_REAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef VOL_DOUBLE

typedef double real;
#define REAL_EPSILON 0x1p-52
#define GAUSS_NODES 10

static inline real real_fma(real a, real b, real c) { return __builtin_fma(a, b, c); }
static inline real real_sqrt(real a) { return __builtin_sqrt(a); }
static inline real real_abs(real a) { return __builtin_fabs(a); }
static inline real real_floor(real a) { return __builtin_floor(a); }
static inline real real_ceil(real a) { return __builtin_ceil(a); }

static inline real real_exp(real x)
{
    const real magic = 0x1.8p52;
    real clamped = x < -708.0 ? -708.0 : x;
    real shifted = real_fma(clamped, 0x1.71547652b82fep0, magic);
    real n = shifted - magic;
    real r = real_fma(n, -0x1.62e42fefa39efp-1, clamped);
    r = real_fma(n, -0x1.abc9e3b39803fp-56, r);
    static const real c[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0, 1.0 / 362880.0,
                             1.0 / 40320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5};
    real p = c[0];
    for (int i = 1; i < 12; i++)
        p = real_fma(p, r, c[i]);
    p = real_fma(r * r, p, r) + 1;
    int64_t bits;
    memcpy(&bits, &p, sizeof bits);
    bits += (int64_t)((uint64_t)(int64_t)n << 52);
    memcpy(&p, &bits, sizeof p);
    return x < -708.0 ? 0 : p;
}

/* Gauss-Legendre on [0, 1]. */
static const real gauss_x[GAUSS_NODES] = {
    0.0130467357414141404275965, 0.0674683166555077457049450, 0.1602952158504878099609670,
    0.2833023029353763933002597, 0.4255628305091844199026241, 0.5744371694908155800973759,
    0.7166976970646236066997403, 0.8397047841495122177946087, 0.9325316833444922126616916,
    0.9869532642585858717154679};
static const real gauss_w[GAUSS_NODES] = {
    0.0333356721543440689958793, 0.0747256745752902934443185, 0.1095431812579910207938738,
    0.1346333596549981748147218, 0.1477621123573764350123128, 0.1477621123573764350123128,
    0.1346333596549981748147218, 0.1095431812579910207938738, 0.0747256745752902934443185,
    0.0333356721543440689958793};
#else

typedef float real;
#define REAL_EPSILON 0x1p-23f
#define GAUSS_NODES 6

static inline real real_fma(real a, real b, real c) { return __builtin_fmaf(a, b, c); }
static inline real real_sqrt(real a) { return __builtin_sqrtf(a); }
static inline real real_abs(real a) { return __builtin_fabsf(a); }
static inline real real_floor(real a) { return __builtin_floorf(a); }
static inline real real_ceil(real a) { return __builtin_ceilf(a); }

static inline real real_exp(real x)
{
    const real magic = 0x1.8p23f;
    real clamped = x < -87.0f ? -87.0f : x;
    real shifted = real_fma(clamped, 0x1.715476p0f, magic);
    real n = shifted - magic;
    real r = real_fma(n, -0x1.62e4p-1f, clamped);
    r = real_fma(n, -0x1.7f7d1cp-20f, r);
    real p = 1.0f / 5040;
    p = real_fma(p, r, 1.0f / 720);
    p = real_fma(p, r, 1.0f / 120);
    p = real_fma(p, r, 1.0f / 24);
    p = real_fma(p, r, 1.0f / 6);
    p = real_fma(p, r, 0.5f);
    p = real_fma(r * r, p, r) + 1;
    int32_t bits;
    memcpy(&bits, &p, sizeof bits);
    bits += (int32_t)((uint32_t)(int32_t)n << 23);
    memcpy(&p, &bits, sizeof p);
    return x < -87.0f ? 0 : p;
}

/* Gauss-Legendre on [0, 1]. */
static const real gauss_x[GAUSS_NODES] = {
    0.033765242898423986094f, 0.16939530676686774317f, 0.38069040695840154568f,
    0.61930959304159845432f, 0.83060469323313225683f, 0.96623475710157601391f};
static const real gauss_w[GAUSS_NODES] = {
    0.085662246189585172520f, 0.18038078652406930378f, 0.23395696728634552369f,
    0.23395696728634552369f, 0.18038078652406930378f, 0.085662246189585172520f};
#endif

static inline real real_min(real a, real b) { return a < b ? a : b; }
static inline real real_max(real a, real b) { return a > b ? a : b; }
static inline real real_clamp(real a, real lo, real hi) { return a < lo ? lo : a > hi ? hi : a; }

#endif
