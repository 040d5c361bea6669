// SPDX-License-Identifier: MIT
//
// Residual of one pass, exact at the configuration it is asked for. First the forces of each
// element, support and contact, in parallel; contact forces are gathered by loop edge, on the
// covers of its element; then every row adds up its own, in a fixed order. Equations (4.x) of
// docs/theory/4-time.md.

#include "system.h"

#include <math.h>
#include <string.h>

// Part of what may be left of the forces of a block below which the springs of one of its contacts
// hold next to nothing: many such contacts leave it together.
#define TOUCHING 0.1

// --- Loads and supports

static void loads_at(double *load, const nmm_system *system, const nmm_model *model, double time) {
    // The ground's acceleration acts on a body seen from the ground as -a.
    double ground[2] = {0, 0};
    if (model->base_motion.n > 0) nmm_history_value(&model->base_motion, time, ground);
    const double ax = model->gravity.x - ground[0], ay = model->gravity.y - ground[1];
    for (int c = 0; c < model->n_cover; c++) {
        load[2 * c] = system->cover_mass[c] * ax;
        load[2 * c + 1] = system->cover_mass[c] * ay;
    }
    for (int k = 0; k < model->n_load; k++) {
        const nmm_load *from = &model->load[k];
        double factor = 1;
        if (from->history >= 0) nmm_history_value(&model->history[from->history], time, &factor);
        for (int i = 0; i < model->n_local; i++) {
            const int c = model->element_cover[model->n_local * from->element + i];
            load[2 * c] += factor * from->weight[i] * from->force.x;
            load[2 * c + 1] += factor * from->weight[i] * from->force.y;
        }
    }
}

// Mean of what acts at the end of the step, in x, and at its start.
static void take_mean(int n, double share, double *x, const double *start) {
    for (int i = 0; i < n; i++)
        x[i] = share * x[i] + (1 - share) * start[i];
}

void nmm_system_load(nmm_system *system, const nmm_model *model, double time) {
    loads_at(system->load, system, model, time);
    if (system->start_load != NULL)
        take_mean(2 * model->n_cover, system->share, system->load, system->start_load);
}

void nmm_system_hold(const nmm_model *model, nmm_state *state, double time) {
    for (int k = 0; k < model->n_hold; k++) {
        const nmm_hold *hold = &model->hold[k];
        double moved[2] = {0, 0};
        if (hold->history >= 0) nmm_history_value(&model->history[hold->history], time, moved);
        if (hold->fix_x) state->displacement[2 * hold->cover] = moved[0];
        if (hold->fix_y) state->displacement[2 * hold->cover + 1] = moved[1];
    }
}

nmm_vec2 nmm_support_error(const nmm_model *model, const nmm_state *state, int support,
                           double time) {
    const nmm_support *s = &model->support[support];
    double moved[2] = {0, 0};
    if (s->history >= 0) nmm_history_value(&model->history[s->history], time, moved);
    nmm_vec2 error = {-moved[0], -moved[1]};
    const int *cover = model->element_cover + model->n_local * (long)s->element;
    for (int i = 0; i < model->n_local; i++) {
        const double *d = state->displacement + 2 * (long)cover[i];
        error.x += s->weight[i] * d[0];
        error.y += s->weight[i] * d[1];
    }
    if (!s->fix_x) error.x = 0;
    if (!s->fix_y) error.y = 0;
    return error;
}

nmm_vec2 nmm_support_reaction(const nmm_model *model, const nmm_state *state, int support,
                              nmm_vec2 error) {
    const double k = model->support[support].stiffness;
    const double *carried = state->support_force + 2 * (long)support;
    return (nmm_vec2){carried[0] - k * error.x, carried[1] - k * error.y};
}

// --- Parts

// Elements in chunks, and several of a chunk at a time.
enum { CHUNK = 256 };

static void fill_elements(const nmm_system *system, const nmm_model *model, const nmm_state *state,
                          const nmm_inner *inner, int first, int end) {
    if (model->order == 0)
        nmm_inner_fill(model, state, system->elastic, inner, first, end);
    else
        nmm_curved_inner_fill(model, state, system->elastic, inner, first, end);
}

// Chunk k of listed elements, run by run of those that follow each other.
static void fill_listed(const nmm_system *system, const nmm_model *model, const nmm_state *state,
                        const nmm_inner *inner, const nmm_items *list, int k) {
    const int end = nmm_min_int(list->n, (k + 1) * CHUNK);
    int first = k * CHUNK;
    for (int i = first + 1; i <= end; i++) {
        if (i < end && list->item[i] == list->item[i - 1] + 1) continue;
        fill_elements(system, model, state, inner, list->item[first], list->item[i - 1] + 1);
        first = i;
    }
}

