// SPDX-License-Identifier: MIT
//
// Nested dissection by places: the rows are cut in two by a straight line, the rows on one side of
// it that are joined to the other come last, and so on with the two halves. What is left is small
// for large systems in the plane, and the two halves can be eliminated at the same time.
// George, SIAM J. Numer. Anal. 10 (1973) 345.

#ifndef NMM_DISSECT_H
#define NMM_DISSECT_H

#include "base.h"

/// Stages are sets of rows that are eliminated one after the other.
typedef struct nmm_stages {
    int n;
    int *start; // [n + 1] first of a stage in `row`
    int *row;   // [n_row]
} nmm_stages;

/// Scratch and result, zero before first use; it is kept.
typedef struct nmm_dissect_room {
    int *number;
    int capacity;
} nmm_dissect_room;

void nmm_dissect_release(nmm_context *context, nmm_dissect_room *room);

/// Stages of a pattern as in nmm_bsr, whose rows are at `place` [n_row][2]; they lie in `room`. The
/// same pattern and places give the same stages. NMM_ERROR_MEMORY.
nmm_status nmm_dissect(nmm_context *context, nmm_dissect_room *room, int n_row,
                       const int *row_start, const int *col, const double *place,
                       nmm_stages *stages);

#endif
