// SPDX-License-Identifier: MIT
//
// The rows where forces do not balance and those near by, as a system of their own. After the first
// pass of a step few blocks are out of balance, those where contacts changed mode, and what a
// correction does there fades within a few blocks: inertia holds the others. So passes solve for
// these rows alone where they are few, with all others at rest. The balance is always that of all
// rows; a pass that found too few of them is followed by one for all.

#ifndef NMM_NEARBY_H
#define NMM_NEARBY_H

#include "system.h"

typedef struct nmm_nearby {
    const nmm_model *model;    // NULL: not open
    double speed;              // [m/s] of the fastest wave
    int n_row;                 // rows of the part
    int *row;                  // [n_row] of the whole, ascending
    int *place;                // [n_cover] row in the part, -1: none
    int *body;                 // [n_row] of the part, numbered anew
    int *first;                // [n_block] number of a body in the part, -1: none so far
    double *at;                // [n_row][2] m, places of covers
    double *residual, *change; // [n_row][2]
    nmm_bsr K;
    nmm_touched touched; // by a change of these rows
    int capacity;        // blocks of K
    nmm_coupling coupling;
    int coupling_capacity;
    nmm_solver *solver;
    int solver_rows, solver_blocks; // sizes it is open for
} nmm_nearby;

nmm_status nmm_nearby_open(nmm_context *context, nmm_nearby *nearby, const nmm_model *model);
void nmm_nearby_close(nmm_context *context, nmm_nearby *nearby);

/// Chooses the rows: those of the largest residuals, as weighted, so that all others together have
/// no more than `left` [N], and their neighbours, ring by ring, as far as a step of length h
/// reaches. Where these are too many twice as much may be left, and so on up to `most_left`. False:
/// still too many, or none.
bool nmm_nearby_choose(nmm_nearby *nearby, const nmm_system *system, double left, double most_left,
                       double h);

/// Solves for the chosen rows on the host, with the options of the whole; residual and coupling
/// have their weights. Into system->change, 0 elsewhere, and `touched`.
nmm_status nmm_nearby_solve(nmm_context *context, nmm_nearby *nearby, nmm_system *system,
                            const nmm_state *state, const nmm_solve_options *options,
                            nmm_solve_report *report);

#endif
