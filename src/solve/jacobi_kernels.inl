// SPDX-License-Identifier: MIT
//
// Block Jacobi, and conjugate gradients with block Jacobi as preconditioner: the kernels and the
// iteration loops, one text for host and target. The includer defines six words:
//
//   PARALLEL_FOR  before a loop whose rounds are independent
//   SINGLE        before a block of scalar work on the data of the kernels
//   BATCH         before a block that calls kernels of the solver `s` many times in a row
//   SEND(p, n)    make what the host wrote into p[0 .. n) known to the kernels
//   FETCH(p, n)   make what the kernels wrote known to the host
//   ON_DEVICE     true where the kernel that asks runs on a device
//
// On the host a batch is one parallel region, which all threads walk through together, and
// PARALLEL_FOR shares the rounds of a loop among them; on a target each kernel is sent off alone.
// Every sum is taken over the rows of a chunk, then over the chunks in order: the same bits for any
// number of threads, and on the target. Equations: docs/theory/6-solve.md.

// Iterations from one look of the host at the scalars to the next.
#define BATCH_LENGTH 8

// Part of the limit at which the recursion of pcg stops, so that the true residual passes as well.
#define RECURSION_MARGIN 0.9

// --- Kernels: the matrix

// y = one block row of K x.
static inline void multiply_row(const int *row_start, const int *col, const double *value,
                                const double *x, int row, double y[2]) {
    double y0 = 0, y1 = 0, y2 = 0, y3 = 0;
    for (int k = row_start[row]; k < row_start[row + 1]; k++) {
        const double *v = value + 4 * (long)k;
        const double *xk = x + 2 * (long)col[k];
        y0 += v[0] * xk[0];
        y1 += v[1] * xk[1];
        y2 += v[2] * xk[0];
        y3 += v[3] * xk[1];
    }
    y[0] = y0 + y1;
    y[1] = y2 + y3;
}

// z = block * r.
static inline void multiply_block(const double *block, const double *r, double *z) {
    z[0] = block[0] * r[0] + block[1] * r[1];
    z[1] = block[2] * r[0] + block[3] * r[1];
}

// True residual r = f - K u; first search direction p = D^-1 r; terms of r.p and r.r.
static void measure_rows(const nmm_solver *s) {
    const int n = s->n_row;
    const int *row_start = s->row_start, *col = s->col;
    const double *value = s->value, *inverse = s->inverse, *f = s->f, *u = s->u;
    double *r = s->r, *p = s->p, *product = s->product;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        double y[2];
        multiply_row(row_start, col, value, u, row, y);
        double *ri = r + 2 * (long)row, *pi = p + 2 * (long)row;
        ri[0] = f[2 * (long)row] - y[0];
        ri[1] = f[2 * (long)row + 1] - y[1];
        multiply_block(inverse + 4 * (long)row, ri, pi);
        product[2 * (long)row] = ri[0] * pi[0] + ri[1] * pi[1];
        product[2 * (long)row + 1] = ri[0] * ri[0] + ri[1] * ri[1];
    }
}

// q = K p; terms of p.q.
static void multiply_direction(const nmm_solver *s) {
    const int n = s->n_row;
    const int *row_start = s->row_start, *col = s->col;
    const double *value = s->value, *p = s->p;
    double *q = s->q, *product = s->product;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        if (state->stop != NMM_STOP_NONE) continue;
        double *qi = q + 2 * (long)row;
        multiply_row(row_start, col, value, p, row, qi);
        product[2 * (long)row] = p[2 * (long)row] * qi[0] + p[2 * (long)row + 1] * qi[1];
        product[2 * (long)row + 1] = 0;
    }
}

