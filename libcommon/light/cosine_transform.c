/* What transforms of one length share: factors, roots of unity, and for lengths with large prime factors Bluestein's
 * convolution (derivations in cosine_transform_tmpl.h).  Everything is computed in double and rounded once. */
#include "light/cosine_transform.h"

#include <stdlib.h>

#include "base/fmath.h"
#include "base/mem.h"

static const double pi = 3.14159265358979323846;

/* exp(-2 pi i part / whole), part in 0..whole-1 */
static void root_of_unity(long long part, long long whole, double out[2])
{
    double angle = 2 * pi * (double)part / (double)whole;
    out[0] = vol_cos(angle);
    out[1] = -vol_sin(angle);
}

/* Of what is left of a length: 4 before 2, since one pass over memory does for two. */
static int next_radix(int n)
{
    if (n % 4 == 0)
        return 4;
    for (int r = 2; r <= VOL_FOURIER_RADIX; r++)
        if (n % r == 0)
            return r;
    return 0;
}

static bool is_smooth(int n, int largest)
{
    for (int r = 2; r <= largest; r++)
        while (n % r == 0)
            n /= r;
    return n == 1;
}

static VolStatus new_roots(VolFourier *f, int radix, VolError *err)
{
    if (radix % 2 == 0 || f->roots[radix])
        return VOL_OK;
    if (!(f->roots[radix] = vol_alloc((size_t)radix, 2 * sizeof(float))))
        return vol_fail_memory(err, (size_t)radix * 2 * sizeof(float));
    for (int j = 0; j < radix; j++) {
        double root[2];
        root_of_unity(j, radix, root);
        f->roots[radix][2 * j] = (float)root[0];
        f->roots[radix][2 * j + 1] = (float)-root[1];
    }
    return VOL_OK;
}

static VolStatus new_fourier(int n, VolFourier *f, VolError *err)
{
    /* A pass of radix r over what is left, r m, takes (r - 1) m twiddles: fewer than 2 n in all. */
    f->n = n;
    if (!(f->twiddles = vol_alloc((size_t)n, 4 * sizeof(float))))
        return vol_fail_memory(err, (size_t)n * 4 * sizeof(float));
    float *to = f->twiddles;
    for (int left = n, radix; left > 1; left /= radix) {
        radix = next_radix(left);
        f->radix[f->passes++] = radix;
        VolStatus status = new_roots(f, radix, err);
        if (status != VOL_OK)
            return status;
        for (int p = 0; p < left / radix; p++)
            for (int k = 1; k < radix; k++, to += 2) {
                double root[2];
                root_of_unity((long long)p * k % left, left, root);
                to[0] = (float)root[0];
                to[1] = (float)root[1];
            }
    }
    return VOL_OK;
}

/* The other factor of the convolution, exp(pi i j^2 / n) for j = 1-n..n-1, wrapped to length m; being even it has the
 * transform b_0 + 2 sum_j b_j cos(2 pi j k / m), itself even. */
static void transform_chirp(const double *chirp, const double *cosines, int n, int m, float *out)
{
    for (int k = 0; k <= m / 2; k++) {
        double re = chirp[0], im = -chirp[1];
        long long at = 0;
        for (int j = 1; j < n; j++) {
            at += k;
            at -= at >= m ? m : 0;
            re += 2 * chirp[2 * j] * cosines[at];
            im -= 2 * chirp[2 * j + 1] * cosines[at];
        }
        for (int half = 0; half < 2; half++) {
            int to = half ? (m - k) % m : k;
            out[2 * to] = (float)(re / m);
            out[2 * to + 1] = (float)(im / m);
        }
    }
}

static VolStatus new_convolution(VolCosine *plan, int m, VolError *err)
{
    size_t n = (size_t)plan->n, size = (size_t)m;
    double *chirp = vol_alloc(n, 2 * sizeof *chirp), *cosines = vol_alloc(size, sizeof *cosines);
    plan->chirp = vol_alloc(n, 2 * sizeof *plan->chirp);
    plan->chirp_transform = vol_alloc(size, 2 * sizeof *plan->chirp_transform);
    bool enough = chirp && cosines && plan->chirp && plan->chirp_transform;
    if (enough) {
        for (int j = 0; j < plan->n; j++)
            root_of_unity((long long)j * j % (2LL * plan->n), 2LL * plan->n, chirp + 2 * j);
        for (int j = 0; j < m; j++) {
            double root[2];
            root_of_unity(j, m, root);
            cosines[j] = root[0];
        }
        for (size_t j = 0; j < 2 * n; j++)
            plan->chirp[j] = (float)chirp[j];
        transform_chirp(chirp, cosines, plan->n, m, plan->chirp_transform);
    }
    free(chirp);
    free(cosines);
    return enough ? VOL_OK : vol_fail_memory(err, size * 2 * sizeof(double));
}

VolStatus vol_cosine_new(int n, VolCosine *out, VolError *err)
{
    *out = (VolCosine){.n = n};
    int length = n;
    if (!is_smooth(n, VOL_FOURIER_RADIX))
        for (length = 2 * n - 1; !is_smooth(length, 5); length++)
            ;
    VolStatus status = new_fourier(length, &out->fourier, err);
    if (status == VOL_OK && length != n)
        status = new_convolution(out, length, err);
    if (status != VOL_OK)
        return status;
    if (!(out->rotation = vol_alloc((size_t)n, 2 * sizeof *out->rotation)))
        return vol_fail_memory(err, (size_t)n * 2 * sizeof *out->rotation);
    for (int k = 0; k < n; k++) {
        double angle = pi * k / (2.0 * n);
        out->rotation[2 * k] = (float)vol_cos(angle);
        out->rotation[2 * k + 1] = (float)vol_sin(angle);
    }
    return VOL_OK;
}

void vol_cosine_free(VolCosine *plan)
{
    free(plan->fourier.twiddles);
    for (int r = 0; r <= VOL_FOURIER_RADIX; r++)
        free(plan->fourier.roots[r]);
    free(plan->chirp);
    free(plan->chirp_transform);
    free(plan->rotation);
    *plan = (VolCosine){0};
}
