// SPDX-License-Identifier: MIT
//
// One time step: find contacts, try with the current dt, shorten until it settles, accept, book,
// choose the next dt. Equations (4.x) of docs/theory/4-time.md.

#include "step.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Factors of the step size: after a failure, and at most after a success.
#define SHORTEN 0.3
#define GROW 1.3
#define GROW_STATIC 2

// Energy over the largest of the run, from which on it matters that overlaps gained it.
#define PUSHED 1e-3

// Short steps in a row, at most, that are left to springs after one in which carrying was in vain.
#define MOST_ALONE 7

// Elements below this part of the mean area are slivers.
#define SLIVER 1e-6

void nmm_sim_clock(nmm_sim *sim, double *phase) {
    const double now = nmm_clock();
    *phase += now - sim->phase_mark;
    sim->phase_mark = now;
}

// --- Parts of a step

static nmm_status save_start(nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const nmm_state *state = &sim->state;
    const size_t pair = 2 * sizeof(double);
    sim->tried = false;
    if (sim->search != NULL)
        TRY(nmm_contact_save(&sim->context, sim->search, state, &sim->start_contact));
    memcpy(sim->start_displacement, state->displacement, (size_t)model->n_cover * pair);
    memcpy(sim->start_velocity, state->velocity, (size_t)model->n_cover * pair);
    memcpy(sim->start_position, state->position, (size_t)model->n_point * pair);
    if (model->n_support > 0) {
        memcpy(sim->start_support, state->support_force, (size_t)model->n_support * pair);
    }
    return NMM_OK;
}

// Back to the last good state after a step that was given up.
static void return_to_start(nmm_sim *sim) {
    nmm_state *state = &sim->state;
    const size_t pair = 2 * sizeof(double);
    memcpy(state->displacement, sim->start_displacement, (size_t)sim->model.n_cover * pair);
    if (sim->model.n_support > 0) {
        memcpy(state->support_force, sim->start_support, (size_t)sim->model.n_support * pair);
    }
    if (state->n_contact > 0) {
        memcpy(state->contact, sim->start_contact, (size_t)state->n_contact * sizeof(nmm_contact));
    }
    nmm_state_place(&sim->model, state, sim->context.n_thread);
}

// Largest velocity of a point. Only for the start: later the motion of the last step is the better
// guess, because velocities of stiff modes alternate from step to step in Shi's scheme.
static double largest_velocity(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double largest = 0;
    for (int p = 0; p < model->n_point; p++) {
        double v[2] = {0, 0};
        const int m = model->n_local, *cover = model->element_cover + m * model->point_element[p];
        for (int i = 0; i < 2 * m; i++) {
            const int c = cover[i / 2];
            v[i % 2] += model->point_weight[m * p + i / 2] * sim->state.velocity[2 * c + i % 2];
        }
        largest = nmm_max(largest, v[0] * v[0] + v[1] * v[1]);
    }
    return sqrt(largest);
}

// det F of element e at the end of the try, the smallest in it.
static double least_volume(const nmm_sim *sim, int e) {
    const nmm_model *model = &sim->model;
    if (model->order > 0) return nmm_curved_least_volume(model, &sim->state, e);
    double d[6];
    for (int i = 0; i < 6; i++)
        d[i] = sim->state.displacement[2 * model->element_cover[3 * e + i / 2] + i % 2];
    const nmm_tensor H = nmm_displacement_gradient(d, model->element_gradient + 6 * (long)e);
    return (1 + H.xx) * (1 + H.yy) - H.xy * H.yx;
}

// First element whose deformation gradient F has det F <= 0 at the end of the try, -1: none.
static int inside_out_element(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    const int n = model->n_element, n_thread = sim->context.n_thread;
    int first = INT32_MAX;
#pragma omp parallel for num_threads(n_thread) schedule(static)                                    \
    reduction(min                                                                                  \
              : first) if (n_thread > 1 && n > 4096)
    for (int e = 0; e < n; e++) {
        if (!(least_volume(sim, e) > 0) && e < first) first = e;
    }
    return first < INT32_MAX ? first : -1;
}

