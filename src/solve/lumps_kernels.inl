// SPDX-License-Identifier: MIT
//
// Kernels of Gauss-Seidel sweeps by lumps of six unknowns in float32; the includer defines KERNELS,
// the name of their table. Vectors of GNU C, so that every processor makes the same bits: without
// AVX the compiler makes two halves of them. What a sweep does to a lump is a chain of some 30
// operations, each waiting for the one before; in the order of the waves a processor works on
// several such chains at a time.

#include "lumps.h"
#include "solver.h"

#include <math.h>
#include <string.h>

typedef float lanes __attribute__((vector_size(32)));
typedef double wide_lanes __attribute__((vector_size(32)));
typedef int64_t wide_bits __attribute__((vector_size(32)));
typedef float four_lanes __attribute__((vector_size(16)));

// Numbers of a vector whose products are summed in float32; sums of these are in float64.
enum { CHUNK = 2048 };

// A negative pivot of a diagonal block with terms, whose diagonal elements were 0.5 .. 4, is taken
// from here on.
#define LEAST_NEGATIVE 1e-2

// What the numbers of a diagonal block, scaled, may have changed by and still be the same: what
// float32 rounds them by.
#define SAME 0x1p-23

// Eight numbers at a place. Lanes never go through a call: before AVX there is no rule for that.
typedef float lanes_there __attribute__((vector_size(32), aligned(4), may_alias));
#define AT(x) (*(lanes_there *)(x))
#define LOAD(x) (*(const lanes_there *)(x))
typedef float four_there __attribute__((vector_size(16), aligned(4), may_alias));
#define FOUR(x) (*(four_there *)(x))
#define FOUR_OF(x) (*(const four_there *)(x))
// Four of float64; more at once the compiler would copy in halves, to wait for them.
typedef double wide_there __attribute__((vector_size(32), aligned(8), may_alias));
#define WIDE(x) (*(wide_there *)(x))
#define LOAD_WIDE(x) (*(const wide_there *)(x))
#define SPREAD(v, k) __builtin_shufflevector(v, v, k, k, k, k, k, k, k, k)

// Two of them, which AVX-512 has in one register: the same sums.
#ifdef __AVX512F__
typedef float two_lanes __attribute__((vector_size(64)));
typedef float two_there __attribute__((vector_size(64), aligned(4), may_alias));
#define LOAD_TWO(x) (*(const two_there *)(x))
#define PAIR(v, i, k) __builtin_shufflevector(v, v, i, i, i, i, i, i, i, i, k, k, k, k, k, k, k, k)
typedef union both_lanes {
    lanes half[2];
    two_lanes all;
} both_lanes;
#else
typedef union both_lanes {
    lanes half[2];
} both_lanes;
#endif

// --- Diagonal blocks

// Lane c of *v becomes x, by its bits: there is no way through memory that would be waited for.
static inline __attribute__((always_inline)) void put(wide_lanes *v, int c, double x) {
    const wide_bits others = {c == 0 ? 0 : -1, c == 1 ? 0 : -1, c == 2 ? 0 : -1, c == 3 ? 0 : -1};
    const wide_lanes own = {c == 0 ? x : 0, c == 1 ? x : 0, c == 2 ? x : 0, c == 3 ? x : 0};
    *v = (wide_lanes)(((wide_bits)*v & others) | (wide_bits)own);
}

// One pivot of Gauss and Jordan on a 6x6 block, rows of 8 in registers: as long as k is a constant.
// The pivot's column becomes that of the inverse. False: it is neither positive nor below `turned`.
static inline __attribute__((always_inline)) bool eliminate(wide_lanes row[6][2], int k,
                                                            double turned) {
    const wide_lanes zero = {0, 0, 0, 0};
    const int h = k / 4, c = k % 4;
    const double diagonal = row[k][h][c], inverse = 1 / diagonal;
    put(&row[k][h], c, 1);
    row[k][0] *= inverse;
    row[k][1] *= inverse;
    for (int i = 0; i < 6; i++) {
        if (i == k) continue;
        const wide_lanes factor = row[i][h][c] - zero;
        put(&row[i][h], c, 0);
        row[i][0] -= factor * row[k][0];
        row[i][1] -= factor * row[k][1];
    }
    return diagonal > 0 || diagonal < turned;
}

