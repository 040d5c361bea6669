// SPDX-License-Identifier: MIT
//
// The balance of forces, block by block. Sums go over the covers in their order, one thread: they
// are next to nothing beside a residual, and the same bits for any number of threads.

#include "balance.h"

#include <float.h>
#include <math.h>
#include <string.h>

// Weights of blocks: within a few powers of two they are not worth the work, and beyond the digits
// of a number they mean nothing.
enum { LEAST_BITS = 4, MOST_BITS = 40 };
#define LEAST_PART 0x1p-40

// --- The object

static void find_held(nmm_balance *balance, const nmm_model *model, const nmm_system *system) {
    for (int b = 0; b < balance->n_block; b++)
        balance->held[b] = system->fixed != NULL;
    for (int c = 0; c < model->n_cover && system->fixed != NULL; c++)
        if (system->fixed[c] != 3) balance->held[model->cover_block[c]] = false;
}

// By the softest material of each block.
static void find_stiffness(nmm_balance *balance, const nmm_model *model) {
    for (int b = 0; b < balance->n_block; b++)
        balance->stiffness[b] = INFINITY;
    for (int e = 0; e < model->n_element; e++) {
        const double modulus = model->material[model->element_material[e]].youngs_modulus;
        double *stiffness = &balance->stiffness[model->element_block[e]];
        *stiffness = nmm_min(*stiffness, modulus * model->size / model->height);
    }
}

nmm_status nmm_balance_open(nmm_context *context, nmm_balance *balance, const nmm_model *model,
                            const nmm_system *system) {
    const size_t n = (size_t)model->n_block;
    balance->n_block = model->n_block;
    balance->gap_rounding = 1;
    TRY(nmm_allocate(context, &balance->held, n, sizeof(bool)));
    TRY(nmm_allocate(context, &balance->group, n, sizeof(int)));
    TRY(nmm_allocate(context, &balance->count, n, sizeof(int)));
    TRY(nmm_allocate(context, &balance->block, n, sizeof(nmm_balance_sums)));
    TRY(nmm_allocate(context, &balance->whole, n, sizeof(nmm_balance_sums)));
    TRY(nmm_allocate(context, &balance->allowed, n, sizeof(double)));
    TRY(nmm_allocate(context, &balance->stiffness, n, sizeof(double)));
    TRY(nmm_allocate(context, &balance->exponent, n, sizeof(int)));
    TRY(nmm_allocate(context, &balance->weight, n, sizeof(double)));
    find_held(balance, model, system);
    find_stiffness(balance, model);
    return NMM_OK;
}

void nmm_balance_close(nmm_context *context, nmm_balance *balance) {
    nmm_release(context, &balance->held);
    nmm_release(context, &balance->group);
    nmm_release(context, &balance->count);
    nmm_release(context, &balance->block);
    nmm_release(context, &balance->whole);
    nmm_release(context, &balance->allowed);
    nmm_release(context, &balance->stiffness);
    nmm_release(context, &balance->exponent);
    nmm_release(context, &balance->weight);
}

// --- Groups

// The first block of a group, on the way to which others are led straight to it.
static int first_of(int *group, int block) {
    while (group[block] != block) {
        group[block] = group[group[block]];
        block = group[block];
    }
    return block;
}

void nmm_balance_group(nmm_balance *balance, const nmm_couples *couples, const nmm_model *model) {
    int *group = balance->group;
    if (balance->list == couples->list) return;
    balance->list = couples->list;
    for (int b = 0; b < balance->n_block; b++)
        group[b] = b;
    for (int k = 0; k < couples->n_contact; k++) {
        const int a = model->vertex_block[couples->identity[2 * k]];
        const int b = model->vertex_block[couples->identity[2 * k + 1]];
        // What is held passes nothing on.
        if (balance->held[a] || balance->held[b]) continue;
        const int first = first_of(group, a), second = first_of(group, b);
        group[nmm_max_int(first, second)] = nmm_min_int(first, second);
    }
    memset(balance->count, 0, (size_t)balance->n_block * sizeof(int));
    for (int b = 0; b < balance->n_block; b++) {
        group[b] = first_of(group, b);
        balance->count[group[b]] += 1;
    }
}

// --- What rounding leaves

static double square(double x) {
    return x * x;
}

