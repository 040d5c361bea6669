// SPDX-License-Identifier: MIT
//
// Clusters of block rows: groups of up to 8 rows that couple most, so that stiff contact springs
// fall inside one dense diagonal block. Found from the matrix alone. Equations:
// docs/theory/6-solve.md.

#ifndef NMM_CLUSTERS_H
#define NMM_CLUSTERS_H

#include "solve.h"

/// Block rows in a group, and unknowns.
#define NMM_GROUP 8
#define NMM_GROUP_UNKNOWNS 16

/// A new order of the rows: group g has the places 8 g .. 8 g + 7, some of them empty.
typedef struct nmm_clusters {
    int n_group;
    int *order;           // [8 n_group] row of the caller, -1: empty
    int *place;           // [n_row] place of a row: the inverse of order
    int *diagonal;        // [8 n_group] its diagonal block in the new order, -1: empty
    double *inverted;     // [8 n_group][2] diagonal of the matrix whose clusters were inverted last
    unsigned char *newer; // [n_group] marks of those inverted since they were sent
    int *entry;           // [n_block] entry of the caller's matrix for an entry in the new order
    int n_row, n_block;   // what there is room for
    // Scratch of the search.
    int *parent, *size; // [n_row] trees of rows that belong together
    double *square;     // [n_row] |K_ii|^2
    int *coupling;      // [n_block / 2 + 1][2] pairs of rows, strongest first
} nmm_clusters;

/// Places that clusters of `n_row` rows can need: all groups but one hold at least 5 rows.
static inline int nmm_clusters_room(int n_row) {
    return (n_row / 5 + 1) * NMM_GROUP;
}

/// Room for groups of `n_row` rows, however they fall; kept when there is enough.
nmm_status nmm_clusters_reserve(nmm_context *context, nmm_clusters *clusters, int n_row,
                                int n_block);
void nmm_clusters_destroy(nmm_context *context, nmm_clusters *clusters);

/// Find the clusters of K. The same result for any number of threads.
nmm_status nmm_clusters_find(nmm_context *context, nmm_clusters *clusters, const nmm_bsr *K);

/// The pattern of K in their order: row_start [8 n_group + 1], col [n_block].
void nmm_clusters_pattern(nmm_clusters *clusters, const nmm_bsr *K, int *row_start, int *col);

/// Values of K in the new order.
void nmm_clusters_take(const nmm_clusters *clusters, const nmm_bsr *K, int n_thread, double *value);

#endif
