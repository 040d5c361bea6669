// SPDX-License-Identifier: MIT
//
// Systems for the solver's tests, see systems.h. Linear triangles in plane strain, two per square
// of a block's grid; consistent or lumped mass times 2 / dt^2; springs of a vertex against an edge
// of the next block, 60 % locked, 25 % sliding, 15 % open.

#include "systems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define YOUNG 1e9
#define POISSON 0.25
#define DENSITY 2500.0

static void must(nmm_status status) {
    if (status != NMM_OK) abort();
}

// --- Putting a matrix together

void triplets_add(nmm_context *context, triplets *list, int row, int col, const double value[4]) {
    must(nmm_grow(context, &list->item, &list->capacity, list->n + 1, sizeof *list->item));
    triplet *t = &list->item[list->n++];
    t->row = row;
    t->col = col;
    memcpy(t->value, value, sizeof t->value);
}

static int compare_triplets(const void *a, const void *b) {
    const triplet *s = a, *t = b;
    if (s->row != t->row) return s->row < t->row ? -1 : 1;
    return (s->col > t->col) - (s->col < t->col);
}

static void add_to(nmm_bsr *K, int k, const double value[4]) {
    for (int i = 0; i < 4; i++)
        K->value[4 * (long)k + i] += value[i];
}

void test_system_build(nmm_context *context, test_system *system, triplets *list, int n_row) {
    const double zero[4] = {0};
    for (int row = 0; row < n_row; row++)
        triplets_add(context, list, row, row, zero);
    qsort(list->item, (size_t)list->n, sizeof *list->item, compare_triplets);
    nmm_bsr *K = &system->K;
    K->n_row = n_row;
    must(nmm_allocate(context, &K->row_start, (size_t)n_row + 1, sizeof(int)));
    must(nmm_allocate(context, &K->diagonal, (size_t)n_row, sizeof(int)));
    must(nmm_allocate(context, &K->col, (size_t)list->n, sizeof(int)));
    must(nmm_allocate(context, &K->value, (size_t)list->n, 4 * sizeof(double)));
    must(nmm_allocate(context, &system->f, (size_t)n_row, 2 * sizeof(double)));
    int n = 0;
    for (int i = 0; i < list->n; i++) {
        const triplet *t = &list->item[i];
        const bool same = i > 0 && compare_triplets(t, t - 1) == 0;
        if (!same) {
            K->col[n] = t->col;
            if (t->row == t->col) K->diagonal[t->row] = n;
            K->row_start[t->row + 1] = ++n;
        }
        add_to(K, n - 1, t->value);
    }
    system->n_block = n;
    nmm_release(context, &list->item);
    memset(list, 0, sizeof *list);
}

void test_system_destroy(nmm_context *context, test_system *system) {
    nmm_release(context, &system->K.row_start);
    nmm_release(context, &system->K.col);
    nmm_release(context, &system->K.value);
    nmm_release(context, &system->K.diagonal);
    nmm_release(context, &system->f);
}

// --- The wall of blocks

// Nodes of a triangle and their places.
typedef struct triangle {
    int node[3];
    double x[3], y[3];
} triangle;

// Stiffness of the pair (i, j) of a triangle's nodes: B_i^T D B_j * area.
static void stiffness(const triangle *t, int i, int j, double value[4]) {
    const double area2 =
        (t->x[1] - t->x[0]) * (t->y[2] - t->y[0]) - (t->x[2] - t->x[0]) * (t->y[1] - t->y[0]);
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    const double bi = (t->y[i1] - t->y[i2]) / area2, ci = (t->x[i2] - t->x[i1]) / area2;
    const double bj = (t->y[j1] - t->y[j2]) / area2, cj = (t->x[j2] - t->x[j1]) / area2;
    const double k = YOUNG / ((1 + POISSON) * (1 - 2 * POISSON)) * area2 / 2;
    const double d0 = k * (1 - POISSON), d1 = k * POISSON, d2 = k * (1 - 2 * POISSON) / 2;
    value[0] = d0 * bi * bj + d2 * ci * cj;
    value[1] = d1 * bi * cj + d2 * ci * bj;
    value[2] = d1 * ci * bj + d2 * bi * cj;
    value[3] = d0 * ci * cj + d2 * bi * bj;
}

static void add_triangle(nmm_context *context, triplets *list, const triangle *t,
                         const rock *wall) {
    // The size of a square is 1, so dt = courant / c_p.
    const double speed2 = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON)) / DENSITY;
    const double dt2 = wall->courant * wall->courant / speed2;
    const double mass = wall->courant > 0 ? 2 / dt2 * DENSITY * 0.5 : 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double value[4];
            stiffness(t, i, j, value);
            const double part =
                wall->lumped ? (i == j ? 1.0 / 3 : 0) : (i == j ? 1.0 / 6 : 1.0 / 12);
            value[0] += part * mass;
            value[3] += part * mass;
            triplets_add(context, list, t->node[i], t->node[j], value);
        }
    }
}

