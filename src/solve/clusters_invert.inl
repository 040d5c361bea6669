// SPDX-License-Identifier: MIT
//
// Inverses of the clusters' dense blocks; compiled once for each kind of processor.

// A pivot below this part of its diagonal: the inverse, rounded to float32, would lose its stiff
// directions or turn them round.
#define UNSAFE_PIVOT 3e-7

// Part of the diagonal that such a block is stiffened by, eq. (6.15).
#define STIFFENED 1e-6

// Smallest part of the largest number of an inverse that float32 holds beside it, with room to add.
#define NARROWEST 1e-30

// Relative change of a diagonal that makes an inverse useless.
#define STALE 0.03

typedef double matrix[NMM_GROUP_UNKNOWNS][NMM_GROUP_UNKNOWNS];

// The diagonal block of a group; one on the diagonal of empty places.
static void gather(int group, const int *row_start, const int *col, const double *value,
                   bool blocks_only, matrix a) {
    memset(a, 0, sizeof(matrix));
    const int first = group * NMM_GROUP;
    for (int i = 0; i < NMM_GROUP; i++) {
        if (row_start[first + i] == row_start[first + i + 1]) a[2 * i][2 * i] = 1;
        if (row_start[first + i] == row_start[first + i + 1]) a[2 * i + 1][2 * i + 1] = 1;
        for (int k = row_start[first + i]; k < row_start[first + i + 1]; k++) {
            const int j = col[k] - first;
            if (j < 0 || j >= NMM_GROUP || (blocks_only && j != i)) continue;
            const double *v = value + 4 * (long)k;
            a[2 * i][2 * j] = v[0];
            a[2 * i][2 * j + 1] = v[1];
            a[2 * i + 1][2 * j] = v[2];
            a[2 * i + 1][2 * j + 1] = v[3];
        }
    }
}

// Gauss-Jordan in place, pivots down the diagonal; false when one is not above this part of its
// diagonal.
static bool invert(matrix a, double part) {
    for (int k = 0; k < NMM_GROUP_UNKNOWNS; k++)
        if (!(a[k][k] > 0)) return false;
    double smallest[NMM_GROUP_UNKNOWNS];
    for (int k = 0; k < NMM_GROUP_UNKNOWNS; k++)
        smallest[k] = part * a[k][k];
    for (int k = 0; k < NMM_GROUP_UNKNOWNS; k++) {
        if (!(a[k][k] > smallest[k])) return false;
        const double pivot = 1 / a[k][k];
        double row[NMM_GROUP_UNKNOWNS];
        for (int j = 0; j < NMM_GROUP_UNKNOWNS; j++)
            row[j] = a[k][j] * pivot;
        row[k] = pivot;
        for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++) {
            const double factor = a[i][k];
            a[i][k] = 0;
            for (int j = 0; j < NMM_GROUP_UNKNOWNS; j++)
                a[i][j] -= factor * row[j];
        }
        memcpy(a[k], row, sizeof row);
    }
    return true;
}

// The inverse of a group's block; of the block stiffened where float32 could not hold that; of its
// 2x2 blocks, which the check of the system let pass, where it is not positive definite.
static void invert_group(int group, const int *row_start, const int *col, const double *value,
                         matrix a) {
    gather(group, row_start, col, value, false, a);
    if (invert(a, UNSAFE_PIVOT)) return;
    gather(group, row_start, col, value, false, a);
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++)
        a[i][i] *= 1 + STIFFENED;
    if (invert(a, UNSAFE_PIVOT)) return;
    gather(group, row_start, col, value, true, a);
    invert(a, 0);
}

static void store(const int *row_start, int group, matrix a, float *dense, double *scale) {
    double largest = 0, smallest = INFINITY;
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++) {
        const int row = group * NMM_GROUP + i / 2;
        if (row_start[row] == row_start[row + 1]) {
            a[i][i] = 0;
        } else {
            largest = nmm_max(largest, a[i][i]);
            smallest = nmm_min(smallest, a[i][i]);
        }
    }
    int exponent = 0;
    frexp(largest, &exponent);
    *scale = smallest >= NARROWEST * largest ? ldexp(1, exponent) : 0;
    const double shrink = ldexp(1, -exponent);
    // Both halves from the mean: an exactly symmetric preconditioner.
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++)
        for (int j = 0; j < NMM_GROUP_UNKNOWNS; j++)
            dense[i * NMM_GROUP_UNKNOWNS + j] = (float)(0.5 * (a[i][j] + a[j][i]) * shrink);
}

// Has the diagonal of a group changed by more than STALE since its block was inverted? Springs that
// close or open change it by their full stiffness.
static bool is_stale(const nmm_clusters *c, int group, const double *value) {
    for (int p = group * NMM_GROUP; p < (group + 1) * NMM_GROUP; p++) {
        if (c->diagonal[p] < 0) continue;
        const double *v = value + 4 * (long)c->diagonal[p], *was = c->inverted + 2 * (long)p;
        if (!(fabs(v[0] - was[0]) <= STALE * was[0])) return true;
        if (!(fabs(v[3] - was[1]) <= STALE * was[1])) return true;
    }
    return false;
}

static void note_diagonal(nmm_clusters *c, int group, const double *value) {
    for (int p = group * NMM_GROUP; p < (group + 1) * NMM_GROUP; p++) {
        if (c->diagonal[p] < 0) continue;
        c->inverted[2 * (long)p] = value[4 * (long)c->diagonal[p]];
        c->inverted[2 * (long)p + 1] = value[4 * (long)c->diagonal[p] + 3];
    }
}

static int invert_clusters(nmm_clusters *clusters, const int *row_start, const int *col,
                           const double *value, int n_thread, bool keep, float *dense,
                           double *scale) {
    const int n_group = clusters->n_group;
    int made = 0;
#pragma omp parallel for num_threads(n_thread) schedule(static) reduction(+ : made) if (n_thread > 1)
    for (int g = 0; g < n_group; g++) {
        if (keep && !is_stale(clusters, g, value)) continue;
        matrix a;
        invert_group(g, row_start, col, value, a);
        store(row_start, g, a, dense + (long)g * NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS,
              scale + g);
        note_diagonal(clusters, g, value);
        clusters->newer[g] = NMM_NEWER_WIDE;
        made++;
    }
    return made;
}
