// SPDX-License-Identifier: MIT
//
// Data only: the constant model, the changing state, materials, interfaces, supports, loads,
// monitors and contacts. Everything above is functions on these.
//
//   lattice node --- star of 6 triangles --- physical covers (pieces of the star)
//   element = block part inside one triangle = common part of 3 covers
//   loop vertex v --- loop edge v (to vertex_next[v]) --- the block lies to the left
//
// A point of element e moves by  u(X) = sum_i w_i(X) d_i.  Of its n_local functions w_i the first
// three are linear, w_i(X) = element_weight + gradient . (X - centre), and add to one; order > 0
// has more, made of these three (functions.c), each with a physical cover of its own.

#ifndef NMM_MODEL_H
#define NMM_MODEL_H

#include "geometry.h"

/// Functions of an element at most: three linear ones; order 1: 6, order 2: 10.
enum { NMM_MOST_LOCAL = 10 };

typedef enum nmm_plane { NMM_PLANE_STRAIN, NMM_PLANE_STRESS } nmm_plane;

typedef struct nmm_material {
    double density;        // [kg/m3]
    double youngs_modulus; // [Pa]
    double poissons_ratio;
    nmm_plane plane;
} nmm_material;

/// Mohr-Coulomb law of an interface. Bonded as long as cohesion or tensile strength hold.
typedef struct nmm_interface {
    double friction;          // tangent of the friction angle
    double residual_friction; // the same after the bond broke
    double cohesion;          // [Pa], times tributary length, while bonded
    double tensile_strength;  // [Pa], times tributary length, while bonded
    double normal_stiffness;  // [Pa/m]; 0: from the penalty
    double shear_stiffness;   // [Pa/m]; 0: normal stiffness / 2.5
} nmm_interface;

/// A history: piecewise linear in time, constant before the first and after the last entry.
typedef struct nmm_history {
    int n;
    int width;     // values of an entry behind the time: 1 or 2
    double *entry; // [n][1 + width]
} nmm_history;

/// A point held in x, y or both at X + history(t) by a stiff spring with a carried force.
typedef struct nmm_support {
    int element;
    double weight[NMM_MOST_LOCAL];
    nmm_vec2 place; // reference place
    bool fix_x, fix_y;
    double length;    // [m] boundary length (or 1 for a lone point) that it stands for
    double stiffness; // [N/m]
    int group;        // supports that raise their carried force together, -1: only the spring
    nmm_vec2 carried; // [N] carried force at the start: balances the initial stress
    int history;      // displacement history (width 2), -1: none
} nmm_support;

/// A force on a point of an element.
typedef struct nmm_load {
    int element;
    double weight[NMM_MOST_LOCAL];
    nmm_vec2 place;
    nmm_vec2 force; // [N], times history
    double length;  // [m] boundary whose traction it stands for, 0: a force at a point
    int history;    // factor history (width 1), -1: constant
} nmm_load;

/// A place whose motion or stress is recorded at each step.
typedef struct nmm_monitor {
    const char *name;
    int element;
    double weight[NMM_MOST_LOCAL];
    nmm_vec2 place;
    bool displacement, velocity, stress;
    double initial[3]; // [Pa] initial stress there
} nmm_monitor;

/// Covers that are held rigidly (supports of a whole block): removed from the system exactly.
typedef struct nmm_hold {
    int cover;
    bool fix_x, fix_y;
    int history; // displacement history (width 2), -1: none
} nmm_hold;

typedef struct nmm_model {
    // Sizes of the tables.
    int n_cover, n_element, n_corner, n_point, n_vertex;
    int order;    // of the cover functions: 0, 1, 2; whole blocks have linear functions only: 0
    int n_local;  // functions of an element: 3, 6, 10
    int n_sample; // order > 0: places where elements are integrated, else 0
    int n_tie;    // order > 0: slivers tied to a neighbour
    int n_block, n_material, n_interface, n_support, n_support_group, n_hold, n_load, n_monitor,
        n_history;
    nmm_vec2 origin;   // [m] coordinates of the scene = coordinates of the model + origin
    double size;       // [m] h: distance of neighbouring lattice nodes, or size of a usual block
    double height;     // [m] half the larger side of the scene's box
    nmm_box box;       // of all points, model coordinates
    bool whole_blocks; // each block has three covers of its own, for its linear functions
    bool apart;        // at the start no block overlaps another by more than rounding

#define FIELD(type, name, count, width, unit, meaning) type *name;
#include "model_fields.inl"
#undef FIELD

    int *tie_element; // [n_tie][2] a sliver and its neighbour; NULL where there are none
    double *tie_gram; // [n_tie][pairs of 2 n_local] m2: products of the functions of the first and
                      // minus those of the second over both triangles
    nmm_material *material;
    nmm_interface *interface; // entry 0: contacts that no joint names
    nmm_support *support;
    nmm_hold *hold; // sorted by cover
    nmm_load *load;
    nmm_monitor *monitor;
    nmm_history *history;
    const char **block_name; // [n_block], may hold NULL
    int *block_scene;        // [n_block] entry of the scene's `blocks`, -1: part of the domain
    nmm_history base_motion; // acceleration of the ground, width 2 [m/s2]; n = 0: none
    nmm_vec2 gravity;        // [m/s2]
    nmm_arena arena;         // names, histories
} nmm_model;

