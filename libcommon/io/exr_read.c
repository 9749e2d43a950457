/* EXR bytes -> image.  Three passes over each part, so that no size is believed before the file's bytes bear it out:
 *
 *   1. the header, which the library checks against the file's size;
 *   2. the leader of every chunk: all present, together no larger than the file, and none claiming to unpack to more than
 *      its compression could ever yield;
 *   3. only then memory for the pixels, and the pixels.
 *
 * So a file of n bytes makes us take at most (expansion of its compression) x n bytes, whatever its header claims. */
#define _GNU_SOURCE /* memmem */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"
#include "io/exr_private.h"

typedef struct Reader {
    VolExrStream stream;
    exr_context_t context;
    const char *name; /* of the input, for messages */
    uint64_t packed;  /* bytes of all chunks so far */
    VolError *err;
} Reader;

/* One part while it is read. */
typedef struct PartReader {
    Reader *r;
    int index;
    exr_storage_t storage;
    exr_compression_t compression;
    int32_t step_x, step_y;   /* size of a chunk: of a tile, or the lines of a scan-line block */
    int32_t count_x, count_y; /* chunks */
    VolPart *part;
} PartReader;

enum { DECODER_ROOM = 1 << 20 };

static VolStatus damaged(Reader *r, exr_result_t code, const char *where)
{
    if (vol_exr_out_of_memory() || vol_memory_is_short(DECODER_ROOM))
        return vol_fail(r->err, VOL_NOMEM, "cannot read EXR '%s': out of memory", r->name);
    if (code == EXR_ERR_OUT_OF_MEMORY)
        code = EXR_ERR_CORRUPT_CHUNK;
    return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': %s: %s", r->name, where, vol_exr_why(code));
}

/* ---- Header -------------------------------------------------------------------------------------------------------- */

static bool standard_attr(const char *name)
{
    static const char *const standard[] = {
        "channels", "chunkCount", "compression", "dataWindow", "displayWindow", "lineOrder", "maxSamplesPerPixel", "name",
        "pixelAspectRatio", "screenWindowCenter", "screenWindowWidth", "tiles", "type", "version"};
    for (size_t i = 0; i < sizeof standard / sizeof *standard; i++)
        if (strcmp(name, standard[i]) == 0)
            return true;
    return false;
}

static VolStatus set_floats(VolPart *part, const char *name, VolAttrType type, const float *f, VolError *err)
{
    double numbers[16];
    for (size_t i = 0; i < vol_attr_numbers(type); i++)
        numbers[i] = (double)f[i];
    return vol_part_set_numbers(part, name, type, numbers, err);
}

static VolStatus read_attr(VolPart *part, const exr_attribute_t *a, VolError *err)
{
    double number;
    VolAttr *other;
    switch (a->type) {
    case EXR_ATTR_STRING: return vol_part_set_text(part, a->name, a->string->str ? a->string->str : "", err);
    case EXR_ATTR_INT: number = a->i; return vol_part_set_numbers(part, a->name, VOL_ATTR_INT, &number, err);
    case EXR_ATTR_FLOAT: return set_floats(part, a->name, VOL_ATTR_FLOAT, &a->f, err);
    case EXR_ATTR_DOUBLE: number = a->d; return vol_part_set_numbers(part, a->name, VOL_ATTR_DOUBLE, &number, err);
    case EXR_ATTR_V3F: return set_floats(part, a->name, VOL_ATTR_V3F, a->v3f->arr, err);
    case EXR_ATTR_M44F: return set_floats(part, a->name, VOL_ATTR_M44F, a->m44f->m, err);
    case EXR_ATTR_CHROMATICITIES:
        return set_floats(part, a->name, VOL_ATTR_CHROMATICITIES, &a->chromaticities->red_x, err);
    default: return vol_part_new_attr(part, a->name, VOL_ATTR_OTHER, &other, err);
    }
}

static VolStatus read_attrs(PartReader *p)
{
    Reader *r = p->r;
    int32_t count = 0;
    exr_result_t code = exr_get_attribute_count(r->context, p->index, &count);
    VolStatus status = VOL_OK;
    for (int32_t i = 0; i < count && !code && !status; i++) {
        const exr_attribute_t *attr;
        code = exr_get_attribute_by_index(r->context, p->index, EXR_ATTR_LIST_FILE_ORDER, i, &attr);
        if (!code && !standard_attr(attr->name))
            status = read_attr(p->part, attr, r->err);
    }
    return status ? status : code ? damaged(r, code, "attributes") : VOL_OK;
}

