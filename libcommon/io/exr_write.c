/* Image -> EXR bytes.  Scan lines in ascending order, one chunk of lines after another, so the bytes depend on the image
 * and the compression library alone: nothing is written that the caller did not ask for.  Chunks are packed over threads;
 * one that is ready before its turn is kept until then. */
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/pool.h"
#include "io/exr_private.h"

typedef struct Chunk {
    int part;
    int32_t y;      /* its first line */
    VolBytes early; /* packed before its turn */
} Chunk;

typedef struct Writer {
    VolExrStream stream;
    exr_context_t context;
    const VolImage *image;
    VolExrCompression compression;
    Chunk *chunks; /* of all parts, as the file has them */
    size_t count;
    struct Encoder *encoders; /* one per thread */
    size_t threads;
    pthread_mutex_t lock; /* guards the chunks, what has been written of them, and: */
    size_t next;          /* the one whose turn it is */
    uint64_t clamped;
    VolError *err;
} Writer;

#define HALF_MAX 65504.0F

static VolStatus writer_fail(Writer *w, exr_result_t code, const char *what)
{
    if (code == EXR_ERR_OUT_OF_MEMORY || vol_exr_out_of_memory())
        return vol_fail(w->err, VOL_NOMEM, "cannot write EXR: out of memory");
    return vol_fail(w->err, VOL_BAD_INPUT, "cannot write EXR %s: %s", what, vol_exr_why(code));
}

/* ---- Header -------------------------------------------------------------------------------------------------------- */

static exr_result_t write_attr(exr_context_t context, int part, const VolAttr *attr)
{
    const double *n = attr->number;
    switch (attr->type) {
    case VOL_ATTR_TEXT: return exr_attr_set_string(context, part, attr->name, attr->text);
    case VOL_ATTR_INT: return exr_attr_set_int(context, part, attr->name, (int32_t)n[0]);
    case VOL_ATTR_FLOAT: return exr_attr_set_float(context, part, attr->name, (float)n[0]);
    case VOL_ATTR_DOUBLE: return exr_attr_set_double(context, part, attr->name, n[0]);
    case VOL_ATTR_V3F: {
        exr_attr_v3f_t v = {.arr = {(float)n[0], (float)n[1], (float)n[2]}};
        return exr_attr_set_v3f(context, part, attr->name, &v);
    }
    case VOL_ATTR_M44F: {
        exr_attr_m44f_t m;
        for (int i = 0; i < 16; i++)
            m.m[i] = (float)n[i];
        return exr_attr_set_m44f(context, part, attr->name, &m);
    }
    case VOL_ATTR_CHROMATICITIES: {
        exr_attr_chromaticities_t c = {(float)n[0], (float)n[1], (float)n[2], (float)n[3],
                                       (float)n[4], (float)n[5], (float)n[6], (float)n[7]};
        return exr_attr_set_chromaticities(context, part, attr->name, &c);
    }
    case VOL_ATTR_OTHER: break; /* known by name only: nothing to write */
    }
    return EXR_ERR_SUCCESS;
}

static exr_pixel_type_t file_type(VolPixel store)
{
    return store == VOL_PIXEL_HALF ? EXR_PIXEL_HALF : store == VOL_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
}

static exr_compression_t file_compression(VolExrCompression compression)
{
    switch (compression) {
    case VOL_EXR_NONE: return EXR_COMPRESSION_NONE;
    case VOL_EXR_ZIPS: return EXR_COMPRESSION_ZIPS;
    case VOL_EXR_ZIP: return EXR_COMPRESSION_ZIP;
    case VOL_EXR_PIZ: return EXR_COMPRESSION_PIZ;
    }
    return EXR_COMPRESSION_ZIP;
}

static exr_attr_box2i_t file_box(VolBox2 b)
{
    return (exr_attr_box2i_t){.min = {.x = b.x0, .y = b.y0}, .max = {.x = b.x1, .y = b.y1}};
}

