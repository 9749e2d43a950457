/* The exact estimator: cell by cell, no step.
 *
 * Inside a cell the field on the ray is a cubic in s (of a grid: trilinear_tmpl.h).  Between two knots of the transfer
 * function extinction is linear in v, hence a cubic in s whose integral, the optical depth, is known in closed form; a soft
 * surface adds |M(v(s)) - M(v(s_a))| where v is monotone, M being the prefix integral of its extinction per unit of v.
 * So the ray is cut at the cell's faces, at the knots and (for surfaces and isosurfaces) where v turns, into segments, and
 * these into sub-intervals, each of which adds
 *     tau += tau(sub-interval),     color += exp(-tau) int q(s) exp(-tau(s)) ds
 * with q = c_scatter mu_scatter + e + c_surface mu_surface |v'(s)|, by Gauss-Legendre over optical depths of at most 1
 * (8 nodes in float: 4e-8 rms on white noise with spiky transfer functions, where 4 leave 4e-6; 16 in double).
 * Shaded ones end where the normal flips or turns to or from a light, roots of cubics too, and where it has turned far
 * (subintervals_tmpl.h).  An isosurface is a factor exp(-its optical depth) at its crossing: wherever
 * v, along the ray, goes from below its value to it or above, or back.  Which of these a place is, neighbouring cells agree
 * on (grid_cells_tmpl.h): fields may touch a surface in a voxel, along an edge or all over a face, and rays may run there.
 *
 * LANES rays go side by side, each through sub-intervals of its own cells: all seek a cell with something in it, find where
 * its next segment ends, integrate that.  (One ray at a time with the nodes side by side took 3.6 times as long on a dense
 * volume.)
 *
 * Compiled in files of a few lines each, one per precision and cpu level; and once more for each set of features that a
 * scene may be without.
 *
 * PARAMETERS  VOL_DOUBLE; VOL_TRAVERSAL
 * PROVIDES    trace_exact() */
#include "trace/blur_tmpl.h"

/* ---- On to the next cell with something in it ---- */

/* Whether an isosurface's value lies between lo and hi (closed). */
ALWAYS_INLINE ints meets_isosurface(const TfTables *o, reals lo, reals hi)
{
    ints before = count_up_to(o->isosurface_values, o->isosurface_count, lo, true);
    return (ints)(count_up_to(o->isosurface_values, o->isosurface_count, hi, false) > before);
}

/* Whether anything can be seen in the cells of `mask`.  They lie in stretches that show nothing but are entered all the same
 * (VOL_BRICK_ENTERED); the field is clamped to the stretch's range first, so that rounding cannot make something visible. */
MAYBE_UNUSED static ints shows_all_the_same(const Exact *k, ints mask, reals lo, reals hi, unsigned features)
{
    const TfTables *o = k->packet.tables;
    ints low, high;
    FOR_LANES(i, mask_bits(mask)) {
        lo[i] = real_clamp(lo[i], k->way.lo[i], k->way.hi[i]);
        hi[i] = real_clamp(hi[i], k->way.lo[i], k->way.hi[i]);
    }
    intervals_around(o, lo, hi, &low, &high);
    ints touching = (ints)(low < high) & (ints)(hi == gather_reals(o->edges, high));
    return range_shows(o, lo, hi, low, high, touching, features);
}

/* What lanes integrate from now on. */
ALWAYS_INLINE void take_cells(Exact *k, ints mask, const Cell *cell, const CellPlace *place, ints low, ints many,
                              unsigned features)
{
    const TfTables *o = k->packet.tables;
    if (any(mask & many)) {
        reals turn[2];
        turning_points(&cell->v, &turn[0], &turn[1]);
        k->turn[0] = reals_select(mask, turn[0], k->turn[0]);
        k->turn[1] = reals_select(mask, turn[1], k->turn[1]);
        low = ints_select(many, intervals_of(o, cell->entry), low);
        k->exit = reals_select(mask, cell->exit, k->exit);
        k->leg_begun &= ~mask;
        k->turns_passed &= ~mask;
    }
    cubic_replace(&k->v, mask, &cell->v);
    traversal_keep_cells(&k->place, mask, place, features);
    k->gradients_known &= ~mask;
    k->begin = reals_select(mask, cell->begin, k->begin);
    k->length = reals_select(mask, cell->length, k->length);
    k->many = ints_select(mask, many, k->many);
    k->interval = ints_select(mask, low, k->interval);
    k->va = reals_select(mask, cell->entry, k->va);
    k->s = reals_select(mask, reals_all(0), k->s);
    k->done = reals_select(mask, reals_all(1), k->done); /* the first segment is to be planned */
    k->in_cell |= mask;
    k->sum.cells -= mask;
}

