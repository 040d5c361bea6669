// SPDX-License-Identifier: MIT
//
// Successive over-relaxation and Gauss-Seidel, the serial references. Point form, as in the paper:
// the unknowns are visited one by one, 2 * row then 2 * row + 1, and each uses the newest values of
// all the others, eq. (6.5). The true residual is measured every few sweeps.

#include "solver.h"

#include <math.h>

#define SWEEPS_PER_CHECK 8

// Sweeps between two looks at whether anything is gained, and looks in a row that see no change.
#define SWEEPS_PER_LOOK 32
#define IDLE_LOOKS 6

// Change of the residual, as a part of it, that is no change.
#define STILL 1e-12

// A residual that has grown by this factor has no way back.
#define BEYOND_ALL_BOUNDS 1e10

// One sweep; the sums of |change of u| and |u|.
static void sweep(const nmm_solver *s, double factor, double sum[2]) {
    sum[0] = sum[1] = 0;
    for (int row = 0; row < s->n_row; row++) {
        double *u = s->wide.u + 2 * (long)row;
        double r0 = s->wide.f[2 * (long)row], r1 = s->wide.f[2 * (long)row + 1];
        const double *diagonal = s->wide.value + 4 * (long)s->row_start[row];
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const double *v = s->wide.value + 4 * (long)k, *x = s->wide.u + 2 * (long)s->col[k];
            if (s->col[k] == row) diagonal = v;
            r0 -= v[0] * x[0] + v[1] * x[1];
            r1 -= v[2] * x[0] + v[3] * x[1];
        }
        const double change0 = factor * r0 / diagonal[0];
        u[0] += change0;
        // The second unknown of the row sees the new first one.
        const double change1 = factor * (r1 - diagonal[2] * change0) / diagonal[3];
        u[1] += change1;
        sum[0] += fabs(change0) + fabs(change1);
        sum[1] += fabs(u[0]) + fabs(u[1]);
    }
}

static double true_norm(const nmm_solver *s) {
    double sum = 0;
    for (int row = 0; row < s->n_row; row++) {
        double r0 = s->wide.f[2 * (long)row], r1 = s->wide.f[2 * (long)row + 1];
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const double *v = s->wide.value + 4 * (long)k, *x = s->wide.u + 2 * (long)s->col[k];
            r0 -= v[0] * x[0] + v[1] * x[1];
            r1 -= v[2] * x[0] + v[3] * x[1];
        }
        sum += r0 * r0 + r1 * r1;
    }
    return sqrt(sum);
}

// What a run gains, looked at every few sweeps.
typedef struct progress {
    double mark, lowest; // residual at the last look, smallest so far
    int n_idle, n_still; // looks in a row that saw no new lowest, and no change
} progress;

// Rounding has the last word, or what is left cannot be solved for.
static bool stagnates(const nmm_solver *s, progress *run, int iterations, double norm) {
    if (iterations % SWEEPS_PER_LOOK != 0) return false;
    run->n_still = fabs(norm - run->mark) <= STILL * norm ? run->n_still + 1 : 0;
    run->n_idle = norm < run->lowest ? 0 : run->n_idle + 1;
    run->lowest = nmm_min(norm, run->lowest);
    run->mark = norm;
    if (run->n_still == IDLE_LOOKS) return true;
    if (run->n_idle < IDLE_LOOKS) return false;
    run->n_idle = 0;
    return nmm_solver_rounds(s, norm);
}

double nmm_sor_run(nmm_solver *solver, const double *u, nmm_solve_report *report) {
    const nmm_solve_options *o = &solver->options;
    double norm = nmm_solver_first_norm(solver, u, true_norm);
    progress run = {.mark = norm, .lowest = norm};
    while (!(norm <= solver->limit)) {
        const int n = nmm_min_int(SWEEPS_PER_CHECK, o->max_iterations - report->iterations);
        if (n == 0) report->end = NMM_SOLVE_TOO_SLOW;
        if (!(norm <= BEYOND_ALL_BOUNDS * solver->norm)) report->end = NMM_SOLVE_DIVERGED;
        if (report->end != NMM_SOLVE_CONVERGED) break;
        double sum[2] = {0};
        for (int k = 0; k < n; k++)
            sweep(solver, o->sor_factor, sum);
        report->iterations += n;
        norm = true_norm(solver);
        report->by_average_change =
            norm > solver->limit && o->stop_average_change && sum[0] <= o->tolerance * sum[1];
        if (report->by_average_change) break;
        if (norm > solver->limit && stagnates(solver, &run, report->iterations, norm)) {
            report->end = NMM_SOLVE_STAGNATED;
        }
    }
    return norm;
}
