// SPDX-License-Identifier: MIT
//
// Welding: what is nearer than `reach` becomes one. Vertices near each other form a cluster; a
// vertex near an edge joins the edge to its cluster. A cluster takes the place of its most rigid
// member (a corner of an outline before a crossing on the outline, this before the end of a joint,
// ...), where an edge counts with its point nearest to the vertex. So a joint that misses an
// outline by rounding is moved onto it, not the outline to the joint, and joints that should
// coincide do. The moved edges are snap rounded once more, so the result is as exact as without
// welding.

#include "arrangement.h"
#include "geometry.h"
#include "grid.h"

#include <math.h>

// A vertex near an edge.
typedef struct nmm_near {
    int vertex;
    double along; // 0 at the edge's lower vertex, 1 at the higher one
} near_vertex;

// Where a cluster goes: the least of its candidates by rigidity, then by place.
typedef struct candidate {
    int rigidity;
    nmm_ipoint place;
} candidate;

typedef struct welder {
    nmm_context *context;
    nmm_arrangement *a;
    const nmm_isegment *segment;
    double reach;
    nmm_grid grid; // of the vertices
    int *cluster;  // [n_vertex] sets
    candidate *at; // [n_vertex] of the roots
    int n_cluster_joined;
    int n_near;
    int *near_start; // [n_edge + 1]
    // Result: links between cluster places, and the edges that they are parts of.
    int n_link, link_capacity, owner_capacity;
    nmm_isegment *link;
    int *owner;
} welder;

static nmm_vec2 difference(nmm_ipoint from, nmm_ipoint to) {
    return (nmm_vec2){(double)(to.x - from.x), (double)(to.y - from.y)};
}

static bool candidate_before(candidate a, candidate b) {
    if (a.rigidity != b.rigidity) return a.rigidity < b.rigidity;
    return nmm_ipoint_compare(a.place, b.place) < 0;
}

static void offer_place(welder *w, int vertex, candidate offered) {
    candidate *at = &w->at[nmm_set_root(w->cluster, vertex)];
    if (candidate_before(offered, *at)) *at = offered;
}

// --- Clusters of vertices

static nmm_status build_vertex_grid(welder *w) {
    nmm_arrangement *a = w->a;
    nmm_isegment *hot = NULL;
    TRY(nmm_arena_take(w->context, &a->arena, &hot, (size_t)a->n_vertex, sizeof *hot));
    for (int v = 0; v < a->n_vertex; v++)
        hot[v] = (nmm_isegment){.a = a->vertex[v], .b = a->vertex[v]};
    TRY(nmm_grid_build(w->context, &a->arena, &w->grid, a->n_vertex, hot));
    w->grid.margin = (int64_t)w->reach + 2;
    return NMM_OK;
}

// Join vertex v with those of a cell that are near it.
static void join_cell(welder *w, int v, int cell) {
    for (int i = w->grid.start[cell]; i < w->grid.start[cell + 1]; i++) {
        const int other = w->grid.item[i];
        if (other >= v) continue;
        const nmm_vec2 d = difference(w->a->vertex[v], w->a->vertex[other]);
        if (nmm_vec2_dot(d, d) >= w->reach * w->reach) continue;
        nmm_set_join(w->cluster, v, other);
        w->n_cluster_joined += 1;
    }
}

static void join_vertices(welder *w) {
    for (int v = 0; v < w->a->n_vertex; v++) {
        const nmm_isegment here = {.a = w->a->vertex[v], .b = w->a->vertex[v]};
        const nmm_span rows = nmm_grid_rows(&w->grid, &here);
        for (int row = rows.first; row < rows.end; row++) {
            const nmm_span columns = nmm_grid_columns(&w->grid, &here, row);
            for (int column = columns.first; column < columns.end; column++)
                join_cell(w, v, nmm_grid_cell(&w->grid, row, column));
        }
    }
}

// The most rigid segment of an edge.
static int edge_rank(const welder *w, int e) {
    int least = INT32_MAX / 4;
    for (int s = w->a->source_start[e]; s < w->a->source_start[e + 1]; s++)
        least = nmm_min_int(least, w->segment[w->a->source[s] / 2].rank);
    return least;
}

