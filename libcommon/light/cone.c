/* From plane to plane.
 *
 * The blur is an exact second moment: 1-D passes out = in + v/2 (in_- - 2 in + in_+) add v o^2 to the variance along their
 * direction, o the distance of the two neighbours, and v <= 1/2 keeps all weights positive.  What is more than one such pass
 * can do is done by passes at o = 1, 2, 4, ..: with v = 1/2 together a triangle.  Along both axes of the lattice that is all
 * a sun needs.  Of a light that spreads the path between planes and the angle at which it meets them change across the
 * plane: at tangents (a, b) per plane distance dw, in tangents,
 *     rate dw / w^2 sqrt(1 + a^2 + b^2) [1 + a^2, a b; a b, 1 + b^2],
 * of which |a b| goes along one of the diagonals of the lattice, that of the sign of a b, and the rest along its axes.
 *
 * Blocks of planes: what rays let through between them, over threads; blurred and attenuated, over channels; read by the
 * voxels that lie between them, over threads. */
#include "light/cone.h"

#include <stdlib.h>
#include <string.h>

#include "base/mem.h"
#include "base/pool.h"
#include "light/strength.h"

enum { BLOCK = 8, DIRECTIONS = 3, MOST_STRIDES = 20 }; /* along both axes, and along a diagonal */

typedef struct Solver {
    const VolCone *of;
    size_t points;
    float *start;                      /* before the domain */
    float *share[DIRECTIONS];          /* of a light that spreads: variance, in units of that on the axis */
    float largest_share;
    float *passed[BLOCK][3], *light[BLOCK + 1][3];
    float *spare[3];
    int32_t first, count;              /* the block's planes: first..first+count */
    int32_t *block, *pending; /* rows that begin in a block, and those after them in it; -1: none */
    int32_t *done;            /* voxels of a row that have been read */
    int32_t *current;         /* rows of this block */
} Solver;

static size_t point_at(const VolConePlanes *p, int32_t i, int32_t j) { return (size_t)i * (size_t)p->size[1] + (size_t)j; }

/* ---- Before the domain ---- */

static void set_start(Solver *s)
{
    const VolCone *cone = s->of;
    const VolConePlanes *p = cone->planes;
    for (int32_t i = 0; i < p->size[0]; i++)
        for (int32_t j = 0; j < p->size[1]; j++) {
            size_t at = point_at(p, i, j);
            VolVec3 way = vol_sub(vol_cone_place(p, 0, i, j), p->origin);
            s->start[at] = cone->start ? cone->start[at] : (float)vol_spot_profile(cone->light, way);
        }
}

static bool needs_shares(const VolCone *cone) { return cone->planes->spreads && !(cone->taps > 0); }

/* sqrt(1 + a^2 + b^2) (1 + a^2 - |a b|) along axis 0, and so on; the diagonal has the sign of a b. */
static void set_shares(Solver *s)
{
    const VolConePlanes *p = s->of->planes;
    for (int32_t i = 0; i < p->size[0]; i++)
        for (int32_t j = 0; j < p->size[1]; j++) {
            VolVec3 along = p->along, u = p->across[0], v = p->across[1];
            double length = vol_length(along), x = p->low[0] + i, y = p->low[1] + j;
            double a = x * vol_length(u) / length, b = y * vol_length(v) / length, path = sqrt(1 + a * a + b * b);
            double shares[DIRECTIONS] = {1 + a * a - fabs(a * b), 1 + b * b - fabs(a * b), a * b};
            for (int d = 0; d < DIRECTIONS; d++) {
                float share = (float)(path * (d < 2 ? fmax(shares[d], 0) : shares[d]));
                s->share[d][point_at(p, i, j)] = share;
                s->largest_share = fmaxf(s->largest_share, fabsf(share));
            }
        }
}

/* ---- The blur ---- */

/* The light at a lattice point, or before the domain beyond the edge. */
static float light_at(const Solver *s, const float *light, int32_t i, int32_t j)
{
    const VolConePlanes *p = s->of->planes;
    if (i >= 0 && i < p->size[0] && j >= 0 && j < p->size[1])
        return light[point_at(p, i, j)];
    int32_t x = i < 0 ? 0 : i >= p->size[0] ? p->size[0] - 1 : i, y = j < 0 ? 0 : j >= p->size[1] ? p->size[1] - 1 : j;
    return s->start[point_at(p, x, y)];
}

static float passed_to(float here, float before, float after, float half_v)
{
    return here + half_v * ((before - here) + (after - here));
}

