// SPDX-License-Identifier: MIT
//
// Matrix of one pass: a Newton matrix, which need not be that of the very place. Elements, inertia
// and supports are added up once and kept, by entry of the constant pattern; each contact is kept
// as a spring, frozen when its mode was last another one. To make all of it, rows gather from
// elements, and their diagonal tells how blocks are to be weighted; then couples add their springs
// in a fixed order; between, only springs whose contacts changed mode are taken out and put in.
// What that leaves behind by rounding goes with the next full matrix, at the start of a step at the
// latest. Equations (4.x) of docs/theory/4-time.md.

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

// Rows first .. end - 1 of the matrix.
typedef struct range {
    int first, end;
} range;

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

// Contacts of the couples that follow lie far apart: they are asked for before they are needed.
static inline void fetch_contact(const nmm_system *system, const nmm_state *state, int p) {
    const int at = nmm_min_int(p + 6, state->n_contact - 1);
    const char *contact = (const char *)&state->contact[system->couples.order[at] / 2];
    __builtin_prefetch(contact);
    __builtin_prefetch(contact + 64);
}

// The couple of place p, from couple q on.
static inline int couple_of(const nmm_couples *couples, int q, int p) {
    while (couples->start[q + 1] <= p)
        q += 1;
    return q;
}

// All springs of couple q.
static void make_springs(nmm_system *system, const nmm_model *model, const nmm_state *state,
                         int q) {
    const nmm_couples *couples = &system->couples;
    const bool held = is_held(system, model, q);
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++) {
        fetch_contact(system, state, p);
        system->spring_mode[p] = first_mode(system, model, state, p);
        if (system->spring_mode[p] == NMM_SPRING_OPEN) continue;
        make_spring(system, model, state, p);
        if (held) hold_spring(system, model, q, p);
    }
}

// Springs that act on the covers of a couple.
typedef struct springs {
    const double *spring;      // [n][nmm_spring_size]
    const unsigned char *mode; // [n]
    int n;
    double weight[2]; // of the rows and columns of either element
} springs;

// Some springs of couple q.
static inline springs springs_of(const nmm_system *system, const nmm_model *model, int q,
                                 const double *spring, const unsigned char *mode, int n) {
    springs all = {spring, mode, n, {1, 1}};
    const int *element = system->couples.element + 2 * (long)q;
    for (int side = 0; side < 2 && system->weight != NULL; side++)
        all.weight[side] = system->weight[model->element_block[element[side]]];
    return all;
}

static inline void add_block(const nmm_system *system, int slot, const four *sum) {
    double *block = system->K.value + 4 * (long)slot;
    four old;
    memcpy(&old, block, sizeof old);
    old += *sum;
    memcpy(block, &old, sizeof old);
}

// Adds the closed springs, weighted, to the blocks (i, j) and (j, i) of couple q, j >= i, in the
// rows that are `inside`; NULL: in all. K is symmetric: each block is computed once. Sums stay in
// registers where m and i are constants.
static inline __attribute__((always_inline)) void
add_cover(const nmm_system *system, int q, const springs *from, int i, int m, const bool *inside) {
    const int *slot = system->couples.slot + 4 * m * m * (long)q;
    const double own = from->weight[i / m];
    const double weight[2] = {own * from->weight[0], own * from->weight[1]};
    four sum[2 * NMM_MOST_LOCAL];
    for (int j = i; j < 2 * m; j++)
        sum[j] = (four){0, 0, 0, 0};
    for (int k = 0; k < from->n; k++) {
        if (from->mode[k] == NMM_SPRING_OPEN) continue;
        const double *normal = from->spring + nmm_spring_size(m) * (long)k, *n = normal + 2 * i;
        const double *shear = normal + 4 * m, *t = shear + 2 * i;
        const four across = normal[8 * m] * (four){n[0], n[0], n[1], n[1]};
        const four along = normal[8 * m + 1] * (four){t[0], t[0], t[1], t[1]};
        for (int j = i; j < 2 * m; j++) {
            n = normal + 2 * j, t = shear + 2 * j;
            sum[j] +=
                across * (four){n[0], n[1], n[0], n[1]} + along * (four){t[0], t[1], t[0], t[1]};
        }
    }
    sum[i] = __builtin_shufflevector(sum[i], sum[i], 0, 1, 1, 3);
    for (int j = i; j < 2 * m; j++) {
        sum[j] *= weight[j / m];
        const four turned = __builtin_shufflevector(sum[j], sum[j], 0, 2, 1, 3);
        if (inside == NULL || inside[i]) add_block(system, slot[2 * m * i + j], &sum[j]);
        if (j > i && (inside == NULL || inside[j])) add_block(system, slot[2 * m * j + i], &turned);
    }
}

