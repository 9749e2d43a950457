/* The upwind scheme couples a voxel to those before it along the light alone: visited in that order each is computed once,
 *     T = (sum_a w_a T_a) / (sum_a w_a + sigma).
 * A sun has one such order, a point an octant each for the up to 8 ways away from its voxel; octants that go down along an
 * axis begin where those that go up do.
 *
 * Rows run along axis 2.  Of the rows of an octant those of one diagonal do not depend on each other: some are swept side by
 * side (upwind_tmpl.h).  Tiles of rows go to threads as soon as the tiles before them are done; tiles are handed out in an
 * order in which none waits for a later one. */
#include "light/upwind.h"

#include <math.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>

#include "base/mem.h"
#include "base/pool.h"
#include "light/upwind_private.h"

enum { TILE = 16 };

/* A stretch of an axis that light crosses one way. */
typedef struct Way {
    int32_t first, count;
    int step; /* +1 or -1 */
} Way;

typedef struct Sweep {
    const VolUpwind *of;
    Way way[3];
    int32_t source[3];   /* a point's voxel */
    float weight[3];     /* a sun's */
    float *ones;         /* a row of them */
    VolUpwindRows *rows;
    int tiles[2];        /* along axes 0 and 1 */
    atomic_bool *done;   /* of tiles */
} Sweep;

static float *row_at(const Sweep *s, float *field, const int32_t at[2])
{
    const int32_t *n = s->of->n;
    return field + ((size_t)at[0] * (size_t)n[1] + (size_t)at[1]) * (size_t)n[2];
}

/* Whether the light comes to `at` along axis a from a voxel, which is done already; from a point's own plane it comes along
 * other axes alone. */
static bool is_reached_by_voxel(const Sweep *s, int32_t at, int a)
{
    int32_t before = at - s->way[a].step;
    return before >= 0 && before < s->of->n[a] && !(s->of->from_point && at == s->source[a]);
}

/* The row that light comes from along axis a. */
static const float *row_before(const Sweep *s, const int32_t at[2], int a)
{
    int32_t before[2] = {at[0], at[1]};
    before[a] -= s->way[a].step;
    return is_reached_by_voxel(s, at[a], a) ? row_at(s, s->of->transmittance, before) : s->ones;
}

static VolUpwindRow row_of(const Sweep *s, int32_t i, int32_t j)
{
    const VolUpwind *u = s->of;
    const int32_t at[2] = {s->way[0].first + i * s->way[0].step, s->way[1].first + j * s->way[1].step};
    VolUpwindRow row = {.before = row_before(s, at, 0), .beside = row_before(s, at, 1)};
    row.to = row_at(s, u->transmittance, at);
    row.extinction = u->extinction + (row.to - u->transmittance);
    for (int a = 0; a < 2; a++) {
        double away = (double)at[a] - (double)s->source[a], reach = away * u->edge[a];
        row.weight[a] = u->from_point ? (float)fabs(away) : s->weight[a];
        row.across += (float)(reach * reach);
    }
    return row;
}

static void run_tile(const Sweep *s, int32_t first_i, int32_t first_j)
{
    const Way *along = &s->way[2];
    const VolUpwindWay way = {.first = along->first, .count = along->count, .step = along->step,
                              .from_voxel = is_reached_by_voxel(s, along->first, 2), .from_point = s->of->from_point,
                              .weight = s->weight[2], .edge = (float)s->of->edge[2], .source = s->source[2]};
    int32_t end_i = first_i + TILE < s->way[0].count ? first_i + TILE : s->way[0].count;
    int32_t end_j = first_j + TILE < s->way[1].count ? first_j + TILE : s->way[1].count;
    for (int32_t d = first_i + first_j; d <= end_i + end_j - 2; d++) {
        VolUpwindRow rows[VOL_UPWIND_ROWS];
        int count = 0;
        int32_t last_i = d - first_j < end_i - 1 ? d - first_j : end_i - 1;
        for (int32_t i = d - (end_j - 1) > first_i ? d - (end_j - 1) : first_i; i <= last_i; i++) {
            rows[count] = row_of(s, i, d - i);
            if (++count == VOL_UPWIND_ROWS || i == last_i) {
                s->rows(&way, rows, count);
                count = 0;
            }
        }
    }
}

