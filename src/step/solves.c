// SPDX-License-Identifier: MIT
//
// What a run has and tells of its linear solves: room for those of part of the rows; how many there
// were, by which method and with which blocks, and in words how one ended.

#include "step.h"

#include <stdio.h>
#include <string.h>

// By which method, with which blocks. Minimal residuals are a kind of their own, whatever they take
// for a preconditioner.
static void count_kind(nmm_summary *summary, const nmm_solve_report *report) {
    if (report->coupled) {
        summary->with_friction += 1;
        return;
    }
    const bool direct = report->method == NMM_SOLVE_DIRECT;
    summary->with_direct += direct;
    summary->with_cover += !direct && report->blocks == NMM_BLOCKS_COVER;
    summary->with_cluster += report->blocks == NMM_BLOCKS_CLUSTER;
    summary->with_body += report->blocks == NMM_BLOCKS_BODY;
}

// In which precision it ended.
static void count_precision(nmm_summary *summary, const nmm_solve_report *report) {
    const bool mixed = report->precision == NMM_PRECISION_MIXED;
    summary->with_mixed += mixed;
    summary->fell_back += report->fell_back;
    if (mixed) snprintf(summary->precision, sizeof summary->precision, "mixed");
    if (report->fell_back) {
        snprintf(summary->fall_back, sizeof summary->fall_back, "%s", report->why);
    }
}

// What auto says most often; of sentences beyond the room for them nothing is kept.
static void count_reason(nmm_sim *sim, const char *why) {
    const int room = (int)(sizeof sim->reason / sizeof *sim->reason);
    int k = 0;
    while (k < room && sim->reason[k].text != NULL && strcmp(sim->reason[k].text, why) != 0)
        k++;
    if (k == room) return;
    sim->reason[k].text = why;
    sim->reason[k].solves += 1;
    if (sim->reason[k].solves <= sim->summary.why_solves) return;
    sim->summary.why_solves = sim->reason[k].solves;
    snprintf(sim->summary.why, sizeof sim->summary.why, "%s", why);
}

void nmm_solves_count(nmm_sim *sim, const nmm_solve_report *report) {
    nmm_summary *summary = &sim->summary;
    summary->solves += 1;
    summary->iterations += report->iterations;
    summary->failed += report->end != NMM_SOLVE_CONVERGED;
    summary->by_average_change += report->by_average_change;
    count_kind(summary, report);
    count_precision(summary, report);
    if (report->why[0] != '\0' && !report->fell_back) count_reason(sim, report->why);
    summary->solve_threads = nmm_max_int(summary->solve_threads, report->n_thread);
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
    case NMM_SOLVE_OUT_OF_RANGE:
        return "found displacements beyond the range of numbers";
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
