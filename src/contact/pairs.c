// SPDX-License-Identifier: MIT
//
// Pairs of near loop edges by a hashed grid of cells: O(n) in time and memory, however far blocks
// have flown apart. Pairs are kept until some vertex has moved so far that one could be missing.
// A pair is taken from the one cell that holds the lower corner of what two boxes share, so it
// comes once, and the order depends on the edges alone.

#include "search.h"

#include <float.h>
#include <math.h>
#include <string.h>

// What the pairs reach beyond the wish: fewer rebuilds against more pairs. The wish grows with the
// speed, so twice of it lasts for several steps; from and up to these parts of h.
#define SKIN_LEAST 0.05
#define SKIN_MOST 0.2

// Entries of the grid, at most, for each edge and beside that: cells grow where edges are far
// longer than a cover.
#define ENTRIES 32.0
#define MORE_ENTRIES 4096.0

static double skin_for(double reach, double size) {
    return nmm_max(SKIN_LEAST * size, nmm_min(SKIN_MOST * size, 2 * reach));
}

static int cell_of(double x, double size) {
    const double cell = floor(x / size);
    return cell > 1e9 ? 1000000000 : cell < -1e9 ? -1000000000 : (int)cell;
}

// Cells that follow each other in x have buckets that do: what is near is met together.
static int bucket_of(int ix, int iy, int n_bucket) {
    const uint32_t hash = (uint32_t)ix + (uint32_t)iy * 2654435761u;
    return (int)(hash & (uint32_t)(n_bucket - 1));
}

// --- Grid

static nmm_box box_of_edge(const nmm_model *model, const nmm_state *state, int e, double grow) {
    const nmm_vec2 p = nmm_vertex_place(model, state, e);
    const nmm_vec2 q = nmm_vertex_place(model, state, model->vertex_next[e]);
    return (nmm_box){{nmm_min(p.x, q.x) - grow, nmm_min(p.y, q.y) - grow},
                     {nmm_max(p.x, q.x) + grow, nmm_max(p.y, q.y) + grow}};
}

// Counts (fill false) or stores the cells of all edges; bucket_start[b + 1] counts bucket b.
static void enter_edges(nmm_contact_search *search, int n, double size, bool fill) {
    for (int e = 0; e < n; e++) {
        const nmm_box *box = &search->box[e];
        const int x1 = cell_of(box->high.x, size), y1 = cell_of(box->high.y, size);
        for (int iy = cell_of(box->low.y, size); iy <= y1; iy++) {
            for (int ix = cell_of(box->low.x, size); ix <= x1; ix++) {
                const int b = bucket_of(ix, iy, search->n_bucket);
                if (fill)
                    search->cell[search->bucket_start[b]++] = (nmm_cell){e, ix, iy};
                else
                    search->bucket_start[b + 1] += 1;
            }
        }
    }
}

static double entries_of(const nmm_contact_search *search, int n, double size) {
    double sum = 0;
    for (int e = 0; e < n; e++) {
        const nmm_box *box = &search->box[e];
        const double x = (box->high.x - box->low.x) / size, y = (box->high.y - box->low.y) / size;
        sum += (x + 2) * (y + 2);
    }
    return sum;
}

static double choose_cell(const nmm_contact_search *search, int n, double size) {
    const double most = ENTRIES * n + MORE_ENTRIES;
    for (int k = 0; k < 64 && entries_of(search, n, size) > most; k++)
        size *= 2;
    return size;
}

static nmm_status fill_grid(nmm_context *context, nmm_contact_search *search, int n) {
    const double size = search->cell_size;
    int *start = search->bucket_start;
    const int n_bucket = search->n_bucket;
    memset(start, 0, ((size_t)n_bucket + 1) * sizeof *start);
    enter_edges(search, n, size, false);
    for (int b = 0; b < n_bucket; b++)
        start[b + 1] += start[b];
    TRY(nmm_grow(context, &search->cell, &search->cell_capacity, start[n_bucket],
                 sizeof(nmm_cell)));
    enter_edges(search, n, size, true);
    // Filling moved each start to the next one's place.
    memmove(start + 1, start, (size_t)n_bucket * sizeof *start);
    start[0] = 0;
    return NMM_OK;
}

