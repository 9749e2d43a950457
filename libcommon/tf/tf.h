/* Transfer functions: from JSON ("pellucid": "transfer-function/1", see pellucid-files(5)) to the piecewise-linear
 * optical properties that every integrator is measured against.
 *
 * Units: extinction 1/world unit; surface extinction 1/unit of the field; colours linear Rec.709; emission
 * radiance per world unit. */
#ifndef VOL_TF_TF_H
#define VOL_TF_TF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/log.h"
#include "base/mem.h"
#include "base/status.h"

typedef enum VolModel { VOL_MODEL_HYBRID, VOL_MODEL_CLASSIC, VOL_MODEL_UNSHADED } VolModel;
typedef enum VolInterpolate { VOL_INTERPOLATE_OPACITY, VOL_INTERPOLATE_EXTINCTION } VolInterpolate;

/* A node as the user wrote it.  `amount`: opacity, density or strength. */
typedef struct VolTfNode {
    double v, amount, color[3];
} VolTfNode;

typedef struct VolTfNodes {
    VolTfNode *nodes;
    size_t count;
} VolTfNodes;

typedef struct VolTfIsosurface {
    double value, opacity, color[3];
    bool color_given; /* false: the surface colour at `value` (resolved by vol_tf_compile) */
} VolTfIsosurface;

/* The file, parsed and checked, defaults filled in, nothing converted. */
typedef struct VolTf {
    VolInterpolate interpolate;
    double particle_step;  /* world units */
    double scalar_step;    /* units of the field; 1/256 of the nodes' range by default; 0: see vol_tf_settle_step */
    bool scalar_step_given;
    VolTfNodes surface, scatter, absorb, emit; /* count 0: absent */
    VolTfNodes transport;                      /* color used, amount unused */
    VolTfNodes surfaceness;                    /* amount = S */
    bool surfaceness_by_gradient;
    double surfaceness_gradient[2];
    VolTfIsosurface *isosurfaces;
    size_t isosurface_count;
    bool phase_given;
    double phase_hg;
    VolTfNodes phase_table; /* v = cosine */
    double ambient, diffuse, specular, shininess;
    VolModel model;
} VolTf;

/* `name` is for messages: "bad transfer function 'NAME': line 7: key 'scatter', node 3: opacity 1.2 lies outside
 * [0, 1]" (nodes are counted from 1).  VOL_BAD_INPUT on anything wrong: syntax, unknown keys, unsorted nodes,
 * three nodes at one v, wrong "pellucid".  Things that have no effect are said to `log`. */
VolStatus vol_tf_parse(const VolBytes *bytes, const char *name, VolTf *out, const VolLog *log, VolError *err);
void vol_tf_free(VolTf *tf);

/* Where nodes and isosurfaces all lie at one value the default of scalar_step is 1/256 of the range of the data, lo to hi (1
 * where that is nothing: no surface is seen).  Without it vol_tf_compile() refuses such a function. */
void vol_tf_settle_step(VolTf *tf, double lo, double hi);

/* What a file with no keys but "pellucid" says. */
VolTf vol_tf_defaults(void);

/* ---- Compiled ---- */

/* One quantity on a stretch: value(v) = a + b (v - v_ref) */
typedef struct VolLinear {
    double a, b;
} VolLinear;

/* Optical properties between two neighbouring knots of the merged node lists.  Intervals cover the real line:
 * interval 0 is (-inf, knot 0), interval i [knot i-1, knot i), the last [knot n-1, +inf); constant in the two
 * unbounded ones. */
typedef struct VolTfInterval {
    double v0, v1; /* -INFINITY, INFINITY at the ends */
    double v_ref;  /* the finite end (v0 where it is finite) */
    VolLinear scatter, scatter_color[3];
    VolLinear absorb[3];
    VolLinear emit[3];
    VolLinear surface, surface_color[3];
    VolLinear surfaceness;  /* 1 where absent */
    VolLinear transport[3]; /* extinction of indirect light (K: 1 - alpha_i); absent: scatter + mean of absorb */
    bool has_scatter, has_absorb, has_emit, has_surface; /* not identically 0 on it */
} VolTfInterval;

typedef struct VolIsosurface { /* a Dirac isosurface */
    double value, opacity, color[3];
    double optical_depth; /* -log1p(-opacity); INFINITY where opacity is 1 */
} VolIsosurface;

typedef struct VolTfCompiled {
    double *knots; /* ascending, distinct: a jump is one knot */
    size_t knot_count;
    VolTfInterval *intervals; /* knot_count + 1 */
    VolIsosurface *isosurfaces;       /* ascending by value, equal values in list order; none of opacity 0 */
    size_t isosurface_count;
    size_t *visible_before;   /* knot_count + 2: how many of the intervals 0..i-1 are not empty */
    bool has_scatter, has_absorb, has_emit, has_surface; /* anywhere */
    bool coloured;            /* attenuation differs between channels (absorb is not grey) */
    double max_color;         /* largest of scatter_color, surface_color, delta color where not transparent */
    double max_emit;          /* largest emission per world unit in any channel */
    double node_min, node_max; /* range of all nodes and isosurface values; INFINITY, -INFINITY if none */
    VolModel model;
    double ambient, diffuse, specular, shininess;
    bool surfaceness_by_gradient;
    double surfaceness_gradient[2];
} VolTfCompiled;

/* Converts to extinction (Y 24-27 by log1p, opacity 1 as 1 - 2^-24), inserts nodes (interpolate = opacity), merges
 * the lists.  Classic: surface nodes are ignored with a warning. */
VolStatus vol_tf_compile(const VolTf *tf, const VolLog *log, VolTfCompiled *out, VolError *err);
void vol_tf_compiled_free(VolTfCompiled *compiled);

/* Keeps depths within what kernels can count with: extinction of particles to 1e18 per voxel edge `voxel` (world units),
 * emission to 1e30 (both less where values differ by more than 1), surface extinction to 1e18 per span of the knots. */
void vol_tf_limit(VolTfCompiled *compiled, double voxel);

/* For a field whose values are `scale` (a power of two) times what they were.  Tables and integrals of it: preint.h. */
void vol_tf_compiled_rescale(VolTfCompiled *compiled, double scale);

/* Index of the interval that holds v: at a knot the one that begins there. */
size_t vol_tf_interval(const VolTfCompiled *compiled, double v);

/* Whether a field that takes the values of the closed range [lo, hi] and no others can show anything: extinction,
 * emission or an isosurface.  Exact, ends included (a single value has no soft surfaces: they need a change of v);
 * rounding in the caller's interpolation is the caller's to allow for.  O(log knots). */
bool vol_tf_range_visible(const VolTfCompiled *compiled, double lo, double hi);

/* The converted nodes of one list after insertion: v, extinction (absorb, transport: by channel, else three times
 * the same; emit: radiance per world unit), colour. */
typedef struct VolTfExtinctionNode {
    double v, extinction[3], color[3];
} VolTfExtinctionNode;
typedef enum VolTfList { VOL_TF_SURFACE, VOL_TF_SCATTER, VOL_TF_ABSORB, VOL_TF_EMIT, VOL_TF_TRANSPORT } VolTfList;
VolStatus vol_tf_extinction_nodes(const VolTf *tf, VolTfList list, VolTfExtinctionNode **out, size_t *count,
                                  VolError *err);

#endif
