// SPDX-License-Identifier: MIT
//
// One try of a time step: the open-close loop as a Newton iteration. The first pass, from the start
// of the step with the modes of the contacts there, is Shi's linear step; every later pass corrects
// the balance of forces at the end configuration. A solve that misses its tolerance ends the try.

#include "step.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// --- Parts of a pass

// What the passes of one try remember.
typedef struct passes {
    double unbalance[NMM_MAX_PASS + 1]; // [N] after pass k
    double worst[NMM_MAX_PASS + 1];     // what is left of the forces over what is allowed
    int n, raised;
    double drift; // [m] bound of how far the covers have gone since the matrix was made anew
    double drift_allowed; // [m]
    double give;    // part of a contact force that a spring held when carried forces were raised
    double stiffer; // springs of augmented contacts over those that the try began with
    nmm_contact_verdict verdict;
    bool in_vain; // the last solve knew of friction, and the pass gained little
    int n_vain;   // passes of this kind
    bool part;    // the last solve was for part of the rows
    bool whole;   // the next one must not be
    bool clouded; // rounding is something beside what may be left of the forces
} passes;

// Back to the start of the step; before its first try that is where everything is.
static void restore_start(nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    if (!sim->tried) {
        sim->tried = true;
        return;
    }
    nmm_state *state = &sim->state;
    const size_t pair = 2 * sizeof(double);
    memcpy(state->displacement, sim->start_displacement, (size_t)model->n_cover * pair);
    if (model->n_support > 0) {
        memcpy(state->support_force, sim->start_support, (size_t)model->n_support * pair);
    }
    if (state->n_contact > 0) {
        memcpy(state->contact, sim->start_contact, (size_t)state->n_contact * sizeof(nmm_contact));
    }
    nmm_state_place(model, state, sim->context.n_thread);
}

// Where there is contact a try begins where the motion of the last step leads, so that most
// contacts have the modes they will have; but not after one that failed.
static bool motion_goes_on(const nmm_sim *sim) {
    return sim->state.n_contact > 0 && sim->report.cuts == 0 && !sim->settings.is_static;
}

// Held covers go where they are prescribed.
static void begin_move(nmm_sim *sim, double h, double end) {
    const bool goes_on = motion_goes_on(sim);
    for (int i = 0; goes_on && i < 2 * sim->model.n_cover; i++)
        sim->state.displacement[i] +=
            h * nmm_motion_goes_on(&sim->motion, &sim->model, &sim->state, h, i);
    nmm_system_hold(&sim->model, &sim->state, end);
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        sim->moved[i] = sim->state.displacement[i] - sim->start_displacement[i];
}

static nmm_contact_verdict evaluate_contacts(nmm_sim *sim) {
    nmm_state_place(&sim->model, &sim->state, sim->context.n_thread);
    if (sim->search == NULL) return (nmm_contact_verdict){.worst = -1};
    return nmm_contact_evaluate(sim->search, &sim->model, &sim->state, sim->context.n_thread);
}

// After a move of some covers: what it touches.
static nmm_contact_verdict evaluate_touched(nmm_sim *sim, const nmm_contact_verdict *last) {
    const nmm_touched *touched = &sim->nearby.touched;
    const int n_thread = sim->context.n_thread;
    nmm_state_place_some(&sim->model, &sim->state, touched->point.item, touched->point.n, n_thread);
    nmm_contact_verdict verdict = nmm_contact_evaluate_some(
        &sim->model, &sim->state, touched->contact.item, touched->contact.n, n_thread);
    verdict.n_sliding += last->n_sliding - verdict.n_slid;
    return verdict;
}

// Room in the solver for the matrix as it is now.
static nmm_status open_solver(nmm_sim *sim) {
    const nmm_bsr *K = &sim->system.K;
    const int n_block = K->row_start[K->n_row];
    if (sim->solver != NULL && K->n_row <= sim->solver_rows && n_block <= sim->solver_blocks) {
        return NMM_OK;
    }
    sim->backend->close(&sim->context, &sim->solver);
    sim->solver_rows = K->n_row;
    sim->solver_blocks = n_block + n_block / 4;
    sim->system.keep_pattern = false;
    return sim->backend->open(&sim->context, &sim->solver, sim->solver_rows, sim->solver_blocks);
}

