// SPDX-License-Identifier: MIT
//
// Every invariant of the model's tables that the cutting promises. Used by tests, and by builds
// with validation; nothing is repaired. The first broken one is named.

#include "cover.h"

#include <math.h>

// Weights come from places that are rounded to the integer lattice, and so may leave the triangle
// by this much.
#define SLACK 1e-6

#define CHECK(condition, ...)                                                                      \
    do {                                                                                           \
        if (!(condition)) return nmm_fail(context, NMM_ERROR_NUMERIC, __VA_ARGS__);                \
    } while (0)

static bool within(int i, int n) {
    return i >= 0 && i < n;
}

static nmm_vec2 point_place(const nmm_model *m, int p) {
    return (nmm_vec2){m->point[2 * p], m->point[2 * p + 1]};
}

// Length over thickness of the triangle of element e, at least 1: digits that a sliver loses.
static double slenderness(const nmm_model *m, int e) {
    double steep = 0, far = 0;
    const int *cover = m->element_cover + m->n_local * (long)e;
    for (int k = 0; k < 6; k++) {
        const double *a = m->cover_place + 2 * (long)cover[k / 2];
        const double *b = m->cover_place + 2 * (long)cover[(k / 2 + 1) % 3];
        steep = nmm_max(steep, fabs(m->element_gradient[6 * (long)e + k]));
        far = nmm_max(far, fabs(a[k % 2] - b[k % 2]));
    }
    return nmm_max(1, steep * far);
}

// Are these the weights of a place within the triangle? Those of whole blocks may be negative.
static bool weights_good(const nmm_model *m, int e, const double w[3]) {
    for (int i = 0; i < 3 && !m->whole_blocks; i++) {
        if (!(w[i] >= -SLACK && w[i] <= 1 + SLACK)) return false;
    }
    return fabs(w[0] + w[1] + w[2] - 1) <= 1e-12 * slenderness(m, e);
}

// Do the weights of element e reproduce the place x = sum w_i X_i?
static bool reproduces(const nmm_model *m, int e, const double w[3], nmm_vec2 place) {
    const double tolerance = 1e-12 * (m->height + m->size) * slenderness(m, e);
    for (int k = 0; k < 2; k++) {
        double x = 0;
        for (int i = 0; i < 3; i++)
            x += w[i] * m->cover_place[2 * m->element_cover[m->n_local * e + i] + k];
        if (!(fabs(x - (k == 0 ? place.x : place.y)) <= tolerance)) return false;
    }
    return true;
}

static nmm_status check_cover(nmm_context *context, const nmm_model *m, int c) {
    const int begin = m->cover_start[c], end = m->cover_start[c + 1];
    CHECK(within(m->cover_block[c], m->n_block), "cover %d: block %d", c, m->cover_block[c]);
    CHECK(begin < end, "cover %d has no element", c);
    for (int k = begin; k < end; k++) {
        const int slot = m->cover_element[k];
        CHECK(within(slot, m->n_local * m->n_element), "cover %d: slot %d", c, slot);
        CHECK(m->element_cover[slot] == c, "cover %d: element %d does not have it", c,
              slot / m->n_local);
        CHECK(k == begin || m->cover_element[k - 1] < slot, "cover %d: elements not sorted", c);
    }
    return NMM_OK;
}

static nmm_status check_gradient(nmm_context *context, const nmm_model *m, int e) {
    const double *g = m->element_gradient + 6 * (long)e;
    // Gradients sum to zero and give grad x = (1, 0), grad y = (0, 1).
    double sum[2] = {0}, grad[4] = {0};
    for (int i = 0; i < 3; i++) {
        const double *place = m->cover_place + 2 * (long)m->element_cover[m->n_local * e + i];
        for (int k = 0; k < 2; k++) {
            sum[k] += g[2 * i + k];
            grad[k] += place[0] * g[2 * i + k];
            grad[2 + k] += place[1] * g[2 * i + k];
        }
    }
    const double unit[4] = {1, 0, 0, 1};
    double steep = 0;
    for (int k = 0; k < 6; k++)
        steep = nmm_max(steep, fabs(g[k]));
    const double error = 1e-13 * (1 + m->height * steep) * slenderness(m, e);
    CHECK(fabs(sum[0]) + fabs(sum[1]) <= error * steep, "element %d: gradients", e);
    for (int k = 0; k < 4; k++)
        CHECK(fabs(grad[k] - unit[k]) <= 10 * error, "element %d: gradients", e);
    return NMM_OK;
}

