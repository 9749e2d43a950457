/* From points as other programs keep them, colours and opacities apart, to the nodes of one list.
 *
 * Colours are blended in one of several spaces and decoded from sRGB, opacities run along straight or bent curves; all of
 * that is first flattened, each list by itself, to straight lines in linear Rec.709 and opacity: an interval is halved
 * while the curve is farther than DIFFERENCE from the chord at any of seven places inside.  Then the two are merged:
 * a node wherever one of them has one. */
#include "tf/foreign_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/fmath.h"

#define LARGEST_VALUE 1e300
#define ROUNDING 1e-6
#define DIFFERENCE 5e-4 /* half of what is promised: between the seven places it may be more */
#define MOST_HALVINGS 16
#define MOST_NODES ((size_t)1 << 22)

void vol_foreign_points_free(VolForeignPoints *points)
{
    free(points->items);
    *points = (VolForeignPoints){0};
}

VolStatus vol_foreign_add_point(const VolForeign *f, VolForeignPoints *points, VolForeignPoint point)
{
    if (points->count == points->capacity) {
        size_t capacity = points->capacity ? 2 * points->capacity : 32;
        VolForeignPoint *grown = vol_resize(points->items, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(f->err, capacity * sizeof *grown);
        points->items = grown;
        points->capacity = capacity;
    }
    point.order = points->count;
    points->items[points->count++] = point;
    return VOL_OK;
}

/* ---- Checks ---- */

static VolStatus check_value(const VolForeign *f, size_t line, size_t number, double v)
{
    if (!(fabs(v) <= LARGEST_VALUE))
        return vol_foreign_fault(f, line, "point %zu: value %.9g is not within 1e300 of 0", number, v);
    return VOL_OK;
}

static VolStatus check_fraction(const VolForeign *f, size_t line, size_t number, const char *what, double *x)
{
    if (!(*x >= -ROUNDING && *x <= 1 + ROUNDING))
        return vol_foreign_fault(f, line, "point %zu: %s %.9g lies outside [0, 1]", number, what, *x);
    *x = fmin(fmax(*x, 0), 1);
    return VOL_OK;
}

VolStatus vol_foreign_add_color(const VolForeign *f, VolForeignPoints *points, size_t line, double v, double r, double g,
                                double b)
{
    static const char *const names[3] = {"red", "green", "blue"};
    VolForeignPoint point = {.v = v, .value = {r, g, b}, .midpoint = 0.5};
    VolStatus status = check_value(f, line, points->count + 1, v);
    for (int c = 0; c < 3 && status == VOL_OK; c++)
        status = check_fraction(f, line, points->count + 1, names[c], &point.value[c]);
    return status != VOL_OK ? status : vol_foreign_add_point(f, points, point);
}

VolStatus vol_foreign_add_opacity(const VolForeign *f, VolForeignPoints *points, size_t line, double v, double opacity,
                                  double midpoint, double sharpness)
{
    VolForeignPoint point = {.v = v, .value = {opacity}, .midpoint = midpoint, .sharpness = sharpness};
    VolStatus status = check_value(f, line, points->count + 1, v);
    if (status == VOL_OK)
        status = check_fraction(f, line, points->count + 1, "opacity", &point.value[0]);
    if (status == VOL_OK)
        status = check_fraction(f, line, points->count + 1, "midpoint", &point.midpoint);
    if (status == VOL_OK)
        status = check_fraction(f, line, points->count + 1, "sharpness", &point.sharpness);
    return status != VOL_OK ? status : vol_foreign_add_point(f, points, point);
}

/* ---- Order ---- */

static int compare_points(const void *a, const void *b)
{
    const VolForeignPoint *x = a, *y = b;
    if (x->v != y->v)
        return x->v < y->v ? -1 : 1;
    return x->order < y->order ? -1 : x->order > y->order;
}

void vol_foreign_sort(const VolForeign *f, VolForeignPoints *points, const char *what)
{
    VolForeignPoint *items = points->items;
    bool sorted = true;
    for (size_t i = 1; i < points->count; i++)
        sorted &= items[i - 1].v <= items[i].v;
    if (!sorted && what)
        vol_foreign_warn(f, "%s are not in order; they are sorted by value", what);
    if (!sorted)
        qsort(items, points->count, sizeof *items, compare_points);
}

void vol_foreign_normalise(VolForeignPoints *points)
{
    double lo = points->items[0].v, range = points->items[points->count - 1].v - lo;
    for (size_t i = 0; i < points->count; i++)
        points->items[i].v = range > 0 ? (points->items[i].v - lo) / range : 0;
}

/* ---- Masks ---- */

/* The straight line through the points at v; `after`: of two at v the second. */
static double opacity_at(const VolForeignPoints *points, double v, bool after)
{
    size_t next = 0;
    while (next < points->count && (after ? points->items[next].v <= v : points->items[next].v < v))
        next++;
    const VolForeignPoint *p = &points->items[next ? next - 1 : 0];
    const VolForeignPoint *q = &points->items[next < points->count ? next : points->count - 1];
    double u = q->v > p->v ? (v - p->v) / (q->v - p->v) : 0;
    return p->value[0] + (q->value[0] - p->value[0]) * u;
}

VolStatus vol_foreign_cut(const VolForeign *f, VolForeignPoints *opacity, double lo, double hi)
{
    VolForeignPoints kept = {0};
    VolStatus status = VOL_OK;
    if (lo > -LARGEST_VALUE) {
        status = vol_foreign_add_opacity(f, &kept, 0, lo, 0, 0.5, 0);
        if (status == VOL_OK && lo < hi)
            status = vol_foreign_add_opacity(f, &kept, 0, lo, opacity_at(opacity, lo, true), 0.5, 0);
    }
    for (size_t i = 0; i < opacity->count && status == VOL_OK; i++)
        if (opacity->items[i].v > lo && opacity->items[i].v < hi)
            status = vol_foreign_add_point(f, &kept, opacity->items[i]);
    if (hi < LARGEST_VALUE) {
        if (status == VOL_OK && lo < hi)
            status = vol_foreign_add_opacity(f, &kept, 0, hi, opacity_at(opacity, hi, false), 0.5, 0);
        if (status == VOL_OK)
            status = vol_foreign_add_opacity(f, &kept, 0, hi, 0, 0.5, 0);
    }
    if (status != VOL_OK || !kept.count) { /* nothing to cut, and no point within: constant */
        vol_foreign_points_free(&kept);
        return status;
    }
    vol_foreign_points_free(opacity);
    *opacity = kept;
    return VOL_OK;
}

/* ---- Flattening ---- */

typedef struct FlatNode {
    double v, y[3];
} FlatNode;

typedef struct Flat {
    FlatNode *nodes;
    size_t count, capacity;
    const VolForeign *f;
    bool colors;
    VolColorSpace space;
    const VolForeignPoint *a, *b; /* the piece being flattened */
} Flat;

static VolStatus emit(Flat *flat, double v, const double y[3])
{
    if (flat->count == MOST_NODES)
        return vol_foreign_fault(flat->f, 0, "more than %zu nodes are needed", MOST_NODES);
    if (flat->count == flat->capacity) {
        size_t capacity = flat->capacity ? 2 * flat->capacity : 64;
        FlatNode *grown = vol_resize(flat->nodes, capacity, sizeof *grown);
        if (!grown)
            return vol_fail_memory(flat->f->err, capacity * sizeof *grown);
        flat->nodes = grown;
        flat->capacity = capacity;
    }
    flat->nodes[flat->count++] = (FlatNode){v, {y[0], y[1], y[2]}};
    return VOL_OK;
}

/* Midpoints at the very ends would divide by 0; VTK moves them inwards by as much. */
static double inner(double midpoint)
{
    return fmin(fmax(midpoint, 1e-5), 1 - 1e-5);
}

/* How far along from one opacity to the next.  The midpoint is where half the way is done; a sharpness above 0 turns the
 * straight line into a Hermite curve on ever steeper arcs of u^(1 + 10 sharpness). */
static double bent(double u, double midpoint, double sharpness)
{
    double m = inner(midpoint);
    double s = u < m ? 0.5 * u / m : 0.5 + 0.5 * (u - m) / (1 - m);
    if (sharpness < 0.01)
        return s;
    double power = 1 + 10 * sharpness;
    if (s < 0.5)
        s = 0.5 * vol_pow(2 * s, power);
    else if (s > 0.5)
        s = 1 - 0.5 * vol_pow(2 * (1 - s), power);
    double slopes = s * (s - 1) * (2 * s - 1) * (1 - sharpness); /* both tangents' parts */
    return fmin(fmax(s * s * (3 - 2 * s) + slopes, 0), 1);
}

static void sample(const Flat *flat, double u, double y[3])
{
    const VolForeignPoint *a = flat->a, *b = flat->b;
    if (flat->colors) {
        double encoded[3];
        vol_color_blend(flat->space, a->value, b->value, u, encoded);
        vol_color_decode(encoded, y);
    } else {
        y[0] = a->value[0] + (b->value[0] - a->value[0]) * bent(u, a->midpoint, a->sharpness);
        y[1] = y[2] = 0;
    }
}

static bool straight(const Flat *flat, double u0, const double y0[3], double u1, const double y1[3])
{
    for (int k = 1; k < 8; k++) {
        double t = k / 8.0, y[3];
        sample(flat, u0 + (u1 - u0) * t, y);
        for (int c = 0; c < 3; c++)
            if (fabs(y0[c] + (y1[c] - y0[c]) * t - y[c]) > DIFFERENCE)
                return false;
    }
    return true;
}

/* Emits the nodes strictly between u0 and u1. */
static VolStatus refine(Flat *flat, double u0, const double y0[3], double u1, const double y1[3], int halvings)
{
    double u = 0.5 * (u0 + u1), v = flat->a->v + (flat->b->v - flat->a->v) * u, y[3];
    if (halvings == MOST_HALVINGS || !(v > flat->a->v && v < flat->b->v) || straight(flat, u0, y0, u1, y1))
        return VOL_OK;
    sample(flat, u, y);
    VolStatus status = refine(flat, u0, y0, u, y, halvings + 1);
    if (status == VOL_OK)
        status = emit(flat, v, y);
    if (status == VOL_OK)
        status = refine(flat, u, y, u1, y1, halvings + 1);
    return status;
}

/* What a point shows by itself. */
static void point_value(const Flat *flat, const VolForeignPoint *p, double y[3])
{
    if (flat->colors)
        vol_color_decode(p->value, y);
    else
        memcpy(y, p->value, 3 * sizeof *y);
}

/* All of one colour or opacity from a to b: a jump at a, or for a sharpness of 1 at the midpoint. */
static VolStatus flatten_step(Flat *flat, const double ya[3], const double yb[3])
{
    double u = flat->colors ? 0 : flat->a->midpoint, v = flat->a->v + (flat->b->v - flat->a->v) * u;
    VolStatus status = u > 0 ? emit(flat, v, ya) : VOL_OK;
    return status != VOL_OK ? status : emit(flat, v, yb);
}

static VolStatus flatten_piece(Flat *flat)
{
    double ya[3], yb[3];
    point_value(flat, flat->a, ya);
    point_value(flat, flat->b, yb);
    if (!(flat->a->v < flat->b->v))
        return VOL_OK;
    if (flat->colors ? flat->space == VOL_COLOR_STEP : flat->a->sharpness > 0.99)
        return flatten_step(flat, ya, yb);
    if (!flat->colors && flat->a->sharpness < 0.01) { /* two straight lines that meet at the midpoint */
        double m = inner(flat->a->midpoint), v = flat->a->v + (flat->b->v - flat->a->v) * m;
        double y[3] = {0.5 * (ya[0] + yb[0]), 0, 0};
        return m != 0.5 && v > flat->a->v && v < flat->b->v ? emit(flat, v, y) : VOL_OK;
    }
    return refine(flat, 0, ya, 1, yb, 0);
}

static VolStatus flatten(Flat *flat, const VolForeignPoints *points)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; i < points->count && status == VOL_OK; i++) {
        double y[3];
        flat->a = &points->items[i];
        flat->b = i + 1 < points->count ? flat->a + 1 : flat->a;
        point_value(flat, flat->a, y);
        status = emit(flat, flat->a->v, y);
        if (status == VOL_OK)
            status = flatten_piece(flat);
    }
    return status;
}

