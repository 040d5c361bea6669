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

/// A spring of the matrix, frozen when the matrix was made: derivatives of gap and slip by the
/// displacements of the couple's six covers, and the stiffnesses that act.
typedef struct nmm_spring {
    double normal[6][2], shear[6][2];
    double normal_stiffness, shear_stiffness; // [N/m]; sliding: no shear
} nmm_spring;

/// Contacts by couples: two elements whose loop edges meet in one contact or more. The pattern of
/// the matrix follows from the couples alone, and they change less often than the contacts.
typedef struct nmm_couples {
    int n_contact, contact_capacity;
    int *identity; // [n_contact][2] vertex, edge of the list these follow from
    int *order;    // [n_contact] 2 * contact + (the vertex is on the second element), by couple
    int *by_edge;  // [n_contact] contacts by their edge, ascending
    int *key;      // [n_contact][2] elements, smaller number first; scratch

    int n, capacity; // few of them without contacts
    int *element;    // [n][2] first element <= second
    int *start;      // [n + 1] first contact in `order`
    int *slot;       // [n][6][6] entry of K for the covers of both elements

    int *vertex_start;  // [n_vertex + 1] first contact of a vertex
    int *edge_start;    // [n_vertex + 1] first entry of an edge in by_edge
    int *element_start; // [n_element + 1] scratch
    int *cover_start;   // [n_cover + 1]
    int *cover_couple;  // [6 * n] 6 * couple + place of the cover in it, by cover
} nmm_couples;

/// Pattern, matrix and vectors of the run; owned by the simulation.
typedef struct nmm_system {
    nmm_bsr K;
    double *residual;  // [n_cover][2] N
    double *change;    // [n_cover][2] m: solution of a pass
    bool keep_pattern; // the pattern is that of the last call of nmm_system_pattern

    // Constant over the run.
    int *base_start, *base_col; // pattern of the elements alone
    int *base_slot;             // [n_element][3][3] entry of base_col for covers (i, j)
    double *element_mass;       // [n_element][6] kg, nmm_mass_of; diagonal when lumped
    double *base_mass;          // [n_base] kg, the same by entry of base_col
    double *cover_mass;         // [n_cover] kg, row sums
    double *cover_stiffness;    // [n_cover] N/m, of its elements; NULL: no augmented contact
    nmm_elastic *elastic;       // [n_material]
    int *support_start, *cover_support; // 3 * support + place of the cover in it, by cover
    int *edge_start, *cover_edge; // 3 * loop edge + place of the cover in its element, by cover
    double *reaction;     // [n_cover][2] N: forces that hold held unknowns, else 0; NULL likewise
    unsigned char *fixed; // [n_cover] bit 0: x, bit 1: y; NULL when nothing is held
    double damping;       // [1/s]
    double share;         // of the end of a step in its mean forces: 2 beta, 1 in Shi's scheme

    // At the start of the step, where means over the step are taken; else NULL.
    double *start_stress;   // [n_element][3] Pa, Biot
    double *start_load;     // [n_cover][2] N
    double *start_reaction; // [n_support][2] N

    // Follow from the contacts.
    nmm_couples couples;
    int *place;       // [n_base] entry of K for an entry of base_col
    int row_capacity; // blocks that K has room for
    int column_capacity;
    int *column;   // scratch: columns of all rows, row c from row_room[c]
    int *row_room; // [n_cover]

    // Of the residual.
    double *piola;         // [n_element][4] Pa, what acts in the step
    double *element_force; // [n_element][3][2] N, inner forces on the covers
    double *acceleration;  // [n_cover][2] m/s2, damping included
    double *load;          // [n_cover][2] N
    double *support_force; // [n_support][2] N
    unsigned char *mode;   // [n_contact] nmm_contact_mode
    double *pull;          // [n_contact][3][2] N on the vertex and on the ends of the edge
    double *edge_force;    // [n_vertex][2][2] N, contact forces on the ends of a loop edge; NULL:
    double *contact_force; // [n_cover][2] N       no contact so far
    double *scale;         // [n_cover] N2: squares of the forces in a row

    // Of the matrix.
    nmm_stiffness *stiffness;   // [n_element]
    double *base_value;         // [n_base][2][2] elements, inertia and supports
    nmm_spring *spring;         // [n_contact] by couple
    unsigned char *spring_mode; // [n_contact] nmm_contact_mode that the spring was made for
    bool made;                  // K was made for the contacts as they are listed
    int spring_capacity;
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

/// Stresses, loads and reactions at the start of a step, where its forces are means.
void nmm_system_begin(const nmm_context *context, nmm_system *system, const nmm_model *model,
                      const nmm_state *state);

/// system->load: gravity, ground acceleration and loads at `time`; their mean with those at the
/// start of the step, where its forces are means.
void nmm_system_load(nmm_system *system, const nmm_model *model, double time);

/// system->residual and scale at state->displacement, position and contact forces.
void nmm_system_residual(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, const nmm_step_state *step);

/// system->K at the configuration of the last residual. Not `anew`: elements, and contacts that did
/// not change mode, stay as they were when they were last taken, in the same step and pattern: a
/// Newton matrix of a place near by. Returns whether any value changed.
bool nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h, bool anew);

/// What a new list of contacts means for the couples.
typedef enum nmm_couples_change {
    NMM_COUPLES_KEPT,     // the same contacts
    NMM_CONTACTS_CHANGED, // other contacts of couples that are listed
    NMM_COUPLES_CHANGED,
} nmm_couples_change;

/// Augmented contact: stiffness of the covers, and the least stiffness of contact springs in a step
/// of length h.
nmm_status nmm_system_measure(nmm_context *context, nmm_system *system, const nmm_model *model);
void nmm_system_stiffen(const nmm_system *system, const nmm_model *model, nmm_state *state,
                        double h);

/// The inside of nmm_system_pattern: contacts by couple, by vertex and by edge.
nmm_status nmm_couples_create(nmm_context *context, nmm_couples *couples, const nmm_model *model);
void nmm_couples_destroy(nmm_context *context, nmm_couples *couples);
nmm_status nmm_couples_list(nmm_context *context, nmm_couples *couples, const nmm_model *model,
                            const nmm_state *state, nmm_couples_change *change);

/// The covers of a couple: of its first element, then of its second.
static inline void nmm_couple_covers(const nmm_model *model, const int element[2], int cover[6]) {
    for (int i = 0; i < 6; i++)
        cover[i] = model->element_cover[3 * element[i / 3] + i % 3];
}

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
