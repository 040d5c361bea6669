// SPDX-License-Identifier: MIT
//
// Weights of Jacobi and Chebyshev sweeps, and what their progress tells about the spectrum.

#ifndef NMM_SWEEPS_H
#define NMM_SWEEPS_H

#include "base.h"

/// A run of sweeps.
typedef struct sweeps {
    bool chebyshev;
    double damping;   // of jacobi
    double bounds[2]; // of the spectrum of D^-1 K; 0: not estimated
    double rho;       // of Chebyshev's recursion; 0 before the first sweep
    double began;     // r.D^-1 r when the recursion began
    int n_since;      // sweeps since then
    double lowest;    // smallest r.D^-1 r so far
    double largest;   // r.D^-1 r beyond which there is no way back
    double least;     // smallest residual so far
    double mark;      // residual when the window of sweeps that is watched began
    bool gained;      // in it: a new least residual, for a fixed damping a new `lowest`
    int n_window;     // sweeps in it
    int n_idle;       // windows in a row that gained nothing
    int n_still;      // windows in a row that changed nothing
} sweeps;

/// Begin, with the residual norm and r.D^-1 r of the first iterate.
void plan_start(sweeps *plan, double norm, double weighted);

/// Weights {old direction, D^-1 r} of the next n sweeps.
void plan_batch(sweeps *plan, int n, double (*weight)[2]);

/// DOUBT: nothing is gained, by rounding or because parts of the residual swing slowly.
typedef enum sweeps_verdict {
    SWEEPS_GO_ON,
    SWEEPS_DIVERGE,
    SWEEPS_STAGNATE,
    SWEEPS_DOUBT
} sweeps_verdict;

/// Take note of residual norm and r.D^-1 r after a batch. May correct the bounds of Chebyshev and
/// begin anew. Rounding can look like divergence as well: who asks must find out.
sweeps_verdict plan_judge(sweeps *plan, double norm, double weighted);

#endif