// May solves take the way of those that know of friction, be it with no terms of it? A system that
// is to be written is solved as it is written.
static bool may_couple(const nmm_sim *sim) {
    if (sim->state.n_contact == 0 || sim->comparable || sim->dump.write != NULL) return false;
    return sim->friction.way != NMM_FRICTION_APART;
}

// Is the solve to know of friction? Where that was in vain, because contacts slide to and fro, the
// next one does not, as surely and slowly as symmetric passes go; at the second time none does.
static bool couples(const nmm_sim *sim, const passes *p) {
    return may_couple(sim) && p->n_vain < 2 && !p->in_vain;
}

static int count_flips(const nmm_contact_verdict *verdict) {
    return verdict->n_opened + verdict->n_closed + verdict->n_slipped + verdict->n_stuck;
}

static nmm_solve_options solve_options(const nmm_sim *sim, const passes *p) {
    const nmm_scene_settings *settings = &sim->settings;
    static const nmm_solve_blocks blocks[] = {
        [NMM_SCENE_BLOCKS_AUTO] = NMM_BLOCKS_AUTO,
        [NMM_SCENE_BLOCKS_COVER] = NMM_BLOCKS_COVER,
        [NMM_SCENE_BLOCKS_CLUSTER] = NMM_BLOCKS_CLUSTER,
        [NMM_SCENE_BLOCKS_BODY] = NMM_BLOCKS_BODY,
    };
    return (nmm_solve_options){
        .coupling = may_couple(sim) ? &sim->system.coupling : NULL,
        .method = nmm_step_method(sim),
        .blocks = blocks[settings->blocks],
        .precision = nmm_step_precision(sim),
        // The coarse correction is on the host only.
        .place = sim->comparable ? NULL : sim->model.cover_place,
        .body = sim->comparable ? NULL : nmm_system_body(&sim->system, &sim->model),
        // Within a step only: matrices of other steps differ more.
        .reuse = p->n > 0,
        .tolerance = settings->solver_tolerance,
        // Later passes solve for small corrections: no need to go far below the balance asked for.
        .absolute = 0.2 * nmm_balance_limit(&sim->balance),
        .stop_average_change = settings->stop == NMM_STOP_AVERAGE_CHANGE,
        .jacobi_damping = settings->jacobi_damping,
        .sor_factor = settings->sor_factor,
        .max_iterations = settings->max_iterations,
        .n_thread = sim->solver_threads,
    };
}

// First guess of a pass: the motion goes on; later passes start from no correction.
static void guess_change(nmm_sim *sim, double h, int pass) {
    double *change = sim->system.change;
    const bool guessed = pass == 0 && !motion_goes_on(sim);
    const unsigned char *fixed = sim->system.fixed;
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        change[i] = guessed ? h * sim->state.velocity[i] : 0;
    for (int i = 0; i < 2 * sim->model.n_cover && guessed && fixed != NULL; i++)
        if (fixed[i / 2] >> i % 2 & 1) change[i] = 0;
}

// What rounding leaves follows from the places reached, and from those to be reached where steps
// are the motion's and not a search.
static void round_forces(nmm_sim *sim, double h) {
    const double reach = sim->settings.is_static ? 0 : sim->allowed_now;
    nmm_balance_round(&sim->balance, &sim->system, &sim->model, &sim->state, h, reach);
}

// What is left of the forces over what is allowed.
static double worst_balance(nmm_sim *sim, double h) {
    round_forces(sim, h);
    return nmm_balance_worst(&sim->balance, &sim->system, &sim->model, sim->settings.tolerance);
}

// Is rounding something beside what may be left of the forces?
static bool is_clouded(const nmm_sim *sim) {
    return nmm_balance_clouded(&sim->balance, NMM_ROUNDED * sim->settings.tolerance, 1);
}

// Weights of the blocks, for all passes of a try.
static void weigh_blocks(nmm_sim *sim, passes *p, double h) {
    worst_balance(sim, h);
    p->clouded = is_clouded(sim);
    nmm_balance_weigh(&sim->balance, sim->settings.stop != NMM_STOP_AVERAGE_CHANGE);
}