// The square of the forces of a contact over that of its normal force alone: friction passes on
// what rounding leaves of the pressure, at 80 degrees six times of it.
static double with_shear(const nmm_model *model, const nmm_contact *contact) {
    if (contact->mode == NMM_CONTACT_SLIDE)
        return 1 + square(model->interface[contact->interface].friction);
    return 1 + square(contact->shear_stiffness / contact->normal_stiffness);
}

// Springs of closed contacts: a gap changes by a difference of displacements.
static void add_gaps(nmm_balance *balance, const nmm_model *model, const nmm_state *state) {
    for (int k = 0; k < state->n_contact; k++) {
        const nmm_contact *contact = &state->contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        const double way = nmm_contact_way(model, state, contact);
        const double force = square(balance->gap_rounding * contact->normal_stiffness * way) *
                             with_shear(model, contact);
        const int a = model->vertex_block[contact->vertex], b = model->vertex_block[contact->edge];
        // What is held has nothing to balance.
        balance->block[a].gaps += balance->held[a] ? 0 : force;
        balance->block[b].gaps += balance->held[b] ? 0 : force;
    }
}

void nmm_balance_round(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                       const nmm_state *state, double h, double reach) {
    const double per_step = 2 / h, per_square = 0.5 * h * h;
    for (int b = 0; b < balance->n_block; b++) {
        nmm_balance_sums *sums = &balance->block[b];
        sums->rounding = sums->gaps = sums->load = sums->moved = 0;
    }
    for (int c = 0; c < model->n_cover; c++) {
        if (system->fixed != NULL && system->fixed[c] == 3) continue;
        const double *stiffness = system->diagonal + 2 * (long)c;
        const double *d = state->displacement + 2 * (long)c;
        const double *v = state->velocity + 2 * (long)c;
        const double *load = system->load + 2 * (long)c;
        const double mass = system->cover_mass[c], inertia = per_step * mass;
        // Where the motion and the loads lead in the step, where that can be meant.
        // The integral of a function of order 2 may vanish.
        const double fall = mass > 0 ? per_square / mass : 0;
        const double mx = nmm_min(h * fabs(v[0]) + fall * fabs(load[0]), reach);
        const double my = nmm_min(h * fabs(v[1]) + fall * fabs(load[1]), reach);
        const double x = stiffness[0] * (fabs(d[0]) + mx) + inertia * fabs(v[0]);
        const double y = stiffness[1] * (fabs(d[1]) + my) + inertia * fabs(v[1]);
        nmm_balance_sums *sums = &balance->block[model->cover_block[c]];
        sums->rounding += x * x + y * y;
        sums->load += square(load[0]) + square(load[1]);
        sums->moved += square(d[0]) + square(d[1]);
    }
    add_gaps(balance, model, state);
    for (int b = 0; b < balance->n_block; b++) {
        nmm_balance_sums *block = &balance->block[b];
        block->gaps *= square(DBL_EPSILON);
        block->rounding = square(DBL_EPSILON) * block->rounding + block->gaps;
    }
}

// --- What is left

static void add_covers(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                       const double *left) {
    for (int b = 0; b < balance->n_block; b++)
        balance->block[b].force = balance->block[b].left = 0;
    for (int c = 0; c < model->n_cover;) {
        // Covers of a block mostly follow each other.
        const int b = model->cover_block[c];
        nmm_balance_sums *block = &balance->block[b];
        double force = block->force, rest = block->left;
        for (; c < model->n_cover && model->cover_block[c] == b; c++) {
            if (system->fixed != NULL && system->fixed[c] == 3) continue;
            force += system->scale[c];
            rest += square(left[2 * c]) + square(left[2 * c + 1]);
        }
        block->force = force, block->left = rest;
    }
}

static void add_blocks(nmm_balance *balance, double tolerance) {
    for (int b = 0; b < balance->n_block; b++) {
        nmm_balance_sums *whole = &balance->whole[b];
        whole->force = whole->left = whole->rounding = whole->allowed = 0;
    }
    for (int b = 0; b < balance->n_block; b++) {
        nmm_balance_sums *whole = &balance->whole[balance->group[b]];
        whole->force += balance->block[b].force;
        whole->left += balance->block[b].left;
        whole->rounding += balance->block[b].rounding;
    }
    for (int b = 0; b < balance->n_block; b++) {
        nmm_balance_sums *whole = &balance->whole[b];
        if (balance->group[b] != b) continue;
        whole->allowed = tolerance * sqrt(whole->force) + sqrt(whole->rounding);
    }
}