void nmm_element_place(const nmm_sim *sim, int element, char *text, size_t size) {
    const nmm_model *model = &sim->model;
    const int block = model->element_block[element];
    const char *name = model->block_name[block];
    snprintf(text, size, "block %d%s%.60s%s near (%.6g, %.6g)", block, name != NULL ? " '" : "",
             name != NULL ? name : "", name != NULL ? "'" : "",
             model->element_centre[2 * (long)element] + model->origin.x,
             model->element_centre[2 * (long)element + 1] + model->origin.y);
}

// A sliver hardly resists: the cover that has nothing but it follows each error of a place a
// million times and more.
static void say_inside_out(nmm_sim *sim, int e) {
    const bool sliver = sim->model.element_area[e] < SLIVER * sim->cover.mean_area;
    char what[40] = "an element", place[120];
    if (sliver) snprintf(what, sizeof what, "a sliver of %.2g m2", sim->model.element_area[e]);
    nmm_element_place(sim, e, place, sizeof place);
    snprintf(sim->report.reason, sizeof sim->report.reason, "%s of %s turned inside out%s", what,
             place, sliver ? "; another covers.size or covers.order: 1 helps" : "");
}

// A soft interface may overlap further than anything moves in a step: its contacts must be found.
static double deepest_overlap(const nmm_sim *sim) {
    double deepest = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        if (contact->mode != NMM_CONTACT_OPEN) deepest = nmm_max(deepest, -contact->gap);
    }
    return deepest;
}

// Contacts of the step, their history and the pattern that follows. Contacts are listed for what
// can move in this step, not for the most that any step may move: fewer open ones. A single block
// meets itself seldom: there no step is shortened for it.
static nmm_status find_contacts(nmm_sim *sim, double h) {
    sim->allowed_now = sim->allowed;
    if (sim->state.step == 0) sim->speed = largest_velocity(sim);
    if (sim->search != NULL) {
        const bool free = sim->settings.is_static || sim->model.n_block == 1;
        const double expected = free ? sim->allowed : 1.5 * h * sim->speed + 0.02 * sim->model.size;
        sim->allowed_now = nmm_min(sim->allowed, expected);
        // In steps of a quarter, so that the list does not change with each change of the speed.
        const double wish = 2 * sim->allowed_now + deepest_overlap(sim);
        double reach = 0.04 * sim->model.size;
        while (reach < wish)
            reach *= 1.25;
        TRY(nmm_contact_find(&sim->context, sim->search, &sim->model, &sim->state, reach));
        // What contacts store at the start, those of initial stress among them.
        if (sim->state.step == 0) {
            nmm_contact_evaluate(sim->search, &sim->model, &sim->state, sim->context.n_thread);
            sim->contact_energy.elastic = nmm_contact_stored(sim->search, &sim->state);
        }
    }
    nmm_sim_clock(sim, &sim->summary.phase_seconds.contact);
    TRY(nmm_system_pattern(&sim->context, &sim->system, &sim->model, &sim->state));
    nmm_balance_group(&sim->balance, &sim->system.couples, &sim->model);
    nmm_sim_clock(sim, &sim->summary.phase_seconds.assemble);
    return NMM_OK;
}

// v' = 2 delta d / h - v, eq. (4.3); held unknowns move as prescribed.
static void update_velocity(nmm_sim *sim, double h) {
    const unsigned char *fixed = sim->system.fixed;
    for (int i = 0; i < 2 * sim->model.n_cover; i++) {
        const double mean = sim->state.mean_velocity[i] = sim->moved[i] / h;
        const bool held = fixed != NULL && (fixed[i / 2] >> i % 2 & 1);
        sim->state.velocity[i] = held ? mean : 2 * mean - sim->start_velocity[i];
    }
}

