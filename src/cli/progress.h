// SPDX-License-Identifier: MIT
//
// One line that is rewritten in place on a terminal; nothing at all where there is none.

#ifndef NMM_CLI_PROGRESS_H
#define NMM_CLI_PROGRESS_H

#include "nmm/study.h"

#include <stdbool.h>

typedef struct progress {
    bool shown;      // there is a terminal and the user did not ask for quiet
    double end_time; // [s] of the scene; 0: it has none
    double started;  // clock
    double drawn;    // clock when last drawn
} progress;

progress progress_start(double end_time, bool quiet);
/// After each step; draws at most ten times a second.
void progress_step(progress *line, const nmm_step_report *report);
/// What an experiment measures now; `user` is the line. Not 0 once the user has asked for an end.
int progress_measuring(void *user, const nmm_bench *bench, const char *what, int row);
/// Wipe the line, so that other text may follow.
void progress_clear(const progress *line);

/// Seconds on a clock that never goes back.
double clock_seconds(void);

#endif
