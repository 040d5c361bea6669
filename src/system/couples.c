// SPDX-License-Identifier: MIT
//
// Contacts by couples of elements. All contacts between the same two elements act on the same
// covers, so the pattern of the matrix, and where their springs go, is a matter of couples: there
// are fewer of them than of contacts, and they change less often. A few may be left without
// contacts, so that the pattern stays.
//
// Everything is sorted by counting, in O(contacts + elements). These loops stay serial: they run
// once a step at most, and take less time than the search that brings the contacts.

#include "system.h"

#include <string.h>

static bool same_contacts(const nmm_couples *couples, const nmm_state *state) {
    if (couples->n_contact != state->n_contact) return false;
    for (int k = 0; k < state->n_contact; k++) {
        if (couples->identity[2 * k] != state->contact[k].vertex) return false;
        if (couples->identity[2 * k + 1] != state->contact[k].edge) return false;
    }
    return true;
}

static nmm_status grow_contacts(nmm_context *context, nmm_couples *couples, int n) {
    int capacity[7];
    for (int i = 0; i < 7; i++)
        capacity[i] = couples->contact_capacity;
    // One more, for the end of the last couple.
    TRY(nmm_grow(context, &couples->identity, &capacity[0], n + 1, 2 * sizeof(int)));
    TRY(nmm_grow(context, &couples->order, &capacity[1], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &couples->by_edge, &capacity[2], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &couples->key, &capacity[3], n + 1, 2 * sizeof(int)));
    TRY(nmm_grow(context, &couples->element, &capacity[4], n + 1, 2 * sizeof(int)));
    TRY(nmm_grow(context, &couples->start, &capacity[5], n + 1, sizeof(int)));
    TRY(nmm_grow(context, &couples->place, &capacity[6], n + 1, sizeof(int)));
    couples->contact_capacity = capacity[0];
    return NMM_OK;
}

// Items 0 .. n - 1 of `from` (NULL: in order) into `to`, stable, by key[stride * item] in
// 0 .. n_key - 1; start[key] is the first place of a key, start[n_key] = n.
static void sort_by_key(int n, const int *from, const int *key, int n_key, int *start, int *to) {
    memset(start, 0, ((size_t)n_key + 1) * sizeof *start);
    for (int i = 0; i < n; i++)
        start[key[2 * i]] += 1;
    int sum = 0;
    for (int k = 0; k <= n_key; k++) {
        const int count = start[k];
        start[k] = sum;
        sum += count;
    }
    for (int i = 0; i < n; i++) {
        const int item = from != NULL ? from[i] : i;
        to[start[key[2 * item]]++] = item;
    }
    // Filling moved each start to the next one's place.
    memmove(start + 1, start, (size_t)n_key * sizeof *start);
    start[0] = 0;
}

// The elements of each contact, the smaller number first, into couples->key.
static void take_keys(nmm_couples *couples, const nmm_model *model, const nmm_state *state) {
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *contact = &state->contact[k];
        const int a = model->edge_element[contact->vertex];
        const int b = model->edge_element[contact->edge];
        couples->identity[2 * k] = contact->vertex;
        couples->identity[2 * k + 1] = contact->edge;
        couples->key[2 * k] = nmm_min_int(a, b);
        couples->key[2 * k + 1] = nmm_max_int(a, b);
    }
}

static int compare_keys(const int *a, const int *b) {
    if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
    return (a[1] > b[1]) - (a[1] < b[1]);
}

// Are all contacts, in their order, of couples that are listed already, and few of these without
// any? Then the couples stay, and the pattern with them.
static bool fit_couples(const nmm_couples *couples, int n_contact) {
    int q = -1, n_used = 0;
    for (int p = 0; p < n_contact; p++) {
        const int *key = couples->key + 2 * (long)couples->order[p];
        if (q >= 0 && compare_keys(couples->element + 2 * (long)q, key) == 0) continue;
        q += 1;
        while (q < couples->n && compare_keys(couples->element + 2 * (long)q, key) < 0)
            q += 1;
        if (q >= couples->n || compare_keys(couples->element + 2 * (long)q, key) != 0) return false;
        n_used += 1;
    }
    return n_used >= couples->n - couples->n / 8;
}

// Contacts of the same elements follow each other in `order`: one couple each.
static void number_couples(nmm_couples *couples, int n_contact) {
    int n = 0;
    for (int p = 0; p < n_contact; p++) {
        const int *key = couples->key + 2 * (long)couples->order[p];
        int *element = couples->element + 2 * (long)n;
        if (n > 0 && compare_keys(element - 2, key) == 0) continue;
        memcpy(element, key, 2 * sizeof *key);
        n += 1;
    }
    couples->n = n;
}