// The inverse of a block in place; false: a pivot is neither positive nor below `turned`.
static inline __attribute__((always_inline)) bool invert_six(wide_lanes row[6][2], double turned) {
    return eliminate(row, 0, turned) && eliminate(row, 1, turned) && eliminate(row, 2, turned) &&
           eliminate(row, 3, turned) && eliminate(row, 4, turned) && eliminate(row, 5, turned);
}

// A power of two whose square times x is 0.5 .. 4; x > 0, the exponent is read from the bits.
static double scale_of(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    const int exponent = (int)(bits >> 52 & 0x7ff) - 1023;
    bits = (uint64_t)(1023 - exponent / 2) << 52;
    memcpy(&x, &bits, sizeof x);
    return x;
}

// The diagonal block of lump i with its terms, by columns. By the symmetry of the matrix its rows
// serve as columns.
static inline void read_diagonal(const nmm_lumps *lumps, const nmm_bsr *K,
                                 const nmm_coupling *coupling, int i, wide_lanes column[6][2]) {
    const wide_lanes zero = {0, 0, 0, 0};
#pragma GCC unroll 3
    for (int r = 0; r < 3; r++) {
        const double *row = K->value + 4 * (long)(K->diagonal[3 * lumps->order[i] + r] - r);
        const wide_lanes b[3] = {LOAD_WIDE(row), LOAD_WIDE(row + 4), LOAD_WIDE(row + 8)};
        column[2 * r][0] = __builtin_shufflevector(b[0], b[1], 0, 1, 4, 5);
        column[2 * r][1] = __builtin_shufflevector(b[2], zero, 0, 1, 4, 5);
        column[2 * r + 1][0] = __builtin_shufflevector(b[0], b[1], 2, 3, 6, 7);
        column[2 * r + 1][1] = __builtin_shufflevector(b[2], zero, 2, 3, 4, 5);
    }
    for (int half = lumps->first[i]; half >= 0; half = lumps->next[half]) {
        const double *push = coupling->push + 6 * (long)half;
        const double *pull = coupling->pull + 6 * (long)half;
        const wide_lanes upper = {push[0], push[1], push[2], push[3]};
        const wide_lanes lower = {push[4], push[5], 0, 0};
#pragma GCC unroll 6
        for (int c = 0; c < 6; c++) {
            column[c][0] += pull[c] * upper;
            column[c][1] += pull[c] * lower;
        }
    }
}

// Is the scaled block what it was, as far as float32 can tell? Most bodies have the one of the pass
// before, but for what rounding leaves of the ratio of forces that slide.
static inline bool same_diagonal(wide_lanes column[6][2], const double *kept, const double *scale) {
    const wide_lanes all[2] = {LOAD_WIDE(scale), LOAD_WIDE(scale + 4)};
    wide_lanes other = {0};
#pragma GCC unroll 6
    for (int c = 0; c < 6; c++) {
        const wide_lanes upper = (column[c][0] - LOAD_WIDE(kept + 8 * c)) * (scale[c] * all[0]);
        const wide_lanes lower = (column[c][1] - LOAD_WIDE(kept + 8 * c + 4)) * (scale[c] * all[1]);
        other += upper * upper + lower * lower;
    }
    return scale[0] > 0 && other[0] + other[1] + other[2] + other[3] <= SAME * SAME;
}

// Scales of lump i by the diagonal of the matrix; are they other ones?
static inline bool take_scale(const nmm_bsr *K, const int *diagonal, double *scale) {
    bool other = false;
    for (int j = 0; j < 6; j++) {
        const double was = scale[j];
        scale[j] = scale_of(K->value[4 * (long)diagonal[j / 2] + 3 * (j % 2)]);
        other = other || scale[j] != was;
    }
    return other;
}

