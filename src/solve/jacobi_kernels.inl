// SPDX-License-Identifier: MIT
//
// Block Jacobi, its Chebyshev acceleration, and conjugate gradients with block Jacobi as
// preconditioner: the kernels, one text for host and target, for float64 and float32. Included once
// for each precision; the includer defines these words:
//
//   REAL          double or float
//   ARRAYS        wide or narrow: the arrays of the solver `s` that are meant
//   NAME(x)       x with a suffix for the precision
//   PARALLEL_FOR  before a loop whose rounds are independent
//   PARALLEL_FOR_LATE  the same where threads begin at different times; with HAS_COARSE only
//   SINGLE        before a block of scalar work on the data of the kernels
//   JOIN          after either: all threads have done their part
//   BATCH         before a block that calls kernels of the solver `s` many times in a row
//   SEND(p, n)    make what the host wrote into p[0 .. n) known to the kernels of the solver `s`
//   FETCH(p, n)   make what the kernels wrote known to the host
//   ON_DEVICE     true where the kernel that asks runs on a device
//   LANES         defined where the compiler has vectors of GNU C
//   HAS_COARSE    defined where the coarse correction can be in use
//
// On the host a batch is one parallel region, which all threads walk through together,
// PARALLEL_FOR shares the rounds of a loop among them and JOIN is a barrier; on a target each
// kernel is sent off alone. The unit of work is a group of 8 block rows. Every sum is taken over
// the rows of a group, then over groups, then over chunks of groups: the same bits for any number
// of threads, and on the target. Equations: docs/theory/6-solve.md.

// --- Rows and groups

// Where LANES is defined, products are written with vectors of four numbers; the sums are the same,
// lane by lane, as in the text beside them.

// y = one block row of K x. `far`: the last row, where K and x come from memory and are fetched
// ahead, K because what a processor fetches by itself ends with each page; of x what no row needed
// before, which is the last that a row asks for. Else 0.
static inline void NAME(multiply_row)(const int *row_start, const int *col, const REAL *value,
                                      const REAL *x, int row, int far, REAL y[2]) {
#ifdef LANES
    // In a cache the loop is all there is.
    if (__builtin_expect(far > 0, 0)) {
        const int later = row + ROWS_AHEAD < far ? row + ROWS_AHEAD : far;
        __builtin_prefetch(x + 2 * (long)col[row_start[later + 1] - 1]);
    }
    NAME(lanes) sum = {0, 0, 0, 0};
    for (int k = row_start[row]; k < row_start[row + 1]; k++) {
        NAME(lanes) v;
        NAME(pair) xk;
        if (far > 0) __builtin_prefetch(value + 4 * (long)k + AHEAD);
        memcpy(&v, value + 4 * (long)k, sizeof v);
        memcpy(&xk, x + 2 * (long)col[k], sizeof xk);
        sum += v * __builtin_shufflevector(xk, xk, 0, 1, 0, 1);
    }
    y[0] = sum[0] + sum[1];
    y[1] = sum[2] + sum[3];
#else
    (void)far;
    REAL sum[4] = {0, 0, 0, 0};
    for (int k = row_start[row]; k < row_start[row + 1]; k++) {
        const REAL *v = value + 4 * (long)k, *xk = x + 2 * (long)col[k];
        for (int i = 0; i < 4; i++)
            sum[i] += v[i] * xk[i % 2];
    }
    y[0] = sum[0] + sum[1];
    y[1] = sum[2] + sum[3];
#endif
}

