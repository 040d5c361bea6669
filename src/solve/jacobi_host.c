// SPDX-License-Identifier: MIT
//
// The host backend: the kernel text with ordinary parallel regions. The matrix is read where it
// lies; nothing is sent or fetched. A batch is one parallel region, so that threads start once for
// several iterations; inside it loops are shared by `omp for`, whose barrier separates kernels.
// Not `omp target` without a device: each such region builds and destroys its threads anew.

#include "direct.h"

#include <math.h>
#include <string.h>

#define PARALLEL_FOR _Pragma("omp for schedule(static)")
#define SINGLE _Pragma("omp single")
#define BATCH _Pragma("omp parallel num_threads(s->n_thread)")
#define SEND(p, n) ((void)(n))
#define FETCH(p, n) ((void)(n))
#define ON_DEVICE 0

#include "jacobi_kernels.inl"

static nmm_status open_host(nmm_context *context, nmm_solver **solver, int max_row, int max_block) {
    const nmm_status status = nmm_solver_create(context, solver, max_row, max_block, false);
    if (status != NMM_OK) nmm_solver_destroy(context, solver);
    return status;
}

static nmm_status solve_host(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                             const double *f, double *u, bool keep_pattern,
                             const nmm_solve_options *options, nmm_solve_report *report) {
    TRY(nmm_solver_prepare(context, solver, K, keep_pattern, options));
    if (solver->options.method == NMM_SOLVE_DIRECT)
        return nmm_direct_solve(context, solver, K, f, u, report);
    if (!nmm_solver_start(solver, K, f, u, report)) return NMM_OK;
    const nmm_solve_method method = solver->options.method;
    const bool serial = method == NMM_SOLVE_SOR || method == NMM_SOLVE_GAUSS_SEIDEL;
    const double norm = serial ? nmm_sor_run(solver, u, report) : run_method(solver, u, report);
    nmm_solver_finish(solver, norm, u, report);
    return NMM_OK;
}

const nmm_solve_backend *nmm_solve_host(void) {
    static const nmm_solve_backend host = {
        .name = "host", .open = open_host, .solve = solve_host, .close = nmm_solver_destroy};
    return &host;
}
