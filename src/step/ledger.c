// SPDX-License-Identifier: MIT
//
// The energy ledger. At the end configuration of each step
//   load + support + contact - internal - M a = r,
// so the work of these forces over the step adds up to r . delta d, which the solver keeps small.
// What the time scheme loses is the difference between the work of a force at the end of the step
// and the change of the energy it stores (docs/theory/4-time.md, eq. (4.9) to (4.11)).
// Sums over elements run over fixed chunks: the same bits for any number of threads.

#include "step.h"

#include <math.h>

// --- Elements

// Stored energies at the end of the step, and work of inner forces over it [J].
typedef struct element_sums {
    double kinetic, strain;
    double inner, inertia, damping; // on the displacement of the step
} element_sums;

static element_sums add_sums(element_sums a, element_sums b) {
    return (element_sums){a.kinetic + b.kinetic, a.strain + b.strain, a.inner + b.inner,
                          a.inertia + b.inertia, a.damping + b.damping};
}

// sum_ij mass_ij a_i . b_j over n functions
static inline double mass_product(int n, const double *mass, const double *a, const double *b) {
    double sum = 0;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            const double product = a[2 * i] * b[2 * j] + a[2 * i + 1] * b[2 * j + 1];
            sum += mass[nmm_pair_index(n, i, j)] * product;
        }
    }
    return sum;
}

// Motion of the functions of an element.
typedef struct element_motion {
    double d[2 * NMM_MOST_LOCAL], v[2 * NMM_MOST_LOCAL];      // [m], [m/s] at the end of the step
    double way[2 * NMM_MOST_LOCAL];                           // [m] in the step
    double end[2 * NMM_MOST_LOCAL], rate[2 * NMM_MOST_LOCAL]; // [m/s], [m/s2] of the scheme
} element_motion;

static inline void take_motion(const nmm_sim *sim, int e, double h, int n, element_motion *m) {
    const int *cover = sim->model.element_cover + n * (long)e;
    for (int i = 0; i < n; i++) {
        for (int x = 0; x < 2; x++) {
            const int k = 2 * cover[i] + x;
            const double v0 = sim->start_velocity[k], way = sim->moved[k];
            const double end = h > 0 ? 2 * sim->state.mean_velocity[k] - v0 : 0;
            m->d[2 * i + x] = sim->state.displacement[k];
            m->v[2 * i + x] = sim->state.velocity[k];
            m->way[2 * i + x] = way;
            m->end[2 * i + x] = end;
            m->rate[2 * i + x] = h > 0 ? (end - v0) / h : 0;
        }
    }
}

// The inner forces and the energy of an element of constant strain.
static void add_linear(const nmm_sim *sim, int e, const element_motion *motion,
                       element_sums *sums) {
    const nmm_model *model = &sim->model;
    const double *gradient = model->element_gradient + 6 * (long)e;
    const nmm_strain strain = nmm_strain_of(motion->d, gradient);
    const nmm_elastic elastic = sim->system.elastic[model->element_material[e]];
    const double stored =
        nmm_strain_energy_of(elastic, &strain, sim->state.initial_stress + 3 * (long)e);
    const nmm_tensor H = nmm_displacement_gradient(motion->way, gradient);
    const double *P = sim->system.piola + 4 * (long)e;
    sums->strain = model->element_area[e] * stored;
    sums->inner = model->element_area[e] * (P[0] * H.xx + P[1] * H.xy + P[2] * H.yx + P[3] * H.yy);
}

static void add_curved(const nmm_sim *sim, int e, const element_motion *motion,
                       element_sums *sums) {
    const nmm_model *model = &sim->model;
    const nmm_elastic elastic = sim->system.elastic[model->element_material[e]];
    const double *force = sim->system.element_force + 2 * model->n_local * (long)e;
    sums->strain = nmm_curved_energy(model, &sim->state, elastic, e);
    for (int i = 0; i < model->n_local; i++) {
        for (int x = 0; x < 2; x++)
            sums->inner += force[2 * i + x] * motion->way[2 * i + x];
    }
}

