/* OpenEXRCore over memory: the callbacks that reading and writing share. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/refusals.h"
#include "io/exr_private.h"

/* The library's last message on this thread.  Not in the stream: the library may hold its lock when it complains, and to
 * ask it for the stream takes the lock again. */
static _Thread_local char last_message[256];

static void keep_message(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context;
    (void)code;
    snprintf(last_message, sizeof last_message, "%s", message);
}

void vol_exr_forget_message(void) { last_message[0] = 0; }

static _Thread_local bool out_of_memory;

static void *zeroed(size_t size)
{
    void *block = vol_library_alloc_zero(size);
    out_of_memory = out_of_memory || !block;
    return block;
}

bool vol_exr_out_of_memory(void) { return out_of_memory; }

/* Like pread: short at the end; the library looks ahead in headers and checks the count where it needs all. */
static int64_t read_memory(exr_const_context_t context, void *user, void *buffer, uint64_t size, uint64_t offset,
                           exr_stream_error_func_ptr_t fail)
{
    (void)context;
    (void)fail;
    VolExrStream *stream = user;
    uint64_t left = offset < stream->in_size ? stream->in_size - offset : 0;
    size_t n = (size_t)(size < left ? size : left);
    if (n)
        memcpy(buffer, stream->in + offset, n);
    return (int64_t)n;
}

static int64_t memory_size(exr_const_context_t context, void *user)
{
    (void)context;
    VolExrStream *stream = user;
    return (int64_t)stream->in_size;
}

bool vol_exr_reserve(VolExrStream *stream, size_t size)
{
    if (size <= stream->out_capacity)
        return true;
    size_t capacity = stream->out_capacity ? stream->out_capacity : 65536;
    while (capacity < size)
        capacity += capacity;
    unsigned char *grown = vol_resize(stream->out.data, capacity, 1);
    if (!grown)
        return false;
    stream->out.data = grown;
    stream->out_capacity = capacity;
    return true;
}

static int64_t write_memory(exr_const_context_t context, void *user, const void *buffer, uint64_t size, uint64_t offset,
                            exr_stream_error_func_ptr_t fail)
{
    VolExrStream *stream = user;
    uint64_t end;
    if (__builtin_add_overflow(offset, size, &end) || end > SIZE_MAX / 4 || !vol_exr_reserve(stream, (size_t)end)) {
        out_of_memory = true;
        fail(context, EXR_ERR_OUT_OF_MEMORY, "out of memory");
        return -1;
    }
    if (offset > stream->out.size)
        memset(stream->out.data + stream->out.size, 0, (size_t)offset - stream->out.size);
    memcpy(stream->out.data + offset, buffer, (size_t)size);
    if (end > stream->out.size)
        stream->out.size = (size_t)end;
    return (int64_t)size;
}

exr_context_initializer_t vol_exr_initializer(VolExrStream *stream)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    out_of_memory = false;
    vol_exr_forget_message();
    init.error_handler_fn = keep_message;
    init.alloc_fn = zeroed;
    init.free_fn = free;
    init.user_data = stream;
    if (stream->in) {
        init.read_fn = read_memory;
        init.size_fn = memory_size;
        /* A chunk table that does not fit the file is damage, not something to guess around. */
        init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    } else {
        init.write_fn = write_memory;
    }
    return init;
}

const char *vol_exr_why(exr_result_t code)
{
    char *why = last_message;
    if (!why[0])
        snprintf(why, sizeof last_message, "%s", exr_get_default_error_message(code));
    if (isupper((unsigned char)why[0]) && !isupper((unsigned char)why[1]))
        why[0] = (char)tolower((unsigned char)why[0]);
    size_t length = strlen(why);
    while (length > 0 && (why[length - 1] == '.' || why[length - 1] == '\n'))
        why[--length] = 0;
    return why;
}
