/* LD_PRELOAD: only FEW_THREADS threads can be started in a process, as under RLIMIT_NPROC (which does not bind root). */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

static atomic_long started;

int pthread_create(pthread_t *thread, const pthread_attr_t *attributes, void *(*run)(void *), void *user)
{
    int (*next)(pthread_t *, const pthread_attr_t *, void *(*)(void *), void *);
    *(void **)&next = dlsym(RTLD_NEXT, "pthread_create");
    const char *most = getenv("FEW_THREADS");
    if (most && atomic_fetch_add(&started, 1) >= strtol(most, NULL, 10))
        return EAGAIN;
    return next(thread, attributes, run, user);
}
