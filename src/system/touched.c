// SPDX-License-Identifier: MIT
//
// What a move of some covers touches: elements, points, contacts, loop edges, and the rows whose
// forces change. Where few move, a pass looks at these alone. Marks are collected in ascending
// order, so that lists do not depend on the order in which they were found.

#include "system.h"

#include <string.h>

nmm_status nmm_touched_open(nmm_context *context, nmm_touched *touched, const nmm_model *model) {
    const size_t n_element = (size_t)model->n_element, n_point = (size_t)model->n_point;
    const size_t n_vertex = (size_t)model->n_vertex, n_cover = (size_t)model->n_cover;
    const int most = nmm_max_int(model->n_element, nmm_max_int(model->n_vertex, model->n_cover));
    TRY(nmm_allocate(context, &touched->element.item, n_element, sizeof(int)));
    TRY(nmm_allocate(context, &touched->point.item, n_point, sizeof(int)));
    TRY(nmm_allocate(context, &touched->edge.item, n_vertex, sizeof(int)));
    TRY(nmm_allocate(context, &touched->row.item, n_cover, sizeof(int)));
    TRY(nmm_allocate(context, &touched->mark, (size_t)most, 1));
    TRY(nmm_allocate(context, &touched->element_point, n_point, sizeof(int)));
    TRY(nmm_allocate(context, &touched->point_start, n_element + 1, sizeof(int)));
    touched->mark_capacity = most;
    // Points by element.
    int *start = touched->point_start;
    for (int p = 0; p < model->n_point; p++)
        start[model->point_element[p] + 1] += 1;
    for (int e = 0; e < model->n_element; e++)
        start[e + 1] += start[e];
    for (int p = model->n_point - 1; p >= 0; p--)
        touched->element_point[--start[model->point_element[p] + 1]] = p;
    for (int e = 0; e < model->n_element; e++)
        start[e] = start[e + 1];
    start[model->n_element] = model->n_point;
    return NMM_OK;
}

void nmm_touched_close(nmm_context *context, nmm_touched *touched) {
    nmm_release(context, &touched->element.item);
    nmm_release(context, &touched->point.item);
    nmm_release(context, &touched->contact.item);
    nmm_release(context, &touched->edge.item);
    nmm_release(context, &touched->row.item);
    nmm_release(context, &touched->mark);
    nmm_release(context, &touched->element_point);
    nmm_release(context, &touched->point_start);
    *touched = (nmm_touched){0};
}

// The marked ones of n into a list; no marks are left.
static void collect(unsigned char *mark, int n, nmm_items *list) {
    list->n = 0;
    for (int i = 0; i < n; i++)
        if (mark[i]) list->item[list->n++] = i;
    memset(mark, 0, (size_t)n);
}

static void find_elements(nmm_touched *touched, const nmm_model *model) {
    for (int i = 0; i < touched->n_moved; i++) {
        const int c = touched->moved[i];
        for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++)
            touched->mark[model->cover_element[k] / model->n_local] = 1;
    }
    collect(touched->mark, model->n_element, &touched->element);
    touched->point.n = 0;
    for (int i = 0; i < touched->element.n; i++) {
        const int e = touched->element.item[i];
        for (int k = touched->point_start[e]; k < touched->point_start[e + 1]; k++)
            touched->point.item[touched->point.n++] = touched->element_point[k];
    }
}

// Rows of the moved covers' elements and ties.
static void find_neighbours(nmm_touched *touched, const nmm_system *system,
                            const nmm_model *model) {
    for (int i = 0; i < touched->n_moved; i++) {
        const int c = touched->moved[i];
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++)
            touched->mark[system->base_col[k]] = 1;
    }
    collect(touched->mark, model->n_cover, &touched->row);
}

// Contacts of these rows, one ring more than move: an edge also knows those beside it.
static void find_contacts(nmm_touched *touched, const nmm_system *system, const nmm_model *model,
                          const nmm_state *state) {
    const nmm_couples *couples = &system->couples;
    const int n_side = 2 * model->n_local;
    for (int i = 0; i < touched->row.n; i++) {
        const int c = touched->row.item[i];
        for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
            const int q = couples->cover_couple[k] / n_side;
            for (int p = couples->start[q]; p < couples->start[q + 1]; p++)
                touched->mark[couples->order[p] / 2] = 1;
        }
    }
    collect(touched->mark, state->n_contact, &touched->contact);
    for (int i = 0; i < touched->contact.n; i++) {
        const nmm_contact *contact = &state->contact[touched->contact.item[i]];
        touched->mark[contact->vertex] = touched->mark[contact->edge] = 1;
    }
    collect(touched->mark, model->n_vertex, &touched->edge);
}

// And those of the elements behind the loop edges.
static void add_rows(nmm_touched *touched, const nmm_model *model) {
    const int m = model->n_local;
    for (int i = 0; i < touched->row.n; i++)
        touched->mark[touched->row.item[i]] = 1;
    for (int i = 0; i < touched->edge.n; i++) {
        const int e = model->edge_element[touched->edge.item[i]];
        for (int k = 0; k < m; k++)
            touched->mark[model->element_cover[m * (long)e + k]] = 1;
    }
    collect(touched->mark, model->n_cover, &touched->row);
}

nmm_status nmm_touched_by(nmm_context *context, nmm_touched *touched, const nmm_system *system,
                          const nmm_model *model, const nmm_state *state, const int *moved, int n) {
    TRY(nmm_grow(context, &touched->contact.item, &touched->contact_capacity, state->n_contact,
                 sizeof(int)));
    TRY(nmm_grow(context, &touched->mark, &touched->mark_capacity, state->n_contact, 1));
    touched->moved = moved;
    touched->n_moved = n;
    find_elements(touched, model);
    find_neighbours(touched, system, model);
    find_contacts(touched, system, model, state);
    add_rows(touched, model);
    return NMM_OK;
}
