// SPDX-License-Identifier: MIT
//
// What the faces and edges of a body's arrangement are. Nothing here compares coordinates: a face
// is inside an area when the area's outline winds round it; it lies in the triangle that the mesh
// lines round it name. So slivers of one unit are as safe as any other face.

#include "cut.h"

#include <math.h>

// --- Edges

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

// A walk over all faces from the unbounded one, across edges. It carries how often each outline
// winds round the face at hand, so no face needs to look at all outlines.
typedef struct face_walk {
    int *way;     // [n_face] half-edge by which a face is entered (it lies to the left), -1: none
    int *child;   // [n_face] first face entered from this one
    int *sibling; // [n_face] next face entered from the same one
    int *winding; // [n_area] round the face at hand
    int *active;  // areas with winding > 0, in no order
    int *slot;    // [n_area] place in `active`
    int n_active;
    bool *touched; // [n_area] holds a face of the domain
} face_walk;

static nmm_status open_walk(nmm_cut *cut, face_walk *walk) {
    nmm_body *body = &cut->body;
    nmm_arena *arena = &body->arena;
    const size_t n_face = (size_t)body->arrangement.n_face, n_area = (size_t)body->n_area;
    TRY(nmm_arena_take(cut->context, arena, &walk->way, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->child, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->sibling, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->winding, n_area, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->active, n_area, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->slot, n_area, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &walk->touched, n_area, sizeof(bool)));
    for (size_t f = 0; f < n_face; f++)
        walk->way[f] = walk->child[f] = walk->sibling[f] = -1;
    return NMM_OK;
}

// Enter the faces next to `face` that were not entered before; they join the queue.
static int enter_neighbours(const nmm_arrangement *a, face_walk *walk, int face, int *queue,
                            int n) {
    for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
        int h = a->cycle[c];
        do {
            const int other = a->face[h ^ 1];
            if (other != 0 && walk->way[other] < 0) {
                walk->way[other] = h ^ 1;
                walk->sibling[other] = walk->child[face];
                walk->child[face] = other;
                queue[n++] = other;
            }
            h = a->next[h];
        } while (h != a->cycle[c]);
    }
    return n;
}

static void wind(face_walk *walk, int area, int turns) {
    const bool before = walk->winding[area] > 0;
    walk->winding[area] += turns;
    const bool after = walk->winding[area] > 0;
    if (!before && after) {
        walk->slot[area] = walk->n_active;
        walk->active[walk->n_active++] = area;
    }
    if (before && !after) {
        const int last = walk->active[--walk->n_active];
        walk->active[walk->slot[area]] = last;
        walk->slot[last] = walk->slot[area];
    }
}

// Step over half-edge h to the face on its left (turns = 1), or back (turns = -1).
static void cross_edge(const nmm_body *body, face_walk *walk, int h, int turns) {
    const nmm_arrangement *a = &body->arrangement;
    for (int s = a->source_start[h / 2]; s < a->source_start[h / 2 + 1]; s++) {
        const nmm_line *line = &body->line[a->source[s] / 2];
        if (line->kind != NMM_LINE_AREA) continue;
        wind(walk, line->index, a->source[s] % 2 == h % 2 ? turns : -turns);
    }
}

// Areas come as domain polygons, holes, regions; of each kind the last one counts.
static void judge_face(nmm_body *body, face_walk *walk, int face) {
    int last[3] = {-1, -1, -1};
    for (int i = 0; i < walk->n_active; i++) {
        const int area = walk->active[i];
        const nmm_area_kind kind = body->area[area].kind;
        last[kind] = nmm_max_int(last[kind], area);
    }
    if (last[NMM_AREA_DOMAIN] < 0) return;
    // Inside a hole nothing but holes has an effect.
    const bool hole = last[NMM_AREA_HOLE] >= 0;
    for (int i = 0; i < walk->n_active; i++) {
        const int area = walk->active[i];
        if (!hole || body->area[area].kind == NMM_AREA_HOLE) walk->touched[area] = true;
    }
    if (hole) return;
    const int area = nmm_max_int(last[NMM_AREA_DOMAIN], last[NMM_AREA_REGION]);
    body->material[face] = body->area[area].area->material;
}

