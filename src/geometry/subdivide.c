// SPDX-License-Identifier: MIT
//
// Faces of an arrangement. Half-edges round a vertex are sorted by exact angle; the one that
// follows h along its face is the clockwise neighbour of h's twin round the vertex that h ends at.
// Cycles that run counter-clockwise bound a face from outside; each connected part of the graph has
// one other cycle, round it, and this one belongs to the face that a ray to the left of its
// leftmost vertex meets. Edges with the same cycle on both sides (bridges) divide nothing and are
// taken out of the cycles.

#include "arrangement.h"
#include "grid.h"

// --- Half-edges and cycles

static const nmm_ipoint *end_of(const nmm_arrangement *a, int half) {
    return &a->vertex[a->edge[half ^ 1]];
}

// Sort the half-edges that leave vertex v, ring[0..n), by angle.
static void sort_ring(const nmm_arrangement *a, int v, int n, int *ring) {
    for (int i = 1; i < n; i++) {
        const int moved = ring[i];
        int k = i;
        for (; k > 0; k--) {
            const int order =
                nmm_ipoint_compare_angle(a->vertex[v], *end_of(a, moved), *end_of(a, ring[k - 1]));
            if (order >= 0) break;
            ring[k] = ring[k - 1];
        }
        ring[k] = moved;
    }
}

// next[] from the half-edges round each vertex.
static nmm_status link_half_edges(nmm_context *context, nmm_arrangement *a) {
    const int n_half = 2 * a->n_edge;
    int *start = NULL, *ring = NULL;
    TRY(nmm_arena_take(context, &a->arena, &start, (size_t)a->n_vertex + 1, sizeof(int)));
    TRY(nmm_arena_take(context, &a->arena, &ring, (size_t)n_half, sizeof(int)));
    TRY(nmm_arena_take(context, &a->arena, &a->next, (size_t)n_half, sizeof(int)));
    for (int h = 0; h < n_half; h++)
        start[a->edge[h]] += 1;
    for (int v = 0, end = 0; v <= a->n_vertex; v++) {
        end += start[v];
        start[v] = end;
    }
    for (int h = n_half - 1; h >= 0; h--)
        ring[--start[a->edge[h]]] = h;
    for (int v = 0; v < a->n_vertex; v++) {
        const int n = start[v + 1] - start[v];
        int *around = ring + start[v];
        sort_ring(a, v, n, around);
        for (int i = 0; i < n; i++)
            a->next[around[i] ^ 1] = around[i > 0 ? i - 1 : n - 1];
    }
    return NMM_OK;
}

// What is known of one boundary cycle.
typedef struct cycle {
    int half;   // its first half-edge
    int lowest; // its lowest vertex: leftmost, then lowest
    int face;
    bool outer; // runs counter-clockwise
} cycle;

// Walk one cycle from `half`, giving its half-edges the number `number`.
static cycle trace_cycle(const nmm_arrangement *a, int half, int *number_of, int number) {
    const nmm_ipoint base = a->vertex[a->edge[half]];
    cycle result = {.half = half, .lowest = a->edge[half], .face = 0};
    nmm_int128 area = 0;
    int h = half;
    do {
        number_of[h] = number;
        result.lowest = nmm_min_int(result.lowest, a->edge[h]);
        area += nmm_icross(base, a->vertex[a->edge[h]], *end_of(a, h));
        h = a->next[h];
    } while (h != half);
    result.outer = area > 0;
    return result;
}

// All cycles, in the order of their first half-edges; number_of[h] = cycle of half-edge h.
static nmm_status trace_cycles(nmm_context *context, nmm_arrangement *a, int *number_of,
                               int *n_cycle, cycle **cycles) {
    const int n_half = 2 * a->n_edge;
    for (int h = 0; h < n_half; h++)
        number_of[h] = -1;
    int capacity = 0;
    *n_cycle = 0;
    for (int h = 0; h < n_half; h++) {
        if (number_of[h] >= 0 || a->bridge[h / 2]) continue;
        if (*n_cycle == capacity) {
            // Room for twice as many; the arena forgets the old list at its reset.
            cycle *larger = NULL;
            capacity = 2 * capacity + 16;
            TRY(nmm_arena_take(context, &a->arena, &larger, (size_t)capacity, sizeof(cycle)));
            for (int c = 0; c < *n_cycle; c++)
                larger[c] = (*cycles)[c];
            *cycles = larger;
        }
        (*cycles)[*n_cycle] = trace_cycle(a, h, number_of, *n_cycle);
        *n_cycle += 1;
    }
    return NMM_OK;
}

