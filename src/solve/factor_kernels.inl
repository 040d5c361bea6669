// SPDX-License-Identifier: MIT
//
// Making a factor and solving with it, in one text that is compiled for any x86-64, for those with
// AVX2 and for those with AVX-512: the includer defines KERNELS, the name of the table of its
// functions. Products and sums are written lane by lane, and nothing is fused: the same bits.

#include "factor.h"

#include <limits.h>
#include <math.h>
#include <string.h>

// As many numbers as a register holds, at any address: larger vectors would not stay in registers.
#ifdef __AVX2__
#define LANE 4
#else
#define LANE 2
#endif
typedef double lane_slot __attribute__((vector_size(8 * LANE), aligned(8), may_alias));
typedef double pair_slot __attribute__((vector_size(16), aligned(8), may_alias));
#define SLOT(at) (*(lane_slot *)(at))
#define SLOT_OF(at) (*(const lane_slot *)(at))
#define PAIR(at) (*(pair_slot *)(at))
#define PAIR_OF(at) (*(const pair_slot *)(at))
#ifdef __AVX512F__
typedef double wide_slot __attribute__((vector_size(64), aligned(8), may_alias));
#endif

// The loops over columns and rows of a tile vanish, so that it stays in registers.
#define UNROLL _Pragma("GCC unroll 4")

static void add_pair(double *to, const double *from) {
    PAIR(to) += PAIR_OF(from);
}

// A thread's stacks: what is not kept for others.
typedef struct own_stacks {
    double *at[2];
} own_stacks;

static own_stacks stacks_of(const nmm_factor *f, int thread) {
    own_stacks own;
    for (int k = 0; k < 2; k++)
        own.at[k] = f->stack[k].number + f->stack[k].n_kept + thread * f->stack[k].n_own;
    return own;
}

// What is left of a front: of the matrix, 0, or of a vector, 1.
static double *rest_of(const nmm_factor *f, const nmm_front *front, const own_stacks *own,
                       int kind) {
    return (front->kept ? f->stack[kind].number : own->at[kind]) + front->rest[kind];
}

#include "factor_apply.inl"

#include "factor_make.inl"

const nmm_factor_kernels KERNELS = {
    .make = make_factor, .apply = apply_factor, .solve = make_and_apply};
