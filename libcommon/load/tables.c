#include "load/tables.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/dd.h"
#include "base/hash.h"
#include "base/number.h"
#include "load/tables_private.h"
#include "tf/write.h"

/* ---- Layout ---- */

static size_t add_planes(VolPlane *planes, size_t count, const char *name, size_t offset, size_t channels)
{
    static const char *const suffix[3] = {".R", ".G", ".B"};
    for (size_t c = 0; c < channels; c++) {
        snprintf(planes[count].name, sizeof planes[count].name, "%.8s%.2s", name, channels == 3 ? suffix[c] : "");
        planes[count++].offset = offset + c;
    }
    return count;
}

size_t vol_planes_full(int channels, VolPlane planes[VOL_MOST_PLANES])
{
    size_t n = (size_t)channels, count = 0;
    count = add_planes(planes, count, "fw_a", 0, n);
    count = add_planes(planes, count, "bw_a", n, n);
    count = add_planes(planes, count, "p_a", 2 * n, n);
    count = add_planes(planes, count, "fw_c", 3 * n, 3);
    count = add_planes(planes, count, "bw_c", 3 * n + 3, 3);
    return add_planes(planes, count, "p_c", 3 * n + 6, 3);
}

#define AT(type, field) (offsetof(type, field) / sizeof(double))

size_t vol_planes_tf(int channels, VolPlane planes[VOL_MOST_PLANES])
{
    size_t count = add_planes(planes, 0, "mu_s", AT(VolTfSample, surface), 1);
    count = add_planes(planes, count, "c_s", AT(VolTfSample, surface_color), 3);
    count = add_planes(planes, count, "mu_p", AT(VolTfSample, particle), (size_t)channels);
    return add_planes(planes, count, "q_p", AT(VolTfSample, source), 3);
}

size_t vol_planes_integrals(int channels, VolPlane planes[VOL_MOST_PLANES])
{
    size_t count = add_planes(planes, 0, "M_s", AT(VolTfIntegral, surface), 1);
    count = add_planes(planes, count, "C_s", AT(VolTfIntegral, surface_color), 3);
    count = add_planes(planes, count, "M_p", AT(VolTfIntegral, particle), (size_t)channels);
    count = add_planes(planes, count, "C_p", AT(VolTfIntegral, source), 3);
    return add_planes(planes, count, "V", AT(VolTfIntegral, value), 1);
}

void vol_octave_name(size_t octave, char name[32])
{
    if (octave)
        snprintf(name, 32, "full@%" PRIu64, (uint64_t)1 << octave);
    else
        snprintf(name, 32, "full");
}

void vol_json_digest(const char *json, char hex[33])
{
    uint64_t digest[2];
    vol_hash_bytes(json, strlen(json), digest);
    vol_hash_hex(digest, hex);
}

/* ---- Making ---- */

void vol_tables_free(VolTables *tables)
{
    if (!tables)
        return;
    vol_preint_free(&tables->preint);
    vol_tf_compiled_free(&tables->compiled);
    vol_tf_free(&tables->tf);
    free(tables->json);
    free(tables);
}

VolStatus vol_tables_build(const char *json, const char *name, VolPreintOptions options, const VolLog *log,
                           VolTables **out, VolError *err)
{
    VolTables *tables = *out = vol_alloc_zero(1, sizeof *tables);
    if (!tables)
        return vol_fail_memory(err, sizeof *tables);
    VolBytes bytes = {(unsigned char *)(uintptr_t)json, strlen(json)}; /* not written to */
    tables->json = vol_copy_text(json);
    VolStatus status = tables->json ? vol_tf_parse(&bytes, name, &tables->tf, log, err)
                                    : vol_fail_memory(err, strlen(json) + 1);
    if (!status)
        status = vol_tf_compile(&tables->tf, log, &tables->compiled, err);
    if (!status && options.lo == 0 && options.hi == 0)
        vol_preint_default_range(&tables->compiled, &options.lo, &options.hi);
    if (options.step == 0)
        options.step = tables->tf.particle_step;
    if (!status) {
        status = vol_preint_build(&tables->compiled, &options, &tables->preint, err);
        if (status == VOL_BAD_INPUT)
            vol_fail_within(err, status, "a table from %.17g to %.17g", options.lo, options.hi);
    }
    if (status) {
        vol_tables_free(tables);
        *out = NULL;
    }
    return status;
}