// --- Islands

typedef struct left_ray {
    const nmm_arrangement *a;
    nmm_ipoint from; // runs to the left from here
    int half;        // nearest half-edge so far whose face the ray comes from, -1: none
} left_ray;

// Is the crossing of the ray's line with upward edge pq further right than the one with rs?
static bool crosses_later(nmm_ipoint p, nmm_ipoint q, nmm_ipoint r, nmm_ipoint s, int64_t y) {
    // x = p.x + (y - p.y) (q.x - p.x) / (q.y - p.y), both over their common denominator.
    const nmm_int128 height_p = q.y - p.y, height_r = s.y - r.y;
    const nmm_int128 left = (nmm_int128)p.x * height_p + (nmm_int128)(y - p.y) * (q.x - p.x);
    const nmm_int128 right = (nmm_int128)r.x * height_r + (nmm_int128)(y - r.y) * (s.x - r.x);
    if (left * height_r != right * height_p) return left * height_r > right * height_p;
    // They meet on the ray: the order just above it counts, as for edges that start there.
    return (q.x - p.x) * height_r > (s.x - r.x) * height_p;
}

// Let the ray meet edge e.
static void meet_edge(left_ray *ray, int e) {
    const nmm_arrangement *a = ray->a;
    // Half-edge that runs down, so that its face is to the right of the edge.
    const int down =
        a->vertex[a->edge[2 * e]].y > a->vertex[a->edge[2 * e + 1]].y ? 2 * e : 2 * e + 1;
    const nmm_ipoint low = *end_of(a, down), high = *end_of(a, down ^ 1);
    const int64_t y = ray->from.y;
    if (low.y > y || high.y <= y) return;
    if (nmm_orientation(low, high, ray->from) >= 0) return;
    if (ray->half >= 0) {
        const nmm_ipoint r = *end_of(a, ray->half), s = *end_of(a, ray->half ^ 1);
        if (!crosses_later(low, high, r, s, y)) return;
    }
    ray->half = down;
}

// The half-edge next to the left of vertex v; walks the row of cells until something is met.
static int shoot(const nmm_arrangement *a, const nmm_grid *grid, int v) {
    left_ray ray = {.a = a, .from = a->vertex[v], .half = -1};
    const nmm_isegment here = {.a = ray.from, .b = ray.from};
    const int row = nmm_grid_rows(grid, &here).first;
    for (int column = nmm_grid_columns(grid, &here, row).end - 1; column >= 0; column--) {
        const int cell = nmm_grid_cell(grid, row, column);
        for (int i = grid->start[cell]; i < grid->start[cell + 1]; i++)
            meet_edge(&ray, grid->item[i]);
        if (ray.half < 0) continue;
        // An edge in this cell may be met further left, behind one that is not listed here.
        const int64_t left = grid->low.x + ((int64_t)column << grid->shift);
        const nmm_ipoint p = {left, ray.from.y};
        if (nmm_orientation(*end_of(a, ray.half), *end_of(a, ray.half ^ 1), p) >= 0) break;
    }
    return ray.half;
}

static nmm_status build_edge_grid(nmm_context *context, nmm_arrangement *a, nmm_grid *grid) {
    nmm_isegment *segment = NULL;
    TRY(nmm_arena_take(context, &a->arena, &segment, (size_t)a->n_edge, sizeof *segment));
    for (int e = 0; e < a->n_edge; e++) {
        segment[e] =
            (nmm_isegment){.a = a->vertex[a->edge[2 * e]], .b = a->vertex[a->edge[2 * e + 1]]};
    }
    return nmm_grid_build(context, &a->arena, grid, a->n_edge, segment);
}

