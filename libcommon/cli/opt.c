#include "cli/opt.h"

#include <stdlib.h>
#include <string.h>

#include "cli/values.h"
#include "cli/words.h"

#define COMMON(field) offsetof(VolCommonOptions, field)

static const VolOpt common_table[] = {
    {.letter = 'o', .name = "output", .kind = VOL_OPT_TEXT, .offset = COMMON(output), .unrecorded = true,
     .value_name = "FILE", .fallback = "-", .help = "write here; - is standard output"},
    {.letter = 'f', .name = "force", .kind = VOL_OPT_FLAG, .offset = COMMON(force), .unrecorded = true,
     .help = "binary from and to terminals too"},
    {.letter = 'n', .name = "no-clobber", .kind = VOL_OPT_FLAG, .offset = COMMON(no_clobber),
     .unrecorded = true, .help = "do nothing if the output exists"},
    {.letter = 'j', .name = "threads", .kind = VOL_OPT_INT, .offset = COMMON(threads), .unrecorded = true,
     .value_name = "N", .fallback = "0", .help = "threads; 0: as many as this process may use"},
    {.name = "cpu", .kind = VOL_OPT_TEXT, .offset = COMMON(cpu), .unrecorded = true,
     .value_name = "auto|scalar|avx2|avx512|neon", .fallback = "auto",
     .help = "kernels to use; never changes the output"},
    {.name = "seed", .kind = VOL_OPT_INT, .offset = COMMON(seed), .value_name = "N", .fallback = "0",
     .help = "seed of everything random"},
    {.name = "frame", .kind = VOL_OPT_INT, .offset = COMMON(frame), .value_name = "N",
     .help = "fill %04d or #### in file names"},
    {.name = "set", .kind = VOL_OPT_LIST, .offset = COMMON(set), .value_name = "KEY=VALUE",
     .help = "add metadata to the output (repeatable)"},
    {.name = "no-history", .kind = VOL_OPT_FLAG, .offset = COMMON(no_history), .unrecorded = true,
     .help = "leave command lines out of the output"},
    {.letter = 'q', .name = "quiet", .kind = VOL_OPT_FLAG, .offset = COMMON(quiet), .unrecorded = true,
     .help = "errors only"},
    {.letter = 'v', .name = "verbose", .kind = VOL_OPT_FLAG, .offset = COMMON(verbose), .unrecorded = true,
     .help = "notes too (repeatable)"},
    {.name = "progress", .kind = VOL_OPT_CHOICE, .offset = COMMON(progress), .unrecorded = true,
     .choices = "auto|always|never", .fallback = "auto", .help = "auto: on a foreground terminal"},
    {.name = "stats", .kind = VOL_OPT_TEXT, .offset = COMMON(stats), .unrecorded = true, .value_name = "FILE",
     .help = "what was done and what was skipped, as JSON"},
    {.name = "print-options", .kind = VOL_OPT_FLAG, .offset = COMMON(print_options), .unrecorded = true,
     .help = "options in effect, to be read by @FILE"},
    {.letter = 'h', .name = "help", .kind = VOL_OPT_FLAG, .offset = COMMON(help), .unrecorded = true,
     .help = "this text"},
    {.letter = 'V', .name = "version", .kind = VOL_OPT_FLAG, .offset = COMMON(version), .unrecorded = true,
     .help = "version of program and libraries"},
    {.name = "fake-tty", .kind = VOL_OPT_TEXT, .offset = COMMON(fake_tty), .unrecorded = true,
     .value_name = "in|out|err", .hidden = true, .help = "take it for a terminal (tests)"},
};

const VolOpt *vol_common_table(size_t *rows)
{
    *rows = sizeof common_table / sizeof *common_table;
    return common_table;
}

static const char *const later[] = {"time-limit", "checkpoint", "resume", "shard", "deep", "memory-limit"};

typedef struct Parser {
    const VolOpt *table;
    size_t rows;
    void *options;
    VolCommandLine *out;
    VolArena **arena;
    VolWord *words; /* what is left to read is words[next..count-1] */
    size_t next, count;
} Parser;

/* ---- finding options ---- */

static const VolOpt *row_named(const VolOpt *table, size_t rows, const char *name, size_t length)
{
    for (size_t i = 0; i < rows; i++)
        if (table[i].name && strlen(table[i].name) == length && !memcmp(table[i].name, name, length))
            return &table[i];
    return NULL;
}

