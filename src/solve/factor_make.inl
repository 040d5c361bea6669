// SPDX-License-Identifier: MIT
//
// The numbers of a factor, and solving with it; compiled once for each kind of processor. All work
// on a front is done by one kernel, a tile of 4 columns and a few rows that stays in registers
// while the columns to its left are taken off. Each number is a sum in the order of the columns,
// whatever the tile, so bits do not depend on it.

// Columns taken off a tile at a time, so that what is read stays in a cache.
#define DEPTH 64

// The loops over columns and rows of a tile vanish, so that it stays in registers.
#define UNROLL _Pragma("GCC unroll 4")

// As many numbers as a register holds, at any address: larger vectors would not stay in registers.
#ifdef __AVX2__
#define LANE 4
#else
#define LANE 2
#endif
typedef double lane_slot __attribute__((vector_size(8 * LANE), aligned(8), may_alias));
#define SLOT(at) (*(lane_slot *)(at))
#define SLOT_OF(at) (*(const lane_slot *)(at))

// --- Tiles

// A place in the columns of a front, from one column to the next `stride` numbers.
typedef struct tile {
    double *at; // its first number
    long stride;
    const double *left; // rows of the tile in the columns to be taken off
    const double *up;   // rows that are the columns of the tile, in the same columns
    long left_stride;
    int depth; // how many columns
} tile;

// at -= left * up^T; divided by the triangle at `corner` unless that is NULL, whose diagonal holds
// inverses. `n`: rows, in lanes.
static inline __attribute__((always_inline)) void take_off(const tile *t, int n,
                                                           const double *corner) {
    lane_slot sum[4][2];
    UNROLL
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < n; i++)
            sum[j][i] = SLOT(t->at + j * t->stride + LANE * i);
    const double *left = t->left, *up = t->up;
    for (int k = 0; k < t->depth; k++) {
        lane_slot l[2];
        for (int i = 0; i < n; i++)
            l[i] = SLOT_OF(left + LANE * i);
        UNROLL
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < n; i++)
                sum[j][i] -= l[i] * up[j];
        left += t->left_stride;
        up += t->left_stride;
    }
    if (corner != NULL) {
        UNROLL
        for (int j = 0; j < 4; j++) {
            for (int i = 0; i < n; i++) {
                for (int k = 0; k < j; k++)
                    sum[j][i] -= sum[k][i] * corner[k * t->stride + j];
                sum[j][i] *= corner[j * t->stride + j];
            }
        }
    }
    UNROLL
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < n; i++)
            SLOT(t->at + j * t->stride + LANE * i) = sum[j][i];
}

// A column of tiles, n_row rows, a multiple of 4.
static void take_off_rows(tile t, int n_row, const double *corner) {
    const int rest = n_row % (2 * LANE);
    if (rest != 0) {
        take_off(&t, 1, corner);
        t.at += LANE;
        t.left += LANE;
    }
    for (int i = rest; i < n_row; i += 2 * LANE) {
        take_off(&t, 2, corner);
        t.at += 2 * LANE;
        t.left += 2 * LANE;
    }
}

// --- Pivots

// Cholesky's method on the triangle of n columns at `corner`; false where a pivot is not positive,
// *broken is then its column. The diagonal takes inverses.
static bool factorise_corner(double *corner, long stride, int n, int *broken) {
    for (int j = 0; j < n; j++) {
        double *column = corner + j * stride;
        for (int k = 0; k < j; k++)
            for (int i = j; i < n; i++)
                column[i] -= corner[k * stride + i] * corner[k * stride + j];
        const double inverse = 1 / sqrt(column[j]);
        *broken = j;
        // Not for zero, for what is negative, nor for what is no number.
        if (!(inverse > 0 && inverse <= 1.7976931348623157e308)) return false;
        column[j] = inverse;
        for (int i = j + 1; i < n; i++)
            column[i] *= inverse;
    }
    return true;
}

