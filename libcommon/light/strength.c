#include "light/strength.h"

/* 1 - cosine by the sine, which narrow spots need: (1 - c) (1 + c) = |way x axis|^2 / |way|^2. */
double vol_spot_profile(const VolLight *light, VolVec3 way)
{
    double length = vol_length(way);
    if (light->kind != VOL_LIGHT_SPOT)
        return 1;
    if (!(length > 0))
        return 0;
    double cosine = vol_dot(way, light->direction) / length, sine = vol_length(vol_cross(way, light->direction)) / length;
    double off = cosine > 0 ? sine * sine / (1 + cosine) : 1 - cosine;
    double s = ((1 - light->cos_edge) - off) / (light->cos_full - light->cos_edge);
    s = s < 0 ? 0 : s > 1 ? 1 : s;
    return s * s * (3 - 2 * s);
}

double vol_light_strength(const VolLight *light, VolVec3 place, double nearest)
{
    if (!vol_light_stands(light))
        return 1;
    VolVec3 way = vol_sub(place, light->position);
    double distance = vol_length(way), reach = distance > nearest ? distance : nearest;
    return vol_spot_profile(light, way) / (reach * reach);
}
