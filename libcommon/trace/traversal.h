/* The contract between estimators and what rays run through: all that they know of a field.
 *
 * A kernel's file names the header that keeps it, as it names the precision, before it includes an estimator:
 *
 *     #define VOL_TRAVERSAL "trace/grid_traversal_tmpl.h"
 *     #include "trace/exact_tmpl.h"
 *
 * Along a ray the field is a sequence of stretches [begin, end] (of a grid: bricks) with empty space left out between them.
 * Estimators that need no step take a stretch apart into cells, in which the field is a cubic; those that march take samples
 * in it.  What a lane is told depends on its own ray alone, and is the same at any cpu level.  `w` is a Traversal, `l` its
 * RayPacket, `i` one lane, `mask` several; times are world units from the ray's origin.
 *
 * Stretches
 *     void traversal_begin(w, l, may_wait)               may_wait: the estimator takes rays on together where w->together
 *     bool w->together                                   says that they are so near one another that this saves time
 *     bool traversal_enter_cells(w, l, i, features)      lane i goes to its next stretch with something in it; false, and it
 *     bool traversal_enter_samples(w, l, i)              is not alive any more: there is none, or the ray is given up
 *     void traversal_visit_samples(w, l, mask)           all of `mask`, where w->together, in place of it
 *     const double *stretch_begin(w), *stretch_end(w)    per lane; the same numbers for neighbours that touch
 *     ints stretch_is_uniform(w)                         one value and no gradient from end to end
 *     w->in_stretch                                      mask; cells clear it where the last one is behind
 *     w->shows                                           mask: something can be seen in the stretch
 *     w->lo, w->hi                                       reals: the field's range in it
 *
 * Cells
 *     ints traversal_next_cells(w, l, mask, bounded, features, Cell *out, CellPlace *at)
 *                                                        the next cell of each lane; those that have one
 *     void traversal_keep_cells(CellPlace *kept, mask, const CellPlace *from, features)
 *     void traversal_sure_range(w, l, const CellPlace *at, s, mask, reals *lo, reals *hi)
 *                                                        in float: what v at s surely lies between, though the ray's
 *                                                        place is rounded; at first, in *lo and *hi, the cell's
 *     void traversal_gradients(w, l, const CellPlace *at, mask, Cubic out[3])
 *                                                        world space, per world unit, along the cell as the field is
 *
 * Samples on a line, at equal steps: runs of a few in one stretch
 *     void traversal_set_step(w, l, h)                   world units, for all runs
 *     void traversal_begin_run(w, l, i, t, last)         its first sample, and the number of its last counted from 0
 *     void traversal_begin_runs(w, l, mask, t, last)     the same of each lane: t[i], last[i]
 *     reals traversal_samples(w, l, j, mask, bounded, SamplePlaces *at, ints *valid)
 *                                                        sample j of each lane's run
 *     reals traversal_sample_gradients(w, l, at, mask, reals out[3])
 *                                                        returns what no component is larger than, nearby
 *
 * Places one by one, the same bits as in a run
 *     void traversal_find(w, l, i, t, Place *out, double *begin, double *end)
 *                                                        the stretch around t, left out or not
 *     void traversal_place_in_run(w, l, i, first_t, last, j, Place *out)
 *     void traversal_place_at(w, l, i, Place *out)       any t in it
 *     void traversal_settle_end(w, l, i, Place *out)     an end of the ray: exactly on the domain's face where it is one
 *     real traversal_value(w, l, const Place *at, bounded, bool *valid)
 *     real traversal_gradient(w, l, const Place *at, real out[3])
 *                                                        returns what no component is larger than, of those that it is
 *                                                        interpolated from
 *
 * `bounded`: values never leave the range of what they are interpolated from, whatever rounding does.  A place that is not
 * valid has no field.  Place begins with `double t; bool is_end`. */
#ifndef VOL_TRACE_TRAVERSAL_H
#define VOL_TRACE_TRAVERSAL_H

#include "trace/cubic_tmpl.h"
#include "trace/packet_tmpl.h"

/* A part of a stretch in which the field is a cubic, under each ray. */
typedef struct Cell {
    Cubic v;            /* s from 0 to 1 along it */
    reals begin, length; /* world units; `begin` counts from the stretch's */
    reals lo, hi;       /* enclose v */
    reals least, most;  /* where bounded: what v never leaves, exactly */
    reals entry, exit;  /* v at the ends; in kernels with isosurfaces neighbours agree on it */
    ints begins;        /* there: no neighbour has judged the entry */
} Cell;

#endif
