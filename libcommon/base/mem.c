#define _GNU_SOURCE /* mremap */
#include "base/mem.h"

#include <stdarg.h>
#ifdef VOL_FAULTS
#include <stdatomic.h>
#endif
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/refused.h"

/* In builds with -DVOL_FAULTS the environment's VOL_FAULT=malloc:N makes the N-th allocation of the run fail, so that a
 * test can walk through all of them: ours, and those that jansson, expat, zlib and OpenEXRCore make through refusals.h. */
#ifdef VOL_FAULTS
static bool fault_is_due(void)
{
    static atomic_long count;
    const char *fault = getenv("VOL_FAULT");
    long number = atomic_fetch_add(&count, 1) + 1;
    return fault && !strncmp(fault, "malloc:", 7) && strtol(fault + 7, NULL, 10) == number;
}
#else
static bool fault_is_due(void) { return false; }
#endif

/* count * size; false where nothing should be allocated. */
static bool product(size_t count, size_t size, size_t *bytes)
{
    return !__builtin_mul_overflow(count, size, bytes) && !fault_is_due();
}

/* The system gives more than there is, and kills who uses it.  A block that grows has half of it already, mostly. */
static bool beyond_machine(size_t bytes)
{
    return bytes > 4 * (size_t)VOL_WORTH_A_CHECK && (double)bytes > vol_memory_available();
}

static void *counted(void *block)
{
    if (!block)
        vol_count_refusal();
    return block;
}

enum { LARGE_PAGE = 1 << 21 };

/* From this size on a block lies on large pages where the system has them: to make one ready costs the system hardly more
 * than an ordinary page, of which it takes 512.  What is left at the block's end lies on one too if it fills most of it. */
enum { LARGE_BLOCK = LARGE_PAGE / 4 * 3 };

static void *prefer_large_pages(void *block, size_t bytes)
{
    size_t before = -(uintptr_t)block % LARGE_PAGE;
    if (block && bytes >= before + LARGE_PAGE)
        madvise((unsigned char *)block + before, (bytes - before) / LARGE_PAGE * LARGE_PAGE, MADV_HUGEPAGE);
    return block;
}

static void *alloc_bytes(size_t bytes)
{
    void *block = NULL;
    if (bytes < LARGE_BLOCK)
        return malloc(bytes ? bytes : 1);
    if (bytes % LARGE_PAGE >= LARGE_BLOCK)
        bytes += LARGE_PAGE - bytes % LARGE_PAGE;
    return posix_memalign(&block, LARGE_PAGE, bytes) == 0 ? prefer_large_pages(block, bytes) : NULL;
}

void *vol_alloc(size_t count, size_t size)
{
    size_t bytes;
    return counted(product(count, size, &bytes) && !beyond_machine(bytes) ? alloc_bytes(bytes) : NULL);
}

void *vol_alloc_zero(size_t count, size_t size)
{
    size_t bytes;
    if (!product(count, size, &bytes) || beyond_machine(bytes))
        return counted(NULL);
    if (bytes < LARGE_BLOCK)
        return counted(calloc(bytes ? bytes : 1, 1));
    void *block = counted(alloc_bytes(bytes));
    return block ? memset(block, 0, bytes) : NULL;
}

void *vol_alloc_aligned(size_t alignment, size_t count, size_t size)
{
    size_t bytes;
    void *block = NULL;
    if (!product(count, size, &bytes) || posix_memalign(&block, alignment, bytes ? bytes : 1) != 0)
        return counted(NULL);
    return block;
}

void *vol_resize(void *old, size_t count, size_t size)
{
    size_t bytes;
    if (!product(count, size, &bytes) || beyond_machine(bytes / 2))
        return counted(NULL);
    return counted(old ? prefer_large_pages(realloc(old, bytes ? bytes : 1), bytes) : alloc_bytes(bytes));
}

/* Address space for `bytes` at a multiple of LARGE_PAGE, nothing behind it. */
static unsigned char *reserve_aligned(size_t bytes)
{
    size_t room;
    if (__builtin_add_overflow(bytes, (size_t)LARGE_PAGE, &room))
        return NULL;
    unsigned char *begin = mmap(NULL, room, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (begin == MAP_FAILED)
        return NULL;
    size_t before = -(uintptr_t)begin % LARGE_PAGE, behind = LARGE_PAGE - before;
    if (before)
        munmap(begin, before);
    if (behind)
        munmap(begin + before + bytes, behind);
    return begin + before;
}

bool vol_pages_grow(VolPages *pages, size_t count, size_t size)
{
    size_t bytes, page = 4096;
    if (!product(count, size, &bytes) || bytes > SIZE_MAX - LARGE_PAGE)
        return counted(NULL);
    if (bytes > LARGE_PAGE / 2)
        page = LARGE_PAGE;
    bytes = (bytes + page - 1) / page * page;
    if (bytes <= pages->bytes)
        return true;
    unsigned char *place = counted(reserve_aligned(bytes));
    if (!place)
        return false;
    void *data = pages->data ? mremap(pages->data, pages->bytes, bytes, MREMAP_MAYMOVE | MREMAP_FIXED, place)
                             : mmap(place, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    if (data == MAP_FAILED) {
        vol_count_refusal();
        munmap(place, bytes);
        return false;
    }
    madvise(data, bytes, MADV_HUGEPAGE); /* where the system has none: ordinary ones */
    *pages = (VolPages){data, bytes};
    return true;
}

void vol_pages_free(VolPages *pages)
{
    if (pages->data)
        munmap(pages->data, pages->bytes);
    *pages = (VolPages){0};
}

char *vol_copy_text(const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = vol_alloc(size, 1);
    return copy ? memcpy(copy, text, size) : NULL;
}

char *vol_format_text(const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int length = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *text = length < 0 ? NULL : vol_alloc((size_t)length + 1, 1);
    if (text)
        vsnprintf(text, (size_t)length + 1, format, again);
    va_end(again);
    return text;
}

VolStatus vol_fail_memory(VolError *err, size_t bytes)
{
    if (bytes == 0) /* the caller cannot tell */
        return vol_fail(err, VOL_NOMEM, "out of memory");
    return vol_fail(err, VOL_NOMEM, "out of memory: %zu bytes wanted", bytes);
}

void vol_bytes_free(VolBytes *bytes)
{
    free(bytes->data);
    *bytes = (VolBytes){0};
}

void vol_bytes_forget(const VolBytes *bytes, size_t begin, size_t end)
{
    uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), base = (uintptr_t)bytes->data;
    uintptr_t from = (base + begin + page - 1) / page * page, to = (base + end) / page * page;
    if (from < to)
        madvise((void *)from, to - from, MADV_DONTNEED);
}

VolStatus vol_bytes_append(VolBytes *bytes, size_t *capacity, const void *data, size_t size, VolError *err)
{
    size_t wanted;
    if (__builtin_add_overflow(bytes->size, size, &wanted))
        return vol_fail_memory(err, SIZE_MAX);
    if (wanted > *capacity) {
        size_t grown = *capacity > SIZE_MAX / 2 ? wanted : *capacity * 2;
        if (grown < wanted)
            grown = wanted;
        unsigned char *moved = vol_resize(bytes->data, grown, 1);
        if (!moved)
            return vol_fail_memory(err, grown);
        bytes->data = moved;
        *capacity = grown;
    }
    if (size)
        memcpy(bytes->data + bytes->size, data, size);
    bytes->size = wanted;
    return VOL_OK;
}