// What friction adds to the system, where the solve is to know of it.
static nmm_status couple(nmm_sim *sim, const passes *p) {
    nmm_coupling *coupling = &sim->system.coupling;
    coupling->n = 0;
    coupling->tolerance =
        count_flips(&p->verdict) == 0 ? NMM_QUIET_TOLERANCE : NMM_COUPLED_TOLERANCE;
    if (p->n == 0) coupling->tolerance = NMM_FIRST_TOLERANCE;
    if (sim->friction.way == NMM_FRICTION_CLOSE) coupling->tolerance *= NMM_CLOSE_PART;
    if (!couples(sim, p)) return NMM_OK;
    const nmm_rows part = {sim->nearby.n_row, sim->nearby.row, sim->nearby.place};
    TRY(nmm_system_couple(&sim->context, &sim->system, &sim->model, &sim->state,
                          p->part ? &part : NULL));
    nmm_balance_weigh_coupling(&sim->balance, coupling, &sim->model);
    return NMM_OK;
}

// Unbalanced forces that a pass may leave aside, to solve for the other rows [N]: in a later one
// less than it will gain.
static double left_aside(const nmm_sim *sim, const passes *p) {
    const double *unbalance = p->unbalance, allowed = nmm_balance_limit(&sim->balance);
    double part = NMM_FIRST_LEFT;
    if (p->n > 0) {
        const double gained = unbalance[p->n] / unbalance[p->n - 1];
        const double left = nmm_max(NMM_LEAST_LEFT, nmm_min(NMM_LEFT_OF_GAIN * gained, NMM_LEFT));
        part = nmm_max(left, NMM_LEFT_ALLOWED / p->worst[p->n]);
    }
    return nmm_max(NMM_FIRST_PASS * allowed, part * unbalance[p->n]);
}

// Is it enough to solve for the rows that are out of balance and what is near them? Symmetric
// passes of contacts that slide mix their changes, which asks for all rows. Where small forces are
// strewn over all, those that hold most must do.
static bool solves_nearby(nmm_sim *sim, const passes *p, double h) {
    if (p->whole || sim->nearby.model == NULL || sim->dump.write != NULL) return false;
    if (!couples(sim, p) && p->verdict.n_sliding > 0) return false;
    const double most = p->n > 0 ? NMM_MOST_LEFT * p->unbalance[p->n] : 0;
    return nmm_nearby_choose(&sim->nearby, &sim->system, left_aside(sim, p), most, h);
}

static nmm_status solve_all(nmm_sim *sim, const nmm_solve_options *options,
                            nmm_solve_report *report) {
    nmm_system *system = &sim->system;
    TRY(open_solver(sim));
    TRY(sim->backend->solve(&sim->context, sim->solver, &system->K, system->residual,
                            system->change, system->keep_pattern, options, report));
    system->keep_pattern = true;
    return NMM_OK;
}

static void swap_caught(nmm_system *system) {
    double *residual = system->residual;
    system->residual = system->caught;
    system->caught = residual;
}

static nmm_status solve_pass(nmm_sim *sim, passes *p, double h, bool anew,
                             nmm_solve_report *report) {
    nmm_system *system = &sim->system;
    if (anew) {
        nmm_system_prepare(&sim->context, system, &sim->model, &sim->state, h);
        if (p->n == 0) weigh_blocks(sim, p, h);
        nmm_system_assemble(&sim->context, system, &sim->model, nmm_balance_weights(&sim->balance));
    } else {
        nmm_system_follow(system, &sim->model, &sim->state);
    }
    nmm_sim_clock(sim, &sim->summary.phase_seconds.assemble);
    guess_change(sim, h, p->n);
    const bool caught = nmm_system_catch(system, &sim->model, &sim->state);
    if (caught) swap_caught(system);
    const nmm_solve_options options = solve_options(sim, p);
    nmm_balance_put_weights(&sim->balance, system, &sim->model);
    if (sim->dump.write != NULL) TRY(sim->dump.write(sim, &options));
    TRY(nmm_solves_open_nearby(sim));
    p->part = solves_nearby(sim, p, h);
    TRY(couple(sim, p));
    TRY(p->part
            ? nmm_nearby_solve(&sim->context, &sim->nearby, system, &sim->state, &options, report)
            : solve_all(sim, &options, report));
    nmm_balance_take_weights(&sim->balance, system, &sim->model);
    if (caught) swap_caught(system);
    nmm_solves_count(sim, report);
    nmm_friction_pass(&sim->friction, p->part ? sim->nearby.n_row : system->K.n_row, report->work,
                      p->verdict.n_sliding > 0);
    sim->report.solver_iterations += report->iterations;
    nmm_sim_clock(sim, &sim->summary.phase_seconds.solve);
    return NMM_OK;
}

