#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include "base/plugin.h"
#include "base/refusals.h"
#include "cmd/shell/shell.h"
#include "io/out.h"

static const char *program;

/* SA_RESETHAND has put the default action back and SA_NODEFER lets it through: the parent sees the signal itself, and a
 * second one kills at once. */
static void clean_up_and_die(int number)
{
    vol_unlink_temporaries();
    raise(number);
}

static void say_and_exit(const char *const *words)
{
    for (; *words; words++)
        if (write(STDERR_FILENO, *words, strlen(*words)) < 0)
            break;
    _exit(VOL_NOMEM);
}

/* The initialisers of C++ libraries know no other way to say that they got no memory or no thread, and others end in an
 * assertion when they got none. */
static void tell_of_abort(int number)
{
    const char *adapter = vol_plugin_being_loaded();
    vol_unlink_temporaries();
    if (adapter)
        say_and_exit((const char *const[]){program, ": error: cannot load adapter '", adapter,
                                           "': its libraries gave up, for want of memory or threads\n", NULL});
    if (vol_refusals())
        say_and_exit((const char *const[]){program, ": error: out of memory\n", NULL});
    raise(number); /* by default: SA_RESETHAND */
}

void shell_catch_signals(const char *name)
{
    struct sigaction on_abort = {.sa_handler = tell_of_abort, .sa_flags = (int)(SA_RESETHAND | SA_NODEFER)};
    program = name;
    sigemptyset(&on_abort.sa_mask);
    sigaction(SIGABRT, &on_abort, NULL);
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        struct sigaction before;
        struct sigaction action = {.sa_handler = clean_up_and_die, .sa_flags = (int)(SA_RESETHAND | SA_NODEFER)};
        sigemptyset(&action.sa_mask);
        if (sigaction(numbers[i], NULL, &before) == 0 && before.sa_handler == SIG_IGN)
            continue; /* nohup and the like */
        sigaction(numbers[i], &action, NULL);
    }
    signal(SIGXFSZ, SIG_IGN); /* write() then fails with EFBIG, which we report */
}
