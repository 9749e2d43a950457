/* Isosurfaces at values that the field reaches exactly: volumes of few different numbers, rays in planes of voxels, along
 * edges and through corners.  What is to be met is counted by itself, in long double along the ray: a point is below the
 * surface's value or it is not, and each change from one to the other along the ray is a crossing.
 *
 *     test_touching [--seed N]    random volumes N+1, N+2, ... (default 0; a failure names its seed) */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/cpu.h"
#include "tests/unit/random_scene.h"
#include "tests/unit/test.h"

enum { SCENES = 400, RAYS = 48, MOST_SIDE = 24 };

static uint64_t first_seed;
static VolCpu levels[3];
static int level_count;

/* ---- Volumes ---- */

typedef struct Lattice {
    RandomScene s;
    int lo[3], size[3]; /* voxels with values of their own */
    double background, unit, value;
    bool exact; /* index space is reached without rounding */
    unsigned char at[MOST_SIDE][MOST_SIDE][MOST_SIDE];
} Lattice;

static double voxel(const Lattice *v, const int at[3])
{
    for (int a = 0; a < 3; a++)
        if (at[a] < v->lo[a] || at[a] >= v->lo[a] + v->size[a])
            return v->background;
    return v->unit * v->at[at[0] - v->lo[0]][at[1] - v->lo[1]][at[2] - v->lo[2]];
}

/* Numbers 0 ... most; all of a plane, a line or a block alike now and then. */
static void fill(Random *r, Lattice *v, int most)
{
    int dense = 1 + random_below(r, 9);
    for (int x = 0; x < v->size[0]; x++)
        for (int y = 0; y < v->size[1]; y++)
            for (int z = 0; z < v->size[2]; z++)
                v->at[x][y][z] = (unsigned char)(random_below(r, 10) < dense ? random_below(r, most + 1) : 0);
    for (int n = random_below(r, 4); n > 0; n--) {
        int from[3], past[3], number = random_below(r, most + 1);
        for (int a = 0; a < 3; a++) {
            from[a] = random_below(r, v->size[a]);
            past[a] = random_below(r, 3) ? from[a] + 1 + random_below(r, v->size[a] - from[a]) : from[a] + 1;
        }
        for (int x = from[0]; x < past[0]; x++)
            for (int y = from[1]; y < past[1]; y++)
                for (int z = from[2]; z < past[2]; z++)
                    v->at[x][y][z] = (unsigned char)number;
    }
}

static void place(Random *r, Lattice *v, VolGridSource *source)
{
    static const double spacings[] = {1, 0.5, 0.1, 0.3, 0.7, 3.3};
    int order = random_below(r, 3);
    double spacing = spacings[random_below(r, 6)];
    v->exact = spacing == 1 || spacing == 0.5;
    for (int a = 0; a < 3; a++) {
        v->lo[a] = random_below(r, 4) ? 0 : random_below(r, 40) - 20;
        v->size[a] = random_below(r, 5) ? 2 + random_below(r, 4) : 2 + random_below(r, MOST_SIDE - 2);
        source->box_min[a] = v->lo[a];
        source->box_max[a] = v->lo[a] + v->size[a] - 1;
        source->index_to_world.m[a][(a + order) % 3] = random_below(r, 2) ? spacing : -spacing;
        source->index_to_world.m[3][a] = spacing * (random_below(r, 21) - 10);
    }
}

static void add_leaves(VolGridBuilder *builder, const Lattice *v)
{
    int first[3], past[3];
    for (int a = 0; a < 3; a++) {
        first[a] = v->lo[a] & ~7;
        past[a] = v->lo[a] + v->size[a];
    }
    for (int32_t x = first[0]; x < past[0]; x += 8)
        for (int32_t y = first[1]; y < past[1]; y += 8)
            for (int32_t z = first[2]; z < past[2]; z += 8) {
                const int32_t origin[3] = {x, y, z};
                float values[512];
                uint64_t active[8] = {0};
                for (int n = 0; n < 512; n++) {
                    int at[3] = {x + (n >> 6), y + (n >> 3 & 7), z + (n & 7)};
                    bool inside = true;
                    for (int a = 0; a < 3; a++)
                        inside = inside && at[a] >= v->lo[a] && at[a] < past[a];
                    values[n] = (float)voxel(v, at);
                    if (inside)
                        active[n >> 6] |= (uint64_t)1 << (n & 63);
                }
                if (vol_grid_leaf(builder, origin, values, NULL, active, NULL))
                    abort();
            }
}