// One sweep of damped block Jacobi, eq. (6.4).
static void sweep(const nmm_solver *s, const double *from, double *to, double damping) {
    const int n = s->n_row;
    const int *row_start = s->row_start, *col = s->col;
    const double *value = s->value, *inverse = s->inverse, *f = s->f;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        double r[2], z[2];
        multiply_row(row_start, col, value, from, row, r);
        r[0] = f[2 * (long)row] - r[0];
        r[1] = f[2 * (long)row + 1] - r[1];
        multiply_block(inverse + 4 * (long)row, r, z);
        to[2 * (long)row] = from[2 * (long)row] + damping * z[0];
        to[2 * (long)row + 1] = from[2 * (long)row + 1] + damping * z[1];
    }
}

// The same; with the terms of r.D^-1 r and r.r, where r belongs to `from`.
static void sweep_measured(const nmm_solver *s, const double *from, double *to, double damping) {
    const int n = s->n_row;
    const int *row_start = s->row_start, *col = s->col;
    const double *value = s->value, *inverse = s->inverse, *f = s->f;
    double *product = s->product;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        double r[2], z[2];
        multiply_row(row_start, col, value, from, row, r);
        r[0] = f[2 * (long)row] - r[0];
        r[1] = f[2 * (long)row + 1] - r[1];
        multiply_block(inverse + 4 * (long)row, r, z);
        to[2 * (long)row] = from[2 * (long)row] + damping * z[0];
        to[2 * (long)row + 1] = from[2 * (long)row + 1] + damping * z[1];
        product[2 * (long)row] = r[0] * z[0] + r[1] * z[1];
        product[2 * (long)row + 1] = r[0] * r[0] + r[1] * r[1];
    }
}

// --- Kernels: vectors

// u += alpha p, r -= alpha q; terms of r.D^-1 r and r.r.
static void advance(const nmm_solver *s) {
    const int n = s->n_row;
    const double *inverse = s->inverse, *p = s->p, *q = s->q;
    double *u = s->u, *r = s->r, *product = s->product;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const double alpha = state->alpha;
        const long i = 2 * (long)row;
        double z[2];
        u[i] += alpha * p[i];
        u[i + 1] += alpha * p[i + 1];
        r[i] -= alpha * q[i];
        r[i + 1] -= alpha * q[i + 1];
        multiply_block(inverse + 2 * i, r + i, z);
        product[i] = r[i] * z[0] + r[i + 1] * z[1];
        product[i + 1] = r[i] * r[i] + r[i + 1] * r[i + 1];
    }
}

// p = D^-1 r + beta p.
static void turn(const nmm_solver *s) {
    const int n = s->n_row;
    const double *inverse = s->inverse, *r = s->r;
    double *p = s->p;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        if (state->stop != NMM_STOP_NONE) continue;
        const double beta = state->beta;
        const long i = 2 * (long)row;
        double z[2];
        multiply_block(inverse + 2 * i, r + i, z);
        p[i] = z[0] + beta * p[i];
        p[i + 1] = z[1] + beta * p[i + 1];
    }
}

// Start of the Lanczos process: r = D^1/2 times fixed pseudo-random numbers, p = D^-1 r; terms of
// r.p and r.r. The numbers depend on the row alone (the finaliser of MurmurHash3).
static void scatter(const nmm_solver *s) {
    const int n = s->n_row;
    const double *inverse = s->inverse;
    double *r = s->r, *p = s->p, *product = s->product;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        const long i = 2 * (long)row;
        for (int k = 0; k < 2; k++) {
            uint32_t h = (uint32_t)(i + k) + 1;
            h = (h ^ (h >> 16)) * 0x85ebca6bu;
            h = (h ^ (h >> 13)) * 0xc2b2ae35u;
            h = h ^ (h >> 16);
            r[i + k] = ((double)h / 2147483648.0 - 1) / sqrt(inverse[2 * i + 3 * k]);
        }
        multiply_block(inverse + 2 * i, r + i, p + i);
        product[i] = r[i] * p[i] + r[i + 1] * p[i + 1];
        product[i + 1] = r[i] * r[i] + r[i + 1] * r[i + 1];
    }
}

