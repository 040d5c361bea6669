// SPDX-License-Identifier: MIT
//
// The faster way of late; the other one is tried again now and then, because machines change.

#include "pace.h"

// Solves between two tries of the slower way, and where it is much slower.
#define TRY_AGAIN 64
#define TRY_SELDOM 512
#define MUCH_SLOWER 2

// Solves that each way has before the paces are compared: the first one with threads makes them.
#define TRIES_SERIAL 1
#define TRIES_SHARED 2

// Iterations that everything before and after them is worth.
#define FRAME 10

bool nmm_pace_shares(nmm_pace *pace) {
    const double *seconds = pace->seconds;
    pace->solves += 1;
    if (pace->tried[1] < TRIES_SHARED) return true;
    if (pace->tried[0] < TRIES_SERIAL) return false;
    const bool shares = seconds[1] < seconds[0];
    const double ratio = shares ? seconds[0] / seconds[1] : seconds[1] / seconds[0];
    const bool again = pace->solves % (ratio < MUCH_SLOWER ? TRY_AGAIN : TRY_SELDOM) == 0;
    return again ? !shares : shares;
}

void nmm_pace_note(nmm_pace *pace, bool shared, int iterations, double seconds) {
    double *known = &pace->seconds[shared];
    const double now = seconds / (iterations + FRAME);
    // Quickly down, slowly up: what disturbs a solve only makes it slower.
    const bool better = pace->tried[shared] == 0 || now < *known;
    *known = better ? now : 0.8 * *known + 0.2 * now;
    pace->tried[shared] += pace->tried[shared] < TRIES_SHARED;
}
