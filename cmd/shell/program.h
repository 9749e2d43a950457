/* What every program does between main() and its one job: parse, say, time, write, exit.  The only code that prints. */
#ifndef CMD_SHELL_PROGRAM_H
#define CMD_SHELL_PROGRAM_H

#include "base/cpu.h"
#include "base/log.h"
#include "base/mem.h"
#include "base/stats.h"
#include "base/status.h"
#include "cli/history.h"
#include "cli/opt.h"
#include "io/in.h"
#include "io/out.h"

typedef struct Run {
    const struct Program *program;
    const VolCommandLine *line;
    const VolCommonOptions *common; /* = &line->common */
    const VolOpt *table;
    size_t rows;
    VolLog log;       /* warnings always (not with -q), notes with -v; `prog: warning: ...` */
    VolStats *stats;  /* NULL without --stats */
    VolCpu cpu;
    int threads;      /* resolved */
    char *history_line; /* never NULL; whether to write it, common->no_history says */
    char *hashed_line;  /* never NULL; for vol:argsHash */
    struct Outputs *outputs;
} Run;

typedef struct Program {
    const char *name, *summary, *operands; /* operands: for the synopsis, "[IN]" */
    const VolOpt *table;
    size_t rows;
    void *options; /* the struct that the table's offsets refer to; NULL if rows is 0 */
    int max_operands; /* -1: any number */
    bool record_operands; /* in the history: where operands are not names of inputs (a field's name) */
    const char *libraries; /* extra lines for --version, or NULL */
    const char *const *also; /* the field with the name of a second output, NULL in it if not wanted; or NULL */
    bool reports;          /* to stdout, whatever -o says */
    VolStatus (*main)(const Run *run, VolError *err);
} Program;

int program_main(const Program *program, int argc, char **argv);

/* Whether the option was on the command line (or in an @FILE). */
bool run_given(const Run *run, const char *option);

/* The one input: operand 0, or "-" where there is none. */
const char *run_input(const Run *run);

/* Reads an input ("-" stdin); refuses a second reading of stdin. */
VolStatus run_read(const Run *run, const char *path, VolBytes *out, VolError *err);

/* VOL_BAD_INPUT for an input that is not what is `wanted` ("VDB"): "DOING 'NAME': it is NIfTI, not VDB: vol-import ..". */
VolStatus run_wrong_kind(const char *doing, const char *name, const char *wanted, const VolBytes *bytes, VolError *err);

/* VOL_BAD_INPUT where a volume stands in a transfer function's place. */
VolStatus run_refuse_volume(const VolBytes *bytes, const char *name, VolError *err);

/* What run_write would refuse, found before the work is done. */
VolStatus run_check_output(const Run *run, bool binary, VolError *err);

/* The output for -o; run_write_to: one beside it, to its own place.  The bytes are taken over.  All outputs and --stats are
 * put in place once the program's main has returned VOL_OK or VOL_NO, or none is.  `binary`: refused on a terminal without
 * -f.  -n is handled by program_main before main. */
VolStatus run_write(const Run *run, VolBytes *bytes, bool binary, VolError *err);
VolStatus run_write_to(const Run *run, const char *path, VolBytes *bytes, bool binary, VolError *err);

/* A text's bytes; the text is taken over, NULL: VOL_NOMEM. */
VolStatus run_write_text(const Run *run, char *text, VolError *err);

/* Warns of an output whose name ends like one of another format than the one that is written ("EXR"): out.png. */
void run_warn_of_name(const Run *run, const char *path, const char *format);

/* Progress 0..1, from one thread or under the caller's lock; draws at most 4 times a second, only where asked. */
void run_progress(const Run *run, double fraction);

#endif