static VolStatus read_channels(PartReader *p)
{
    Reader *r = p->r;
    const exr_attr_chlist_t *list;
    exr_result_t code = exr_get_channels(r->context, p->index, &list);
    if (code)
        return damaged(r, code, "channels");
    if (list->num_channels == 0)
        return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': part %d has no channels", r->name, p->index);
    VolStatus status = VOL_OK;
    for (int i = 0; i < list->num_channels && !status; i++) {
        const exr_attr_chlist_entry_t *entry = &list->entries[i];
        if (entry->x_sampling != 1 || entry->y_sampling != 1)
            return vol_fail(r->err, VOL_BAD_INPUT, "cannot read EXR '%s': channel '%s' of part %d is subsampled (%dx%d)",
                            r->name, entry->name.str, p->index, entry->x_sampling, entry->y_sampling);
        VolChannel *channel;
        if (vol_part_channel(p->part, entry->name.str))
            return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': part %d has two channels '%s'", r->name, p->index,
                            entry->name.str);
        status = vol_part_insert_channel(p->part, entry->name.str,
                                         entry->pixel_type == EXR_PIXEL_HALF   ? VOL_PIXEL_HALF
                                         : entry->pixel_type == EXR_PIXEL_UINT ? VOL_PIXEL_UINT
                                                                               : VOL_PIXEL_FLOAT,
                                         &channel, r->err);
    }
    return status;
}

static VolStatus read_windows(PartReader *p, VolImage *image)
{
    Reader *r = p->r;
    exr_attr_box2i_t data, display;
    exr_attr_v2f_t center;
    float aspect, width;
    const char *name = NULL;
    exr_result_t code = exr_get_data_window(r->context, p->index, &data);
    if (!code) code = exr_get_display_window(r->context, p->index, &display);
    if (!code) code = exr_get_screen_window_center(r->context, p->index, &center);
    if (!code) code = exr_get_screen_window_width(r->context, p->index, &width);
    if (!code) code = exr_get_pixel_aspect_ratio(r->context, p->index, &aspect);
    if (code)
        return damaged(r, code, "header");
    if (exr_get_name(r->context, p->index, &name)) {
        name = NULL; /* a single part need not have one */
        vol_exr_forget_message();
    }
    VolStatus status = vol_image_add_part(image, name, (VolBox2){data.min.x, data.min.y, data.max.x, data.max.y},
                                          (VolBox2){display.min.x, display.min.y, display.max.x, display.max.y},
                                          &p->part, r->err);
    if (status)
        return status;
    p->part->pixel_aspect = (double)aspect;
    p->part->screen_width = (double)width;
    p->part->screen_center[0] = (double)center.x;
    p->part->screen_center[1] = (double)center.y;
    int64_t across = (int64_t)data.max.x - data.min.x + 1, down = (int64_t)data.max.y - data.min.y + 1;
    if (across < 1 || down < 1 || across > INT32_MAX / 8 || down > INT32_MAX)
        return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': part %d has a data window of %lld x %lld", r->name,
                        p->index, (long long)across, (long long)down);
    return VOL_OK;
}

/* The library puts a default in the place of a required attribute that is damaged or missing: an unknown compression would
 * become ZIP, a lost window 64 x 64 pixels.  Of a damaged one it complains, without failing. */
static VolStatus check_layout(Reader *r, int parts)
{
    static const struct {
        const char *name, *bytes; /* name and type, each with its NUL */
        size_t size;
    } needed[] = {{"compression", "compression\0compression", 24}, {"dataWindow", "dataWindow\0box2i", 17},
                  {"displayWindow", "displayWindow\0box2i", 20}};
    char quoted[32];
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++) {
        snprintf(quoted, sizeof quoted, "'%s'", needed[i].name);
        if (strstr(vol_exr_why(EXR_ERR_SUCCESS), quoted))
            return damaged(r, EXR_ERR_INVALID_ATTR, "header");
        const unsigned char *at = r->stream.in, *end = at + r->stream.in_size;
        for (int p = 0; p < parts; p++, at += needed[i].size)
            if (!(at = memmem(at, (size_t)(end - at), needed[i].bytes, needed[i].size)))
                return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': part %d has no attribute %s", r->name, p,
                                needed[i].name);
    }
    vol_exr_forget_message();
    return VOL_OK;
}

