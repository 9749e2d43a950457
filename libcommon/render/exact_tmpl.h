/* The exact estimator: cell by cell, no step.
 *
 * Inside a cell the field on the ray is a cubic in s (cells_tmpl.h).  Between two knots of the transfer function extinction
 * is linear in v, hence a cubic in s whose integral, the optical depth, is known in closed form; a soft surface adds
 * |M(v(s)) - M(v(s_a))| on stretches where v is monotone, M being the prefix integral of its extinction per unit of v.
 * So the ray is cut at the cell's faces, at the knots and (for surfaces and isosurfaces) where v turns, and each piece
 * adds
 *     tau += tau(piece),     color += exp(-tau) int q(s) exp(-tau(s)) ds
 * with q = c_scatter mu_scatter + e + c_surface mu_surface |v'(s)|, by Gauss-Legendre on stretches of optical depth at
 * most 1 (8 nodes in float: 4e-8 rms on white noise with spiky transfer functions, where 4 leave 4e-6; 16 in double).
 * Shaded pieces end where the normal flips or turns to or from a light, roots of cubics too, and where it has turned far
 * (pieces_tmpl.h).  An isosurface is a factor exp(-mu_k) at its crossing.  Optical depth and colour are summed in
 * double, and exp(-tau) is taken anew for each piece, so that no product of many factors near 1 is ever formed.
 *
 * LANES rays go side by side, each from piece to piece of its own cells: all seek a cell with something in it, find
 * where its next piece ends, integrate that.  (One ray at a time with the nodes side by side took 3.6 times as long on a
 * dense volume.)
 *
 * Compiled in files of a few lines each, one per precision and cpu level; and once more for each set of terms that a scene
 * may be without. */
#include "render/cells_way_tmpl.h"
#include "render/pieces_tmpl.h"

/* ---- Where the next stretch ends ---- */

/* The field at a turning point: within the cell's corners, whatever rounding makes of the cubic. */
ALWAYS_INLINE reals value_at_turn(const Cells *k, reals v, unsigned terms)
{
    if (terms & TERM_ISO || k->lanes.optics->jumps)
        v = reals_min(reals_max(v, k->least), k->most);
    return v;
}

/* The lanes of `mask` begin their next leg: up to the next turning point, or the cell's exit. */
ALWAYS_INLINE void begin_legs(Cells *k, ints mask, unsigned terms)
{
    reals one = reals_all(1);
    reals end = reals_select((ints)(k->turns_passed == 0), k->turn[0],
                             reals_select((ints)(k->turns_passed == 1), k->turn[1], one));
    reals v = reals_select((ints)(end < one), value_at_turn(k, cubic_at(&k->v, end), terms), k->exit);
    k->leg_s = reals_select(mask, end, k->leg_s);
    k->leg_v = reals_select(mask, v, k->leg_v);
    k->leg_begun |= mask;
}

/* The stretch ends with the leg, or before that at a knot. */
static void plan_knots(Cells *k, ints mask)
{
    const real *edges = k->lanes.optics->edges;
    ints rising = (ints)(k->leg_v > k->va), falling = (ints)(k->leg_v < k->va);
    /* Falling from a knot itself: the interval below. */
    ints on_edge = mask & falling & (ints)(gather_reals(edges, k->interval) == k->va);
    k->interval += on_edge;
    reals target = gather_reals(edges, k->interval - rising);
    ints crosses = mask & ((rising & (ints)(target < k->leg_v)) | (falling & (ints)(target > k->leg_v)));
    reals stop = k->leg_s;
    if (any(crosses))
        stop = reals_select(crosses, solve_cubic(&k->v, target, k->s, k->leg_s, crosses), stop);
    k->stop = reals_select(mask, stop, k->stop);
    k->stop_v = reals_select(mask, reals_select(crosses, target, k->leg_v), k->stop_v);
    k->stop_step = ints_select(mask, crosses & (falling - rising), k->stop_step);
    k->ends_leg = ints_select(mask, ~crosses, k->ends_leg);
}

