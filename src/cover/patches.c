// SPDX-License-Identifier: MIT
//
// Blocks and physical covers by union-find. Blocks: elements joined across edges that connect.
// Covers: each element has a slot for each of its functions, at a node of its triangle, at the
// middle of an edge or at the centroid; across an edge that connects, slots of the same function
// are joined. What is left over are the connected pieces of the node's star (of the triangles at an
// edge, of a triangle): a joint that passes through divides them, one that ends inside does not.
// With covers.mesh: block each block has one cover of order 1. Its space, the linear functions on
// the block, is that of three covers of order 0 which no other block shares, and so it is kept.

#include "cut.h"

static nmm_status make_sets(nmm_cut *cut, int n, int **parent) {
    TRY(nmm_arena_take(cut->context, &cut->body.arena, parent, (size_t)n, sizeof(int)));
    for (int i = 0; i < n; i++)
        (*parent)[i] = i;
    return NMM_OK;
}

// Elements on both sides of an edge.
static void sides_of(const nmm_body *body, int edge, int element[2]) {
    element[0] = body->element[body->arrangement.face[2 * edge]];
    element[1] = body->element[body->arrangement.face[2 * edge + 1]];
}

// --- Blocks

static nmm_status add_block(nmm_cut *cut) {
    nmm_draft *draft = &cut->draft;
    TRY(nmm_grow(cut->context, &draft->block_name, &draft->block_capacity, draft->n_block + 1,
                 sizeof(char *)));
    TRY(nmm_grow(cut->context, &draft->block_scene, &draft->scene_capacity, draft->n_block + 1,
                 sizeof(int)));
    draft->block_name[draft->n_block] = cut->body.name;
    draft->block_scene[draft->n_block++] = cut->body.from;
    return NMM_OK;
}

// Append the elements, with their blocks, numbered by their first elements.
static nmm_status add_elements(nmm_cut *cut) {
    nmm_body *body = &cut->body;
    nmm_draft *draft = &cut->draft;
    int *parent = NULL;
    TRY(make_sets(cut, body->n_element, &parent));
    for (int e = 0; e < body->arrangement.n_edge; e++) {
        if (!body->connects[e]) continue;
        int side[2];
        sides_of(body, e, side);
        nmm_set_join(parent, side[0], side[1]);
    }
    const int base = draft->n_element;
    TRY(nmm_grow(cut->context, &draft->element, &draft->element_capacity, base + body->n_element,
                 sizeof(nmm_draft_element)));
    for (int k = 0; k < body->n_element; k++) {
        const int face = body->face_of[k], root = nmm_set_root(parent, k);
        if (root == k) TRY(add_block(cut));
        draft->element[base + k] = (nmm_draft_element){
            .triangle = body->triangle[face],
            .material = body->material[face],
            .block = root == k ? draft->n_block - 1 : draft->element[base + root].block,
        };
    }
    draft->n_element = base + body->n_element;
    return NMM_OK;
}

// --- Covers

// Where the functions of body element k have their places, in sixths of steps between nodes: nodes,
// middles of edges, the same for the second functions of the edges, centroid.
static void slot_nodes(const nmm_body *body, int k, nmm_node slot[NMM_MOST_LOCAL]) {
    nmm_node n[3];
    nmm_triangle_nodes(body->triangle[body->face_of[k]], n);
    for (int a = 0; a < 3; a++) {
        const nmm_node next = n[(a + 1) % 3];
        slot[a] = (nmm_node){6 * n[a].i, 6 * n[a].j};
        slot[3 + a] = slot[6 + a] = (nmm_node){3 * (n[a].i + next.i), 3 * (n[a].j + next.j)};
    }
    slot[9] = (nmm_node){2 * (n[0].i + n[1].i + n[2].i), 2 * (n[0].j + n[1].j + n[2].j)};
}

// Slots of two elements that belong to the same function of n, side by side; returns how many.
static int same_functions(const nmm_body *body, const int side[2], int n,
                          int pair[NMM_MOST_LOCAL][2]) {
    nmm_node left[NMM_MOST_LOCAL], right[NMM_MOST_LOCAL];
    slot_nodes(body, side[0], left);
    slot_nodes(body, side[1], right);
    int n_pair = 0;
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            // The two functions of an edge share their place.
            if (left[a].i != right[b].i || left[a].j != right[b].j || a / 6 != b / 6) continue;
            pair[n_pair][0] = n * side[0] + a;
            pair[n_pair++][1] = n * side[1] + b;
        }
    }
    return n_pair;
}

static void join_slots(const nmm_body *body, int *parent, const int side[2], int n) {
    int pair[NMM_MOST_LOCAL][2];
    const int n_pair = same_functions(body, side, n, pair);
    for (int k = 0; k < n_pair; k++)
        nmm_set_join(parent, pair[k][0], pair[k][1]);
}

// Do the same functions act on both sides of a joint? What only one side has is zero on it.
static bool is_shut(const nmm_body *body, int *parent, const int side[2], int n) {
    int pair[NMM_MOST_LOCAL][2];
    const int n_pair = same_functions(body, side, n, pair);
    for (int k = 0; k < n_pair; k++) {
        if (nmm_set_root(parent, pair[k][0]) != nmm_set_root(parent, pair[k][1])) return false;
    }
    return true;
}