static const VolOpt *find_name(const Parser *p, const char *name, size_t length)
{
    const VolOpt *row = row_named(p->table, p->rows, name, length);
    return row ? row : row_named(common_table, sizeof common_table / sizeof *common_table, name, length);
}

static const VolOpt *find_letter(const Parser *p, char letter)
{
    for (size_t i = 0; i < p->rows; i++)
        if (p->table[i].name && p->table[i].letter == letter)
            return &p->table[i];
    for (size_t i = 0; i < sizeof common_table / sizeof *common_table; i++)
        if (common_table[i].letter == letter)
            return &common_table[i];
    return NULL;
}

static bool is_common(const VolOpt *option)
{
    return option >= common_table && option < common_table + sizeof common_table / sizeof *common_table;
}

/* Edits (insert, delete, change, swap of neighbours) from a to b; words longer than 31 count as far away. */
static int edit_distance(const char *a, size_t a_length, const char *b)
{
    size_t b_length = strlen(b);
    int d[32][32];
    if (a_length > 31 || b_length > 31)
        return 99;
    for (size_t i = 0; i <= a_length; i++)
        for (size_t j = 0; j <= b_length; j++) {
            if (i == 0 || j == 0) {
                d[i][j] = (int)(i + j);
                continue;
            }
            int best = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
            if (d[i - 1][j] + 1 < best)
                best = d[i - 1][j] + 1;
            if (d[i][j - 1] + 1 < best)
                best = d[i][j - 1] + 1;
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] && d[i - 2][j - 2] + 1 < best)
                best = d[i - 2][j - 2] + 1;
            d[i][j] = best;
        }
    return d[a_length][b_length];
}

static void nearest_in(const VolOpt *table, size_t rows, const char *name, size_t length, int *least, const char **best)
{
    for (size_t i = 0; i < rows; i++) {
        int distance = table[i].name && !table[i].hidden ? edit_distance(name, length, table[i].name) : 99;
        if (distance < *least) {
            *least = distance;
            *best = table[i].name;
        }
    }
}

static VolStatus unknown(const Parser *p, const char *name, size_t length, VolError *err)
{
    for (size_t i = 0; i < sizeof later / sizeof *later; i++)
        if (strlen(later[i]) == length && !memcmp(name, later[i], length))
            return vol_fail(err, VOL_USAGE, "cannot use '--%s': not in this version", later[i]);
    int least = length < 4 ? 2 : length < 7 ? 3 : 4; /* must be nearer than this */
    const char *best = NULL;
    nearest_in(p->table, p->rows, name, length, &least, &best);
    nearest_in(common_table, sizeof common_table / sizeof *common_table, name, length, &least, &best);
    if (best)
        return vol_fail(err, VOL_USAGE, "unknown option '--%.*s': did you mean '--%s'?", (int)length, name, best);
    return vol_fail(err, VOL_USAGE, "unknown option '--%.*s': there is none of that name", (int)length, name);
}

/* ---- taking words ---- */

static VolStatus record(Parser *p, const VolOpt *option, const char *value, bool cleared, VolError *err)
{
    VolCommandLine *out = p->out;
    size_t n = out->use_count;
    if ((n & (n - 1)) == 0) {
        VolOptUse *uses = vol_arena_alloc(p->arena, n ? 2 * n : 1, sizeof *uses);
        if (!uses)
            return vol_fail_memory(err, n * sizeof *uses);
        if (n)
            memcpy(uses, out->uses, n * sizeof *uses);
        out->uses = uses;
    }
    out->uses[out->use_count++] = (VolOptUse){.option = option, .value = value, .cleared = cleared};
    return VOL_OK;
}

static VolStatus apply(Parser *p, const VolOpt *option, const char *value, bool cleared, VolError *err)
{
    VolCommonOptions *common = &p->out->common;
    VolStatus status = record(p, option, value, cleared, err);
    if (status != VOL_OK)
        return status;
    if (is_common(option) && option->offset == COMMON(verbose)) {
        common->verbose = cleared ? 0 : common->verbose + 1;
        return VOL_OK;
    }
    if (is_common(option) && option->offset == COMMON(frame))
        common->frame_given = true;
    if (!is_common(option))
        p->out->given[option - p->table] = true;
    void *options = is_common(option) ? (void *)common : p->options;
    if (cleared) {
        *(bool *)((char *)options + option->offset) = false;
        return VOL_OK;
    }
    return vol_store_value(p->arena, option, options, value, err);
}

