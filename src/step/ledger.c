// SPDX-License-Identifier: MIT
//
// The energy ledger. At the end configuration of each step
//   load + support + contact - internal - M a = r,
// so the work of these forces over the step adds up to r . delta d, which the solver keeps small.
// What the time scheme loses is the difference between the work of a force at the end of the step
// and the change of the energy it stores (docs/theory/4-time.md, eq. (4.9) to (4.11)).

#include "step.h"

#include <math.h>

static double kinetic_energy(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const nmm_system *system = &sim->system;
    const double *v = sim->state.velocity;
    double sum = 0;
    for (int e = 0; e < model->n_element && !system->lumped; e++) {
        const int *cover = model->element_cover + 3 * (long)e;
        for (int k = 0; k < 9; k++) {
            const double *a = v + 2 * cover[k / 3], *b = v + 2 * cover[k % 3];
            const double m = system->element_mass[6 * (long)e + nmm_mass_index(k / 3, k % 3)];
            sum += 0.5 * m * (a[0] * b[0] + a[1] * b[1]);
        }
    }
    for (int c = 0; c < model->n_cover && system->lumped; c++) {
        sum += 0.5 * system->cover_mass[c] * (v[2 * c] * v[2 * c] + v[2 * c + 1] * v[2 * c + 1]);
    }
    return sum;
}

static void element_displacement(const nmm_model *model, const double *d, int e, double out[6]) {
    const int *cover = model->element_cover + 3 * (long)e;
    for (int i = 0; i < 6; i++)
        out[i] = d[2 * cover[i / 2] + i % 2];
}

static double strain_energy(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int e = 0; e < model->n_element; e++) {
        double d[6];
        element_displacement(model, sim->state.displacement, e, d);
        const nmm_strain strain = nmm_strain_of(d, model->element_gradient + 6 * (long)e);
        const nmm_elastic elastic = nmm_elastic_of(&model->material[model->element_material[e]]);
        sum += model->element_area[e] *
               nmm_strain_energy_of(elastic, &strain, sim->state.initial_stress + 3 * (long)e);
    }
    return sum;
}

// Energy in the springs of supports.
static double support_energy(const nmm_sim *sim) {
    double sum = 0;
    for (int s = 0; s < sim->model.n_support; s++) {
        const nmm_vec2 error = nmm_support_error(&sim->model, &sim->state, s, sim->state.time);
        sum += 0.5 * sim->model.support[s].stiffness * nmm_vec2_dot(error, error);
    }
    return sum;
}

// Displacement of the step.
static double moved(const nmm_sim *sim, int i) {
    return sim->state.displacement[i] - sim->start_displacement[i];
}

static double internal_work(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int e = 0; e < model->n_element; e++) {
        double d[6];
        for (int i = 0; i < 6; i++) {
            d[i] = moved(sim, 2 * model->element_cover[3 * e + i / 2] + i % 2);
        }
        const nmm_tensor H = nmm_displacement_gradient(d, model->element_gradient + 6 * (long)e);
        const double *P = sim->system.piola + 4 * (long)e;
        sum += model->element_area[e] * (P[0] * H.xx + P[1] * H.xy + P[2] * H.yx + P[3] * H.yy);
    }
    return sum;
}

double nmm_ledger_contact_work(const nmm_sim *sim) {
    double sum = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        const nmm_contact_row *row = &sim->system.row[k];
        for (int i = 0; i < 12; i++) {
            const double force = contact->normal_force * row->normal[i / 2][i % 2] +
                                 contact->shear_force * row->shear[i / 2][i % 2];
            sum += force * moved(sim, 2 * row->cover[i / 2] + i % 2);
        }
    }
    return sum;
}

