// SPDX-License-Identifier: MIT
//
// Contact between loop vertices and loop edges: candidates by a grid of cells, vertex-edge contacts
// with tributary lengths, history by identity, Mohr-Coulomb return mapping, open-close judgement.
//
// One step:  find (candidates, narrow phase, inherit) once;  evaluate after each solve;  commit
// when the step is accepted. All give the same bits for any number of threads. Equations (5.x) of
// docs/theory/5-contact.md.

#ifndef NMM_CONTACT_H
#define NMM_CONTACT_H

#include "model.h"

#include <math.h>

typedef struct nmm_contact_options {
    double penalty; // normal stiffness per tributary length = penalty * E / h, E harmonic mean
    bool augmented; // carried forces follow the contact forces until nothing overlaps
} nmm_contact_options;

/// Why the open-close loop goes on, and which contact is the worst.
typedef struct nmm_contact_verdict {
    int n_opened, n_closed; // against the modes before the evaluation
    int n_slipped, n_stuck;
    int n_sliding;      // contacts that slide now
    int n_slid;         // that slid before
    int worst;          // contact that changed mode with the largest force, -1: none
    double worst_force; // [N] of that one
} nmm_contact_verdict;

/// Derivatives of gap and slip by the displacements of 2 n_local covers: of the vertex, then of the
/// edge.
typedef struct nmm_contact_row {
    int cover[2 * NMM_MOST_LOCAL];
    double normal[2 * NMM_MOST_LOCAL][2]; // d gap  / d cover displacement
    double shear[2 * NMM_MOST_LOCAL][2];  // d slip / d cover displacement
} nmm_contact_row;

/// Where derivatives go: of the covers of the vertex, then of those of the edge, [n_local][2] each.
typedef struct nmm_derivatives {
    double *normal[2], *shear[2];
} nmm_derivatives;

/// Modulus of a vertex and an edge in a row, their harmonic mean. Either edge at the vertex may be
/// the one that faces the other block: on a border of materials `after` and `before` it differ.
static inline double nmm_contact_modulus(double after, double before, double edge) {
    const double vertex = 0.5 * (after + before);
    return 2 * vertex * edge / (vertex + edge);
}

/// Energies of all contacts; the ledger takes differences.
typedef struct nmm_contact_energy {
    double elastic;  // [J] normal and shear springs
    double friction; // [J] lost in sliding since the start
    double fracture; // [J] lost when bonds broke since the start
} nmm_contact_energy;

/// The spatial index, kept over steps; rebuilt when something moved too far for it.
typedef struct nmm_contact_search nmm_contact_search;

/// Can two parts of the boundary ever meet? So they can with two blocks, with a crack, and where a
/// block has sides that face each other: a slot, a hole, two prongs. Else there is nothing to find.
nmm_status nmm_contact_can_be(nmm_context *context, const nmm_model *model, bool *can_be);

nmm_status nmm_contact_open(nmm_context *context, const nmm_model *model,
                            const nmm_contact_options *options, nmm_contact_search **search);
void nmm_contact_close(nmm_context *context, nmm_contact_search **search);

/// All vertices nearer than `reach` [m] to an edge they could touch: rewrites state->contact,
/// sorted by (vertex, edge), history inherited. The first call of a run bonds the joints and, with
/// initial stress, gives contacts the forces that hold it.
nmm_status nmm_contact_find(nmm_context *context, nmm_contact_search *search,
                            const nmm_model *model, nmm_state *state, double reach);

/// A copy of the list as it is, in the room of the next one: valid until that is looked for.
nmm_status nmm_contact_save(nmm_context *context, nmm_contact_search *search,
                            const nmm_state *state, const nmm_contact **start);

/// Gap, slip, forces and mode of each contact at state->position, from the anchors of the step's
/// start. Returns how the modes differ from those before.
nmm_contact_verdict nmm_contact_evaluate(const nmm_contact_search *search, const nmm_model *model,
                                         nmm_state *state, int n_thread);

