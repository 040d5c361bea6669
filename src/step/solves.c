// SPDX-License-Identifier: MIT
//
// What a run has and tells of its linear solves: room for those of part of the rows; how many there
// were, by which method and with which blocks, and in words how one ended.

#include "step.h"

void nmm_solves_count(nmm_summary *summary, const nmm_solve_report *report) {
    summary->solves += 1;
    summary->iterations += report->iterations;
    summary->failed += report->end != NMM_SOLVE_CONVERGED;
    const bool direct = report->method == NMM_SOLVE_DIRECT;
    summary->with_direct += direct;
    summary->with_cover += !direct && report->blocks == NMM_BLOCKS_COVER;
    summary->with_cluster += report->blocks == NMM_BLOCKS_CLUSTER;
    summary->with_body += report->blocks == NMM_BLOCKS_BODY;
    summary->setups += report->setups;
    summary->transfers += report->transfers;
    summary->transfer_bytes += report->transfer_bytes;
    summary->transfer_seconds += report->transfer_seconds;
    summary->on_device |= report->on_device;
}

const char *nmm_solves_end(nmm_solve_end end) {
    switch (end) {
    case NMM_SOLVE_CONVERGED:
        return "converged";
    case NMM_SOLVE_DIVERGED:
        return "diverged";
    case NMM_SOLVE_TOO_SLOW:
        return "did not converge within its iterations";
    case NMM_SOLVE_INDEFINITE:
        return "met a matrix that is not positive definite";
    case NMM_SOLVE_NOT_FINITE:
        return "met a number that is not finite";
    case NMM_SOLVE_STAGNATED:
        return "stagnated above its tolerance";
    case NMM_SOLVE_BAD_PATTERN:
        return "met a wrong pattern";
    }
    return "failed";
}

// Other methods and devices, which are asked for by name, are asked for all rows.
nmm_status nmm_solves_open_nearby(nmm_sim *sim) {
    const bool chosen = nmm_step_method(sim) == NMM_SOLVE_AUTO && sim->backend == nmm_solve_host();
    const bool large = sim->system.K.n_row >= NMM_NEAR_ROWS && sim->state.n_contact > 0;
    if (!chosen || !large || sim->nearby.model != NULL) return NMM_OK;
    return nmm_nearby_open(&sim->context, &sim->nearby, &sim->model);
}
