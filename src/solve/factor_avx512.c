// SPDX-License-Identifier: MIT
//
// The numbers of a factor on those with AVX-512.

#define KERNELS nmm_factor_avx512
#include "factor_kernels.inl"
