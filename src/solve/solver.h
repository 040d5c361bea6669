// SPDX-License-Identifier: MIT
//
// Inside of the solve floor: the solver object, shared by the host backend, the target backend and
// the serial methods, and the steps before and after the iteration, which are the same for all:
// check the system, scale it, invert its diagonal blocks; judge the result, write it back.
//
// The iteration works in groups of 8 block rows. With 2x2 blocks a group is 8 rows in the caller's
// order, and the matrix is read where it lies. With clusters a group is a cluster: rows are copied
// in a new order, and groups that have fewer than 8 are filled with empty rows.

#ifndef NMM_SOLVER_H
#define NMM_SOLVER_H

#include "clusters.h"
#include "coarse.h"
#include "factor.h"
#include "newer.h"
#include "pace.h"
#include "solve.h"

/// Groups whose terms are added up one after the other. A sum is made over the rows of each group,
/// then over the groups of each chunk, then over the chunks, always in order: one order of
/// additions for any number of threads and any device.
#define NMM_SOLVE_CHUNK 64

/// A first guess may be worse than u = 0 by this factor, which is rounding, and is taken all the
/// same.
#define NMM_GUESS_MARGIN (1 + 1e-12)

/// Steps of the Lanczos process that estimates the spectrum of D^-1 K.
#define NMM_LANCZOS 32

/// Iterations from one look of the host at the scalars to the next.
#define NMM_BATCH 8

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
    int directed;  // sweeps keep their direction for the next one
    double limit;  // value of r . r at which to stop
    double unit;   // factor on the start of the Lanczos process
    double sum[2]; // last sums
    double rho, alpha, beta;
    double history[NMM_LANCZOS][2]; // alpha and beta of the first iterations
    double weight[NMM_BATCH][2];    // of the sweeps of a batch: old direction, D^-1 r
} nmm_iteration;

/// What an iteration in float64 works on; rows in the order of the iteration, m rows.
typedef struct nmm_wide {
    double *value;     // [blocks][2][2]
    double *inverse;   // [m][2][2] D^-1
    double *f, *u, *r; // [m][2]
    double *p, *q, *z; // [m][2] search direction, K p, D^-1 r; q: second iterate of sweeps
} nmm_wide;

/// The same in float32, for a correction: its f is a residual.
typedef struct nmm_narrow {
    float *value;
    float *inverse;
    float *f, *u, *r;
    float *p, *q, *z;
} nmm_narrow;

/// What automatic choice has learned of this run (choose.c).
typedef struct nmm_experience {
    double rate[NMM_BLOCKS_BODY +
                1]; // by nmm_solve_blocks: orders of magnitude an iteration gains; 0: not known
    bool wide_only; // float32 did not reach a tolerance since
    int solves;     // since they were last forgotten
    int n_kept;     // with the pattern at hand
    int undirected; // in a row that needed no factor
    double life;    // the same with patterns before, on average of late; 0: not known
} nmm_experience;

/// What went to the device and came back.
typedef struct nmm_traffic {
    long transfers;
    double bytes, seconds;
} nmm_traffic;

typedef struct nmm_variant nmm_variant;
struct nmm_gauss;

/// A whole solve with the blocks and limits in `options`: the backend's own.
typedef nmm_status nmm_solve_run(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                                 const double *f, double *u, bool keep_pattern,
                                 const nmm_solve_options *options, nmm_solve_report *report);

