// SPDX-License-Identifier: MIT
//
// Where elements with covers of order > 0 are integrated. The polygon of an element is divided into
// triangles by cutting off ears, in integers and by geometry alone; each triangle gets the points
// of a symmetric rule (Dunavant 1985): of degree 2 p for the strain energy of order p, and once, of
// degree 2 p + 2, for the products of functions in the mass. Corners on straight sides make no
// triangle of their own. Where no ear is found, which exact arithmetic leaves to polygons that
// touch themselves, the rest is divided as a fan whose triangles have signs: integrals of
// polynomials are the same.

#include "cut.h"

#include <math.h>

// Diagonals whose squares differ by less are equal: places are rounded.
#define NMM_EVEN 1e-6

// --- Pieces

// A polygon while ears are cut off it: corners in a ring.
typedef struct ear_ring {
    int n;
    const nmm_ipoint *place;
    int *next, *prev;
} ear_ring;

static nmm_status add_piece(nmm_cut *cut, nmm_ipoint a, nmm_ipoint b, nmm_ipoint c) {
    nmm_draft *draft = &cut->draft;
    TRY(nmm_grow(cut->context, &draft->piece, &draft->piece_capacity, draft->n_piece + 1,
                 sizeof *draft->piece));
    nmm_ipoint *piece = draft->piece[draft->n_piece++];
    piece[0] = a, piece[1] = b, piece[2] = c;
    return NMM_OK;
}

// Is q in the triangle a b c, its sides included, and at none of its corners?
static bool is_inside(nmm_ipoint q, nmm_ipoint a, nmm_ipoint b, nmm_ipoint c) {
    if (nmm_ipoint_equal(q, a) || nmm_ipoint_equal(q, b) || nmm_ipoint_equal(q, c)) return false;
    return nmm_orientation(a, b, q) >= 0 && nmm_orientation(b, c, q) >= 0 &&
           nmm_orientation(c, a, q) >= 0;
}

// May corner i be cut off? Only then does its triangle lie inside the polygon.
static bool is_ear(const ear_ring *ring, int i) {
    const nmm_ipoint a = ring->place[ring->prev[i]], b = ring->place[i];
    const nmm_ipoint c = ring->place[ring->next[i]];
    const int end = ring->prev[i];
    if (nmm_orientation(a, b, c) <= 0) return false;
    for (int k = ring->next[ring->next[i]]; k != end; k = ring->next[k]) {
        if (is_inside(ring->place[k], a, b, c)) return false;
    }
    return true;
}

// Corner i leaves the ring, with its triangle where that has an area.
static nmm_status cut_off(nmm_cut *cut, ear_ring *ring, int i) {
    const int before = ring->prev[i], after = ring->next[i];
    const nmm_ipoint a = ring->place[before], b = ring->place[i], c = ring->place[after];
    if (nmm_orientation(a, b, c) != 0) TRY(add_piece(cut, a, b, c));
    ring->next[before] = after;
    ring->prev[after] = before;
    ring->n -= 1;
    return NMM_OK;
}

static bool is_straight(const ear_ring *ring, int i) {
    return nmm_orientation(ring->place[ring->prev[i]], ring->place[i],
                           ring->place[ring->next[i]]) == 0;
}

static double squared_distance(nmm_ipoint a, nmm_ipoint b) {
    const double x = (double)(b.x - a.x), y = (double)(b.y - a.y);
    return x * x + y * y;
}

// The corner to cut off: a straight one, else the ear with the shortest base, so that geometry
// decides and not where the list of corners begins; -1: there is none.
static int choose_corner(const ear_ring *ring, int start) {
    double least = INFINITY;
    int best = -1;
    for (int k = 0, i = start; k < ring->n; k++, i = ring->next[i]) {
        if (is_straight(ring, i)) return i;
        const double base =
            squared_distance(ring->place[ring->prev[i]], ring->place[ring->next[i]]);
        if (base >= least || !is_ear(ring, i)) continue;
        best = i, least = base;
    }
    return best;
}

// Four corners with two equal diagonals are divided by neither, but about their middle.
static nmm_status divide_evenly(nmm_cut *cut, ear_ring *ring, int start) {
    nmm_ipoint corner[4], middle = {0, 0};
    for (int k = 0, i = start; k < 4; k++, i = ring->next[i]) {
        corner[k] = ring->place[i];
        middle.x += corner[k].x / 4, middle.y += corner[k].y / 4;
    }
    const double a = squared_distance(corner[0], corner[2]);
    const double b = squared_distance(corner[1], corner[3]);
    if (fabs(a - b) > NMM_EVEN * a) return NMM_OK;
    for (int k = 0; k < 4; k++) {
        if (nmm_orientation(corner[k], corner[(k + 1) % 4], middle) <= 0) return NMM_OK;
    }
    ring->n = 0;
    for (int k = 0; k < 4; k++)
        TRY(add_piece(cut, corner[k], corner[(k + 1) % 4], middle));
    return NMM_OK;
}

