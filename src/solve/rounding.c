// SPDX-License-Identifier: MIT
//
// Rounding or a slow method? A residual f - K u is a sum of terms of which each is rounded, and so
// is u: no method brings it below about 1e-16 of |f| + |K| |u|, taken number by number. That bound
// tells a solve that rounding has ended from one that converges slowly or not at all. Another one,
// far down, is that of the numbers themselves: next to zero they lie 4.9e-324 apart.

#include "solver.h"

#include <float.h>
#include <math.h>

// Residuals up to so many times the bound are rounding's.
#define MARGIN 8

bool nmm_solver_rounds(const nmm_solver *s, double norm) {
    const double *u = s->wide.u;
    double sum = 0;
    for (int row = 0; row < s->n; row++) {
        double r0 = fabs(s->wide.f[2 * (long)row]), r1 = fabs(s->wide.f[2 * (long)row + 1]);
        for (int k = s->row_start[row]; k < s->row_start[row + 1]; k++) {
            const double *v = s->wide.value + 4 * (long)k, *x = u + 2 * (long)s->col[k];
            r0 += fabs(v[0] * x[0]) + fabs(v[1] * x[1]);
            r1 += fabs(v[2] * x[0]) + fabs(v[3] * x[1]);
        }
        sum += r0 * r0 + r1 * r1;
    }
    return norm <= MARGIN * DBL_EPSILON * sqrt(sum);
}

double nmm_solver_least_norm(const nmm_solver *s, const nmm_bsr *K) {
    // An eigenvalue of K is no larger than the largest number of its diagonal times the numbers of
    // a row, of which the mean is known; each displacement is off by half the spacing.
    const double numbers = 2.0 * (4.0 * s->n_block / nmm_max_int(s->n_row, 1));
    const double spacing = ldexp(DBL_TRUE_MIN, nmm_max_int(-s->exponent, 0));
    const double factor = numbers * sqrt(s->n_row) * spacing;
    if (s->limit >= factor * DBL_MAX) return 0;
    double largest = 0;
    for (int row = 0; row < K->n_row; row++) {
        const double *block = K->value + 4 * (long)K->diagonal[row];
        largest = nmm_max(largest, nmm_max(block[0], block[3]));
    }
    return factor * largest;
}
