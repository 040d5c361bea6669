// SPDX-License-Identifier: MIT
//
// Sparsity: covers that share an element, a constant pattern, merged with covers that share a
// contact. `place` and `contact_slot` say where each contribution goes, so that the assembly needs
// no search. Both halves are stored and columns ascend.

#include "system.h"

#include <stdlib.h>
#include <string.h>

static int compare_int(const void *a, const void *b) {
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

// Entry of column `col` in the ascending list col_of[begin, end).
static int find_column(const int *col_of, int begin, int end, int col) {
    while (end - begin > 1) {
        const int middle = begin + (end - begin) / 2;
        if (col_of[middle] <= col)
            begin = middle;
        else
            end = middle;
    }
    NMM_ASSERT(col_of[begin] == col);
    return begin;
}

// --- Constant part

// Columns of row c into scratch, ascending, without repetition; returns how many.
static int columns_of_cover(const nmm_model *model, int c, int *scratch) {
    int n = 0;
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int *cover = model->element_cover + 3 * (long)(model->cover_element[k] / 3);
        for (int j = 0; j < 3; j++)
            scratch[n++] = cover[j];
    }
    qsort(scratch, (size_t)n, sizeof *scratch, compare_int);
    int kept = 0;
    for (int i = 0; i < n; i++) {
        if (i == 0 || scratch[i] != scratch[i - 1]) scratch[kept++] = scratch[i];
    }
    return kept;
}

static nmm_status build_base(nmm_context *context, nmm_system *system, const nmm_model *model) {
    const int n = model->n_cover;
    int longest = 0;
    for (int c = 0; c < n; c++) {
        longest = nmm_max_int(longest, model->cover_start[c + 1] - model->cover_start[c]);
    }
    TRY(nmm_allocate(context, &system->base_start, (size_t)n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->base_col, 9 * (size_t)model->n_element, sizeof(int)));
    TRY(nmm_allocate(context, &system->base_slot, 9 * (size_t)model->n_element, sizeof(int)));
    int *scratch = NULL;
    TRY(nmm_allocate(context, &scratch, 3 * (size_t)longest + 1, sizeof(int)));
    for (int c = 0; c < n; c++) {
        const int kept = columns_of_cover(model, c, scratch);
        memcpy(system->base_col + system->base_start[c], scratch, (size_t)kept * sizeof(int));
        system->base_start[c + 1] = system->base_start[c] + kept;
    }
    nmm_release(context, &scratch);
    for (int e = 0; e < model->n_element; e++) {
        const int *cover = model->element_cover + 3 * (long)e;
        for (int k = 0; k < 9; k++) {
            const int row = cover[k / 3];
            system->base_slot[9 * (long)e + k] =
                find_column(system->base_col, system->base_start[row], system->base_start[row + 1],
                            cover[k % 3]);
        }
    }
    return NMM_OK;
}

// Mass of each element, lumped as its row sums when asked for, and of each cover.
static void build_mass(nmm_system *system, const nmm_model *model, bool lumped) {
    for (int e = 0; e < model->n_element; e++) {
        const double density = model->material[model->element_material[e]].density;
        const double *weight = model->element_weight + 3 * (long)e;
        double *m = system->element_mass + 6 * (long)e;
        nmm_mass_of(density, model->element_area[e], model->element_moment + 3 * (long)e, weight,
                    model->element_gradient + 6 * (long)e, m);
        for (int i = 0; i < 3; i++) {
            const double row = density * model->element_area[e] * weight[i];
            system->cover_mass[model->element_cover[3 * e + i]] += row;
            for (int j = i; j < 3 && lumped; j++)
                m[nmm_mass_index(i, j)] = i == j ? row : 0;
        }
    }
}

// Supports by cover, ascending.
static nmm_status build_supports(nmm_context *context, nmm_system *system, const nmm_model *model) {
    const int n = model->n_cover, n_entry = 3 * model->n_support;
    TRY(nmm_allocate(context, &system->support_start, (size_t)n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->cover_support, (size_t)n_entry, sizeof(int)));
    int *start = system->support_start;
    for (int k = 0; k < n_entry; k++) {
        start[model->element_cover[3 * model->support[k / 3].element + k % 3] + 1] += 1;
    }
    for (int c = 0; c < n; c++)
        start[c + 1] += start[c];
    // Filled from the back, so that `start` ends where it began.
    for (int k = n_entry - 1; k >= 0; k--) {
        const int c = model->element_cover[3 * model->support[k / 3].element + k % 3];
        system->cover_support[--start[c + 1]] = k;
    }
    for (int c = 0; c < n; c++)
        start[c] = start[c + 1];
    start[n] = n_entry;
    return NMM_OK;
}

