// SPDX-License-Identifier: MIT
//
// The same solves on two backends, compared in every bit of solution and report.

#ifndef NMM_TEST_AGREEMENT_H
#define NMM_TEST_AGREEMENT_H

#include "solve.h"

/// What is compared.
typedef struct agreement {
    bool launches;   // the target sends each kernel off alone, whatever the size
    bool loud;       // print a line for each case
    bool stop_early; // end at the first case that differs
} agreement;

/// Runs all cases on host and target; returns how many differ. `context` of the target's memory may
/// have its own hook.
int test_agreement(nmm_context *context, const agreement *how);

/// The solutions of all cases on the host alone, as a hash.
uint64_t test_host_hash(void);

/// Solves compared by test_agreement.
int test_agreement_cases(void);

#endif
