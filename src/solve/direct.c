// SPDX-License-Identifier: MIT
//
// The direct method: P K P^T = L D L^T by CHOLMOD, simplicial, eq. (6.20). Order and shape of L
// are found once per pattern (approximate minimum degree on the graph of block rows), numbers when
// needed. Conjugate gradients with the factor as preconditioner finish: one iteration with a factor
// of K itself, more with one of an older K. Whether an old factor pays is told by counts of
// operations, never by a clock. What always holds: converged means that |f - K u| was measured.
// Chen, Davis, Hager, Rajamanickam: Algorithm 887, ACM Trans. Math. Softw. 35 (2008) 22.

#include "direct.h"

#include <math.h>
#include <string.h>

#include <cholmod.h>

// Costs in operations of a factorisation, measured with systems of 900 to 84 000 unknowns: what a
// factorisation does for each number of L and K beside its arithmetic; and what an iteration does
// for each, where L lies in the caches of a processor and where it does not.
#define FACTOR_OVERHEAD 10.0
#define SOLVE_NEAR 2.0
#define SOLVE_FAR 6.0
#define NEAR_NUMBERS 2e6

// Iterations with a factor of K itself from one measured residual to the next.
#define FRESH_ITERATIONS 20

// Where no solution is found a pivot below this part of its diagonal element is named as the cause.
#define SMALL_PIVOT 1e-12

// Least part of a factorisation's cost that iterations with an old factor may take.
#define LEAST_PATIENCE 0.0625

// Part of the limit at which the recursion stops, so that the true residual passes as well.
#define RECURSION_MARGIN 0.9

typedef struct nmm_direct {
    cholmod_common common;
    bool started; // common is in use
    // The pattern the factor was made for.
    int n_row, n_block;
    int *row_start, *col;   // [n_row + 1], [n_block]
    cholmod_sparse *matrix; // lower half of K by columns
    cholmod_factor *factor;
    bool fresh;  // the factor is that of the system at hand
    bool usable; // the factor is that of some system, with pivots above zero
    int weakest_row;
    double weakest_pivot; // smallest pivot / diagonal element
    // Operations of a factorisation, and of an iteration.
    double factor_cost, iteration_cost;
    // Since the factor was made: solves, operations including its own.
    int n_solve;
    double spent;
    double patience; // part of a factorisation's cost that iterations with an old factor may take
    // z = (P^T L D L^T P)^-1 r
    cholmod_dense right; // a view of the residual
    cholmod_dense *z, *work[2];
} nmm_direct;

bool nmm_solve_has_direct(void) {
    return true;
}

// --- The object

static void forget_factor(nmm_direct *d) {
    cholmod_l_free_factor(&d->factor, &d->common);
    d->usable = d->fresh = false;
}

static void forget_matrix(nmm_context *context, nmm_direct *d) {
    cholmod_l_free_sparse(&d->matrix, &d->common);
    nmm_release(context, &d->row_start);
    nmm_release(context, &d->col);
    d->n_row = d->n_block = 0;
}

void nmm_direct_destroy(nmm_context *context, nmm_direct **direct) {
    nmm_direct *d = *direct;
    if (d == NULL) return;
    if (d->started) {
        forget_factor(d);
        forget_matrix(context, d);
        cholmod_l_free_dense(&d->z, &d->common);
        for (int k = 0; k < 2; k++)
            cholmod_l_free_dense(&d->work[k], &d->common);
        cholmod_l_finish(&d->common);
    }
    nmm_release(context, direct);
}

static nmm_status create(nmm_context *context, nmm_direct **direct) {
    TRY(nmm_allocate(context, direct, 1, sizeof **direct));
    nmm_direct *d = *direct;
    d->patience = 1;
    cholmod_common *common = &d->common;
    d->started = cholmod_l_start(common) != 0;
    // Silent, on the processor, without BLAS.
    common->print = 0;
    common->error_handler = NULL;
    common->useGPU = 0;
    common->supernodal = CHOLMOD_SIMPLICIAL;
    common->final_ll = 0;
    // The order is made on the graph of block rows and given; L keeps it but for a postorder.
    common->nmethods = 1;
    common->method[0].ordering = CHOLMOD_GIVEN;
    common->postorder = 1;
    return NMM_OK;
}

// What CHOLMOD said of its last call.
static nmm_status judge(nmm_context *context, const nmm_direct *d) {
    const int status = d->common.status;
    if (status >= CHOLMOD_OK) return NMM_OK;
    if (status == CHOLMOD_OUT_OF_MEMORY || status == CHOLMOD_TOO_LARGE) {
        return nmm_fail(context, NMM_ERROR_MEMORY,
                        "no memory for the direct solver of %d rows and %d blocks", d->n_row,
                        d->n_block);
    }
    return nmm_fail(context, NMM_ERROR_ARGUMENT, "the direct solver's library refuses: status %d",
                    status);
}

