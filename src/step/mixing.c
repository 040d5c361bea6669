// SPDX-License-Identifier: MIT
//
// Anderson mixing: least squares on the differences of the last passes, by normal equations of
// their few products. Sums run over fixed chunks: the same bits for any number of threads.

#include "mixing.h"

#include "solve.h"

#include <math.h>
#include <string.h>

// A difference that adds less than this part of its length to those before adds nothing.
#define DEPENDENT 1e-10

nmm_status nmm_mixing_open(nmm_context *context, nmm_mixing *mixing, int n) {
    mixing->n = n;
    TRY(nmm_allocate(context, &mixing->place, (size_t)n, sizeof(double)));
    TRY(nmm_allocate(context, &mixing->change, (size_t)n, sizeof(double)));
    for (int k = 0; k < NMM_MIXING_DEPTH; k++) {
        TRY(nmm_allocate(context, &mixing->places[k], (size_t)n, sizeof(double)));
        TRY(nmm_allocate(context, &mixing->changes[k], (size_t)n, sizeof(double)));
    }
    return NMM_OK;
}

void nmm_mixing_close(nmm_context *context, nmm_mixing *mixing) {
    nmm_release(context, &mixing->place);
    nmm_release(context, &mixing->change);
    for (int k = 0; k < NMM_MIXING_DEPTH; k++) {
        nmm_release(context, &mixing->places[k]);
        nmm_release(context, &mixing->changes[k]);
    }
    *mixing = (nmm_mixing){0};
}

void nmm_mixing_reset(nmm_mixing *mixing) {
    mixing->count = mixing->next = 0;
    mixing->begun = false;
}

// The oldest difference makes room for that from the pass before to this one.
static void add_difference(nmm_mixing *mixing, const double *place, const double *change) {
    double *places = mixing->places[mixing->next], *changes = mixing->changes[mixing->next];
    for (int i = 0; i < mixing->n; i++) {
        places[i] = place[i] - mixing->place[i];
        changes[i] = change[i] - mixing->change[i];
    }
    mixing->next = (mixing->next + 1) % NMM_MIXING_DEPTH;
    mixing->count = nmm_min_int(mixing->count + 1, NMM_MIXING_DEPTH);
}

// Cholesky's factor of the m products in place, and part[m] for the right-hand side in its last
// row. A dependent difference gets no part.
static void solve_products(double a[NMM_MIXING_DEPTH + 1][NMM_MIXING_DEPTH], int m, double *part) {
    for (int j = 0; j < m; j++) {
        double pivot = a[j][j];
        for (int k = 0; k < j; k++)
            pivot -= a[j][k] * a[j][k];
        const bool good = pivot > DEPENDENT * a[j][j];
        a[j][j] = good ? sqrt(pivot) : INFINITY;
        for (int i = j + 1; i <= m; i++) {
            double entry = a[i][j];
            for (int k = 0; k < j; k++)
                entry -= a[i][k] * a[j][k];
            a[i][j] = entry / a[j][j];
        }
    }
    for (int j = m - 1; j >= 0; j--) {
        double entry = a[m][j];
        for (int i = j + 1; i < m; i++)
            entry -= a[i][j] * part[i];
        part[j] = entry / a[j][j];
    }
}

static void mix_change(nmm_mixing *mixing, double *change, int n_thread) {
    const int m = mixing->count, n = mixing->n;
    double a[NMM_MIXING_DEPTH + 1][NMM_MIXING_DEPTH] = {{0}}, part[NMM_MIXING_DEPTH] = {0};
    for (int i = 0; i < m; i++) {
        for (int j = 0; j <= i; j++)
            a[i][j] = nmm_sum_product(n, mixing->changes[i], mixing->changes[j], n_thread);
        a[m][i] = nmm_sum_product(n, change, mixing->changes[i], n_thread);
    }
    solve_products(a, m, part);
    for (int k = 0; k < m; k++) {
        const double *places = mixing->places[k], *changes = mixing->changes[k];
        for (int i = 0; i < n; i++)
            change[i] -= part[k] * (places[i] + changes[i]);
    }
}

bool nmm_mixing_take(nmm_mixing *mixing, const double *place, double *change, bool mix,
                     int n_thread) {
    const size_t size = (size_t)mixing->n * sizeof(double);
    if (!mix) mixing->count = mixing->next = 0;
    if (mix && mixing->begun) add_difference(mixing, place, change);
    memcpy(mixing->place, place, size);
    memcpy(mixing->change, change, size);
    mixing->begun = true;
    if (mixing->count == 0) return false;
    mix_change(mixing, change, n_thread);
    return true;
}
