// SPDX-License-Identifier: MIT
//
// Points, and boundary loops of blocks. Round a vertex of the arrangement, the corners of elements
// that follow each other across connecting edges are one point: each side of a joint has its own.
// Every half-edge of an element that does not connect is a loop edge; the next one is found by
// turning round the vertex across the edges that connect, so loops close and never cross over from
// one side of a joint to the other, also at crack tips and where a block touches itself in a point.

#include "cut.h"

// Edges shorter than this part of the cover size are not divided.
#define LEAST_DIVIDED 1e-4

// Element of the draft to the left of a half-edge, -1: none.
static int element_of(const nmm_cut *cut, int base, int half) {
    const nmm_body *body = &cut->body;
    if (body->arrangement.bridge[half / 2]) return -1;
    const int element = body->element[body->arrangement.face[half]];
    return element < 0 ? -1 : base + element;
}

nmm_status nmm_cut_points(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    nmm_draft *draft = &cut->draft;
    const nmm_arrangement *a = &body->arrangement;
    const int n_half = 2 * a->n_edge, base = draft->n_element - body->n_element;
    TRY(nmm_arena_take(cut->context, &body->arena, &body->point, (size_t)n_half, sizeof(int)));
    // Roots are the smallest half-edges, so a root comes before its corners.
    for (int h = 0; h < n_half; h++) {
        const int element = element_of(cut, base, h), root = nmm_set_root(body->corner_set, h);
        body->point[h] = -1;
        if (element < 0) continue;
        if (root == h) {
            TRY(nmm_grow(cut->context, &draft->point, &draft->point_capacity, draft->n_point + 1,
                         sizeof(nmm_draft_point)));
            draft->point[draft->n_point] = (nmm_draft_point){a->vertex[a->edge[h]], element};
            body->point[h] = draft->n_point++;
        } else {
            body->point[h] = body->point[root];
        }
    }
    return NMM_OK;
}

// The loop edge that follows loop half-edge h.
static int next_on_loop(const nmm_body *body, int h) {
    const int *next = body->arrangement.next;
    int following = next[h];
    while (body->connects[following / 2])
        following = next[following ^ 1];
    return following;
}

// Parts of a loop edge: order + 1, so that straight parts follow its curve; very short edges stay
// whole.
static int parts_of(const nmm_cut *cut, int h) {
    const nmm_arrangement *a = &cut->body.arrangement;
    const nmm_ipoint p = a->vertex[a->edge[h]], q = a->vertex[a->edge[h ^ 1]];
    const double dx = (double)(q.x - p.x), dy = (double)(q.y - p.y);
    const double least = LEAST_DIVIDED * (double)cut->lattice.side;
    return dx * dx + dy * dy > least * least ? 1 + nmm_cut_order(cut) : 1;
}

// The place at part k of n of an edge, the same seen from both sides.
static nmm_ipoint place_of_part(const nmm_cut *cut, int h, int k, int n) {
    const nmm_arrangement *a = &cut->body.arrangement;
    const int even = h & ~1;
    const nmm_ipoint p = a->vertex[a->edge[even]], q = a->vertex[a->edge[even ^ 1]];
    const int at = h == even ? k : n - k;
    return (nmm_ipoint){p.x + (q.x - p.x) * at / n, p.y + (q.y - p.y) * at / n};
}

// The vertices of the parts 1 .. n - 1 of loop edge h, whose first vertex is v and stands already.
static nmm_status divide_edge(nmm_cut *cut, int h, int v, int mate) {
    nmm_draft *draft = &cut->draft;
    const nmm_draft_vertex first = draft->vertex[v];
    const int n = first.n_part;
    draft->vertex[v].mate = mate >= 0 ? mate + n - 1 : -1;
    for (int k = 1; k < n; k++) {
        TRY(nmm_grow(cut->context, &draft->point, &draft->point_capacity, draft->n_point + 1,
                     sizeof(nmm_draft_point)));
        draft->point[draft->n_point] =
            (nmm_draft_point){place_of_part(cut, h, k, n), first.element};
        nmm_draft_vertex *vertex = &draft->vertex[v + k];
        *vertex = first;
        vertex->point = draft->n_point++;
        vertex->part = k;
        vertex->mate = mate >= 0 ? mate + n - 1 - k : -1;
        vertex->prev = v + k - 1;
        draft->vertex[v + k - 1].next = v + k;
    }
    draft->vertex[v + n - 1].next = first.next;
    draft->vertex[first.next].prev = v + n - 1;
    return NMM_OK;
}

nmm_status nmm_cut_loops(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    nmm_draft *draft = &cut->draft;
    const nmm_arrangement *a = &body->arrangement;
    const int n_half = 2 * a->n_edge, base = draft->n_element - body->n_element;
    int *vertex_of = NULL, n_vertex = draft->n_vertex;
    TRY(nmm_arena_take(cut->context, &body->arena, &vertex_of, (size_t)n_half, sizeof(int)));
    for (int h = 0; h < n_half; h++) {
        const bool on_loop = element_of(cut, base, h) >= 0 && !body->connects[h / 2];
        vertex_of[h] = on_loop ? n_vertex : -1;
        if (on_loop) n_vertex += parts_of(cut, h);
    }
    TRY(nmm_grow(cut->context, &draft->vertex, &draft->vertex_capacity, n_vertex,
                 sizeof(nmm_draft_vertex)));
    for (int h = 0; h < n_half; h++) {
        if (vertex_of[h] < 0) continue;
        nmm_draft_vertex *vertex = &draft->vertex[vertex_of[h]];
        const int joint = body->joint[h / 2];
        const int next = vertex_of[next_on_loop(body, h)];
        vertex->point = body->point[h];
        vertex->element = element_of(cut, base, h);
        vertex->next = next;
        vertex->interface = joint >= 0 ? cut->scene->joint[joint].interface : -1;
        vertex->mate = vertex_of[h ^ 1];
        vertex->part = 0;
        vertex->n_part = parts_of(cut, h);
        draft->vertex[next].prev = vertex_of[h];
        if (vertex->n_part > 1) TRY(divide_edge(cut, h, vertex_of[h], vertex_of[h ^ 1]));
    }
    draft->n_vertex = n_vertex;
    return NMM_OK;
}
