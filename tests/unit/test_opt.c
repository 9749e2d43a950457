/* cli/: the command line, the @FILE, help, the history. */
#include <stdlib.h>
#include <unistd.h>

#include "cli/history.h"
#include "cli/opt.h"
#include "tests/unit/test.h"

typedef struct Options {
    bool precise, shaded;
    int64_t samples, inner;
    double fov;
    const char *tf;
    int estimator;
    VolTextList lights, names;
    VolVec3 up, background;
    VolSize2 size;
    VolCrop crop;
    VolLen step;
} Options;

#define AT(field) offsetof(Options, field)
static const VolOpt table[] = {
    {.help = "Camera:"},
    {.letter = 'p', .name = "precise", .kind = VOL_OPT_FLAG, .offset = AT(precise), .help = "in double"},
    {.name = "shaded", .kind = VOL_OPT_FLAG, .offset = AT(shaded), .fallback = "yes", .help = "with light"},
    {.letter = 's', .name = "samples", .kind = VOL_OPT_INT, .offset = AT(samples), .value_name = "N", .fallback = "1",
     .help = "per pixel"},
    {.name = "fov", .kind = VOL_OPT_REAL, .offset = AT(fov), .value_name = "DEG", .fallback = "40",
     .help = "vertical"},
    {.letter = 't', .name = "tf", .kind = VOL_OPT_TEXT, .offset = AT(tf), .value_name = "FILE", .input = true,
     .help = "transfer function"},
    {.name = "estimator", .kind = VOL_OPT_CHOICE, .offset = AT(estimator), .choices = "exact|full|integrals|direct",
     .fallback = "exact",
     .help = "how"},
    {.name = "light", .kind = VOL_OPT_LIST, .offset = AT(lights), .value_name = "SPEC", .help = "a light"},
    {.name = "name", .kind = VOL_OPT_LIST, .offset = AT(names), .value_name = "NAME", .fallback = "density",
     .help = "names"},
    {.name = "up", .kind = VOL_OPT_VEC3, .offset = AT(up), .value_name = "X,Y,Z", .fallback = "0,1,0",
     .help = "up"},
    {.name = "background", .kind = VOL_OPT_RGB, .offset = AT(background), .value_name = "R,G,B", .fallback = "0,0,0",
     .help = "behind"},
    {.name = "size", .kind = VOL_OPT_SIZE, .offset = AT(size), .value_name = "WxH", .fallback = "512x256",
     .help = "pixels"},
    {.name = "crop", .kind = VOL_OPT_CROP, .offset = AT(crop), .value_name = "WxH+X+Y", .help = "window"},
    {.name = "step", .kind = VOL_OPT_LENGTH, .offset = AT(step), .value_name = "LEN", .fallback = "1v",
     .help = "step"},
    {.name = "inner", .kind = VOL_OPT_INT, .offset = AT(inner), .value_name = "N", .hidden = true,
     .help = "not shown"},
};
enum { ROWS = sizeof table / sizeof *table, MAX_WORDS = 40 };

static Options o;
static VolCommandLine line;
static VolError err;

/* Words are separated by single spaces; the line of the last parse is released by the next. */
static VolStatus parse(const char *words)
{
    static char copy[2000];
    char *argv[MAX_WORDS] = {copy};
    int argc = 1;
    vol_command_line_free(&line);
    o = (Options){0};
    snprintf(copy, sizeof copy, "prog %s", words);
    for (char *c = copy; (c = strchr(c, ' ')) && argc < MAX_WORDS;) {
        *c++ = 0;
        argv[argc++] = c;
    }
    return vol_parse_command_line(table, ROWS, &o, *words ? argc : 1, argv, &line, &err);
}

static void check_usage(const char *words, const char *part_of_message)
{
    VolStatus status = parse(words);
    if (status != VOL_USAGE)
        FAIL("'%s' gives %d, not 2", words, (int)status);
    else if (!strstr(err.text, part_of_message))
        FAIL("'%s' says '%s', not '%s'", words, err.text, part_of_message);
}

static void test_defaults(void)
{
    CHECK(parse("") == VOL_OK);
    CHECK(!o.precise && o.shaded && o.samples == 1 && o.fov == 40 && !o.tf && o.estimator == 0);
    CHECK(o.lights.count == 0 && o.names.count == 1 && o.up.y == 1 && o.size.width == 512 && o.size.height == 256);
    CHECK(o.step.voxels && o.step.value == 1 && line.operands.count == 0);
    CHECK(!vol_given(&line, table, ROWS, "samples"));
    CHECK_TEXT(line.common.output, "-");
    CHECK_TEXT(line.common.cpu, "auto");
    CHECK(line.common.threads == 0 && line.common.seed == 0 && !line.common.frame_given && !line.common.stats);
}