// The inverse of a block, scaled; false as above.
static bool invert_scaled(const double *block, const double *scale, double turned, float *inverse) {
    const wide_lanes all[2] = {LOAD_WIDE(scale), LOAD_WIDE(scale + 4)};
    wide_lanes column[6][2];
#pragma GCC unroll 6
    for (int c = 0; c < 6; c++) {
        column[c][0] = LOAD_WIDE(block + 8 * c) * (scale[c] * all[0]);
        column[c][1] = LOAD_WIDE(block + 8 * c + 4) * (scale[c] * all[1]);
    }
    if (!invert_six(column, turned)) return false;
#pragma GCC unroll 6
    for (int c = 0; c < 6; c++) {
        FOUR(inverse + 8 * c) = __builtin_convertvector(column[c][0], four_lanes);
        FOUR(inverse + 8 * c + 4) = __builtin_convertvector(column[c][1], four_lanes);
    }
    return true;
}

// The inverse of the diagonal block of lump i, and its scale.
static bool take_diagonal(nmm_lumps *lumps, const nmm_bsr *K, const nmm_coupling *coupling, int i) {
    double *kept = lumps->own + 48 * (long)i, *scale = lumps->scale + 8 * (long)i;
    wide_lanes column[6][2];
    read_diagonal(lumps, K, coupling, i, column);
    lumps->changed[i] = NMM_LUMP_SAME;
    if (same_diagonal(column, kept, scale)) return true;
#pragma GCC unroll 6
    for (int c = 0; c < 6; c++) {
        WIDE(kept + 8 * c) = column[c][0];
        WIDE(kept + 8 * c + 4) = column[c][1];
    }
    const bool rescaled = take_scale(K, K->diagonal + 3 * (long)lumps->order[i], scale);
    lumps->changed[i] = rescaled ? NMM_LUMP_RESCALED : NMM_LUMP_OTHER;
    const bool has_terms = lumps->first[i] >= 0;
    return invert_scaled(kept, scale, has_terms ? -LEAST_NEGATIVE : -INFINITY,
                         lumps->inverse + 48 * (long)i);
}

// --- The matrix

// Three 2x2 blocks of the rows of a lump in one column of blocks, scaled: two columns of six.
static inline void take_two_columns(const double *const row[3], const wide_lanes left[3],
                                    const double *other, float *column) {
    const wide_lanes right = {other[0], other[1], other[0], other[1]};
    four_lanes part[3];
    for (int r = 0; r < 3; r++) {
        wide_lanes v;
        memcpy(&v, row[r], sizeof v);
        part[r] = __builtin_convertvector(v * left[r] * right, four_lanes);
    }
    const four_lanes zero = {0, 0, 0, 0};
    // Store by store: collected first they would be waited for.
    FOUR(column) = __builtin_shufflevector(part[0], part[1], 0, 2, 4, 6);
    FOUR(column + 4) = __builtin_shufflevector(part[2], zero, 0, 2, 4, 5);
    FOUR(column + 8) = __builtin_shufflevector(part[0], part[1], 1, 3, 5, 7);
    FOUR(column + 12) = __builtin_shufflevector(part[2], zero, 1, 3, 4, 5);
}

// A block of 6x6 at the three blocks from `value` on of each of three rows, `length` blocks apart.
static inline void take_block(const double *value, long length, const wide_lanes left[3],
                              const double *other, float *block) {
    const double *const at[3] = {value, value + 4 * length, value + 8 * length};
    for (int c = 0; c < 3; c++) {
        const double *const row[3] = {at[0] + 4 * c, at[1] + 4 * c, at[2] + 4 * c};
        take_two_columns(row, left, other + 2 * c, block + 16 * c);
    }
}

// What two bodies have to do with each other, terms as well, changes the diagonal blocks of both:
// one that is the same is enough, unless the scale of the other is new.
static inline bool is_other(const nmm_lump_change *changed, int i, int j) {
    return changed[i] + changed[j] >= NMM_LUMP_RESCALED;
}

// Of n blocks in a row those that have changed.
static void take_side(const nmm_lumps *lumps, const double *value, long length, int i, int n,
                      const int *place, float *block) {
    const double *scale = lumps->scale, *own = scale + 8 * (long)i;
    wide_lanes left[3];
    for (int r = 0; r < 3; r++)
        left[r] = (wide_lanes){own[2 * r], own[2 * r], own[2 * r + 1], own[2 * r + 1]};
    for (int k = 0; k < n; k++, value += 12, block += 48)
        if (is_other(lumps->changed, i, place[k]))
            take_block(value, length, left, scale + 8 * (long)place[k], block);
}

