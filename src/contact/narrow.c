// SPDX-License-Identifier: MIT
//
// From near edges to raw contacts.
//
//   edge-edge: two edges that face each other share an interval; each of its ends is a vertex of
//   one on the other, and stands for half of it. Summed over pairs this is the trapezoid rule on
//   the union of both sides' vertices: a uniform pressure passes exactly, eq. (5.2).
//
//      a1 <-------------- a0            ends of the shared interval: a0 on the lower edge,
//             b0 ------------------> b1                              b0 on the upper edge
//
//   corner: a convex corner in front of an edge that is not parallel; of several edges of one block
//   that it overlaps, the one with the smaller overlap.

#include "search.h"

#include <math.h>
#include <string.h>

nmm_edge_line nmm_edge_line_of(const nmm_model *model, const nmm_state *state, int e) {
    const nmm_vec2 p = nmm_vertex_place(model, state, e);
    const nmm_vec2 q = nmm_vertex_place(model, state, model->vertex_next[e]);
    const nmm_vec2 along = nmm_vec2_sub(q, p);
    const double length = sqrt(nmm_vec2_dot(along, along));
    const nmm_vec2 t = length > 0 ? nmm_vec2_scale(1 / length, along) : (nmm_vec2){1, 0};
    return (nmm_edge_line){.p = p, .q = q, .t = t, .n = {t.y, -t.x}, .length = length};
}

const nmm_contact *nmm_contact_lookup(const nmm_state *state, int vertex, int edge) {
    int low = 0, high = state->n_contact;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        const nmm_contact *c = &state->contact[middle];
        if (c->vertex < vertex || (c->vertex == vertex && c->edge < edge))
            low = middle + 1;
        else
            high = middle;
    }
    if (low >= state->n_contact) return NULL;
    const nmm_contact *c = &state->contact[low];
    return c->vertex == vertex && c->edge == edge ? c : NULL;
}

// --- One pair
// --------------------------------------------------------------------------------------------

typedef struct narrowing {
    const nmm_contact_search *search;
    const nmm_model *model;
    const nmm_state *state;
    double reach;
    nmm_raw *out;
    int n;
} narrowing;

// 1: edge-edge, 0: corner, between: both in part.
static double share_parallel(const nmm_edge_line *f, const nmm_edge_line *e) {
    if (nmm_vec2_dot(f->t, e->t) >= 0) return 0;
    const double sine = fabs(nmm_vec2_cross(f->t, e->t));
    return nmm_min(1, nmm_max(0, (NMM_SLANTED - sine) / (NMM_SLANTED - NMM_PARALLEL)));
}

// Near enough to be listed; deep overlaps only with history.
static bool listed(const narrowing *now, int vertex, int edge, double gap) {
    if (gap > now->reach) return false;
    const bool same_block = now->model->vertex_block[vertex] == now->model->vertex_block[edge];
    const double allowed = same_block ? 1e-6 * now->model->size : now->reach;
    if (gap >= -allowed) return true;
    if (gap < -NMM_DEEPEST * now->model->size) return false;
    const nmm_contact *old = nmm_contact_lookup(now->state, vertex, edge);
    return old != NULL && old->mode != NMM_CONTACT_OPEN;
}

static void add_raw(narrowing *now, int vertex, int edge, double length, bool corner) {
    const nmm_edge_line e = nmm_edge_line_of(now->model, now->state, edge);
    const nmm_vec2 p = nmm_vertex_place(now->model, now->state, vertex);
    const double gap = nmm_vec2_dot(e.n, nmm_vec2_sub(p, e.p));
    if (!listed(now, vertex, edge, gap)) return;
    now->out[now->n++] = (nmm_raw){vertex, edge, length, gap, corner};
}

