// SPDX-License-Identifier: MIT
//
// The list of contacts of a step: raw contacts with the history of the last list. A contact is
// known by (vertex, edge). Where that is new, history comes from the same vertex on the
// neighbouring edge, or from the other side's vertex of the same place: then the slip is kept and
// the anchor put so. Bonded contacts stay, with their first length, until they break.

#include "search.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Does the edge after `edge` run on in the same direction, in the reference configuration?
static bool runs_on(const nmm_model *model, int edge) {
    const int next = model->vertex_next[edge], last = model->vertex_next[next];
    const double *p = model->point + 2 * (long)model->vertex_point[edge];
    const double *q = model->point + 2 * (long)model->vertex_point[next];
    const double *r = model->point + 2 * (long)model->vertex_point[last];
    const nmm_vec2 a = {q[0] - p[0], q[1] - p[1]}, b = {r[0] - q[0], r[1] - q[1]};
    const double size = sqrt(nmm_vec2_dot(a, a) * nmm_vec2_dot(b, b));
    return nmm_vec2_dot(a, b) > 0 && fabs(nmm_vec2_cross(a, b)) <= 1e-3 * size;
}

// Edges of a loop that lie in line, cut only by the mesh, are one side.
static void number_sides(nmm_contact_search *search, const nmm_model *model) {
    for (int v = 0; v < model->n_vertex; v++)
        search->side[v] = -1;
    for (int v = 0; v < model->n_vertex; v++) {
        if (search->side[v] >= 0) continue;
        // Back to the start of the side; once round at most.
        int first = v;
        while (runs_on(model, model->vertex_prev[first]) && model->vertex_prev[first] != v) {
            first = model->vertex_prev[first];
        }
        int edge = first;
        do {
            search->side[edge] = first;
            const bool on = runs_on(model, edge);
            edge = model->vertex_next[edge];
            if (!on) break;
        } while (search->side[edge] < 0);
    }
    for (int v = 0; v < model->n_vertex; v++) {
        if (model->edge_mate[v] >= 0) search->joint_side[search->side[v]] = true;
    }
}

static nmm_vec2 middle_of(const nmm_model *model) {
    double area = 0, x = 0, y = 0;
    for (int e = 0; e < model->n_element; e++) {
        area += model->element_area[e];
        x += model->element_area[e] * model->element_centre[2 * (long)e];
        y += model->element_area[e] * model->element_centre[2 * (long)e + 1];
    }
    return (nmm_vec2){x / area, y / area};
}

nmm_status nmm_contact_open(nmm_context *context, const nmm_model *model,
                            const nmm_contact_options *options, nmm_contact_search **search) {
    TRY(nmm_allocate(context, search, 1, sizeof **search));
    nmm_contact_search *s = *search;
    const size_t n = (size_t)model->n_vertex;
    s->options = *options;
    s->n_bucket = 16;
    while (s->n_bucket < model->n_vertex && s->n_bucket < 1 << 28)
        s->n_bucket *= 2;
    TRY(nmm_allocate(context, &s->side, n, sizeof(int)));
    TRY(nmm_allocate(context, &s->joint_side, n, sizeof(bool)));
    number_sides(s, model);
    s->middle = middle_of(model);
    TRY(nmm_allocate(context, &s->built_at, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &s->rests_at, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &s->bucket_start, (size_t)s->n_bucket + 1, sizeof(int)));
    TRY(nmm_allocate(context, &s->bucket_pairs, (size_t)s->n_bucket + 1, sizeof(int)));
    TRY(nmm_allocate(context, &s->box, n, sizeof(nmm_box)));
    TRY(nmm_allocate(context, &s->line, n, sizeof(nmm_edge_line)));
    TRY(nmm_allocate(context, &s->vertex_start, n + 1, sizeof(int)));
    return nmm_allocate(context, &s->last_start, n + 1, sizeof(int));
}

