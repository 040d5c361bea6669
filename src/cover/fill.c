// SPDX-License-Identifier: MIT
//
// The draft becomes the model: all tables of model_fields.inl, and what the model takes over from
// the scene. Areas and moments are integrated over the snapped polygons, whose coordinates doubles
// hold exactly.

#include "cut.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// --- Elements and covers

// Lattice nodes are numbered in the order in which covers mention them.
static nmm_status fill_covers(nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    const int n = draft->n_cover;
    nmm_ipoint *node = NULL, *spare = NULL;
    nmm_arena *arena = &cut->body.arena;
    TRY(nmm_arena_take(cut->context, arena, &node, (size_t)n, sizeof *node));
    TRY(nmm_arena_take(cut->context, arena, &spare, (size_t)n, sizeof *spare));
    for (int c = 0; c < n; c++) {
        const nmm_node at = draft->cover[c].node;
        const nmm_vec2 place = cut->frame != NULL ? cut->frame[at.j].node[at.i]
                                                  : nmm_lattice_between(&cut->lattice, at);
        model->cover_block[c] = draft->cover[c].block;
        model->cover_place[2 * c] = place.x;
        model->cover_place[2 * c + 1] = place.y;
        // Row, then column with the cover packed behind.
        node[c] = (nmm_ipoint){at.j, at.i * (INT64_C(1) << 32) + c};
    }
    const nmm_ipoint *sorted = nmm_ipoint_sort(n, node, spare);
    for (int k = 0, number = -1; k < n; k++) {
        const bool same =
            k > 0 && sorted[k].x == sorted[k - 1].x && sorted[k].y >> 32 == sorted[k - 1].y >> 32;
        number += !same;
        model->cover_node[sorted[k].y & INT64_C(0xffffffff)] = number;
    }
    return NMM_OK;
}

// Area, centroid and moments of one element; `corner` has room for its polygon.
static void fill_element(const nmm_cut *cut, nmm_model *model, int e, nmm_ipoint *place,
                         nmm_vec2 *corner) {
    const nmm_draft *draft = &cut->draft;
    const int begin = model->element_start[e], n = model->element_start[e + 1] - begin;
    for (int k = 0; k < n; k++) {
        place[k] = draft->point[draft->corner[begin + k]].place;
        corner[k] = nmm_lattice_place(&cut->lattice, place[k]);
    }
    const double unit = cut->lattice.spacing;
    nmm_moments moments = nmm_polygon_moments(n, corner);
    // The area is exact. Where the integrals of a sliver drowned in rounding, it has no moments.
    const double area = (double)nmm_ipolygon_area(n, place) / 2 * unit * unit;
    if (!(moments.area > area / 2 && moments.area < 2 * area)) {
        moments = (nmm_moments){.centre = corner[0]};
    }
    model->element_area[e] = area;
    model->element_centre[2 * e] = moments.centre.x;
    model->element_centre[2 * e + 1] = moments.centre.y;
    model->element_moment[3 * e] = nmm_max(0, moments.xx);
    model->element_moment[3 * e + 1] = moments.xy;
    model->element_moment[3 * e + 2] = nmm_max(0, moments.yy);
}

// The linear functions of an element at an integer point.
static void linear_at(const nmm_cut *cut, const nmm_draft_element *element, nmm_ipoint p,
                      double weight[3]) {
    if (cut->frame == NULL) {
        nmm_lattice_weights(&cut->lattice, element->triangle, p, weight);
    } else {
        nmm_frame_weights(&cut->frame[element->block], nmm_lattice_place(&cut->lattice, p), weight);
    }
}

// All functions of element e at an integer point.
static void weights_at(const nmm_cut *cut, const nmm_model *model, int e, nmm_ipoint p,
                       double *weight) {
    double linear[3];
    linear_at(cut, &cut->draft.element[e], p, linear);
    nmm_functions_value(model, e, linear, weight);
}