static void test_forms(void)
{
    CHECK(parse("a --samples=4 -t x.json - -j2 --up -1,0,2.5 -o out --precise b --no-shaded -vv -v -q") == VOL_OK);
    CHECK(o.samples == 4 && o.precise && !o.shaded && o.up.x == -1 && o.up.z == 2.5);
    CHECK_TEXT(o.tf, "x.json");
    CHECK_TEXT(line.common.output, "out");
    CHECK(line.common.threads == 2 && line.common.verbose == 3 && line.common.quiet);
    CHECK(line.operands.count == 3 && !strcmp(line.operands.words[1], "-") && !strcmp(line.operands.words[2], "b"));
    CHECK(vol_given(&line, table, ROWS, "samples") && vol_given(&line, table, ROWS, "shaded"));
    CHECK(!vol_given(&line, table, ROWS, "fov"));
    CHECK(parse("--tf= --tf -x --fov -5 -s-3") == VOL_OK); /* a value may start with a dash; the last one wins */
    CHECK_TEXT(o.tf, "-x");
    CHECK(o.fov == -5 && o.samples == -3);
    CHECK(parse("-- --precise @x -t") == VOL_OK && line.operands.count == 3 && !o.precise);
}

static void test_kinds(void)
{
    CHECK(parse("--estimator integrals --size 3x4 --crop 5x6+7+-8 --step 0.25w --background 1,.5,1e-3") == VOL_OK);
    CHECK(o.estimator == 2 && o.size.width == 3 && o.size.height == 4);
    CHECK(o.crop.width == 5 && o.crop.height == 6 && o.crop.x == 7 && o.crop.y == -8);
    CHECK(!o.step.voxels && o.step.value == 0.25 && o.background.z == 1e-3);
    CHECK(parse("--light a --light b --light c --name d --name e --light f --light g") == VOL_OK);
    CHECK(o.lights.count == 5 && !strcmp(o.lights.words[4], "g"));
    CHECK(o.names.count == 2 && !strcmp(o.names.words[0], "d")); /* the default is replaced */
}

static void test_refusals(void)
{
    check_usage("--stepp 1v", "did you mean '--step'?");
    check_usage("--smaples 1", "did you mean '--samples'?");
    check_usage("--treads 1", "did you mean '--threads'?");
    check_usage("--inne 1", "none of that name"); /* hidden ones are not suggested */
    check_usage("--sampl 3", "unknown option '--sampl'"); /* no abbreviations */
    check_usage("-step 1v", "did you mean '--step'?");
    check_usage("-z", "unknown option '-z'");
    check_usage("-pq", "one option per word");
    check_usage("--tf", "lacks its value");
    check_usage("--precise=1", "takes no value");
    check_usage("--no-tf", "unknown option");
    for (const char *bad = "nan\0inf\0-inf\0001e999\00012x\0 1\0\0"; *bad; bad += strlen(bad) + 1) {
        char *argv[] = {(char *)"prog", (char *)"--fov", (char *)bad};
        vol_command_line_free(&line);
        CHECK(vol_parse_command_line(table, ROWS, &o, 3, argv, &line, &err) == VOL_USAGE);
    }
    check_usage("--fov=", "finite number");
    check_usage("--samples 1.5", "whole number");
    check_usage("--samples 99999999999999999999", "whole number");
    check_usage("--estimator exac", "exact|full|integrals|direct");
    check_usage("--up 1,2", "three finite numbers");
    check_usage("--up 1,2,3,4", "three finite numbers");
    check_usage("--up 1,2,", "three finite numbers");
    check_usage("--size 0x4", "at least 1");
    check_usage("--size 4", "WxH");
    check_usage("--size 4x-4", "WxH");
    check_usage("--size 4x4x4", "WxH");
    check_usage("--crop 4x4+1", "WxH+X+Y");
    check_usage("--step 1", "voxels");
    check_usage("--step v", "voxels");
    check_usage("--step -1v", "voxels");
    check_usage("-j 2000", "0 to 1024");
    check_usage("--seed -1", "0 or more");
    check_usage("--set novalue", "KEY=VALUE");
    check_usage("--progress often", "auto|always|never");
}

