/* Environments: directions, what is refused, and the suns that stand for them. */
#include "test.h"

#include <stdlib.h>

#include "base/random.h"
#include "trace/environment.h"

static const double PI = 3.14159265358979323846, white[3] = {1, 1, 1};
static int warnings;

static void count_warnings(void *user, VolSeverity severity, const char *line)
{
    (void)user;
    (void)line;
    warnings += severity == VOL_WARNING;
}

static const VolLog log_warnings = {count_warnings, NULL};

enum { WIDTH = 48, HEIGHT = 24, SUNS = 32 };

typedef struct Picture {
    float rgb[HEIGHT][WIDTH][3];
} Picture;

static VolEnvironment environment_of(const Picture *picture)
{
    VolEnvironment e;
    VolError err = {{0}};
    CHECK(vol_environment_new(&picture->rgb[0][0][0], 3, WIDTH, HEIGHT, white, "sky", &log_warnings, &e, &err) == VOL_OK);
    return e;
}

/* Values between 2^-5 and 2^5 without pattern. */
static void fill(Picture *picture)
{
    unsigned state = 1;
    for (int n = 0; n < HEIGHT * WIDTH * 3; n++) {
        state = state * 1664525u + 1013904223u;
        (&picture->rgb[0][0][0])[n] = (float)exp2((double)(state >> 8) / (1 << 24) * 10 - 5);
    }
}

static void test_directions(void)
{
    VolEnvironment e = {.width = WIDTH, .height = HEIGHT};
    static const struct {
        double column, row;
        VolVec3 want;
    } places[] = {{3, 0, {0, 1, 0}}, {3, HEIGHT, {0, -1, 0}}, {WIDTH / 2, HEIGHT / 2, {0, 0, 1}},
                  {WIDTH / 4, HEIGHT / 2, {1, 0, 0}}, {3 * WIDTH / 4, HEIGHT / 2, {-1, 0, 0}}, {0, HEIGHT / 2, {0, 0, -1}}};
    for (size_t n = 0; n < sizeof places / sizeof *places; n++)
        CHECK_NEAR(vol_length(vol_sub(vol_environment_direction(&e, places[n].column, places[n].row), places[n].want)), 0, 0,
                   1e-15);
}

static void test_power(void)
{
    Picture even;
    double rgb[3];
    for (int n = 0; n < HEIGHT * WIDTH * 3; n++)
        (&even.rgb[0][0][0])[n] = (float)(n % 3 + 1);
    VolEnvironment e = environment_of(&even);
    vol_environment_power(&e, rgb);
    for (int c = 0; c < 3; c++)
        CHECK_NEAR(rgb[c], 4 * PI * (c + 1), 1e-13, 0);
    vol_environment_free(&e);
}

/* No light is made or lost, whatever the number; the brightest comes first. */
static void test_conservation(void)
{
    static const size_t numbers[] = {1, 2, 3, 4, 7, SUNS, WIDTH * HEIGHT, 2 * WIDTH * HEIGHT};
    static VolLight suns[2 * WIDTH * HEIGHT];
    static Picture picture;
    VolError err;
    fill(&picture);
    VolEnvironment e = environment_of(&picture);
    double power[3];
    vol_environment_power(&e, power);
    for (size_t n = 0; n < sizeof numbers / sizeof *numbers; n++) {
        size_t count, want = numbers[n] < WIDTH * HEIGHT ? numbers[n] : WIDTH * HEIGHT;
        double sum[3] = {0, 0, 0}, last = INFINITY;
        CHECK(vol_environment_suns(&e, numbers[n], suns, &count, &err) == VOL_OK);
        CHECK(count == want);
        for (size_t s = 0; s < count; s++) {
            double bright = 0.2126 * suns[s].rgb[0] + 0.7152 * suns[s].rgb[1] + 0.0722 * suns[s].rgb[2];
            CHECK(suns[s].kind == VOL_LIGHT_SUN && fabs(vol_length(suns[s].direction) - 1) < 1e-14);
            CHECK(bright <= last * (1 + 1e-12));
            last = bright;
            for (int c = 0; c < 3; c++)
                sum[c] += 4 * PI * suns[s].rgb[c];
        }
        for (int c = 0; c < 3; c++)
            CHECK_NEAR(sum[c], power[c], 1e-12, 0);
    }
    vol_environment_free(&e);
}

