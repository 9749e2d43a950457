/* Tables from EXR, distrusted: a table that does not fit its transfer function makes pictures that are wrong and
 * look right. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "io/in.h"
#include "load/tables_private.h"

static const VolPart *find_part(const VolImage *image, const char *name)
{
    for (size_t i = 0; i < image->part_count; i++)
        if (image->parts[i].name && strcmp(image->parts[i].name, name) == 0)
            return &image->parts[i];
    return image->part_count == 1 && !image->parts[0].name && strcmp(name, "full") == 0 ? &image->parts[0] : NULL;
}

static const VolAttr *find_attr(const VolPart *part, const char *name, VolAttrType type, VolError *err)
{
    const VolAttr *attr = vol_part_attr(part, name);
    if (attr && attr->type == type)
        return attr;
    vol_fail(err, VOL_BAD_INPUT, "part '%s' has no attribute '%s'", part->name ? part->name : "", name);
    return NULL;
}

/* Version, range, size, and that it belongs to this transfer function. */
static VolStatus check_part(const VolPart *part, const VolTables *tables, bool square, VolPreintOptions *options,
                            VolError *err)
{
    char digest[33];
    double range[2];
    const VolAttr *version = find_attr(part, "vol:tfVersion", VOL_ATTR_INT, err);
    const VolAttr *text = version ? find_attr(part, "vol:tfRange", VOL_ATTR_TEXT, err) : NULL;
    const VolAttr *hash = text ? find_attr(part, "vol:tfHash", VOL_ATTR_TEXT, err) : NULL;
    const VolAttr *scalar_step = hash ? find_attr(part, "vol:tfScalarStep", VOL_ATTR_DOUBLE, err) : NULL;
    if (!scalar_step)
        return VOL_BAD_INPUT;
    if (version->number[0] != VOL_TABLES_VERSION)
        return vol_fail(err, VOL_BAD_INPUT, "part '%s' is of version %g; this program reads version %d", part->name,
                        version->number[0], VOL_TABLES_VERSION);
    if (vol_parse_reals(text->text, range, 2, 2) != 2 || !(range[0] < range[1]))
        return vol_fail(err, VOL_BAD_INPUT, "part '%s': its range '%.80s' is not LO,HI with LO below HI", part->name,
                        text->text);
    vol_json_digest(tables->json, digest);
    if (strcmp(hash->text, digest) != 0 || scalar_step->number[0] != tables->tf.scalar_step)
        return vol_fail(err, VOL_BAD_INPUT, "part '%s' was made from another transfer function than the header has",
                        part->name);
    size_t width = vol_box2_width(part->data_window), height = vol_box2_height(part->data_window);
    if (width < 2 || height != (square ? width : 1))
        return vol_fail(err, VOL_BAD_INPUT, "part '%s' is %zux%zu, not %s", part->name, width, height,
                        square ? "square" : "one row of at least 2");
    if (options->n && (options->n != width || options->lo != range[0] || options->hi != range[1]))
        return vol_fail(err, VOL_BAD_INPUT, "part '%s' has %zu nodes from %g to %g, another %zu from %g to %g", part->name,
                        width, range[0], range[1], options->n, options->lo, options->hi);
    options->n = width;
    options->lo = range[0];
    options->hi = range[1];
    return VOL_OK;
}

static VolStatus find_channels(const VolPart *part, const VolPlane *planes, size_t count, const char *suffix,
                               const float *data[VOL_MOST_PLANES], VolError *err)
{
    for (size_t p = 0; p < count; p++) {
        char *name = vol_format_text("%s%s", planes[p].name, suffix);
        if (!name)
            return vol_fail_memory(err, 32);
        const VolChannel *channel = vol_part_channel(part, name);
        free(name);
        if (!channel || !channel->data)
            return vol_fail(err, VOL_BAD_INPUT, "part '%s' has no channel '%s%s'", part->name, planes[p].name, suffix);
        data[p] = channel->data;
    }
    return VOL_OK;
}

