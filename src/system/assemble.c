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

/// Gap, as a part of the cover size, up to which an open contact only just touches.
#define TOUCHES 1e-9

static void add_diagonal(double *block, double x, double y) {
    block[0] += x;
    block[3] += y;
}

// --- Elements, inertia and supports

static void linear_stiffness(nmm_system *system, const nmm_model *model, const nmm_state *state,
                             int e) {
    const double *gradient = model->element_gradient + 6 * (long)e;
    const double *initial = state->initial_stress + 3 * (long)e;
    double d[6];
    for (int i = 0; i < 6; i++)
        d[i] = state->displacement[2 * model->element_cover[3 * e + i / 2] + i % 2];
    const nmm_strain strain = nmm_strain_of(d, gradient);
    system->stiffness[e] = nmm_stiffness_of(system->elastic[model->element_material[e]], &strain,
                                            0.5 * (initial[0] + initial[1]),
                                            system->share * model->element_area[e], gradient);
}

static void stiffness_pass(nmm_system *system, const nmm_model *model, const nmm_state *state,
                           int n_thread) {
    const int n = model->n_element, m = model->n_local;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n * m > 6144)
    for (int e = 0; e < n; e++) {
        if (model->order == 0) {
            linear_stiffness(system, model, state, e);
            continue;
        }
        nmm_curved_stiffness(model, state, system->elastic[model->element_material[e]], e,
                             system->share, system->curved_stiffness + 4 * m * m * (long)e);
    }
}

// Entry k of the constant pattern in the matrix.
static inline double *base_block(const nmm_system *system, int k) {
    return system->K.value + 4 * (long)system->place[k];
}

static void add_curved(nmm_system *system, const nmm_model *model, int c) {
    const int m = model->n_local;
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        // Its slot is a row of all the elements' matrices.
        const int *slot = system->base_slot + m * (long)model->cover_element[k];
        const double *from = system->curved_stiffness + 4 * m * (long)model->cover_element[k];
        for (int j = 0; j < m; j++) {
            double *block = base_block(system, slot[j]);
            for (int x = 0; x < 4; x++)
                block[x] += from[4 * j + x];
        }
    }
}

static inline void add_elements(nmm_system *system, const nmm_model *model, int c) {
    for (int k = model->cover_start[c]; k < model->cover_start[c + 1]; k++) {
        const int e = model->cover_element[k] / 3, i = model->cover_element[k] % 3;
        const int *slot = system->base_slot + 9 * (long)e + 3 * i;
        const nmm_stiffness stiffness = system->stiffness[e];
        for (int j = 0; j < 3; j++)
            nmm_stiffness_add(&stiffness, i, j, base_block(system, slot[j]));
    }
}

static void add_supports(nmm_system *system, const nmm_model *model, int c) {
    const int m = model->n_local;
    for (int k = system->support_start[c]; k < system->support_start[c + 1]; k++) {
        const int i = system->cover_support[k] % m;
        const nmm_support *s = &model->support[system->cover_support[k] / m];
        for (int j = 0; j < m; j++) {
            const int slot = system->base_slot[m * (m * (long)s->element + i) + j];
            const double w = system->share * s->stiffness * s->weight[i] * s->weight[j];
            add_diagonal(base_block(system, slot), s->fix_x ? w : 0, s->fix_y ? w : 0);
        }
    }
}

static inline __attribute__((always_inline)) void
base_row(nmm_system *system, const nmm_model *model, int c, double inertia, int m) {
    const int begin = system->base_start[c], end = system->base_start[c + 1];
    for (int k = begin; k < end; k++) {
        double *block = base_block(system, k);
        block[0] = block[3] = inertia * system->base_mass[k];
    }
    if (m == 3)
        add_elements(system, model, c);
    else
        add_curved(system, model, c);
    add_supports(system, model, c);
    if (model->n_tie == 0 || system->tie_start[c] == system->tie_start[c + 1]) return;
    for (int k = begin; k < end; k++) {
        const double tie = system->share * system->tie_stiffness[k];
        add_diagonal(base_block(system, k), tie, tie);
    }
}

// Held unknowns leave the system: their couplings vanish, their diagonal stays as a scale.
static void remove_held(nmm_system *system, int c) {
    for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
        const int col = system->base_col[k];
        if (!(system->fixed[c] | system->fixed[col])) continue;
        double *block = base_block(system, k);
        for (int x = 0; x < 4; x++) {
            const bool row_held = system->fixed[c] >> (x / 2) & 1;
            const bool col_held = system->fixed[col] >> (x % 2) & 1;
            const bool diagonal = col == c && x / 2 == x % 2;
            if ((row_held || col_held) && !diagonal) block[x] = 0;
        }
    }
}

