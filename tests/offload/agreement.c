// SPDX-License-Identifier: MIT
//
// Cases for host against target: every method, kind of blocks, precision, stopping test, first
// guess and end that has kernels or transfers of its own. One solver serves several systems in
// turn, so that data left over from the last solve show up where a transfer is missing.

#include "agreement.h"

#include "solver.h"
#include "systems.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WALL, SOFT_WALL, FEW_CHANGED, SMALL, HUGE_VALUES, TINY_VALUES, INDEFINITE, CHAIN, N_SYSTEM };

#define PCG NMM_SOLVE_PCG
#define JACOBI NMM_SOLVE_JACOBI
#define CHEBYSHEV NMM_SOLVE_CHEBYSHEV
#define AUTO NMM_BLOCKS_AUTO
#define COVER NMM_BLOCKS_COVER
#define CLUSTER NMM_BLOCKS_CLUSTER

// What makes a case. What is not named in the table is 0 or false.
typedef struct variant {
    const char *name;
    int system;
    nmm_solve_method method;
    nmm_solve_blocks blocks;
    double tolerance;
    bool mixed;
    bool keep, reuse; // pattern of the last case; what was prepared for it
    double load;      // factor on the right-hand side; 0: one
    bool idle;        // no load
    double guess;
    double damping;
    int most; // iterations
    bool average;
    nmm_solve_end end; // as it must be
    bool refused;      // before anything is sent
    bool falls_back;   // from float32
} variant;