// Adds the closed springs to all blocks of couple q in the rows inside.
static inline __attribute__((always_inline)) void
add_springs(const nmm_system *system, int q, const springs *from, int m, const bool *inside) {
    if (m == 3) {
        add_cover(system, q, from, 0, 3, inside);
        add_cover(system, q, from, 1, 3, inside);
        add_cover(system, q, from, 2, 3, inside);
        add_cover(system, q, from, 3, 3, inside);
        add_cover(system, q, from, 4, 3, inside);
        add_cover(system, q, from, 5, 3, inside);
        return;
    }
    for (int i = 0; i < 2 * m; i++)
        add_cover(system, q, from, i, m, inside);
}

static bool all_open(const springs *from) {
    for (int k = 0; k < from->n; k++)
        if (from->mode[k] != NMM_SPRING_OPEN) return false;
    return true;
}

// Which covers of couple q are among the rows? Returns how many.
static int find_inside(const nmm_system *system, const nmm_model *model, int q, range rows,
                       bool *inside) {
    const int m = model->n_local;
    int cover[2 * NMM_MOST_LOCAL] = {0}, n = 0;
    nmm_couple_covers(model, system->couples.element + 2 * (long)q, cover);
    for (int i = 0; i < 2 * m; i++) {
        inside[i] = cover[i] >= rows.first && cover[i] < rows.end;
        n += inside[i];
    }
    return n;
}

// The couples that may have covers among some rows: from the first one up to the last.
static range couples_of(const nmm_couples *couples, const nmm_model *model, range rows) {
    const int n_side = 2 * model->n_local;
    range of = {couples->n, 0};
    for (int c = rows.first; c < rows.end; c++) {
        const int begin = couples->cover_start[c], end = couples->cover_start[c + 1];
        if (begin == end) continue;
        of.first = nmm_min_int(of.first, couples->cover_couple[begin] / n_side);
        of.end = nmm_max_int(of.end, couples->cover_couple[end - 1] / n_side + 1);
    }
    return of;
}

// Times the weights of row and column.
static void weigh_rows(const nmm_system *system, const nmm_model *model, range rows) {
    for (int c = rows.first; c < rows.end && system->weight != NULL; c++) {
        const double own = system->weight[model->cover_block[c]];
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
            const double weight = own * system->weight[model->cover_block[system->base_col[k]]];
            double *block = base_block(system, k);
            for (int i = 0; i < 4; i++)
                block[i] *= weight;
        }
    }
}

