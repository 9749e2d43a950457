/* Pieces of a ray for the exact estimator (exact_tmpl.h has the derivation): stretches of a cell within one interval of the
 * transfer function, their optical depth in closed form, their light by Gauss-Legendre quadrature, a node a lane.
 * Include real.h and optics_tmpl.h first. */
#ifndef VOL_RENDER_PIECES_TMPL_H
#define VOL_RENDER_PIECES_TMPL_H

#include "render/cell_tmpl.h"
#include "render/reals.h"
#include "render/shade_tmpl.h"
#include "render/walk.h"

typedef struct RayState {
    const VolScene *scene;
    const Optics *optics;
    const VolRay *ray;
    VolRadiance *out;
    double tau_stop;
    real view[3];
    real carry;       /* the field where the last cell was left */
    double carry_t;   /* and at which t: valid for a stretch that begins there */
    size_t interval;  /* of the last look-up: the first guess for the next */
    bool done;
} RayState;

typedef struct Cell {
    Cubic v;
    real corners[8];
    real p[3], d[3]; /* entry point and step, local */
    double t0;       /* of the entry */
    real length;     /* world units */
    int32_t at[3];   /* index of the cell */
    real gradients[8][3];
    bool has_gradients;
    bool counted; /* among the cells that something was integrated in */
    real lo, hi;
} Cell;

/* ---- Shading inside a cell ---- */

static void take_gradients(const VolGrid *grid, Cell *cell)
{
    for (int n = 0; n < 8; n++) {
        double g[3];
        vol_grid_voxel_gradient(grid, cell->at[0] + (n >> 2), cell->at[1] + (n >> 1 & 1), cell->at[2] + (n & 1), g);
        for (int a = 0; a < 3; a++)
            cell->gradients[n][a] = (real)g[a];
    }
    cell->has_gradients = true;
}

static inline real mix(real a, real b, real t) { return real_fma(t, b - a, a); }

/* World gradient. */
static void gradient_at(RayState *r, Cell *cell, real s, real world[3])
{
    const VolGrid *grid = r->scene->grid;
    if (!cell->has_gradients)
        take_gradients(grid, cell);
    real x = real_fma(s, cell->d[0], cell->p[0]), y = real_fma(s, cell->d[1], cell->p[1]),
         z = real_fma(s, cell->d[2], cell->p[2]);
    real g[3];
    for (int a = 0; a < 3; a++) {
        real z00 = mix(cell->gradients[0][a], cell->gradients[1][a], z);
        real z01 = mix(cell->gradients[2][a], cell->gradients[3][a], z);
        real z10 = mix(cell->gradients[4][a], cell->gradients[5][a], z);
        real z11 = mix(cell->gradients[6][a], cell->gradients[7][a], z);
        g[a] = mix(mix(z00, z01, y), mix(z10, z11, y), x);
    }
    world_gradient(&grid->world_to_index, g, world);
}

static void shade_at(RayState *r, Cell *cell, real s, Shading *out)
{
    real gradient[3];
    gradient_at(r, cell, s, gradient);
    double t = cell->t0 + (double)(s * cell->length);
    shade(r->scene, r->optics, gradient, r->view, vol_along(r->ray->origin, t, r->ray->direction), out);
}

/* K 11: E ((1 - S) + f_s S), as a factor of the scattering colour. */
static void classic_factor(const Optics *optics, const Interval *in, const Shading *sh, real x, real factor[3])
{
    real S = surfaceness_at(optics, in, sh, x);
    for (int c = 0; c < 3; c++)
        factor[c] = real_fma(S, sh->k[c] + sh->b[c], 1 - S);
}

/* ---- Pieces ---- */

/* A stretch of a cell within one interval, u in [0, 1]: x(u) = v - ref = x0 + u (x1 + u (x2 + u x3)). */
typedef struct Piece {
    const Interval *in;
    real x0, x1, x2, x3;
    real length; /* world units */
    real sa, ds; /* s = sa + ds u */
    real extinction0[3], slope[3]; /* of the particles: extinction0 + slope (x - x0) */
    real surface0, surface1;
} Piece;

