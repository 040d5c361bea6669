// SPDX-License-Identifier: MIT
//
// Matrix of one pass: a Newton matrix, which need not be that of the very place. Elements, inertia
// and supports are added up once and kept, by entry of the constant pattern; each contact is kept
// as a spring, frozen when its mode was last another one. A pass then makes anew only the rows of
// contacts that changed mode. Both halves of the matrix come from the same springs, so that it
// stays symmetric. Rows gather in a fixed order. Equations (4.x) of docs/theory/4-time.md.

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
        system->stiffness[e] =
            nmm_stiffness_of(system->elastic[model->element_material[e]], &strain,
                             0.5 * (initial[0] + initial[1]), model->element_area[e], gradient);
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
            const double w = s->stiffness * s->weight[i] * s->weight[j];
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

// --- Contacts

static void make_spring(nmm_spring *spring, const nmm_model *model, const nmm_state *state,
                        const nmm_contact *contact, bool swapped) {
    const nmm_contact_row row = nmm_contact_row_of(model, state, contact);
    for (int i = 0; i < 6; i++) {
        const int from = swapped ? (i + 3) % 6 : i;
        memcpy(spring->normal[i], row.normal[from], sizeof row.normal[from]);
        memcpy(spring->shear[i], row.shear[from], sizeof row.shear[from]);
    }
    spring->normal_stiffness = contact->normal_stiffness;
    spring->shear_stiffness = contact->mode == NMM_CONTACT_STICK ? contact->shear_stiffness : 0;
}

// Springs of couple q whose contacts changed mode, or all of them; marks the couple.
static void make_springs(nmm_system *system, const nmm_model *model, const nmm_state *state, int q,
                         bool anew) {
    nmm_couples *couples = &system->couples;
    couples->old[q] = anew;
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
        const int k = couples->order[p] / 2;
        const unsigned char mode = (unsigned char)state->contact[k].mode;
        if (!anew && mode == system->spring_mode[p]) continue;
        system->spring_mode[p] = mode;
        couples->old[q] = true;
        if (mode == NMM_CONTACT_OPEN) continue;
        make_spring(&system->spring[p], model, state, &state->contact[k], couples->order[p] % 2);
    }
}

// Adds row i of one spring to sum[6][2][2].
static void add_spring(const nmm_spring *spring, int i, double *restrict sum) {
    const double kn = spring->normal_stiffness, ks = spring->shear_stiffness;
    const double across[2] = {kn * spring->normal[i][0], kn * spring->normal[i][1]};
    const double along[2] = {ks * spring->shear[i][0], ks * spring->shear[i][1]};
    for (int j = 0; j < 6; j++) {
        for (int x = 0; x < 4; x++) {
            sum[4 * j + x] +=
                across[x / 2] * spring->normal[j][x % 2] + along[x / 2] * spring->shear[j][x % 2];
        }
    }
}

// Springs of all couples of row c, added up couple by couple.
static void add_couples(nmm_system *system, int c) {
    const nmm_couples *couples = &system->couples;
    for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
        const int q = couples->cover_couple[k] / 6, i = couples->cover_couple[k] % 6;
        double sum[24] = {0};
        bool any = false;
        for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
            if (system->spring_mode[p] == NMM_CONTACT_OPEN) continue;
            add_spring(&system->spring[p], i, sum);
            any = true;
        }
        if (!any) continue;
        const int *slot = couples->slot + 36 * (long)q + 6 * (long)i;
        for (int j = 0; j < 6; j++) {
            double *block = system->K.value + 4 * (long)slot[j];
            for (int x = 0; x < 4; x++)
                block[x] += sum[4 * j + x];
        }
    }
}

static bool has_old_couple(const nmm_couples *couples, int c) {
    for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
        if (couples->old[couples->cover_couple[k] / 6]) return true;
    }
    return false;
}

// Where forces are uncertain by rounding: a gap is a difference of places.
static double closed_stiffness(const nmm_system *system) {
    double sum = 0;
    for (int p = 0; p < system->couples.n_contact; p++) {
        const double kn = system->spring[p].normal_stiffness;
        if (system->spring_mode[p] != NMM_CONTACT_OPEN) sum += kn * kn;
    }
    return sqrt(sum);
}

// --- Rows

// Held unknowns leave the system: their couplings vanish, their diagonal stays as a scale.
static void remove_held(nmm_system *system, int c) {
    nmm_bsr *K = &system->K;
    for (int k = K->row_start[c]; k < K->row_start[c + 1]; k++) {
        double *block = K->value + 4 * (long)k;
        for (int x = 0; x < 4; x++) {
            const bool row_held = system->fixed[c] >> (x / 2) & 1;
            const bool col_held = system->fixed[K->col[k]] >> (x % 2) & 1;
            const bool diagonal = K->col[k] == c && x / 2 == x % 2;
            if ((row_held || col_held) && !diagonal) block[x] = 0;
        }
    }
}

static void fill_row(nmm_system *system, int c) {
    nmm_bsr *K = &system->K;
    const size_t block = 4 * sizeof(double);
    const long begin = K->row_start[c], end = K->row_start[c + 1];
    memset(K->value + 4 * begin, 0, (size_t)(end - begin) * block);
    for (long k = system->base_start[c]; k < system->base_start[c + 1]; k++)
        memcpy(K->value + 4 * (long)system->place[k], system->base_value + 4 * k, block);
    add_couples(system, c);
    if (system->fixed != NULL) remove_held(system, c);
}

bool nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h, bool anew) {
    const int n_thread = context->n_thread, n = model->n_cover, n_couple = system->couples.n;
    const double inertia = 2 / (h * h) + 2 * system->damping / h;
    const bool all = anew || !system->made;
    bool changed = all;
    if (all) stiffness_pass(system, model, state, n_thread);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_couple > 1024)
    for (int q = 0; q < n_couple; q++)
        make_springs(system, model, state, q, all);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)      \
    reduction(||                                                                                   \
              : changed)
    for (int c = 0; c < n; c++) {
        if (!all && !has_old_couple(&system->couples, c)) continue;
        if (all) base_row(system, model, c, inertia);
        fill_row(system, c);
        changed = true;
    }
    system->contact_stiffness = closed_stiffness(system);
    system->made = true;
    return changed;
}
