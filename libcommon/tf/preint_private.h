/* Within tf/: what the files of pre-integration share. */
#ifndef VOL_TF_PREINT_PRIVATE_H
#define VOL_TF_PREINT_PRIVATE_H

#ifndef VOL_DOUBLE
#define VOL_DOUBLE
#endif
#include "simd/reals.h"
#include "tf/preint.h"

/* The properties at v by the lines of one interval, whose end v may be. */
void vol_tf_sample_within(const VolTfInterval *interval, double v, VolTfSample *out);

/* A bin, the values between two neighbouring nodes run through at constant speed, or a piece of one: what leaves of
 * tables are made of, whatever the step.  w in [0, 1] is the position; s(w), p(w) are the surfaces' optical depth
 * and the particles' for a bin run through in length 1; s(1) = surface, p(1) = particle.  A vector holds a couple of bins,
 * 2m and 2m+1, each run through upwards and, in the place behind, its mirror image (bin n-2-b for b) run through
 * downwards. */
typedef struct BinColor {
    reals surface, source;            /* int c_s ds, int q dw */
    reals surface_on_s, surface_on_p; /* int s d(surface) - s surface / 2, and with p: how it is spread over the depth */
    reals source_on_s, source_on_p;
} BinColor;

typedef struct Bin {
    reals surface, particle;
    reals mixed;           /* int p ds - s(1) p(1) / 2: are surfaces or particles in front? */
    reals where_s, where_p; /* int w ds - s / 2, int w dp - p / 2 */
    BinColor color[3];
} Bin;

/* Couple m is made of pieces first[m] .. first[m+1]-1, each `share` of its bin's width; m = 0 .. n/2 - 1.  Where the four
 * of a vector have not the same number, empty ones fill up; so does a bin where the last couple has but one. */
typedef struct Bins {
    Bin *pieces;
    reals *share;
    size_t *first;
} Bins;

/* Into how many equal parts bins are cut, and at every knot too where there are at most so many, so that properties are
 * linear on each piece. */
typedef struct VolPreintCut {
    size_t parts, most_knots;
} VolPreintCut;

/* For the attenuation of one channel. */
VolStatus vol_preint_bins(const VolPreint *tables, int channel, VolPreintCut how, Bins *out, VolError *err);
void vol_preint_bins_free(Bins *bins);

/* What a stretch shows of one quantity: of opacity, or of a colour. */
typedef struct Light {
    reals all, moment; /* of surfaces; their first moment about the front, in bins */
    reals particles;
} Light;

/* The states that building works in.  Quantities, opacity and then colours, lie in pairs: quantity q upwards is
 * [q % 2 * 2] of light[q / 2], downwards [q % 2 * 2 + 1]. */
typedef struct State {
    reals t; /* transmittance upwards, downwards, and both again */
    Light light[2];
} State;

/* Diagonal k >= 1 of the table: the opacities of `channel`, and the colours that go with it (its own where
 * attenuation is coloured, else all).  leaves: n states, suffix: k states, to work in. */
typedef void VolPreintDiagonal(const VolPreint *tables, const VolPreintTable *table, const Bins *bins, size_t k,
                               int channel, State *leaves, State *suffix);

VolPreintDiagonal vol_preint_diagonal, vol_preint_diagonal_avx2; /* the same bytes */

#endif