// Stress and inner forces of each element, eq. (3.8).
static void elements_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          const nmm_step_state *step, const nmm_items *list, int n_thread) {
    const int n = list != NULL ? list->n : model->n_element, n_chunk = (n + CHUNK - 1) / CHUNK;
    const nmm_inner inner = {.piola = system->piola,
                             .force = system->element_force,
                             .start = system->start_stress,
                             .moved = step->moved,
                             .share = system->share};
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int k = 0; k < n_chunk; k++) {
        if (list != NULL)
            fill_listed(system, model, state, &inner, list, k);
        else
            fill_elements(system, model, state, &inner, k * CHUNK, nmm_min_int(n, (k + 1) * CHUNK));
    }
}

// Acceleration at the end of the step, eq. (4.1), with mass-proportional damping added.
static void acceleration_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                              const nmm_step_state *step) {
    const double h = step->h, alpha = system->damping;
    const double of_way = 2 / h, of_change = 1 / h;
    for (int i = 0; i < 2 * model->n_cover; i++) {
        const double end_velocity = of_way * step->moved[i] - state->velocity[i];
        system->acceleration[i] =
            of_change * (end_velocity - state->velocity[i]) + alpha * end_velocity;
    }
}

// Few, and their histories are read: serial.
static void reactions_at(double *force, const nmm_model *model, const nmm_state *state,
                         double time) {
    for (int s = 0; s < model->n_support; s++) {
        const nmm_vec2 error = nmm_support_error(model, state, s, time);
        const nmm_vec2 reaction = nmm_support_reaction(model, state, s, error);
        force[2 * s] = reaction.x;
        force[2 * s + 1] = reaction.y;
    }
}

static void supports_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          double end) {
    reactions_at(system->support_force, model, state, end);
    if (system->start_reaction == NULL) return;
    take_mean(2 * model->n_support, system->share, system->support_force, system->start_reaction);
}

// --- Start of a step

// Biot stress of element e before the step.
static void start_element(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          int e) {
    const nmm_elastic elastic = system->elastic[model->element_material[e]];
    if (model->order > 0) {
        nmm_curved_biot(model, state, elastic, e, system->start_stress);
        return;
    }
    double d[6];
    for (int i = 0; i < 6; i++)
        d[i] = state->displacement[2 * model->element_cover[3 * e + i / 2] + i % 2];
    const nmm_strain strain = nmm_strain_of(d, model->element_gradient + 6 * (long)e);
    nmm_biot_of(elastic, &strain, state->initial_stress + 3 * (long)e,
                system->start_stress + 3 * (long)e);
}

void nmm_system_begin(const nmm_context *context, nmm_system *system, const nmm_model *model,
                      const nmm_state *state) {
    if (system->start_stress == NULL) return;
    const int n = model->n_element, n_thread = context->n_thread;
    loads_at(system->start_load, system, model, state->time);
    reactions_at(system->start_reaction, model, state, state->time);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int e = 0; e < n; e++)
        start_element(system, model, state, e);
}

// Both components at once.
typedef double pair __attribute__((vector_size(16)));

static inline void add_part(pair *sum, double factor, const double *from) {
    pair part;
    memcpy(&part, from, sizeof part);
    *sum += factor * part;
}

// --- Contacts

// Would springs that hold gap and slip of the contact hold next to nothing of what may be left of
// the forces of its blocks? Then its mode is a matter of what the last solve left.
static bool only_touches(const nmm_system *system, const nmm_model *model, const nmm_contact *c) {
    const double a = system->allowed[model->vertex_block[c->vertex]];
    const double b = system->allowed[model->vertex_block[c->edge]];
    // What is held asks for nothing.
    const double least = TOUCHING * (a > 0 && b > 0 ? nmm_min(a, b) : nmm_max(a, b));
    const double N = c->carried_normal - c->normal_stiffness * (c->gap - c->rest);
    const double T = c->carried_shear - c->shear_stiffness * c->slip;
    return fabs(N) < least && fabs(T) < least;
}

// By its mode; what only touches is held, as any mode balances there and this one moves least.
static nmm_spring_mode spring_mode_of(const nmm_system *system, const nmm_model *model,
                                      const nmm_contact *c) {
    if (c->mode == NMM_CONTACT_STICK || only_touches(system, model, c)) return NMM_SPRING_STICK;
    const bool back = c->mode == NMM_CONTACT_SLIDE && c->shear_force < 0;
    return back ? NMM_SPRING_SLIDE_BACK : (nmm_spring_mode)c->mode;
}

static void contacts_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          const nmm_items *list, int n_thread) {
    const int n = list != NULL ? list->n : state->n_contact;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int i = 0; i < n; i++) {
        const int k = list != NULL ? list->item[i] : i;
        double *pull = system->pull + 6 * (long)k;
        const nmm_contact *contact = &state->contact[k];
        system->mode[system->couples.place[k]] =
            (unsigned char)spring_mode_of(system, model, contact);
        if (contact->mode == NMM_CONTACT_OPEN)
            memset(pull, 0, 6 * sizeof *pull);
        else
            nmm_contact_pull(contact, pull);
    }
}

