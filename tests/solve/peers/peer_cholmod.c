// SPDX-License-Identifier: MIT
//
// SuiteSparse's CHOLMOD in the benchmark: the ordering and the symbolic factor are kept, simplicial
// or supernodal as CHOLMOD chooses; each solve makes the numeric factor, solves and, where rounding
// left too much, solves for the residual again.

#include "bench.h"

#include <suitesparse/cholmod.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MAX_REFINEMENTS 5

typedef struct direct {
    const bench_system *system;
    cholmod_common common;
    cholmod_sparse *A; // its lower half
    cholmod_factor *L;
    cholmod_dense *f, *u, *r;
} direct;

// The rows of a symmetric matrix are its columns: what is right of the diagonal in row j is what
// is below it in column j.
static cholmod_sparse *lower_half(const bench_system *s, cholmod_common *common) {
    const size_t n = 2 * (size_t)s->n_row;
    const size_t most = 2 * (size_t)s->n_block + n;
    cholmod_sparse *A = cholmod_allocate_sparse(n, n, most, 1, 1, -1, CHOLMOD_REAL, common);
    if (A == NULL) return NULL;
    int *start = A->p, *row_of = A->i;
    double *value = A->x;
    int at = 0;
    for (int j = 0; j < 2 * s->n_row; j++) {
        start[j] = at;
        for (int k = s->row_start[j / 2]; k < s->row_start[j / 2 + 1]; k++) {
            for (int i = 0; i < 2; i++) {
                const int row = 2 * s->col[k] + i;
                if (row < j) continue;
                row_of[at] = row;
                value[at++] = s->value[4 * (long)k + 2 * (j % 2) + i];
            }
        }
    }
    start[n] = at;
    return A;
}

static void close_cholmod(void *state) {
    direct *d = state;
    cholmod_free_dense(&d->f, &d->common);
    cholmod_free_dense(&d->u, &d->common);
    cholmod_free_dense(&d->r, &d->common);
    cholmod_free_factor(&d->L, &d->common);
    cholmod_free_sparse(&d->A, &d->common);
    cholmod_finish(&d->common);
    free(d);
}

static void *open_cholmod(const bench_system *system, const bench_method *method, int n_thread) {
    (void)method, (void)n_thread;
    direct *d = calloc(1, sizeof *d);
    if (d == NULL) return NULL;
    d->system = system;
    cholmod_start(&d->common);
    d->common.print = 0;
    const size_t n = 2 * (size_t)system->n_row;
    d->A = lower_half(system, &d->common);
    d->f = cholmod_zeros(n, 1, CHOLMOD_REAL, &d->common);
    d->u = cholmod_zeros(n, 1, CHOLMOD_REAL, &d->common);
    d->r = cholmod_zeros(n, 1, CHOLMOD_REAL, &d->common);
    if (d->A != NULL) d->L = cholmod_analyze(d->A, &d->common);
    if (d->L != NULL && d->r != NULL) {
        memcpy(d->f->x, system->f, n * sizeof(double));
        return d;
    }
    close_cholmod(d);
    return NULL;
}

static double norm(const cholmod_dense *x) {
    const double *v = x->x;
    double sum = 0;
    for (size_t i = 0; i < x->nrow; i++)
        sum += v[i] * v[i];
    return sqrt(sum);
}

// r = f - A u.
static void residual(direct *d) {
    double one[2] = {1, 0}, minus[2] = {-1, 0};
    memcpy(d->r->x, d->f->x, d->f->nrow * sizeof(double));
    cholmod_sdmult(d->A, 0, minus, one, d->u, d->r, &d->common);
}

static int solve_cholmod(void *state, double tolerance, double *u) {
    direct *d = state;
    double *sum = d->u->x;
    if (!cholmod_factorize(d->A, d->L, &d->common) || d->common.status != CHOLMOD_OK) return -1;
    memset(sum, 0, d->u->nrow * sizeof *sum);
    memcpy(d->r->x, d->f->x, d->f->nrow * sizeof(double));
    const double limit = tolerance * norm(d->f);
    for (int k = 1; k <= MAX_REFINEMENTS; k++) {
        cholmod_dense *change = cholmod_solve(CHOLMOD_A, d->L, d->r, &d->common);
        if (change == NULL) return -1;
        const double *part = change->x;
        for (size_t i = 0; i < d->u->nrow; i++)
            sum[i] += part[i];
        cholmod_free_dense(&change, &d->common);
        residual(d);
        if (norm(d->r) > limit) continue;
        memcpy(u, sum, d->u->nrow * sizeof *u);
        return k;
    }
    return -1;
}

static const char *note_of_cholmod(const void *state) {
    const direct *d = state;
    return d->L->is_super ? "supernodal" : "simplicial";
}

const bench_method *bench_cholmod(int *n) {
    static const bench_method list[] = {{.name = "cholmod",
                                         .family = BENCH_DIRECT,
                                         .threads = true,
                                         .open = open_cholmod,
                                         .solve = solve_cholmod,
                                         .close = close_cholmod,
                                         .note = note_of_cholmod}};
    *n = 1;
    return list;
}
