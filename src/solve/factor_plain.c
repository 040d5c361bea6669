// SPDX-License-Identifier: MIT
//
// The numbers of a factor on any x86-64.

#define KERNELS nmm_factor_plain
#include "factor_kernels.inl"
