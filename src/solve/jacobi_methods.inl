// SPDX-License-Identifier: MIT
//
// The methods of the Jacobi family, built from the kernels of both precisions; the same words as in
// jacobi_kernels.inl, which is included twice before this. Control stays on the host.

// Largest gain asked of one round in float32: of a recursion, and of sweeps, whose residual is
// summed up anew and falls no further than rounding lets it.
#define NARROW_GAIN 1e-5
#define NARROW_SWEEP_GAIN 1e-2

// --- Residuals

// |f - K u| as it truly is.
static double true_norm(const nmm_solver *s) {
    BATCH {
        measure_wide(s);
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
    SEND(s->wide.u, 2 * (long)s->n);
    double norm = true_norm(s);
    if (!(norm <= NMM_GUESS_MARGIN * s->norm)) {
        s->guess_dropped = true;
        memset(s->wide.u, 0, 2 * (size_t)s->n * sizeof(double));
        SEND(s->wide.u, 2 * (long)s->n);
        norm = true_norm(s);
    }
    s->guess_norm = norm;
    return norm;
}

// The caller's row that takes most from p.q, when that is not positive.
static int row_of_curvature(const nmm_solver *s) {
    const double *p = s->wide.p, *q = s->wide.q;
    FETCH(s->wide.p, 2 * (long)s->n);
    FETCH(s->wide.q, 2 * (long)s->n);
    int worst = -1;
    double least = 0;
    for (int row = 0; row < s->n; row++) {
        const long i = 2 * (long)row;
        const double term = p[i] * q[i] + p[i + 1] * q[i + 1];
        if (nmm_solver_row(s, row) < 0 || (worst >= 0 && !(term < least))) continue;
        least = term;
        worst = nmm_solver_row(s, row);
    }
    return worst;
}

// What the verdict on sweeps means, which rounding may have bent; CONVERGED: they go on. `wide`:
// they are in float64; whatever ends them in float32, float64 goes on.
static nmm_solve_end end_of_sweeps(const nmm_solver *s, const sweeps *plan, sweeps_verdict verdict,
                                   double norm, bool wide) {
    const bool diverges = verdict == SWEEPS_DIVERGE;
    if (!wide) return diverges ? NMM_SOLVE_DIVERGED : NMM_SOLVE_STAGNATED;
    if (verdict == SWEEPS_STAGNATE) return NMM_SOLVE_STAGNATED;
    FETCH(s->wide.u, 2 * (long)s->n);
    // A recursion of three terms carries each rounding on, up to so many times.
    const double carried = plan->chebyshev ? sqrt(plan->bounds[1] / plan->bounds[0]) : 1;
    if (nmm_solver_rounds(s, norm / carried)) return NMM_SOLVE_STAGNATED;
    return diverges ? NMM_SOLVE_DIVERGED : NMM_SOLVE_CONVERGED;
}

// --- Kernels that one precision has

// Start of the Lanczos process: r = D^1/2 times fixed pseudo-random numbers, times a unit that
// keeps them within float32; z = D^-1 r; terms of r.z and r.r. The numbers depend on the row alone
// (the finaliser of MurmurHash3).
static void scatter(const nmm_solver *s) {
    const int n = s->n, n_group = nmm_groups_of(n);
    const double *inverse = s->wide.inverse;
    double *r = s->wide.r, *z = s->wide.z;
    const float *dense = s->dense;
    const double *scale = s->dense_scale;
    double *part = s->part;
    const nmm_iteration *state = s->state;
    PARALLEL_FOR
    for (int group = 0; group < n_group; group++) {
        const int first = group * NMM_GROUP, end = first + NMM_GROUP < n ? first + NMM_GROUP : n;
        const double unit = state->unit;
        for (long i = 2 * (long)first; i < 2 * (long)end; i++) {
            uint32_t h = (uint32_t)i + 1;
            h = (h ^ (h >> 16)) * 0x85ebca6bu;
            h = (h ^ (h >> 13)) * 0xc2b2ae35u;
            h = h ^ (h >> 16);
            const double d = inverse[4 * (i / 2) + 3 * (i % 2)];
            r[i] = d > 0 ? unit * (((double)h / 2147483648.0 - 1) / sqrt(d)) : 0;
        }
        const double *rg = r + 2 * (long)first;
        double *zg = z + 2 * (long)first;
        apply_group_wide(inverse, dense, scale, group, end - first, rg, zg);
        part[2 * (long)group] = dot_group_wide(rg, zg, 2 * (end - first));
        part[2 * (long)group + 1] = dot_group_wide(rg, rg, 2 * (end - first));
    }
    JOIN;
}

// --- Float32 corrections

// f of the correction = residual / norm; its u = 0.
static void begin_correction(const nmm_solver *s, double norm) {
    const int n = 2 * s->n;
    const double *r = s->wide.r;
    float *f = s->narrow.f, *u = s->narrow.u;
    PARALLEL_FOR
    for (int i = 0; i < n; i++) {
        f[i] = (float)(r[i] / norm);
        u[i] = 0;
    }
    JOIN;
}

// u += factor * correction.
static void add_correction(const nmm_solver *s, double factor) {
    const int n = 2 * s->n;
    const float *correction = s->narrow.u;
    double *u = s->wide.u;
    PARALLEL_FOR
    for (int i = 0; i < n; i++)
        u[i] += factor * (double)correction[i];
    JOIN;
}

// One round in float32, by sweeps or, where there is no plan, conjugate gradients.
static void run_narrow(nmm_solver *s, sweeps *plan, double norm, nmm_solve_report *report) {
    const double gain = plan != NULL ? NARROW_SWEEP_GAIN : NARROW_GAIN;
    const double goal = nmm_max(gain, 0.5 * s->limit / norm);
    s->state->limit = goal * goal;
    SEND(s->state, 1);
    BATCH {
        begin_correction(s, norm);
        measure_narrow(s);
    }
    FETCH(s->state, 1);
    if (plan != NULL) {
        run_sweeps_narrow(s, plan, 1, goal, report);
        return;
    }
    // Most are left to float64, which may have to go on alone.
    const int done = s->state->iterations, left = s->options.max_iterations - done;
    run_recursion_narrow(s, done + nmm_max_int(left / 4, nmm_min_int(left, NMM_BATCH)));
    report->iterations = s->state->iterations;
}

// Residual correction: rounds in float32, each judged in float64, until the residual is small or a
// round gains too little; then float64 goes on from there.
static double run_mixed(nmm_solver *s, sweeps *plan, double norm, nmm_solve_report *report) {
    const sweeps planned = plan != NULL ? *plan : (sweeps){0};
    while (!(norm <= s->limit) && report->iterations < s->options.max_iterations) {
        const double before = norm;
        run_narrow(s, plan, norm, report);
        BATCH {
            add_correction(s, before);
        }
        norm = true_norm(s);
        const bool gained = norm <= s->limit || norm < 0.3 * before;
        if (report->end == NMM_SOLVE_CONVERGED && gained) continue;
        if (!(norm < before)) {
            // A correction that is not finite cannot be taken back.
            memset(s->wide.u, 0, 2 * (size_t)s->n * sizeof(double));
            SEND(s->wide.u, 2 * (long)s->n);
            norm = true_norm(s);
        }
        report->end = NMM_SOLVE_CONVERGED;
        report->by_average_change = false;
        report->precision = NMM_PRECISION_DOUBLE;
        report->fell_back = true;
        report->why = "float32 gained nothing more, float64 went on";
        // Bounds that float32's rounding has bent.
        if (plan != NULL) *plan = planned;
        break;
    }
    s->state->limit = s->limit * s->limit;
    s->state->stop = norm <= s->limit ? NMM_STOP_SMALL : NMM_STOP_NONE;
    SEND(s->state, 1);
    return norm;
}

// --- Methods

// Conjugate gradients. What the recursion calls small is measured; if it is not, the recursion
// starts anew from there, as long as each start at least halves the residual.
static double run_pcg(nmm_solver *s, const double *u, nmm_solve_report *report) {
    const int most = s->options.max_iterations;
    double norm = first_norm(s, u), before = 2 * norm + 1;
    if (report->precision == NMM_PRECISION_MIXED) {
        norm = run_mixed(s, NULL, norm, report);
        before = 2 * norm + 1;
    }
    while (!(norm <= s->limit) && report->end == NMM_SOLVE_CONVERGED) {
        if (s->state->iterations >= most) {
            report->end = NMM_SOLVE_TOO_SLOW;
        } else if (!(norm < 0.5 * before)) {
            report->end = NMM_SOLVE_STAGNATED;
        } else {
            before = norm;
            run_recursion_wide(s, most);
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

// A power of two next to the square root of the largest number in D^-1.
static double unit_of(const nmm_solver *s) {
    double largest = 0;
    for (long i = 0; i < 2 * (long)s->n; i++)
        largest = nmm_max(largest, s->wide.inverse[4 * (i / 2) + 3 * (i % 2)]);
    int exponent = 0;
    frexp(sqrt(largest), &exponent);
    return ldexp(1, exponent);
}

// Bounds of the spectrum of D^-1 K by Lanczos steps, which are those of conjugate gradients,
// eq. (6.9). Leaves its sums in u, which nothing reads.
static void estimate_bounds(nmm_solver *s, double bounds[2], nmm_solve_report *report) {
    s->state->limit = 0;
    s->state->unit = unit_of(s);
    SEND(s->state, 1);
    BATCH {
        scatter(s);
        sum_chunks(s);
        begin_recursion(s);
    }
    FETCH(s->state, 1);
    // Where the residual has fallen this far the process has seen the whole spectrum.
    s->state->limit = 1e-24 * s->state->sum[1];
    s->state->iterations = 0;
    SEND(s->state, 1);
    run_recursion_wide(s, NMM_LANCZOS);
    if (s->state->stop == NMM_STOP_CURVATURE) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = row_of_curvature(s);
    }
    nmm_lanczos_bounds(s->state->iterations, s->state->history, bounds);
}

// What the sweeps are to do: the damping asked for, or bounds from before or from an estimate.
static void plan_sweeps(nmm_solver *s, sweeps *plan, nmm_solve_report *report) {
    *plan = (sweeps){.chebyshev = s->options.method == NMM_SOLVE_CHEBYSHEV,
                     .damping = s->options.jacobi_damping};
    if (!plan->chebyshev && plan->damping > 0) return;
    if (s->options.reuse && s->lambda[1] > 0 && s->lambda_blocks == s->blocks) {
        plan->bounds[0] = s->lambda[0];
        plan->bounds[1] = s->lambda[1];
    } else {
        estimate_bounds(s, plan->bounds, report);
        // The process sees them from inside.
        plan->bounds[0] = nmm_min(0.9 * plan->bounds[0], 0.5 * plan->bounds[1]);
        plan->bounds[1] = 1.05 * nmm_max(plan->bounds[1], 1);
    }
    if (!plan->chebyshev) plan->damping = 1.9 * 1.05 / plan->bounds[1];
}

// Jacobi and Chebyshev, with bounds of the spectrum that may be those of an earlier system.
static double try_sweeps(nmm_solver *s, const double *u, nmm_solve_report *report) {
    sweeps plan;
    plan_sweeps(s, &plan, report);
    double norm = first_norm(s, u);
    if (report->precision == NMM_PRECISION_MIXED && report->end == NMM_SOLVE_CONVERGED) {
        norm = run_mixed(s, &plan, norm, report);
    }
    if (report->end == NMM_SOLVE_CONVERGED) {
        norm = run_sweeps_wide(s, &plan, norm, s->limit, report);
    }
    // By the paper's test the newest iterate is the result, and what is measured is another.
    if (report->by_average_change) norm = true_norm(s);
    s->lambda[0] = plan.bounds[0];
    // Bounds that served badly are not handed on.
    s->lambda[1] = report->end == NMM_SOLVE_CONVERGED ? plan.bounds[1] : 0;
    s->lambda_blocks = s->blocks;
    report->lambda_min = plan.chebyshev ? plan.bounds[0] : 0;
    report->lambda_max = plan.bounds[1] / 1.05;
    return norm;
}

static double run_jacobi(nmm_solver *s, const double *u, nmm_solve_report *report) {
    const bool reused = s->options.reuse && s->lambda[1] > 0;
    const double norm = try_sweeps(s, u, report);
    if (!reused || report->end != NMM_SOLVE_DIVERGED) return norm;
    // The bounds did not hold for this system.
    s->lambda[1] = 0;
    report->end = NMM_SOLVE_CONVERGED;
    report->iterations = 0;
    return try_sweeps(s, u, report);
}

// Of the matrix and its inverted blocks, what kernels do not know yet.
static void send_matrix(nmm_solver *s, bool mixed) {
    const long n_dense = NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS;
    unsigned char *row = s->newer_row, *group = row != NULL ? s->clusters.newer : NULL;
    nmm_range part = {0, 0};
    while (nmm_newer_next(row, s->n, NMM_NEWER_WIDE, NMM_GAP_ROWS, &part)) {
        const long first = s->row_start[part.begin], end = s->row_start[part.end];
        SEND(s->wide.value + 4 * first, 4 * (end - first));
        SEND(s->wide.inverse + 4 * (long)part.begin, 4 * (long)(part.end - part.begin));
    }
    part = (nmm_range){0, 0};
    while (mixed && nmm_newer_next(row, s->n, NMM_NEWER_NARROW, NMM_GAP_ROWS, &part)) {
        const long first = s->row_start[part.begin], end = s->row_start[part.end];
        SEND(s->narrow.value + 4 * first, 4 * (end - first));
        SEND(s->narrow.inverse + 4 * (long)part.begin, 4 * (long)(part.end - part.begin));
    }
    if (s->dense == NULL) return;
    const int n_group = nmm_groups_of(s->n);
    part = (nmm_range){0, 0};
    while (nmm_newer_next(group, n_group, NMM_NEWER_WIDE, NMM_GAP_CLUSTERS, &part)) {
        const long n_part = part.end - part.begin;
        SEND(s->dense + n_dense * part.begin, n_dense * n_part);
        SEND(s->dense_scale + part.begin, n_part);
    }
}

// A prepared system: send it, iterate, fetch the result into s->wide.u; its true residual norm.
static double run_method(nmm_solver *s, const double *u, nmm_solve_report *report) {
    const long n = s->n;
    if (!s->pattern_kept) {
        SEND(s->row_start, n + 1);
        SEND(s->col, s->n_block);
    }
    send_matrix(s, report->precision == NMM_PRECISION_MIXED);
    SEND(s->wide.f, 2 * n);
    const bool pcg = s->options.method == NMM_SOLVE_PCG;
    const double norm = pcg ? run_pcg(s, u, report) : run_jacobi(s, u, report);
    FETCH(s->wide.u, 2 * n);
    report->on_device = s->state->on_device != 0;
    return norm;
}
