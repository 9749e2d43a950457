/* The heavy loops of diffusion.
 *
 * Along axes 1 and 2 the operator is diagonal in cosines.  Along axis 0 each mode is left as a tridiagonal system, which
 * costs less than a transform there and back and gives the same:
 *     (c + s (2 - [i = 0] - [i = n-1])) x_i - s x_{i-1} - s x_{i+1} = f_i,     c = 1 + eigen_1 + eigen_2.
 * Its pivots d_i = c + 2 s - s^2 / d_{i-1} would lose c where s is 1e6.  By what they exceed s, e_i = d_i - s (the last:
 * d_i), nothing is ever subtracted:
 *     e_0 = c,     e_i = c + q_{i-1} e_{i-1},     q_i = s / (e_i + s),     y_i = f_i + q_{i-1} y_{i-1},
 *     x_i = y_i / (e_i + s) + q_i x_{i+1},
 * so that every x is as accurate as the numbers themselves, whatever s.
 *
 * A lane is a line.  Along axis 2 the lines of a slice are turned, four by four, on their way to the registers.
 *
 * PROVIDES    diffusion_transform(), diffusion_solve(), diffusion_preview_rows(), diffusion_preview_slice() */
#ifndef VOL_LIGHT_DIFFUSION_TMPL_H
#define VOL_LIGHT_DIFFUSION_TMPL_H

#include "light/cosine_transform_tmpl.h"
#include "light/diffusion_kernels.h"

static inline int at_most(int a, int b) { return a < b ? a : b; }

/* ---- Lines that lie along memory, a lane each ---- */

/* LANES lines of memory: lane i is line[i], `stride` numbers from the one before. */
typedef struct Lines {
    int line[LANES], count; /* there are `count` of them */
    size_t stride;
    ints offsets; /* those beyond are the last again, and are not stored */
} Lines;

ALWAYS_INLINE void lines_place(Lines *lines)
{
    lane_int at[LANES];
    for (int i = 0; i < LANES; i++)
        at[i] = (lane_int)((size_t)at_most(lines->line[i], lines->count - 1) * lines->stride);
    memcpy(&lines->offsets, at, sizeof at);
}

/* Which line shares a complex number with which must not depend on LANES, since either is rounded beside the other: of 16
 * lines the first 8 are real parts, the other 8 imaginary ones (half 1). */
enum { PAIRED = 8 };
ALWAYS_INLINE int paired_line(int half, int lane) { return lane / PAIRED * 2 * PAIRED + half * PAIRED + lane % PAIRED; }

ALWAYS_INLINE void store_turned(float *to, const Lines *lines, const reals column[4])
{
    reals row[4];
    transpose_quads(column, row);
    for (int i = 0; i < 4; i++) {
        float numbers[LANES];
        memcpy(numbers, &row[i], sizeof numbers);
        for (int l = i; l < LANES; l += 4)
            if (lines->line[l] < lines->count)
                memcpy(to + lines->offsets[l], numbers + (l - i), 4 * sizeof *to);
    }
}

/* Number k of every line to lanes[k * step]. */
ALWAYS_INLINE void load_lines(const float *from, int n, const Lines *lines, reals *lanes, size_t step)
{
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        reals column[4];
        load_quads(from + k, lines->offsets, column);
        for (int i = 0; i < 4; i++)
            lanes[(size_t)(k + i) * step] = column[i];
    }
    for (; k < n; k++)
        lanes[(size_t)k * step] = gather_reals(from + k, lines->offsets);
}

ALWAYS_INLINE void store_lines(float *to, int n, const Lines *lines, const reals *lanes, size_t step)
{
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        reals column[4];
        for (int i = 0; i < 4; i++)
            column[i] = lanes[(size_t)(k + i) * step];
        store_turned(to + k, lines, column);
    }
    for (; k < n; k++)
        for (int l = 0; l < LANES; l++)
            if (lines->line[l] < lines->count)
                to[lines->offsets[l] + k] = lanes[(size_t)k * step][l];
}

/* ---- Transforms of a slice ---- */

/* From order to cosine_position() or back, by way of other memory. */
ALWAYS_INLINE void to_positions(int n, const Complexes *in_order, Complexes *out)
{
    for (int j = 0; j < n; j++)
        out[cosine_position(n, j)] = in_order[j];
}
ALWAYS_INLINE void from_positions(int n, const Complexes *from, Complexes *in_order)
{
    for (int j = 0; j < n; j++) {
        Complexes a = from[cosine_position(n, j)];
        in_order[j] = (Complexes){a.im, a.re};
    }
}

/* 2 LANES lines in `lines`, in order, there and back; `work`: vol_cosine_work() vectors. */
ALWAYS_INLINE void transform_lines(const VolCosine *plan, bool inverse, Complexes *lines, Complexes *work)
{
    if (inverse) {
        memcpy(work, lines, (size_t)plan->n * sizeof *work);
        from_positions(plan->n, cosine_inverse(plan, work), lines);
    } else {
        to_positions(plan->n, lines, work);
        memcpy(lines, cosine_forward(plan, work), (size_t)plan->n * sizeof *lines);
    }
}

