// SPDX-License-Identifier: MIT
//
// The law of a contact: gap and slip at the configuration given, Mohr-Coulomb with a return mapping
// from the anchor of the step's start, bonds that break once, commit of an accepted step.
// N = carried - k_n g;  T = carried - k_s s, cut to mu N;  energy N^2 / 2 k_n + T^2 / 2 k_s.

#include "search.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define AT_LIMIT (1 - 1e-9)

// Part of its friction with which a contact sticks, whatever rounding is.
#define HOLDS 0.5

// Of a slip, over the lengths it is made of.
#define ROUNDING 1e-15

// --- Kinematics

// Was the vertex beyond a convex end of the edge when the step began, and is it still? Then it
// passes the corner, whatever the gap to the edge's line. `foot` and `anchor` along the edge [m].
static bool passes_corner(const nmm_model *model, const nmm_state *state, const nmm_contact *c,
                          const nmm_edge_line *e, double foot) {
    const double anchor = c->anchor * e->length, margin = 2 * NMM_SAME * model->size;
    const int *step;
    if (foot < -margin && anchor < -margin)
        step = model->vertex_prev;
    else if (foot > e->length + margin && anchor > e->length + margin)
        step = model->vertex_next;
    else
        return false;
    int next = step[c->edge];
    nmm_edge_line beyond = nmm_edge_line_of(model, state, next);
    for (int k = 0; k < 8 && beyond.length <= NMM_TINY * model->size; k++) {
        next = step[next];
        beyond = nmm_edge_line_of(model, state, next);
    }
    const double turn = nmm_vec2_cross(e->t, beyond.t);
    return foot < 0 ? turn < -NMM_SLANTED : turn > NMM_SLANTED;
}

// A vertex and the edge it meets: where they began, and how they have moved against each other.
typedef struct meeting {
    nmm_vec2 begun, moved;  // from the start of the edge to the vertex
    nmm_vec2 along, turned; // from the start of the edge to its end
} meeting;

static nmm_vec2 difference(const double *of_point, int p, int from) {
    const double *a = of_point + 2 * (long)p, *b = of_point + 2 * (long)from;
    return (nmm_vec2){a[0] - b[0], a[1] - b[1]};
}

static meeting meeting_of(const nmm_model *model, const nmm_state *state, int vertex, int edge) {
    const int p0 = model->vertex_point[vertex], p1 = model->vertex_point[edge];
    const int p2 = model->vertex_point[model->vertex_next[edge]];
    return (meeting){.begun = difference(model->point, p0, p1),
                     .moved = difference(state->shift, p0, p1),
                     .along = difference(model->point, p2, p1),
                     .turned = difference(state->shift, p2, p1)};
}

// Moment of the vertex about the edge, eq. (5.16): its first part is a constant, so that it changes
// with the digits of what moved and not with those of places.
static double moment_of(const meeting *m, nmm_vec2 e) {
    return nmm_vec2_cross(m->begun, m->along) +
           (nmm_vec2_cross(m->begun, m->turned) + nmm_vec2_cross(m->moved, e));
}

double nmm_contact_gap(const nmm_model *model, const nmm_state *state, int vertex, int edge) {
    const meeting m = meeting_of(model, state, vertex, edge);
    const nmm_vec2 e = nmm_vec2_add(m.along, m.turned);
    return moment_of(&m, e) / sqrt(nmm_vec2_dot(e, e));
}

enum { BATCH = 32 };

typedef struct vectors {
    double x[BATCH], y[BATCH];
} vectors;

// Contacts that are measured together, in order, so that roots and quotients are taken side by
// side.
typedef struct batch {
    int n;
    vectors place[3]; // [m] in the model, of the vertex, the start and the end of the edge
    vectors shift[3]; // [m] of these since the start
    double anchor[BATCH];
    double gap[BATCH], slip[BATCH];
    vectors along;          // where the edge points
    double length[BATCH];   // [m] of the edge
    double per_edge[BATCH]; // [1/m] one over it
    double rounding[BATCH]; // [m] what the slip is uncertain by
} batch;

