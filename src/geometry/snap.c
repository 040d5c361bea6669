// SPDX-License-Identifier: MIT
//
// Iterated snap rounding (Hobby 1999; Halperin and Packer 2002). Hot pixels are the ends of the
// segments and their rounded crossings. Each segment becomes the chain of the hot pixels that it
// meets; the links of a chain are routed again until they meet no other hot pixel. Then no edge
// comes nearer than half a unit to a vertex that is not its end, no two edges cross, and each edge
// is within a few units of its segment.

#include "arrangement.h"
#include "grid.h"

#include <string.h>

// A link of a chain, from its lower to its higher vertex.
struct nmm_fragment {
    int low, high;
    int source; // 2 * segment + reversed
};

typedef struct nmm_fragment fragment;

// --- Hot pixels

static bool boxes_apart(int64_t a, int64_t b, int64_t c, int64_t d) {
    return (a < c && a < d && b < c && b < d) || (a > c && a > d && b > c && b > d);
}

static nmm_status test_pair(nmm_context *context, nmm_arrangement *arrangement, nmm_isegment s,
                            nmm_isegment t) {
    const bool same = s.family == t.family;
    if (same && s.family == NMM_FAMILY_MESH) return NMM_OK;
    if (boxes_apart(s.a.x, s.b.x, t.a.x, t.b.x)) return NMM_OK;
    if (boxes_apart(s.a.y, s.b.y, t.a.y, t.b.y)) return NMM_OK;
    if (!nmm_isegment_cross(s, t)) return NMM_OK;
    if (same && s.family >= 0 && (arrangement->crossed < 0 || s.family < arrangement->crossed)) {
        arrangement->crossed = s.family;
    }
    TRY(nmm_grow(context, &arrangement->crossing, &arrangement->crossing_capacity,
                 arrangement->n_crossing + 1, sizeof(nmm_ipoint)));
    arrangement->crossing[arrangement->n_crossing++] = nmm_isegment_crossing(s, t);
    return NMM_OK;
}

// Rounded crossings of all pairs that share a cell. A pair may be found in several cells.
static nmm_status find_crossings(nmm_context *context, nmm_arrangement *arrangement, int n,
                                 const nmm_isegment *segment) {
    nmm_grid grid;
    TRY(nmm_grid_build(context, &arrangement->arena, &grid, n, segment));
    arrangement->n_crossing = 0;
    for (int cell = 0; cell < grid.nx * grid.ny; cell++) {
        for (int i = grid.start[cell]; i < grid.start[cell + 1]; i++) {
            const nmm_isegment s = segment[grid.item[i]];
            for (int j = grid.start[cell]; j < i; j++)
                TRY(test_pair(context, arrangement, s, segment[grid.item[j]]));
        }
    }
    return NMM_OK;
}

// All ends and crossings, sorted, once each.
static nmm_status collect_vertices(nmm_context *context, nmm_arrangement *arrangement, int n,
                                   const nmm_isegment *segment) {
    const size_t most = 2 * (size_t)n + (size_t)arrangement->n_crossing;
    if (most > INT32_MAX / 2) return nmm_fail(context, NMM_ERROR_INPUT, "too many segments");
    nmm_ipoint *point = NULL, *spare = NULL;
    TRY(nmm_arena_take(context, &arrangement->arena, &point, most, sizeof *point));
    TRY(nmm_arena_take(context, &arrangement->arena, &spare, most, sizeof *spare));
    int n_point = 0;
    for (int i = 0; i < n; i++) {
        if (nmm_ipoint_equal(segment[i].a, segment[i].b)) continue;
        point[n_point++] = segment[i].a;
        point[n_point++] = segment[i].b;
    }
    for (int i = 0; i < arrangement->n_crossing; i++)
        point[n_point++] = arrangement->crossing[i];
    nmm_ipoint *sorted = nmm_ipoint_sort(n_point, point, spare);
    int n_vertex = 0;
    for (int i = 0; i < n_point; i++) {
        const bool again = n_vertex > 0 && nmm_ipoint_equal(sorted[n_vertex - 1], sorted[i]);
        if (!again) sorted[n_vertex++] = sorted[i];
    }
    arrangement->vertex = sorted;
    arrangement->n_vertex = n_vertex;
    return NMM_OK;
}

// --- Chains

