// SPDX-License-Identifier: MIT
//
// An elimination order that keeps the factor of a sparse symmetric matrix small.

#ifndef NMM_ORDER_H
#define NMM_ORDER_H

#include "dissect.h"

/// Rows are eliminated in steps, some rows that have the same columns at a time.
typedef struct nmm_order {
    int n_step;
    int *row;     // [n_row] row eliminated k-th
    int *size;    // [n_row] of which n_step are in use: rows of a step
    int *n_below; // [n_row] the same: rows left that a step changes
    int *parent;  // [n_row] the same: later step that has or changes all of those, -1: none
} nmm_order;

/// Scratch, zero before first use; it is kept, so that orders of like size need no memory.
typedef struct nmm_order_room {
    int *row, *list;
    int row_capacity, list_capacity;
} nmm_order_room;

void nmm_order_release(nmm_context *context, nmm_order_room *room);

/// By approximate minimum degree, into arrays of the caller. The pattern is as in nmm_bsr: both
/// halves, diagonal present. The same pattern gives the same order. NMM_ERROR_MEMORY.
nmm_status nmm_order_find(nmm_context *context, nmm_order_room *room, int n_row,
                          const int *row_start, const int *col, const nmm_stages *stages,
                          nmm_order *order);

#endif
