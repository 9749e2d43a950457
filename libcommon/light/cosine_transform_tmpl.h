/* Cosine transforms of 2 LANES lines side by side, two real lines as one complex one.
 *
 * Makhoul: with v = (x_0, x_2, x_4, .., x_5, x_3, x_1), V its Fourier transform and w = exp(-pi i k / 2n),
 *     w V_k = C_k - i C_{n-k},     C_k = sum_j x_j cos(pi k (2j + 1) / 2n),     C_n = 0,
 * for even and odd n.  Of two lines a and b, Z the transform of a + i b has a's and b's within it:
 *     A_k = (Z_k + conj Z_{n-k}) / 2,     B_k = (Z_k - conj Z_{n-k}) / 2i.
 * The inverse goes back the same way, V_k = conj w (C_k - i C_{n-k}), and by a Fourier transform with real and imaginary
 * parts exchanged, before and after.
 *
 * The Fourier transform is Stockham's, which needs no permutation: a pass of radix r over n = r m, at stride s, takes
 *     y[q + s (r p + k)] = exp(-2 pi i p k / n) sum_j x[q + s (p + j m)] exp(-2 pi i j k / r).
 * Lengths with large prime factors: Bluestein, 2jk = j^2 + k^2 - (k - j)^2, a convolution of a smooth length.
 *
 * Nothing is fused: machines without fused multiply-add give the same bits, and quickly.
 *
 * PARAMETERS  none: in float
 * PROVIDES    Complexes, cosine_position(), cosine_forward(), cosine_inverse(); load_lanes(), store_lanes() */
#ifndef VOL_LIGHT_COSINE_TRANSFORM_TMPL_H
#define VOL_LIGHT_COSINE_TRANSFORM_TMPL_H

#include "light/cosine_transform.h"
#include "simd/reals.h"

typedef struct Complexes {
    reals re, im; /* lines 0..LANES-1 and the LANES after them */
} Complexes;

ALWAYS_INLINE reals load_lanes(const float *from)
{
    reals a;
    memcpy(&a, from, sizeof a);
    return a;
}
ALWAYS_INLINE void store_lanes(float *to, reals a) { memcpy(to, &a, sizeof a); }

/* Where sample j of a line stands before a forward, and after an inverse transform. */
ALWAYS_INLINE int cosine_position(int n, int j) { return j % 2 ? n - 1 - j / 2 : j / 2; }

ALWAYS_INLINE Complexes plus(Complexes a, Complexes b) { return (Complexes){a.re + b.re, a.im + b.im}; }
ALWAYS_INLINE Complexes minus(Complexes a, Complexes b) { return (Complexes){a.re - b.re, a.im - b.im}; }
ALWAYS_INLINE Complexes times(Complexes a, const float w[2])
{
    reals re = reals_all(w[0]), im = reals_all(w[1]);
    return (Complexes){a.re * re - a.im * im, a.re * im + a.im * re};
}
ALWAYS_INLINE Complexes times_minus_i(Complexes a) { return (Complexes){a.im, -a.re}; }

/* ---- Passes ---- */

ALWAYS_INLINE void pass_2(const Complexes *x, Complexes *y, int m, int s, const float *w)
{
    for (int p = 0; p < m; p++, w += 2)
        for (int q = 0; q < s; q++) {
            Complexes a = x[q + s * p], b = x[q + s * (p + m)];
            y[q + s * 2 * p] = plus(a, b);
            y[q + s * (2 * p + 1)] = times(minus(a, b), w);
        }
}

ALWAYS_INLINE void pass_4(const Complexes *x, Complexes *y, int m, int s, const float *w)
{
    for (int p = 0; p < m; p++, w += 6)
        for (int q = 0; q < s; q++) {
            const Complexes *from = x + q + s * p;
            Complexes a = from[0], b = from[s * m], c = from[2 * s * m], d = from[3 * s * m], *to = y + q + s * 4 * p;
            Complexes even = plus(a, c), odd = minus(a, c), sum = plus(b, d), turned = times_minus_i(minus(b, d));
            to[0] = plus(even, sum);
            to[s] = times(plus(odd, turned), w);
            to[2 * s] = times(minus(even, sum), w + 2);
            to[3 * s] = times(minus(odd, turned), w + 4);
        }
}

/* Of an odd radix r: outputs k and r - k share their sums. */
ALWAYS_INLINE void butterfly_odd(const Complexes *x, size_t from, Complexes *y, size_t to, int r, const float *roots,
                                 const float *w)
{
    Complexes sum[VOL_FOURIER_RADIX / 2], difference[VOL_FOURIER_RADIX / 2], first = x[0], all = first;
    const int half = r / 2;
    for (int j = 1; j <= half; j++) {
        Complexes a = x[from * (size_t)j], b = x[from * (size_t)(r - j)];
        sum[j - 1] = plus(a, b);
        difference[j - 1] = minus(a, b);
        all = plus(all, sum[j - 1]);
    }
    y[0] = all;
    for (int k = 1; k <= half; k++) {
        Complexes even = first, odd = {reals_all(0), reals_all(0)};
        for (int j = 1, at = k; j <= half; j++) {
            reals c = reals_all(roots[2 * at]), d = reals_all(roots[2 * at + 1]);
            even = (Complexes){even.re + c * sum[j - 1].re, even.im + c * sum[j - 1].im};
            odd = (Complexes){odd.re + d * difference[j - 1].re, odd.im + d * difference[j - 1].im};
            at += k;
            at -= at >= r ? r : 0;
        }
        odd = times_minus_i(odd);
        y[to * (size_t)k] = times(plus(even, odd), w + 2 * (k - 1));
        y[to * (size_t)(r - k)] = times(minus(even, odd), w + 2 * (r - k - 1));
    }
}

