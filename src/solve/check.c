// SPDX-License-Identifier: MIT
//
// What is asked of a caller: options within their ranges, sizes that fit, hints that name places
// and bodies, and a pattern that is one of a symmetric block matrix. What is wrong ends with a
// message or the row it is in, before anything is computed.

#include "solver.h"

#include <math.h>
#include <string.h>

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
    if (!((int)o->blocks >= NMM_BLOCKS_AUTO && o->blocks <= NMM_BLOCKS_BODY) ||
        !((int)o->precision >= NMM_PRECISION_DOUBLE && o->precision <= NMM_PRECISION_AUTO)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "solver blocks %d, precision %d: unknown",
                        (int)o->blocks, (int)o->precision);
    }
    if (o->max_iterations < 0 || o->n_thread < 0) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT, "%d solver iterations on %d threads",
                        o->max_iterations, o->n_thread);
    }
    return NMM_OK;
}

// Beyond this a place is not one, and squares of distances might overflow.
#define FARTHEST 1e100

// All of them, in loops that never branch.
static bool hints_are_good(int n_row, const nmm_solve_options *o) {
    long far = 0;
    int wrong = 0;
    for (long i = 0; i < 2 * (long)n_row; i++)
        far += !(fabs(o->place[i]) <= FARTHEST);
    for (int row = 0; row < n_row; row++)
        wrong |= (o->body[row] < -1) | (o->body[row] >= n_row);
    return far == 0 && wrong == 0;
}

// Which one is not, if any.
static nmm_status check_hints(nmm_context *context, int n_row, const nmm_solve_options *o) {
    if (o->place == NULL || o->body == NULL || hints_are_good(n_row, o)) return NMM_OK;
    for (int row = 0; row < n_row; row++) {
        const double x = o->place[2 * (long)row], y = o->place[2 * (long)row + 1];
        if (!(fabs(x) <= FARTHEST && fabs(y) <= FARTHEST)) {
            return nmm_fail(context, NMM_ERROR_ARGUMENT, "place of row %d is (%g, %g)", row, x, y);
        }
        if (o->body[row] < -1 || o->body[row] >= n_row) {
            return nmm_fail(context, NMM_ERROR_ARGUMENT,
                            "body of row %d is %d, which is not within -1 .. %d", row, o->body[row],
                            n_row - 1);
        }
    }
    return NMM_OK;
}

nmm_status nmm_solver_check(nmm_context *context, const nmm_solver *solver, const nmm_bsr *K,
                            const nmm_solve_options *options) {
    TRY(check_options(context, options));
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    if (K->n_row < 0 || K->n_row > solver->max_row || n_block > solver->max_block) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "a system of %d rows and %d blocks in a solver opened for %d and %d",
                        K->n_row, n_block, solver->max_row, solver->max_block);
    }
    return check_hints(context, K->n_row, options);
}

// --- Pattern

bool nmm_solver_keeps(const nmm_solver *solver, const nmm_bsr *K, bool keep_pattern) {
    const int n_block = K->n_row > 0 ? K->row_start[K->n_row] : 0;
    return keep_pattern && solver->n_row == K->n_row && solver->n_block == n_block;
}

// Row with a block whose mirror image is not there; -1: none. Rows come in order, so the block that
// each one asks of another is the next one there.
static int one_sided_row(const nmm_bsr *K, int *next) {
    memcpy(next, K->row_start, (size_t)K->n_row * sizeof(int));
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
            const int other = K->col[k];
            if (next[other] == K->row_start[other + 1] || K->col[next[other]++] != row) return row;
        }
    }
    return -1;
}

int nmm_solver_bad_row(const nmm_bsr *K, int n_block, int *next) {
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
    return one_sided_row(K, next);
}
