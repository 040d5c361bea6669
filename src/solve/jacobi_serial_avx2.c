// SPDX-License-Identifier: MIT
//
// The Jacobi family on one thread of x86-64 with AVX2 (compiler flags: src/CMakeLists.txt).

#define VARIANT nmm_variant_serial_avx2
#include "jacobi_host.inl"
