/* Blending colours.
 *
 * Lab: sRGB is decoded, taken to CIE XYZ by the matrix of IEC 61966-2-1, and to L*a*b* by
 *     L = 116 f(Y) - 16,  a = 500 (f(X) - f(Y)),  b = 200 (f(Y) - f(Z)),
 * f the cube root, continued by a straight line below 0.008856; X, Y, Z relative to the white point of D65.  Blends can
 * leave the gamut of sRGB; as VTK does, they are then divided by their largest channel, and negative channels made 0.
 *
 * Diverging (Moreland, Diverging color maps for scientific visualization, 2009): polar coordinates of Lab,
 *     M = |(L, a, b)|,  s = acos(L / M),  h = atan2(b, a).
 * Two saturated colours of different hue meet in an unsaturated one at least as bright as both; where only one of the
 * two is saturated, the other one's hue, which is undefined or means nothing, is spun a little so that the path is
 * perceptually even. */
#include "tf/color.h"

#include "base/fmath.h"

#include <math.h>
#include <stdbool.h>

#define PI 3.14159265358979323846

static double decode(double e)
{
    return e <= 0.04045 ? e / 12.92 : vol_pow((e + 0.055) / 1.055, 2.4);
}

static double encode(double v)
{
    return v <= 0.0031308 ? 12.92 * v : 1.055 * vol_pow(v, 1 / 2.4) - 0.055;
}

void vol_color_decode(const double encoded[3], double linear[3])
{
    for (int c = 0; c < 3; c++)
        linear[c] = decode(encoded[c]);
}

static double mix(double a, double b, double u)
{
    return a + (b - a) * u;
}