// The first two columns, where the number of columns is not a multiple of 4: n_row rows below them.
static void divide_pair(double *panel, long stride, int n_row) {
    const double inverse[2] = {panel[0], panel[stride + 1]}, lower = panel[1];
    double *a = panel + 2, *b = a + stride;
    for (int i = 0; i < n_row; i += LANE) {
        const lane_slot x = SLOT(a + i) * inverse[0];
        SLOT(a + i) = x;
        SLOT(b + i) = (SLOT(b + i) - x * lower) * inverse[1];
    }
}

// Columns of L of a front, from left to right; row of the pivot that is not positive, -1: none.
static int factorise_pivots(const nmm_front *front, double *panel) {
    const int n = 2 * front->n_pivot, n_all = n + front->padded;
    const long stride = front->stride;
    int broken = 0, first = 0;
    if (n % 4 != 0) {
        if (!factorise_corner(panel, stride, 2, &broken)) return front->first;
        divide_pair(panel, stride, n_all - 2);
        first = 2;
    }
    for (int j = first; j < n; j += 4) {
        double *corner = panel + j * stride + j;
        tile t = {corner, stride, panel + j, panel + j, stride, j};
        take_off(&t, 4 / LANE, NULL);
        if (!factorise_corner(corner, stride, 4, &broken)) return front->first + (j + broken) / 2;
        t.at += 4;
        t.left += 4;
        take_off_rows(t, n_all - j - 4, corner);
    }
    return -1;
}

// What the pivots leave of the rest of a front.
static void reduce_rest(const nmm_front *front, const double *panel, double *rest) {
    const int n = 2 * front->n_pivot, m = front->padded;
    for (int k = 0; k < n; k += DEPTH) {
        const double *columns = panel + (long)k * front->stride + n;
        const int depth = nmm_min_int(DEPTH, n - k);
        for (int j = 0; j < m; j += 4) {
            const tile t = {rest + (long)j * m + j, m,    columns + j, columns + j,
                            front->stride,          depth};
            take_off_rows(t, m - j, NULL);
        }
    }
}

// --- Assembly

static void add_pair(double *to, const double *from) {
    pair_wide a, b;
    memcpy(&a, to, sizeof a);
    memcpy(&b, from, sizeof b);
    a += b;
    memcpy(to, &a, sizeof a);
}

// What is left of a child into the front of its parent.
static void add_child(const nmm_factor *f, const nmm_front *child, const nmm_front *front,
                      double *panel, double *rest) {
    const int *place = f->place + child->row;
    const double *from = f->stack + child->rest;
    for (int j = 0; j < child->n_row; j++) {
        const bool pivot = place[j] < front->n_pivot;
        const long stride = pivot ? front->stride : front->padded;
        const int above = pivot ? 0 : front->n_pivot;
        double *to = (pivot ? panel : rest) + 2 * (place[j] - above) * stride;
        const double *column = from + 2 * (long)j * child->padded;
        for (int i = j; i < child->n_row; i++) {
            const int at = 2 * (place[i] - above);
            add_pair(to + at, column + 2 * i);
            add_pair(to + stride + at, column + child->padded + 2 * i);
        }
    }
}

static void assemble_front(const nmm_factor *f, const nmm_front *front, const double *value,
                           double *panel, double *rest) {
    const long n = 2 * front->n_pivot;
    memset(panel, 0, (size_t)(n * front->stride - n % 4) * sizeof(double));
    for (int k = front->entry; k < front->entry + front->n_entry; k++) {
        const double *block = value + 4 * (long)f->entry[k].block;
        double *to = panel + f->entry[k].at;
        memcpy(to, block, 2 * sizeof(double));
        memcpy(to + front->stride, block + 2, 2 * sizeof(double));
    }
    memset(rest, 0, (size_t)front->padded * (size_t)front->padded * sizeof(double));
    for (int c = front->child; c >= 0; c = f->front[c].sibling)
        add_child(f, &f->front[c], front, panel, rest);
}

