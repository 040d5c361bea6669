// SPDX-License-Identifier: MIT
//
// Inside of the contact floor: pairs of near edges, and raw contacts made from them.

#ifndef NMM_SEARCH_H
#define NMM_SEARCH_H

#include "contact.h"

#include <math.h>

/// Lengths as parts of the cover size h.
#define NMM_EXACT 1e-9  // rounding of places
#define NMM_TINY 1e-5   // edges shorter than this have no direction of their own: they are left out
#define NMM_TOUCH 1e-6  // overlap that counts as touching
#define NMM_SAME 1e-4   // of two vertices nearer than this the one that was listed stays
#define NMM_CORNER 0.5  // tributary length of a corner
#define NMM_DEEPEST 0.5 // overlap that is still a contact with history
#define NMM_REST 0.001  // motion up to which pairs of edges rest
/// Sine of an angle that rounding may turn over.
#define NMM_EQUAL 1e-6
/// Sines of angles between edges: blend from edge-edge to corner.
#define NMM_PARALLEL 0.026 // 1.5 degrees
#define NMM_SLANTED 0.078  // 4.5 degrees
/// Length over that of the last list from which on it makes much more of a force. Less comes and
/// goes with elastic slip: rest would follow each time, and never come back.
#define NMM_LONGER 1.01
/// Cosine of the angle up to which history passes from one edge to another.
#define NMM_IN_LINE 0.5 // 60 degrees

typedef struct nmm_edge_pair {
    int a, b;   // a < b
    int sides;  // number of the pair of sides whose springs may be lengthened, -1: none
    bool rests; // nothing comes of it until something has moved on
} nmm_edge_pair;

/// A contact before history.
typedef struct nmm_raw {
    int vertex, edge;
    int facing; // edge of the vertex's block that faces the edge
    int sides;  // of the pair of edges, -1: a corner, or not to be lengthened
    double length, gap;
    double shared;        // [m] part of the length that two parallel edges share, before the blend
    double corner_length; // [m] part of a corner; added to both lengths in the end
    double spring_length; // [m] length for springs
    double beyond;        // [m] how far the vertex is beyond an end of the edge, 0: in front of it
    bool corner;          // not of two parallel edges
    bool dropped;
} nmm_raw;

/// The list of the last step, with where the contacts of each vertex begin.
typedef struct nmm_last_list {
    const nmm_contact *contact;
    const int *start; // [n_vertex + 1]
} nmm_last_list;

/// Edges as of now.
typedef struct nmm_edge_line {
    nmm_vec2 p, q; // ends
    nmm_vec2 t, n; // unit direction, outward normal
    double length;
} nmm_edge_line;

static inline nmm_vec2 nmm_vertex_place(const nmm_model *model, const nmm_state *state, int v) {
    const double *p = state->position + 2 * (long)model->vertex_point[v];
    return (nmm_vec2){p[0], p[1]};
}

static inline nmm_edge_line nmm_edge_line_of(const nmm_model *model, const nmm_state *state,
                                             int e) {
    const nmm_vec2 p = nmm_vertex_place(model, state, e);
    const nmm_vec2 q = nmm_vertex_place(model, state, model->vertex_next[e]);
    const nmm_vec2 along = nmm_vec2_sub(q, p);
    const double length = sqrt(nmm_vec2_dot(along, along));
    const nmm_vec2 t = length > 0 ? nmm_vec2_scale(1 / length, along) : (nmm_vec2){1, 0};
    return (nmm_edge_line){.p = p, .q = q, .t = t, .n = {t.y, -t.x}, .length = length};
}

/// All forces of a contact, carried and present, are `by` times those of another, or its own.
static inline void nmm_contact_scale(nmm_contact *contact, const nmm_contact *of, double by) {
    contact->carried_normal = by * of->carried_normal;
    contact->carried_shear = by * of->carried_shear;
    contact->normal_force = by * of->normal_force;
    contact->shear_force = by * of->shear_force;
}

/// What the narrow phase works on. What `out` has no room for is only counted.
typedef struct nmm_narrowing {
    const nmm_model *model;
    const nmm_state *state;
    nmm_last_list last;
    nmm_vec2 middle;           // of nmm_contact_search
    double reach;              // [m] largest gap that is listed
    double near;               // [m] the reach and the largest overlap
    const nmm_edge_line *line; // [n_vertex] of all edges
    nmm_raw *out;              // [room]
    int n, room;
} nmm_narrowing;

/// Two straight sides that face each other, and the length they share.
typedef struct nmm_side_pair {
    int a, b;   // first edges, a < b; both 0: free entry
    int number; // among those of near edges
    double length;
    double last; // [m] the same in the last list
} nmm_side_pair;

/// An entry of the grid: an edge in one of the cells that its box touches.
typedef struct nmm_cell {
    int edge, ix, iy;
} nmm_cell;

enum { NMM_PAIR_CHUNK = 512 };