static void mix3(const double a[3], const double b[3], double u, double out[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = mix(a[c], b[c], u);
}

/* ---- HSV: hue, saturation, value, each in [0, 1] ---- */

static void rgb_to_hsv(const double rgb[3], double hsv[3])
{
    double r = rgb[0], g = rgb[1], b = rgb[2];
    double most = fmax(r, fmax(g, b)), least = fmin(r, fmin(g, b)), range = most - least;
    hsv[0] = 0;
    hsv[1] = most > 0 ? range / most : 0;
    hsv[2] = most;
    if (!(range > 0))
        return;
    double sixths = most == r ? (g - b) / range : most == g ? 2 + (b - r) / range : 4 + (r - g) / range;
    hsv[0] = sixths < 0 ? sixths / 6 + 1 : sixths / 6;
}

static void hsv_to_rgb(const double hsv[3], double rgb[3])
{
    for (int c = 0; c < 3; c++) {
        /* Each channel is 1 for a third of the circle around its own hue and falls to 0 over a sixth on both sides. */
        double turned = hsv[0] * 6 - 2 * c;
        double distance = fabs(turned - 6 * nearbyint(turned / 6));
        double pure = fmin(fmax(2 - distance, 0), 1);
        rgb[c] = hsv[2] * (1 - hsv[1] * (1 - pure));
    }
}

static void blend_hsv(const double a[3], const double b[3], double u, bool wrap, double out[3])
{
    double p[3], q[3], middle[3];
    rgb_to_hsv(a, p);
    rgb_to_hsv(b, q);
    if (wrap && fabs(p[0] - q[0]) > 0.5) {
        if (p[0] > q[0])
            p[0] -= 1;
        else
            q[0] -= 1;
    }
    mix3(p, q, u, middle);
    hsv_to_rgb(middle, out);
}

/* ---- Lab ---- */

static const double to_xyz[3][3] = {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
static const double from_xyz[3][3] = {{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}};
static const double white[3] = {0.9505, 1, 1.0890};

static void multiply(const double m[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static void rgb_to_lab(const double rgb[3], double lab[3])
{
    double linear[3], xyz[3], f[3];
    vol_color_decode(rgb, linear);
    multiply(to_xyz, linear, xyz);
    for (int i = 0; i < 3; i++) {
        double t = xyz[i] / white[i];
        f[i] = t > 0.008856 ? vol_cbrt(t) : 7.787 * t + 16.0 / 116;
    }
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

static void lab_to_rgb(const double lab[3], double rgb[3])
{
    double xyz[3], linear[3], y = (lab[0] + 16) / 116;
    double f[3] = {y + lab[1] / 500, y, y - lab[2] / 200};
    for (int i = 0; i < 3; i++) {
        double cube = f[i] * f[i] * f[i];
        xyz[i] = white[i] * (cube > 0.008856 ? cube : (f[i] - 16.0 / 116) / 7.787);
    }
    multiply(from_xyz, xyz, linear);
    for (int c = 0; c < 3; c++)
        rgb[c] = encode(linear[c]);
    double most = fmax(1, fmax(rgb[0], fmax(rgb[1], rgb[2])));
    for (int c = 0; c < 3; c++)
        rgb[c] = fmax(rgb[c] / most, 0);
}

static void blend_lab(const double a[3], const double b[3], double u, double out[3])
{
    double p[3], q[3], middle[3];
    rgb_to_lab(a, p);
    rgb_to_lab(b, q);
    mix3(p, q, u, middle);
    lab_to_rgb(middle, out);
}

/* ---- Msh ---- */

typedef struct Msh {
    double m, s, h;
} Msh;

#define SATURATED 0.05
#define LEAST_MIDDLE 88.0

static Msh rgb_to_msh(const double rgb[3])
{
    double lab[3];
    rgb_to_lab(rgb, lab);
    double m = sqrt(lab[0] * lab[0] + lab[1] * lab[1] + lab[2] * lab[2]);
    double s = m > 0.001 ? vol_acos(fmin(fmax(lab[0] / m, -1), 1)) : 0;
    return (Msh){m, s, s > 0.001 ? vol_atan2(lab[2], lab[1]) : 0};
}

static void msh_to_rgb(Msh c, double rgb[3])
{
    double chroma = c.m * vol_sin(c.s);
    double lab[3] = {c.m * vol_cos(c.s), chroma * vol_cos(c.h), chroma * vol_sin(c.h)};
    lab_to_rgb(lab, rgb);
}

static double angle_between(double a, double b)
{
    double d = fabs(a - b);
    while (d >= 2 * PI)
        d -= 2 * PI;
    return d > PI ? 2 * PI - d : d;
}

/* The hue for an unsaturated colour of magnitude m beside the saturated one. */
static double spun_hue(Msh saturated, double m)
{
    if (saturated.m >= m - 0.1)
        return saturated.h;
    double spin = saturated.s * sqrt(m * m - saturated.m * saturated.m) / (saturated.m * vol_sin(saturated.s));
    return saturated.h > -0.3 * PI ? saturated.h + spin : saturated.h - spin;
}

static void blend_diverging(const double a[3], const double b[3], double u, double out[3])
{
    Msh p = rgb_to_msh(a), q = rgb_to_msh(b);
    if (p.s > SATURATED && q.s > SATURATED && angle_between(p.h, q.h) > 0.33 * PI) {
        Msh middle = {fmax(fmax(p.m, q.m), LEAST_MIDDLE), 0, 0};
        if (u < 0.5) {
            q = middle;
            u = 2 * u;
        } else {
            p = middle;
            u = 2 * u - 1;
        }
    }
    if (p.s < SATURATED && q.s > SATURATED)
        p.h = spun_hue(q, p.m);
    else if (q.s < SATURATED && p.s > SATURATED)
        q.h = spun_hue(p, q.m);
    msh_to_rgb((Msh){mix(p.m, q.m, u), mix(p.s, q.s, u), mix(p.h, q.h, u)}, out);
}

void vol_color_blend(VolColorSpace space, const double a[3], const double b[3], double u, double out[3])
{
    switch (space) {
    case VOL_COLOR_HSV: blend_hsv(a, b, u, false, out); break;
    case VOL_COLOR_HSV_WRAP: blend_hsv(a, b, u, true, out); break;
    case VOL_COLOR_LAB: blend_lab(a, b, u, out); break;
    case VOL_COLOR_DIVERGING: blend_diverging(a, b, u, out); break;
    case VOL_COLOR_STEP: mix3(b, b, 0, out); break;
    default: mix3(a, b, u, out); break;
    }
}
