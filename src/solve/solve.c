// SPDX-License-Identifier: MIT
//
// What all methods share: options, the solver object, and what comes before and after the
// iteration. Before: the system is checked, scaled by a power of two (which rounds nothing) and its
// 2x2 diagonal blocks are inverted. After: the result is judged by its true residual and written
// back. Wrong systems end with a report that names the row; the iteration never sees them.

#include "direct.h"

#include <math.h>
#include <string.h>

// Below this many rows one thread is fastest (docs/offload.md has the measurement).
#define ROWS_FOR_THREADS 2000

// A diagonal block whose second pivot is below this part of its diagonal counts as singular.
#define SINGULAR 1e-14

nmm_solve_options nmm_default_solve_options(void) {
    return (nmm_solve_options){.method = NMM_SOLVE_AUTO, .tolerance = 1e-8};
}

const char *nmm_solve_method_name(nmm_solve_method method) {
    switch (method) {
    case NMM_SOLVE_AUTO:
        return "auto";
    case NMM_SOLVE_JACOBI:
        return "jacobi";
    case NMM_SOLVE_PCG:
        return "pcg";
    case NMM_SOLVE_SOR:
        return "sor";
    case NMM_SOLVE_GAUSS_SEIDEL:
        return "gauss_seidel";
    case NMM_SOLVE_CHEBYSHEV:
        return "chebyshev";
    case NMM_SOLVE_DIRECT:
        return "direct";
    }
    return "unknown";
}

const char *nmm_solve_blocks_name(nmm_solve_blocks blocks) {
    static const char *const name[] = {"auto", "cover", "cluster", "body"};
    const bool known = (int)blocks >= NMM_BLOCKS_AUTO && (int)blocks <= NMM_BLOCKS_BODY;
    return known ? name[blocks] : "unknown";
}

const char *nmm_solve_end_name(nmm_solve_end end) {
    switch (end) {
    case NMM_SOLVE_CONVERGED:
        return "converged";
    case NMM_SOLVE_DIVERGED:
        return "diverged";
    case NMM_SOLVE_TOO_SLOW:
        return "not converged within the allowed iterations";
    case NMM_SOLVE_INDEFINITE:
        return "matrix not positive definite";
    case NMM_SOLVE_NOT_FINITE:
        return "matrix or right-hand side not finite";
    case NMM_SOLVE_STAGNATED:
        return "stagnated above the tolerance by rounding";
    case NMM_SOLVE_BAD_PATTERN:
        return "matrix pattern broken";
    }
    return "unknown";
}

// --- The object

nmm_status nmm_solver_create(nmm_context *context, nmm_solver **solver, int max_row, int max_block,
                             bool staged) {
    *solver = NULL;
    if (max_row < 0 || max_block < 0) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver opened for %d rows and %d blocks",
                        max_row, max_block);
    }
    TRY(nmm_allocate(context, solver, 1, sizeof **solver));
    nmm_solver *s = *solver;
    s->max_row = max_row;
    s->max_block = max_block;
    s->staged = staged;
    // At least one row, so that every array has an address.
    const size_t n = (size_t)nmm_max_int(max_row, 1);
    double **const vector[] = {&s->f, &s->u, &s->r, &s->p, &s->q, &s->product};
    for (size_t k = 0; k < sizeof vector / sizeof *vector; k++)
        TRY(nmm_allocate(context, vector[k], n, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &s->inverse, n, 4 * sizeof(double)));
    TRY(nmm_allocate(context, &s->part, n / NMM_SOLVE_CHUNK + 1, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &s->state, 1, sizeof *s->state));
    if (!staged) return NMM_OK;
    const size_t n_block = (size_t)nmm_max_int(max_block, 1);
    TRY(nmm_allocate(context, &s->row_start, n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &s->col, n_block, sizeof(int)));
    return nmm_allocate(context, &s->value, n_block, 4 * sizeof(double));
}

void nmm_solver_destroy(nmm_context *context, nmm_solver **solver) {
    nmm_solver *s = *solver;
    if (s == NULL) return;
    double **const vector[] = {&s->f, &s->u,       &s->r,       &s->p,
                               &s->q, &s->product, &s->inverse, &s->part};
    for (size_t k = 0; k < sizeof vector / sizeof *vector; k++)
        nmm_release(context, vector[k]);
    nmm_release(context, &s->state);
    nmm_direct_destroy(context, &s->direct);
    if (s->staged) {
        nmm_release(context, &s->row_start);
        nmm_release(context, &s->col);
        nmm_release(context, &s->value);
    }
    nmm_release(context, solver);
}

// --- Options and sizes