static int node_of(const rock *wall, int block, int i, int j) {
    return (block * wall->n_node + j) * wall->n_node + i;
}

static void add_block(nmm_context *context, triplets *list, const rock *wall, int block) {
    for (int j = 0; j + 1 < wall->n_node; j++) {
        for (int i = 0; i + 1 < wall->n_node; i++) {
            const int a = node_of(wall, block, i, j), b = node_of(wall, block, i + 1, j);
            const int c = node_of(wall, block, i + 1, j + 1), d = node_of(wall, block, i, j + 1);
            const triangle lower = {{a, b, c}, {i, i + 1, i + 1}, {j, j, j + 1}};
            const triangle upper = {{a, c, d}, {i, i + 1, i}, {j, j + 1, j + 1}};
            add_triangle(context, list, &lower, wall);
            add_triangle(context, list, &upper, wall);
        }
    }
}

// Springs of `vertex` against a point between nodes a and b: normal along x (0) or y (1).
static void add_spring(nmm_context *context, triplets *list, const int node[3], int normal,
                       const double stiff[2]) {
    const double weight[3] = {1, -0.6, -0.4};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double value[4] = {0};
            value[3 * normal] = weight[i] * weight[j] * stiff[0];
            value[3 * (1 - normal)] = weight[i] * weight[j] * stiff[1];
            triplets_add(context, list, node[i], node[j], value);
        }
    }
}

// The contacts between block and the next one to the right (normal 0) or above (normal 1).
static void add_contacts(nmm_context *context, triplets *list, const rock *wall, int block,
                         int normal, nmm_random *random) {
    const int next = block + (normal == 0 ? 1 : wall->n_across);
    const int far = wall->n_node - 1;
    for (int k = 0; k < far; k++) {
        const double luck = nmm_random_unit(random);
        const double hard = wall->spring * YOUNG;
        const double stiff[2] = {luck < 0.85 ? hard : 0, luck < 0.6 ? 0.4 * hard : 0};
        const int right[3] = {node_of(wall, next, 0, k), node_of(wall, block, far, k),
                              node_of(wall, block, far, k + 1)};
        const int above[3] = {node_of(wall, next, k, 0), node_of(wall, block, k, far),
                              node_of(wall, block, k + 1, far)};
        add_spring(context, list, normal == 0 ? right : above, normal, stiff);
    }
}

void test_system_rock(nmm_context *context, test_system *system, const rock *wall) {
    triplets list = {0};
    nmm_random random = nmm_random_seed(wall->seed);
    const int n_block = wall->n_across * wall->n_up;
    for (int block = 0; block < n_block; block++) {
        add_block(context, &list, wall, block);
        const bool right = block % wall->n_across + 1 < wall->n_across;
        const bool above = block + wall->n_across < n_block;
        if (wall->spring > 0 && right) add_contacts(context, &list, wall, block, 0, &random);
        if (wall->spring > 0 && above) add_contacts(context, &list, wall, block, 1, &random);
    }
    // The foot is held by springs.
    const double held[4] = {1000 * YOUNG, 0, 0, 1000 * YOUNG};
    for (int block = 0; block < wall->n_across; block++)
        for (int i = 0; i < wall->n_node; i++)
            triplets_add(context, &list, node_of(wall, block, i, 0), node_of(wall, block, i, 0),
                         held);
    test_system_build(context, system, &list, n_block * wall->n_node * wall->n_node);
    for (int row = 0; row < system->K.n_row; row++) {
        system->f[2 * row] = 1e3 * (nmm_random_unit(&random) - 0.5);
        system->f[2 * row + 1] = -DENSITY * 9.81;
    }
}

void test_system_wall(nmm_context *context, test_system *system, int n_across, int n_up,
                      double courant) {
    const rock wall = {.n_across = n_across,
                       .n_up = n_up,
                       .n_node = 5,
                       .courant = courant,
                       .spring = 50,
                       .seed = 11};
    test_system_rock(context, system, &wall);
}

// --- Graphs

// `value` times the unit block, and the same on the other side of the diagonal.
static void add_both(nmm_context *context, triplets *list, int row, int col, double value) {
    const double block[4] = {value, 0, 0, value};
    triplets_add(context, list, row, col, block);
    if (row != col) triplets_add(context, list, col, row, block);
}

void test_system_grid(nmm_context *context, test_system *system, int n_side) {
    triplets list = {0};
    const int n = n_side * n_side;
    for (int row = 0; row < n; row++) {
        add_both(context, &list, row, row, 5);
        if (row % n_side + 1 < n_side) add_both(context, &list, row, row + 1, -1);
        if (row + n_side < n) add_both(context, &list, row, row + n_side, -1);
    }
    test_system_build(context, system, &list, n);
}

void test_system_star(nmm_context *context, test_system *system, int n_row, int middle,
                      double coupling) {
    triplets list = {0};
    for (int row = 0; row < n_row; row++) {
        add_both(context, &list, row, row, 1);
        if (row != middle) add_both(context, &list, row, middle, coupling);
    }
    test_system_build(context, system, &list, n_row);
}

