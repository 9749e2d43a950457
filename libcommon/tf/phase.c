/* Drawing cosines.
 *
 * Henyey-Greenstein: with s = 2u - 1 the cumulative inverts to c = (1 + g^2 - ((1 - g^2)/(1 + g s))^2) / 2g.  Over one
 * denominator, and divided by 2g, nothing is lost where g is near 0:
 *     c = (s + g (3 + s^2)/2 + g^2 s + g^3 (s^2 - 1)/2) / (1 + g s)^2
 *
 * Tables: within a piece of length h from density d0 to d1 the cumulative is (d0 x + (d1 - d0) x^2 / 2h) / 2, relative
 * densities being twice those per cosine; it reaches m at x = 4m / (d0 + sqrt(d0^2 + 4m (d1 - d0)/h)), where nothing
 * cancels whichever end is the larger. */
#include "tf/phase.h"

#include <math.h>
#include <stdlib.h>

VolPhase vol_phase_of(const VolTf *tf)
{
    bool is_table = tf->phase_table.count > 0;
    return (VolPhase){.g = is_table ? 0 : tf->phase_hg, .table = is_table ? &tf->phase_table : NULL};
}

/* (1 - g^2) / (1 + g^2 - 2 g c)^(3/2); 1 + g^2 - 2 g c = (1 - g)^2 + 2 g (1 - c), without loss where c is near 1. */
static double henyey_greenstein(double g, double cosine)
{
    double d = (1 - g) * (1 - g) + 2 * g * (1 - cosine);
    return (1 - g) * (1 + g) / (d * sqrt(d));
}

void vol_phase_at(const VolPhase *phase, double cosine, double rgb[3])
{
    const VolTfNodes *table = phase->table;
    if (!table) {
        rgb[0] = rgb[1] = rgb[2] = phase->g == 0 ? 1 : henyey_greenstein(phase->g, fmin(fmax(cosine, -1), 1));
        return;
    }
    size_t after = 0;
    while (after < table->count && table->nodes[after].v <= cosine)
        after++;
    const VolTfNode *p = &table->nodes[after ? after - 1 : 0];
    const VolTfNode *q = &table->nodes[after < table->count ? after : table->count - 1];
    double u = q->v > p->v ? fmin(fmax((cosine - p->v) / (q->v - p->v), 0), 1) : 0;
    for (int c = 0; c < 3; c++)
        rgb[c] = p->color[c] + u * (q->color[c] - p->color[c]);
}

double vol_phase_most(const VolPhase *phase)
{
    double most = 0;
    if (!phase->table)
        return henyey_greenstein(fabs(phase->g), 1);
    for (size_t n = 0; n < phase->table->count; n++)
        for (int c = 0; c < 3; c++)
            most = fmax(most, phase->table->nodes[n].color[c]);
    return most;
}

/* ---- Over the sphere ---- */

/* The pieces of a table: from -1 to its first node, between nodes, from the last to 1.  Colours at both ends. */
static void piece_ends(const VolTfNodes *table, size_t piece, double cosine[2], const double *color[2])
{
    const VolTfNode *nodes = table->nodes;
    bool first = piece == 0, last = piece == table->count;
    cosine[0] = first ? -1 : nodes[piece - 1].v;
    cosine[1] = last ? 1 : nodes[piece].v;
    color[0] = nodes[first ? 0 : piece - 1].color;
    color[1] = nodes[last ? piece - 1 : piece].color;
}

void vol_phase_means(const VolPhase *phase, double mean[3])
{
    const VolTfNodes *table = phase->table;
    mean[0] = mean[1] = mean[2] = table ? 0 : 1;
    for (size_t piece = 0; table && piece <= table->count; piece++) {
        double cosine[2];
        const double *color[2];
        piece_ends(table, piece, cosine, color);
        for (int c = 0; c < 3; c++)
            mean[c] += 0.25 * (cosine[1] - cosine[0]) * (color[0][c] + color[1][c]);
    }
}

static double density_of(const double color[3], const double mean[3])
{
    double sum = 0;
    int channels = 0;
    for (int c = 0; c < 3; c++)
        if (mean[c] > 0) {
            sum += color[c] / mean[c];
            channels++;
        }
    return channels ? sum / channels : 1;
}

VolStatus vol_phase_sampler_new(const VolPhase *phase, VolPhaseSampler *out, VolError *err)
{
    const VolTfNodes *table = phase->table;
    *out = (VolPhaseSampler){.phase = *phase};
    vol_phase_means(phase, out->mean);
    if (!table || !(fmax(out->mean[0], fmax(out->mean[1], out->mean[2])) > 0))
        return VOL_OK;
    if (!(out->pieces = vol_alloc(table->count + 1, sizeof *out->pieces)))
        return vol_fail_memory(err, (table->count + 1) * sizeof *out->pieces);
    double before = 0;
    for (size_t piece = 0; piece <= table->count; piece++) {
        VolPhasePiece made = {.before = before};
        const double *color[2];
        piece_ends(table, piece, made.cosine, color);
        for (int end = 0; end < 2; end++)
            made.density[end] = density_of(color[end], out->mean);
        double mass = 0.25 * (made.cosine[1] - made.cosine[0]) * (made.density[0] + made.density[1]);
        if (!(mass > 0))
            continue;
        before += mass;
        out->pieces[out->count++] = made;
    }
    for (size_t n = 0; n < out->count; n++) /* but for rounding `before` is 1 */
        out->pieces[n].before /= before;
    return VOL_OK;
}

void vol_phase_sampler_free(VolPhaseSampler *sampler)
{
    free(sampler->pieces);
    *sampler = (VolPhaseSampler){0};
}

void vol_phase_normalised(const VolPhaseSampler *sampler, double cosine, double rgb[3])
{
    vol_phase_at(&sampler->phase, cosine, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = sampler->mean[c] > 0 ? rgb[c] / sampler->mean[c] : 0;
}

double vol_phase_density(const VolPhaseSampler *sampler, double cosine)
{
    double rgb[3];
    vol_phase_at(&sampler->phase, cosine, rgb);
    return sampler->phase.table ? density_of(rgb, sampler->mean) : rgb[0];
}

static double sample_henyey_greenstein(double g, double u)
{
    double s = 2 * u - 1, d = 1 + g * s;
    double c = (s + g * (3 + s * s) / 2 + g * g * s + g * g * g * (s * s - 1) / 2) / (d * d);
    return fmin(fmax(c, -1), 1);
}

double vol_phase_sample(const VolPhaseSampler *sampler, double u)
{
    if (!sampler->count)
        return sample_henyey_greenstein(sampler->phase.g, u);
    size_t at = 0, above = sampler->count; /* pieces[at].before <= u < pieces[above].before */
    while (above - at > 1) {
        size_t middle = at + (above - at) / 2;
        if (sampler->pieces[middle].before <= u)
            at = middle;
        else
            above = middle;
    }
    const VolPhasePiece *piece = &sampler->pieces[at];
    double m = 4 * (u - piece->before), h = piece->cosine[1] - piece->cosine[0];
    double d0 = piece->density[0], slope = (piece->density[1] - d0) / h;
    double root = sqrt(fmax(d0 * d0 + m * slope, 0));
    return m > 0 ? fmin(piece->cosine[0] + m / (d0 + root), piece->cosine[1]) : piece->cosine[0];
}
