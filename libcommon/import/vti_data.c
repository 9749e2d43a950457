/* The samples of one array of a .vti: text, base64 or raw bytes, the latter two also in packed blocks. */
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "adapters/vtk.h"
#include "base/plugin.h"
#include "base/refusals.h"
#include "import/vti.h"

/* Characters of the file that are bytes as they are, or in base64. */
typedef struct Stream {
    const unsigned char *data;
    size_t size;
    bool base64;
} Stream;

/* Packed blocks, all of one size but the last. */
typedef struct Blocks {
    Stream header, data;
    uint64_t count, size, last; /* unpacked; `last` 0: of that size too */
} Blocks;

typedef struct Job {
    const Vti *vti;
    const VtiArray *array;
    VolSample type;
    uint64_t count;
    VolError *err;
} Job;

const char *vol_vti_array_name(const Vti *vti, const VtiArray *array, char *text, size_t size)
{
    const int64_t *e = vti->pieces[array->piece].extent;
    int n = snprintf(text, size, "array '%.80s' (%s)", array->name, array->cells ? "cells" : "points");
    if (n > 0 && (size_t)n < size)
        snprintf(text + n, size - (size_t)n,
                 " of piece %zu (extent %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 " %" PRId64 ")",
                 array->piece + 1, e[0], e[1], e[2], e[3], e[4], e[5]);
    return text;
}

bool vol_vti_bits(const VtiArray *array) { return strcmp(array->type, "Bit") == 0; }

/* The bytes of `count` values, and the values of so many bytes, as the file has them. */
static uint64_t bytes_of(const Job *job, uint64_t count)
{
    return vol_vti_bits(job->array) ? count / 8 + (count % 8 != 0) : count * vol_sample_size(job->type);
}
static uint64_t values_of(const Job *job, uint64_t bytes)
{
    return vol_vti_bits(job->array) ? 8 * bytes : bytes / vol_sample_size(job->type);
}

static VolStatus refuse(const Job *job, const char *what)
{
    char name[300];
    return vol_fail(job->err, VOL_BAD_INPUT, "cannot import '%s': %s: %s", job->vti->file,
                    vol_vti_array_name(job->vti, job->array, name, sizeof name), what);
}

static VolStatus refuse_short(const Job *job, uint64_t have)
{
    char what[120];
    snprintf(what, sizeof what, "truncated: it holds %" PRIu64 " of its %" PRIu64 " values", have, job->count);
    return refuse(job, what);
}

/* ---- Streams ---- */