/* What is at the value. */
enum { ISOSURFACE, AMONG_PARTICLES, KINDS };

#define OPACITY 0.05

/* @ stands for the value, ^ for one above it. */
static void look(Lattice *v, int kind)
{
    static const char *const texts[KINDS] = {
        "'isosurfaces': [{'value': @, 'opacity': 0.05}]",
        "'isosurfaces': [{'value': @, 'opacity': 0.4}], 'scatter': [[@, 0.1], [^, 0.5]]",
    };
    char text[800] = "{\"pellucid\": \"transfer-function/1\", \"model\": \"unshaded\", ";
    size_t n = strlen(text);
    for (const char *from = texts[kind]; *from; from++) {
        if (*from == '@' || *from == '^')
            n += (size_t)snprintf(text + n, sizeof text - n, "%.17g", v->value + (*from == '^' ? v->unit : 0));
        else
            text[n++] = *from == '\'' ? '"' : *from;
    }
    snprintf(text + n, sizeof text - n, "}");
    scene_look(&v->s, text, &(VolPreintOptions){.n = 33, .step = 0.05, .octaves = 1, .change = INFINITY, .threads = 1});
}

static void lattice_begin(uint64_t seed, int kind, Random *r, Lattice *v)
{
    static const double units[] = {1, 1, 1, 0.1, 3, 1e-3};
    VolGridSource source = {0};
    VolGridBuilder *builder;
    memset(v, 0, sizeof *v);
    *r = (Random){seed};
    int most = 1 + random_below(r, 2), halves = random_below(r, 4) ? 2 * random_below(r, most + 1) : random_below(r, 5);
    v->unit = units[random_below(r, 6)];
    v->background = v->unit * random_below(r, most + 1);
    v->background = (double)(float)v->background;
    v->unit = (double)(float)v->unit;
    v->value = 0.5 * halves * v->unit;
    source.box = random_below(r, 2) != 0;
    source.background = v->background;
    place(r, v, &source);
    fill(r, v, most);
    if (vol_grid_begin(&source, &builder, NULL))
        abort();
    add_leaves(builder, v);
    if (vol_grid_finish(builder, &v->s.grid, NULL))
        abort();
    look(v, kind);
    v->s.lights[0] = vol_light_head();
    v->s.scene = (VolScene){.volume = vol_volume_of_grid(v->s.grid), .tf = &v->s.compiled, .lights = v->s.lights,
                            .light_count = 1, .skip = true, .preint = &v->s.tables, .integrals = &v->s.integrals,
                            .step = 0.05};
}

/* ---- Rays ---- */

/* Through exact places of index space: o + t d. */
typedef struct Line {
    double o[3], d[3];
    bool exact; /* it meets planes, edges and corners without rounding */
} Line;

static double some_place(Random *r, const Lattice *v, int a, int parts)
{
    return v->lo[a] - 1 + (double)random_below(r, (v->size[a] + 2) * parts) / parts;
}

static Line random_line(Random *r, const Lattice *v)
{
    Line line = {.exact = true};
    int kind = random_below(r, 6), parts = 1 << random_below(r, 3), most = 0;
    for (int a = 0; a < 3; a++) {
        line.o[a] = some_place(r, v, a, kind == 0 || random_below(r, 2) ? parts : 1);
        line.d[a] = kind == 3 ? random_below(r, 9) - 4 : random_below(r, 3) - 1;
        if (kind == 0)
            line.d[a] = 0;
    }
    if (kind == 0)
        line.d[random_below(r, 3)] = random_below(r, 2) ? 1 : -1;
    if (kind == 2)
        line.d[random_below(r, 3)] = 0;
    for (int a = 0; a < 3; a++)
        most += line.d[a] != 0;
    if (most == 0)
        line.d[2] = most = 1;
    for (int a = 0; a < 3; a++)
        line.exact = line.exact && (line.d[a] == 0 || fabs(line.d[a]) == 1 || fabs(line.d[a]) == 2 || fabs(line.d[a]) == 4);
    if (kind == 4) { /* next to such places: float may take the one for the other */
        double near = pow(10, -random_in(r, 4, 10));
        for (int a = 0; a < 3; a++) {
            line.o[a] += near * random_below(r, 2);
            line.d[a] += near * random_below(r, 2) * random_unit(r);
        }
        line.exact = false;
    }
    if (kind == 5) { /* a pixel's, from an eye on a plane or an edge */
        int along = random_below(r, 3), pixels = 3 + random_below(r, 6);
        for (int a = 0; a < 3; a++)
            line.d[a] = a == along ? random_below(r, 2) - 0.5 : 0.5 * (2 * random_below(r, pixels) + 1 - pixels) / pixels;
        line.exact = false;
    }
    for (int a = 0; a < 3 && !v->exact; a++)
        line.exact = line.exact && most == 1 && (line.d[a] != 0 || line.o[a] == floor(line.o[a]));
    return line;
}