static VolStatus read_part_header(PartReader *p, VolImage *image)
{
    Reader *r = p->r;
    exr_result_t code = exr_get_storage(r->context, p->index, &p->storage);
    if (code)
        return damaged(r, code, "header");
    if (p->storage == EXR_STORAGE_DEEP_SCANLINE || p->storage == EXR_STORAGE_DEEP_TILED)
        return vol_fail(r->err, VOL_BAD_INPUT, "cannot read EXR '%s': part %d is deep", r->name, p->index);
    VolStatus status = read_windows(p, image);
    if (!status)
        status = read_channels(p);
    return status ? status : read_attrs(p);
}

/* ---- Chunks -------------------------------------------------------------------------------------------------------- */

/* The most bytes that one packed byte can stand for, generously rounded up.  Deflate: 1032; run lengths: 64; wavelet +
 * Huffman with runs: 255 halves for about 10 bits; block compression: at most 11 times; DCT: 64 values from one deflated. */
static uint64_t largest_expansion(exr_compression_t compression)
{
    switch (compression) {
    case EXR_COMPRESSION_NONE: return 1;
    case EXR_COMPRESSION_RLE: return 128;
    case EXR_COMPRESSION_B44:
    case EXR_COMPRESSION_B44A: return 32;
    case EXR_COMPRESSION_DWAA:
    case EXR_COMPRESSION_DWAB: return 100000;
    default: return 2048;
    }
}

static const char *compression_name(exr_compression_t compression)
{
    static const char *const names[] = {"none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"};
    return (size_t)compression < sizeof names / sizeof *names ? names[compression] : "unknown";
}

static VolStatus prepare_chunks(PartReader *p)
{
    Reader *r = p->r;
    int64_t width = (int64_t)vol_box2_width(p->part->data_window), height = (int64_t)vol_box2_height(p->part->data_window);
    exr_result_t code = exr_get_compression(r->context, p->index, &p->compression);
    p->step_x = (int32_t)width;
    if (!code && p->storage == EXR_STORAGE_SCANLINE)
        code = exr_get_scanlines_per_chunk(r->context, p->index, &p->step_y);
    else if (!code)
        code = exr_get_tile_sizes(r->context, p->index, 0, 0, &p->step_x, &p->step_y);
    if (code || p->step_x < 1 || p->step_y < 1)
        return damaged(r, code ? code : EXR_ERR_INVALID_ATTR, "header");
    p->count_x = (int32_t)((width + p->step_x - 1) / p->step_x);
    p->count_y = (int32_t)((height + p->step_y - 1) / p->step_y);
    if ((int64_t)p->count_x * p->count_y > (int64_t)(r->stream.in_size / 8)) /* 8 bytes each in the table alone */
        return vol_fail(r->err, VOL_BAD_INPUT, "damaged EXR '%s': part %d is %lld x %lld pixels, too many for %zu bytes",
                        r->name, p->index, (long long)width, (long long)height, r->stream.in_size);
    return VOL_OK;
}

static exr_result_t chunk_info(const PartReader *p, int32_t x, int32_t y, exr_chunk_info_t *info)
{
    if (p->storage == EXR_STORAGE_SCANLINE)
        return exr_read_scanline_chunk_info(p->r->context, p->index,
                                            (int)((int64_t)p->part->data_window.y0 + (int64_t)y * p->step_y), info);
    return exr_read_tile_chunk_info(p->r->context, p->index, x, y, 0, 0, info);
}