/* The required attributes, the channels, then the caller's attributes in their order. */
static VolStatus describe_part(Writer *w, const VolPart *part, VolExrCompression compression)
{
    int index;
    exr_context_t c = w->context;
    exr_attr_box2i_t display = file_box(part->display_window), data = file_box(part->data_window);
    exr_attr_v2f_t center = {.x = (float)part->screen_center[0], .y = (float)part->screen_center[1]};
    exr_result_t code = exr_add_part(c, part->name, EXR_STORAGE_SCANLINE, &index);
    if (!code)
        code = exr_initialize_required_attr(c, index, &display, &data, (float)part->pixel_aspect, &center,
                                            (float)part->screen_width, EXR_LINEORDER_INCREASING_Y,
                                            file_compression(compression));
    for (size_t i = 0; i < part->channel_count && !code; i++)
        code = exr_add_channel(c, index, part->channels[i].name, file_type(part->channels[i].store),
                               EXR_PERCEPTUALLY_LINEAR, 1, 1);
    for (size_t i = 0; i < part->attr_count && !code; i++)
        code = write_attr(c, index, &part->attrs[i]);
    return code ? writer_fail(w, code, "header") : VOL_OK;
}

static bool needs_long_names(const VolImage *image)
{
    for (size_t p = 0; p < image->part_count; p++) {
        const VolPart *part = &image->parts[p];
        for (size_t i = 0; i < part->channel_count; i++)
            if (strlen(part->channels[i].name) > 31)
                return true;
        for (size_t i = 0; i < part->attr_count; i++)
            if (strlen(part->attrs[i].name) > 31)
                return true;
    }
    return false;
}

static VolStatus check_part(const VolImage *image, size_t p, VolError *err)
{
    const VolPart *part = &image->parts[p];
    VolBox2 b = part->data_window;
    if (part->channel_count == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR: part %zu has no channels", p);
    if (image->part_count > 1 && !part->name)
        return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR: part %zu of %zu has no name", p, image->part_count);
    if (b.x1 < b.x0 || b.y1 < b.y0 || vol_box2_width(b) > INT32_MAX / 8)
        return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR: part %zu has no valid data window", p);
    for (size_t i = 0; i < part->channel_count; i++)
        if (!part->channels[i].data)
            return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR: channel '%s' has no pixels", part->channels[i].name);
    return VOL_OK;
}

/* For half of the bytes that the pixels take, which is enough for most pictures; what is not used takes no memory. */
static VolStatus reserve_output(Writer *w)
{
    size_t bytes = 0;
    for (size_t p = 0; p < w->image->part_count; p++) {
        const VolPart *part = &w->image->parts[p];
        bytes += vol_box2_width(part->data_window) * vol_box2_height(part->data_window) * part->channel_count * 2;
    }
    return vol_exr_reserve(&w->stream, bytes) ? VOL_OK : vol_fail_memory(w->err, bytes);
}

static VolStatus write_header(Writer *w)
{
    if (needs_long_names(w->image))
        exr_set_longname_support(w->context, 1);
    VolStatus status = VOL_OK;
    for (size_t p = 0; p < w->image->part_count && !status; p++) {
        status = check_part(w->image, p, w->err);
        if (!status)
            status = describe_part(w, &w->image->parts[p], w->compression);
    }
    if (!status)
        status = reserve_output(w);
    if (status)
        return status;
    exr_result_t code = exr_write_header(w->context);
    return code ? writer_fail(w, code, "header") : VOL_OK;
}

/* ---- Pixels -------------------------------------------------------------------------------------------------------- */

/* The file's half has no place for values beyond 65504: they would become infinite. */
static void clamp_lines(const float *from, float *to, size_t n, uint64_t *clamped)
{
    for (size_t i = 0; i < n; i++) {
        float v = from[i];
        if (fabsf(v) > HALF_MAX) {
            v = v < 0 ? -HALF_MAX : HALF_MAX;
            ++*clamped;
        }
        to[i] = v;
    }
}

static void whole_lines(const float *from, uint32_t *to, size_t n)
{
    for (size_t i = 0; i < n; i++)
        to[i] = !(from[i] > 0) ? 0 : from[i] >= 4294967296.0F ? UINT32_MAX : (uint32_t)from[i];
}

/* What one thread encodes with. */
typedef struct Encoder {
    exr_encode_pipeline_t pipeline;
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); /* the library's */
    Writer *w;
    size_t chunk;   /* the one at hand */
    bool started;
    float *scratch; /* one chunk of every channel */
    VolExrZip zip;
    uint64_t clamped;
} Encoder;