/* Looks at the next cell of each lane of `mask`: those with something in it are in that cell from now on. */
ALWAYS_INLINE void look_at_cells(Exact *k, ints mask, unsigned features)
{
    const TfTables *o = k->packet.tables;
    const bool is_lit = features & FEATURE_LIT && features & (FEATURE_SURFACE | FEATURE_ISO) && k->packet.lit;
    const bool bounded = features & FEATURE_ISO || o->jumps || is_lit;
    Cell cell;
    CellPlace place;
    ints met = traversal_next_cells(&k->way, &k->packet, mask, bounded, features, &cell, &place), meets_iso = {0};
    reals lo = cell.lo, hi = cell.hi, blur = reals_all(0);
    if (bounded) {
        blur = reals_where((ints)(cell.least < cell.most), blur_on_way(cell.least, cell.most));
        k->least = reals_select(met, cell.least, k->least);
        k->most = reals_select(met, cell.most, k->most);
    }
    if (features & FEATURE_ISO) {
        meets_iso = meets_isosurface(o, lo - blur, hi + blur);
        k->meets_iso = ints_select(met, meets_iso, k->meets_iso);
    }
    ints low, high;
    intervals_around(o, lo - blur, hi + blur, &low, &high);
    ints first_visible = gather_ints(o->next_visible, low);
    ints visible = (ints)(first_visible <= high), constant = met & visible & (ints)(lo == hi);
    /* Unshaded, a cell's light costs less than looking at one cell more. */
    if (features & FEATURE_SHADED && any(constant))
        visible &= ~constant | particles_at(o, low, lo, features);
    ints judged = met & visible & ~k->way.shows;
    if (__builtin_expect(any(judged), 0))
        visible &= ~judged | shows_all_the_same(k, judged, lo, hi, features);
    ints seen = met & (visible | meets_iso);
    k->packet.scratch->skipped.cells_met += (unsigned)__builtin_popcount(mask_bits(met));
    if (!any(seen))
        return;
    ints many = (ints)(low != high) | meets_iso;
    if (is_lit)
        FOR_LANES(i, mask_bits(seen))
            k->in_surface[i] =
                vol_reach_is_surface(k->packet.scene, (double)cell.least[i], (double)cell.most[i]) ? -1 : 0;
    if (features & FEATURE_SURFACE)
        many |= (ints)(gather_reals(&o->intervals[0].has_surface, low * INTERVAL_REALS) > 0);
    take_cells(k, seen, &cell, &place, low, many, features);
    if (features & FEATURE_ISO && any(meets_iso & cell.begins))
        give_up_unsure_entries(k, seen & meets_iso & cell.begins, features);
}

/* Every lane that is in no cell goes on until it is, or its ray has ended. */
ALWAYS_INLINE void traverse(Exact *k, unsigned features)
{
    for (;;) {
        ints wanted = k->packet.alive & ~k->in_cell;
        if (!any(wanted))
            return;
        ints entering = wanted & ~k->way.in_stretch;
        FOR_LANES(i, mask_bits(entering))
            traversal_enter_cells(&k->way, &k->packet, i, features);
        wanted &= k->packet.alive;
        if (features & FEATURE_LIT && k->packet.lit)
            lit_move(&k->packet, entering & k->packet.alive, stretch_begin(&k->way));
        if (any(wanted))
            look_at_cells(k, wanted, features);
    }
}

/* ---- Where the next segment ends ---- */

/* The field at a turning point: within the cell's corners, whatever rounding makes of the cubic. */
ALWAYS_INLINE reals value_at_turn(const Exact *k, reals v, unsigned features)
{
    if (features & FEATURE_ISO || k->packet.tables->jumps)
        v = reals_min(reals_max(v, k->least), k->most);
    return v;
}

/* The lanes of `mask` begin their next leg: up to the next turning point, or the cell's exit. */
ALWAYS_INLINE void begin_legs(Exact *k, ints mask, unsigned features)
{
    reals one = reals_all(1);
    reals end = reals_select((ints)(k->turns_passed == 0), k->turn[0],
                             reals_select((ints)(k->turns_passed == 1), k->turn[1], one));
    reals v = reals_select((ints)(end < one), value_at_turn(k, cubic_at(&k->v, end), features), k->exit);
    k->leg_s = reals_select(mask, end, k->leg_s);
    k->leg_v = reals_select(mask, v, k->leg_v);
    k->leg_begun |= mask;
}