// --- Pattern

static bool same_pattern(const nmm_direct *d, const nmm_solver *s) {
    return d->row_start != NULL && d->n_row == s->n_row && d->n_block == s->n_block &&
           memcmp(d->row_start, s->row_start, ((size_t)s->n_row + 1) * sizeof(int)) == 0 &&
           memcmp(d->col, s->col, (size_t)s->n_block * sizeof(int)) == 0;
}

static nmm_status take_pattern(nmm_context *context, nmm_direct *d, const nmm_solver *s) {
    forget_matrix(context, d);
    const size_t n = (size_t)s->n_row;
    TRY(nmm_allocate(context, &d->row_start, n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &d->col, (size_t)s->n_block, sizeof(int)));
    memcpy(d->row_start, s->row_start, (n + 1) * sizeof(int));
    memcpy(d->col, s->col, (size_t)s->n_block * sizeof(int));
    d->n_row = s->n_row;
    d->n_block = s->n_block;
    return NMM_OK;
}

// Where numbers go, two columns for each block row: column 2 * row + a holds K(2 * row + a, ..)
// from the diagonal on, which is the lower half by columns since K is symmetric. `value` NULL: the
// pattern.
static void fill_lower(const nmm_direct *d, const double *value) {
    SuiteSparse_long *start = d->matrix->p, *index = d->matrix->i, n = 0;
    double *x = d->matrix->x;
    for (int row = 0; row < d->n_row; row++) {
        for (int a = 0; a < 2; a++) {
            start[2 * (long)row + a] = n;
            for (int k = d->row_start[row]; k < d->row_start[row + 1]; k++) {
                if (d->col[k] < row) continue;
                for (int b = d->col[k] == row ? a : 0; b < 2; b++) {
                    index[n] = 2 * (SuiteSparse_long)d->col[k] + b;
                    x[n++] = value == NULL ? 0 : value[4 * (long)k + 2 * a + b];
                }
            }
        }
    }
    start[2 * (long)d->n_row] = n;
}

// Numbers alone, in the order of fill_lower.
static nmm_status make_matrix(nmm_context *context, nmm_direct *d) {
    const size_t n = 2 * (size_t)d->n_row;
    // Both halves of 2x2 blocks hold 4 * n_block numbers, n of them on the diagonal.
    const size_t n_number = (4 * (size_t)d->n_block + n) / 2;
    d->matrix = cholmod_l_allocate_sparse(n, n, n_number, 1, 1, -1, CHOLMOD_REAL, &d->common);
    return judge(context, d);
}

// The graph of block rows: its lower half by columns, numbers left out.
static cholmod_sparse *make_graph(nmm_direct *d) {
    const size_t n = (size_t)d->n_row, n_edge = ((size_t)d->n_block + n) / 2;
    cholmod_sparse *graph =
        cholmod_l_allocate_sparse(n, n, n_edge, 1, 1, -1, CHOLMOD_PATTERN, &d->common);
    if (graph == NULL) return NULL;
    SuiteSparse_long *start = graph->p, *index = graph->i, m = 0;
    for (int row = 0; row < d->n_row; row++) {
        start[row] = m;
        for (int k = d->row_start[row]; k < d->row_start[row + 1]; k++)
            if (d->col[k] >= row) index[m++] = d->col[k];
    }
    start[d->n_row] = m;
    return graph;
}

// Elimination order of the unknowns, by approximate minimum degree of the block rows.
static nmm_status find_order(nmm_context *context, nmm_direct *d, SuiteSparse_long *order) {
    cholmod_sparse *graph = make_graph(d);
    SuiteSparse_long *row_order = order + d->n_row;
    if (graph != NULL) cholmod_l_amd(graph, NULL, 0, row_order, &d->common);
    const nmm_status status = judge(context, d);
    cholmod_l_free_sparse(&graph, &d->common);
    // The rows' order lies in the second half, and is read before it is written over.
    for (int k = 0; status == NMM_OK && k < d->n_row; k++) {
        const SuiteSparse_long row = row_order[k];
        order[2 * (long)k] = 2 * row;
        order[2 * (long)k + 1] = 2 * row + 1;
    }
    return status;
}

// Order and shape of L.
static nmm_status analyse(nmm_context *context, nmm_direct *d) {
    SuiteSparse_long *order = NULL;
    TRY(nmm_allocate(context, &order, 2 * (size_t)d->n_row, sizeof *order));
    nmm_status status = find_order(context, d, order);
    if (status == NMM_OK) {
        d->factor = cholmod_l_analyze_p(d->matrix, order, NULL, 0, &d->common);
        status = judge(context, d);
        const double n_factor = d->common.lnz, n_matrix = 4.0 * d->n_block;
        d->factor_cost = d->common.fl + FACTOR_OVERHEAD * (n_factor + n_matrix / 2);
        d->iteration_cost =
            (n_factor > NEAR_NUMBERS ? SOLVE_FAR : SOLVE_NEAR) * n_factor + n_matrix;
    }
    nmm_release(context, &order);
    return status;
}

