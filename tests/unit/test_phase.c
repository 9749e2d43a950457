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

int main(void)
{
    RUN(test_henyey_greenstein);
    RUN(test_means);
    RUN(test_bounds);
    RUN(test_tables);
    return test_end();
}