// The contacts at `first` and behind of a list; NULL: those themselves.
static void gather(const nmm_model *model, const nmm_state *state, const int *contact, int first,
                   batch *b) {
    for (int i = 0; i < b->n; i++) {
        const nmm_contact *c = &state->contact[contact != NULL ? contact[first + i] : first + i];
        const int vertex[3] = {c->vertex, c->edge, model->vertex_next[c->edge]};
        for (int k = 0; k < 3; k++) {
            const long p = 2 * (long)model->vertex_point[vertex[k]];
            b->place[k].x[i] = model->point[p];
            b->place[k].y[i] = model->point[p + 1];
            b->shift[k].x[i] = state->shift[p];
            b->shift[k].y[i] = state->shift[p + 1];
        }
        b->anchor[i] = c->anchor;
    }
}

static inline nmm_vec2 between(const vectors *from, const vectors *to, int i) {
    return (nmm_vec2){to->x[i] - from->x[i], to->y[i] - from->y[i]};
}

static inline double size_of(const vectors *way, int i) {
    return nmm_max(fabs(way->x[i]), fabs(way->y[i]));
}

// Gap, slip and where the edge points, eq. (5.1).
static inline __attribute__((always_inline)) void measure_all(batch *b) {
    for (int i = 0; i < b->n; i++) {
        const meeting m = {.begun = between(&b->place[1], &b->place[0], i),
                           .moved = between(&b->shift[1], &b->shift[0], i),
                           .along = between(&b->place[1], &b->place[2], i),
                           .turned = between(&b->shift[1], &b->shift[2], i)};
        const nmm_vec2 e = nmm_vec2_add(m.along, m.turned);
        const double length = sqrt(nmm_vec2_dot(e, e)), scale = 1 / length, anchor = b->anchor[i];
        const nmm_vec2 began = nmm_vec2_sub(m.begun, nmm_vec2_scale(anchor, m.along));
        const nmm_vec2 slid = nmm_vec2_sub(m.moved, nmm_vec2_scale(anchor, m.turned));
        b->gap[i] = scale * moment_of(&m, e);
        b->slip[i] = scale * (nmm_vec2_dot(e, began) + nmm_vec2_dot(e, slid));
        b->along.x[i] = scale * e.x;
        b->along.y[i] = scale * e.y;
        b->length[i] = length;
        b->per_edge[i] = scale;
        // Displacements, and the anchor, a part of the edge.
        const double way = nmm_max(size_of(&b->shift[0], i), size_of(&b->shift[1], i));
        b->rounding[i] = ROUNDING * (length + way);
    }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void measure_wide(batch *b) {
    measure_all(b);
}
#endif

// With AVX2 four at once, and the same bits.
static void measure(batch *b) {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        measure_wide(b);
        return;
    }
#endif
    measure_all(b);
}

// A contact as forces and derivatives see it.
typedef struct frame {
    nmm_vec2 t, n;
    double foot; // of the vertex, edge parameter
    double turn; // gap over the length of the edge
} frame;

// At state->position.
static frame frame_of(const nmm_model *model, const nmm_state *state, const nmm_contact *c) {
    const nmm_edge_line e = nmm_edge_line_of(model, state, c->edge);
    const nmm_vec2 off = nmm_vec2_sub(nmm_vertex_place(model, state, c->vertex), e.p);
    return (frame){.t = e.t,
                   .n = e.n,
                   .foot = nmm_vec2_dot(e.t, off) / e.length,
                   .turn = nmm_vec2_dot(e.n, off) / e.length};
}

// As the last evaluation left it.
static frame frame_evaluated(const nmm_contact *c) {
    return (frame){.t = c->along,
                   .n = {c->along.y, -c->along.x},
                   .foot = c->anchor + c->per_edge * c->slip,
                   .turn = c->per_edge * c->gap};
}

// Both components at once.
typedef double pair __attribute__((vector_size(16)));

static inline void put_pair(double *to, pair value) {
    memcpy(to, &value, sizeof value);
}

