// SPDX-License-Identifier: MIT
//
// The faster way of late. The other one is tried again, soon after a change, in case that was a
// mistake, then less and less often: what disturbs a few solves must not decide for the next
// hundred.

#include "pace.h"

// Solves between two tries of the slower way: at first, doubled with each, at most; and at most
// where it is much slower, doubled twice.
#define TRY_SOON 4
#define TRY_AGAIN 64
#define TRY_SELDOM 512
#define MUCH_SLOWER 2
#define MOST_DOUBLED 7

// Solves that each way has before the paces are compared: the first one with threads makes them.
#define TRIES_SERIAL 1
#define TRIES_SHARED 2

// Iterations that everything before and after them is worth.
#define FRAME 10

static bool is_faster_shared(const nmm_pace *pace) {
    return pace->seconds[1] < pace->seconds[0];
}

bool nmm_pace_shares(nmm_pace *pace) {
    if (pace->tried[1] < TRIES_SHARED) return true;
    if (pace->tried[0] < TRIES_SERIAL) return false;
    const double *seconds = pace->seconds;
    const bool shares = is_faster_shared(pace);
    const bool much = seconds[shares ? 0 : 1] > MUCH_SLOWER * seconds[shares ? 1 : 0];
    const int patience = TRY_SOON << nmm_min_int(pace->tries, MOST_DOUBLED);
    if (++pace->since < nmm_min_int(patience, much ? TRY_SELDOM : TRY_AGAIN)) return shares;
    pace->since = 0;
    pace->tries = nmm_min_int(pace->tries + (much ? 2 : 1), MOST_DOUBLED);
    return !shares;
}

void nmm_pace_note(nmm_pace *pace, bool shared, int iterations, double seconds) {
    double *known = &pace->seconds[shared];
    const bool shares = is_faster_shared(pace);
    const double now = seconds / (iterations + FRAME);
    // Quickly down, slowly up: what disturbs a solve only makes it slower.
    const bool better = pace->tried[shared] == 0 || now < *known;
    *known = better ? now : 0.8 * *known + 0.2 * now;
    pace->tried[shared] += pace->tried[shared] < TRIES_SHARED;
    if (is_faster_shared(pace) != shares) pace->since = pace->tries = 0;
}
