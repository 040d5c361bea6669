// SPDX-License-Identifier: MIT
//
// Ties of slivers, eq. (3.15): the difference of the polynomials of two neighbouring cells, over
// both their triangles, has an energy and a mass. Both are constant matrices in displacements of
// the covers and vanish for every linear displacement: rigid motions, and what they carry of
// momentum, do not feel them. Kept by entry of the constant pattern, beside the mass.

#include "system.h"

#include <math.h>

// Parts of Young's modulus and of the density.
#define TIE_STIFFNESS 0.01
#define TIE_MASS 0.01

static void list_ties(nmm_system *system, const nmm_model *model) {
    const int m = model->n_local, n = 2 * m;
    int *start = system->tie_start;
    for (int pass = 0; pass < 2; pass++) {
        // Counted first; then filled from the back, so that the starts end where they began.
        for (int k = n * model->n_tie - 1; k >= 0; k--) {
            const int e = model->tie_element[2 * (long)(k / n) + k % n / m];
            const int c = model->element_cover[m * (long)e + k % m];
            if (pass == 0)
                start[c + 1] += 1;
            else
                system->cover_tie[--start[c + 1]] = k;
        }
        for (int c = 0; c < model->n_cover && pass == 0; c++)
            start[c + 1] += start[c];
    }
    for (int c = 0; c < model->n_cover; c++)
        start[c] = start[c + 1];
    start[model->n_cover] = n * model->n_tie;
}

nmm_status nmm_ties_list(nmm_context *context, nmm_system *system, const nmm_model *model) {
    if (model->n_tie == 0) return NMM_OK;
    const size_t n = 2 * (size_t)model->n_local * (size_t)model->n_tie;
    TRY(nmm_allocate(context, &system->tie_start, (size_t)model->n_cover + 1, sizeof(int)));
    TRY(nmm_allocate(context, &system->cover_tie, n, sizeof(int)));
    list_ties(system, model);
    return NMM_OK;
}

int nmm_ties_columns(const nmm_system *system, const nmm_model *model, int c, int *column) {
    const int m = model->n_local;
    int n = 0;
    if (system->tie_start == NULL) return 0;
    for (int k = system->tie_start[c]; k < system->tie_start[c + 1]; k++) {
        const int *pair = model->tie_element + 2 * (long)(system->cover_tie[k] / (2 * m));
        for (int j = 0; j < 2 * m; j++)
            column[n++] = model->element_cover[m * (long)pair[j / m] + j % m];
    }
    return n;
}

// The softest and the lightest material of the cell that begins with element e: which of its
// elements has the lowest number must not matter.
static void take_least(const nmm_model *model, int e, double *modulus, double *density) {
    const int m = model->n_local, cover = model->element_cover[m * (long)e + 3];
    for (int k = model->cover_start[cover]; k < model->cover_start[cover + 1]; k++) {
        const int f = model->cover_element[k] / m;
        if (!nmm_same_covers(model, e, f)) continue;
        const nmm_material *material = &model->material[model->element_material[f]];
        *modulus = nmm_min(*modulus, material->youngs_modulus);
        *density = nmm_min(*density, material->density);
    }
}

// Adds row i of a tie to row c of the matrices.
static void add_row(nmm_system *system, const nmm_model *model, int c, int tie, int i) {
    const int m = model->n_local, n = 2 * m, *pair = model->tie_element + 2 * (long)tie;
    double modulus = INFINITY, density = INFINITY;
    take_least(model, pair[0], &modulus, &density);
    take_least(model, pair[1], &modulus, &density);
    const double stiffness = TIE_STIFFNESS * modulus / (model->size * model->size);
    const double mass = TIE_MASS * density;
    const double *gram = model->tie_gram + (long)tie * n * (n + 1) / 2;
    for (int j = 0; j < n; j++) {
        const int col = model->element_cover[m * (long)pair[j / m] + j % m];
        const double product = gram[nmm_pair_index(n, i, j)];
        const int at = nmm_system_entry(system, c, col);
        system->tie_stiffness[at] += stiffness * product;
        system->tie_mass[at] += mass * product;
        system->base_mass[at] += mass * product;
    }
}

nmm_status nmm_ties_fill(nmm_context *context, nmm_system *system, const nmm_model *model) {
    if (model->n_tie == 0) return NMM_OK;
    const size_t n_base = (size_t)system->base_start[model->n_cover];
    TRY(nmm_allocate(context, &system->tie_stiffness, n_base, sizeof(double)));
    TRY(nmm_allocate(context, &system->tie_mass, n_base, sizeof(double)));
    TRY(nmm_allocate(context, &system->tie_force, 2 * (size_t)model->n_cover, sizeof(double)));
    const int n = 2 * model->n_local;
    for (int c = 0; c < model->n_cover; c++) {
        for (int k = system->tie_start[c]; k < system->tie_start[c + 1]; k++)
            add_row(system, model, c, system->cover_tie[k] / n, system->cover_tie[k] % n);
    }
    return NMM_OK;
}

// Row c of a matrix times x. Only differences between nodes count: so a large displacement of the
// whole costs no digits.
static nmm_vec2 row_product(const nmm_system *system, const double *matrix, int c,
                            const double *x) {
    nmm_vec2 sum = {0, 0}, first = {0, 0};
    bool found = false;
    for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
        const int col = system->base_col[k];
        nmm_vec2 at = {x[2 * (long)col], x[2 * (long)col + 1]};
        if (system->body[col] >= 0) {
            if (!found) first = at;
            found = true;
            at = nmm_vec2_sub(at, first);
        }
        sum = nmm_vec2_add(sum, nmm_vec2_scale(matrix[k], at));
    }
    return sum;
}

double nmm_ties_product(const nmm_system *system, int n_cover, const double *matrix,
                        const double *a, const double *b) {
    double sum = 0;
    for (int c = 0; c < n_cover; c++) {
        if (system->tie_start[c] == system->tie_start[c + 1]) continue;
        const nmm_vec2 row = row_product(system, matrix, c, b);
        sum += a[2 * (long)c] * row.x + a[2 * (long)c + 1] * row.y;
    }
    return sum;
}

void nmm_ties_force(nmm_system *system, const nmm_model *model, const nmm_state *state,
                    const double *moved, int n_thread) {
    if (model->n_tie == 0) return;
    const int n = model->n_cover;
    const double before = 1 - system->share;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        if (system->tie_start[c] == system->tie_start[c + 1]) continue;
        const double *K = system->tie_stiffness;
        nmm_vec2 force = row_product(system, K, c, state->displacement);
        if (before != 0) {
            const nmm_vec2 change = row_product(system, K, c, moved);
            force = nmm_vec2_sub(force, nmm_vec2_scale(before, change));
        }
        system->tie_force[2 * (long)c] = force.x;
        system->tie_force[2 * (long)c + 1] = force.y;
    }
}