/* The segment ends with the leg, or before that at a knot. */
static void plan_knots(Exact *k, ints mask)
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
static void plan_crossings(Exact *k, unsigned i)
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

/* v along the segments of `mask`, as a cubic from where each begins, made to end exactly at stop_v.  Where the cell's values
 * range so widely that those of this segment are lost in their rounding, a straight line from end to end replaces it. */
static void set_run(Exact *k, ints mask)
{
    reals ds = k->stop - k->s, change = k->stop_v - k->va, zero = reals_all(0);
    reals a1 = ds * cubic_slope(&k->v, k->s), a2 = ds * ds * reals_fma(3 * k->v.a3, k->s, k->v.a2);
    reals a3 = ds * ds * ds * k->v.a3, ratio = change / ((a1 + a2) + a3);
    ints curved = (ints)(reals_abs(ratio - 1) < (real)(1.0 / 16));
    Cubic run = {zero, reals_select(curved, a1 * ratio, change), reals_where(curved, a2 * ratio),
                 reals_where(curved, a3 * ratio)};
    cubic_replace(&k->run, mask, &run);
}

ALWAYS_INLINE void plan(Exact *k, unsigned features)
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
        if (k->packet.tables->jumps)
            give_up_blurred(k, cut, features);
    }
    ints whole = wanted & ~k->many;
    k->stop = reals_select(whole, reals_all(1), k->stop);
    k->stop_step &= ~whole;
    k->ends_leg |= whole;
    cubic_replace(&k->run, whole, &k->v);
}

/* ---- Sub-intervals ---- */

typedef struct SubIntervalSoFar {
    const SubInterval *part;
    double before[3]; /* optical depth in front of it */
    unsigned features;
} SubIntervalSoFar;

MAYBE_UNUSED static void depth_of_sub_interval(const void *part, unsigned i, double u, double optical_depth[3])
{
    const SubIntervalSoFar *s = part;
    for (int c = 0; c < channels_of(s->features); c++)
        optical_depth[c] = s->before[c] + (double)optical_depth_to(s->part, s->features, c, reals_all((real)u))[i];
}

/* What only layers and listeners ask for. */
MAYBE_UNUSED static void note_sub_interval(Exact *k, const SubInterval *p, const Properties *in, ints mask,
                                           unsigned features)
{
    RayPacket *l = &k->packet;
    FOR_LANES(i, mask_bits(mask)) {
        SubIntervalSoFar so_far = {.part = p, .features = features};
        if (wants_depth(l, i)) {
            optical_depths_of(&k->sum, i, features, so_far.before);
            double share = share_up_to_half(depth_of_sub_interval, &so_far, i, channels_of(features));
            if (share <= 1)
                l->out[i].depth = stretch_begin(&k->way)[i] + (double)k->begin[i] +
                                  (double)k->length[i] * ((double)p->sa[i] + (double)p->ds[i] * share);
        }
        if (l->listener) {
            reals last = p->x0 + run_of(p, reals_all(1));
            tell(l, &(VolTraceStep){cell_time(k, i, p->sa[i]), cell_time(k, i, p->sa[i] + p->ds[i]),
                                    (double)(in->ref[i] + p->x0[i]), (double)(in->ref[i] + last[i]),
                                    (double)optical_depth_to(p, features, 0, reals_all(1))[i], (size_t)k->interval[i],
                                    in->has_surface[i] > 0 ? "surface" : "particles"});
        }
    }
}

static inline void end_opaque_rays(Exact *k, ints mask, unsigned features)
{
    k->in_cell &= ~terminate_rays(&k->sum, &k->packet, mask, features);
}