static void apply_change(nmm_sim *sim, double part) {
    for (int i = 0; i < 2 * sim->model.n_cover; i++) {
        sim->moved[i] += part * sim->system.change[i];
        sim->state.displacement[i] = sim->start_displacement[i] + sim->moved[i];
    }
}

// Largest component of the change of a cover.
static double largest_change(const nmm_sim *sim) {
    double largest = 0;
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        largest = nmm_max(largest, fabs(sim->system.change[i]));
    return largest;
}

// Largest displacement of a point in this step over the allowed one; NaN counts as infinite.
static double largest_move(const nmm_sim *sim) {
    double largest = 0;
    for (int p = 0; p < sim->model.n_point; p++) {
        const double x = sim->state.position[2 * p] - sim->start_position[2 * p];
        const double y = sim->state.position[2 * p + 1] - sim->start_position[2 * p + 1];
        const double square = x * x + y * y;
        if (!(square <= largest)) largest = square;
        if (!(largest < INFINITY)) return INFINITY;
    }
    return sqrt(largest) / sim->allowed_now;
}

// --- When is it settled?

// Work of the unbalanced forces over the step, next to what its ledger may lose in a step.
static bool adds_up(const nmm_sim *sim) {
    const nmm_ledger *ledger = &sim->summary.ledger;
    double work = 0;
    for (int i = 0; i < 2 * sim->model.n_cover; i++)
        work += sim->system.residual[i] * sim->moved[i];
    return fabs(work) >
           nmm_max(NMM_LEFT_WORK * ledger->largest, NMM_LEFT_ROUNDING * ledger->rounding);
}

// What rounding leaves changes little from pass to pass: where it is next to nothing beside what is
// allowed it is looked at now and then. Before the first pass it is known where the motion is to
// lead; and after carried forces were raised passes begin anew.
static void round_balance(nmm_sim *sim, passes *p, double h) {
    const bool foreseen = p->n > 1 || (motion_goes_on(sim) && p->raised == 0);
    if (foreseen && p->n % NMM_ROUND_AGAIN != 0 && !p->clouded) return;
    round_forces(sim, h);
    p->clouded = is_clouded(sim);
}

// Unbalanced forces of a first pass along the motion do work step by step, which adds up in the
// ledger.
static bool drives(nmm_sim *sim, const passes *p) {
    if (p->n != 1 || !motion_goes_on(sim)) return false;
    return nmm_balance_along(&sim->balance, &sim->system, &sim->model, sim->moved) > NMM_FIRST_PASS;
}

// Do forces balance, eq. (4.5)? What later passes leave of a body that swings and turns adds up as
// well; with Shi's scheme that fades.
static bool balanced(nmm_sim *sim, passes *p, double h) {
    round_balance(sim, p, h);
    p->worst[p->n] =
        nmm_balance_worst(&sim->balance, &sim->system, &sim->model, sim->settings.tolerance);
    if (p->worst[p->n] > 1 || drives(sim, p)) return false;
    const bool swings = sim->settings.newmark && !sim->settings.is_static;
    return !swings || p->n > NMM_SWING_PASSES || !adds_up(sim);
}

// Statics whose passes gain nothing more: is what they leave rounding of the places, and next to
// nothing beside the forces?
static bool is_rounding(nmm_sim *sim, double h) {
    if (!sim->settings.is_static) return false;
    if (nmm_balance_clouded(&sim->balance, NMM_CLOUDED, NMM_GAP_ROUNDING)) return false;
    sim->balance.gap_rounding = NMM_GAP_ROUNDING;
    const bool is = worst_balance(sim, h) <= 1;
    sim->balance.gap_rounding = 1;
    return is;
}

// Norm of the unbalanced forces, by the weights of the try [N]: does it gain? Not next to the
// forces, which fall as well while bodies that overlap are pushed apart.
static double unbalance(const nmm_sim *sim) {
    return nmm_balance_norm(&sim->balance, &sim->system, &sim->model, sim->context.n_thread);
}

// Eight passes that hardly gained on those before: more will not help.
static bool stagnates(const double *left, int n) {
    double before = INFINITY, last = INFINITY;
    for (int k = 0; k < n - 8; k++)
        before = nmm_min(before, left[k]);
    for (int k = nmm_max_int(0, n - 8); k < n; k++)
        last = nmm_min(last, left[k]);
    return n >= 16 && !(last < 0.5 * before);
}

