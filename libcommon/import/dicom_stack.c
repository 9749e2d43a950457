/* Slices in order: along the normal where all have positions, else by their numbers (files) or as they are stored
 * (frames).  Slices of several times at the same places become time steps; where a step is of twice the usual one, or
 * three times and so on, slices are missing; other steps of more than one and a half are refused. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import/dicom.h"

/* A longer step, in usual ones, is no jitter: something is missing, or the slices are of several series. */
#define MOST_STEPS 1.5001

static VolVec3 row_of(const DicomPlace *p)
{
    return vol_vec3(p->orientation[0], p->orientation[1], p->orientation[2]);
}
static VolVec3 column_of(const DicomPlace *p)
{
    return vol_vec3(p->orientation[3], p->orientation[4], p->orientation[5]);
}
static VolVec3 place_of(const DicomPlace *p) { return vol_vec3(p->position[0], p->position[1], p->position[2]); }

static VolVec3 normal_of(const DicomPlace *p)
{
    VolVec3 normal = vol_cross(row_of(p), column_of(p));
    double length = vol_length(normal);
    return length > 0 ? vol_scale(normal, 1 / length) : normal;
}

/* "'a.dcm'", or "'a.dcm' (frame 3)" where there are several; from 1, as viewers count. */
static const char *label(const DicomSlice *s, char *text, size_t size)
{
    if (s->file->frames > 1)
        snprintf(text, size, "'%s' (frame %u)", s->file->name, (unsigned)s->frame + 1);
    else
        snprintf(text, size, "'%s'", s->file->name);
    return text;
}

static bool has_place(const DicomSlice *s)
{
    return s->place->has_position && (s->file->frames == 1 || s->file->frames_placed);
}

static VolStatus same_shape(const DicomSlice *s, const DicomSlice *t, VolError *err)
{
    const DicomFile *a = s->file, *b = t->file;
    char first[300], other[300];
    bool size = a->rows == b->rows && a->columns == b->columns, turned = false, spaced = false;
    bool type = a->bits_allocated == b->bits_allocated && a->is_signed == b->is_signed && a->sample == b->sample;
    for (int i = 0; i < 6; i++)
        turned = turned || !(fabs(s->place->orientation[i] - t->place->orientation[i]) < 1e-4);
    for (int i = 0; i < 2; i++)
        spaced = spaced ||
                 !(fabs(s->place->spacing[i] - t->place->spacing[i]) <= 1e-4 * fabs(s->place->spacing[i]));
    if (size && type && !turned && !spaced)
        return VOL_OK;
    const char *what = !size ? "size" : !type ? "type" : turned ? "orientation" : "spacing";
    return vol_fail(err, VOL_BAD_INPUT, "cannot import %s: its %s is not that of %s: no slices of one volume",
                    label(t, other, sizeof other), what, label(s, first, sizeof first));
}

static int by_depth(const void *a, const void *b)
{
    const DicomSlice *s = a, *t = b;
    if (s->depth != t->depth)
        return s->depth < t->depth ? -1 : 1;
    if (s->file->instance != t->file->instance)
        return s->file->instance < t->file->instance ? -1 : 1;
    if (s->file != t->file)
        return strcmp(s->file->name, t->file->name);
    return s->frame < t->frame ? -1 : s->frame > t->frame ? 1 : 0;
}

static int by_time(const void *a, const void *b)
{
    const DicomSlice *s = a, *t = b;
    if (s->place->time != t->place->time)
        return s->place->time < t->place->time ? -1 : 1;
    return by_depth(a, b);
}

