// SPDX-License-Identifier: MIT
//
// Smallest and largest eigenvalue of the tridiagonal matrix that conjugate gradients build on their
// way: estimates from inside of the bounds of the spectrum of D^-1 K. By bisection with Sturm's
// count of eigenvalues.

#include "solver.h"

#include <math.h>

typedef struct tridiagonal {
    int n;
    double diagonal[NMM_LANCZOS], off[NMM_LANCZOS]; // off[k]: between k and k + 1
} tridiagonal;

// Number of eigenvalues below x: negative pivots of T - x I.
static int count_below(const tridiagonal *T, double x) {
    int count = 0;
    double pivot = 1;
    for (int k = 0; k < T->n; k++) {
        const double coupling = k > 0 ? T->off[k - 1] * T->off[k - 1] / pivot : 0;
        pivot = T->diagonal[k] - x - coupling;
        if (pivot == 0) pivot = 1e-300;
        if (pivot < 0) count++;
    }
    return count;
}

// The value below which lie `count` eigenvalues but not `count` + 1, between low and high.
static double find(const tridiagonal *T, int count, double low, double high) {
    for (int round = 0; round < 60 && high - low > 1e-6 * high; round++) {
        const double middle = 0.5 * (low + high);
        if (count_below(T, middle) > count) {
            high = middle;
        } else {
            low = middle;
        }
    }
    return high;
}

void nmm_lanczos_bounds(int n, double history[][2], double bounds[2]) {
    tridiagonal T = {.n = nmm_min_int(n, NMM_LANCZOS)};
    double high = 0;
    for (int k = 0; k < T.n; k++) {
        const double alpha = history[k][0], beta = history[k][1];
        const double carried = k > 0 ? history[k - 1][1] / history[k - 1][0] : 0;
        T.diagonal[k] = 1 / alpha + carried;
        T.off[k] = sqrt(nmm_max(beta, 0)) / alpha;
        // Gershgorin's bound.
        const double before = k > 0 ? T.off[k - 1] : 0;
        high = nmm_max(high, T.diagonal[k] + before + T.off[k]);
    }
    bounds[0] = T.n > 0 ? find(&T, 0, 0, high) : 0;
    bounds[1] = T.n > 0 ? find(&T, T.n - 1, 0, high) : 0;
}