static int base64_digit(unsigned char c)
{
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/* Three bytes, or fewer before padding, from four characters. */
static size_t decode_four(const unsigned char *in, unsigned char out[3])
{
    int d[4];
    size_t n = in[2] == '=' ? 1 : in[3] == '=' ? 2 : 3;
    for (size_t i = 0; i < 4; i++) {
        d[i] = i <= n ? base64_digit(in[i]) : 0;
        if (d[i] < 0)
            return 0;
    }
    unsigned bits = (unsigned)(d[0] << 18 | d[1] << 12 | d[2] << 6 | d[3]);
    for (size_t i = 0; i < 3; i++)
        out[i] = (unsigned char)(bits >> (16 - 8 * i));
    return n;
}

/* How many bytes there are at most. */
static size_t room(const Stream *s) { return s->base64 ? s->size / 4 * 3 : s->size; }

/* The bytes from `at` on; false: they are not all there, or no base64. */
static bool get(const Stream *s, size_t at, size_t n, unsigned char *out)
{
    if (at > room(s) || n > room(s) - at)
        return false;
    if (!s->base64) {
        memcpy(out, s->data + at, n);
        return true;
    }
    const unsigned char *in = s->data + at / 3 * 4;
    for (size_t skip = at % 3, done = 0; done < n; in += 4, skip = 0) {
        unsigned char three[3];
        size_t have = decode_four(in, three), want = n - done < 3 - skip ? n - done : 3 - skip;
        if (have < skip + want)
            return false;
        memcpy(out + done, three + skip, want);
        done += want;
    }
    return true;
}

/* What follows `n` bytes that were encoded for themselves. */
static Stream after(const Stream *s, size_t n)
{
    size_t characters = s->base64 ? (n + 2) / 3 * 4 : n;
    return (Stream){s->data + characters, s->size - characters, s->base64};
}

static bool get_word(const Job *job, const Stream *s, uint64_t index, uint64_t *out)
{
    unsigned char bytes[8];
    size_t word = job->vti->word;
    if (index > room(s) / word || !get(s, (size_t)index * word, word, bytes))
        return false;
    bool big = job->vti->big_endian;
    *out = word == 8 ? vol_get_u64(bytes, big) : vol_get_u32(bytes, big);
    return true;
}

/* Where the samples begin.  Text in an element ends with it. */
static VolStatus open_stream(const Job *job, Stream *out)
{
    const Vti *vti = job->vti;
    const VolBytes *bytes = vti->bytes;
    const VtiArray *array = job->array;
    if (array->appended) {
        if (!vti->has_appended)
            return refuse(job, "its data are said to be appended, but there is no AppendedData");
        if (array->offset < 0 || (uint64_t)array->offset > bytes->size - vti->appended)
            return refuse(job, "truncated: its offset lies beyond the end of the file");
        size_t begin = vti->appended + (size_t)array->offset;
        *out = (Stream){bytes->data + begin, bytes->size - begin, !vti->appended_raw};
        return VOL_OK;
    }
    const unsigned char *begin = bytes->data + array->begin;
    const unsigned char *end = memchr(begin, '<', bytes->size - array->begin);
    while (end && begin < end && vol_vtk_space(*begin))
        begin++;
    *out = (Stream){begin, end ? (size_t)(end - begin) : 0, true};
    return VOL_OK;
}

static bool is_text(const VtiArray *array) { return !array->appended && !array->binary; }

/* ---- Packed blocks ---- */

static uint64_t block_size(const Blocks *blocks, uint64_t index)
{
    return index + 1 == blocks->count && blocks->last ? blocks->last : blocks->size;
}

/* More than any data can shrink, so that a forged size takes no memory: deflate's longest match of 258 bytes takes
 * 2 bits, LZ4 counts 255 a byte, LZMA comes to about 7000. */
static uint64_t most_unpacked(VtiPacking packing, uint64_t packed)
{
    uint64_t factor = packing == VTI_LZMA ? 8192 : packing == VTI_LZ4 ? 256 : 1040;
    return packed > UINT64_MAX / factor - 64 ? UINT64_MAX : factor * (packed + 64);
}

/* Reads the table of sizes and checks that everything up to `wanted` bytes can be there. */
static VolStatus open_blocks(const Job *job, uint64_t wanted, Blocks *out)
{
    Stream stream;
    uint64_t table, total = 0, packed = 0, at;
    VolStatus status = open_stream(job, &stream);
    if (status)
        return status;
    *out = (Blocks){.header = stream};
    if (!get_word(job, &stream, 0, &out->count) || !get_word(job, &stream, 1, &out->size) ||
        !get_word(job, &stream, 2, &out->last))
        return refuse_short(job, 0);
    size_t word = job->vti->word;
    if (out->count > room(&stream) / word || __builtin_mul_overflow(out->count + 3, word, &table) ||
        table > room(&stream))
        return refuse(job, "truncated: the table of its packed blocks does not fit into the file");
    if (out->last > out->size)
        return refuse(job, "damaged: its last packed block is larger than the others");
    out->data = after(&stream, (size_t)table);
    for (at = 0; at < out->count && total < wanted; at++) {
        uint64_t bytes;
        if (!get_word(job, &stream, 3 + at, &bytes) || bytes > room(&out->data) - packed)
            return refuse_short(job, values_of(job, total));
        packed += bytes;
        uint64_t block = block_size(out, at);
        if (block == 0 || block > most_unpacked(job->vti->packing, bytes) || block > UINT64_MAX - total)
            return refuse(job, "damaged: the sizes of its packed blocks cannot be");
        total += block;
    }
    return total < wanted ? refuse_short(job, values_of(job, total)) : VOL_OK;
}

static int unpack_zlib(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size)
{
    z_stream z = {.zalloc = vol_zlib_alloc,
                  .zfree = vol_zlib_free,
                  .next_in = (Bytef *)(uintptr_t)in,
                  .avail_in = (uInt)in_size,
                  .next_out = out,
                  .avail_out = (uInt)out_size};
    if (inflateInit(&z) != Z_OK)
        return VOL_VTK_NO_MEMORY;
    int result = inflate(&z, Z_FINISH);
    bool whole = z.avail_out == 0;
    inflateEnd(&z);
    return result == Z_MEM_ERROR             ? VOL_VTK_NO_MEMORY
           : result == Z_STREAM_END && whole ? VOL_VTK_DONE
                                             : VOL_VTK_BAD;
}

static VolStatus unpack(const Job *job, const unsigned char *in, size_t in_size, unsigned char *out,
                        size_t out_size)
{
    int result = VOL_VTK_BAD;
    const void *table;
    if (in_size > INT_MAX || out_size > INT_MAX) {
        return refuse(job, "packed blocks of more than 2 GB are not read");
    } else if (job->vti->packing == VTI_ZLIB) {
        result = unpack_zlib(in, in_size, out, out_size);
    } else {
        VolStatus status = vol_plugin("vtk", &table, job->err);
        if (status)
            return status;
        const VolVtkAdapter *adapter = table;
        result = adapter->unpack(job->vti->packing == VTI_LZMA, in, in_size, out, out_size);
    }
    if (result == VOL_VTK_NO_MEMORY)
        return vol_fail_memory(job->err, out_size);
    return result == VOL_VTK_DONE ? VOL_OK : refuse(job, "damaged: a packed block does not unpack to its size");
}

static VolStatus get_blocks(const Job *job, uint64_t wanted, unsigned char *out)
{
    Blocks blocks;
    VolStatus status = open_blocks(job, wanted, &blocks);
    uint64_t done = 0;
    size_t from = 0;
    for (uint64_t at = 0; !status && done < wanted; at++) {
        uint64_t bytes = 0, size = block_size(&blocks, at), use = size < wanted - done ? size : wanted - done;
        get_word(job, &blocks.header, 3 + at, &bytes); /* was there in open_blocks */
        unsigned char *packed = vol_alloc((size_t)bytes, 1);
        unsigned char *rest = use < size ? vol_alloc((size_t)size, 1) : NULL;
        if (!packed || (use < size && !rest))
            status = vol_fail_memory(job->err, (size_t)(bytes + size));
        else if (!get(&blocks.data, from, (size_t)bytes, packed))
            status = refuse_short(job, values_of(job, done));
        else
            status = unpack(job, packed, (size_t)bytes, rest ? rest : out + done, (size_t)size);
        if (!status && rest)
            memcpy(out + done, rest, (size_t)use);
        from += (size_t)bytes;
        done += use;
        free(packed);
        free(rest);
    }
    return status;
}

/* ---- Text ---- */

/* Every number takes at least one digit and one separator: where there cannot be enough, they are counted. */
static VolStatus check_text(const Job *job, const Stream *stream)
{
    const VolBytes text = {(unsigned char *)(uintptr_t)stream->data, stream->size};
    char word[2];
    uint64_t have = 0;
    if (job->count <= stream->size / 2 + 1)
        return VOL_OK;
    for (size_t at = 0; vol_vtk_word(&text, &at, word, sizeof word);)
        have++;
    return refuse_short(job, have);
}

/* Text ends at a '<'. */
static VolStatus get_text(const Job *job, unsigned char *out)
{
    Stream stream;
    VolStatus status = open_stream(job, &stream);
    if (status)
        return status;
    const VolBytes text = {(unsigned char *)(uintptr_t)stream.data, stream.size};
    size_t size = vol_sample_size(job->type), at = 0;
    for (uint64_t n = 0; n < job->count; n++) {
        char word[128], what[160];
        uint64_t bits;
        if (!vol_vtk_word(&text, &at, word, sizeof word))
            return refuse_short(job, n);
        if (!vol_vtk_number(word, job->type, &bits)) {
            snprintf(what, sizeof what, "value %" PRIu64 " of %" PRIu64 ", '%.30s', is no %.20s", n + 1,
                     job->count, word, job->array->type);
            return refuse(job, what);
        }
        if (vol_vti_bits(job->array))
            bits = bits != 0;
        vol_vtk_put(out + n * size, bits, size, job->vti->big_endian);
    }
    return VOL_OK;
}

/* ---- All of them ---- */

/* Bytes that are not packed, after their number. */
static VolStatus open_plain(const Job *job, uint64_t wanted, Stream *out)
{
    uint64_t said = 0;
    VolStatus status = open_stream(job, out);
    if (status)
        return status;
    size_t have = room(out), word = job->vti->word;
    if (have < word || !get_word(job, out, 0, &said))
        return refuse_short(job, 0);
    if (said > have - word)
        said = have - word;
    return said < wanted ? refuse_short(job, values_of(job, said)) : VOL_OK;
}

VolStatus vol_vti_find(const Vti *vti, const VtiArray *array, VolSample type, uint64_t count, VolError *err)
{
    const Job job = {vti, array, type, count, err};
    uint64_t wanted;
    if (__builtin_mul_overflow(count, vol_sample_size(type), &wanted) || wanted > SIZE_MAX / 4)
        return refuse(&job, "its sizes are too large");
    wanted = bytes_of(&job, count);
    Stream stream;
    Blocks blocks;
    if (is_text(array)) {
        VolStatus status = open_stream(&job, &stream);
        return status ? status : check_text(&job, &stream);
    }
    return vti->packing ? open_blocks(&job, wanted, &blocks) : open_plain(&job, wanted, &stream);
}

VolStatus vol_vti_get(const Vti *vti, const VtiArray *array, VolSample type, size_t count, unsigned char *out,
                      VolError *err)
{
    const Job job = {vti, array, type, count, err};
    size_t wanted = (size_t)bytes_of(&job, count);
    Stream stream;
    if (is_text(array))
        return get_text(&job, out);
    VolStatus status = vti->packing ? get_blocks(&job, wanted, out) : open_plain(&job, wanted, &stream);
    if (!status && !vti->packing && !get(&stream, vti->word, wanted, out))
        status = refuse(&job, stream.base64 ? "damaged: its data are no base64, or end early" : "truncated");
    if (!status && vol_vti_bits(array))
        vol_vtk_spread_bits(out, count);
    return status;
}
