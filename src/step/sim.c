// SPDX-License-Identifier: MIT
//
// Life of a simulation: from a scene file to a model at rest, and the questions one can ask of it.

#include "step.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

nmm_sim_def nmm_default_sim_def(void) {
    return (nmm_sim_def){0};
}

// --- Create

static nmm_status read_scene(nmm_sim *sim, const nmm_sim_def *def) {
    if (def->path == NULL) {
        return nmm_fail(&sim->context, NMM_ERROR_ARGUMENT, "nmm_sim_def.path is NULL");
    }
    if (def->text == NULL) {
        return nmm_scene_read(&sim->context, &sim->scene, def->path, def->n_override,
                              def->override);
    }
    return nmm_scene_parse(&sim->context, &sim->scene, def->path, def->text, def->text_length,
                           def->n_override, def->override);
}

void nmm_wave_squares(const nmm_model *model, double *slowest, double *fastest) {
    *slowest = INFINITY, *fastest = 0;
    for (int m = 0; m < model->n_material; m++) {
        const nmm_material *material = &model->material[m];
        const double square = material->youngs_modulus / material->density;
        *slowest = nmm_min(*slowest, square);
        *fastest = nmm_max(*fastest, square);
    }
}

// Steps of statics: from what a wave takes through a cover to where inertia is next to nothing.
static void complete_static(nmm_sim *sim) {
    nmm_scene_settings *settings = &sim->settings;
    double slowest, fastest;
    nmm_wave_squares(&sim->model, &slowest, &fastest);
    const double longest = 1e5 * sim->model.size / sqrt(slowest);
    if (settings->dt <= 0) settings->dt = 10 * sim->model.size / sqrt(fastest);
    if (settings->dt_max <= settings->dt) settings->dt_max = nmm_max(settings->dt, longest);
    if (settings->dt_min <= 0) settings->dt_min = 1e-6 * settings->dt;
}

// What was left on auto, decided.
static void complete_settings(nmm_sim *sim) {
    nmm_scene_settings *settings = &sim->settings;
    *settings = sim->scene.settings;
    if (settings->dt_max <= 0) settings->dt_max = settings->dt;
    settings->cover_size = sim->model.size;
    if (settings->penalty <= 0) settings->penalty = 20;
    if (settings->is_static) complete_static(sim);
    sim->state.dt = settings->dt;
    sim->allowed = settings->max_move * sim->model.height;
}

static nmm_status open_contact(nmm_sim *sim, bool always) {
    bool can_be = true;
    if (!always) TRY(nmm_contact_can_be(&sim->context, &sim->model, &can_be));
    if (!can_be) return NMM_OK;
    // Contacts are found once a step: nothing may pass through an edge within it.
    sim->allowed = nmm_min(sim->allowed, 0.25 * sim->model.size);
    const nmm_contact_options options = {
        .penalty = sim->settings.penalty,
        .augmented = sim->settings.contact_method == NMM_CONTACT_AUGMENTED,
    };
    return nmm_contact_open(&sim->context, &sim->model, &options, &sim->search);
}

nmm_solve_method nmm_step_method(const nmm_sim *sim) {
    static const nmm_solve_method method[] = {
        [NMM_METHOD_AUTO] = NMM_SOLVE_AUTO,
        [NMM_METHOD_JACOBI] = NMM_SOLVE_JACOBI,
        [NMM_METHOD_PCG] = NMM_SOLVE_PCG,
        [NMM_METHOD_SOR] = NMM_SOLVE_SOR,
        [NMM_METHOD_GAUSS_SEIDEL] = NMM_SOLVE_GAUSS_SEIDEL,
        [NMM_METHOD_CHEBYSHEV] = NMM_SOLVE_CHEBYSHEV,
        [NMM_METHOD_DIRECT] = NMM_SOLVE_DIRECT,
    };
    const bool is_auto = sim->settings.method == NMM_METHOD_AUTO;
    return is_auto && sim->comparable ? NMM_SOLVE_PCG : method[sim->settings.method];
}

nmm_solve_precision nmm_step_precision(const nmm_sim *sim) {
    static const nmm_solve_precision precision[] = {
        [NMM_SCENE_DOUBLE] = NMM_PRECISION_DOUBLE,
        [NMM_SCENE_MIXED] = NMM_PRECISION_MIXED,
        [NMM_SCENE_PRECISION_AUTO] = NMM_PRECISION_AUTO,
    };
    const bool is_auto = sim->settings.precision == NMM_SCENE_PRECISION_AUTO;
    return is_auto && sim->comparable ? NMM_PRECISION_DOUBLE : precision[sim->settings.precision];
}

nmm_status nmm_step_backend(nmm_context *context, nmm_device_choice device,
                            const nmm_solve_backend **backend) {
    *backend = nmm_solve_host();
    if (device != NMM_DEVICE_TARGET) return NMM_OK;
    *backend = nmm_solve_target();
    if (*backend == NULL) {
        return nmm_fail(context, NMM_ERROR_DEVICE,
                        "no target device: this build of nmm has no offload backend");
    }
    if (nmm_solve_target_devices() > 0) return NMM_OK;
    return nmm_fail(context, NMM_ERROR_DEVICE,
                    "no target device: the runtime ran a target region on the host");
}