// Index of a point that is a vertex.
static int find_vertex(const nmm_arrangement *arrangement, nmm_ipoint p) {
    int low = 0, high = arrangement->n_vertex - 1;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (nmm_ipoint_compare(arrangement->vertex[middle], p) < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

// Place of p along a -> b.
static nmm_int128 place_along(nmm_ipoint a, nmm_ipoint b, nmm_ipoint p) {
    return (nmm_int128)(b.x - a.x) * (p.x - a.x) + (nmm_int128)(b.y - a.y) * (p.y - a.y);
}

// Put vertex v into the list of hits, in the order along a -> b. Cells are visited along the
// segment, so v belongs to the end, or near it.
static nmm_status add_hit(nmm_context *context, nmm_arrangement *arrangement, nmm_ipoint a,
                          nmm_ipoint b, int v) {
    TRY(nmm_grow(context, &arrangement->hit, &arrangement->hit_capacity, arrangement->n_hit + 1,
                 sizeof(int)));
    int *hit = arrangement->hit;
    const nmm_int128 place = place_along(a, b, arrangement->vertex[v]);
    int k = arrangement->n_hit++;
    for (; k > 0 && place_along(a, b, arrangement->vertex[hit[k - 1]]) > place; k--)
        hit[k] = hit[k - 1];
    hit[k] = v;
    return NMM_OK;
}

// Vertices of one cell whose pixels the link from -> to meets.
static nmm_status search_cell(nmm_context *context, nmm_arrangement *arrangement,
                              const nmm_grid *grid, int cell, const int link[2]) {
    const nmm_ipoint a = arrangement->vertex[link[0]], b = arrangement->vertex[link[1]];
    for (int i = grid->start[cell]; i < grid->start[cell + 1]; i++) {
        const int v = grid->item[i];
        if (v == link[0] || v == link[1]) continue;
        if (!nmm_isegment_meets_pixel(a, b, arrangement->vertex[v])) continue;
        TRY(add_hit(context, arrangement, a, b, v));
    }
    return NMM_OK;
}

// The vertices strictly inside a link, in order, into arrangement->hit.
static nmm_status search_link(nmm_context *context, nmm_arrangement *arrangement,
                              const nmm_grid *grid, const int link[2]) {
    const nmm_isegment s = {.a = arrangement->vertex[link[0]], .b = arrangement->vertex[link[1]]};
    const bool down = s.b.y < s.a.y, left = s.b.x < s.a.x;
    const nmm_span rows = nmm_grid_rows(grid, &s);
    arrangement->n_hit = 0;
    for (int r = rows.first; r < rows.end; r++) {
        const int row = down ? rows.end - 1 - (r - rows.first) : r;
        const nmm_span columns = nmm_grid_columns(grid, &s, row);
        for (int c = columns.first; c < columns.end; c++) {
            const int column = left ? columns.end - 1 - (c - columns.first) : c;
            const int cell = nmm_grid_cell(grid, row, column);
            TRY(search_cell(context, arrangement, grid, cell, link));
        }
    }
    return NMM_OK;
}

// Put the hits behind entry k of the chain.
static nmm_status insert_hits(nmm_context *context, nmm_arrangement *arrangement, int k) {
    const int n_hit = arrangement->n_hit, n_chain = arrangement->n_chain;
    TRY(nmm_grow(context, &arrangement->chain, &arrangement->chain_capacity, n_chain + n_hit,
                 sizeof(int)));
    int *after = arrangement->chain + k + 1;
    memmove(after + n_hit, after, (size_t)(n_chain - k - 1) * sizeof(int));
    memcpy(after, arrangement->hit, (size_t)n_hit * sizeof(int));
    arrangement->n_chain = n_chain + n_hit;
    return NMM_OK;
}

// The chain of vertices of one segment. A hit lies inside the box of its link and is not one of its
// ends, so links only get shorter and the loop ends.
static nmm_status route_segment(nmm_context *context, nmm_arrangement *arrangement,
                                const nmm_grid *grid, const nmm_isegment *segment) {
    TRY(nmm_grow(context, &arrangement->chain, &arrangement->chain_capacity, 2, sizeof(int)));
    arrangement->chain[0] = find_vertex(arrangement, segment->a);
    arrangement->chain[1] = find_vertex(arrangement, segment->b);
    arrangement->n_chain = 2;
    for (int k = 0; k + 1 < arrangement->n_chain;) {
        TRY(search_link(context, arrangement, grid, arrangement->chain + k));
        if (arrangement->n_hit == 0) k += 1;
        if (arrangement->n_hit > 0) TRY(insert_hits(context, arrangement, k));
    }
    return NMM_OK;
}

static nmm_status add_fragments(nmm_context *context, nmm_arrangement *arrangement, int segment) {
    const int n = arrangement->n_fragment + arrangement->n_chain - 1;
    TRY(nmm_grow(context, &arrangement->fragment, &arrangement->fragment_capacity, n,
                 sizeof(fragment)));
    for (int k = 0; k + 1 < arrangement->n_chain; k++) {
        const int u = arrangement->chain[k], v = arrangement->chain[k + 1];
        arrangement->fragment[arrangement->n_fragment++] = (fragment){
            nmm_min_int(u, v),
            nmm_max_int(u, v),
            2 * segment + (u > v),
        };
    }
    return NMM_OK;
}

static nmm_status route_all(nmm_context *context, nmm_arrangement *arrangement, int n,
                            const nmm_isegment *segment) {
    const int n_vertex = arrangement->n_vertex;
    nmm_isegment *hot = NULL;
    nmm_grid grid;
    TRY(nmm_arena_take(context, &arrangement->arena, &hot, (size_t)n_vertex, sizeof *hot));
    for (int v = 0; v < n_vertex; v++)
        hot[v] = (nmm_isegment){.a = arrangement->vertex[v], .b = arrangement->vertex[v]};
    TRY(nmm_grid_build(context, &arrangement->arena, &grid, n_vertex, hot));
    arrangement->n_fragment = 0;
    for (int i = 0; i < n; i++) {
        if (nmm_ipoint_equal(segment[i].a, segment[i].b)) continue;
        TRY(route_segment(context, arrangement, &grid, &segment[i]));
        TRY(add_fragments(context, arrangement, i));
    }
    return NMM_OK;
}

// --- Edges

static bool fragment_before(const fragment *a, const fragment *b) {
    return a->high != b->high ? a->high < b->high : a->source < b->source;
}

// Fragments by (low, high, source): counted by their lower vertex, then each vertex for itself.
static nmm_status sort_fragments(nmm_context *context, nmm_arrangement *arrangement,
                                 fragment **sorted) {
    const int n = arrangement->n_fragment, n_vertex = arrangement->n_vertex;
    int *start = NULL;
    TRY(nmm_arena_take(context, &arrangement->arena, &start, (size_t)n_vertex + 1, sizeof(int)));
    TRY(nmm_arena_take(context, &arrangement->arena, sorted, (size_t)n, sizeof(fragment)));
    for (int i = 0; i < n; i++)
        start[arrangement->fragment[i].low] += 1;
    for (int v = 0, end = 0; v <= n_vertex; v++) {
        end += start[v];
        start[v] = end;
    }
    for (int i = n - 1; i >= 0; i--)
        (*sorted)[--start[arrangement->fragment[i].low]] = arrangement->fragment[i];
    for (int v = 0; v < n_vertex; v++) {
        for (int i = start[v] + 1; i < start[v + 1]; i++) {
            const fragment moved = (*sorted)[i];
            int k = i;
            for (; k > start[v] && fragment_before(&moved, &(*sorted)[k - 1]); k--)
                (*sorted)[k] = (*sorted)[k - 1];
            (*sorted)[k] = moved;
        }
    }
    return NMM_OK;
}

// Fragments with the same ends become one edge that knows its sources.
static nmm_status merge_fragments(nmm_context *context, nmm_arrangement *arrangement) {
    const size_t n = (size_t)arrangement->n_fragment;
    nmm_arena *arena = &arrangement->arena;
    fragment *sorted = NULL;
    TRY(sort_fragments(context, arrangement, &sorted));
    TRY(nmm_arena_take(context, arena, &arrangement->edge, 2 * n, sizeof(int)));
    TRY(nmm_arena_take(context, arena, &arrangement->source_start, n + 1, sizeof(int)));
    TRY(nmm_arena_take(context, arena, &arrangement->source, n, sizeof(int)));
    int n_edge = 0;
    for (int i = 0; i < arrangement->n_fragment; i++) {
        const bool again =
            i > 0 && sorted[i].low == sorted[i - 1].low && sorted[i].high == sorted[i - 1].high;
        if (!again) {
            arrangement->edge[2 * n_edge] = sorted[i].low;
            arrangement->edge[2 * n_edge + 1] = sorted[i].high;
            arrangement->source_start[n_edge++] = i;
        }
        arrangement->source[i] = sorted[i].source;
    }
    arrangement->source_start[n_edge] = arrangement->n_fragment;
    arrangement->n_edge = n_edge;
    return NMM_OK;
}

nmm_status nmm_arrangement_snap(nmm_context *context, nmm_arrangement *arrangement, int n,
                                const nmm_isegment *segment) {
    nmm_arena_reset(context, &arrangement->arena);
    arrangement->crossed = -1;
    arrangement->n_vertex = arrangement->n_edge = 0;
    TRY(find_crossings(context, arrangement, n, segment));
    TRY(collect_vertices(context, arrangement, n, segment));
    TRY(route_all(context, arrangement, n, segment));
    return merge_fragments(context, arrangement);
}

nmm_status nmm_arrangement_build(nmm_context *context, nmm_arrangement *arrangement, int n,
                                 const nmm_isegment *segment, int64_t reach) {
    TRY(nmm_arrangement_snap(context, arrangement, n, segment));
    TRY(nmm_arrangement_weld(context, arrangement, segment, reach));
    return nmm_arrangement_subdivide(context, arrangement);
}

void nmm_arrangement_destroy(nmm_context *context, nmm_arrangement *arrangement) {
    nmm_release(context, &arrangement->crossing);
    nmm_release(context, &arrangement->chain);
    nmm_release(context, &arrangement->hit);
    nmm_release(context, &arrangement->fragment);
    nmm_release(context, &arrangement->near);
    nmm_arena_destroy(context, &arrangement->arena);
    *arrangement = (nmm_arrangement){0};
}