// --- Pairs

static bool boxes_meet(const nmm_box *a, const nmm_box *b) {
    return a->low.x <= b->high.x && b->low.x <= a->high.x && a->low.y <= b->high.y &&
           b->low.y <= a->high.y;
}

static nmm_vec2 reference_direction(const nmm_model *model, int e) {
    const double *p = model->point + 2 * (long)model->vertex_point[e];
    const double *q = model->point + 2 * (long)model->vertex_point[model->vertex_next[e]];
    const nmm_vec2 along = {q[0] - p[0], q[1] - p[1]};
    const double length = sqrt(nmm_vec2_dot(along, along));
    return length > 0 ? nmm_vec2_scale(1 / length, along) : along;
}

static nmm_vec2 reference_middle(const nmm_model *model, int e) {
    const double *p = model->point + 2 * (long)model->vertex_point[e];
    const double *q = model->point + 2 * (long)model->vertex_point[model->vertex_next[e]];
    return (nmm_vec2){0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])};
}

// What is thinner may be so by rounding: places have as few digits as the scene's coordinates.
static double least_thickness(const nmm_model *model) {
    const double far = nmm_max(fabs(model->origin.x), fabs(model->origin.y));
    return nmm_max(NMM_EXACT * model->size, 64 * DBL_EPSILON * far);
}

// Is each behind the other: the two sides of something thin, a wedge between two joints say? They
// see the same material, not each other.
static bool back_to_back(const nmm_model *model, int a, int b, nmm_vec2 of_a, nmm_vec2 of_b) {
    const nmm_vec2 way = nmm_vec2_sub(reference_middle(model, b), reference_middle(model, a));
    const double thin = least_thickness(model);
    return nmm_vec2_cross(way, of_a) < -thin && nmm_vec2_cross(way, of_b) > thin;
}

// Neighbours of a loop meet only as the two faces of a crack at its tip; edges of one block only
// when they faced each other at the start, so that the answer does not depend on when it is asked.
bool nmm_edges_can_meet(const nmm_model *model, int a, int b) {
    if (model->vertex_block[a] != model->vertex_block[b]) return true;
    if (model->vertex_next[a] == b || model->vertex_next[b] == a) return model->edge_mate[a] == b;
    const nmm_vec2 of_a = reference_direction(model, a), of_b = reference_direction(model, b);
    return nmm_vec2_dot(of_a, of_b) < -0.2 && !back_to_back(model, a, b, of_a, of_b);
}

static nmm_vec2 built_place(const nmm_contact_search *search, int v) {
    return (nmm_vec2){search->built_at[2 * (long)v], search->built_at[2 * (long)v + 1]};
}

// Is the start of edge a further from edge b than `reach`?
static bool starts_far(nmm_vec2 start, nmm_vec2 from, nmm_vec2 along, double reach) {
    const nmm_vec2 off = nmm_vec2_sub(start, from);
    const double part = nmm_vec2_dot(off, along) / nmm_vec2_dot(along, along);
    const nmm_vec2 foot = nmm_vec2_scale(nmm_max(0, nmm_min(1, part)), along);
    const nmm_vec2 rest = nmm_vec2_sub(off, foot);
    return nmm_vec2_dot(rest, rest) > reach * reach;
}