/* Whether all have positions; what cannot be ordered is refused. */
static VolStatus check_places(DicomStack *stack, const VolLog *log, VolError *err)
{
    const DicomSlice *first = &stack->slices[0], *with = NULL, *without = NULL;
    char a[300], b[300];
    VolStatus status = VOL_OK;
    bool frames = false, several = false, differ = false;
    for (size_t i = 0; !status && i < stack->count; i++) {
        const DicomSlice *s = &stack->slices[i];
        if (has_place(s))
            with = s;
        else
            without = s;
        frames = frames || s->file->frames > 1;
        several = several || s->file != first->file;
        differ = differ || s->place->time != first->place->time || strcmp(s->place->stack, first->place->stack) != 0;
        status = same_shape(first, s, err);
    }
    stack->placed = !without;
    if (status || !without)
        return status;
    if (with && frames)
        return vol_fail(err, VOL_BAD_INPUT, "cannot import %s: it has no position, but %s has one",
                        label(without, a, sizeof a), label(with, b, sizeof b));
    if (frames && several)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': several files of several frames each, which have no positions",
                        first->file->name);
    if (frames && differ)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': frames of several stacks or times, which have no positions",
                        first->file->name);
    for (size_t i = 0; !frames && stack->count > 1 && i < stack->count; i++)
        if (!stack->slices[i].file->has_instance)
            return vol_fail(err, VOL_BAD_INPUT,
                            "cannot import %s: it has neither a place nor an instance number to put it in order",
                            label(&stack->slices[i], a, sizeof a));
    if (with)
        vol_warn(log, "%s has no position: the slices are put in order of their instance numbers",
                 label(without, a, sizeof a));
    return VOL_OK;
}

/* Nearer than this are slices at the same place; the numbers may have been rounded. */
static double nearest(const DicomStack *stack)
{
    const DicomSlice *s = stack->slices;
    double range = s[stack->count - 1].depth - s[0].depth;
    return stack->count > 1 ? fmin(1e-3, 1e-3 * range / (double)(stack->count - 1)) : 0;
}

/* `slices` are the same places at several times? */
static bool split_times(DicomStack *stack, double near)
{
    DicomSlice *s = stack->slices;
    size_t n = 1;
    qsort(s, stack->count, sizeof *s, by_time);
    while (n < stack->count && s[n].place->time == s[0].place->time)
        n++;
    if (n == stack->count || stack->count % n != 0)
        return false;
    for (size_t i = 0; i < stack->count; i++) {
        bool first = i % n == 0, after = i > 0 && s[i].place->time == s[i - 1].place->time;
        if (first == after || fabs(s[i].depth - s[i % n].depth) > near ||
            (!first && s[i].depth - s[i - 1].depth <= near))
            return false;
    }
    stack->times = stack->count / n;
    stack->count = n;
    return true;
}

/* What tells two slices at the same place apart, so that users see what the file holds. */
static void difference(const DicomPlace *a, const DicomPlace *b, char *text, size_t size)
{
    size_t dimensions = sizeof a->dimension / sizeof *a->dimension;
    text[0] = 0;
    if (strcmp(a->stack, b->stack) != 0) {
        snprintf(text, size, ": they are of stacks '%s' and '%s'; only one stack can be imported", a->stack,
                 b->stack);
    } else if (a->time != b->time) {
        snprintf(text, size,
                 ": they are of times %" PRId64 " and %" PRId64 ", but not all times have the same slices", a->time,
                 b->time);
    } else {
        for (size_t i = 0; i < dimensions; i++)
            if (a->dimension[i] != b->dimension[i]) {
                snprintf(text, size,
                         ": they differ in dimension %zu of the Dimension Index Values (%u and %u); only one "
                         "volume can be imported",
                         i + 1, (unsigned)a->dimension[i], (unsigned)b->dimension[i]);
                return;
            }
    }
}

