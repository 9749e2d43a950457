/* Which failure is reported does not depend on timing: items are handed out in ascending order, so when any item has
 * failed, all items before it are running or done and will be heard. */
#include "base/pool.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "base/mem.h"

typedef struct Loop {
    VolStatus (*item)(void *user, size_t index, int thread, VolError *err);
    void *user;
    size_t count;
    pthread_mutex_t lock; /* guards what follows */
    size_t next, failed_index;
    VolStatus status;
    VolError error;
} Loop;

typedef struct Worker {
    Loop *loop;
    int thread;
    pthread_t id;
} Worker;

static bool take(Loop *loop, size_t *index)
{
    pthread_mutex_lock(&loop->lock);
    bool taken = loop->status == VOL_OK && loop->next < loop->count;
    if (taken)
        *index = loop->next++;
    pthread_mutex_unlock(&loop->lock);
    return taken;
}

static void record_failure(Loop *loop, size_t index, VolStatus status, const VolError *error)
{
    pthread_mutex_lock(&loop->lock);
    if (loop->status == VOL_OK || index < loop->failed_index) {
        loop->status = status;
        loop->failed_index = index;
        loop->error = *error;
    }
    pthread_mutex_unlock(&loop->lock);
}

static void *work(void *argument)
{
    const Worker *worker = argument;
    Loop *loop = worker->loop;
    size_t index;
    while (take(loop, &index)) {
        VolError error = {""};
        VolStatus status = loop->item(loop->user, index, worker->thread, &error);
        if (status != VOL_OK)
            record_failure(loop, index, status, &error);
    }
    return NULL;
}

/* Starts workers 1..threads-1; returns how many there are with the caller's. */
static int start(Loop *loop, Worker *workers, int threads)
{
    for (int t = 1; t < threads; t++) {
        workers[t] = (Worker){.loop = loop, .thread = t};
        int errnum = pthread_create(&workers[t].id, NULL, work, &workers[t]);
        if (errnum) {
            VolError error;
            vol_fail(&error, VOL_NOMEM, "cannot start thread %d of %d: %s", t + 1, threads, strerror(errnum));
            record_failure(loop, 0, VOL_NOMEM, &error);
            return t;
        }
    }
    return threads;
}

static void *wait_for_gate(void *gate)
{
    pthread_mutex_lock(gate);
    pthread_mutex_unlock(gate);
    return NULL;
}

VolStatus vol_threads_can_start(int count, VolError *err)
{
    enum { MOST = 16 };
    pthread_t threads[MOST];
    pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;
    int started = 0, errnum = 0;
    pthread_mutex_lock(&gate); /* all at once */
    while (started < count && started < MOST && !errnum)
        if (!(errnum = pthread_create(&threads[started], NULL, wait_for_gate, &gate)))
            started++;
    pthread_mutex_unlock(&gate);
    for (int t = 0; t < started; t++)
        pthread_join(threads[t], NULL);
    pthread_mutex_destroy(&gate);
    return errnum ? vol_fail(err, VOL_NOMEM, "cannot start %d threads: %s", count, strerror(errnum)) : VOL_OK;
}

VolStatus vol_parallel(int threads, size_t count,
                       VolStatus (*item)(void *user, size_t index, int thread, VolError *err), void *user,
                       VolError *err)
{
    if (count == 0)
        return VOL_OK;
    if (threads < 1)
        threads = 1;
    if ((size_t)threads > count)
        threads = (int)count;
    Worker *workers = vol_alloc((size_t)threads, sizeof *workers);
    if (!workers)
        return vol_fail_memory(err, (size_t)threads * sizeof *workers);
    Loop loop = {.item = item, .user = user, .count = count, .lock = PTHREAD_MUTEX_INITIALIZER};
    workers[0] = (Worker){.loop = &loop};
    int started = start(&loop, workers, threads);
    work(&workers[0]);
    for (int t = 1; t < started; t++)
        pthread_join(workers[t].id, NULL);
    pthread_mutex_destroy(&loop.lock);
    free(workers);
    if (loop.status != VOL_OK && err)
        *err = loop.error;
    return loop.status;
}