void nmm_contact_close(nmm_context *context, nmm_contact_search **search) {
    nmm_contact_search *s = *search;
    if (s == NULL) return;
    nmm_release(context, &s->side);
    nmm_release(context, &s->joint_side);
    nmm_release(context, &s->table);
    nmm_release(context, &s->built_at);
    nmm_release(context, &s->rests_at);
    nmm_release(context, &s->pair);
    nmm_release(context, &s->shared);
    nmm_release(context, &s->bucket_start);
    nmm_release(context, &s->bucket_pairs);
    nmm_release(context, &s->cell);
    nmm_release(context, &s->box);
    nmm_release(context, &s->raw);
    nmm_release(context, &s->raw_first);
    nmm_release(context, &s->raw_count);
    nmm_release(context, &s->line);
    nmm_release(context, &s->vertex_start);
    nmm_release(context, &s->last_start);
    nmm_release(context, &s->sorted);
    nmm_release(context, &s->next);
    nmm_release(context, search);
}

// --- A new contact

// Of two joints the one that holds less, whichever is listed first; -1: none.
static int weaker_of(const nmm_model *model, int a, int b) {
    if (a < 0 || b < 0) return nmm_max_int(a, b);
    const nmm_interface *one = &model->interface[a], *other = &model->interface[b];
    if (one->friction != other->friction) return one->friction < other->friction ? a : b;
    if (one->cohesion != other->cohesion) return one->cohesion < other->cohesion ? a : b;
    return one->normal_stiffness < other->normal_stiffness ? a : b;
}

// Of the joints that made the edge and the side which faces it, the one that holds less; at a
// corner of the one that made the edge, else of those that made the sides of the corner; else of
// none.
static int interface_of(const nmm_model *model, const nmm_raw *raw) {
    const int of_edge = model->edge_interface[raw->edge];
    const int of_side = raw->corner ? -1 : model->edge_interface[raw->facing];
    const int of_both = weaker_of(model, of_edge, of_side);
    if (of_both >= 0) return of_both;
    const int after = model->edge_interface[raw->vertex];
    const int before = model->edge_interface[model->vertex_prev[raw->vertex]];
    return nmm_max_int(0, weaker_of(model, after, before));
}

static double modulus_behind(const nmm_model *model, int edge) {
    return model->material[model->element_material[model->edge_element[edge]]].youngs_modulus;
}

// Springs in proportion to the length, eq. (5.3).
static void set_springs(const nmm_contact_search *search, const nmm_model *model, nmm_contact *c) {
    const nmm_interface *law = &model->interface[c->interface];
    const double both = nmm_contact_modulus(modulus_behind(model, c->vertex),
                                            modulus_behind(model, model->vertex_prev[c->vertex]),
                                            modulus_behind(model, c->edge));
    const double normal = law->normal_stiffness > 0 ? law->normal_stiffness
                                                    : search->options.penalty * both / model->size;
    const double shear = law->shear_stiffness > 0 ? law->shear_stiffness : normal / 2.5;
    // A stiffness that the scene gives is a property of the interface: it goes by the true length.
    const double length = law->normal_stiffness > 0 ? c->length : c->spring_length;
    c->normal_stiffness = normal * length;
    c->shear_stiffness = shear * length;
}

// Where a new contact has its anchor.
static double anchor_of(const nmm_contact_search *search, const nmm_raw *raw) {
    const nmm_edge_line *e = &search->line[raw->edge];
    return nmm_vec2_dot(e->t, nmm_vec2_sub(search->line[raw->vertex].p, e->p)) / e->length;
}

// --- History