static const variant variants[] = {
    {"pcg", WALL, PCG, COVER, 1e-9, .keep = false},
    {"new values, load and guess", SOFT_WALL, PCG, COVER, 1e-6, .keep = true, .load = -3,
     .guess = 1e-9},
    {"another pattern", SMALL, PCG, COVER, 1e-12, .load = 1e-30},
    {"back again", WALL, PCG, COVER, 1e-3, .load = 2},
    {"guess worse than zero", WALL, PCG, COVER, 1e-5, .keep = true, .load = 2, .guess = 1e3},
    {"no load", WALL, PCG, COVER, 1e-5, .keep = true, .idle = true, .guess = 1},
    {"after no load", WALL, PCG, COVER, 1e-5, .keep = true},
    {"odd number of steps", WALL, PCG, COVER, 1e-6, .keep = true, .most = 13,
     .end = NMM_SOLVE_TOO_SLOW},
    {"few rows changed", FEW_CHANGED, PCG, COVER, 1e-9, .keep = true},
    {"and back", WALL, PCG, COVER, 1e-9, .keep = true},
    {"beyond rounding", SMALL, PCG, COVER, 1e-25, .end = NMM_SOLVE_STAGNATED},

    {"clusters", WALL, PCG, CLUSTER, 1e-9, .keep = false},
    {"clusters, new values", SOFT_WALL, PCG, CLUSTER, 1e-9, .keep = true},
    {"clusters kept", WALL, PCG, CLUSTER, 1e-9, .keep = true, .reuse = true},
    {"clusters, few rows changed", FEW_CHANGED, PCG, CLUSTER, 1e-9, .keep = true, .reuse = true},
    {"covers again", SOFT_WALL, PCG, COVER, 1e-6, .keep = true, .reuse = true},
    {"clusters again", SOFT_WALL, PCG, CLUSTER, 1e-6, .keep = true, .reuse = true},
    {"clusters of another pattern", SMALL, PCG, CLUSTER, 1e-12, .keep = false},
    {"clusters, too slow", WALL, PCG, CLUSTER, 1e-9, .most = 9, .end = NMM_SOLVE_TOO_SLOW},

    {"mixed", WALL, PCG, COVER, 1e-10, .mixed = true},
    {"mixed, few rows changed", FEW_CHANGED, PCG, COVER, 1e-10, .keep = true, .mixed = true},
    {"double between", WALL, PCG, COVER, 1e-9, .keep = true},
    {"mixed after double", WALL, PCG, COVER, 1e-10, .keep = true, .mixed = true},
    {"mixed, new values", SOFT_WALL, PCG, COVER, 1e-10, .keep = true, .mixed = true},
    {"mixed, clusters", SOFT_WALL, PCG, CLUSTER, 1e-10, .keep = true, .mixed = true},
    {"mixed, clusters kept", WALL, PCG, CLUSTER, 1e-10, .keep = true, .reuse = true, .mixed = true},
    {"mixed, low demand", WALL, PCG, CLUSTER, 1e-2, .keep = true, .mixed = true},
    {"mixed, too slow", WALL, PCG, CLUSTER, 1e-10, .keep = true, .mixed = true, .most = 21,
     .end = NMM_SOLVE_TOO_SLOW, .falls_back = true},
    {"beyond float32", HUGE_VALUES, PCG, CLUSTER, 1e-10, .keep = true, .mixed = true,
     .falls_back = true},
    {"mixed, beyond rounding", SMALL, PCG, COVER, 1e-25, .mixed = true, .end = NMM_SOLVE_STAGNATED,
     .falls_back = true},

    // Blocks left to the solver; the direct method, which auto may take too, is on the host only.
    {"clusters before auto", SOFT_WALL, PCG, CLUSTER, 1e-3, .keep = false},
    {"covers before auto", SOFT_WALL, PCG, COVER, 1e-3, .keep = true},
    {"auto after covers", WALL, PCG, AUTO, 1e-9, .keep = true},
    {"auto, another pattern", SMALL, PCG, AUTO, 1e-9, .load = 7},
    {"auto", WALL, PCG, AUTO, 1e-9, .load = 7},
    {"auto, experienced", SOFT_WALL, PCG, AUTO, 1e-9, .keep = true},
    {"auto, reuse", WALL, PCG, AUTO, 1e-9, .keep = true, .reuse = true},
    {"auto, low demand", WALL, PCG, AUTO, 1e-2, .keep = true, .reuse = true},
    {"auto, mixed", WALL, PCG, AUTO, 1e-9, .keep = true, .mixed = true},

    {"chebyshev", WALL, CHEBYSHEV, COVER, 1e-5, .keep = false},
    {"chebyshev, bounds kept", SOFT_WALL, CHEBYSHEV, COVER, 1e-5, .keep = true, .reuse = true},
    {"chebyshev, clusters", WALL, CHEBYSHEV, CLUSTER, 1e-5, .keep = true, .reuse = true},
    {"chebyshev, mixed", WALL, CHEBYSHEV, COVER, 1e-7, .keep = true, .mixed = true},
    {"chebyshev, mixed, clusters", WALL, CHEBYSHEV, CLUSTER, 1e-7, .keep = true, .mixed = true},
    {"chebyshev, odd", WALL, CHEBYSHEV, CLUSTER, 1e-7, .keep = true, .most = 11,
     .end = NMM_SOLVE_TOO_SLOW},

    {"chebyshev, beyond rounding", CHAIN, CHEBYSHEV, COVER, 1e-25, .most = 3000,
     .end = NMM_SOLVE_STAGNATED},

    {"jacobi", WALL, JACOBI, COVER, 1e-1, .keep = true},
    {"jacobi, clusters", WALL, JACOBI, CLUSTER, 1e-1, .keep = true},
    {"jacobi, mixed", WALL, JACOBI, COVER, 1e-1, .keep = true, .mixed = true},
    {"jacobi, mixed, clusters", WALL, JACOBI, CLUSTER, 1e-1, .keep = true, .mixed = true},
    {"jacobi, tiny values", TINY_VALUES, JACOBI, COVER, 1e-10, .keep = false},
    {"wall again", WALL, JACOBI, CLUSTER, 1e-1, .keep = false},
    {"average change", WALL, JACOBI, COVER, 1e-2, .keep = true, .average = true},
    {"average change, clusters", WALL, JACOBI, CLUSTER, 1e-2, .keep = true, .average = true},
    {"average change, mixed", WALL, JACOBI, COVER, 1e-2, .keep = true, .average = true,
     .mixed = true, .falls_back = true},
    {"plain jacobi", WALL, JACOBI, COVER, 1e-6, .keep = true, .damping = 1,
     .end = NMM_SOLVE_DIVERGED},
    {"plain jacobi, mixed", WALL, JACOBI, COVER, 1e-6, .keep = true, .damping = 1, .mixed = true,
     .end = NMM_SOLVE_DIVERGED, .falls_back = true},
    {"jacobi of a few rows", SMALL, JACOBI, COVER, 1e-10, .mixed = true},
    {"jacobi, bounds kept", SMALL, JACOBI, COVER, 1e-10, .keep = true, .reuse = true},
    {"jacobi, bounds of another", WALL, JACOBI, COVER, 1e-1, .reuse = true},
    {"jacobi, odd", WALL, JACOBI, COVER, 1e-6, .most = 13, .end = NMM_SOLVE_TOO_SLOW},

    {"negative curvature", INDEFINITE, PCG, COVER, 1e-6, .keep = true, .end = NMM_SOLVE_INDEFINITE},
    {"negative, clusters", INDEFINITE, PCG, CLUSTER, 1e-6, .keep = true,
     .end = NMM_SOLVE_INDEFINITE},
    {"negative, mixed", INDEFINITE, PCG, COVER, 1e-6, .keep = true, .mixed = true,
     .end = NMM_SOLVE_INDEFINITE, .falls_back = true},
    {"negative, jacobi", INDEFINITE, JACOBI, COVER, 1e-6, .keep = true,
     .end = NMM_SOLVE_INDEFINITE},
    {"negative, chebyshev", INDEFINITE, CHEBYSHEV, CLUSTER, 1e-6, .keep = true,
     .end = NMM_SOLVE_INDEFINITE},
    {"not a number", SOFT_WALL, PCG, CLUSTER, 1e-6, .keep = true, .load = NAN,
     .end = NMM_SOLVE_NOT_FINITE, .refused = true},
    {"after not a number", WALL, PCG, CLUSTER, 1e-6, .keep = true, .reuse = true},
};
#define N_VARIANT ((int)(sizeof variants / sizeof *variants))

