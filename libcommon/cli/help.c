#include <stdio.h>
#include <string.h>

#include "cli/words.h"

enum { HELP_COLUMN = 32 };

static const char *value_shown(const VolOpt *option)
{
    return option->kind == VOL_OPT_FLAG     ? NULL
           : option->kind == VOL_OPT_CHOICE ? option->choices
                                            : option->value_name;
}

static void add_row(VolText *text, const VolOpt *option)
{
    if (option->hidden)
        return;
    if (!option->name) {
        vol_text_add(text, "\n");
        vol_text_add(text, option->help);
        vol_text_add(text, "\n");
        return;
    }
    char left[160], letter[8] = "    ";
    const char *value = value_shown(option);
    if (option->letter)
        snprintf(letter, sizeof letter, "-%c, ", option->letter);
    int length = snprintf(left, sizeof left, "  %s--%s%s%s", letter, option->name, value ? " " : "", value ? value : "");
    vol_text_add(text, left);
    if (length >= HELP_COLUMN) { /* the help gets a line of its own */
        vol_text_add(text, "\n");
        length = 0;
    }
    snprintf(left, sizeof left, "%*s", HELP_COLUMN - length, "");
    vol_text_add(text, left);
    vol_text_add(text, option->help);
    if (option->fallback) {
        vol_text_add(text, " (default ");
        vol_text_add(text, option->fallback);
        vol_text_add(text, ")");
    }
    vol_text_add(text, "\n");
}

char *vol_help_text(const char *program, const char *summary, const char *operands, const VolOpt *table, size_t rows)
{
    VolText text = {0};
    vol_text_add(&text, "usage: ");
    vol_text_add(&text, program);
    vol_text_add(&text, " [option ...]");
    if (operands && *operands) {
        vol_text_add(&text, " ");
        vol_text_add(&text, operands);
    }
    vol_text_add(&text, "\n\n");
    vol_text_add(&text, summary);
    vol_text_add(&text, "\n");
    if (rows && table[0].name)
        vol_text_add(&text, "\nOptions:\n");
    for (size_t i = 0; i < rows; i++)
        add_row(&text, &table[i]);
    size_t common_rows;
    const VolOpt *common = vol_common_table(&common_rows);
    vol_text_add(&text, "\nOptions of every program:\n");
    for (size_t i = 0; i < common_rows; i++)
        add_row(&text, &common[i]);
    vol_text_add(&text, "  @FILE                         replaced by the words of FILE\n");
    return vol_text_end(&text);
}

/* ---- --print-options ---- */

static void print_use(VolText *text, const VolOpt *option, const char *value, bool cleared)
{
    vol_text_add(text, cleared ? "--no-" : "--");
    vol_text_add(text, option->name);
    if (option->kind != VOL_OPT_FLAG) {
        vol_text_add(text, " ");
        vol_text_add_quoted(text, value);
    }
    vol_text_add(text, "\n");
}

/* Lists and counted flags are printed once per occurrence, everything else as it was given last, or its default. */
static void print_option(VolText *text, const VolCommandLine *line, const VolOpt *option)
{
    bool every = option->kind == VOL_OPT_LIST || !strcmp(option->name, "verbose");
    const VolOptUse *last = NULL;
    for (size_t i = 0; i < line->use_count; i++) {
        if (line->uses[i].option != option)
            continue;
        last = &line->uses[i];
        if (every)
            print_use(text, option, last->value, last->cleared);
    }
    if (last && !every)
        print_use(text, option, last->value, last->cleared);
    else if (!last && option->fallback)
        print_use(text, option, option->fallback, false);
}

char *vol_print_options_text(const VolCommandLine *line, const VolOpt *table, size_t rows)
{
    VolText text = {0};
    for (size_t i = 0; i < rows; i++)
        if (table[i].name && !table[i].hidden)
            print_option(&text, line, &table[i]);
    size_t common_rows;
    const VolOpt *common = vol_common_table(&common_rows);
    for (size_t i = 0; i < common_rows; i++)
        if (!common[i].hidden && strcmp(common[i].name, "print-options"))
            print_option(&text, line, &common[i]);
    return vol_text_end(&text);
}