void test_system_lumps(nmm_context *context, test_system *system, int n_lump, int size,
                       int n_middle) {
    triplets list = {0};
    const int n = n_lump * size + n_middle;
    for (int row = 0; row < n; row++) {
        add_both(context, &list, row, row, 10);
        for (int col = 0; col < row; col++) {
            const int middle = row - n_lump * size, lump = col / size;
            const bool met = middle < 0 ? row / size == lump : middle != lump;
            if (met) add_both(context, &list, row, col, 0.01 * ((7 * row + 13 * col) % 5 - 2));
        }
    }
    test_system_build(context, system, &list, n);
}

void test_system_chain(nmm_context *context, test_system *system, int n_row, bool held) {
    triplets list = {0};
    for (int row = 0; row < n_row; row++) {
        const int n_spring = (row > 0 || held) + (row + 1 < n_row);
        add_both(context, &list, row, row, n_spring);
        if (row > 0) add_both(context, &list, row, row - 1, -1);
    }
    test_system_build(context, system, &list, n_row);
}

void test_system_random(nmm_context *context, test_system *system, int n_row, int per_row,
                        uint64_t seed) {
    triplets list = {0};
    nmm_random random = nmm_random_seed(seed);
    for (int row = 0; row < n_row; row++) {
        for (int k = 0; k < per_row; k++) {
            // g g^T on two rows, and a little on the diagonal: positive definite.
            const int other = (int)(nmm_random_unit(&random) * n_row);
            double g[4];
            for (int i = 0; i < 4; i++)
                g[i] = nmm_random_unit(&random) - 0.5;
            const double a[4] = {g[0] * g[0] + 0.1, g[0] * g[1], g[0] * g[1], g[1] * g[1] + 0.1};
            const double b[4] = {g[0] * g[2], g[0] * g[3], g[1] * g[2], g[1] * g[3]};
            const double t[4] = {b[0], b[2], b[1], b[3]};
            const double d[4] = {g[2] * g[2], g[2] * g[3], g[2] * g[3], g[3] * g[3]};
            triplets_add(context, &list, row, row, a);
            if (other == row) continue;
            triplets_add(context, &list, row, other, b);
            triplets_add(context, &list, other, row, t);
            triplets_add(context, &list, other, other, d);
        }
    }
    test_system_build(context, system, &list, n_row);
    for (int i = 0; i < 2 * n_row; i++)
        system->f[i] = nmm_random_unit(&random) - 0.5;
}

void test_system_scale(test_system *system, const double *scale) {
    nmm_bsr *K = &system->K;
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                K->value[4 * k + i] *= scale[2 * row + i / 2] * scale[2 * K->col[k] + i % 2];
        system->f[2 * row] *= scale[2 * row];
        system->f[2 * row + 1] *= scale[2 * row + 1];
    }
}

// --- References

// Eliminate with row pivoting; `a` is [n][n + 1], the last column the right-hand side.
static void eliminate(int n, double *a, double *u) {
    const int w = n + 1;
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i * w + k]) > fabs(a[best * w + k])) best = i;
        for (int j = k; j < w && best != k; j++) {
            const double t = a[k * w + j];
            a[k * w + j] = a[best * w + j];
            a[best * w + j] = t;
        }
        for (int i = k + 1; i < n; i++) {
            const double factor = a[i * w + k] / a[k * w + k];
            for (int j = k; j < w; j++)
                a[i * w + j] -= factor * a[k * w + j];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        u[k] = a[k * w + n];
        for (int j = k + 1; j < n; j++)
            u[k] -= a[k * w + j] * u[j];
        u[k] /= a[k * w + k];
    }
}

void test_dense_solve(nmm_context *context, const test_system *system, double *u) {
    const nmm_bsr *K = &system->K;
    const int n = 2 * K->n_row;
    double *a = NULL;
    must(nmm_allocate(context, &a, (size_t)n * (size_t)(n + 1), sizeof *a));
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                a[(2 * row + i / 2) * (n + 1) + 2 * K->col[k] + i % 2] = K->value[4 * k + i];
        for (int i = 0; i < 2; i++)
            a[(2 * row + i) * (n + 1) + n] = system->f[2 * row + i];
    }
    eliminate(n, a, u);
    nmm_release(context, &a);
}

double test_true_residual(const test_system *system, const double *u) {
    const nmm_bsr *K = &system->K;
    long double residual = 0, load = 0;
    for (int row = 0; row < K->n_row; row++) {
        for (int i = 0; i < 2; i++) {
            long double r = system->f[2 * row + i];
            load += r * r;
            for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
                const double *v = K->value + 4 * k + 2 * i, *x = u + 2 * K->col[k];
                r -= (long double)v[0] * x[0] + (long double)v[1] * x[1];
            }
            residual += r * r;
        }
    }
    return (double)sqrtl(residual / load);
}

bool test_has_avx2(void) {
#if defined(__x86_64__)
    return __builtin_cpu_supports("avx2");
#else
    return false;
#endif
}