/* Points the encoder at the lines of one chunk. */
static void feed_chunk(Encoder *encoder, const VolPart *part)
{
    exr_encode_pipeline_t *pipeline = &encoder->pipeline;
    size_t width = vol_box2_width(part->data_window);
    size_t n = width * (size_t)pipeline->chunk.height;
    size_t first = width * (size_t)(pipeline->chunk.start_y - part->data_window.y0);
    for (int i = 0; i < pipeline->channel_count; i++) {
        exr_coding_channel_info_t *info = &pipeline->channels[i];
        const VolChannel *channel = vol_part_channel(part, info->channel_name);
        const void *lines = channel->data + first;
        float *mine = encoder->scratch + (size_t)i * n;
        if (channel->store == VOL_PIXEL_HALF) {
            clamp_lines(channel->data + first, mine, n, &encoder->clamped);
            lines = mine;
        } else if (channel->whole) {
            lines = channel->whole + first;
        } else if (channel->store == VOL_PIXEL_UINT) {
            whole_lines(channel->data + first, (uint32_t *)(void *)mine, n);
            lines = mine;
        }
        info->user_data_type = channel->store == VOL_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        info->user_bytes_per_element = 4;
        info->user_pixel_stride = 4;
        info->user_line_stride = (int32_t)(width * 4);
        info->encode_from_ptr = lines;
    }
}

/* A chunk that compression does not shrink has to be stored as it is: readers take one whose size equals that of the bare
 * pixels for uncompressed.  OpenEXRCore 3.1 stores the compressed bytes where both are of equal size. */
static exr_result_t compress_or_store(exr_encode_pipeline_t *pipeline)
{
    const Encoder *encoder = pipeline->encoding_user_data;
    exr_result_t code = encoder->compress(pipeline);
    if (code) /* any pixels can be compressed: it has not got the memory */
        return EXR_ERR_OUT_OF_MEMORY;
    if (pipeline->compressed_bytes >= pipeline->packed_bytes) {
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
        pipeline->compressed_bytes = pipeline->packed_bytes;
    }
    return EXR_ERR_SUCCESS;
}

/* The same by libdeflate.  The library releases none of these buffers as the compressed one: they have no size of theirs. */
static exr_result_t zip_or_store(exr_encode_pipeline_t *pipeline)
{
    Encoder *encoder = pipeline->encoding_user_data;
    size_t size = vol_exr_zip(&encoder->zip, pipeline->packed_buffer, pipeline->packed_bytes);
    pipeline->compressed_buffer = size ? encoder->zip.packed : pipeline->packed_buffer;
    pipeline->compressed_bytes = size ? size : pipeline->packed_bytes;
    pipeline->compressed_alloc_size = 0;
    return EXR_ERR_SUCCESS;
}

static exr_result_t write_early(Writer *w)
{
    exr_result_t code = EXR_ERR_SUCCESS;
    while (!code && w->next < w->count && w->chunks[w->next].early.data) {
        Chunk *chunk = &w->chunks[w->next++];
        code = exr_write_scanline_chunk(w->context, chunk->part, chunk->y, chunk->early.data, chunk->early.size);
        vol_bytes_free(&chunk->early);
    }
    return code;
}

