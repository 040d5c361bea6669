// SPDX-License-Identifier: MIT
//
// One linear system by itself: written out of a run, read from Matrix Market files or generated,
// solved by any method of src/solve. The functions for users are in include/nmm/nmm.h.

#ifndef NMM_LINEAR_H
#define NMM_LINEAR_H

#include "matrix_market.h"
#include "solve.h"

/// A system of `order` equations in 2x2 blocks. Where the order is odd, the last block holds one
/// more unknown, which nothing touches: diagonal 1, load 0.
typedef struct nmm_linear {
    int order;
    long entries;  // of the matrix, both halves
    nmm_bsr K;     // owned
    double *f;     // [K.n_row][2]
    double *guess; // [K.n_row][2] or NULL: zeros
    double *u;     // [K.n_row][2] solution
    double *place; // [K.n_row][2] m, or NULL: not known
    int *body;     // [K.n_row] or NULL
} nmm_linear;

void nmm_linear_destroy(nmm_context *context, nmm_linear *system);

/// The matrix of a file, with both halves and a symmetric pattern. NMM_ERROR_INPUT: an entry given
/// twice, or a matrix that is not symmetric: the first row and column that differ are named.
nmm_status nmm_linear_read_matrix(nmm_context *context, nmm_linear *system, const char *path);

/// A square plate of rock of about `order` unknowns in a step: linear triangles in plane strain,
/// lumped mass at Courant number 10; with places and bodies. For measurements.
nmm_status nmm_linear_generate(nmm_context *context, nmm_linear *system, int order);

/// K as a file: symmetric where both halves are equal in every bit, else general.
nmm_status nmm_linear_write_matrix(nmm_context *context, const nmm_bsr *K, const char *path,
                                   const char *comment);

/// n numbers as a file.
nmm_status nmm_linear_write_vector(nmm_context *context, int n, const double *x, const char *path,
                                   const char *comment);

#endif
