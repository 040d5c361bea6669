// SPDX-License-Identifier: MIT
//
// Inside of the solve floor: systems with a coupling, (K + sum of push pull^T) u = f, as friction
// leaves them. Minimal residuals (GMRES) with one symmetric Gauss-Seidel sweep as preconditioner,
// or with the factor of K, or of that of an earlier pass of the step, where that costs less.
// Serial: few iterations of a small price, the same bits for any number of threads.

#ifndef NMM_GAUSS_H
#define NMM_GAUSS_H

#include "lumps.h"
#include "solver.h"

/// Most directions that are kept, and so iterations of a solve.
enum { NMM_GAUSS_MOST = 30 };

/// The preconditioners.
enum {
    NMM_GAUSS_SWEEPS,
    NMM_GAUSS_FACTOR, // made anew
    NMM_GAUSS_KEPT,   // the factor as it is
    NMM_GAUSS_KINDS
};

/// What sweeps need beside the matrix, and what is learned of them.
typedef struct nmm_gauss {
    int lump;                  // rows whose diagonal block is inverted as a whole: 1 or 3
    nmm_lumps lumps;           // for 3
    long pattern;              // of which the lumps are, as the solver counts
    double largest;            // force of the residual at hand, by which those of lumps are divided
    const int *diagonal;       // [n_row] of the matrix at hand
    double *basis;             // [NMM_GAUSS_MOST + 1][n_row][2]; lumps have float32 in all these
    double *t, *ahead, *extra; // [n_row][2]
    int capacity;              // rows there is room for
    int pause, next_pause;     // solves left out: still to come, and after the next failure
    nmm_factor factor;
    bool made;                    // the factor has numbers
    int n_thread;                 // that make it
    double rate[NMM_GAUSS_KINDS]; // orders of magnitude that an iteration gains
    int solves;                   // since rates were last forgotten
    int n_kept;                   // with the pattern at hand
    double work;                  // [ns] counted, of the solve at hand
} nmm_gauss;

void nmm_gauss_destroy(nmm_context *context, struct nmm_gauss **gauss);

/// Solves with options->coupling where that promises to pay. report->coupled: it did, the report is
/// complete; else u is as it was, and the system without its coupling is to be solved.
nmm_status nmm_gauss_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                           const double *f, double *u, bool keep_pattern,
                           const nmm_solve_options *options, nmm_solve_report *report);

#endif