/* Regions end up alike: cut is always the brightest, and pixels are small beside it. */
static void test_evenness(void)
{
    static Picture picture;
    VolLight suns[SUNS];
    size_t count;
    VolError err;
    fill(&picture);
    VolEnvironment e = environment_of(&picture);
    CHECK(vol_environment_suns(&e, SUNS, suns, &count, &err) == VOL_OK && count == SUNS);
    double first = suns[0].rgb[0] + suns[0].rgb[1] + suns[0].rgb[2];
    double last = suns[SUNS - 1].rgb[0] + suns[SUNS - 1].rgb[1] + suns[SUNS - 1].rgb[2];
    CHECK(first < 3 * last);
    vol_environment_free(&e);
}

/* A picture mirrored has the mirrored suns: left to right is x to -x, top to bottom y to -y. */
static void test_mirrored(void)
{
    static Picture picture, mirrored[2];
    VolLight suns[SUNS], others[SUNS];
    size_t count, other_count;
    VolError err;
    fill(&picture);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                mirrored[0].rgb[y][WIDTH - 1 - x][c] = picture.rgb[y][x][c];
                mirrored[1].rgb[HEIGHT - 1 - y][x][c] = picture.rgb[y][x][c];
            }
    VolEnvironment e = environment_of(&picture);
    CHECK(vol_environment_suns(&e, SUNS, suns, &count, &err) == VOL_OK);
    for (int m = 0; m < 2; m++) {
        VolEnvironment other = environment_of(&mirrored[m]);
        CHECK(vol_environment_suns(&other, SUNS, others, &other_count, &err) == VOL_OK && count == other_count);
        for (size_t n = 0; n < count; n++) {
            VolVec3 want = suns[n].direction;
            *(m ? &want.y : &want.x) *= -1;
            CHECK_NEAR(vol_length(vol_sub(others[n].direction, want)), 0, 0, 1e-12);
            for (int c = 0; c < 3; c++)
                CHECK_NEAR(others[n].rgb[c], suns[n].rgb[c], 1e-12, 0);
        }
        vol_environment_free(&other);
    }
    vol_environment_free(&e);
}

/* One bright pixel in the dark is one sun, from its middle. */
static void test_one_pixel(void)
{
    static Picture picture;
    VolLight suns[SUNS];
    size_t count;
    VolError err;
    picture.rgb[5][31][1] = 2;
    VolEnvironment e = environment_of(&picture);
    CHECK(vol_environment_suns(&e, SUNS, suns, &count, &err) == VOL_OK && count == 1);
    VolVec3 from = vol_environment_direction(&e, 31.5, 5.5);
    CHECK_NEAR(vol_length(vol_add(suns[0].direction, from)), 0, 0, 1e-15);
    CHECK_NEAR(suns[0].rgb[1], 2 * e.solid_angle[5] / (4 * PI), 1e-14, 0);
    CHECK(suns[0].rgb[0] == 0 && suns[0].rgb[2] == 0);
    vol_environment_free(&e);
}

static void check_refused(float bad, VolStatus want, const char *why)
{
    static Picture picture;
    VolEnvironment e;
    VolError err = {{0}};
    picture.rgb[5][31][1] = bad;
    VolStatus got = vol_environment_new(&picture.rgb[0][0][0], 3, WIDTH, HEIGHT, white, "sky", NULL, &e, &err);
    CHECK(got == want);
    if (want)
        CHECK_TEXT(err.text, why);
    else
        vol_environment_free(&e);
}

static void test_refused(void)
{
    check_refused(NAN, VOL_BAD_INPUT, "bad environment 'sky': the pixel in column 31 of row 5 is not a finite number");
    check_refused(-INFINITY, VOL_BAD_INPUT, "bad environment 'sky': the pixel in column 31 of row 5 is not a finite number");
    check_refused(-1e-6f, VOL_BAD_INPUT, "bad environment 'sky': the pixel in column 31 of row 5 is negative");
    check_refused(1e37f, VOL_BAD_INPUT, "bad environment 'sky': the pixel in column 31 of row 5 is brighter than 1e36");
    check_refused(1e30f, VOL_OK, NULL);
}

