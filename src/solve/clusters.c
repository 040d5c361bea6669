// SPDX-License-Identifier: MIT
//
// Clusters by Kruskal's method: couplings from the strongest to the weakest, in classes by powers
// of two; each joins the clusters of its two rows where both fit into one group. What is left over
// is packed, largest first, so that no two groups are half empty. All of it is serial and reads the
// matrix alone: one result for any number of threads.

#include "clusters.h"

#include <math.h>
#include <string.h>

// Classes of coupling strength; weaker couplings than the last class join nothing.
#define CLASSES 40

// --- Memory

nmm_status nmm_clusters_reserve(nmm_context *context, nmm_clusters *clusters, int n_row,
                                int n_block) {
    if (clusters->order != NULL && n_row <= clusters->n_row && n_block <= clusters->n_block) {
        return NMM_OK;
    }
    nmm_clusters_destroy(context, clusters);
    const size_t n = (size_t)n_row + 1;
    TRY(nmm_allocate(context, &clusters->order, (size_t)nmm_clusters_room(n_row), sizeof(int)));
    const size_t room = (size_t)nmm_clusters_room(n_row);
    TRY(nmm_allocate(context, &clusters->diagonal, room, sizeof(int)));
    TRY(nmm_allocate(context, &clusters->inverted, room, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &clusters->newer, room / NMM_GROUP, 1));
    TRY(nmm_allocate(context, &clusters->place, n, sizeof(int)));
    TRY(nmm_allocate(context, &clusters->entry, (size_t)n_block + 1, sizeof(int)));
    TRY(nmm_allocate(context, &clusters->parent, n, sizeof(int)));
    TRY(nmm_allocate(context, &clusters->size, n, sizeof(int)));
    TRY(nmm_allocate(context, &clusters->square, n, sizeof(double)));
    TRY(nmm_allocate(context, &clusters->coupling, (size_t)n_block / 2 + 1, 2 * sizeof(int)));
    clusters->n_row = n_row;
    clusters->n_block = n_block;
    return NMM_OK;
}

void nmm_clusters_destroy(nmm_context *context, nmm_clusters *clusters) {
    int **const array[] = {&clusters->diagonal, &clusters->order,  &clusters->place,
                           &clusters->entry,    &clusters->parent, &clusters->size,
                           &clusters->coupling};
    for (size_t k = 0; k < sizeof array / sizeof *array; k++)
        nmm_release(context, array[k]);
    nmm_release(context, &clusters->square);
    nmm_release(context, &clusters->inverted);
    nmm_release(context, &clusters->newer);
    *clusters = (nmm_clusters){0};
}

// --- Couplings

static double square_sum(const double *v) {
    return (v[0] * v[0] + v[1] * v[1]) + (v[2] * v[2] + v[3] * v[3]);
}

// Class of a coupling: 0 for those as strong as the diagonal, one more for each factor of two in
// |K_ij|^2 / (|K_ii| |K_jj|), squared; CLASSES and more: none.
static int class_of(double square, double diagonal_i, double diagonal_j) {
    const double strength = square / diagonal_i * (square / diagonal_j);
    if (!(strength > 0 && strength < 1e300)) return strength > 0 ? 0 : CLASSES;
    int exponent = 0;
    frexp(strength, &exponent);
    return nmm_max_int(0, nmm_min_int(-exponent, CLASSES));
}

// The couplings below the diagonal as pairs of rows, strongest class first; their number.
static int sort_couplings(nmm_clusters *c, const nmm_bsr *K) {
    int begin[CLASSES + 1] = {0};
    for (int i = 0; i < K->n_row; i++)
        c->square[i] = square_sum(K->value + 4 * (long)K->diagonal[i]);
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < K->n_row; i++) {
            for (int k = K->row_start[i]; k < K->diagonal[i]; k++) {
                const int j = K->col[k];
                const double square = square_sum(K->value + 4 * (long)k);
                const int class = class_of(square, c->square[i], c->square[j]);
                if (class >= CLASSES) continue;
                if (pass == 0) {
                    begin[class + 1] += 1;
                } else {
                    int *pair = c->coupling + 2 * (long)begin[class]++;
                    pair[0] = i;
                    pair[1] = j;
                }
            }
        }
        if (pass == 1) break;
        for (int class = 0; class < CLASSES; class ++)
            begin[class + 1] += begin[class];
    }
    return begin[CLASSES - 1];
}