// Linear functions at the centroid, from those at an integer point of the triangle.
static void fill_weights(const nmm_cut *cut, nmm_model *model, int e) {
    const nmm_draft_element *element = &cut->draft.element[e];
    const nmm_ipoint base = {
        (int64_t)(model->element_centre[2 * e] / cut->lattice.spacing),
        (int64_t)(model->element_centre[2 * e + 1] / cut->lattice.spacing),
    };
    const nmm_vec2 place = nmm_lattice_place(&cut->lattice, base);
    const double dx = model->element_centre[2 * e] - place.x;
    const double dy = model->element_centre[2 * e + 1] - place.y;
    double *gradient = model->element_gradient + 6 * (long)e;
    double *weight = model->element_weight + 3 * (long)e;
    if (cut->frame == NULL) {
        nmm_lattice_gradient(&cut->lattice, element->triangle, gradient);
    } else {
        memcpy(gradient, cut->frame[element->block].gradient, sizeof cut->frame->gradient);
    }
    linear_at(cut, element, base, weight);
    for (int i = 0; i < 3; i++)
        weight[i] += gradient[2 * i] * dx + gradient[2 * i + 1] * dy;
}

// Areas and moments of all elements, then the weights.
static nmm_status fill_elements(nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    int longest = 0;
    for (int e = 0; e <= draft->n_element; e++) {
        const bool last = e == draft->n_element;
        model->element_start[e] = last ? draft->n_corner : draft->element[e].first_corner;
        if (e == 0) continue;
        longest = nmm_max_int(longest, model->element_start[e] - model->element_start[e - 1]);
    }
    nmm_ipoint *place = NULL;
    nmm_vec2 *corner = NULL;
    nmm_arena *arena = &cut->body.arena;
    TRY(nmm_arena_take(cut->context, arena, &place, (size_t)longest, sizeof *place));
    TRY(nmm_arena_take(cut->context, arena, &corner, (size_t)longest, sizeof *corner));
    memcpy(model->corner_point, draft->corner, (size_t)draft->n_corner * sizeof(int));
    memcpy(model->element_cover, draft->element_cover,
           (size_t)draft->n_element * (size_t)model->n_local * sizeof(int));
    for (int e = 0; e < draft->n_element; e++) {
        const nmm_draft_element *element = &draft->element[e];
        model->element_block[e] = element->block;
        model->element_material[e] = element->material;
        fill_element(cut, model, e, place, corner);
    }
    if (nmm_cut_whole_blocks(cut)) TRY(nmm_frames_build(cut->context, arena, model, &cut->frame));
    for (int e = 0; e < draft->n_element; e++)
        fill_weights(cut, model, e);
    return NMM_OK;
}

// Elements of each cover: counted, then filled from the end.
static void fill_cover_elements(nmm_model *model) {
    const int n_slot = model->n_local * model->n_element;
    int *start = model->cover_start;
    for (int s = 0; s < n_slot; s++)
        start[model->element_cover[s]] += 1;
    for (int c = 0, end = 0; c <= model->n_cover; c++) {
        end += start[c];
        start[c] = end;
    }
    for (int s = n_slot - 1; s >= 0; s--)
        model->cover_element[--start[model->element_cover[s]]] = s;
}

// --- Points and loops

static void include_place(nmm_box *box, nmm_vec2 p) {
    box->low = (nmm_vec2){nmm_min(box->low.x, p.x), nmm_min(box->low.y, p.y)};
    box->high = (nmm_vec2){nmm_max(box->high.x, p.x), nmm_max(box->high.y, p.y)};
}

static void fill_points(const nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    for (int p = 0; p < draft->n_point; p++) {
        const nmm_draft_point *point = &draft->point[p];
        const nmm_vec2 place = nmm_lattice_place(&cut->lattice, point->place);
        model->point[2 * p] = place.x;
        model->point[2 * p + 1] = place.y;
        model->point_element[p] = point->element;
        weights_at(cut, model, point->element, point->place,
                   model->point_weight + model->n_local * (long)p);
        if (p == 0) model->box = (nmm_box){place, place};
        include_place(&model->box, place);
    }
}

