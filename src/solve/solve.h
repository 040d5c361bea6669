// SPDX-License-Identifier: MIT
//
// Linear systems of 2x2 blocks: one interface, several methods, host and target.
// A result is only ever called converged when its true relative residual was measured.

#ifndef NMM_SOLVE_H
#define NMM_SOLVE_H

#include "base.h"

/// Symmetric block matrix, both halves stored; columns of a row ascending; diagonal present.
typedef struct nmm_bsr {
    int n_row;      // block rows
    int *row_start; // [n_row + 1]
    int *col;       // [row_start[n_row]]
    double *value;  // [row_start[n_row]][2][2]
    int *diagonal;  // [n_row] index of the diagonal block of a row
} nmm_bsr;

typedef enum nmm_solve_method {
    NMM_SOLVE_AUTO,
    NMM_SOLVE_JACOBI,
    NMM_SOLVE_PCG,
    NMM_SOLVE_SOR,
    NMM_SOLVE_GAUSS_SEIDEL
} nmm_solve_method;

typedef enum nmm_solve_end {
    NMM_SOLVE_CONVERGED = 0,
    NMM_SOLVE_DIVERGED = -1,   // residual grew beyond all bounds, or not a number
    NMM_SOLVE_TOO_SLOW = -2,   // max_iterations passed
    NMM_SOLVE_INDEFINITE = -3, // a negative curvature or a singular diagonal block: `row` names it
    NMM_SOLVE_NOT_FINITE = -4, // matrix or right-hand side holds NaN or infinity: `row` names it
} nmm_solve_end;

typedef struct nmm_solve_options {
    nmm_solve_method method;
    double tolerance;         // |f - K u| <= tolerance * |f|, or absolute * 1 where that is larger
    double absolute;          // [N] 0: relative only
    bool stop_average_change; // the paper's test: mean |change of u| of a sweep <= tolerance * mean
                              // |u|
    double jacobi_damping;    // 0: 1 / estimate of lambda_max * 1.9..; 1: plain
    double sor_factor;        // 0 < factor < 2
    int max_iterations;       // 0: chosen from the size
    int n_thread;
} nmm_solve_options;

typedef struct nmm_solve_report {
    nmm_solve_end end;
    nmm_solve_method method; // the one used; auto says which
    int iterations;
    int row;           // row that caused the trouble, -1: none
    double residual;   // true relative residual at the end
    double lambda_max; // estimate for D^-1 K, 0: not made
    bool on_device;    // observed inside a target region
} nmm_solve_report;

typedef struct nmm_solver nmm_solver;

/// Where the iteration runs. `open` owns staging memory until `close`. Systems of up to max_row
/// rows and max_block blocks; more needs close and open.
typedef struct nmm_solve_backend {
    const char *name; // "host", "target"
    nmm_status (*open)(nmm_context *context, nmm_solver **solver, int max_row, int max_block);
    /// u holds the first guess and takes the result (also the best so far when it fails).
    /// `keep_pattern`: row_start and col are those of the last call, and need not be sent again.
    nmm_status (*solve)(nmm_context *context, nmm_solver *solver, const nmm_bsr *K, const double *f,
                        double *u, bool keep_pattern, const nmm_solve_options *options,
                        nmm_solve_report *report);
    void (*close)(nmm_context *context, nmm_solver **solver);
} nmm_solve_backend;

const nmm_solve_backend *nmm_solve_host(void);
/// NULL in a build without offload.
const nmm_solve_backend *nmm_solve_target(void);
/// Devices that really run a target region (observed inside one); 0 without offload.
int nmm_solve_target_devices(void);

#endif