// A piece of a joint on both sides of which the same functions act cannot open: it connects. Along
// a line of the lattice this is what lies beyond the last node.
static void close_shut(nmm_cut *cut, int *parent, int n_local) {
    nmm_body *body = &cut->body;
    const nmm_arrangement *a = &body->arrangement;
    for (int e = 0; e < a->n_edge; e++) {
        int side[2];
        sides_of(body, e, side);
        if (body->connects[e] || a->bridge[e] || side[0] < 0 || side[1] < 0) continue;
        if (!is_shut(body, parent, side, n_local)) continue;
        body->connects[e] = true;
        nmm_cut_join_corners(body, e);
    }
}

// Root slots by row, column and slot: each one is a cover. x = row, y = column * 2^32 + slot.
static nmm_status list_covers(nmm_cut *cut, int *parent, int n_local, int *n_cover,
                              nmm_ipoint **cover) {
    nmm_body *body = &cut->body;
    nmm_ipoint *list = NULL, *spare = NULL;
    const size_t most = (size_t)n_local * (size_t)body->n_element;
    TRY(nmm_arena_take(cut->context, &body->arena, &list, most, sizeof *list));
    TRY(nmm_arena_take(cut->context, &body->arena, &spare, most, sizeof *spare));
    *n_cover = 0;
    for (int k = 0; k < body->n_element; k++) {
        nmm_node node[NMM_MOST_LOCAL];
        slot_nodes(body, k, node);
        for (int a = 0; a < n_local; a++) {
            const int slot = n_local * k + a;
            if (nmm_set_root(parent, slot) != slot) continue;
            const int64_t packed = node[a].i * (INT64_C(1) << 32) + slot;
            list[(*n_cover)++] = (nmm_ipoint){node[a].j, packed};
        }
    }
    *cover = nmm_ipoint_sort(*n_cover, list, spare);
    return NMM_OK;
}

// The slot that list_covers packed.
static int slot_of(nmm_ipoint cover) {
    return (int)(cover.y & INT64_C(0xffffffff));
}

static nmm_status add_covers(nmm_cut *cut, int base) {
    nmm_body *body = &cut->body;
    nmm_draft *draft = &cut->draft;
    int *parent = NULL, *cover_of = NULL, n_cover = 0;
    nmm_ipoint *cover = NULL;
    const int n_local = nmm_local_of(nmm_cut_order(cut)), n_slot = n_local * body->n_element;
    TRY(make_sets(cut, n_slot, &parent));
    for (int e = 0; e < body->arrangement.n_edge; e++) {
        if (!body->connects[e]) continue;
        int side[2];
        sides_of(body, e, side);
        join_slots(body, parent, side, n_local);
    }
    if (body->n_joint > 0) close_shut(cut, parent, n_local);
    TRY(list_covers(cut, parent, n_local, &n_cover, &cover));
    TRY(nmm_arena_take(cut->context, &body->arena, &cover_of, (size_t)n_slot, sizeof(int)));
    TRY(nmm_grow(cut->context, &draft->cover, &draft->cover_capacity, draft->n_cover + n_cover,
                 sizeof(nmm_draft_cover)));
    for (int c = 0; c < n_cover; c++) {
        const int slot = slot_of(cover[c]);
        nmm_node node[NMM_MOST_LOCAL];
        slot_nodes(body, slot / n_local, node);
        cover_of[slot] = draft->n_cover + c;
        draft->cover[draft->n_cover + c] =
            (nmm_draft_cover){node[slot % n_local], draft->element[base + slot / n_local].block};
    }
    draft->n_cover += n_cover;
    int *element_cover = draft->element_cover + n_local * (long)base;
    for (int slot = 0; slot < n_slot; slot++)
        element_cover[slot] = cover_of[nmm_set_root(parent, slot)];
    return NMM_OK;
}

// Three covers for each new block, shared by all its elements.
static nmm_status add_whole_blocks(nmm_cut *cut, int base) {
    nmm_draft *draft = &cut->draft;
    const int n_cover = 3 * draft->n_block;
    TRY(nmm_grow(cut->context, &draft->cover, &draft->cover_capacity, n_cover,
                 sizeof(nmm_draft_cover)));
    for (int c = draft->n_cover; c < n_cover; c++)
        draft->cover[c] = (nmm_draft_cover){{c % 3, c / 3}, c / 3};
    draft->n_cover = n_cover;
    for (int e = base; e < draft->n_element; e++) {
        for (int i = 0; i < 3; i++)
            draft->element_cover[3 * (long)e + i] = 3 * draft->element[e].block + i;
    }
    return NMM_OK;
}

nmm_status nmm_cut_patches(nmm_cut *cut) {
    const int base = cut->draft.n_element;
    TRY(add_elements(cut));
    nmm_draft *draft = &cut->draft;
    TRY(nmm_grow(cut->context, &draft->element_cover, &draft->slot_capacity, draft->n_element,
                 (size_t)nmm_local_of(nmm_cut_order(cut)) * sizeof(int)));
    return nmm_cut_whole_blocks(cut) ? add_whole_blocks(cut, base) : add_covers(cut, base);
}
