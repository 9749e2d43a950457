/* Phase functions: values, means over the sphere, bounds. */
#include "test.h"
#include "tf_help.h"

#include "tf/phase.h"

static const double asymmetry[] = {-0.9, -0.3, 0, 1e-3, 0.5, 0.6, 0.95};
enum { ASYMMETRIES = sizeof asymmetry / sizeof *asymmetry };

static double hg_at(double g, double cosine)
{
    VolPhase phase = {.g = g};
    double rgb[3];
    vol_phase_at(&phase, cosine, rgb);
    CHECK(rgb[0] == rgb[1] && rgb[0] == rgb[2]);
    return rgb[0];
}

static void test_henyey_greenstein(void)
{
    CHECK_NEAR(hg_at(0.5, 1), 6, 0, 1e-14);
    CHECK_NEAR(hg_at(0.5, -1), 2.0 / 9, 0, 1e-15);
    CHECK_NEAR(hg_at(0.5, 0), 0.75 / pow(1.25, 1.5), 0, 1e-15);
    CHECK(hg_at(0, 0.3) == 1);
    CHECK(hg_at(0.5, 1 + 1e-12) == hg_at(0.5, 1)); /* a cosine is one but for rounding */
    CHECK_NEAR(hg_at(1 - 1e-9, 1) * 1e-18, 2 - 1e-9, 0, 1e-6); /* (1 + g) / (1 - g)^2 */
}

/* Half the integral over the cosine, by Simpson's rule in u, cosine = 1 - 2 u^3 towards the peak. */
static void test_means(void)
{
    enum { STEPS = 20000 };
    for (int n = 0; n < ASYMMETRIES; n++) {
        double g = asymmetry[n], sum = 0;
        for (int i = 0; i <= STEPS; i++) {
            double u = (double)i / STEPS, cosine = 1 - 2 * u * u * u, weight = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
            sum += weight * hg_at(g, g < 0 ? -cosine : cosine) * 3 * u * u;
        }
        CHECK_NEAR(sum / (3 * STEPS), 1, 0, 1e-9);
    }
}

static void test_bounds(void)
{
    for (int n = 0; n < ASYMMETRIES; n++) {
        VolPhase phase = {.g = asymmetry[n]};
        double most = 0;
        for (int i = -1000; i <= 1000; i++)
            most = fmax(most, hg_at(asymmetry[n], i / 1000.0));
        CHECK_NEAR(most, vol_phase_most(&phase), 0, 1e-12 * most);
        CHECK(vol_phase_is_even(&phase) == (asymmetry[n] == 0));
    }
}

