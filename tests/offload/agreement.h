// SPDX-License-Identifier: MIT
//
// The same solves on two backends, compared in every bit of solution and report.

#ifndef NMM_TEST_AGREEMENT_H
#define NMM_TEST_AGREEMENT_H

#include "solve.h"

/// Runs all cases on host and target; returns how many differ, and prints the first lines of
/// what differs when `loud`. `context` of the target's memory may have its own hook.
int test_agreement(nmm_context *context, bool loud);

/// Solves compared by test_agreement.
int test_agreement_cases(void);

#endif
