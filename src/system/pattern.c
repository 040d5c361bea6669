// SPDX-License-Identifier: MIT
//
// Sparsity: covers that share an element, a constant pattern, merged with covers that share a
// contact. `place` and `contact_slot` say where each contribution goes, so that the assembly needs
// no search. Both halves are stored and columns ascend.

#include "system.h"

#include <stdlib.h>
#include <string.h>

// Row and column of one block that a contact asks for.
struct nmm_pair {
    int row, col;
};
typedef struct nmm_pair nmm_pair;

static int compare_int(const void *a, const void *b) {
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static int compare_pair(const void *a, const void *b) {
    const nmm_pair *x = a, *y = b;
    if (x->row != y->row) return (x->row > y->row) - (x->row < y->row);
    return (x->col > y->col) - (x->col < y->col);
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
// -----------------------------------------------------------------------------------

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
        &system->contact_start, &system->cover_contact, &system->pair,
        &system->piola,         &system->stiffness,     &system->acceleration,
        &system->load,          &system->scale,         &system->reaction,
    };
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        nmm_release(context, owned[i]);
    *system = (nmm_system){0};
}

// --- Contacts
// ------------------------------------------------------------------------------------------

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
    int capacity[5];
    for (int i = 0; i < 5; i++)
        capacity[i] = system->contact_capacity;
    TRY(nmm_grow(context, &system->row, &capacity[0], n_contact, sizeof(nmm_contact_row)));
    TRY(nmm_grow(context, &system->identity, &capacity[1], n_contact, 2 * sizeof(int)));
    TRY(nmm_grow(context, &system->contact_slot, &capacity[2], n_contact, 36 * sizeof(int)));
    TRY(nmm_grow(context, &system->cover_contact, &capacity[3], n_contact, 6 * sizeof(int)));
    TRY(nmm_grow(context, &system->pair, &capacity[4], n_contact, 36 * sizeof(nmm_pair)));
    system->contact_capacity = capacity[0];
    return NMM_OK;
}

// Blocks asked for by contacts, sorted by row and column, without repetition.
static int gather_pairs(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    int n = 0;
    for (int k = 0; k < state->n_contact; k++) {
        int cover[6];
        covers_of_contact(model, &state->contact[k], cover);
        for (int i = 0; i < 36; i++) {
            // Blocks of one element are in the constant pattern.
            if (i / 18 == i % 6 / 3) continue;
            system->pair[n++] = (nmm_pair){cover[i / 6], cover[i % 6]};
        }
    }
    if (n > 1) qsort(system->pair, (size_t)n, sizeof(nmm_pair), compare_pair);
    int kept = 0;
    for (int i = 0; i < n; i++) {
        if (i == 0 || compare_pair(&system->pair[i], &system->pair[i - 1]) != 0) {
            system->pair[kept++] = system->pair[i];
        }
    }
    return kept;
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

// Merge the constant columns of each row with those of the pairs.
static void merge_rows(nmm_system *system, int n_pair) {
    nmm_bsr *K = &system->K;
    int next = 0, pair = 0;
    for (int row = 0; row < K->n_row; row++) {
        K->row_start[row] = next;
        int base = system->base_start[row];
        const int base_end = system->base_start[row + 1];
        while (base < base_end || (pair < n_pair && system->pair[pair].row == row)) {
            const bool paired = pair < n_pair && system->pair[pair].row == row;
            const int extra = paired ? system->pair[pair].col : INT32_MAX;
            const int own = base < base_end ? system->base_col[base] : INT32_MAX;
            if (own <= extra) system->place[base++] = next;
            if (extra <= own) pair += 1;
            const int col = nmm_min_int(own, extra);
            if (col == row) K->diagonal[row] = next;
            K->col[next++] = col;
        }
    }
    K->row_start[K->n_row] = next;
}

// Contacts by cover, ascending, and where their blocks go.
static void place_contacts(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const nmm_bsr *K = &system->K;
    const int n = K->n_row, n_contact = state->n_contact;
    int *start = system->contact_start;
    memset(start, 0, ((size_t)n + 1) * sizeof(int));
    for (int k = 0; k < n_contact; k++) {
        int cover[6];
        covers_of_contact(model, &state->contact[k], cover);
        system->identity[2 * k] = state->contact[k].vertex;
        system->identity[2 * k + 1] = state->contact[k].edge;
        for (int i = 0; i < 6; i++)
            start[cover[i] + 1] += 1;
        for (int i = 0; i < 36; i++) {
            const int row = cover[i / 6];
            system->contact_slot[36 * (long)k + i] =
                find_column(K->col, K->row_start[row], K->row_start[row + 1], cover[i % 6]);
        }
    }
    for (int c = 0; c < n; c++)
        start[c + 1] += start[c];
    for (int k = 6 * n_contact - 1; k >= 0; k--) {
        int cover[6];
        covers_of_contact(model, &state->contact[k / 6], cover);
        system->cover_contact[--start[cover[k % 6] + 1]] = k;
    }
    for (int c = 0; c < n; c++)
        start[c] = start[c + 1];
    start[n] = 6 * n_contact;
}

nmm_status nmm_system_pattern(nmm_context *context, nmm_system *system, const nmm_model *model,
                              const nmm_state *state) {
    system->keep_pattern = same_contacts(system, state);
    if (system->keep_pattern) return NMM_OK;
    system->n_contact = -1;
    TRY(grow_contacts(context, system, state->n_contact));
    const int n_pair = gather_pairs(system, model, state);
    const int n_block = system->base_start[model->n_cover] + n_pair;
    TRY(grow_matrix(context, &system->K, &system->row_capacity, n_block));
    merge_rows(system, n_pair);
    place_contacts(system, model, state);
    system->n_contact = state->n_contact;
    return NMM_OK;
}
