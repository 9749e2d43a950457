#include "cli/words.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- arena ---- */

struct VolArena {
    VolArena *next;
    max_align_t data[];
};

void *vol_arena_alloc(VolArena **arena, size_t count, size_t size)
{
    size_t bytes;
    if (__builtin_mul_overflow(count, size, &bytes) || __builtin_add_overflow(bytes, sizeof(VolArena), &bytes))
        return NULL;
    VolArena *block = vol_alloc_zero(bytes, 1);
    if (!block)
        return NULL;
    block->next = *arena;
    *arena = block;
    return block->data;
}

char *vol_arena_copy(VolArena **arena, const char *text, size_t length)
{
    char *copy = vol_arena_alloc(arena, length + 1, 1);
    if (copy)
        memcpy(copy, text, length);
    return copy;
}

void vol_arena_free(VolArena *arena)
{
    while (arena) {
        VolArena *next = arena->next;
        free(arena);
        arena = next;
    }
}

VolStatus vol_list_append(VolArena **arena, VolTextList *list, const char *word, VolError *err)
{
    size_t n = list->count;
    if ((n & (n - 1)) == 0) { /* full, or none yet */
        const char **words = vol_arena_alloc(arena, n ? 2 * n : 1, sizeof *words);
        if (!words)
            return vol_fail_memory(err, (n ? 2 * n : 1) * sizeof *words);
        if (n)
            memcpy(words, list->words, n * sizeof *words);
        list->words = words;
    }
    list->words[list->count++] = word;
    return VOL_OK;
}

/* ---- texts ---- */

void vol_text_add(VolText *text, const char *more)
{
    if (vol_bytes_append(&text->bytes, &text->capacity, more, strlen(more), NULL) != VOL_OK)
        text->failed = true;
}

void vol_text_add_quoted(VolText *text, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%+,-./:=^_";
    /* '=' and '@' mean something at the start only, and @ is quoted anywhere. */
    if (*word && word[strspn(word, plain)] == 0) {
        vol_text_add(text, word);
        return;
    }
    vol_text_add(text, "'");
    for (const char *quote; (quote = strchr(word, '\'')); word = quote + 1) {
        if (vol_bytes_append(&text->bytes, &text->capacity, word, (size_t)(quote - word), NULL) != VOL_OK)
            text->failed = true;
        vol_text_add(text, "'\\''");
    }
    vol_text_add(text, word);
    vol_text_add(text, "'");
}

char *vol_text_end(VolText *text)
{
    if (vol_bytes_append(&text->bytes, &text->capacity, "", 1, NULL) != VOL_OK || text->failed) {
        vol_bytes_free(&text->bytes);
        return NULL;
    }
    return (char *)text->bytes.data;
}

/* ---- @FILE ---- */

typedef struct Scanner {
    VolArena **arena;
    const char *file, *at, *end;
    int line;
    VolWord *words;
    size_t count;
} Scanner;

static VolStatus add_word(Scanner *scan, const char *text, size_t length, int line, VolError *err)
{
    size_t n = scan->count;
    if ((n & (n - 1)) == 0) {
        VolWord *words = vol_arena_alloc(scan->arena, n ? 2 * n : 1, sizeof *words);
        if (!words)
            return vol_fail_memory(err, n * sizeof *words);
        if (n)
            memcpy(words, scan->words, n * sizeof *words);
        scan->words = words;
    }
    char *copy = vol_arena_copy(scan->arena, text, length);
    if (!copy)
        return vol_fail_memory(err, length);
    scan->words[scan->count++] = (VolWord){.text = copy, .file = scan->file, .line = line};
    return VOL_OK;
}

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

static void skip_blanks_and_comments(Scanner *scan)
{
    while (scan->at < scan->end && (blank(*scan->at) || *scan->at == '#')) {
        if (*scan->at == '#')
            while (scan->at < scan->end && *scan->at != '\n')
                scan->at++;
        else if (*scan->at++ == '\n')
            scan->line++;
    }
}

/* Takes one word into `out`, which has room for all that is left. */
static VolStatus scan_word(Scanner *scan, char *out, size_t *length, VolError *err)
{
    int start = scan->line;
    char quote = 0;
    size_t n = 0;
    for (; scan->at < scan->end; scan->at++) {
        char c = *scan->at;
        bool last = scan->at + 1 == scan->end;
        if (!quote && blank(c))
            break;
        if (c == 0)
            return vol_fail(err, VOL_USAGE, "%s:%d: a NUL byte", scan->file, scan->line);
        if (c == '\n')
            scan->line++;
        if (!quote && (c == '\'' || c == '"'))
            quote = c;
        else if (c == quote)
            quote = 0;
        else if (c == '\\' && !last && (!quote || (quote == '"' && (scan->at[1] == '"' || scan->at[1] == '\\'))))
            out[n++] = *++scan->at;
        else
            out[n++] = c;
    }
    if (quote)
        return vol_fail(err, VOL_USAGE, "%s:%d: quote without an end", scan->file, start);
    *length = n;
    return VOL_OK;
}

static VolStatus scan_words(Scanner *scan, VolError *err)
{
    size_t room = (size_t)(scan->end - scan->at) + 1;
    char *buffer = vol_alloc(room, 1);
    if (!buffer)
        return vol_fail_memory(err, room);
    VolStatus status = VOL_OK;
    for (;;) {
        skip_blanks_and_comments(scan);
        if (scan->at == scan->end)
            break;
        int line = scan->line;
        size_t length = 0;
        status = scan_word(scan, buffer, &length, err);
        if (status == VOL_OK)
            status = add_word(scan, buffer, length, line, err);
        if (status != VOL_OK)
            break;
    }
    free(buffer);
    return status;
}

static VolStatus read_text(const char *path, VolBytes *out, VolError *err)
{
    FILE *file = fopen(path, "re");
    if (!file)
        return vol_fail(err, VOL_USAGE, "cannot read '%s': %s", path, strerror(errno));
    VolStatus status = VOL_OK;
    size_t capacity = 0, got;
    char block[4096];
    while (status == VOL_OK && (got = fread(block, 1, sizeof block, file)) > 0)
        status = vol_bytes_append(out, &capacity, block, got, err);
    if (status == VOL_OK && ferror(file))
        status = vol_fail(err, VOL_USAGE, "cannot read '%s': %s", path, strerror(errno));
    fclose(file);
    return status;
}

VolStatus vol_read_words(VolArena **arena, const char *path, VolWord **words, size_t *count, VolError *err)
{
    VolBytes bytes = {0};
    VolStatus status = read_text(path, &bytes, err);
    if (status == VOL_OK && bytes.size) {
        const char *text = (const char *)bytes.data;
        Scanner scan = {.arena = arena, .file = path, .at = text, .end = text + bytes.size, .line = 1};
        status = scan_words(&scan, err);
        *words = scan.words;
        *count = scan.count;
    } else {
        *words = NULL;
        *count = 0;
    }
    vol_bytes_free(&bytes);
    return status;
}