// Sums of an element with n functions; h = 0: only the stored energies.
static inline element_sums sum_functions(const nmm_sim *sim, int e, double h, int n) {
    const double *mass = sim->system.element_mass + (long)e * (n * (n + 1) / 2);
    const double damping = sim->system.damping;
    element_motion motion;
    take_motion(sim, e, h, n, &motion);
    element_sums sums = {
        .kinetic = 0.5 * mass_product(n, mass, motion.v, motion.v),
        .inertia = mass_product(n, mass, motion.way, motion.rate),
        .damping = damping > 0 ? damping * mass_product(n, mass, motion.way, motion.end) : 0,
    };
    if (n == 3)
        add_linear(sim, e, &motion, &sums);
    else
        add_curved(sim, e, &motion, &sums);
    return sums;
}

static element_sums sum_element(const nmm_sim *sim, int e, double h) {
    return sim->model.order == 0 ? sum_functions(sim, e, h, 3)
                                 : sum_functions(sim, e, h, sim->model.n_local);
}

double nmm_ledger_strain(const nmm_sim *sim, int element, double *work) {
    const element_sums sums = sum_element(sim, element, 0);
    *work = sums.inner;
    return sums.strain;
}

// Ties of slivers have an energy and a mass too.
static void add_ties(const nmm_sim *sim, double h, element_sums *sums) {
    const nmm_system *system = &sim->system;
    const nmm_state *state = &sim->state;
    const int n = sim->model.n_cover;
    const double *K = system->tie_stiffness, *M = system->tie_mass;
    const double *v1 = state->velocity, *v0 = sim->start_velocity, *way = sim->moved;
    if (sim->model.n_tie == 0) return;
    const double *d = state->displacement;
    sums->kinetic += 0.5 * nmm_ties_product(system, n, M, v1, v1);
    sums->strain += 0.5 * nmm_ties_product(system, n, K, d, d);
    if (!(h > 0)) return;
    for (int i = 0; i < 2 * n; i++)
        sums->inner += system->tie_force[i] * way[i];
    // Velocities of the scheme: 2 way / h - v0 at the end, whose change takes the time h.
    const double of_way = nmm_ties_product(system, n, M, way, way);
    const double of_start = nmm_ties_product(system, n, M, way, v0);
    sums->inertia += 2 / (h * h) * of_way - 2 / h * of_start;
    sums->damping += system->damping * (2 / h * of_way - of_start);
}

static element_sums sum_elements(const nmm_sim *sim, double h) {
    enum { GROUP = 64 };
    const int n = sim->model.n_element, n_thread = sim->context.n_thread;
    element_sums total = {0};
    for (long first = 0; first < n; first += GROUP * NMM_CHUNK) {
        element_sums part[GROUP] = {{0}};
        const int n_part = (int)nmm_min(GROUP, (double)((n - first + NMM_CHUNK - 1) / NMM_CHUNK));
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_part > 4)
        for (int k = 0; k < n_part; k++) {
            const long begin = first + (long)k * NMM_CHUNK;
            for (long e = begin; e < begin + NMM_CHUNK && e < n; e++) {
                part[k] = add_sums(part[k], sum_element(sim, (int)e, h));
            }
        }
        for (int k = 0; k < n_part; k++)
            total = add_sums(total, part[k]);
    }
    add_ties(sim, h, &total);
    return total;
}

double nmm_ledger_lost_in_bodies(const nmm_sim *sim) {
    const element_sums sums = sum_elements(sim, 0);
    return sums.inner - (sums.strain - sim->strain);
}

// --- Supports, contacts, loads

// Energy in the springs of supports.
static double support_energy(const nmm_sim *sim) {
    double sum = 0;
    for (int s = 0; s < sim->model.n_support; s++) {
        const nmm_vec2 error =
            nmm_support_error(&sim->model, &sim->state, s, nmm_sim_time_after(sim, 0));
        sum += 0.5 * sim->model.support[s].stiffness * nmm_vec2_dot(error, error);
    }
    return sum;
}

double nmm_ledger_contact_work(const nmm_sim *sim) {
    double sum = 0;
    for (int i = 0; i < 2 * sim->model.n_cover && sim->system.contact_force != NULL; i++)
        sum += sim->system.contact_force[i] * sim->moved[i];
    return sum;
}