// --- Contacts

// The functions below take m, the functions of an element: where it is a constant, their loops are
// straight code.

typedef double four __attribute__((vector_size(32)));

// Derivatives of the gap, [2 m][2]; behind them those of the slip, then both stiffnesses.
static inline double *spring_of(const nmm_system *system, int p, int m) {
    return system->spring + nmm_spring_size(m) * (long)p;
}

// Is any unknown of couple q held?
static bool is_held(const nmm_system *system, const nmm_model *model, int q) {
    const int m = model->n_local, *element = system->couples.element + 2 * (long)q;
    int held = 0;
    for (int i = 0; i < m && system->fixed != NULL; i++) {
        held |= system->fixed[model->element_cover[m * (long)element[0] + i]];
        held |= system->fixed[model->element_cover[m * (long)element[1] + i]];
    }
    return held != 0;
}

// Held unknowns do not feel the spring at place p of couple q.
static void hold_spring(const nmm_system *system, const nmm_model *model, int q, int p) {
    const int m = model->n_local;
    double *spring = spring_of(system, p, m);
    for (int side = 0; side < 2; side++) {
        const int *cover = model->element_cover + m * (long)system->couples.element[2 * q + side];
        double *normal = spring + 2 * m * side, *shear = normal + 4 * m;
        for (int i = 0; i < m; i++) {
            const int held = system->fixed[cover[i]];
            if (held & 1) normal[2 * i] = shear[2 * i] = 0;
            if (held & 2) normal[2 * i + 1] = shear[2 * i + 1] = 0;
        }
    }
}

static bool holds_shear(unsigned char mode) {
    return mode == NMM_SPRING_STICK || mode == NMM_SPRING_CAUGHT;
}

static bool slides(unsigned char mode) {
    return mode == NMM_SPRING_SLIDE || mode == NMM_SPRING_SLIDE_BACK;
}

// The spring at place p of the couples' order, whose couple's first element may be the edge's.
static void make_spring(nmm_system *system, const nmm_model *model, const nmm_state *state, int p) {
    const int m = model->n_local, order = system->couples.order[p];
    double *spring = spring_of(system, p, m);
    const nmm_contact *contact = &state->contact[order / 2];
    const int of_vertex = order % 2 == 1 ? 2 * m : 0, of_edge = 2 * m - of_vertex;
    const nmm_derivatives to = {{spring + of_vertex, spring + of_edge},
                                {spring + 4 * m + of_vertex, spring + 4 * m + of_edge}};
    nmm_contact_derive(model, contact, &to);
    spring[8 * m] = contact->normal_stiffness;
    spring[8 * m + 1] = holds_shear(system->spring_mode[p]) ? contact->shear_stiffness : 0;
}

// What was to slide one way and slid the other is caught: a spring that holds its shear finds the
// balance between, where without one passes would throw it to and fro.
static unsigned char next_mode(unsigned char spring, unsigned char now) {
    const bool reversed = slides(spring) && slides(now) && spring != now;
    return reversed ? NMM_SPRING_CAUGHT : now;
}

// Mode by which the contact at place p gets its spring. Where bodies are pressed, one that only
// just touches counts as closed: as an open one it would let each pass bring a push to the next
// body only.
static unsigned char first_mode(const nmm_system *system, const nmm_model *model,
                                const nmm_state *state, int p) {
    if (!system->pressed || system->mode[p] != NMM_SPRING_OPEN) return system->mode[p];
    const nmm_contact *contact = &state->contact[system->couples.order[p] / 2];
    const bool touches = fabs(contact->gap - contact->rest) <= TOUCHES * model->size;
    return touches ? NMM_SPRING_SLIDE : NMM_SPRING_OPEN;
}

// All springs of couple q.
static void make_springs(nmm_system *system, const nmm_model *model, const nmm_state *state,
                         int q) {
    const nmm_couples *couples = &system->couples;
    const bool held = is_held(system, model, q);
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
        system->spring_mode[p] = first_mode(system, model, state, p);
        if (system->spring_mode[p] == NMM_SPRING_OPEN) continue;
        make_spring(system, model, state, p);
        if (held) hold_spring(system, model, q, p);
    }
}

// Adds the two rows of cover i of one spring, times `sign`, to row[2][2 m][2].
static inline void add_spring(const double *spring, int i, double sign, int m,
                              double *restrict row) {
    const double kn = sign * spring[8 * m], ks = sign * spring[8 * m + 1];
    const double *normal = spring, *shear = spring + 4 * m;
    for (int x = 0; x < 2; x++) {
        const double across = kn * normal[2 * i + x], along = ks * shear[2 * i + x];
        for (int j = 0; j < 4 * m; j++)
            row[4 * m * x + j] += across * normal[j] + along * shear[j];
    }
}

