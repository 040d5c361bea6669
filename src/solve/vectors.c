// SPDX-License-Identifier: MIT
//
// What comes in and goes out: right-hand side, first guess and solution, scaled by a power of two,
// which rounds nothing, and in the order of the iteration. Whether all numbers are finite is told
// by sums of 0 * x, which never branch.

#include "solver.h"
#include "team.h"

#include <math.h>

// Sums that are made side by side; numbers that a thread looks through at a time.
#define LANES 4
#define PIECE 4096

// Are all of scale * x finite? Several sums at a time, so that none waits for another.
static bool all_finite(int n, const double *x, double scale) {
    double zero[LANES] = {0};
    int i = 0;
    for (; i + LANES <= n; i += LANES)
        for (int k = 0; k < LANES; k++)
            zero[k] += 0 * (scale * x[i + k]);
    for (; i < n; i++)
        zero[0] += 0 * (scale * x[i]);
    return zero[0] + zero[1] + zero[2] + zero[3] == 0;
}

static double largest_of(int n, const double *x) {
    double most[LANES] = {0};
    int i = 0;
    for (; i + LANES <= n; i += LANES)
        for (int k = 0; k < LANES; k++)
            most[k] = nmm_max(most[k], fabs(x[i + k]));
    for (; i < n; i++)
        most[0] = nmm_max(most[0], fabs(x[i]));
    return nmm_max(nmm_max(most[0], most[1]), nmm_max(most[2], most[3]));
}

// Are all of scale * x finite? *largest: of |x|, unless it is NULL.
static bool look_through(int n, const double *x, double scale, int n_thread, double *largest) {
    if (n_thread == 1 || n <= NMM_MANY_NUMBERS) {
        if (largest != NULL) *largest = largest_of(n, x);
        return all_finite(n, x, scale);
    }
    const int n_piece = (n + PIECE - 1) / PIECE;
    int wrong = 0;
    double most = 0;
#pragma omp parallel for num_threads(n_thread) schedule(static) reduction(+ : wrong)               \
    reduction(max : most)
    for (int k = 0; k < n_piece; k++) {
        const int first = k * PIECE, size = nmm_min_int(PIECE, n - first);
        wrong += !all_finite(size, x + first, scale);
        if (largest != NULL) most = nmm_max(most, largest_of(size, x + first));
    }
    if (largest != NULL) *largest = most;
    return wrong == 0;
}

static int first_row_not_finite(int n, const double *x) {
    for (int i = 0; i < n; i++)
        if (0 * x[i] != 0) return i / 2;
    return -1;
}

// The caller's vector into one of the iteration; padding becomes 0.
static void bring_in(const nmm_solver *s, double scale, const double *from, double *to) {
    if (s->blocks < NMM_BLOCKS_CLUSTER) {
        NMM_SHARED_LOOP(2 * s->n, s->n_thread, to[i] = scale * from[i]);
        return;
    }
    for (int at = 0; at < s->n; at++) {
        const int row = nmm_solver_row(s, at);
        to[2 * at] = row < 0 ? 0 : scale * from[2 * row];
        to[2 * at + 1] = row < 0 ? 0 : scale * from[2 * row + 1];
    }
}

int nmm_solver_take_force(nmm_solver *solver, const double *f) {
    const int n = 2 * solver->n_row;
    double largest = 0;
    if (!look_through(n, f, 1, solver->n_thread, &largest)) return first_row_not_finite(n, f);
    frexp(largest, &solver->exponent);
    // Kept where 2^exponent and its inverse are ordinary numbers.
    solver->exponent = nmm_max_int(-1000, nmm_min_int(solver->exponent, 1000));
    const double scale = ldexp(1, -solver->exponent);
    bring_in(solver, scale, f, solver->wide.f);
    solver->norm = sqrt(nmm_sum_product(2 * solver->n, solver->wide.f, solver->wide.f, 1));
    solver->limit =
        nmm_max(solver->options.tolerance * solver->norm, scale * solver->options.absolute);
    return -1;
}

void nmm_solver_load_guess(nmm_solver *solver, const double *u) {
    bring_in(solver, ldexp(1, -solver->exponent), u, solver->wide.u);
}

bool nmm_solver_write_back(const nmm_solver *solver, double *u) {
    const double scale = ldexp(1, solver->exponent), *x = solver->wide.u;
    const int n_thread = solver->n_thread;
    if (!look_through(2 * solver->n, x, scale, n_thread, NULL)) return false;
    if (solver->blocks < NMM_BLOCKS_CLUSTER) {
        NMM_SHARED_LOOP(2 * solver->n, n_thread, u[i] = scale * x[i]);
        return true;
    }
    for (int at = 0; at < solver->n; at++) {
        const int row = nmm_solver_row(solver, at);
        if (row < 0) continue;
        u[2 * row] = scale * x[2 * at];
        u[2 * row + 1] = scale * x[2 * at + 1];
    }
    return true;
}
