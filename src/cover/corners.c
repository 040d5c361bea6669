// SPDX-License-Identifier: MIT
//
// The polygons of elements, as lists of points. An element with holes becomes one polygon: each
// hole is joined to what is outside it by a cut that is run along twice, from the hole's leftmost
// corner to the nearest corner that it can be seen from.

#include "cut.h"

// The polygon of one face while it grows: half-edges, each standing for its start.
typedef struct half_ring {
    int n, capacity;
    int *half;
    int n_hole, hole_capacity;
    int *hole;
} half_ring;

static nmm_ipoint place_of(const nmm_arrangement *a, int half) {
    return a->vertex[a->edge[half]];
}

// Append the cycle that starts at `half` to a list.
static nmm_status list_cycle(nmm_cut *cut, int half, int **list, int *n, int *capacity) {
    const nmm_arrangement *a = &cut->body.arrangement;
    int h = half;
    do {
        TRY(nmm_grow(cut->context, list, capacity, *n + 1, sizeof(int)));
        (*list)[(*n)++] = h;
        h = a->next[h];
    } while (h != half);
    return NMM_OK;
}

static double distance2(nmm_ipoint p, nmm_ipoint q) {
    const double dx = (double)(q.x - p.x), dy = (double)(q.y - p.y);
    return dx * dx + dy * dy;
}

// Does a cut from p to q cross an edge of the face?
static bool is_hidden(const nmm_arrangement *a, int face, nmm_ipoint p, nmm_ipoint q) {
    const nmm_isegment cut = {.a = p, .b = q};
    for (int c = a->face_start[face]; c < a->face_start[face + 1]; c++) {
        int h = a->cycle[c];
        do {
            const nmm_isegment edge = {.a = place_of(a, h), .b = place_of(a, h ^ 1)};
            if (nmm_isegment_cross(cut, edge)) return true;
            h = a->next[h];
        } while (h != a->cycle[c]);
    }
    return false;
}

// The ring's nearest corner to p that is visible from p; the nearest of all if none is.
static int find_corner(const nmm_arrangement *a, int face, const half_ring *ring, nmm_ipoint p) {
    double passed = -1;
    int nearest_of_all = 0;
    for (int attempt = 0; attempt < ring->n; attempt++) {
        int best = -1;
        double least = 0;
        for (int k = 0; k < ring->n; k++) {
            const double d = distance2(p, place_of(a, ring->half[k]));
            if (d <= passed || (best >= 0 && d >= least)) continue;
            best = k;
            least = d;
        }
        if (best < 0) break;
        if (attempt == 0) nearest_of_all = best;
        if (!is_hidden(a, face, p, place_of(a, ring->half[best]))) return best;
        passed = least;
    }
    return nearest_of_all;
}

// Insert the hole of cycle `half` into the ring.
static nmm_status join_hole(nmm_cut *cut, int face, int half, half_ring *ring) {
    const nmm_arrangement *a = &cut->body.arrangement;
    ring->n_hole = 0;
    TRY(list_cycle(cut, half, &ring->hole, &ring->n_hole, &ring->hole_capacity));
    int start = 0;
    for (int k = 1; k < ring->n_hole; k++) {
        if (a->edge[ring->hole[k]] < a->edge[ring->hole[start]]) start = k;
    }
    const int corner = find_corner(a, face, ring, place_of(a, ring->hole[start]));
    // ring[..corner], hole from start round to start, ring[corner..]
    const int added = ring->n_hole + 2;
    TRY(nmm_grow(cut->context, &ring->half, &ring->capacity, ring->n + added, sizeof(int)));
    for (int k = ring->n - 1; k >= corner; k--)
        ring->half[k + added] = ring->half[k];
    for (int k = 0; k <= ring->n_hole; k++)
        ring->half[corner + 1 + k] = ring->hole[(start + k) % ring->n_hole];
    ring->n += added;
    return NMM_OK;
}

static nmm_status add_polygon(nmm_cut *cut, int face, half_ring *ring) {
    const nmm_arrangement *a = &cut->body.arrangement;
    nmm_draft *draft = &cut->draft;
    const int begin = a->face_start[face], end = a->face_start[face + 1];
    ring->n = 0;
    TRY(list_cycle(cut, a->cycle[begin], &ring->half, &ring->n, &ring->capacity));
    for (int c = begin + 1; c < end; c++)
        TRY(join_hole(cut, face, a->cycle[c], ring));
    TRY(nmm_grow(cut->context, &draft->corner, &draft->corner_capacity, draft->n_corner + ring->n,
                 sizeof(int)));
    for (int k = 0; k < ring->n; k++)
        draft->corner[draft->n_corner++] = cut->body.point[ring->half[k]];
    return NMM_OK;
}

nmm_status nmm_cut_corners(nmm_cut *cut) {
    const nmm_body *body = &cut->body;
    const int base = cut->draft.n_element - body->n_element;
    half_ring ring = {0};
    nmm_status status = NMM_OK;
    for (int k = 0; k < body->n_element && status == NMM_OK; k++) {
        cut->draft.element[base + k].first_corner = cut->draft.n_corner;
        status = add_polygon(cut, body->face_of[k], &ring);
    }
    nmm_release(cut->context, &ring.half);
    nmm_release(cut->context, &ring.hole);
    return status;
}
