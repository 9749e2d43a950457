#include <signal.h>
#include <stddef.h>

#include "cmd/shell/shell.h"
#include "io/out.h"

/* SA_RESETHAND has put the default action back and SA_NODEFER lets it through: the parent sees the signal itself, and a
 * second one kills at once. */
static void clean_up_and_die(int number)
{
    vol_unlink_temporaries();
    raise(number);
}

void shell_catch_signals(void)
{
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