// Edges of two blocks that meet only end to end, or as a T: sides that never face each other while
// the pairs are kept, and of both the vertex that comes with the edge stays away from the other
// edge. Until then no vertex moves by more than half of what the pairs reach, and its distance by
// that; a corner is at most 1.5 times the reach away.
static bool never_touch(const nmm_contact_search *search, const nmm_model *model, int a, int b) {
    if (model->vertex_block[a] == model->vertex_block[b]) return false;
    const nmm_vec2 p = built_place(search, a), q = built_place(search, b);
    const nmm_vec2 of_a = nmm_vec2_sub(built_place(search, model->vertex_next[a]), p);
    const nmm_vec2 of_b = nmm_vec2_sub(built_place(search, model->vertex_next[b]), q);
    const double reach = search->built_for, size_a = sqrt(nmm_vec2_dot(of_a, of_a));
    const double size_b = sqrt(nmm_vec2_dot(of_b, of_b)), size = size_a * size_b;
    // Both edges together turn by less than this [rad]: asin x <= 1.6 x.
    const double turn = 1.6 * reach * (1 / size_a + 1 / size_b);
    const bool aslant = fabs(nmm_vec2_cross(of_a, of_b)) > (NMM_SLANTED + turn) * size;
    const bool alike = nmm_vec2_dot(of_a, of_b) > turn * size;
    return (aslant || alike) && starts_far(p, q, of_b, 2.5 * reach) &&
           starts_far(q, p, of_a, 2.5 * reach);
}

// Pairs of bucket b; stores those that there is room for. Returns how many.
static int pairs_of_bucket(const nmm_contact_search *search, const nmm_model *model, int b,
                           nmm_edge_pair *out, int room) {
    const double size = search->cell_size;
    int n = 0;
    for (int i = search->bucket_start[b]; i < search->bucket_start[b + 1]; i++) {
        const nmm_cell *one = &search->cell[i];
        const nmm_box *first = &search->box[one->edge];
        for (int k = i + 1; k < search->bucket_start[b + 1]; k++) {
            const nmm_cell *two = &search->cell[k];
            const nmm_box *second = &search->box[two->edge];
            if (one->ix != two->ix || one->iy != two->iy || !boxes_meet(first, second)) continue;
            if (cell_of(nmm_max(first->low.x, second->low.x), size) != one->ix) continue;
            if (cell_of(nmm_max(first->low.y, second->low.y), size) != one->iy) continue;
            if (!nmm_edges_can_meet(model, one->edge, two->edge)) continue;
            if (never_touch(search, model, one->edge, two->edge)) continue;
            if (n < room) out[n] = (nmm_edge_pair){one->edge, two->edge, -1, false};
            n += 1;
        }
    }
    return n;
}

// Bucket by bucket; one that finds no room is gone through again.
static nmm_status list_pairs(nmm_context *context, nmm_contact_search *search,
                             const nmm_model *model) {
    search->n_pair = 0;
    for (int b = 0; b < search->n_bucket;) {
        const int n = search->n_pair, room = search->pair_capacity - n;
        const int found = pairs_of_bucket(search, model, b, search->pair + n, room);
        if (found > room) {
            TRY(nmm_grow(context, &search->pair, &search->pair_capacity, n + found,
                         sizeof(nmm_edge_pair)));
            continue;
        }
        search->n_pair += found;
        b += 1;
    }
    return NMM_OK;
}

// By several threads: counted first, so that each bucket has its place.
static nmm_status share_pairs(nmm_context *context, nmm_contact_search *search,
                              const nmm_model *model) {
    const int n = search->n_bucket;
    int *first = search->bucket_pairs;
    first[0] = 0;
#pragma omp parallel for num_threads(context->n_thread) schedule(dynamic, 256)
    for (int b = 0; b < n; b++)
        first[b + 1] = pairs_of_bucket(search, model, b, NULL, 0);
    for (int b = 0; b < n; b++)
        first[b + 1] += first[b];
    search->n_pair = first[n];
    TRY(nmm_grow(context, &search->pair, &search->pair_capacity, first[n], sizeof(nmm_edge_pair)));
#pragma omp parallel for num_threads(context->n_thread) schedule(dynamic, 256)
    for (int b = 0; b < n; b++) {
        const int room = first[b + 1] - first[b];
        if (room > 0) pairs_of_bucket(search, model, b, search->pair + first[b], room);
    }
    return NMM_OK;
}

static nmm_status find_pairs(nmm_context *context, nmm_contact_search *search,
                             const nmm_model *model) {
    const bool shared = context->n_thread > 1 && search->n_bucket > 4096;
    return shared ? share_pairs(context, search, model) : list_pairs(context, search, model);
}

// --- Pairs of sides