// For elements with m functions; a constant m makes straight code of it.
static inline void derive(const nmm_model *model, const nmm_contact *contact, const frame *f, int m,
                          const nmm_derivatives *to) {
    const double a = f->foot, b = contact->anchor;
    const double *wv = model->edge_weight + 2 * m * (long)contact->vertex;
    const double *we = model->edge_weight + 2 * m * (long)contact->edge;
    const pair n = {f->n.x, f->n.y}, t = {f->t.x, f->t.y};
    for (int i = 0; i < m; i++) {
        const double at_vertex = wv[i], at_start = we[i], at_end = we[m + i];
        put_pair(to->normal[0] + 2 * i, at_vertex * n);
        put_pair(to->shear[0] + 2 * i, at_vertex * t);
        // d gap = n . (dp0 - (1 - a) dp1 - a dp2): exact, the turn of n included.
        const double at_foot = (1 - a) * at_start + a * at_end;
        put_pair(to->normal[1] + 2 * i, -at_foot * n);
        // d slip = t . (dp0 - (1 - b) dp1 - b dp2) + g/L n . (dp2 - dp1), b the anchor.
        const double at_anchor = (1 - b) * at_start + b * at_end;
        const double turned = f->turn * (at_end - at_start);
        put_pair(to->shear[1] + 2 * i, -at_anchor * t + turned * n);
    }
}

void nmm_contact_derive(const nmm_model *model, const nmm_contact *contact,
                        const nmm_derivatives *to) {
    const frame f = frame_evaluated(contact);
    if (model->n_local == 3)
        derive(model, contact, &f, 3, to);
    else
        derive(model, contact, &f, model->n_local, to);
}

nmm_contact_row nmm_contact_row_of(const nmm_model *model, const nmm_state *state,
                                   const nmm_contact *contact) {
    const int m = model->n_local;
    const int *cv = model->element_cover + m * (long)model->edge_element[contact->vertex];
    const int *ce = model->element_cover + m * (long)model->edge_element[contact->edge];
    const frame f = frame_of(model, state, contact);
    nmm_contact_row row;
    const nmm_derivatives to = {{row.normal[0], row.normal[m]}, {row.shear[0], row.shear[m]}};
    derive(model, contact, &f, m, &to);
    for (int i = 0; i < m; i++) {
        row.cover[i] = cv[i];
        row.cover[m + i] = ce[i];
    }
    return row;
}

void nmm_contact_pull(const nmm_contact *contact, double pull[6]) {
    const frame f = frame_evaluated(contact);
    const double N = contact->normal_force, T = contact->shear_force;
    const double a = f.foot, b = contact->anchor;
    // The couple of the shear force about the edge, by normal forces at its ends.
    const double turn = f.turn * T;
    const double n1 = -(1 - a) * N - turn, n2 = turn - a * N, t1 = -(1 - b) * T, t2 = -b * T;
    pull[0] = N * f.n.x + T * f.t.x;
    pull[1] = N * f.n.y + T * f.t.y;
    pull[2] = n1 * f.n.x + t1 * f.t.x;
    pull[3] = n1 * f.n.y + t1 * f.t.y;
    pull[4] = n2 * f.n.x + t2 * f.t.x;
    pull[5] = n2 * f.n.y + t2 * f.t.y;
}

// --- Law

static double energy_of(const nmm_contact *c, double N, double T) {
    return 0.5 * N * N / c->normal_stiffness + 0.5 * T * T / c->shear_stiffness;
}

static void set_open(nmm_contact *c) {
    c->normal_force = 0;
    c->shear_force = 0;
    c->mode = NMM_CONTACT_OPEN;
}

// Friction without strength, eq. (5.7). `rounding` [m] is what places are uncertain by.
static void slide_or_stick(nmm_contact *c, double N, double T, double friction, double rounding) {
    set_open(c);
    if (N <= 0) return;
    const double limit = friction * N;
    // A contact that just slid stands exactly at its limit: rounding must not make it stick. The
    // force is what it is, or where rounding is more than friction it would jump.
    const double blur = (c->shear_stiffness + friction * c->normal_stiffness) * rounding;
    const double holds = nmm_max(limit * AT_LIMIT - blur, HOLDS * limit);
    c->normal_force = N;
    c->mode = fabs(T) < holds ? NMM_CONTACT_STICK : NMM_CONTACT_SLIDE;
    c->shear_force = copysign(nmm_min(fabs(T), limit), T);
}

