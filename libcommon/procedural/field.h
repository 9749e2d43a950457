/* Analytic scalar fields: a table of named functions of the place, each with parameters and their defaults.
 *
 * Fields are functions of world space.  Values are computed in double with functions that give the same bits on
 * every machine, so that a volume made from a field has the same bytes everywhere. */
#ifndef VOL_PROCEDURAL_FIELD_H
#define VOL_PROCEDURAL_FIELD_H

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"
#include "base/vec.h"

enum { VOL_FIELD_PARAMS = 10 };

typedef struct VolFieldParam {
    const char *name;
    double fallback;
    const char *help;
} VolFieldParam;

/* `p` holds the parameters in the order of the table. */
typedef struct VolField {
    const char *name, *summary;
    double (*value)(const double *p, uint64_t seed, VolVec3 x);
    VolFieldParam params[VOL_FIELD_PARAMS]; /* ends at the first without a name */
} VolField;

/* A field with its parameters filled in. */
typedef struct VolFieldCase {
    const VolField *field;
    double p[VOL_FIELD_PARAMS];
    uint64_t seed;
} VolFieldCase;

size_t vol_field_count(void);
const VolField *vol_field_at(size_t i);

/* Finds the field and fills in its defaults; VOL_USAGE lists the names. */
VolStatus vol_field_find(const char *name, VolFieldCase *out, VolError *err);

/* Sets a parameter from "K=V"; VOL_USAGE lists the field's parameters. */
VolStatus vol_field_set(VolFieldCase *field, const char *assignment, VolError *err);

static inline double vol_field_value(const VolFieldCase *field, VolVec3 x)
{
    return field->field->value(field->p, field->seed, x);
}

/* The list of fields and parameters for people.  Allocated; NULL: out of memory. */
char *vol_field_list(void);

#endif