// One end of the shared interval: vertex u of edge f lies `ahead` of vertex w of edge e, seen from
// inside the interval: then w is the end, on f; behind: u is, on e. Where they nearly coincide the
// one that was listed stays, so that elastic slip does not change the list in every step.
static void add_end(narrowing *now, int u, int e, int w, int f, double ahead, double length) {
    const double size = now->model->size;
    bool take_u = fabs(ahead) <= NMM_EXACT * size ? u < w : ahead < 0;
    if (fabs(ahead) <= NMM_SAME * size) {
        const bool had_u = nmm_contact_lookup(now->state, u, e) != NULL;
        const bool had_w = nmm_contact_lookup(now->state, w, f) != NULL;
        if (had_u != had_w) take_u = had_u;
    }
    if (take_u)
        add_raw(now, u, e, length, false);
    else
        add_raw(now, w, f, length, false);
}

static void edge_edge(narrowing *now, int f, int e, const nmm_edge_line *lf,
                      const nmm_edge_line *le, double share) {
    // Along e: f runs from a (its start, further) to b (its end).
    const double a = nmm_vec2_dot(le->t, nmm_vec2_sub(lf->p, le->p));
    const double b = nmm_vec2_dot(le->t, nmm_vec2_sub(lf->q, le->p));
    const double high = nmm_min(a, le->length), low = nmm_max(b, 0);
    if (high - low <= NMM_EXACT * now->model->size) return;
    const double length = 0.5 * share * (high - low);
    add_end(now, f, e, now->model->vertex_next[e], f, a - le->length, length);
    add_end(now, now->model->vertex_next[f], e, e, f, -b, length);
}

// Both edges at the vertex lie in front of the line of e; *share is how parallel they are to it.
static bool admissible(const narrowing *now, int vertex, const nmm_edge_line *e, double *share) {
    const nmm_edge_line out = nmm_edge_line_of(now->model, now->state, vertex);
    const nmm_edge_line in =
        nmm_edge_line_of(now->model, now->state, now->model->vertex_prev[vertex]);
    *share = nmm_max(share_parallel(&out, e), share_parallel(&in, e));
    return nmm_vec2_dot(out.t, e->n) >= -NMM_SLANTED && nmm_vec2_dot(in.t, e->n) <= NMM_SLANTED;
}

// The first edge beyond `edge` (in one direction) that is not in line with it.
static int edge_round_the_corner(const narrowing *now, int edge, const nmm_edge_line *e,
                                 const int *step) {
    int other = step[edge];
    for (int k = 0; k < 16 && other != edge; k++, other = step[other]) {
        const nmm_edge_line o = nmm_edge_line_of(now->model, now->state, other);
        if (fabs(nmm_vec2_cross(e->t, o.t)) > 1e-3 || nmm_vec2_dot(e->t, o.t) < 0) break;
    }
    return other;
}

// A vertex behind edge e is in its block only if it lies behind the sides of a convex corner as
// well; where it lies less deep behind such a side, that is its way out.
static bool nearer_way_out(const narrowing *now, int edge, const nmm_edge_line *e, nmm_vec2 place,
                           double gap) {
    const int *step[2] = {now->model->vertex_next, now->model->vertex_prev};
    for (int k = 0; k < 2; k++) {
        const int other = edge_round_the_corner(now, edge, e, step[k]);
        const nmm_edge_line o = nmm_edge_line_of(now->model, now->state, other);
        const double turn = nmm_vec2_cross(e->t, o.t);
        const bool convex = k == 0 ? turn > 0 : turn < 0;
        if (convex && nmm_vec2_dot(o.n, nmm_vec2_sub(place, o.p)) > gap) return true;
    }
    return false;
}

static void corner(narrowing *now, int vertex, int edge, const nmm_edge_line *e) {
    const nmm_vec2 off = nmm_vec2_sub(nmm_vertex_place(now->model, now->state, vertex), e->p);
    const double along = nmm_vec2_dot(e->t, off), gap = nmm_vec2_dot(e->n, off);
    if (along < 0 || along > e->length || fabs(gap) > NMM_DEEPEST * now->model->size) return;
    double share = 0;
    if (!admissible(now, vertex, e, &share) || share >= 1) return;
    if (gap < 0 && nearer_way_out(now, edge, e, nmm_vec2_add(e->p, off), gap)) {
        const nmm_contact *old = nmm_contact_lookup(now->state, vertex, edge);
        if (old == NULL || old->mode == NMM_CONTACT_OPEN) return;
    }
    add_raw(now, vertex, edge, (1 - share) * NMM_CORNER * now->model->size, true);
}