int test_agreement_cases(void) {
    return N_VARIANT;
}

static void must(nmm_status status) {
    if (status != NMM_OK) abort();
}

// --- Systems

// Off-diagonal blocks of some rows grow beyond the diagonal.
static void make_indefinite(nmm_bsr *K) {
    const int begin = 200, end = 220;
    for (int row = begin; row < end; row++)
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                K->value[4 * k + i] *=
                    K->col[k] >= begin && K->col[k] < end && K->col[k] != row ? 9 : 1;
}

// A few rows far apart become stiffer.
static void change_few(nmm_bsr *K) {
    const int row[] = {5, 6, 300, K->n_row - 1};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++)
        for (int i = 0; i < 4; i += 3)
            K->value[4 * K->diagonal[row[k]] + i] *= 1.5;
}

static void multiply(test_system *system, double factor) {
    for (int k = 0; k < 4 * system->n_block; k++)
        system->K.value[k] *= factor;
}

static void make_systems(nmm_context *context, test_system system[N_SYSTEM]) {
    rock wall = {.n_across = 4, .n_up = 3, .n_node = 7, .courant = 3, .spring = 50, .seed = 4};
    test_system_rock(context, &system[WALL], &wall);
    test_system_rock(context, &system[FEW_CHANGED], &wall);
    test_system_rock(context, &system[INDEFINITE], &wall);
    test_system_rock(context, &system[HUGE_VALUES], &wall);
    wall.courant = 1;
    test_system_rock(context, &system[SOFT_WALL], &wall);
    test_system_random(context, &system[SMALL], 5, 3, 8);
    test_system_random(context, &system[TINY_VALUES], 5, 3, 9);
    change_few(&system[FEW_CHANGED].K);
    // Large displacements under small loads: rounding leaves thousands of times what the load alone
    // would.
    test_system_chain(context, &system[CHAIN], 60, true);
    for (int i = 0; i < 120; i++)
        system[CHAIN].f[i] = 1;
    make_indefinite(&system[INDEFINITE].K);
    multiply(&system[HUGE_VALUES], 1e20);
    multiply(&system[TINY_VALUES], 1e-20);
}

// --- One case on one backend

typedef struct side {
    const nmm_solve_backend *backend;
    nmm_context *memory;
    nmm_solver *solver;
    nmm_solve_report report;
    double *u;
} side;

static void run_variant(side *s, const test_system *system, const variant *v) {
    const int n = 2 * system->K.n_row;
    nmm_context own = {.n_thread = 1};
    double *f = NULL;
    must(nmm_allocate(&own, &f, (size_t)n, sizeof *f));
    const double load = v->load != 0 ? v->load : 1;
    for (int i = 0; i < n; i++) {
        f[i] = v->idle ? 0 : load * system->f[i];
        s->u[i] = v->guess * (1 + i % 3);
    }
    const nmm_solve_options options = {.method = v->method,
                                       .blocks = v->blocks,
                                       .precision =
                                           v->mixed ? NMM_PRECISION_MIXED : NMM_PRECISION_DOUBLE,
                                       .reuse = v->reuse,
                                       .tolerance = v->tolerance,
                                       .stop_average_change = v->average,
                                       .jacobi_damping = v->damping,
                                       .max_iterations = v->most};
    must(s->backend->solve(s->memory, s->solver, &system->K, f, s->u, v->keep, &options,
                           &s->report));
    nmm_release(&own, &f);
}

static void open_side(side *s, const nmm_solve_backend *backend, nmm_context *memory,
                      const test_system *largest) {
    nmm_context own = {.n_thread = 1};
    s->backend = backend;
    s->memory = memory;
    must(backend->open(memory, &s->solver, largest->K.n_row, largest->n_block));
    must(nmm_allocate(&own, &s->u, (size_t)largest->K.n_row, 2 * sizeof(double)));
}