typedef enum nmm_contact_mode {
    NMM_CONTACT_OPEN,
    NMM_CONTACT_SLIDE,
    NMM_CONTACT_STICK
} nmm_contact_mode;

/// A loop vertex against a loop edge of another place. Sorted by (vertex, edge): its identity.
//
//            vertex p0            gap  g = n . (p0 - p1),     n outward normal of the edge
//               |  g              slip s = t . (p0 - p(anchor)), t = (p2 - p1) / |p2 - p1|
//   p2 <--------+------- p1       p(a) = p1 + a (p2 - p1); the edge's block lies below
//
typedef struct nmm_contact {
    int vertex, edge;
    int interface;
    nmm_contact_mode mode; // at the last evaluation
    bool bonded;           // cohesion and tension still act
    bool broken;           // was bonded once: residual friction from now on
    bool breaking;         // the bond gave way in this try of the step
    bool hasty; // augmented: the spring acts alone, in a short step or contact: see eq. (5.14)
    double normal_stiffness, shear_stiffness; // [N/m]
    double anchor; // edge parameter where the shear spring is tied, at the start of the step
    double rest;   // [m] overlap it was found with, <= 0: carries no force
    double carried_normal; // [N] carried force, pressure positive: initial stress, multiplier
    double carried_shear;  // [N] carried shear force on the vertex along t
    double gap;            // [m] at the last evaluation, negative = overlap
    double slip;           // [m] at the last evaluation, since the anchor
    double normal_force;   // [N] pressure positive
    double shear_force;    // [N] on the vertex, along t
    nmm_vec2 along;        // t at the last evaluation
    double per_edge;       // [1/m] one over the length of the edge there

    // What no pass reads.
    double length;        // [m] tributary length
    double spring_length; // [m] the same for springs: more on short sides
    double slid;          // [m] length slid since the contact came to be, never falls
    double force_before;  // [N] augmented: pressure at the end of the step before the last
    double bond_normal, bond_shear; // [N] forces of a bond at the start of the step
} nmm_contact;

typedef struct nmm_state {
    double time; // [s]
    double dt;   // [s] next step
    long step;   // accepted steps

#define FIELD(type, name, count, width, unit, meaning) type *name;
#include "state_fields.inl"
#undef FIELD

    int n_contact, contact_capacity;
    nmm_contact *contact;
} nmm_state;

/// Allocate all tables for the sizes that `model` already holds (points of loads etc. included).
nmm_status nmm_model_allocate(nmm_context *context, nmm_model *model);
void nmm_model_destroy(nmm_context *context, nmm_model *model);

/// A state at rest in the reference configuration.
nmm_status nmm_state_create(nmm_context *context, const nmm_model *model, nmm_state *state);
void nmm_state_destroy(nmm_context *context, nmm_state *state);

/// state->position from state->displacement.
void nmm_state_place(const nmm_model *model, nmm_state *state, int n_thread);

/// The same for n points; NULL: the first ones.
void nmm_state_place_some(const nmm_model *model, nmm_state *state, const int *point, int n,
                          int n_thread);

/// NMM_ERROR_NUMERIC with array and index at the first number that is not finite; `stage` is named.
nmm_status nmm_state_check(nmm_context *context, const nmm_model *model, const nmm_state *state,
                           const char *stage);

/// Hash of the bits of time, displacement, velocity, stress and contacts (vertex, edge, mode,
/// forces).
uint64_t nmm_state_hash(const nmm_model *model, const nmm_state *state);

/// Value of a history at `time` into value[width].
void nmm_history_value(const nmm_history *history, double time, double *value);

/// Functions of an element with covers of an order.
static inline int nmm_local_of(int order) {
    return (order + 2) * (order + 3) / 2;
}

/// Do two elements have all covers in common? They are of one cell: pieces of a triangle that a
/// border of materials or of regions has cut.
static inline bool nmm_same_covers(const nmm_model *model, int e, int f) {
    const int m = model->n_local;
    for (int i = 0; i < m; i++)
        if (model->element_cover[m * (long)e + i] != model->element_cover[m * (long)f + i])
            return false;
    return true;
}

/// The linear functions of element `e` at the reference place X (model coordinates).
void nmm_element_linear(const nmm_model *model, int e, nmm_vec2 place, double linear[3]);

/// All functions of element `e` at the reference place X: weight[n_local].
void nmm_element_weights(const nmm_model *model, int e, nmm_vec2 place, double *weight);

/// All functions of element `e` where its linear ones have these values: value[n_local].
void nmm_functions_value(const nmm_model *model, int e, const double linear[3], double *value);

/// Their gradients there: gradient[n_local][2] [1/m].
void nmm_functions_gradient(const nmm_model *model, int e, const double linear[3],
                            double *gradient);

/// Place of (i, j) among the products of n functions: 00, 01, .., 11, 12, ..
static inline int nmm_pair_index(int n, int i, int j) {
    const int low = i < j ? i : j, high = i < j ? j : i;
    return low * (2 * n - 1 - low) / 2 + high;
}

/// The element that holds the reference place X; the nearest one (by its polygon) within `reach`;
/// -1: none.
int nmm_model_find_element(const nmm_model *model, nmm_vec2 place, double reach);

#endif