// Adds row[2][2 m][2] to row i of couple q in the matrix.
static inline void put_row(nmm_system *system, int q, int i, int m, const double *row) {
    const int *slot = system->couples.slot + 2 * m * (2 * m * (long)q + i);
    for (int j = 0; j < 2 * m; j++) {
        double *block = system->K.value + 4 * (long)slot[j];
        block[0] += row[2 * j];
        block[1] += row[2 * j + 1];
        block[2] += row[4 * m + 2 * j];
        block[3] += row[4 * m + 2 * j + 1];
    }
}

// Adds the closed springs of couple q to row i of it in the matrix: sums stay in registers where m
// is a constant. `slot` of that row.
static inline __attribute__((always_inline)) void add_cover(const nmm_system *system, int q, int i,
                                                            const int *slot, int m) {
    const unsigned char *mode = system->spring_mode;
    const int end = system->couples.start[q + 1];
    double *value = system->K.value;
    bool any = false;
    four sum[2][NMM_MOST_LOCAL];
    for (int j = 0; j < m; j++)
        sum[0][j] = sum[1][j] = (four){0, 0, 0, 0};
    for (int p = system->couples.start[q]; p < end; p++) {
        if (mode[p] == NMM_SPRING_OPEN) continue;
        const double *normal = spring_of(system, p, m), *shear = normal + 4 * m;
        const double kn = normal[8 * m], ks = normal[8 * m + 1];
        const double across[2] = {kn * normal[2 * i], kn * normal[2 * i + 1]};
        const double along[2] = {ks * shear[2 * i], ks * shear[2 * i + 1]};
        any = true;
        for (int j = 0; j < m; j++) {
            four n, s;
            memcpy(&n, normal + 4 * j, sizeof n);
            memcpy(&s, shear + 4 * j, sizeof s);
            sum[0][j] += across[0] * n + along[0] * s;
            sum[1][j] += across[1] * n + along[1] * s;
        }
    }
    // Two blocks at a time, each of both rows.
    for (int j = 0; j < m && any; j++) {
        double *block[2] = {value + 4 * (long)slot[2 * j], value + 4 * (long)slot[2 * j + 1]};
        four old[2];
        memcpy(&old[0], block[0], sizeof *old);
        memcpy(&old[1], block[1], sizeof *old);
        old[0] += __builtin_shufflevector(sum[0][j], sum[1][j], 0, 1, 4, 5);
        old[1] += __builtin_shufflevector(sum[0][j], sum[1][j], 2, 3, 6, 7);
        memcpy(block[0], &old[0], sizeof *old);
        memcpy(block[1], &old[1], sizeof *old);
    }
}

// Springs of all couples of row c, added up couple by couple.
static inline __attribute__((always_inline)) void add_couples(const nmm_system *system, int c,
                                                              int m) {
    const nmm_couples *couples = &system->couples;
    for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
        const int row = couples->cover_couple[k], q = row / (2 * m);
        add_cover(system, q, row - 2 * m * q, couples->slot + 2 * m * (long)row, m);
    }
}

// Row i of couple q times the weights of its row and of its columns.
static void weigh_row(const nmm_system *system, const nmm_model *model, int q, int i, int m,
                      double *row) {
    const int *element = system->couples.element + 2 * (long)q;
    const double own = system->weight[model->element_block[element[i / m]]];
    for (int j = 0; j < 2 * m; j++) {
        const double weight = own * system->weight[model->element_block[element[j / m]]];
        for (int x = 0; x < 2; x++) {
            row[2 * j + x] *= weight;
            row[4 * m + 2 * j + x] *= weight;
        }
    }
}

// Blocks of couple q in the matrix lie far apart: they are asked for before they are needed.
static inline void fetch_blocks(const nmm_system *system, int q, int m) {
    const int *slot = system->couples.slot + 4 * m * m * (long)q;
    for (int k = 0; k < 4 * m * m; k += m) {
        const double *block = system->K.value + 4 * (long)slot[k];
        for (int i = 0; i < 4 * m; i += 8)
            __builtin_prefetch(block + i, 1);
    }
}

