#include "trace/jumps.h"

#include <math.h>

static double at(const VolLinear *line, const VolTfInterval *in, double v) { return line->a + line->b * (v - in->v_ref); }

static bool lines_meet(const VolLinear *before, double x, const VolLinear *after)
{
    double a = before->a + before->b * x, b = after->a;
    return fabs(a - b) <= 1e-9 * fmax(fabs(a), fabs(b));
}

static bool intervals_meet(const VolTfInterval *before, const VolTfInterval *after)
{
    double x = after->v0 - before->v_ref;
    bool meet = lines_meet(&before->scatter, x, &after->scatter) && lines_meet(&before->surface, x, &after->surface) &&
                lines_meet(&before->surfaceness, x, &after->surfaceness);
    for (int c = 0; c < 3 && meet; c++)
        meet = lines_meet(&before->absorb[c], x, &after->absorb[c]) && lines_meet(&before->emit[c], x, &after->emit[c]) &&
               lines_meet(&before->scatter_color[c], x, &after->scatter_color[c]) &&
               lines_meet(&before->surface_color[c], x, &after->surface_color[c]);
    return meet;
}

/* What particles do at a value, as an interval has it. */
typedef struct Particles {
    double extinction, emission, color;
} Particles;

static Particles particles_of(const VolTfInterval *in, double v, int c)
{
    return (Particles){fmax(at(&in->scatter, in, v) + at(&in->absorb[c], in, v), 0), fmax(at(&in->emit[c], in, v), 0),
                       at(&in->scatter_color[c], in, v)};
}

double vol_jump_at_knot(const VolTfCompiled *tf, size_t knot)
{
    const VolTfInterval *before = &tf->intervals[knot], *after = before + 1;
    double most = 0, v = tf->knots[knot];
    if (intervals_meet(before, after))
        return 0;
    for (int c = 0; c < 3; c++) {
        Particles p = particles_of(before, v, c), q = particles_of(after, v, c);
        most = fmax(most, fabs(p.extinction - q.extinction) + fabs(p.emission - q.emission) +
                              fmin(p.extinction, q.extinction) * fabs(p.color - q.color));
    }
    return most;
}

double vol_particles_around(const VolTfCompiled *tf, double v)
{
    double most = 0;
    size_t above = vol_tf_interval(tf, v), below = above > 0 && tf->knots[above - 1] == v ? above - 1 : above;
    for (size_t j = below; j <= above; j++)
        for (int c = 0; c < 3; c++) {
            Particles p = particles_of(&tf->intervals[j], v, c);
            most = fmax(most, p.extinction + p.emission);
        }
    return most;
}

bool vol_has_jumps(const VolTfCompiled *tf)
{
    bool jumps = tf->isosurface_count > 0;
    for (size_t i = 0; i < tf->knot_count && !jumps; i++)
        jumps = !intervals_meet(&tf->intervals[i], &tf->intervals[i + 1]);
    return jumps;
}