/* Writes the chunk, and those that have waited for it, or lets it wait. */
static exr_result_t write_in_turn(exr_encode_pipeline_t *pipeline)
{
    const Encoder *encoder = pipeline->encoding_user_data;
    Writer *w = encoder->w;
    Chunk *chunk = &w->chunks[encoder->chunk];
    exr_result_t code = EXR_ERR_SUCCESS;
    pthread_mutex_lock(&w->lock);
    if (encoder->chunk == w->next) {
        w->next++;
        code = exr_write_scanline_chunk(w->context, chunk->part, chunk->y, pipeline->compressed_buffer,
                                        pipeline->compressed_bytes);
        if (!code)
            code = write_early(w);
    } else {
        unsigned char *copy = vol_alloc(pipeline->compressed_bytes, 1);
        if (copy)
            memcpy(copy, pipeline->compressed_buffer, pipeline->compressed_bytes);
        else
            code = EXR_ERR_OUT_OF_MEMORY;
        chunk->early = (VolBytes){copy, pipeline->compressed_bytes};
    }
    pthread_mutex_unlock(&w->lock);
    return code;
}

/* A pipeline serves one part. */
static exr_result_t start_pipeline(Encoder *encoder, int part, const exr_chunk_info_t *info)
{
    exr_encode_pipeline_t *pipeline = &encoder->pipeline;
    exr_context_t context = encoder->w->context;
    if (encoder->started && pipeline->part_index == part)
        return exr_encoding_update(context, part, info, pipeline);
    if (encoder->started)
        exr_encoding_destroy(context, pipeline);
    exr_result_t code = exr_encoding_initialize(context, part, info, pipeline);
    encoder->started = !code;
    return code;
}

static exr_result_t choose_routines(Encoder *encoder, int part)
{
    exr_encode_pipeline_t *pipeline = &encoder->pipeline;
    VolExrCompression compression = encoder->w->compression;
    exr_result_t code = exr_encoding_choose_default_routines(encoder->w->context, part, pipeline);
    encoder->compress = pipeline->compress_fn;
    if (pipeline->compress_fn)
        pipeline->compress_fn = compression == VOL_EXR_ZIP || compression == VOL_EXR_ZIPS ? zip_or_store : compress_or_store;
    pipeline->encoding_user_data = encoder;
    pipeline->yield_until_ready_fn = NULL;
    pipeline->write_fn = write_in_turn;
    return code;
}

static exr_result_t encode_chunk(Encoder *encoder)
{
    Writer *w = encoder->w;
    const Chunk *chunk = &w->chunks[encoder->chunk];
    exr_chunk_info_t info;
    exr_result_t code = exr_write_scanline_chunk_info(w->context, chunk->part, chunk->y, &info);
    if (!code)
        code = start_pipeline(encoder, chunk->part, &info);
    if (code)
        return code;
    feed_chunk(encoder, &w->image->parts[chunk->part]);
    if (!encoder->pipeline.write_fn)
        code = choose_routines(encoder, chunk->part);
    return code ? code : exr_encoding_run(w->context, chunk->part, &encoder->pipeline);
}

static VolStatus write_chunk(void *user, size_t index, int thread, VolError *err)
{
    Writer *w = user;
    Encoder *encoder = &w->encoders[thread];
    encoder->chunk = index;
    exr_result_t code = encode_chunk(encoder);
    if (!code)
        return VOL_OK;
    if (code == EXR_ERR_OUT_OF_MEMORY || vol_exr_out_of_memory())
        return vol_fail(err, VOL_NOMEM, "cannot write EXR: out of memory");
    return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR pixels: %s", vol_exr_why(code));
}

/* ---- Beginning and end --------------------------------------------------------------------------------------------- */