// A bond is elastic during the passes; whether it holds is asked when forces balance.
static void apply_law(const nmm_interface *law, nmm_contact *c, double rounding) {
    const double N = c->carried_normal - c->normal_stiffness * (c->gap - c->rest);
    const double T = c->carried_shear - c->shear_stiffness * c->slip;
    if (c->bonded && !c->breaking) {
        c->mode = NMM_CONTACT_STICK;
        c->normal_force = N;
        c->shear_force = T;
        return;
    }
    const bool broken = c->broken || c->breaking;
    slide_or_stick(c, N, T, broken ? law->residual_friction : law->friction, rounding);
}

// Load of a bond over its strength, eq. (5.8): above 1 it breaks. Cohesion without tensile strength
// stands a millionth of itself in tension, so that rounding does not open an unloaded joint.
static double bond_load(const nmm_interface *law, const nmm_contact *c) {
    const double pull = nmm_max(law->tensile_strength, 1e-6 * law->cohesion) * c->length;
    const double N = c->normal_force;
    const double shear = law->cohesion * c->length + law->friction * nmm_max(N, 0);
    const double tension = N < 0 ? -N / pull : 0;
    const double slip = c->shear_force != 0 ? fabs(c->shear_force) / shear : 0;
    return nmm_max(tension, slip);
}

bool nmm_contact_may_bond(const nmm_model *model) {
    for (int i = 0; i < model->n_interface; i++)
        if (model->interface[i].cohesion > 0 || model->interface[i].tensile_strength > 0)
            return true;
    return false;
}

int nmm_contact_break(const nmm_model *model, nmm_state *state) {
    double worst = 0;
    if (!nmm_contact_may_bond(model)) return 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        if (!c->bonded || c->breaking) continue;
        worst = nmm_max(worst, bond_load(&model->interface[c->interface], c));
    }
    if (worst <= 1) return 0;
    // The most loaded ones first: what they carried goes elsewhere before the others are asked.
    int n = 0;
    for (int k = 0; k < state->n_contact; k++) {
        nmm_contact *c = &state->contact[k];
        if (!c->bonded || c->breaking) continue;
        const double load = bond_load(&model->interface[c->interface], c);
        if (load <= 1 || load < 0.9 * worst) continue;
        c->breaking = true;
        n += 1;
    }
    return n;
}

static void count_change(nmm_contact_verdict *verdict, nmm_contact_mode before,
                         nmm_contact_mode now) {
    if (now == NMM_CONTACT_OPEN)
        verdict->n_opened += 1;
    else if (before == NMM_CONTACT_OPEN)
        verdict->n_closed += 1;
    else if (now == NMM_CONTACT_SLIDE)
        verdict->n_slipped += 1;
    else
        verdict->n_stuck += 1;
}

// Contact k has a new mode: its force may be the largest, the first of equal ones counts.
static void count_worst(nmm_contact_verdict *verdict, int k, double force) {
    const bool first = force == verdict->worst_force && k < verdict->worst;
    if (verdict->worst >= 0 && !(force > verdict->worst_force || first)) return;
    verdict->worst = k;
    verdict->worst_force = force;
}

// In any order: counts, and the largest of all.
static void add_verdict(nmm_contact_verdict *sum, const nmm_contact_verdict *part) {
    sum->n_opened += part->n_opened;
    sum->n_closed += part->n_closed;
    sum->n_slipped += part->n_slipped;
    sum->n_stuck += part->n_stuck;
    sum->n_sliding += part->n_sliding;
    sum->n_slid += part->n_slid;
    if (part->worst >= 0) count_worst(sum, part->worst, part->worst_force);
}

