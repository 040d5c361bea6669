// SPDX-License-Identifier: MIT
//
// The watch of the energy ledger. What `numerical` gives back of what it took has come from
// nowhere, and the residual is what the equations leave: both are looked at after each step, next
// to the largest energy that any term had, and told once, when the run is summed up.

#include "step.h"

#include <math.h>
#include <stdio.h>

// Gain of a step, over the largest energy, from which on its place is asked for; and by how much
// more the next one must gain, so that it is asked for a few times in a run.
#define WORTH_A_PLACE 1e-5
#define MUCH_MORE 2

// Forces are sums of what strains of the whole and its springs hold, which are known to so much.
#define FORCE_ROUNDING 1e-15
#define WAY_ROUNDING 1e-9

void nmm_watch_start(nmm_sim *sim) {
    double stiffest = 0;
    for (int m = 0; m < sim->model.n_material; m++)
        stiffest = nmm_max(stiffest, sim->model.material[m].youngs_modulus);
    const double springs = nmm_max(1, 2 * sim->settings.penalty);
    sim->watch.force = FORCE_ROUNDING * stiffest * springs * 2 * sim->model.height;
    sim->summary.ledger.largest = sim->kinetic0;
}

// --- Where

// The element that gained most.
static int gaining_element(const nmm_sim *sim) {
    nmm_sim before = *sim;
    before.state.displacement = sim->start_displacement;
    int gainer = 0;
    double most = -INFINITY;
    for (int e = 0; e < sim->model.n_element; e++) {
        double work, unused;
        const double stored = nmm_ledger_strain(sim, e, &work);
        const double gain = stored - nmm_ledger_strain(&before, e, &unused) - work;
        if (gain <= most) continue;
        most = gain;
        gainer = e;
    }
    return gainer;
}

static void find_place(nmm_sim *sim, const nmm_losses *losses) {
    nmm_watch *watch = &sim->watch;
    const double least = nmm_min(losses->elements, nmm_min(losses->contacts, losses->supports));
    watch->place[0] = 0;
    watch->gainer = least == losses->contacts   ? NMM_GAIN_CONTACTS
                    : least == losses->elements ? NMM_GAIN_ELEMENTS
                                                : NMM_GAIN_SUPPORTS;
    if (watch->gainer == NMM_GAIN_ELEMENTS) {
        nmm_element_place(sim, gaining_element(sim), watch->place, sizeof watch->place);
    } else if (watch->gainer == NMM_GAIN_CONTACTS && sim->search != NULL) {
        const int contact = nmm_contact_gainer(sim->search, &sim->model, &sim->state,
                                               sim->start_contact, sim->moved);
        if (contact >= 0)
            nmm_contact_describe(&sim->model, &sim->state, contact, watch->place,
                                 sizeof watch->place);
    }
}

// --- Step by step

static double largest_term(const nmm_energy *e) {
    const double term[] = {e->kinetic, e->strain,  e->contact,  e->friction, e->fracture,
                           e->support, e->damping, e->external, e->numerical};
    double largest = 0;
    for (int i = 0; i < 9; i++)
        largest = nmm_max(largest, fabs(term[i]));
    return largest;
}

// The step since which `amount` is above its limit, 0: it is not.
static void note_step(const nmm_sim *sim, bool above, long *step, double *time) {
    if (above && *step > 0) return;
    *step = above ? sim->state.step : 0;
    *time = above ? sim->state.time : 0;
}

void nmm_watch_step(nmm_sim *sim, const nmm_losses *losses) {
    nmm_watch *watch = &sim->watch;
    nmm_ledger *ledger = &sim->summary.ledger;
    const nmm_energy *energy = &sim->energy;
    watch->way += sim->report.move * sim->allowed_now;
    watch->lost = nmm_max(watch->lost, energy->numerical);
    ledger->rounding = watch->force * (watch->way + WAY_ROUNDING * 2 * sim->model.height);
    ledger->largest = nmm_max(ledger->largest, largest_term(energy));
    ledger->gain = nmm_max(ledger->gain, watch->lost - energy->numerical);
    ledger->residual = nmm_max(ledger->residual, fabs(energy->residual));
    note_step(sim, ledger->gain > nmm_max(NMM_GAIN_LIMIT * ledger->largest, ledger->rounding),
              &ledger->gain_step, &ledger->gain_time);
    note_step(sim,
              ledger->residual > nmm_max(NMM_RESIDUAL_LIMIT * ledger->largest, ledger->rounding),
              &ledger->residual_step, &ledger->residual_time);
    const double gained = -(losses->elements + losses->contacts + losses->supports);
    if (gained <= nmm_max(MUCH_MORE * watch->step_gain, WORTH_A_PLACE * ledger->largest)) return;
    watch->step_gain = gained;
    find_place(sim, losses);
}

// --- In words

static const char *advice_of(const nmm_sim *sim) {
    const bool augmented = sim->settings.contact_method == NMM_CONTACT_AUGMENTED;
    if (sim->watch.gainer != NMM_GAIN_CONTACTS)
        return sim->settings.is_static ? "another covers.size" : "a smaller time.dt_max";
    if (augmented)
        return sim->settings.is_static ? "contact.method: penalty"
                                       : "a smaller time.dt_max, or contact.method: penalty,";
    return sim->settings.is_static ? "a lower contact.penalty"
                                   : "a smaller time.dt_max, or a lower contact.penalty,";
}

// "since step 12 (0.3 s)"; statics have no time.
static void say_since(const nmm_sim *sim, long step, double time, char *text, size_t size) {
    if (sim->settings.is_static)
        snprintf(text, size, "since step %ld", step);
    else
        snprintf(text, size, "since step %ld (%.4g s)", step, time);
}

void nmm_watch_tell(nmm_sim *sim) {
    static const char *const of[] = {"elements", "contacts", "supports"};
    nmm_ledger *ledger = &sim->summary.ledger;
    const nmm_watch *watch = &sim->watch;
    const size_t size = sizeof ledger->warning;
    char since[64];
    int n = 0;
    ledger->warning[0] = 0;
    if (ledger->gain_step > 0) {
        say_since(sim, ledger->gain_step, ledger->gain_time, since, sizeof since);
        n = snprintf(
            ledger->warning, size,
            "energy from nowhere, %.3g J or %.2g %% of the largest energy, more than %g %% "
            "%s; most of it by %s%s%s; %s may help",
            ledger->gain, 100 * ledger->gain / ledger->largest, 100 * NMM_GAIN_LIMIT, since,
            of[watch->gainer], watch->place[0] != 0 ? ": " : "", watch->place, advice_of(sim));
    }
    if (ledger->residual_step > 0) {
        say_since(sim, ledger->residual_step, ledger->residual_time, since, sizeof since);
        snprintf(ledger->warning + n, size - (size_t)n,
                 "%sthe energy ledger does not close, by %.3g J or %.2g of the largest energy, "
                 "more than %g %s: forces are not balanced closely enough; a smaller "
                 "analysis.tolerance than %g may help",
                 n > 0 ? "; " : "", ledger->residual, ledger->residual / ledger->largest,
                 NMM_RESIDUAL_LIMIT, since, sim->settings.tolerance);
    }
}
