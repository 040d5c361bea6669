// SPDX-License-Identifier: MIT
//
// Kernels of conjugate directions with Gauss-Seidel sweeps as preconditioner, for one matrix with a
// coupling; one text for any x86-64 and for AVX2, the same bits. K = L + D + U by lumps, which are
// single block rows or three rows of a body, whose diagonal block is inverted as a whole.
// Eisenstat's trick: (D + L)^-1 K (D + U)^-1 D costs no more than one product with K.

// Sum of the blocks begin .. end - 1 of a row, from the last to the first, so
// that what was found last is waited for last.
static inline void sum_down(const nmm_solver *s, const double *x, int begin, int end, double y[2]) {
    wide_lanes sum = {0, 0, 0, 0};
    for (int k = end - 1; k >= begin; k--) {
        wide_lanes v;
        pair_wide xk;
        memcpy(&v, s->wide.value + 4 * (long)k, sizeof v);
        memcpy(&xk, x + 2 * (long)s->col[k], sizeof xk);
        sum += v * __builtin_shufflevector(xk, xk, 0, 1, 0, 1);
    }
    y[0] = sum[0] + sum[1];
    y[1] = sum[2] + sum[3];
}

static inline void sum_up(const nmm_solver *s, const double *x, int begin, int end, double y[2]) {
    wide_lanes sum = {0, 0, 0, 0};
    for (int k = begin; k < end; k++) {
        wide_lanes v;
        pair_wide xk;
        memcpy(&v, s->wide.value + 4 * (long)k, sizeof v);
        memcpy(&xk, x + 2 * (long)s->col[k], sizeof xk);
        sum += v * __builtin_shufflevector(xk, xk, 0, 1, 0, 1);
    }
    y[0] = sum[0] + sum[1];
    y[1] = sum[2] + sum[3];
}

// The same for three rows that have the same columns: `count` blocks of each, from its block `from`
// on, up or down.
static inline void sum_three(const nmm_solver *s, const double *x, int row, int from, int count,
                             int step, double y[6]) {
    const int start = s->row_start[row], length = s->row_start[row + 1] - start;
    const double *value = s->wide.value + 4 * (long)start;
    const int *col = s->col + start;
    wide_lanes a = {0, 0, 0, 0}, b = {0, 0, 0, 0}, c = {0, 0, 0, 0};
    for (int i = 0, k = from; i < count; i++, k += step) {
        const double *block = value + 4 * (long)k;
        wide_lanes u, v, w;
        pair_wide pair;
        memcpy(&u, block, sizeof u);
        memcpy(&v, block + 4 * (long)length, sizeof v);
        memcpy(&w, block + 8 * (long)length, sizeof w);
        memcpy(&pair, x + 2 * (long)col[k], sizeof pair);
        const wide_lanes both = __builtin_shufflevector(pair, pair, 0, 1, 0, 1);
        a += u * both;
        b += v * both;
        c += w * both;
    }
    y[0] = a[0] + a[1];
    y[1] = a[2] + a[3];
    y[2] = b[0] + b[1];
    y[3] = b[2] + b[3];
    y[4] = c[0] + c[1];
    y[5] = c[2] + c[3];
}

// Sums of the blocks behind the diagonal block of a lump, and of those before it.
static inline void sum_behind(const nmm_solver *s, const nmm_gauss *g, int lump, const double *x,
                              double sum[6]) {
    const int row = g->lump * lump, first = g->diagonal[row], end = s->row_start[row + 1];
    if (g->lump == 3)
        sum_three(s, x, row, end - 1 - s->row_start[row], end - first - 3, -1, sum);
    else
        sum_down(s, x, first + 1, end, sum);
}

static inline void sum_before(const nmm_solver *s, const nmm_gauss *g, int lump, const double *x,
                              double sum[6]) {
    const int row = g->lump * lump, first = g->diagonal[row], begin = s->row_start[row];
    if (g->lump == 3)
        sum_three(s, x, row, 0, first - begin, 1, sum);
    else
        sum_up(s, x, begin, first, sum);
}

// y = x - D^-1 sum for a lump of three rows; inverse[6][8] by columns.
static inline void take_lump_three(const double *inverse, const double *sum, const double *x,
                                   double *y) {
    wide_lanes a = {0}, b = {0}, c = {0}, d = {0};
    for (int j = 0; j < 6; j += 2) {
        wide_lanes left0, left1, right0, right1;
        memcpy(&left0, inverse + 8 * j, sizeof left0);
        memcpy(&left1, inverse + 8 * j + 4, sizeof left1);
        memcpy(&right0, inverse + 8 * j + 8, sizeof right0);
        memcpy(&right1, inverse + 8 * j + 12, sizeof right1);
        a += left0 * sum[j];
        b += left1 * sum[j];
        c += right0 * sum[j + 1];
        d += right1 * sum[j + 1];
    }
    a += c;
    b += d;
    for (int i = 0; i < 4; i++)
        y[i] = x[i] - a[i];
    y[4] = x[4] - b[0];
    y[5] = x[5] - b[1];
}