/* A channel that is dark already shows nothing of what lies behind. */
ALWAYS_INLINE void add_light_of(Exact *k, const SubInterval *p, const Light *sent, ints mask, unsigned features)
{
    reals zero = reals_all(0), transmittance[3];
    Light seen;
    ints first = features & FEATURE_COLOURED ? mask & channel_is_lit(k, 0) : mask;
    for (int c = 0; c < channels_of(features); c++)
        transmittance[c] = reals_exp(-k->sum.reached[c]);
    for (int c = 0; c < 3; c++) {
        reals T = transmittance[features & FEATURE_COLOURED ? c : 0];
        ints lit = features & FEATURE_COLOURED ? mask & channel_is_lit(k, c) : mask;
        reals all = seen.scatter[c] = reals_where(lit, T * (p->length * sent->scatter[c]));
        seen.emit[c] = seen.surface[c] = zero;
        if (features & FEATURE_EMIT)
            all += seen.emit[c] = reals_where(lit, T * (p->length * sent->emit[c]));
        if (features & FEATURE_SURFACE)
            all += seen.surface[c] = reals_where(lit, T * sent->surface[c]);
        if (features & FEATURE_SHADED)
            seen.normal[c] = reals_where(first, transmittance[0] * sent->normal[c]);
        doubles_add(&k->sum.color[c], all);
    }
    add_layers(&k->sum, &k->packet, &seen, features);
}

/* In u of the segment: up to `end`, or to where light grids bend before that. */
MAYBE_UNUSED static reals end_of_even_light(const Exact *k, reals end)
{
    reals whole = k->stop - k->s, from = reals_fma(whole, k->done, k->s);
    reals to = (lit_until(&k->packet, lit_in_cell(k, from)) - k->begin) / k->length;
    reals u = (to - k->s) / whole;
    return reals_select((ints)(u > k->done) & (ints)(u < end), u, end);
}

/* Integrates a sub-interval: to the segment's end, or as far as an optical depth of 1 or the bends of the gradient allow. */
ALWAYS_INLINE void integrate(Exact *k, unsigned features)
{
    const reals one = reals_all(1);
    ints mask = k->in_cell & (ints)(k->done < 1);
    ints seen = mask & intervals_visible(k->packet.tables, k->interval);
    k->done = reals_select(mask & ~seen, one, k->done);
    if (!any(seen))
        return;
    Properties in;
    SubInterval p;
    Light light;
    load_properties(k->packet.tables, k->interval, seen, features, &in);
    reals end = one;
    ints shaded = seen & needs_gradient(in.has_surface, in.scatter, features);
    if (features & FEATURE_SHADED && any(shaded)) {
        take_gradients(k, shaded);
        end = reals_select(shaded, end_of_gentle_turn(k, shaded), end);
    }
    if (features & FEATURE_LIT && k->packet.lit && k->packet.scene->lit->apart)
        end = end_of_even_light(k, end);
    cut_sub_interval(k, &in, features, end, &p);
    reals optical_depth = largest_optical_depth(k, &p, features);
    ints dense = seen & (ints)(optical_depth > 1);
    while (any(dense)) {
        /* Shortened as if extinction were even, and again where it is not and optical depth is still above 1. */
        reals next = k->done + (end - k->done) * reals_max((real)0.9 / optical_depth, reals_all((real)(1.0 / 64)));
        dense &= (ints)(next > k->done) & (ints)(next < end);
        if (!any(dense))
            break;
        end = reals_select(dense, next, end);
        cut_sub_interval(k, &in, features, end, &p);
        optical_depth = largest_optical_depth(k, &p, features);
        dense &= (ints)(optical_depth > 1);
    }
    give_up_steep(k, seen, &p, &in, optical_depth, features);
    const unsigned plain = features & ~(unsigned)(FEATURE_SHADED | FEATURE_CLASSIC | FEATURE_SURFACE);
    dense = seen & (ints)(optical_depth > 1);
    if (plain == features || !any(shaded)) {
        sub_interval_light(k, &in, &p, seen, dense, plain, &light);
    } else {
        sub_interval_light(k, &in, &p, seen, dense, features, &light);
        if (features & FEATURE_SHADED)
            give_up_faint(k, shaded, &p, optical_depth, features);
    }
    add_light_of(k, &p, &light, seen, features);
    if (features & FEATURE_EXTRA && k->packet.extra)
        note_sub_interval(k, &p, &in, seen, features);
    for (int c = 0; c < channels_of(features); c++)
        doubles_add(&k->sum.optical_depth[c], reals_where(seen, optical_depth_to(&p, features, c, reals_all(1))));
    k->done = reals_select(seen, end, k->done);
    end_opaque_rays(k, seen, features);
}

/* ---- Isosurfaces ---- */

MAYBE_UNUSED static bool ray_is_opaque(const Exact *k, unsigned i, unsigned features)
{
    double optical_depth[3], least = INFINITY;
    optical_depths_of(&k->sum, i, features, optical_depth);
    for (int c = 0; c < channels_of(features); c++)
        least = fmin(least, optical_depth[c]);
    return (real)least > k->packet.termination_depth[i];
}

