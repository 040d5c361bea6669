// SPDX-License-Identifier: MIT
//
// The direct method: K = L L^T, eq. (6.20). Order and shape of L are found once per pattern, its
// numbers when needed. Conjugate gradients with the factor as preconditioner finish: one iteration
// with a factor of K itself, more with one of an older K. Whether an old factor pays is told by
// counts of operations, never by a clock. What always holds: converged means that |f - K u| was
// measured.

#include "direct.h"

#include <math.h>
#include <string.h>

// Nanoseconds of one core of about 3 GHz.
#define PER_CALL 1500.0
#define PER_NUMBER 0.16 // of L, twice for each solve with it, and of K
#define ANALYSE 30.0    // by block
#define CUT 30.0        // the same, where nested dissection comes first
// By block, where the pattern is not known; and by its fronts, as in the plane: by block and rows
// to the power 3/4, and to the power 1/2 where rows are cut first.
#define FACTORISE 3.2
#define FRONTS 0.052
#define FRONTS_CUT 0.5
#define FILL 7.0 // numbers of L by block

// Iterations with a factor of K itself from one measured residual to the next.
#define FRESH_ITERATIONS 20

// Where no solution is found a pivot below this part of its diagonal element is named as the cause.
#define SMALL_PIVOT 1e-12

// Work of a solve that several threads are worth [ns].
#define LEAST_SHARED 200000.0

// Part of the iterations that are worth a factorisation, before progress with an old factor is
// judged.
#define GRACE 0.25

// Solves without a try of the old factor, at most, after failures.
#define LONGEST_PAUSE 8

// Part of the limit at which the recursion stops, so that the true residual passes as well.
#define RECURSION_MARGIN 0.9

typedef struct nmm_direct {
    nmm_factor factor;
    bool fresh;  // the factor is that of the system at hand
    bool usable; // the factor is that of some system, with pivots above zero
    // Work of a factorisation, and of an iteration.
    double factor_cost, iteration_cost;
    // Since the factor was made: solves, work including its own.
    int n_solve;
    double spent;
    // Solves without a try of an old factor: still to come, and after the next failure.
    int pause, next_pause;
    nmm_pace pace; // one thread or several
    bool analysed; // in this solve
    long pattern;  // of the solver when the factor was found to be for it; 0: never
} nmm_direct;

// --- The object

void nmm_direct_destroy(nmm_context *context, nmm_direct **direct) {
    if (*direct == NULL) return;
    nmm_factor_destroy(context, &(*direct)->factor);
    nmm_release(context, direct);
}

static nmm_status create(nmm_context *context, nmm_direct **direct) {
    if (*direct != NULL) return NMM_OK;
    TRY(nmm_allocate(context, direct, 1, sizeof **direct));
    (*direct)->next_pause = 1;
    return NMM_OK;
}

// Is the factor for this pattern? What the caller says to be the same is not compared again.
static bool knows(const nmm_solver *s, const nmm_bsr *K) {
    const nmm_direct *d = s->direct;
    if (d == NULL) return false;
    return (d->pattern > 0 && d->pattern == s->pattern) || nmm_factor_knows(&d->factor, K);
}

double nmm_direct_work(const nmm_solver *solver, const nmm_bsr *K, double *analysis) {
    const double n = K->n_row, n_block = n > 0 ? K->row_start[K->n_row] : 0;
    const double per_block = PER_NUMBER * 4;
    // Twice a product with K, and a look at its numbers.
    const double call = PER_CALL + 3 * per_block * n_block;
    const bool cut = n >= NMM_ROWS_TO_CUT;
    *analysis = (cut ? ANALYSE + CUT : ANALYSE) * n_block;
    if (solver != NULL && knows(solver, K)) {
        const nmm_factor *factor = &solver->direct->factor;
        *analysis = 0;
        return call + factor->work + 2 * PER_NUMBER * factor->n_number;
    }
    const double fronts = cut ? FRONTS_CUT * sqrt(n) : FRONTS * sqrt(n * sqrt(n));
    const double work = (FACTORISE + fronts) * n_block;
    return call + work + 2 * PER_NUMBER * FILL * n_block;
}

// Places that were checked.
static const double *place_of(const nmm_solver *s) {
    return s->options.body != NULL ? s->options.place : NULL;
}

// Order and shape of L.
static nmm_status analyse(nmm_context *context, nmm_direct *d, const nmm_solver *s,
                          const nmm_bsr *K) {
    const bool known = knows(s, K);
    d->pattern = known ? s->pattern : 0;
    if (known) return NMM_OK;
    d->usable = d->fresh = false;
    d->analysed = true;
    TRY(nmm_factor_analyse(context, &d->factor, K, place_of(s)));
    d->pattern = s->pattern;
    d->factor_cost = d->factor.work;
    d->iteration_cost = PER_NUMBER * (2 * d->factor.n_number + 4.0 * d->factor.n_block);
    return NMM_OK;
}

// --- Factor