// Weights at a vertex that divides a loop edge, eq. (2.17): their trapezoid sum over the edge's n
// parts is the integral of each function, so that a uniform pressure acts as it should.
static void weights_between(const nmm_cut *cut, const nmm_model *model, int v, double *weight) {
    const nmm_draft *draft = &cut->draft;
    const nmm_draft_vertex *vertex = &draft->vertex[v];
    const int n = vertex->n_part, first = v - vertex->part, m = model->n_local;
    const int start = draft->vertex[first].point;
    const int end = draft->vertex[draft->vertex[first + n - 1].next].point;
    double low[NMM_MOST_LOCAL], high[NMM_MOST_LOCAL];
    weights_at(cut, model, vertex->element, draft->point[vertex->point].place, weight);
    weights_at(cut, model, vertex->element, draft->point[start].place, low);
    weights_at(cut, model, vertex->element, draft->point[end].place, high);
    const double along = (double)vertex->part / n, bulge = n == 2 ? 1.0 / 3 : 1.0 / 8;
    for (int i = 3; i < m; i++)
        weight[i] += bulge * (weight[i] - (1 - along) * low[i] - along * high[i]);
}

// Weights at the start of loop edge v, in that edge's element.
static void weights_at_start(const nmm_cut *cut, const nmm_model *model, int v, double *weight) {
    const nmm_draft_vertex *vertex = &cut->draft.vertex[v];
    if (vertex->part > 0)
        weights_between(cut, model, v, weight);
    else
        weights_at(cut, model, vertex->element, cut->draft.point[vertex->point].place, weight);
}

static void fill_vertices(const nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    for (int v = 0; v < draft->n_vertex; v++) {
        const nmm_draft_vertex *vertex = &draft->vertex[v];
        const nmm_draft_element *element = &draft->element[vertex->element];
        const int end = draft->vertex[vertex->next].point;
        double *weight = model->edge_weight + 2 * model->n_local * (long)v;
        model->vertex_point[v] = vertex->point;
        model->vertex_next[v] = vertex->next;
        model->vertex_prev[v] = vertex->prev;
        model->vertex_block[v] = element->block;
        model->edge_element[v] = vertex->element;
        model->edge_interface[v] = vertex->interface;
        model->edge_mate[v] = vertex->mate;
        weights_at_start(cut, model, v, weight);
        if (vertex->part + 1 < vertex->n_part)
            weights_between(cut, model, v + 1, weight + model->n_local);
        else
            weights_at(cut, model, vertex->element, draft->point[end].place,
                       weight + model->n_local);
        // What divides an edge is no corner of an element: it has the weights of its vertex.
        if (vertex->part > 0)
            weights_between(cut, model, v, model->point_weight + model->n_local * vertex->point);
    }
}

// --- What the model takes over from the scene

static nmm_status copy_block_names(nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    TRY(nmm_allocate(cut->context, &model->block_name, (size_t)draft->n_block, sizeof(char *)));
    TRY(nmm_allocate(cut->context, &model->block_scene, (size_t)draft->n_block, sizeof(int)));
    memcpy(model->block_scene, draft->block_scene, (size_t)draft->n_block * sizeof(int));
    const char *original = NULL;
    char *copy = NULL;
    for (int b = 0; b < draft->n_block; b++) {
        const char *name = draft->block_name[b];
        if (name == NULL) continue;
        // Repeated blocks share their name.
        if (name != original) {
            TRY(nmm_arena_text(cut->context, &model->arena, &copy, name, strlen(name)));
        }
        original = name;
        model->block_name[b] = copy;
    }
    return NMM_OK;
}

