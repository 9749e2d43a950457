/* Looking up between nodes, and between octaves.
 *
 * Opacity needs no interpolation: it follows from the integrals for any v0, v1, dl.  What the tables know better
 * than the integrals is how it divides, and in what colours.  An entry for step l is carried over to dl by what both
 * would be without mutual attenuation (Y 17): particles grow as dl phi(M), surfaces as phi(M), phi(M) = (1 - e^-M) /
 * M, which loses nothing where opacity is small.  Two octaves are blended, then everything is scaled so that the
 * parts' opacities add up to the exact one: mean colours come from the tables, opacity never does. */
#include <math.h>

#include "base/fmath.h"
#include "tf/preint.h"

typedef struct Corner {
    size_t i, j;
    double weight;
} Corner;

/* The node below v and how far v lies towards the next; false: v is out of range. */
static bool locate(const VolPreint *tables, double v, size_t *node, double *fraction)
{
    if (!(v >= tables->lo && v <= tables->hi))
        return false;
    double x = (v - tables->lo) / (tables->hi - tables->lo) * (double)(tables->n - 1), cell = floor(x);
    if (cell > (double)(tables->n - 2))
        cell = (double)(tables->n - 2);
    *node = (size_t)cell;
    *fraction = x - cell < 1 ? x - cell : 1;
    return true;
}

/* Bilinear, but linear on each of the two triangles of a cell that v0 = v1 cuts: there surfaces fall to 0 from both
 * sides, and what does not change shows none. */
static size_t corners_of(size_t i, double x, size_t j, double y, Corner out[4])
{
    if (i == j) {
        out[0] = (Corner){i, i, 1 - fmax(x, y)};
        out[1] = (Corner){i + 1, i + 1, fmin(x, y)};
        out[2] = y > x ? (Corner){i, i + 1, y - x} : (Corner){i + 1, i, x - y};
        return 3;
    }
    out[0] = (Corner){i, j, (1 - x) * (1 - y)};
    out[1] = (Corner){i + 1, j, x * (1 - y)};
    out[2] = (Corner){i, j + 1, (1 - x) * y};
    out[3] = (Corner){i + 1, j + 1, x * y};
    return 4;
}

static bool covered(const VolPreintTable *table, const Corner *corners, size_t count)
{
    for (size_t n = 0; n < count; n++)
        if (!vol_preint_in_band(table, corners[n].i, corners[n].j))
            return false;
    return true;
}

/* surface = M_s; particle: the means of mu_p between v0 and v1 */
typedef struct Depths {
    double surface, particle[3];
} Depths;

static Depths depths_of(const VolTfIntegrals *integrals, double v0, double v1)
{
    double lo = v0 < v1 ? v0 : v1, hi = v0 < v1 ? v1 : v0;
    Depths d = {0};
    if (hi > lo) {
        VolTfIntegral sum;
        vol_tf_integrals_between(integrals, lo, hi, &sum);
        d.surface = sum.surface;
        for (int c = 0; c < 3; c++)
            d.particle[c] = sum.particle[c] / (hi - lo);
    } else {
        VolTfSample s;
        vol_tf_sample(integrals->tf, v0, &s);
        for (int c = 0; c < 3; c++)
            d.particle[c] = s.particle[c];
    }
    return d;
}

static double phi_at(const Depths *d, int c, double dl) { return vol_preint_phi(d->surface + d->particle[c] * dl); }

/* Adds `weight` times the table's segment, carried over to dl. */
static void add_table(const VolPreint *tables, const VolPreintTable *table, const Corner *corners, size_t count,
                      const Depths *depths, double dl, double weight, VolPreintSegment *out)
{
    size_t channels = (size_t)tables->channels;
    for (size_t c = 0; c < 3; c++) {
        size_t a = channels == 3 ? c : 0, color = 3 * channels + c;
        double surface = dl == table->step ? 1 : phi_at(depths, (int)c, dl) / phi_at(depths, (int)c, table->step);
        double particle = surface * (dl / table->step);
        surface *= weight;
        particle *= weight;
        for (size_t n = 0; n < count; n++) {
            const float *entry = vol_preint_entry(tables, table, corners[n].i, corners[n].j);
            double ws = surface * corners[n].weight, wp = particle * corners[n].weight;
            out->fw_a[c] += ws * (double)entry[a];
            out->bw_a[c] += ws * (double)entry[channels + a];
            out->p_a[c] += wp * (double)entry[2 * channels + a];
            out->fw_c[c] += ws * (double)entry[color];
            out->bw_c[c] += ws * (double)entry[color + 3];
            out->p_c[c] += wp * (double)entry[color + 6];
        }
    }
}

static void make_exact(const VolPreint *tables, const Depths *depths, double dl, VolPreintSegment *out)
{
    for (int c = 0; c < 3; c++) {
        if (c >= tables->channels) { /* grey: opacities as in the first channel */
            out->depth[c] = out->depth[0];
            out->alpha[c] = out->alpha[0];
        } else {
            out->depth[c] = depths->surface + depths->particle[c] * dl;
            out->alpha[c] = out->depth[c] * vol_preint_phi(out->depth[c]);
        }
        double sum = out->fw_a[c] + out->bw_a[c] + out->p_a[c], factor = sum > 0 ? out->alpha[c] / sum : 1;
        out->fw_a[c] *= factor;
        out->bw_a[c] *= factor;
        out->p_a[c] *= factor;
        out->fw_c[c] *= factor;
        out->bw_c[c] *= factor;
        out->p_c[c] *= factor;
    }
}

/* The octaves on both sides of dl; the weight of the upper. */
static double octaves_around(const VolPreint *tables, double dl, const VolPreintTable **lower,
                             const VolPreintTable **upper)
{
    size_t o = 0;
    while (o + 1 < tables->octave_count && tables->octaves[o + 1].step <= dl)
        o++;
    *lower = &tables->octaves[o];
    *upper = *lower;
    if (dl <= (*lower)->step || o + 1 == tables->octave_count)
        return 0;
    *upper = &tables->octaves[o + 1];
    return (dl - (*lower)->step) / ((*upper)->step - (*lower)->step);
}

void vol_preint_full_at(const VolPreint *tables, double v0, double v1, double dl, VolPreintSegment *out)
{
    size_t i, j, count = 0;
    double x, y, weight = 0;
    Corner corners[4];
    const VolPreintTable *lower = NULL, *upper = NULL;
    bool known = tables->octave_count && locate(tables, v0, &i, &x) && locate(tables, v1, &j, &y);
    if (known && tables->dense && (tables->dense[i] || tables->dense[j]))
        known = false;
    if (known) {
        count = corners_of(i, x, j, y, corners);
        weight = octaves_around(tables, dl, &lower, &upper);
        known = covered(lower, corners, count) && covered(upper, corners, count);
    }
    if (!known) {
        vol_preint_segment(tables->integrals.tf, v0, v1, dl, out);
        return;
    }
    Depths depths = depths_of(&tables->integrals, v0, v1);
    *out = (VolPreintSegment){{0}};
    add_table(tables, lower, corners, count, &depths, dl, 1 - weight, out);
    if (weight > 0)
        add_table(tables, upper, corners, count, &depths, dl, weight, out);
    make_exact(tables, &depths, dl, out);
}