// Puts `now` in and takes `before` out, springs of couple q; NULL: none.
static inline void change_spring(nmm_system *system, const nmm_model *model, int q, int m,
                                 const double *before, const double *now) {
    for (int i = 0; i < 2 * m; i++) {
        double row[8 * NMM_MOST_LOCAL];
        memset(row, 0, 8 * (size_t)m * sizeof *row);
        if (before != NULL) add_spring(before, i, -1, m, row);
        if (now != NULL) add_spring(now, i, 1, m, row);
        if (system->weight != NULL) weigh_row(system, model, q, i, m, row);
        put_row(system, q, i, m, row);
    }
}

// The spring at place p of couple q becomes one of the mode that is asked for.
static void follow_mode(nmm_system *system, const nmm_model *model, const nmm_state *state, int q,
                        int p) {
    const int m = model->n_local;
    const bool was_open = system->spring_mode[p] == NMM_SPRING_OPEN;
    double kept[8 * NMM_MOST_LOCAL + 2];
    fetch_blocks(system, q, m);
    const double *now = spring_of(system, p, m), *before = was_open ? NULL : kept;
    if (!was_open) memcpy(kept, now, (size_t)nmm_spring_size(m) * sizeof *kept);
    system->spring_mode[p] = next_mode(system->spring_mode[p], system->mode[p]);
    if (system->spring_mode[p] == NMM_SPRING_OPEN)
        now = NULL;
    else
        make_spring(system, model, state, p);
    if (now != NULL && is_held(system, model, q)) hold_spring(system, model, q, p);
    if (m == 3)
        change_spring(system, model, q, 3, before, now);
    else
        change_spring(system, model, q, m, before, now);
}

// The first place from i on where two lists of n modes differ; n: none.
static int next_other(const unsigned char *a, const unsigned char *b, int i, int n) {
    uint64_t x, y;
    for (; i + 8 <= n; i += 8) {
        memcpy(&x, a + i, sizeof x);
        memcpy(&y, b + i, sizeof y);
        if (x != y) break;
    }
    while (i < n && a[i] == b[i])
        i += 1;
    return i;
}

// Serial: few change, and two of them may meet in one block.
static bool change_springs(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const nmm_couples *couples = &system->couples;
    const int n = state->n_contact;
    bool changed = false;
    for (int p = 0, q = 0; (p = next_other(system->mode, system->spring_mode, p, n)) < n; p++) {
        while (couples->start[q + 1] <= p)
            q += 1;
        follow_mode(system, model, state, q, p);
        changed = true;
    }
    return changed;
}

// --- All

static inline __attribute__((always_inline)) void
fill_row(nmm_system *system, const nmm_model *model, int c, double inertia, int m) {
    const nmm_bsr *K = &system->K;
    const long begin = K->row_start[c], end = K->row_start[c + 1];
    memset(K->value + 4 * begin, 0, 4 * (size_t)(end - begin) * sizeof *K->value);
    base_row(system, model, c, inertia, m);
    if (system->fixed != NULL) remove_held(system, c);
    add_couples(system, c, m);
}

static void fill_any(nmm_system *system, const nmm_model *model, int c, double inertia) {
    if (model->order == 0)
        fill_row(system, model, c, inertia, 3);
    else
        fill_row(system, model, c, inertia, model->n_local);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void
fill_three_wide(nmm_system *system, const nmm_model *model, int c, double inertia) {
    fill_row(system, model, c, inertia, 3);
}
#endif

// With AVX2 four numbers at once where functions are linear, and the same bits.
static void fill(nmm_system *system, const nmm_model *model, int c, double inertia) {
#if defined(__x86_64__)
    if (model->order == 0 && __builtin_cpu_supports("avx2")) {
        fill_three_wide(system, model, c, inertia);
        return;
    }
#endif
    fill_any(system, model, c, inertia);
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
    for (int c = 0; c < n; c++)
        fill(system, model, c, inertia);
}

bool nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const nmm_state *state, double h, bool anew) {
    if (!anew && system->made) return change_springs(system, model, state);
    make_all(context, system, model, state, h);
    system->weight = NULL;
    system->made = true;
    system->pressed = false;
    return true;
}

// --- Coupling

static nmm_status grow_coupling(nmm_context *context, nmm_system *system, int n, int m) {
    nmm_coupling *coupling = &system->coupling;
    const size_t size = 2 * (size_t)m * sizeof(double);
    int capacity[3];
    for (int i = 0; i < 3; i++)
        capacity[i] = system->coupling_capacity;
    coupling->n_row = 2 * m;
    TRY(nmm_grow(context, &coupling->row, &capacity[0], n, 2 * (size_t)m * sizeof(int)));
    TRY(nmm_grow(context, &coupling->push, &capacity[1], n, 2 * size));
    TRY(nmm_grow(context, &coupling->pull, &capacity[2], n, 2 * size));
    system->coupling_capacity = capacity[0];
    return NMM_OK;
}