static bool ray_of(const Lattice *v, const Line *line, bool backwards, VolRay *ray)
{
    double back = backwards ? 64 : -64;
    VolVec3 o = vol_vec3(line->o[0] + back * line->d[0], line->o[1] + back * line->d[1], line->o[2] + back * line->d[2]);
    VolVec3 d = vol_apply_linear(&v->s.grid->index_to_world, vol_vec3(line->d[0], line->d[1], line->d[2]));
    d = vol_scale(d, (backwards ? -1 : 1) / vol_length(d));
    *ray = (VolRay){vol_apply(&v->s.grid->index_to_world, o), d, 0, INFINITY};
    return vol_ray_clip(&v->s.scene, ray);
}

/* ---- What is met ---- */

static const long double NEAR = 1e-12L;

/* `cancels`: the isosurface's value comes out though not all voxels that matter have it, and rounding decides. */
static long double field(const Lattice *v, const Line *line, long double t, bool *cancels)
{
    int cell[3];
    bool alike = true;
    long double f[3], sum = 0;
    for (int a = 0; a < 3; a++) {
        long double x = line->o[a] + t * line->d[a], whole = floorl(x + 0.5L);
        x = fabsl(x - whole) < NEAR ? whole : x;
        cell[a] = (int)floorl(x);
        f[a] = x - cell[a];
    }
    for (int n = 0; n < 8; n++) {
        int up[3] = {n >> 2, n >> 1 & 1, n & 1}, at[3];
        long double weight = 1;
        for (int a = 0; a < 3; a++) {
            at[a] = cell[a] + up[a];
            weight *= up[a] ? f[a] : 1 - f[a];
        }
        sum += weight * voxel(v, at);
        alike = alike && (weight == 0 || voxel(v, at) == v->value);
    }
    *cancels = *cancels || (!alike && fabsl(sum - v->value) <= NEAR * (v->unit + fabs(v->value)));
    return sum;
}

static int compare_numbers(const void *a, const void *b)
{
    long double x = *(const long double *)a, y = *(const long double *)b;
    return (x > y) - (x < y);
}

/* Where the ray enters, leaves and meets planes of voxels; how many. */
static int events(const Lattice *v, const Line *line, long double at[200])
{
    const VolGrid *grid = v->s.grid;
    long double t0 = -INFINITY, t1 = INFINITY;
    int count = 0, kept = 0;
    for (int a = 0; a < 3; a++)
        if (line->d[a] != 0) {
            long double x = (grid->domain_min[a] - line->o[a]) / (long double)line->d[a];
            long double y = (grid->domain_max[a] - line->o[a]) / (long double)line->d[a];
            t0 = fmaxl(t0, fminl(x, y));
            t1 = fminl(t1, fmaxl(x, y));
        }
    at[count++] = t0;
    at[count++] = t1;
    for (int a = 0; a < 3; a++)
        for (int n = (int)grid->domain_min[a]; n <= grid->domain_max[a] && line->d[a] != 0; n++)
            at[count++] = (n - line->o[a]) / (long double)line->d[a];
    qsort(at, (size_t)count, sizeof *at, compare_numbers);
    for (int n = 0; n < count; n++)
        if (at[n] >= t0 && at[n] <= t1 && (kept == 0 || at[n] > at[kept - 1] + NEAR))
            at[kept++] = at[n];
    return kept;
}