// Change of a history of width 2 over the step.
static nmm_vec2 history_change(const nmm_sim *sim, int history, double h) {
    if (history < 0) return (nmm_vec2){0, 0};
    double before[2], after[2];
    // In statics all of it is in the first step.
    const bool is_static = sim->settings.is_static;
    const double end = nmm_sim_time_after(sim, 0);
    const double begin = !is_static ? end - h : sim->state.step > 1 ? end : 0;
    nmm_history_value(&sim->model.history[history], begin, before);
    nmm_history_value(&sim->model.history[history], end, after);
    return (nmm_vec2){after[0] - before[0], after[1] - before[1]};
}

// Work of supports on the body, and of it what moved supports put in.
static double support_work(const nmm_sim *sim, double h, double *put_in) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int s = 0; s < model->n_support; s++) {
        const nmm_support *support = &model->support[s];
        nmm_vec2 reaction = {sim->system.support_force[2 * s],
                             sim->system.support_force[2 * s + 1]};
        if (!support->fix_x) reaction.x = 0;
        if (!support->fix_y) reaction.y = 0;
        nmm_vec2 way = {0, 0};
        for (int i = 0; i < model->n_local; i++) {
            const int c = model->element_cover[model->n_local * support->element + i];
            way.x += support->weight[i] * sim->moved[2 * c];
            way.y += support->weight[i] * sim->moved[2 * c + 1];
        }
        sum += nmm_vec2_dot(reaction, way);
        *put_in += nmm_vec2_dot(reaction, history_change(sim, support->history, h));
    }
    return sum;
}

// Work of loads and of whatever moves held covers.
static double load_work(const nmm_sim *sim) {
    const nmm_system *system = &sim->system;
    double sum = 0;
    for (int i = 0; i < 2 * sim->model.n_cover; i++) {
        const double held = system->reaction != NULL ? system->reaction[i] : 0;
        sum += (system->load[i] + held) * sim->moved[i];
    }
    return sum;
}

// --- The ledger

void nmm_ledger_start(nmm_sim *sim) {
    const element_sums sums = sum_elements(sim, 0);
    sim->kinetic = sim->kinetic0 = sums.kinetic;
    sim->strain = sim->strain0 = sums.strain;
    // A motion that does not begin at zero loads the springs in the first step: its ledger says so.
    sim->support = 0;
    nmm_watch_start(sim);
}

void nmm_ledger_step(nmm_sim *sim, double h, nmm_contact_energy before) {
    nmm_energy *energy = &sim->energy;
    const element_sums sums = sum_elements(sim, h);
    double put_in = 0;
    const double support = support_work(sim, h, &put_in);
    const double contact = nmm_ledger_contact_work(sim), spring = support_energy(sim);
    const nmm_contact_energy *after = &sim->contact_energy;
    const double friction = after->friction - before.friction;
    const double fracture = after->fracture - before.fracture;
    const double stored = after->elastic - before.elastic;

    energy->external += load_work(sim) + put_in;
    energy->damping += sums.damping;
    energy->friction += friction;
    energy->fracture += fracture;
    const nmm_losses losses = {.elements = sums.inner - (sums.strain - sim->strain),
                               .contacts = -contact - stored - friction - fracture,
                               .supports = put_in - support - (spring - sim->support)};
    energy->numerical += losses.elements;
    energy->numerical += losses.contacts;
    energy->numerical += losses.supports;
    // Held unknowns do not follow the scheme: their kinetic energy is prescribed.
    // Nor do those that are stopped after each step of statics.
    if (sim->system.fixed != NULL || sim->settings.is_static)
        energy->numerical += sums.inertia - (sums.kinetic - sim->kinetic);
    sim->kinetic = sums.kinetic, sim->strain = sums.strain, sim->support = spring;
    energy->kinetic = sums.kinetic - sim->kinetic0;
    energy->strain = sums.strain - sim->strain0;
    energy->contact += stored;
    energy->support = spring;
    energy->residual = energy->external - energy->kinetic - energy->strain - energy->contact -
                       energy->friction - energy->fracture - energy->support - energy->damping -
                       energy->numerical;
    nmm_watch_step(sim, &losses);
}
