#include "inspect/tf_plot.h"

#include <math.h>

#include "base/fmath.h"
#include "io/pixels.h"
#include "plot/raster.h"
#include "tf/phase.h"

enum { WIDTH = 720, PANEL = 240, LEFT = 70, RIGHT = 20, TOP = 44, BOTTOM = 36, STRIP = 12, POLAR = 420 };
enum { PAPER = 0xffffff, INK = 0x202020, PALE = 0xdddddd, BAR = 0xb8c4d0 };

static const uint32_t channel_ink[3] = {0xc03030, 0x2a8a2a, 0x3050c0};
static const double pi = 3.14159265358979323846;

/* ---- What is drawn in a panel ---- */

typedef enum Kind { SCATTER, ABSORB, EMIT, SURFACE, TRANSPORT, SURFACENESS, KINDS } Kind;

static const char *const titles[KINDS] = {"scatter: opacity of one particle step", "absorb: opacity of one particle step",
                                          "emit: light of one particle step", "surface: opacity of one scalar step",
                                          "transport: indirect opacity of one particle step", "surfaceness"};

typedef struct Plot {
    const VolTf *tf;
    const VolTfCompiled *compiled;
    const VolSeries *data;
    double lo, hi;
    VolRaster raster;
} Plot;

static bool is_there(const VolTf *tf, Kind kind)
{
    const size_t count[KINDS] = {tf->scatter.count, tf->absorb.count, tf->emit.count,
                                 tf->surface.count + tf->isosurface_count, tf->transport.count, tf->surfaceness.count};
    return count[kind] > 0;
}

/* Absorb, transport and emit differ by channel; emit's colour is drawn below instead. */
static int curves_of(Kind kind) { return kind == ABSORB || kind == TRANSPORT ? 3 : 1; }

static double opacity(double extinction, double step) { return -vol_expm1(-fmax(extinction, 0) * step); }

static double at(VolLinear line, double x) { return line.a + line.b * x; }

/* The height of the curve on an interval, whose end v may be. */
static double height(const Plot *plot, Kind kind, int channel, const VolTfInterval *in, double v)
{
    double x = v - in->v_ref, step = plot->tf->particle_step;
    switch (kind) {
    case SCATTER: return opacity(at(in->scatter, x), step);
    case ABSORB: return opacity(at(in->absorb[channel], x), step);
    case EMIT: return fmax(at(in->emit[0], x), fmax(at(in->emit[1], x), at(in->emit[2], x))) * step;
    case SURFACE: return opacity(at(in->surface, x), plot->tf->scalar_step);
    case TRANSPORT: return opacity(at(in->transport[channel], x), step);
    default: return at(in->surfaceness, x);
    }
}

static uint32_t encode(double r, double g, double b)
{
    double rgb[3] = {r, g, b};
    uint32_t word = 0;
    for (int c = 0; c < 3; c++) {
        double x = fmin(fmax(rgb[c], 0), 1);
        double s = x <= 0.0031308 ? 12.92 * x : 1.055 * vol_pow(x, 1 / 2.4) - 0.055;
        word = word << 8 | (uint32_t)nearbyint(255 * s);
    }
    return word;
}

static uint32_t color_at(const Plot *plot, Kind kind, double v, double most)
{
    const VolTfInterval *in = &plot->compiled->intervals[vol_tf_interval(plot->compiled, v)];
    double x = v - in->v_ref, rgb[3];
    for (int c = 0; c < 3; c++)
        switch (kind) {
        case SCATTER: rgb[c] = at(in->scatter_color[c], x); break;
        case SURFACE: rgb[c] = at(in->surface_color[c], x); break;
        case EMIT: rgb[c] = at(in->emit[c], x) * plot->tf->particle_step / most; break;
        case SURFACENESS: rgb[c] = at(in->surfaceness, x); break;
        default: rgb[c] = 1 - height(plot, kind, c, in, v); /* what passes */
        }
    return encode(rgb[0], rgb[1], rgb[2]);
}

/* ---- Panels over values ---- */

