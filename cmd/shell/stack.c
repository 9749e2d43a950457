#define _GNU_SOURCE /* pthread_setattr_default_np */
#include <pthread.h>
#include <signal.h>
#include <string.h>
#include <sys/resource.h>

#include "cmd/shell/shell.h"

/* Kernels, and the libraries' decoders more so, keep blocks on the stack.  Nobody has counted how much they may take. */
enum { ENOUGH = 1 << 20, OURS = 8 << 20 };

typedef struct Call {
    int (*work)(void *user);
    void *user;
    int result;
    sigset_t signals;
} Call;

static void *call(void *argument)
{
    Call *it = argument;
    pthread_sigmask(SIG_SETMASK, &it->signals, NULL);
    it->result = it->work(it->user);
    return NULL;
}

/* The thread that waits takes no signals, so that the one which works can hold them back. */
static int call_on_thread(Call *it)
{
    pthread_t thread;
    pthread_attr_t attributes;
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &it->signals);
    pthread_attr_init(&attributes);
    int errnum = pthread_attr_setstacksize(&attributes, OURS);
    if (!errnum)
        errnum = pthread_setattr_default_np(&attributes); /* for those that libraries start */
    if (!errnum)
        errnum = pthread_create(&thread, &attributes, call, it);
    if (!errnum)
        pthread_join(thread, NULL);
    pthread_attr_destroy(&attributes);
    return errnum;
}

VolStatus shell_with_stack(int (*work)(void *user), void *user, int *result, VolError *err)
{
    struct rlimit limit;
    Call it = {.work = work, .user = user};
    if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur >= ENOUGH) {
        *result = work(user);
        return VOL_OK;
    }
    int errnum = call_on_thread(&it);
    *result = it.result;
    if (errnum)
        return vol_fail(err, VOL_NOMEM, "cannot work on a stack of %llu KiB, nor get a larger one: %s (see 'ulimit -s')",
                        (unsigned long long)limit.rlim_cur / 1024, strerror(errnum));
    return VOL_OK;
}