static VolStatus check_twins(DicomStack *stack, VolError *err)
{
    const DicomSlice *s = stack->slices;
    double near = nearest(stack);
    for (size_t i = 1; i < stack->count; i++) {
        if (s[i].depth - s[i - 1].depth > near)
            continue;
        if (stack->placed && split_times(stack, near))
            return VOL_OK;
        qsort(stack->slices, stack->count, sizeof *s, by_depth);
        char a[300], b[300], why[200];
        difference(s[i - 1].place, s[i].place, why, sizeof why);
        const double *p = s[i].place->position;
        if (!stack->placed)
            return vol_fail(err, VOL_BAD_INPUT, "cannot import %s: it has the same place as %s: instance number %g",
                            label(&s[i], b, sizeof b), label(&s[i - 1], a, sizeof a), s[i].depth);
        return vol_fail(err, VOL_BAD_INPUT, "cannot import %s: it has the same place as %s: %g, %g, %g%s",
                        label(&s[i], b, sizeof b), label(&s[i - 1], a, sizeof a), p[0], p[1], p[2], why);
    }
    return VOL_OK;
}

static int ascending(const void *a, const void *b)
{
    double s = *(const double *)a, t = *(const double *)b;
    return s < t ? -1 : s > t ? 1 : 0;
}

/* How many steps a distance is: a whole number where it is about one, else 0. */
static double multiple(double distance, double step)
{
    double ratio = distance / step, whole = floor(ratio + 0.5);
    return fabs(ratio - whole) <= fmin(0.25, 0.1 + 0.01 * whole) ? whole : 0;
}

/* The steps from slice to slice in ascending order: is `step` one of them, and are all of them whole multiples of it? */
static bool all_multiples(const double *steps, size_t n, double step)
{
    bool fits = step > 0 && multiple(steps[0], step) == 1;
    for (size_t i = 0; fits && i < n; i++)
        fits = multiple(steps[i], step) >= 1;
    return fits;
}

/* What the shortest steps are, which differ by little. */
static double shortest_step(const double *steps, size_t n)
{
    double sum = 0;
    size_t count = 0;
    while (count < n && steps[count] <= 1.25 * steps[0])
        sum += steps[count++];
    return sum / (double)count;
}

/* The usual step: Spacing Between Slices or the shortest step, where all steps are multiples of it (then more slices may
 * be missing than not), else the median.  Where a third of the steps are far shorter than that, it is no more usual
 * than they are. */
static VolStatus usual_step(const DicomStack *stack, double *out, VolError *err)
{
    size_t n = stack->count - 1;
    double *steps = vol_alloc(n, sizeof *steps);
    if (!steps)
        return vol_fail_memory(err, n * sizeof *steps);
    for (size_t i = 0; i < n; i++)
        steps[i] = stack->slices[i + 1].depth - stack->slices[i].depth;
    qsort(steps, n, sizeof *steps, ascending);
    double told = stack->placed ? stack->slices[0].place->between : 0;
    double shortest = shortest_step(steps, n);
    double median = steps[(n - 1) / 2], low = n >= 6 ? steps[n / 3] : median;
    if (all_multiples(steps, n, told))
        *out = told;
    else if (all_multiples(steps, n, shortest) && multiple(steps[n - 1], shortest) > 1)
        *out = shortest;
    else
        *out = median > MOST_STEPS * low ? low : median;
    free(steps);
    return VOL_OK;
}

typedef struct Gaps {
    double usual;
    double missing; /* slices */
    size_t places;
    size_t at;      /* the first: between this slice and the next */
    double there;   /* how many are missing there */
    size_t uneven, uneven_at; /* places with more than a step, but no whole number of them, and the first */
} Gaps;

/* What is wrong is no missing slice: nothing is there to be found or filled. */
static VolStatus refuse_uneven(const DicomStack *stack, const Gaps *gaps, const VolSource *source, VolError *err)
{
    const DicomSlice *s = &stack->slices[gaps->uneven_at], *t = s + 1;
    const double *p = s->place->position, *q = t->place->position;
    char a[300], b[300], more[80] = "";
    if (gaps->uneven > 1)
        snprintf(more, sizeof more, "; with other places %zu such gaps", gaps->uneven);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': a gap between %s at %g, %g, %g and %s at %g, %g, %g: they are %.6g apart where "
                    "%.6g is usual%s: %s",
                    source->name, label(s, a, sizeof a), p[0], p[1], p[2], label(t, b, sizeof b), q[0], q[1], q[2],
                    t->depth - s->depth, gaps->usual, more,
                    source->options->fill_gaps ? "--fill-gaps fills only whole steps"
                    : s->file == t->file       ? "they are of more than one volume"
                                               : "import the parts one by one, by naming their files");
}