static nmm_status copy_properties(nmm_cut *cut, nmm_model *model) {
    const nmm_scene *scene = cut->scene;
    // Without an interface in the scene, contacts have no strength.
    const size_t n_material = (size_t)scene->n_material, n_interface = (size_t)scene->n_interface;
    model->n_material = scene->n_material;
    model->n_interface = nmm_max_int(1, scene->n_interface);
    TRY(nmm_allocate(cut->context, &model->material, n_material, sizeof(nmm_material)));
    TRY(nmm_allocate(cut->context, &model->interface, (size_t)model->n_interface,
                     sizeof(nmm_interface)));
    if (n_material > 0) {
        memcpy(model->material, scene->material, n_material * sizeof(nmm_material));
    }
    if (n_interface > 0) {
        memcpy(model->interface, scene->interface, n_interface * sizeof(nmm_interface));
    }
    model->gravity = scene->gravity;
    model->base_motion = scene->base_motion;
    const size_t n_entry = (size_t)scene->base_motion.n * (size_t)(1 + scene->base_motion.width);
    model->base_motion.entry = NULL;
    if (scene->base_motion.n == 0) return NMM_OK;
    TRY(nmm_arena_take(cut->context, &model->arena, &model->base_motion.entry, n_entry,
                       sizeof(double)));
    memcpy(model->base_motion.entry, scene->base_motion.entry, n_entry * sizeof(double));
    return NMM_OK;
}

static int compare_areas(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Side of a square as large as the usual block: half the blocks are larger.
static nmm_status measure_blocks(nmm_cut *cut, nmm_model *model) {
    double *area = NULL;
    const size_t n = (size_t)model->n_block;
    TRY(nmm_arena_take(cut->context, &cut->body.arena, &area, n, sizeof *area));
    for (int e = 0; e < model->n_element; e++)
        area[model->element_block[e]] += model->element_area[e];
    qsort(area, n, sizeof *area, compare_areas);
    model->size = cut->report->size_chosen = sqrt(area[(n - 1) / 2]);
    return NMM_OK;
}

static void report_areas(const nmm_model *model, nmm_cover_report *report) {
    report->area = 0;
    for (int e = 0; e < model->n_element; e++) {
        report->area += model->element_area[e];
        const double smallest = model->element_area[report->smallest_element];
        if (model->element_area[e] < smallest) report->smallest_element = e;
    }
    report->smallest_area = model->element_area[report->smallest_element];
    report->mean_area = report->area / model->n_element;
}

nmm_status nmm_cut_fill_model(nmm_cut *cut, nmm_model *model) {
    const nmm_draft *draft = &cut->draft;
    const nmm_box box = cut->lattice.box;
    model->n_cover = draft->n_cover;
    model->n_element = draft->n_element;
    model->n_corner = draft->n_corner;
    model->n_point = draft->n_point;
    model->n_vertex = draft->n_vertex;
    model->n_block = draft->n_block;
    model->origin = cut->lattice.origin;
    model->size = (double)cut->lattice.side * cut->lattice.spacing;
    model->height = nmm_max(box.high.x - box.low.x, box.high.y - box.low.y) / 2;
    model->whole_blocks = nmm_cut_whole_blocks(cut);
    model->apart = cut->apart;
    model->order = nmm_cut_order(cut);
    model->n_local = nmm_local_of(model->order);
    if (model->order > 0) TRY(nmm_cut_pieces(cut));
    model->n_sample = nmm_cut_samples(cut);
    TRY(nmm_model_allocate(cut->context, model));
    TRY(fill_elements(cut, model));
    if (model->whole_blocks) TRY(measure_blocks(cut, model));
    TRY(fill_covers(cut, model));
    fill_cover_elements(model);
    if (model->order > 0) {
        nmm_cut_fill_samples(cut, model);
        TRY(nmm_cut_ties(cut->context, model));
        TRY(nmm_cut_fill_ties(cut->context, model));
    }
    fill_points(cut, model);
    fill_vertices(cut, model);
    TRY(copy_block_names(cut, model));
    TRY(copy_properties(cut, model));
    report_areas(model, cut->report);
    return NMM_OK;
}
