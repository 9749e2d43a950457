/* The constants of every bin, or of its pieces between knots: integrals of polynomials, exact by three Gauss nodes. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/gauss.h"
#include "tf/preint_private.h"

/* One direction, before pairing. */
typedef struct Sums {
    double s, p, mixed, where_s, where_p;
    double surface[3], source[3], surface_on_s[3], surface_on_p[3], source_on_s[3], source_on_p[3];
} Sums;

/* The ends of a stretch without knots: mu_s and mu_p are linear between them. */
typedef struct Stretch {
    VolTfSample a, b;
    double width; /* in units of the field */
} Stretch;

static double linear_integral(double a, double b, double u) { return u * (a + u * (b - a) / 2); }

static double lerp(double a, double b, double u) { return a + u * (b - a); }

/* The stretch from w0 on, a fraction dw of all. */
static void add_stretch(Sums *sum, const Stretch *st, const VolTfSample at[3], double w0, double dw, int channel)
{
    double s0 = sum->s, p0 = sum->p;
    for (int i = 0; i < 3; i++) {
        double u = vol_gauss3_x[i], w = w0 + dw * u;
        double s = s0 + st->width * linear_integral(st->a.surface, st->b.surface, u);
        double p = p0 + dw * linear_integral(st->a.particle[channel], st->b.particle[channel], u);
        double ds = vol_gauss3_w[i] * st->width * lerp(st->a.surface, st->b.surface, u);
        double d = vol_gauss3_w[i] * dw, dp = d * lerp(st->a.particle[channel], st->b.particle[channel], u);
        sum->mixed += p * ds;
        sum->where_s += w * ds;
        sum->where_p += w * dp;
        for (int c = 0; c < 3; c++) {
            double surface = ds * at[i].surface_color[c], source = d * at[i].source[c];
            sum->surface[c] += surface;
            sum->source[c] += source;
            sum->surface_on_s[c] += s * surface;
            sum->surface_on_p[c] += p * surface;
            sum->source_on_s[c] += s * source;
            sum->source_on_p[c] += p * source;
        }
    }
    sum->s = s0 + st->width * linear_integral(st->a.surface, st->b.surface, 1);
    sum->p = p0 + dw * linear_integral(st->a.particle[channel], st->b.particle[channel], 1);
}

static void sum_between(const VolTfCompiled *tf, double v0, double v1, int channel, Sums *sum)
{
    *sum = (Sums){0};
    for (size_t i = vol_tf_interval(tf, v0); i <= tf->knot_count; i++) {
        const VolTfInterval *in = &tf->intervals[i];
        double a = fmax(v0, in->v0), b = fmin(v1, in->v1);
        if (a >= v1)
            break;
        Stretch st = {.width = b - a};
        VolTfSample at[3];
        vol_tf_sample_within(in, a, &st.a);
        vol_tf_sample_within(in, b, &st.b);
        for (int k = 0; k < 3; k++)
            vol_tf_sample_within(in, a + vol_gauss3_x[k] * (b - a), &at[k]);
        add_stretch(sum, &st, at, (a - v0) / (v1 - v0), (b - a) / (v1 - v0), channel);
    }
}

/* Deviations from even spreading; the mirror image (an odd lane) has the opposite ones.  Particles count by the share of
 * the bin's length that the piece takes. */
static void put_piece(const Sums *sum, double share, size_t lane, Bin *to)
{
    double s = sum->s, p = sum->p, turn = lane & 1 ? -1 : 1, turned_share = turn * share;
    to->surface[lane] = s;
    to->particle[lane] = p * share;
    to->mixed[lane] = (sum->mixed - s * p / 2) * turned_share;
    to->where_s[lane] = (sum->where_s - s / 2) * turn;
    to->where_p[lane] = (sum->where_p - p / 2) * turned_share;
    for (int c = 0; c < 3; c++) {
        BinColor *color = &to->color[c];
        color->surface[lane] = sum->surface[c];
        color->source[lane] = sum->source[c] * share;
        color->surface_on_s[lane] = (sum->surface_on_s[c] - s * sum->surface[c] / 2) * turn;
        color->surface_on_p[lane] = (sum->surface_on_p[c] - p * sum->surface[c] / 2) * turned_share;
        color->source_on_s[lane] = (sum->source_on_s[c] - s * sum->source[c] / 2) * turned_share;
        color->source_on_p[lane] = (sum->source_on_p[c] - p * sum->source[c] / 2) * turned_share * share;
    }
}

/* Where one bin is cut: at its knots and into equal parts. */
typedef struct Cuts {
    double v0, v1, cut;    /* of the bin; where the last piece ended */
    const double *knot;    /* the next */
    size_t knots, part, parts;
} Cuts;

