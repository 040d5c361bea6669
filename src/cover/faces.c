// SPDX-License-Identifier: MIT
//
// What the faces and edges of a body's arrangement are. Nothing here compares coordinates: a face
// is inside an area when the area's outline, which winds round it, says so; it lies in the triangle
// that the mesh lines round it say. So slivers of one unit are as safe as any other face.

#include "cut.h"

#include <math.h>

// --- Edges
// ----------------------------------------------------------------------------------------

static nmm_status name_edges(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    const size_t n_edge = (size_t)a->n_edge;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->joint, n_edge, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->mesh, n_edge, sizeof(bool)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->connects, n_edge, sizeof(bool)));
    for (int e = 0; e < a->n_edge; e++) {
        body->joint[e] = -1;
        for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
            const nmm_line *line = &body->line[a->source[s] / 2];
            if (line->kind == NMM_LINE_MESH) body->mesh[e] = true;
            const bool first = body->joint[e] < 0 || line->index < body->joint[e];
            if (line->kind == NMM_LINE_JOINT && first) body->joint[e] = line->index;
        }
    }
    return NMM_OK;
}

// --- Areas
// ----------------------------------------------------------------------------------------

// Edges of all outlines, by area.
typedef struct outline_table {
    int *start; // [n_area + 1]
    int *half;  // half-edges with the area to their left
    int *net;   // [n_edge] windings of the area at hand: left of the edge minus right of it
    int *stack; // [n_face]
    int *seen;  // [n_face] last area + 1 that holds the face
} outline_table;

static nmm_status list_outlines(nmm_cut *cut, outline_table *outlines) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    nmm_arena *arena = &body->arena;
    const int n_source = a->source_start[a->n_edge];
    TRY(nmm_arena_take(cut->context, arena, &outlines->start, (size_t)body->n_area + 1,
                       sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &outlines->net, (size_t)a->n_edge, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &outlines->stack, (size_t)a->n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &outlines->seen, (size_t)a->n_face, sizeof(int)));
    for (int s = 0; s < n_source; s++) {
        const nmm_line *line = &body->line[a->source[s] / 2];
        if (line->kind == NMM_LINE_AREA) outlines->start[line->index] += 1;
    }
    for (int k = 0, end = 0; k <= body->n_area; k++) {
        end += outlines->start[k];
        outlines->start[k] = end;
    }
    const size_t n_half = (size_t)outlines->start[body->n_area];
    TRY(nmm_arena_take(cut->context, arena, &outlines->half, n_half, sizeof(int)));
    for (int e = a->n_edge - 1; e >= 0; e--) {
        for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
            const nmm_line *line = &body->line[a->source[s] / 2];
            if (line->kind != NMM_LINE_AREA) continue;
            outlines->half[--outlines->start[line->index]] = 2 * e + a->source[s] % 2;
        }
    }
    return NMM_OK;
}

// Put a face into area k, once.
static int push_face(outline_table *outlines, int k, int n_stack, int face) {
    if (face == 0 || outlines->seen[face] == k + 1) return n_stack;
    outlines->seen[face] = k + 1;
    outlines->stack[n_stack] = face;
    return n_stack + 1;
}

// The faces next to `face` that no edge of area k divides from it.
static int push_neighbours(const nmm_arrangement *a, outline_table *outlines, int k, int n_stack,
                           int face) {
    for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
        int h = a->cycle[c];
        do {
            if (outlines->net[h / 2] == 0) {
                n_stack = push_face(outlines, k, n_stack, a->face[h ^ 1]);
            }
            h = a->next[h];
        } while (h != a->cycle[c]);
    }
    return n_stack;
}

// What area k makes of a face that it holds. Returns whether the face was within the domain.
static bool fill_face(nmm_body *body, int k, int face) {
    const nmm_body_area *area = &body->area[k];
    switch (area->kind) {
    case NMM_AREA_DOMAIN:
        body->within[face] = true;
        body->material[face] = area->area->material;
        break;
    case NMM_AREA_HOLE:
        body->material[face] = -1;
        break;
    case NMM_AREA_REGION:
        if (body->material[face] >= 0) body->material[face] = area->area->material;
        break;
    }
    return body->within[face];
}

// Fill all faces inside area k; *touched: some were within the domain.
static void fill_area(nmm_body *body, outline_table *outlines, int k, bool *touched) {
    const nmm_arrangement *a = &body->arrangement;
    const int begin = outlines->start[k], end = outlines->start[k + 1];
    for (int i = begin; i < end; i++) {
        const int h = outlines->half[i];
        outlines->net[h / 2] += h % 2 == 0 ? 1 : -1;
    }
    int n_stack = 0;
    for (int i = begin; i < end; i++) {
        const int e = outlines->half[i] / 2;
        if (outlines->net[e] == 0) continue;
        const int inner = outlines->net[e] > 0 ? 2 * e : 2 * e + 1;
        n_stack = push_face(outlines, k, n_stack, a->face[inner]);
    }
    *touched = false;
    while (n_stack > 0) {
        const int face = outlines->stack[--n_stack];
        if (fill_face(body, k, face)) *touched = true;
        n_stack = push_neighbours(a, outlines, k, n_stack, face);
    }
    for (int i = begin; i < end; i++)
        outlines->net[outlines->half[i] / 2] = 0;
}

static nmm_status fill_areas(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const size_t n_face = (size_t)body->arrangement.n_face;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->material, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->within, n_face, sizeof(bool)));
    for (size_t f = 0; f < n_face; f++)
        body->material[f] = -1;
    outline_table outlines = {0};
    TRY(list_outlines(cut, &outlines));
    for (int k = 0; k < body->n_area; k++) {
        bool touched = false;
        fill_area(body, &outlines, k, &touched);
        if (touched) continue;
        if (body->area[k].kind == NMM_AREA_HOLE) {
            return nmm_scene_reject(cut->context, cut->scene, body->area[k].area->mark,
                                    "this hole lies outside the domain");
        }
        if (body->area[k].kind == NMM_AREA_REGION) cut->report->n_region_outside += 1;
    }
    return NMM_OK;
}

