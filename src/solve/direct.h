// SPDX-License-Identifier: MIT
//
// Inside of the solve floor: the direct method, a sparse Cholesky factor. The factor is kept in the
// solver; where the next matrix differs little the old factor leads conjugate gradients to its
// solution, and a new one is made only when iterations cost more. The true residual decides as for
// every other method.

#ifndef NMM_DIRECT_H
#define NMM_DIRECT_H

#include "solver.h"

/// A prepared solver: start, factorise as far as needed, solve, finish. u as in nmm_solve_backend.
/// Trouble with the system ends with a report: INDEFINITE with the row of the pivot that is not
/// positive, STAGNATED, TOO_SLOW. NMM_ERROR_MEMORY.
nmm_status nmm_direct_solve(nmm_context *context, nmm_solver *solver, const nmm_bsr *K,
                            const double *f, double *u, nmm_solve_report *report);

/// Nanoseconds of one core of about 3 GHz that a solve with a new factor takes, by sizes alone;
/// where the pattern is not known yet, an estimate. `solver` may be NULL. *analysis: the same for
/// what is found once for a pattern, 0 where it is known.
double nmm_direct_work(const nmm_solver *solver, const nmm_bsr *K, double *analysis);

/// Release the factor; *direct becomes NULL. NULL inside is accepted.
void nmm_direct_destroy(nmm_context *context, struct nmm_direct **direct);

#endif
