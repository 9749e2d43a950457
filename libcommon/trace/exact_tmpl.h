/* The exact estimator: cell by cell, no step.
 *
 * Inside a cell the field on the ray is a cubic in s (trilinear_tmpl.h).  Between two knots of the transfer function
 * extinction is linear in v, hence a cubic in s whose integral, the optical depth, is known in closed form; a soft surface
 * adds |M(v(s)) - M(v(s_a))| on stretches where v is monotone, M being the prefix integral of its extinction per unit of v.
 * So the ray is cut at the cell's faces, at the knots and (for surfaces and isosurfaces) where v turns, and each piece
 * adds
 *     tau += tau(piece),     color += exp(-tau) int q(s) exp(-tau(s)) ds
 * with q = c_scatter mu_scatter + e + c_surface mu_surface |v'(s)|, by Gauss-Legendre on stretches of optical depth at
 * most 1 (8 nodes in float: 4e-8 rms on white noise with spiky transfer functions, where 4 leave 4e-6; 16 in double).
 * Shaded pieces end where the normal flips or turns to or from a light, roots of cubics too, and where it has turned far
 * (subintervals_tmpl.h).  An isosurface is a factor exp(-mu_k) at its crossing.  Optical depth and colour are summed in
 * double, and exp(-tau) is taken anew for each piece, so that no product of many factors near 1 is ever formed.
 *
 * LANES rays go side by side, each from piece to piece of its own cells: all seek a cell with something in it, find
 * where its next piece ends, integrate that.  (One ray at a time with the nodes side by side took 3.6 times as long on a
 * dense volume.)
 *
 * Compiled in files of a few lines each, one per precision and cpu level; and once more for each set of terms that a scene
 * may be without. */
#include "trace/cell_traversal_tmpl.h"
#include "trace/subintervals_tmpl.h"

/* ---- Where the next stretch ends ---- */

/* The field at a turning point: within the cell's corners, whatever rounding makes of the cubic. */
ALWAYS_INLINE reals value_at_turn(const Cells *k, reals v, unsigned features)
{
    if (features & FEATURE_ISO || k->packet.tables->jumps)
        v = reals_min(reals_max(v, k->least), k->most);
    return v;
}

/* The lanes of `mask` begin their next leg: up to the next turning point, or the cell's exit. */
ALWAYS_INLINE void begin_legs(Cells *k, ints mask, unsigned features)
{
    reals one = reals_all(1);
    reals end = reals_select((ints)(k->turns_passed == 0), k->turn[0],
                             reals_select((ints)(k->turns_passed == 1), k->turn[1], one));
    reals v = reals_select((ints)(end < one), value_at_turn(k, cubic_at(&k->v, end), features), k->exit);
    k->leg_s = reals_select(mask, end, k->leg_s);
    k->leg_v = reals_select(mask, v, k->leg_v);
    k->leg_begun |= mask;
}