/* ---- Merging ---- */

/* The values just below and just above v; *at moves on behind v.  Of several nodes at v only the first and the last
 * count. */
static void sides(const Flat *flat, size_t *at, double v, double below[3], double above[3])
{
    const FlatNode *nodes = flat->nodes;
    size_t i = *at, here = i;
    while (here < flat->count && nodes[here].v == v)
        here++;
    *at = here;
    if (here > i) {
        memcpy(below, nodes[i].y, sizeof nodes[i].y);
        memcpy(above, nodes[here - 1].y, sizeof nodes[i].y);
        return;
    }
    const FlatNode *p = &nodes[i ? i - 1 : 0], *q = &nodes[i < flat->count ? i : flat->count - 1];
    double u = p->v < q->v ? (v - p->v) / (q->v - p->v) : 0;
    for (int c = 0; c < 3; c++)
        below[c] = above[c] = p->y[c] + (q->y[c] - p->y[c]) * u;
}

static VolTfNode node_of(double v, const double opacity[3], const double color[3])
{
    return (VolTfNode){v, opacity[0], {color[0], color[1], color[2]}};
}

static void merge(const Flat *colors, const Flat *opacity, VolTfNodes *out)
{
    size_t i = 0, j = 0;
    while (i < colors->count || j < opacity->count) {
        double c0[3], c1[3], o0[3], o1[3];
        double v = fmin(i < colors->count ? colors->nodes[i].v : INFINITY,
                        j < opacity->count ? opacity->nodes[j].v : INFINITY);
        sides(colors, &i, v, c0, c1);
        sides(opacity, &j, v, o0, o1);
        out->nodes[out->count++] = node_of(v, o0, c0);
        if (o0[0] != o1[0] || c0[0] != c1[0] || c0[1] != c1[1] || c0[2] != c1[2])
            out->nodes[out->count++] = node_of(v, o1, c1);
    }
}

VolStatus vol_foreign_finish(const VolForeign *f, VolForeignPoints *colors, VolColorSpace space,
                             VolForeignPoints *opacity, VolTf *out)
{
    Flat c = {.f = f, .colors = true, .space = space}, o = {.f = f};
    vol_foreign_sort(f, colors, "the points of the colours");
    vol_foreign_sort(f, opacity, "the points of the opacity");
    VolStatus status = flatten(&c, colors);
    if (status == VOL_OK)
        status = flatten(&o, opacity);
    if (status == VOL_OK) {
        out->scatter.nodes = vol_alloc(c.count + o.count, sizeof *out->scatter.nodes);
        if (out->scatter.nodes)
            merge(&c, &o, &out->scatter);
        else
            status = vol_fail_memory(f->err, (c.count + o.count) * sizeof *out->scatter.nodes);
    }
    free(c.nodes);
    free(o.nodes);
    return status;
}
