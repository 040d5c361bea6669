// SPDX-License-Identifier: MIT
//
// Whole runs of a scene with one choice of solver after the other: the first steps are computed
// again and again, and a backend that only changes the options stands between step and solver.
// What a step gives the solver, warm starts and reuse included, is as in the program. Friction's
// coupling, which only auto takes into account, is left out but in one choice: without it all
// choices solve for the same.
//
// Usage: bench_runs SCENE STEPS THREADS ROUNDS [KEY=VALUE...]

#include "nmm/nmm.h"
#include "step.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_ROUNDS 9
#define FAR_BEHIND 1.5

typedef struct choice {
    const char *name;
    nmm_solve_method method;
    nmm_solve_blocks blocks;
    nmm_solve_precision precision;
    bool coupling;
} choice;

typedef struct outcome {
    double wall, solve; // [s] of the steps; of the solves in them
    long solves, iterations;
    long steps;
    bool failed; // an option that this build does not have, or that was replaced
    char why[200];
} outcome;

static const nmm_solve_backend *host;
static choice chosen;
static outcome now;

static nmm_status solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K, const double *f,
                        double *u, bool keep_pattern, const nmm_solve_options *options,
                        nmm_solve_report *report) {
    nmm_solve_options o = *options;
    o.method = chosen.method;
    o.blocks = chosen.blocks;
    if (chosen.method != NMM_SOLVE_AUTO) o.precision = chosen.precision;
    if (!chosen.coupling) o.coupling = NULL;
    const double start = nmm_clock();
    TRY(host->solve(context, solver, K, f, u, keep_pattern, &o, report));
    now.solve += nmm_clock() - start;
    now.solves += 1;
    now.iterations += report->iterations;
    if (chosen.method == NMM_SOLVE_AUTO) {
        snprintf(now.why, sizeof now.why, "%s %s %s", nmm_solve_method_name(report->method),
                 nmm_solve_blocks_name(report->blocks),
                 report->precision == NMM_PRECISION_MIXED ? "mixed" : "double");
        return NMM_OK;
    }
    // No solve took place where there was no load; what ran is then unknown.
    const bool same =
        report->method == o.method && (o.blocks == NMM_BLOCKS_AUTO || report->blocks == o.blocks);
    if (report->iterations > 0 && !same) now.failed = true;
    return NMM_OK;
}

static outcome run_once(const nmm_sim_def *def, long steps) {
    nmm_sim *sim = NULL;
    nmm_step_report report = {.end = NMM_END_RUNNING};
    if (nmm_sim_create(&sim, def) != NMM_OK) {
        const char *mistakes = nmm_sim_mistakes(sim);
        fprintf(stderr, "%s\n%s", nmm_sim_error(sim)->message, mistakes != NULL ? mistakes : "");
        exit(1);
    }
    host = nmm_solve_host();
    nmm_solve_backend between = *host;
    between.solve = solve;
    sim->backend = &between;
    now = (outcome){0};
    const double start = nmm_clock();
    while (report.end == NMM_END_RUNNING && sim->state.step < steps && !now.failed)
        if (nmm_sim_step(sim, &report) != NMM_OK) now.failed = true;
    now.wall = nmm_clock() - start;
    now.steps = sim->state.step;
    if (report.end < 0) now.failed = true;
    sim->backend = host;
    nmm_sim_destroy(sim);
    return now;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static const choice list[] = {
    {"auto", NMM_SOLVE_AUTO, NMM_BLOCKS_AUTO, NMM_PRECISION_DOUBLE, false},
    {"auto-coupled", NMM_SOLVE_AUTO, NMM_BLOCKS_AUTO, NMM_PRECISION_DOUBLE, true},
    {"pcg-cover", NMM_SOLVE_PCG, NMM_BLOCKS_COVER, NMM_PRECISION_DOUBLE, false},
    {"pcg-cover-mixed", NMM_SOLVE_PCG, NMM_BLOCKS_COVER, NMM_PRECISION_MIXED, false},
    {"pcg-cluster", NMM_SOLVE_PCG, NMM_BLOCKS_CLUSTER, NMM_PRECISION_DOUBLE, false},
    {"pcg-cluster-mixed", NMM_SOLVE_PCG, NMM_BLOCKS_CLUSTER, NMM_PRECISION_MIXED, false},
    {"pcg-body", NMM_SOLVE_PCG, NMM_BLOCKS_BODY, NMM_PRECISION_DOUBLE, false},
    {"pcg-body-mixed", NMM_SOLVE_PCG, NMM_BLOCKS_BODY, NMM_PRECISION_MIXED, false},
    {"chebyshev-cover", NMM_SOLVE_CHEBYSHEV, NMM_BLOCKS_COVER, NMM_PRECISION_DOUBLE, false},
    {"chebyshev-cluster", NMM_SOLVE_CHEBYSHEV, NMM_BLOCKS_CLUSTER, NMM_PRECISION_DOUBLE, false},
    {"chebyshev-cluster-mixed", NMM_SOLVE_CHEBYSHEV, NMM_BLOCKS_CLUSTER, NMM_PRECISION_MIXED,
     false},
    {"direct", NMM_SOLVE_DIRECT, NMM_BLOCKS_AUTO, NMM_PRECISION_DOUBLE, false},
};
enum { N_CHOICE = sizeof list / sizeof *list };

int main(int argc, char **argv) {
    if (argc < 5) {
        fprintf(stderr, "usage: bench_runs SCENE STEPS THREADS ROUNDS [KEY=VALUE...]\n");
        return 2;
    }
    nmm_sim_def def = nmm_default_sim_def();
    def.path = argv[1];
    def.n_thread = atoi(argv[3]);
    def.n_override = argc - 5;
    def.override = (const char *const *)argv + 5;
    const long steps = strtol(argv[2], NULL, 10);
    const int rounds = nmm_max_int(1, nmm_min_int(MAX_ROUNDS, atoi(argv[4])));
    static double wall[N_CHOICE][MAX_ROUNDS], solved[N_CHOICE][MAX_ROUNDS];
    static outcome last[N_CHOICE];
    // Choices take turns, so that whatever else the machine does meets all of them. One that is far
    // behind keeps the times of its first turn.
    for (int round = 0; round < rounds; round++) {
        double best = DBL_MAX;
        for (int k = 0; k < N_CHOICE; k++)
            if (!last[k].failed && round > 0) best = nmm_min(best, wall[k][0]);
        for (int k = 0; k < N_CHOICE; k++) {
            chosen = list[k];
            if (round == 0 || (!last[k].failed && wall[k][0] < FAR_BEHIND * best))
                last[k] = run_once(&def, steps);
            wall[k][round] = last[k].wall;
            solved[k][round] = last[k].solve;
        }
    }
    for (int k = 0; k < N_CHOICE; k++) {
        const outcome *o = &last[k];
        printf("run\t%s\t%s\t%s\t", argv[1], argv[3], list[k].name);
        qsort(wall[k], (size_t)rounds, sizeof **wall, compare);
        qsort(solved[k], (size_t)rounds, sizeof **solved, compare);
        if (o->failed)
            printf("-\t-\t-\t-\t-\t\n");
        else
            printf("%.5g\t%.5g\t%ld\t%ld\t%ld\t%s\n", wall[k][rounds / 2], solved[k][rounds / 2],
                   o->steps, o->solves, o->iterations, o->why);
    }
    return 0;
}
