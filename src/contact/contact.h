// SPDX-License-Identifier: MIT
//
// Contact between loop vertices and loop edges: candidates by a uniform grid, vertex-edge contacts
// with tributary lengths, history by identity, Mohr-Coulomb return mapping, open-close judgement.
//
// One step:  find (candidates, narrow phase, inherit) once;  evaluate after each solve;  commit
// when the step is accepted. Find, evaluate and commit give the same bits for any number of
// threads.

#ifndef NMM_CONTACT_H
#define NMM_CONTACT_H

#include "model.h"

typedef struct nmm_contact_options {
    double penalty; // normal stiffness per tributary length = penalty * E / h, E harmonic mean of
                    // both sides
    bool augmented; // carried normal forces follow the contact force
    double reach;   // [m] a vertex nearer than this to an edge is a contact (open ones too)
} nmm_contact_options;

/// Why the open-close loop goes on, and which contact is the worst.
typedef struct nmm_contact_verdict {
    int n_opened, n_closed; // against the modes before the evaluation
    int n_slipped, n_stuck;
    int worst;           // contact whose normal force changed most, -1: none
    double force_change; // [N] of that contact
    double force_scale;  // [N] largest normal force
    double penetration;  // [m] largest overlap
    uint64_t modes;      // hash of all modes: the same twice in one step is a cycle
} nmm_contact_verdict;

/// Derivatives of gap and slip by the displacements of six covers (of the vertex, then of the
/// edge).
typedef struct nmm_contact_row {
    int cover[6];
    double normal[6][2]; // d gap  / d cover displacement
    double shear[6][2];  // d slip / d cover displacement
} nmm_contact_row;

/// Energies of all contacts; the ledger takes differences.
typedef struct nmm_contact_energy {
    double elastic;  // [J] normal and shear springs
    double friction; // [J] lost in sliding since the start
    double fracture; // [J] lost when bonds broke since the start
} nmm_contact_energy;

/// The spatial index, kept over steps; rebuilt when something moved more than half the skin.
typedef struct nmm_contact_search nmm_contact_search;

nmm_status nmm_contact_open(nmm_context *context, const nmm_model *model,
                            const nmm_contact_options *options, nmm_contact_search **search);
void nmm_contact_close(nmm_context *context, nmm_contact_search **search);

/// First call of a run: contacts of joints get their bond and, with initial stress, their carried
/// forces. Rewrites state->contact, sorted by (vertex, edge), history inherited.
nmm_status nmm_contact_find(nmm_context *context, nmm_contact_search *search,
                            const nmm_model *model, nmm_state *state);

/// Gap, slip, forces and mode of each contact at state->position, from the anchors of the step's
/// start. Returns how the modes differ from those before.
nmm_contact_verdict nmm_contact_evaluate(const nmm_contact_search *search, const nmm_model *model,
                                         nmm_state *state);

/// The derivatives at state->position, for the assembly.
nmm_contact_row nmm_contact_row_of(const nmm_model *model, const nmm_state *state,
                                   const nmm_contact *contact);

/// The step is accepted: anchors follow the slip, bonds break, carried forces are updated.
/// Adds friction and fracture of the step to *energy and sets its elastic part.
void nmm_contact_commit(const nmm_contact_search *search, const nmm_model *model, nmm_state *state,
                        nmm_contact_energy *energy);

#endif
