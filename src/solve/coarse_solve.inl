// SPDX-License-Identifier: MIT
//
// The two triangular solves of the coarse correction. The three rows of a part begin at the same
// column, so they are done side by side: three sums in flight instead of one. The factor is read in
// float32, half the memory; sums are in float64.

static inline void load_lanes(const float *from, wide_lanes *to) {
    lanes_narrow four;
    memcpy(&four, from, sizeof four);
    *to = __builtin_convertvector(four, wide_lanes);
}

// sums[k] = row k . x over n numbers; four lanes each.
static inline void dot_rows(const float *const row[3], const double *x, int n, double sums[3]) {
    wide_lanes s0 = {0, 0, 0, 0}, s1 = {0, 0, 0, 0}, s2 = {0, 0, 0, 0};
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        wide_lanes v, r0, r1, r2;
        memcpy(&v, x + k, sizeof v);
        load_lanes(row[0] + k, &r0);
        load_lanes(row[1] + k, &r1);
        load_lanes(row[2] + k, &r2);
        s0 += r0 * v;
        s1 += r1 * v;
        s2 += r2 * v;
    }
    for (int i = 0; k < n; k++, i++) {
        s0[i] += (double)row[0][k] * x[k];
        s1[i] += (double)row[1][k] * x[k];
        s2[i] += (double)row[2][k] * x[k];
    }
    sums[0] = (s0[0] + s0[1]) + (s0[2] + s0[3]);
    sums[1] = (s1[0] + s1[1]) + (s1[2] + s1[3]);
    sums[2] = (s2[0] + s2[1]) + (s2[2] + s2[3]);
}

// x -= (three rows)^T y over n numbers.
static inline void subtract_rows(const float *const row[3], const double y[3], double *x, int n) {
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        wide_lanes v, r0, r1, r2;
        memcpy(&v, x + k, sizeof v);
        load_lanes(row[0] + k, &r0);
        load_lanes(row[1] + k, &r1);
        load_lanes(row[2] + k, &r2);
        v -= r0 * y[0] + r1 * y[1] + r2 * y[2];
        memcpy(x + k, &v, sizeof v);
    }
    for (; k < n; k++)
        x[k] -= (double)row[0][k] * y[0] + (double)row[1][k] * y[1] + (double)row[2][k] * y[2];
}

// move = A^-1 load, both of the coarse system.
static void solve_coarse(const nmm_coarse *c) {
    double *x = c->move;
    const double *inverse = c->inverse;
    for (int p = 0; p < c->n_part; p++) {
        const int i = 3 * p, first = c->first[i];
        const float *const r1 = c->lower + c->offset[i + 1], *const r2 =
                                                                 c->lower + c->offset[i + 2];
        const float *const row[3] = {c->lower + c->offset[i] + first, r1 + first, r2 + first};
        double sums[3];
        dot_rows(row, x + first, i - first, sums);
        x[i] = (c->load[i] - sums[0]) * inverse[i];
        x[i + 1] = (c->load[i + 1] - sums[1] - (double)r1[i] * x[i]) * inverse[i + 1];
        x[i + 2] =
            (c->load[i + 2] - sums[2] - (double)r2[i] * x[i] - (double)r2[i + 1] * x[i + 1]) *
            inverse[i + 2];
    }
    for (int p = c->n_part - 1; p >= 0; p--) {
        const int i = 3 * p, first = c->first[i];
        const float *const r1 = c->lower + c->offset[i + 1], *const r2 =
                                                                 c->lower + c->offset[i + 2];
        const float *const row[3] = {c->lower + c->offset[i] + first, r1 + first, r2 + first};
        const double y2 = x[i + 2] * inverse[i + 2];
        const double y1 = (x[i + 1] - (double)r2[i + 1] * y2) * inverse[i + 1];
        const double y0 = (x[i] - (double)r2[i] * y2 - (double)r1[i] * y1) * inverse[i];
        const double y[3] = {y0, y1, y2};
        memcpy(x + i, y, sizeof y);
        subtract_rows(row, y, x + first, i - first);
    }
    for (int i = 0; i < 3 * c->n_part; i++)
        x[i] = x[i] * c->unit * c->unit;
}