// What is left, by its square, over what is allowed; what is not a number counts as infinite.
static double excess(double left, double allowed) {
    const double quotient = left == 0 ? 0 : sqrt(left) / allowed;
    return quotient == quotient ? quotient : INFINITY;
}

// The larger of `worst` and that excess; most are far below, and need no root.
static double worse(double worst, double left, double allowed) {
    if (left < square(worst * allowed)) return worst;
    return nmm_max(worst, excess(left, allowed));
}

double nmm_balance_allowed(const nmm_balance *balance, int b, double tolerance) {
    const nmm_balance_sums *block = &balance->block[b];
    const int first = balance->group[b];
    const nmm_balance_sums *whole = &balance->whole[first];
    // In a group of equal blocks one of them may have what the group may have together.
    const double scale = nmm_min(balance->count[first] * block->force, whole->force);
    // Weights end there, and what is less beside the others is their rounding.
    const double least = block->force > 0 ? whole->allowed * LEAST_PART : 0;
    return tolerance * sqrt(scale) + sqrt(block->rounding) + least;
}

double nmm_balance_worst_of(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                            const double *left, double tolerance) {
    add_covers(balance, system, model, left);
    add_blocks(balance, tolerance);
    double worst = 0;
    for (int b = 0; b < balance->n_block; b++) {
        const nmm_balance_sums *whole = &balance->whole[b];
        balance->allowed[b] = nmm_balance_allowed(balance, b, tolerance);
        worst = worse(worst, balance->block[b].left, balance->allowed[b]);
        // Of the group that begins here.
        if (balance->group[b] == b) worst = worse(worst, whole->left, whole->allowed);
    }
    return worst;
}

double nmm_balance_worst(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                         double tolerance) {
    return nmm_balance_worst_of(balance, system, model, system->residual, tolerance);
}

double nmm_balance_along(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                         const double *moved) {
    for (int b = 0; b < balance->n_block; b++)
        balance->whole[b].work = balance->whole[b].way = 0;
    for (int c = 0; c < model->n_cover; c++) {
        if (system->fixed != NULL && system->fixed[c] == 3) continue;
        const double *left = system->residual + 2 * (long)c, *d = moved + 2 * (long)c;
        nmm_balance_sums *whole = &balance->whole[balance->group[model->cover_block[c]]];
        whole->work += left[0] * d[0] + left[1] * d[1];
        whole->way += square(d[0]) + square(d[1]);
    }
    double most = 0;
    for (int b = 0; b < balance->n_block; b++) {
        const nmm_balance_sums *whole = &balance->whole[b];
        most = nmm_max(most, excess(square(whole->work), whole->allowed * sqrt(whole->way)));
    }
    return most;
}

// Forces that rounding is compared with, by their square.
static double acting(const nmm_balance *balance, int b) {
    const nmm_balance_sums *block = &balance->block[b];
    const double strained = square(balance->stiffness[b]) * block->moved;
    return block->load > 0 ? block->force : nmm_max(block->force, strained);
}

bool nmm_balance_clouded_in(const nmm_balance *balance, int b, double tolerance, double rounding) {
    const nmm_balance_sums *block = &balance->block[b];
    return block->force > 0 &&
           square(rounding) * block->gaps > square(tolerance) * acting(balance, b);
}

bool nmm_balance_clouded(const nmm_balance *balance, double tolerance, double rounding) {
    for (int b = 0; b < balance->n_block; b++)
        if (nmm_balance_clouded_in(balance, b, tolerance, rounding)) return true;
    return false;
}

// --- Weights

void nmm_balance_weigh(nmm_balance *balance, bool wanted) {
    double largest = 0;
    int lowest = 0, most = 0;
    for (int b = 0; b < balance->n_block; b++)
        largest = nmm_max(largest, balance->allowed[b]);
    frexp(largest, &most);
    for (int b = 0; b < balance->n_block; b++) {
        int own = most;
        if (balance->allowed[b] > 0) frexp(balance->allowed[b], &own);
        balance->exponent[b] = nmm_min_int(most - own, MOST_BITS);
        balance->weight[b] = ldexp(1, balance->exponent[b]);
        lowest = nmm_max_int(lowest, balance->exponent[b]);
    }
    balance->weighted = wanted && lowest > LEAST_BITS;
    balance->n_class = nmm_min_int(lowest / NMM_FORCE_CLASS_BITS, NMM_FORCE_CLASSES - 1) + 1;
}

