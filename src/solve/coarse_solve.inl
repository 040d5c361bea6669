// SPDX-License-Identifier: MIT
//
// The two triangular solves of the coarse correction. The three rows of a part begin at the same
// column, so they are done side by side: three sums in flight instead of one.

// sums[k] = row k . x over n numbers; four lanes each.
static inline void dot_rows(const double *const row[3], const double *x, int n, double sums[3]) {
    wide_lanes s0 = {0, 0, 0, 0}, s1 = {0, 0, 0, 0}, s2 = {0, 0, 0, 0};
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        wide_lanes v, r0, r1, r2;
        memcpy(&v, x + k, sizeof v);
        memcpy(&r0, row[0] + k, sizeof r0);
        memcpy(&r1, row[1] + k, sizeof r1);
        memcpy(&r2, row[2] + k, sizeof r2);
        s0 += r0 * v;
        s1 += r1 * v;
        s2 += r2 * v;
    }
    for (int i = 0; k < n; k++, i++) {
        s0[i] += row[0][k] * x[k];
        s1[i] += row[1][k] * x[k];
        s2[i] += row[2][k] * x[k];
    }
    sums[0] = (s0[0] + s0[1]) + (s0[2] + s0[3]);
    sums[1] = (s1[0] + s1[1]) + (s1[2] + s1[3]);
    sums[2] = (s2[0] + s2[1]) + (s2[2] + s2[3]);
}

// move = A^-1 load, both of the coarse system.
static void solve_coarse(const nmm_coarse *c) {
    double *x = c->move;
    for (int p = 0; p < c->n_part; p++) {
        const int i = 3 * p, first = c->first[i];
        const double *const row[3] = {c->factor + c->offset[i] + first,
                                      c->factor + c->offset[i + 1] + first,
                                      c->factor + c->offset[i + 2] + first};
        double sums[3];
        dot_rows(row, x + first, i - first, sums);
        const double *last = c->factor + c->offset[i + 2];
        x[i] = (c->load[i] - sums[0]) * c->inverse[i];
        x[i + 1] =
            (c->load[i + 1] - sums[1] - c->factor[c->offset[i + 1] + i] * x[i]) * c->inverse[i + 1];
        x[i + 2] = (c->load[i + 2] - sums[2] - last[i] * x[i] - last[i + 1] * x[i + 1]) *
                   c->inverse[i + 2];
    }
    for (int p = c->n_part - 1; p >= 0; p--) {
        const int i = 3 * p, first = c->first[i];
        const double *r0 = c->factor + c->offset[i], *r1 = c->factor + c->offset[i + 1];
        const double *r2 = c->factor + c->offset[i + 2];
        const double x2 = x[i + 2] * c->inverse[i + 2];
        const double x1 = (x[i + 1] - r2[i + 1] * x2) * c->inverse[i + 1];
        const double x0 = (x[i] - r2[i] * x2 - r1[i] * x1) * c->inverse[i];
        x[i] = x0;
        x[i + 1] = x1;
        x[i + 2] = x2;
        for (int j = first; j < i; j++)
            x[j] -= r0[j] * x0 + r1[j] * x1 + r2[j] * x2;
    }
}
