// SPDX-License-Identifier: MIT
//
// The faster way of late; the other one is tried again now and then, because machines change.

#include "pace.h"

// Solves between two tries of the slower way, and where it is much slower.
#define TRY_AGAIN 64
#define TRY_SELDOM 512
#define MUCH_SLOWER 2

// Iterations that everything before and after them is worth.
#define FRAME 10

bool nmm_pace_shares(nmm_pace *pace) {
    const double *seconds = pace->seconds;
    pace->solves += 1;
    if (seconds[1] == 0) return true;
    if (seconds[0] == 0) return false;
    const bool shares = seconds[1] < seconds[0];
    const double ratio = shares ? seconds[0] / seconds[1] : seconds[1] / seconds[0];
    const bool again = pace->solves % (ratio < MUCH_SLOWER ? TRY_AGAIN : TRY_SELDOM) == 0;
    return again ? !shares : shares;
}

void nmm_pace_note(nmm_pace *pace, bool shared, int iterations, double seconds) {
    double *known = &pace->seconds[shared];
    const double now = seconds / (iterations + FRAME);
    *known = *known > 0 ? 0.75 * *known + 0.25 * now : now;
}