/// Rows 0 .. n_row - 1 of the caller; 0 .. n - 1 in the iteration. D: the diagonal blocks of K that
/// are inverted. Right-hand side and unknowns are scaled by a power of two, so that max |f| is
/// 0.5 .. 1.
struct nmm_solver {
    int max_row, max_block;
    int max_n; // rows of the iteration there is room for, padding included
    int n_row, n_block, n_thread;
    long pattern;       // counts those solved for, from 1
    nmm_solve_run *run; // set by the backend that opened it
    const nmm_variant *variant;
    struct nmm_barrier *barrier; // of the host's threads
    nmm_traffic *traffic;        // of this solve
    // The matrix of the iteration: the caller's, or copies.
    int *row_start; // [n + 1]
    int *col;       // [n_block]
    nmm_wide wide;
    nmm_narrow narrow; // NULL until a solve in mixed precision
    int *next;         // [max_row] scratch of the check of a pattern
    double *part;      // [groups][2] terms of two sums
    double *chunk;     // [chunks][2] their sums
    nmm_iteration *state;
    int *own_row_start, *own_col; // copies
    double *own_value;
    unsigned char *newer_row; // staged: [max_n] marks of rows that are to be sent
    // Clusters and coarse correction: found for the pattern, made from the values.
    nmm_clusters clusters;
    float *dense;        // [groups][16][16] inverted clusters over dense_scale; NULL: 2x2 blocks
    double *dense_scale; // [groups]
    float *dense_room;   // what `dense` points to while clusters are in use
    nmm_coarse coarse;
    struct nmm_gauss *gauss;   // of systems with a coupling, NULL before the first
    struct nmm_direct *direct; // the factor of the direct method, NULL before its first solve
    nmm_experience experience;
    nmm_pace pace[NMM_BLOCKS_BODY + 1]; // host: by kind of blocks
    double lambda[2];                   // bounds of the spectrum that sweeps used last; 0: none
    nmm_solve_blocks lambda_blocks;
    nmm_solve_blocks blocks; // those of this solve, never auto
    const char *why_blocks;  // they are not those asked for; else ""
    int n;                   // rows of the iteration
    int team_rows;           // target: up to so many rows one team does it all
    // What the caller asked for, in the scaled system.
    nmm_solve_options options; // every 0 replaced by what it stands for
    double norm;               // |f|
    double limit;              // |r| must not be larger
    double least;              // the limit, where the range of numbers sets it; else 0
    double guess_norm;         // |r| of the first guess taken
    int exponent;              // f = 2^exponent * scaled f
    bool guess_dropped;        // u = 0 is used instead of the caller's guess
    bool staged;               // the matrix is copied in any case; else only where it is reordered
    bool without_inverses;     // nmm_solver_start leaves out those of the 2x2 blocks
    bool pattern_kept;         // row_start and col hold what they held in the last solve
    bool clusters_found, parts_found;
    bool dense_made, coarse_made;     // there are values to reuse
    bool dense_mapped, narrow_mapped; // target: known on the device
};

/// Groups of 8 rows.
static inline int nmm_groups_of(int n) {
    return (n + NMM_GROUP - 1) / NMM_GROUP;
}

/// Allocate. `staged`: with own copies of the matrix.
nmm_status nmm_solver_create(nmm_context *context, nmm_solver **solver, int max_row, int max_block,
                             bool staged);
void nmm_solver_destroy(nmm_context *context, nmm_solver **solver);

/// Arrays that only some solves need, allocated at the first of them.
nmm_status nmm_solver_own_matrix(nmm_context *context, nmm_solver *solver);
nmm_status nmm_solver_own_narrow(nmm_context *context, nmm_solver *solver);
nmm_status nmm_solver_own_dense(nmm_context *context, nmm_solver *solver);

/// Are options and sizes in range?
nmm_status nmm_solver_check(nmm_context *context, const nmm_solver *solver, const nmm_bsr *K,
                            const nmm_solve_options *options);

/// Is the pattern the one last solved for? The caller says so in `keep_pattern`, by mistake maybe
/// of a system of another size.
bool nmm_solver_keeps(const nmm_solver *solver, const nmm_bsr *K, bool keep_pattern);

/// Row whose columns are not ascending within the matrix, or whose diagonal is elsewhere, or which
/// has a block on one side only; -1: none. `next`: scratch for all rows.
int nmm_solver_bad_row(const nmm_bsr *K, int n_block, int *next);

/// For checked options: complete them, choose nothing.
/// Allocates what they need. `keep_pattern`: what was taken over last still holds.
nmm_status nmm_solver_prepare(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                              bool keep_pattern, const nmm_solve_options *options);

/// Threads of this solve, and the variant that goes with them.
void nmm_solver_use_threads(nmm_solver *solver, int n_thread);

/// Check pattern, numbers and diagonal blocks; scale f, take the matrix over, invert the blocks.
/// *ready is false when there is nothing to iterate: trouble found (u is untouched) or f = 0 (u
/// becomes 0); the report is complete.
nmm_status nmm_solver_start(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report, bool *ready);

/// Are all numbers of the matrix finite? Else the report says which row is not. For a method that
/// nmm_solver_start did not look at all of them for, the direct one, when it ends badly. Also
/// inverts the blocks.
bool nmm_solver_check_numbers(nmm_solver *solver, const nmm_bsr *K, nmm_solve_report *report);

