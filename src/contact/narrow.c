// SPDX-License-Identifier: MIT
//
// From near edges to raw contacts, all of them: pairs in chunks, counted first and then stored;
// the results by vertex; lengths of one (vertex, edge) added up; of several sides of a corner one.

#include "search.h"

#include <math.h>
#include <string.h>

// Boxes of the edges as they are now, near enough?
static bool still_near(const nmm_narrowing *now, nmm_edge_pair pair) {
    const nmm_edge_line *a = &now->line[pair.a], *b = &now->line[pair.b];
    return nmm_min(a->p.x, a->q.x) - nmm_max(b->p.x, b->q.x) <= now->near &&
           nmm_min(b->p.x, b->q.x) - nmm_max(a->p.x, a->q.x) <= now->near &&
           nmm_min(a->p.y, a->q.y) - nmm_max(b->p.y, b->q.y) <= now->near &&
           nmm_min(b->p.y, b->q.y) - nmm_max(a->p.y, a->q.y) <= now->near;
}

// Raw contacts of chunk c into its room; those beyond it are only counted.
static void narrow_chunk(nmm_contact_search *search, const nmm_narrowing *all, int c) {
    nmm_narrowing now = *all;
    now.out = search->raw + search->raw_first[c];
    now.room = search->raw_first[c + 1] - search->raw_first[c];
    const int end = nmm_min_int((c + 1) * NMM_PAIR_CHUNK, search->n_pair);
    for (int k = c * NMM_PAIR_CHUNK; k < end; k++) {
        const nmm_edge_pair pair = search->pair[k];
        if (!pair.rests && still_near(&now, pair)) nmm_touch(&now, pair);
    }
    search->raw_count[c] = now.n;
}

// Most pairs of a corner bring nothing, step after step: which of them rest is asked again when a
// vertex has moved on, or contacts are listed from further away.
static void let_rest(nmm_context *context, nmm_contact_search *search, const nmm_narrowing *now) {
    const nmm_model *model = now->model;
    const double way = NMM_REST * model->size;
    if (search->rests_for >= now->near &&
        nmm_largest_motion(model, now->state, search->rests_at) <= way) {
        return;
    }
    search->rests_for = now->near + way;
    for (int v = 0; v < model->n_vertex; v++) {
        const nmm_vec2 p = now->line[v].p;
        search->rests_at[2 * (long)v] = p.x;
        search->rests_at[2 * (long)v + 1] = p.y;
    }
    const int n = search->n_pair, n_thread = context->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int k = 0; k < n; k++)
        search->pair[k].rests = nmm_touch_rests(now, search->pair[k], search->rests_for, way);
}

// Has every chunk had room? Sums the counts.
static bool had_room(const nmm_contact_search *search, int n_chunk, int *n_raw) {
    bool fits = true;
    *n_raw = 0;
    for (int c = 0; c < n_chunk; c++) {
        const int room = search->raw_first[c + 1] - search->raw_first[c];
        fits = fits && search->raw_count[c] <= room;
        *n_raw += search->raw_count[c];
    }
    return fits;
}

// Room for what was counted, and a little more.
static nmm_status make_room(nmm_context *context, nmm_contact_search *search, int n_chunk) {
    int *first = search->raw_first;
    for (int c = 0; c < n_chunk; c++)
        first[c + 1] = first[c] + search->raw_count[c] + search->raw_count[c] / 8 + 4;
    return nmm_grow(context, &search->raw, &search->raw_capacity, first[n_chunk], sizeof(nmm_raw));
}

// Each chunk writes where it had room in the last step; new pairs, or more contacts than expected,
// ask for a second time.
static nmm_status narrow_all(nmm_context *context, nmm_contact_search *search,
                             const nmm_narrowing *all, int *n_raw) {
    const int n_thread = context->n_thread;
    const int n_chunk = (search->n_pair + NMM_PAIR_CHUNK - 1) / NMM_PAIR_CHUNK;
    int capacity = search->chunk_capacity;
    TRY(nmm_grow(context, &search->raw_count, &capacity, n_chunk + 1, sizeof(int)));
    TRY(nmm_grow(context, &search->raw_first, &search->chunk_capacity, n_chunk + 1, sizeof(int)));
    if (search->n_chunk == 0) memset(search->raw_first, 0, ((size_t)n_chunk + 1) * sizeof(int));
    search->n_chunk = n_chunk;
    for (;;) {
#pragma omp parallel for num_threads(n_thread) schedule(dynamic) if (n_thread > 1 && n_chunk > 4)
        for (int c = 0; c < n_chunk; c++)
            narrow_chunk(search, all, c);
        if (had_room(search, n_chunk, n_raw)) return NMM_OK;
        TRY(make_room(context, search, n_chunk));
    }
}

