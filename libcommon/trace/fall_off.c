/* A light at the distance p from the ray's line has the strength 1 / (p^2 + u^2), u along the ray from the point nearest to
 * it: poles at u = +-ip, which lie as far from a place on the ray as the light does.  A piece around c of half length h has
 * its error fall by rho^-2 a node, rho = x + sqrt(x^2 - 1) with x = r(c) / h (Trefethen): h <= r(c) / 2 makes that 14 a
 * node.  From a on, pieces of 2/3 r(a) keep to it, and grow with the distance.  Within `nearest` a point's strength is
 * constant; a spot's changes with direction.  Both have kinks: where that ball begins and ends, and a spot at both of its
 * cones. */
#include "trace/fall_off.h"

#include <math.h>

#include "base/fmath.h"
#include "base/gauss.h"

/* What is asked for: the first place behind `after`, if it lies before `first`. */
typedef struct Soonest {
    double after, first;
} Soonest;

static void consider(Soonest *s, double t)
{
    if (t > s->after && t < s->first)
        s->first = t;
}

/* Where the line from the light to the place p + u d makes an angle of this cosine with the spot's axis:
 * (A u + P)^2 = k^2 (p^2 + u^2), on the lit side. */
static void consider_cone(Soonest *s, const VolLight *light, VolVec3 p, VolVec3 d, double foot, double cosine)
{
    double A = vol_dot(light->direction, d), P = vol_dot(light->direction, p), k2 = cosine * cosine;
    double a = A * A - k2, b = A * P, c = P * P - k2 * vol_dot(p, p), root = b * b - a * c;
    if (!(root >= 0))
        return;
    double q = b >= 0 ? -b - sqrt(root) : -b + sqrt(root);
    const double at[2] = {q / a, c / q};
    for (int n = 0; n < 2; n++)
        if (isfinite(at[n]) && A * at[n] + P >= 0)
            consider(s, foot + at[n]);
}

static double even_until(const VolLight *light, const VolRay *ray, double nearest, double t, double end, double blur)
{
    VolVec3 from = vol_sub(light->position, ray->origin), d = ray->direction;
    double foot = vol_dot(from, d);
    VolVec3 p = vol_sub(vol_scale(d, foot), from); /* from the light to the foot of the perpendicular */
    double beside = vol_dot(p, p), u = t - foot, r = sqrt(beside + u * u), in_ball = nearest * nearest - beside;
    Soonest s = {t + blur, end};
    bool within = false;
    if (in_ball > 0) {
        double half = sqrt(in_ball);
        consider(&s, foot - half);
        consider(&s, foot + half);
        within = fabs(u + blur) < half;
    }
    if (light->kind == VOL_LIGHT_SPOT) {
        consider_cone(&s, light, p, d, foot, light->cos_edge);
        consider_cone(&s, light, p, d, foot, light->cos_full);
    }
    double step = 2.0 / 3 * r;
    if (within)
        step = light->kind == VOL_LIGHT_SPOT ? fmax(step, nearest / 16) : INFINITY;
    consider(&s, t + fmax(step, 2 * blur));
    return s.first;
}

/* Where a part of the ray from t on must end, at `end` at the latest, for a quadrature of 8 nodes to see all lights as
 * smooth (rms 1e-9).  At least `blur` behind t, and kinks within that are overlooked: it is what places can be told apart
 * by. */
static double lights_even_until(const VolScene *scene, const VolRay *ray, double nearest, double t, double end, double blur)
{
    for (size_t n = 0; n < scene->light_count; n++)
        if (vol_light_stands(&scene->lights[n]))
            end = even_until(&scene->lights[n], ray, nearest, t, end, blur);
    return end;
}

/* How much of a light's strength arrives at t (shading_tmpl.h has the same for many rays). */
static double arriving(const VolLight *light, const VolRay *ray, double nearest, double t)
{
    if (!vol_light_stands(light))
        return 1;
    VolVec3 place = {fma(t, ray->direction.x, ray->origin.x), fma(t, ray->direction.y, ray->origin.y),
                     fma(t, ray->direction.z, ray->origin.z)};
    VolVec3 way = vol_sub(place, light->position);
    double r = vol_length(way), reach = fmax(r, nearest), scale = 1 / (reach * reach);
    if (light->kind != VOL_LIGHT_SPOT)
        return scale;
    double c = r > 0 ? vol_dot(way, light->direction) / r : 0;
    double s = fmin(fmax((c - light->cos_edge) / (light->cos_full - light->cos_edge), 0), 1);
    return scale * (s * s * (3 - 2 * s));
}

/* Sums for the mean. */
typedef struct Mean {
    double light[3], weight[3];
} Mean;

/* From t to `until`, where the optical depth in front, per length, is density[c]. */
static void add_piece(Mean *sum, const VolScene *scene, const VolRay *ray, double nearest, double t0, double t, double until,
                      const double density[3])
{
    for (int n = 0; n < 8; n++) {
        double at = t + vol_gauss8_x[n] * (until - t), weight = 0, rgb[3] = {0};
        for (size_t k = 0; k < scene->light_count; k++) {
            const VolLight *light = &scene->lights[k];
            double strength = arriving(light, ray, nearest, at);
            for (int c = 0; c < 3; c++)
                rgb[c] += light->rgb[c] * strength;
        }
        for (int c = 0; c < 3; c++) {
            if (c == 0 || density[c] != density[c - 1])
                weight = vol_gauss8_w[n] * (until - t) * vol_exp(-density[c] * (at - t0));
            sum->light[c] += weight * rgb[c];
            sum->weight[c] += weight;
        }
    }
}

void vol_lights_mean(const VolScene *scene, const VolRay *ray, double nearest, double t0, double t1, const double depth[3],
                     double mean[3])
{
    enum { DARK = 40 }; /* what lies behind this depth is not seen */
    double length = t1 - t0, density[3], t = t0;
    Mean sum = {{0}, {0}};
    for (int c = 0; c < 3; c++)
        density[c] = depth[c] / length;
    while (t < t1) {
        double densest = 0;
        bool lit = false;
        for (int c = 0; c < 3; c++)
            if (density[c] * (t - t0) < DARK) {
                lit = true;
                densest = fmax(densest, density[c]);
            }
        double end = densest * (t1 - t) > 1 ? t + 1 / densest : t1;
        double until = lights_even_until(scene, ray, nearest, t, end, length * 0x1p-40);
        if (!lit || !(until > t))
            break;
        add_piece(&sum, scene, ray, nearest, t0, t, until, density);
        t = until;
    }
    for (int c = 0; c < 3; c++)
        mean[c] = sum.weight[c] > 0 ? sum.light[c] / sum.weight[c] : 0;
}
