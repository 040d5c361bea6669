// SPDX-License-Identifier: MIT
//
// A generated system: nodes of a square grid, two linear triangles in each cell, plane strain,
// cells of 1 m, lumped mass times 2 / dt^2 (eq. (4.1)) at ten times the time a wave takes through
// a cell. What a step of one unjointed plate looks like to the solver.
//
//   2 --- 1        node (i, j) is block row j * n + i
//   |   / |        lower triangle: 0, (1, 0), (1, 1)
//   | /   |        upper triangle: 0, (1, 1), (0, 1)
//   0 --- *

#include "linear.h"

#include <math.h>

#define YOUNG 5e9
#define POISSON 0.25
#define DENSITY 2500.0
#define COURANT 10.0

/// Blocks between two corners of a triangle.
typedef struct triangle {
    int corner[3][2];      // steps of i and j
    double block[3][3][4]; // N/m
} triangle;

// Stiffness B^T C B times the area, from the gradients of the shape functions.
static void make_stiffness(triangle *t, const double gradient[3][2]) {
    const double scale = 0.5 * YOUNG / ((1 + POISSON) * (1 - 2 * POISSON));
    const double c11 = scale * (1 - POISSON), c12 = scale * POISSON;
    const double c33 = 0.5 * scale * (1 - 2 * POISSON);
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
            const double *g = gradient[a], *h = gradient[b];
            double *k = t->block[a][b];
            k[0] = c11 * g[0] * h[0] + c33 * g[1] * h[1];
            k[1] = c12 * g[0] * h[1] + c33 * g[1] * h[0];
            k[2] = c12 * g[1] * h[0] + c33 * g[0] * h[1];
            k[3] = c11 * g[1] * h[1] + c33 * g[0] * h[0];
        }
    }
}

static void make_triangles(triangle t[2]) {
    static const double lower[3][2] = {{-1, 0}, {1, -1}, {0, 1}};
    static const double upper[3][2] = {{0, -1}, {1, 0}, {-1, 1}};
    t[0] = (triangle){.corner = {{0, 0}, {1, 0}, {1, 1}}};
    t[1] = (triangle){.corner = {{0, 0}, {1, 1}, {0, 1}}};
    make_stiffness(&t[0], lower);
    make_stiffness(&t[1], upper);
    const double speed2 = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON)) / DENSITY;
    const double mass = 2 * speed2 / (COURANT * COURANT) * DENSITY * 0.5 / 3;
    for (int k = 0; k < 2; k++) {
        for (int a = 0; a < 3; a++) {
            t[k].block[a][a][0] += mass;
            t[k].block[a][a][3] += mass;
        }
    }
}

// Add the triangles of the cell at (i, j) that touch node (x, y) to its row: block[dy + 1][dx + 1].
static void add_cell(const triangle t[2], const int cell[2], const int node[2],
                     double block[3][3][4]) {
    for (int k = 0; k < 2; k++) {
        for (int a = 0; a < 3; a++) {
            const int *own = t[k].corner[a];
            if (cell[0] + own[0] != node[0] || cell[1] + own[1] != node[1]) continue;
            for (int b = 0; b < 3; b++) {
                const int dx = t[k].corner[b][0] - own[0], dy = t[k].corner[b][1] - own[1];
                for (int i = 0; i < 4; i++)
                    block[dy + 1][dx + 1][i] += t[k].block[a][b][i];
            }
        }
    }
}

// Node (x, y) of n by n: its blocks in the order of columns; returns where the next row starts.
static int put_row(nmm_bsr *K, const triangle t[2], int n, const int node[2], int at) {
    double block[3][3][4] = {{{0}}};
    for (int cy = nmm_max_int(0, node[1] - 1); cy <= nmm_min_int(n - 2, node[1]); cy++) {
        for (int cx = nmm_max_int(0, node[0] - 1); cx <= nmm_min_int(n - 2, node[0]); cx++)
            add_cell(t, (const int[]){cx, cy}, node, block);
    }
    const int row = node[1] * n + node[0];
    for (int k = 0; k < 9; k++) {
        const int dx = k % 3 - 1, dy = k / 3 - 1, x = node[0] + dx, y = node[1] + dy;
        // The other diagonal of a cell joins nothing.
        if (dx * dy < 0 || x < 0 || y < 0 || x >= n || y >= n) continue;
        if (k == 4) K->diagonal[row] = at;
        K->col[at] = y * n + x;
        for (int i = 0; i < 4; i++)
            K->value[4 * (long)at + i] = block[dy + 1][dx + 1][i];
        at += 1;
    }
    K->row_start[row + 1] = at;
    return at;
}

nmm_status nmm_linear_generate(nmm_context *context, nmm_linear *system, int order) {
    const int n = nmm_max_int(2, (int)sqrt(0.5 * order));
    nmm_bsr *K = &system->K;
    K->n_row = n * n;
    system->order = 2 * K->n_row;
    const size_t n_row = (size_t)K->n_row;
    TRY(nmm_allocate(context, &K->row_start, n_row + 1, sizeof(int)));
    TRY(nmm_allocate(context, &K->diagonal, n_row, sizeof(int)));
    TRY(nmm_allocate(context, &K->col, 7 * n_row, sizeof(int)));
    TRY(nmm_allocate(context, &K->value, 7 * n_row, 4 * sizeof(double)));
    TRY(nmm_allocate(context, &system->place, n_row, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &system->body, n_row, sizeof(int)));
    triangle t[2];
    make_triangles(t);
    for (int row = 0, at = 0; row < K->n_row; row++) {
        const int node[2] = {row % n, row / n};
        at = put_row(K, t, n, node, at);
        system->place[2 * row] = node[0];
        system->place[2 * row + 1] = node[1];
    }
    system->entries = 4 * (long)K->row_start[K->n_row];
    return NMM_OK;
}