// A vertex is more rigid as the end of a segment than as a place on it.
static void rate_vertices(welder *w) {
    const nmm_arrangement *a = w->a;
    for (int v = 0; v < a->n_vertex; v++)
        w->at[v] = (candidate){INT32_MAX, a->vertex[v]};
    for (int e = 0; e < a->n_edge; e++) {
        for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
            const nmm_isegment *segment = &w->segment[a->source[s] / 2];
            for (int end = 0; end < 2; end++) {
                const int v = a->edge[2 * e + end];
                const nmm_ipoint p = a->vertex[v];
                const bool is_end =
                    nmm_ipoint_equal(p, segment->a) || nmm_ipoint_equal(p, segment->b);
                offer_place(w, v, (candidate){2 * segment->rank + !is_end, p});
            }
        }
    }
}

// --- Vertices near edges

// Note the vertices of a cell that are near edge e, outside the clusters of its ends.
static nmm_status note_cell(welder *w, int e, int cell) {
    nmm_arrangement *a = w->a;
    const int u = a->edge[2 * e], v = a->edge[2 * e + 1];
    const nmm_vec2 along = difference(a->vertex[u], a->vertex[v]);
    const double length2 = nmm_vec2_dot(along, along);
    for (int i = w->grid.start[cell]; i < w->grid.start[cell + 1]; i++) {
        const int other = w->grid.item[i];
        const nmm_vec2 d = difference(a->vertex[u], a->vertex[other]);
        const double t = nmm_vec2_dot(along, d) / length2;
        if (!(t > 0 && t < 1)) continue;
        const double off = (double)nmm_icross(a->vertex[u], a->vertex[v], a->vertex[other]);
        if (off * off >= w->reach * w->reach * length2) continue;
        const int root = nmm_set_root(w->cluster, other);
        if (root == nmm_set_root(w->cluster, u) || root == nmm_set_root(w->cluster, v)) continue;
        TRY(nmm_grow(w->context, &a->near, &a->near_capacity, w->n_near + 1, sizeof(near_vertex)));
        a->near[w->n_near++] = (near_vertex){other, t};
        const nmm_ipoint foot = {a->vertex[u].x + llround(t * along.x),
                                 a->vertex[u].y + llround(t * along.y)};
        offer_place(w, other, (candidate){2 * edge_rank(w, e) + 1, foot});
    }
    return NMM_OK;
}

static bool near_before(const near_vertex *a, const near_vertex *b) {
    return a->along != b->along ? a->along < b->along : a->vertex < b->vertex;
}

// Sort the vertices near one edge, from `first` on, along it.
static void sort_near(near_vertex *list, int first, int end) {
    for (int i = first + 1; i < end; i++) {
        const near_vertex moved = list[i];
        int k = i;
        for (; k > first && near_before(&moved, &list[k - 1]); k--)
            list[k] = list[k - 1];
        list[k] = moved;
    }
}

static nmm_status note_edges(welder *w) {
    nmm_arrangement *a = w->a;
    for (int e = 0; e < a->n_edge; e++) {
        const nmm_isegment s = {.a = a->vertex[a->edge[2 * e]], .b = a->vertex[a->edge[2 * e + 1]]};
        const nmm_span rows = nmm_grid_rows(&w->grid, &s);
        w->near_start[e] = w->n_near;
        for (int row = rows.first; row < rows.end; row++) {
            const nmm_span columns = nmm_grid_columns(&w->grid, &s, row);
            for (int column = columns.first; column < columns.end; column++)
                TRY(note_cell(w, e, nmm_grid_cell(&w->grid, row, column)));
        }
        sort_near(a->near, w->near_start[e], w->n_near);
    }
    w->near_start[a->n_edge] = w->n_near;
    return NMM_OK;
}

// --- The moved edges

static nmm_status add_link(welder *w, int e, nmm_ipoint from, nmm_ipoint to) {
    if (nmm_ipoint_equal(from, to)) return NMM_OK;
    TRY(nmm_grow(w->context, &w->link, &w->link_capacity, w->n_link + 1, sizeof *w->link));
    TRY(nmm_grow(w->context, &w->owner, &w->owner_capacity, w->n_link + 1, sizeof *w->owner));
    w->link[w->n_link] = (nmm_isegment){.a = from, .b = to, .family = NMM_FAMILY_NONE};
    w->owner[w->n_link++] = e;
    return NMM_OK;
}

static nmm_ipoint cluster_place(welder *w, int vertex) {
    return w->at[nmm_set_root(w->cluster, vertex)].place;
}

