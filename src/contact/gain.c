// SPDX-License-Identifier: MIT
//
// Which contact brings energy from nowhere: the bracket of eq. (4.10) contact by contact. Asked
// only after steps in which much of it came, so that nothing is kept for it but the last list,
// which the search has in any case.

#include "search.h"

#include <math.h>

// At rest a spring that is pushed out under its force gives back half of the work that this takes:
// as much as it stored is gained, and more by loads that grow on the way.
#define STORED_TWICE 2

// What the contact stored when the last step ended; one of another name has it from its history.
static double stored_before(const nmm_contact_search *search, const nmm_contact *start) {
    const nmm_last_list last = {search->next, search->last_start};
    const nmm_contact *old = nmm_contact_lookup(&last, start->vertex, start->edge);
    return nmm_contact_stored_in(search, old != NULL ? old : start);
}

// Work of the contact's forces at the end of the step on the covers.
static double work_of(const nmm_model *model, const nmm_state *state, const nmm_contact *c,
                      const double *moved) {
    const nmm_contact_row row = nmm_contact_row_of(model, state, c);
    double work = 0;
    for (int i = 0; i < 2 * model->n_local; i++) {
        for (int x = 0; x < 2; x++)
            work += (c->normal_force * row.normal[i][x] + c->shear_force * row.shear[i][x]) *
                    moved[2 * (long)row.cover[i] + x];
    }
    return work;
}

// What the contact will have stored and lost in sliding when the try is accepted.
static double taken_up(const nmm_contact_search *search, const nmm_contact *c) {
    nmm_contact end = *c;
    if (c->mode != NMM_CONTACT_SLIDE) return nmm_contact_stored_in(search, &end);
    if (!c->hasty) end.carried_shear = c->shear_force;
    end.slip = (end.carried_shear - c->shear_force) / c->shear_stiffness;
    return nmm_contact_stored_in(search, &end) + fabs(c->shear_force * (c->slip - end.slip));
}

double nmm_contact_pushed(const nmm_contact_search *search, const nmm_state *state,
                          const nmm_contact *start) {
    double pushed = 0, stored = 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        stored += taken_up(search, c);
        if (start[k].hasty && !c->hasty && start[k].mode != NMM_CONTACT_OPEN)
            pushed += nmm_contact_stored_in(search, &start[k]);
    }
    return pushed > 0 ? stored - STORED_TWICE * pushed : -INFINITY;
}

int nmm_contact_gainer(const nmm_contact_search *search, const nmm_model *model,
                       const nmm_state *state, const nmm_contact *start, const double *moved) {
    int gainer = -1;
    double most = 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        const double friction = fabs(c->shear_force) * (c->slid - start[k].slid);
        const double stored = nmm_contact_stored_in(search, c) - stored_before(search, &start[k]);
        const double gain = work_of(model, state, c, moved) + stored + friction;
        if (gain <= most) continue;
        most = gain;
        gainer = k;
    }
    return gainer;
}
