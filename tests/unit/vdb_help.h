/* For tests of VDB files: opening and writing that must succeed, and leaves of either kind seen in one place. */
#ifndef TESTS_UNIT_VDB_HELP_H
#define TESTS_UNIT_VDB_HELP_H

#include <stdlib.h>

#include "io/vdb.h"
#include "tests/unit/test.h"

static VolError err;

static const VolAffine unit = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

#define OK(call)                                         \
    do {                                                 \
        VolStatus status_ = (call);                      \
        if (status_)                                     \
            FAIL("%s: %d %s", #call, status_, err.text); \
    } while (0)

static VolBytes copy_of(const VolBytes *bytes, size_t size)
{
    VolBytes copy = {malloc(size ? size : 1), size};
    if (size)
        memcpy(copy.data, bytes->data, size);
    return copy;
}

/* Opens a copy, so that `bytes` may be used again. */
static VolVdb *open_copy(const VolBytes *bytes)
{
    VolVdb *vdb = NULL;
    OK(vol_vdb_open(copy_of(bytes, bytes->size), "test", &vdb, &err));
    return vdb;
}

static VolVdbWriter *new_writer(VolVdbCompression compression)
{
    VolVdbWriter *writer = NULL;
    OK(vol_vdb_writer_new(compression, &writer, &err));
    return writer;
}

static VolBytes finish(VolVdbWriter *writer)
{
    VolBytes bytes = {0};
    OK(vol_vdb_finish(writer, &bytes, &err));
    vol_vdb_writer_free(writer);
    return bytes;
}

/* Each test's own: one of `floats` and `doubles` is NULL. */
static VolStatus see_leaf(void *user, const int32_t origin[3], const float *floats, const double *doubles,
                          const uint64_t active[8], VolError *e);

__attribute__((unused)) static VolStatus see_float(void *user, const int32_t origin[3], const float *values,
                                                   const uint64_t active[8], VolError *e)
{
    return see_leaf(user, origin, values, NULL, active, e);
}

__attribute__((unused)) static VolStatus see_double(void *user, const int32_t origin[3], const double *values,
                                                    const uint64_t active[8], VolError *e)
{
    return see_leaf(user, origin, NULL, values, active, e);
}

#endif