// Sum of the first n products, n even, at most those of a group.
static inline double NAME(dot_group)(const REAL *a, const REAL *b, int n) {
#ifdef LANES
    wide_lanes sum = {0, 0, 0, 0};
    int i = 0;
    for (; i + 4 <= n; i += 4) {
        NAME(lanes) x, y;
        memcpy(&x, a + i, sizeof x);
        memcpy(&y, b + i, sizeof y);
        sum += __builtin_convertvector(x, wide_lanes) * __builtin_convertvector(y, wide_lanes);
    }
    for (int k = 0; i < n; i++, k++)
        sum[k] += (double)a[i] * (double)b[i];
#else
    double sum[4] = {0, 0, 0, 0};
    for (int i = 0; i < n; i++)
        sum[i % 4] += (double)a[i] * (double)b[i];
#endif
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

// z = D^-1 r by the dense block of a cluster: columns in turn, even ones and odd ones.
static inline void NAME(apply_dense)(const float *column, REAL factor, const REAL *r, REAL *z) {
#ifdef LANES
    dense_lanes even0 = {0}, even1 = {0}, odd0 = {0}, odd1 = {0};
    for (int j = 0; j < NMM_GROUP_UNKNOWNS; j += 2) {
        const float r0 = (float)r[j], r1 = (float)r[j + 1];
        const float *c = column + NMM_GROUP_UNKNOWNS * j;
        __builtin_prefetch(c + DENSE_AHEAD);
        __builtin_prefetch(c + DENSE_AHEAD + 16);
        dense_lanes c0, c1, c2, c3;
        memcpy(&c0, c, sizeof c0);
        memcpy(&c1, c + 8, sizeof c1);
        memcpy(&c2, c + 16, sizeof c2);
        memcpy(&c3, c + 24, sizeof c3);
        even0 += c0 * r0;
        even1 += c1 * r0;
        odd0 += c2 * r1;
        odd1 += c3 * r1;
    }
    float sum[NMM_GROUP_UNKNOWNS];
    even0 += odd0;
    even1 += odd1;
    memcpy(sum, &even0, sizeof even0);
    memcpy(sum + 8, &even1, sizeof even1);
#else
    float sum[NMM_GROUP_UNKNOWNS] = {0}, odd[NMM_GROUP_UNKNOWNS] = {0};
    for (int j = 0; j < NMM_GROUP_UNKNOWNS; j += 2) {
        const float r0 = (float)r[j], r1 = (float)r[j + 1];
        for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++) {
            sum[i] += column[NMM_GROUP_UNKNOWNS * j + i] * r0;
            odd[i] += column[NMM_GROUP_UNKNOWNS * (j + 1) + i] * r1;
        }
    }
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++)
        sum[i] += odd[i];
#endif
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++)
        z[i] = factor * (REAL)sum[i];
}

// z = D^-1 r for the rows of a group: by 2x2 blocks, or by the block of a cluster, where all 8 rows
// are there.
static inline void NAME(apply_group)(const REAL *inverse, const float *dense, const double *scale,
                                     int group, int n_row, const REAL *r, REAL *z) {
    if (dense != NULL) {
        const float *column = dense + (long)group * NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS;
        NAME(apply_dense)(column, (REAL)scale[group], r, z);
        return;
    }
    for (int k = 0; k < n_row; k++) {
        const REAL *block = inverse + 4 * ((long)group * NMM_GROUP + k);
        const REAL r0 = r[2 * k], r1 = r[2 * k + 1];
        z[2 * k] = block[0] * r0 + block[1] * r1;
        z[2 * k + 1] = block[2] * r0 + block[3] * r1;
    }
}

// --- Kernels: the matrix

// True residual r = f - K u; z = D^-1 r; terms of r.z and r.r.
static void NAME(measure_rows)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const int far = far_row(n);
    const int *row_start = s->row_start, *col = s->col;
    const REAL *value = s->ARRAYS.value, *inverse = s->ARRAYS.inverse;
    const REAL *f = s->ARRAYS.f, *u = s->ARRAYS.u;
    REAL *r = s->ARRAYS.r, *z = s->ARRAYS.z;
    const float *dense = s->dense;
    const double *scale = s->dense_scale;
    double *part = s->part;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        for (int row = first; row < end; row++) {
            REAL y[2];
            NAME(multiply_row)(row_start, col, value, u, row, far, y);
            r[2 * (long)row] = f[2 * (long)row] - y[0];
            r[2 * (long)row + 1] = f[2 * (long)row + 1] - y[1];
        }
        const REAL *rg = r + 2 * (long)first;
        REAL *zg = z + 2 * (long)first;
        NAME(apply_group)(inverse, dense, scale, group, end - first, rg, zg);
        part[2 * (long)group] = NAME(dot_group)(rg, zg, 2 * (end - first));
        part[2 * (long)group + 1] = NAME(dot_group)(rg, rg, 2 * (end - first));
    }
    JOIN;
}

// q = K p; terms of p.q.
static void NAME(multiply_direction)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const int far = far_row(n);
    const int *row_start = s->row_start, *col = s->col;
    const REAL *value = s->ARRAYS.value, *p = s->ARRAYS.p;
    REAL *q = s->ARRAYS.q;
    double *part = s->part;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        for (int row = first; row < end; row++)
            NAME(multiply_row)(row_start, col, value, p, row, far, q + 2 * (long)row);
        const long at = 2 * (long)first;
        part[2 * (long)group] = NAME(dot_group)(p + at, q + at, 2 * (end - first));
        part[2 * (long)group + 1] = 0;
    }
    JOIN;
}