static void transform_rows(const VolModes *modes, float *slice, bool inverse, Complexes *lines, Complexes *work)
{
    const int rows = modes->n[1], n = modes->n[2];
    for (int row = 0; row < rows; row += 2 * LANES) {
        float *first = slice + (size_t)row * (size_t)n;
        Lines half[2];
        for (int h = 0; h < 2; h++) {
            half[h] = (Lines){.count = rows - row, .stride = (size_t)n};
            for (int i = 0; i < LANES; i++)
                half[h].line[i] = paired_line(h, i);
            lines_place(&half[h]);
        }
        load_lines(first, n, &half[0], &lines->re, 2);
        load_lines(first, n, &half[1], &lines->im, 2);
        transform_lines(modes->cosine[2], inverse, lines, work);
        store_lines(first, n, &half[0], &lines->re, 2);
        store_lines(first, n, &half[1], &lines->im, 2);
    }
}

/* 2 LANES numbers of a row, or fewer and zeros, and back. */
ALWAYS_INLINE Complexes load_pairs(const float *from)
{
#if defined(REALS_AVX512)
    reals low = load_lanes(from), high = load_lanes(from + LANES);
    return (Complexes){__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23),
                       __builtin_shufflevector(low, high, 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31)};
#else
    return (Complexes){load_lanes(from), load_lanes(from + LANES)};
#endif
}

ALWAYS_INLINE void store_pairs(float *to, Complexes a)
{
#if defined(REALS_AVX512)
    store_lanes(to, __builtin_shufflevector(a.re, a.im, 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23));
    store_lanes(to + LANES,
                __builtin_shufflevector(a.re, a.im, 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31));
#else
    store_lanes(to, a.re);
    store_lanes(to + LANES, a.im);
#endif
}

static void transform_columns(const VolModes *modes, float *slice, bool inverse, Complexes *lines, Complexes *work)
{
    const int n = modes->n[1], columns = modes->n[2];
    for (int column = 0; column < columns; column += 2 * LANES) {
        const int count = at_most(columns - column, 2 * LANES);
        const bool whole = count == 2 * LANES;
        float *first = slice + column, some[2 * LANES] = {0};
        for (int j = 0; j < n; j++, first += columns) {
            if (!whole)
                memcpy(some, first, (size_t)count * sizeof *some);
            lines[j] = load_pairs(whole ? first : some);
        }
        transform_lines(modes->cosine[1], inverse, lines, work);
        first = slice + column;
        for (int j = 0; j < n; j++, first += columns) {
            store_pairs(whole ? first : some, lines[j]);
            if (!whole)
                memcpy(first, some, (size_t)count * sizeof *some);
        }
    }
}

static inline void diffusion_transform(const VolModes *modes, float *slice, bool inverse, float *memory)
{
    Complexes *lines = (Complexes *)(void *)memory;
    int longest = modes->n[1] > modes->n[2] ? modes->n[1] : modes->n[2];
    if (modes->n[2] > 1)
        transform_rows(modes, slice, inverse, lines, lines + longest);
    if (modes->n[1] > 1)
        transform_columns(modes, slice, inverse, lines, lines + longest);
}

/* ---- Modes along axis 0 ---- */

typedef struct ModesRow {
    reals excess[VOL_MODES / LANES], y[VOL_MODES / LANES], c[VOL_MODES / LANES];
} ModesRow;

/* Voxel i of all modes: `share` and `part`, y / (e + s), of this one; `before`: the shares of the one before, or NULL. */
ALWAYS_INLINE void eliminate(ModesRow *row, const float *f, const reals *before, reals s, int vectors, reals *share,
                             reals *part)
{
    for (int v = 0; v < vectors; v++) {
        reals e = row->c[v], y = load_lanes(f + v * LANES);
        if (before) {
            e = e + before[v] * row->excess[v];
            y = y + before[v] * row->y[v];
        }
        row->excess[v] = e;
        row->y[v] = y;
        reals over = reals_all(1) / (e + s);
        share[v] = s * over;
        part[v] = y * over;
    }
}

