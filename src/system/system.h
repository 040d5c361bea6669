// SPDX-License-Identifier: MIT
//
// The system of equations of one pass: sparsity pattern, residual at the end configuration, matrix,
// supports and loads.
//
//   (2/h^2 + 2 alpha/h) M d2 + K d2 = r,   r = f(t1) - f_int(d) - M (2 (d - d0)/h^2 - 2 v0/h) - ...
//
// Every row of matrix and residual is added up by one thread in a fixed order: the same bits for
// any number of threads.

#ifndef NMM_SYSTEM_H
#define NMM_SYSTEM_H

#include "contact.h"
#include "mechanics.h"
#include "scene.h"
#include "solve.h"

/// Contacts by couples: two elements whose loop edges meet in one contact or more. The pattern of
/// the matrix follows from the couples alone, and they change less often than the contacts.
typedef struct nmm_couples {
    long list; // times that other contacts were listed
    int n_contact, contact_capacity;
    int *identity; // [n_contact][2] vertex, edge of the list these follow from
    int *order;    // [n_contact] 2 * contact + (the vertex is on the second element), by couple
    int *place;    // [n_contact] of a contact in `order`
    int *by_edge;  // [n_contact] contacts by their edge, ascending
    int *key;      // [n_contact][2] elements, smaller number first; scratch

    int n, capacity; // few of them without contacts
    int *element;    // [n][2] first element <= second
    int *start;      // [n + 1] first contact in `order`
    int *slot;       // [n][2 n_local][2 n_local] entry of K for the covers of both elements

    int *vertex_start;  // [n_vertex + 1] first contact of a vertex
    int *edge_start;    // [n_vertex + 1] first entry of an edge in by_edge
    int *element_start; // [n_element + 1] scratch
    int *cover_start;   // [n_cover + 1]
    int *cover_couple;  // [2 n_local * n] 2 n_local * couple + place of the cover in it, by cover
} nmm_couples;

/// Mode of a contact and which way it slides. Caught: it was to slide one way and slid the other.
typedef enum nmm_spring_mode {
    NMM_SPRING_OPEN = NMM_CONTACT_OPEN,
    NMM_SPRING_SLIDE = NMM_CONTACT_SLIDE,
    NMM_SPRING_STICK = NMM_CONTACT_STICK,
    NMM_SPRING_SLIDE_BACK,
    NMM_SPRING_CAUGHT,
} nmm_spring_mode;

/// Pattern, matrix and vectors of the run; owned by the simulation.
typedef struct nmm_system {
    nmm_bsr K;
    double *residual;  // [n_cover][2] N
    double *caught;    // [n_cover][2] N: of nmm_system_catch; NULL: no contact so far
    double *change;    // [n_cover][2] m: solution of a pass
    bool keep_pattern; // the pattern is that of the last call of nmm_system_pattern

    // Constant over the run.
    int *base_start, *base_col; // pattern of the elements alone
    int *base_slot;             // [n_element][n_local][n_local] entry of base_col for covers (i, j)
    double *element_mass;       // [n_element][pairs] kg, by nmm_pair_index; diagonal when lumped
    double *base_mass;          // [n_base] kg, the same by entry of base_col
    double *cover_mass;         // [n_cover] kg, row sums
    double *cover_give; // [n_cover][2] stiffness of its elements N/m, mass kg; NULL: not augmented
    nmm_elastic *elastic;               // [n_material]
    int *support_start, *cover_support; // n_local * support + place of the cover, by cover
    int *edge_start,
        *cover_edge;  // n_local * loop edge + place of the cover in its element, by cover
    double *reaction; // [n_cover][2] N: forces that hold held unknowns, else 0; NULL likewise
    // Ties of slivers; NULL where there are none.
    int *tie_start, *cover_tie; // 2 n_local * tie + place of the cover in it, by cover
    double *tie_stiffness;      // [n_base] N/m, by entry of base_col
    double *tie_mass;           // [n_base] kg, of base_mass
    double *tie_force;          // [n_cover][2] N, inner forces
    unsigned char *fixed;       // [n_cover] bit 0: x, bit 1: y; NULL when nothing is held
    int *body;      // [n_cover] order > 0: block of a node's cover, -1: others; else NULL
    double damping; // [1/s]
    double share;   // of the end of a step in its mean forces: 2 beta, 1 in Shi's scheme

    // At the start of the step, where means over the step are taken; else NULL.
    double *start_stress;   // [n_element, order > 0: n_sample][3] Pa, Biot
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
    double *piola;         // [n_element][4] Pa, what acts in the step; order > 0: NULL
    double *element_force; // [n_element][n_local][2] N, inner forces on the covers
    double *acceleration;  // [n_cover][2] m/s2, damping included
    double *load;          // [n_cover][2] N
    double *support_force; // [n_support][2] N
    unsigned char *mode;   // [n_contact] nmm_spring_mode that is asked for, by couple
    const double *allowed; // [n_block] N that the balance may leave of a block; held: 0
    double *pull;          // [n_contact][3][2] N on the vertex and on the ends of the edge
    double *edge_force;    // [n_vertex][n_local][2] N, contact forces of a loop edge on the covers
                           // of its element; NULL: no contact so far
    double *contact_force; // [n_cover][2] N; NULL likewise
    double *scale;         // [n_cover] N2: squares of the forces in a row

    // Of the matrix.
    nmm_stiffness *stiffness; // [n_element]; order > 0: NULL
    double *curved_stiffness; // [n_element][n_local][n_local][2][2] N/m; order 0: NULL
    // Springs, frozen when the matrix was made, by couple: derivatives of gap and of slip by the
    // displacements of the couple's covers, then the normal and shear stiffness that act, sliding:
    // no shear.
    double *spring;             // [n_contact][nmm_spring_size]
    unsigned char *spring_mode; // [n_contact] nmm_spring_mode that the spring was made for
    double *diagonal;           // [n_cover][2] N/m, of K before springs and weights
    const double *weight;       // [n_block] of rows and columns of K; NULL: none
    bool pressed;               // the next K counts contacts that only just touch as closed
    int spring_capacity;
    nmm_coupling coupling; // of the contacts that slide, nmm_system_couple
    int coupling_capacity;
} nmm_system;

