// SPDX-License-Identifier: MIT
//
// Bodies that nothing holds. What passes leave of the forces, and what rounding makes of stiff
// ones, is a push and a torque on a whole body: next to nothing in a step, but step after step it
// changes momenta that Newmark's scheme keeps exactly. Here the body is moved rigidly until both
// vanish, about the places half way, where inner forces have no moment either, eq. (4.13).

#include "step.h"

#include <string.h>

// Bodies without supports, held covers and closed contacts with others.
static void find_free(nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const unsigned char *fixed = sim->system.fixed;
    for (int b = 0; b < model->n_block; b++)
        sim->free_body[b] = (nmm_free_body){.free = true};
    for (int c = 0; c < model->n_cover && fixed != NULL; c++)
        if (fixed[c] != 0) sim->free_body[model->cover_block[c]].free = false;
    for (int s = 0; s < model->n_support; s++)
        sim->free_body[model->element_block[model->support[s].element]].free = false;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        const int a = model->vertex_block[contact->vertex], b = model->vertex_block[contact->edge];
        if (contact->mode == NMM_CONTACT_OPEN || a == b) continue;
        sim->free_body[a].free = sim->free_body[b].free = false;
    }
}

// The free body that cover c moves rigidly with others; NULL: none.
static nmm_free_body *body_of(const nmm_sim *sim, int c) {
    const int b = nmm_system_body(&sim->system, &sim->model)[c];
    return b >= 0 && sim->free_body[b].free ? &sim->free_body[b] : NULL;
}

static nmm_vec2 half_way(const nmm_sim *sim, int c) {
    const double *X = sim->model.cover_place + 2 * (long)c, *moved = sim->moved + 2 * (long)c;
    const double *d = sim->state.displacement + 2 * (long)c;
    return (nmm_vec2){X[0] + d[0] - 0.5 * moved[0], X[1] + d[1] - 0.5 * moved[1]};
}

static void find_centres(nmm_sim *sim) {
    for (int c = 0; c < sim->model.n_cover; c++) {
        nmm_free_body *body = body_of(sim, c);
        if (body == NULL) continue;
        const double mass = sim->system.cover_mass[c];
        body->mass += mass;
        body->centre = nmm_vec2_add(body->centre, nmm_vec2_scale(mass, half_way(sim, c)));
    }
    for (int b = 0; b < sim->model.n_block; b++)
        sim->free_body[b].centre =
            nmm_vec2_scale(1 / sim->free_body[b].mass, sim->free_body[b].centre);
}

// Push and torque of what is left, moment of inertia about the centre.
static void add_cover(const nmm_sim *sim, int c, nmm_free_body *body) {
    const nmm_system *system = &sim->system;
    const double *left = system->residual + 2 * (long)c;
    const nmm_vec2 r = {left[0], left[1]};
    const nmm_vec2 x = nmm_vec2_sub(half_way(sim, c), body->centre);
    nmm_vec2 moment = {0, 0};
    for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
        const int other = system->base_col[k];
        if (body_of(sim, other) == NULL) continue;
        const nmm_vec2 at = nmm_vec2_sub(half_way(sim, other), body->centre);
        moment = nmm_vec2_add(moment, nmm_vec2_scale(system->base_mass[k], at));
    }
    body->push = nmm_vec2_add(body->push, r);
    body->torque += nmm_vec2_cross(x, r);
    body->inertia += nmm_vec2_dot(x, moment);
}

// The rigid motion that takes both away, in `change`; `resistance` [1/s2] is that of mass.
static void find_change(nmm_sim *sim, double resistance) {
    double *change = sim->system.change;
    memset(change, 0, 2 * (size_t)sim->model.n_cover * sizeof *change);
    for (int c = 0; c < sim->model.n_cover; c++) {
        const nmm_free_body *body = body_of(sim, c);
        if (body == NULL) continue;
        const double turn = body->torque / (body->inertia * resistance);
        const nmm_vec2 shift = nmm_vec2_scale(1 / (body->mass * resistance), body->push);
        const nmm_vec2 x = nmm_vec2_sub(half_way(sim, c), body->centre);
        change[2 * c] = shift.x - turn * x.y;
        change[2 * c + 1] = shift.y + turn * x.x;
    }
}

// Only inertia resists.
static void apply_change(nmm_sim *sim, double resistance) {
    nmm_system *system = &sim->system;
    for (int c = 0; c < sim->model.n_cover; c++) {
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
            const double mass = resistance * system->base_mass[k];
            const double *change = system->change + 2 * (long)system->base_col[k];
            system->residual[2 * c] -= mass * change[0];
            system->residual[2 * c + 1] -= mass * change[1];
        }
        for (int i = 2 * c; i < 2 * c + 2; i++) {
            sim->moved[i] += system->change[i];
            sim->state.displacement[i] = sim->start_displacement[i] + sim->moved[i];
        }
    }
}

void nmm_free_balance(nmm_sim *sim, double h) {
    if (sim->free_body == NULL) return;
    const double resistance = 2 / (h * h) + 2 * sim->system.damping / h;
    find_free(sim);
    find_centres(sim);
    for (int c = 0; c < sim->model.n_cover; c++) {
        nmm_free_body *body = body_of(sim, c);
        if (body != NULL) add_cover(sim, c, body);
    }
    find_change(sim, resistance);
    apply_change(sim, resistance);
    nmm_state_place(&sim->model, &sim->state, sim->context.n_thread);
}