static void take_blocks(nmm_lumps *lumps, const nmm_bsr *K) {
    nmm_lump_change most = NMM_LUMP_SAME;
    for (int i = 0; i < lumps->n; i++)
        most = nmm_max_int(most, lumps->changed[i]);
    for (int i = 0; i < lumps->n; i++) {
        if (lumps->changed[i] + most < NMM_LUMP_RESCALED) continue;
        const int row = 3 * lumps->order[i];
        const int before = lumps->before_start[i], behind = lumps->behind_start[i + 1];
        const int n_before = lumps->before_start[i + 1] - before;
        const long length = K->row_start[row + 1] - K->row_start[row];
        const double *value = K->value + 4 * (long)K->row_start[row];
        take_side(lumps, value, length, i, n_before, lumps->before + before,
                  lumps->before_value + 48 * (long)before);
        take_side(lumps, value + 12 * (n_before + 1), length, i, lumps->behind_start[i] - behind,
                  lumps->behind + behind, lumps->behind_value + 48 * (long)behind);
    }
}

// Six numbers of a lump times its scales, and two zeros.
static inline void scale_six(const double *x, const double *scale, wide_lanes y[2]) {
    y[0] = LOAD_WIDE(x) * LOAD_WIDE(scale);
    y[1] = (wide_lanes){x[4] * scale[4], x[5] * scale[5], 0, 0};
}

// block += push pull^T.
static inline void add_product(const wide_lanes push[2], const wide_lanes pull[2], float *block) {
    const four_lanes upper = __builtin_convertvector(push[0], four_lanes);
    const four_lanes lower = __builtin_convertvector(push[1], four_lanes);
    for (int c = 0; c < 6; c++) {
        const float factor = (float)pull[c / 4][c % 4];
        FOUR(block + 8 * c) += upper * factor;
        FOUR(block + 8 * c + 4) += lower * factor;
    }
}

// What terms have of the blocks off the diagonal that have changed.
static void blend_terms(nmm_lumps *lumps, const nmm_coupling *coupling) {
    for (int half = 0; half < 2 * lumps->n_term; half++) {
        const int other = half ^ 1, i = lumps->half[half], j = lumps->half[other];
        if (i < 0 || j < 0 || !is_other(lumps->changed, i, j)) continue;
        float *block = j < i ? lumps->before_value : lumps->behind_value;
        wide_lanes push[2], pull[2];
        scale_six(coupling->push + 6 * (long)half, lumps->scale + 8 * (long)i, push);
        scale_six(coupling->pull + 6 * (long)other, lumps->scale + 8 * (long)j, pull);
        add_product(push, pull, block + 48 * (long)lumps->cross[half]);
    }
}

static bool take(nmm_lumps *lumps, const nmm_bsr *K, const nmm_coupling *coupling) {
    for (int i = 0; i < lumps->n; i++) {
        if (take_diagonal(lumps, K, coupling, i)) continue;
        // The next time nothing is what it was.
        memset(lumps->scale, 0, 8 * (size_t)lumps->n * sizeof *lumps->scale);
        return false;
    }
    take_blocks(lumps, K);
    blend_terms(lumps, coupling);
    return true;
}

// --- Vectors

// The sizes of x where they are larger than the numbers of most.
static inline void take_larger(const wide_lanes *x, wide_lanes *most) {
    const wide_lanes size = (wide_lanes)((wide_bits)*x & INT64_MAX);
    const wide_bits is = size > *most;
    *most = (wide_lanes)(((wide_bits)size & is) | ((wide_bits)*most & ~is));
}

static double load(const nmm_lumps *lumps, const double *x, float *y) {
    wide_lanes most = {0};
    for (int i = 0; i < lumps->n; i++) {
        wide_lanes own[2];
        scale_six(x + 6 * (long)lumps->order[i], lumps->scale + 8 * (long)i, own);
        take_larger(&own[0], &most);
        take_larger(&own[1], &most);
    }
    const double largest = nmm_max(nmm_max(most[0], most[1]), nmm_max(most[2], most[3]));
    const double factor = largest > 0 ? 1 / largest : 0;
    for (int i = 0; i < lumps->n; i++) {
        wide_lanes own[2];
        scale_six(x + 6 * (long)lumps->order[i], lumps->scale + 8 * (long)i, own);
        FOUR(y + 8 * (long)i) = __builtin_convertvector(own[0] * factor, four_lanes);
        FOUR(y + 8 * (long)i + 4) = __builtin_convertvector(own[1] * factor, four_lanes);
    }
    return largest;
}

