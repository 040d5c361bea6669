// SPDX-License-Identifier: MIT
//
// Inside of the solve floor: Gauss-Seidel sweeps over bodies with three rows each, one cover of
// order 1, in float32. The matrix is copied into blocks of 6x6, those before and those behind the
// diagonal apart, each unknown scaled by a power of two so that the diagonal is 0.5 .. 4: no number
// is too large for float32 then. Lumps are in an order of waves: one comes after all those with
// which it has a block and which come before it in the matrix, so that sweeps are those of the
// matrix, but neighbours in the order seldom wait for each other. The terms of a coupling go into
// the blocks, so that sweeps are those of the unsymmetric matrix.

#ifndef NMM_LUMPS_H
#define NMM_LUMPS_H

#include "solve.h"

/// What the last take found of the diagonal block of a lump: two that are other ones, or one that
/// has other scales, change the blocks beside them.
typedef enum nmm_lump_change { NMM_LUMP_SAME, NMM_LUMP_OTHER, NMM_LUMP_RESCALED } nmm_lump_change;

/// Vectors are [n][8]: six numbers and two zeros for each lump, in the order of the waves.
typedef struct nmm_lumps {
    int n;
    int capacity, block_capacity, term_capacity;
    int *order; // [n] lump of the matrix
    int *place; // [n] of a lump of the matrix; scratch behind it
    // The blocks of lump i in the order in which sweeps need them, at these places: those before
    // start[i] .. start[i + 1] - 1; those behind, from the last lump on, start[i + 1] .. start[i]
    // - 1.
    int *before_start, *behind_start; // [n + 1]
    int *before, *behind;
    float *before_value, *behind_value; // [..][6][8] by columns
    float *inverse;                     // [n][6][8] of the diagonal blocks
    double *scale;                      // [n][8] of the unknowns; 0: nothing was taken
    double *own;                        // [n][6][8] diagonal blocks that were taken, with terms
    nmm_lump_change *changed;           // [n]
    // The coupling: each term has two halves of three rows.
    int n_term;
    int *half;  // [n_term][2] lump; -1: all zero
    int *first; // [n] half of a lump; -1: none
    int *next;  // [n_term][2] the next half of the same lump; -1: none
    int *cross; // [n_term][2] place of the block of this half's rows and the other's columns
    bool known; // the pattern is one of lumps
} nmm_lumps;

void nmm_lumps_destroy(nmm_context *context, nmm_lumps *lumps);

/// Are the rows of K those of bodies with three rows each, with all blocks between these, and with
/// the same columns? body[row]: >= 0. Then the order of the waves and the places of the blocks.
nmm_status nmm_lumps_find(nmm_context *context, nmm_lumps *lumps, const nmm_bsr *K,
                          const int *body);

/// Where the terms go, before the numbers are taken; *fit is false where one has other rows than
/// those of two lumps with a block between them.
nmm_status nmm_lumps_couple(nmm_context *context, nmm_lumps *lumps, const nmm_coupling *coupling,
                            bool *fit);

typedef struct nmm_lumps_kernels {
    /// Takes the numbers, and those of the terms; false: a diagonal block is not positive definite,
    /// or one with terms has a pivot that is next to nothing.
    bool (*take)(nmm_lumps *lumps, const nmm_bsr *K, const nmm_coupling *coupling);
    /// Forces x [n_row][2] over the largest of them, scaled, which is returned; and displacements y
    /// times a factor, added to x.
    double (*load)(const nmm_lumps *lumps, const double *x, float *y);
    void (*add)(const nmm_lumps *lumps, const float *y, double factor, double *x);
    /// The residual of the matrix itself, wide.r = f - K u - extra.
    void (*residual)(const nmm_solver *solver, const double *extra);
    /// t = (D + U)^-1 D v.
    void (*backward)(const nmm_lumps *lumps, const float *v, float *t);
    /// y = (D + L)^-1 K t for t = (D + U)^-1 D v; `ahead` becomes y - t.
    void (*forward)(const nmm_lumps *lumps, const float *v, const float *t, float *ahead, float *y);
    /// y = (D + L)^-1 x.
    void (*begin)(const nmm_lumps *lumps, const float *x, float *y);
    /// Takes the m directions of n numbers out of w, part[j] of each; the length of what is left.
    double (*orthogonalise)(const float *basis, int m, long n, float *w, double *part);
    /// x *= factor; y = sum of m directions, part[j] of each.
    void (*scale)(float *x, long n, double factor);
    void (*combine)(const float *basis, int m, long n, const double *part, float *y);
} nmm_lumps_kernels;

extern const nmm_lumps_kernels nmm_lumps_plain, nmm_lumps_avx2, nmm_lumps_avx512;

/// Those for this processor; the same bits.
const nmm_lumps_kernels *nmm_lumps_fastest(void);

#endif