// --- Factor

// Are all pivots above zero? Notes the weakest one.
static bool look_at_pivots(nmm_direct *d) {
    const cholmod_factor *L = d->factor;
    const SuiteSparse_long *start = L->p, *perm = L->Perm;
    const SuiteSparse_long *diagonal = d->matrix->p;
    const double *pivot = L->x, *value = d->matrix->x;
    d->weakest_pivot = 2;
    for (size_t k = 0; k < L->n; k++) {
        // The first number of a column of either is on the diagonal.
        const double ratio = pivot[start[k]] / value[diagonal[perm[k]]];
        const bool positive = k < L->minor && ratio > 0;
        if (positive && ratio >= d->weakest_pivot) continue;
        d->weakest_pivot = ratio;
        d->weakest_row = (int)(perm[k] / 2);
        if (!positive) return false;
    }
    return true;
}

// The numbers of L for the solver's matrix.
static nmm_status factorise(nmm_context *context, nmm_direct *d, const nmm_solver *s,
                            nmm_solve_report *report) {
    const bool known = same_pattern(d, s) && d->matrix != NULL;
    d->usable = d->fresh = false;
    if (!known) {
        TRY(take_pattern(context, d, s));
        TRY(make_matrix(context, d));
    }
    fill_lower(d, s->wide.value);
    if (!known || d->factor == NULL) {
        forget_factor(d);
        TRY(analyse(context, d));
    }
    cholmod_l_factorize(d->matrix, d->factor, &d->common);
    TRY(judge(context, d));
    report->setups++;
    d->n_solve = 0;
    d->spent = d->factor_cost;
    d->fresh = d->usable = look_at_pivots(d);
    if (!d->usable) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = d->weakest_row;
    }
    return NMM_OK;
}

// z = (factor)^-1 r, eq. (6.21), as a pointer to [n_row][2].
static nmm_status apply_factor(nmm_context *context, nmm_direct *d, const nmm_solver *s,
                               const double **z) {
    const size_t n = 2 * (size_t)s->n_row;
    d->right = (cholmod_dense){.nrow = n,
                               .ncol = 1,
                               .nzmax = n,
                               .d = n,
                               .x = s->wide.r,
                               .xtype = CHOLMOD_REAL,
                               .dtype = CHOLMOD_DOUBLE};
    cholmod_l_solve2(CHOLMOD_A, d->factor, &d->right, NULL, &d->z, NULL, &d->work[0], &d->work[1],
                     &d->common);
    TRY(judge(context, d));
    *z = d->z->x;
    return NMM_OK;
}

// --- Conjugate gradients

// y = K x.
static void multiply(const nmm_solver *s, const double *x, double *y) {
    for (int row = 0; row < s->n_row; row++) {
        double y0 = 0, y1 = 0, y2 = 0, y3 = 0;
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const double *v = s->wide.value + 4 * (long)k, *xk = x + 2 * (long)s->col[k];
            y0 += v[0] * xk[0];
            y1 += v[1] * xk[1];
            y2 += v[2] * xk[0];
            y3 += v[3] * xk[1];
        }
        y[2 * (long)row] = y0 + y1;
        y[2 * (long)row + 1] = y2 + y3;
    }
}

static double dot(const nmm_solver *s, const double *x, const double *y) {
    return nmm_sum_product(2 * s->n_row, x, y, 1);
}

// r = f - K u; its norm.
static double true_norm(const nmm_solver *s) {
    multiply(s, s->wide.u, s->wide.r);
    for (int i = 0; i < 2 * s->n_row; i++)
        s->wide.r[i] = s->wide.f[i] - s->wide.r[i];
    return sqrt(dot(s, s->wide.r, s->wide.r));
}

// One step of conjugate gradients, eqs. (6.6) and (6.7) with the factor in place of D. `rho` is
// that of the step before, 0 at first; becomes -1 when the matrix or the factor is not positive in
// the direction tried, or a number is not finite. *norm: of the recursion's residual.
static nmm_status step(nmm_context *context, nmm_direct *d, nmm_solver *s, double *rho,
                       double *norm) {
    const double *z = NULL;
    TRY(apply_factor(context, d, s, &z));
    const int n = 2 * s->n_row;
    const double rho_new = dot(s, s->wide.r, z);
    const double beta = *rho > 0 ? rho_new / *rho : 0;
    for (int i = 0; i < n; i++)
        s->wide.p[i] = z[i] + (beta == 0 ? 0 : beta * s->wide.p[i]);
    multiply(s, s->wide.p, s->wide.q);
    const double curvature = dot(s, s->wide.p, s->wide.q), alpha = rho_new / curvature;
    *rho = rho_new > 0 && curvature > 0 && 0 * alpha == 0 ? rho_new : -1;
    if (*rho < 0) return NMM_OK;
    for (int i = 0; i < n; i++) {
        s->wide.u[i] += alpha * s->wide.p[i];
        s->wide.r[i] -= alpha * s->wide.q[i];
    }
    *norm = sqrt(dot(s, s->wide.r, s->wide.r));
    return NMM_OK;
}