static void add(const nmm_lumps *lumps, const float *y, double factor, double *x) {
    for (int i = 0; i < lumps->n; i++) {
        const double *scale = lumps->scale + 8 * (long)i;
        const float *from = y + 8 * (long)i;
        double *to = x + 6 * (long)lumps->order[i];
        const wide_lanes four = __builtin_convertvector(FOUR_OF(from), wide_lanes);
        WIDE(to) += factor * (LOAD_WIDE(scale) * four);
        to[4] += factor * (scale[4] * from[4]);
        to[5] += factor * (scale[5] * from[5]);
    }
}

// The three rows of a lump have the same columns, in threes: each x serves three blocks. The same
// sums as row by row.
static void residual(const nmm_solver *s, const double *extra) {
    const double *u = s->wide.u;
    for (int row = 0; row < s->n; row += 3) {
        const int *col = s->col + s->row_start[row];
        const long length = s->row_start[row + 1] - s->row_start[row];
        const double *value = s->wide.value + 4 * (long)s->row_start[row];
        wide_lanes sum[3] = {{0}};
        for (long k = 0; k < length; k++, value += 4) {
            const double *x = u + 2 * (long)col[k];
            const wide_lanes twice = {x[0], x[1], x[0], x[1]};
            for (int r = 0; r < 3; r++) {
                wide_lanes v;
                memcpy(&v, value + 4 * r * length, sizeof v);
                sum[r] += v * twice;
            }
        }
        for (int r = 0; r < 3; r++) {
            const long at = 2 * ((long)row + r);
            s->wide.r[at] = s->wide.f[at] - (sum[r][0] + sum[r][1]) - extra[at];
            s->wide.r[at + 1] = s->wide.f[at + 1] - (sum[r][2] + sum[r][3]) - extra[at + 1];
        }
    }
}

// --- Sweeps

// sum += three even columns and, apart, three odd ones of a block times a part of x.
static inline void add_block(const float *block, const lanes *x, both_lanes *sum) {
#ifdef __AVX512F__
    sum->all += LOAD_TWO(block) * PAIR(*x, 0, 1);
    sum->all += LOAD_TWO(block + 16) * PAIR(*x, 2, 3);
    sum->all += LOAD_TWO(block + 32) * PAIR(*x, 4, 5);
#else
    sum->half[0] += LOAD(block) * SPREAD(*x, 0);
    sum->half[1] += LOAD(block + 8) * SPREAD(*x, 1);
    sum->half[0] += LOAD(block + 16) * SPREAD(*x, 2);
    sum->half[1] += LOAD(block + 24) * SPREAD(*x, 3);
    sum->half[0] += LOAD(block + 32) * SPREAD(*x, 4);
    sum->half[1] += LOAD(block + 40) * SPREAD(*x, 5);
#endif
}

// Sum of n blocks times the parts of x at these places.
static inline void sum_blocks(const float *block, const int *place, int n, const float *x,
                              lanes *result) {
    both_lanes sum = {{{0}}};
    for (int k = 0; k < n; k++, block += 48) {
        const lanes part = LOAD(x + 8 * (long)place[k]);
        add_block(block, &part, &sum);
    }
    *result = sum.half[0] + sum.half[1];
}

// y = D^-1 x.
static inline void divide(const float *inverse, const lanes *x, lanes *y) {
    both_lanes sum = {{{0}}};
    add_block(inverse, x, &sum);
    *y = sum.half[0] + sum.half[1];
}

static void backward(const nmm_lumps *lumps, const float *v, float *t) {
    const int *start = lumps->behind_start;
    for (int i = lumps->n - 1; i >= 0; i--) {
        const long at = 8 * (long)i;
        lanes sum, part;
        sum_blocks(lumps->behind_value + 48 * (long)start[i + 1], lumps->behind + start[i + 1],
                   start[i] - start[i + 1], t, &sum);
        divide(lumps->inverse + 6 * at, &sum, &part);
        AT(t + at) = LOAD(v + at) - part;
    }
}

