// SPDX-License-Identifier: MIT
//
// Systems written out of a run: PREFIX.mtx, PREFIX_rhs.mtx, PREFIX_guess.mtx and
// PREFIX_places.mtx, as they stand before the linear solve of one pass of one step. A later try of
// the same step writes them anew.

#include "linear.h"
#include "step.h"

#include <string.h>

// Longest ending of the files.
#define ENDING sizeof "_places.mtx"

// x, y and body of each cover, in model coordinates.
static nmm_status write_places(nmm_sim *sim, const char *path) {
    const nmm_model *model = &sim->model;
    const int *body = nmm_system_body(&sim->system, model);
    const nmm_market_head head = {
        .n_row = model->n_cover,
        .n_column = 3,
        .comment = "a row for each cover, which is two rows of the matrix:\n"
                   "x and y [m] of its lattice node, number of its block from 0; -1: no part\n"
                   "in rigid motions\n"};
    nmm_replacement file = {0};
    nmm_status status = nmm_market_open(&sim->context, &file, path, &head);
    for (int i = 0; status == NMM_OK && i < 3 * model->n_cover; i++) {
        const int c = i % model->n_cover, column = i / model->n_cover;
        const double value = column < 2 ? model->cover_place[2 * c + column] : (double)body[c];
        nmm_market_value(&file, value);
    }
    if (status == NMM_OK) status = nmm_replacement_commit(&file);
    nmm_replacement_drop(&file);
    return status;
}

static nmm_status write_files(nmm_sim *sim, char *path, const char *comment) {
    nmm_context *context = &sim->context;
    const nmm_system *system = &sim->system;
    const int n = 2 * sim->model.n_cover;
    char *ending = path + strlen(sim->dump.prefix);
    memcpy(ending, "_rhs.mtx", sizeof "_rhs.mtx");
    TRY(nmm_linear_write_vector(context, n, system->residual, path, comment));
    memcpy(ending, "_guess.mtx", sizeof "_guess.mtx");
    TRY(nmm_linear_write_vector(context, n, system->change, path, comment));
    memcpy(ending, "_places.mtx", sizeof "_places.mtx");
    TRY(write_places(sim, path));
    memcpy(ending, ".mtx", sizeof ".mtx");
    return nmm_linear_write_matrix(context, &system->K, path, comment);
}

// Before each solve: is it the one asked for?
static nmm_status write_system(nmm_sim *sim, const nmm_solve_options *options) {
    nmm_dump *dump = &sim->dump;
    const int iteration = sim->report.passes + 1;
    if (sim->state.step + 1 != dump->step || iteration != dump->iteration) return NMM_OK;
    char comment[256], *path = NULL;
    snprintf(comment, sizeof comment,
             "step %ld, open-close iteration %d, try %d of the step, from time %.9g s\n"
             "tolerance %.17g, absolute %.17g\n",
             dump->step, iteration, sim->report.cuts + 1, sim->state.time, options->tolerance,
             options->absolute);
    TRY(nmm_allocate(&sim->context, &path, strlen(dump->prefix) + ENDING, 1));
    memcpy(path, dump->prefix, strlen(dump->prefix));
    const nmm_status status = write_files(sim, path, comment);
    nmm_release(&sim->context, &path);
    dump->n_written += status == NMM_OK;
    return status;
}

nmm_status nmm_sim_dump_system(nmm_sim *sim, long step, int iteration, const char *prefix) {
    if (step < 1 || iteration < 1 || prefix == NULL || *prefix == 0) {
        return nmm_fail(&sim->context, NMM_ERROR_ARGUMENT,
                        "a system to dump: step %ld and iteration %d must be 1 or more, and there "
                        "must be a prefix for the files",
                        step, iteration);
    }
    char *copy = NULL;
    TRY(nmm_arena_text(&sim->context, &sim->scene.arena, &copy, prefix, strlen(prefix)));
    sim->dump =
        (nmm_dump){.write = write_system, .step = step, .iteration = iteration, .prefix = copy};
    return NMM_OK;
}

int nmm_sim_dumped(const nmm_sim *sim) {
    return sim->dump.n_written;
}