// Take over what `old` knew. Forces per length are kept; the slip too, so the anchor moves along.
static void inherit(const nmm_contact_search *search, const nmm_model *model, const nmm_raw *raw,
                    const nmm_contact *old, nmm_contact *c) {
    *c = *old;
    if (!old->bonded) {
        c->length = raw->length;
        c->spring_length = raw->spring_length;
    }
    if (old->vertex != raw->vertex || old->edge != raw->edge) {
        c->vertex = raw->vertex;
        c->edge = raw->edge;
        c->anchor = anchor_of(search, raw) - old->slip / search->line[raw->edge].length;
        c->interface = interface_of(model, raw);
    }
    // Read from where it was: what has just been written would be waited for.
    nmm_contact_scale(c, old, c->spring_length / old->spring_length);
}

// A closed contact that a new one at the same place goes on from: its vertex has left its edge, and
// the two edges have about the same direction (sign 1) or face each other (sign -1).
static const nmm_contact *left_contact(const nmm_narrowing *now, int vertex, int edge, int new_edge,
                                       int sign) {
    const nmm_contact *old = nmm_contact_lookup(&now->last, vertex, edge);
    if (old == NULL || old->mode == NMM_CONTACT_OPEN) return NULL;
    const nmm_edge_line *e = &now->line[edge];
    const double foot = nmm_vec2_dot(e->t, nmm_vec2_sub(now->line[vertex].p, e->p));
    const double margin = NMM_EXACT * now->model->size;
    if (!old->bonded && foot > margin && foot < e->length - margin) return NULL;
    return sign * nmm_vec2_dot(e->t, now->line[new_edge].t) > NMM_IN_LINE ? old : NULL;
}

// The end of `edge` that the vertex is at: the far one may have left its own edge, which is no
// matter of this place.
static int nearer_end(const nmm_narrowing *now, int edge, int vertex) {
    const nmm_edge_line *e = &now->line[edge];
    const double along = nmm_vec2_dot(e->t, nmm_vec2_sub(now->line[vertex].p, e->p));
    return along < 0.5 * e->length ? edge : nmm_vertex_behind(now, edge);
}

// Of the closed contacts that a vertex left on two edges which meet: the one whose edge has the
// direction of the new one more, by more than rounding; else the one that pressed more.
static const nmm_contact *left_of_two(const nmm_narrowing *now, int vertex, const int *edge,
                                      int new_edge, int sign) {
    const nmm_contact *first = left_contact(now, vertex, edge[0], new_edge, sign);
    const nmm_contact *second = left_contact(now, vertex, edge[1], new_edge, sign);
    if (first == NULL || second == NULL) return first != NULL ? first : second;
    const nmm_vec2 along = nmm_vec2_scale(sign, now->line[new_edge].t);
    const double more =
        nmm_vec2_dot(along, now->line[edge[0]].t) - nmm_vec2_dot(along, now->line[edge[1]].t);
    if (fabs(more) > NMM_EQUAL) return more > 0 ? first : second;
    return first->normal_force >= second->normal_force ? first : second;
}

const nmm_contact *nmm_contact_history(const nmm_narrowing *now, int vertex, int edge) {
    const nmm_contact *old = nmm_contact_lookup(&now->last, vertex, edge);
    if (old != NULL) return old;
    // The vertex passed a corner or a cut of the other side.
    const int near[2] = {nmm_vertex_before(now, edge), nmm_vertex_behind(now, edge)};
    old = left_of_two(now, vertex, near, edge, 1);
    if (old != NULL) return old;
    // The other side's vertex at this place, on the edges that meet here.
    const int side[2] = {vertex, nmm_vertex_before(now, vertex)};
    return left_of_two(now, nearer_end(now, edge, vertex), side, edge, -1);
}

// Made where it is listed: a copy of what has just been written would be waited for.
static void make_contact(const nmm_contact_search *search, const nmm_narrowing *now,
                         const nmm_raw *raw, const nmm_contact *old, nmm_contact *c) {
    const nmm_model *model = now->model;
    if (old != NULL) {
        inherit(search, model, raw, old, c);
    } else {
        memset(c, 0, sizeof *c);
        c->vertex = raw->vertex;
        c->edge = raw->edge;
        c->length = raw->length;
        c->spring_length = raw->spring_length;
        c->interface = interface_of(model, raw);
        c->gap = raw->gap;
        c->anchor = anchor_of(search, raw);
        c->rest = nmm_min(0, nmm_contact_gap(model, now->state, c->vertex, c->edge));
    }
    set_springs(search, model, c);
}