/* One pass along axis d < 2, or along the diagonals; `v`: on the axis of a light that spreads. */
static void blur_pass(const Solver *s, const float *from, float *to, int d, int32_t stride, float v)
{
    const VolConePlanes *p = s->of->planes;
    const float *share = p->spreads ? s->share[d] : NULL;
    const int32_t wide = p->size[1], step_i = d == 1 ? 0 : stride, step_j = d == 0 ? 0 : stride;
    for (int32_t i = 0; i < p->size[0]; i++) {
        const bool inner = i >= step_i && i + step_i < p->size[0] && d < 2;
        const size_t row = point_at(p, i, 0);
        const ptrdiff_t away = (ptrdiff_t)step_i * wide + step_j;
        for (int32_t j = 0; j < wide; j++) {
            const size_t at = row + (size_t)j;
            float half_v = 0.5f * (share ? v * share[at] : v);
            if (inner && j >= step_j && j + step_j < wide) {
                const float *here = from + at;
                to[at] = passed_to(*here, here[-away], here[away], half_v);
                continue;
            }
            int32_t side = half_v < 0 ? -step_j : step_j; /* the other diagonal */
            half_v = half_v < 0 ? -half_v : half_v;
            to[at] = passed_to(from[at], light_at(s, from, i - step_i, j - side), light_at(s, from, i + step_i, j + side),
                               half_v);
        }
    }
}

/* Of this variance along each axis, in lattice spacings. */
static void blur_by(const Solver *s, float *light, float *spare, double variance)
{
    const bool spreads = s->of->planes->spreads;
    const double most = spreads ? variance * (double)s->largest_share : variance;
    double each = 0.5; /* strides 1, 2, .. 2^(n-1) with v = 1/2: (4^n - 1) / 6 */
    int strides = 1;
    for (double power = 4; strides < MOST_STRIDES && each < most; strides++) {
        each += 0.5 * power;
        power *= 4;
    }
    for (int n = 0; n < strides && variance > 0; n++)
        for (int d = 0; d < (spreads ? DIRECTIONS : 2); d++) {
            blur_pass(s, light, spare, d, 1 << n, (float)fmin(0.5 * variance / each, 0.5));
            memcpy(light, spare, s->points * sizeof *light);
        }
}

/* K 9: the mean of four taps, bilinear. */
static void blur_by_taps(const Solver *s, float *light, float *spare, const double offset[2])
{
    const VolConePlanes *p = s->of->planes;
    for (int32_t i = 0; i < p->size[0]; i++)
        for (int32_t j = 0; j < p->size[1]; j++) {
            float sum = 0;
            for (int tap = 0; tap < 4; tap++) {
                double at = tap & 1 ? offset[tap >> 1] : -offset[tap >> 1], whole = floor(at);
                int32_t k = (int32_t)whole;
                float f = (float)(at - whole), low, high;
                low = tap < 2 ? light_at(s, light, i + k, j) : light_at(s, light, i, j + k);
                high = tap < 2 ? light_at(s, light, i + k + 1, j) : light_at(s, light, i, j + k + 1);
                sum += low + f * (high - low);
            }
            spare[point_at(p, i, j)] = 0.25f * sum;
        }
    memcpy(light, spare, s->points * sizeof *light);
}

/* Between planes k and k + 1. */
static void blur(const Solver *s, float *light, float *spare, int32_t k)
{
    const VolCone *cone = s->of;
    const VolConePlanes *p = cone->planes;
    double low = p->first + k * p->step, high = low + p->step, length = vol_length(p->along);
    double edge[2] = {vol_length(p->across[0]), vol_length(p->across[1])};
    if (cone->taps > 0) {
        double scale = p->spreads ? 0.5 * (low + high) : 1;
        double offset[2] = {cone->taps / (edge[0] * scale), cone->taps / (edge[1] * scale)};
        blur_by_taps(s, light, spare, offset);
        return;
    }
    double variance = p->spreads ? cone->rate * (1 / low - 1 / high) : cone->rate * p->step * length;
    blur_by(s, light, spare, variance / (edge[0] * edge[0]));
}

/* ---- A block of planes ---- */

static VolStatus pass_row(void *user, size_t index, int thread, VolError *err)
{
    const Solver *s = user;
    const VolCone *cone = s->of;
    size_t rows = (size_t)cone->planes->size[0], k = index / rows, i = index % rows;
    float *passed[3] = {NULL, NULL, NULL};
    for (int c = 0; c < cone->channels; c++)
        passed[c] = s->passed[k][c] + point_at(cone->planes, (int32_t)i, 0);
    return cone->pass(cone->user, cone->planes, s->first + (int32_t)k, (int32_t)i, thread, passed, err);
}

