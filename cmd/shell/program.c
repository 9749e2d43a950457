#include "cmd/shell/program.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/refusals.h"
#include "cmd/shell/outputs.h"
#include "cmd/shell/shell.h"

/* ---- what programs call ---- */

bool run_given(const Run *run, const char *option) { return vol_given(run->line, run->table, run->rows, option); }

const char *run_input(const Run *run) { return run->line->operands.count ? run->line->operands.words[0] : "-"; }

static bool fake_terminal(const VolCommonOptions *common, const char *which)
{
    return common->fake_tty && strstr(common->fake_tty, which);
}

VolStatus run_read(const Run *run, const char *path, VolBytes *out, VolError *err)
{
    static bool stdin_taken;
    *out = (VolBytes){0};
    if (!strcmp(path, "-")) {
        if (stdin_taken)
            return vol_fail(err, VOL_USAGE, "cannot read 'stdin': it has been read already");
        stdin_taken = true;
        if (fake_terminal(run->common, "in") && !run->common->force)
            return vol_refuse_input_terminal("stdin", err);
    }
    VolStatus status = vol_read_whole(path, run->common->force, out, err);
    if (status || out->size || strcmp(path, "-") != 0)
        return status;
    vol_bytes_free(out);
    return vol_fail(err, VOL_BAD_INPUT, "cannot read 'stdin': it ended before its first byte; %s",
                    "the program that writes to this pipe failed, or had nothing to write");
}

static VolOutOptions out_options(const Run *run, bool binary)
{
    return (VolOutOptions){.binary = binary, .allow_terminal = run->common->force};
}

VolStatus run_check_output(const Run *run, bool binary, VolError *err)
{
    const char *path = run->common->output;
    if (binary && !run->common->force && !strcmp(path, "-") && fake_terminal(run->common, "out"))
        return vol_refuse_output_terminal("stdout", err);
    return vol_check_output(path, out_options(run, binary), err);
}

VolStatus run_write_to(const Run *run, const char *path, VolBytes *bytes, bool binary, VolError *err)
{
    return outputs_add(run->outputs, path, bytes, out_options(run, binary), err);
}

VolStatus run_write(const Run *run, VolBytes *bytes, bool binary, VolError *err)
{
    VolStatus status = run_check_output(run, binary, err);
    if (status == VOL_OK)
        return run_write_to(run, run->common->output, bytes, binary, err);
    vol_bytes_free(bytes);
    return status;
}

VolStatus run_write_text(const Run *run, char *text, VolError *err)
{
    VolBytes bytes = {.data = (unsigned char *)text, .size = text ? strlen(text) : 0};
    return text ? run_write(run, &bytes, false, err) : vol_fail_memory(err, 0);
}

void run_progress(const Run *run, double fraction)
{
    (void)run;
    shell_progress_draw(fraction);
}

/* ---- messages ---- */

static void say(void *user, VolSeverity severity, const char *line)
{
    const Run *run = user;
    if (severity == VOL_WARNING && !run->common->quiet)
        shell_say(run->program->name, "warning", line);
    if (severity == VOL_NOTE && run->common->verbose > 0)
        shell_say(run->program->name, "note", line);
}

/* Damage in what came through a pipe: most often its writer stopped half-way. */
static void blame_pipe(VolStatus status, VolError *err)
{
    struct stat info;
    VolError seen = *err;
    if (status == VOL_BAD_INPUT && strncmp(seen.text, "damaged", 7) == 0 && strstr(seen.text, "'stdin'") &&
        fstat(STDIN_FILENO, &info) == 0 && S_ISFIFO(info.st_mode))
        vol_fail(err, status, "%s (did the program before it in the pipe end early?)", seen.text);
}

static void report(const Program *program, VolStatus status, const VolError *err)
{
    char line[1200];
    if (status == VOL_OK || !err->text[0])
        return;
    if (status == VOL_USAGE)
        snprintf(line, sizeof line, "%s (try '%s --help')", err->text, program->name);
    shell_say(program->name, "error", status == VOL_USAGE ? line : err->text);
}