// The numbers of the factor for those of K; row of K whose pivot is not positive, -1: none.
static int make_factor(nmm_factor *factor, const double *value) {
    for (int i = 0; i < factor->n_front; i++) {
        const nmm_front *front = &factor->front[i];
        double *panel = factor->value + front->column, *rest = factor->stack + front->rest;
        assemble_front(factor, front, value, panel, rest);
        const int broken = factorise_pivots(front, panel);
        if (broken >= 0) return factor->order[broken];
        reduce_rest(front, panel, rest);
    }
    return -1;
}

// --- Solving

// Pivots of a front: x = L^-1 x; below -= L x for the rows below.
static void solve_forward(const nmm_front *front, const double *panel, double *x, double *below) {
    const int n = 2 * front->n_pivot, m = front->padded;
    const long stride = front->stride;
    for (int j = 0; j < n; j += 2) {
        const double *a = panel + j * stride, *b = a + stride;
        const double u = x[j] * a[j], v = (x[j + 1] - a[j + 1] * u) * b[j + 1];
        x[j] = u;
        x[j + 1] = v;
        for (int i = j + 2; i < n; i++)
            x[i] = x[i] - a[i] * u - b[i] * v;
        a += n;
        b += n;
        for (int i = 0; i < m; i += LANE)
            SLOT(below + i) = SLOT(below + i) - SLOT_OF(a + i) * u - SLOT_OF(b + i) * v;
    }
}

// Sum of n products, n a multiple of 4, in four running sums.
static inline double dot_below(const double *a, const double *below, int n) {
    lane_slot sum[4 / LANE] = {{0}};
    for (int i = 0; i < n; i += 4)
        for (int k = 0; k < 4 / LANE; k++)
            sum[k] += SLOT_OF(a + i + LANE * k) * SLOT_OF(below + i + LANE * k);
    double all[4];
    memcpy(all, sum, sizeof all);
    return (all[0] + all[1]) + (all[2] + all[3]);
}

// x = L^-T (x - L^T below), from the last pivots to the first.
static void solve_backward(const nmm_front *front, const double *panel, double *x,
                           const double *below) {
    const int n = 2 * front->n_pivot, m = front->padded;
    const long stride = front->stride;
    for (int j = n - 2; j >= 0; j -= 2) {
        const double *a = panel + j * stride, *b = a + stride;
        double u = x[j] - dot_below(a + n, below, m), v = x[j + 1] - dot_below(b + n, below, m);
        for (int i = j + 2; i < n; i++) {
            u -= a[i] * x[i];
            v -= b[i] * x[i];
        }
        x[j + 1] = v * b[j + 1];
        x[j] = (u - a[j + 1] * x[j + 1]) * a[j];
    }
}

// z = K^-1 r by the factor; both [n_row][2] in the order of K.
static void apply_factor(const nmm_factor *f, const double *r, double *z) {
    double *x = f->x, *below = f->below;
    for (int k = 0; k < f->n_row; k++)
        memcpy(x + 2 * (long)k, r + 2 * (long)f->order[k], 2 * sizeof(double));
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        const int *row = f->row + front->row;
        memset(below, 0, (size_t)front->padded * sizeof(double));
        solve_forward(front, f->value + front->column, x + 2 * (long)front->first, below);
        for (int k = 0; k < front->n_row; k++)
            add_pair(x + 2 * (long)row[k], below + 2 * k);
    }
    for (int i = f->n_front - 1; i >= 0; i--) {
        const nmm_front *front = &f->front[i];
        const int *row = f->row + front->row;
        for (int k = 0; k < front->n_row; k++)
            memcpy(below + 2 * k, x + 2 * (long)row[k], 2 * sizeof(double));
        if (front->padded > 2 * front->n_row) memset(below + 2 * front->n_row, 0, 16);
        solve_backward(front, f->value + front->column, x + 2 * (long)front->first, below);
    }
    for (int k = 0; k < f->n_row; k++)
        memcpy(z + 2 * (long)f->order[k], x + 2 * (long)k, 2 * sizeof(double));
}

// y = K x.
static void multiply_all(const nmm_solver *s, const double *x, double *y) {
    for (int row = 0; row < s->n; row++)
        multiply_row_wide(s->row_start, s->col, s->wide.value, x, row, y + 2 * (long)row);
}
