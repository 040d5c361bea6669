// SPDX-License-Identifier: MIT
//
// Sparsity: covers that share an element, a constant pattern, merged with covers whose elements
// share a contact. `place` and the slots of the couples say where each contribution goes, so that
// the assembly needs no search. Both halves are stored and columns ascend.

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

int nmm_system_entry(const nmm_system *system, int c, int col) {
    return find_column(system->base_col, system->base_start[c], system->base_start[c + 1], col);
}

// --- Constant part

// Columns of row c into scratch, ascending, without repetition; returns how many.
static int columns_of_cover(const nmm_system *system, const nmm_model *model, int c, int *scratch) {
    const int m = model->n_local;
    int n = nmm_ties_columns(system, model, c, scratch);
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int *cover = model->element_cover + m * (long)(model->cover_element[k] / m);
        for (int j = 0; j < m; j++)
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
    const int n = model->n_cover, m = model->n_local;
    const size_t n_slot = (size_t)model->n_element * (size_t)(m * m);
    const size_t n_tied = (size_t)model->n_tie * (size_t)(4 * m * m);
    int longest = 0;
    for (int c = 0; c < n; c++) {
        const int n_tie =
            system->tie_start != NULL ? system->tie_start[c + 1] - system->tie_start[c] : 0;
        longest =
            nmm_max_int(longest, model->cover_start[c + 1] - model->cover_start[c] + 2 * n_tie);
    }
    TRY(nmm_allocate(context, &system->base_start, (size_t)n + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->base_col, n_slot + n_tied, sizeof(int)));
    TRY(nmm_allocate(context, &system->base_slot, n_slot, sizeof(int)));
    int *scratch = NULL;
    TRY(nmm_allocate(context, &scratch, (size_t)m * (size_t)longest + 1, sizeof(int)));
    for (int c = 0; c < n; c++) {
        const int kept = columns_of_cover(system, model, c, scratch);
        memcpy(system->base_col + system->base_start[c], scratch, (size_t)kept * sizeof(int));
        system->base_start[c + 1] = system->base_start[c] + kept;
    }
    nmm_release(context, &scratch);
    for (int e = 0; e < model->n_element; e++) {
        const int *cover = model->element_cover + m * (long)e;
        for (int k = 0; k < m * m; k++) {
            const int row = cover[k / m];
            system->base_slot[m * m * (long)e + k] = nmm_system_entry(system, row, cover[k % m]);
        }
    }
    return NMM_OK;
}

// Mass of an element with linear functions, lumped as its row sums when asked for.
static void linear_mass(nmm_system *system, const nmm_model *model, int e, bool lumped) {
    const double density = model->material[model->element_material[e]].density;
    const double *weight = model->element_weight + 3 * (long)e;
    double *mass = system->element_mass + 6 * (long)e;
    nmm_mass_of(density, model->element_area[e], model->element_moment + 3 * (long)e, weight,
                model->element_gradient + 6 * (long)e, mass);
    for (int i = 0; i < 3; i++) {
        const double row = density * model->element_area[e] * weight[i];
        system->cover_mass[model->element_cover[3 * e + i]] += row;
        for (int j = i; j < 3 && lumped; j++)
            mass[nmm_pair_index(3, i, j)] = i == j ? row : 0;
    }
}

// Of any order, by the integrals of the products. The linear functions add to one: the integral of
// a function is the sum of its products with them.
static void curved_mass(nmm_system *system, const nmm_model *model, int e) {
    const double density = model->material[model->element_material[e]].density;
    const int m = model->n_local, n_pair = m * (m + 1) / 2;
    const double *gram = model->element_gram + (long)n_pair * e;
    double *mass = system->element_mass + (long)n_pair * e;
    for (int k = 0; k < n_pair; k++)
        mass[k] = density * gram[k];
    for (int i = 0; i < m; i++) {
        double *row = &system->cover_mass[model->element_cover[m * (long)e + i]];
        for (int j = 0; j < 3; j++)
            *row += mass[nmm_pair_index(m, i, j)];
    }
}