static nmm_status cut_ears(nmm_cut *cut, ear_ring *ring) {
    int i = 0;
    while (ring->n >= 3) {
        int at = choose_corner(ring, i);
        if (ring->n == 4 && at >= 0 && !is_straight(ring, at)) {
            TRY(divide_evenly(cut, ring, at));
            if (ring->n == 0) break;
        }
        // No ear: one triangle of a fan round corner i.
        if (at < 0) at = ring->next[i];
        i = ring->next[at];
        TRY(cut_off(cut, ring, at));
    }
    return NMM_OK;
}

static nmm_status cut_element(nmm_cut *cut, int e, ear_ring *ring, nmm_ipoint *place) {
    const nmm_draft *draft = &cut->draft;
    const bool last = e + 1 == draft->n_element;
    const int begin = draft->element[e].first_corner;
    ring->n = (last ? draft->n_corner : draft->element[e + 1].first_corner) - begin;
    for (int k = 0; k < ring->n; k++) {
        place[k] = draft->point[draft->corner[begin + k]].place;
        ring->next[k] = k + 1 < ring->n ? k + 1 : 0;
        ring->prev[k] = k > 0 ? k - 1 : ring->n - 1;
    }
    return cut_ears(cut, ring);
}

nmm_status nmm_cut_pieces(nmm_cut *cut) {
    nmm_draft *draft = &cut->draft;
    nmm_arena *arena = &cut->body.arena;
    const size_t most = (size_t)draft->n_corner;
    nmm_ipoint *place = NULL;
    ear_ring ring = {0};
    TRY(nmm_arena_take(cut->context, arena, &place, most, sizeof *place));
    TRY(nmm_arena_take(cut->context, arena, &ring.next, most, sizeof(int)));
    TRY(nmm_arena_take(cut->context, arena, &ring.prev, most, sizeof(int)));
    TRY(nmm_allocate(cut->context, &draft->piece_start, (size_t)draft->n_element + 1, sizeof(int)));
    ring.place = place;
    for (int e = 0; e < draft->n_element; e++) {
        TRY(cut_element(cut, e, &ring, place));
        draft->piece_start[e + 1] = draft->n_piece;
    }
    return NMM_OK;
}

// --- Rules

// A point of a rule by its barycentric coordinates; with the two turns of its corners if they
// differ, and with all six orders where all three differ.
typedef struct orbit {
    double a, b, weight;
} orbit;

static const orbit degree_2[] = {{2.0 / 3, 1.0 / 6, 1.0 / 3}};
static const orbit degree_4[] = {
    {0.108103018168070227360, 0.445948490915964886320, 0.223381589678011465700},
    {0.816847572980458513080, 0.091576213509770743460, 0.109951743655321867630},
};
static const orbit degree_6[] = {
    {0.501426509658179157420, 0.249286745170910421290, 0.116786275726379366030},
    {0.873821971016995545290, 0.063089014491502227350, 0.050844906370206816920},
    {0.636502499121398647230, 0.310352451033784405420, 0.082851075618373575190},
};

enum { MOST_POINTS = 12 };

typedef struct rule {
    int n;
    double at[MOST_POINTS][3], weight[MOST_POINTS];
} rule;

static void add_point(rule *r, double a, double b, double c, double weight) {
    r->at[r->n][0] = a, r->at[r->n][1] = b, r->at[r->n][2] = c;
    r->weight[r->n++] = weight;
}

static rule rule_of(int n, const orbit *from) {
    rule r = {0};
    for (int k = 0; k < n; k++) {
        const double a = from[k].a, b = from[k].b, c = 1 - a - b, weight = from[k].weight;
        add_point(&r, a, b, c, weight);
        add_point(&r, b, c, a, weight);
        add_point(&r, c, a, b, weight);
        if (nmm_max(b - c, c - b) < 1e-9) continue;
        add_point(&r, b, a, c, weight);
        add_point(&r, a, c, b, weight);
        add_point(&r, c, b, a, weight);
    }
    return r;
}

// For the strain energy of an order.
static rule energy_rule(int order) {
    return order == 1 ? rule_of(1, degree_2) : rule_of(2, degree_4);
}

// For products of the functions of an order.
static rule product_rule(int order) {
    return order == 1 ? rule_of(2, degree_4) : rule_of(3, degree_6);
}