// Where the contacts of each couple begin, and on which side of it their vertices are.
static void start_couples(nmm_couples *couples, const nmm_model *model, int n_contact) {
    int p = 0;
    for (int q = 0; q < couples->n; q++) {
        const int *element = couples->element + 2 * (long)q;
        couples->start[q] = p;
        for (; p < n_contact; p++) {
            const int k = couples->order[p];
            if (compare_keys(couples->key + 2 * (long)k, element) != 0) break;
            const int of_vertex = model->edge_element[couples->identity[2 * k]];
            couples->order[p] = 2 * k + (of_vertex != element[0]);
            couples->place[k] = p;
        }
    }
    couples->start[couples->n] = n_contact;
}

// Couples by cover, ascending.
static void list_covers(nmm_couples *couples, const nmm_model *model) {
    int *start = couples->cover_start;
    const int n_side = 2 * model->n_local;
    memset(start, 0, ((size_t)model->n_cover + 1) * sizeof *start);
    for (int q = 0; q < couples->n; q++) {
        int cover[2 * NMM_MOST_LOCAL] = {0};
        nmm_couple_covers(model, couples->element + 2 * (long)q, cover);
        for (int i = 0; i < n_side; i++)
            start[cover[i] + 1] += 1;
    }
    for (int c = 0; c < model->n_cover; c++)
        start[c + 1] += start[c];
    // Filled from the back, so that start[c + 1] ends where c begins.
    for (int q = couples->n - 1; q >= 0; q--) {
        int cover[2 * NMM_MOST_LOCAL] = {0};
        nmm_couple_covers(model, couples->element + 2 * (long)q, cover);
        for (int i = n_side - 1; i >= 0; i--)
            couples->cover_couple[--start[cover[i] + 1]] = n_side * q + i;
    }
    for (int c = 0; c < model->n_cover; c++)
        start[c] = start[c + 1];
    start[model->n_cover] = n_side * couples->n;
}

nmm_status nmm_couples_create(nmm_context *context, nmm_couples *couples, const nmm_model *model) {
    const size_t n_vertex = (size_t)model->n_vertex, n_cover = (size_t)model->n_cover;
    TRY(nmm_allocate(context, &couples->vertex_start, n_vertex + 1, sizeof(int)));
    TRY(nmm_allocate(context, &couples->edge_start, n_vertex + 1, sizeof(int)));
    TRY(nmm_allocate(context, &couples->element_start, (size_t)model->n_element + 1, sizeof(int)));
    couples->n = couples->n_contact = -1; // nothing is listed yet
    return nmm_allocate(context, &couples->cover_start, n_cover + 1, sizeof(int));
}

void nmm_couples_destroy(nmm_context *context, nmm_couples *couples) {
    void *owned[] = {
        &couples->identity,      &couples->order,        &couples->by_edge,
        &couples->key,           &couples->element,      &couples->start,
        &couples->slot,          &couples->vertex_start, &couples->edge_start,
        &couples->element_start, &couples->cover_start,  &couples->cover_couple,
        &couples->place,
    };
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        nmm_release(context, owned[i]);
    *couples = (nmm_couples){0};
}

nmm_status nmm_couples_list(nmm_context *context, nmm_couples *couples, const nmm_model *model,
                            const nmm_state *state, nmm_couples_change *change) {
    *change = NMM_COUPLES_KEPT;
    if (same_contacts(couples, state)) return NMM_OK;
    const int n = state->n_contact;
    couples->list += 1;
    couples->n_contact = -1;
    TRY(grow_contacts(context, couples, n));
    take_keys(couples, model, state);
    // By vertex they are sorted already: only the starts are wanted. `order` is scratch here.
    const int *identity = couples->identity, *key = couples->key;
    sort_by_key(n, NULL, identity, model->n_vertex, couples->vertex_start, couples->order);
    sort_by_key(n, NULL, identity + 1, model->n_vertex, couples->edge_start, couples->by_edge);
    // By the second element, then, stable, by the first; identity is not needed in between.
    int *second = couples->start;
    sort_by_key(n, NULL, key + 1, model->n_element, couples->element_start, second);
    sort_by_key(n, second, key, model->n_element, couples->element_start, couples->order);
    const bool fit = couples->n >= 0 && fit_couples(couples, n);
    if (!fit) number_couples(couples, n);
    start_couples(couples, model, n);
    couples->n_contact = n;
    *change = fit ? NMM_CONTACTS_CHANGED : NMM_COUPLES_CHANGED;
    if (fit) return NMM_OK;
    const int capacity = couples->capacity;
    int room[2] = {capacity, capacity};
    const size_t n_side = 2 * (size_t)model->n_local;
    TRY(nmm_grow(context, &couples->slot, &room[0], couples->n, n_side * n_side * sizeof(int)));
    TRY(nmm_grow(context, &couples->cover_couple, &room[1], couples->n, n_side * sizeof(int)));
    couples->capacity = room[0];
    list_covers(couples, model);
    return NMM_OK;
}
