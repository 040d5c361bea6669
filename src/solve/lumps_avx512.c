// SPDX-License-Identifier: MIT
//
// Sweeps by lumps on those with AVX-512.

#define KERNELS nmm_lumps_avx512
#include "lumps_kernels.inl"
