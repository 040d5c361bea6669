// SPDX-License-Identifier: MIT
//
// The Jacobi family on one thread of any x86-64.

#define VARIANT nmm_variant_serial
#include "jacobi_host.inl"