/* ---- Writing ---- */

/* Shortest of 15 to 17 digits that reads back. */
static void write_real(double x, char text[32])
{
    for (int digits = 15; digits <= 17; digits++) {
        double back;
        snprintf(text, 32, "%.*g", digits, x);
        if (vol_parse_real(text, &back) && back == x)
            return;
    }
}

static VolStatus set_attributes(const VolTables *tables, VolPart *part, bool first, VolError *err)
{
    char lo[32], hi[32], range[80], digest[33];
    double version = VOL_TABLES_VERSION;
    write_real(tables->preint.lo, lo);
    write_real(tables->preint.hi, hi);
    snprintf(range, sizeof range, "%s,%s", lo, hi);
    vol_json_digest(tables->json, digest);
    VolStatus status = vol_part_set_numbers(part, "vol:tfVersion", VOL_ATTR_INT, &version, err);
    if (!status)
        status = vol_part_set_text(part, "vol:tfRange", range, err);
    if (!status)
        status = vol_part_set_numbers(part, "vol:tfScalarStep", VOL_ATTR_DOUBLE, &tables->tf.scalar_step, err);
    if (!status)
        status = vol_part_set_text(part, "vol:tfHash", digest, err);
    if (!status && first)
        status = vol_part_set_text(part, "vol:transferFunction", tables->json, err);
    return status;
}

static VolStatus add_part(const VolTables *tables, unsigned parts, const char *name, size_t height, VolImage *image,
                          VolPart **out, VolError *err)
{
    int32_t n = (int32_t)tables->preint.n, tall = parts & VOL_TABLES_FULL ? n : 1; /* all parts share one display window */
    VolStatus status = vol_image_add_part(image, name, (VolBox2){0, 0, n - 1, (int32_t)height - 1},
                                          (VolBox2){0, 0, n - 1, tall - 1}, out, err);
    return status ? status : set_attributes(tables, *out, image->part_count == 1, err);
}

static VolStatus add_channels(VolPart *part, const VolPlane *planes, size_t count, const char *suffix, VolError *err)
{
    VolStatus status = VOL_OK;
    for (size_t i = 0; !status && i < count; i++) {
        char name[32];
        VolChannel *channel;
        snprintf(name, sizeof name, "%.15s%.3s", planes[i].name, suffix);
        status = vol_part_add_channel(part, name, VOL_PIXEL_FLOAT, &channel, err);
    }
    return status;
}

/* Where the planes' pixels are, once all channels are there. */
static void find_data(const VolPart *part, const VolPlane *planes, size_t count, const char *suffix, float *data[])
{
    for (size_t p = 0; p < count; p++) {
        char name[32];
        snprintf(name, sizeof name, "%.15s%.3s", planes[p].name, suffix);
        data[p] = vol_part_channel(part, name)->data;
    }
}

static VolStatus check_finite(const VolPart *part, VolError *err)
{
    size_t pixels = vol_box2_width(part->data_window) * vol_box2_height(part->data_window);
    for (size_t c = 0; c < part->channel_count; c++)
        for (size_t i = 0; i < pixels; i++)
            if (!isfinite(part->channels[c].data[i]))
                return vol_fail(err, VOL_BAD_INPUT, "transfer function: %s of part '%s' does not fit a float",
                                part->channels[c].name, part->name);
    return VOL_OK;
}

static VolStatus add_tf(const VolTables *tables, unsigned parts, VolImage *image, VolError *err)
{
    VolPlane planes[VOL_MOST_PLANES];
    float *data[VOL_MOST_PLANES];
    VolPart *part;
    size_t count = vol_planes_tf(tables->preint.channels, planes);
    VolStatus status = add_part(tables, parts, "tf", 1, image, &part, err);
    if (!status)
        status = add_channels(part, planes, count, "", err);
    if (status)
        return status;
    find_data(part, planes, count, "", data);
    for (size_t i = 0; i < tables->preint.n; i++) {
        VolTfSample sample;
        const double *numbers = (const double *)&sample;
        vol_tf_sample(&tables->compiled, vol_preint_node(&tables->preint, i), &sample);
        for (size_t p = 0; p < count; p++)
            data[p][i] = (float)numbers[planes[p].offset];
    }
    return check_finite(part, err);
}