static void draw_histogram(Plot *plot, const VolAxes *axes)
{
    const VolSeries *data = plot->data;
    double most = 1, width = data->max - data->min;
    for (int i = 0; i < VOL_BINS; i++)
        most = fmax(most, (double)data->bins[i]);
    for (int i = 0; i < VOL_BINS; i++) {
        if (!data->bins[i])
            continue;
        int left = vol_axes_x(axes, data->min + width * i / VOL_BINS);
        int right = vol_axes_x(axes, data->min + width * (i + 1) / VOL_BINS);
        int tall = (int)nearbyint(axes->height * vol_log1p((double)data->bins[i]) / vol_log1p(most));
        vol_raster_box(&plot->raster, left, axes->top + axes->height - tall, right > left ? right - left : 1, tall, BAR);
    }
}

/* Column by column from the lowest to the highest that the curve is there, so that no spike falls between two
 * columns. */
static void draw_curve(Plot *plot, const VolAxes *axes, Kind kind, int channel, uint32_t ink)
{
    const VolTfCompiled *tf = plot->compiled;
    double last = NAN;
    for (int column = 0; column < axes->width; column++) {
        double v0 = axes->x0 + (axes->x1 - axes->x0) * column / axes->width;
        double v1 = axes->x0 + (axes->x1 - axes->x0) * (column + 1) / axes->width, lo = last, hi = last;
        for (size_t i = vol_tf_interval(tf, v0); i <= tf->knot_count && tf->intervals[i].v0 < v1; i++) {
            const VolTfInterval *in = &tf->intervals[i];
            double a = height(plot, kind, channel, in, fmax(v0, in->v0));
            double b = height(plot, kind, channel, in, fmin(v1, in->v1));
            lo = fmin(lo, fmin(a, b)); /* drops the NaN of the first column */
            hi = fmax(hi, fmax(a, b));
            last = b;
        }
        int x = axes->left + column;
        vol_raster_line(&plot->raster, x, vol_axes_y(axes, lo), x, vol_axes_y(axes, hi), ink);
    }
}

static void draw_isosurfaces(Plot *plot, const VolAxes *axes)
{
    for (size_t i = 0; i < plot->compiled->isosurface_count; i++) {
        const VolIsosurface *d = &plot->compiled->isosurfaces[i];
        int x = vol_axes_x(axes, d->value), y = vol_axes_y(axes, d->opacity), bottom = axes->top + axes->height;
        vol_raster_line(&plot->raster, x, y, x, bottom - 1, INK);
        vol_raster_box(&plot->raster, x - 5, y - 5, 11, 11, INK);
        vol_raster_box(&plot->raster, x - 4, y - 4, 9, 9, encode(d->color[0], d->color[1], d->color[2]));
    }
}

/* The highest point, which a curve has at a knot or everywhere. */
static double highest(const Plot *plot, Kind kind)
{
    double most = 0;
    for (size_t i = 0; i <= plot->compiled->knot_count; i++) {
        const VolTfInterval *in = &plot->compiled->intervals[i];
        most = fmax(most, height(plot, kind, 0, in, in->v_ref));
        if (isfinite(in->v1))
            most = fmax(most, height(plot, kind, 0, in, in->v1));
    }
    return most;
}

static void draw_panel(Plot *plot, Kind kind, int top)
{
    double most = kind == EMIT ? highest(plot, kind) : 1;
    most = most > 0 ? most : 1;
    VolAxes axes = {.left = LEFT, .top = top + TOP, .width = WIDTH - LEFT - RIGHT, .height = PANEL - TOP - BOTTOM - STRIP,
                    .x0 = plot->lo, .x1 = plot->hi, .y0 = 0, .y1 = most * (kind == EMIT ? 1.05 : 1)};
    VolAxes below = axes; /* the numbers stand below the strip */
    below.height += STRIP;
    below.y0 = -axes.y1 * STRIP / axes.height;
    vol_axes_draw(&plot->raster, &below, titles[kind], "value", "");
    if (plot->data)
        draw_histogram(plot, &axes);
    for (int column = 0; column < axes.width; column++) {
        double v = axes.x0 + (axes.x1 - axes.x0) * (column + 0.5) / axes.width;
        vol_raster_box(&plot->raster, axes.left + column, axes.top + axes.height, 1, STRIP, color_at(plot, kind, v, most));
    }
    for (int c = 0; c < curves_of(kind); c++)
        draw_curve(plot, &axes, kind, c, curves_of(kind) == 3 ? channel_ink[c] : INK);
    if (kind == SURFACE)
        draw_isosurfaces(plot, &axes);
}

