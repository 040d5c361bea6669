// SPDX-License-Identifier: MIT
//
// What features cost a scene that has them, and what leaving them out saves one that does not:
// bytes, and where it is more than a branch the time of a step. Contact is weighed, by a search of
// its own where the scene has none; what is only memory is counted.

#include "step.h"

#include <math.h>

// Bytes and time of a search in the first configuration. `state` has no contacts yet.
static nmm_status weigh_search(nmm_context *context, const nmm_sim *sim, nmm_state *state,
                               nmm_contact_search **search, nmm_mixing *mixing) {
    const nmm_contact_options options = {.penalty = 1};
    TRY(nmm_contact_open(context, &sim->model, &options, search));
    TRY(nmm_mixing_open(context, mixing, 2 * sim->model.n_cover));
    const double reach = 0.04 * sim->model.size;
    // The first time makes room.
    for (int k = 0; k < 2; k++)
        TRY(nmm_contact_find(context, *search, &sim->model, state, reach));
    return NMM_OK;
}

static nmm_status weigh_contact(nmm_sim *sim, nmm_costs *costs) {
    nmm_context *context = &sim->context;
    nmm_contact_search *search = NULL;
    nmm_mixing mixing = {0};
    nmm_state state = sim->state;
    state.contact = NULL;
    state.n_contact = state.contact_capacity = 0;
    const size_t before = context->live_bytes;
    nmm_status status = weigh_search(context, sim, &state, &search, &mixing);
    if (status == NMM_OK) {
        costs->contact_bytes = (double)(context->live_bytes - before);
        const double start = nmm_clock();
        status = nmm_contact_find(context, search, &sim->model, &state, 0.04 * sim->model.size);
        costs->contact_seconds = nmm_clock() - start;
    }
    nmm_contact_close(context, &search);
    nmm_mixing_close(context, &mixing);
    nmm_release(context, &state.contact);
    return status;
}

// What order 0 does without.
static double curved_bytes(const nmm_model *model) {
    const double m = model->n_local, n_pair = m * (m + 1) / 2;
    if (model->order == 0) return 0;
    return sizeof(double) * (7.0 * model->n_sample + (4 * m * m + n_pair) * model->n_element);
}

static double tie_bytes(const nmm_sim *sim) {
    const double m = sim->model.n_local, n_base = sim->system.base_start[sim->model.n_cover];
    if (sim->model.n_tie == 0) return 0;
    return sizeof(double) * (m * (2 * m + 1) * sim->model.n_tie + 2 * n_base);
}

nmm_status nmm_costs_weigh(nmm_sim *sim, nmm_costs *costs) {
    const nmm_model *model = &sim->model;
    const double n = model->n_cover, number = sizeof(double);
    const double point = 3 * sizeof(float) * (double)model->n_point;
    *costs = (nmm_costs){
        .known = true,
        .curved_bytes = curved_bytes(model),
        .tie_bytes = tie_bytes(sim),
        .mean_bytes = number * (3.0 * (model->order > 0 ? model->n_sample : model->n_element) +
                                2 * n + 2.0 * model->n_support) +
                      (double)sizeof(nmm_free_body) * model->n_block,
        .hold_bytes = (1 + 2 * number) * n,
        .displacement_bytes = point,
        .velocity_bytes = point,
        .stress_bytes = 6 * sizeof(float) * (double)model->n_element,
    };
    return weigh_contact(sim, costs);
}
