// SPDX-License-Identifier: MIT
//
// A run as text for people and as JSON for programs. Used after a run and for a run file.

#ifndef NMM_CLI_REPORT_H
#define NMM_CLI_REPORT_H

#include "json.h"
#include "nmm/nmm.h"

/// A run to be reported. `reading` gives monitor k, from the simulation or from the file.
typedef struct run_report {
    const char *scene; // file name or title
    const char *path;  // of the run file
    nmm_summary summary;
    int n_frame; // -1: not known
    int n_monitor;
    nmm_status (*reading)(const struct run_report *report, int k, nmm_reading *reading);
    void *source; // for `reading`
} run_report;

/// As nmm_end_name; a run without a recorded end counts as interrupted.
const char *end_name(nmm_end end);

/// "10 steps to 0.01 s"; statics have no time: "6 steps to equilibrium", "6 steps" before it.
enum { REACHED_LENGTH = 64 };
void reached(char text[REACHED_LENGTH], const nmm_summary *summary);

void report_print(const run_report *report);
void report_json(const run_report *report);

/// The parts "phase_seconds" and "solver" of that object.
void json_phases(json *out, const nmm_summary *summary);
void json_solver(json *out, const nmm_summary *summary);

#endif
