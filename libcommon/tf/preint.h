/* Pre-integration: what a stretch of a ray adds to a picture, the value running linearly from v0 to v1 over a length
 * dl (Yang et al. 2012, Y, equations 16 to 23).
 *
 *     sigma = mu_p(v) + mu_s(v) |dv/dl|       extinction: particles per world unit, surfaces per unit of the field
 *     M_s = int mu_s dv    C_s = int c_s mu_s dv    V = int mu_s v dv      of surfaces (Y 16, 18)
 *     M_p = int mu_p dv    C_p = int q_p dv,  q_p = c_p mu_p + e_p         of particles: scatter and absorb, and emit
 *
 * all of them piecewise polynomial, hence exact here.  Isosurfaces (Dirac items) are in none of this: a ray is cut
 * where it crosses one.  Everything holds three channels; where attenuation is grey (VolTfCompiled.coloured is
 * false) the three opacities of a kind are the same number. */
#ifndef VOL_TF_PREINT_H
#define VOL_TF_PREINT_H

#include "base/cpu.h"
#include "tf/tf.h"

/* ---- Values and integrals in one dimension ---- */

typedef struct VolTfSample {
    double surface, surface_color[3]; /* mu_s, c_s */
    double particle[3], source[3];    /* mu_p, q_p */
} VolTfSample;

/* At a jump: what begins there. */
void vol_tf_sample(const VolTfCompiled *tf, double v, VolTfSample *out);

typedef struct VolTfIntegral {
    double surface, surface_color[3]; /* M_s, C_s */
    double particle[3], source[3];    /* M_p, C_p */
    double value;                     /* V */
} VolTfIntegral;

typedef struct VolTfIntegrals {
    const VolTfCompiled *tf; /* must live as long */
    VolTfIntegral *at_knot;  /* from the first knot to each */
} VolTfIntegrals;

VolStatus vol_tf_integrals_new(const VolTfCompiled *tf, VolTfIntegrals *out, VolError *err);
void vol_tf_integrals_free(VolTfIntegrals *integrals);

/* After vol_tf_compiled_rescale of the transfer function. */
void vol_tf_integrals_rescale(VolTfIntegrals *integrals, double scale);

/* From v0 to v1, v0 <= v1; either may lie anywhere. */
void vol_tf_integrals_between(const VolTfIntegrals *integrals, double v0, double v1, VolTfIntegral *out);

/* ---- One segment ---- */

/* Y 22: surfaces seen with the shading at the front (fw) and at the back (bw) of the segment, and particles;
 * opacities and premultiplied colours.  fw_a + bw_a + p_a = alpha = 1 - exp(-optical depth).  Shaded by k and b at
 * both ends (Y 23): colour = k0 fw_c + b0 fw_a + k1 bw_c + b1 bw_a + p_c. */
typedef struct VolPreintSegment {
    double fw_a[3], bw_a[3], p_a[3];
    double fw_c[3], bw_c[3], p_c[3];
    double alpha[3], depth[3]; /* depth: the optical depth */
} VolPreintSegment;

/* By the definition, to about 1e-14: cut at every knot, Gauss quadrature on pieces of optical depth 1/2.  For any
 * values and any dl >= 0. */
void vol_preint_segment(const VolTfCompiled *tf, double v0, double v1, double dl, VolPreintSegment *out);

/* Y 17 to 19: without the attenuation of one part of the segment by another, from the integrals alone. */
typedef struct VolPreintApproximation {
    double surface_a[3], surface_c[3], particle_a[3], particle_c[3];
    double alpha[3], depth[3]; /* exact: surface_a + particle_a; optical depth */
    double v_c;      /* the value whose surface stands for all (Y 18); the mean of v0 and v1 where there is none */
} VolPreintApproximation;

void vol_preint_integrals_at(const VolTfIntegrals *integrals, double v0, double v1, double dl,
                             VolPreintApproximation *out);

/* ---- Tables over v0 and v1 ---- */

