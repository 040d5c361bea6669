// SPDX-License-Identifier: MIT
//
// Slivers of triangles, order > 0. On a piece that is a small part of its triangle the functions
// are almost dependent, and so are the rows of the matrix. A cell, the elements of one triangle
// that have all their covers in common, is tied to its neighbour across an edge of the triangle by
// the difference of their two polynomials over both whole triangles, eq. (2.18). Ties lead from
// slivers to cells that are none, in at most MOST_TIES steps: what is thin by itself is left alone,
// until it is a crumb of its triangle. A crumb without a neighbour to lean on is tied to its linear
// part.

#include "cut.h"

#include <math.h>

// Cells with less of their triangle than this are tied; to themselves below CRUMB.
#define SLIVER 0.3
#define CRUMB 1e-3

enum { MOST_TIES = 2 };

static bool same_triangle(const nmm_model *model, int e, int f) {
    const int *a = model->element_cover + model->n_local * (long)e;
    const int *b = model->element_cover + model->n_local * (long)f;
    for (int i = 0; i < 3; i++) {
        if (model->cover_node[a[i]] != model->cover_node[b[i]]) return false;
    }
    return true;
}

static double triangle_area(const nmm_model *model, int e) {
    const double *g = model->element_gradient + 6 * (long)e;
    return 0.5 / fabs(g[0] * g[3] - g[1] * g[2]);
}

// Is e the first element of its cell? *part is the share of its triangle that the cell has. All of
// a cell's elements have its first edge's cover.
static bool measure_cell(const nmm_model *model, int e, double *part) {
    const int cover = model->element_cover[model->n_local * (long)e + 3];
    double area = 0;
    for (int k = model->cover_start[cover]; k < model->cover_start[cover + 1]; k++) {
        const int f = model->cover_element[k] / model->n_local;
        if (!nmm_same_covers(model, e, f)) continue;
        if (f < e) return false;
        area += model->element_area[f];
    }
    *part = area / triangle_area(model, e);
    return true;
}

// What a search for ties knows: of each cell, by its first element, the number of ties to a cell
// that is no sliver; MOST_TIES + 1: more, and for elements that are not the first of a cell.
typedef struct tie_search {
    const nmm_model *model;
    unsigned char *distance;
} tie_search;

// Elements k of a cover in other triangles than e's, first of their cells.
static bool is_across(const tie_search *s, int e, int f) {
    return f != e && s->distance[f] <= MOST_TIES && !same_triangle(s->model, e, f);
}

// Shortens the distance of cell e by its neighbours of distance `near`.
static void come_near(const tie_search *s, int e, int near) {
    const nmm_model *model = s->model;
    const int m = model->n_local;
    for (int a = 0; a < 3; a++) {
        const int cover = model->element_cover[m * (long)e + 3 + a];
        for (int k = model->cover_start[cover]; k < model->cover_start[cover + 1]; k++) {
            const int f = model->cover_element[k] / m;
            if (is_across(s, e, f) && s->distance[f] == near)
                s->distance[e] = (unsigned char)(near + 1);
        }
    }
}

// distance[e] of all elements; the first of a cell that is not reached keeps MOST_TIES + 1.
static int measure_distances(const tie_search *s, unsigned char *first) {
    const nmm_model *model = s->model;
    int n_sliver = 0;
    for (int e = 0; e < model->n_element; e++) {
        double part = 0;
        first[e] = measure_cell(model, e, &part);
        s->distance[e] = first[e] && part >= SLIVER ? 0 : MOST_TIES + 1;
        n_sliver += first[e] && part < SLIVER;
    }
    for (int near = 0; near < MOST_TIES && n_sliver > 0; near++) {
        for (int e = 0; e < model->n_element; e++)
            if (first[e] && s->distance[e] > near + 1) come_near(s, e, near);
    }
    return n_sliver;
}

static nmm_status add_tie(nmm_context *context, nmm_model *model, int *capacity, int e, int f) {
    TRY(nmm_grow(context, &model->tie_element, capacity, model->n_tie + 1, 2 * sizeof(int)));
    model->tie_element[2 * (long)model->n_tie] = e;
    model->tie_element[2 * (long)model->n_tie + 1] = f;
    model->n_tie += 1;
    return NMM_OK;
}

// A cell that reaches no other, and is too small to stand by itself: a pair with itself.
static nmm_status tie_crumb(nmm_context *context, nmm_model *model, int e, int *capacity) {
    double part = 0;
    if (!measure_cell(model, e, &part) || part >= CRUMB) return NMM_OK;
    return add_tie(context, model, capacity, e, e);
}

// From each sliver to its neighbours that are one tie nearer.
static nmm_status list_ties(nmm_context *context, const tie_search *s, nmm_model *model) {
    const int m = model->n_local;
    int capacity = 0;
    for (int e = 0; e < model->n_element; e++) {
        if (s->distance[e] > MOST_TIES) TRY(tie_crumb(context, model, e, &capacity));
        if (s->distance[e] == 0 || s->distance[e] > MOST_TIES) continue;
        for (int a = 0; a < 3; a++) {
            const int cover = model->element_cover[m * (long)e + 3 + a];
            for (int k = model->cover_start[cover]; k < model->cover_start[cover + 1]; k++) {
                const int f = model->cover_element[k] / m;
                if (is_across(s, e, f) && s->distance[f] + 1 == s->distance[e])
                    TRY(add_tie(context, model, &capacity, e, f));
            }
        }
    }
    return NMM_OK;
}

nmm_status nmm_cut_ties(nmm_context *context, nmm_model *model) {
    unsigned char *first = NULL;
    tie_search s = {.model = model};
    const size_t n = (size_t)model->n_element;
    nmm_status status = nmm_allocate(context, &first, n, 1);
    if (status == NMM_OK) status = nmm_allocate(context, &s.distance, n, 1);
    if (status == NMM_OK && measure_distances(&s, first) > 0)
        status = list_ties(context, &s, model);
    nmm_release(context, &first);
    nmm_release(context, &s.distance);
    return status;
}