/* The first isosurface on the way of lane i from `va` to `vb`, if any; equal values in list order, whichever way v goes. */
static bool next_isosurface(const Optics *o, bool rising, real va, real vb, size_t *first, size_t *last)
{
    const real *values = o->delta_values;
    size_t n = o->delta_count, at = 0;
    while (at < n && (rising ? !(va < values[at]) : va >= values[at]))
        at++;
    if (rising ? at == n || !(vb >= values[at]) : at == 0 || !(vb < values[at - 1]))
        return false;
    *first = *last = rising ? at : at - 1;
    while (*first > 0 && values[*first - 1] == values[*last])
        --*first;
    while (*last < n && values[*last] == values[*first])
        ++*last;
    return true;
}

/* As plan_knots, for one lane in a cell with isosurfaces: knots and isosurfaces are met in the order of v. */
static void plan_crossings(Cells *k, unsigned i)
{
    const Optics *o = k->lanes.optics;
    real va = k->va[i], vb = k->leg_v[i];
    bool rising = vb > va;
    if (vb < va && o->edges[k->interval[i]] >= va)
        k->interval[i]--;
    lane_int j = k->interval[i];
    real knot_v = rising ? o->edges[j + 1] : o->edges[j];
    bool knot = rising ? knot_v < vb : knot_v > vb;
    bool iso = next_isosurface(o, rising, va, vb, &k->event_first[i], &k->event_last[i]);
    real iso_v = iso ? o->delta_values[k->event_first[i]] : 0;
    iso = iso && (!knot || (rising ? iso_v <= knot_v : iso_v >= knot_v));
    if (!iso)
        k->event_first[i] = k->event_last[i] = 0;
    k->stop[i] = k->leg_s[i];
    k->stop_v[i] = vb;
    k->stop_step[i] = 0;
    k->ends_leg[i] = iso || knot ? 0 : -1;
    if (!iso && !knot)
        return;
    k->stop[i] = solve_cubic(&k->v, reals_all(iso ? iso_v : knot_v), k->s, k->leg_s, mask_of(1u << i))[i];
    k->stop_v[i] = !iso ? knot_v : rising ? iso_v : real_below(iso_v);
    k->stop_step[i] = iso ? 0 : rising ? 1 : -1;
}

/* v along the stretches of `mask`, about their beginnings.  It arrives at stop_v: where a cell runs through so many values
 * that rounding blurs the few of this stretch, what is left of the cubic is a straight line. */
static void set_run(Cells *k, ints mask)
{
    reals ds = k->stop - k->s, change = k->stop_v - k->va, zero = reals_all(0);
    reals a1 = ds * cubic_slope(&k->v, k->s), a2 = ds * ds * reals_fma(3 * k->v.a3, k->s, k->v.a2);
    reals a3 = ds * ds * ds * k->v.a3, ratio = change / ((a1 + a2) + a3);
    ints curved = (ints)(reals_abs(ratio - 1) < (real)(1.0 / 16));
    Cubic run = {zero, reals_select(curved, a1 * ratio, change), reals_where(curved, a2 * ratio),
                 reals_where(curved, a3 * ratio)};
    cubic_replace(&k->run, mask, &run);
}

ALWAYS_INLINE void plan(Cells *k, unsigned terms)
{
    ints wanted = k->in_cell & (ints)(k->done >= 1), cut = wanted & k->many;
    if (!any(wanted))
        return;
    k->done = reals_select(wanted, reals_all(0), k->done);
    if (any(cut)) {
        begin_legs(k, cut & ~k->leg_begun, terms);
        ints knots = cut;
        if (terms & TERM_ISO) {
            FOR_LANES(i, mask_bits(cut & k->meets_iso))
                plan_crossings(k, i);
            knots &= ~k->meets_iso;
        }
        if (any(knots))
            plan_knots(k, knots);
        set_run(k, cut);
    }
    ints whole = wanted & ~k->many;
    k->stop = reals_select(whole, reals_all(1), k->stop);
    k->stop_step &= ~whole;
    k->ends_leg |= whole;
    cubic_replace(&k->run, whole, &k->v);
}

/* ---- Pieces ---- */