int nmm_cut_samples(const nmm_cut *cut) {
    const int order = nmm_cut_order(cut);
    return order > 0 ? cut->draft.n_piece * energy_rule(order).n : 0;
}

// --- Samples

// Linear functions of element e at point k of a rule on a triangle whose corners have linear[3][3].
static void linear_inside(const rule *r, int k, double linear[3][3], double at[3]) {
    for (int i = 0; i < 3; i++) {
        at[i] =
            r->at[k][0] * linear[0][i] + r->at[k][1] * linear[1][i] + r->at[k][2] * linear[2][i];
    }
}

static void add_products(nmm_model *model, int e, const double at[3], double area) {
    const int m = model->n_local;
    double value[NMM_MOST_LOCAL];
    double *gram = model->element_gram + (long)e * m * (m + 1) / 2;
    nmm_functions_value(model, e, at, value);
    for (int i = 0, k = 0; i < m; i++) {
        for (int j = i; j < m; j++)
            gram[k++] += area * value[i] * value[j];
    }
}

static void fill_piece(const nmm_cut *cut, nmm_model *model, int e, int p, const rule rules[2]) {
    const nmm_ipoint *corner = cut->draft.piece[p];
    const rule *energy = &rules[0], *product = &rules[1];
    const double unit = cut->lattice.spacing;
    const double area = (double)nmm_ipolygon_area(3, corner) / 2 * unit * unit;
    double linear[3][3], at[3];
    for (int k = 0; k < 3; k++)
        nmm_lattice_weights(&cut->lattice, cut->draft.element[e].triangle, corner[k], linear[k]);
    for (int k = 0; k < energy->n; k++) {
        const long s = (long)energy->n * p + k;
        model->sample_area[s] = energy->weight[k] * area;
        linear_inside(energy, k, linear, model->sample_linear + 3 * s);
    }
    for (int k = 0; k < product->n; k++) {
        linear_inside(product, k, linear, at);
        add_products(model, e, at, product->weight[k] * area);
    }
}

void nmm_cut_fill_samples(const nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    const rule rules[2] = {energy_rule(model->order), product_rule(model->order)};
    for (int e = 0; e < draft->n_element; e++) {
        model->sample_start[e + 1] = draft->piece_start[e + 1] * rules[0].n;
        for (int p = draft->piece_start[e]; p < draft->piece_start[e + 1]; p++)
            fill_piece(cut, model, e, p, rules);
    }
}

// --- Ties

// Adds the products of the jump over the triangle of element `on`.
static void add_jump(const nmm_model *model, int t, int on, const rule *r) {
    const int m = model->n_local, n = 2 * m, *pair = model->tie_element + 2 * (long)t;
    const int *node = model->element_cover + m * (long)on;
    const double *g = model->element_gradient + 6 * (long)on;
    const double area = 0.5 / (g[0] * g[3] - g[1] * g[2]);
    double *gram = model->tie_gram + (long)t * n * (n + 1) / 2;
    for (int k = 0; k < r->n; k++) {
        nmm_vec2 place = {0, 0};
        for (int i = 0; i < 3; i++) {
            place.x += r->at[k][i] * model->cover_place[2 * (long)node[i]];
            place.y += r->at[k][i] * model->cover_place[2 * (long)node[i] + 1];
        }
        double jump[2 * NMM_MOST_LOCAL] = {0};
        nmm_element_weights(model, pair[0], place, jump);
        nmm_element_weights(model, pair[1], place, jump + m);
        // A cell and itself: what is not linear.
        for (int i = 0; i < m; i++)
            jump[m + i] = pair[0] == pair[1] ? 0 : -jump[m + i];
        for (int i = 0; i < 3 && pair[0] == pair[1]; i++)
            jump[i] = 0;
        for (int i = 0, at = 0; i < n; i++) {
            for (int j = i; j < n; j++)
                gram[at++] += r->weight[k] * area * jump[i] * jump[j];
        }
    }
}

nmm_status nmm_cut_fill_ties(nmm_context *context, nmm_model *model) {
    const size_t n = 2 * (size_t)model->n_local, n_pair = n * (n + 1) / 2;
    if (model->n_tie == 0) return NMM_OK;
    TRY(nmm_allocate(context, &model->tie_gram, (size_t)model->n_tie * n_pair, sizeof(double)));
    const rule r = product_rule(model->order);
    for (int t = 0; t < model->n_tie; t++) {
        add_jump(model, t, model->tie_element[2 * (long)t], &r);
        if (model->tie_element[2 * (long)t + 1] == model->tie_element[2 * (long)t]) continue;
        add_jump(model, t, model->tie_element[2 * (long)t + 1], &r);
    }
    return NMM_OK;
}