// Sweep k of a batch, of block Jacobi or Chebyshev, eq. (6.4) and (6.12): p = a p + b D^-1 r, to =
// from + p; p is kept for Chebyshev. `last` of the batch: terms of r.D^-1 r and r.r, where r
// belongs to `from`.
static void NAME(sweep)(const nmm_solver *s, const REAL *from, REAL *to, int k, bool last) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const int far = far_row(n);
    const int *row_start = s->row_start, *col = s->col;
    const REAL *value = s->ARRAYS.value, *inverse = s->ARRAYS.inverse, *f = s->ARRAYS.f;
    REAL *p = s->ARRAYS.p;
    const float *dense = s->dense;
    const double *scale = s->dense_scale;
    double *part = s->part;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        const REAL a = (REAL)state->weight[k][0], b = (REAL)state->weight[k][1];
        REAL r[NMM_GROUP_UNKNOWNS], z[NMM_GROUP_UNKNOWNS];
        for (int row = first; row < end; row++) {
            REAL y[2];
#ifdef LANES
            if (far > 0) __builtin_prefetch(inverse + 4 * (long)row + INVERSE_AHEAD);
#endif
            NAME(multiply_row)(row_start, col, value, from, row, far, y);
            r[2 * (row - first)] = f[2 * (long)row] - y[0];
            r[2 * (row - first) + 1] = f[2 * (long)row + 1] - y[1];
        }
        NAME(apply_group)(inverse, dense, scale, group, end - first, r, z);
        const long at = 2 * (long)first;
        for (int i = 0; i < 2 * (end - first); i++) {
            // What p held before the first sweep is no number to count with.
            const REAL step = a == 0 ? b * z[i] : a * p[at + i] + b * z[i];
            if (state->directed) p[at + i] = step;
            to[at + i] = from[at + i] + step;
        }
        if (!last) continue;
        part[2 * (long)group] = NAME(dot_group)(r, z, 2 * (end - first));
        part[2 * (long)group + 1] = NAME(dot_group)(r, r, 2 * (end - first));
    }
    JOIN;
}

// --- Kernels: vectors

// u += alpha p, r -= alpha q, z = D^-1 r; terms of r.z and r.r.
static void NAME(advance)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const REAL *inverse = s->ARRAYS.inverse, *p = s->ARRAYS.p, *q = s->ARRAYS.q;
    REAL *u = s->ARRAYS.u, *r = s->ARRAYS.r, *z = s->ARRAYS.z;
    const float *dense = s->dense;
    const double *scale = s->dense_scale;
    double *part = s->part;
    const nmm_iteration *state = s->state;
#ifdef HAS_COARSE
    const bool apply_later = s->blocks == NMM_BLOCKS_BODY;
#else
    const bool apply_later = false;
#endif
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const REAL alpha = (REAL)state->alpha;
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        for (long i = 2 * (long)first; i < 2 * (long)end; i++) {
            u[i] += alpha * p[i];
            r[i] -= alpha * q[i];
        }
        const REAL *rg = r + 2 * (long)first;
        REAL *zg = z + 2 * (long)first;
        // With a coarse correction that is done beside it.
        if (!apply_later) {
            NAME(apply_group)(inverse, dense, scale, group, end - first, rg, zg);
            part[2 * (long)group] = NAME(dot_group)(rg, zg, 2 * (end - first));
        }
        part[2 * (long)group + 1] = NAME(dot_group)(rg, rg, 2 * (end - first));
    }
    JOIN;
}

// p = z + beta p.
static void NAME(turn)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const REAL *z = s->ARRAYS.z;
    REAL *p = s->ARRAYS.p;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const REAL beta = (REAL)state->beta;
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        for (long i = 2 * (long)first; i < 2 * (long)end; i++)
            p[i] = beta == 0 ? z[i] : z[i] + beta * p[i];
    }
    JOIN;
}

