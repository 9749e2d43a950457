/* Words: where they live, how an @FILE is cut into them, how they are quoted to be read again.  Used within cli/ only. */
#ifndef VOL_CLI_WORDS_H
#define VOL_CLI_WORDS_H

#include <stddef.h>

#include "base/mem.h"
#include "base/status.h"
#include "cli/opt.h"

/* Memory that is released all at once: a list of blocks. */
typedef struct VolArena VolArena;

void *vol_arena_alloc(VolArena **arena, size_t count, size_t size); /* zeroed; NULL: out of memory */
char *vol_arena_copy(VolArena **arena, const char *text, size_t length);
void vol_arena_free(VolArena *arena);

/* Appends; the array's capacity is the power of two at or above its count. */
VolStatus vol_list_append(VolArena **arena, VolTextList *list, const char *word, VolError *err);

typedef struct VolWord {
    const char *text;
    const char *file; /* the @FILE it stands in; NULL: the command line */
    int line;
} VolWord;

/* Cuts the file into words: blanks separate; # at a word's start begins a comment; '..' is literal; in ".." a backslash
 * protects " \ and itself; elsewhere it protects any character.  VOL_USAGE where it cannot be read or a quote
 * stays open. */
VolStatus vol_read_words(VolArena **arena, const char *path, VolWord **words, size_t *count, VolError *err);

/* A text that grows; a want of memory is remembered and shows in vol_text_end. */
typedef struct VolText {
    VolBytes bytes;
    size_t capacity;
    bool failed;
} VolText;

void vol_text_add(VolText *text, const char *more);
void vol_text_add_quoted(VolText *text, const char *word); /* in '..' where a shell or an @FILE would need it */
char *vol_text_end(VolText *text);                         /* allocated; NULL: out of memory */

#endif