nmm_status nmm_side_table(nmm_context *context, nmm_contact_search *search, int n, int *size) {
    for (*size = 16; *size < 2 * n;)
        *size *= 2;
    TRY(nmm_grow(context, &search->table, &search->table_capacity, *size, sizeof(nmm_side_pair)));
    memset(search->table, 0, (size_t)*size * sizeof(nmm_side_pair));
    return NMM_OK;
}

nmm_side_pair *nmm_side_pair_of(nmm_contact_search *search, int size, int x, int y) {
    const int a = nmm_min_int(x, y), b = nmm_max_int(x, y);
    uint32_t at = (uint32_t)a * 2654435761u ^ (uint32_t)b * 2246822519u;
    for (at = (at ^ at >> 15) & (uint32_t)(size - 1);; at = (at + 1) & (uint32_t)(size - 1)) {
        nmm_side_pair *entry = &search->table[at];
        if (entry->a == entry->b) *entry = (nmm_side_pair){.a = a, .b = b, .number = -1};
        if (entry->a == a && entry->b == b) return entry;
    }
}

// Sides that a joint cut fit each other, and four of them meet at a crossing: there the blocks that
// face each other across it share no more than a rounding, which must stay as little.
static bool may_lengthen(const nmm_contact_search *search, int a, int b) {
    return a != b && !(search->joint_side[a] && search->joint_side[b]);
}

// Several edges may be of one side.
nmm_status nmm_pairs_number(nmm_context *context, nmm_contact_search *search) {
    int size = 0, n = 0;
    for (int k = 0; k < search->n_pair; k++)
        n += may_lengthen(search, search->side[search->pair[k].a], search->side[search->pair[k].b]);
    TRY(nmm_side_table(context, search, n, &size));
    search->n_sides = 0;
    for (int k = 0; k < search->n_pair; k++) {
        nmm_edge_pair *pair = &search->pair[k];
        const int a = search->side[pair->a], b = search->side[pair->b];
        pair->sides = -1;
        if (!may_lengthen(search, a, b)) continue;
        nmm_side_pair *sides = nmm_side_pair_of(search, size, a, b);
        if (sides->number < 0) sides->number = search->n_sides++;
        pair->sides = sides->number;
    }
    return nmm_grow(context, &search->shared, &search->sides_capacity, search->n_sides,
                    sizeof(double));
}

// --- When they are made anew

double nmm_largest_motion(const nmm_model *model, const nmm_state *state, const double *from) {
    double largest = 0;
    for (int v = 0; v < model->n_vertex; v++) {
        const nmm_vec2 p = nmm_vertex_place(model, state, v);
        const double x = p.x - from[2 * (long)v], y = p.y - from[2 * (long)v + 1];
        largest = nmm_max(largest, x * x + y * y);
    }
    return sqrt(largest);
}

nmm_status nmm_pairs_update(nmm_context *context, nmm_contact_search *search,
                            const nmm_model *model, const nmm_state *state, double reach) {
    const double wish = reach + skin_for(reach, model->size);
    // Pairs that reach far too far, as after a first step that looked deep, cost more than new
    // ones.
    const bool lavish = search->built_for > 1.5 * wish;
    if (search->started && !lavish &&
        reach + 2 * nmm_largest_motion(model, state, search->built_at) <= search->built_for) {
        return NMM_OK;
    }
    const int n = model->n_vertex, n_thread = context->n_thread;
    search->built_for = wish;
    search->n_chunk = 0;
    search->rests_for = 0;
    for (int v = 0; v < n; v++) {
        const nmm_vec2 p = nmm_vertex_place(model, state, v);
        search->built_at[2 * v] = p.x;
        search->built_at[2 * v + 1] = p.y;
    }
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int e = 0; e < n; e++) {
        search->box[e] = box_of_edge(model, state, e, 0.5 * search->built_for);
    }
    search->cell_size = choose_cell(search, n, model->size);
    TRY(fill_grid(context, search, n));
    TRY(find_pairs(context, search, model));
    return nmm_pairs_number(context, search);
}

// --- Can there be a contact at all?