// Terms of the sums of |u - q| and |u|.
static void measure_change(const nmm_solver *s) {
    const int n = s->n_row;
    const double *u = s->u, *q = s->q;
    double *product = s->product;
    PARALLEL_FOR
    for (int row = 0; row < n; row++) {
        const long i = 2 * (long)row;
        product[i] = fabs(u[i] - q[i]) + fabs(u[i + 1] - q[i + 1]);
        product[i + 1] = fabs(u[i]) + fabs(u[i + 1]);
    }
}

// --- Kernels: sums and scalars

static inline int chunks_of(int n_row) {
    return (n_row + NMM_SOLVE_CHUNK - 1) / NMM_SOLVE_CHUNK;
}

// Sums of the terms over each chunk.
static void sum_chunks(const nmm_solver *s) {
    const int n = s->n_row, n_chunk = chunks_of(n);
    const double *product = s->product;
    double *part = s->part;
    nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int chunk = 0; chunk < n_chunk; chunk++) {
        const int begin = chunk * NMM_SOLVE_CHUNK;
        const int end = begin + NMM_SOLVE_CHUNK < n ? begin + NMM_SOLVE_CHUNK : n;
        double sum0 = 0, sum1 = 0;
        for (int row = begin; row < end; row++) {
            sum0 += product[2 * (long)row];
            sum1 += product[2 * (long)row + 1];
        }
        part[2 * (long)chunk] = sum0;
        part[2 * (long)chunk + 1] = sum1;
        if (chunk == 0) state->on_device = ON_DEVICE;
    }
}

static inline void add_parts(const double *part, int n_chunk, double sum[2]) {
    double sum0 = 0, sum1 = 0;
    for (int chunk = 0; chunk < n_chunk; chunk++) {
        sum0 += part[2 * (long)chunk];
        sum1 += part[2 * (long)chunk + 1];
    }
    sum[0] = sum0;
    sum[1] = sum1;
}

static inline int is_finite(double x) {
    return 0 * x == 0;
}

// The two sums.
static void total(const nmm_solver *s) {
    const int n_chunk = chunks_of(s->n_row);
    const double *part = s->part;
    nmm_iteration *state = s->state;
    SINGLE {
        add_parts(part, n_chunk, state->sum);
    }
}

// The recursion of conjugate gradients begins from r.z and r.r.
static void begin_recursion(const nmm_solver *s) {
    const int n_chunk = chunks_of(s->n_row);
    const double *part = s->part;
    nmm_iteration *state = s->state;
    SINGLE {
        add_parts(part, n_chunk, state->sum);
        state->rho = state->sum[0];
        state->stop = NMM_STOP_NONE;
        if (state->sum[1] <= state->limit) state->stop = NMM_STOP_SMALL;
        if (!is_finite(state->sum[0] + state->sum[1])) state->stop = NMM_STOP_BROKEN;
    }
}

// alpha = rho / p.q, eq. (6.6).
static void find_step(const nmm_solver *s) {
    const int n_chunk = chunks_of(s->n_row);
    const double *part = s->part;
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            add_parts(part, n_chunk, state->sum);
            const double curvature = state->sum[0];
            if (!(curvature > 0)) state->stop = NMM_STOP_CURVATURE;
            if (!is_finite(curvature)) state->stop = NMM_STOP_BROKEN;
            state->alpha = state->rho / curvature;
        }
    }
}

// beta = new rho / rho, eq. (6.7); is the residual small enough?
static void find_turn(const nmm_solver *s) {
    const int n_chunk = chunks_of(s->n_row);
    const double *part = s->part;
    nmm_iteration *state = s->state;
    SINGLE {
        if (state->stop == NMM_STOP_NONE) {
            add_parts(part, n_chunk, state->sum);
            state->beta = state->sum[0] / state->rho;
            state->rho = state->sum[0];
            if (state->iterations < NMM_LANCZOS) {
                state->history[state->iterations][0] = state->alpha;
                state->history[state->iterations][1] = state->beta;
            }
            state->iterations += 1;
            const double margin = RECURSION_MARGIN * RECURSION_MARGIN;
            if (state->sum[1] <= margin * state->limit) state->stop = NMM_STOP_SMALL;
            if (!is_finite(state->sum[0] + state->sum[1])) state->stop = NMM_STOP_BROKEN;
        }
    }
}