static Cuts begin_cuts(const VolPreint *tables, size_t bin, VolPreintCut how)
{
    const VolTfCompiled *tf = tables->integrals.tf;
    Cuts cuts = {.v0 = vol_preint_node(tables, bin), .v1 = vol_preint_node(tables, bin + 1), .part = 1,
                 .parts = how.parts};
    size_t first = vol_tf_interval(tf, cuts.v0), end = vol_tf_interval(tf, cuts.v1);
    if (end > first && tf->knots[end - 1] == cuts.v1)
        end--;
    cuts.cut = cuts.v0;
    cuts.knot = tf->knots + first;
    cuts.knots = end - first <= how.most_knots ? end - first : 0;
    return cuts;
}

/* The end of the next piece; false: there is none. */
static bool next_cut(Cuts *cuts, double *from, double *to)
{
    if (!(cuts->cut < cuts->v1))
        return false;
    *from = cuts->cut;
    do {
        double part = cuts->part < cuts->parts
                          ? cuts->v0 + (cuts->v1 - cuts->v0) * ((double)cuts->part / (double)cuts->parts) : cuts->v1;
        bool at_knot = cuts->knots && *cuts->knot <= part;
        cuts->cut = at_knot ? *cuts->knot : part;
        if (at_knot)
            cuts->knot++, cuts->knots--;
        else
            cuts->part++;
    } while (cuts->cut <= *from);
    *to = cuts->cut;
    return true;
}

static size_t piece_count(const VolPreint *tables, size_t bin, VolPreintCut how)
{
    Cuts cuts = begin_cuts(tables, bin, how);
    size_t count = 0;
    for (double from, to; next_cut(&cuts, &from, &to);)
        count++;
    return count;
}

/* Both ways: upwards the bin is number `bin`, downwards number n-2-bin, and its pieces come in the opposite order. */
static void put_bin(const VolPreint *tables, size_t bin, int channel, VolPreintCut how, const Bins *out)
{
    size_t mirrored = tables->n - 2 - bin, up_lane = 2 * (bin & 1), down_lane = 2 * (mirrored & 1) + 1;
    size_t up = out->first[bin / 2], down = out->first[mirrored / 2] + piece_count(tables, bin, how);
    Cuts cuts = begin_cuts(tables, bin, how);
    for (double from, to; next_cut(&cuts, &from, &to); up++) {
        Sums sum;
        double part = (to - from) / (cuts.v1 - cuts.v0);
        down--;
        sum_between(tables->integrals.tf, from, to, channel, &sum);
        put_piece(&sum, part, up_lane, &out->pieces[up]);
        put_piece(&sum, part, down_lane, &out->pieces[down]);
        out->share[up][up_lane] = out->share[down][down_lane] = part;
    }
}

/* Pieces of the couple: as many as the most divided of its four bins has. */
static size_t couple_count(const VolPreint *tables, size_t couple, VolPreintCut how)
{
    size_t most = 0, bins = tables->n - 1;
    for (size_t bin = 2 * couple; bin < 2 * couple + 2 && bin < bins; bin++) {
        size_t up = piece_count(tables, bin, how), down = piece_count(tables, bins - 1 - bin, how);
        most = up > most ? up : most;
        most = down > most ? down : most;
    }
    return most;
}

void vol_preint_bins_free(Bins *bins)
{
    free(bins->pieces);
    free(bins->share);
    free(bins->first);
    *bins = (Bins){0};
}

VolStatus vol_preint_bins(const VolPreint *tables, int channel, VolPreintCut how, Bins *out, VolError *err)
{
    size_t couples = tables->n / 2, total = 0;
    *out = (Bins){.first = vol_alloc(couples + 1, sizeof *out->first)};
    for (size_t m = 0; out->first && m < couples; m++) {
        out->first[m] = total;
        total += couple_count(tables, m, how);
    }
    out->pieces = vol_alloc_aligned(64, total, sizeof *out->pieces);
    out->share = vol_alloc_aligned(64, total, sizeof *out->share);
    if (!out->first || !out->pieces || !out->share) {
        vol_preint_bins_free(out);
        return vol_fail_memory(err, total * sizeof *out->pieces);
    }
    out->first[couples] = total;
    memset(out->pieces, 0, total * sizeof *out->pieces);
    memset(out->share, 0, total * sizeof *out->share);
    for (size_t bin = 0; bin + 1 < tables->n; bin++)
        put_bin(tables, bin, channel, how, out);
    return VOL_OK;
}
