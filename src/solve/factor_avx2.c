// SPDX-License-Identifier: MIT
//
// The numbers of a factor on those with AVX2.

#define KERNELS nmm_factor_avx2
#include "factor_kernels.inl"
