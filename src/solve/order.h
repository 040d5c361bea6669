// SPDX-License-Identifier: MIT
//
// An elimination order that keeps the factor of a sparse symmetric matrix small.

#ifndef NMM_ORDER_H
#define NMM_ORDER_H

#include "base.h"

/// order[k], k < n_row: the row to eliminate k-th, by approximate minimum degree. The pattern is as
/// in nmm_bsr: both halves, diagonal present. The same pattern gives the same order.
/// NMM_ERROR_MEMORY.
nmm_status nmm_order_find(nmm_context *context, int n_row, const int *row_start, const int *col,
                          int *order);

#endif