/// An edge of the reference configuration.
typedef struct reference_edge {
    nmm_vec2 middle, along;
} reference_edge;

/// All of them, and boxes of the middles of runs of them.
typedef struct outline {
    int n, length, n_run; // edges; in a run; runs
    reference_edge *edge; // [n]
    nmm_box *run;         // [n_run]
} outline;

static int end_of_run(const outline *o, int run) {
    return nmm_min_int(o->n, (run + 1) * o->length);
}

static nmm_box box_of_run(const outline *o, int run) {
    nmm_box box = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int e = run * o->length; e < end_of_run(o, run); e++) {
        const nmm_vec2 p = o->edge[e].middle;
        box.low = (nmm_vec2){nmm_min(box.low.x, p.x), nmm_min(box.low.y, p.y)};
        box.high = (nmm_vec2){nmm_max(box.high.x, p.x), nmm_max(box.high.y, p.y)};
    }
    return box;
}

static nmm_status trace_outline(nmm_context *context, const nmm_model *model, outline *o) {
    o->n = model->n_vertex;
    // About as many runs as edges in one.
    o->length = nmm_max_int(1, (int)sqrt(o->n));
    o->n_run = (o->n + o->length - 1) / o->length;
    TRY(nmm_allocate(context, &o->edge, (size_t)o->n, sizeof *o->edge));
    TRY(nmm_allocate(context, &o->run, (size_t)o->n_run, sizeof *o->run));
    for (int e = 0; e < o->n; e++)
        o->edge[e] = (reference_edge){reference_middle(model, e), reference_direction(model, e)};
    for (int run = 0; run < o->n_run; run++)
        o->run[run] = box_of_run(o, run);
    return NMM_OK;
}

// Has the boundary a corner that points inwards? Without one the block is convex. Places of a
// straight side are straight to rounding only.
static bool has_inward_corner(const nmm_model *model, const outline *o) {
    for (int v = 0; v < o->n; v++) {
        const nmm_vec2 after = o->edge[model->vertex_next[v]].along;
        if (nmm_vec2_cross(o->edge[v].along, after) < -NMM_EXACT) return true;
    }
    return false;
}

static bool is_in_front(const reference_edge *e, nmm_vec2 place) {
    return nmm_vec2_cross(nmm_vec2_sub(place, e->middle), e->along) > 0;
}

// Is any of a box in front of the edge? If so the corner of it that is furthest there.
static bool is_box_in_front(const reference_edge *e, const nmm_box *box) {
    const nmm_vec2 furthest = {e->along.y > 0 ? box->high.x : box->low.x,
                               e->along.x > 0 ? box->low.y : box->high.y};
    return is_in_front(e, furthest);
}

// Is each of two edges of a block in front of the other, with nothing said of what is between?
static bool face_each_other(const nmm_model *model, const outline *o, int a, int b) {
    const reference_edge *one = &o->edge[a], *other = &o->edge[b];
    return is_in_front(one, other->middle) && is_in_front(other, one->middle) &&
           nmm_edges_can_meet(model, a, b);
}

static bool faces_another(const nmm_model *model, const outline *o, int a) {
    for (int run = a / o->length; run < o->n_run; run++) {
        if (!is_box_in_front(&o->edge[a], &o->run[run])) continue;
        for (int b = nmm_max_int(a + 1, run * o->length); b < end_of_run(o, run); b++) {
            if (face_each_other(model, o, a, b)) return true;
        }
    }
    return false;
}

nmm_status nmm_contact_can_be(nmm_context *context, const nmm_model *model, bool *can_be) {
    *can_be = model->n_block > 1;
    for (int v = 0; v < model->n_vertex && !*can_be; v++)
        *can_be = model->edge_mate[v] >= 0;
    if (*can_be) return NMM_OK;
    outline o = {0};
    const nmm_status status = trace_outline(context, model, &o);
    if (status == NMM_OK && has_inward_corner(model, &o)) {
        for (int a = 0; a < o.n && !*can_be; a++)
            *can_be = faces_another(model, &o, a);
    }
    nmm_release(context, &o.run);
    nmm_release(context, &o.edge);
    return status;
}
