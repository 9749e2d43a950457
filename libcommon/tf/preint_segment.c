/* One segment by quadrature: the yardstick of the tables, and what stands in where no table reaches.
 *
 * Between two knots extinction along the segment is linear in s in [0, 1], its optical depth quadratic and exact;
 * what is integrated is a quadratic, times a position, times exp(-quadratic).  Cut so that no piece is deeper than
 * 1/2, eight Gauss nodes leave about 1e-15. */
#include "tf/preint.h"

#include <math.h>

#include "base/fmath.h"
#include "base/gauss.h"

#define DARK 746.0 /* exp(-DARK) is 0 */

/* What is the same for all pieces. */
typedef struct Segment {
    double v0, v1, dl, change; /* change = |v1 - v0| */
    int channels;              /* of extinction */
    double tau[3];
    VolPreintSegment *out;
} Segment;

/* A stretch without knots: properties at both ends, per unit of s; linear in between, and q = scatter x colour +
 * emit. */
typedef struct End {
    double surface, surface_color[3], particle[3], scatter, scatter_color[3], emit[3];
} End;

static double line_at(VolLinear line, double x)
{
    double y = line.a + line.b * x;
    return y > 0 ? y : 0;
}

static End end_at(const Segment *seg, const VolTfInterval *in, double v)
{
    double x = v - in->v_ref;
    End e = {.surface = line_at(in->surface, x) * seg->change, .scatter = line_at(in->scatter, x) * seg->dl};
    for (int c = 0; c < 3; c++) {
        e.surface_color[c] = line_at(in->surface_color[c], x);
        e.scatter_color[c] = line_at(in->scatter_color[c], x);
        e.particle[c] = e.scatter + line_at(in->absorb[c], x) * seg->dl;
        e.emit[c] = line_at(in->emit[c], x) * seg->dl;
    }
    return e;
}

static double lerp(double a, double b, double u) { return a + u * (b - a); }

/* Adds the light of one Gauss node: at s, a fraction u of the stretch, `through` = weight x transmittance. */
static void add_node(const Segment *seg, const End *a, const End *b, double u, double s, double through, int c0, int c1)
{
    VolPreintSegment *out = seg->out;
    double surface = through * lerp(a->surface, b->surface, u), scatter = through * lerp(a->scatter, b->scatter, u);
    for (int c = c0; c < c1; c++) {
        double color = surface * lerp(a->surface_color[c], b->surface_color[c], u);
        out->fw_a[c] += (1 - s) * surface;
        out->bw_a[c] += s * surface;
        out->fw_c[c] += (1 - s) * color;
        out->bw_c[c] += s * color;
        out->p_a[c] += through * lerp(a->particle[c], b->particle[c], u);
        out->p_c[c] += scatter * lerp(a->scatter_color[c], b->scatter_color[c], u) +
                       through * lerp(a->emit[c], b->emit[c], u);
    }
}

/* How far one can go until the depth has grown by 1/2: sigma d + slope d^2 / 2 = 1/2, at most to the end. */
static double depth_half(double sigma, double slope, double rest)
{
    double root = sigma * sigma + slope;
    if (!(root >= 0))
        return rest;
    double d = 1 / (sigma + sqrt(root));
    return d < rest ? d : rest;
}

/* The stretch from s = sa to sb, for the channels c0 .. c1-1, which share their extinction. */
static void add_stretch(Segment *seg, const End *a, const End *b, double sa, double sb, int c0, int c1)
{
    double ds = sb - sa, tau = seg->tau[c0];
    double front = (a->surface + a->particle[c0]) * ds, slope = (b->surface + b->particle[c0]) * ds - front;
    for (double u = 0; u < 1 && tau < DARK;) {
        double sigma = front + slope * u, d = depth_half(sigma > 0 ? sigma : 0, slope, 1 - u);
        for (int i = 0; i < 8; i++) {
            double x = d * vol_gauss8_x[i], at = u + x;
            double through = vol_exp(-(tau + x * (sigma + slope * x / 2))) * (vol_gauss8_w[i] * d * ds);
            add_node(seg, a, b, at, sa + ds * at, through, c0, c1);
        }
        tau += d * (sigma + slope * d / 2);
        u = d < 1 - u ? u + d : 1;
    }
    seg->tau[c0] += front + slope / 2;
}

static void add_interval(Segment *seg, const VolTfInterval *in, double from, double to)
{
    double sa = (from - seg->v0) / (seg->v1 - seg->v0), sb = (to - seg->v0) / (seg->v1 - seg->v0);
    if (!(sb > sa))
        return;
    End a = end_at(seg, in, from), b = end_at(seg, in, to);
    for (int c = 0; c < seg->channels; c++)
        add_stretch(seg, &a, &b, sa, sb, c, seg->channels == 1 ? 3 : c + 1);
}

static void constant_segment(Segment *seg, const VolTfCompiled *tf)
{
    VolTfSample s;
    vol_tf_sample(tf, seg->v0, &s);
    for (int c = 0; c < 3; c++) {
        double depth = s.particle[c] * seg->dl;
        seg->out->depth[c] = depth;
        seg->out->alpha[c] = seg->out->p_a[c] = -vol_expm1(-depth);
        seg->out->p_c[c] = s.source[c] * seg->dl * vol_preint_phi(depth);
    }
}

void vol_preint_segment(const VolTfCompiled *tf, double v0, double v1, double dl, VolPreintSegment *out)
{
    *out = (VolPreintSegment){{0}};
    Segment seg = {.v0 = v0, .v1 = v1, .dl = dl, .change = fabs(v1 - v0), .channels = tf->coloured ? 3 : 1, .out = out};
    if (!(seg.change > 0)) {
        constant_segment(&seg, tf);
        return;
    }
    double lo = fmin(v0, v1), hi = fmax(v0, v1);
    size_t first = vol_tf_interval(tf, lo), last = vol_tf_interval(tf, hi);
    for (size_t n = 0; n <= last - first; n++) {
        const VolTfInterval *in = &tf->intervals[v1 > v0 ? first + n : last - n];
        double a = fmax(lo, in->v0), b = fmin(hi, in->v1);
        add_interval(&seg, in, v1 > v0 ? a : b, v1 > v0 ? b : a);
    }
    for (int c = 0; c < 3; c++) {
        out->depth[c] = seg.tau[seg.channels == 1 ? 0 : c];
        out->alpha[c] = -vol_expm1(-out->depth[c]);
    }
}
