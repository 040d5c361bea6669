// SPDX-License-Identifier: MIT
//
// Cases for host against target: every method, stopping test, first guess and end that has kernels
// or transfers of its own. One solver serves several systems in turn, so that data left over from
// the last solve show up where a transfer is missing.

#include "agreement.h"

#include "systems.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// What makes a case.
typedef struct variant {
    const char *name;
    int system;  // which matrix
    double load; // factor on its right-hand side
    double guess;
    bool keep_pattern;
    nmm_solve_options options;
    nmm_solve_end end; // as it must be
} variant;

#define N_SYSTEM 4
enum { WALL, SOFT_WALL, SMALL, INDEFINITE };

static const variant variants[] = {
    {"pcg", WALL, 1, 0, false, {.method = NMM_SOLVE_PCG, .tolerance = 1e-9}, NMM_SOLVE_CONVERGED},
    {"same pattern, new values, new load",
     SOFT_WALL,
     -3,
     1e-9,
     true,
     {.method = NMM_SOLVE_AUTO, .tolerance = 1e-6},
     NMM_SOLVE_CONVERGED},
    {"another pattern",
     SMALL,
     1e-30,
     0,
     false,
     {.method = NMM_SOLVE_PCG, .tolerance = 1e-12},
     NMM_SOLVE_CONVERGED},
    {"back again", WALL, 2, 0, false, {.tolerance = 1e-3}, NMM_SOLVE_CONVERGED},
    {"guess worse than zero", WALL, 2, 1e3, true, {.tolerance = 1e-5}, NMM_SOLVE_CONVERGED},
    {"no load", WALL, 0, 1, true, {.tolerance = 1e-5}, NMM_SOLVE_CONVERGED},
    {"after no load", WALL, 1, 0, true, {.tolerance = 1e-5}, NMM_SOLVE_CONVERGED},
    {"damped Jacobi",
     WALL,
     1,
     0,
     true,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-2},
     NMM_SOLVE_CONVERGED},
    {"average change",
     WALL,
     1,
     0,
     true,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-3, .stop_average_change = true},
     NMM_SOLVE_CONVERGED},
    {"plain Jacobi",
     WALL,
     1,
     0,
     true,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-6, .jacobi_damping = 1},
     NMM_SOLVE_DIVERGED},
    {"Jacobi of a few rows",
     SMALL,
     1,
     0,
     false,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-10},
     NMM_SOLVE_CONVERGED},
    {"odd number of sweeps",
     WALL,
     1,
     0,
     false,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-6, .max_iterations = 13},
     NMM_SOLVE_TOO_SLOW},
    {"odd number of steps",
     WALL,
     1,
     0,
     true,
     {.tolerance = 1e-6, .max_iterations = 13},
     NMM_SOLVE_TOO_SLOW},
    {"beyond rounding", WALL, 1, 0, true, {.tolerance = 1e-25}, NMM_SOLVE_STAGNATED},
    {"negative curvature", INDEFINITE, 1, 0, true, {.tolerance = 1e-6}, NMM_SOLVE_INDEFINITE},
    {"negative curvature, Jacobi",
     INDEFINITE,
     1,
     0,
     true,
     {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-6},
     NMM_SOLVE_INDEFINITE},
};
#define N_VARIANT ((int)(sizeof variants / sizeof *variants))

int test_agreement_cases(void) {
    return N_VARIANT;
}

static void must(nmm_status status) {
    if (status != NMM_OK) abort();
}

static void make_systems(nmm_context *context, test_system system[N_SYSTEM]) {
    rock wall = {.n_across = 6, .n_up = 3, .n_node = 8, .courant = 3, .spring = 50, .seed = 4};
    test_system_rock(context, &system[WALL], &wall);
    test_system_rock(context, &system[INDEFINITE], &wall);
    wall.courant = 1;
    test_system_rock(context, &system[SOFT_WALL], &wall);
    test_system_random(context, &system[SMALL], 5, 3, 8);
    // Off-diagonal blocks grow beyond the diagonal.
    nmm_bsr *K = &system[INDEFINITE].K;
    for (int row = 700; row < 720; row++)
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                K->value[4 * k + i] *=
                    K->col[k] >= 700 && K->col[k] < 720 && K->col[k] != row ? 9 : 1;
}