// --- Batches

static void pcg_batch(const nmm_solver *s, int n) {
    BATCH {
        for (int k = 0; k < n; k++) {
            multiply_direction(s);
            sum_chunks(s);
            find_step(s);
            advance(s);
            sum_chunks(s);
            find_turn(s);
            turn(s);
        }
    }
}

// u and q in turns; the last of the n sweeps is measured.
static void jacobi_batch(const nmm_solver *s, int n, double damping) {
    BATCH {
        double *x[2] = {s->u, s->q};
        for (int k = 0; k < n - 1; k++)
            sweep(s, x[k % 2], x[(k + 1) % 2], damping);
        sweep_measured(s, x[(n - 1) % 2], x[n % 2], damping);
        sum_chunks(s);
        total(s);
    }
}

// --- Control

// |f - K u| as it truly is.
static double true_norm(const nmm_solver *s) {
    BATCH {
        measure_rows(s);
        sum_chunks(s);
        begin_recursion(s);
    }
    FETCH(s->state, 1);
    return sqrt(s->state->sum[1]);
}

// Take the first guess, or zero where that is better; its residual norm.
static double first_norm(nmm_solver *s, const double *u) {
    s->state->limit = s->limit * s->limit;
    s->state->iterations = 0;
    SEND(s->state, 1);
    nmm_solver_load_guess(s, u);
    SEND(s->u, 2 * (long)s->n_row);
    double norm = true_norm(s);
    if (!(norm <= NMM_GUESS_MARGIN * s->norm)) {
        s->guess_dropped = true;
        memset(s->u, 0, 2 * (size_t)s->n_row * sizeof(double));
        SEND(s->u, 2 * (long)s->n_row);
        norm = true_norm(s);
    }
    s->guess_norm = norm;
    return norm;
}

// The row that takes most from p.q, when that is not positive.
static int row_of_curvature(const nmm_solver *s) {
    FETCH(s->product, 2 * (long)s->n_row);
    int worst = 0;
    for (int row = 1; row < s->n_row; row++)
        if (s->product[2 * (long)row] < s->product[2 * (long)worst]) worst = row;
    return worst;
}

// Iterate until the kernels say stop, or `most` iterations are done.
static void run_recursion(const nmm_solver *s, int most) {
    while (s->state->stop == NMM_STOP_NONE && s->state->iterations < most) {
        pcg_batch(s, nmm_min_int(BATCH_LENGTH, most - s->state->iterations));
        FETCH(s->state, 1);
    }
}

// Conjugate gradients. What the recursion calls small is measured; if it is not, the recursion
// starts anew from there, as long as each start at least halves the residual.
static double run_pcg(nmm_solver *s, const double *u, nmm_solve_report *report) {
    const int most = s->options.max_iterations;
    double norm = first_norm(s, u), before = 2 * norm + 1;
    while (!(norm <= s->limit) && report->end == NMM_SOLVE_CONVERGED) {
        if (s->state->iterations >= most) {
            report->end = NMM_SOLVE_TOO_SLOW;
        } else if (!(norm < 0.5 * before)) {
            report->end = NMM_SOLVE_STAGNATED;
        } else {
            before = norm;
            run_recursion(s, most);
            const int stop = s->state->stop;
            const int row = stop == NMM_STOP_CURVATURE ? row_of_curvature(s) : -1;
            norm = true_norm(s);
            if (norm <= s->limit) break;
            report->row = row;
            if (stop == NMM_STOP_CURVATURE) report->end = NMM_SOLVE_INDEFINITE;
            if (stop == NMM_STOP_BROKEN) report->end = NMM_SOLVE_DIVERGED;
        }
    }
    report->iterations = s->state->iterations;
    return norm;
}

