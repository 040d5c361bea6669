// SPDX-License-Identifier: MIT
//
// What experiments measure: steps of a run by phase, and solves of one linear system that a run
// came to.

#include "bench.h"

#include <string.h>

// --- Steps

static bool reached(nmm_bench_limit limit, const nmm_bench_timing *run) {
    return (limit.steps > 0 && run->steps >= limit.steps) ||
           (limit.time > 0 && run->time >= limit.time * (1 - 1e-9)) ||
           (limit.seconds > 0 && run->seconds >= limit.seconds);
}

nmm_status nmm_bench_steps(nmm_bench *bench, nmm_sim *sim, nmm_bench_limit limit,
                           nmm_bench_timing *run) {
    nmm_step_report report = {.end = NMM_END_RUNNING};
    nmm_summary summary;
    *run = (nmm_bench_timing){0};
    while (report.end == NMM_END_RUNNING && !reached(limit, run)) {
        const double start = nmm_clock();
        const nmm_status status = nmm_sim_step(sim, &report);
        run->seconds += nmm_clock() - start;
        if (status != NMM_OK) {
            bench->context.error = *nmm_sim_error(sim);
            return status;
        }
        run->steps = report.step;
        run->time = report.time;
    }
    nmm_sim_summary(sim, &summary);
    const nmm_phases *phase = &summary.phase_seconds;
    run->cuts = summary.dt_cuts;
    run->phase[NMM_PHASE_CONTACT] = phase->contact;
    run->phase[NMM_PHASE_ASSEMBLY] = phase->assemble;
    run->phase[NMM_PHASE_SOLVER] = phase->solve;
    run->phase[NMM_PHASE_REST] = run->seconds - phase->contact - phase->assemble - phase->solve;
    return NMM_OK;
}

// --- A system out of a run

/// Where the hook of the run leaves the system.
typedef struct catcher {
    nmm_bench *bench;
    nmm_bench_system *captured;
} catcher;

static nmm_status copy(nmm_context *context, void *to, const void *from, size_t n, size_t size) {
    TRY(nmm_allocate(context, to, n, size));
    void *block = *(void **)to;
    if (n > 0) memcpy(block, from, n * size);
    return NMM_OK;
}

static nmm_status copy_system(nmm_context *context, const nmm_sim *sim, nmm_linear *s) {
    const nmm_bsr *K = &sim->system.K;
    const size_t n = (size_t)K->n_row, n_block = (size_t)K->row_start[K->n_row];
    s->order = 2 * K->n_row;
    s->entries = 4 * (long)n_block;
    s->K.n_row = K->n_row;
    TRY(copy(context, &s->K.row_start, K->row_start, n + 1, sizeof(int)));
    TRY(copy(context, &s->K.col, K->col, n_block, sizeof(int)));
    TRY(copy(context, &s->K.value, K->value, n_block, 4 * sizeof(double)));
    TRY(copy(context, &s->K.diagonal, K->diagonal, n, sizeof(int)));
    TRY(copy(context, &s->f, sim->system.residual, n, 2 * sizeof(double)));
    TRY(copy(context, &s->guess, sim->system.change, n, 2 * sizeof(double)));
    TRY(copy(context, &s->place, sim->model.cover_place, n, 2 * sizeof(double)));
    TRY(copy(context, &s->body, nmm_system_body(&sim->system, &sim->model), n, sizeof(int)));
    return nmm_allocate(context, &s->u, n, 2 * sizeof(double));
}

// Called before each solve of the run.
static nmm_status catch_system(nmm_sim *sim, const nmm_solve_options *options) {
    const catcher *c = sim->dump.user;
    if (sim->state.step + 1 != sim->dump.step || sim->report.passes + 1 != sim->dump.iteration)
        return NMM_OK;
    nmm_bench_system *captured = c->captured;
    // A later try of the step takes the place of the one before.
    nmm_linear_destroy(&c->bench->context, &captured->system);
    captured->options = *options;
    const nmm_status status = copy_system(&c->bench->context, sim, &captured->system);
    captured->options.place = captured->system.place;
    captured->options.body = captured->system.body;
    captured->options.reuse = false;
    captured->options.coupling = NULL; // the symmetric part is what all methods solve
    captured->unknowns = captured->system.order;
    if (status != NMM_OK) sim->context.error = c->bench->context.error;
    return status;
}

nmm_status nmm_bench_capture(nmm_bench *bench, const nmm_bench_source *source, long step,
                             nmm_bench_system *captured) {
    nmm_sim *sim = NULL;
    nmm_bench_timing run;
    catcher c = {bench, captured};
    nmm_status status = nmm_bench_open(bench, &sim, source);
    if (status == NMM_OK) {
        sim->dump = (nmm_dump){.write = catch_system, .step = step, .iteration = 1, .user = &c};
        status = nmm_bench_steps(bench, sim, (nmm_bench_limit){.steps = step}, &run);
    }
    if (status == NMM_OK && captured->system.order == 0) {
        status = nmm_fail(&bench->context, NMM_ERROR_INPUT, "%s: ended before its step %ld: %s",
                          source->path, step, sim->report.reason);
    }
    nmm_bench_close(&sim);
    return status;
}

void nmm_bench_system_destroy(nmm_bench *bench, nmm_bench_system *captured) {
    nmm_linear_destroy(&bench->context, &captured->system);
}

// --- Solves

nmm_status nmm_bench_solver_open(nmm_bench *bench, nmm_bench_solver *solver,
                                 const nmm_bench_system *captured, bool on_target) {
    const nmm_bsr *K = &captured->system.K;
    *solver = (nmm_bench_solver){.backend = on_target ? nmm_solve_target() : nmm_solve_host(),
                                 .options = captured->options};
    return solver->backend->open(&bench->context, &solver->solver, K->n_row,
                                 K->row_start[K->n_row]);
}

nmm_status nmm_bench_solve(nmm_bench *bench, nmm_bench_solver *solver, nmm_bench_system *captured) {
    nmm_linear *s = &captured->system;
    memcpy(s->u, s->guess, 2 * (size_t)s->K.n_row * sizeof(double));
    const double start = nmm_clock();
    const nmm_status status =
        solver->backend->solve(&bench->context, solver->solver, &s->K, s->f, s->u, false,
                               &solver->options, &solver->report);
    solver->seconds = nmm_clock() - start;
    return status;
}

void nmm_bench_solver_close(nmm_bench *bench, nmm_bench_solver *solver) {
    if (solver->backend != NULL) solver->backend->close(&bench->context, &solver->solver);
}