// Depth first over the tree of faces, stepping back over the same edges.
static void judge_faces(nmm_body *body, face_walk *walk) {
    const nmm_arrangement *a = &body->arrangement;
    int face = 0;
    for (;;) {
        const int child = walk->child[face];
        if (child >= 0) {
            walk->child[face] = walk->sibling[child];
            cross_edge(body, walk, walk->way[child], 1);
            judge_face(body, walk, child);
            face = child;
        } else {
            if (face == 0) return;
            cross_edge(body, walk, walk->way[face], -1);
            face = a->face[walk->way[face] ^ 1];
        }
    }
}

static nmm_status fill_areas(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    const size_t n_face = (size_t)a->n_face;
    face_walk walk = {0};
    int *queue = NULL, n = 1;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->material, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &queue, n_face, sizeof(int)));
    TRY(open_walk(cut, &walk));
    for (size_t f = 0; f < n_face; f++)
        body->material[f] = -1;
    // A tree over the faces, breadth first from face 0.
    for (int i = 0; i < n; i++)
        n = enter_neighbours(a, &walk, queue[i], queue, n);
    judge_faces(body, &walk);
    for (int k = 0; k < body->n_area; k++) {
        if (walk.touched[k]) continue;
        const nmm_mark mark = body->area[k].area->mark;
        if (body->area[k].kind == NMM_AREA_HOLE) {
            return nmm_scene_reject(cut->context, cut->scene, mark,
                                    "this hole lies outside the domain");
        }
        if (body->area[k].kind != NMM_AREA_REGION) continue;
        cut->report->n_region_outside += 1;
        TRY(nmm_scene_warn(cut->context, cut->scene, mark,
                           "no material lies inside this region: it changes nothing"));
    }
    return NMM_OK;
}

// --- Triangles

// The mesh line that an edge lies on; NULL: none, or more than one, which tells nothing.
static const nmm_line *mesh_line_of(const nmm_body *body, int e, int *source) {
    const nmm_arrangement *a = &body->arrangement;
    const nmm_line *found = NULL;
    for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
        const nmm_line *line = &body->line[a->source[s] / 2];
        if (line->kind != NMM_LINE_MESH) continue;
        if (found != NULL) return NULL;
        found = line;
        *source = a->source[s];
    }
    return found;
}

// Give a face its triangle, once, and note it.
static void give_triangle(nmm_body *body, int face, nmm_triangle triangle, int *queue, int *n) {
    if (face == 0 || body->triangle[face].down >= 0) return;
    body->triangle[face] = triangle;
    queue[(*n)++] = face;
}

// Hand the triangle of a face on to its neighbours in the same triangle.
static void hand_on(nmm_body *body, int face, int *queue, int *n) {
    const nmm_arrangement *a = &body->arrangement;
    for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
        int h = a->cycle[c];
        do {
            if (!body->mesh[h / 2]) {
                give_triangle(body, a->face[h ^ 1], body->triangle[face], queue, n);
            }
            h = a->next[h];
        } while (h != a->cycle[c]);
    }
}

// Mesh lines name the triangles on both sides; the other faces have the triangle of a neighbour.
static nmm_status find_triangles(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    int *queue = NULL, n = 0;
    const size_t n_face = (size_t)a->n_face;
    TRY(nmm_arena_take(cut->context, &body->arena, &queue, n_face, sizeof(int)));
    TRY(nmm_arena_take(cut->context, &body->arena, &body->triangle, n_face, sizeof(nmm_triangle)));
    for (size_t f = 0; f < n_face; f++)
        body->triangle[f].down = -1;
    for (int e = 0; e < a->n_edge; e++) {
        int source = 0;
        const nmm_line *line = mesh_line_of(body, e, &source);
        for (int side = 0; side < 2 && line != NULL; side++) {
            const int face = a->face[(2 * e + source % 2) ^ side];
            give_triangle(body, face, nmm_mesh_line_triangle(line->mesh, side), queue, &n);
        }
    }
    for (int i = 0; i < n; i++)
        hand_on(body, queue[i], queue, &n);
    return NMM_OK;
}

// --- Elements