static void update_element(nmm_sim *sim, int e) {
    const nmm_model *model = &sim->model;
    const nmm_elastic elastic = sim->system.elastic[model->element_material[e]];
    double *stress = sim->state.stress + 3 * (long)e, *rotation = sim->state.rotation + 2 * (long)e;
    if (model->order > 0) {
        nmm_curved_mean(model, &sim->state, elastic, e, stress, rotation);
        return;
    }
    double d[6];
    for (int i = 0; i < 6; i++)
        d[i] = sim->state.displacement[2 * model->element_cover[3 * e + i / 2] + i % 2];
    const nmm_strain strain = nmm_strain_of(d, model->element_gradient + 6 * (long)e);
    const double *in_step = sim->system.piola + 4 * (long)e;
    nmm_tensor P = {in_step[0], in_step[1], in_step[2], in_step[3]};
    // That was a mean over the step: here counts its end.
    if (sim->system.start_stress != NULL)
        P = nmm_piola_of(elastic, &strain, sim->state.initial_stress + 3 * (long)e);
    nmm_cauchy_of(&strain, P, stress);
    rotation[0] = strain.c;
    rotation[1] = strain.s;
}

static void update_stress(nmm_sim *sim) {
    const int n = sim->model.n_element, n_thread = sim->context.n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int e = 0; e < n; e++)
        update_element(sim, e);
}

// Largest distance of a held point from its prescribed place.
static void report_supports(nmm_sim *sim) {
    double most = 0;
    for (int s = 0; s < sim->model.n_support; s++) {
        const nmm_vec2 error =
            nmm_support_error(&sim->model, &sim->state, s, nmm_sim_time_after(sim, 0));
        most = nmm_max(most, nmm_vec2_dot(error, error));
    }
    sim->summary.max_support_give = nmm_max(sim->summary.max_support_give, sqrt(most));
}

// Augmented contact: whose forces were carried, and whose the springs alone had to hold.
// In statics the last step counts: those before are a way to it.
static void count_raised(nmm_sim *sim) {
    if (sim->settings.is_static) sim->summary.pressed = sim->summary.not_raised = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        sim->summary.pressed += 1;
        sim->summary.not_raised += contact->hasty;
    }
}

static void report_contacts(nmm_sim *sim) {
    nmm_step_report *report = &sim->report;
    report->contacts = sim->state.n_contact;
    report->closed = 0;
    report->penetration = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        report->closed += 1;
        report->penetration = nmm_max(report->penetration, -contact->gap);
    }
    if (sim->settings.contact_method == NMM_CONTACT_AUGMENTED) count_raised(sim);
    sim->summary.max_penetration = nmm_max(sim->summary.max_penetration, report->penetration);
}

// The try settled: it becomes the new state.
static nmm_status accept_step(nmm_sim *sim, double h) {
    nmm_state *state = &sim->state;
    const nmm_contact_energy before = sim->contact_energy;
    // Statics have no time: the way to its end is gone in parts.
    state->time += sim->settings.is_static ? (sim->settings.end - state->time) / 8 : h;
    state->step += 1;
    nmm_free_balance(sim, h);
    update_stress(sim);
    if (sim->search != NULL)
        nmm_motion_take(&sim->motion, &sim->model, &sim->state, sim->balance.group, sim->moved, h);
    update_velocity(sim, h);
    if (sim->settings.is_static) {
        memset(state->velocity, 0, 2 * (size_t)sim->model.n_cover * sizeof(double));
    }
    if (sim->search != NULL) {
        nmm_contact_commit(sim->search, &sim->model, state, &sim->contact_energy);
    }
    nmm_ledger_step(sim, h, before);
    report_contacts(sim);
    report_supports(sim);
    TRY(nmm_state_check(&sim->context, &sim->model, state, "step"));
    nmm_sim_clock(sim, &sim->summary.phase_seconds.advance);
    return NMM_OK;
}

// --- Step size

// Length of the next try: as wished, and the last step ends on the scene's end.
static double choose_length(const nmm_sim *sim) {
    if (sim->settings.is_static) return sim->state.dt;
    const double left = sim->settings.end - sim->state.time;
    const double wished = sim->state.dt;
    if (left <= wished * (1 + 1e-9)) return left;
    // Two equal steps rather than a tiny last one.
    return left < 1.5 * wished ? 0.5 * left : wished;
}

static double shorter(const nmm_sim *sim, double h, nmm_try outcome) {
    const double move = sim->report.move;
    if (outcome == NMM_TRY_MOVED && move < INFINITY) {
        return h * nmm_max(0.1, nmm_min(0.7, 0.8 / move));
    }
    return SHORTEN * h;
}