static VolStatus print_text(char *text, VolError *err) /* takes the text */
{
    if (!text)
        return vol_fail_memory(err, 0);
    VolStatus status = vol_write_whole("-", text, strlen(text), (VolOutOptions){0}, err);
    free(text);
    return status;
}

static char *version_text(const Program *program)
{
    VolCpu cpu = VOL_CPU_SCALAR;
    vol_cpu_choose("auto", &cpu, NULL);
    const char *libraries = program->libraries ? program->libraries : "";
    size_t length = strlen(libraries);
    const char *newline = length && libraries[length - 1] != '\n' ? "\n" : "";
    return vol_format_text("%s (Pellucid) %s\n%s%scpu %s of %s\n", program->name, VOL_VERSION, libraries, newline,
                           vol_cpu_name(cpu), vol_cpu_list());
}

/* ---- before main ---- */

/* A closed stdin, stdout or stderr would give its number to the next file that is opened.  What is put in its place is
 * open the wrong way round, so that using it fails as it should. */
static void occupy_standard_descriptors(void)
{
    for (int fd = 0; fd <= 2; fd++)
        if (fcntl(fd, F_GETFD) < 0 && errno == EBADF && open("/dev/null", fd == 0 ? O_WRONLY : O_RDONLY) < 0)
            return;
}

static VolStatus choose_threads(Run *run, VolError *err)
{
    int64_t wanted = run->common->threads;
    const char *fallback = getenv("VOL_THREADS");
    if (wanted == 0 && fallback && *fallback)
        if (!vol_parse_int(fallback, &wanted) || wanted < 0 || wanted > 1024)
            return vol_fail(err, VOL_USAGE, "bad value '%s' in the environment's VOL_THREADS: 0 to 1024 is needed",
                            fallback);
    run->threads = vol_thread_count((int)wanted);
    return VOL_OK;
}

static VolStatus check_operands(const Run *run, VolError *err)
{
    const VolTextList *operands = &run->line->operands;
    int max = run->program->max_operands;
    if (max >= 0 && operands->count > (size_t)max)
        return vol_fail(err, VOL_USAGE, "unexpected operand '%s': at most %d can be given", operands->words[max], max);
    size_t from_stdin = 0;
    for (size_t i = 0; i < operands->count; i++)
        from_stdin += !strcmp(operands->words[i], "-");
    if (from_stdin > 1)
        return vol_fail(err, VOL_USAGE, "cannot read 'stdin' %zu times: one input at most can be -", from_stdin);
    return VOL_OK;
}

static const char *output_name(const char *path) { return strcmp(path, "-") ? path : "stdout"; }

/* Every output has a place of its own, and one that can be written to. */
static VolStatus check_outputs(const Run *run, VolError *err)
{
    const Program *program = run->program;
    const char *also = program->also ? *program->also : NULL, *report = NULL;
    const char *output = run->common->output;
    if (program->reports) {
        report = run->common->quiet ? NULL : "-";
        output = strcmp(output, "-") ? output : NULL;
    }
    const char *paths[] = {output, run->common->stats, also, report};
    enum { COUNT = sizeof paths / sizeof *paths };
    for (size_t i = 0; i < COUNT; i++) {
        VolStatus status = paths[i] ? vol_check_output(paths[i], (VolOutOptions){0}, err) : VOL_OK;
        if (status)
            return status;
        for (size_t k = 0; k < i && paths[i]; k++)
            if (paths[k] && vol_same_output(paths[k], paths[i]))
                return vol_fail(err, VOL_USAGE, "cannot write '%s': '%s' is the same place, and each output needs its own",
                                output_name(paths[i]), output_name(paths[k]));
    }
    return VOL_OK;
}