static VolStatus take_value(Parser *p, const VolOpt *option, const char **value, VolError *err)
{
    if (p->next == p->count)
        return vol_fail(err, VOL_USAGE, "option '--%s' lacks its value: %s", option->name,
                        option->kind == VOL_OPT_CHOICE ? option->choices : option->value_name);
    *value = p->words[p->next++].text;
    return VOL_OK;
}

static VolStatus take_long(Parser *p, const char *word, VolError *err)
{
    const char *name = word + 2, *equals = strchr(name, '=');
    size_t length = equals ? (size_t)(equals - name) : strlen(name);
    const VolOpt *option = find_name(p, name, length);
    bool cleared = false;
    if (!option && length > 3 && !memcmp(name, "no-", 3)) {
        option = find_name(p, name + 3, length - 3);
        if (option && option->kind != VOL_OPT_FLAG)
            option = NULL;
        cleared = option != NULL;
    }
    if (!option)
        return unknown(p, name, length, err);
    const char *value = equals ? equals + 1 : NULL;
    if (option->kind == VOL_OPT_FLAG && value)
        return vol_fail(err, VOL_USAGE, "option '--%.*s' takes no value: '%s'", (int)length, name, value);
    if (option->kind != VOL_OPT_FLAG && !value) {
        VolStatus status = take_value(p, option, &value, err);
        if (status != VOL_OK)
            return status;
    }
    return apply(p, option, value, cleared, err);
}

static VolStatus take_short(Parser *p, const char *word, VolError *err)
{
    const VolOpt *option = find_letter(p, word[1]), *meant = find_name(p, word + 1, strcspn(word + 1, "="));
    if (meant && word[2]) /* even where -s is an option and "tep" could be its value */
        return vol_fail(err, VOL_USAGE, "unknown option '%s': did you mean '--%s'?", word, meant->name);
    if (!option)
        return vol_fail(err, VOL_USAGE, "unknown option '%s': there is none of that letter", word);
    if (option->kind != VOL_OPT_FLAG) {
        const char *value = word + 2;
        VolStatus status = *value ? VOL_OK : take_value(p, option, &value, err);
        return status == VOL_OK ? apply(p, option, value, false, err) : status;
    }
    /* Flags are not joined, so that a word never hides a second meaning; -vv says -v twice. */
    for (const char *c = word + 1; *c; c++) {
        if (*c != word[1])
            return vol_fail(err, VOL_USAGE, "cannot take '%s' apart: one option per word", word);
        VolStatus status = apply(p, option, NULL, false, err);
        if (status != VOL_OK)
            return status;
    }
    return VOL_OK;
}

/* Puts the words of the file named by words[next - 1] in its place. */
static VolStatus splice_file(Parser *p, const VolWord *word, VolError *err)
{
    if (word->file)
        return vol_fail(err, VOL_USAGE, "cannot read '%s': an @FILE within an @FILE", word->text);
    VolWord *more, *all;
    size_t more_count;
    VolStatus status = vol_read_words(p->arena, word->text + 1, &more, &more_count, err);
    if (status != VOL_OK)
        return status;
    size_t rest = p->count - p->next;
    all = vol_arena_alloc(p->arena, more_count + rest, sizeof *all);
    if (!all)
        return vol_fail_memory(err, (more_count + rest) * sizeof *all);
    if (more_count)
        memcpy(all, more, more_count * sizeof *all);
    if (rest)
        memcpy(all + more_count, p->words + p->next, rest * sizeof *all);
    p->words = all;
    p->next = 0;
    p->count = more_count + rest;
    return VOL_OK;
}

static VolStatus take_operand(Parser *p, const char *text, VolError *err)
{
    VolStatus status = record(p, NULL, text, false, err);
    return status == VOL_OK ? vol_list_append(p->arena, &p->out->operands, text, err) : status;
}

static VolStatus take_words(Parser *p, VolError *err)
{
    bool operands_only = false;
    while (p->next < p->count) {
        VolWord word = p->words[p->next++];
        const char *text = word.text;
        VolStatus status = VOL_OK;
        if (operands_only)
            status = take_operand(p, text, err);
        else if (!strcmp(text, "--"))
            operands_only = true;
        else if (text[0] == '-' && text[1] == '-')
            status = take_long(p, text, err);
        else if (text[0] == '-' && text[1])
            status = take_short(p, text, err);
        else if (text[0] == '@' && text[1])
            status = splice_file(p, &word, err);
        else
            status = take_operand(p, text, err);
        if (status != VOL_OK && word.file)
            return vol_fail_within(err, status, "%s:%d", word.file, word.line);
        if (status != VOL_OK)
            return status;
    }
    return VOL_OK;
}

