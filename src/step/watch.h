// SPDX-License-Identifier: MIT
//
// The watch of the energy ledger: eq. (4.18) to (4.20) of docs/theory/4-time.md. A run whose energy
// comes from nowhere, or whose equations were not solved, says so itself.

#ifndef NMM_WATCH_H
#define NMM_WATCH_H

/// Energy from nowhere, and the residual, over the largest energy of any term, that are let pass.
#define NMM_GAIN_LIMIT 0.02
#define NMM_RESIDUAL_LIMIT 1e-5

/// What the scheme lost in a step by the three brackets of eq. (4.10) [J]; negative: gained.
typedef struct nmm_losses {
    double elements, contacts, supports;
} nmm_losses;

/// Where energy from nowhere comes from.
typedef enum nmm_gainer { NMM_GAIN_ELEMENTS, NMM_GAIN_CONTACTS, NMM_GAIN_SUPPORTS } nmm_gainer;

typedef struct nmm_watch {
    double force;      // [N] what rounding leaves of forces
    double way;        // [m] of the fastest point, summed over the steps
    double lost;       // [J] largest numerical so far
    double step_gain;  // [J] largest gain of a step whose place was asked for
    nmm_gainer gainer; // of that step
    char place[160];   // the same, in words; may be empty
} nmm_watch;

#endif