static nmm_status check_element(nmm_context *context, const nmm_model *m, int e) {
    const int begin = m->element_start[e], end = m->element_start[e + 1];
    const nmm_vec2 centre = {m->element_centre[2 * e], m->element_centre[2 * e + 1]};
    const double *w = m->element_weight + 3 * (long)e;
    CHECK(within(m->element_block[e], m->n_block), "element %d: block", e);
    CHECK(m->element_material[e] >= 0, "element %d: material", e);
    CHECK(m->element_area[e] > 0, "element %d: area %g", e, m->element_area[e]);
    CHECK(end - begin >= 3, "element %d has %d corners", e, end - begin);
    for (int i = 0; i < m->n_local; i++) {
        const int c = m->element_cover[m->n_local * e + i];
        CHECK(within(c, m->n_cover), "element %d: cover %d", e, c);
        CHECK(m->cover_block[c] == m->element_block[e], "element %d: cover of another block", e);
    }
    TRY(check_gradient(context, m, e));
    CHECK(weights_good(m, e, w), "element %d: weights %g %g %g", e, w[0], w[1], w[2]);
    CHECK(reproduces(m, e, w, centre), "element %d: weights miss the centroid", e);
    // Corners belong to the element's covers: their weights give their places.
    double area = 0, across = 0;
    for (int k = begin; k < end; k++) {
        CHECK(within(m->corner_point[k], m->n_point), "element %d: corner", e);
        const nmm_vec2 p = point_place(m, m->corner_point[k]);
        const nmm_vec2 q = point_place(m, m->corner_point[k + 1 < end ? k + 1 : begin]);
        const nmm_vec2 a = nmm_vec2_sub(p, centre), b = nmm_vec2_sub(q, centre);
        double weight[3];
        nmm_element_linear(m, e, p, weight);
        CHECK(weights_good(m, e, weight), "element %d: corner outside its triangle", e);
        area += nmm_vec2_cross(a, b) / 2;
        across = nmm_max(across, nmm_vec2_dot(a, a));
    }
    CHECK(fabs(area - m->element_area[e]) <= 1e-9 * area + 1e-12 * across,
          "element %d: area %g, polygon %g", e, m->element_area[e], area);
    return NMM_OK;
}

static nmm_status check_point(nmm_context *context, const nmm_model *m, int p) {
    const int e = m->point_element[p];
    const double *w = m->point_weight + m->n_local * (long)p;
    CHECK(within(e, m->n_element), "point %d: element %d", p, e);
    CHECK(weights_good(m, e, w), "point %d: weights %g %g %g", p, w[0], w[1], w[2]);
    CHECK(reproduces(m, e, w, point_place(m, p)), "point %d: weights miss its place", p);
    return NMM_OK;
}

static nmm_status check_vertex(nmm_context *context, const nmm_model *m, int v) {
    const int next = m->vertex_next[v], prev = m->vertex_prev[v], mate = m->edge_mate[v];
    const int e = m->edge_element[v];
    const double *w = m->edge_weight + 2 * m->n_local * (long)v;
    CHECK(within(next, m->n_vertex) && within(prev, m->n_vertex), "vertex %d: neighbours", v);
    CHECK(m->vertex_prev[next] == v && m->vertex_next[prev] == v, "vertex %d: loop broken", v);
    CHECK(next != v, "vertex %d: loop of one", v);
    CHECK(within(m->vertex_point[v], m->n_point), "vertex %d: point", v);
    CHECK(within(e, m->n_element), "vertex %d: element", v);
    CHECK(m->element_block[e] == m->vertex_block[v], "vertex %d: block", v);
    CHECK(m->vertex_block[next] == m->vertex_block[v], "vertex %d: loop changes block", v);
    CHECK(m->edge_interface[v] >= -1 && m->edge_interface[v] < m->n_interface,
          "vertex %d: interface", v);
    const nmm_vec2 p = point_place(m, m->vertex_point[v]);
    const nmm_vec2 q = point_place(m, m->vertex_point[next]);
    CHECK(p.x != q.x || p.y != q.y, "edge %d has no length", v);
    CHECK(weights_good(m, e, w) && weights_good(m, e, w + m->n_local), "edge %d: weights", v);
    CHECK(reproduces(m, e, w, p) && reproduces(m, e, w + m->n_local, q), "edge %d: weights", v);
    if (mate < 0) return NMM_OK;
    CHECK(within(mate, m->n_vertex) && mate != v && m->edge_mate[mate] == v, "edge %d: mate", v);
    const nmm_vec2 r = point_place(m, m->vertex_point[mate]);
    const nmm_vec2 s = point_place(m, m->vertex_point[m->vertex_next[mate]]);
    CHECK(p.x == s.x && p.y == s.y && q.x == r.x && q.y == r.y, "edge %d: mate elsewhere", v);
    CHECK(m->edge_interface[v] >= 0, "edge %d: a mate, but no joint", v);
    return NMM_OK;
}

// Loops bound the elements: the area inside all loops is the area of all elements.
static nmm_status check_area(nmm_context *context, const nmm_model *m) {
    double area = 0, loops = 0;
    for (int e = 0; e < m->n_element; e++)
        area += m->element_area[e];
    for (int v = 0; v < m->n_vertex; v++) {
        const nmm_vec2 p = point_place(m, m->vertex_point[v]);
        const nmm_vec2 q = point_place(m, m->vertex_point[m->vertex_next[v]]);
        loops += nmm_vec2_cross(p, q) / 2;
    }
    const double rounding = 1e-14 * (m->n_vertex + 100) * m->height * m->height;
    CHECK(fabs(area - loops) <= 1e-12 * area + rounding, "elements cover %.17g m2, loops %.17g m2",
          area, loops);
    return NMM_OK;
}

nmm_status nmm_cover_check(nmm_context *context, const nmm_model *model) {
    for (int c = 0; c < model->n_cover; c++)
        TRY(check_cover(context, model, c));
    CHECK(model->cover_start[model->n_cover] == model->n_local * model->n_element,
          "cover table incomplete");
    for (int e = 0; e < model->n_element; e++)
        TRY(check_element(context, model, e));
    for (int p = 0; p < model->n_point; p++)
        TRY(check_point(context, model, p));
    for (int v = 0; v < model->n_vertex; v++)
        TRY(check_vertex(context, model, v));
    return check_area(context, model);
}
