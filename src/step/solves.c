// SPDX-License-Identifier: MIT
//
// What a run tells of its linear solves: how many, by which method and with which blocks, and in
// words how one ended.

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