// Forces on the ends of loop edge e: of its start as a vertex, and of its own contacts.
static inline void add_ends(const nmm_system *system, int e, pair *start, pair *end) {
    const nmm_couples *couples = &system->couples;
    for (int k = couples->vertex_start[e]; k < couples->vertex_start[e + 1]; k++)
        add_part(start, 1, system->pull + 6 * (long)k);
    for (int p = couples->edge_start[e]; p < couples->edge_start[e + 1]; p++) {
        const double *of_edge = system->pull + 6 * (long)couples->by_edge[p] + 2;
        add_part(start, 1, of_edge);
        add_part(end, 1, of_edge + 2);
    }
}

// Contact forces of loop edge e on the m covers of its element, by the weights of its ends: a
// constant m makes straight code of it.
static inline void fill_edge(nmm_system *system, const nmm_model *model, int e, int m) {
    const double *weight = model->edge_weight + 2 * m * (long)e;
    double *force = system->edge_force + 2 * m * (long)e;
    pair start = {0, 0}, end = {0, 0};
    add_ends(system, e, &start, &end);
    for (int i = 0; i < m; i++) {
        const pair of_cover = weight[i] * start + weight[m + i] * end;
        memcpy(force + 2 * i, &of_cover, sizeof of_cover);
    }
}

static void edges_pass(nmm_system *system, const nmm_model *model, const nmm_items *list,
                       int n_thread) {
    const int n = list != NULL ? list->n : model->n_vertex;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int i = 0; i < n; i++) {
        const int e = list != NULL ? list->item[i] : i;
        if (model->order == 0)
            fill_edge(system, model, e, 3);
        else
            fill_edge(system, model, e, model->n_local);
    }
}

// --- Rows

static inline void add_inner(const nmm_system *system, const nmm_model *model, int c, pair *force) {
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++)
        add_part(force, 1, system->element_force + 2 * (long)model->cover_element[k]);
    if (model->n_tie > 0) add_part(force, 1, system->tie_force + 2 * (long)c);
}

static inline void add_inertia(const nmm_system *system, int c, pair *force) {
    for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++)
        add_part(force, system->base_mass[k], system->acceleration + 2 * (long)system->base_col[k]);
}

static inline void add_supports(const nmm_system *system, const nmm_model *model, int c,
                                pair *force) {
    for (int k = system->support_start[c]; k < system->support_start[c + 1]; k++) {
        const int s = system->cover_support[k] / model->n_local;
        add_part(force, model->support[s].weight[system->cover_support[k] % model->n_local],
                 system->support_force + 2 * (long)s);
    }
}

static inline void add_contacts(const nmm_system *system, int c, pair *force) {
    for (int k = system->edge_start[c]; k < system->edge_start[c + 1]; k++)
        add_part(force, 1, system->edge_force + 2 * (long)system->cover_edge[k]);
}

static void add_row(nmm_system *system, const nmm_model *model, int c) {
    pair inner = {0, 0}, inertia = {0, 0}, support = {0, 0}, contact = {0, 0}, load;
    add_inner(system, model, c, &inner);
    add_inertia(system, c, &inertia);
    add_supports(system, model, c, &support);
    if (system->couples.n > 0) add_contacts(system, c, &contact);
    memcpy(&load, system->load + 2 * (long)c, sizeof load);
    const pair sum = load - inner - inertia + support + contact;
    const pair squares =
        load * load + inner * inner + inertia * inertia + support * support + contact * contact;
    system->scale[c] = squares[0] + squares[1];
    if (system->contact_force != NULL)
        memcpy(system->contact_force + 2 * (long)c, &contact, sizeof contact);
    memcpy(system->residual + 2 * (long)c, &sum, sizeof sum);
    for (int x = 0; x < 2 && system->fixed != NULL; x++) {
        if (!(system->fixed[c] >> x & 1)) continue;
        system->residual[2 * (long)c + x] = 0;
        system->reaction[2 * (long)c + x] = -sum[x];
    }
}

void nmm_system_residual(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, const nmm_step_state *step,
                         const nmm_touched *touched) {
    const int n_thread = context->n_thread;
    const nmm_items *row = touched != NULL ? &touched->row : NULL;
    const int n = row != NULL ? row->n : model->n_cover;
    NMM_ASSERT(system->couples.n_contact == state->n_contact);
    elements_pass(system, model, state, step, touched != NULL ? &touched->element : NULL, n_thread);
    nmm_ties_force(system, model, state, step->moved, n_thread);
    acceleration_pass(system, model, state, step);
    supports_pass(system, model, state, step->end);
    if (state->n_contact > 0) {
        contacts_pass(system, model, state, touched != NULL ? &touched->contact : NULL, n_thread);
        edges_pass(system, model, touched != NULL ? &touched->edge : NULL, n_thread);
    }
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int i = 0; i < n; i++)
        add_row(system, model, row != NULL ? row->item[i] : i);
}