static VolStatus set_up(Run *run, VolError *err)
{
    const VolCommonOptions *common = run->common;
    VolStatus status = vol_cpu_choose(common->cpu, &run->cpu, err);
    if (status == VOL_OK)
        status = choose_threads(run, err);
    if (status == VOL_OK)
        status = check_operands(run, err);
    if (status == VOL_OK)
        status = check_outputs(run, err);
    if (status != VOL_OK)
        return status;
    run->history_line = vol_history_line(run->program->name, run->line, run->program->record_operands);
    run->hashed_line = vol_hashed_line(run->program->name, run->line, run->program->record_operands);
    if (common->stats)
        run->stats = vol_stats_new();
    return run->history_line && run->hashed_line && (run->stats || !common->stats) ? VOL_OK : vol_fail_memory(err, 0);
}

static bool nothing_to_do(const Run *run)
{
    struct stat info;
    const char *output = run->common->output;
    if (!run->common->no_clobber || !strcmp(output, "-") || stat(output, &info) != 0)
        return false;
    char line[1024];
    snprintf(line, sizeof line, "nothing to do for '%s': it exists", output);
    if (!run->common->quiet)
        shell_say(run->program->name, "note", line);
    return true;
}

/* ---- after main ---- */

typedef struct StatsFile {
    VolOutput output;
    VolBytes json;
} StatsFile;

static void drop_stats(StatsFile *file)
{
    vol_output_free(&file->output);
    vol_bytes_free(&file->json);
}

/* What is known by now, ready to be put in place. */
static VolStatus prepare_stats(const Run *run, VolStatus outcome, StatsFile *file, VolError *err)
{
    *file = (StatsFile){.output.temporary = -1};
    vol_stats_text(run->stats, "program", run->program->name);
    vol_stats_text(run->stats, "version", VOL_VERSION);
    vol_stats_text(run->stats, "cpu", vol_cpu_name(run->cpu));
    vol_stats_number(run->stats, "threads", (uint64_t)run->threads);
    vol_stats_number(run->stats, "status", (uint64_t)outcome);
    VolStatus status = vol_stats_write(run->stats, &file->json, err);
    if (status == VOL_OK)
        status = vol_output_prepare(&file->output, run->common->stats, file->json.data, file->json.size,
                                    (VolOutOptions){0}, err);
    if (status != VOL_OK)
        vol_bytes_free(&file->json);
    return status;
}

/* Stats that cannot be written leave no output: they are ready before any output is in place.  Then they are told anew, so
 * that they know of the writing to pipes; one that is itself a pipe or a device is done with by then. */
static VolStatus commit_with_stats(const Run *run, VolStatus outcome, bool *told, VolError *err)
{
    StatsFile file;
    VolStatus status = prepare_stats(run, outcome, &file, err);
    *told = true;
    if (status)
        return status;
    bool early = *told = file.output.target.direct;
    if (early)
        status = vol_output_commit(&file.output, err);
    if (!status && outputs_some_are_direct(run->outputs)) {
        status = outputs_commit_direct(run->outputs, err);
        vol_stats_stage(run->stats, "write");
        drop_stats(&file);
        if (!status && !early)
            status = prepare_stats(run, outcome, &file, err);
    }
    if (!status)
        status = outputs_commit_files(run->outputs, err);
    if (!status && !early)
        status = vol_output_commit(&file.output, err);
    drop_stats(&file);
    return status;
}

/* A run that failed has stats, too. */
static void write_failed_stats(const Run *run, VolStatus outcome)
{
    StatsFile file;
    if (prepare_stats(run, outcome, &file, NULL) != VOL_OK)
        return; /* there is a worse failure to report */
    vol_output_commit(&file.output, NULL);
    drop_stats(&file);
}