static void close_side(side *s) {
    nmm_context own = {.n_live = 1};
    s->backend->close(s->memory, &s->solver);
    nmm_release(&own, &s->u);
}

// --- Comparison

static bool same_bits(double a, double b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

// Everything but n_thread and on_device.
static bool same_reports(const nmm_solve_report *a, const nmm_solve_report *b) {
    return a->end == b->end && a->method == b->method && a->blocks == b->blocks &&
           a->precision == b->precision && strcmp(a->why, b->why) == 0 && a->setups == b->setups &&
           a->iterations == b->iterations && a->row == b->row &&
           same_bits(a->residual, b->residual) && same_bits(a->lambda_max, b->lambda_max) &&
           same_bits(a->lambda_min, b->lambda_min) && a->by_average_change == b->by_average_change;
}

static void print_case(const variant *v, const nmm_solve_report *r) {
    printf("%-28s %-9s %-7s %-6s %5d iterations, residual %.2e, row %d: ", v->name,
           nmm_solve_method_name(r->method), nmm_solve_blocks_name(r->blocks),
           r->precision == NMM_PRECISION_MIXED ? "mixed" : "double", r->iterations, r->residual,
           r->row);
}

// Is the case what its name says? In mixed precision the change ends a round, the residual the
// solve.
static bool as_meant(const variant *v, const nmm_solve_report *r) {
    const bool narrow = r->precision == NMM_PRECISION_MIXED;
    return r->end == v->end && narrow == (v->mixed && !v->falls_back) &&
           r->by_average_change == (v->average && !narrow);
}

static bool agree(const variant *v, int n, const side *host, const side *target, bool loud) {
    const bool solution = memcmp(host->u, target->u, (size_t)n * sizeof(double)) == 0;
    const bool report = same_reports(&host->report, &target->report);
    const bool kernels = !v->idle && !v->refused;
    const bool place = target->report.on_device == kernels && !host->report.on_device;
    const bool meant = as_meant(v, &host->report);
    if (loud) {
        print_case(v, &host->report);
        printf("solution %s, report %s, %s\n", solution ? "same bits" : "DIFFERS",
               report ? "same" : "DIFFERS",
               !place    ? "NOT where it should run"
               : kernels ? "on the device"
                         : "no kernel needed");
        if (!report) {
            print_case(v, &target->report);
            printf("on the target\n");
        }
        if (!meant) {
            printf("    NOT as meant: %s %s\n", nmm_solve_end_name(host->report.end),
                   host->report.why);
        }
    }
    return solution && report && place && meant;
}

int test_agreement(nmm_context *context, const agreement *how) {
    nmm_context own = {.n_thread = 2};
    test_system system[N_SYSTEM] = {0};
    make_systems(&own, system);
    side host = {0}, target = {0};
    open_side(&host, nmm_solve_host(), &own, &system[WALL]);
    open_side(&target, nmm_solve_target(), context, &system[WALL]);
    target.solver->team_rows = how->launches ? 0 : INT_MAX;
    int differing = 0;
    for (int k = 0; k < N_VARIANT && !(how->stop_early && differing > 0); k++) {
        const test_system *s = &system[variants[k].system];
        run_variant(&host, s, &variants[k]);
        run_variant(&target, s, &variants[k]);
        differing += !agree(&variants[k], 2 * s->K.n_row, &host, &target, how->loud);
    }
    close_side(&host);
    close_side(&target);
    for (int k = 0; k < N_SYSTEM; k++)
        test_system_destroy(&own, &system[k]);
    return differing + (own.n_live != 0);
}

uint64_t test_host_hash(void) {
    nmm_context own = {.n_thread = 2};
    test_system system[N_SYSTEM] = {0};
    make_systems(&own, system);
    side host = {0};
    open_side(&host, nmm_solve_host(), &own, &system[WALL]);
    uint64_t hash = NMM_HASH_START;
    for (int k = 0; k < N_VARIANT; k++) {
        const test_system *s = &system[variants[k].system];
        run_variant(&host, s, &variants[k]);
        hash = nmm_hash(hash, host.u, 2 * (size_t)s->K.n_row * sizeof(double));
        if (!as_meant(&variants[k], &host.report)) printf("not as meant: %s\n", variants[k].name);
    }
    close_side(&host);
    for (int k = 0; k < N_SYSTEM; k++)
        test_system_destroy(&own, &system[k]);
    return hash;
}