// --- Triangles
// ------------------------------------------------------------------------------------

// Mesh lines name the triangles on both sides; the other faces have the triangle of a neighbour.
static nmm_status find_triangles(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    int *stack = NULL, n_stack = 0;
    const size_t n_face = (size_t)a->n_face;
    TRY(nmm_arena_take(cut->context, &body->arena, &stack, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->triangle, n_face, sizeof(nmm_triangle)));
    for (size_t f = 0; f < n_face; f++)
        body->triangle[f].down = -1;
    for (int s = 0, e = 0; s < a->source_start[a->n_edge]; s++) {
        while (s >= a->source_start[e + 1])
            e += 1;
        const nmm_line *line = &body->line[a->source[s] / 2];
        for (int side = 0; side < 2 && line->kind == NMM_LINE_MESH; side++) {
            const int face = a->face[2 * e + (a->source[s] % 2 ^ side)];
            if (face == 0 || body->triangle[face].down >= 0) continue;
            body->triangle[face] = nmm_mesh_line_triangle(line->mesh, side);
            stack[n_stack++] = face;
        }
    }
    while (n_stack > 0) {
        const int face = stack[--n_stack];
        for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
            int h = a->cycle[c];
            do {
                const int other = a->face[h ^ 1];
                if (!body->mesh[h / 2] && other != 0 && body->triangle[other].down < 0) {
                    body->triangle[other] = body->triangle[face];
                    stack[n_stack++] = other;
                }
                h = a->next[h];
            } while (h != a->cycle[c]);
        }
    }
    return NMM_OK;
}

// --- Elements
// -------------------------------------------------------------------------------------

static nmm_status number_elements(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    const size_t n_face = (size_t)a->n_face;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->element, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->face_of, n_face, sizeof(int)));
    body->n_element = 0;
    for (int f = 0; f < a->n_face; f++) {
        body->element[f] = -1;
        if (body->material[f] < 0) continue;
        if (body->triangle[f].down < 0) {
            return nmm_fail(cut->context, NMM_ERROR_NUMERIC,
                            "cutting: face %d lies in no triangle of the mesh", f);
        }
        body->face_of[body->n_element] = f;
        body->element[f] = body->n_element++;
    }
    for (int e = 0; e < a->n_edge; e++) {
        const bool inside =
            body->element[a->face[2 * e]] >= 0 && body->element[a->face[2 * e + 1]] >= 0;
        body->connects[e] = inside && !a->bridge[e] && body->joint[e] < 0;
    }
    return NMM_OK;
}

// --- Joints
// ---------------------------------------------------------------------------------------

static double edge_length(const nmm_cut *cut, int e) {
    const nmm_arrangement *a = &cut->body.arrangement;
    const nmm_vec2 p = nmm_lattice_place(&cut->lattice, a->vertex[a->edge[2 * e]]);
    const nmm_vec2 q = nmm_lattice_place(&cut->lattice, a->vertex[a->edge[2 * e + 1]]);
    const nmm_vec2 d = nmm_vec2_sub(q, p);
    return sqrt(nmm_vec2_dot(d, d));
}

static bool is_trimmed(const nmm_body *body, int e) {
    const nmm_arrangement *a = &body->arrangement;
    return a->bridge[e] && body->joint[e] >= 0 && body->element[a->face[2 * e]] >= 0;
}

// Which joints touch the material.
static void mark_joints(nmm_cut *cut) {
    const nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    for (int e = 0; e < a->n_edge; e++) {
        if (body->joint[e] < 0) continue;
        if (body->element[a->face[2 * e]] < 0 && body->element[a->face[2 * e + 1]] < 0) continue;
        for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
            const nmm_line *line = &body->line[a->source[s] / 2];
            if (line->kind == NMM_LINE_JOINT) cut->touched[line->index] = true;
        }
    }
}

// Trimmed pieces are the connected parts of the bridges; tails do not count.
static nmm_status measure_trimmed(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    int *parent = NULL;
    double *length = NULL;
    const size_t n_vertex = (size_t)a->n_vertex;
    TRY(nmm_arena_take(cut->context, &body->arena, &parent, n_vertex, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &length, n_vertex, sizeof(double)));
    for (int v = 0; v < a->n_vertex; v++)
        parent[v] = v;
    for (int e = 0; e < a->n_edge; e++) {
        if (is_trimmed(body, e)) nmm_set_join(parent, a->edge[2 * e], a->edge[2 * e + 1]);
    }
    for (int e = 0; e < a->n_edge; e++) {
        const int root = nmm_set_root(parent, a->edge[2 * e]);
        if (is_trimmed(body, e)) length[root] += edge_length(cut, e);
    }
    const double tail = 4 * (double)cut->lattice.reach * cut->lattice.spacing;
    nmm_cover_report *report = cut->report;
    for (int v = 0; v < a->n_vertex; v++) {
        if (length[v] <= tail) continue;
        report->n_trimmed += 1;
        report->trimmed_length += length[v];
        report->longest_trimmed = nmm_max(report->longest_trimmed, length[v]);
    }
    return NMM_OK;
}

nmm_status nmm_cut_faces(nmm_cut *cut) {
    TRY(name_edges(cut));
    TRY(fill_areas(cut));
    TRY(find_triangles(cut));
    TRY(number_elements(cut));
    if (cut->body.n_joint == 0) return NMM_OK;
    mark_joints(cut);
    return measure_trimmed(cut);
}