/* Frames of several stacks are one volume only where they follow each other as the slices of one do. */
static VolStatus refuse_stacks(const DicomStack *stack, size_t at, const VolSource *source, VolError *err)
{
    const DicomSlice *s = &stack->slices[at], *t = s + 1;
    char a[300], b[300];
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': %s and %s are of stacks '%s' and '%s', which lie %.6g apart; only one stack can be "
                    "imported",
                    source->name, label(s, a, sizeof a), label(t, b, sizeof b), s->place->stack, t->place->stack,
                    t->depth - s->depth);
}

static VolStatus report_gaps(const DicomStack *stack, const Gaps *gaps, const VolSource *source, VolError *err)
{
    const DicomSlice *s = &stack->slices[gaps->at], *t = s + 1;
    bool fill = source->options->fill_gaps;
    char a[300], b[300], more[80] = "";
    label(s, a, sizeof a);
    label(t, b, sizeof b);
    if (gaps->places > 1)
        snprintf(more, sizeof more, "; with other places %.0f are missing at %zu", gaps->missing, gaps->places);
    const char *one = gaps->there == 1 ? "slice is" : "slices are";
    if (fill && gaps->missing > 16 * (double)stack->count)
        return vol_fail(err, VOL_BAD_INPUT,
                        "cannot import '%s': %.0f slices are missing and %zu are there: too many to fill the gaps",
                        source->name, gaps->missing, stack->count);
    if (fill) {
        vol_warn(source->log, "'%s': %.0f missing slice%s filled with NaN, at %zu place%s", source->name,
                 gaps->missing, gaps->missing == 1 ? " is" : "s are", gaps->places, gaps->places == 1 ? "" : "s");
        return VOL_OK;
    }
    if (!stack->placed) {
        vol_warn(source->log,
                 "'%s': slices without positions: between %s and %s %.0f %s missing, as the instance numbers %g "
                 "and %g say%s; closed up (--fill-gaps leaves room)",
                 source->name, a, b, gaps->there, one, s->depth, t->depth, more);
        return VOL_OK;
    }
    const double *p = s->place->position, *q = t->place->position;
    double f = 1 / (gaps->there + 1);
    return vol_fail(err, VOL_BAD_INPUT,
                    "cannot import '%s': %.0f %s missing at %g, %g, %g, between %s and %s, which are %g apart "
                    "where %g is usual%s; find what is missing, or leave it empty with --fill-gaps",
                    source->name, gaps->there, one, p[0] + f * (q[0] - p[0]), p[1] + f * (q[1] - p[1]),
                    p[2] + f * (q[2] - p[2]), a, b, t->depth - s->depth, gaps->usual, more);
}

/* Counts the gaps; `usual` is known. */
static VolStatus count_gaps(const DicomStack *stack, const VolSource *source, Gaps *gaps, VolError *err)
{
    const DicomSlice *s = stack->slices;
    for (size_t i = 0; i + 1 < stack->count; i++) {
        double step = s[i + 1].depth - s[i].depth, missing = multiple(step, gaps->usual) - 1;
        bool uneven = stack->placed && missing < 0 && step > MOST_STEPS * gaps->usual;
        if ((uneven || missing >= 1) && strcmp(s[i].place->stack, s[i + 1].place->stack) != 0)
            return refuse_stacks(stack, i, source, err);
        if (uneven && gaps->uneven++ == 0)
            gaps->uneven_at = i;
        if (missing < 1)
            continue;
        if (gaps->places++ == 0) {
            gaps->at = i;
            gaps->there = missing;
        }
        gaps->missing += missing;
    }
    return gaps->uneven ? refuse_uneven(stack, gaps, source, err) : VOL_OK;
}