ALWAYS_INLINE void pass_odd(const Complexes *x, Complexes *y, int r, int m, int s, const float *roots, const float *w)
{
    for (int p = 0; p < m; p++, w += 2 * (r - 1))
        for (int q = 0; q < s; q++)
            butterfly_odd(x + q + s * p, (size_t)s * (size_t)m, y + q + s * r * p, (size_t)s, r, roots, w);
}

static void pass(const VolFourier *f, int r, const Complexes *x, Complexes *y, int m, int s, const float *w)
{
    switch (r) {
    case 2: pass_2(x, y, m, s, w); break;
    case 4: pass_4(x, y, m, s, w); break;
    case 3: pass_odd(x, y, 3, m, s, f->roots[3], w); break;
    case 5: pass_odd(x, y, 5, m, s, f->roots[5], w); break;
    default: pass_odd(x, y, r, m, s, f->roots[r], w); break;
    }
}

/* Of what stands in x; its result stands in what is returned, x or y. */
static Complexes *fourier(const VolFourier *f, Complexes *x, Complexes *y)
{
    const float *w = f->twiddles;
    for (int i = 0, left = f->n, s = 1; i < f->passes; i++) {
        int r = f->radix[i], m = left / r;
        pass(f, r, x, y, m, s, w);
        w += 2 * m * (r - 1);
        s *= r;
        left = m;
        Complexes *swap = x;
        x = y;
        y = swap;
    }
    return x;
}

static Complexes *fourier_by_convolution(const VolCosine *plan, Complexes *x, Complexes *y)
{
    const VolFourier *f = &plan->fourier;
    const Complexes zero = {reals_all(0), reals_all(0)};
    for (int j = 0; j < f->n; j++)
        x[j] = j < plan->n ? times(x[j], plan->chirp + 2 * j) : zero;
    Complexes *z = fourier(f, x, y), *other = z == x ? y : x;
    for (int k = 0; k < f->n; k++) {
        Complexes product = times(z[k], plan->chirp_transform + 2 * k);
        z[k] = (Complexes){product.im, product.re};
    }
    z = fourier(f, z, other);
    for (int k = 0; k < plan->n; k++)
        z[k] = times((Complexes){z[k].im, z[k].re}, plan->chirp + 2 * k);
    return z;
}

static Complexes *transformed(const VolCosine *plan, Complexes *work)
{
    Complexes *spare = work + plan->fourier.n;
    return plan->chirp ? fourier_by_convolution(plan, work, spare) : fourier(&plan->fourier, work, spare);
}

/* ---- The transforms ---- */

/* Samples in `work` at cosine_position(); coefficients of both halves of the lines, in order, where the result points.
 * `work`: vol_cosine_work() vectors. */
static inline const Complexes *cosine_forward(const VolCosine *plan, Complexes *work)
{
    const int n = plan->n;
    Complexes *z = transformed(plan, work);
    const reals half = reals_all((float)(0.5 / n)), whole = reals_all((float)(1.0 / n));
    z[0] = (Complexes){z[0].re * whole, z[0].im * whole};
    for (int k = 1; k <= n / 2; k++) {
        reals c = reals_all(plan->rotation[2 * k]), d = reals_all(plan->rotation[2 * k + 1]);
        Complexes a = z[k], b = z[n - k];
        reals a_re = (a.re + b.re) * half, a_im = (a.im - b.im) * half;
        reals b_re = (a.im + b.im) * half, b_im = (b.re - a.re) * half;
        z[n - k] = (Complexes){d * a_re - c * a_im, d * b_re - c * b_im};
        z[k] = (Complexes){c * a_re + d * a_im, c * b_re + d * b_im};
    }
    return z;
}

/* Coefficients in `work`, in order; samples at cosine_position() of the result, whose real and imaginary parts have changed
 * places. */
static inline const Complexes *cosine_inverse(const VolCosine *plan, Complexes *work)
{
    const int n = plan->n;
    work[0] = (Complexes){work[0].im, work[0].re};
    for (int k = 1; k <= n / 2; k++) {
        reals c = reals_all(plan->rotation[2 * k]), d = reals_all(plan->rotation[2 * k + 1]);
        Complexes x = work[k], y = work[n - k];
        reals a_re = c * x.re + d * y.re, a_im = d * x.re - c * y.re;
        reals b_re = c * x.im + d * y.im, b_im = d * x.im - c * y.im;
        work[n - k] = (Complexes){b_re - a_im, a_re + b_im};
        work[k] = (Complexes){a_im + b_re, a_re - b_im};
    }
    return transformed(plan, work);
}

#endif
