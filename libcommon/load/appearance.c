#include "load/appearance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

VolStatus vol_appearance_read(const VolBytes *bytes, const char *name, const char *part, const VolLog *log,
                              VolAppearance *out, VolError *err)
{
    *out = (VolAppearance){0};
    return vol_load_transfer_function(bytes, name, part, log, &out->tf, &out->units, &out->tables, err);
}

static bool changes_steps(const VolAppearance *appearance, const VolAppearanceSettings *settings)
{
    return (settings->particle_step > 0 && settings->particle_step != appearance->tf.particle_step) ||
           (settings->scalar_step > 0 && settings->scalar_step != appearance->tf.scalar_step);
}

/* Tables of this volume: only as far from the diagonal as the field can change over a step.  For coloured attenuation there
 * are none, integrals alone. */
static VolStatus make_tables(VolAppearance *appearance, const VolVolume *volume, const VolAppearanceSettings *settings,
                             VolError *err)
{
    VolPreintOptions options = {.n = settings->nodes, .step = settings->step,
                                .octaves = appearance->compiled.coloured ? 0 : 1, .threads = settings->threads,
                                .cpu = settings->cpu, .change = vol_volume_change(volume, settings->step)};
    vol_preint_default_range(&appearance->compiled, &options.lo, &options.hi);
    VolStatus status = vol_preint_build(&appearance->compiled, &options, &appearance->preint, err);
    if (status == VOL_BAD_INPUT)
        vol_fail_within(err, status, "a table from %.17g to %.17g", options.lo * appearance->unit,
                        options.hi * appearance->unit);
    return status;
}

void vol_appearance_settle(VolTf *tf, VolTfUnits units, const VolVolume *volume, const VolLog *log)
{
    double lo, hi;
    if (units.relative && vol_volume_range(volume, &lo, &hi))
        vol_tf_rescale(tf, lo, hi);
    if (units.step == VOL_STEP_WORLD)
        return;
    tf->particle_step *= vol_step_of_unit(volume, units.step);
    vol_note(log, "the transfer function's program has its opacities hold for %.6g world units of this volume",
             tf->particle_step);
}

/* Takes a transfer function whose nodes lie far from 1, and the field with it, to units in which kernels count well. */
static void settle_units(VolAppearance *appearance, VolVolume *volume)
{
    enum { NEAR = 40 }; /* squares and cubes of values, and of differences a thousandth of them, stay well within float */
    VolTfCompiled *tf = appearance->tables ? &appearance->tables->compiled : &appearance->compiled;
    double largest = fmax(fabs(tf->node_min), fabs(tf->node_max));
    if (largest == 0 && tf->has_surface) /* nodes at 0 alone */
        largest = appearance->tf.scalar_step * 256;
    int exponent = 0;
    appearance->unit = 1;
    if (tf->node_min <= tf->node_max && largest > 0)
        frexp(largest, &exponent);
    if (abs(exponent) <= NEAR)
        return;
    appearance->unit = ldexp(1, exponent);
    vol_volume_rescale(volume, -exponent);
    vol_tf_compiled_rescale(tf, 1 / appearance->unit);
    if (appearance->tables)
        vol_preint_rescale(&appearance->tables->preint, 1 / appearance->unit);
}

VolStatus vol_appearance_fit(VolAppearance *appearance, VolVolume *volume, const VolAppearanceSettings *settings,
                             const VolLog *log, VolError *err)
{
    VolStatus status = VOL_OK;
    if (appearance->tables && changes_steps(appearance, settings)) {
        vol_note(log, "--particle-step or --scalar-step differ from the tables': made anew from their transfer function");
        vol_tables_free(appearance->tables);
        appearance->tables = NULL;
    }
    if (!appearance->tables) {
        double lo = 0, hi = 0;
        vol_appearance_settle(&appearance->tf, appearance->units, volume, log);
        vol_volume_range(volume, &lo, &hi);
        vol_tf_settle_step(&appearance->tf, lo, hi);
        appearance->units = (VolTfUnits){0};
        if (settings->particle_step > 0)
            appearance->tf.particle_step = settings->particle_step;
        if (settings->scalar_step > 0)
            appearance->tf.scalar_step = settings->scalar_step;
        status = vol_tf_compile(&appearance->tf, log, &appearance->compiled, err);
    }
    if (!status) {
        settle_units(appearance, volume);
        vol_tf_limit(appearance->tables ? &appearance->tables->compiled : &appearance->compiled, vol_volume_voxel(volume));
    }
    if (!status && settings->full && appearance->tables && !appearance->tables->preint.octave_count)
        return vol_fail(err, VOL_BAD_INPUT, "the tables have no part 'full': make them with tf-preint --part full");
    if (!status && settings->full && !appearance->tables)
        status = make_tables(appearance, volume, settings, err);
    if (!status && settings->integrals) {
        status = vol_tf_integrals_new(vol_appearance_compiled(appearance), &appearance->integrals, err);
        appearance->has_integrals = !status;
    }
    return status;
}

/* The linear functions of an interval, side by side in it. */
enum { FUNCTIONS = (offsetof(VolTfInterval, has_scatter) - offsetof(VolTfInterval, scatter)) / sizeof(VolLinear) };

static bool is_level(const VolTfInterval *interval)
{
    const VolLinear *f = &interval->scatter;
    for (size_t i = 0; i < FUNCTIONS; i++)
        if (f[i].b != 0)
            return false;
    return true;
}

static bool joins_level(const VolTfInterval *a, const VolTfInterval *b)
{
    return is_level(a) && is_level(b) && memcmp(&a->scatter, &b->scatter, FUNCTIONS * sizeof(VolLinear)) == 0;
}

bool vol_appearance_varies(const VolTfCompiled *tf, double *from, double *to)
{
    size_t first = 0, last = tf->knot_count;
    while (first < last && joins_level(&tf->intervals[first], &tf->intervals[first + 1]))
        first++;
    while (last > first && joins_level(&tf->intervals[last - 1], &tf->intervals[last]))
        last--;
    if (first == last)
        return false;
    *from = tf->knots[first];
    *to = tf->knots[last - 1];
    return true;
}

const VolTfCompiled *vol_appearance_compiled(const VolAppearance *appearance)
{
    return appearance->tables ? &appearance->tables->compiled : &appearance->compiled;
}

const VolPreint *vol_appearance_preint(const VolAppearance *appearance)
{
    return appearance->tables ? &appearance->tables->preint : &appearance->preint;
}

void vol_appearance_free(VolAppearance *appearance)
{
    if (appearance->has_integrals)
        vol_tf_integrals_free(&appearance->integrals);
    vol_preint_free(&appearance->preint);
    vol_tf_compiled_free(&appearance->compiled);
    vol_tables_free(appearance->tables);
    vol_tf_free(&appearance->tf);
    *appearance = (VolAppearance){0};
}

double vol_appearance_steps(const VolVolume *volume, double step) { return vol_volume_longest_way(volume) / step; }