// Terms of the sums of |u - q| and |u|.
static void NAME(measure_change)(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const REAL *u = s->ARRAYS.u, *q = s->ARRAYS.q;
    double *part = s->part;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        double sum0 = 0, sum1 = 0;
        for (long i = 2 * (long)first; i < 2 * (long)end; i++) {
            sum0 += fabs((double)u[i] - (double)q[i]);
            sum1 += fabs((double)u[i]);
        }
        part[2 * (long)group] = sum0;
        part[2 * (long)group + 1] = sum1;
    }
    JOIN;
}

#ifdef HAS_COARSE
#include "jacobi_coarse.inl"
#endif

// --- Batches

// r, z and their sums for u as it is.
static void NAME(measure)(const nmm_solver *s) {
    NAME(measure_rows)(s);
    sum_chunks(s);
    begin_recursion(s);
}

// n iterations of conjugate gradients. z and the sums belong to r.
static void NAME(pcg_batch)(const nmm_solver *s, int n) {
    BATCH {
        for (int k = 0; k < n; k++) {
#ifdef HAS_COARSE
            if (s->blocks == NMM_BLOCKS_BODY) NAME(correct_coarse)(s);
#endif
            find_turn(s);
            NAME(turn)(s);
            NAME(multiply_direction)(s);
            sum_chunks(s);
            find_step(s);
            NAME(advance)(s);
            sum_chunks(s);
            look_at_residual(s);
        }
    }
}

// u and q in turns; the sums belong to the iterate before the last.
static void NAME(sweep_batch)(const nmm_solver *s, int n) {
    BATCH {
        REAL *x[2] = {s->ARRAYS.u, s->ARRAYS.q};
        for (int k = 0; k < n; k++)
            NAME(sweep)(s, x[k % 2], x[(k + 1) % 2], k, k == n - 1);
        sum_chunks(s);
        total(s);
    }
}

// --- Loops

// Conjugate gradients from u, whose r, z and sums are measured, until the kernels say stop or
// `most` iterations are done.
static void NAME(run_recursion)(const nmm_solver *s, int most) {
    while (s->state->stop == NMM_STOP_NONE && s->state->iterations < most) {
        NAME(pcg_batch)(s, nmm_min_int(NMM_BATCH, most - s->state->iterations));
        FETCH(s->state, 1);
    }
}

static void NAME(swap_iterates)(nmm_solver *s) {
    REAL *newest = s->ARRAYS.u;
    s->ARRAYS.u = s->ARRAYS.q;
    s->ARRAYS.q = newest;
}

// The paper's test: mean change of the last sweep against the mean of u, eq. (6.3).
static bool NAME(change_settled)(const nmm_solver *s) {
    BATCH {
        NAME(measure_change)(s);
        sum_chunks(s);
        total(s);
    }
    FETCH(s->state, 1);
    return s->state->sum[0] <= s->options.tolerance * s->state->sum[1];
}

// Sweeps by batches, from u, until its residual is at most `limit`. The sums of a batch belong to
// the iterate before its last, kept in q; that one is the result. Returns its residual.
static double NAME(run_sweeps)(nmm_solver *s, sweeps *plan, double norm, double limit,
                               nmm_solve_report *report) {
    plan_start(plan, norm, s->state->sum[0]);
    s->state->directed = plan->chebyshev;
    const int before = report->iterations;
    while (!(norm <= limit)) {
        const int n = nmm_min_int(NMM_BATCH, s->options.max_iterations - report->iterations);
        if (n == 0) report->end = NMM_SOLVE_TOO_SLOW;
        if (report->end != NMM_SOLVE_CONVERGED) break;
        plan_batch(plan, n, s->state->weight);
        SEND(s->state, 1);
        NAME(sweep_batch)(s, n);
        FETCH(s->state, 1);
        report->iterations += n;
        norm = sqrt(s->state->sum[1]);
        // Let u be the newest iterate, q the measured one.
        if (n % 2 == 1) NAME(swap_iterates)(s);
        const sweeps_verdict verdict = plan_judge(plan, norm, s->state->sum[0]);
        if (verdict != SWEEPS_GO_ON && !(norm <= limit)) {
            const bool wide = sizeof *s->ARRAYS.u == sizeof(double);
            report->end = end_of_sweeps(s, plan, verdict, norm, wide);
        }
        report->by_average_change = norm > limit && report->end == NMM_SOLVE_CONVERGED &&
                                    s->options.stop_average_change && NAME(change_settled)(s);
        if (report->by_average_change) return norm;
    }
    if (report->iterations > before) NAME(swap_iterates)(s);
    return norm;
}
