// SPDX-License-Identifier: MIT
//
// One thread or several? Answers are the same bits for any number of threads, so here, and only
// here, the clock may decide: on busy cores threads that wait for each other can be many times
// slower than one.

#ifndef NMM_PACE_H
#define NMM_PACE_H

#include "base.h"

/// Seconds an iteration has taken lately: [0] on one thread, [1] on all; 0: not known.
typedef struct nmm_pace {
    double seconds[2];
    int tried[2];
    int since; // solves since the slower way was tried
    int tries; // of the slower way since it is that; those of a much slower one count twice
} nmm_pace;

/// Shall the next solve use all threads?
bool nmm_pace_shares(nmm_pace *pace);

/// A solve took that long.
void nmm_pace_note(nmm_pace *pace, bool shared, int iterations, double seconds);

#endif