/* Where the cubic through its values at 0, 1/3, 2/3 and 1 turns, ascending; 0, 1: nowhere. */
static void turns_of(const long double f[4], long double turn[2])
{
    long double a1 = (-11 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 2;
    long double a2 = 9 * (2 * f[0] - 5 * f[1] + 4 * f[2] - f[3]) / 2, a3 = 9 * (-f[0] + 3 * f[1] - 3 * f[2] + f[3]) / 2;
    long double scale = fabsl(a1) + fabsl(a2) + fabsl(a3), a = 3 * a3, b = 2 * a2, disc = b * b - 4 * a * a1;
    turn[0] = turn[1] = 0;
    if (!(scale > 0))
        return;
    if (fabsl(a) < NEAR * scale)
        turn[0] = fabsl(b) < NEAR * scale ? 0 : -a1 / b;
    else if (disc > 0) {
        turn[0] = (-b - copysignl(sqrtl(disc), a)) / (2 * a);
        turn[1] = (-b + copysignl(sqrtl(disc), a)) / (2 * a);
    }
}

static int crossings(const Lattice *v, const Line *line, bool *cancels)
{
    long double at[200], near = NEAR * (long double)(v->unit + fabs(v->value));
    int count = events(v, line, at), changes = 0;
    bool ignored, below = field(v, line, at[0], cancels) < v->value - near;
    for (int n = 0; n + 1 < count; n++) {
        long double f[4], turn[2];
        for (int k = 0; k < 4; k++)
            f[k] = field(v, line, at[n] + (at[n + 1] - at[n]) * k / 3, k > 0 ? cancels : &ignored);
        turns_of(f, turn);
        for (int k = 0; k < 3; k++) {
            long double s = k < 2 ? turn[k] : 1;
            if (k < 2 && !(s > 0 && s < 1))
                continue;
            long double x = k < 2 ? field(v, line, at[n] + (at[n + 1] - at[n]) * s, cancels) : f[3];
            bool now = x < v->value - near;
            changes += now != below;
            below = now;
        }
    }
    return changes;
}

/* ---- Kernels ---- */

typedef struct Traced {
    VolRay rays[VOL_PACKET];
    VolRadiance out[VOL_PACKET];
    size_t count;
    uint64_t in_double;
} Traced;

static void trace(Lattice *v, VolEstimator estimator, bool precise, VolCpu cpu, Traced *t)
{
    VolScratch scratch;
    v->s.scene.estimator = estimator;
    v->s.scene.precise = precise;
    v->s.scene.cpu = cpu;
    if (vol_scene_prepare(&v->s.scene, &v->s.prepared, NULL) || vol_scratch_new(&v->s.prepared, &scratch, NULL))
        abort();
    memset(t->out, 0, sizeof t->out);
    vol_trace_rays(&(VolTraceCall){.prepared = &v->s.prepared, .scratch = &scratch, .rays = t->rays, .count = t->count,
                                   .out = t->out});
    t->in_double += scratch.skipped.rays_in_double;
    vol_scratch_free(&scratch);
    vol_prepared_free(&v->s.prepared);
}

static int counted(const VolRadiance *out)
{
    return (int)(out->optical_depth[0] / -log1p(-OPACITY) + 0.5);
}

static const char *const names[] = {"exact", "full", "integrals", "direct"};

static void wrong(uint64_t seed, const Lattice *v, const Line *line, const char *what, int got, int want)
{
    FAIL("seed %d (unit %g, value %g): %s met %d, not %d: from %g %g %g along %g %g %g", (int)seed, v->unit, v->value, what,
         got, want, line->o[0], line->o[1], line->o[2], line->d[0], line->d[1], line->d[2]);
}

typedef struct Tally {
    uint64_t rays, in_double, exact, unresolved;
} Tally;

static void check_packet(uint64_t seed, Lattice *v, const Line *lines, Traced *t, bool backwards, Tally *tally)
{
    Traced precise = *t;
    trace(v, VOL_ESTIMATE_EXACT, true, VOL_CPU_SCALAR, &precise);
    t->in_double = 0;
    trace(v, VOL_ESTIMATE_EXACT, false, VOL_CPU_SCALAR, t);
    tally->rays += t->count;
    tally->in_double += t->in_double;
    for (int n = 0; n < level_count; n++) {
        Traced other = *t;
        trace(v, VOL_ESTIMATE_EXACT, false, levels[n], &other);
        if (memcmp(other.out, t->out, sizeof other.out) != 0)
            FAIL("seed %d: %s differs from scalar", (int)seed, vol_cpu_name(levels[n]));
    }
    bool sure[VOL_PACKET];
    for (size_t i = 0; i < t->count; i++) {
        bool cancels = false;
        int want = crossings(v, &lines[i], &cancels), d = counted(&precise.out[i]), f = counted(&t->out[i]);
        sure[i] = lines[i].exact && !cancels;
        if (sure[i] && d != want)
            wrong(seed, v, &lines[i], backwards ? "double, backwards" : "double", d, want);
        if (f != d)
            wrong(seed, v, &lines[i], "float", f, d);
        tally->exact += sure[i];
        tally->unresolved += d != want;
    }
    for (int e = VOL_ESTIMATE_FULL; e <= VOL_ESTIMATE_DIRECT; e++)
        for (int p = 0; p < 2; p++) {
            Traced other = *t;
            trace(v, (VolEstimator)e, p, VOL_CPU_SCALAR, &other);
            for (size_t i = 0; i < t->count; i++) {
                int want = counted(&precise.out[i]), got = counted(&other.out[i]);
                /* What happens between two samples escapes these: pairs of crossings. */
                if (sure[i] && ((got - want) % 2 != 0 || got > want))
                    wrong(seed, v, &lines[i], names[e], got, want);
            }
        }
}

static void rays_meet_what_the_field_passes(void)
{
    Tally tally = {0};
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r;
        static Lattice v;
        lattice_begin(seed, ISOSURFACE, &r, &v);
        for (int n = 0; n < RAYS; n += VOL_PACKET) {
            Line lines[VOL_PACKET];
            Traced there = {0}, back = {0};
            for (int tries = 0; tries < 200 && there.count < VOL_PACKET; tries++) {
                Line line = random_line(&r, &v);
                if (!ray_of(&v, &line, false, &there.rays[there.count]) || !ray_of(&v, &line, true, &back.rays[there.count]))
                    continue;
                lines[there.count++] = line;
            }
            back.count = there.count;
            check_packet(seed, &v, lines, &there, false, &tally);
            check_packet(seed, &v, lines, &back, true, &tally);
        }
        random_scene_free(&v.s);
    }
    printf("# %llu rays, %llu in double; of %llu that are exact in index space none may be wrong, of the others %llu "
           "meet more or less than they would without rounding\n",
           (unsigned long long)tally.rays, (unsigned long long)tally.in_double, (unsigned long long)tally.exact,
           (unsigned long long)tally.unresolved);
}