/* The 1D parts say nothing that the transfer function does not; they are checked, not kept. */
static VolStatus check_1d(const VolPart *part, const VolPlane *planes, size_t count, const char *suffix, VolError *err)
{
    const float *data[VOL_MOST_PLANES];
    size_t n = vol_box2_width(part->data_window);
    VolStatus status = find_channels(part, planes, count, suffix, data, err);
    for (size_t p = 0; !status && p < count; p++)
        for (size_t i = 0; i < n; i++)
            if (!isfinite(data[p][i]))
                return vol_fail(err, VOL_BAD_INPUT, "part '%s': %s%s of node %zu is not finite", part->name, planes[p].name,
                                suffix, i);
    return status;
}

static VolStatus read_1d(const VolImage *image, const VolTables *tables, VolPreintOptions *options, VolError *err)
{
    VolPlane planes[VOL_MOST_PLANES];
    int channels = tables->compiled.coloured ? 3 : 1;
    const VolPart *tf = find_part(image, "tf"), *integrals = find_part(image, "integrals");
    VolStatus status = VOL_OK;
    if (tf) {
        status = check_part(tf, tables, false, options, err);
        if (!status)
            status = check_1d(tf, planes, vol_planes_tf(channels, planes), "", err);
    }
    if (!status && integrals) {
        size_t count = vol_planes_integrals(channels, planes);
        status = check_part(integrals, tables, false, options, err);
        if (!status)
            status = check_1d(integrals, planes, count, "", err);
        if (!status)
            status = check_1d(integrals, planes, count, ".lo", err);
    }
    return status;
}

static const VolPart *octave_part(const VolImage *image, size_t octave)
{
    char name[32];
    vol_octave_name(octave, name);
    return find_part(image, name);
}

/* Counts the octaves and takes the step from the first. */
static VolStatus survey_full(const VolImage *image, const VolTables *tables, VolPreintOptions *options, VolError *err)
{
    const VolPart *part;
    for (size_t o = 0; o < 32 && (part = octave_part(image, o)) != NULL; o++) {
        VolStatus status = check_part(part, tables, true, options, err);
        if (status)
            return status;
        const VolAttr *step = find_attr(part, "vol:tfStep", VOL_ATTR_DOUBLE, err);
        const VolAttr *band = step ? find_attr(part, "vol:tfBand", VOL_ATTR_INT, err) : NULL;
        if (!band)
            return VOL_BAD_INPUT;
        if (o == 0)
            options->step = step->number[0];
        if (!(step->number[0] > 0) || step->number[0] != ldexp(options->step, (int)o))
            return vol_fail(err, VOL_BAD_INPUT, "part '%s': its step %g is not that of its octave", part->name,
                            step->number[0]);
        if (!(band->number[0] >= 1 && band->number[0] < (double)options->n))
            return vol_fail(err, VOL_BAD_INPUT, "part '%s': its band of %g is not 1 to %zu", part->name, band->number[0],
                            options->n - 1);
        options->octaves++;
    }
    return VOL_OK;
}

static VolStatus read_entry(const VolPart *part, const VolPlane *planes, size_t count, const float *const *data,
                            size_t opacities, size_t i, size_t j, size_t n, float *entry, VolError *err)
{
    for (size_t p = 0; p < count; p++) {
        float x = data[p][j * n + i];
        bool opacity = planes[p].offset < opacities;
        if (!isfinite(x) || (opacity && !(x >= 0 && x <= 1)))
            return vol_fail(err, VOL_BAD_INPUT, "part '%s': %s of entry (%zu, %zu) is %g, not %s", part->name,
                            planes[p].name, i, j, (double)x, opacity ? "an opacity" : "finite");
        entry[planes[p].offset] = x;
    }
    return VOL_OK;
}