/// Numbers of a spring in nmm_system.spring, for elements with m functions.
static inline int nmm_spring_size(int m) {
    return 8 * m + 2;
}

/// Of each cover, the body that it moves rigidly with others, for a coarse correction.
static inline const int *nmm_system_body(const nmm_system *system, const nmm_model *model) {
    return system->body != NULL ? system->body : model->cover_block;
}

/// The step that the residual belongs to.
typedef struct nmm_step_state {
    double h;            // [s]
    double end;          // [s] time at its end
    const double *moved; // [n_cover][2] displacement of the step
} nmm_step_state;

/// Numbers of some items, ascending unless told otherwise.
typedef struct nmm_items {
    int n, *item;
} nmm_items;

/// Some rows of the system.
typedef struct nmm_rows {
    int n;
    const int *row;   // [n] ascending
    const int *place; // [n_cover] of each row in that list, -1: not in it
} nmm_rows;

/// What a move of some covers touches; lists are scratch of the last nmm_touched_by.
typedef struct nmm_touched {
    const int *moved; // [n_moved] the covers
    int n_moved;
    nmm_items element; // that change
    nmm_items point;   // of these, element by element
    nmm_items contact, edge;
    nmm_items row;                    // whose forces change
    int *point_start, *element_point; // constant: points by element
    unsigned char *mark;              // no marks between calls
    int mark_capacity, contact_capacity;
} nmm_touched;

nmm_status nmm_touched_open(nmm_context *context, nmm_touched *touched, const nmm_model *model);
void nmm_touched_close(nmm_context *context, nmm_touched *touched);

/// What a move of n covers touches, with the contacts that the couples are those of.
nmm_status nmm_touched_by(nmm_context *context, nmm_touched *touched, const nmm_system *system,
                          const nmm_model *model, const nmm_state *state, const int *moved, int n);

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

/// system->residual and scale at state->displacement, position and contact forces. `touched`: by
/// what has moved since the last residual of the same step, nothing else has changed; NULL: all.
void nmm_system_residual(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, const nmm_step_state *step,
                         const nmm_touched *touched);

/// A new matrix at the configuration of the last residual begins: elements, inertia and supports in
/// K, springs of contacts beside it, and system->diagonal, by which blocks may be weighted.
void nmm_system_prepare(const nmm_context *context, nmm_system *system, const nmm_model *model,
                        const nmm_state *state, double h);

/// system->K after nmm_system_prepare, rows and columns times the weight of their block, which
/// lasts as long as the matrix; NULL: unweighted.
void nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const double *weight);

/// In K, contacts that changed mode, weighted as it is; elements and other contacts stay as they
/// were when they were last taken, in the same step and pattern: a Newton matrix of a place near
/// by. Returns whether any value changed.
bool nmm_system_follow(nmm_system *system, const nmm_model *model, const nmm_state *state);

