// SPDX-License-Identifier: MIT
//
// Sweeps by lumps on those with AVX2.

#define KERNELS nmm_lumps_avx2
#include "lumps_kernels.inl"