struct nmm_contact_search {
    nmm_contact_options options;
    bool started;     // the first find is done
    bool grows;       // a pressed contact of the list stands for more than in the last one
    int *side;        // [n_vertex] straight side of an edge: its first edge
    bool *joint_side; // [n_vertex] of a side: a joint made some of it
    nmm_vec2 middle;  // of the area of all blocks, at the start
    double built_for; // [m] distance up to which the pairs are complete at built_at
    double *built_at; // [n_vertex][2] positions when the pairs were made

    int n_pair, pair_capacity;
    nmm_edge_pair *pair; // near edges
    double rests_for;    // [m] distance up to which it is known which of them rest; 0: of none
    double *rests_at;    // [n_vertex][2] positions when that was found
    int n_sides, sides_capacity;
    double *shared; // [n_sides] [m] what two sides share

    double cell_size;  // [m] of the grid
    int n_bucket;      // power of two
    int *bucket_start; // [n_bucket + 1]
    int *bucket_pairs; // [n_bucket + 1] first pair found in a bucket
    nmm_cell *cell;    // entries by bucket
    int cell_capacity;
    nmm_box *box; // [n_vertex] of the edges, grown

    nmm_edge_line *line; // [n_vertex] of the edges, of this step
    int raw_capacity, chunk_capacity;
    int n_chunk;       // chunks of pairs that have room in raw; 0: pairs are new
    nmm_raw *raw;      // by chunk of pairs
    int *raw_first;    // [chunks + 1] first place of a chunk in raw
    int *raw_count;    // [chunks] raw contacts of a chunk
    int *vertex_start; // [n_vertex + 1]
    int *last_start;   // [n_vertex + 1] first contact of a vertex in the last list
    int sorted_capacity;
    nmm_raw *sorted; // by vertex and edge
    int table_capacity;
    nmm_side_pair *table; // pairs of sides, hashed
    int next_capacity;
    nmm_contact *next; // the new list; between searches what was saved
};

/// Pairs of edges nearer than `reach`, complete; remade only when needed.
nmm_status nmm_pairs_update(nmm_context *context, nmm_contact_search *search,
                            const nmm_model *model, const nmm_state *state, double reach);

/// Largest way of a vertex from the places `from` [n_vertex][2] to now [m].
double nmm_largest_motion(const nmm_model *model, const nmm_state *state, const double *from);

/// Numbers the pairs of sides that the pairs of edges are of.
nmm_status nmm_pairs_number(nmm_context *context, nmm_contact_search *search);

/// Raw contacts of all pairs, sorted by (vertex, edge), lengths added, into search->sorted.
nmm_status nmm_narrow(nmm_context *context, nmm_contact_search *search, const nmm_narrowing *now,
                      int *n_raw);

/// May two edges meet, whichever place they have? Those of one block not always.
bool nmm_edges_can_meet(const nmm_model *model, int a, int b);

/// Raw contacts of one pair of edges.
void nmm_touch(nmm_narrowing *now, nmm_edge_pair pair);

/// Is it certain that nothing comes of a pair while contacts are listed up to the distance `near`
/// and no vertex moves by more than `way` from where it is now [m]? Of two blocks, edges that are
/// far from parallel: no sides that face each other, and one corner only.
bool nmm_touch_rests(const nmm_narrowing *now, nmm_edge_pair pair, double near, double way);

/// The contact of the last list that (vertex, edge) goes on from: its own; else a closed one that
/// the vertex left, on a neighbouring edge; else a closed one that the other side's vertex at the
/// place left. NULL: there is none.
const nmm_contact *nmm_contact_history(const nmm_narrowing *now, int vertex, int edge);

/// The vertex or edge behind or before v on its loop, tiny edges passed over: the vertex that
/// stands for all at its place, and the edge that begins there.
int nmm_vertex_behind(const nmm_narrowing *now, int v);
int nmm_vertex_before(const nmm_narrowing *now, int v);

/// From a corner into its block, between both sides; 2 to 2.9 long.
nmm_vec2 nmm_vertex_inward(const nmm_narrowing *now, int v);

/// The contact (vertex, edge) of the last list, or NULL.
static inline const nmm_contact *nmm_contact_lookup(const nmm_last_list *last, int vertex,
                                                    int edge) {
    for (int k = last->start[vertex]; k < last->start[vertex + 1]; k++) {
        if (last->contact[k].edge == edge) return &last->contact[k];
    }
    return NULL;
}

/// Gap of the vertex to the line of the edge, as the law measures it [m].
double nmm_contact_gap(const nmm_model *model, const nmm_state *state, int vertex, int edge);

/// Elastic energy of a contact as it is [J].
double nmm_contact_stored_in(const nmm_contact_search *search, const nmm_contact *c);

/// Room for n pairs of sides, all free; *size is how many entries there are.
nmm_status nmm_side_table(nmm_context *context, nmm_contact_search *search, int n, int *size);

/// The entry of two sides.
nmm_side_pair *nmm_side_pair_of(nmm_contact_search *search, int size, int x, int y);

/// After the list: forces between two sides that share more than in the last list stay as they are.
nmm_status nmm_contact_keep_sides(nmm_context *context, nmm_contact_search *search,
                                  const nmm_model *model, nmm_state *state);

#endif