static nmm_status check_options(nmm_context *context, const nmm_solve_options *o) {
    if (!((int)o->method >= NMM_SOLVE_AUTO && o->method <= NMM_SOLVE_DIRECT)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver method %d is unknown", (int)o->method);
    }
    if (!(o->tolerance >= 0 && o->absolute >= 0 && o->tolerance < 1 &&
          o->tolerance + o->absolute > 0 && o->absolute <= 1e300)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "solver tolerance %g and absolute tolerance %g: one must be above 0, none "
                        "below, the first below 1",
                        o->tolerance, o->absolute);
    }
    if (!(o->jacobi_damping >= 0 && o->jacobi_damping < 2)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "jacobi damping %g is not within 0 (estimated) .. 2", o->jacobi_damping);
    }
    if (!(o->sor_factor >= 0 && o->sor_factor < 2)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "SOR factor %g is not within 0 .. 2",
                        o->sor_factor);
    }
    if (o->max_iterations < 0 || o->n_thread < 0) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "%d solver iterations on %d threads",
                        o->max_iterations, o->n_thread);
    }
    return NMM_OK;
}

static int chosen_iterations(nmm_solve_method method, int n_row) {
    const bool pcg = method == NMM_SOLVE_PCG;
    const long some = 10 * (long)n_row + 1000;
    const long most = pcg ? 20000 : 200000;
    const long wanted = pcg ? some : 100 * some;
    return (int)(wanted < most ? wanted : most);
}

// Every 0 by what it stands for.
static nmm_solve_options complete_options(const nmm_context *context,
                                          const nmm_solve_options *options, int n_row) {
    nmm_solve_options o = *options;
    if (o.method == NMM_SOLVE_AUTO) o.method = NMM_SOLVE_PCG;
    if (o.sor_factor == 0) o.sor_factor = 1.9;
    if (o.method == NMM_SOLVE_GAUSS_SEIDEL) o.sor_factor = 1;
    if (o.max_iterations == 0) o.max_iterations = chosen_iterations(o.method, n_row);
    if (o.n_thread == 0) o.n_thread = nmm_max_int(context->n_thread, 1);
    return o;
}

nmm_status nmm_solver_prepare(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                              bool keep_pattern, const nmm_solve_options *options) {
    TRY(check_options(context, options));
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    if (K->n_row < 0 || K->n_row > solver->max_row || n_block > solver->max_block) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "a system of %d rows and %d blocks in a solver opened for %d and %d",
                        K->n_row, n_block, solver->max_row, solver->max_block);
    }
    solver->options = complete_options(context, options, K->n_row);
    solver->pattern_kept = keep_pattern && solver->n_row == K->n_row && solver->n_block == n_block;
    solver->n_row = K->n_row;
    solver->n_block = n_block;
    solver->n_thread = K->n_row < ROWS_FOR_THREADS ? 1 : solver->options.n_thread;
    return NMM_OK;
}

// --- Checks of the system

// Row whose columns are not ascending within the matrix, or whose diagonal is elsewhere; -1: none.
static int bad_pattern_row(const nmm_bsr *K, int n_block) {
    if (K->row_start[0] != 0) return 0;
    for (int row = 0; row < K->n_row; row++) {
        const int begin = K->row_start[row], end = K->row_start[row + 1];
        if (end <= begin || end > n_block) return row;
        for (int k = begin; k < end; k++) {
            const int least = k > begin ? K->col[k - 1] + 1 : 0;
            if (K->col[k] < least || K->col[k] >= K->n_row) return row;
        }
        const int d = K->diagonal[row];
        if (d < begin || d >= end || K->col[d] != row) return row;
    }
    return -1;
}

// Sum of 0 * x over the blocks of a row: 0, or NaN when one number is not finite.
static double not_finite(const nmm_bsr *K, int row) {
    double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
        const double *v = K->value + 4 * (long)k;
        s0 += 0 * v[0];
        s1 += 0 * v[1];
        s2 += 0 * v[2];
        s3 += 0 * v[3];
    }
    return (s0 + s1) + (s2 + s3);
}

// Inverse of a block by two pivots, so that no product over- or underflows; false: not positive.
static bool invert_block(const double *v, double *inverse) {
    const double left = v[2] / v[0], up = v[1] / v[0];
    const double pivot = v[3] - left * v[1];
    if (!(v[0] > 0 && pivot > SINGULAR * v[3])) return false;
    inverse[3] = 1 / pivot;
    inverse[1] = -up * inverse[3];
    inverse[2] = -left * inverse[3];
    inverse[0] = 1 / v[0] - up * inverse[2];
    return 0 * (inverse[0] + inverse[3]) == 0;
}