// --- Start of a run

// What friction cannot hold is not there from the start: nothing slides to lose it, so no work is
// done.
static void hold_less(const nmm_interface *law, nmm_contact *c) {
    c->carried_normal = nmm_max(0, c->carried_normal);
    const double most = law->friction * c->carried_normal;
    c->carried_shear = nmm_max(-most, nmm_min(most, c->carried_shear));
}

// Joints that hold are bonded; initial stress is in balance at once, eq. (5.12), and has been
// before. It is carried across joints: where two cross, the blocks across touch in a point and
// carry nothing.
static void begin_contact(const nmm_model *model, const nmm_state *state, const nmm_raw *raw,
                          nmm_contact *c) {
    const nmm_interface *law = &model->interface[c->interface];
    const bool touching = fabs(c->gap) <= NMM_TOUCH * model->size;
    const int mate = model->edge_mate[c->edge];
    if (raw->corner || !touching || mate < 0) return;
    c->bonded = law->cohesion > 0 || law->tensile_strength > 0;
    if (c->bonded) c->mode = NMM_CONTACT_STICK;
    if (raw->facing != mate) return;
    const nmm_edge_line e = nmm_edge_line_of(model, state, c->edge);
    const double *a = state->initial_stress + 3 * (long)model->edge_element[c->edge];
    const double *b = state->initial_stress + 3 * (long)model->edge_element[c->vertex];
    double s[3];
    for (int i = 0; i < 3; i++)
        s[i] = 0.5 * (a[i] + b[i]);
    const nmm_vec2 pull = {s[0] * e.n.x + s[2] * e.n.y, s[2] * e.n.x + s[1] * e.n.y};
    c->carried_normal = -nmm_vec2_dot(e.n, pull) * c->length;
    c->carried_shear = -nmm_vec2_dot(e.t, pull) * c->length;
    if (!c->bonded) hold_less(law, c);
    if (c->carried_normal > 0) c->mode = NMM_CONTACT_STICK;
    c->force_before = c->carried_normal;
}

// --- The list

// Where the contacts of each vertex begin; their largest overlap, at the places of the last
// evaluation, and how many are bonded.
static int start_list(const nmm_state *state, int n_vertex, int *start, double *overlap) {
    int v = 0, n_bonded = 0;
    *overlap = 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        while (v <= c->vertex)
            start[v++] = k;
        *overlap = nmm_max(*overlap, -c->gap);
        n_bonded += c->bonded;
    }
    while (v <= n_vertex)
        start[v++] = state->n_contact;
    return n_bonded;
}

static bool is_longer(const nmm_contact *c, const nmm_contact *before) {
    if (before == NULL || before->mode == NMM_CONTACT_OPEN) return false;
    return c->spring_length > NMM_LONGER * before->spring_length;
}

static int order_of(const nmm_contact *old, const nmm_raw *raw) {
    if (old->vertex != raw->vertex) return old->vertex < raw->vertex ? -1 : 1;
    return (old->edge > raw->edge) - (old->edge < raw->edge);
}