/* The stretch ends with the leg, or before that at a knot. */
static void plan_knots(Cells *k, ints mask)
{
    const real *edges = k->packet.tables->edges;
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
static bool next_isosurface(const TfTables *o, bool rising, real va, real vb, size_t *first, size_t *last)
{
    const real *values = o->isosurface_values;
    size_t n = o->isosurface_count, at = 0;
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
    const TfTables *o = k->packet.tables;
    real va = k->va[i], vb = k->leg_v[i];
    bool rising = vb > va;
    if (vb < va && o->edges[k->interval[i]] >= va)
        k->interval[i]--;
    lane_int j = k->interval[i];
    real knot_v = rising ? o->edges[j + 1] : o->edges[j];
    bool knot = rising ? knot_v < vb : knot_v > vb;
    bool iso = next_isosurface(o, rising, va, vb, &k->event_first[i], &k->event_last[i]);
    real iso_v = iso ? o->isosurface_values[k->event_first[i]] : 0;
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

ALWAYS_INLINE void plan(Cells *k, unsigned features)
{
    ints wanted = k->in_cell & (ints)(k->done >= 1), cut = wanted & k->many;
    if (!any(wanted))
        return;
    k->done = reals_select(wanted, reals_all(0), k->done);
    if (any(cut)) {
        begin_legs(k, cut & ~k->leg_begun, features);
        ints knots = cut;
        if (features & FEATURE_ISO) {
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

static void optical_depths_of(const Cells *k, unsigned i, unsigned features, double optical_depth[3])
{
    for (int c = 0; c < channels_of(features); c++)
        optical_depth[c] = doubles_lane(&k->sums.optical_depth[c], (int)i);
}

/* The depth layer: where the mean transmittance falls to one half within the piece. */
static void find_depth(Cells *k, const SubInterval *p, unsigned features, unsigned i)
{
    int channels = channels_of(features);
    double lo = 0, hi = 1, start[3], end[3];
    optical_depths_of(k, i, features, start);
    for (int n = -1; n < 48; n++) {
        double mid = n < 0 ? 1 : 0.5 * (lo + hi);
        for (int c = 0; c < channels; c++)
            end[c] = start[c] + (double)optical_depth_to(p, features, c, reals_all((real)mid))[i];
        if (mean_transmittance(end, channels) > 0.5) {
            if (n < 0)
                return;
            lo = mid;
        } else
            hi = mid;
    }
    k->packet.out[i].depth = k->packet.span[i].t0 + (double)k->u0[i] +
                            (double)k->length[i] * ((double)p->sa[i] + (double)p->ds[i] * hi);
}

static void report(const Cells *k, unsigned i, const real s[2], const real v[2], double optical_depth, size_t number,
                   const char *what)
{
    VolTraceStep step = {cell_time(k, i, s[0]), cell_time(k, i, s[1]), (double)v[0], (double)v[1], optical_depth, number,
                         what};
    k->packet.scene->trace(k->packet.scene->trace_user, &step);
}

/* What only layers and traces ask for. */
static void note_sub_interval(Cells *k, const SubInterval *p, const Properties *in, ints mask, unsigned features)
{
    const VolScene *scene = k->packet.scene;
    FOR_LANES(i, mask_bits(mask)) {
        if (scene->layers & VOL_LAYER_Z && isinf(k->packet.out[i].depth))
            find_depth(k, p, features, i);
        if (scene->trace) {
            reals last = p->x0 + run_of(p, reals_all(1));
            report(k, i, (real[]){p->sa[i], p->sa[i] + p->ds[i]}, (real[]){in->ref[i] + p->x0[i], in->ref[i] + last[i]},
                   (double)optical_depth_to(p, features, 0, reals_all(1))[i], (size_t)k->interval[i],
                   in->has_surface[i] > 0 ? "surface" : "particles");
        }
    }
}

/* Lanes through which nothing can be seen any more have ended. */
ALWAYS_INLINE void terminate_rays(Cells *k, ints mask, unsigned features)
{
    reals least = reals_all(INFINITY);
    for (int c = 0; c < channels_of(features); c++) {
        k->optical_depth_so_far[c] = doubles_round(&k->sums.optical_depth[c]);
        least = reals_min(k->optical_depth_so_far[c], least);
    }
    ints dark = mask & (ints)(least > k->packet.termination_depth);
    if (!any(dark))
        return;
    k->packet.scratch->skipped.rays_ended += (unsigned)__builtin_popcount(mask_bits(dark));
    k->packet.alive &= ~dark;
    k->in_cell &= ~dark;
}

ALWAYS_INLINE void add_light_of(Cells *k, const SubInterval *p, const SubIntervalLight *sum, ints mask, unsigned features)
{
    reals zero = reals_all(0), transmittance[3];
    ints first = features & FEATURE_COLOURED ? mask & channel_is_lit(k, 0) : mask;
    for (int c = 0; c < channels_of(features); c++)
        transmittance[c] = reals_exp(-k->optical_depth_so_far[c]);
    for (int c = 0; c < 3; c++) {
        reals T = transmittance[features & FEATURE_COLOURED ? c : 0];
        ints seen = features & FEATURE_COLOURED ? mask & channel_is_lit(k, c) : mask;
        reals scatter = reals_where(seen, T * (p->length * sum->scatter[c])), all = scatter;
        reals emit = zero, surface = zero;
        if (features & FEATURE_EMIT)
            all += emit = reals_where(seen, T * (p->length * sum->emit[c]));
        if (features & FEATURE_SURFACE)
            all += surface = reals_where(seen, T * sum->surface[c]);
        doubles_add(&k->sums.color[c], all);
        if (features & FEATURE_EXTRA) {
            doubles_add(&k->sums.scatter[c], scatter);
            doubles_add(&k->sums.emit[c], emit);
            doubles_add(&k->sums.surface[c], surface);
        }
        if (features & FEATURE_EXTRA && features & FEATURE_SHADED)
            doubles_add(&k->sums.normal[c], reals_where(first, transmittance[0] * sum->normal[c]));
    }
}

/* To the end of the stretch, or as far as an optical depth of 1 or the bends of the gradient allow. */
ALWAYS_INLINE void integrate(Cells *k, unsigned features)
{
    const reals one = reals_all(1);
    ints mask = k->in_cell & (ints)(k->done < 1);
    ints seen = mask & intervals_visible(k->packet.tables, k->interval);
    k->done = reals_select(mask & ~seen, one, k->done);
    if (!any(seen))
        return;
    Properties in;
    SubInterval p;
    SubIntervalLight light;
    load_properties(k->packet.tables, k->interval, seen, features, &in);
    reals end = one;
    ints surfaces = seen & (ints)(in.has_surface > 0); /* or what else needs the gradient */
    if (features & FEATURE_CLASSIC)
        surfaces |= seen & ((ints)(in.scatter[0] != 0) | (ints)(in.scatter[1] != 0));
    if (features & FEATURE_SHADED && any(surfaces)) {
        take_gradients(k, surfaces);
        end = reals_select(surfaces, end_of_gentle_turn(k, surfaces), end);
    }
    cut_sub_interval(k, &in, features, end, &p);
    reals optical_depth = largest_optical_depth(k, &p, features);
    ints dense = seen & (ints)(optical_depth > 1);
    while (any(dense)) {
        /* First by the mean extinction, then by halves: extinction may grow along the way. */
        reals next = k->done + (end - k->done) * reals_max((real)0.9 / optical_depth, reals_all((real)(1.0 / 64)));
        dense &= (ints)(next > k->done) & (ints)(next < end);
        if (!any(dense))
            break;
        end = reals_select(dense, next, end);
        cut_sub_interval(k, &in, features, end, &p);
        optical_depth = largest_optical_depth(k, &p, features);
        dense &= (ints)(optical_depth > 1);
    }
    const unsigned plain = features & ~(unsigned)(FEATURE_SHADED | FEATURE_CLASSIC | FEATURE_SURFACE);
    dense = seen & (ints)(optical_depth > 1);
    if (plain == features || !any(surfaces))
        sub_interval_light(k, &in, &p, dense, plain, &light);
    else
        sub_interval_light(k, &in, &p, dense, features, &light);
    add_light_of(k, &p, &light, seen, features);
    if (features & FEATURE_EXTRA)
        note_sub_interval(k, &p, &in, seen, features);
    for (int c = 0; c < channels_of(features); c++)
        doubles_add(&k->sums.optical_depth[c], reals_where(seen, optical_depth_to(&p, features, c, reals_all(1))));
    k->done = reals_select(seen, end, k->done);
    terminate_rays(k, seen, features);
}

/* ---- Isosurfaces ---- */

static void cross(Cells *k, unsigned i, const Isosurface *isosurface, const Shading *sh, unsigned features)
{
    VolRadiance *out = &k->packet.out[i];
    double optical_depth[3];
    optical_depths_of(k, i, features, optical_depth);
    for (int c = 0; c < 3; c++) {
        real color = features & FEATURE_SHADED ? real_fma(sh->k[c][i], isosurface->color[c], sh->b[c][i])
            : isosurface->color[c];
        double part = vol_exp(-optical_depth[c < channels_of(features) ? c : 0]) * isosurface->opacity * (double)color;
        out->surface[c] += part;
        doubles_set(&k->sums.color[c], (int)i, doubles_lane(&k->sums.color[c], (int)i) + part);
        if (features & FEATURE_SHADED)
            out->normal[c] += vol_exp(-optical_depth[0]) * isosurface->opacity * (double)sh->normal[c][i];
    }
    for (int c = 0; c < channels_of(features); c++) {
        optical_depth[c] += isosurface->mu;
        doubles_set(&k->sums.optical_depth[c], (int)i, optical_depth[c]);
    }
    if (isinf(out->depth) && mean_transmittance(optical_depth, channels_of(features)) <= 0.5)
        out->depth = cell_time(k, i, k->s[i]);
    if (k->packet.scene->trace)
        report(k, i, (real[]){k->s[i], k->s[i]}, (real[]){isosurface->value, isosurface->value}, isosurface->mu,
               (size_t)(isosurface - k->packet.tables->isosurfaces), "isosurface");
}

static bool ray_is_opaque(const Cells *k, unsigned i, unsigned features)
{
    double optical_depth[3], least = INFINITY;
    optical_depths_of(k, i, features, optical_depth);
    for (int c = 0; c < channels_of(features); c++)
        least = fmin(least, optical_depth[c]);
    return (real)least > k->packet.termination_depth[i];
}

static void cross_all(Cells *k, ints mask, unsigned features)
{
    Shading sh;
    ints crossing = {0};
    FOR_LANES(n, mask_bits(mask))
        crossing[n] = k->event_first[n] < k->event_last[n] ? -1 : 0;
    if (!any(crossing))
        return;
    if (features & FEATURE_SHADED) {
        take_gradients(k, crossing);
        shade_at(k, 1, &k->s, &sh);
    }
    FOR_LANES(i, mask_bits(crossing)) {
        for (size_t n = k->event_first[i]; n < k->event_last[i] && !ray_is_opaque(k, i, features); n++)
            cross(k, i, &k->packet.tables->isosurfaces[n], &sh, features);
        k->event_first[i] = k->event_last[i] = 0;
    }
    terminate_rays(k, crossing, features);
}

/* Lanes that reached the end of their stretch: on to the next, or out of the cell. */
ALWAYS_INLINE void arrive(Cells *k, unsigned features)
{
    ints there = k->in_cell & (ints)(k->done >= 1);
    k->s = reals_select(there, k->stop, k->s);
    if (features & FEATURE_ISO && any(there & k->meets_iso)) {
        cross_all(k, there & k->meets_iso, features);
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

ALWAYS_INLINE void trace_lanes(Cells *k, unsigned features)
{
    for (;;) {
        traverse(k, features);
        if (!any(k->packet.alive))
            break;
        plan(k, features);
        integrate(k, features);
        arrive(k, features);
    }
    store_sums(&k->sums, &k->packet);
}

static void trace_particles(void *k) { trace_lanes(k, 0); }
static void trace_emission(void *k) { trace_lanes(k, FEATURE_EMIT | FEATURE_COLOURED); }
static void trace_surfaces(void *k) { trace_lanes(k, FEATURE_SURFACE); }
static void trace_shaded_surfaces(void *k) { trace_lanes(k, FEATURE_SURFACE | FEATURE_SHADED); }
static void trace_shaded_isosurfaces(void *k) { trace_lanes(k, FEATURE_ISO | FEATURE_SHADED); }
static void trace_unshaded(void *k) { trace_lanes(k, ALL_FEATURES); }
static void trace_shaded(void *k) { trace_lanes(k, ALL_FEATURES | FEATURE_SHADED); }
static void trace_classic(void *k) { trace_lanes(k, ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC); }

static void trace_exact(const VolScene *scene, VolScratch *scratch, const VolRay *rays, size_t count, VolRadiance *out)
{
    static const FeaturesKernel kernels[] = {{0, trace_particles},
                                          {FEATURE_EMIT | FEATURE_COLOURED, trace_emission},
                                          {FEATURE_SURFACE, trace_surfaces},
                                          {FEATURE_SURFACE | FEATURE_SHADED, trace_shaded_surfaces},
                                          {FEATURE_ISO | FEATURE_SHADED, trace_shaded_isosurfaces},
                                          {ALL_FEATURES, trace_unshaded},
                                          {ALL_FEATURES | FEATURE_SHADED, trace_shaded},
                                          {ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, trace_classic}};
    const FeaturesKernel *kernel = kernel_for(scene, kernels);
    for (size_t i = 0; i < count; i += LANES) {
        Cells k;
        cells_begin(&k, scene, scratch, rays + i, count - i < LANES ? count - i : LANES, out + i);
        kernel->trace(&k);
    }
}
