/* For the tests of transfer functions: parsing a text, and collecting what is said. */
#ifndef TESTS_UNIT_TF_HELP_H
#define TESTS_UNIT_TF_HELP_H

#include "tf/tf.h"

#include <stdio.h>
#include <string.h>

#define HEAD "{\"pellucid\": \"transfer-function/1\""

static char tf_said[2048];

static void tf_collect(void *user, VolSeverity severity, const char *line)
{
    (void)user;
    size_t n = strlen(tf_said);
    snprintf(tf_said + n, sizeof tf_said - n, "%s: %s\n", severity == VOL_WARNING ? "warning" : "note", line);
}

static const VolLog tf_log = {tf_collect, NULL};

__attribute__((unused)) static VolStatus tf_parse_bytes(const char *text, size_t size, VolTf *tf, VolError *err)
{
    char copy[1 << 16]; /* the library must not write into it, nor need a NUL */
    tf_said[0] = 0;
    memcpy(copy, text, size);
    VolBytes bytes = {(unsigned char *)copy, size};
    return vol_tf_parse(&bytes, "look.json", tf, &tf_log, err);
}

__attribute__((unused)) static VolStatus tf_parse(const char *text, VolTf *tf, VolError *err)
{
    return tf_parse_bytes(text, strlen(text), tf, err);
}

#endif
