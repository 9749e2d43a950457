/* What the readers of text headers share: lines, numbers, and the files that headers refer to. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import/readers.h"

VolStatus vol_next_line(const VolBytes *bytes, size_t *at, char **line, VolError *err)
{
    *line = NULL;
    if (*at >= bytes->size)
        return VOL_OK;
    const unsigned char *begin = bytes->data + *at;
    const unsigned char *newline = memchr(begin, '\n', bytes->size - *at);
    size_t length = newline ? (size_t)(newline - begin) : bytes->size - *at;
    *at += length + (newline ? 1 : 0);
    if (length && begin[length - 1] == '\r')
        length--;
    char *text = vol_alloc(length + 1, 1);
    if (!text)
        return vol_fail_memory(err, length + 1);
    memcpy(text, begin, length);
    text[length] = 0;
    *line = text;
    return VOL_OK;
}

char *vol_trim(char *text)
{
    text += strspn(text, " \t\r\n");
    size_t length = strlen(text);
    while (length && strchr(" \t\r\n", text[length - 1]))
        text[--length] = 0;
    return text;
}

int vol_scan_reals(const char *text, double *out, int max)
{
    int count = 0;
    for (;;) {
        text += strspn(text, " \t\r\n,()[]");
        if (!*text)
            return count;
        char *end;
        double value = strtod(text, &end);
        if (end == text || count == max)
            return -1;
        out[count++] = value;
        text = end;
    }
}

bool vol_one_of(const char *word, const char *choices)
{
    size_t n = strlen(word);
    for (const char *at = choices; at; at = strchr(at, '|') ? strchr(at, '|') + 1 : NULL)
        if (strncmp(at, word, n) == 0 && (at[n] == '|' || at[n] == 0))
            return true;
    return false;
}

bool vol_sample_spelt(const char *word, const char *const spellings[VOL_SAMPLE_F64 + 1], VolSample *out)
{
    for (int type = 0; type <= VOL_SAMPLE_F64; type++)
        if (spellings[type] && vol_one_of(word, spellings[type]))
            return *out = (VolSample)type, true;
    return false;
}

VolStatus vol_read_beside(const VolSource *source, const char *data_name, VolBytes *out, VolError *err)
{
    const char *slash = strrchr(source->name, '/');
    int folder = slash && data_name[0] != '/' ? (int)(slash - source->name) + 1 : 0;
    char *path = vol_format_text("%.*s%s", folder, source->name, data_name);
    if (!path)
        return vol_fail_memory(err, strlen(data_name));
    VolStatus status = source->files->read(source->files->user, path, out, err);
    free(path);
    return status;
}

VolStatus vol_unpack_samples(VolBytes *bytes, uint64_t wanted, const char *name, VolError *err)
{
    return bytes->size == wanted ? VOL_OK : vol_unpack(bytes, name, err);
}

VolStatus vol_read_slices(const VolSource *source, const char *const *names, size_t count, size_t share,
                          int64_t skip, bool beside, VolBytes *out, VolError *err)
{
    size_t total;
    if (__builtin_mul_overflow(count, share, &total))
        return vol_fail(err, VOL_BAD_INPUT, "cannot import '%s': its sizes are too large", source->name);
    unsigned char *data = NULL;
    VolStatus status = VOL_OK;
    for (size_t i = 0; !status && i < count; i++) {
        VolBytes slice = {0};
        status = beside ? vol_read_beside(source, names[i], &slice, err)
                        : source->files->read(source->files->user, names[i], &slice, err);
        if (!status && skip >= 0)
            status = vol_unpack_samples(&slice, (uint64_t)skip + share, names[i], err);
        size_t before = skip < 0 && slice.size > share ? slice.size - share : skip < 0 ? 0 : (size_t)skip;
        if (!status && (slice.size < before || slice.size - before != share))
            status =
                vol_fail(err, VOL_BAD_INPUT,
                         "cannot import '%s': size does not match: a slice is %zu bytes after %zu of header, the "
                         "file has %zu",
                         names[i], share, before, slice.size);
        /* Only now: the first file has shown that the sizes are not made up. */
        if (!status && !data && !(data = vol_alloc(total, 1)))
            status = vol_fail_memory(err, total);
        if (!status)
            memcpy(data + i * share, slice.data + before, share);
        vol_bytes_free(&slice);
    }
    if (status)
        free(data);
    else
        *out = (VolBytes){data, total};
    return status;
}

VolStatus vol_fill_slice_number(const char *pattern, int64_t number, char **out, VolError *err)
{
    const char *percent = strchr(pattern, '%');
    const char *at = percent ? percent + 1 : NULL;
    int width = 0;
    bool zeros = at && *at == '0';
    while (at && *at >= '0' && *at <= '9' && width < 100)
        width = 10 * width + *at++ - '0';
    if (!at || *at != 'd' || width > 32 || strchr(at, '%'))
        return vol_fail(err, VOL_USAGE, "pattern '%s': one %%d or %%0Nd is to stand for the number", pattern);
    char digits[64];
    if (zeros)
        snprintf(digits, sizeof digits, "%0*" PRId64, width, number);
    else
        snprintf(digits, sizeof digits, "%*" PRId64, width, number);
    *out = vol_format_text("%.*s%s%s", (int)(percent - pattern), pattern, digits, at + 1);
    return *out ? VOL_OK : vol_fail_memory(err, strlen(pattern) + sizeof digits);
}
