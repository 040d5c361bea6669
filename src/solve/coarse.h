// SPDX-License-Identifier: MIT
//
// Coarse correction: rigid motions of parts of bodies. A body, or a piece of a large one, moves as
// a whole at little cost in energy, and block Jacobi needs many sweeps to notice; three unknowns
// for each part, solved exactly by a skyline Cholesky factor, do it at once.
// docs/theory/6-solve.md.

#ifndef NMM_COARSE_H
#define NMM_COARSE_H

#include "base.h"

/// What the coarse correction is made from: the matrix in the order of the iteration, n rows, some
/// of them empty, and where its rows are.
typedef struct nmm_coarse_source {
    int n, n_thread;
    const int *row_start, *col;
    const double *value;
    const int *order;    // [n] row of the caller, -1: empty
    const double *place; // [rows of the caller][2] m
    const int *body;     // [rows of the caller]
} nmm_coarse_source;

/// Parts 0 .. n_part - 1; unknowns 3 * part + {x, y, turn}. Rows in the order of the iteration.
typedef struct nmm_coarse {
    int n_part;
    int *part;           // [n] part of a row, -1: empty row
    double *arm;         // [n][2] place of a row from the centre of its part, over `length`
    double length;       // [m]
    int *start, *row;    // [n_part + 1], [n] rows by part
    int *first;          // [3 n_part] first column in a row of the factor
    long *offset;        // [3 n_part] factor + offset[i] + j is entry i, j
    double *factor;      // [n_factor] lower triangle by rows, first[i] <= j < i
    float *lower;        // [n_factor] unit * factor in float32, which is what solves read
    double *inverse;     // [3 n_part] of unit * diagonal; 0 for a motion that moves nothing
    double unit;         // a power of two that brings the largest of the diagonal next to 1
    double *load, *move; // [3 n_part]
    long n_factor;
    double work;  // multiplications of a factorisation
    int capacity; // rows there is room for
    long factor_capacity;
    int *rank, *queue; // [n] scratch
} nmm_coarse;

void nmm_coarse_destroy(nmm_context *context, nmm_coarse *coarse);

/// Rows that a part of a large body has about.
double nmm_coarse_rows_of_part(int n_row);

/// Divide the bodies into parts of about equal size and find the pattern of the factor; the values
/// are not looked at.
nmm_status nmm_coarse_divide(nmm_context *context, nmm_coarse *coarse,
                             const nmm_coarse_source *source);

#endif