// Merge the raw contacts with bonded ones that the search did not bring.
static int make_list(nmm_contact_search *search, const nmm_narrowing *now, bool begins, int n_raw) {
    const nmm_state *state = now->state;
    int n = 0, old = 0;
    search->grows = false;
    for (int i = 0; i < n_raw || old < state->n_contact;) {
        const int order = old >= state->n_contact ? 1
                          : i >= n_raw            ? -1
                                       : order_of(&state->contact[old], &search->sorted[i]);
        if (order < 0) {
            if (state->contact[old].bonded) search->next[n++] = state->contact[old];
            old += 1;
            continue;
        }
        const nmm_raw *raw = &search->sorted[i++];
        const nmm_contact *before =
            order == 0 ? &state->contact[old++] : nmm_contact_history(now, raw->vertex, raw->edge);
        // A bond at the same place, kept under its own name, stands for this one.
        if (before != NULL && before->bonded && order != 0) continue;
        make_contact(search, now, raw, before, &search->next[n]);
        search->grows |= is_longer(&search->next[n], before);
        if (begins) begin_contact(now->model, state, raw, &search->next[n]);
        n += 1;
    }
    return n;
}

static void draw_lines(const nmm_context *context, nmm_contact_search *search,
                       const nmm_model *model, const nmm_state *state) {
    const int n = model->n_vertex, n_thread = context->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 4096)
    for (int e = 0; e < n; e++)
        search->line[e] = nmm_edge_line_of(model, state, e);
}

nmm_status nmm_contact_find(nmm_context *context, nmm_contact_search *search,
                            const nmm_model *model, nmm_state *state, double reach) {
    // A run that goes on from a file has contacts already.
    const bool begins = !search->started && state->step == 0;
    double overlap = 0;
    const int n_bonded = start_list(state, model->n_vertex, search->last_start, &overlap);
    // What rounding leaves is less than NMM_SAME.
    if (begins && !model->apart) overlap = NMM_DEEPEST * model->size;
    const double near = nmm_max(reach, NMM_SAME * model->size) + overlap;
    TRY(nmm_pairs_update(context, search, model, state, near));
    draw_lines(context, search, model, state);
    const nmm_narrowing now = {.model = model,
                               .state = state,
                               .line = search->line,
                               .last = {state->contact, search->last_start},
                               .middle = search->middle,
                               .reach = reach,
                               .near = near};
    int n_raw = 0;
    TRY(nmm_narrow(context, search, &now, &n_raw));
    const int most = n_raw + n_bonded;
    TRY(nmm_grow(context, &search->next, &search->next_capacity, most, sizeof(nmm_contact)));
    state->n_contact = make_list(search, &now, begins, n_raw);
    // The two lists change places.
    nmm_contact *const list = search->next;
    const int capacity = search->next_capacity;
    search->next = state->contact;
    search->next_capacity = state->contact_capacity;
    state->contact = list;
    state->contact_capacity = capacity;
    search->started = true;
    return search->grows ? nmm_contact_keep_sides(context, search, model, state) : NMM_OK;
}

nmm_status nmm_contact_save(nmm_context *context, nmm_contact_search *search,
                            const nmm_state *state, const nmm_contact **start) {
    const int n = state->n_contact;
    TRY(nmm_grow(context, &search->next, &search->next_capacity, n, sizeof(nmm_contact)));
    if (n > 0) memcpy(search->next, state->contact, (size_t)n * sizeof(nmm_contact));
    *start = search->next;
    return NMM_OK;
}

void nmm_contact_describe(const nmm_model *model, const nmm_state *state, int contact, char *text,
                          size_t size) {
    const nmm_contact *c = &state->contact[contact];
    const nmm_vec2 p = nmm_vertex_place(model, state, c->vertex);
    const int a = model->vertex_block[c->vertex], b = model->vertex_block[c->edge];
    const char *name_a = model->block_name[a], *name_b = model->block_name[b];
    static const char *const mode[] = {"open", "sliding", "sticking"};
    snprintf(text, size, "block %d%s%.24s%s on block %d%s%.24s%s at (%.6g, %.6g), now %s", a,
             name_a ? " '" : "", name_a ? name_a : "", name_a ? "'" : "", b, name_b ? " '" : "",
             name_b ? name_b : "", name_b ? "'" : "", p.x + model->origin.x, p.y + model->origin.y,
             mode[c->mode]);
}