static void taus_of(const Cells *k, unsigned i, unsigned terms, double tau[3])
{
    for (int c = 0; c < channels_of(terms); c++)
        tau[c] = doubles_lane(&k->sums.tau[c], (int)i);
}

/* The depth layer: where the mean transmittance falls to one half within the piece. */
static void find_depth(Cells *k, const Piece *p, unsigned terms, unsigned i)
{
    int channels = channels_of(terms);
    double lo = 0, hi = 1, start[3], end[3];
    taus_of(k, i, terms, start);
    for (int n = -1; n < 48; n++) {
        double mid = n < 0 ? 1 : 0.5 * (lo + hi);
        for (int c = 0; c < channels; c++)
            end[c] = start[c] + (double)depth_to(p, terms, c, reals_all((real)mid))[i];
        if (mean_transmittance(end, channels) > 0.5) {
            if (n < 0)
                return;
            lo = mid;
        } else
            hi = mid;
    }
    k->lanes.out[i].depth = k->lanes.span[i].t0 + (double)k->u0[i] +
                            (double)k->length[i] * ((double)p->sa[i] + (double)p->ds[i] * hi);
}

static void report(const Cells *k, unsigned i, const real s[2], const real v[2], double tau, size_t number, const char *what)
{
    VolTraceStep step = {cell_time(k, i, s[0]), cell_time(k, i, s[1]), (double)v[0], (double)v[1], tau, number, what};
    k->lanes.scene->trace(k->lanes.scene->trace_user, &step);
}

/* What only layers and traces ask for. */
static void note_piece(Cells *k, const Piece *p, const Optic *in, ints mask, unsigned terms)
{
    const VolScene *scene = k->lanes.scene;
    FOR_LANES(i, mask_bits(mask)) {
        if (scene->layers & VOL_LAYER_Z && isinf(k->lanes.out[i].depth))
            find_depth(k, p, terms, i);
        if (scene->trace) {
            reals last = p->x0 + run_of(p, reals_all(1));
            report(k, i, (real[]){p->sa[i], p->sa[i] + p->ds[i]}, (real[]){in->ref[i] + p->x0[i], in->ref[i] + last[i]},
                   (double)depth_to(p, terms, 0, reals_all(1))[i], (size_t)k->interval[i],
                   in->has_surface[i] > 0 ? "surface" : "particles");
        }
    }
}

/* Lanes through which nothing can be seen any more have ended. */
ALWAYS_INLINE void end_dark(Cells *k, ints mask, unsigned terms)
{
    reals least = reals_all(INFINITY);
    for (int c = 0; c < channels_of(terms); c++) {
        k->depth_so_far[c] = doubles_round(&k->sums.tau[c]);
        least = reals_min(k->depth_so_far[c], least);
    }
    ints dark = mask & (ints)(least > k->lanes.tau_stop);
    if (!any(dark))
        return;
    k->lanes.scratch->skipped.rays_ended += (unsigned)__builtin_popcount(mask_bits(dark));
    k->lanes.alive &= ~dark;
    k->in_cell &= ~dark;
}

ALWAYS_INLINE void add_light_of(Cells *k, const Piece *p, const PieceLight *sum, ints mask, unsigned terms)
{
    reals zero = reals_all(0), through[3];
    ints first = terms & TERM_COLOURED ? mask & channel_is_lit(k, 0) : mask;
    for (int c = 0; c < channels_of(terms); c++)
        through[c] = reals_exp(-k->depth_so_far[c]);
    for (int c = 0; c < 3; c++) {
        reals T = through[terms & TERM_COLOURED ? c : 0];
        ints seen = terms & TERM_COLOURED ? mask & channel_is_lit(k, c) : mask;
        reals scatter = reals_where(seen, T * (p->length * sum->scatter[c])), all = scatter;
        reals emit = zero, surface = zero;
        if (terms & TERM_EMIT)
            all += emit = reals_where(seen, T * (p->length * sum->emit[c]));
        if (terms & TERM_SURFACE)
            all += surface = reals_where(seen, T * sum->surface[c]);
        doubles_add(&k->sums.color[c], all);
        if (terms & TERM_EXTRA) {
            doubles_add(&k->sums.scatter[c], scatter);
            doubles_add(&k->sums.emit[c], emit);
            doubles_add(&k->sums.surface[c], surface);
        }
        if (terms & TERM_EXTRA && terms & TERM_SHADED)
            doubles_add(&k->sums.normal[c], reals_where(first, through[0] * sum->normal[c]));
    }
}