static inline void take_lump_one(const double *inverse, const double *sum, const double *x,
                                 double *y) {
    y[0] = x[0] - (inverse[0] * sum[0] + inverse[1] * sum[1]);
    y[1] = x[1] - (inverse[2] * sum[0] + inverse[3] * sum[1]);
}

static inline void take_lump(const nmm_gauss *g, int lump, const double *sum, const double *x,
                             double *y) {
    if (g->lump == 3)
        take_lump_three(g->inverse + 48 * (long)lump, sum, x, y);
    else
        take_lump_one(g->inverse + 4 * (long)lump, sum, x, y);
}

// t = (D + U)^-1 D v.
static void gauss_backward(const nmm_solver *s, const nmm_gauss *g, const double *v, double *t) {
    const int m = g->lump;
    for (int lump = s->n / m - 1; lump >= 0; lump--) {
        double sum[6];
        sum_behind(s, g, lump, t, sum);
        const long at = 2 * (long)m * lump;
        take_lump(g, lump, sum, v + at, t + at);
    }
}

// y = (D + L)^-1 (K + coupling) t for t = (D + U)^-1 D v; `extra` is the coupling's part of the
// product. `ahead` becomes y - t.
static void gauss_forward(const nmm_solver *s, const nmm_gauss *g, const double *v, const double *t,
                          const double *extra, double *ahead, double *y) {
    const int m = g->lump;
    for (int lump = 0; lump < s->n / m; lump++) {
        double sum[6];
        sum_before(s, g, lump, ahead, sum);
        const long at = 2 * (long)m * lump;
        for (int i = 0; i < 2 * m; i++)
            sum[i] -= extra[at + i];
        take_lump(g, lump, sum, v + at, y + at);
        for (int i = 0; i < 2 * m; i++)
            ahead[at + i] = y[at + i] - t[at + i];
    }
}

// extra += coupling x, for terms of m rows.
static inline void add_terms(const nmm_coupling *coupling, int m, const double *x, double *extra) {
    for (int k = 0; k < coupling->n; k++) {
        const int *row = coupling->row + (long)m * k;
        const double *push = coupling->push + 2 * (long)m * k;
        const double *pull = coupling->pull + 2 * (long)m * k;
        double sum[2] = {0, 0};
        for (int i = 0; i < m; i++)
            for (int c = 0; c < 2; c++)
                sum[c] += pull[2 * i + c] * x[2 * (long)row[i] + c];
        const double both = sum[0] + sum[1];
        for (int i = 0; i < m; i++)
            for (int c = 0; c < 2; c++)
                extra[2 * (long)row[i] + c] += both * push[2 * i + c];
    }
}

// extra = coupling x.
static void couple(const nmm_coupling *coupling, int n_row, const double *x, double *extra) {
    memset(extra, 0, 2 * (size_t)n_row * sizeof *extra);
    if (coupling->n_row == 6)
        add_terms(coupling, 6, x, extra);
    else
        add_terms(coupling, coupling->n_row, x, extra);
}

// Sum of n products, n even, in a fixed order.
static double dot_long(const double *a, const double *b, int n) {
    wide_lanes sum[4] = {{0}};
    int i = 0;
    for (; i + 16 <= n; i += 16) {
        for (int k = 0; k < 4; k++) {
            wide_lanes x, y;
            memcpy(&x, a + i + 4 * k, sizeof x);
            memcpy(&y, b + i + 4 * k, sizeof y);
            sum[k] += x * y;
        }
    }
    sum[0] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    for (; i < n; i++)
        sum[0][i % 4] += a[i] * b[i];
    return (sum[0][0] + sum[0][1]) + (sum[0][2] + sum[0][3]);
}

// Takes the m directions of length n out of w, part[j] of each; the length of what is left.
static double orthogonalise(const double *basis, int m, int n, double *w, double *part) {
    for (int j = 0; j < m; j++) {
        const double *v = basis + (long)j * n;
        const double p = part[j] = dot_long(w, v, n);
        for (int i = 0; i < n; i++)
            w[i] -= p * v[i];
    }
    return sqrt(dot_long(w, w, n));
}
