/* LD_PRELOAD: makes the FAIL_MALLOC-th allocation of a process fail, or with FAIL_MALLOC_FOR=M that one and all of the next M,
 * whoever makes it: programs, the C library, C++'s operator new, libraries.  Counted once the program's own
 * libraries are there.  With FAIL_MALLOC_COUNT=FILE the number of allocations is written there at the end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void *__libc_memalign(size_t alignment, size_t size);

void *malloc(size_t size);
void *calloc(size_t count, size_t size);
void *realloc(void *old, size_t size);
int posix_memalign(void **out, size_t alignment, size_t size);
void *aligned_alloc(size_t alignment, size_t size);
void *memalign(size_t alignment, size_t size);

static atomic_long made;
static long first = -1, last = -1;
static const char *count_file;

__attribute__((constructor)) static void begin(void)
{
    const char *number = getenv("FAIL_MALLOC"), *run = getenv("FAIL_MALLOC_FOR");
    count_file = getenv("FAIL_MALLOC_COUNT");
    made = 0;
    if (number) {
        first = strtol(number, NULL, 10);
        last = first + (run ? strtol(run, NULL, 10) : 0);
    }
}

/* The programs end by it. */
void _exit(int status)
{
    char text[32];
    int fd = count_file ? open(count_file, O_WRONLY | O_CREAT | O_TRUNC, 0666) : -1;
    int length = snprintf(text, sizeof text, "%ld\n", atomic_load(&made));
    if (fd >= 0 && write(fd, text, (size_t)length) == length)
        close(fd);
    syscall(SYS_exit_group, status);
    __builtin_unreachable();
}

static int refused(void)
{
    long number = atomic_fetch_add(&made, 1) + 1;
    if (number < first || number > last)
        return 0;
    errno = ENOMEM;
    return 1;
}

void *malloc(size_t size) { return refused() ? NULL : __libc_malloc(size); }
void *calloc(size_t count, size_t size) { return refused() ? NULL : __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { return refused() ? NULL : __libc_realloc(old, size); }
void *memalign(size_t alignment, size_t size) { return refused() ? NULL : __libc_memalign(alignment, size); }
void *aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }

int posix_memalign(void **out, size_t alignment, size_t size)
{
    void *block = memalign(alignment, size);
    if (block)
        *out = block;
    return block ? 0 : ENOMEM;
}