// Not while the block that is worst gains: heavy ones beside it may long be as near as they come.
static bool gains_nothing(const passes *p) {
    return stagnates(p->unbalance + 1, p->n) && stagnates(p->worst + 1, p->n);
}

// How far covers may go before all of the matrix is made anew. A turn by d leaves the part d of the
// unbalanced forces; and against a further turn a stiffness of d^2 E where there is none, next to
// the inertia.
static double drift_allowed(const nmm_sim *sim, double h) {
    double slowest, fastest;
    nmm_wave_squares(&sim->model, &slowest, &fastest);
    const double wave = h * sqrt(fastest) / sim->model.size;
    return sim->model.size * NMM_DRIFT * nmm_min(1, 1 / wave);
}

// Springs may become stiffer while the rounding of places is nothing in them.
static bool may_stiffen(const nmm_sim *sim, const passes *p) {
    const double rounding =
        sim->balance.gap_rounding * nmm_contact_rounding(sim->search, &sim->model, &sim->state);
    return p->stiffer < NMM_SPRING_STIFFEST && NMM_SPRING_STIFFER * rounding <= NMM_SPRING_ROUNDING;
}

// Raise the carried forces of augmented contacts, eq. (5.14); false when springs hold next to
// nothing. Where mesh lines cut two faces there are forces that hardly do anything together, and
// follow slowly: where a round gains little the springs become stiffer.
static bool raise_contacts(nmm_sim *sim, passes *p) {
    if (sim->search == NULL) return false;
    const double before = p->give;
    p->give = nmm_contact_give(sim->search, &sim->model, &sim->state) / p->stiffer;
    if (p->give <= (sim->carried.quick ? NMM_SPRING_SHARE_QUICK : NMM_SPRING_SHARE)) return false;
    const bool slow = p->give > NMM_SPRING_GAIN * before;
    // Gently: only where little is left, so that nothing opens for it.
    const bool allowed = !sim->carrying.gentle || p->give <= NMM_SPRING_SHARE_LEFT;
    const bool stiffer = slow && allowed && may_stiffen(sim, p);
    if (!stiffer && p->give > 0.9 * before && p->give <= NMM_SPRING_SHARE_LEFT) return false;
    nmm_contact_raise(sim->search, &sim->state, stiffer ? NMM_SPRING_STIFFER : 1);
    if (!stiffer) return true;
    p->stiffer *= NMM_SPRING_STIFFER;
    sim->carried.stiff = true;
    // The matrix has the springs as they were.
    p->drift = INFINITY;
    return true;
}

static void say_why(nmm_sim *sim, const nmm_contact_verdict *verdict, const char *what) {
    char contact[160] = "";
    if (verdict->worst >= 0) {
        nmm_contact_describe(&sim->model, &sim->state, verdict->worst, contact, sizeof contact);
    }
    snprintf(sim->report.reason, sizeof sim->report.reason, "%s%s%s", what,
             contact[0] != 0 ? ": " : "", contact);
}

// --- The loop

// What to do after a residual.
typedef enum judgement { SOLVE_ON, LOOK_AGAIN, TRY_ENDED } judgement;

// Forces are those of the law at the places where the covers are, and the law has no jumps: where
// they balance, the step is settled, whatever the last pass did to the modes.
static judgement judge_pass(nmm_sim *sim, passes *p, const nmm_step_state *step, nmm_try *outcome) {
    if (p->n == 0) return SOLVE_ON;
    const bool goes_on = p->n < NMM_MAX_PASS && !gains_nothing(p);
    if (balanced(sim, p, step->h) || (!goes_on && is_rounding(sim, step->h))) {
        *outcome = NMM_TRY_SETTLED;
        const bool broke = nmm_contact_break(&sim->model, &sim->state) > 0;
        const bool contacts = !broke && raise_contacts(sim, p);
        const bool supports = !broke && nmm_supports_raise(sim, step, !contacts);
        if (!(broke || contacts || supports)) return TRY_ENDED;
        p->raised += !broke;
        if (p->raised > NMM_MAX_RAISE) {
            // Forces balance, but overlaps are larger than allowed; a shorter step may do. At rest
            // it would only let go what was raised: that goes on in the next step.
            say_why(sim, &p->verdict, "carried forces have not come to rest");
            sim->overlaps = contacts;
            if (contacts && !sim->settings.is_static) *outcome = NMM_TRY_CARRIED;
            return TRY_ENDED;
        }
        // Passes are counted for one set of bonds and carried forces.
        p->n = 1;
        p->n_vain = 0;
        p->in_vain = false;
        return LOOK_AGAIN;
    }
    if (goes_on) return SOLVE_ON;
    const bool quiet = count_flips(&p->verdict) == 0;
    say_why(sim, &p->verdict, quiet ? "forces do not balance" : "contacts keep changing mode");
    *outcome = quiet ? NMM_TRY_FORCES : NMM_TRY_FLIPS;
    return TRY_ENDED;
}

