// SPDX-License-Identifier: MIT
//
// Residual and matrix of one pass. First each element's and contact's own quantities, in parallel;
// then every row gathers from its elements, supports and contacts, in a fixed order.
// Equations (4.x) of docs/theory/4-time.md.

#include "system.h"

#include <math.h>
#include <string.h>

// --- Loads and supports

void nmm_system_load(nmm_system *system, const nmm_model *model, double time) {
    // The ground's acceleration acts on a body seen from the ground as -a.
    double ground[2] = {0, 0};
    if (model->base_motion.n > 0) nmm_history_value(&model->base_motion, time, ground);
    const double ax = model->gravity.x - ground[0], ay = model->gravity.y - ground[1];
    for (int c = 0; c < model->n_cover; c++) {
        system->load[2 * c] = system->cover_mass[c] * ax;
        system->load[2 * c + 1] = system->cover_mass[c] * ay;
    }
    for (int k = 0; k < model->n_load; k++) {
        const nmm_load *load = &model->load[k];
        double factor = 1;
        if (load->history >= 0) nmm_history_value(&model->history[load->history], time, &factor);
        for (int i = 0; i < 3; i++) {
            const int c = model->element_cover[3 * load->element + i];
            system->load[2 * c] += factor * load->weight[i] * load->force.x;
            system->load[2 * c + 1] += factor * load->weight[i] * load->force.y;
        }
    }
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
    for (int i = 0; i < 3; i++) {
        const double *d = state->displacement + 2 * model->element_cover[3 * s->element + i];
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

// --- Residual

// Stress and stiffness of each element, eq. (3.8) and (3.10).
static void elements_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          int n_thread) {
    const int n = model->n_element;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int e = 0; e < n; e++) {
        const int *cover = model->element_cover + 3 * (long)e;
        const double *gradient = model->element_gradient + 6 * (long)e;
        const double *initial = state->initial_stress + 3 * (long)e;
        double d[6];
        for (int i = 0; i < 6; i++)
            d[i] = state->displacement[2 * cover[i / 2] + i % 2];
        const nmm_elastic elastic = nmm_elastic_of(&model->material[model->element_material[e]]);
        const nmm_strain strain = nmm_strain_of(d, gradient);
        const nmm_tensor P = nmm_piola_of(elastic, &strain, initial);
        double *piola = system->piola + 4 * (long)e;
        piola[0] = P.xx, piola[1] = P.xy, piola[2] = P.yx, piola[3] = P.yy;
        system->stiffness[e] = nmm_stiffness_of(elastic, &strain, 0.5 * (initial[0] + initial[1]),
                                                model->element_area[e], gradient);
    }
}

// Acceleration at the end of the step, eq. (4.1), with mass-proportional damping added.
static void acceleration_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                              const nmm_step_state *step) {
    const double h = step->h, alpha = system->damping;
    for (int i = 0; i < 2 * model->n_cover; i++) {
        const double end_velocity = 2 * step->moved[i] / h - state->velocity[i];
        system->acceleration[i] = (end_velocity - state->velocity[i]) / h + alpha * end_velocity;
    }
}

// Internal and inertia forces of row c.
static void gather_elements(const nmm_system *system, const nmm_model *model, int c,
                            double inner[2], double inertia[2]) {
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int e = model->cover_element[k] / 3, i = model->cover_element[k] % 3;
        const double *P = system->piola + 4 * (long)e;
        const double *g = model->element_gradient + 6 * (long)e + 2 * i;
        const double area = model->element_area[e];
        inner[0] += area * (P[0] * g[0] + P[1] * g[1]);
        inner[1] += area * (P[2] * g[0] + P[3] * g[1]);
        for (int j = 0; j < 3; j++) {
            const double m = system->element_mass[6 * (long)e + nmm_mass_index(i, j)];
            const double *a = system->acceleration + 2 * (long)model->element_cover[3 * e + j];
            inertia[0] += m * a[0];
            inertia[1] += m * a[1];
        }
    }
}

static void gather_supports(const nmm_system *system, const nmm_model *model,
                            const nmm_state *state, const nmm_step_state *step, int c,
                            double force[2]) {
    for (int k = system->support_start[c]; k < system->support_start[c + 1]; k++) {
        const int s = system->cover_support[k] / 3;
        const double w = model->support[s].weight[system->cover_support[k] % 3];
        const nmm_vec2 error = nmm_support_error(model, state, s, step->end);
        const nmm_vec2 reaction = nmm_support_reaction(model, state, s, error);
        force[0] += w * reaction.x;
        force[1] += w * reaction.y;
    }
}

static void gather_contacts(const nmm_system *system, const nmm_state *state, int c,
                            double force[2]) {
    for (int k = system->contact_start[c]; k < system->contact_start[c + 1]; k++) {
        const int i = system->cover_contact[k] % 6;
        const nmm_contact *contact = &state->contact[system->cover_contact[k] / 6];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        const nmm_contact_row *row = &system->row[system->cover_contact[k] / 6];
        for (int x = 0; x < 2; x++) {
            force[x] +=
                contact->normal_force * row->normal[i][x] + contact->shear_force * row->shear[i][x];
        }
    }
}

static void contacts_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                          int n_thread) {
    const int n = state->n_contact;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int k = 0; k < n; k++) {
        if (state->contact[k].mode == NMM_CONTACT_OPEN) continue;
        system->row[k] = nmm_contact_row_of(model, state, &state->contact[k]);
    }
}