static void test_black(void)
{
    static Picture black;
    VolLight suns[4];
    size_t count;
    VolError err;
    warnings = 0;
    VolEnvironment e = environment_of(&black);
    CHECK(warnings == 1);
    CHECK(vol_environment_suns(&e, 4, suns, &count, &err) == VOL_OK && count == 0);
    vol_environment_free(&e);
}

static void check_spec(const char *spec, VolStatus want, const char *want_file, double want_green)
{
    bool is_one;
    char *file;
    double factor[3];
    VolError err;
    CHECK(vol_environment_parse(spec, &is_one, &file, factor, &err) == want);
    CHECK(is_one == (strncmp(spec, "env:", 4) == 0));
    CHECK(!want_file == !file);
    if (file && want_file) {
        CHECK_TEXT(file, want_file);
        CHECK(factor[1] == want_green);
    }
    free(file);
}

static void test_specifications(void)
{
    check_spec("env:sky.hdr", VOL_OK, "sky.hdr", 1);
    check_spec("env:sky.hdr:1,2,3", VOL_OK, "sky.hdr", 2);
    check_spec("env:a:b.exr", VOL_OK, "a:b.exr", 1);
    check_spec("sun:1,0,0", VOL_OK, NULL, 0);
    check_spec("env:", VOL_USAGE, NULL, 0);
    check_spec("env::1,2,3", VOL_USAGE, NULL, 0);
    check_spec("env:sky.hdr:1,-2,3", VOL_USAGE, NULL, 0);
    check_spec("env:sky.hdr:1,1e37,3", VOL_USAGE, NULL, 0);
}

/* The mean of any function over its density is its integral: of radiance, and of radiance times each coordinate, to 4
 * deviations; what is drawn is what is seen from there. */
static void test_drawing(void)
{
    enum { COUNT = 40000 };
    static Picture picture;
    VolEnvironmentSampler sampler;
    VolError err;
    fill(&picture);
    VolEnvironment e = environment_of(&picture);
    CHECK(vol_environment_sampler_new(&e, &sampler, &err) == VOL_OK);
    double want[4] = {0}, sum[4] = {0}, squares[4] = {0};
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            /* The integral of the direction over a pixel, in closed form. */
            double a = PI * y / HEIGHT, b = PI * (y + 1) / HEIGHT, p = PI / WIDTH, l = PI * (1 - (2 * x + 1.0) / WIDTH);
            double flat = 0.5 * (b - a) - 0.25 * (sin(2 * b) - sin(2 * a)), light = picture.rgb[y][x][0];
            want[0] += light * e.solid_angle[y];
            want[1] += light * flat * 2 * sin(p) * sin(l);
            want[2] += light * (sin(b) * sin(b) - sin(a) * sin(a)) * p;
            want[3] += light * flat * 2 * sin(p) * cos(l);
        }
    for (uint32_t n = 0; n < COUNT; n++) {
        VolFromAround drawn = vol_environment_sample(&sampler, vol_random_at(1, 2, n, 0), vol_random_at(1, 2, n, 1));
        VolFromAround seen = vol_environment_from(&sampler, drawn.from);
        double weight = drawn.rgb[0] / drawn.density;
        double values[4] = {weight, weight * drawn.from.x, weight * drawn.from.y, weight * drawn.from.z};
        CHECK(memcmp(seen.rgb, drawn.rgb, sizeof seen.rgb) == 0 && seen.density == drawn.density);
        CHECK_NEAR(vol_length(drawn.from), 1, 0, 1e-14);
        for (int i = 0; i < 4; i++) {
            sum[i] += values[i];
            squares[i] += values[i] * values[i];
        }
    }
    for (int i = 0; i < 4; i++) {
        double mean = sum[i] / COUNT, deviation = sqrt((squares[i] / COUNT - mean * mean) / COUNT);
        CHECK(deviation < 0.02 * want[0]);
        CHECK_NEAR((mean - want[i]) / deviation, 0, 0, 4);
    }
    vol_environment_sampler_free(&sampler);
    vol_environment_free(&e);
}

int main(void)
{
    RUN(test_directions);
    RUN(test_power);
    RUN(test_conservation);
    RUN(test_evenness);
    RUN(test_mirrored);
    RUN(test_one_pixel);
    RUN(test_refused);
    RUN(test_black);
    RUN(test_specifications);
    RUN(test_drawing);
    return test_end();
}