static nmm_status choose_backend(nmm_sim *sim, nmm_device_choice device) {
    TRY(nmm_step_backend(&sim->context, device, &sim->backend));
    nmm_summary *summary = &sim->summary;
    snprintf(summary->method, sizeof summary->method, "%s",
             nmm_solve_method_name(nmm_step_method(sim)));
    snprintf(summary->device, sizeof summary->device, "%s", sim->backend->name);
    snprintf(summary->precision_asked, sizeof summary->precision_asked, "%s",
             nmm_solve_precision_word[nmm_step_precision(sim)]);
    snprintf(summary->precision, sizeof summary->precision, "double");
    return NMM_OK;
}

static nmm_status allocate_start(nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const size_t n = 2 * (size_t)model->n_cover;
    if (sim->system.start_stress != NULL)
        TRY(nmm_allocate(&sim->context, &sim->free_body, (size_t)model->n_block,
                         sizeof *sim->free_body));
    if (sim->search != NULL) {
        TRY(nmm_mixing_open(&sim->context, &sim->mixing, (int)n));
        TRY(nmm_motion_open(&sim->context, &sim->motion, model));
    }
    TRY(nmm_allocate(&sim->context, &sim->moved, n, sizeof(double)));
    TRY(nmm_allocate(&sim->context, &sim->start_displacement, n, sizeof(double)));
    TRY(nmm_allocate(&sim->context, &sim->start_velocity, n, sizeof(double)));
    TRY(nmm_allocate(&sim->context, &sim->start_position, 2 * (size_t)model->n_point,
                     sizeof(double)));
    TRY(nmm_raising_open(&sim->context, &sim->raising, model));
    return nmm_allocate(&sim->context, &sim->start_support, 2 * (size_t)model->n_support,
                        sizeof(double));
}

static nmm_status build(nmm_sim *sim, const nmm_sim_def *def) {
    TRY(read_scene(sim, def));
    TRY(nmm_cover_build(&sim->context, &sim->scene, &sim->model, &sim->cover));
    TRY(nmm_loads_place(&sim->context, &sim->scene, &sim->model));
    TRY(nmm_state_create(&sim->context, &sim->model, &sim->state));
    nmm_loads_start(&sim->scene, &sim->model, &sim->state);
    complete_settings(sim);
    TRY(open_contact(sim, def->search_always != 0));
    const bool scene_says = def->device == NMM_DEVICE_SCENE;
    TRY(choose_backend(sim, scene_says ? sim->settings.device : def->device));
    TRY(nmm_system_create(&sim->context, &sim->model, &sim->settings, &sim->system));
    TRY(nmm_balance_open(&sim->context, &sim->balance, &sim->model, &sim->system));
    sim->system.allowed = sim->balance.allowed;
    TRY(allocate_start(sim));
    nmm_ledger_start(sim);
    return nmm_sim_describe(sim);
}

nmm_status nmm_sim_create(nmm_sim **sim, const nmm_sim_def *def) {
    // The handle itself comes from the hook too, through a context that it then takes over.
    nmm_context context = {.allocate = def->allocate, .user = def->user};
    context.n_thread = def->n_thread > 0 ? def->n_thread : nmm_max_int(1, omp_get_max_threads());
    TRY(nmm_allocate(&context, sim, 1, sizeof **sim));
    (*sim)->context = context;
    (*sim)->started = nmm_clock();
    (*sim)->comparable = def->comparable != 0;
    return build(*sim, def);
}

void nmm_sim_destroy(nmm_sim *sim) {
    if (sim == NULL) return;
    nmm_context *context = &sim->context;
    if (sim->backend != NULL) sim->backend->close(context, &sim->solver);
    nmm_contact_close(context, &sim->search);
    nmm_system_destroy(context, &sim->system);
    nmm_mixing_close(context, &sim->mixing);
    nmm_motion_close(context, &sim->motion);
    nmm_nearby_close(context, &sim->nearby);
    nmm_balance_close(context, &sim->balance);
    nmm_release(context, &sim->free_body);
    nmm_release(context, &sim->moved);
    nmm_release(context, &sim->start_displacement);
    nmm_release(context, &sim->start_velocity);
    nmm_release(context, &sim->start_position);
    nmm_release(context, &sim->start_support);
    nmm_raising_close(context, &sim->raising);
    nmm_state_destroy(context, &sim->state);
    nmm_model_destroy(context, &sim->model);
    nmm_scene_destroy(context, &sim->scene);
    nmm_context last = *context;
    nmm_release(&last, &sim);
}

// --- Questions

const nmm_error *nmm_sim_error(const nmm_sim *sim) {
    static const nmm_error no_memory = {.status = NMM_ERROR_MEMORY, .message = "out of memory"};
    return sim != NULL ? &sim->context.error : &no_memory;
}

const char *nmm_sim_mistakes(const nmm_sim *sim) {
    return sim != NULL ? sim->scene.report : NULL;
}