static void forward(const nmm_lumps *lumps, const float *v, const float *t, float *ahead,
                    float *y) {
    const int *start = lumps->before_start;
    for (int i = 0; i < lumps->n; i++) {
        const long at = 8 * (long)i;
        lanes sum, part;
        sum_blocks(lumps->before_value + 48 * (long)start[i], lumps->before + start[i],
                   start[i + 1] - start[i], ahead, &sum);
        divide(lumps->inverse + 6 * at, &sum, &part);
        const lanes own = LOAD(v + at) - part;
        AT(ahead + at) = own - LOAD(t + at);
        AT(y + at) = own;
    }
}

static void begin(const nmm_lumps *lumps, const float *x, float *y) {
    const int *start = lumps->before_start;
    for (int i = 0; i < lumps->n; i++) {
        const long at = 8 * (long)i;
        lanes sum, own;
        sum_blocks(lumps->before_value + 48 * (long)start[i], lumps->before + start[i],
                   start[i + 1] - start[i], y, &sum);
        sum = LOAD(x + at) - sum;
        divide(lumps->inverse + 6 * at, &sum, &own);
        AT(y + at) = own;
    }
}

// --- Directions: vectors of n numbers, n a multiple of 8

static inline double add_up(const lanes sum[4]) {
    const lanes all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    return (((double)all[0] + all[1]) + ((double)all[2] + all[3])) +
           (((double)all[4] + all[5]) + ((double)all[6] + all[7]));
}

// w -= p v and the product of what is left with `next`.
static double step(float *w, const float *v, float p, const float *next, long n) {
    double total = 0;
    for (long begin = 0; begin < n; begin += CHUNK) {
        const long end = begin + CHUNK < n ? begin + CHUNK : n;
        lanes sum[4] = {{0}};
        long i = begin;
#ifdef __AVX512F__
        two_lanes two[2] = {{0}};
        for (; i + 32 <= end; i += 32) {
            for (int k = 0; k < 2; k++) {
                const two_lanes left = LOAD_TWO(w + i + 16 * k) - LOAD_TWO(v + i + 16 * k) * p;
                *(two_there *)(w + i + 16 * k) = left;
                two[k] += left * LOAD_TWO(next + i + 16 * k);
            }
        }
        memcpy(sum, two, sizeof sum);
#else
        for (; i + 32 <= end; i += 32) {
            for (int k = 0; k < 4; k++) {
                const lanes left = LOAD(w + i + 8 * k) - LOAD(v + i + 8 * k) * p;
                AT(w + i + 8 * k) = left;
                sum[k] += left * LOAD(next + i + 8 * k);
            }
        }
#endif
        for (; i < end; i += 8) {
            const lanes left = LOAD(w + i) - LOAD(v + i) * p;
            AT(w + i) = left;
            sum[0] += left * LOAD(next + i);
        }
        total += add_up(sum);
    }
    return total;
}

static double orthogonalise(const float *basis, int m, long n, float *w, double *part) {
    double product = step(w, basis, 0, m > 0 ? basis : w, n);
    for (int j = 0; j < m; j++) {
        part[j] = product;
        product = step(w, basis + j * n, (float)product, j + 1 < m ? basis + (j + 1) * n : w, n);
    }
    return sqrt(product);
}

static void scale_all(float *x, long n, double factor) {
    for (long i = 0; i < n; i += 8)
        AT(x + i) *= (float)factor;
}

static void combine(const float *basis, int m, long n, const double *part, float *y) {
    memset(y, 0, (size_t)n * sizeof *y);
    for (int j = 0; j < m; j++)
        for (long i = 0; i < n; i += 8)
            AT(y + i) += LOAD(basis + j * n + i) * (float)part[j];
}

const nmm_lumps_kernels KERNELS = {.take = take,
                                   .load = load,
                                   .add = add,
                                   .residual = residual,
                                   .backward = backward,
                                   .forward = forward,
                                   .begin = begin,
                                   .orthogonalise = orthogonalise,
                                   .scale = scale_all,
                                   .combine = combine};
