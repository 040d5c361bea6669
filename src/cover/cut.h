// SPDX-License-Identifier: MIT
//
// The parts of the cutting, shared by the files of this floor. A body is what is arranged at once:
// the whole domain with its holes, regions and joints, or one separate block. Bodies are cut one
// after another with the same memory and appended to the draft of the model.

#ifndef NMM_CUT_H
#define NMM_CUT_H

#include "arrangement.h"
#include "cover.h"
#include "lattice.h"

/// What a segment stands for.
typedef enum nmm_line_kind { NMM_LINE_AREA, NMM_LINE_JOINT, NMM_LINE_MESH } nmm_line_kind;

typedef struct nmm_line {
    nmm_line_kind kind;
    int index;          // area: entry of nmm_body.area; joint: of the scene's joints
    nmm_mesh_line mesh; // mesh line
} nmm_line;

typedef enum nmm_area_kind { NMM_AREA_DOMAIN, NMM_AREA_HOLE, NMM_AREA_REGION } nmm_area_kind;

typedef struct nmm_body_area {
    nmm_area_kind kind;
    const nmm_scene_area *area;
} nmm_body_area;

/// One body: what goes into its arrangement, and what its edges and faces are. Arrays behind
/// `arena` live until the next body.
typedef struct nmm_body {
    int n_area;
    nmm_body_area *area; // domain polygons, holes, regions: later entries win
    int n_joint;         // joints 0..n_joint - 1 of the scene cut this body
    const char *name;    // of its blocks, may be NULL
    int from;            // entry of the scene's blocks, -1: the domain

    int n_segment, segment_capacity, line_capacity;
    nmm_isegment *segment;
    nmm_line *line;

    nmm_arrangement arrangement;
    int *joint;             // [n_edge] first joint that the edge lies on, -1: none
    bool *mesh;             // [n_edge] lies on a side of the mesh
    bool *connects;         // [n_edge] material is continuous across it
    int *material;          // [n_face] -1: no material
    int *element;           // [n_face] element of the body, -1: no material
    nmm_triangle *triangle; // [n_face], without meaning where each block is one cover
    int n_element;
    int *face_of;    // [n_element]
    int *corner_set; // [2 * n_edge] sets of half-edges whose starts are one point
    int *point;      // [2 * n_edge] draft point at the start of a half-edge of an element
    nmm_arena arena;
} nmm_body;

typedef struct nmm_draft_element {
    nmm_triangle triangle;
    int block, material;
    int first_corner; // in nmm_draft.corner
} nmm_draft_element;

typedef struct nmm_draft_cover {
    nmm_node node; // sixths of steps between lattice nodes; whole blocks: (0..2, block)
    int block;
} nmm_draft_cover;

typedef struct nmm_draft_point {
    nmm_ipoint place;
    int element;
} nmm_draft_point;

typedef struct nmm_draft_vertex {
    int point, next, prev, element;
    int interface, mate;
    int part, n_part; // order > 0: of an edge that is divided; else 0 of 1
} nmm_draft_vertex;

/// The model while it grows, body by body.
typedef struct nmm_draft {
    int n_element, n_corner, n_cover, n_point, n_vertex, n_block;
    nmm_draft_element *element;
    int *element_cover; // [n_element][functions of an element]
    int *corner;        // points
    nmm_draft_cover *cover;
    nmm_draft_point *point;
    nmm_draft_vertex *vertex;
    const char **block_name;
    int *block_scene; // entry of the scene's blocks, -1: the domain
    int n_piece, piece_capacity;
    int *piece_start;       // [n_element + 1] order > 0: first piece of an element
    nmm_ipoint (*piece)[3]; // triangles that make up the elements, signed
    int element_capacity, slot_capacity, corner_capacity, cover_capacity, point_capacity,
        vertex_capacity, block_capacity, scene_capacity;
} nmm_draft;

/// The linear functions of a whole block: w_i = 1/3 + g_i . (x - centre), eq. (2.13).
typedef struct nmm_frame {
    nmm_vec2 centre;    // [m] centroid of the block
    double gradient[6]; // [1/m] g_0, g_1, g_2
    nmm_vec2 node[3];   // [m] where one of them is 1 and the others are 0
} nmm_frame;

/// Everything the stages need.
typedef struct nmm_cut {
    nmm_context *context;
    nmm_scene *scene;
    nmm_lattice lattice;
    nmm_body body;
    nmm_draft draft;
    nmm_frame *frame; // [n_block] with covers.mesh: block, else NULL
    bool *touched;    // [scene->n_joint] the joint touches the domain
    bool apart;       // no block of the scene overlaps another, nor the domain
    nmm_cover_report *report;
} nmm_cut;

// The stages, in order. Each works on cut->body.

/// Segments of the body's outlines, joints and mesh lines.
nmm_status nmm_cut_outline(nmm_cut *cut);
/// Add the mesh lines of all triangles that the body's domain polygons touch.
nmm_status nmm_cut_mesh(nmm_cut *cut);
/// Meaning of edges and faces: material, triangle, element.
nmm_status nmm_cut_faces(nmm_cut *cut);
/// An edge connects from now on: the corners on both its sides become one point at its ends.
void nmm_cut_join_corners(nmm_body *body, int edge);
/// Append elements and blocks to the draft, and the physical covers.
nmm_status nmm_cut_patches(nmm_cut *cut);
/// Report what joints lost.
nmm_status nmm_cut_measure_trimmed(nmm_cut *cut);
/// Append the points, the polygons of the elements, the loops.
nmm_status nmm_cut_points(nmm_cut *cut);
nmm_status nmm_cut_corners(nmm_cut *cut);
nmm_status nmm_cut_loops(nmm_cut *cut);

/// Is each block one cover?
static inline bool nmm_cut_whole_blocks(const nmm_cut *cut) {
    return cut->scene->settings.mesh == NMM_MESH_BLOCK;
}

/// The functions of each block from the areas, centroids and moments of its elements; in `arena`.
nmm_status nmm_frames_build(nmm_context *context, nmm_arena *arena, const nmm_model *model,
                            nmm_frame **frame);
void nmm_frame_weights(const nmm_frame *frame, nmm_vec2 place, double weight[3]);

/// Order > 0: divide the polygons of all elements into triangles.
nmm_status nmm_cut_pieces(nmm_cut *cut);
/// Places where all elements are integrated; 0 at order 0.
int nmm_cut_samples(const nmm_cut *cut);
/// Order > 0: the samples of the elements and the integrals of their functions.
void nmm_cut_fill_samples(const nmm_cut *cut, nmm_model *model);

/// Order of the functions on the lattice; those of whole blocks count as linear ones.
static inline int nmm_cut_order(const nmm_cut *cut) {
    return nmm_cut_whole_blocks(cut) ? 0 : cut->scene->settings.order;
}

/// Order > 0: model->tie_element from the covers of the elements.
nmm_status nmm_cut_ties(nmm_context *context, nmm_model *model);
/// Order > 0: model->tie_gram, as the samples are filled.
nmm_status nmm_cut_fill_ties(nmm_context *context, nmm_model *model);

/// Write the draft into the model.
nmm_status nmm_cut_fill_model(nmm_cut *cut, nmm_model *model);

#endif