/* From the first node on; the sums are kept in twice double's digits, so that the residuals mean something. */
static void fill_integrals(const VolPreint *preint, const VolPlane *planes, size_t count, float *const *data,
                           float *const *residual)
{
    VolDd sum[VOL_MOST_PLANES] = {{0}};
    for (size_t i = 0; i < preint->n; i++) {
        VolTfIntegral bin = {0};
        const double *numbers = (const double *)&bin;
        if (i)
            vol_tf_integrals_between(&preint->integrals, vol_preint_node(preint, i - 1), vol_preint_node(preint, i), &bin);
        for (size_t p = 0; p < count; p++) {
            sum[p] = vol_dd_add(sum[p], (VolDd){numbers[planes[p].offset], 0});
            data[p][i] = (float)sum[p].hi;
            residual[p][i] = (float)((sum[p].hi - (double)data[p][i]) + sum[p].lo);
        }
    }
}

static VolStatus add_integrals(const VolTables *tables, unsigned parts, VolImage *image, VolError *err)
{
    VolPlane planes[VOL_MOST_PLANES];
    float *data[VOL_MOST_PLANES], *residual[VOL_MOST_PLANES];
    VolPart *part;
    size_t count = vol_planes_integrals(tables->preint.channels, planes);
    VolStatus status = add_part(tables, parts, "integrals", 1, image, &part, err);
    if (!status)
        status = add_channels(part, planes, count, "", err);
    if (!status)
        status = add_channels(part, planes, count, ".lo", err);
    if (status)
        return status;
    find_data(part, planes, count, "", data);
    find_data(part, planes, count, ".lo", residual);
    fill_integrals(&tables->preint, planes, count, data, residual);
    return check_finite(part, err);
}

/* Entries lie by diagonals, pixels by rows, and each plane wants one number of every entry: what few of both hold stays in
 * the cache. */
enum { TILE = 16 };

static void put_tile(const VolPreint *preint, const VolPreintTable *table, size_t i0, size_t j0, const VolPlane *planes,
                     size_t count, float *const *data)
{
    size_t n = preint->n, i1 = i0 + TILE < n ? i0 + TILE : n, j1 = j0 + TILE < n ? j0 + TILE : n;
    for (size_t j = j0; j < j1; j++)
        for (size_t i = i0; i < i1; i++) {
            const float *entry = vol_preint_in_band(table, i, j) ? vol_preint_entry(preint, table, i, j) : NULL;
            for (size_t p = 0; p < count; p++)
                data[p][j * n + i] = entry ? entry[planes[p].offset] : VOL_TABLES_OUT_OF_BAND;
        }
}

static VolStatus add_full(const VolTables *tables, unsigned parts, size_t octave, VolImage *image, VolError *err)
{
    const VolPreint *preint = &tables->preint;
    const VolPreintTable *table = &preint->octaves[octave];
    VolPlane planes[VOL_MOST_PLANES];
    float *data[VOL_MOST_PLANES];
    VolPart *part;
    char name[32];
    size_t n = preint->n, count = vol_planes_full(preint->channels, planes);
    double band = (double)table->band;
    vol_octave_name(octave, name);
    VolStatus status = add_part(tables, parts, name, n, image, &part, err);
    if (!status)
        status = vol_part_set_numbers(part, "vol:tfStep", VOL_ATTR_DOUBLE, &table->step, err);
    if (!status)
        status = vol_part_set_numbers(part, "vol:tfBand", VOL_ATTR_INT, &band, err);
    if (!status)
        status = add_channels(part, planes, count, "", err);
    if (status)
        return status;
    find_data(part, planes, count, "", data);
    for (size_t j = 0; j < n; j += TILE)
        for (size_t i = 0; i < n; i += TILE)
            put_tile(preint, table, i, j, planes, count, data);
    return VOL_OK;
}

VolStatus vol_tables_to_image(const VolTables *tables, unsigned parts, VolImage *image, VolError *err)
{
    VolStatus status = VOL_OK;
    *image = (VolImage){0};
    if (parts & VOL_TABLES_TF)
        status = add_tf(tables, parts, image, err);
    if (!status && parts & VOL_TABLES_INTEGRALS)
        status = add_integrals(tables, parts, image, err);
    for (size_t o = 0; !status && parts & VOL_TABLES_FULL && o < tables->preint.octave_count; o++)
        status = add_full(tables, parts, o, image, err);
    if (status)
        vol_image_free(image);
    return status;
}