static inline void diffusion_solve(const VolModes *modes, float *field, int row, int first, int count, float *memory)
{
    enum { VECTORS = VOL_MODES / LANES };
    const int n = modes->n[0], vectors = (count + LANES - 1) / LANES;
    const size_t stride = (size_t)modes->n[1] * (size_t)modes->n[2], bytes = (size_t)count * sizeof *field;
    float *at = field + (size_t)row * (size_t)modes->n[2] + (size_t)first;
    reals *share = (reals *)(void *)memory, *part = share + (size_t)n * VECTORS;
    float some[VOL_MODES] = {0};
    ModesRow state;
    memcpy(some, modes->eigen[2] + first, bytes);
    for (int v = 0; v < vectors; v++)
        state.c[v] = load_lanes(some + v * LANES) + reals_all(modes->eigen[1][row] + 1);
    for (int i = 0; i < n; i++) {
        size_t k = (size_t)i * VECTORS;
        memcpy(some, at + (size_t)i * stride, bytes);
        eliminate(&state, some, i ? share + k - VECTORS : NULL, reals_all(i < n - 1 ? modes->s : 0), vectors, share + k,
                  part + k);
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int v = 0; v < vectors; v++) {
            size_t k = (size_t)i * VECTORS + (size_t)v;
            state.y[v] = i < n - 1 ? part[k] + share[k] * state.y[v] : part[k];
        }
        memcpy(at + (size_t)i * stride, state.y, bytes);
    }
}

/* ---- The preview ---- */

/* Lines side by side in `f`, number i of all of them at f[i * step]. */
ALWAYS_INLINE void solve_lines(const VolPivots *pivots, reals *f, size_t step)
{
    const int n = pivots->n;
    reals y = f[0];
    for (int i = 1; i < n; i++) {
        y = f[(size_t)i * step] + reals_all(pivots->share[i - 1]) * y;
        f[(size_t)i * step] = y;
    }
    reals x = reals_all(pivots->over[n - 1]) * y;
    f[(size_t)(n - 1) * step] = x;
    for (int i = n - 2; i >= 0; i--) {
        x = reals_all(pivots->over[i]) * f[(size_t)i * step] + reals_all(pivots->share[i]) * x;
        f[(size_t)i * step] = x;
    }
}

/* Rows of a plane, `n` numbers each: row += share * before; row = over * row + share * after. */
ALWAYS_INLINE void add_row(float *row, const float *before, float share, int n)
{
    int k = 0;
    for (; k + LANES <= n; k += LANES)
        store_lanes(row + k, load_lanes(row + k) + reals_all(share) * load_lanes(before + k));
    for (; k < n; k++)
        row[k] = row[k] + share * before[k];
}
ALWAYS_INLINE void substitute_row(float *to, const float *row, float over, const float *after, float share, int n)
{
    int k = 0;
    for (; k + LANES <= n; k += LANES)
        store_lanes(to + k, reals_all(over) * load_lanes(row + k) + reals_all(share) * load_lanes(after + k));
    for (; k < n; k++)
        to[k] = over * row[k] + share * after[k];
}
ALWAYS_INLINE void scale_row(float *to, const float *row, float over, int n)
{
    for (int k = 0; k < n; k++)
        to[k] = over * row[k];
}

/* Rows in `from`, `from_stride` apart, to `to`, which may be the same. */
ALWAYS_INLINE void solve_rows(const VolPivots *pivots, float *from, size_t from_stride, float *to, size_t stride, int count)
{
    const int n = pivots->n;
    for (int i = 1; i < n; i++)
        add_row(from + (size_t)i * from_stride, from + (size_t)(i - 1) * from_stride, pivots->share[i - 1], count);
    size_t last = (size_t)(n - 1);
    scale_row(to + last * stride, from + last * from_stride, pivots->over[n - 1], count);
    for (int i = n - 2; i >= 0; i--)
        substitute_row(to + (size_t)i * stride, from + (size_t)i * from_stride, pivots->over[i],
                       to + (size_t)(i + 1) * stride, pivots->share[i], count);
}

/* The lines along axis 2 go to a plane of their own, where those along axis 0 are solved. */
static inline void diffusion_preview_rows(const int n[3], const VolPivots pivots[3], float *field, int row, float *memory)
{
    const size_t stride = (size_t)n[1] * (size_t)n[2], length = (size_t)n[2];
    float *plane = memory, *at = field + (size_t)row * length;
    size_t numbers = ((size_t)n[0] * length + VOL_MOST_LANES - 1) / VOL_MOST_LANES * VOL_MOST_LANES;
    reals *lines = (reals *)(void *)(memory + numbers);
    for (int i = 0; i < n[0]; i += LANES) {
        Lines from = {.count = n[0] - i, .stride = stride}, to = {.count = n[0] - i, .stride = length};
        for (int l = 0; l < LANES; l++)
            from.line[l] = to.line[l] = l;
        lines_place(&from);
        lines_place(&to);
        load_lines(at + (size_t)i * stride, n[2], &from, lines, 1);
        solve_lines(&pivots[2], lines, 1);
        store_lines(plane + (size_t)i * length, n[2], &to, lines, 1);
    }
    solve_rows(&pivots[0], plane, length, at, stride, n[2]);
}

static inline void diffusion_preview_slice(const int n[3], const VolPivots *pivots, float *slice)
{
    solve_rows(pivots, slice, (size_t)n[2], slice, (size_t)n[2], n[2]);
}

#endif
