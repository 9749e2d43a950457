/* Allocation with overflow-checked sizes, and the bytes of a file in memory. */
#ifndef VOL_BASE_MEM_H
#define VOL_BASE_MEM_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

/* NULL on overflow or want of memory.  A count or size of 0 gives a valid pointer.  Released with free(). */
void *vol_alloc(size_t count, size_t size);        /* uninitialised */
void *vol_alloc_zero(size_t count, size_t size);
void *vol_alloc_aligned(size_t alignment, size_t count, size_t size); /* alignment: a power of two >= 8 */
void *vol_resize(void *old, size_t count, size_t size);
char *vol_copy_text(const char *text);
char *vol_format_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* A large block of zeros on pages of its own: it begins at a multiple of 2 MiB and lies on pages of that size where the
 * system has them.  Growing moves pages, not bytes, and pages that nobody touches take no memory. */
typedef struct VolPages {
    void *data;
    size_t bytes; /* a multiple of the page size; 0: nothing yet */
} VolPages;

bool vol_pages_grow(VolPages *pages, size_t count, size_t size); /* false: as it was */
void vol_pages_free(VolPages *pages);

/* "out of memory" as a status, for the many places that need just this. */
VolStatus vol_fail_memory(VolError *err, size_t bytes);

/* An allocated block of bytes, such as a file's. */
typedef struct VolBytes {
    unsigned char *data;
    size_t size;
} VolBytes;

void vol_bytes_free(VolBytes *bytes);

/* The whole pages between the bytes `begin` and `end` take no more memory: they are zeros now. */
void vol_bytes_forget(const VolBytes *bytes, size_t begin, size_t end);

/* Appends to an allocated block that grows by doubling; `capacity` is the caller's. */
VolStatus vol_bytes_append(VolBytes *bytes, size_t *capacity, const void *data, size_t size, VolError *err);

#endif