// Mass of each element and of each cover.
static void build_mass(nmm_system *system, const nmm_model *model, bool lumped) {
    const int m = model->n_local;
    for (int e = 0; e < model->n_element; e++) {
        if (model->order == 0)
            linear_mass(system, model, e, lumped);
        else
            curved_mass(system, model, e);
        const double *mass = system->element_mass + (long)e * m * (m + 1) / 2;
        for (int k = 0; k < m * m; k++) {
            const int slot = system->base_slot[m * m * (long)e + k];
            system->base_mass[slot] += mass[nmm_pair_index(m, k / m, k % m)];
        }
    }
}

// Entries n_local * item + place of the cover in the item's element, by cover, ascending.
static nmm_status list_by_cover(nmm_context *context, const nmm_model *model, int n_item,
                                const int *element_of, int **start_of, int **entry_of) {
    const int n = model->n_cover, m = model->n_local, n_entry = m * n_item;
    TRY(nmm_allocate(context, start_of, (size_t)n + 1, sizeof(int)));
    TRY(nmm_allocate(context, entry_of, (size_t)n_entry, sizeof(int)));
    int *start = *start_of;
    for (int k = 0; k < n_entry; k++)
        start[model->element_cover[m * (long)element_of[k / m] + k % m] + 1] += 1;
    for (int c = 0; c < n; c++)
        start[c + 1] += start[c];
    // Filled from the back, so that `start` ends where it began.
    for (int k = n_entry - 1; k >= 0; k--) {
        const int c = model->element_cover[m * (long)element_of[k / m] + k % m];
        (*entry_of)[--start[c + 1]] = k;
    }
    for (int c = 0; c < n; c++)
        start[c] = start[c + 1];
    start[n] = n_entry;
    return NMM_OK;
}

static nmm_status build_supports(nmm_context *context, nmm_system *system, const nmm_model *model) {
    int *element = NULL;
    TRY(nmm_allocate(context, &element, (size_t)model->n_support, sizeof(int)));
    for (int s = 0; s < model->n_support; s++)
        element[s] = model->support[s].element;
    const nmm_status status = list_by_cover(context, model, model->n_support, element,
                                            &system->support_start, &system->cover_support);
    nmm_release(context, &element);
    return status;
}

static nmm_status build_holds(nmm_context *context, nmm_system *system, const nmm_model *model) {
    const size_t n = (size_t)model->n_cover;
    if (model->n_hold == 0) return NMM_OK;
    TRY(nmm_allocate(context, &system->fixed, n, 1));
    TRY(nmm_allocate(context, &system->reaction, 2 * n, sizeof(double)));
    for (int k = 0; k < model->n_hold; k++) {
        const nmm_hold *hold = &model->hold[k];
        system->fixed[hold->cover] |= (unsigned char)(hold->fix_x + 2 * hold->fix_y);
    }
    return NMM_OK;
}

// Order > 0: only covers of nodes take part in rigid motions.
static nmm_status build_bodies(nmm_context *context, nmm_system *system, const nmm_model *model) {
    if (model->order == 0) return NMM_OK;
    TRY(nmm_allocate(context, &system->body, (size_t)model->n_cover, sizeof(int)));
    for (int c = 0; c < model->n_cover; c++)
        system->body[c] = -1;
    for (int k = 0; k < 3 * model->n_element; k++) {
        const int c = model->element_cover[model->n_local * (long)(k / 3) + k % 3];
        system->body[c] = model->cover_block[c];
    }
    return NMM_OK;
}

// What each residual and each matrix fills.
static nmm_status allocate_passes(nmm_context *context, nmm_system *system,
                                  const nmm_model *model) {
    const size_t n = (size_t)model->n_cover, n_element = (size_t)model->n_element;
    const size_t n_base = (size_t)system->base_start[n];
    const size_t m = (size_t)model->n_local;
    if (model->order == 0) {
        TRY(nmm_allocate(context, &system->piola, 4 * n_element, sizeof(double)));
        TRY(nmm_allocate(context, &system->stiffness, n_element, sizeof(nmm_stiffness)));
    } else {
        TRY(nmm_allocate(context, &system->curved_stiffness, 4 * m * m * n_element,
                         sizeof(double)));
    }
    TRY(nmm_allocate(context, &system->element_force, 2 * m * n_element, sizeof(double)));
    TRY(nmm_allocate(context, &system->acceleration, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->load, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->support_force, 2 * (size_t)model->n_support,
                     sizeof(double)));
    TRY(nmm_allocate(context, &system->scale, n, sizeof(double)));
    TRY(nmm_allocate(context, &system->diagonal, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->residual, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->change, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->place, n_base, sizeof(int)));
    TRY(nmm_allocate(context, &system->row_room, n, sizeof(int)));
    TRY(nmm_allocate(context, &system->K.row_start, n + 1, sizeof(int)));
    return nmm_allocate(context, &system->K.diagonal, n, sizeof(int));
}