/* ---- before and after ---- */

static VolStatus set_defaults(Parser *p, const VolOpt *table, size_t rows, void *options, VolError *err)
{
    for (size_t i = 0; i < rows; i++) {
        if (!table[i].name)
            continue;
        vol_clear_value(&table[i], options);
        if (!table[i].fallback)
            continue;
        VolStatus status = vol_store_value(p->arena, &table[i], options, table[i].fallback, err);
        if (status == VOL_USAGE)
            abort(); /* a default that its own option refuses */
        if (status != VOL_OK)
            return status;
    }
    return VOL_OK;
}

/* The first value given to a list replaces its default. */
static void forget_list_defaults(Parser *p)
{
    for (size_t i = 0; i < p->rows; i++)
        if (p->table[i].name && p->table[i].kind == VOL_OPT_LIST && p->table[i].fallback && p->out->given[i]) {
            VolTextList *list = (VolTextList *)(void *)((char *)p->options + p->table[i].offset);
            list->words++;
            list->count--;
        }
}

static VolStatus fill_frames(Parser *p, VolError *err)
{
    VolCommonOptions *common = &p->out->common;
    if (!common->frame_given)
        return VOL_OK;
    const char **fields[] = {&common->output, &common->stats};
    size_t operands = p->out->operands.count;
    for (size_t i = 0; i < operands + 2; i++) {
        const char **field = i < operands ? &p->out->operands.words[i] : fields[i - operands];
        char *filled;
        if (!*field)
            continue;
        VolStatus status = vol_fill_frame(*field, common->frame, &filled, err);
        if (status != VOL_OK)
            return status;
        *field = vol_arena_copy(p->arena, filled, strlen(filled));
        free(filled);
        if (!*field)
            return vol_fail_memory(err, 0);
    }
    return VOL_OK;
}

static VolStatus check_common(const VolCommonOptions *common, VolError *err)
{
    if (common->threads < 0 || common->threads > 1024)
        return vol_fail(err, VOL_USAGE, "bad value '%lld' for '--threads': 0 to 1024 is needed",
                        (long long)common->threads);
    if (common->seed < 0)
        return vol_fail(err, VOL_USAGE, "bad value '%lld' for '--seed': 0 or more is needed", (long long)common->seed);
    for (size_t i = 0; i < common->set.count; i++) {
        const char *equals = strchr(common->set.words[i], '=');
        if (!equals || equals == common->set.words[i])
            return vol_fail(err, VOL_USAGE, "bad value '%s' for '--set': KEY=VALUE is needed", common->set.words[i]);
    }
    return VOL_OK;
}

static VolStatus begin(Parser *p, int argc, char **argv, VolError *err)
{
    p->out->given = vol_arena_alloc(p->arena, p->rows, sizeof *p->out->given);
    p->count = argc > 1 ? (size_t)argc - 1 : 0;
    p->words = vol_arena_alloc(p->arena, p->count, sizeof *p->words);
    if (!p->out->given || !p->words)
        return vol_fail_memory(err, p->count * sizeof *p->words);
    for (size_t i = 0; i < p->count; i++)
        p->words[i] = (VolWord){.text = argv[i + 1]};
    VolStatus status = set_defaults(p, common_table, sizeof common_table / sizeof *common_table, &p->out->common, err);
    return status == VOL_OK ? set_defaults(p, p->table, p->rows, p->options, err) : status;
}

VolStatus vol_parse_command_line(const VolOpt *table, size_t rows, void *options, int argc, char **argv,
                                 VolCommandLine *out, VolError *err)
{
    VolArena *arena = NULL;
    Parser parser = {.table = table, .rows = rows, .options = options, .out = out, .arena = &arena};
    *out = (VolCommandLine){0};
    VolStatus status = begin(&parser, argc, argv, err);
    if (status == VOL_OK)
        status = take_words(&parser, err);
    if (status == VOL_OK) {
        forget_list_defaults(&parser);
        status = check_common(&out->common, err);
    }
    if (status == VOL_OK)
        status = fill_frames(&parser, err);
    out->arena = arena;
    if (status != VOL_OK)
        vol_command_line_free(out);
    return status;
}

void vol_command_line_free(VolCommandLine *line)
{
    vol_arena_free(line->arena);
    *line = (VolCommandLine){0};
}

bool vol_given(const VolCommandLine *line, const VolOpt *table, size_t rows, const char *name)
{
    const VolOpt *row = row_named(table, rows, name, strlen(name));
    if (!row)
        abort();
    return line->given[row - table];
}