static VolStatus advance_channel(void *user, size_t c, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const Solver *s = user;
    for (int32_t k = 0; k < s->count; k++) {
        float *to = s->light[k + 1][c];
        memcpy(to, s->light[k][c], s->points * sizeof *to);
        blur(s, to, s->spare[c], s->first + k);
        for (size_t at = 0; at < s->points; at++)
            to[at] *= s->passed[k][c][at];
    }
    return VOL_OK;
}

/* ---- Voxels ---- */

/* Plane and lattice coordinates of a place. */
static void find(const VolConePlanes *p, VolVec3 place, double out[3])
{
    VolVec3 d = vol_sub(place, p->origin);
    for (int r = 0; r < 3; r++)
        out[r] = p->to_plane[r][0] * d.x + p->to_plane[r][1] * d.y + p->to_plane[r][2] * d.z;
    double w = out[0];
    out[0] = (w - p->first) / p->step;
    if (p->step == 0)
        out[0] = 0;
    for (int r = 1; r < 3; r++)
        out[r] = (p->spreads ? out[r] / w : out[r]) - p->low[r - 1];
}

/* Voxel m of a row, from the end that is nearer to the light. */
static VolVec3 voxel_place(const VolCone *cone, const VolConeRow *row, int32_t m)
{
    return vol_apply(&cone->index_to_world, vol_vec3(row->first[0], row->first[1], (double)row->first[2] + m));
}

static int32_t voxel_number(const VolCone *cone, const VolConeRow *row, int32_t m)
{
    const double *to = cone->planes->to_plane[0];
    const double *way = cone->index_to_world.m[2];
    bool away = to[0] * way[0] + to[1] * way[1] + to[2] * way[2] >= 0;
    return away ? m : row->count - 1 - m;
}

static int32_t whole_in(double x, int32_t most)
{
    return x >= most ? most : x > 0 ? (int32_t)x : 0; /* NaN: 0 */
}

static int32_t plane_before(const VolConePlanes *p, double k) { return whole_in(k, p->count - 1); }

static float between(const Solver *s, int c, int32_t k, double f, const double at[2])
{
    const VolConePlanes *p = s->of->planes;
    int32_t i = whole_in(at[0], p->size[0] - 2), j = whole_in(at[1], p->size[1] - 2);
    double x = fmin(fmax(at[0] - i, 0), 1), y = fmin(fmax(at[1] - j, 0), 1), plane[2];
    for (int n = 0; n < 2; n++) {
        const float *from = s->light[k + n][c] + point_at(p, i, j), *next = from + p->size[1];
        double low = (double)from[0] + y * ((double)from[1] - (double)from[0]);
        double high = (double)next[0] + y * ((double)next[1] - (double)next[0]);
        plane[n] = low + x * (high - low);
    }
    return (float)(plane[0] + f * (plane[1] - plane[0]));
}

/* Reads what lies in the block; whether something is left. */
static bool read_row(const Solver *s, int32_t r)
{
    const VolCone *cone = s->of;
    const VolConePlanes *p = cone->planes;
    const VolConeRow *row = &cone->rows[r];
    for (; s->done[r] < row->count; s->done[r]++) {
        int32_t m = voxel_number(cone, row, s->done[r]);
        double at[3];
        find(p, voxel_place(cone, row, m), at);
        int32_t k = plane_before(p, at[0]);
        if (k >= s->first + s->count)
            return true;
        for (int c = 0; c < cone->channels; c++)
            cone->out[c][row->at + (size_t)m] = between(s, c, k - s->first, fmin(fmax(at[0] - k, 0), 1), at + 1);
    }
    return false;
}

enum { ROWS = 64 }; /* a thread's at a time */

static VolStatus read_rows(void *user, size_t index, int thread, VolError *err)
{
    (void)thread;
    (void)err;
    const Solver *s = user;
    for (size_t n = index * ROWS; n < (index + 1) * ROWS && s->current[n] >= 0; n++)
        read_row(s, s->current[n]);
    return VOL_OK;
}

/* The row waits for the block that its next voxel lies in. */
static void wait_for_block(Solver *s, int32_t r)
{
    const VolCone *cone = s->of;
    double at[3];
    if (s->done[r] >= cone->rows[r].count)
        return;
    find(cone->planes, voxel_place(cone, &cone->rows[r], voxel_number(cone, &cone->rows[r], s->done[r])), at);
    int32_t block = plane_before(cone->planes, at[0]) / BLOCK;
    s->pending[r] = s->block[block];
    s->block[block] = r;
}

