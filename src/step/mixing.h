// SPDX-License-Identifier: MIT
//
// Anderson mixing of the passes of one try. While no contact changes mode a pass is a linear map of
// the places: with friction the matrix lacks the part that is not symmetric, so that each pass
// gains a factor of two to five only. From the changes of the last passes the one is mixed that
// would have left the least: on a linear map as good as GMRES (Walker and Ni, SIAM J. Numer. Anal.
// 49, 2011).

#ifndef NMM_MIXING_H
#define NMM_MIXING_H

#include "base.h"

enum { NMM_MIXING_DEPTH = 4 };

typedef struct nmm_mixing {
    int n;                             // unknowns
    int count, next;                   // differences held, and where the next one goes
    bool begun;                        // `place` and `change` hold a pass
    double *place, *change;            // [n] m, of the pass before
    double *places[NMM_MIXING_DEPTH];  // [n] m, differences of places of passes
    double *changes[NMM_MIXING_DEPTH]; // [n] m, and of their changes
} nmm_mixing;

nmm_status nmm_mixing_open(nmm_context *context, nmm_mixing *mixing, int n);
void nmm_mixing_close(nmm_context *context, nmm_mixing *mixing);

/// Forget all passes.
void nmm_mixing_reset(nmm_mixing *mixing);

/// A pass at `place`, both [n] m, found `change`: takes note of it. With `mix` the change becomes
/// the mixed one; true when it did.
bool nmm_mixing_take(nmm_mixing *mixing, const double *place, double *change, bool mix,
                     int n_thread);

#endif