/* Linear between nodes, constant beyond; where two share a cosine, the second holds there. */
static void test_tables(void)
{
    VolTf tf;
    VolError err = {{0}};
    double rgb[3];
    static const char text[] = HEAD ", \"phase\": {\"table\": [[-0.5, [1, 0, 2]], [0.5, [3, 0, 2]], "
                                    "[0.5, [4, 5, 6]], [0.75, [0, 0, 0]]]}}";
    CHECK(tf_parse(text, &tf, &err) == VOL_OK);
    VolPhase phase = vol_phase_of(&tf);
    vol_phase_at(&phase, 0, rgb);
    CHECK(rgb[0] == 2 && rgb[1] == 0 && rgb[2] == 2);
    vol_phase_at(&phase, -1, rgb);
    CHECK(rgb[0] == 1 && rgb[1] == 0 && rgb[2] == 2);
    vol_phase_at(&phase, 0.5, rgb);
    CHECK(rgb[0] == 4 && rgb[1] == 5 && rgb[2] == 6);
    vol_phase_at(&phase, 0.625, rgb);
    CHECK(rgb[0] == 2 && rgb[1] == 2.5 && rgb[2] == 3);
    vol_phase_at(&phase, 1, rgb);
    CHECK(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    CHECK(vol_phase_most(&phase) == 6 && !vol_phase_is_even(&phase));
    vol_tf_free(&tf);
}

/* Half the integral over the cosine of a channel, -1 the density: even steps (from -1 to 1 all nodes of the tables lie at
 * their ends), two Gauss nodes in each. */
static double mean_of(const VolPhaseSampler *sampler, int channel, double lo, double hi)
{
    enum { STEPS = 20000 };
    double sum = 0;
    for (int i = 0; i < 2 * STEPS; i++) {
        double rgb[3], cosine = lo + (hi - lo) * (i / 2 + 0.5 + (i % 2 - 0.5) / sqrt(3)) / STEPS;
        vol_phase_normalised(sampler, cosine, rgb);
        sum += channel < 0 ? vol_phase_density(sampler, cosine) : rgb[channel];
    }
    return sum * (hi - lo) / (4 * STEPS);
}

/* What is drawn for u is the place up to which the density makes u; densities and channels have the mean 1. */
static void check_sampler(const VolPhase *phase, const bool *dark)
{
    VolPhaseSampler sampler;
    VolError err;
    double last = -1;
    CHECK(vol_phase_sampler_new(phase, &sampler, &err) == VOL_OK);
    for (int c = 0; c < 3; c++)
        CHECK_NEAR(mean_of(&sampler, c, -1, 1), dark && dark[c] ? 0 : 1, 0, 1e-6);
    CHECK_NEAR(mean_of(&sampler, -1, -1, 1), 1, 0, 1e-6);
    for (int n = 1; n < 50; n++) {
        double cosine = vol_phase_sample(&sampler, n / 50.0), rgb[3];
        CHECK(cosine >= last && cosine <= 1);
        CHECK_NEAR(mean_of(&sampler, -1, -1, cosine), n / 50.0, 0, 1e-4);
        vol_phase_normalised(&sampler, cosine, rgb);
        for (int c = 0; c < 3; c++)
            CHECK(rgb[c] <= 3.0000001 * vol_phase_density(&sampler, cosine));
        last = cosine;
    }
    CHECK(vol_phase_sample(&sampler, 0x1p-33) >= -1 && vol_phase_sample(&sampler, 1 - 0x1p-33) <= 1);
    vol_phase_sampler_free(&sampler);
}

static void test_drawing(void)
{
    for (int n = 0; n < ASYMMETRIES - 1; n++)
        check_sampler(&(VolPhase){.g = asymmetry[n]}, NULL);
    for (double g = 1e-12; g < 1; g *= 10) { /* nothing is lost near g = 0 */
        VolPhaseSampler sampler = {.phase = {.g = g}};
        for (double s = -0.9; s < 1; s += 0.2)
            CHECK_NEAR(vol_phase_sample(&sampler, 0.5 * (1 + s)), s + 1.5 * g * (1 - s * s), 0, 8 * g * g + 1e-15);
    }
    VolPhaseSampler sampler = {.phase = {.g = 0.6}};
    CHECK_NEAR(vol_phase_sample(&sampler, 1), 1, 0, 1e-15);
    CHECK_NEAR(vol_phase_sample(&sampler, 0), -1, 0, 1e-15);
}

static void check_table(const char *table, double r, double g, double b)
{
    char text[512];
    VolTf tf;
    VolError err = {{0}};
    double mean[3];
    snprintf(text, sizeof text, "%s, \"phase\": {\"table\": %s}}", HEAD, table);
    CHECK(tf_parse(text, &tf, &err) == VOL_OK);
    VolPhase phase = vol_phase_of(&tf);
    vol_phase_means(&phase, mean);
    CHECK_NEAR(mean[0], r, 1e-14, 0);
    CHECK_NEAR(mean[1], g, 1e-14, 0);
    CHECK_NEAR(mean[2], b, 1e-14, 0);
    if (r + g + b > 0)
        check_sampler(&phase, (const bool[]){r == 0, g == 0, b == 0});
    vol_tf_free(&tf);
}

static void test_tables_over_the_sphere(void)
{
    check_table("[[-0.5, [1, 0, 2]], [0.5, [3, 0, 2]], [0.5, [4, 5, 6]], [0.75, [0, 0, 0]]]", 1.5, 0.3125, 1.875);
    check_table("[[-1, [0, 1, 3]], [1, [1, 0, 0]]]", 0.5, 0.5, 1.5);
    check_table("[[0.25, [2, 3, 4]]]", 2, 3, 4);
    check_table("[[-1, [0, 0, 0]], [0.5, [0, 0, 0]], [0.5, [8, 0, 1]]]", 2, 0, 0.25); /* nothing is sent back */
    check_table("[[0, [0, 0, 0]]]", 0, 0, 0);
}

int main(void)
{
    RUN(test_henyey_greenstein);
    RUN(test_means);
    RUN(test_bounds);
    RUN(test_tables);
    RUN(test_drawing);
    RUN(test_tables_over_the_sphere);
    return test_end();
}