static VolStatus read_block(Solver *s, VolError *err)
{
    size_t count = 0;
    for (int32_t r = s->block[s->first / BLOCK]; r >= 0; r = s->pending[r])
        s->current[count++] = r;
    s->current[count] = -1;
    VolStatus status = vol_parallel(s->of->threads, (count + ROWS - 1) / ROWS, read_rows, s, err);
    for (size_t n = 0; status == VOL_OK && n < count; n++)
        wait_for_block(s, s->current[n]);
    return status;
}

static VolStatus solve_block(Solver *s, VolError *err)
{
    const VolCone *cone = s->of;
    size_t rows = (size_t)s->count * (size_t)cone->planes->size[0];
    VolStatus status = vol_parallel(cone->threads, rows, pass_row, s, err);
    if (status == VOL_OK)
        status = vol_parallel(cone->threads, (size_t)cone->channels, advance_channel, s, err);
    if (status == VOL_OK)
        status = read_block(s, err);
    for (int c = 0; c < cone->channels; c++)
        memcpy(s->light[0][c], s->light[s->count][c], s->points * sizeof(float));
    return status;
}

/* ---- Memory ---- */

static void solver_free(Solver *s)
{
    free(s->start);
    for (int d = 0; d < DIRECTIONS; d++)
        free(s->share[d]);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k <= BLOCK; k++)
            free(s->light[k][c]);
        for (int k = 0; k < BLOCK; k++)
            free(s->passed[k][c]);
        free(s->spare[c]);
    }
    free(s->block);
    free(s->pending);
    free(s->done);
    free(s->current);
}

static bool new_plane(const Solver *s, float **out) { return (*out = vol_alloc(s->points, sizeof **out)) != NULL; }

static VolStatus solver_new(const VolCone *cone, Solver *s, VolError *err)
{
    const VolConePlanes *p = cone->planes;
    *s = (Solver){.of = cone, .points = (size_t)p->size[0] * (size_t)p->size[1]};
    bool enough = new_plane(s, &s->start);
    for (int d = 0; needs_shares(cone) && d < DIRECTIONS; d++)
        enough = enough && new_plane(s, &s->share[d]);
    for (int c = 0; c < cone->channels; c++) {
        for (int k = 0; k <= BLOCK; k++)
            enough = enough && new_plane(s, &s->light[k][c]);
        for (int k = 0; k < BLOCK; k++)
            enough = enough && new_plane(s, &s->passed[k][c]);
        enough = enough && new_plane(s, &s->spare[c]);
    }
    size_t blocks = (size_t)(p->count / BLOCK + 1);
    s->block = vol_alloc(blocks, sizeof *s->block);
    s->pending = vol_alloc(cone->row_count, sizeof *s->pending);
    s->done = vol_alloc_zero(cone->row_count, sizeof *s->done);
    s->current = vol_alloc(cone->row_count + 1, sizeof *s->current);
    if (!enough || !s->block || !s->pending || !s->done || !s->current)
        return vol_fail_memory(err, s->points * sizeof(float) * (2 * BLOCK + 2) + cone->row_count * 3 * sizeof *s->done);
    for (size_t b = 0; b < blocks; b++)
        s->block[b] = -1;
    return VOL_OK;
}

VolStatus vol_cone_solve(const VolCone *cone, VolError *err)
{
    const VolConePlanes *p = cone->planes;
    Solver s = {0};
    if (cone->row_count > INT32_MAX)
        return vol_fail(err, VOL_BAD_INPUT, "%zu rows of voxels to be lit, at most %d", cone->row_count, INT32_MAX);
    VolStatus status = solver_new(cone, &s, err);
    if (status == VOL_OK) {
        set_start(&s);
        if (needs_shares(cone))
            set_shares(&s);
        for (int c = 0; c < cone->channels; c++)
            memcpy(s.light[0][c], s.start, s.points * sizeof(float));
        for (size_t r = 0; r < cone->row_count; r++)
            wait_for_block(&s, (int32_t)r);
    }
    for (s.first = 0; status == VOL_OK && s.first < p->count; s.first += BLOCK) {
        s.count = p->count - s.first < BLOCK ? p->count - s.first : BLOCK;
        status = solve_block(&s, err);
    }
    solver_free(&s);
    return status;
}