// Row of the pivot that is smallest beside its diagonal element; *ratio: of the two. The diagonal
// of L holds inverses.
static int weakest_pivot(const nmm_factor *f, const nmm_bsr *K, double *ratio) {
    double most = 0;
    int weakest = -1;
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        for (int j = 0; j < 2 * front->n_pivot; j++) {
            const int row = f->order[front->first + j / 2];
            const double inverse = f->value[front->column + (front->stride + 1L) * j];
            const double element = K->value[4 * (long)K->diagonal[row] + 3 * (j % 2)];
            const double inverse_ratio = inverse * element * inverse;
            if (inverse_ratio <= most) continue;
            most = inverse_ratio;
            weakest = row;
        }
    }
    *ratio = 1 / most;
    return weakest;
}

// The numbers of L for the solver's matrix, and z for the residual at hand.
static nmm_status factorise(nmm_context *context, nmm_direct *d, const nmm_solver *s,
                            const nmm_bsr *K, nmm_solve_report *report) {
    TRY(analyse(context, d, s, K));
    d->usable = d->fresh = false;
    TRY(nmm_factor_reserve(context, &d->factor, s->n_thread));
    const int row = nmm_factor_fastest()->solve(&d->factor, K->value, s->wide.r, s->wide.z);
    report->setups++;
    d->n_solve = 0;
    d->spent = d->factor_cost;
    if (row >= 0) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = row;
        // That an older factor failed tells nothing then.
        d->pause = 0;
        d->next_pause = 1;
        return NMM_OK;
    }
    d->fresh = d->usable = true;
    return NMM_OK;
}

// --- Conjugate gradients

static double dot(const nmm_solver *s, const double *x, const double *y) {
    return nmm_sum_product(2 * s->n_row, x, y, s->n_thread);
}

static bool is_zero(int n, const double *x) {
    int i = 0;
    while (i < n && x[i] == 0)
        i++;
    return i == n;
}

// r = f - K u; its norm. Many solves begin with u = 0.
static double true_norm(const nmm_solver *s) {
    const double *f = s->wide.f;
    double *r = s->wide.r;
    const int n = 2 * s->n_row;
    if (is_zero(n, s->wide.u)) {
        memcpy(r, f, (size_t)n * sizeof *r);
        return s->norm;
    }
    s->variant->multiply(s, s->wide.u, r);
    NMM_SHARED_LOOP(n, s->n_thread, r[i] = f[i] - r[i]);
    return sqrt(dot(s, s->wide.r, s->wide.r));
}

// One step of conjugate gradients, eqs. (6.6) and (6.7) with the factor in place of D. `rho` is
// that of the step before, 0 at first; becomes -1 when the matrix or the factor is not positive in
// the direction tried, or a number is not finite. *norm: of the recursion's residual.
static void step(const nmm_direct *d, nmm_solver *s, double *rho, double *norm) {
    const int n = 2 * s->n_row;
    double *p = s->wide.p, *q = s->wide.q, *r = s->wide.r, *u = s->wide.u, *z = s->wide.z;
    nmm_factor_fastest()->apply(&d->factor, r, z);
    const double rho_new = dot(s, r, z);
    const double beta = *rho > 0 ? rho_new / *rho : 0;
    NMM_SHARED_LOOP(n, s->n_thread, p[i] = z[i] + (beta == 0 ? 0 : beta * p[i]));
    s->variant->multiply(s, p, q);
    const double curvature = dot(s, p, q), alpha = rho_new / curvature;
    *rho = rho_new > 0 && curvature > 0 && 0 * alpha == 0 ? rho_new : -1;
    if (*rho < 0) return;
    NMM_SHARED_LOOP(n, s->n_thread, u[i] += alpha * p[i]; r[i] -= alpha * q[i]);
    *norm = sqrt(dot(s, r, r));
}

static double power(double x, int n) {
    double product = 1;
    for (int k = 0; k < n; k++)
        product *= x;
    return product;
}

// Does the progress from `first` to `now` in k iterations promise the limit in `most` in all?
// Orders of magnitude are compared as powers: log10 is not the same on every machine.
static bool promises(double first, double now, double limit, int k, int most) {
    if (k < GRACE * most) return true;
    return power(first / limit, k) <= power(first / now, most);
}

// Up to `most` steps from the residual in r, as long as they promise to do; *norm is then the true
// one.
static void run_recursion(const nmm_direct *d, nmm_solver *s, int most, double *norm,
                          nmm_solve_report *report) {
    const double first = *norm, limit = RECURSION_MARGIN * s->limit;
    double rho = 0, small = first;
    for (int k = 0; k < most && small > limit && promises(first, small, limit, k, most); k++) {
        step(d, s, &rho, &small);
        if (rho < 0) break;
        report->iterations++;
    }
    *norm = true_norm(s);
}

// --- Control

// Is the factor at hand one to begin with?
static bool old_factor_pays(nmm_direct *d, const nmm_solver *s) {
    if (!(s->options.reuse && d->usable && d->factor.n_row == s->n_row)) return false;
    d->pause--;
    return d->pause < 0;
}