// One pass over the matrix; the lowest troubled row of each kind.
static nmm_solve_end take_rows(nmm_solver *s, const nmm_bsr *K, int *row_of_trouble) {
    int infinite = K->n_row, indefinite = K->n_row;
    const int n_thread = s->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static)                                    \
    reduction(min                                                                                  \
              : infinite, indefinite) if (n_thread > 1)
    for (int row = 0; row < K->n_row; row++) {
        const double *block = K->value + 4 * (long)K->diagonal[row];
        if (not_finite(K, row) != 0) infinite = nmm_min_int(infinite, row);
        if (!invert_block(block, s->inverse + 4 * (long)row)) {
            indefinite = nmm_min_int(indefinite, row);
        }
    }
    *row_of_trouble = infinite < K->n_row ? infinite : indefinite;
    if (infinite < K->n_row) return NMM_SOLVE_NOT_FINITE;
    return indefinite < K->n_row ? NMM_SOLVE_INDEFINITE : NMM_SOLVE_CONVERGED;
}

// --- Scaling

// f into solver->f, scaled; returns the row of a number that is not finite, or -1.
static int take_right_hand_side(nmm_solver *s, const double *f) {
    double largest = 0;
    for (int i = 0; i < 2 * s->n_row; i++) {
        if (!(fabs(f[i]) <= 1.7976931348623157e308)) return i / 2;
        largest = nmm_max(largest, fabs(f[i]));
    }
    frexp(largest, &s->exponent);
    // Kept where 2^exponent and its inverse are ordinary numbers.
    s->exponent = nmm_max_int(-1000, nmm_min_int(s->exponent, 1000));
    const double scale = ldexp(1, -s->exponent);
    for (int i = 0; i < 2 * s->n_row; i++)
        s->f[i] = scale * f[i];
    s->norm = sqrt(nmm_sum_product(2 * s->n_row, s->f, s->f, 1));
    s->limit = nmm_max(s->options.tolerance * s->norm, scale * s->options.absolute);
    return -1;
}

void nmm_solver_load_guess(nmm_solver *solver, const double *u) {
    const double scale = ldexp(1, -solver->exponent);
    for (int i = 0; i < 2 * solver->n_row; i++)
        solver->u[i] = scale * u[i];
}

// The matrix: a pointer to it, or a copy.
static void take_matrix(nmm_solver *s, const nmm_bsr *K) {
    if (!s->staged) {
        s->row_start = K->row_start;
        s->col = K->col;
        s->value = K->value;
        return;
    }
    if (!s->pattern_kept) {
        memcpy(s->row_start, K->row_start, ((size_t)K->n_row + 1) * sizeof(int));
        memcpy(s->col, K->col, (size_t)s->n_block * sizeof(int));
    }
    memcpy(s->value, K->value, (size_t)s->n_block * 4 * sizeof(double));
}

// --- Before and after

static bool end_early(nmm_solver *s, nmm_solve_report *report, nmm_solve_end end, int row) {
    report->end = end;
    report->row = row;
    // What was sent before cannot be trusted to match what comes next.
    s->n_row = -1;
    return false;
}

bool nmm_solver_start(nmm_solver *solver, const nmm_bsr *K, const double *f, double *u,
                      nmm_solve_report *report) {
    *report = (nmm_solve_report){.method = solver->options.method, .row = -1, .residual = -1};
    solver->guess_dropped = false;
    memset(solver->state, 0, sizeof *solver->state);
    if (K->n_row > 0 && !solver->pattern_kept) {
        const int row = bad_pattern_row(K, solver->n_block);
        if (row >= 0) return end_early(solver, report, NMM_SOLVE_BAD_PATTERN, row);
    }
    const int row_of_f = take_right_hand_side(solver, f);
    if (row_of_f >= 0) return end_early(solver, report, NMM_SOLVE_NOT_FINITE, row_of_f);
    // No load, no displacement.
    if (solver->norm == 0) {
        for (int i = 0; i < 2 * K->n_row; i++)
            u[i] = 0;
        report->residual = 0;
        return end_early(solver, report, NMM_SOLVE_CONVERGED, -1);
    }
    int row = -1;
    const nmm_solve_end end = take_rows(solver, K, &row);
    if (end != NMM_SOLVE_CONVERGED) return end_early(solver, report, end, row);
    take_matrix(solver, K);
    return true;
}

static bool write_back(const nmm_solver *s, double *u) {
    const double scale = ldexp(1, s->exponent);
    double zero = 0;
    for (int i = 0; i < 2 * s->n_row; i++)
        zero += 0 * (scale * s->u[i]);
    if (zero != 0) return false;
    for (int i = 0; i < 2 * s->n_row; i++)
        u[i] = scale * s->u[i];
    return true;
}

void nmm_solver_finish(nmm_solver *solver, double norm, double *u, nmm_solve_report *report) {
    report->residual = norm / solver->norm;
    if (report->end == NMM_SOLVE_CONVERGED || norm <= solver->guess_norm) {
        if (write_back(solver, u)) return;
        report->end = NMM_SOLVE_DIVERGED;
    }
    // Failed and worse than the first guess: that is still in u, unless zero was better than it.
    report->residual = solver->guess_norm / solver->norm;
    for (int i = 0; solver->guess_dropped && i < 2 * solver->n_row; i++)
        u[i] = 0;
}
