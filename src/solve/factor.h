// SPDX-License-Identifier: MIT
//
// Sparse Cholesky factor of a matrix of 2x2 blocks, K = L L^T in an order of its own, by the
// multifrontal method: rows that are eliminated one after the other and have nearly the same
// columns form a front, a small dense matrix. Order, fronts and all places are found once for a
// pattern; numbers are then made without a search and without an allocation. Threads take whole
// subtrees of fronts and fronts above them, then share those at the top. Each number is one sum in
// an order that fronts alone decide: the same bits on any number of threads, with and without AVX2.

#ifndef NMM_FACTOR_H
#define NMM_FACTOR_H

#include "order.h"
#include "pool.h"
#include "solve.h"
#include "team.h"

/// Rows from which on nested dissection comes before minimum degree, where places are known.
#define NMM_ROWS_TO_CUT 12000

/// Nanoseconds of making a front that is not worth sharing.
#define NMM_SMALL_FRONT 20000.0

/// Pivots first .. first + n_pivot - 1 in order of elimination, which are block rows, and n_row
/// rows below them that they change. The pivots' columns lie in factor->value by columns, pivots
/// first, the rest of the front, n_row by n_row, on a stack until the parent takes it.
/// Numbers of rows are even multiples of 2 unknowns: rows below are filled up to `padded`.
typedef struct nmm_front {
    int first, n_pivot, n_row;
    int padded;         // unknowns below the pivots, a multiple of 4
    int stride;         // numbers from one column to the next, of the pivots
    int parent;         // front that takes the rest, -1: none
    int child, sibling; // first child; next child of its parent; -1: none
    int row;            // first of its n_row numbers in factor->row and factor->place
    int entry, n_entry; // its blocks of K in factor->entry
    int part;           // of the factor, -1: threads share the front
    bool kept;          // what is left is for another thread: `rest` counts from the first stack
    long column;        // first number in factor->value
    // First number of what is left of the matrix, of a vector, in its stack of these. Of a matrix
    // that a part leaves for another one it is known once the front is made.
    long rest[2];
} nmm_front;

/// Fronts first .. end - 1 are for one thread: whole subtrees, or one front above others.
typedef struct nmm_factor_part {
    int first, end;
    int above;   // the part that takes what is left, -1: fronts that threads share, or none
    int n_below; // parts that leave something for this one
    double work;
    double path; // work from its beginning until only shared fronts are left
} nmm_factor_part;

/// A block of K on its way into a front.
typedef struct nmm_front_entry {
    int block, at; // in K; of its first number from the front's first column
} nmm_front_entry;

/// What is left of fronts until their parents take it: first what threads share, `n_top` numbers of
/// fronts that all of them make and then what passes from part to part; then a stack for each
/// thread.
typedef struct nmm_factor_stack {
    double *number;
    long capacity, n_top, n_kept, n_own;
} nmm_factor_stack;

typedef struct nmm_factor {
    int n_row, n_block;
    int *row_start, *col; // the pattern it was analysed for
    int *order, *rank;    // [n_row] row eliminated k-th; its inverse
    int n_front;
    nmm_front *front;       // [n_front] children before parents
    int *row;               // rows below pivots, in order of elimination, ascending
    int *place;             // the same as block rows of the parent's front
    int *run;               // of how many from here on the places follow one another
    nmm_front_entry *entry; // [(n_block + n_row) / 2]
    double *value;          // [n_value] columns of L, with inverses on the diagonal
    double *x;              // [n_row][2] a vector in order of elimination
    nmm_team *team;         // threads at work
    long n_value;
    // How `n_thread` threads share the work: the parts, longer paths first, then fronts `top`
    // together.
    int n_thread, n_part, n_top;
    nmm_factor_part *part;
    // [2][n_part] on the way up: parts below that are not done; on the way back: 0. Below 0: taken.
    atomic_int *part_state;
    int *top;
    // The same fronts in rounds for the solution: those of a round need only rounds before.
    int n_round;
    int *round_front, *round_start; // [n_top], [n_round + 1], behind `top`
    double time;                    // [ns] of making the numbers then
    nmm_factor_stack stack[2];      // for matrices, for vectors
    nmm_pool pool;                  // places of matrices that pass from part to part
    double n_number;                // numbers of L that may differ from zero, without padding
    double work;                    // [ns] of making the numbers, by count of operations
    int *tree;                      // scratch of the analysis
    nmm_dissect_room stage_room;
    nmm_order_room room;
    // What there is room for.
    int row_capacity, col_capacity, entry_capacity, list_capacity, place_capacity, run_capacity;
    int tree_capacity;
    int part_capacity, state_capacity, top_capacity;
    long value_capacity;
} nmm_factor;

/// Order and fronts for the pattern of K; nothing to do when it is the one known. Checks no
/// pattern. `place` [n_row][2]: where rows are, finite; NULL: not known, which makes factors of
/// large systems larger. NMM_ERROR_MEMORY: the factor is without a pattern.
nmm_status nmm_factor_analyse(nmm_context *context, nmm_factor *factor, const nmm_bsr *K,
                              const double *place);
void nmm_factor_destroy(nmm_context *context, nmm_factor *factor);

/// Is the pattern the one analysed?
bool nmm_factor_knows(const nmm_factor *factor, const nmm_bsr *K);

/// Room for the numbers of the pattern analysed, and shares for this many threads.
/// NMM_ERROR_MEMORY.
nmm_status nmm_factor_reserve(nmm_context *context, nmm_factor *factor, int n_thread);

/// What takes time, in the same text, compiled for any x86-64, for those with AVX2 and for those
/// with AVX-512. The same bits. Uses the threads of nmm_factor_reserve.
typedef struct nmm_factor_kernels {
    /// The numbers of the factor for those of K, whose pattern was analysed, and which has room;
    /// row of K whose pivot is the first that is not positive, -1: none.
    int (*make)(nmm_factor *factor, const double *value);
    /// z = K^-1 r by the factor; both [n_row][2].
    void (*apply)(const nmm_factor *factor, const double *r, double *z);
    /// Both, with half of the solution on the way, while the factor is in a cache.
    int (*solve)(nmm_factor *factor, const double *value, const double *r, double *z);
} nmm_factor_kernels;

extern const nmm_factor_kernels nmm_factor_plain, nmm_factor_avx2, nmm_factor_avx512;

/// Those for this processor.
const nmm_factor_kernels *nmm_factor_fastest(void);

/// Nanoseconds to assemble a front of so many block rows and to eliminate its pivots, on one core.
double nmm_front_work(int n_pivot, int n_row);

/// Numbers that are left of a front: of the matrix, 0, or of a vector, 1.
static inline long nmm_front_rest(const nmm_front *front, int kind) {
    return kind == 0 ? (long)front->padded * front->padded : front->padded;
}

/// What each of `n_thread` threads does, and where on the stack. NMM_ERROR_MEMORY.
nmm_status nmm_factor_share(nmm_context *context, nmm_factor *factor, int n_thread);

#endif
