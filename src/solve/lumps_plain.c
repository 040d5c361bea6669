// SPDX-License-Identifier: MIT
//
// Sweeps by lumps on any x86-64.

#define KERNELS nmm_lumps_plain
#include "lumps_kernels.inl"