/// system->coupling: what K leaves out, the change of friction with the pressure of contacts that
/// slide. Belongs to K as it is. `part`: only contacts of these rows; NULL: of all.
nmm_status nmm_system_couple(nmm_context *context, nmm_system *system, const nmm_model *model,
                             const nmm_state *state, const nmm_rows *part);

/// Are there springs of caught contacts in K? Then system->caught is the residual with the forces
/// that these would have if they stuck: what a solve for it moves is exact where they do.
bool nmm_system_catch(nmm_system *system, const nmm_model *model, const nmm_state *state);

/// Entry of base_col for column `col` of row c, which has it.
int nmm_system_entry(const nmm_system *system, int c, int col);

/// The inside of nmm_system_create: ties by cover; columns that they add to row c, how many; their
/// matrices.
nmm_status nmm_ties_list(nmm_context *context, nmm_system *system, const nmm_model *model);
int nmm_ties_columns(const nmm_system *system, const nmm_model *model, int c, int *column);
nmm_status nmm_ties_fill(nmm_context *context, nmm_system *system, const nmm_model *model);

/// system->tie_force at state->displacement; moved: the displacement of the step.
void nmm_ties_force(nmm_system *system, const nmm_model *model, const nmm_state *state,
                    const double *moved, int n_thread);

/// a . (matrix of ties) b for vectors [n_cover][2].
double nmm_ties_product(const nmm_system *system, int n_cover, const double *matrix,
                        const double *a, const double *b);

/// What a new list of contacts means for the couples.
typedef enum nmm_couples_change {
    NMM_COUPLES_KEPT,     // the same contacts
    NMM_CONTACTS_CHANGED, // other contacts of couples that are listed
    NMM_COUPLES_CHANGED,
} nmm_couples_change;

/// What becomes of the overlaps that springs of short steps had when carried forces follow.
typedef enum nmm_overlaps {
    NMM_OVERLAPS_AT_REST, // statics: they are pushed out, and slip may be taken back for nothing
    NMM_OVERLAPS_GO,      // they are pushed out
    NMM_OVERLAPS_STAY,    // as the place where the contact rests
} nmm_overlaps;

/// What springs of augmented contacts do in a try.
typedef struct nmm_carrying {
    bool gentle; // they have no more than the least stiffness, whatever the penalty
    bool alone;  // short steps are left to them
    nmm_overlaps overlaps;
} nmm_carrying;

/// What another try may do without.
typedef struct nmm_carried {
    bool stiff; // some springs have more than the least stiffness
    bool quick; // some forces are carried though the step is short
} nmm_carried;

/// Augmented contact: stiffness of the covers, and the least stiffness of contact springs in a step
/// of length h.
nmm_status nmm_system_measure(nmm_context *context, nmm_system *system, const nmm_model *model);
/// The length of a step below which inertia stiffens springs at some cover that is not held [s].
double nmm_system_carrying_step(const nmm_system *system, int n_cover);
nmm_carried nmm_system_stiffen(const nmm_system *system, const nmm_model *model, nmm_state *state,
                               double h, nmm_carrying how);

/// The inside of nmm_system_pattern: contacts by couple, by vertex and by edge.
nmm_status nmm_couples_create(nmm_context *context, nmm_couples *couples, const nmm_model *model);
void nmm_couples_destroy(nmm_context *context, nmm_couples *couples);
nmm_status nmm_couples_list(nmm_context *context, nmm_couples *couples, const nmm_model *model,
                            const nmm_state *state, nmm_couples_change *change);

/// The covers of a couple: of its first element, then of its second.
static inline void nmm_couple_covers(const nmm_model *model, const int element[2],
                                     int cover[2 * NMM_MOST_LOCAL]) {
    const int m = model->n_local;
    for (int i = 0; i < m; i++) {
        cover[i] = model->element_cover[m * (long)element[0] + i];
        cover[m + i] = model->element_cover[m * (long)element[1] + i];
    }
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

/// The inside of nmm_loads_place: groups of the supports from the first one, placed on line a-b.
nmm_status nmm_supports_group(nmm_context *context, nmm_model *model, nmm_vec2 a, nmm_vec2 b,
                              int first);

/// Initial stress of the elements and initial velocities of the blocks.
void nmm_loads_start(const nmm_scene *scene, const nmm_model *model, nmm_state *state);

#endif