double nmm_balance_norm(const nmm_balance *balance, const nmm_system *system,
                        const nmm_model *model, int n_thread) {
    const double *r = system->residual;
    if (!balance->weighted) return sqrt(nmm_sum_product(2 * model->n_cover, r, r, n_thread));
    double sum = 0;
    for (int c = 0; c < model->n_cover; c++) {
        const double factor = balance->weight[model->cover_block[c]];
        sum += square(factor * r[2 * c]) + square(factor * r[2 * c + 1]);
    }
    return sqrt(sum);
}

double nmm_balance_limit(const nmm_balance *balance) {
    double least = INFINITY;
    for (int b = 0; b < balance->n_block; b++) {
        if (!(balance->allowed[b] > 0)) continue;
        const double weight = balance->weighted ? balance->weight[b] : 1;
        least = nmm_min(least, weight * balance->allowed[b]);
    }
    return least < INFINITY ? least : 0;
}

const double *nmm_balance_weights(const nmm_balance *balance) {
    return balance->weighted ? balance->weight : NULL;
}

// Times the weights, the change the other way; or back.
static void weigh(const nmm_balance *balance, nmm_system *system, const nmm_model *model,
                  bool put) {
    if (!balance->weighted) return;
    for (int c = 0; c < system->K.n_row; c++) {
        const double own = balance->weight[model->cover_block[c]];
        const double factor = put ? own : 1 / own, back = put ? 1 / own : own;
        for (int x = 0; x < 2; x++) {
            system->residual[2 * c + x] *= factor;
            system->change[2 * c + x] *= back;
        }
    }
}

// Its terms are made anew for each system: there is no way back.
void nmm_balance_weigh_coupling(const nmm_balance *balance, nmm_coupling *coupling,
                                const nmm_model *model) {
    const long n = (long)coupling->n * coupling->n_row;
    for (long i = 0; balance->weighted && i < n; i++) {
        const double factor = balance->weight[model->cover_block[coupling->row[i]]];
        for (int x = 0; x < 2; x++) {
            coupling->push[2 * i + x] *= factor;
            coupling->pull[2 * i + x] *= factor;
        }
    }
}

void nmm_balance_put_weights(const nmm_balance *balance, nmm_system *system,
                             const nmm_model *model) {
    weigh(balance, system, model, true);
}

void nmm_balance_take_weights(const nmm_balance *balance, nmm_system *system,
                              const nmm_model *model) {
    weigh(balance, system, model, false);
}

// --- Work

static int class_of(const nmm_balance *balance, int block) {
    const int class = balance->exponent[block] / NMM_FORCE_CLASS_BITS;
    return nmm_min_int(class, NMM_FORCE_CLASSES - 1);
}

void nmm_balance_work(const nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                      int n_thread, double work[NMM_FORCE_CLASSES]) {
    const double *change = system->change, *residual = system->residual;
    memset(work, 0, NMM_FORCE_CLASSES * sizeof *work);
    if (balance->n_class == 1) {
        work[0] = nmm_sum_product(2 * model->n_cover, change, residual, n_thread);
        return;
    }
    for (int c = 0; c < model->n_cover; c++) {
        const int class = class_of(balance, model->cover_block[c]);
        work[class] += change[2 * c] * residual[2 * c] + change[2 * c + 1] * residual[2 * c + 1];
    }
}

void nmm_balance_least_work(nmm_balance *balance, const nmm_system *system, const nmm_model *model,
                            double least[NMM_FORCE_CLASSES]) {
    memset(least, 0, NMM_FORCE_CLASSES * sizeof *least);
    if (balance->n_class == 1) return;
    for (int b = 0; b < balance->n_block; b++)
        balance->block[b].way = 0;
    for (int c = 0; c < model->n_cover; c++) {
        const double *change = system->change + 2 * (long)c;
        balance->block[model->cover_block[c]].way += square(change[0]) + square(change[1]);
    }
    for (int b = 0; b < balance->n_block; b++)
        least[class_of(balance, b)] += balance->allowed[b] * sqrt(balance->block[b].way);
}