static void test_later_versions(void)
{
    static const char *const names[] = {"time-limit", "checkpoint", "resume", "shard", "deep", "memory-limit"};
    for (size_t i = 0; i < 6; i++) {
        char words[64];
        snprintf(words, sizeof words, "--%s=1", names[i]);
        check_usage(words, "not in this version");
    }
}

/* ---- @FILE ---- */

static char file_name[] = "/tmp/test_opt-XXXXXX";

static void write_file(const char *text)
{
    FILE *file = fopen(file_name, "w");
    fputs(text, file);
    fclose(file);
}

static VolStatus parse_with_file(const char *before, const char *after)
{
    char words[300];
    snprintf(words, sizeof words, "%s@%s%s", before, file_name, after);
    return parse(words);
}

static void test_file(void)
{
    write_file("# look\n--samples 3 # not 4\n--tf 'a b'\\''c' --light \"x\\\"y # \\z\"\n\n  op#1 '' --name=q\\ r");
    CHECK(parse_with_file("first ", " last --samples 5") == VOL_OK);
    CHECK_TEXT(o.tf, "a b'c");
    CHECK(o.samples == 5 && o.lights.count == 1);
    CHECK_TEXT(o.lights.words[0], "x\"y # \\z");
    CHECK_TEXT(o.names.words[0], "q r");
    CHECK(line.operands.count == 4);
    CHECK_TEXT(line.operands.words[1], "op#1");
    CHECK_TEXT(line.operands.words[2], "");
    CHECK_TEXT(line.operands.words[3], "last");
    CHECK(parse("--tf @notread") == VOL_OK); /* a value, no operand */
    write_file("");
    CHECK(parse_with_file("", "") == VOL_OK && line.operands.count == 0);
}

static void check_file_error(const char *text, int at_line, const char *part)
{
    char place[100];
    write_file(text);
    CHECK(parse_with_file("", "") == VOL_USAGE);
    snprintf(place, sizeof place, "%s:%d: ", file_name, at_line);
    if (strncmp(err.text, place, strlen(place)) != 0 || !strstr(err.text, part))
        FAIL("'%s' instead of '%s..%s'", err.text, place, part);
}

static void test_file_errors(void)
{
    check_file_error("--samples 3\n\n--stepp 1v\n", 3, "did you mean '--step'?");
    check_file_error("a\nb 'c\nd", 2, "quote without an end");
    check_file_error("x\n@other", 2, "an @FILE within an @FILE");
    check_file_error("'a\nb'\n--fov x", 3, "finite number");
    check_usage("@/nowhere/args", "cannot read '/nowhere/args'");
}

static void test_print_options(void)
{
    CHECK(parse("--light a'b --light --x --tf @y --no-shaded -p --samples 7 --set k=v w -vv") == VOL_OK);
    char *text = vol_print_options_text(&line, table, ROWS);
    CHECK(strstr(text, "--samples 7\n") && strstr(text, "--fov 40\n") && strstr(text, "--no-shaded\n"));
    CHECK(!strstr(text, "--inner") && !strstr(text, "--crop"));
    write_file(text);
    CHECK(parse_with_file("", "") == VOL_OK);
    CHECK(o.lights.count == 2 && o.precise && !o.shaded && o.samples == 7 && line.common.verbose == 2);
    CHECK_TEXT(o.lights.words[0], "a'b");
    CHECK_TEXT(o.lights.words[1], "--x");
    CHECK_TEXT(o.tf, "@y");
    char *again = vol_print_options_text(&line, table, ROWS);
    CHECK_TEXT(again, text);
    free(text);
    free(again);
}

static void test_help(void)
{
    char *text = vol_help_text("prog", "Does one thing.", "[IN]", table, ROWS);
    CHECK(!strncmp(text, "usage: prog [option ...] [IN]\n", 30) && strstr(text, "\nDoes one thing.\n"));
    CHECK(strstr(text, "\nCamera:\n") && strstr(text, "  -s, --samples N ") && strstr(text, "(default 512x256)"));
    CHECK(strstr(text, "--estimator exact|full|integrals|direct") && !strstr(text, "--inner"));
    size_t rows;
    const VolOpt *common = vol_common_table(&rows);
    for (size_t i = 0; i < rows; i++)
        CHECK(common[i].hidden == !strstr(text, common[i].name));
    free(text);
}

/* ---- frames ---- */

static void check_frame(const char *pattern, int64_t frame, const char *want)
{
    char *got = NULL;
    CHECK(vol_fill_frame(pattern, frame, &got, &err) == VOL_OK);
    if (got)
        CHECK_TEXT(got, want);
    free(got);
}