// Adds all couples to some rows, couple by couple.
static inline __attribute__((always_inline)) void
add_couples(const nmm_system *system, const nmm_model *model, range rows, int m) {
    const int *start = system->couples.start;
    const bool all = rows.first == 0 && rows.end == model->n_cover;
    const range couples =
        all ? (range){0, system->couples.n} : couples_of(&system->couples, model, rows);
    for (int q = couples.first; q < couples.end; q++) {
        const springs from = springs_of(system, model, q, spring_of(system, start[q], m),
                                        system->spring_mode + start[q], start[q + 1] - start[q]);
        bool inside[2 * NMM_MOST_LOCAL];
        if (all_open(&from)) continue;
        const int n = all ? 2 * m : find_inside(system, model, q, rows, inside);
        if (n == 2 * m)
            add_springs(system, q, &from, m, NULL);
        else if (n > 0)
            add_springs(system, q, &from, m, inside);
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

// A copy of the spring at place p, `sign` times.
static void copy_spring(const nmm_system *system, int p, int m, double sign, double *to) {
    const int size = nmm_spring_size(m);
    memcpy(to, spring_of(system, p, m), (size_t)size * sizeof *to);
    to[8 * m] *= sign;
    to[8 * m + 1] *= sign;
}

// The spring at place p of couple q becomes one of the mode that is asked for: the one before is
// taken out and the new one put in.
static void follow_mode(nmm_system *system, const nmm_model *model, const nmm_state *state, int q,
                        int p) {
    const int m = model->n_local;
    const unsigned char before = system->spring_mode[p], now = next_mode(before, system->mode[p]);
    const unsigned char mode[2] = {before, now};
    double change[2 * (8 * NMM_MOST_LOCAL + 2)];
    fetch_blocks(system, q, m);
    if (before != NMM_SPRING_OPEN) copy_spring(system, p, m, -1, change);
    system->spring_mode[p] = now;
    if (now != NMM_SPRING_OPEN) {
        make_spring(system, model, state, p);
        if (is_held(system, model, q)) hold_spring(system, model, q, p);
        copy_spring(system, p, m, 1, change + nmm_spring_size(m));
    }
    const springs both = springs_of(system, model, q, change, mode, 2);
    if (m == 3)
        add_springs(system, q, &both, 3, NULL);
    else
        add_springs(system, q, &both, m, NULL);
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
bool nmm_system_follow(nmm_system *system, const nmm_model *model, const nmm_state *state) {
    const int n = state->n_contact;
    bool changed = false;
    for (int p = 0, q = 0; (p = next_other(system->mode, system->spring_mode, p, n)) < n; p++) {
        q = couple_of(&system->couples, q, p);
        follow_mode(system, model, state, q, p);
        changed = true;
    }
    return changed;
}

// --- All

// Row c without springs.
static inline __attribute__((always_inline)) void
begin_row(nmm_system *system, const nmm_model *model, int c, double inertia, int m) {
    const nmm_bsr *K = &system->K;
    const long begin = K->row_start[c], end = K->row_start[c + 1];
    memset(K->value + 4 * begin, 0, 4 * (size_t)(end - begin) * sizeof *K->value);
    base_row(system, model, c, inertia, m);
    if (system->fixed != NULL) remove_held(system, c);
    const double *block = K->value + 4 * (long)K->diagonal[c];
    system->diagonal[2 * (long)c] = block[0];
    system->diagonal[2 * (long)c + 1] = block[3];
}

void nmm_system_prepare(const nmm_context *context, nmm_system *system, const nmm_model *model,
                        const nmm_state *state, double h) {
    const int n_thread = context->n_thread, n = model->n_cover, n_couple = system->couples.n;
    const double inertia = 2 / (h * h) + 2 * system->damping / h;
    stiffness_pass(system, model, state, n_thread);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n_couple > 1024)
    for (int q = 0; q < n_couple; q++)
        make_springs(system, model, state, q);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1 && n > 2048)
    for (int c = 0; c < n; c++) {
        if (model->order == 0)
            begin_row(system, model, c, inertia, 3);
        else
            begin_row(system, model, c, inertia, model->n_local);
    }
    system->pressed = false;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void add_three_wide(const nmm_system *system,
                                                           const nmm_model *model, range rows) {
    add_couples(system, model, rows, 3);
}
#endif

// With AVX2 four numbers at once where functions are linear, and the same bits.
static void add_to_rows(const nmm_system *system, const nmm_model *model, range rows) {
#if defined(__x86_64__)
    if (model->order == 0 && __builtin_cpu_supports("avx2")) {
        add_three_wide(system, model, rows);
        return;
    }
#endif
    if (model->order == 0)
        add_couples(system, model, rows, 3);
    else
        add_couples(system, model, rows, model->n_local);
}

void nmm_system_assemble(const nmm_context *context, nmm_system *system, const nmm_model *model,
                         const double *weight) {
    const int n = model->n_cover, n_part = n > 2048 ? context->n_thread : 1;
    system->weight = weight;
    // Each thread goes over the couples of its rows.
#pragma omp parallel for num_threads(n_part) schedule(static) if (n_part > 1)
    for (int k = 0; k < n_part; k++) {
        const range rows = {(int)((long)n * k / n_part), (int)((long)n * (k + 1) / n_part)};
        weigh_rows(system, model, rows);
        add_to_rows(system, model, rows);
    }
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

// The term of place p of couple q, if its contact slides and is pressed.
static void add_term(nmm_system *system, const nmm_model *model, const nmm_state *state, int q,
                     int p) {
    const nmm_contact *contact = &state->contact[system->couples.order[p] / 2];
    if (!slides(system->spring_mode[p]) || !(contact->normal_force > 0)) return;
    const int m = model->n_local;
    const double *spring = spring_of(system, p, m);
    const long at = 2 * (long)m * system->coupling.n++;
    double *restrict pull = system->coupling.pull + 2 * at;
    const double stiffness =
        contact->normal_stiffness * contact->shear_force / contact->normal_force;
    nmm_couple_covers(model, system->couples.element + 2 * (long)q, system->coupling.row + at);
    memcpy(system->coupling.push + 2 * at, spring + 4 * m, 4 * (size_t)m * sizeof(double));
    for (int i = 0; i < 4 * m; i++)
        pull[i] = stiffness * spring[i];
}

// The terms of couple q.
static void add_terms(nmm_system *system, const nmm_model *model, const nmm_state *state, int q) {
    const nmm_couples *couples = &system->couples;
    for (int p = couples->start[q]; p < couples->start[q + 1]; p++)
        add_term(system, model, state, q, p);
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
    for (int p = 0, q = 0; p < state->n_contact && n > 0 && part == NULL; p++) {
        if (!slides(system->spring_mode[p])) continue;
        q = couple_of(couples, q, p);
        add_term(system, model, state, q, p);
    }
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
        q = couple_of(couples, q, p);
        add_caught(system, model, &state->contact[couples->order[p] / 2], q, p);
    }
    return true;
}