static int root_of(int *parent, int i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

static void join(nmm_clusters *c, int n_row, int n_coupling) {
    for (int i = 0; i < n_row; i++) {
        c->parent[i] = i;
        c->size[i] = 1;
    }
    for (int k = 0; k < n_coupling; k++) {
        int a = root_of(c->parent, c->coupling[2 * (long)k]);
        int b = root_of(c->parent, c->coupling[2 * (long)k + 1]);
        if (a == b || c->size[a] + c->size[b] > NMM_GROUP) continue;
        // The lower row stays the root.
        if (b < a) {
            const int other = a;
            a = b;
            b = other;
        }
        c->parent[b] = a;
        c->size[a] += c->size[b];
    }
}

// --- Packing

// Group of each root, in c->place: the fullest open group with room, else a new one.
static int pack(nmm_clusters *c, int n_row) {
    // Open groups by the room they have: stacks, linked through `next`, which borrows c->order.
    int top[NMM_GROUP + 1], *next = c->order, n_group = 0;
    for (int room = 0; room <= NMM_GROUP; room++)
        top[room] = -1;
    for (int size = NMM_GROUP; size >= 1; size--) {
        for (int i = 0; i < n_row; i++) {
            if (c->parent[i] != i || c->size[i] != size) continue;
            int room = size;
            while (room < NMM_GROUP && top[room] < 0)
                room++;
            int group = n_group;
            if (room < NMM_GROUP) {
                group = top[room];
                top[room] = next[group];
            } else {
                n_group++;
            }
            c->place[i] = group;
            next[group] = top[room - size];
            top[room - size] = group;
        }
    }
    return n_group;
}

// Groups numbered by their lowest row, rows ascending within each.
static void order_rows(nmm_clusters *c, int n_row) {
    int *group_of = c->size, *rank = c->coupling, *filled = rank + c->n_group;
    for (int i = 0; i < n_row; i++)
        group_of[i] = c->place[root_of(c->parent, i)];
    for (int g = 0; g < c->n_group; g++) {
        rank[g] = -1;
        filled[g] = 0;
    }
    for (long p = 0; p < (long)c->n_group * NMM_GROUP; p++)
        c->order[p] = -1;
    int n_rank = 0;
    for (int i = 0; i < n_row; i++) {
        const int g = group_of[i];
        if (rank[g] < 0) rank[g] = n_rank++;
        c->place[i] = rank[g] * NMM_GROUP + filled[g]++;
        c->order[c->place[i]] = i;
    }
}

nmm_status nmm_clusters_find(nmm_context *context, nmm_clusters *clusters, const nmm_bsr *K) {
    TRY(nmm_clusters_reserve(context, clusters, K->n_row, K->row_start[K->n_row]));
    join(clusters, K->n_row, sort_couplings(clusters, K));
    clusters->n_group = pack(clusters, K->n_row);
    order_rows(clusters, K->n_row);
    return NMM_OK;
}

void nmm_clusters_pattern(nmm_clusters *clusters, const nmm_bsr *K, int *row_start, int *col) {
    int n = 0;
    row_start[0] = 0;
    for (int p = 0; p < clusters->n_group * NMM_GROUP; p++) {
        const int row = clusters->order[p];
        clusters->diagonal[p] = row < 0 ? -1 : n + K->diagonal[row] - K->row_start[row];
        for (int k = row < 0 ? 0 : K->row_start[row]; row >= 0 && k < K->row_start[row + 1]; k++) {
            col[n] = clusters->place[K->col[k]];
            clusters->entry[n++] = k;
        }
        row_start[p + 1] = n;
    }
}

void nmm_clusters_take(const nmm_clusters *clusters, const nmm_bsr *K, int n_thread,
                       double *value) {
    const int n = K->row_start[K->n_row];
    const int *entry = clusters->entry;
#pragma omp parallel for num_threads(n_thread) schedule(static) if (n_thread > 1)
    for (int k = 0; k < n; k++)
        memcpy(value + 4 * (long)k, K->value + 4 * (long)entry[k], 4 * sizeof(double));
}