// Grow slowly, stay below the cap, do not plan to move further than allowed.
static void plan_next(nmm_sim *sim, double h) {
    const double grow = sim->settings.is_static ? GROW_STATIC : GROW;
    double next = nmm_min(grow * h, sim->settings.dt_max);
    if (h < sim->state.dt) next = nmm_max(next, nmm_min(sim->state.dt, GROW * h));
    sim->speed = sim->report.move * sim->allowed_now / h;
    // From rest the way grows with the square of the step, else with the step.
    const double share = 0.8 * sim->allowed / (sim->speed * h);
    if (sim->speed > 0) next = nmm_min(next, h * (sim->settings.is_static ? sqrt(share) : share));
    sim->state.dt = nmm_max(next, sim->settings.dt_min);
}

static void end_early(nmm_sim *sim, nmm_try outcome, double h) {
    nmm_step_report *report = &sim->report;
    char why[256], clouded[160] = "";
    snprintf(why, sizeof why, "%s", report->reason);
    if (outcome == NMM_TRY_FORCES || outcome == NMM_TRY_FLIPS)
        nmm_say_clouded(sim, clouded, sizeof clouded);
    // Where there is a cause, the place of the contact says nothing more.
    if (clouded[0] != 0) why[strcspn(why, ":")] = 0;
    snprintf(report->reason, sizeof report->reason,
             "dt would fall below dt_min = %.3g s (at %.3g s): %.*s%s", sim->settings.dt_min, h,
             clouded[0] != 0 ? 40 : 160, why, clouded);
    report->end = outcome == NMM_TRY_SOLVER ? NMM_END_SOLVER_FAILED : NMM_END_STEP_TOO_SMALL;
    sim->summary.end = report->end;
    snprintf(sim->summary.reason, sizeof sim->summary.reason, "%s", report->reason);
}

// Stiff springs of augmented contact gain much in a round, but contacts may open and close with
// them for ever; softer ones take more rounds, and find the same forces. A step that is cut instead
// begins too fast where friction has to set in: its springs need a way for it.
static bool may_be_gentle(const nmm_sim *sim, nmm_try outcome) {
    const bool in_vain =
        outcome == NMM_TRY_FLIPS || outcome == NMM_TRY_FORCES || outcome == NMM_TRY_CARRIED;
    return in_vain && sim->carried.stiff && !sim->carrying.gentle;
}

// Another way for contacts to hold in a step as long: in a short one springs alone, which inertia
// makes easy, or gentle ones. The next steps are not tried otherwise, for longer each time.
static bool holds_otherwise(nmm_sim *sim, nmm_try outcome) {
    if (outcome == NMM_TRY_MOVED || outcome == NMM_TRY_INSIDE_OUT) return false;
    const bool alone = sim->carried.quick;
    sim->carrying.gentle = !alone && may_be_gentle(sim, outcome);
    if (!alone) return sim->carrying.gentle;
    sim->carrying.alone = true;
    sim->n_alone = nmm_min_int(2 * sim->n_alone + 1, MOST_ALONE);
    sim->left_alone = sim->n_alone + 1;
    return true;
}

// An accepted step: one less to be left to springs, or forces were carried in it.
static void count_alone(nmm_sim *sim) {
    if (sim->left_alone > 0)
        sim->left_alone -= 1;
    else if (sim->carried.quick)
        sim->n_alone = 0;
}

// Overlaps of short steps that the first long one pushes out, against the inertia of a whole block
// or another corner that is wedged in: a work of any size that nothing has stored.
static bool must_keep_overlaps(const nmm_sim *sim) {
    if (sim->carrying.overlaps != NMM_OVERLAPS_GO || sim->system.cover_give == NULL) return false;
    if (sim->search == NULL) return false;
    const double stored = nmm_contact_pushed(sim->search, &sim->state, sim->start_contact);
    const double gained = nmm_ledger_contact_work(sim) + stored - sim->contact_energy.elastic;
    const double most = PUSHED * sim->summary.ledger.largest;
    // What bodies lose to the scheme in the same step they would have lost with less to lose.
    return gained > most && gained - nmm_ledger_lost_in_bodies(sim) > most;
}

