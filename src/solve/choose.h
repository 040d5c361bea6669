// SPDX-License-Identifier: MIT
//
// Automatic choice of the diagonal blocks: from small to large while small ones are slow.

#ifndef NMM_CHOOSE_H
#define NMM_CHOOSE_H

#include "solver.h"

/// Are the blocks left to choose?
static inline bool nmm_solver_chooses(const nmm_solve_options *options) {
    const bool pcg = options->method == NMM_SOLVE_AUTO || options->method == NMM_SOLVE_PCG;
    return pcg && options->blocks == NMM_BLOCKS_AUTO;
}

/// Conjugate gradients with the blocks that promise the least work by what earlier solves have
/// shown; where they have shown nothing, small blocks first, and larger ones once the work done
/// would have paid for them. Deterministic: counts work, never looks at a clock.
nmm_status nmm_choose_blocks(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                             const double *f, double *u, bool keep_pattern,
                             const nmm_solve_options *options, nmm_solve_report *report);

/// The `solve` of both backends: the checks of options and sizes, the choice where there is one to
/// make, and the backend's own `run`.
nmm_status nmm_solver_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, bool keep_pattern,
                            const nmm_solve_options *options, nmm_solve_report *report);

#endif