/* Gives every slice its voxel along k. */
static VolStatus find_gaps(DicomStack *stack, const VolSource *source, VolError *err)
{
    Gaps gaps = {.missing = 0};
    DicomSlice *s = stack->slices;
    size_t n = stack->count;
    VolStatus status = n > 2 ? usual_step(stack, &gaps.usual, err) : VOL_OK;
    if (!status && n > 2)
        status = count_gaps(stack, source, &gaps, err);
    if (!status && gaps.places)
        status = report_gaps(stack, &gaps, source, err);
    if (status)
        return status;
    int64_t slot = 0;
    for (size_t i = 0; i < n; i++) {
        bool fill = source->options->fill_gaps && i && n > 2;
        double steps = fill ? multiple(s[i].depth - s[i - 1].depth, gaps.usual) : 1;
        slot += i == 0 ? 0 : steps > 1 ? (int64_t)steps : 1;
        for (size_t t = 0; t < stack->times; t++)
            s[t * n + i].slot = slot;
    }
    stack->slots = slot + 1;
    return VOL_OK;
}

VolStatus vol_dicom_order(DicomStack *stack, const VolSource *source, VolError *err)
{
    stack->times = 1;
    VolStatus status = check_places(stack, source->log, err);
    if (status)
        return status;
    VolVec3 normal = normal_of(stack->slices[0].place);
    for (size_t i = 0; i < stack->count; i++) {
        DicomSlice *s = &stack->slices[i];
        s->depth = stack->placed         ? vol_dot(place_of(s->place), normal)
                   : s->file->frames > 1 ? (double)s->frame
                                         : (double)s->file->instance;
    }
    qsort(stack->slices, stack->count, sizeof *stack->slices, by_depth);
    status = check_twins(stack, err);
    return status ? status : find_gaps(stack, source, err);
}

/* The step of slices of which at most one position is known.  The sign tells in which direction frames follow. */
static double step_of(const DicomSlice *s)
{
    const DicomPlace *p = s->place;
    if (p->between > 0 || (p->between < 0 && s->file->frames > 1))
        return p->between;
    return p->thickness > 0 ? p->thickness : 0;
}

void vol_dicom_affine(const DicomStack *stack, const VolLog *log, VolAffine *out)
{
    const DicomSlice *first = &stack->slices[0], *last = &stack->slices[stack->count - 1];
    const DicomPlace *p = first->place;
    VolVec3 i = vol_scale(row_of(p), p->spacing[1]), j = vol_scale(column_of(p), p->spacing[0]);
    VolVec3 k = vol_scale(normal_of(p), step_of(first));
    VolVec3 place = p->has_position ? place_of(p) : vol_vec3(0, 0, 0);
    if (stack->placed && stack->count > 1) {
        k = vol_scale(vol_sub(place_of(last->place), place), 1.0 / (double)last->slot);
        double step = vol_length(k), worst = 0;
        for (size_t n = 1; n < stack->count; n++) {
            const DicomSlice *s = &stack->slices[n];
            VolVec3 even = vol_along(place, (double)s->slot, k);
            worst = fmax(worst, vol_length(vol_sub(place_of(s->place), even)));
        }
        if (worst > 0.01 * step)
            vol_warn(log,
                     "DICOM series '%s': slices are not evenly spaced (up to %.3g of a step off); taken as even",
                     first->file->series, worst / step);
    }
    const VolVec3 rows[4] = {i, j, k, place};
    for (int a = 0; a < 4; a++) {
        out->m[a][0] = rows[a].x;
        out->m[a][1] = rows[a].y;
        out->m[a][2] = rows[a].z;
    }
}
