// SPDX-License-Identifier: MIT
//
// Two lattices. The integer lattice: all geometry is snapped to it, so that topology is exact. The
// mathematical mesh: near-equilateral triangles whose nodes are points of the integer lattice.
//
//            (i,j+1)-------(i+1,j+1)       x = base.x + i side + j side/2
//             /    \  down  /              y = base.y + j rise
//            /  up  \      /
//         (i,j)-----(i+1,j)                strip j: between rows j and j + 1

#ifndef NMM_LATTICE_H
#define NMM_LATTICE_H

#include "integer.h"
#include "scene.h"

/// What keeps its place when things are welded: see nmm_arrangement_weld.
enum { NMM_RANK_OUTLINE, NMM_RANK_REGION, NMM_RANK_JOINT, NMM_RANK_MESH };

typedef struct nmm_lattice {
    nmm_vec2 origin; // [m] scene coordinates of the integer point (0, 0)
    double spacing;  // [m] of the integer lattice, a power of two
    nmm_box box;     // [m] of domain and blocks, scene coordinates
    double area;     // [m2] domain and blocks, before cutting
    int64_t side;    // [spacing] side of a triangle, even
    int64_t rise;    // [spacing] height of a row, even
    int64_t reach;   // [spacing] what is nearer is welded
    nmm_ipoint base; // node (0, 0)
} nmm_lattice;

/// A triangle of the mesh. Its nodes, counter-clockwise, up: (i,j) (i+1,j) (i,j+1);
/// down: (i+1,j) (i+1,j+1) (i,j+1).
typedef struct nmm_triangle {
    int i, j;
    int down; // 0 or 1; -1: no triangle
} nmm_triangle;

typedef struct nmm_node {
    int i, j;
} nmm_node;

/// A side of the triangles: direction 0 from (i,j) to (i+1,j), 1 to (i,j+1), 2 from (i+1,j) to
/// (i,j+1).
typedef struct nmm_mesh_line {
    int i, j, direction;
} nmm_mesh_line;

/// Choose origin, spacing and mesh for the scene. Rejects coordinates that are not finite, scenes
/// without material, cover sizes far too large or too small.
nmm_status nmm_lattice_choose(nmm_context *context, nmm_scene *scene, nmm_lattice *lattice);

/// Nearest integer point of a place in the scene.
nmm_ipoint nmm_lattice_snap(const nmm_lattice *lattice, nmm_vec2 place);
/// Model coordinates of an integer point [m].
nmm_vec2 nmm_lattice_place(const nmm_lattice *lattice, nmm_ipoint p);
nmm_ipoint nmm_lattice_node(const nmm_lattice *lattice, nmm_node node);
/// Model coordinates of a place between nodes, given in sixths of steps [m].
nmm_vec2 nmm_lattice_between(const nmm_lattice *lattice, nmm_node sixth);

/// The three nodes of a triangle, counter-clockwise.
void nmm_triangle_nodes(nmm_triangle t, nmm_node node[3]);
/// Barycentric weights of the triangle's nodes at an integer point.
void nmm_lattice_weights(const nmm_lattice *lattice, nmm_triangle t, nmm_ipoint p,
                         double weight[3]);
/// Gradients of the weights: [3][2], [1/m].
void nmm_lattice_gradient(const nmm_lattice *lattice, nmm_triangle t, double gradient[6]);

nmm_isegment nmm_mesh_line_segment(const nmm_lattice *lattice, nmm_mesh_line line);
/// The triangle to the left (side 0) or right (side 1) of a line.
nmm_triangle nmm_mesh_line_triangle(nmm_mesh_line line, int side);

#endif
