/* Inside tf/: what the readers of foreign formats share.  A reader fills two lists of points, colours in sRGB and
 * opacities, and vol_foreign_finish makes a transfer function of them. */
#ifndef VOL_TF_FOREIGN_PRIVATE_H
#define VOL_TF_FOREIGN_PRIVATE_H

#include "tf/color.h"
#include "tf/foreign.h"
#include "tf/xml.h"

/* The file being read. */
typedef struct VolForeign {
    const char *name; /* for messages */
    const char *part; /* the one asked for, or NULL */
    char subject[96]; /* "preset 'CT-Bone': ", once it is known which */
    const VolLog *log;
    VolError *err;
} VolForeign;

/* "bad transfer function 'FILE': line 7: preset 'CT-Bone': WHY"; line 0: none. */
VolStatus vol_foreign_fault(const VolForeign *f, size_t line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void vol_foreign_warn(const VolForeign *f, const char *format, ...) __attribute__((format(printf, 2, 3)));
void vol_foreign_note(const VolForeign *f, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* Finds f->part among the names, or the only one where it is NULL, and sets f->subject.  `kind`: "preset". */
VolStatus vol_foreign_choose(VolForeign *f, const char *kind, const char *const *names, size_t count, size_t *out);

/* VOL_BAD_INPUT where a part is asked for: this format has none. */
VolStatus vol_foreign_no_parts(const VolForeign *f);

/* ---- Points ---- */

/* `value`: a colour in sRGB, or the opacity in value[0].  Midpoint and sharpness shape the way to the next point as VTK's
 * piecewise functions do; 0.5 and 0 make it a straight line. */
typedef struct VolForeignPoint {
    double v, value[3], midpoint, sharpness;
    size_t order;
} VolForeignPoint;

typedef struct VolForeignPoints {
    VolForeignPoint *items;
    size_t count, capacity;
} VolForeignPoints;

void vol_foreign_points_free(VolForeignPoints *points);

/* Checks that v is within 1e300, that the value is within [0, 1] and the rest in order.  Rounding beyond 0 or 1 by 1e-6
 * is put right. */
VolStatus vol_foreign_add_color(const VolForeign *f, VolForeignPoints *points, size_t line, double v, double r, double g,
                                double b);
VolStatus vol_foreign_add_opacity(const VolForeign *f, VolForeignPoints *points, size_t line, double v, double opacity,
                                  double midpoint, double sharpness);

/* Brings points into order, with a warning where they are not (none for `what` NULL). */
void vol_foreign_sort(const VolForeign *f, VolForeignPoints *points, const char *what);

/* Like the functions above without their checks. */
VolStatus vol_foreign_add_point(const VolForeign *f, VolForeignPoints *points, VolForeignPoint point);

/* Opacity 0 below lo and above hi.  Straight pieces only; sorted. */
VolStatus vol_foreign_cut(const VolForeign *f, VolForeignPoints *opacity, double lo, double hi);

/* Values to fractions of the range from the first to the last point.  Sorted. */
void vol_foreign_normalise(VolForeignPoints *points);

/* Sorts, blends and merges both lists (neither empty) into out->scatter. */
VolStatus vol_foreign_finish(const VolForeign *f, VolForeignPoints *colors, VolColorSpace space,
                             VolForeignPoints *opacity, VolTf *out);

/* ---- Formats.  *out holds the defaults, *units is world units and values; on failure the caller frees. ---- */

struct json_t;
bool vol_foreign_is_paraview(const struct json_t *root);
VolStatus vol_foreign_paraview(VolForeign *f, struct json_t *root, VolTf *out, VolTfUnits *units);
VolStatus vol_foreign_slicer(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units);
VolStatus vol_foreign_inviwo(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units);
VolStatus vol_foreign_voreen(VolForeign *f, const VolXml *xml, VolTf *out, VolTfUnits *units);
VolStatus vol_foreign_ospray(VolForeign *f, const VolBytes *bytes, VolTf *out, VolTfUnits *units);

/* ---- Numbers in XML ---- */

/* Attribute `key` of an element as a number; a fault where it is missing or none. */
VolStatus vol_foreign_number(const VolForeign *f, const VolXml *xml, size_t element, const char *key, double *out);

/* Attribute `key` of the child `child`; *out stays where there is no such child. */
VolStatus vol_foreign_child_number(const VolForeign *f, const VolXml *xml, size_t element, const char *child,
                                   const char *key, double *out);

#endif
