// SPDX-License-Identifier: MIT
//
// The planar arrangement of integer segments: snap rounding, then faces.
//
//   segments -> hot pixels (ends and rounded crossings) -> segments re-routed through the pixels
//   they pass, again and again until nothing moves -> edges without duplicates -> what is very near
//   welded -> half-edges sorted by angle -> faces -> islands put into the face around them -> edges
//   that divide nothing dropped
//
// All decisions are exact (integer.h). The result depends on the set of segments only, not on their
// order or direction; which segments an edge came from is kept, so attributes stay the caller's.

#ifndef NMM_ARRANGEMENT_H
#define NMM_ARRANGEMENT_H

#include "integer.h"

//  Half-edge h: half h % 2 of edge h / 2, from vertex edge[h] to vertex edge[h ^ 1], twin h ^ 1.
//
//            face[h]                   next[h] is the half-edge that follows along face[h]
//   edge[h] --------> edge[h ^ 1]      (the face lies to the left)
//          face[h ^ 1]

/// Arrays live in the arena until the next build. Start zeroed; reuse for many builds.
typedef struct nmm_arrangement {
    int n_vertex;
    nmm_ipoint *vertex; // [n_vertex] sorted by x, then y

    int n_edge;
    int *edge;         // [n_edge][2] lower vertex first; sorted by both
    int *source_start; // [n_edge + 1]
    int *source;       // 2 * segment, + 1 where the segment runs from the higher vertex; ascending

    int *next;    // [2 * n_edge] following half-edge, bridges left out; of a bridge: unspecified
    int *face;    // [2 * n_edge] face to the left; a bridge has the same face on both sides
    bool *bridge; // [n_edge] the edge divides nothing: a dangling end, or a link between loops

    int n_face;      // face 0 is the unbounded one
    int *face_start; // [n_face + 1] first entry of a face in `cycle`
    int *cycle;      // a half-edge of each boundary cycle; the outer one first (face 0 has none)

    int crossed; // smallest family >= 0 of which two segments cross, -1: none

    // Growing lists, kept between builds.
    nmm_ipoint *crossing;
    int *chain, *hit;
    struct nmm_fragment *fragment;
    struct nmm_near *near;
    int crossing_capacity, chain_capacity, hit_capacity, fragment_capacity, near_capacity;
    int n_crossing, n_chain, n_hit, n_fragment;
    nmm_arena arena;
} nmm_arrangement;

/// Arrange `n` segments; what is nearer than `reach` units is welded (0: nothing). Segments without
/// length are left out.
nmm_status nmm_arrangement_build(nmm_context *context, nmm_arrangement *arrangement, int n,
                                 const nmm_isegment *segment, int64_t reach);
void nmm_arrangement_destroy(nmm_context *context, nmm_arrangement *arrangement);

/// The parts of the build: vertices, edges and sources; the same, welded; half-edges and faces.
nmm_status nmm_arrangement_snap(nmm_context *context, nmm_arrangement *arrangement, int n,
                                const nmm_isegment *segment);
nmm_status nmm_arrangement_weld(nmm_context *context, nmm_arrangement *arrangement,
                                const nmm_isegment *segment, int64_t reach);
nmm_status nmm_arrangement_subdivide(nmm_context *context, nmm_arrangement *arrangement);

/// Union-find over 0..n-1; the root of a set is its smallest member.
static inline int nmm_set_root(int *parent, int i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}
static inline void nmm_set_join(int *parent, int i, int j) {
    i = nmm_set_root(parent, i);
    j = nmm_set_root(parent, j);
    if (i < j) parent[j] = i;
    if (j < i) parent[i] = j;
}

#endif
