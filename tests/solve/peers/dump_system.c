// SPDX-License-Identifier: MIT
//
// Writes the linear system of the first pass of a step: runs a scene up to that step, then lets a
// solver that only records take the place of the real one. The step's length follows from its
// Courant number C = c_p dt / h, c_p of the first material, h the size of the covers. Long steps
// are near statics and begin from rest: what moves at the end of a short step would fly far off in
// one.
//
// Usage: dump_system SCENE STEP COURANT FILE [KEY=VALUE...]     (COURANT 0: the run's own dt)

#include "bench.h"

#include "nmm/nmm.h"
#include "step.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Courant numbers from which on a step begins from rest.
#define LONG_STEP 100

static nmm_sim *sim;
static const char *file;

static void must(nmm_status status) {
    if (status == NMM_OK) return;
    const char *mistakes = nmm_sim_mistakes(sim);
    fprintf(stderr, "%s\n%s", nmm_sim_error(sim)->message, mistakes != NULL ? mistakes : "");
    exit(1);
}

// Speed of pressure waves in the first material.
static double wave_speed(const nmm_model *model) {
    const nmm_material *m = &model->material[0];
    const double nu = m->poissons_ratio;
    return sqrt(m->youngs_modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / m->density);
}

static int count_closed(const nmm_state *state) {
    int n = 0;
    for (int k = 0; k < state->n_contact; k++)
        n += state->contact[k].mode != NMM_CONTACT_OPEN;
    return n;
}

// Stands in for a backend's `solve`: writes the system and gives up the step.
static nmm_status record(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                         const double *f, double *u, bool keep_pattern,
                         const nmm_solve_options *options, nmm_solve_report *report) {
    (void)solver, (void)u, (void)keep_pattern, (void)options, (void)report;
    const double dt = sim->state.dt;
    const bench_system system = {
        .n_row = K->n_row,
        .n_block = K->row_start[K->n_row],
        .n_contact = sim->state.n_contact,
        .n_closed = count_closed(&sim->state),
        .dt = dt,
        .courant = wave_speed(&sim->model) * dt / sim->model.size,
        .row_start = K->row_start,
        .col = K->col,
        .diagonal = K->diagonal,
        .value = K->value,
        .f = (double *)f,
        .place = sim->model.cover_place,
        .body = sim->model.cover_block,
    };
    bench_system_write(&system, file);
    printf("%s: %d unknowns, %d blocks, %d contacts, %d closed, C %.3g\n", file, 2 * K->n_row,
           system.n_block, system.n_contact, system.n_closed, system.courant);
    return nmm_fail(context, NMM_ERROR_ARGUMENT, "recorded");
}

static void dump(double courant) {
    if (courant > 0) {
        sim->state.dt = courant * sim->model.size / wave_speed(&sim->model);
        sim->settings.dt_max = sim->state.dt;
        sim->settings.end = sim->state.time + 10 * sim->state.dt;
    }
    const size_t n = 2 * (size_t)sim->model.n_cover * sizeof(double);
    if (courant >= LONG_STEP) {
        memset(sim->state.velocity, 0, n);
        memset(sim->state.mean_velocity, 0, n);
    }
    nmm_step_report report;
    const nmm_status status = nmm_sim_step(sim, &report);
    if (status != NMM_OK && strcmp(nmm_sim_error(sim)->message, "recorded") == 0) return;
    fprintf(stderr, "%s: no system was made: %s\n", file, nmm_sim_error(sim)->message);
    exit(1);
}

static void run_to(long step, const char *scene) {
    nmm_step_report report = {.end = NMM_END_RUNNING};
    while (sim->state.step < step) {
        must(nmm_sim_step(sim, &report));
        if (report.end == NMM_END_RUNNING) continue;
        fprintf(stderr, "%s ended at step %ld: %s\n", scene, sim->state.step, report.reason);
        exit(1);
    }
}

int main(int argc, char **argv) {
    if (argc < 5) {
        fprintf(stderr, "usage: dump_system SCENE STEP COURANT FILE [KEY=VALUE...]\n");
        return 2;
    }
    file = argv[4];
    nmm_sim_def def = nmm_default_sim_def();
    def.path = argv[1];
    def.n_override = argc - 5;
    def.override = (const char *const *)argv + 5;
    must(nmm_sim_create(&sim, &def));
    run_to(strtol(argv[2], NULL, 10), argv[1]);
    const nmm_solve_backend *real = sim->backend;
    nmm_solve_backend recorder = *real;
    recorder.solve = record;
    sim->backend = &recorder;
    dump(strtod(argv[3], NULL));
    sim->backend = real;
    nmm_sim_destroy(sim);
    return 0;
}