void nmm_system_residual(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, const nmm_step_state *step) {
    const int n_thread = context->n_thread, n = model->n_cover;
    NMM_ASSERT(system->n_contact == state->n_contact);
    elements_pass(system, model, state, n_thread);
    acceleration_pass(system, model, state, step);
    contacts_pass(system, model, state, n_thread);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        double inner[2] = {0, 0}, inertia[2] = {0, 0}, support[2] = {0, 0}, contact[2] = {0, 0};
        gather_elements(system, model, c, inner, inertia);
        gather_supports(system, model, state, step, c, support);
        gather_contacts(system, state, c, contact);
        system->scale[c] = 0;
        for (int x = 0; x < 2; x++) {
            const double load = system->load[2 * c + x];
            const bool held = system->fixed != NULL && (system->fixed[c] >> x & 1);
            const double sum = load - inner[x] - inertia[x] + support[x] + contact[x];
            system->residual[2 * c + x] = held ? 0 : sum;
            if (held) system->reaction[2 * c + x] = -sum;
            system->scale[c] += load * load + inner[x] * inner[x] + inertia[x] * inertia[x] +
                                support[x] * support[x] + contact[x] * contact[x];
        }
    }
    // One root per row keeps the sum of squares from overflowing before it is needed.
    double total = 0;
    for (int c = 0; c < n; c++)
        total += system->scale[c];
    system->force_scale = sqrt(total);
}

// --- Matrix

static void add_diagonal(double *block, double x, double y) {
    block[0] += x;
    block[3] += y;
}

static void assemble_elements(nmm_system *system, const nmm_model *model, int c, double inertia) {
    nmm_bsr *K = &system->K;
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int e = model->cover_element[k] / 3, i = model->cover_element[k] % 3;
        for (int j = 0; j < 3; j++) {
            double *block =
                K->value + 4 * (long)system->place[system->base_slot[9 * (long)e + 3 * i + j]];
            nmm_stiffness_add(&system->stiffness[e], i, j, block);
            const double m = inertia * system->element_mass[6 * (long)e + nmm_mass_index(i, j)];
            add_diagonal(block, m, m);
        }
    }
}

static void assemble_supports(nmm_system *system, const nmm_model *model, int c) {
    for (int k = system->support_start[c]; k < system->support_start[c + 1]; k++) {
        const int i = system->cover_support[k] % 3;
        const nmm_support *s = &model->support[system->cover_support[k] / 3];
        for (int j = 0; j < 3; j++) {
            const int slot = system->base_slot[9 * (long)s->element + 3 * i + j];
            const double w = s->stiffness * s->weight[i] * s->weight[j];
            add_diagonal(system->K.value + 4 * (long)system->place[slot], s->fix_x ? w : 0,
                         s->fix_y ? w : 0);
        }
    }
}

static void assemble_contacts(nmm_system *system, const nmm_state *state, int c) {
    for (int k = system->contact_start[c]; k < system->contact_start[c + 1]; k++) {
        const int i = system->cover_contact[k] % 6;
        const long contact = system->cover_contact[k] / 6;
        const nmm_contact *p = &state->contact[contact];
        if (p->mode == NMM_CONTACT_OPEN) continue;
        const nmm_contact_row *row = &system->row[contact];
        const double kn = p->normal_stiffness;
        const double ks = p->mode == NMM_CONTACT_STICK ? p->shear_stiffness : 0;
        const double across[2] = {kn * row->normal[i][0], kn * row->normal[i][1]};
        const double along[2] = {ks * row->shear[i][0], ks * row->shear[i][1]};
        const int *slot = system->contact_slot + 36 * contact + 6 * (long)i;
        for (int j = 0; j < 6; j++) {
            double *block = system->K.value + 4 * (long)slot[j];
            const double n0 = row->normal[j][0], n1 = row->normal[j][1];
            const double s0 = row->shear[j][0], s1 = row->shear[j][1];
            const double sum[4] = {
                block[0] + (across[0] * n0 + along[0] * s0),
                block[1] + (across[0] * n1 + along[0] * s1),
                block[2] + (across[1] * n0 + along[1] * s0),
                block[3] + (across[1] * n1 + along[1] * s1),
            };
            memcpy(block, sum, sizeof sum);
        }
    }
}

// Held unknowns leave the system: their couplings vanish, their diagonal stays as a scale.
static void remove_held(nmm_system *system, int c) {
    nmm_bsr *K = &system->K;
    for (int k = K->row_start[c]; k < K->row_start[c + 1]; k++) {
        double *block = K->value + 4 * (long)k;
        for (int x = 0; x < 4; x++) {
            const bool row_held = system->fixed[c] >> (x / 2) & 1;
            const bool col_held = system->fixed[K->col[k]] >> (x % 2) & 1;
            const bool diagonal = K->col[k] == c && x / 2 == x % 2;
            if ((row_held || col_held) && !diagonal) block[x] = 0;
        }
    }
}

void nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h) {
    const int n_thread = context->n_thread, n = model->n_cover;
    const double inertia = 2 / (h * h) + 2 * system->damping / h;
    nmm_bsr *K = &system->K;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        const long begin = K->row_start[c], end = K->row_start[c + 1];
        memset(K->value + 4 * begin, 0, 4 * (size_t)(end - begin) * sizeof(double));
        assemble_elements(system, model, c, inertia);
        assemble_supports(system, model, c);
        assemble_contacts(system, state, c);
        if (system->fixed != NULL) remove_held(system, c);
    }
}