// Up to `most` steps from the residual in r; *norm is then the true one. With a few eigenvalues
// away from 1 the residual falls slowly at first, then fast: half-way through the steps it must
// have come a quarter of the way on a logarithmic scale, or the rest is left out.
static nmm_status run_recursion(nmm_context *context, nmm_direct *d, nmm_solver *s, int most,
                                double *norm, nmm_solve_report *report) {
    const double quarter = sqrt(*norm) * sqrt(sqrt(*norm) * sqrt(s->limit));
    double rho = 0, small = *norm;
    for (int k = 0; k < most; k++) {
        TRY(step(context, d, s, &rho, &small));
        if (rho < 0) break;
        report->iterations++;
        if (!(small > RECURSION_MARGIN * s->limit)) break;
        if (2 * (k + 1) >= most && !(small <= quarter)) break;
    }
    *norm = true_norm(s);
    return NMM_OK;
}

// --- Control

// Is the factor at hand one to begin with?
static bool old_factor_pays(const nmm_direct *d, const nmm_solver *s) {
    return s->options.reuse && d->usable && d->factor->n == 2 * (size_t)s->n_row;
}

// With a factor of another matrix: as many iterations as a factorisation is worth; fewer after
// failures, so that a run whose matrices differ much does not pay twice for each.
static nmm_status try_old_factor(nmm_context *context, nmm_direct *d, nmm_solver *s,
                                 const double *u, double *norm, nmm_solve_report *report) {
    const double worth = d->patience * d->factor_cost / d->iteration_cost;
    const int most = (int)nmm_min(worth, s->options.max_iterations / 2);
    TRY(run_recursion(context, d, s, most, norm, report));
    const double cost = report->iterations * d->iteration_cost;
    d->n_solve++;
    d->spent += cost;
    const bool solved = *norm <= s->limit;
    d->patience = solved ? nmm_min(2 * d->patience, 1) : nmm_max(0.5 * d->patience, LEAST_PATIENCE);
    // The cost per solve has passed its lowest point, eq. (6.22): the next solve makes a new
    // factor.
    if (cost * d->n_solve > d->spent) d->usable = false;
    if (!(*norm <= s->guess_norm)) *norm = nmm_solver_first_norm(s, u, true_norm);
    return NMM_OK;
}

// With the factor of this matrix: one iteration, and some more where rounding wants them, as long
// as each round at least halves the true residual.
static nmm_status refine(nmm_context *context, nmm_direct *d, nmm_solver *s, double *norm,
                         nmm_solve_report *report) {
    double before = 4 * *norm;
    while (!(*norm <= s->limit) && *norm < 0.5 * before) {
        const int left = s->options.max_iterations - report->iterations;
        before = *norm;
        if (left == 0) {
            report->end = NMM_SOLVE_TOO_SLOW;
            return NMM_OK;
        }
        TRY(run_recursion(context, d, s, nmm_min_int(FRESH_ITERATIONS, left), norm, report));
    }
    if (*norm <= s->limit) return NMM_OK;
    report->end = NMM_SOLVE_STAGNATED;
    // A pivot that is nothing but rounding: singular.
    if (d->weakest_pivot < SMALL_PIVOT) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = d->weakest_row;
    }
    return NMM_OK;
}

static nmm_status run(nmm_context *context, nmm_solver *s, const double *u, double *norm,
                      nmm_solve_report *report) {
    if (s->direct == NULL) TRY(create(context, &s->direct));
    nmm_direct *d = s->direct;
    d->fresh = false;
    *norm = nmm_solver_first_norm(s, u, true_norm);
    if (*norm <= s->limit) return NMM_OK;
    if (old_factor_pays(d, s)) {
        TRY(try_old_factor(context, d, s, u, norm, report));
        if (*norm <= s->limit) return NMM_OK;
    }
    TRY(factorise(context, d, s, report));
    return d->fresh ? refine(context, d, s, norm, report) : NMM_OK;
}

nmm_status nmm_direct_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report) {
    bool ready = false;
    TRY(nmm_solver_start(context, solver, K, f, u, report, &ready));
    if (!ready) return NMM_OK;
    report->n_thread = 1;
    double norm = 0;
    TRY(run(context, solver, u, &norm, report));
    nmm_solver_finish(solver, norm, u, report);
    return NMM_OK;
}