static void narrow_pair(narrowing *now, nmm_edge_pair pair) {
    const nmm_model *model = now->model;
    const nmm_edge_line a = nmm_edge_line_of(model, now->state, pair.a);
    const nmm_edge_line b = nmm_edge_line_of(model, now->state, pair.b);
    const double share = share_parallel(&a, &b);
    if (share > 0) edge_edge(now, pair.a, pair.b, &a, &b, share);
    corner(now, pair.a, pair.b, &b);
    corner(now, pair.b, pair.a, &a);
}

// Boxes of the edges as they are now, nearer than reach?
static bool still_near(const narrowing *now, nmm_edge_pair pair) {
    const nmm_vec2 p = nmm_vertex_place(now->model, now->state, pair.a);
    const nmm_vec2 q = nmm_vertex_place(now->model, now->state, now->model->vertex_next[pair.a]);
    const nmm_vec2 r = nmm_vertex_place(now->model, now->state, pair.b);
    const nmm_vec2 s = nmm_vertex_place(now->model, now->state, now->model->vertex_next[pair.b]);
    const double reach = nmm_max(now->reach, NMM_SAME * now->model->size);
    return nmm_min(p.x, q.x) - nmm_max(r.x, s.x) <= reach &&
           nmm_min(r.x, s.x) - nmm_max(p.x, q.x) <= reach &&
           nmm_min(p.y, q.y) - nmm_max(r.y, s.y) <= reach &&
           nmm_min(r.y, s.y) - nmm_max(p.y, q.y) <= reach;
}

// --- All pairs
// -------------------------------------------------------------------------------------------

// By edge, then by length: sums of lengths do not depend on the order of the pairs.
static bool comes_after(const nmm_raw *a, const nmm_raw *b) {
    return a->edge != b->edge ? a->edge > b->edge : a->length > b->length;
}

// Insertion sort, then equal edges are added up; returns how many are left.
static int merge_vertex(nmm_raw *raw, int n) {
    for (int i = 1; i < n; i++) {
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
            raw[kept - 1].corner = raw[kept - 1].corner && raw[i].corner;
        } else {
            raw[kept++] = raw[i];
        }
    }
    return kept;
}

static bool was_closed(const nmm_state *state, const nmm_raw *raw) {
    const nmm_contact *old = nmm_contact_lookup(state, raw->vertex, raw->edge);
    return old != NULL && old->mode != NMM_CONTACT_OPEN;
}

// Is `other` a better way out of the same block than the overlapping corner `own`?
static bool better_way_out(const nmm_model *model, const nmm_state *state, const nmm_raw *own,
                           const nmm_raw *other) {
    if (model->vertex_block[own->edge] != model->vertex_block[other->edge]) return false;
    const bool own_closed = was_closed(state, own), other_closed = was_closed(state, other);
    if (own_closed != other_closed) return other_closed;
    if (own->gap != other->gap) return other->gap > own->gap;
    return other->edge < own->edge;
}

// Corners that overlap several edges of one block keep one.
static int choose_entrance(const nmm_model *model, const nmm_state *state, nmm_raw *raw, int n) {
    bool dropped[64] = {false};
    if (n > 64) return n;
    for (int i = 0; i < n; i++) {
        if (!raw[i].corner || raw[i].gap >= 0) continue;
        for (int k = 0; k < n && !dropped[i]; k++) {
            dropped[i] = k != i && better_way_out(model, state, &raw[i], &raw[k]);
        }
    }
    int kept = 0;
    for (int i = 0; i < n; i++) {
        if (!dropped[i]) raw[kept++] = raw[i];
    }
    return kept;
}