/// The same for n contacts; NULL: the first ones. The others have not moved since the last time.
nmm_contact_verdict nmm_contact_evaluate_some(const nmm_model *model, nmm_state *state,
                                              const int *contact, int n, int n_thread);

/// The derivatives at state->position, eq. (5.5) and (5.6): exact, so that a pair of contact forces
/// has neither resultant nor moment.
nmm_contact_row nmm_contact_row_of(const nmm_model *model, const nmm_state *state,
                                   const nmm_contact *contact);

/// The derivatives alone, at the last evaluation.
void nmm_contact_derive(const nmm_model *model, const nmm_contact *contact,
                        const nmm_derivatives *to);

/// Forces of the contact at the last evaluation: pull[3][2] [N] on the vertex, on the start and on
/// the end of the edge. With the weights of the covers there the same as the row times the forces.
void nmm_contact_pull(const nmm_contact *contact, double pull[6]);

/// Has any interface a strength, so that contacts on it may be bonded?
bool nmm_contact_may_bond(const nmm_model *model);

/// Forces balance: bonds loaded beyond their strength break in this step, the most loaded ones
/// first. Returns how many; then the passes go on.
int nmm_contact_break(const nmm_model *model, nmm_state *state);

/// Augmented contact: the largest part of a force that a spring still holds beside the carried
/// force, by an overlap or, sticking, by slip; 0 where nothing is carried.
double nmm_contact_give(const nmm_contact_search *search, const nmm_model *model,
                        const nmm_state *state);

/// How far its vertex or its edge has moved since the start [m]: gaps are differences of that.
static inline double nmm_contact_way(const nmm_model *model, const nmm_state *state,
                                     const nmm_contact *contact) {
    const double *a = state->shift + 2 * (long)model->vertex_point[contact->vertex];
    const double *b = state->shift + 2 * (long)model->vertex_point[contact->edge];
    return nmm_max(nmm_max(fabs(a[0]), fabs(a[1])), nmm_max(fabs(b[0]), fabs(b[1])));
}

/// Augmented contact: what the rounding of displacements is in the stiffest spring, over the
/// largest force.
double nmm_contact_rounding(const nmm_contact_search *search, const nmm_model *model,
                            const nmm_state *state);

/// The springs of a closed contact became stiffer: they give way by less, and hold its forces.
/// `gap` is that of now.
void nmm_contact_keep(const nmm_model *model, const nmm_state *state, nmm_contact *contact,
                      double gap);

/// Augmented contact: carried forces of closed contacts become what acts; their springs are made
/// `stiffer` by a factor, until the next step.
void nmm_contact_raise(const nmm_contact_search *search, nmm_state *state, double stiffer);

/// The step is accepted: anchors follow the slip, bonds break.
/// Adds friction and fracture of the step to *energy and sets its elastic part.
void nmm_contact_commit(const nmm_contact_search *search, const nmm_model *model, nmm_state *state,
                        nmm_contact_energy *energy);

/// Elastic energy of all contacts as they are [J]; bonds keep the forces of now.
double nmm_contact_stored(const nmm_contact_search *search, nmm_state *state);

/// Of the contacts of the step just committed the one that gained most energy from nowhere: whose
/// forces did more work on the covers and on friction than it lost. `start` is the list as the step
/// began with it, `moved` the way of the covers. -1: none gained.
int nmm_contact_gainer(const nmm_contact_search *search, const nmm_model *model,
                       const nmm_state *state, const nmm_contact *start, const double *moved);

/// Augmented contact: what all contacts store at the end of a try and lost in it, less twice what
/// those stored at its start that springs held alone before, and carried forces push out now [J]:
/// at rest that takes no more. Minus infinity: there are none.
double nmm_contact_pushed(const nmm_contact_search *search, const nmm_state *state,
                          const nmm_contact *start);

/// "contact of block 3 'slider' with block 0 at (1.2, 3.4)" into text[size].
void nmm_contact_describe(const nmm_model *model, const nmm_state *state, int contact, char *text,
                          size_t size);

#endif
