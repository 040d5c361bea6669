// SPDX-License-Identifier: MIT
//
// From which size on the target pays: solves of generated systems, each four times the size of the
// one before, by pcg on host and target and by what the host would choose. A solve that fails ends
// the ladder and is told.

#ifndef NMM_CLI_LADDER_H
#define NMM_CLI_LADDER_H

#include "json.h"

#include <stdbool.h>

/// Whole solves of a rung: the same one on both sides, and what the host would choose.
enum { HOST_PCG, TARGET_PCG, HOST_AUTO, RUNNERS };
enum { RUNGS = 6 };

/// One size of the ladder.
typedef struct rung {
    int unknowns, iterations; // of pcg
    double seconds[RUNNERS];
    char best[40]; // what the host chose
} rung;

/// Unknowns from which on the target is faster; 0: not found. Estimated: between or beyond the
/// sizes measured.
typedef struct break_even {
    double unknowns;
    bool is_estimated;
} break_even;

typedef struct ladder {
    int n_rung;
    rung rung[RUNGS];
    break_even against_pcg, against_auto;
    int status;          // exit status; not 0: a solve failed, and the ladder ended there
    int failed_unknowns; // of that solve
    const char *failed;  // "target pcg", ...
    char reason[200];
} ladder;

void ladder_climb(ladder *l, int n_thread);

void ladder_print(const ladder *l);
/// The part "break_even".
void ladder_json(const ladder *l, json *out);

#endif
