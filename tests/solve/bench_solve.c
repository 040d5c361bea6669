// SPDX-License-Identifier: MIT
//
// Measures the host backend (and the target backend where a device runs) on walls of blocks at
// orders near 200, 2000 and 20 000 unknowns and one larger: microseconds of a Jacobi sweep,
// milliseconds of a pcg solve, for 1 and 2 threads. Best of
// several, as other work may share the machine.
// Usage: bench_solve [courant] [tolerance]

#include "systems.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// At least so many solves, and so many seconds, for each figure.
#define ROUNDS 5
#define SECONDS 2

typedef struct timing {
    double seconds;
    nmm_solve_report report;
} timing;

static void must(const nmm_context *context, nmm_status status) {
    if (status == NMM_OK) return;
    fprintf(stderr, "%s\n", context->error.message);
    exit(1);
}

// Best of some solves from zero.
static timing measure(nmm_context *context, const nmm_solve_backend *backend,
                      const test_system *system, const nmm_solve_options *options) {
    nmm_solver *solver = NULL;
    double *u = NULL;
    timing best = {.seconds = 1e30};
    must(context, backend->open(context, &solver, system->K.n_row, system->n_block));
    must(context, nmm_allocate(context, &u, (size_t)system->K.n_row, 2 * sizeof *u));
    const double first = nmm_clock();
    for (int k = 0; k < ROUNDS || nmm_clock() - first < SECONDS; k++) {
        memset(u, 0, 2 * (size_t)system->K.n_row * sizeof *u);
        const double start = nmm_clock();
        must(context, backend->solve(context, solver, &system->K, system->f, u, k > 0, options,
                                     &best.report));
        best.seconds = nmm_min(best.seconds, nmm_clock() - start);
    }
    nmm_release(context, &u);
    backend->close(context, &solver);
    return best;
}

static void measure_order(nmm_context *context, const nmm_solve_backend *backend, const rock *wall,
                          double tolerance) {
    test_system system = {0};
    test_system_rock(context, &system, wall);
    for (int n_thread = 1; n_thread <= 2; n_thread++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.n_thread = n_thread;
        options.tolerance = tolerance;
        options.method = NMM_SOLVE_PCG;
        const timing pcg = measure(context, backend, &system, &options);
        // The cost of a sweep: many against few.
        options.method = NMM_SOLVE_JACOBI;
        options.tolerance = 1e-300;
        options.jacobi_damping = 0.2;
        options.max_iterations = 80;
        const timing few = measure(context, backend, &system, &options);
        options.max_iterations = 480;
        const timing many = measure(context, backend, &system, &options);
        printf("| %s | %d | %.1f | %d | %.2f | %d | %.3f | %s |\n", backend->name,
               2 * system.K.n_row, (double)system.n_block / system.K.n_row, n_thread,
               1e6 * (many.seconds - few.seconds) / 400, pcg.report.iterations, 1e3 * pcg.seconds,
               nmm_solve_end_name(pcg.report.end));
        fflush(stdout);
    }
    test_system_destroy(context, &system);
}

int main(int argc, char **argv) {
    const double courant = argc > 1 ? strtod(argv[1], NULL) : 10;
    const double tolerance = argc > 2 ? strtod(argv[2], NULL) : 1e-8;
    nmm_context context = {.n_thread = 1};
    const int across[] = {2, 6, 20, 64}, up[] = {1, 4, 15, 48};
    printf(
        "| backend | order | blocks per row | threads | us per sweep | pcg iterations | pcg ms | "
        "end |\n|---|---|---|---|---|---|---|---|\n");
    for (int k = 0; k < 4; k++) {
        const rock wall = {.n_across = across[k],
                           .n_up = up[k],
                           .n_node = 6,
                           .courant = courant,
                           .spring = 50,
                           .seed = 7};
        measure_order(&context, nmm_solve_host(), &wall, tolerance);
        if (nmm_solve_target() != NULL && nmm_solve_target_devices() > 0)
            measure_order(&context, nmm_solve_target(), &wall, tolerance);
    }
    return 0;
}
