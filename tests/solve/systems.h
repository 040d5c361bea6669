// SPDX-License-Identifier: MIT
//
// Systems for the solver's tests: what steps of the manifold method look like, made without it, and
// a slow reference. Rows of square rock blocks of triangles, each block apart from its neighbours,
// joined by stiff springs between a vertex and an edge; mass for a given Courant number.

#ifndef NMM_TEST_SYSTEMS_H
#define NMM_TEST_SYSTEMS_H

#include "solve.h"

/// Block (row, col) += value, before the matrix is put together.
typedef struct triplet {
    int row, col;
    double value[4];
} triplet;

typedef struct triplets {
    triplet *item;
    int n, capacity;
} triplets;

typedef struct rock {
    int n_across, n_up; // blocks of the wall
    int n_node;         // nodes along a block's side
    double courant;     // c_p dt / h; 0: no mass
    bool lumped;        // mass matrix
    double spring;      // contact springs as a multiple of Young's modulus, 0: none
    uint64_t seed;      // right-hand side, and which contacts lock, slide or are open
} rock;

/// The system of a wall of blocks held at its foot. K and f belong to the caller:
/// test_system_destroy.
typedef struct test_system {
    nmm_bsr K;
    double *f; // [n_row][2]
    int n_block;
} test_system;

void triplets_add(nmm_context *context, triplets *list, int row, int col, const double value[4]);
/// Sorts, adds up equal places; every diagonal block is there afterwards.
void test_system_build(nmm_context *context, test_system *system, triplets *list, int n_row);
void test_system_rock(nmm_context *context, test_system *system, const rock *wall);
/// Seeded symmetric positive definite matrix with strong diagonal, columns at random.
void test_system_random(nmm_context *context, test_system *system, int n_row, int per_row,
                        uint64_t seed);
/// A wall of blocks of 5 x 5 nodes with stiff springs.
void test_system_wall(nmm_context *context, test_system *system, int n_across, int n_up,
                      double courant);
/// The graph of n_side^2 rows joined to their neighbours across and up.
void test_system_grid(nmm_context *context, test_system *system, int n_side);
/// Rows 0 .. n_row - 1 of 1 on the diagonal, joined by `coupling` to row `middle` alone.
void test_system_star(nmm_context *context, test_system *system, int n_row, int middle,
                      double coupling);
/// Lumps of `size` rows that are joined to each other, and `n_middle` rows joined to
/// all, but each of the first ones not to one lump.
void test_system_lumps(nmm_context *context, test_system *system, int n_lump, int size,
                       int n_middle);
/// Springs of stiffness 1 from row to row. The last row is free, the first held by one more, or
/// not.
void test_system_chain(nmm_context *context, test_system *system, int n_row, bool held);
void test_system_destroy(nmm_context *context, test_system *system);
/// Replace K by S K S, f by S f with S = diag(scale[2 * row + i]).
void test_system_scale(test_system *system, const double *scale);

/// u = K^-1 f by elimination with pivoting on the dense matrix.
void test_dense_solve(nmm_context *context, const test_system *system, double *u);
/// Does this processor run the variants for AVX2?
bool test_has_avx2(void);
/// |f - K u| / |f|, summed in long double.
double test_true_residual(const test_system *system, const double *u);

#endif