// Work of supports on the body, and of it what moved supports put in.
static double support_work(const nmm_sim *sim, double start, double *put_in) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int s = 0; s < model->n_support; s++) {
        const nmm_support *support = &model->support[s];
        const nmm_vec2 error = nmm_support_error(model, &sim->state, s, sim->state.time);
        const nmm_vec2 reaction = nmm_support_reaction(model, &sim->state, s, error);
        double before[2] = {0, 0}, after[2] = {0, 0}, way[2] = {0, 0};
        if (support->history >= 0) {
            nmm_history_value(&model->history[support->history], start, before);
            nmm_history_value(&model->history[support->history], sim->state.time, after);
        }
        for (int i = 0; i < 6; i++) {
            const int c = model->element_cover[3 * support->element + i / 2];
            way[i % 2] += support->weight[i / 2] * moved(sim, 2 * c + i % 2);
        }
        sum += support->fix_x ? reaction.x * way[0] : 0;
        sum += support->fix_y ? reaction.y * way[1] : 0;
        *put_in += support->fix_x ? reaction.x * (after[0] - before[0]) : 0;
        *put_in += support->fix_y ? reaction.y * (after[1] - before[1]) : 0;
    }
    return sum;
}

// Work of inertia, damping, loads and held unknowns on the displacement of the step.
typedef struct work {
    double inertia, damping, load, held;
} work;

static work cover_work(const nmm_sim *sim, double h) {
    const nmm_system *system = &sim->system;
    work w = {0};
    for (int i = 0; i < 2 * sim->model.n_cover; i++) {
        w.load += system->load[i] * moved(sim, i);
        if (system->reaction != NULL) w.held += system->reaction[i] * moved(sim, i);
    }
    // M a . delta d and alpha M v . delta d, element by element.
    const nmm_model *model = &sim->model;
    const double alpha = system->damping;
    for (int e = 0; e < model->n_element; e++) {
        const int *cover = model->element_cover + 3 * (long)e;
        for (int k = 0; k < 9 && !system->lumped; k++) {
            const double m = system->element_mass[6 * (long)e + nmm_mass_index(k / 3, k % 3)];
            for (int x = 0; x < 2; x++) {
                const int j = 2 * cover[k % 3] + x;
                const double v = 2 * moved(sim, j) / h - sim->start_velocity[j];
                const double way = moved(sim, 2 * cover[k / 3] + x);
                w.inertia += m * way * (v - sim->start_velocity[j]) / h;
                w.damping += alpha * m * way * v;
            }
        }
    }
    for (int i = 0; i < 2 * model->n_cover && system->lumped; i++) {
        const double m = system->cover_mass[i / 2];
        const double v = 2 * moved(sim, i) / h - sim->start_velocity[i];
        w.inertia += m * moved(sim, i) * (v - sim->start_velocity[i]) / h;
        w.damping += alpha * m * moved(sim, i) * v;
    }
    return w;
}

void nmm_ledger_start(nmm_sim *sim) {
    sim->kinetic = sim->kinetic0 = kinetic_energy(sim);
    sim->strain = sim->strain0 = strain_energy(sim);
    sim->support = support_energy(sim);
}

void nmm_ledger_step(nmm_sim *sim, double h, nmm_contact_energy before) {
    nmm_energy *energy = &sim->energy;
    const double inner = internal_work(sim), contact = nmm_ledger_contact_work(sim);
    double put_in = 0;
    const double support = support_work(sim, sim->state.time - h, &put_in);
    const work w = cover_work(sim, h);
    const double kinetic = kinetic_energy(sim), strain = strain_energy(sim);
    const double spring = support_energy(sim);
    const nmm_contact_energy *after = &sim->contact_energy;
    const double friction = after->friction - before.friction;
    const double fracture = after->fracture - before.fracture;
    const double stored = after->elastic - before.elastic;

    energy->external += w.load + put_in + w.held;
    energy->damping += w.damping;
    energy->friction += friction;
    energy->fracture += fracture;
    energy->numerical += inner - (strain - sim->strain);
    energy->numerical += -contact - stored - friction - fracture;
    energy->numerical += put_in - support - (spring - sim->support);
    // Held unknowns do not follow the scheme: their kinetic energy is prescribed.
    if (sim->system.fixed != NULL) energy->numerical += w.inertia - (kinetic - sim->kinetic);
    sim->kinetic = kinetic, sim->strain = strain, sim->support = spring;
    energy->kinetic = kinetic - sim->kinetic0;
    energy->strain = strain - sim->strain0;
    energy->contact += stored;
    energy->support = spring;
    energy->residual = energy->external - energy->kinetic - energy->strain - energy->contact -
                       energy->friction - energy->fracture - energy->support - energy->damping -
                       energy->numerical;
}
