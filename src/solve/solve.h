// SPDX-License-Identifier: MIT
//
// Linear systems of 2x2 blocks: one interface, several methods, host and target.
// By the residual test a result is only called converged when its true residual |f - K u| was
// measured; a result is never NaN. The same system gives the same bits for any number of threads.
// Method: docs/theory/6-solve.md; offload: docs/offload.md.

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

/// The unsymmetric part of a system, K + sum of push pull^T: a contact that slides adds a term of
/// rank one, because a change of its pressure changes its friction.
typedef struct nmm_coupling {
    int n, n_row;        // terms, block rows of each
    double tolerance;    // like that of the options, where the coupling is taken into account
    int *row;            // [n][n_row]
    double *push, *pull; // [n][n_row][2]
} nmm_coupling;

typedef enum nmm_solve_method {
    NMM_SOLVE_AUTO,   // pcg or direct, see nmm_solve_report.why
    NMM_SOLVE_JACOBI, // block Jacobi, damped
    NMM_SOLVE_PCG,    // conjugate gradients, block Jacobi as preconditioner
    NMM_SOLVE_SOR,    // successive over-relaxation, unknown by unknown (point form); host only
    NMM_SOLVE_GAUSS_SEIDEL, // the same with factor 1; host only
    NMM_SOLVE_CHEBYSHEV,    // block Jacobi with Chebyshev weights: no sums between checks
    NMM_SOLVE_DIRECT        // sparse Cholesky; host only
} nmm_solve_method;

/// The diagonal blocks that jacobi, chebyshev and pcg invert.
typedef enum nmm_solve_blocks {
    NMM_BLOCKS_AUTO,
    NMM_BLOCKS_COVER,   // 2x2, one per block row
    NMM_BLOCKS_CLUSTER, // up to 8 block rows, so that stiff springs fall inside
    NMM_BLOCKS_BODY // clusters, and a coarse correction by rigid motions of parts of bodies; pcg
} nmm_solve_blocks;

typedef enum nmm_solve_precision {
    NMM_PRECISION_DOUBLE,
    NMM_PRECISION_MIXED, // iterations in float32 inside a float64 residual correction
    NMM_PRECISION_AUTO   // mixed where blocks are left to choose and it promises less work
} nmm_solve_precision;

typedef enum nmm_solve_end {
    NMM_SOLVE_CONVERGED = 0,
    NMM_SOLVE_DIVERGED = -1,    // residual grew beyond all bounds, or not a number
    NMM_SOLVE_TOO_SLOW = -2,    // max_iterations passed
    NMM_SOLVE_INDEFINITE = -3,  // a negative curvature or a singular diagonal block: `row` names it
    NMM_SOLVE_NOT_FINITE = -4,  // matrix or right-hand side holds NaN or infinity: `row` names it
    NMM_SOLVE_STAGNATED = -5,   // rounding keeps the true residual above the tolerance
    NMM_SOLVE_BAD_PATTERN = -6, // rows, columns or diagonal not as nmm_bsr asks: `row` names it
    NMM_SOLVE_OUT_OF_RANGE = -7 // found, but a number of it is beyond 1.8e308
} nmm_solve_end;

typedef struct nmm_solve_options {
    nmm_solve_method method;
    nmm_solve_blocks blocks;
    nmm_solve_precision precision;
    // What a coarse correction needs to know of the rows; one NULL: not known, no coarse
    // correction. Read when a pattern is new. Out of range: NMM_ERROR_ARGUMENT, whatever the blocks
    // are.
    const double *place; // [n_row][2] m, within -1e100 .. 1e100: where a row's displacements are
    // [n_row] 0 .. n_row - 1: rows of one body are connected by its elements; -1: a row that has no
    // part in rigid motions
    const int *body;
    // What friction adds to K; NULL: nothing. Taken into account by auto on the host where that
    // pays, see the report; everything else solves the system without it, which is symmetric.
    const nmm_coupling *coupling;
    // What was made from the last system's values (inverted blocks, coarse factor, direct factor,
    // bounds of the spectrum) may serve this one, which differs little. What follows from a kept
    // pattern, and the rates that auto has learned, serve in any case.
    bool reuse;
    double tolerance; // |f - K u| <= tolerance * |f|, or `absolute` where that is larger
    double absolute;  // [N] 0: relative only
    // The paper's test, mean |change of u| in a sweep <= tolerance * mean |u|, instead of the
    // residual. For jacobi, sor and gauss_seidel; pcg has no sweeps and tests the residual.
    bool stop_average_change;
    double jacobi_damping; // 0: 1.9 / estimate of lambda_max of D^-1 K; 1: plain Jacobi
    double sor_factor;     // 0 < factor < 2; 0: 1.9
    int max_iterations;    // 0: chosen from method and size
    int n_thread;          // 0: those of the context; small systems use one in any case
    // A solve that fails leaves its last iterate in u, however bad. For studies of convergence.
    bool keep_last;
} nmm_solve_options;