const char *nmm_sim_warnings(const nmm_sim *sim) {
    return sim != NULL && sim->scene.warnings != NULL ? sim->scene.warnings : "";
}

nmm_status nmm_sim_check(nmm_sim *sim, nmm_check *check) {
    const nmm_model *model = &sim->model;
    if (sim->state.step == 0 && sim->search != NULL) {
        TRY(nmm_contact_find(&sim->context, sim->search, model, &sim->state, 0.04 * model->size));
    }
    TRY(nmm_system_pattern(&sim->context, &sim->system, model, &sim->state));
    // The solver keeps the matrix once more, and about eight vectors.
    const double solver = 40.0 * sim->system.K.row_start[model->n_cover] + 128.0 * model->n_cover;
    *check = (nmm_check){
        .blocks = model->n_block,
        .elements = model->n_element,
        .covers = model->whole_blocks ? model->n_block : model->n_cover,
        .unknowns = 2 * model->n_cover,
        .points = model->n_point,
        .vertices = model->n_vertex,
        .contacts = sim->state.n_contact,
        .trimmed = sim->cover.n_trimmed,
        .trimmed_length = sim->cover.trimmed_length,
        .joints_outside = sim->cover.n_joint_outside,
        .area = sim->cover.area,
        .mean_area = sim->cover.mean_area,
        .smallest_area = sim->cover.smallest_area,
        .whole_blocks = model->whole_blocks,
        .cover_size = model->size,
        .memory_bytes = (double)sim->context.live_bytes + solver,
    };
    TRY(nmm_costs_weigh(sim, &sim->costs));
    return nmm_sim_describe(sim);
}

void nmm_sim_interrupt(nmm_sim *sim) {
    if (sim->summary.end == NMM_END_RUNNING) sim->summary.end = NMM_END_INTERRUPTED;
}

void nmm_sim_summary(nmm_sim *sim, nmm_summary *summary) {
    nmm_watch_tell(sim);
    nmm_summary *s = &sim->summary;
    s->blocks = sim->model.n_block;
    s->elements = sim->model.n_element;
    s->covers = sim->model.whole_blocks ? sim->model.n_block : sim->model.n_cover;
    s->unknowns = 2 * sim->model.n_cover;
    s->contacts = sim->state.n_contact;
    s->cover_size = sim->model.size;
    s->is_static = sim->settings.is_static;
    s->steps = sim->state.step;
    s->time = sim->state.time;
    s->wall_seconds = nmm_clock() - sim->started;
    s->energy = sim->energy;
    s->state_hash = nmm_state_hash(&sim->model, &sim->state);
    *summary = *s;
}

nmm_view nmm_sim_view(const nmm_sim *sim, const char *field) {
    const nmm_model *model = &sim->model;
    const nmm_state *state = &sim->state;
    const struct {
        const char *name;
        nmm_view view;
    } known[] = {
        {"displacement", {state->displacement, model->n_cover, 2, "m"}},
        {"velocity", {state->velocity, model->n_cover, 2, "m/s"}},
        {"position", {state->position, model->n_point, 2, "m"}},
        {"stress", {state->stress, model->n_element, 3, "Pa"}},
    };
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        if (strcmp(field, known[i].name) == 0) return known[i].view;
    }
    return (nmm_view){0};
}

int nmm_sim_monitors(const nmm_sim *sim) {
    return sim->model.n_monitor;
}

nmm_status nmm_sim_monitor(const nmm_sim *sim, int k, nmm_reading *reading) {
    if (k < 0 || k >= sim->model.n_monitor) return NMM_ERROR_ARGUMENT;
    const nmm_monitor *monitor = &sim->model.monitor[k];
    const nmm_state *state = &sim->state;
    *reading = (nmm_reading){
        .name = monitor->name,
        .has_displacement = monitor->displacement,
        .has_velocity = monitor->velocity,
        .has_stress = monitor->stress,
    };
    const int m = sim->model.n_local;
    for (int i = 0; i < 2 * m; i++) {
        const int c = sim->model.element_cover[m * monitor->element + i / 2];
        const double w = monitor->weight[i / 2];
        if (monitor->displacement)
            reading->displacement[i % 2] += w * state->displacement[2 * c + i % 2];
        if (monitor->velocity) reading->velocity[i % 2] += w * state->velocity[2 * c + i % 2];
    }
    const bool exact = sim->model.order > 0; // else it is the same all over the element
    for (int i = 0; i < 3 && monitor->stress; i++)
        reading->stress[i] = state->stress[3 * monitor->element + i];
    if (monitor->stress && exact) {
        const int material = sim->model.element_material[monitor->element];
        nmm_curved_stress_at(&sim->model, state, sim->system.elastic[material], monitor,
                             reading->stress);
    }
    return NMM_OK;
}

double nmm_sim_end_time(const nmm_sim *sim) {
    return sim->settings.end;
}

const char *nmm_sim_title(const nmm_sim *sim) {
    return sim->scene.title != NULL ? sim->scene.title : "";
}
