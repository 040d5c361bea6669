// SPDX-License-Identifier: MIT
//
// Springs that become stiffer hold what they held, eq. (5.15) of docs/theory/5-contact.md: with the
// forces of the pressure they would do work that nothing has put into them. What they gave way by
// is less then: rest and anchor move. So it is when two sides share more than they did in the last
// list; a vertex that only stands for more of them, and another one for less, passes its force on.

#include "search.h"

#include <math.h>

void nmm_contact_keep(const nmm_model *model, const nmm_state *state, nmm_contact *contact,
                      double gap) {
    if (contact->mode == NMM_CONTACT_OPEN) return;
    const double overlap =
        (contact->carried_normal - contact->normal_force) / contact->normal_stiffness;
    if (overlap <= 0 && gap - contact->rest < overlap) contact->rest = gap - overlap;
    const double slip = (contact->carried_shear - contact->shear_force) / contact->shear_stiffness;
    if (!(fabs(slip) < fabs(contact->slip))) return;
    const double length = nmm_edge_line_of(model, state, contact->edge).length;
    contact->anchor += (contact->slip - slip) / length;
    contact->slip = slip;
}

// Side of the vertex that faces the edge: of both edges there the one that runs more against it.
static nmm_side_pair *sides_of(nmm_contact_search *search, const nmm_model *model, int size,
                               const nmm_contact *c) {
    const int before = model->vertex_prev[c->vertex];
    const nmm_vec2 t = search->line[c->edge].t;
    const double out = nmm_vec2_dot(search->line[c->vertex].t, t);
    const double in = nmm_vec2_dot(search->line[before].t, t);
    const int facing = in < out ? before : c->vertex;
    return nmm_side_pair_of(search, size, search->side[facing], search->side[c->edge]);
}

// Of what two sides share: pressed, or an overlap that came without force.
static bool is_shared(const nmm_contact *c) {
    return !c->bonded && (c->mode != NMM_CONTACT_OPEN || c->gap <= 0);
}

nmm_status nmm_contact_keep_sides(nmm_context *context, nmm_contact_search *search,
                                  const nmm_model *model, nmm_state *state) {
    // The list before: it gave its place to the new one.
    const nmm_contact *last = search->next;
    const int n_last = search->last_start[model->n_vertex];
    int size = 0;
    TRY(nmm_side_table(context, search, n_last + state->n_contact, &size));
    for (int k = 0; k < n_last; k++)
        if (is_shared(&last[k]))
            sides_of(search, model, size, &last[k])->last += last[k].spring_length;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        if (is_shared(c)) sides_of(search, model, size, c)->length += c->spring_length;
    }
    for (int k = 0; k < state->n_contact; k++) {
        nmm_contact *c = &state->contact[k];
        if (!is_shared(c) || c->mode == NMM_CONTACT_OPEN) continue;
        const nmm_side_pair *sides = sides_of(search, model, size, c);
        const double growth = sides->last > 0 ? sides->length / sides->last : 1;
        if (growth <= NMM_LONGER) continue;
        nmm_contact_scale(c, c, 1 / growth);
        nmm_contact_keep(model, state, c, c->gap);
    }
    return NMM_OK;
}