// The cycles round connected parts, by their lowest vertex: at a vertex there is one at most.
static nmm_status sort_islands(nmm_context *context, nmm_arrangement *a, int n_cycle,
                               const cycle *cycles, int *n_island, int **island) {
    int *at_vertex = NULL;
    TRY(nmm_arena_take(context, &a->arena, &at_vertex, (size_t)a->n_vertex, sizeof(int)));
    TRY(nmm_arena_take(context, &a->arena, island, (size_t)n_cycle, sizeof(int)));
    for (int c = 0; c < n_cycle; c++) {
        if (!cycles[c].outer) at_vertex[cycles[c].lowest] = c + 1;
    }
    *n_island = 0;
    for (int v = 0; v < a->n_vertex; v++) {
        if (at_vertex[v] > 0) (*island)[(*n_island)++] = at_vertex[v] - 1;
    }
    return NMM_OK;
}

// Give each cycle its face. What a ray from an island meets has a vertex further left, so it
// belongs to a part that has been placed before.
static nmm_status assign_faces(nmm_context *context, nmm_arrangement *a, int n_cycle, cycle *cycles,
                               const int *number_of) {
    a->n_face = 1;
    for (int c = 0; c < n_cycle; c++) {
        if (cycles[c].outer) cycles[c].face = a->n_face++;
    }
    int n_island = 0, *island = NULL;
    TRY(sort_islands(context, a, n_cycle, cycles, &n_island, &island));
    if (n_island < 2) return NMM_OK;
    nmm_grid grid;
    TRY(build_edge_grid(context, a, &grid));
    for (int i = 1; i < n_island; i++) {
        cycle *c = &cycles[island[i]];
        const int half = shoot(a, &grid, c->lowest);
        c->face = half >= 0 ? cycles[number_of[half]].face : 0;
    }
    return NMM_OK;
}

// --- Bridges and faces

// Mark the edges that divide nothing and let next[] pass them by.
static void drop_bridges(nmm_arrangement *a, const int *number_of) {
    for (int e = 0; e < a->n_edge; e++)
        a->bridge[e] = number_of[2 * e] == number_of[2 * e + 1];
    for (int h = 0; h < 2 * a->n_edge; h++) {
        if (a->bridge[h / 2]) continue;
        while (a->bridge[a->next[h] / 2])
            a->next[h] = a->next[a->next[h] ^ 1];
    }
}

// The cycles of each face, the outer one first.
static nmm_status list_cycles(nmm_context *context, nmm_arrangement *a, int n_cycle,
                              const cycle *cycles) {
    TRY(nmm_arena_take(context, &a->arena, &a->face_start, (size_t)a->n_face + 1, sizeof(int)));
    TRY(nmm_arena_take(context, &a->arena, &a->cycle, (size_t)n_cycle, sizeof(int)));
    for (int c = 0; c < n_cycle; c++)
        a->face_start[a->face[cycles[c].half]] += 1;
    for (int f = 0, end = 0; f <= a->n_face; f++) {
        end += a->face_start[f];
        a->face_start[f] = end;
    }
    // Filled from the end: holes first, so that the outer cycles come to the front.
    for (int outer = 0; outer < 2; outer++) {
        for (int c = n_cycle - 1; c >= 0; c--) {
            if (cycles[c].outer == (outer == 1)) {
                a->cycle[--a->face_start[a->face[cycles[c].half]]] = cycles[c].half;
            }
        }
    }
    return NMM_OK;
}

nmm_status nmm_arrangement_subdivide(nmm_context *context, nmm_arrangement *a) {
    const size_t n_half = 2 * (size_t)a->n_edge;
    int n_cycle = 0, *number_of = NULL;
    cycle *cycles = NULL;
    TRY(nmm_arena_take(context, &a->arena, &a->bridge, (size_t)a->n_edge, sizeof(bool)));
    TRY(nmm_arena_take(context, &a->arena, &a->face, n_half, sizeof(int)));
    TRY(nmm_arena_take(context, &a->arena, &number_of, n_half, sizeof(int)));
    TRY(link_half_edges(context, a));

    // Faces of the whole graph.
    TRY(trace_cycles(context, a, number_of, &n_cycle, &cycles));
    TRY(assign_faces(context, a, n_cycle, cycles, number_of));
    for (size_t h = 0; h < n_half; h++)
        a->face[h] = cycles[number_of[h]].face;

    // The same faces without the edges that divide nothing.
    drop_bridges(a, number_of);
    TRY(trace_cycles(context, a, number_of, &n_cycle, &cycles));
    return list_cycles(context, a, n_cycle, cycles);
}
