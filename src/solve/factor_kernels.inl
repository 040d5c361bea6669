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

#include "factor_make.inl"

#include "factor_apply.inl"

const nmm_factor_kernels KERNELS = {.make = make_factor, .apply = apply_factor};
