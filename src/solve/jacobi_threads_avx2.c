// SPDX-License-Identifier: MIT
//
// The Jacobi family on several threads of x86-64 with AVX2 (compiler flags: src/CMakeLists.txt).

#define THREADS
#define VARIANT nmm_variant_threads_avx2
#include "jacobi_host.inl"
