#include "cli/history.h"

#include <string.h>

#include "base/descriptor.h"
#include "base/hash.h"
#include "cli/words.h"

/* The value with descriptors' names written as "-": their numbers are the shell's affair.  They stand alone or behind
 * what a specification has before a file's name (env:/dev/fd/63). */
static void add_value(VolText *out, const char *value)
{
    VolText plain = {0};
    for (char before = ':'; *value;) {
        size_t length = strchr(":=,@", before) ? vol_descriptor_name(value, NULL) : 0;
        char one[2] = {before = length ? '-' : *value, 0};
        vol_text_add(&plain, one);
        value += length ? length : 1;
    }
    char *text = vol_text_end(&plain);
    if (text)
        vol_text_add_quoted(out, text);
    else
        out->failed = true;
    vol_bytes_free(&plain.bytes);
}

static void add_key(VolText *out, const char *setting)
{
    char key[256] = "";
    strncat(key, setting, strcspn(setting, "=") < sizeof key ? strcspn(setting, "=") : sizeof key - 1);
    vol_text_add_quoted(out, key);
}

static void add_use(VolText *out, const VolOptUse *use, bool inputs)
{
    vol_text_add(out, " ");
    if (!use->option) {
        add_value(out, use->value);
        return;
    }
    vol_text_add(out, use->cleared ? "--no-" : "--");
    vol_text_add(out, use->option->name);
    if (use->option->kind == VOL_OPT_FLAG || (use->option->input && !inputs))
        return;
    vol_text_add(out, " ");
    if (!strcmp(use->option->name, "set"))
        add_key(out, use->value);
    else
        add_value(out, use->value);
}

static char *line_of(const char *program, const VolCommandLine *line, bool with_operands, bool inputs)
{
    VolText text = {0};
    vol_text_add(&text, program);
    for (size_t i = 0; i < line->use_count; i++) {
        const VolOptUse *use = &line->uses[i];
        if (use->option ? !use->option->unrecorded : with_operands)
            add_use(&text, use, inputs);
    }
    return vol_text_end(&text);
}

char *vol_history_line(const char *program, const VolCommandLine *line, bool with_operands)
{
    return line_of(program, line, with_operands, true);
}

char *vol_hashed_line(const char *program, const VolCommandLine *line, bool with_operands)
{
    return line_of(program, line, with_operands, false);
}

char *vol_history_append(const char *prior, const char *line)
{
    return prior && *prior ? vol_format_text("%s\n%s", prior, line) : vol_copy_text(line);
}

void vol_args_hash(const char *hashed_line, const uint64_t (*input_digests)[2], size_t inputs, char out[33])
{
    VolHash hash;
    uint64_t digest[2];
    vol_hash_begin(&hash);
    vol_hash_add(&hash, VOL_VERSION, sizeof VOL_VERSION);
    vol_hash_add(&hash, hashed_line, strlen(hashed_line) + 1);
    for (size_t i = 0; i < inputs; i++) {
        char hex[33]; /* in text, so that the machine's byte order does not matter */
        vol_hash_hex(input_digests[i], hex);
        vol_hash_add(&hash, hex, sizeof hex);
    }
    vol_hash_end(&hash, digest);
    vol_hash_hex(digest, out);
}
