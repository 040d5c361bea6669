// SPDX-License-Identifier: MIT
//
// Marks on what a device does not know yet. The solver's own copy of the matrix is what was sent
// last, so the copy of new values tells which rows differ, at no further memory.

#include "newer.h"

#include "solver.h"

#include <string.h>

bool nmm_newer_next(unsigned char *mark, int n, int bit, int gap, nmm_range *range) {
    int i = range->end;
    while (mark != NULL && i < n && (mark[i] & bit) == 0)
        i++;
    if (mark == NULL || i >= n) return false;
    range->begin = i;
    for (range->end = i; i < n && i - range->end <= gap; i++) {
        if ((mark[i] & bit) == 0) continue;
        mark[i] &= (unsigned char)~bit;
        range->end = i + 1;
    }
    return true;
}

// Bits, not values: what the device holds is to be what the host holds.
static bool same_bits(const void *a, const void *b, size_t size) {
    return memcmp(a, b, size) == 0;
}

void nmm_newer_take(nmm_solver *solver, const nmm_bsr *K) {
    const bool reordered = solver->blocks >= NMM_BLOCKS_CLUSTER;
    const int *entry = reordered ? solver->clusters.entry : NULL;
    const int *row_start = solver->row_start;
    const int n = solver->n, n_thread = solver->n_thread;
    const unsigned char all = NMM_NEWER_WIDE | NMM_NEWER_NARROW;
    unsigned char *mark = solver->newer_row;
    double *own = solver->own_value;
    if (!solver->pattern_kept) memset(mark, all, (size_t)n);
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1)
    for (int row = 0; row < n; row++) {
        for (long k = row_start[row]; k < row_start[row + 1]; k++) {
            const double *value = K->value + 4 * (entry != NULL ? (long)entry[k] : k);
            if (same_bits(own + 4 * k, value, 4 * sizeof(double))) continue;
            memcpy(own + 4 * k, value, 4 * sizeof(double));
            mark[row] = all;
        }
    }
}