// Raw contacts of all chunks by vertex.
static nmm_status sort_raw(nmm_context *context, nmm_contact_search *search, const nmm_model *model,
                           const nmm_state *state, int n_chunk, int *n_raw) {
    const int n = model->n_vertex;
    int *start = search->vertex_start;
    memset(start, 0, ((size_t)n + 1) * sizeof *start);
    int total = 0;
    for (int c = 0; c < n_chunk; c++) {
        const nmm_raw *raw = search->raw + search->raw_first[c];
        for (int k = 0; k < search->raw_count[c]; k++)
            start[raw[k].vertex] += 1;
        total += search->raw_count[c];
    }
    TRY(nmm_grow(context, &search->sorted, &search->sorted_capacity, total, sizeof(nmm_raw)));
    int sum = 0;
    for (int v = 0; v <= n; v++) {
        const int count = start[v];
        start[v] = sum;
        sum += count;
    }
    for (int c = 0; c < n_chunk; c++) {
        const nmm_raw *raw = search->raw + search->raw_first[c];
        for (int k = 0; k < search->raw_count[c]; k++) {
            search->sorted[start[raw[k].vertex]++] = raw[k];
        }
    }
    // start[v] is now the end of v. Merge within each vertex and close the ranks.
    int kept = 0, begin = 0;
    for (int v = 0; v < n; v++) {
        const int end = start[v];
        int count = merge_vertex(search->sorted + begin, end - begin);
        count = choose_entrance(model, state, search->sorted + begin, count);
        for (int k = 0; k < count; k++)
            search->sorted[kept + k] = search->sorted[begin + k];
        kept += count;
        begin = end;
    }
    *n_raw = kept;
    return NMM_OK;
}

// First place of each chunk's raw contacts: room for what its near pairs can make at most.
static void share_room(nmm_contact_search *search, const narrowing *now, int n_chunk,
                       int n_thread) {
    int *first = search->raw_first;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_chunk > 4)
    for (int c = 0; c < n_chunk; c++) {
        const int end = nmm_min_int((c + 1) * NMM_PAIR_CHUNK, search->n_pair);
        int near = 0;
        for (int k = c * NMM_PAIR_CHUNK; k < end; k++)
            near += still_near(now, search->pair[k]);
        first[c + 1] = NMM_RAW_PER_PAIR * near;
    }
    first[0] = 0;
    for (int c = 0; c < n_chunk; c++)
        first[c + 1] += first[c];
}

nmm_status nmm_narrow(nmm_context *context, nmm_contact_search *search, const nmm_model *model,
                      const nmm_state *state, double reach, int *n_raw) {
    const int n_thread = context->n_thread;
    const int n_chunk = (search->n_pair + NMM_PAIR_CHUNK - 1) / NMM_PAIR_CHUNK;
    int capacity = search->chunk_capacity;
    TRY(nmm_grow(context, &search->raw_first, &capacity, n_chunk + 1, sizeof(int)));
    TRY(nmm_grow(context, &search->raw_count, &search->chunk_capacity, n_chunk + 1, sizeof(int)));
    const narrowing all = {.search = search, .model = model, .state = state, .reach = reach};
    share_room(search, &all, n_chunk, n_thread);
    TRY(nmm_grow(context, &search->raw, &search->raw_capacity, search->raw_first[n_chunk],
                 sizeof(nmm_raw)));
#pragma omp parallel for num_threads(n_thread) schedule(dynamic) if (n_thread > 1 && n_chunk > 4)
    for (int c = 0; c < n_chunk; c++) {
        narrowing now = all;
        now.out = search->raw + search->raw_first[c];
        const int end = nmm_min_int((c + 1) * NMM_PAIR_CHUNK, search->n_pair);
        for (int k = c * NMM_PAIR_CHUNK; k < end; k++) {
            if (still_near(&now, search->pair[k])) narrow_pair(&now, search->pair[k]);
        }
        search->raw_count[c] = now.n;
    }
    return sort_raw(context, search, model, state, n_chunk, n_raw);
}