MAYBE_UNUSED static void cross_all(Exact *k, ints mask, unsigned features)
{
    Shading sh;
    ints crossing = {0};
    FOR_LANES(n, mask_bits(mask))
        crossing[n] = k->event_first[n] < k->event_last[n] ? -1 : 0;
    if (!any(crossing))
        return;
    const reals at = lit_in_cell(k, k->s);
    real value[LANES];
    FOR_LANES(n, mask_bits(crossing))
        value[n] = k->packet.tables->isosurface_values[k->event_first[n]];
    const LitPlaces places = {&at, crossing, crossing, value, (ints)(k->leg_v > k->va)};
    const bool is_lit = features & FEATURE_LIT && k->packet.lit;
    if (features & FEATURE_SHADED) {
        take_gradients(k, crossing);
        crossing = give_up_unsure_normals(k, crossing, features);
        shade_at(k, 1, &k->s, is_lit ? &places : NULL, &sh);
    } else if (is_lit) {
        light_evenly(&k->packet, 1, &places, &sh);
    }
    FOR_LANES(i, mask_bits(crossing)) {
        for (size_t n = k->event_first[i]; n < k->event_last[i] && !ray_is_opaque(k, i, features); n++)
            cross_isosurface(&k->sum, &k->packet, i, &k->packet.tables->isosurfaces[n], cell_time(k, i, k->s[i]),
                             features & FEATURE_SHADED || is_lit ? &sh : NULL, features);
        k->event_first[i] = k->event_last[i] = 0;
    }
    end_opaque_rays(k, crossing, features);
}

/* Lanes that reached the end of their segment: on to the next, or out of the cell. */
ALWAYS_INLINE void arrive(Exact *k, unsigned features)
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

ALWAYS_INLINE void trace_lanes(Exact *k, unsigned features)
{
    for (;;) {
        traverse(k, features);
        if (!any(k->packet.alive))
            break;
        plan(k, features);
        integrate(k, features);
        arrive(k, features);
    }
    store_sums(&k->sum, &k->packet);
}

static void trace_particles(void *k) { trace_lanes(k, 0); }
static void trace_lit_particles(void *k) { trace_lanes(k, FEATURE_LIT); }
static void trace_emission(void *k) { trace_lanes(k, FEATURE_EMIT | FEATURE_COLOURED); }
static void trace_surfaces(void *k) { trace_lanes(k, FEATURE_SURFACE); }
static void trace_shaded_surfaces(void *k) { trace_lanes(k, FEATURE_SURFACE | FEATURE_SHADED); }
static void trace_shaded_isosurfaces(void *k) { trace_lanes(k, FEATURE_ISO | FEATURE_SHADED); }
static void trace_unshaded(void *k) { trace_lanes(k, ALL_FEATURES); }
static void trace_shaded(void *k) { trace_lanes(k, ALL_FEATURES | FEATURE_SHADED); }
static void trace_classic(void *k) { trace_lanes(k, ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC); }

static void exact_begin(Exact *k, const VolTraceCall *call, size_t first)
{
    CLEAR_FROM(k, sum);
    packet_begin(&k->packet, call, first);
    lit_begin(&k->packet);
    traversal_begin(&k->way, &k->packet, false);
}

static void trace_exact(const VolTraceCall *call)
{
    static const FeaturesKernel kernels[] = {{0, trace_particles},
                                             {FEATURE_LIT, trace_lit_particles},
                                             {FEATURE_EMIT | FEATURE_COLOURED, trace_emission},
                                             {FEATURE_SURFACE, trace_surfaces},
                                             {FEATURE_SURFACE | FEATURE_SHADED, trace_shaded_surfaces},
                                             {FEATURE_ISO | FEATURE_SHADED, trace_shaded_isosurfaces},
                                             {ALL_FEATURES, trace_unshaded},
                                             {ALL_FEATURES | FEATURE_SHADED, trace_shaded},
                                             {ALL_FEATURES | FEATURE_SHADED | FEATURE_CLASSIC, trace_classic}};
    const FeaturesKernel *kernel = kernel_for(call, kernels, sizeof kernels / sizeof *kernels);
    for (size_t i = 0; i < call->count; i += LANES) {
        Exact k;
        exact_begin(&k, call, i);
        kernel->trace(&k);
    }
}