// Contact k, place i of a batch. One whose vertex passes a corner of the other block is open.
static void evaluate(const nmm_model *model, const nmm_state *state, int k, const batch *b, int i,
                     nmm_contact_verdict *verdict) {
    nmm_contact *c = &state->contact[k];
    const nmm_contact_mode before = c->mode;
    verdict->n_slid += before == NMM_CONTACT_SLIDE;
    c->gap = b->gap[i];
    c->slip = b->slip[i];
    c->along = (nmm_vec2){b->along.x[i], b->along.y[i]};
    c->per_edge = b->per_edge[i];
    const nmm_edge_line line = {.t = c->along, .length = b->length[i]};
    if (!c->bonded && passes_corner(model, state, c, &line, c->slip + c->anchor * line.length))
        set_open(c);
    else
        apply_law(&model->interface[c->interface], c, b->rounding[i]);
    verdict->n_sliding += c->mode == NMM_CONTACT_SLIDE;
    if (c->mode == before) return;
    count_change(verdict, before, c->mode);
    count_worst(verdict, k, fabs(c->normal_force) + fabs(c->shear_force));
}

static void evaluate_batch(const nmm_model *model, const nmm_state *state, const int *contact,
                           int first, int end, nmm_contact_verdict *verdict) {
    batch b;
    b.n = nmm_min_int(BATCH, end - first);
    gather(model, state, contact, first, &b);
    measure(&b);
    for (int i = 0; i < b.n; i++)
        evaluate(model, state, contact != NULL ? contact[first + i] : first + i, &b, i, verdict);
}

nmm_contact_verdict nmm_contact_evaluate_some(const nmm_model *model, nmm_state *state,
                                              const int *contact, int n, int n_thread) {
    nmm_contact_verdict verdict = {.worst = -1};
#pragma omp parallel num_threads(n_thread) if (n_thread > 1 && n > 2048)
    {
        nmm_contact_verdict own = {.worst = -1};
#pragma omp for schedule(static) nowait
        for (int i = 0; i < n; i += BATCH)
            evaluate_batch(model, state, contact, i, n, &own);
#pragma omp critical(nmm_verdict)
        add_verdict(&verdict, &own);
    }
    return verdict;
}

nmm_contact_verdict nmm_contact_evaluate(const nmm_contact_search *search, const nmm_model *model,
                                         nmm_state *state, int n_thread) {
    (void)search;
    return nmm_contact_evaluate_some(model, state, NULL, state->n_contact, n_thread);
}

// Part of a force that a spring holds, by its way; ways of rounding hold nothing.
static double share_of(double way, double stiffness, double force, double rounding) {
    return fabs(way) > rounding ? fabs(way) * stiffness / force : 0;
}

double nmm_contact_give(const nmm_contact_search *search, const nmm_model *model,
                        const nmm_state *state) {
    const double rounding = 1e-14 * model->height;
    double largest = 0, worst = 0;
    if (!search->options.augmented) return 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        if (!c->hasty) largest = nmm_max(largest, fabs(c->normal_force) + fabs(c->shear_force));
    }
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        if (c->mode == NMM_CONTACT_OPEN || c->hasty) continue;
        const double own = fabs(c->normal_force) + fabs(c->shear_force);
        const double force = nmm_max(own, 1e-3 * largest);
        // Friction that acts along its slip: the spring of a carried force that was larger.
        const bool springs = c->mode == NMM_CONTACT_STICK || c->shear_force * c->slip > 0;
        const double slip = springs ? c->slip : 0;
        worst = nmm_max(worst, share_of(c->gap - c->rest, c->normal_stiffness, force, rounding));
        worst = nmm_max(worst, share_of(slip, c->shear_stiffness, force, rounding));
    }
    return worst;
}

double nmm_contact_rounding(const nmm_contact_search *search, const nmm_model *model,
                            const nmm_state *state) {
    double stiffest = 0, largest = 0;
    if (!search->options.augmented) return 0;
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *c = &state->contact[k];
        if (c->mode == NMM_CONTACT_OPEN || c->hasty) continue;
        stiffest = nmm_max(stiffest, c->normal_stiffness * nmm_contact_way(model, state, c));
        largest = nmm_max(largest, fabs(c->normal_force));
    }
    return stiffest > 0 ? DBL_EPSILON * stiffest / largest : 0;
}

