// SPDX-License-Identifier: MIT
//
// The Jacobi family on several threads of any x86-64.

#define THREADS
#define VARIANT nmm_variant_threads
#include "jacobi_host.inl"
