/* Command lines: one table per program drives parsing, --help, --print-options and the check of the man page.
 * Nothing here prints or exits. */
#ifndef VOL_CLI_OPT_H
#define VOL_CLI_OPT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/mem.h"
#include "base/number.h"
#include "base/status.h"
#include "base/vec.h"

/* What the field at `offset` of the program's options struct is. */
typedef enum VolOptKind {
    VOL_OPT_FLAG,   /* bool; --name sets, --no-name clears */
    VOL_OPT_INT,    /* int64_t */
    VOL_OPT_REAL,   /* double, finite */
    VOL_OPT_TEXT,   /* const char *: a word, never parsed further */
    VOL_OPT_CHOICE, /* int: index into `choices` ("exact|full|integrals|direct") */
    VOL_OPT_LIST,   /* VolTextList: every occurrence is kept, in order */
    VOL_OPT_VEC3,   /* VolVec3: X,Y,Z finite */
    VOL_OPT_RGB,    /* VolVec3: R,G,B finite */
    VOL_OPT_SIZE,   /* VolSize2: WxH, both at least 1 */
    VOL_OPT_CROP,   /* VolCrop: WxH+X+Y */
    VOL_OPT_LENGTH, /* VolLen: 0.5v, 0.1w; a bare number is refused (it does not say of what) */
    VOL_OPT_WORLD_LENGTH /* the same, but a bare number is world units: for what is a key of a file, which has these */
} VolOptKind;

typedef struct VolTextList {
    const char **words;
    size_t count;
} VolTextList;
typedef struct VolSize2 {
    int64_t width, height;
} VolSize2;
typedef struct VolCrop {
    int64_t width, height, x, y;
} VolCrop;
typedef struct VolLen {
    double value;
    bool voxels; /* else world units */
} VolLen;

typedef struct VolOpt {
    char letter;            /* 0: none */
    const char *name;       /* without the dashes; NULL in a heading row (then only help is used) */
    VolOptKind kind;
    size_t offset;          /* of the field in the options struct */
    const char *value_name; /* "FILE", "X,Y,Z"; NULL for flags; for CHOICE the choices are shown */
    const char *fallback;   /* the default as a user would type it; NULL: none (field is zeroed); a flag's: "yes" */
    const char *help;       /* one line */
    const char *choices;    /* CHOICE only */
    bool hidden;            /* not in --help, man page or --print-options */
    bool input;             /* its value names an input, whose contents count in vol:argsHash and not its name */
    bool unrecorded;        /* not in the history: cannot change what the output says (threads), or tells which part of
                             * the same output is wanted (a crop) */
} VolOpt;

/* The flags every program has, parsed by the same code. */
typedef struct VolCommonOptions {
    bool help, version, force, no_clobber, print_options, no_history;
    bool quiet;
    int64_t verbose; /* number of -v */
    const char *output; /* "-" */
    int64_t threads;
    const char *cpu;
    int progress; /* 0 auto, 1 always, 2 never */
    int64_t seed;
    bool frame_given;
    int64_t frame;
    VolTextList set; /* KEY=VALUE */
    const char *stats;
    const char *fake_tty; /* hidden: "in", "out", "err" treated as terminals, for tests */
} VolCommonOptions;

/* One option or operand, in the order of the command line (after @FILE): for the history and --print-options. */
typedef struct VolOptUse {
    const VolOpt *option; /* NULL: an operand */
    const char *value;    /* as typed; NULL for flags */
    bool cleared;         /* --no-NAME */
} VolOptUse;

typedef struct VolCommandLine {
    VolCommonOptions common;
    VolTextList operands; /* --frame filled in */
    bool *given;          /* one per row of the program's table */
    VolOptUse *uses;
    size_t use_count;
    void *arena; /* owns every word */
} VolCommandLine;

/* Parses argv[1..]: long options (`--name VALUE`, `--name=VALUE`, `--no-flag`), short ones (`-o FILE`, `-j2`), operands
 * anywhere, `--` ends options, `@FILE` is replaced by the words of FILE (# comments, '..' and ".." quotes, no recursion;
 * errors name FILE:LINE).  An option that takes a value takes the next word whatever it starts with (`--up -1,0,0`).
 * Last occurrence wins.  Fills `options` (defaults first).  No prefix abbreviations; an unknown
 * option suggests the nearest.  VOL_USAGE on anything wrong.  Options of later versions (--time-limit, --checkpoint,
 * --resume, --shard, --deep, --memory-limit): VOL_USAGE, "not in this version". */
VolStatus vol_parse_command_line(const VolOpt *table, size_t rows, void *options, int argc, char **argv,
                                 VolCommandLine *out, VolError *err);
void vol_command_line_free(VolCommandLine *line);

/* Index of the row named `name`, for `given`; aborts where there is none (a programming error). */
bool vol_given(const VolCommandLine *line, const VolOpt *table, size_t rows, const char *name);

/* Allocated texts: the help page, and the effective options one per line, re-readable through @FILE. */
char *vol_help_text(const char *program, const char *summary, const char *operands, const VolOpt *table, size_t rows);
char *vol_print_options_text(const VolCommandLine *line, const VolOpt *table, size_t rows);

/* The table of the common flags, for the man page check. */
const VolOpt *vol_common_table(size_t *rows);

/* Replaces %04d forms and runs of # by the frame number; a single # is VOL_USAGE ("1 or 4 digits?"). */
VolStatus vol_fill_frame(const char *pattern, int64_t frame, char **out, VolError *err);

#endif