static nmm_status link_edges(welder *w) {
    const nmm_arrangement *a = w->a;
    for (int e = 0; e < a->n_edge; e++) {
        nmm_ipoint from = cluster_place(w, a->edge[2 * e]);
        for (int k = w->near_start[e]; k < w->near_start[e + 1]; k++) {
            const nmm_ipoint to = cluster_place(w, a->near[k].vertex);
            TRY(add_link(w, e, from, to));
            from = to;
        }
        TRY(add_link(w, e, from, cluster_place(w, a->edge[2 * e + 1])));
    }
    return NMM_OK;
}

static void sort_sources(int *source, int n) {
    for (int i = 1; i < n; i++) {
        const int moved = source[i];
        int k = i;
        for (; k > 0 && source[k - 1] > moved; k--)
            source[k] = source[k - 1];
        source[k] = moved;
    }
}

// Sources name links: let them name the segments again that the owners of the links came from.
static nmm_status name_segments(welder *w, const int *old_start, const int *old_source) {
    nmm_arrangement *a = w->a;
    int *start = NULL, *source = NULL;
    size_t n = 0;
    for (int s = 0; s < a->source_start[a->n_edge]; s++) {
        const int owner = w->owner[a->source[s] / 2];
        n += (size_t)(old_start[owner + 1] - old_start[owner]);
    }
    if (n > INT32_MAX) return nmm_fail(w->context, NMM_ERROR_INPUT, "too many segments");
    TRY(nmm_arena_take(w->context, &a->arena, &start, (size_t)a->n_edge + 1, sizeof(int)));
    TRY(nmm_arena_take(w->context, &a->arena, &source, n, sizeof(int)));
    int end = 0;
    for (int e = 0; e < a->n_edge; e++) {
        start[e] = end;
        for (int s = a->source_start[e]; s < a->source_start[e + 1]; s++) {
            const int owner = w->owner[a->source[s] / 2], turned = a->source[s] % 2;
            for (int k = old_start[owner]; k < old_start[owner + 1]; k++)
                source[end++] = old_source[k] ^ turned;
        }
        sort_sources(source + start[e], end - start[e]);
    }
    start[a->n_edge] = end;
    a->source_start = start;
    a->source = source;
    return NMM_OK;
}

// Keep the sources of the edges, arrange the links, and give them their sources back.
static nmm_status arrange_links(welder *w, nmm_arena *kept) {
    nmm_arrangement *a = w->a;
    const int n_edge = a->n_edge, n_source = a->source_start[n_edge], crossed = a->crossed;
    int *start = NULL, *source = NULL;
    TRY(nmm_arena_take(w->context, kept, &start, (size_t)n_edge + 1, sizeof(int)));
    TRY(nmm_arena_take(w->context, kept, &source, (size_t)n_source, sizeof(int)));
    for (int e = 0; e <= n_edge; e++)
        start[e] = a->source_start[e];
    for (int s = 0; s < n_source; s++)
        source[s] = a->source[s];
    TRY(nmm_arrangement_snap(w->context, a, w->n_link, w->link));
    a->crossed = crossed;
    return name_segments(w, start, source);
}

static nmm_status weld(welder *w, nmm_arena *kept) {
    nmm_arrangement *a = w->a;
    const size_t n_vertex = (size_t)a->n_vertex, n_edge = (size_t)a->n_edge;
    TRY(build_vertex_grid(w));
    TRY(nmm_arena_take(w->context, &a->arena, &w->cluster, n_vertex, sizeof(int)));
    TRY(nmm_arena_take(w->context, &a->arena, &w->at, n_vertex, sizeof(candidate)));
    TRY(nmm_arena_take(w->context, &a->arena, &w->near_start, n_edge + 1, sizeof(int)));
    for (int v = 0; v < a->n_vertex; v++)
        w->cluster[v] = v;
    join_vertices(w);
    rate_vertices(w);
    TRY(note_edges(w));
    // Most scenes end here: nothing is near anything else.
    if (w->n_cluster_joined == 0 && w->n_near == 0) return NMM_OK;
    TRY(link_edges(w));
    return arrange_links(w, kept);
}

nmm_status nmm_arrangement_weld(nmm_context *context, nmm_arrangement *arrangement,
                                const nmm_isegment *segment, int64_t reach) {
    if (reach <= 0) return NMM_OK;
    welder w = {.context = context, .a = arrangement, .segment = segment, .reach = (double)reach};
    nmm_arena kept = {0};
    const nmm_status status = weld(&w, &kept);
    nmm_release(context, &w.link);
    nmm_release(context, &w.owner);
    nmm_arena_destroy(context, &kept);
    return status;
}
