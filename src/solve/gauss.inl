// SPDX-License-Identifier: MIT
//
// Kernels of conjugate directions with Gauss-Seidel sweeps as preconditioner, for one matrix with a
// coupling; one text for any x86-64 and for AVX2, the same bits. K = L + D + U by block rows.
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

// y = x - D^-1 sum.
static inline void take_row(const double *inverse, const double *sum, const double *x, double *y) {
    y[0] = x[0] - (inverse[0] * sum[0] + inverse[1] * sum[1]);
    y[1] = x[1] - (inverse[2] * sum[0] + inverse[3] * sum[1]);
}

// t = (D + U)^-1 D v.
static void gauss_backward(const nmm_solver *s, const nmm_gauss *g, const double *v, double *t) {
    for (long row = s->n - 1; row >= 0; row--) {
        double sum[2];
        sum_down(s, t, g->diagonal[row] + 1, s->row_start[row + 1], sum);
        take_row(s->wide.inverse + 4 * row, sum, v + 2 * row, t + 2 * row);
    }
}

// y = (D + L)^-1 (K + coupling) t for t = (D + U)^-1 D v; `extra` is the coupling's part of the
// product. `ahead` becomes y - t.
static void gauss_forward(const nmm_solver *s, const nmm_gauss *g, const double *v, const double *t,
                          const double *extra, double *ahead, double *y) {
    for (long row = 0; row < s->n; row++) {
        double sum[2];
        sum_up(s, ahead, s->row_start[row], g->diagonal[row], sum);
        for (int i = 0; i < 2; i++)
            sum[i] -= extra[2 * row + i];
        take_row(s->wide.inverse + 4 * row, sum, v + 2 * row, y + 2 * row);
        for (int i = 0; i < 2; i++)
            ahead[2 * row + i] = y[2 * row + i] - t[2 * row + i];
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
