// SPDX-License-Identifier: MIT
//
// The direct method in a build without SuiteSparse: it says so. Nothing else takes its place
// unasked. What is here has the same interface as direct.c.

#include "direct.h"

bool nmm_solve_has_direct(void) {
    return false;
}

nmm_status nmm_direct_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report) {
    (void)solver;
    (void)K;
    (void)f;
    (void)u;
    (void)report;
    return nmm_fail(context, NMM_ERROR_ARGUMENT,
                    "the direct method needs SuiteSparse, which this build is without");
}

void nmm_direct_destroy(nmm_context *context, struct nmm_direct **direct) {
    (void)context;
    NMM_ASSERT(*direct == NULL);
    *direct = NULL;
}
