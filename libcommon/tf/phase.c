#include "tf/phase.h"

#include <math.h>

VolPhase vol_phase_of(const VolTf *tf)
{
    bool is_table = tf->phase_table.count > 0;
    return (VolPhase){.g = is_table ? 0 : tf->phase_hg, .table = is_table ? &tf->phase_table : NULL};
}

/* (1 - g^2) / (1 + g^2 - 2 g c)^(3/2); 1 + g^2 - 2 g c = (1 - g)^2 + 2 g (1 - c), without loss where c is near 1. */
static double henyey_greenstein(double g, double cosine)
{
    double d = (1 - g) * (1 - g) + 2 * g * (1 - cosine);
    return (1 - g) * (1 + g) / (d * sqrt(d));
}

void vol_phase_at(const VolPhase *phase, double cosine, double rgb[3])
{
    const VolTfNodes *table = phase->table;
    if (!table) {
        rgb[0] = rgb[1] = rgb[2] = phase->g == 0 ? 1 : henyey_greenstein(phase->g, fmin(fmax(cosine, -1), 1));
        return;
    }
    size_t after = 0;
    while (after < table->count && table->nodes[after].v <= cosine)
        after++;
    const VolTfNode *p = &table->nodes[after ? after - 1 : 0];
    const VolTfNode *q = &table->nodes[after < table->count ? after : table->count - 1];
    double u = q->v > p->v ? fmin(fmax((cosine - p->v) / (q->v - p->v), 0), 1) : 0;
    for (int c = 0; c < 3; c++)
        rgb[c] = p->color[c] + u * (q->color[c] - p->color[c]);
}

double vol_phase_most(const VolPhase *phase)
{
    double most = 0;
    if (!phase->table)
        return henyey_greenstein(fabs(phase->g), 1);
    for (size_t n = 0; n < phase->table->count; n++)
        for (int c = 0; c < 3; c++)
            most = fmax(most, phase->table->nodes[n].color[c]);
    return most;
}