// With a factor of another matrix: as many iterations as a factorisation is worth. After a failure
// some solves are left out, twice as many each time, so that a run whose matrices differ much does
// not pay twice for each.
static void try_old_factor(nmm_direct *d, nmm_solver *s, const double *u, double *norm,
                           nmm_solve_report *report) {
    const double worth = nmm_max(1, d->factor_cost / d->iteration_cost);
    const int most = (int)nmm_min(worth, s->options.max_iterations / 2);
    run_recursion(d, s, most, norm, report);
    const double cost = report->iterations * d->iteration_cost;
    d->n_solve++;
    d->spent += cost;
    const bool solved = *norm <= s->limit;
    d->pause = solved ? 0 : d->next_pause;
    d->next_pause = solved ? 1 : nmm_min_int(2 * d->next_pause, LONGEST_PAUSE);
    // The cost per solve has passed its lowest point, eq. (6.22): the next solve makes a new
    // factor.
    if (cost * d->n_solve > d->spent) d->usable = false;
    if (!(*norm <= s->guess_norm)) *norm = nmm_solver_first_norm(s, u, true_norm);
}

// u += z = (factor)^-1 r, made with the factor; the first guess again where that is no gain. Needs
// one product with K less than an iteration does.
static void correct(nmm_solver *s, const double *u, double *norm, nmm_solve_report *report) {
    const int n = 2 * s->n_row;
    NMM_SHARED_LOOP(n, s->n_thread, s->wide.u[i] += s->wide.z[i]);
    report->iterations++;
    *norm = true_norm(s);
    if (!(*norm <= s->guess_norm)) *norm = nmm_solver_first_norm(s, u, true_norm);
}

// With the factor of this matrix: one correction, and some iterations where rounding wants them, as
// long as each round at least halves the true residual.
static void refine(const nmm_direct *d, nmm_solver *s, const nmm_bsr *K, const double *u,
                   double *norm, nmm_solve_report *report) {
    if (report->iterations < s->options.max_iterations) correct(s, u, norm, report);
    double before = 4 * *norm;
    while (!(*norm <= s->limit) && *norm < 0.5 * before) {
        const int left = s->options.max_iterations - report->iterations;
        before = *norm;
        if (left == 0) {
            report->end = NMM_SOLVE_TOO_SLOW;
            return;
        }
        run_recursion(d, s, nmm_min_int(FRESH_ITERATIONS, left), norm, report);
    }
    if (*norm <= s->limit) return;
    report->end = NMM_SOLVE_STAGNATED;
    // A pivot that is nothing but rounding: singular.
    double ratio = 1;
    const int row = weakest_pivot(&d->factor, K, &ratio);
    if (ratio < SMALL_PIVOT) {
        report->end = NMM_SOLVE_INDEFINITE;
        report->row = row;
    }
}

static nmm_status run(nmm_context *context, nmm_solver *s, const nmm_bsr *K, const double *u,
                      double *norm, nmm_solve_report *report) {
    nmm_direct *d = s->direct;
    d->fresh = false;
    *norm = nmm_solver_first_norm(s, u, true_norm);
    if (*norm <= s->limit) return NMM_OK;
    if (old_factor_pays(d, s)) {
        TRY(nmm_factor_reserve(context, &d->factor, s->n_thread));
        try_old_factor(d, s, u, norm, report);
        if (*norm <= s->limit) return NMM_OK;
    }
    TRY(factorise(context, d, s, K, report));
    if (d->fresh) refine(d, s, K, u, norm, report);
    return NMM_OK;
}

// Is the work worth several threads? Then the faster way of late is taken, as bits are the same.
static bool several_threads(const nmm_solver *s, const nmm_bsr *K) {
    double analysis = 0;
    return s->n_thread > 1 && nmm_direct_work(s, K, &analysis) >= LEAST_SHARED;
}

nmm_status nmm_direct_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report) {
    TRY(create(context, &solver->direct));
    nmm_direct *d = solver->direct;
    const bool several = several_threads(solver, K);
    if (!several || !nmm_pace_shares(&d->pace)) nmm_solver_use_threads(solver, 1);
    const double began = nmm_clock();
    bool ready = false;
    TRY(nmm_solver_start(context, solver, K, f, u, report, &ready));
    if (!ready) return NMM_OK;
    d->analysed = false;
    double norm = 0;
    TRY(run(context, solver, K, u, &norm, report));
    // What was measured with all of K has shown that its numbers are finite.
    const bool measured = report->setups + report->iterations > 0;
    if ((report->end != NMM_SOLVE_CONVERGED || !measured) &&
        !nmm_solver_check_numbers(solver, K, report)) {
        return NMM_OK;
    }
    nmm_solver_finish(solver, norm, u, report);
    // The analysis is for one thread in any case.
    if (several && !d->analysed && measured) {
        const double work =
            report->setups * d->factor_cost / d->iteration_cost + report->iterations;
        nmm_pace_note(&d->pace, solver->n_thread > 1, (int)work, nmm_clock() - began);
    }
    return NMM_OK;
}
