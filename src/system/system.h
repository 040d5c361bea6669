// SPDX-License-Identifier: MIT
//
// The system of equations of one pass: sparsity pattern, residual at the end configuration, matrix,
// supports and loads.
//
//   (2/h^2 + 2 alpha/h) M d2 + K d2 = r,   r = f(t1) - f_int(d) - M (2 (d - d0)/h^2 - 2 v0/h) - ...
//
// Every row of matrix and residual is gathered by one thread in a fixed order: the same bits for
// any number of threads.

#ifndef NMM_SYSTEM_H
#define NMM_SYSTEM_H

#include "contact.h"
#include "mechanics.h"
#include "scene.h"
#include "solve.h"

/// Pattern, matrix and vectors of the run; owned by the simulation.
typedef struct nmm_system {
    nmm_bsr K;
    double *residual;   // [n_cover][2] N
    double *change;     // [n_cover][2] m: solution of a pass
    bool keep_pattern;  // the pattern is that of the last call of nmm_system_pattern
    double force_scale; // [N] norm of all forces of the last residual: what it is measured against

    // Constant over the run.
    int *base_start, *base_col;         // pattern of the elements alone
    int *base_slot;                     // [n_element][3][3] entry of base_col for covers (i, j)
    double *element_mass;               // [n_element][6] kg, nmm_mass_of; diagonal when lumped
    double *cover_mass;                 // [n_cover] kg, row sums
    int *support_start, *cover_support; // 3 * support + place of the cover in it, by cover
    double *reaction;     // [n_cover][2] N: forces that hold held unknowns, else 0; NULL likewise
    unsigned char *fixed; // [n_cover] bit 0: x, bit 1: y; NULL when nothing is held
    double damping;       // [1/s]

    // Follow from the contacts.
    int *place; // [n_base] entry of K for an entry of base_col
    int n_contact, contact_capacity;
    int row_capacity;     // blocks that K has room for
    nmm_contact_row *row; // [n_contact] at the last residual
    int *identity;        // [n_contact][2] vertex, edge of the last pattern
    int *contact_slot;    // [n_contact][6][6] entry of K
    int *contact_start;   // [n_cover + 1]
    int *cover_contact;   // 6 * contact + place of the cover in it, by cover
    int column_capacity;
    int *column;   // scratch: columns of all rows, row c from row_room[c]
    int *row_room; // [n_cover]

    // Of the pass.
    double *piola;            // [n_element][4] Pa
    nmm_stiffness *stiffness; // [n_element]
    double *acceleration;     // [n_cover][2] m/s2, damping included
    double *load;             // [n_cover][2] N
    double *scale;            // [n_cover] N2: squares of the forces in a row
} nmm_system;

/// The step that the residual belongs to.
typedef struct nmm_step_state {
    double h;            // [s]
    double end;          // [s] time at its end
    const double *moved; // [n_cover][2] displacement of the step
} nmm_step_state;

nmm_status nmm_system_create(nmm_context *context, const nmm_model *model,
                             const nmm_scene_settings *settings, nmm_system *system);
void nmm_system_destroy(nmm_context *context, nmm_system *system);

/// Pattern of elements and contacts; only rebuilt when the list of contacts changed.
nmm_status nmm_system_pattern(nmm_context *context, nmm_system *system, const nmm_model *model,
                              const nmm_state *state);

/// system->load: gravity, ground acceleration and loads at `time`.
void nmm_system_load(nmm_system *system, const nmm_model *model, double time);

/// system->residual and force_scale at state->displacement, position and contact forces.
void nmm_system_residual(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, const nmm_step_state *step);

/// system->K at the same configuration; call after the residual.
void nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h);

/// Put held covers at their prescribed place at `time`.
void nmm_system_hold(const nmm_model *model, nmm_state *state, double time);

/// Distance of a support's point from its prescribed place at `time`, [m] by component; 0 where
/// free.
nmm_vec2 nmm_support_error(const nmm_model *model, const nmm_state *state, int support,
                           double time);

/// Force of a support on the body [N].
nmm_vec2 nmm_support_reaction(const nmm_model *model, const nmm_state *state, int support,
                              nmm_vec2 error);

/// Supports, held blocks, loads, monitors of the scene onto the model's points and edges.
/// What touches nothing is rejected with its line and column.
nmm_status nmm_loads_place(nmm_context *context, nmm_scene *scene, nmm_model *model);

/// Initial stress of the elements and initial velocities of the blocks.
void nmm_loads_start(const nmm_scene *scene, const nmm_model *model, nmm_state *state);

#endif