// --- Of one vertex

// By edge, then by length: sums of lengths do not depend on the order of the pairs.
static bool comes_after(const nmm_raw *a, const nmm_raw *b) {
    return a->edge != b->edge ? a->edge > b->edge : a->length > b->length;
}

static void move_raw(nmm_raw *raw, int from, int to) {
    if (from != to) raw[to] = raw[from];
}

// Insertion sort, then equal edges are added up; returns how many are left.
static int merge_vertex(nmm_raw *raw, int n) {
    for (int i = 1; i < n; i++) {
        if (!comes_after(&raw[i - 1], &raw[i])) continue;
        const nmm_raw moved = raw[i];
        int k = i;
        for (; k > 0 && comes_after(&raw[k - 1], &moved); k--)
            raw[k] = raw[k - 1];
        raw[k] = moved;
    }
    int kept = 0;
    for (int i = 0; i < n; i++) {
        if (kept > 0 && raw[kept - 1].edge == raw[i].edge) {
            raw[kept - 1].length += raw[i].length;
            raw[kept - 1].shared += raw[i].shared;
            raw[kept - 1].corner_length += raw[i].corner_length;
            if (raw[kept - 1].corner) {
                raw[kept - 1].facing = raw[i].facing;
                raw[kept - 1].sides = raw[i].sides;
            }
            raw[kept - 1].corner = raw[kept - 1].corner && raw[i].corner;
            raw[kept - 1].beyond = nmm_min(raw[kept - 1].beyond, raw[i].beyond);
        } else {
            move_raw(raw, i, kept++);
        }
    }
    return kept;
}

static bool was_closed(const nmm_last_list *last, const nmm_raw *raw) {
    const nmm_contact *old = nmm_contact_lookup(last, raw->vertex, raw->edge);
    return old != NULL && old->mode != NMM_CONTACT_OPEN;
}

// Two edges of one block in line or round a convex corner: a vertex meets one of them. In a notch,
// and on steps, it may meet both.
static bool exclude_each_other(const nmm_narrowing *now, int a, int b) {
    if (now->model->vertex_block[a] != now->model->vertex_block[b]) return false;
    const nmm_edge_line *e = &now->line[a], *f = &now->line[b];
    const nmm_vec2 way = nmm_vec2_sub(nmm_vec2_mix(f->p, f->q, 0.5), nmm_vec2_mix(e->p, e->q, 0.5));
    const double in_front = NMM_SLANTED * sqrt(nmm_vec2_dot(way, way));
    return nmm_vec2_dot(e->n, way) <= in_front && -nmm_vec2_dot(f->n, way) <= in_front;
}

// How much the edge faces the corner, in steps that rounding does not reach.
static double facing_of(const nmm_narrowing *now, const nmm_raw *raw) {
    const nmm_vec2 inward = nmm_vertex_inward(now, raw->vertex);
    return floor(nmm_vec2_dot(now->line[raw->edge].n, inward) / NMM_EQUAL + 0.5);
}

// Of two edges in line that end before the vertex: is the other one nearer? By more than rounding.
static bool is_nearer_in_line(const nmm_narrowing *now, const nmm_raw *other, const nmm_raw *own) {
    const nmm_vec2 t = now->line[own->edge].t, u = now->line[other->edge].t;
    const bool in_line = nmm_vec2_dot(t, u) > 0 && fabs(nmm_vec2_cross(t, u)) <= NMM_SLANTED;
    return in_line && own->beyond - other->beyond > NMM_EXACT * now->model->size;
}

// Which of two that exclude each other: the one in front of its edge, of two in line the nearer
// one, the one that was pressed, the one with the smaller overlap; of equal ones that of a whole
// side, the one that faces the corner more.
static bool is_better(const nmm_narrowing *now, const nmm_raw *other, const nmm_raw *own) {
    const nmm_last_list *last = &now->last;
    const double unit = NMM_EXACT * now->model->size;
    const double own_gap = floor(own->gap / unit + 0.5), other_gap = floor(other->gap / unit + 0.5);
    const bool own_inside = own->beyond == 0, other_inside = other->beyond == 0;
    if (own_inside != other_inside) return other_inside;
    if (is_nearer_in_line(now, other, own)) return true;
    if (is_nearer_in_line(now, own, other)) return false;
    const bool own_closed = was_closed(last, own), other_closed = was_closed(last, other);
    if (own_closed != other_closed) return other_closed;
    if (own_gap != other_gap) return other_gap > own_gap;
    if (own->corner != other->corner) return own->corner;
    const double own_facing = facing_of(now, own), other_facing = facing_of(now, other);
    return own_facing != other_facing ? other_facing > own_facing : other->edge < own->edge;
}