/* ---- The phase function ---- */

static double phase_at(const VolTf *tf, int channel, double cosine)
{
    const VolPhase phase = vol_phase_of(tf);
    double rgb[3];
    vol_phase_at(&phase, cosine, rgb);
    return rgb[channel];
}

enum { AROUND = 720 };

static void draw_around(Plot *plot, int x, int y, double scale, int channel, uint32_t ink)
{
    int last_x = 0, last_y = 0;
    for (int i = 0; i <= AROUND; i++) {
        double angle = 2 * pi * i / AROUND, c = vol_cos(angle);
        double r = scale * (channel < 0 ? 1 : phase_at(plot->tf, channel, c)); /* channel -1: a circle */
        int to_x = x + (int)nearbyint(r * c), to_y = y - (int)nearbyint(r * vol_sin(angle));
        if (i)
            vol_raster_line(&plot->raster, last_x, last_y, to_x, to_y, ink);
        last_x = to_x;
        last_y = to_y;
    }
}

static void draw_phase(Plot *plot, int top)
{
    int curves = plot->tf->phase_table.count ? 3 : 1;
    int x = WIDTH / 2, y = top + TOP + (POLAR - TOP) / 2, radius = (POLAR - TOP) / 2 - 16;
    double most = 1e-300;
    for (int i = 0; i <= AROUND; i++)
        for (int c = 0; c < curves; c++)
            most = fmax(most, phase_at(plot->tf, c, vol_cos(2 * pi * i / AROUND)));
    for (int ring = 1; ring <= 4; ring++)
        draw_around(plot, x, y, radius * ring / 4.0, -1, PALE);
    vol_raster_line(&plot->raster, x - radius - 10, y, x + radius + 10, y, PALE);
    vol_raster_line(&plot->raster, x, y - radius, x, y + radius, PALE);
    vol_raster_text(&plot->raster, LEFT, top + 20, 2, INK, "phase: light comes from the left");
    for (int c = 0; c < curves; c++)
        draw_around(plot, x, y, radius / most, c, curves == 3 ? channel_ink[c] : INK);
}

VolStatus vol_tf_plot(const VolTf *tf, const VolTfCompiled *compiled, double lo, double hi, const VolSeries *data,
                      VolBytes *png, VolError *err)
{
    Plot plot = {.tf = tf, .compiled = compiled, .lo = lo, .hi = hi, .data = data && data->finite ? data : NULL};
    if (plot.data) {
        plot.lo = fmin(lo, data->min);
        plot.hi = fmax(hi, data->max);
    }
    int panels = 0, top = 0;
    for (int kind = 0; kind < KINDS; kind++)
        panels += is_there(tf, (Kind)kind);
    *png = (VolBytes){0};
    int tall = PANEL * (panels ? panels : 1) + (tf->phase_given ? POLAR : 0);
    VolStatus status = vol_raster_new(WIDTH, tall, PAPER, &plot.raster, err);
    if (status)
        return status;
    for (int kind = 0; kind < KINDS; kind++)
        if (is_there(tf, (Kind)kind) || (!panels && kind == SCATTER)) {
            draw_panel(&plot, (Kind)kind, top);
            top += PANEL;
        }
    if (tf->phase_given)
        draw_phase(&plot, top);
    status = vol_png_encode(plot.raster.rgb, plot.raster.width, plot.raster.height, png, err);
    vol_raster_free(&plot.raster);
    return status;
}