/* One ray, in float and in double. */
static void compare_precisions(uint64_t seed, const Lattice *v, const Line *line, const VolRadiance *f, const VolRadiance *d,
                               double *worst)
{
    double off = fabs(exp(-f->optical_depth[0]) - exp(-d->optical_depth[0]));
    for (int c = 0; c < 3; c++)
        off = fmax(off, fabs(f->color[c] - d->color[c]));
    *worst = fmax(*worst, off);
    if (off <= 1e-5)
        return;
    FAIL("seed %d (unit %g, value %g): float is off by %g: from %g %g %g along %g %g %g", (int)seed, v->unit, v->value, off,
         line->o[0], line->o[1], line->o[2], line->d[0], line->d[1], line->d[2]);
}

static size_t random_lines(Random *r, const Lattice *v, Line lines[VOL_PACKET], Traced *t)
{
    size_t count = 0;
    for (int tries = 0; tries < 200 && count < VOL_PACKET; tries++) {
        lines[count] = random_line(r, v);
        count += ray_of(v, &lines[count], false, &t->rays[count]);
    }
    return t->count = count;
}

static void float_is_double_among_particles(void)
{
    double worst = 0;
    uint64_t in_double = 0, rays = 0;
    for (uint64_t seed = first_seed + 1; seed <= first_seed + SCENES; seed++) {
        Random r;
        static Lattice v;
        lattice_begin(seed, AMONG_PARTICLES, &r, &v);
        for (int n = 0; n < RAYS; n += VOL_PACKET) {
            Line lines[VOL_PACKET];
            Traced narrow = {0}, precise;
            random_lines(&r, &v, lines, &narrow);
            precise = narrow;
            trace(&v, VOL_ESTIMATE_EXACT, false, VOL_CPU_SCALAR, &narrow);
            trace(&v, VOL_ESTIMATE_EXACT, true, VOL_CPU_SCALAR, &precise);
            for (size_t i = 0; i < narrow.count; i++)
                compare_precisions(seed, &v, &lines[i], &narrow.out[i], &precise.out[i], &worst);
            in_double += narrow.in_double;
            rays += narrow.count;
        }
        random_scene_free(&v.s);
    }
    printf("# float off by %.3g at the most; %llu of %llu rays in double\n", worst, (unsigned long long)in_double,
           (unsigned long long)rays);
}

int main(int argc, char **argv)
{
    static const char *const best[] = {"avx2", "avx512", "neon"};
    first_seed = seed_before_first(argc, argv);
    for (int n = 0; n < 3; n++)
        level_count += !vol_cpu_choose(best[n], &levels[level_count], NULL);
    RUN(rays_meet_what_the_field_passes);
    RUN(float_is_double_among_particles);
    return test_end();
}
