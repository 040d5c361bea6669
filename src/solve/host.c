// SPDX-License-Identifier: MIT
//
// The host backend: whole solves, and on how many threads.

#include "choose.h"
#include "direct.h"

static nmm_status run_host(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                           const double *f, double *u, bool keep_pattern,
                           const nmm_solve_options *options, nmm_solve_report *report) {
    TRY(nmm_solver_prepare(context, solver, K, keep_pattern, options));
    if (solver->options.method == NMM_SOLVE_DIRECT) {
        return nmm_direct_solve(context, solver, K, f, u, report);
    }
    nmm_pace *pace = &solver->pace[solver->blocks];
    const bool several = solver->n_thread > 1;
    if (several && !nmm_pace_shares(pace)) nmm_solver_use_threads(solver, 1);
    const double began = nmm_clock();
    bool ready = false;
    TRY(nmm_solver_start(context, solver, K, f, u, report, &ready));
    if (!ready) return NMM_OK;
    const nmm_solve_method method = solver->options.method;
    const bool serial = method == NMM_SOLVE_SOR || method == NMM_SOLVE_GAUSS_SEIDEL;
    const double norm =
        serial ? nmm_sor_run(solver, u, report) : solver->variant->run(solver, u, report);
    nmm_solver_finish(solver, norm, u, report);
    if (several) {
        nmm_pace_note(pace, solver->n_thread > 1, report->iterations, nmm_clock() - began);
    }
    return NMM_OK;
}

static nmm_status open_host(nmm_context *context, nmm_solver **solver, int max_row, int max_block) {
    const nmm_status status = nmm_solver_create(context, solver, max_row, max_block, false);
    if (status != NMM_OK) {
        nmm_solver_destroy(context, solver);
    } else {
        (*solver)->run = run_host;
    }
    return status;
}

const nmm_solve_backend *nmm_solve_host(void) {
    static const nmm_solve_backend host = {
        .name = "host", .open = open_host, .solve = nmm_solver_solve, .close = nmm_solver_destroy};
    return &host;
}