/* "part 0 ('beauty'), scan line 16 (byte 3400)" */
static VolStatus chunk_damaged(const PartReader *p, int32_t x, int32_t y, const exr_chunk_info_t *info, exr_result_t code)
{
    char part[160] = "", where[320], byte[40] = "";
    if (code == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
        return vol_fail(p->r->err, VOL_BAD_INPUT,
                        "cannot read EXR '%s': part %d is %s-compressed, which this build's OpenEXRCore cannot decode",
                        p->r->name, p->index, compression_name(p->compression));
    if (p->part->name)
        snprintf(part, sizeof part, " ('%.128s')", p->part->name);
    if (info && info->data_offset)
        snprintf(byte, sizeof byte, " (byte %llu)", (unsigned long long)info->data_offset);
    if (p->storage == EXR_STORAGE_SCANLINE)
        snprintf(where, sizeof where, "part %d%s, scan line %lld%s", p->index, part,
                 (long long)p->part->data_window.y0 + (long long)y * p->step_y, byte);
    else
        snprintf(where, sizeof where, "part %d%s, tile %d,%d%s", p->index, part, x, y, byte);
    return damaged(p->r, code, where);
}

static VolStatus check_chunk(PartReader *p, int32_t x, int32_t y)
{
    Reader *r = p->r;
    exr_chunk_info_t info = {0};
    vol_exr_forget_message();
    exr_result_t code = chunk_info(p, x, y, &info);
    if (code)
        return chunk_damaged(p, x, y, &info, code);
    bool raw = info.packed_size == info.unpacked_size;
    if (info.packed_size > info.unpacked_size || (p->compression == EXR_COMPRESSION_NONE && !raw) ||
        info.packed_size > r->stream.in_size || info.data_offset > r->stream.in_size - info.packed_size ||
        info.unpacked_size / largest_expansion(p->compression) > info.packed_size)
        return chunk_damaged(p, x, y, &info, EXR_ERR_CORRUPT_CHUNK);
    r->packed += info.packed_size;
    if (r->packed > r->stream.in_size) /* chunks that overlap */
        return chunk_damaged(p, x, y, &info, EXR_ERR_CORRUPT_CHUNK);
    return VOL_OK;
}

static VolStatus check_chunks(PartReader *p)
{
    VolStatus status = prepare_chunks(p);
    for (int32_t y = 0; y < p->count_y && !status; y++)
        for (int32_t x = 0; x < p->count_x && !status; x++)
            status = check_chunk(p, x, y);
    return status;
}

/* ---- Pixels -------------------------------------------------------------------------------------------------------- */

static VolStatus allocate_pixels(VolPart *part, VolError *err)
{
    size_t pixels = vol_box2_width(part->data_window) * vol_box2_height(part->data_window);
    for (size_t i = 0; i < part->channel_count; i++) {
        part->channels[i].data = vol_alloc_zero(pixels, sizeof(float));
        if (!part->channels[i].data)
            return vol_fail_memory(err, pixels * sizeof(float));
        if (part->channels[i].store != VOL_PIXEL_UINT)
            continue;
        part->channels[i].whole = vol_alloc_zero(pixels, sizeof(float));
        if (!part->channels[i].whole)
            return vol_fail_memory(err, pixels * sizeof(uint32_t));
    }
    return VOL_OK;
}

static void fill_from_whole(const VolPart *part)
{
    size_t pixels = vol_box2_width(part->data_window) * vol_box2_height(part->data_window);
    for (size_t c = 0; c < part->channel_count; c++)
        for (size_t i = 0; i < pixels && part->channels[c].whole; i++)
            part->channels[c].data[i] = (float)part->channels[c].whole[i];
}

/* Tells the decoder where the pixels of this chunk go. */
static void place_chunk(const PartReader *p, int32_t x, int32_t y, exr_decode_pipeline_t *decode)
{
    size_t width = vol_box2_width(p->part->data_window);
    size_t first = (size_t)y * (size_t)p->step_y * width + (size_t)x * (size_t)p->step_x;
    for (int i = 0; i < decode->channel_count; i++) {
        exr_coding_channel_info_t *info = &decode->channels[i];
        const VolChannel *channel = vol_part_channel(p->part, info->channel_name);
        info->user_data_type = channel->whole ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        info->user_bytes_per_element = 4;
        info->user_pixel_stride = 4;
        info->user_line_stride = (int32_t)(width * 4);
        info->decode_to_ptr = channel->whole ? (uint8_t *)(channel->whole + first) : (uint8_t *)(channel->data + first);
    }
}

/* What one part is decoded with. */
typedef struct Decoder {
    exr_decode_pipeline_t pipeline;
    exr_result_t (*decompress)(exr_decode_pipeline_t *pipeline); /* the library's */
    bool ready;
} Decoder;

/* A chunk as large as its bare pixels is just them, whatever the compression: writers store it so where packing gains
 * nothing.  OpenEXRCore 3.1 takes such a chunk for packed if the compression is B44, and makes other pixels of it.  The
 * pipeline has already let the unpacked pixels be the packed ones. */
static exr_result_t decompress_or_take(exr_decode_pipeline_t *pipeline)
{
    const Decoder *decoder = pipeline->decoding_user_data;
    return pipeline->chunk.packed_size == pipeline->chunk.unpacked_size ? EXR_ERR_SUCCESS : decoder->decompress(pipeline);
}

static exr_result_t choose_routines(const PartReader *p, Decoder *decoder)
{
    exr_decode_pipeline_t *pipeline = &decoder->pipeline;
    exr_result_t code = exr_decoding_choose_default_routines(p->r->context, p->index, pipeline);
    if (!code && pipeline->decompress_fn) {
        decoder->decompress = pipeline->decompress_fn;
        pipeline->decompress_fn = decompress_or_take;
        pipeline->decoding_user_data = decoder;
    }
    decoder->ready = true;
    return code;
}

static VolStatus read_chunk(const PartReader *p, int32_t x, int32_t y, Decoder *decoder)
{
    exr_chunk_info_t info = {0};
    exr_context_t context = p->r->context;
    exr_decode_pipeline_t *decode = &decoder->pipeline;
    vol_exr_forget_message();
    exr_result_t code = chunk_info(p, x, y, &info);
    if (!code)
        code = decoder->ready ? exr_decoding_update(context, p->index, &info, decode)
                              : exr_decoding_initialize(context, p->index, &info, decode);
    if (!code) {
        place_chunk(p, x, y, decode);
        if (!decoder->ready)
            code = choose_routines(p, decoder);
    }
    if (!code)
        code = exr_decoding_run(context, p->index, decode);
    if (code == EXR_ERR_CORRUPT_CHUNK) /* damaged, or zlib was refused memory: once more */
        code = exr_decoding_run(context, p->index, decode);
    return code ? chunk_damaged(p, x, y, &info, code) : VOL_OK;
}

static VolStatus read_pixels(const PartReader *p)
{
    VolStatus status = allocate_pixels(p->part, p->r->err);
    Decoder decoder = {.pipeline = EXR_DECODE_PIPELINE_INITIALIZER};
    for (int32_t y = 0; y < p->count_y && !status; y++)
        for (int32_t x = 0; x < p->count_x && !status; x++)
            status = read_chunk(p, x, y, &decoder);
    exr_decoding_destroy(p->r->context, &decoder.pipeline);
    if (!status)
        fill_from_whole(p->part);
    return status;
}

static VolStatus read_part(Reader *r, int index, bool pixels, VolImage *out)
{
    PartReader p = {.r = r, .index = index};
    VolStatus status = read_part_header(&p, out);
    if (!status && pixels)
        status = check_chunks(&p);
    if (!status && pixels)
        status = read_pixels(&p);
    return status;
}

static VolStatus read_image(const VolBytes *bytes, const char *name, bool pixels, VolImage *out, VolError *err)
{
    *out = (VolImage){0};
    static const unsigned char magic[4] = {0x76, 0x2f, 0x31, 0x01};
    if (bytes->size < 8 || memcmp(bytes->data, magic, 4) != 0)
        return vol_fail(err, VOL_BAD_INPUT, bytes->size >= 4 && memcmp(bytes->data, magic, 4) == 0
                                                ? "damaged EXR '%s': ends at byte %zu"
                                                : "not an EXR image '%s' (%zu bytes)", name, bytes->size);
    Reader r = {.stream = {.in = bytes->data, .in_size = bytes->size}, .name = name, .err = err};
    exr_context_initializer_t init = vol_exr_initializer(&r.stream);
    exr_result_t code = exr_start_read(&r.context, "memory", &init);
    int count = 0;
    if (!code)
        code = exr_get_count(r.context, &count);
    VolStatus status = code ? damaged(&r, code, "header") : check_layout(&r, count);
    for (int p = 0; p < count && !status; p++)
        status = read_part(&r, p, pixels, out);
    if (r.context)
        exr_finish(&r.context);
    if (!status && vol_exr_out_of_memory()) /* it leaves out what it has no memory for */
        status = vol_fail(err, VOL_NOMEM, "cannot read EXR '%s': out of memory", name);
    if (status)
        vol_image_free(out);
    return status;
}

VolStatus vol_exr_read(const VolBytes *bytes, const char *name, VolImage *out, VolError *err)
{
    return read_image(bytes, name, true, out, err);
}

VolStatus vol_exr_read_header(const VolBytes *bytes, const char *name, VolImage *out, VolError *err)
{
    return read_image(bytes, name, false, out, err);
}
