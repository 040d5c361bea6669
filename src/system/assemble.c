// SPDX-License-Identifier: MIT
//
// Matrix of one pass: a Newton matrix, which need not be that of the very place. Elements, inertia
// and supports are added up once and kept, by entry of the constant pattern; each contact is kept
// as a spring, frozen when its mode was last another one. To make all of it, rows gather from
// elements and springs in a fixed order; between, only springs whose contacts changed mode are
// taken out and put in. What that leaves behind by rounding goes with the next full matrix, at the
// start of a step at the latest. Equations (4.x) of docs/theory/4-time.md.

#include "system.h"

#include <math.h>
#include <string.h>

static void add_diagonal(double *block, double x, double y) {
    block[0] += x;
    block[3] += y;
}

// --- Elements, inertia and supports

static void stiffness_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                           int n_thread) {
    const int n = model->n_element;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int e = 0; e < n; e++) {
        const double *gradient = model->element_gradient + 6 * (long)e;
        const double *initial = state->initial_stress + 3 * (long)e;
        double d[6];
        for (int i = 0; i < 6; i++)
            d[i] = state->displacement[2 * model->element_cover[3 * e + i / 2] + i % 2];
        const nmm_strain strain = nmm_strain_of(d, gradient);
        system->stiffness[e] = nmm_stiffness_of(system->elastic[model->element_material[e]],
                                                &strain, 0.5 * (initial[0] + initial[1]),
                                                system->share * model->element_area[e], gradient);
    }
}

static void add_elements(nmm_system *system, const nmm_model *model, int c) {
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int e = model->cover_element[k] / 3, i = model->cover_element[k] % 3;
        const int *slot = system->base_slot + 9 * (long)e + 3 * i;
        for (int j = 0; j < 3; j++)
            nmm_stiffness_add(&system->stiffness[e], i, j, system->base_value + 4 * (long)slot[j]);
    }
}

static void add_supports(nmm_system *system, const nmm_model *model, int c) {
    for (int k = system->support_start[c]; k < system->support_start[c + 1]; k++) {
        const int i = system->cover_support[k] % 3;
        const nmm_support *s = &model->support[system->cover_support[k] / 3];
        for (int j = 0; j < 3; j++) {
            const int slot = system->base_slot[9 * (long)s->element + 3 * i + j];
            const double w = system->share * s->stiffness * s->weight[i] * s->weight[j];
            add_diagonal(system->base_value + 4 * (long)slot, s->fix_x ? w : 0, s->fix_y ? w : 0);
        }
    }
}

static void base_row(nmm_system *system, const nmm_model *model, int c, double inertia) {
    const long begin = system->base_start[c], end = system->base_start[c + 1];
    for (long k = begin; k < end; k++) {
        const double m = inertia * system->base_mass[k];
        const double block[4] = {m, 0, 0, m};
        memcpy(system->base_value + 4 * k, block, sizeof block);
    }
    add_elements(system, model, c);
    add_supports(system, model, c);
}

// Held unknowns leave the system: their couplings vanish, their diagonal stays as a scale.
static void remove_held(nmm_system *system, int c) {
    for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
        double *block = system->base_value + 4 * (long)k;
        const int col = system->base_col[k];
        for (int x = 0; x < 4; x++) {
            const bool row_held = system->fixed[c] >> (x / 2) & 1;
            const bool col_held = system->fixed[col] >> (x % 2) & 1;
            const bool diagonal = col == c && x / 2 == x % 2;
            if ((row_held || col_held) && !diagonal) block[x] = 0;
        }
    }
}

// --- Contacts

static void hold_spring(nmm_spring *spring, const unsigned char *fixed, const int cover[6]) {
    for (int i = 0; i < 12; i++) {
        if (!(fixed[cover[i / 2]] >> i % 2 & 1)) continue;
        spring->normal[i / 2][i % 2] = 0;
        spring->shear[i / 2][i % 2] = 0;
    }
}

// The spring at place p of the couples' order, of couple q. Held unknowns do not feel it.
static void make_spring(nmm_system *system, const nmm_model *model, const nmm_state *state, int q,
                        int p) {
    nmm_spring *spring = &system->spring[p];
    const int k = system->couples.order[p] / 2, swapped = 3 * (system->couples.order[p] % 2);
    const nmm_contact *contact = &state->contact[k];
    const nmm_contact_row row = nmm_contact_row_of(model, state, contact);
    const size_t half = sizeof row.normal / 2;
    memcpy(spring->normal[0], row.normal[swapped], half);
    memcpy(spring->normal[3], row.normal[3 - swapped], half);
    memcpy(spring->shear[0], row.shear[swapped], half);
    memcpy(spring->shear[3], row.shear[3 - swapped], half);
    spring->normal_stiffness = contact->normal_stiffness;
    spring->shear_stiffness = contact->mode == NMM_CONTACT_STICK ? contact->shear_stiffness : 0;
    if (system->fixed == NULL) return;
    int cover[6];
    nmm_couple_covers(model, system->couples.element + 2 * (long)q, cover);
    hold_spring(spring, system->fixed, cover);
}