static Piece cut_piece(const Cell *cell, const Interval *in, int channels, real sa, real sb)
{
    Piece p;
    const Cubic *v = &cell->v;
    real ds = sb - sa;
    p.in = in;
    p.sa = sa;
    p.ds = ds;
    p.length = cell->length * ds;
    p.x0 = real_fma(real_fma(real_fma(v->a3, sa, v->a2), sa, v->a1), sa, v->a0 - in->ref);
    p.x1 = ds * cubic_slope(v, sa);
    p.x2 = ds * ds * real_fma(3 * v->a3, sa, v->a2);
    p.x3 = ds * ds * ds * v->a3;
    for (int c = 0; c < channels; c++) {
        p.extinction0[c] = real_max(line_at(in->extinction[c], p.x0), 0);
        p.slope[c] = in->extinction[c].b;
    }
    p.surface0 = line_at(in->surface, p.x0);
    p.surface1 = in->surface.b;
    return p;
}

/* Optical depth from the piece's start to u: of the particles, and of surfaces. */
static inline real depth_of_particles(const Piece *p, int c, real u)
{
    real travelled = u * real_fma(u, real_fma(u, p->x3 * (real)0.25, p->x2 * (real)(1.0 / 3.0)), p->x1 * (real)0.5);
    return p->length * u * real_fma(p->slope[c], travelled, p->extinction0[c]);
}

static inline real depth_of_surface(const Piece *p, real u)
{
    real X = u * real_fma(u, real_fma(u, p->x3, p->x2), p->x1);
    return real_abs(X) * real_max(real_fma(p->surface1, (real)0.5 * X, p->surface0), 0);
}

static inline real depth_to(const Piece *p, int c, real u)
{
    real tau = depth_of_particles(p, c, u);
    return real_max(p->in->has_surface ? tau + depth_of_surface(p, u) : tau, 0);
}

static real depth_of(const Piece *p, int channels)
{
    real tau = depth_to(p, 0, 1);
    for (int c = 1; c < channels; c++)
        tau = real_max(tau, depth_to(p, c, 1));
    return tau;
}

static double mean_transmittance(const double tau[3], int channels)
{
    double sum = 0;
    for (int c = 0; c < channels; c++)
        sum += vol_exp(-tau[c]);
    return sum / channels;
}

/* The depth layer: where the mean transmittance falls to one half within the piece. */
static void find_depth(RayState *r, const Cell *cell, const Piece *p)
{
    int channels = r->optics->channels;
    double lo = 0, hi = 1, end[3];
    for (int c = 0; c < channels; c++)
        end[c] = r->out->tau[c] + (double)depth_to(p, c, 1);
    if (mean_transmittance(end, channels) > 0.5)
        return;
    for (int i = 0; i < 48; i++) {
        double mid = 0.5 * (lo + hi);
        for (int c = 0; c < channels; c++)
            end[c] = r->out->tau[c] + (double)depth_to(p, c, (real)mid);
        if (mean_transmittance(end, channels) > 0.5)
            lo = mid;
        else
            hi = mid;
    }
    r->out->depth = cell->t0 + (double)cell->length * ((double)p->sa + (double)p->ds * hi);
}

static bool is_shaded(const RayState *r, const Interval *in)
{
    return r->scene->shaded && (in->has_surface || (r->optics->classic && in->has_scatter));
}

/* All Gauss nodes of a piece, a node a lane. */
typedef struct Nodes {
    reals x;          /* v - ref */
    reals through[3]; /* weight times transmittance from the eye */
    reals k[3], b[3], normal[3];
} Nodes;

static inline reals lines_at(Line line, reals x) { return reals_fma(reals_all(line.b), x, reals_all(line.a)); }

static inline reals cubics(real a0, real a1, real a2, real a3, reals u)
{
    return reals_fma(reals_fma(reals_fma(reals_all(a3), u, reals_all(a2)), u, reals_all(a1)), u, reals_all(a0));
}