static void wait_for(atomic_bool *done)
{
    while (!atomic_load_explicit(done, memory_order_acquire))
        sched_yield();
}

/* Tile number `index` along diagonals of tiles. */
static void tile_at(const Sweep *s, size_t index, int at[2])
{
    for (int d = 0;; d++) {
        int first = d - s->tiles[1] + 1 > 0 ? d - s->tiles[1] + 1 : 0, last = d < s->tiles[0] ? d : s->tiles[0] - 1;
        size_t count = (size_t)(last - first + 1);
        if (index < count) {
            at[0] = first + (int)index;
            at[1] = d - at[0];
            return;
        }
        index -= count;
    }
}

static VolStatus sweep_tile(void *user, size_t index, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    Sweep *s = user;
    int at[2];
    tile_at(s, index, at);
    atomic_bool *done = s->done + at[0] * s->tiles[1] + at[1];
    if (at[0] > 0)
        wait_for(done - s->tiles[1]);
    if (at[1] > 0)
        wait_for(done - 1);
    run_tile(s, at[0] * TILE, at[1] * TILE);
    atomic_store_explicit(done, true, memory_order_release);
    return VOL_OK;
}

static VolStatus sweep_octant(Sweep *s, VolError *err)
{
    size_t tiles = 1;
    for (int a = 0; a < 2; a++) {
        s->tiles[a] = (s->way[a].count + TILE - 1) / TILE;
        tiles *= (size_t)s->tiles[a];
    }
    for (size_t i = 0; i < tiles; i++)
        atomic_init(&s->done[i], false);
    return s->way[2].count ? vol_parallel(s->of->threads, tiles, sweep_tile, s, err) : VOL_OK;
}

/* ---- Octants ---- */

/* The stretch of axis a that light crosses upwards (down = 0) or downwards. */
static Way way_of(const Sweep *s, int a, int down)
{
    const VolUpwind *u = s->of;
    int32_t n = u->n[a];
    if (!u->from_point)
        return (u->light[a] < 0) == down ? (Way){down ? n - 1 : 0, n, down ? -1 : 1} : (Way){0, 0, 1};
    int32_t at = s->source[a] < 0 ? 0 : s->source[a] > n ? n : s->source[a]; /* the first upwards */
    return down ? (Way){at - 1, at, -1} : (Way){at, n - at, 1};
}

static void set_light(Sweep *s)
{
    const VolUpwind *u = s->of;
    for (int a = 0; a < 3; a++) {
        if (u->from_point)
            s->source[a] = (int32_t)fmin(fmax(floor(u->light[a] + 0.5), -0x1p30), 0x1p30);
        else
            s->weight[a] = (float)(fabs(u->light[a]) / u->edge[a]);
    }
}

static VolUpwindRows *rows_for(VolCpu cpu)
{
#if defined(__x86_64__)
    if (cpu == VOL_CPU_AVX512)
        return vol_upwind_rows_avx512;
    if (vol_cpu_runs_avx2(cpu))
        return vol_upwind_rows_avx2;
#endif
    (void)cpu;
    return vol_upwind_rows;
}

VolStatus vol_upwind(const VolUpwind *upwind, VolError *err)
{
    const int32_t *n = upwind->n;
    Sweep s = {.of = upwind, .rows = rows_for(upwind->cpu)};
    size_t tiles = (size_t)(n[0] / TILE + 1) * (size_t)(n[1] / TILE + 1);
    s.ones = vol_alloc((size_t)n[2], sizeof *s.ones);
    s.done = vol_alloc(tiles, sizeof *s.done);
    VolStatus status = s.ones && s.done ? VOL_OK : vol_fail_memory(err, (size_t)n[2] * sizeof *s.ones);
    for (int32_t z = 0; status == VOL_OK && z < n[2]; z++)
        s.ones[z] = 1;
    set_light(&s);
    for (int octant = 0; status == VOL_OK && octant < 8; octant++) {
        for (int a = 0; a < 3; a++)
            s.way[a] = way_of(&s, a, octant >> a & 1);
        if (s.way[0].count && s.way[1].count && s.way[2].count)
            status = sweep_octant(&s, err);
    }
    free(s.ones);
    free(s.done);
    return status;
}