/* Puts in place what a run has made. */
static VolStatus finish(const Run *run, VolStatus outcome, VolError *err)
{
    VolStatus status = outcome;
    bool told = false;
    if (outcome == VOL_OK || outcome == VOL_NO) {
        status = run->stats ? commit_with_stats(run, outcome, &told, err) : outputs_commit_direct(run->outputs, err);
        if (!status && !run->stats)
            status = outputs_commit_files(run->outputs, err);
    }
    outputs_drop(run->outputs);
    if (status && run->stats && !told)
        write_failed_stats(run, status);
    return status ? status : outcome;
}

static VolStatus close_stdout(VolError *err)
{
    if (fflush(stdout) != 0 || ferror(stdout) || close(STDOUT_FILENO) != 0)
        return vol_fail(err, VOL_IO, "cannot write 'stdout': %s", strerror(errno));
    return VOL_OK;
}

/* ---- main ---- */

/* Who was refused memory may have gone on with less, or have taken it for something else. */
static VolStatus judge(VolStatus status, VolError *err)
{
    if (!vol_refusals() || status == VOL_IO || status == VOL_NOMEM)
        return status;
    if (status == VOL_OK || status == VOL_NO)
        return vol_fail_memory(err, 0);
    return vol_fail_within(err, VOL_NOMEM, "out of memory");
}

static VolStatus work(Run *run, VolError *err)
{
    VolStatus status = set_up(run, err);
    if (status != VOL_OK || nothing_to_do(run))
        return status;
    shell_progress_begin(run->program->name, run->common->progress, run->common->quiet,
                         fake_terminal(run->common, "err"));
    status = run->program->main(run, err);
    const char *clear = shell_progress_clear();
    if (write(STDERR_FILENO, clear, strlen(clear)) < 0)
        return status; /* stderr is gone: no reason to fail */
    return status;
}

static VolStatus run_program(Run *run, VolError *err)
{
    const Program *program = run->program;
    const VolCommonOptions *common = run->common;
    if (common->help)
        return print_text(vol_help_text(program->name, program->summary, program->operands, run->table, run->rows), err);
    if (common->version)
        return print_text(version_text(program), err);
    if (common->print_options)
        return print_text(vol_print_options_text(run->line, run->table, run->rows), err);
    return finish(run, judge(work(run, err), err), err);
}

typedef struct Arguments {
    const Program *program;
    int argc;
    char **argv;
} Arguments;

static int main_on_stack(void *user)
{
    const Arguments *arguments = user;
    const Program *program = arguments->program;
    VolError err = {""};
    VolCommandLine line;
    VolStatus status = vol_parse_command_line(program->table, program->rows, program->options, arguments->argc,
                                              arguments->argv, &line, &err);
    if (status == VOL_OK) {
        Outputs outputs = {0};
        Run run = {.program = program, .line = &line, .common = &line.common, .table = program->table,
                   .rows = program->rows, .threads = 1, .outputs = &outputs};
        run.log = (VolLog){.say = say, .user = &run};
        status = run_program(&run, &err);
        vol_stats_free(run.stats);
        free(run.history_line);
        free(run.hashed_line);
    }
    if (status != VOL_OK && status != VOL_NO)
        status = judge(status, &err);
    VolError close_err;
    VolStatus closed = close_stdout(&close_err);
    if (status == VOL_OK && closed != VOL_OK) {
        err = close_err;
        status = closed;
    }
    blame_pipe(status, &err);
    report(program, status, &err);
    vol_command_line_free(&line);
    return (int)status;
}

int program_main(const Program *program, int argc, char **argv)
{
    VolError err = {""};
    Arguments arguments = {program, argc, argv};
    int result = 0;
    occupy_standard_descriptors();
    shell_catch_signals(program->name);
    VolStatus status = shell_with_stack(main_on_stack, &arguments, &result, &err);
    report(program, status, &err);
    result = status ? (int)status : result;
#ifndef VOL_FAULTS /* in sanitizer builds leaks are looked for at exit */
    _exit(result); /* what destructors of C++ libraries do is nothing to us, and may fail when all is done */
#endif
    return result;
}