/// f into solver->wide.f, scaled; its norm and the limit of the residual. Row of a number that is
/// not finite, -1: none.
int nmm_solver_take_force(nmm_solver *solver, const double *f);

/// The caller's u, scaled and in the order of the iteration, into solver->wide.u.
void nmm_solver_load_guess(nmm_solver *solver, const double *u);

/// solver->wide.u into the caller's u; false: beyond the range of numbers, u is untouched.
bool nmm_solver_write_back(const nmm_solver *solver, double *u);

/// Take the first guess, or zero where that is better; its residual norm. For the serial methods,
/// each with its own order of sums.
double nmm_solver_first_norm(nmm_solver *solver, const double *u,
                             double (*true_norm)(const nmm_solver *));

/// Is this residual norm no more than what rounding may leave of the terms of f - K u?
bool nmm_solver_rounds(const nmm_solver *solver, double norm);

/// Residual norm that displacements next to zero, which are multiples of 4.9e-324, may leave; 0
/// where it is below the limit in any case.
double nmm_solver_least_norm(const nmm_solver *solver, const nmm_bsr *K);

/// Row of the caller for a row of the iteration; -1: padding.
static inline int nmm_solver_row(const nmm_solver *solver, int row) {
    return solver->blocks >= NMM_BLOCKS_CLUSTER ? solver->clusters.order[row] : row;
}

/// Write the result in solver->wide.u, whose true residual norm is `norm`, back into u, or leave
/// the first guess there when that is better and the solve failed. Completes the report.
void nmm_solver_finish(nmm_solver *solver, double norm, double *u, nmm_solve_report *report);

/// Smallest and largest eigenvalue of D^-1 K as seen by `n` Lanczos steps, from alpha and beta of
/// conjugate gradients: eq. (6.9).
void nmm_lanczos_bounds(int n, double history[][2], double bounds[2]);

/// The serial methods, from the first guess u. The result is in solver->wide.u; returns its true
/// residual norm.
double nmm_sor_run(nmm_solver *solver, const double *u, nmm_solve_report *report);

/// Invert the diagonal block of each group: dense[g] * scale[g], symmetric [16][16], zero for empty
/// places. A block whose inverse float32 could not hold is stiffened first, one that is not
/// positive definite is replaced by its 2x2 diagonal blocks. scale[g] = 0: rows differ too much in
/// scale. `keep`: those whose diagonal is within a few per cent of what it was stay as they are.
/// The number of blocks made.
typedef int nmm_invert(nmm_clusters *clusters, const int *row_start, const int *col,
                       const double *value, int n_thread, bool keep, float *dense, double *scale);

/// Project the matrix on the motions of the parts and factorise it.
typedef void nmm_make_coarse(nmm_coarse *coarse, const nmm_coarse_source *source);

/// y = K x, both [n][2].
typedef void nmm_multiply(const nmm_solver *solver, const double *x, double *y);

/// The kernels of gauss.inl.
typedef void nmm_gauss_backward(const nmm_solver *solver, const struct nmm_gauss *gauss,
                                const double *v, double *t);
typedef void nmm_gauss_forward(const nmm_solver *solver, const struct nmm_gauss *gauss,
                               const double *v, const double *t, const double *extra, double *ahead,
                               double *y);
typedef void nmm_gauss_couple(const nmm_coupling *coupling, int n_row, const double *x,
                              double *extra);
typedef double nmm_gauss_orthogonalise(const double *basis, int m, int n, double *w, double *part);

/// A prepared solve from the first guess u. The result is in solver->wide.u; returns its true
/// residual norm.
typedef double nmm_jacobi_run(nmm_solver *solver, const double *u, nmm_solve_report *report);

/// What takes time on the host, in the same text, compiled for one thread and for several, for any
/// x86-64 and for those with AVX2. The same bits.
struct nmm_variant {
    nmm_jacobi_run *run;
    nmm_invert *invert;
    nmm_make_coarse *make_coarse;
    nmm_multiply *multiply;
    nmm_gauss_backward *gauss_backward;
    nmm_gauss_forward *gauss_forward;
    nmm_gauss_couple *couple;
    nmm_gauss_orthogonalise *orthogonalise;
};

extern const nmm_variant nmm_variant_serial, nmm_variant_threads;
extern const nmm_variant nmm_variant_serial_avx2, nmm_variant_threads_avx2;

#endif