// --- Line search

// Work of the unbalanced forces along the change: falls from positive through zero where they
// balance best. Where forces of blocks are far apart, each class of them counts as much as the
// others, by its work at the beginning.
typedef struct line {
    double share[NMM_FORCE_CLASSES];
    double work; // at the beginning
} line;

static double work_along(const nmm_sim *sim, const line *along) {
    double work[NMM_FORCE_CLASSES], sum = 0;
    nmm_balance_work(&sim->balance, &sim->system, &sim->model, sim->context.n_thread, work);
    for (int k = 0; k < sim->balance.n_class; k++)
        sum += along->share[k] * work[k];
    return sum;
}

// A class whose blocks balance has no say: next to the work of a rounding all is large.
static line begin_line(nmm_sim *sim) {
    line along = {{0}, 0};
    double work[NMM_FORCE_CLASSES], least[NMM_FORCE_CLASSES], most = 0;
    nmm_balance_least_work(&sim->balance, &sim->system, &sim->model, least);
    nmm_balance_work(&sim->balance, &sim->system, &sim->model, sim->context.n_thread, work);
    for (int k = 0; k < sim->balance.n_class; k++)
        most = nmm_max(most, work[k]);
    for (int k = 0; k < sim->balance.n_class; k++)
        along.share[k] = work[k] > least[k] ? most / work[k] : 0;
    for (int k = 0; k < sim->balance.n_class; k++)
        along.work += along.share[k] * work[k];
    return along;
}

// Go a further part of the change; contacts and residual there.
static void go_further(nmm_sim *sim, passes *p, const nmm_step_state *step, double part) {
    apply_change(sim, part);
    const nmm_touched *touched = p->part ? &sim->nearby.touched : NULL;
    p->verdict = p->part ? evaluate_touched(sim, &p->verdict) : evaluate_contacts(sim);
    nmm_sim_clock(sim, &sim->summary.phase_seconds.contact);
    nmm_system_residual(&sim->context, &sim->system, &sim->model, &sim->state, step, touched);
    nmm_sim_clock(sim, &sim->summary.phase_seconds.assemble);
}

// Go along the change. A contact force has a corner where it sets in, so that the whole change may
// lead far beyond the balance and the next one as far back, for ever. Where the forces at its end
// point back by more than a part of what they were, the balance is between: false position, where
// an end that stays counts half (the Illinois rule).
static void go_along(nmm_sim *sim, passes *p, const nmm_step_state *step, const line *along) {
    double low = 0, low_work = along->work, high = 1, at = 1;
    const double enough = NMM_OVERSHOOT * low_work;
    go_further(sim, p, step, 1);
    double work = work_along(sim, along), high_work = work, last = work;
    // With friction a change need not begin downhill.
    if (sim->search == NULL || enough <= 0 || work >= -enough) return;
    for (int k = 0; k < NMM_MAX_LOOK && fabs(work) > enough; k++) {
        const double share = nmm_max(0.05, nmm_min(0.95, low_work / (low_work - high_work)));
        const double next = low + share * (high - low);
        go_further(sim, p, step, next - at);
        work = work_along(sim, along);
        at = next;
        if (work > 0) {
            low = at, low_work = work;
            if (last > 0) high_work *= 0.5;
        } else {
            high = at, high_work = work;
            if (last <= 0) low_work *= 0.5;
        }
        last = work;
    }
}

// --- The loop

// Passes that differ by friction alone: the last one changed no mode, and if it was mixed, it
// gained.
static bool may_mix(const passes *p) {
    return p->n >= 2 && p->verdict.n_sliding > 0 && count_flips(&p->verdict) == 0;
}