static void place_nodes(const RayState *r, const Piece *p, Nodes *n)
{
    const reals u = gauss_x;
    reals travelled = u * cubics(p->x1 * (real)0.5, p->x2 * (real)(1.0 / 3.0), p->x3 * (real)0.25, 0, u);
    reals surface = {0};
    n->x = cubics(p->x0, p->x1, p->x2, p->x3, u);
    if (p->in->has_surface) {
        reals X = u * cubics(p->x1, p->x2, p->x3, 0, u);
        surface = reals_abs(X) * reals_max(reals_fma(reals_all(p->surface1), (real)0.5 * X, reals_all(p->surface0)),
                                           reals_all(0));
    }
    for (int c = 0; c < 3; c++) {
        int ch = c < r->optics->channels ? c : 0; /* grey: one exponential for all */
        if (ch < c) {
            n->through[c] = n->through[0];
            continue;
        }
        reals depth = p->length * u * reals_fma(reals_all(p->slope[c]), travelled, reals_all(p->extinction0[c]));
        depth = reals_max(depth + surface, reals_all(0));
        n->through[c] = gauss_w * reals_exp(-(depth + (real)r->out->tau[c]));
    }
}

/* Shading at the nodes; for the classic model k becomes K 11's factor of the scattering colour. */
static void shade_nodes(RayState *r, Cell *cell, const Piece *p, Nodes *n)
{
    for (int k = 0; k < LANES; k++) {
        Shading sh;
        real factor[3];
        shade_at(r, cell, real_fma(gauss_x[k], p->ds, p->sa), &sh);
        if (r->optics->classic)
            classic_factor(r->optics, p->in, &sh, n->x[k], factor);
        for (int c = 0; c < 3; c++) {
            n->k[c][k] = r->optics->classic ? factor[c] : sh.k[c];
            n->b[c][k] = sh.b[c];
            n->normal[c][k] = sh.normal[c];
        }
    }
}

/* Adds the normals, weighted by `amount` as seen from the eye. */
static void add_normals(RayState *r, const Nodes *n, reals amount)
{
    for (int a = 0; a < 3; a++)
        r->out->normal[a] += (double)reals_sum(n->through[0] * amount * n->normal[a]);
}

static void add_scatter(RayState *r, const Piece *p, const Nodes *n, bool classic, real sum[3])
{
    const Interval *in = p->in;
    reals amount = p->length * reals_max(lines_at(in->scatter, n->x), reals_all(0));
    for (int c = 0; c < 3; c++) {
        reals t = n->through[c] * (amount * lines_at(in->scatter_color[c], n->x));
        sum[c] = reals_sum(classic ? t * n->k[c] : t);
    }
    if (classic)
        add_normals(r, n, amount);
}

static void add_surface_nodes(RayState *r, const Piece *p, const Nodes *n, bool shaded, real sum[3])
{
    const Interval *in = p->in;
    reals amount = reals_abs(cubics(p->x1, 2 * p->x2, 3 * p->x3, 0, gauss_x)) *
                   reals_max(lines_at(in->surface, n->x), reals_all(0));
    for (int c = 0; c < 3; c++) {
        reals color = lines_at(in->surface_color[c], n->x);
        if (shaded)
            color = reals_fma(n->k[c], color, n->b[c]);
        sum[c] = reals_sum(n->through[c] * (amount * color));
    }
    if (shaded)
        add_normals(r, n, amount);
}

static void add_emission(const Piece *p, const Nodes *n, real sum[3])
{
    for (int c = 0; c < 3; c++)
        sum[c] = reals_sum(n->through[c] * (p->length * lines_at(p->in->emit[c], n->x)));
}

/* The light that a piece sends, seen from the eye. */
static void add_piece(RayState *r, Cell *cell, const Piece *p)
{
    const Interval *in = p->in;
    VolRadiance *out = r->out;
    Nodes n = {0};
    real scatter[3] = {0, 0, 0}, emit[3] = {0, 0, 0}, surface[3] = {0, 0, 0};
    bool shaded = is_shaded(r, in);
    place_nodes(r, p, &n);
    if (shaded)
        shade_nodes(r, cell, p, &n);
    if (in->has_scatter)
        add_scatter(r, p, &n, shaded && r->optics->classic, scatter);
    if (in->has_emit)
        add_emission(p, &n, emit);
    if (in->has_surface)
        add_surface_nodes(r, p, &n, shaded, surface);
    for (int c = 0; c < 3; c++) {
        out->scatter[c] += (double)scatter[c];
        out->emit[c] += (double)emit[c];
        out->surface[c] += (double)surface[c];
        out->color[c] += (double)((scatter[c] + emit[c]) + surface[c]);
    }
}