void nmm_contact_raise(const nmm_contact_search *search, nmm_state *state, double stiffer) {
    if (!search->options.augmented) return;
    for (int k = 0; k < state->n_contact; k++) {
        nmm_contact *c = &state->contact[k];
        if (c->mode == NMM_CONTACT_OPEN || c->hasty) continue;
        c->carried_normal = c->normal_force;
        c->carried_shear = c->shear_force;
        c->normal_stiffness *= stiffer;
        c->shear_stiffness *= stiffer;
    }
}

// --- Accepted

// A sliding contact's anchor follows, so that the spring holds just the limit: no creep afterwards.
// Where carried forces follow they hold all of it: the spring may have another stiffness next time.
static double commit_slide(const nmm_contact_search *search, nmm_contact *c, double length) {
    if (search->options.augmented && !c->hasty) c->carried_shear = c->shear_force;
    const double T = c->carried_shear - c->shear_stiffness * c->slip;
    const double slid = (c->shear_force - T) / c->shear_stiffness;
    c->anchor += (c->slip - (c->carried_shear - c->shear_force) / c->shear_stiffness) / length;
    c->slip = (c->carried_shear - c->shear_force) / c->shear_stiffness;
    c->slid += fabs(slid);
    return fabs(c->shear_force * slid);
}

// An open contact remembers nothing but where its vertex is.
static void commit_open(nmm_contact *c, double length) {
    c->anchor += c->slip / length;
    c->slip = 0;
    c->carried_normal = 0;
    c->carried_shear = 0;
    // An overlap without force shrinks with the real one, and never grows.
    c->rest = nmm_max(c->rest, nmm_min(0, c->gap));
}

double nmm_contact_stored_in(const nmm_contact_search *search, const nmm_contact *c) {
    if (c->mode == NMM_CONTACT_OPEN) return 0;
    if (!search->options.augmented) return energy_of(c, c->normal_force, c->shear_force);
    // What the forces give back on the way to no overlap and no slip; there they are carried alone.
    const double slip = c->slip;
    const double overlap = c->gap - c->rest;
    return (0.5 * c->normal_stiffness * overlap - c->carried_normal) * overlap +
           (0.5 * c->shear_stiffness * slip - c->carried_shear) * slip;
}

// Energy of a bond's springs when the step began that neither friction nor springs have now: the
// forces fall without a way. Forces that are carried in long steps store nothing.
static double lost_in_break(const nmm_contact_search *search, const nmm_contact *c) {
    if (search->options.augmented && !c->hasty) return 0;
    const double pull = nmm_max(0, -c->bond_normal);
    const double shear = nmm_max(0, fabs(c->bond_shear) - fabs(c->shear_force));
    return energy_of(c, pull, shear);
}

// Elastic energy; a bond keeps the forces of now.
static double store(const nmm_contact_search *search, nmm_contact *c) {
    c->bond_normal = c->bonded ? c->normal_force : 0;
    c->bond_shear = c->bonded ? c->shear_force : 0;
    return nmm_contact_stored_in(search, c);
}

void nmm_contact_commit(const nmm_contact_search *search, const nmm_model *model, nmm_state *state,
                        nmm_contact_energy *energy) {
    double sum = 0;
    for (int k = 0; k < state->n_contact; k++) {
        nmm_contact *c = &state->contact[k];
        const double length =
            c->mode != NMM_CONTACT_STICK ? nmm_edge_line_of(model, state, c->edge).length : 0;
        if (c->mode == NMM_CONTACT_SLIDE) energy->friction += commit_slide(search, c, length);
        if (c->mode == NMM_CONTACT_OPEN) commit_open(c, length);
        if (c->breaking) energy->fracture += lost_in_break(search, c);
        c->bonded &= !c->breaking;
        c->broken |= c->breaking;
        c->breaking = false;
        sum += store(search, c);
    }
    energy->elastic = sum;
}

double nmm_contact_stored(const nmm_contact_search *search, nmm_state *state) {
    double sum = 0;
    for (int k = 0; k < state->n_contact; k++)
        sum += store(search, &state->contact[k]);
    return sum;
}
