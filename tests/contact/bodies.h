// SPDX-License-Identifier: MIT
//
// Blocks for the tests of the contact floor: a model made by hand from polygons, with one triangle
// of the mesh (three covers) around each block. A block then moves as an affine map, set through
// its cover displacements, so that the positions of its vertices are exact.

#ifndef NMM_TEST_BODIES_H
#define NMM_TEST_BODIES_H

#include "contact.h"
#include "search.h"
#include "test.h"

#define BODY_MODULUS 1e9
#define BODY_PENALTY 10.0

/// One loop: corners counter-clockwise (clockwise round a hole). A loop with the same block as the
/// one before it belongs to the same block.
typedef struct loop {
    int block;
    int n;
    const nmm_vec2 *corner;
} loop;

typedef struct bodies {
    nmm_context context;
    nmm_model model;
    nmm_state state;
    nmm_contact_search *search;
    nmm_contact_options options;
} bodies;

/// Model and state of the loops, cover size `size`; interface 0 has friction 0.5. Opens the search.
/// The context (hook, threads) may be set before. Returns the first failure.
nmm_status bodies_open(bodies *b, int n_loop, const loop *loops, double size);
void bodies_close(bodies *b);

/// Options and strength of the interface; before the first find.
void bodies_options(bodies *b, nmm_contact_options options);
/// Edges with the same ends in opposite directions become mates (a joint) with this interface.
void bodies_join(bodies *b, int interface);

/// Put a block at its reference place turned by `angle` about its reference centre, moved by (x,
/// y).
void bodies_put(bodies *b, int block, double x, double y, double angle);
/// Add a random affine motion of the size `amount` to each cover displacement.
void bodies_shake(bodies *b, nmm_random *random, double amount);

/// Calls that must succeed.
void bodies_find(bodies *b, double reach);
nmm_contact_verdict bodies_evaluate(bodies *b);
void bodies_commit(bodies *b, nmm_contact_energy *energy);

/// First vertex of a block; its vertices follow in the order of the loops.
int bodies_vertex(const bodies *b, int block);
nmm_contact *bodies_contact(bodies *b, int vertex, int edge);
/// Contacts whose vertex is of one block and whose edge of the other, in either role.
int bodies_count(const bodies *b, int block_a, int block_b);
/// Sum of their lengths / of the forces on block a [N].
double bodies_length(const bodies *b, int block_a, int block_b);
nmm_vec2 bodies_force(const bodies *b, int block_a, int block_b);

/// Four corners of a box, counter-clockwise from the lower left one.
#define BOX(x0, y0, x1, y1)                                                                        \
    {                                                                                              \
        {(x0), (y0)}, {(x1), (y0)}, {(x1), (y1)}, {                                                \
            (x0), (y1)                                                                             \
        }                                                                                          \
    }

#endif