// Go the mixed change instead; where that leaves more than there was, the change as it is stays to
// be gone.
static bool go_mixed(nmm_sim *sim, passes *p, const nmm_step_state *step) {
    nmm_mixing *mixing = &sim->mixing;
    const bool mixed =
        sim->search != NULL &&
        nmm_mixing_take(mixing, sim->moved, sim->system.change, may_mix(p), sim->context.n_thread);
    if (!mixed) return false;
    go_further(sim, p, step, 1);
    if (unbalance(sim) < p->unbalance[p->n]) return true;
    apply_change(sim, -1);
    memcpy(sim->system.change, mixing->change, (size_t)mixing->n * sizeof(double));
    nmm_mixing_reset(mixing);
    return false;
}

// One linear solve, applied; leaves the residual there. *outcome says when the solve missed its
// tolerance or the step went too far.
static nmm_status correct(nmm_sim *sim, passes *p, const nmm_step_state *step, nmm_try *outcome) {
    nmm_solve_report solved = {0};
    // Without sliding the matrix is the exact derivative: a fresh one gains digits by the square.
    const bool exact = p->verdict.n_sliding == 0;
    const bool anew = p->n == 0 || exact || p->drift > p->drift_allowed;
    TRY(solve_pass(sim, p, step->h, anew, &solved));
    p->drift = (anew ? 0 : p->drift) + largest_change(sim);
    if (solved.end != NMM_SOLVE_CONVERGED) {
        snprintf(sim->report.reason, sizeof sim->report.reason,
                 "the solver %s (%d iterations, relative residual %.2g)",
                 nmm_solves_end(solved.end), solved.iterations, solved.residual);
        *outcome = NMM_TRY_SOLVER;
        return NMM_OK;
    }
    const line along = begin_line(sim);
    const bool coupled = solved.coupled && couples(sim, p);
    if (coupled || p->part) nmm_mixing_reset(&sim->mixing);
    if (coupled || p->part || !go_mixed(sim, p, step)) go_along(sim, p, step, &along);
    const double left = unbalance(sim);
    const bool gained = left < NMM_GAINED * p->unbalance[p->n];
    // The first pass of a step finds the modes: what it leaves says little.
    p->in_vain = coupled && !gained && !p->part && p->n > 0;
    p->whole = p->part && !gained;
    p->n_vain += p->in_vain;
    p->n += 1;
    p->unbalance[p->n] = left;
    sim->report.passes += 1;
    sim->summary.open_close_iterations += 1;
    sim->report.move = largest_move(sim);
    // Far beyond what is allowed: no need to settle first.
    if (sim->report.move > 2) *outcome = NMM_TRY_MOVED;
    return NMM_OK;
}

static void look_again(nmm_sim *sim, passes *p, const nmm_step_state *step) {
    p->verdict = evaluate_contacts(sim);
    nmm_sim_clock(sim, &sim->summary.phase_seconds.contact);
    nmm_system_residual(&sim->context, &sim->system, &sim->model, &sim->state, step, NULL);
    p->unbalance[p->n] = unbalance(sim);
    nmm_sim_clock(sim, &sim->summary.phase_seconds.assemble);
}

nmm_status nmm_step_try(nmm_sim *sim, double h, nmm_try *outcome) {
    const nmm_step_state step = {h, nmm_sim_time_after(sim, h), sim->moved};
    passes p = {.give = INFINITY, .stiffer = 1, .drift_allowed = drift_allowed(sim, h)};
    sim->report.passes = 0;
    *outcome = NMM_TRY_SETTLED;
    nmm_mixing_reset(&sim->mixing);
    nmm_supports_begin(sim);
    sim->overlaps = false;
    restore_start(sim);
    sim->carried = nmm_system_stiffen(&sim->system, &sim->model, &sim->state, h, sim->carrying);
    begin_move(sim, h, step.end);
    // Carried forces remember the way that passes take, and statics have many equilibria. Under
    // loads that set in at once bodies that touch may part anywhere: large slopes then found no
    // end.
    sim->system.pressed =
        motion_goes_on(sim) && sim->state.step > 0 && sim->system.cover_give == NULL;
    nmm_system_load(&sim->system, &sim->model, step.end);
    look_again(sim, &p, &step);
    while (*outcome == NMM_TRY_SETTLED) {
        const judgement judged = judge_pass(sim, &p, &step, outcome);
        if (judged == TRY_ENDED) return NMM_OK;
        if (judged == LOOK_AGAIN) look_again(sim, &p, &step);
        if (judged == SOLVE_ON) TRY(correct(sim, &p, &step, outcome));
    }
    return NMM_OK;
}