typedef struct nmm_solve_report {
    nmm_solve_end end;
    nmm_solve_method method; // the one used; auto says which
    nmm_solve_blocks blocks;
    // Never auto; double where float32 could not reach the tolerance.
    nmm_solve_precision precision;
    int n_thread;
    const char *why; // a sentence on what auto chose or mixed fell back to; "" otherwise
    bool coupled;    // the coupling was taken into account, by minimal residuals
    bool fell_back;  // float32 was begun or asked for, and float64 had to go on: `why`
    int setups;      // times blocks or factors were made anew for this solve
    // What auto takes the solve for, all that it tried [ns of one core]: counted, not measured, the
    // same on any machine. 0: it had nothing to choose.
    double work;
    int iterations;
    int row;                // row that caused the trouble, -1: none
    double residual;        // true |f - K u| / |f| of what u holds at the end; -1: not measured
    double lambda_max;      // estimate for D^-1 K, 0: not made
    double lambda_min;      // the same, chebyshev only
    bool by_average_change; // converged by the paper's test, whatever `residual` is
    long transfers;         // copies to and from the device; 0 on the host
    double transfer_bytes, transfer_seconds;
    bool on_device; // observed inside the kernels of this solve
} nmm_solve_report;

typedef struct nmm_solver nmm_solver;

/// Where the iteration runs. `open` owns staging memory until `close`. Systems of up to max_row
/// rows and max_block blocks; more needs close and open.
typedef struct nmm_solve_backend {
    const char *name; // "host", "target"
    /// Target: NMM_ERROR_DEVICE when no device really runs a target region.
    nmm_status (*open)(nmm_context *context, nmm_solver **solver, int max_row, int max_block);
    /// u [n_row][2] holds the first guess and takes the result; a guess worse than u = 0 is not
    /// used. When the solve fails u holds the better of first guess and last iterate.
    /// `keep_pattern`: row_start and col are those of the last call, and need not be sent again.
    /// A solve that fails is no error: see report->end. NMM_ERROR_ARGUMENT: options out of range, a
    /// system larger than opened for, or a serial method asked of the target.
    nmm_status (*solve)(nmm_context *context, nmm_solver *solver, const nmm_bsr *K, const double *f,
                        double *u, bool keep_pattern, const nmm_solve_options *options,
                        nmm_solve_report *report);
    /// NULL inside is accepted; *solver becomes NULL.
    void (*close)(nmm_context *context, nmm_solver **solver);
} nmm_solve_backend;

const nmm_solve_backend *nmm_solve_host(void);
/// NULL in a build without offload.
const nmm_solve_backend *nmm_solve_target(void);
/// Devices that really run a target region (observed inside one); 0 without offload.
int nmm_solve_target_devices(void);

/// auto, tolerance 1e-8, residual test, estimated damping, SOR factor 1.9.
nmm_solve_options nmm_default_solve_options(void);
/// The words of scenes and commands, at the places of their values, ended by NULL.
extern const char *const nmm_solve_method_word[], *const nmm_solve_blocks_word[],
                                                      *const nmm_solve_precision_word[];
/// The same; "unknown" for what is no method, no kind of blocks.
const char *nmm_solve_method_name(nmm_solve_method method);
const char *nmm_solve_blocks_name(nmm_solve_blocks blocks);
/// "converged", "diverged", ... as words for a message.
const char *nmm_solve_end_name(nmm_solve_end end);

#endif