/* Lists the chunks of part `p`; *room becomes the number of values in the largest chunk. */
static VolStatus add_chunks(Writer *w, size_t p, size_t *room)
{
    const VolPart *part = &w->image->parts[p];
    int32_t lines = 0;
    exr_result_t code = exr_get_scanlines_per_chunk(w->context, (int)p, &lines);
    if (code)
        return writer_fail(w, code, "pixels");
    size_t values, height = vol_box2_height(part->data_window), count = (height + (size_t)lines - 1) / (size_t)lines;
    if (__builtin_mul_overflow(vol_box2_width(part->data_window) * (size_t)lines, part->channel_count, &values))
        values = SIZE_MAX; /* what is asked for this many will be refused */
    Chunk *chunks = vol_resize(w->chunks, w->count + count, sizeof *chunks);
    if (!chunks)
        return vol_fail_memory(w->err, (w->count + count) * sizeof *chunks);
    w->chunks = chunks;
    for (size_t n = 0; n < count; n++)
        chunks[w->count++] = (Chunk){(int)p, (int32_t)(part->data_window.y0 + (int64_t)n * lines), {0}};
    *room = values > *room ? values : *room;
    return VOL_OK;
}

static VolStatus make_encoders(Writer *w, size_t room)
{
    static const exr_encode_pipeline_t none = EXR_ENCODE_PIPELINE_INITIALIZER;
    VolStatus status = VOL_OK;
    w->threads = w->threads < w->count ? w->threads : w->count;
    w->encoders = vol_alloc_zero(w->threads, sizeof *w->encoders);
    if (!w->encoders)
        return vol_fail_memory(w->err, w->threads * sizeof *w->encoders);
    for (size_t t = 0; t < w->threads && !status; t++) {
        Encoder *encoder = &w->encoders[t];
        encoder->pipeline = none;
        encoder->w = w;
        encoder->scratch = vol_alloc(room, sizeof *encoder->scratch);
        status = encoder->scratch ? vol_exr_zip_new(room, &encoder->zip, w->err)
                                  : vol_fail_memory(w->err, room * sizeof *encoder->scratch);
    }
    return status;
}

static VolStatus prepare_chunks(Writer *w)
{
    size_t room = 0;
    VolStatus status = VOL_OK;
    for (size_t p = 0; p < w->image->part_count && !status; p++)
        status = add_chunks(w, p, &room);
    return status ? status : make_encoders(w, room);
}

static void free_chunks(Writer *w)
{
    for (size_t t = 0; w->encoders && t < w->threads; t++) {
        Encoder *encoder = &w->encoders[t];
        if (encoder->started)
            exr_encoding_destroy(w->context, &encoder->pipeline);
        w->clamped += encoder->clamped;
        free(encoder->scratch);
        vol_exr_zip_free(&encoder->zip);
    }
    for (size_t n = 0; n < w->count; n++)
        vol_bytes_free(&w->chunks[n].early);
    free(w->encoders);
    free(w->chunks);
}

VolStatus vol_exr_write(const VolImage *image, VolExrCompression compression, int threads, VolBytes *out,
                        uint64_t *clamped, VolError *err)
{
    *out = (VolBytes){0};
    if (image->part_count == 0)
        return vol_fail(err, VOL_BAD_INPUT, "cannot write EXR: no parts");
    Writer w = {.image = image, .compression = compression, .threads = threads < 1 ? 1 : (size_t)threads,
                .lock = PTHREAD_MUTEX_INITIALIZER, .err = err};
    exr_context_initializer_t init = vol_exr_initializer(&w.stream);
    exr_result_t code = exr_start_write(&w.context, "memory", EXR_WRITE_FILE_DIRECTLY, &init);
    if (code)
        return writer_fail(&w, code, "header");
    VolStatus status = write_header(&w);
    if (!status)
        status = prepare_chunks(&w);
    if (!status)
        status = vol_parallel((int)w.threads, w.count, write_chunk, &w, err);
    free_chunks(&w);
    code = exr_finish(&w.context); /* writes the chunk tables */
    if (code && !status)
        status = writer_fail(&w, code, "chunk table");
    pthread_mutex_destroy(&w.lock);
    if (status) {
        vol_bytes_free(&w.stream.out);
        return status;
    }
    *out = w.stream.out;
    if (clamped)
        *clamped += w.clamped;
    return VOL_OK;
}
