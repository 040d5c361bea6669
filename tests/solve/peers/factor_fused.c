// SPDX-License-Identifier: MIT
//
// The numbers of a factor with AVX-512 as in the program, but multiply and add fused: other bits
// than on other machines. Only to measure what the same bits everywhere cost.

#define KERNELS nmm_factor_fused
#include "factor_kernels.inl"