static VolStatus read_full(const VolPart *part, const VolPreint *preint, VolPreintTable *table, VolError *err)
{
    VolPlane planes[VOL_MOST_PLANES];
    const float *data[VOL_MOST_PLANES];
    size_t n = preint->n, count = vol_planes_full(preint->channels, planes);
    VolStatus status = find_channels(part, planes, count, "", data, err);
    for (size_t j = 0; !status && j < n; j++) {
        size_t first = j > table->band ? j - table->band : 0, last = n - 1 - j > table->band ? j + table->band : n - 1;
        for (size_t i = first; !status && i <= last; i++)
            status = read_entry(part, planes, count, data, 3 * (size_t)preint->channels, i, j, n,
                                vol_preint_entry(preint, table, i, j), err);
    }
    return status;
}

static VolStatus read_tables(const VolImage *image, VolTables *tables, VolError *err)
{
    VolPreintOptions options = {.threads = 1};
    VolStatus status = read_1d(image, tables, &options, err);
    if (!status)
        status = survey_full(image, tables, &options, err);
    if (status)
        return status;
    if (!options.n)
        return vol_fail(err, VOL_BAD_INPUT, "it has none of the parts 'tf', 'integrals' and 'full'");
    size_t bands[32];
    for (size_t o = 0; o < options.octaves; o++)
        bands[o] = (size_t)vol_part_attr(octave_part(image, o), "vol:tfBand")->number[0];
    status = vol_preint_allocate(&tables->compiled, &options, bands, &tables->preint, err);
    for (size_t o = 0; !status && o < options.octaves; o++)
        status = read_full(octave_part(image, o), &tables->preint, &tables->preint.octaves[o], err);
    return status;
}

static const char *find_json(const VolImage *image)
{
    for (size_t i = 0; i < image->part_count; i++) {
        const VolAttr *attr = vol_part_attr(&image->parts[i], "vol:transferFunction");
        if (attr && attr->type == VOL_ATTR_TEXT)
            return attr->text;
    }
    return NULL;
}

VolStatus vol_tables_from_image(const VolImage *image, const char *name, const VolLog *log, VolTables **out,
                                VolError *err)
{
    *out = NULL;
    const char *json = find_json(image);
    if (!json)
        return vol_fail(err, VOL_BAD_INPUT, "cannot use tables '%s': no transfer function in the header (%s)", name,
                        "vol:transferFunction");
    VolTables *tables = vol_alloc_zero(1, sizeof *tables);
    if (!tables)
        return vol_fail_memory(err, sizeof *tables);
    VolBytes bytes = {(unsigned char *)(uintptr_t)json, strlen(json)}; /* not written to */
    tables->json = vol_copy_text(json);
    VolStatus status = tables->json ? vol_tf_parse(&bytes, name, &tables->tf, log, err)
                                    : vol_fail_memory(err, strlen(json) + 1);
    if (!status)
        status = vol_tf_compile(&tables->tf, log, &tables->compiled, err);
    if (!status) {
        status = read_tables(image, tables, err);
        if (status)
            vol_fail_within(err, status, "cannot use tables '%s'", name);
    }
    if (status)
        vol_tables_free(tables);
    else
        *out = tables;
    return status;
}

static VolStatus read_tables_file(const VolBytes *bytes, const char *name, const VolLog *log, VolTf *tf,
                                  VolTables **tables, VolError *err)
{
    VolImage image;
    VolStatus status = vol_exr_read(bytes, name, &image, err);
    if (status)
        return status;
    status = vol_tables_from_image(&image, name, log, tables, err);
    vol_image_free(&image);
    if (status)
        return status;
    VolBytes json = {(unsigned char *)(*tables)->json, strlen((*tables)->json)};
    status = vol_tf_parse(&json, name, tf, NULL, err); /* the caller's own copy, to change steps in */
    if (status) {
        vol_tables_free(*tables);
        *tables = NULL;
    }
    return status;
}

VolStatus vol_load_transfer_function(const VolBytes *bytes, const char *name, const char *part, const VolLog *log,
                                     VolTf *tf, VolTfUnits *units, VolTables **tables, VolError *err)
{
    *tables = NULL;
    *units = (VolTfUnits){0};
    if (vol_kind(bytes) == VOL_KIND_EXR)
        return read_tables_file(bytes, name, log, tf, tables, err);
    return vol_tf_read(bytes, name, part, tf, units, log, err);
}
