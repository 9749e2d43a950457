/* Within tf/: what the files of pre-integration share. */
#ifndef VOL_TF_PREINT_PRIVATE_H
#define VOL_TF_PREINT_PRIVATE_H

#include "tf/preint.h"

/* The properties at v by the lines of one interval, whose end v may be. */
void vol_tf_sample_within(const VolTfInterval *interval, double v, VolTfSample *out);

/* A bin, the values between two neighbouring nodes run through at constant speed, or a piece of one: what leaves of
 * tables are made of, whatever the step.  w in [0, 1] is the position; s(w), p(w) are the surfaces' optical depth
 * and the particles' for a bin run through in length 1; s(1) = surface, p(1) = particle.  A pair holds the bin run
 * through upwards and, in the second place, the mirrored one (bin n-2-b for b) run through downwards. */
typedef double Pair __attribute__((vector_size(16)));

typedef struct BinColor {
    Pair surface, source;           /* int c_s ds, int q dw */
    Pair surface_on_s, surface_on_p; /* int s d(surface) - s surface / 2, and with p: how it is spread over the depth */
    Pair source_on_s, source_on_p;
} BinColor;

typedef struct Bin {
    Pair surface, particle;
    Pair mixed;                   /* int p ds - s(1) p(1) / 2: are surfaces or particles in front? */
    Pair where_s, where_p;        /* int w ds - s / 2, int w dp - p / 2 */
    BinColor color[3];
} Bin;

/* Bin b is made of pieces first[b] .. first[b+1]-1, each `share` of its width; b = 0 .. n-2.  Where the two of a
 * pair have not the same number, empty ones fill up. */
typedef struct Bins {
    Bin *pieces;
    Pair *share;
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

/* The states that building works in; one per thread. */
typedef struct State {
    Pair t;                   /* transmittance */
    Pair a0, a1, p0;          /* opacity of surfaces, its first moment about the front (in bins), of particles */
    Pair c0[3], c1[3], q[3];  /* colour of surfaces, its moment, of particles */
} State;

/* Diagonal k >= 1 of the table: the opacities of `channel`, and the colours that go with it (its own where
 * attenuation is coloured, else all).  leaves: n - 1 states, suffix: k states, to work in. */
void vol_preint_diagonal(const VolPreint *tables, const VolPreintTable *table, const Bins *bins, size_t k, int channel,
                         State *leaves, State *suffix);

#endif