// lambda_max of D^-1 K by Lanczos steps, which are those of conjugate gradients, eq. (6.9). Uses u.
static void estimate_lambda(nmm_solver *s, nmm_solve_report *report) {
    SEND(s->state, 1);
    BATCH {
        scatter(s);
        sum_chunks(s);
        begin_recursion(s);
    }
    FETCH(s->state, 1);
    // Where the residual has fallen this far the process has seen the whole spectrum.
    s->state->limit = 1e-24 * s->state->sum[1];
    SEND(s->state, 1);
    run_recursion(s, NMM_LANCZOS);
    if (s->state->stop == NMM_STOP_CURVATURE) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = row_of_curvature(s);
    }
    report->lambda_max = nmm_lanczos_largest(s->state->iterations, s->state->history);
}

static void swap_iterates(nmm_solver *s) {
    double *newest = s->u;
    s->u = s->q;
    s->q = newest;
}

// The paper's test: mean change of the last sweep against the mean of u, eq. (6.3).
static bool change_settled(const nmm_solver *s) {
    BATCH {
        measure_change(s);
        sum_chunks(s);
        total(s);
    }
    FETCH(s->state, 1);
    return s->state->sum[0] <= s->options.tolerance * s->state->sum[1];
}

// Sweeps by batches. The last of a batch measures the iterate before it, kept in q. The weighted
// sum r.D^-1 r is a convex function of the number of sweeps: once it has grown, it grows for ever.
static double run_sweeps(nmm_solver *s, double damping, double norm, nmm_solve_report *report) {
    double lowest = s->state->sum[0];
    while (!(norm <= s->limit)) {
        const int n = nmm_min_int(BATCH_LENGTH, s->options.max_iterations - report->iterations);
        if (n == 0) report->end = NMM_SOLVE_TOO_SLOW;
        if (report->end != NMM_SOLVE_CONVERGED) break;
        jacobi_batch(s, n, damping);
        FETCH(s->state, 1);
        report->iterations += n;
        norm = sqrt(s->state->sum[1]);
        const double weighted = s->state->sum[0];
        // Let u be the newest iterate, q the measured one.
        if (n % 2 == 1) swap_iterates(s);
        if (!(weighted <= 2 * lowest)) report->end = NMM_SOLVE_DIVERGED;
        lowest = nmm_min(lowest, weighted);
        report->by_average_change = norm > s->limit && report->end == NMM_SOLVE_CONVERGED &&
                                    s->options.stop_average_change && change_settled(s);
        if (report->by_average_change) return true_norm(s);
    }
    if (report->iterations > 0) swap_iterates(s);
    return norm;
}

static double run_jacobi(nmm_solver *s, const double *u, nmm_solve_report *report) {
    double damping = s->options.jacobi_damping;
    if (damping == 0) {
        estimate_lambda(s, report);
        damping = 1.9 / nmm_max(report->lambda_max, 1);
    }
    const double norm = first_norm(s, u);
    if (report->end != NMM_SOLVE_CONVERGED) return norm;
    return run_sweeps(s, damping, norm, report);
}

// A prepared system: send it, iterate, fetch the result into s->u; its true residual norm.
static double run_method(nmm_solver *s, const double *u, nmm_solve_report *report) {
    const long n = s->n_row, n_block = s->n_block;
    if (!s->pattern_kept) {
        SEND(s->row_start, n + 1);
        SEND(s->col, n_block);
    }
    SEND(s->value, 4 * n_block);
    SEND(s->inverse, 4 * n);
    SEND(s->f, 2 * n);
    const bool jacobi = s->options.method == NMM_SOLVE_JACOBI;
    const double norm = jacobi ? run_jacobi(s, u, report) : run_pcg(s, u, report);
    FETCH(s->u, 2 * n);
    report->on_device = s->state->on_device != 0;
    return norm;
}