nmm_status nmm_system_create(nmm_context *context, const nmm_model *model,
                             const nmm_scene_settings *settings, nmm_system *system) {
    const size_t n = (size_t)model->n_cover, n_element = (size_t)model->n_element;
    system->damping = settings->damping;
    TRY(build_base(context, system, model));
    TRY(nmm_allocate(context, &system->element_mass, 6 * n_element, sizeof(double)));
    TRY(nmm_allocate(context, &system->cover_mass, n, sizeof(double)));
    build_mass(system, model, settings->mass == NMM_MASS_LUMPED);
    TRY(build_supports(context, system, model));
    if (model->n_hold > 0) {
        TRY(nmm_allocate(context, &system->fixed, n, 1));
        TRY(nmm_allocate(context, &system->reaction, 2 * n, sizeof(double)));
        for (int k = 0; k < model->n_hold; k++) {
            const nmm_hold *hold = &model->hold[k];
            system->fixed[hold->cover] |= (unsigned char)(hold->fix_x + 2 * hold->fix_y);
        }
    }
    TRY(nmm_allocate(context, &system->piola, 4 * n_element, sizeof(double)));
    TRY(nmm_allocate(context, &system->stiffness, n_element, sizeof(nmm_stiffness)));
    TRY(nmm_allocate(context, &system->acceleration, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->load, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->scale, n, sizeof(double)));
    TRY(nmm_allocate(context, &system->residual, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->change, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->place, (size_t)system->base_start[n], sizeof(int)));
    TRY(nmm_allocate(context, &system->contact_start, n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->row_room, n, sizeof(int)));
    TRY(nmm_allocate(context, &system->K.row_start, n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->K.diagonal, n, sizeof(int)));
    system->K.n_row = model->n_cover;
    system->n_contact = -1; // no pattern yet
    return NMM_OK;
}

void nmm_system_destroy(nmm_context *context, nmm_system *system) {
    void *owned[] = {
        &system->K.row_start,   &system->K.col,         &system->K.value,
        &system->K.diagonal,    &system->residual,      &system->change,
        &system->base_start,    &system->base_col,      &system->base_slot,
        &system->element_mass,  &system->cover_mass,    &system->support_start,
        &system->cover_support, &system->fixed,         &system->place,
        &system->row,           &system->identity,      &system->contact_slot,
        &system->contact_start, &system->cover_contact, &system->column,
        &system->row_room,      &system->piola,         &system->stiffness,
        &system->acceleration,  &system->load,          &system->scale,
        &system->reaction,
    };
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        nmm_release(context, owned[i]);
    *system = (nmm_system){0};
}

// --- Contacts

static void covers_of_contact(const nmm_model *model, const nmm_contact *contact, int cover[6]) {
    const int *a = model->element_cover + 3 * (long)model->edge_element[contact->vertex];
    const int *b = model->element_cover + 3 * (long)model->edge_element[contact->edge];
    for (int i = 0; i < 3; i++) {
        cover[i] = a[i];
        cover[3 + i] = b[i];
    }
}

static bool same_contacts(const nmm_system *system, const nmm_state *state) {
    if (system->n_contact != state->n_contact) return false;
    for (int k = 0; k < state->n_contact; k++) {
        if (system->identity[2 * k] != state->contact[k].vertex) return false;
        if (system->identity[2 * k + 1] != state->contact[k].edge) return false;
    }
    return true;
}

static nmm_status grow_contacts(nmm_context *context, nmm_system *system, int n_contact) {
    int capacity[4];
    for (int i = 0; i < 4; i++)
        capacity[i] = system->contact_capacity;
    TRY(nmm_grow(context, &system->row, &capacity[0], n_contact, sizeof(nmm_contact_row)));
    TRY(nmm_grow(context, &system->identity, &capacity[1], n_contact, 2 * sizeof(int)));
    TRY(nmm_grow(context, &system->contact_slot, &capacity[2], n_contact, 36 * sizeof(int)));
    TRY(nmm_grow(context, &system->cover_contact, &capacity[3], n_contact, 6 * sizeof(int)));
    system->contact_capacity = capacity[0];
    return NMM_OK;
}

// Contacts by cover, ascending.
static void list_contacts(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const int n = system->K.n_row, n_contact = state->n_contact;
    int *start = system->contact_start;
    memset(start, 0, ((size_t)n + 1) * sizeof(int));
    for (int k = 0; k < n_contact; k++) {
        int cover[6];
        covers_of_contact(model, &state->contact[k], cover);
        system->identity[2 * k] = state->contact[k].vertex;
        system->identity[2 * k + 1] = state->contact[k].edge;
        for (int i = 0; i < 6; i++)
            start[cover[i] + 1] += 1;
    }
    for (int c = 0; c < n; c++)
        start[c + 1] += start[c];
    // Filled from the back, so that start[c + 1] ends where c begins.
    for (int k = n_contact - 1; k >= 0; k--) {
        int cover[6];
        covers_of_contact(model, &state->contact[k], cover);
        for (int i = 5; i >= 0; i--)
            system->cover_contact[--start[cover[i] + 1]] = 6 * k + i;
    }
    for (int c = 0; c < n; c++)
        start[c] = start[c + 1];
    start[n] = 6 * n_contact;
}