nmm_status nmm_system_create(nmm_context *context, const nmm_model *model,
                             const nmm_scene_settings *settings, nmm_system *system) {
    const size_t n = (size_t)model->n_cover, n_element = (size_t)model->n_element;
    system->damping = settings->damping;
    system->share = 2 * settings->beta;
    if (settings->newmark) {
        const size_t n_stress = model->order == 0 ? n_element : (size_t)model->n_sample;
        TRY(nmm_allocate(context, &system->start_stress, 3 * n_stress, sizeof(double)));
        TRY(nmm_allocate(context, &system->start_load, 2 * n, sizeof(double)));
        TRY(nmm_allocate(context, &system->start_reaction, 2 * (size_t)model->n_support,
                         sizeof(double)));
    }
    TRY(nmm_ties_list(context, system, model));
    TRY(build_base(context, system, model));
    const size_t n_pair = (size_t)(model->n_local * (model->n_local + 1) / 2);
    TRY(nmm_allocate(context, &system->element_mass, n_element * n_pair, sizeof(double)));
    TRY(nmm_allocate(context, &system->base_mass, (size_t)system->base_start[n], sizeof(double)));
    TRY(nmm_allocate(context, &system->cover_mass, n, sizeof(double)));
    build_mass(system, model, settings->mass == NMM_MASS_LUMPED);
    TRY(nmm_ties_fill(context, system, model));
    TRY(nmm_allocate(context, &system->elastic, (size_t)model->n_material, sizeof(nmm_elastic)));
    for (int m = 0; m < model->n_material; m++)
        system->elastic[m] = nmm_elastic_of(&model->material[m]);
    if (settings->contact_method == NMM_CONTACT_AUGMENTED) {
        TRY(nmm_system_measure(context, system, model));
    }
    TRY(build_supports(context, system, model));
    TRY(list_by_cover(context, model, model->n_vertex, model->edge_element, &system->edge_start,
                      &system->cover_edge));
    TRY(build_holds(context, system, model));
    TRY(build_bodies(context, system, model));
    TRY(nmm_couples_create(context, &system->couples, model));
    system->K.n_row = model->n_cover;
    return allocate_passes(context, system, model);
}

void nmm_system_destroy(nmm_context *context, nmm_system *system) {
    void *owned[] = {
        &system->K.value,        &system->K.diagonal,    &system->residual,
        &system->change,         &system->base_start,    &system->base_col,
        &system->base_slot,      &system->element_mass,  &system->base_mass,
        &system->cover_mass,     &system->elastic,       &system->support_start,
        &system->cover_support,  &system->edge_start,    &system->cover_edge,
        &system->fixed,          &system->reaction,      &system->place,
        &system->column,         &system->start_stress,  &system->start_load,
        &system->start_reaction, &system->row_room,      &system->piola,
        &system->element_force,  &system->acceleration,  &system->load,
        &system->support_force,  &system->pull,          &system->edge_force,
        &system->contact_force,  &system->caught,        &system->scale,
        &system->cover_give,     &system->stiffness,     &system->spring,
        &system->mode,           &system->spring_mode,   &system->body,
        &system->tie_start,      &system->cover_tie,     &system->tie_stiffness,
        &system->tie_mass,       &system->tie_force,     &system->curved_stiffness,
        &system->coupling.row,   &system->coupling.push, &system->coupling.pull,
        &system->K.row_start,    &system->K.col,         &system->diagonal,
    };
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        nmm_release(context, owned[i]);
    nmm_couples_destroy(context, &system->couples);
    *system = (nmm_system){0};
}