/* To the end of the stretch, or as far as an optical depth of 1 or the bends of the gradient allow. */
ALWAYS_INLINE void integrate(Cells *k, unsigned terms)
{
    const reals one = reals_all(1);
    ints mask = k->in_cell & (ints)(k->done < 1);
    ints seen = mask & intervals_visible(k->lanes.optics, k->interval);
    k->done = reals_select(mask & ~seen, one, k->done);
    if (!any(seen))
        return;
    Optic in;
    Piece p;
    PieceLight light;
    load_optics(k->lanes.optics, k->interval, seen, terms, &in);
    reals end = one;
    ints surfaces = seen & (ints)(in.has_surface > 0); /* or what else needs the gradient */
    if (terms & TERM_CLASSIC)
        surfaces |= seen & ((ints)(in.scatter[0] != 0) | (ints)(in.scatter[1] != 0));
    if (terms & TERM_SHADED && any(surfaces)) {
        take_gradients(k, surfaces);
        end = reals_select(surfaces, end_of_gentle_turn(k, surfaces), end);
    }
    cut_piece(k, &in, terms, end, &p);
    reals tau = depth_of(k, &p, terms);
    ints dense = seen & (ints)(tau > 1);
    while (any(dense)) {
        /* First by the mean extinction, then by halves: extinction may grow along the way. */
        reals next = k->done + (end - k->done) * reals_max((real)0.9 / tau, reals_all((real)(1.0 / 64)));
        dense &= (ints)(next > k->done) & (ints)(next < end);
        if (!any(dense))
            break;
        end = reals_select(dense, next, end);
        cut_piece(k, &in, terms, end, &p);
        tau = depth_of(k, &p, terms);
        dense &= (ints)(tau > 1);
    }
    const unsigned plain = terms & ~(unsigned)(TERM_SHADED | TERM_CLASSIC | TERM_SURFACE);
    dense = seen & (ints)(tau > 1);
    if (plain == terms || !any(surfaces))
        piece_light(k, &in, &p, dense, plain, &light);
    else
        piece_light(k, &in, &p, dense, terms, &light);
    add_light_of(k, &p, &light, seen, terms);
    if (terms & TERM_EXTRA)
        note_piece(k, &p, &in, seen, terms);
    for (int c = 0; c < channels_of(terms); c++)
        doubles_add(&k->sums.tau[c], reals_where(seen, depth_to(&p, terms, c, reals_all(1))));
    k->done = reals_select(seen, end, k->done);
    end_dark(k, seen, terms);
}

/* ---- Isosurfaces ---- */

static void cross(Cells *k, unsigned i, const Delta *delta, const Shading *sh, unsigned terms)
{
    VolRadiance *out = &k->lanes.out[i];
    double tau[3];
    taus_of(k, i, terms, tau);
    for (int c = 0; c < 3; c++) {
        real color = terms & TERM_SHADED ? real_fma(sh->k[c][i], delta->color[c], sh->b[c][i]) : delta->color[c];
        double part = vol_exp(-tau[c < channels_of(terms) ? c : 0]) * delta->opacity * (double)color;
        out->surface[c] += part;
        doubles_set(&k->sums.color[c], (int)i, doubles_lane(&k->sums.color[c], (int)i) + part);
        if (terms & TERM_SHADED)
            out->normal[c] += vol_exp(-tau[0]) * delta->opacity * (double)sh->normal[c][i];
    }
    for (int c = 0; c < channels_of(terms); c++) {
        tau[c] += delta->mu;
        doubles_set(&k->sums.tau[c], (int)i, tau[c]);
    }
    if (isinf(out->depth) && mean_transmittance(tau, channels_of(terms)) <= 0.5)
        out->depth = cell_time(k, i, k->s[i]);
    if (k->lanes.scene->trace)
        report(k, i, (real[]){k->s[i], k->s[i]}, (real[]){delta->value, delta->value}, delta->mu,
               (size_t)(delta - k->lanes.optics->deltas), "isosurface");
}

