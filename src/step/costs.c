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

// Numbers of an element with m functions, without its samples.
static double curved_numbers(double m) {
    return 4 * m * m + m * (m + 1) / 2;
}

// Order 0 does without one function for each edge of a triangle, two covers that meet, and without
// the matrices and products of six functions in each element.
static void weigh_order(const nmm_sim *sim, nmm_costs *costs) {
    const nmm_model *model = &sim->model;
    const double n = model->n_element;
    if (model->order > 0) {
        costs->curved_bytes =
            sizeof(double) * (7.0 * model->n_sample + curved_numbers(model->n_local) * n);
    } else if (!model->whole_blocks) {
        costs->curved_bytes = sizeof(double) * curved_numbers(6) * n;
        costs->curved_unknowns = sim->system.base_start[model->n_cover] - model->n_cover;
    }
}

// Ties add to the matrix at places of their own, so the first one brings two numbers for each.
static double tie_bytes(const nmm_sim *sim) {
    const double m = sim->model.n_local, n_base = sim->system.base_start[sim->model.n_cover];
    if (sim->model.order == 0) return 0;
    return sizeof(double) * (m * (2 * m + 1) * sim->model.n_tie + 2 * n_base);
}

// Place, two vectors and four numbers, four indices and two flags of each contact.
#define CONTACT_ROW (3 * sizeof(double) + (6 + 4) * sizeof(float) + 4 * sizeof(int) + 2)

nmm_status nmm_costs_weigh(nmm_sim *sim, nmm_costs *costs) {
    const nmm_model *model = &sim->model;
    const double n = model->n_cover, number = sizeof(double);
    const double point = 3 * sizeof(float) * (double)model->n_point;
    *costs = (nmm_costs){
        .known = true,
        .tie_bytes = tie_bytes(sim),
        .mean_bytes = number * (3.0 * (model->order > 0 ? model->n_sample : model->n_element) +
                                2 * n + 2.0 * model->n_support) +
                      (double)sizeof(nmm_free_body) * model->n_block,
        .hold_bytes = (1 + 2 * number) * n,
        .support_bytes = (sizeof(nmm_support) + 6 * number) * nmm_max_int(1, model->n_support),
        .load_bytes = (double)sizeof(nmm_load) * nmm_max_int(1, model->n_load),
        .monitor_bytes = (double)sizeof(nmm_monitor) * nmm_max_int(1, model->n_monitor),
        .initial_bytes = 3 * number * (double)(model->n_element + model->n_sample),
        .displacement_bytes = point,
        .velocity_bytes = point,
        .stress_bytes = 6 * sizeof(float) * (double)model->n_element,
        .contact_rows = (double)CONTACT_ROW * sim->state.n_contact,
    };
    weigh_order(sim, costs);
    return weigh_contact(sim, costs);
}