// Does raw contact k take the place of the corner in raw contact i? Where i is of a side as well,
// not in line with it: there the mesh cuts one side.
static bool takes_corner(const nmm_narrowing *now, const nmm_raw *raw, int k, int i) {
    if (k == i || !is_better(now, &raw[k], &raw[i])) return false;
    const nmm_vec2 t = now->line[raw[i].edge].t, u = now->line[raw[k].edge].t;
    if (!raw[i].corner && fabs(nmm_vec2_cross(t, u)) <= NMM_PARALLEL) return false;
    return exclude_each_other(now, raw[i].edge, raw[k].edge);
}

static int choose_sides(const nmm_narrowing *now, nmm_raw *raw, int n) {
    for (int i = 0; i < n; i++) {
        raw[i].dropped = false;
        if (raw[i].corner_length == 0) continue;
        for (int k = 0; k < n && !raw[i].dropped; k++)
            raw[i].dropped = takes_corner(now, raw, k, i);
    }
    int kept = 0;
    for (int i = 0; i < n; i++) {
        if (raw[i].dropped && raw[i].corner) continue;
        if (raw[i].dropped) raw[i].corner_length = 0;
        move_raw(raw, i, kept++);
    }
    return kept;
}

// --- All

// By vertex, into search->sorted; search->vertex_start[v] becomes the end of v.
static nmm_status sort_raw(nmm_context *context, nmm_contact_search *search, int n_vertex,
                           int n_raw) {
    int *start = search->vertex_start;
    TRY(nmm_grow(context, &search->sorted, &search->sorted_capacity, n_raw, sizeof(nmm_raw)));
    memset(start, 0, ((size_t)n_vertex + 1) * sizeof *start);
    for (int c = 0; c < search->n_chunk; c++) {
        const nmm_raw *raw = search->raw + search->raw_first[c];
        for (int k = 0; k < search->raw_count[c]; k++)
            start[raw[k].vertex] += 1;
    }
    int sum = 0;
    for (int v = 0; v <= n_vertex; v++) {
        const int count = start[v];
        start[v] = sum;
        sum += count;
    }
    for (int c = 0; c < search->n_chunk; c++) {
        const nmm_raw *raw = search->raw + search->raw_first[c];
        for (int k = 0; k < search->raw_count[c]; k++)
            search->sorted[start[raw[k].vertex]++] = raw[k];
    }
    return NMM_OK;
}

// --- Sides that share little

// The springs between two sides that face each other count for at least the length of a corner:
// blocks that only just meet would else overlap deeply, and gain force without moving when they
// slide further together. Strength goes by the true length.
static void lengthen_short_sides(const nmm_contact_search *search, const nmm_model *model,
                                 int n_raw) {
    double *shared = search->shared;
    for (int i = 0; i < search->n_sides; i++)
        shared[i] = 0;
    for (int k = 0; k < n_raw; k++) {
        const nmm_raw *raw = &search->sorted[k];
        if (raw->sides >= 0) shared[raw->sides] += raw->shared;
    }
    const double least = NMM_CORNER * model->size;
    for (int k = 0; k < n_raw; k++) {
        nmm_raw *raw = &search->sorted[k];
        raw->spring_length = raw->length + raw->corner_length;
        if (raw->sides >= 0 && shared[raw->sides] < least)
            raw->spring_length += (least / shared[raw->sides] - 1) * raw->length;
        raw->length += raw->corner_length;
    }
}

nmm_status nmm_narrow(nmm_context *context, nmm_contact_search *search, const nmm_narrowing *now,
                      int *n_raw) {
    const int n_vertex = now->model->n_vertex;
    let_rest(context, search, now);
    TRY(narrow_all(context, search, now, n_raw));
    TRY(sort_raw(context, search, n_vertex, *n_raw));
    // Merge within each vertex and close the ranks.
    nmm_raw *sorted = search->sorted;
    int kept = 0, begin = 0;
    for (int v = 0; v < n_vertex; v++) {
        const int end = search->vertex_start[v];
        int count = merge_vertex(sorted + begin, end - begin);
        count = choose_sides(now, sorted + begin, count);
        for (int k = 0; k < count; k++)
            move_raw(sorted, begin + k, kept + k);
        kept += count;
        begin = end;
    }
    *n_raw = kept;
    lengthen_short_sides(search, now->model, kept);
    return NMM_OK;
}