static void test_frames(void)
{
    check_frame("a.%04d.vdb", 7, "a.0007.vdb");
    check_frame("a.####.vdb", 12345, "a.12345.vdb");
    check_frame("%d/##.%03d", 5, "5/05.005");
    check_frame("100%%.%d", 1, "100%.1");
    check_frame("%s %5d %", 3, "%s %5d %");
    check_frame("####", -5, "-005");
    check_frame("", 1, "");
    char *got;
    CHECK(vol_fill_frame("a.#.vdb", 1, &got, &err) == VOL_USAGE && strstr(err.text, "1 or 4 digits?"));
    CHECK(parse("in.####.vdb -o out.%02d.exr --stats s.##.json --frame 9") == VOL_OK);
    CHECK_TEXT(line.operands.words[0], "in.0009.vdb");
    CHECK_TEXT(line.common.output, "out.09.exr");
    CHECK_TEXT(line.common.stats, "s.09.json");
    CHECK(line.common.frame_given && line.common.frame == 9);
    CHECK(parse("in.####.vdb") == VOL_OK);
    CHECK_TEXT(line.operands.words[0], "in.####.vdb");
}

/* ---- history ---- */

static void check_history(const char *words, bool with_operands, const char *want)
{
    CHECK(parse(words) == VOL_OK);
    char *got = vol_history_line("prog", &line, with_operands);
    CHECK_TEXT(got, want);
    free(got);
}

static void test_history(void)
{
    check_history("in.vdb -o x -f -n -j3 --cpu scalar -q -v --progress never --stats s --no-history", false, "prog");
    check_history("in.vdb -p --tf=a'b --no-shaded --seed 3", false, "prog --precise --tf 'a'\\''b' --no-shaded --seed 3");
    check_history("field --samples 2 sphere", true, "prog field --samples 2 sphere");
    check_history("-t /dev/fd/63 --light env:/proc/self/fd/7:1,2,3 --light /dev/stdin", false,
                  "prog --tf - --light env:-:1,2,3 --light -");
    check_history("-t //dev/./fd/63 -t /proc/4711/fd/63#skin -t /proc/self/task/9/fd/3 -t /proc/thread-self/fd/3", false,
                  "prog --tf - --tf '-#skin' --tf - --tf -");
    check_history("-t /tmp/dev/fd/63 -t /dev/fd/63/x.json -t /dev/stdin2 -t /proc/self/maps", false,
                  "prog --tf /tmp/dev/fd/63 --tf /dev/fd/63/x.json --tf /dev/stdin2 --tf /proc/self/maps");
    check_history("--set owner=me --set k=secret=x", false, "prog --set owner --set k");
    CHECK(parse("-t a.json --light sun -t b.json#skin w") == VOL_OK);
    char *hashed = vol_hashed_line("prog", &line, true);
    CHECK_TEXT(hashed, "prog --tf --light sun --tf w");
    free(hashed);
    char *both = vol_history_append("a\n\tb", "c"), *one = vol_history_append(NULL, "c");
    char *two = vol_history_append("", "c");
    CHECK_TEXT(both, "a\n\tb\nc");
    CHECK_TEXT(one, "c");
    CHECK_TEXT(two, "c");
    free(both);
    free(one);
    free(two);
}

static void test_args_hash(void)
{
    const uint64_t digests[2][2] = {{1, 2}, {3, 4}}, swapped[2][2] = {{3, 4}, {1, 2}};
    char a[33], b[33];
    vol_args_hash("prog -x", digests, 2, a);
    CHECK(strlen(a) == 32 && strspn(a, "0123456789abcdef") == 32);
    vol_args_hash("prog -x", digests, 2, b);
    CHECK_TEXT(a, b);
    vol_args_hash("prog -y", digests, 2, b);
    CHECK(strcmp(a, b) != 0);
    vol_args_hash("prog -x", swapped, 2, b);
    CHECK(strcmp(a, b) != 0);
    vol_args_hash("prog -x", digests, 1, b);
    CHECK(strcmp(a, b) != 0);
}

int main(void)
{
    close(mkstemp(file_name));
    RUN(test_defaults);
    RUN(test_forms);
    RUN(test_kinds);
    RUN(test_refusals);
    RUN(test_later_versions);
    RUN(test_file);
    RUN(test_file_errors);
    RUN(test_print_options);
    RUN(test_help);
    RUN(test_frames);
    RUN(test_history);
    RUN(test_args_hash);
    vol_command_line_free(&line);
    unlink(file_name);
    return test_end();
}