// Tries until one settles; *h is its length. report->end tells when none did.
static nmm_status settle_step(nmm_sim *sim, double *h) {
    nmm_step_report *report = &sim->report;
    const bool is_static = sim->settings.is_static;
    sim->carrying = (nmm_carrying){
        .alone = is_static || sim->left_alone > 0,
        .overlaps = is_static ? NMM_OVERLAPS_AT_REST : NMM_OVERLAPS_GO,
    };
    for (;;) {
        nmm_try outcome = NMM_TRY_SETTLED;
        TRY(nmm_step_try(sim, *h, &outcome));
        if (report->move > 1 + 1e-9 && outcome == NMM_TRY_SETTLED) outcome = NMM_TRY_MOVED;
        if (outcome == NMM_TRY_MOVED) {
            snprintf(report->reason, sizeof report->reason,
                     "a point moved %.3g times the allowed %.3g m", report->move, sim->allowed_now);
        }
        const int inside_out = outcome == NMM_TRY_SETTLED ? inside_out_element(sim) : -1;
        if (inside_out >= 0) {
            outcome = NMM_TRY_INSIDE_OUT;
            say_inside_out(sim, inside_out);
        }
        if (outcome == NMM_TRY_SETTLED && !must_keep_overlaps(sim)) return NMM_OK;
        if (outcome == NMM_TRY_SETTLED) {
            sim->carrying.overlaps = NMM_OVERLAPS_STAY;
            continue;
        }
        if (holds_otherwise(sim, outcome)) continue;
        *h = shorter(sim, *h, outcome);
        report->cuts += 1;
        sim->summary.dt_cuts += 1;
        if (*h >= sim->settings.dt_min) continue;
        end_early(sim, outcome, *h);
        return_to_start(sim);
        return NMM_OK;
    }
}

// --- The step

static nmm_status do_step(nmm_sim *sim) {
    nmm_step_report *report = &sim->report;
    *report =
        (nmm_step_report){.step = sim->state.step, .time = sim->state.time, .energy = sim->energy};
    sim->phase_mark = nmm_clock();
    if (sim->summary.end != NMM_END_RUNNING) {
        report->end = sim->summary.end;
        return NMM_OK;
    }
    double h = choose_length(sim);
    TRY(find_contacts(sim, h));
    TRY(save_start(sim));
    nmm_system_begin(&sim->context, &sim->system, &sim->model, &sim->state);
    nmm_friction_begin(&sim->friction, sim->system.K.n_row);
    TRY(settle_step(sim, &h));
    if (report->end != NMM_END_RUNNING) return NMM_OK;
    // Steps of statics are too different to be compared.
    if (!sim->settings.is_static) nmm_friction_end(&sim->friction);
    count_alone(sim);
    TRY(accept_step(sim, h));
    plan_next(sim, h);
    report->step = sim->state.step;
    report->time = sim->state.time;
    report->dt = h;
    report->energy = sim->energy;
    if (sim->settings.is_static) {
        nmm_static_judge(sim, h);
    } else if (sim->state.time >= sim->settings.end * (1 - 1e-12)) {
        report->end = sim->summary.end = NMM_END_COMPLETED;
    }
    return NMM_OK;
}

// All phases but the solver, whose threads have a pace of their own.
static double seconds_of_phases(const nmm_sim *sim) {
    return sim->summary.phase_seconds.contact + sim->summary.phase_seconds.assemble +
           sim->summary.phase_seconds.advance;
}

// A step on all threads or, but for its solves, on one: whatever has been faster of late.
static nmm_status paced_step(nmm_sim *sim) {
    const int n_thread = sim->context.n_thread;
    const bool shared = n_thread > 1 && nmm_pace_shares(&sim->pace);
    const double before = seconds_of_phases(sim);
    sim->solver_threads = n_thread;
    sim->context.n_thread = shared ? n_thread : 1;
    const nmm_status status = do_step(sim);
    sim->context.n_thread = n_thread;
    if (n_thread > 1)
        nmm_pace_note(&sim->pace, shared, sim->report.passes, seconds_of_phases(sim) - before);
    return status;
}

nmm_status nmm_sim_step(nmm_sim *sim, nmm_step_report *report) {
    const nmm_status status =
        sim->context.error.status != NMM_OK ? sim->context.error.status : paced_step(sim);
    if (report != NULL) *report = sim->report;
    return status;
}