// A block that is one cover cannot open a joint that does not divide it: such edges connect.
static nmm_status close_inside(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    int *parent = NULL;
    TRY(nmm_arena_take(cut->context, &body->arena, &parent, (size_t)body->n_element, sizeof(int)));
    for (int k = 0; k < body->n_element; k++)
        parent[k] = k;
    for (int e = 0; e < a->n_edge; e++) {
        if (!body->connects[e]) continue;
        nmm_set_join(parent, body->element[a->face[2 * e]], body->element[a->face[2 * e + 1]]);
    }
    for (int e = 0; e < a->n_edge; e++) {
        const int left = body->element[a->face[2 * e]], right = body->element[a->face[2 * e + 1]];
        if (a->bridge[e] || left < 0 || right < 0) continue;
        body->connects[e] = nmm_set_root(parent, left) == nmm_set_root(parent, right);
    }
    return NMM_OK;
}

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
        if (body->triangle[f].down < 0 && !nmm_cut_whole_blocks(cut)) {
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
    return nmm_cut_whole_blocks(cut) ? close_inside(cut) : NMM_OK;
}

// --- Corners

void nmm_cut_join_corners(nmm_body *body, int edge) {
    const nmm_arrangement *a = &body->arrangement;
    nmm_set_join(body->corner_set, 2 * edge, a->next[2 * edge + 1]);
    nmm_set_join(body->corner_set, 2 * edge + 1, a->next[2 * edge]);
}

// Round a vertex, corners of elements that follow each other across edges that connect are one
// point. A half-edge stands for the corner at its start.
static nmm_status join_corners(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    const int n_half = 2 * a->n_edge;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->corner_set, (size_t)n_half, sizeof(int)));
    for (int h = 0; h < n_half; h++)
        body->corner_set[h] = h;
    for (int e = 0; e < a->n_edge; e++) {
        if (body->connects[e]) nmm_cut_join_corners(body, e);
    }
    return NMM_OK;
}

// A joint of a single edge whose sides share their points at both ends cannot open: it connects.
static void close_slits(nmm_body *body) {
    const nmm_arrangement *a = &body->arrangement;
    for (int e = 0; e < a->n_edge; e++) {
        const int h = 2 * e, twin = 2 * e + 1;
        if (a->bridge[e] || body->joint[e] < 0) continue;
        if (body->element[a->face[h]] < 0 || body->element[a->face[twin]] < 0) continue;
        const int start = nmm_set_root(body->corner_set, h);
        const int end = nmm_set_root(body->corner_set, twin);
        body->connects[e] = start == nmm_set_root(body->corner_set, a->next[twin]) &&
                            end == nmm_set_root(body->corner_set, a->next[h]);
    }
}

// --- Joints

static double edge_length(const nmm_cut *cut, int e) {
    const nmm_arrangement *a = &cut->body.arrangement;
    const nmm_vec2 p = nmm_lattice_place(&cut->lattice, a->vertex[a->edge[2 * e]]);
    const nmm_vec2 q = nmm_lattice_place(&cut->lattice, a->vertex[a->edge[2 * e + 1]]);
    const nmm_vec2 d = nmm_vec2_sub(q, p);
    return sqrt(nmm_vec2_dot(d, d));
}

static bool is_trimmed(const nmm_body *body, int e) {
    const nmm_arrangement *a = &body->arrangement;
    if (body->joint[e] < 0 || body->element[a->face[2 * e]] < 0) return false;
    return a->bridge[e] || body->connects[e];
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

// Trimmed pieces are the connected parts of what joints lost; what is as short as welding reaches
// does not count.
nmm_status nmm_cut_measure_trimmed(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    int *parent = NULL;
    double *length = NULL;
    if (body->n_joint == 0) return NMM_OK;
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
    const double shortest = 4 * (double)cut->lattice.reach * cut->lattice.spacing;
    nmm_cover_report *report = cut->report;
    for (int v = 0; v < a->n_vertex; v++) {
        if (length[v] <= shortest) continue;
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
    TRY(join_corners(cut));
    close_slits(&cut->body);
    if (cut->body.n_joint > 0) mark_joints(cut);
    return NMM_OK;
}