typedef struct outcome {
    nmm_solve_report report;
    double *u;
} outcome;

static void run_variant(nmm_context *context, const nmm_solve_backend *backend, nmm_solver *solver,
                        const test_system *system, const variant *v, outcome *result) {
    const int n = 2 * system->K.n_row;
    nmm_context own = {.n_thread = 1};
    double *f = NULL;
    must(nmm_allocate(&own, &f, (size_t)n, sizeof *f));
    for (int i = 0; i < n; i++) {
        f[i] = v->load * system->f[i];
        result->u[i] = v->guess * (1 + i % 3);
    }
    must(backend->solve(context, solver, &system->K, f, result->u, v->keep_pattern, &v->options,
                        &result->report));
    nmm_release(&own, &f);
}

// Everything but on_device, which must be true wherever kernels ran.
static bool same_reports(const nmm_solve_report *a, const nmm_solve_report *b) {
    return a->end == b->end && a->method == b->method && a->iterations == b->iterations &&
           a->row == b->row && memcmp(&a->residual, &b->residual, sizeof(double)) == 0 &&
           memcmp(&a->lambda_max, &b->lambda_max, sizeof(double)) == 0 &&
           a->by_average_change == b->by_average_change;
}

static bool agree(const variant *v, int n, const outcome *host, const outcome *target, bool loud) {
    const bool solution = memcmp(host->u, target->u, (size_t)n * sizeof(double)) == 0;
    const bool report = same_reports(&host->report, &target->report);
    const bool place = target->report.on_device == (v->load != 0) && !host->report.on_device;
    const bool end = host->report.end == v->end;
    if (loud) {
        printf("%-36s %-8s %5d iterations, residual %.3g, row %d: solution %s, report %s, %s\n",
               v->name, nmm_solve_method_name(host->report.method), host->report.iterations,
               host->report.residual, host->report.row, solution ? "same bits" : "DIFFERS",
               report ? "same" : "DIFFERS", place ? "on the device" : "NOT on the device");
        if (!end) printf("    the host ends with: %s\n", nmm_solve_end_name(host->report.end));
    }
    return solution && report && place && end;
}

int test_agreement(nmm_context *context, bool loud) {
    nmm_context own = {.n_thread = 2};
    test_system system[N_SYSTEM] = {0};
    make_systems(&own, system);
    const nmm_solve_backend *backend[2] = {nmm_solve_host(), nmm_solve_target()};
    nmm_context *memory[2] = {&own, context};
    nmm_solver *solver[2] = {NULL, NULL};
    outcome result[2] = {0};
    const int max_row = system[WALL].K.n_row, max_block = system[WALL].n_block;
    for (int b = 0; b < 2; b++) {
        must(backend[b]->open(memory[b], &solver[b], max_row, max_block));
        must(nmm_allocate(&own, &result[b].u, (size_t)max_row, 2 * sizeof(double)));
    }
    int differing = 0;
    for (int k = 0; k < N_VARIANT; k++) {
        const test_system *s = &system[variants[k].system];
        for (int b = 0; b < 2; b++)
            run_variant(memory[b], backend[b], solver[b], s, &variants[k], &result[b]);
        differing += !agree(&variants[k], 2 * s->K.n_row, &result[0], &result[1], loud);
    }
    for (int b = 0; b < 2; b++) {
        backend[b]->close(memory[b], &solver[b]);
        nmm_release(&own, &result[b].u);
    }
    for (int k = 0; k < N_SYSTEM; k++)
        test_system_destroy(&own, &system[k]);
    return differing + (own.n_live != 0);
}
