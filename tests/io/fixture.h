// SPDX-License-Identifier: MIT
//
// A simulation made by hand for the tests of run files and pictures: a block of triangles that
// carries two loose blocks of one polygon each, moved by formulas instead of mechanics, with
// contacts whose number changes from step to step.

#ifndef NMM_TEST_FIXTURE_H
#define NMM_TEST_FIXTURE_H

#include "step.h"

/// How the loose blocks and the far corner of the large one move: d = speed * t.
typedef struct fixture {
    nmm_sim *sim;
    double speed; // [m/s]
} fixture;

/// nx * ny cells of two triangles. All memory is of sim->context.
void fixture_create(fixture *f, int nx, int ny);
/// One step of `dt`: moves, stresses, contacts, ledger.
void fixture_step(fixture *f, double dt, nmm_step_report *report);
void fixture_destroy(fixture *f);

/// A path in the test's own folder (made on first use, below TMPDIR or /tmp).
const char *fixture_path(char path[512], const char *name);
/// Remove the folder with everything in it; takes and returns what the end of a test group does.
int fixture_clean(void **unused);

#endif