// --- Contacts

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
static int columns_of_row(const nmm_system *system, const nmm_model *model, int c, int *column) {
    const nmm_couples *couples = &system->couples;
    const int m = model->n_local;
    int n = system->base_start[c + 1] - system->base_start[c];
    memcpy(column, system->base_col + system->base_start[c], (size_t)n * sizeof *column);
    for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
        const int q = couples->cover_couple[k] / (2 * m);
        const int side = couples->cover_couple[k] % (2 * m) / m;
        const int *other = model->element_cover + m * (long)couples->element[2 * q + 1 - side];
        for (int j = 0; j < m; j++)
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
static nmm_status gather_columns(nmm_context *context, nmm_system *system, const nmm_model *model) {
    const int n = system->K.n_row, m = model->n_local, n_thread = context->n_thread;
    const int *couple_start = system->couples.cover_start;
    for (int c = 0; c < n; c++)
        system->row_room[c] = system->base_start[c] + m * couple_start[c];
    TRY(nmm_grow(context, &system->column, &system->column_capacity,
                 system->base_start[n] + m * couple_start[n], sizeof(int)));
    int *start = system->K.row_start;
    start[0] = 0;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        start[c + 1] = columns_of_row(system, model, c, system->column + system->row_room[c]);
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

// Where the springs of couple q go: within an element that is known, across it is searched.
static void place_couple(nmm_system *system, const nmm_model *model, int q) {
    const nmm_bsr *K = &system->K;
    const int *element = system->couples.element + 2 * (long)q;
    const int m = model->n_local, n_side = 2 * m;
    int *slot = system->couples.slot + n_side * n_side * (long)q;
    int cover[2 * NMM_MOST_LOCAL] = {0};
    nmm_couple_covers(model, element, cover);
    for (int i = 0; i < n_side; i++) {
        const int row = cover[i], own = i / m;
        for (int j = 0; j < m; j++) {
            const long base = m * m * (long)element[own] + m * (i % m) + j;
            const int across = m * (1 - own) + j;
            slot[n_side * i + m * own + j] = system->place[system->base_slot[base]];
            slot[n_side * i + across] =
                find_column(K->col, K->row_start[row], K->row_start[row + 1], cover[across]);
        }
    }
}

// Contact forces, from the first contact on.
static nmm_status allocate_forces(nmm_context *context, nmm_system *system,
                                  const nmm_model *model) {
    const size_t n_vertex = (size_t)model->n_vertex, n = (size_t)model->n_cover;
    const size_t of_edge = 2 * (size_t)model->n_local;
    if (system->edge_force != NULL) return NMM_OK;
    TRY(nmm_allocate(context, &system->contact_force, 2 * n, sizeof(double)));
    TRY(nmm_allocate(context, &system->caught, 2 * n, sizeof(double)));
    return nmm_allocate(context, &system->edge_force, of_edge * n_vertex, sizeof(double));
}

static nmm_status grow_springs(nmm_context *context, nmm_system *system, const nmm_model *model,
                               int n) {
    int capacity[4];
    for (int i = 0; i < 4; i++)
        capacity[i] = system->spring_capacity;
    TRY(nmm_grow(context, &system->spring, &capacity[0], n,
                 (size_t)nmm_spring_size(model->n_local) * sizeof(double)));
    TRY(nmm_grow(context, &system->spring_mode, &capacity[1], n, 1));
    TRY(nmm_grow(context, &system->pull, &capacity[2], n, 6 * sizeof(double)));
    TRY(nmm_grow(context, &system->mode, &capacity[3], n, 1));
    system->spring_capacity = capacity[0];
    return NMM_OK;
}

nmm_status nmm_system_pattern(nmm_context *context, nmm_system *system, const nmm_model *model,
                              const nmm_state *state) {
    const int n = model->n_cover, n_thread = context->n_thread;
    nmm_couples_change change;
    TRY(nmm_couples_list(context, &system->couples, model, state, &change));
    TRY(grow_springs(context, system, model, state->n_contact));
    if (state->n_contact > 0) TRY(allocate_forces(context, system, model));
    system->keep_pattern = change != NMM_COUPLES_CHANGED;
    if (system->keep_pattern) return NMM_OK;
    TRY(gather_columns(context, system, model));
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++)
        fill_row(system, c);
    const int n_couple = system->couples.n;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_couple > 1024)
    for (int q = 0; q < n_couple; q++)
        place_couple(system, model, q);
    return NMM_OK;
}
