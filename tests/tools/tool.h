/* What the test tools share: TAP lines, files, running a command line, reading pixels back.
 * Functions are static so that each tool stays a single file; a tool uses what it needs. */
#ifndef TESTS_TOOLS_TOOL_H
#define TESTS_TOOLS_TOOL_H

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "io/exr.h"
#include "io/in.h"

#define UNUSED __attribute__((unused))

/* ---- TAP ---- */

static int tap_count, tap_failures;

/* One line of TAP; `why` (NULL: passed) is shown below a failure. */
static UNUSED void tap(const char *why, const char *format, ...) __attribute__((format(printf, 2, 3)));
static UNUSED void tap(const char *why, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    printf("%s %d - ", why ? "not ok" : "ok", ++tap_count);
    vprintf(format, args);
    va_end(args);
    printf("\n");
    if (why) {
        tap_failures++;
        printf("# ");
        for (const char *c = why; *c; c++) {
            putchar(*c);
            if (*c == '\n' && c[1])
                printf("# ");
        }
        printf("\n");
    }
    fflush(stdout);
}

static UNUSED int tap_end(void)
{
    printf("1..%d\n", tap_count);
    return tap_failures != 0;
}

/* A tool that cannot go on: no TAP plan follows, which the runner takes as a failure. */
static UNUSED void die(const char *format, ...) __attribute__((format(printf, 1, 2), noreturn));
static UNUSED void die(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    fprintf(stderr, "test tool: ");
    vfprintf(stderr, format, args);
    va_end(args);
    fprintf(stderr, "\n");
    exit(2);
}

/* ---- text that grows ---- */

typedef struct Text {
    char bytes[8192];
    size_t size;
} Text;

static UNUSED void text_add(Text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static UNUSED void text_add(Text *text, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = vsnprintf(text->bytes + text->size, sizeof text->bytes - text->size, format, args);
    va_end(args);
    if (n < 0 || (size_t)n >= sizeof text->bytes - text->size)
        die("a text of more than %zu bytes", sizeof text->bytes);
    text->size += (size_t)n;
}

/* ---- files and commands ---- */

static UNUSED void write_file(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(data, 1, size, file) != size || fclose(file))
        die("cannot write '%s': %s", path, strerror(errno));
}

static UNUSED json_t *read_json(const char *path)
{
    json_error_t error;
    json_t *json = json_load_file(path, JSON_REJECT_DUPLICATES, &error);
    if (!json)
        die("%s:%d: %s", path, error.line, error.text);
    return json;
}

/* The exit code of a shell command; 128 + n where a signal ended it. */
static UNUSED int run_command(const char *command)
{
    fflush(stdout);
    int status = system(command);
    if (status == -1)
        die("cannot run '%s': %s", command, strerror(errno));
    return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

/* Runs it with stderr going to the file `stderr`; false and a reason where the exit code is not 0. */
static UNUSED bool run_well(const char *command, char *why, size_t why_size)
{
    char line[8192];
    if (snprintf(line, sizeof line, "%s 2>stderr", command) >= (int)sizeof line)
        die("a command of more than %zu bytes", sizeof line);
    int code = run_command(line);
    if (code == 0)
        return true;
    char said[512] = "";
    FILE *file = fopen("stderr", "r");
    if (file) {
        size_t n = fread(said, 1, sizeof said - 1, file);
        said[n] = '\0';
        fclose(file);
    }
    snprintf(why, why_size, "exit code %d: %.2000s\n%s", code, command, said);
    return false;
}

static UNUSED bool same_files(const char *a, const char *b)
{
    VolBytes x = {0}, y = {0};
    bool same = vol_read_whole(a, true, &x, NULL) == VOL_OK && vol_read_whole(b, true, &y, NULL) == VOL_OK &&
                x.size == y.size && memcmp(x.data, y.data, x.size) == 0;
    vol_bytes_free(&x);
    vol_bytes_free(&y);
    return same;
}

/* ---- pixels ---- */

static UNUSED bool read_image(const char *path, VolImage *image, char *why, size_t why_size)
{
    VolBytes bytes = {0};
    VolError error = {""};
    VolStatus status = vol_read_whole(path, true, &bytes, &error);
    if (status == VOL_OK)
        status = vol_exr_read(&bytes, path, image, &error);
    vol_bytes_free(&bytes);
    if (status != VOL_OK)
        snprintf(why, why_size, "%s", error.text);
    return status == VOL_OK;
}

/* The value at pixel (x, y) of the display window, or NaN where the part has no such channel or pixel. */
static UNUSED double pixel(const VolPart *part, const char *channel, int x, int y)
{
    const VolChannel *c = vol_part_channel(part, channel);
    VolBox2 box = part->data_window;
    if (!c || x < box.x0 || x > box.x1 || y < box.y0 || y > box.y1)
        return (double)NAN;
    return (double)c->data[(size_t)(y - box.y0) * vol_box2_width(box) + (size_t)(x - box.x0)];
}

/* Of what `vol-render --probe` prints, {"pixels": [{"x": 0, "y": 0, "channels": {"R": 0.5, ..}}]}: the channels of one
 * pixel (borrowed), or NULL. */
static UNUSED json_t *probed_channels(json_t *probe, int x, int y)
{
    size_t i;
    json_t *entry;
    json_array_foreach (json_object_get(probe, "pixels"), i, entry)
        if (json_integer_value(json_object_get(entry, "x")) == x &&
            json_integer_value(json_object_get(entry, "y")) == y)
            return json_object_get(entry, "channels");
    return NULL;
}

/* |got - want| <= max(floor, rel |want|), and says so in `why` where not. */
static UNUSED bool near(double got, double want, double rel, double floor_, const char *what, char *why, size_t why_size)
{
    double bound = fmax(floor_, rel * fabs(want));
    if (fabs(got - want) <= bound)
        return true;
    snprintf(why, why_size, "%s: got %.17g, want %.17g, off by %.3g, allowed %.3g", what, got, want, fabs(got - want),
             bound);
    return false;
}

#endif