// The term of a contact that slides, from its spring at place p of couple q.
static void add_term(nmm_system *system, const nmm_model *model, const nmm_contact *contact, int q,
                     int p) {
    const int m = model->n_local;
    const double *spring = spring_of(system, p, m);
    const long at = 2 * (long)m * system->coupling.n++;
    const double stiffness =
        contact->normal_stiffness * contact->shear_force / contact->normal_force;
    int cover[2 * NMM_MOST_LOCAL] = {0};
    nmm_couple_covers(model, system->couples.element + 2 * (long)q, cover);
    memcpy(system->coupling.row + at, cover, 2 * (size_t)m * sizeof(int));
    memcpy(system->coupling.push + 2 * at, spring + 4 * m, 4 * (size_t)m * sizeof(double));
    for (int i = 0; i < 4 * m; i++)
        system->coupling.pull[2 * at + i] = stiffness * spring[i];
}

// The terms of couple q.
static void add_terms(nmm_system *system, const nmm_model *model, const nmm_state *state, int q) {
    const nmm_couples *couples = &system->couples;
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
        if (!slides(system->spring_mode[p])) continue;
        const nmm_contact *contact = &state->contact[couples->order[p] / 2];
        if (contact->normal_force > 0) add_term(system, model, contact, q, p);
    }
}

static bool any_slides(const nmm_system *system, int q) {
    const nmm_couples *couples = &system->couples;
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++)
        if (slides(system->spring_mode[p])) return true;
    return false;
}

// Is cover i of couple q its first one in the part?
static bool comes_first(const nmm_system *system, const nmm_model *model, int q, int i,
                        const nmm_rows *part) {
    const int m = model->n_local, *element = system->couples.element + 2 * (long)q;
    // The one before it most likely is in the part, too.
    for (int j = i - 1; j >= 0; j--)
        if (part->place[model->element_cover[m * (long)element[j / m] + j % m]] >= 0) return false;
    return true;
}

nmm_status nmm_system_couple(nmm_context *context, nmm_system *system, const nmm_model *model,
                             const nmm_state *state, const nmm_rows *part) {
    const nmm_couples *couples = &system->couples;
    const int n_side = 2 * model->n_local;
    int n = 0;
    for (int p = 0; p < state->n_contact; p++)
        n += slides(system->spring_mode[p]);
    TRY(grow_coupling(context, system, n, model->n_local));
    system->coupling.n = 0;
    for (int q = 0; q < couples->n && n > 0 && part == NULL; q++)
        add_terms(system, model, state, q);
    for (int r = 0; part != NULL && r < part->n && n > 0; r++) {
        const int c = part->row[r];
        for (int k = couples->cover_start[c]; k < couples->cover_start[c + 1]; k++) {
            const int q = couples->cover_couple[k] / n_side, i = couples->cover_couple[k] % n_side;
            if (any_slides(system, q) && comes_first(system, model, q, i, part))
                add_terms(system, model, state, q);
        }
    }
    return NMM_OK;
}

// --- Caught contacts

// Adds to the caught residual the shear force that contact `contact`, with its spring at place p of
// couple q, would have more if it stuck.
static void add_caught(nmm_system *system, const nmm_model *model, const nmm_contact *contact,
                       int q, int p) {
    const int m = model->n_local;
    const double *shear = spring_of(system, p, m) + 4 * m;
    const double sticking = contact->carried_shear - contact->shear_stiffness * contact->slip;
    int cover[2 * NMM_MOST_LOCAL] = {0};
    nmm_couple_covers(model, system->couples.element + 2 * (long)q, cover);
    for (int i = 0; i < 4 * m; i++)
        system->caught[2 * cover[i / 2] + i % 2] += (sticking - contact->shear_force) * shear[i];
}

// The first caught place from p on; n: none.
static int next_caught(const unsigned char *mode, int p, int n) {
    const unsigned char *found =
        p < n ? memchr(mode + p, NMM_SPRING_CAUGHT, (size_t)(n - p)) : NULL;
    return found != NULL ? (int)(found - mode) : n;
}

bool nmm_system_catch(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const nmm_couples *couples = &system->couples;
    const int n = state->n_contact, first = next_caught(system->spring_mode, 0, n);
    if (first == n) return false;
    memcpy(system->caught, system->residual, 2 * (size_t)model->n_cover * sizeof *system->caught);
    for (int p = first, q = 0; p < n; p = next_caught(system->spring_mode, p + 1, n)) {
        while (couples->start[q + 1] <= p)
            q += 1;
        add_caught(system, model, &state->contact[couples->order[p] / 2], q, p);
    }
    return true;
}