// Insert into an ascending list without repetition.
static int insert_column(int *column, int n, int col) {
    int k = n;
    while (k > 0 && column[k - 1] > col)
        k -= 1;
    if (k > 0 && column[k - 1] == col) return n;
    memmove(column + k + 1, column + k, (size_t)(n - k) * sizeof *column);
    column[k] = col;
    return n + 1;
}

// Columns of row c: those of its elements, and the covers on the other side of its contacts.
static int columns_of_row(const nmm_system *system, const nmm_model *model, const nmm_state *state,
                          int c, int *column) {
    int n = system->base_start[c + 1] - system->base_start[c];
    memcpy(column, system->base_col + system->base_start[c], (size_t)n * sizeof *column);
    for (int k = system->contact_start[c]; k < system->contact_start[c + 1]; k++) {
        const nmm_contact *contact = &state->contact[system->cover_contact[k] / 6];
        const bool of_vertex = system->cover_contact[k] % 6 < 3;
        const int *other =
            model->element_cover +
            3 * (long)model->edge_element[of_vertex ? contact->edge : contact->vertex];
        for (int j = 0; j < 3; j++)
            n = insert_column(column, n, other[j]);
    }
    return n;
}

static nmm_status grow_matrix(nmm_context *context, nmm_bsr *K, int *capacity, int n_block) {
    if (n_block <= *capacity) return NMM_OK;
    const int wanted = n_block + n_block / 8 + 64;
    nmm_release(context, &K->col);
    nmm_release(context, &K->value);
    *capacity = 0;
    TRY(nmm_allocate(context, &K->col, (size_t)wanted, sizeof(int)));
    TRY(nmm_allocate(context, &K->value, (size_t)wanted, 4 * sizeof(double)));
    *capacity = wanted;
    return NMM_OK;
}

// Columns of all rows into system->column, row c from row_room[c]; their counts into K.row_start.
static nmm_status gather_columns(nmm_context *context, nmm_system *system, const nmm_model *model,
                                 const nmm_state *state) {
    const int n = system->K.n_row, n_thread = context->n_thread;
    for (int c = 0; c < n; c++) {
        system->row_room[c] = system->base_start[c] + 3 * system->contact_start[c];
    }
    TRY(nmm_grow(context, &system->column, &system->column_capacity,
                 system->base_start[n] + 3 * system->contact_start[n], sizeof(int)));
    int *start = system->K.row_start;
    start[0] = 0;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        start[c + 1] =
            columns_of_row(system, model, state, c, system->column + system->row_room[c]);
    }
    for (int c = 0; c < n; c++)
        start[c + 1] += start[c];
    return grow_matrix(context, &system->K, &system->row_capacity, start[n]);
}

// Columns of row c into K, and where the constant ones went.
static void fill_row(nmm_system *system, int c) {
    nmm_bsr *K = &system->K;
    const int *column = system->column + system->row_room[c];
    int base = system->base_start[c];
    for (int k = K->row_start[c]; k < K->row_start[c + 1]; k++) {
        const int col = column[k - K->row_start[c]];
        K->col[k] = col;
        if (col == c) K->diagonal[c] = k;
        if (base < system->base_start[c + 1] && system->base_col[base] == col) {
            system->place[base++] = k;
        }
    }
}

static void place_contacts(const nmm_context *context, nmm_system *system, const nmm_model *model,
                           const nmm_state *state) {
    const nmm_bsr *K = &system->K;
    const int n = state->n_contact, n_thread = context->n_thread;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 1024)
    for (int k = 0; k < n; k++) {
        int cover[6];
        covers_of_contact(model, &state->contact[k], cover);
        for (int i = 0; i < 36; i++) {
            const int row = cover[i / 6];
            system->contact_slot[36 * (long)k + i] =
                find_column(K->col, K->row_start[row], K->row_start[row + 1], cover[i % 6]);
        }
    }
}

nmm_status nmm_system_pattern(nmm_context *context, nmm_system *system, const nmm_model *model,
                              const nmm_state *state) {
    const int n = model->n_cover, n_thread = context->n_thread;
    system->keep_pattern = same_contacts(system, state);
    if (system->keep_pattern) return NMM_OK;
    system->n_contact = -1;
    TRY(grow_contacts(context, system, state->n_contact));
    list_contacts(system, model, state);
    TRY(gather_columns(context, system, model, state));
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++)
        fill_row(system, c);
    place_contacts(context, system, model, state);
    system->n_contact = state->n_contact;
    return NMM_OK;
}
