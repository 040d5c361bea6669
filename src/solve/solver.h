// SPDX-License-Identifier: MIT
//
// Inside of the solve floor: the solver object, shared by the host backend, the target backend and
// the serial methods, and the steps before and after the iteration, which are the same for all:
// check the system, scale it, invert its diagonal blocks; judge the result, write it back.

#ifndef NMM_SOLVER_H
#define NMM_SOLVER_H

#include "solve.h"

/// Rows whose terms are added up one after the other. A sum is made over the rows of each chunk,
/// then over the chunks in order: one order of additions for any number of threads and any device.
/// Smaller than NMM_CHUNK, because on a device each chunk is the work of one thread.
#define NMM_SOLVE_CHUNK 64

/// A first guess may be worse than u = 0 by this factor, which is rounding, and is taken all the
/// same.
#define NMM_GUESS_MARGIN (1 + 1e-12)

/// Steps of the Lanczos process that estimates lambda_max.
#define NMM_LANCZOS 32

/// Why the kernels stopped iterating; kept where they run.
typedef enum nmm_stop {
    NMM_STOP_NONE = 0,
    NMM_STOP_SMALL,     // the residual of the recursion is below the limit
    NMM_STOP_CURVATURE, // p . K p is not positive
    NMM_STOP_BROKEN     // a number that is not finite
} nmm_stop;

/// The scalars of an iteration: they live with the vectors, and are fetched now and then.
typedef struct nmm_iteration {
    int stop; // nmm_stop
    int iterations;
    int on_device; // observed in a kernel
    double limit;  // value of r . r at which to stop
    double sum[2]; // last sums
    double rho, alpha, beta;
    double history[NMM_LANCZOS][2]; // alpha and beta of the first iterations
} nmm_iteration;

/// Rows 0 .. n_row - 1 in use; room for max_row and max_block. D: the diagonal blocks of K.
/// Right-hand side and unknowns are scaled by a power of two, so that max |f| is 0.5 .. 1.
struct nmm_solver {
    int max_row, max_block;
    bool staged; // row_start, col, value are own copies; else those of the caller's matrix
    int n_row, n_block, n_thread;
    bool pattern_kept; // what was sent last still holds
    int *row_start;    // [n_row + 1]
    int *col;          // [n_block]
    double *value;     // [n_block][2][2]
    double *inverse;   // [n_row][2][2] D^-1
    double *f, *u, *r; // [n_row][2]
    double *p, *q;     // [n_row][2] search direction and K p; q: second iterate of jacobi
    double *product;   // [n_row][2] terms of two sums
    double *part;      // [chunks][2] their sums over chunks
    nmm_iteration *state;
    // What the caller asked for, in the scaled system.
    nmm_solve_options options; // every 0 replaced by what it stands for
    int exponent;              // f = 2^exponent * scaled f
    double norm;               // |f|
    double limit;              // |r| must not be larger
    double guess_norm;         // |r| of the first guess taken
    bool guess_dropped;        // u = 0 is used instead of the caller's guess
    struct nmm_direct *direct; // the factor of the direct method, NULL before its first solve
};

/// Allocate. `staged`: with own copies of the matrix.
nmm_status nmm_solver_create(nmm_context *context, nmm_solver **solver, int max_row, int max_block,
                             bool staged);
void nmm_solver_destroy(nmm_context *context, nmm_solver **solver);

/// Look at options and sizes.
/// `keep_pattern`: what was taken over last still holds.
nmm_status nmm_solver_prepare(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                              bool keep_pattern, const nmm_solve_options *options);

/// Check pattern, numbers and diagonal blocks; scale f, invert the blocks. False when there is
/// nothing to iterate: trouble found (u is untouched) or f = 0 (u becomes 0); the report is
/// complete.
bool nmm_solver_start(nmm_solver *solver, const nmm_bsr *K, const double *f, double *u,
                      nmm_solve_report *report);

/// The caller's u, scaled, into solver->u.
void nmm_solver_load_guess(nmm_solver *solver, const double *u);

/// Write the result in solver->u, whose true residual norm is `norm`, back into u, or leave the
/// first guess there when that is better and the solve failed. Completes the report.
void nmm_solver_finish(nmm_solver *solver, double norm, double *u, nmm_solve_report *report);

/// Largest eigenvalue of D^-1 K as seen by `n` Lanczos steps, from alpha and beta of conjugate
/// gradients: eq. (6.9).
double nmm_lanczos_largest(int n, double history[][2]);

/// The serial methods, from the first guess u. The result is in solver->u; returns its true
/// residual norm.
double nmm_sor_run(nmm_solver *solver, const double *u, nmm_solve_report *report);

#endif