// All springs of couple q.
static void make_springs(nmm_system *system, const nmm_model *model, const nmm_state *state,
                         int q) {
    const nmm_couples *couples = &system->couples;
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
        system->spring_mode[p] = system->mode[couples->order[p] / 2];
        if (system->spring_mode[p] != NMM_CONTACT_OPEN) make_spring(system, model, state, q, p);
    }
}

// Adds the two rows of cover i of one spring to row[2][6][2].
static void add_spring(const nmm_spring *spring, int i, double *restrict row) {
    const double kn = spring->normal_stiffness, ks = spring->shear_stiffness;
    const double *normal = spring->normal[0], *shear = spring->shear[0];
    for (int x = 0; x < 2; x++) {
        const double across = kn * normal[2 * i + x], along = ks * shear[2 * i + x];
        for (int j = 0; j < 12; j++)
            row[12 * x + j] += across * normal[j] + along * shear[j];
    }
}

// Adds row[2][6][2] to row i of couple q in the matrix.
static void put_row(nmm_system *system, int q, int i, const double *row) {
    const int *slot = system->couples.slot + 36 * (long)q + 6 * (long)i;
    for (int j = 0; j < 6; j++) {
        double *block = system->K.value + 4 * (long)slot[j];
        block[0] += row[2 * j];
        block[1] += row[2 * j + 1];
        block[2] += row[12 + 2 * j];
        block[3] += row[12 + 2 * j + 1];
    }
}

// Springs of all couples of row c, added up couple by couple.
static void add_couples(nmm_system *system, int c) {
    const nmm_couples *couples = &system->couples;
    for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
        const int q = couples->cover_couple[k] / 6, i = couples->cover_couple[k] % 6;
        double row[24] = {0};
        bool any = false;
        for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
            if (system->spring_mode[p] == NMM_CONTACT_OPEN) continue;
            add_spring(&system->spring[p], i, row);
            any = true;
        }
        if (any) put_row(system, q, i, row);
    }
}

// Puts the spring at place p of couple q in (sign 1) or takes it out (sign -1).
static void change_spring(nmm_system *system, int q, int p, double sign) {
    if (system->spring_mode[p] == NMM_CONTACT_OPEN) return;
    nmm_spring spring = system->spring[p];
    spring.normal_stiffness *= sign;
    spring.shear_stiffness *= sign;
    for (int i = 0; i < 6; i++) {
        double row[24] = {0};
        add_spring(&spring, i, row);
        put_row(system, q, i, row);
    }
}

// Serial: few change, and two of them may meet in one block.
static bool change_springs(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const nmm_couples *couples = &system->couples;
    bool changed = false;
    for (int q = 0; q < couples->n; q++) {
        for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
            const unsigned char mode = system->mode[couples->order[p] / 2];
            if (mode == system->spring_mode[p]) continue;
            change_spring(system, q, p, -1);
            system->spring_mode[p] = mode;
            if (mode != NMM_CONTACT_OPEN) make_spring(system, model, state, q, p);
            change_spring(system, q, p, 1);
            changed = true;
        }
    }
    return changed;
}

// --- All

static void fill_row(nmm_system *system, int c) {
    nmm_bsr *K = &system->K;
    const size_t block = 4 * sizeof(double);
    const long begin = K->row_start[c], end = K->row_start[c + 1];
    memset(K->value + 4 * begin, 0, (size_t)(end - begin) * block);
    for (long k = system->base_start[c]; k < system->base_start[c + 1]; k++)
        memcpy(K->value + 4 * (long)system->place[k], system->base_value + 4 * k, block);
    add_couples(system, c);
}

static void make_all(const nmm_context *context, nmm_system *system, const nmm_model *model,
                     const nmm_state *state, double h) {
    const int n_thread = context->n_thread, n = model->n_cover, n_couple = system->couples.n;
    const double inertia = 2 / (h * h) + 2 * system->damping / h;
    stiffness_pass(system, model, state, n_thread);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_couple > 1024)
    for (int q = 0; q < n_couple; q++)
        make_springs(system, model, state, q);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        base_row(system, model, c, inertia);
        if (system->fixed != NULL) remove_held(system, c);
        fill_row(system, c);
    }
}

bool nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h, bool anew) {
    if (!anew && system->made) return change_springs(system, model, state);
    make_all(context, system, model, state, h);
    system->made = true;
    return true;
}