/* One step length.  Entries are kept by diagonals k = |j - i|: building writes and looking up reads along them, and a
 * band is just fewer of them.  `rising` holds j >= i, `falling` j <= i (k = 0: unused); diagonal k begins at entry
 * k n - k (k - 1) / 2 and is indexed by the lower of i and j. */
typedef struct VolPreintTable {
    double step;
    size_t band; /* the last diagonal, at most n - 1 */
    float *rising, *falling;
    VolPages pages; /* where both lie */
} VolPreintTable;

/* An entry is `floats` numbers: fw_a, bw_a, p_a (`channels` each), then fw_c, bw_c, p_c (three each). */
typedef struct VolPreint {
    VolTfIntegrals integrals; /* and with it the transfer function, which must live as long */
    double lo, hi;            /* node i lies at lo + i (hi - lo) / (n - 1) */
    size_t n;
    int channels;             /* 1, or 3 where attenuation is coloured */
    size_t floats;            /* 3 channels + 9 */
    VolPreintTable *octaves;  /* of steps step, 2 step, 4 step, ... */
    size_t octave_count;      /* 0: 1D only */
    unsigned char *dense;     /* per bin: a surface's optical depth in it is above VOL_PREINT_DENSE, or properties break */
} VolPreint;

#define VOL_PREINT_MOST_NODES 4096
#define VOL_PREINT_DENSE 0.25

typedef struct VolPreintOptions {
    double lo, hi; /* lo < hi */
    size_t n;      /* 2 .. VOL_PREINT_MOST_NODES where octaves > 0, else up to 2^20 */
    double step;   /* world units, above 0 */
    size_t octaves;
    double change; /* by how much the value can change over `step`; INFINITY: all of the table is built */
    int threads;
    VolCpu cpu; /* whose kernels; the same tables by any */
} VolPreintOptions;

/* From the lowest to the highest node; widened where that is nothing. */
void vol_preint_default_range(const VolTfCompiled *tf, double *lo, double *hi);

/* Same tables whatever the number of threads.  VOL_BAD_INPUT where numbers are too large for float. */
VolStatus vol_preint_build(const VolTfCompiled *tf, const VolPreintOptions *options, VolPreint *out, VolError *err);
/* The same with octaves that are not filled yet.  `bands`: one per octave, or NULL: from `change`. */
VolStatus vol_preint_allocate(const VolTfCompiled *tf, const VolPreintOptions *options, const size_t *bands,
                              VolPreint *out, VolError *err);
void vol_preint_free(VolPreint *tables);

/* After vol_tf_compiled_rescale of the transfer function; its integrals included. */
void vol_preint_rescale(VolPreint *tables, double scale);

static inline double vol_preint_node(const VolPreint *tables, size_t i)
{
    return i + 1 == tables->n ? tables->hi
                              : tables->lo + (double)i * ((tables->hi - tables->lo) / (double)(tables->n - 1));
}

static inline bool vol_preint_in_band(const VolPreintTable *table, size_t i, size_t j)
{
    return (i < j ? j - i : i - j) <= table->band;
}

/* (v0, v1) = nodes (i, j), within the band. */
static inline float *vol_preint_entry(const VolPreint *tables, const VolPreintTable *table, size_t i, size_t j)
{
    size_t k = i < j ? j - i : i - j, row = k * tables->n - k * (k - 1) / 2;
    return (j >= i ? table->rising : table->falling) + (row + (i < j ? i : j)) * tables->floats;
}

/* Opacity is exact for every v0, v1 and dl; how it divides into parts, and the parts' colours, are interpolated between
 * nodes and, for another dl than the tables', between octaves.  What no table covers (beyond the range or the band)
 * comes from vol_preint_segment; so does what begins or ends in a bin that is dense. */
void vol_preint_full_at(const VolPreint *tables, double v0, double v1, double dl, VolPreintSegment *out);

/* (1 - exp(-t)) / t, 1 at 0 */
double vol_preint_phi(double t);

#endif
