// SPDX-License-Identifier: MIT
//
// Our own methods in the benchmark: every choice of method, blocks and precision through the host
// backend's interface, as a step of the program uses it. `reuse` stays off: each solve prepares
// all that depends on numbers anew, as the other libraries must. A choice that this build does not
// have, or that was replaced by another one, counts as failed.

#include "bench.h"
#include "solve.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Sweeps after which methods are given up: those without acceleration, and Chebyshev's.
#define SWEEPS 50000
#define WEIGHTED_SWEEPS 5000

typedef struct ours {
    nmm_context context;
    nmm_solver *solver;
    nmm_bsr K;
    const double *f;
    nmm_solve_options options;
    nmm_solve_report report;
    bool keep_pattern;
    char note[400];
} ours;

static void *open_ours(const bench_system *system, const bench_method *method, int n_thread) {
    ours *o = calloc(1, sizeof *o);
    if (o == NULL) return NULL;
    o->context.n_thread = n_thread;
    o->K = (nmm_bsr){.n_row = system->n_row,
                     .row_start = system->row_start,
                     .col = system->col,
                     .value = system->value,
                     .diagonal = system->diagonal};
    o->f = system->f;
    o->options = nmm_default_solve_options();
    o->options.method = (nmm_solve_method)method->choice[0];
    o->options.blocks = (nmm_solve_blocks)method->choice[1];
    o->options.precision = (nmm_solve_precision)method->choice[2];
    o->options.place = system->place;
    o->options.body = system->body;
    o->options.n_thread = n_thread;
    o->options.jacobi_damping = method->number;
    const int asked = method->choice[0];
    const bool sweeps = asked != NMM_SOLVE_AUTO && asked != NMM_SOLVE_PCG;
    if (sweeps) o->options.max_iterations = SWEEPS;
    if (asked == NMM_SOLVE_CHEBYSHEV) o->options.max_iterations = WEIGHTED_SWEEPS;
    if (nmm_solve_host()->open(&o->context, &o->solver, system->n_row, system->n_block) == NMM_OK) {
        return o;
    }
    free(o);
    return NULL;
}

// Whether the method that ran is the one that was asked for.
static bool as_asked(const ours *o) {
    const nmm_solve_options *asked = &o->options;
    const nmm_solve_report *used = &o->report;
    if (asked->method == NMM_SOLVE_AUTO) return true;
    if (used->method != asked->method) return false;
    const bool blocks = asked->blocks == NMM_BLOCKS_AUTO || used->blocks == asked->blocks;
    return blocks && used->precision == asked->precision;
}

static int solve_ours(void *state, double tolerance, double *u) {
    ours *o = state;
    o->options.tolerance = tolerance;
    memset(u, 0, 2 * (size_t)o->K.n_row * sizeof *u);
    const nmm_status status = nmm_solve_host()->solve(&o->context, o->solver, &o->K, o->f, u,
                                                      o->keep_pattern, &o->options, &o->report);
    if (status != NMM_OK) {
        snprintf(o->note, sizeof o->note, "%.300s", o->context.error.message);
        o->context.error = (nmm_error){0};
        return -1;
    }
    o->keep_pattern = true;
    const nmm_solve_report *r = &o->report;
    if (r->end != NMM_SOLVE_CONVERGED) {
        snprintf(o->note, sizeof o->note, "%s", nmm_solve_end_name(r->end));
        return -1;
    }
    const char *why = r->why != NULL ? r->why : "";
    snprintf(o->note, sizeof o->note, "%s %s %s %d | %.300s", nmm_solve_method_name(r->method),
             nmm_solve_blocks_name(r->blocks),
             r->precision == NMM_PRECISION_MIXED ? "mixed" : "double", r->n_thread, why);
    return as_asked(o) ? r->iterations : -1;
}

static void close_ours(void *state) {
    ours *o = state;
    nmm_solve_host()->close(&o->context, &o->solver);
    free(o);
}

static const char *note_of_ours(const void *state) {
    return ((const ours *)state)->note;
}

// Name, largest order, method, blocks, precision, damping (0: the method's own).
#define OURS(NAME, LARGEST, THREADS, METHOD, BLOCKS, PRECISION, DAMPING)                           \
    {                                                                                              \
        .name = NAME, .family = BENCH_OURS, .largest = LARGEST, .threads = THREADS,                \
        .open = open_ours, .solve = solve_ours, .close = close_ours, .note = note_of_ours,         \
        .choice = {NMM_SOLVE_##METHOD, NMM_BLOCKS_##BLOCKS, NMM_PRECISION_##PRECISION},            \
        .number = DAMPING                                                                          \
    }

const bench_method *bench_ours(int *n) {
    static const bench_method list[] = {
        OURS("auto", 0, true, AUTO, AUTO, AUTO, 0),
        OURS("pcg-cover", 0, true, PCG, COVER, DOUBLE, 0),
        OURS("pcg-cover-mixed", 0, true, PCG, COVER, MIXED, 0),
        OURS("pcg-cluster", 0, true, PCG, CLUSTER, DOUBLE, 0),
        OURS("pcg-cluster-mixed", 0, true, PCG, CLUSTER, MIXED, 0),
        OURS("pcg-body", 0, true, PCG, BODY, DOUBLE, 0),
        OURS("pcg-body-mixed", 0, true, PCG, BODY, MIXED, 0),
        OURS("chebyshev-cover", 300000, true, CHEBYSHEV, COVER, DOUBLE, 0),
        OURS("chebyshev-cover-mixed", 300000, true, CHEBYSHEV, COVER, MIXED, 0),
        OURS("chebyshev-cluster", 300000, true, CHEBYSHEV, CLUSTER, DOUBLE, 0),
        OURS("chebyshev-cluster-mixed", 300000, true, CHEBYSHEV, CLUSTER, MIXED, 0),
        OURS("direct", 0, true, DIRECT, AUTO, DOUBLE, 0),
        OURS("jacobi-cover", 3000, true, JACOBI, COVER, DOUBLE, 0),
        OURS("jacobi-cluster", 3000, true, JACOBI, CLUSTER, DOUBLE, 0),
        OURS("jacobi-plain", 3000, true, JACOBI, COVER, DOUBLE, 1),
        OURS("sor", 3000, false, SOR, AUTO, DOUBLE, 0),
        OURS("gauss-seidel", 3000, false, GAUSS_SEIDEL, AUTO, DOUBLE, 0),
    };
    *n = (int)(sizeof list / sizeof *list);
    return list;
}