static bool ray_is_dark(const RayState *r)
{
    double least = r->out->tau[0];
    for (int c = 1; c < r->optics->channels; c++)
        least = fmin(least, r->out->tau[c]);
    return least > r->tau_stop;
}

static void report(RayState *r, const Cell *cell, real sa, real sb, double tau, size_t interval, const char *what)
{
    VolTraceStep step = {cell->t0 + (double)(sa * cell->length), cell->t0 + (double)(sb * cell->length),
                         (double)cubic_at(&cell->v, sa), (double)cubic_at(&cell->v, sb), tau, interval, what};
    r->scene->trace(r->scene->trace_user, &step);
}

/* Whether the normal turns by more than 26 degrees from a to b, or flips to face the viewer. */
static bool turns(const real a[3], const real b[3], const real view[3])
{
    real aa = dot3(a, a), bb = dot3(b, b), ab = dot3(a, b);
    return (ab < 0 || ab * ab < (real)0.81 * aa * bb) || dot3(a, view) * dot3(b, view) < 0;
}

/* Whether the gradient bends so much that it may all but vanish in between: the second difference against the middle. */
static bool bends(const real a[3], const real m[3], const real b[3])
{
    real second[3];
    for (int i = 0; i < 3; i++)
        second[i] = (a[i] - m[i]) + (b[i] - m[i]);
    return dot3(second, second) > (real)0.25 * dot3(m, m);
}

/* Shading is no polynomial.  A piece is shortened until the normals at its ends and its middle show that it varies
 * gently: rms error of a shaded noise-like field 4e-5 without, 2e-8 with. */
static real turn_limit(RayState *r, Cell *cell, real sa, real sb)
{
    real first[3], middle[3], last[3];
    gradient_at(r, cell, sa, first);
    gradient_at(r, cell, sb, last);
    for (int halvings = 0; halvings < 6; halvings++) {
        real half = (real)0.5 * (sa + sb);
        if (!(half > sa && half < sb))
            break;
        gradient_at(r, cell, half, middle);
        if (!turns(first, middle, r->view) && !turns(middle, last, r->view) && !bends(first, middle, last))
            break;
        sb = half;
        memcpy(last, middle, sizeof last);
    }
    return sb;
}

/* s from sa to sb lies within interval j and, where j has a surface, v is monotone there. */
static void integrate(RayState *r, Cell *cell, size_t j, real sa, real sb)
{
    const Interval *in = &r->optics->intervals[j];
    int channels = r->optics->channels;
    if (!in->visible || r->done)
        return;
    if (!cell->counted)
        r->out->cells += 1;
    cell->counted = true;
    while (sa < sb) {
        real end = is_shaded(r, in) ? turn_limit(r, cell, sa, sb) : sb;
        Piece p = cut_piece(cell, in, channels, sa, end);
        real tau = depth_of(&p, channels);
        while (tau > 1) {
            /* First by the mean extinction, then by halves: extinction may grow along the way. */
            real next = sa + (end - sa) * real_max((real)0.9 / tau, (real)(1.0 / 64));
            if (!(next > sa && next < end))
                break;
            end = next;
            p = cut_piece(cell, in, channels, sa, end);
            tau = depth_of(&p, channels);
        }
        add_piece(r, cell, &p);
        if ((r->scene->layers & VOL_LAYER_Z) && isinf(r->out->depth))
            find_depth(r, cell, &p);
        for (int c = 0; c < channels; c++)
            r->out->tau[c] += (double)depth_to(&p, c, 1);
        if (r->scene->trace)
            report(r, cell, sa, end, (double)depth_to(&p, 0, 1), j, in->has_surface ? "surface" : "particles");
        sa = end;
        if (ray_is_dark(r)) {
            r->done = true;
            return;
        }
    }
}

#endif
