/* The compiled transfer function in the kernel's precision, laid out for loads by several rays at once.
 *
 * PARAMETERS  VOL_DOUBLE
 * PROVIDES    TfTables, PREPARED_TABLES(), FEATURE_... */
#ifndef VOL_TRACE_TF_TABLES_TMPL_H
#define VOL_TRACE_TF_TABLES_TMPL_H

#include <stdlib.h>

#include "base/mem.h"
#include "simd/real.h"
#include "trace/prepared.h"

/* value(v) = a + b x, x = v - ref */
typedef struct Line {
    real a, b;
} Line;

/* One interval between knots; what a kernel needs together stands in groups of four numbers. */
typedef struct Interval {
    real ref;
    Line extinction;                 /* scatter + absorb, of the first channel */
    real has_surface;                /* 1 or 0 */
    Line scatter, scatter_color[3];
    Line emit[3];
    Line surfaceness;
    Line surface, surface_color[3];
    Line extinction_rest[2];         /* of the other channels */
} Interval;

enum { INTERVAL_REALS = 32, AT_PARTICLES = 0, AT_SCATTER = 4, AT_EMIT = 12, AT_SURFACE = 20, AT_REST = 28 };
_Static_assert(sizeof(Interval) == INTERVAL_REALS * sizeof(real), "an interval is an array of reals");

typedef struct Isosurface {
    real value;
    real color[3];
    real around; /* what particles beside it take from a ray or add to it, per unit of length */
    double optical_depth, opacity;
} Isosurface;

/* What a scene may be without, each an own kernel's saving. */
enum {
    FEATURE_SURFACE = 1,  /* soft surfaces */
    FEATURE_COLOURED = 2, /* extinction differs by channel */
    FEATURE_EMIT = 4,
    FEATURE_SHADED = 8,   /* soft surfaces and isosurfaces are shaded */
    FEATURE_CLASSIC = 16, /* K 11 shades what scatters */
    FEATURE_ISO = 32,     /* isosurfaces */
    FEATURE_EXTRA = 64,   /* layers beside RGBA, or a trace */
    FEATURE_LIT = 256,    /* light grids */
    /* Which are nothing where there are none. */
    ALL_FEATURES = FEATURE_SURFACE | FEATURE_COLOURED | FEATURE_EMIT | FEATURE_ISO | FEATURE_EXTRA | FEATURE_LIT
};

/* What float may do to a pixel before its ray is traced in double (blur_tmpl.h). */
#define BLUR_LIMIT 5e-6

enum { KNOT_BUCKETS = 1024, FEW_KNOTS = 12 };

/* A knot, and extinction on both sides of it: what a segment needs that runs over it. */
typedef struct Knot {
    real v, v_rest; /* v + v_rest is the knot to twice the precision */
    real extinction[2], surface[2]; /* below, above */
    real unused[2];
} Knot;

enum { KNOT_REALS = sizeof(Knot) / sizeof(real) };

/* Where there are so few intervals, each number of all of them stands side by side too: a register holds it. */
enum { REGISTER_NUMBERS = 8 };

typedef struct FewIntervals {
    real numbers[INTERVAL_REALS][REGISTER_NUMBERS];
    int32_t next_visible[REGISTER_NUMBERS];
} FewIntervals;

/* Tables over (v0, v1) for the scene's own step, v0 = node i + x, v1 = node j + y: see lookup_tmpl.h. */
typedef struct Lookup {
    real *entries;             /* NULL: everything is looked up in VolPreint */
    int32_t parts, stride;     /* groups of four in an entry; entries in a diagonal */
    int32_t nodes, band;       /* diagonals -band ... band */
    int32_t *reach;            /* per bin: the last diagonal that it is good for; -1: none.  NULL: band - 1 for all */
    real lo, hi;               /* what the nodes cover */
    real scale, scale_rest;    /* v -> place among the nodes: v (scale + scale_rest) + offset + offset_rest + offset_low, */
    real offset, offset_rest, offset_low; /* `offset` a whole number */
} Lookup;

typedef struct TfTables {
    real *edges;       /* knot_count + 2: -infinity, the knots, infinity; interval j lies from edges[j] to edges[j + 1] */
    real *jump;        /* per edge: what changes there at once (jumps.h) */
    size_t knot_count;
    Interval *intervals;   /* knot_count + 1 */
    int32_t *next_visible; /* per interval: the first at or above it that is something; knot_count + 1: none */
    int32_t *buckets;      /* knots below the bucket's lower edge, at most: where a search may begin */
    real bucket_lo, bucket_scale;
    int32_t bucket_steps;  /* and after how many knots it ends */
    Isosurface *isosurfaces;   /* ascending by value, equal values in list order */
    real *isosurface_values;
    size_t *falling; /* their numbers descending by value, equal values in list order */
    size_t isosurface_count;
    unsigned features;
    int channels; /* 1: extinction is grey, 3: coloured */
    bool classic;
    bool steep;      /* somewhere float's rounding of the field may show in what particles and surfaces do */
    bool jumps;      /* isosurfaces, or values at which something begins or ends at once */
    real ambient, diffuse, specular;
    double shininess;
    bool gradient_surfaceness;
    real g0, g1;
    Knot *knots;                    /* NULL but for the pre-integrated estimators, as are: */
    const VolTfIntegral *at_knot;   /* from the first knot to each */
    FewIntervals few;
    bool other_steps;               /* full tables there are, but none of the scene's step */
    Lookup lookup;
} TfTables;

#ifdef VOL_DOUBLE
struct VolTfTablesF64 {
    TfTables o;
};
#define PREPARED_TABLES(prepared) (&(prepared)->tables64->o)
#else
struct VolTfTablesF32 {
    TfTables o;
};
#define PREPARED_TABLES(prepared) (&(prepared)->tables32->o)
#endif

static inline real line_at(Line line, real x) { return real_fma(line.b, x, line.a); }
static inline bool few_intervals(const TfTables *o) { return o->knot_count < REGISTER_NUMBERS; }
static inline bool interval_visible(const TfTables *o, size_t j) { return o->next_visible[j] == (int32_t)j; }

/* Number of knots <= v: the interval that holds v. */
static inline size_t interval_of(const TfTables *tables, real v)
{
    size_t lo = 0, hi = tables->knot_count;
    while (lo < hi) {
        size_t mid = (lo + hi) / 2;
        if (tables->edges[mid + 1] <= v)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

/* Number of knots < v: the interval below v, for a value that falls. */
static inline size_t interval_below(const TfTables *tables, real v)
{
    size_t j = interval_of(tables, v);
    return j > 0 && tables->edges[j] == v ? j - 1 : j;
}

#endif