static bool lane_is_dark(const Cells *k, unsigned i, unsigned terms)
{
    double tau[3], least = INFINITY;
    taus_of(k, i, terms, tau);
    for (int c = 0; c < channels_of(terms); c++)
        least = fmin(least, tau[c]);
    return (real)least > k->lanes.tau_stop[i];
}

static void cross_all(Cells *k, ints mask, unsigned terms)
{
    Shading sh;
    ints crossing = {0};
    FOR_LANES(n, mask_bits(mask))
        crossing[n] = k->event_first[n] < k->event_last[n] ? -1 : 0;
    if (!any(crossing))
        return;
    if (terms & TERM_SHADED) {
        take_gradients(k, crossing);
        shade_at(k, 1, &k->s, &sh);
    }
    FOR_LANES(i, mask_bits(crossing)) {
        for (size_t n = k->event_first[i]; n < k->event_last[i] && !lane_is_dark(k, i, terms); n++)
            cross(k, i, &k->lanes.optics->deltas[n], &sh, terms);
        k->event_first[i] = k->event_last[i] = 0;
    }
    end_dark(k, crossing, terms);
}

/* Lanes that reached the end of their stretch: on to the next, or out of the cell. */
ALWAYS_INLINE void arrive(Cells *k, unsigned terms)
{
    ints there = k->in_cell & (ints)(k->done >= 1);
    k->s = reals_select(there, k->stop, k->s);
    if (terms & TERM_ISO && any(there & k->meets_iso)) {
        cross_all(k, there & k->meets_iso, terms);
        there &= k->in_cell;
    }
    k->va = reals_select(there, k->stop_v, k->va);
    k->interval += there & k->stop_step;
    ints leg = there & k->ends_leg;
    k->leg_begun &= ~leg;
    k->turns_passed -= leg;
    k->in_cell &= ~(leg & (ints)(k->s >= 1));
}

/* ---- Rays ---- */

ALWAYS_INLINE void trace_lanes(Cells *k, unsigned terms)
{
    for (;;) {
        seek(k, terms);
        if (!any(k->lanes.alive))
            break;
        plan(k, terms);
        integrate(k, terms);
        arrive(k, terms);
    }
    store_sums(&k->sums, &k->lanes);
}

static void trace_particles(void *k) { trace_lanes(k, 0); }
static void trace_emission(void *k) { trace_lanes(k, TERM_EMIT | TERM_COLOURED); }
static void trace_surfaces(void *k) { trace_lanes(k, TERM_SURFACE); }
static void trace_shaded_surfaces(void *k) { trace_lanes(k, TERM_SURFACE | TERM_SHADED); }
static void trace_shaded_isosurfaces(void *k) { trace_lanes(k, TERM_ISO | TERM_SHADED); }
static void trace_unshaded(void *k) { trace_lanes(k, TERMS_ALL); }
static void trace_shaded(void *k) { trace_lanes(k, TERMS_ALL | TERM_SHADED); }
static void trace_classic(void *k) { trace_lanes(k, TERMS_ALL | TERM_SHADED | TERM_CLASSIC); }

static void trace_exact(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    static const TermsKernel kernels[] = {{0, trace_particles},
                                          {TERM_EMIT | TERM_COLOURED, trace_emission},
                                          {TERM_SURFACE, trace_surfaces},
                                          {TERM_SURFACE | TERM_SHADED, trace_shaded_surfaces},
                                          {TERM_ISO | TERM_SHADED, trace_shaded_isosurfaces},
                                          {TERMS_ALL, trace_unshaded},
                                          {TERMS_ALL | TERM_SHADED, trace_shaded},
                                          {TERMS_ALL | TERM_SHADED | TERM_CLASSIC, trace_classic}};
    const TermsKernel *kernel = kernel_for(scene, kernels);
    for (size_t i = 0; i < count; i += LANES) {
        Cells k;
        cells_begin(&k, scene, scratch, rays + i, count - i < LANES ? count - i : LANES, out + i);
        kernel->trace(&k);
    }
}
