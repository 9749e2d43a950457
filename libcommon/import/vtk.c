/* VTK's image files (.vti, legacy structured points), through VTK's own readers.  What VTK would read in spite of
 * damage is looked for here first. */
#include <stdlib.h>
#include <string.h>

#include "adapters/vtk.h"
#include "base/plugin.h"
#include "base/refusals.h"
#include "import/readers.h"

static const unsigned char *find_text(const VolBytes *bytes, const char *text, size_t within)
{
    size_t n = strlen(text), end = bytes->size < within ? bytes->size : within;
    for (size_t at = 0; at + n <= end; at++)
        if (memcmp(bytes->data + at, text, n) == 0)
            return bytes->data + at;
    return NULL;
}

bool vol_is_vtk_legacy(const VolBytes *bytes)
{
    return bytes->size > 14 && memcmp(bytes->data, "# vtk DataFile", 14) == 0;
}

bool vol_is_vtk_xml(const VolBytes *bytes) { return find_text(bytes, "<VTKFile", 4096) != NULL; }

/* The word in quotes after type= of the VTKFile element, or the word after DATASET; other kinds are named. */
static VolStatus check_kind(const VolSource *source, bool xml, VolError *err)
{
    const unsigned char *end = source->bytes->data + source->bytes->size;
    const unsigned char *at =
        xml ? find_text(source->bytes, "<VTKFile", 4096) : find_text(source->bytes, "DATASET", 65536);
    if (at && xml) {
        VolBytes rest = {(unsigned char *)(uintptr_t)at, (size_t)(end - at)};
        at = find_text(&rest, "type=", 1024);
    }
    char kind[32] = "";
    if (at) {
        at += xml ? 6 : 7;
        while (at < end && *at == ' ')
            at++;
        for (size_t n = 0; at < end && n + 1 < sizeof kind && *at > ' ' && *at != '"' && *at != '\''; n++)
            kind[n] = (char)*at++;
    }
    if (strcmp(kind, xml ? "ImageData" : "STRUCTURED_POINTS") == 0)
        return VOL_OK;
    if (!*kind)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': truncated: the VTK file does not say what it holds", source->name);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': VTK files of kind '%s' are not read in this version (%s are)",
                    source->name, kind, xml ? "ImageData" : "STRUCTURED_POINTS");
}

VolStatus vol_read_vtk(const VolSource *source, bool xml, VolSampled *out, VolError *err)
{
    *out = (VolSampled){0};
    const void *table;
    VolStatus status = check_kind(source, xml, err);
    if (!status && xml && !find_text(source->bytes, "</VTKFile>", source->bytes->size))
        status =
            vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': truncated after %zu bytes: </VTKFile> is missing",
                     source->name, source->bytes->size);
    if (!status)
        status = vol_plugin("vtk", &table, err);
    if (status)
        return status;

    const VolVtkAdapter *adapter = table;
    VolVtkImage image;
    char why[700] = "";
    int result = adapter->read_image(source->bytes->data, source->bytes->size, xml, source->options->array,
                                     source->options->time_step, &image, why, sizeof why);
    if (result == 2 || (result && vol_memory_is_short(source->bytes->size)))
        return vol_fail_memory(err, source->bytes->size);
    if (result == 3)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': damaged, or truncated after %zu bytes: %s",
                        source->name, source->bytes->size, why);
    if (result)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': %s", source->name, why);

    const uint16_t one = 1;
    out->big_endian = *(const unsigned char *)&one == 0;
    for (int a = 0; a < 3; a++)
        out->dims[a] = image.dims[a];
    memcpy(out->index_to_world.m, image.index_to_world, sizeof image.index_to_world);
    out->components = image.components;
    out->times = image.times;
    vol_sampled_order(out);
    out->time_stride = 0; /* the adapter has read the step that was asked for */
    out->bytes = (VolBytes){image.data, image.size};
    if (!vol_sample_named(image.sample, &out->type))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': samples '%s' are not known", source->name,
                        image.sample);
    int64_t times = out->times;
    out->times = 1;
    status = vol_sampled_check(out, source->name, true, err);
    out->times = times;
    return status;
}
