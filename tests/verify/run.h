// SPDX-License-Identifier: MIT
//
// Running the scenes of examples/verification and comparing what they give with closed forms.
// Opening a scene prints its name, each comparison one row of its table in docs/verification.md
// (tests/verify/book.py):
//   scene: incline.yaml
//   | quantity | expected | measured | error | tolerance | ok |
// and a test ends with rows_end(), which fails when one of its rows did.

#ifndef NMM_VERIFY_RUN_H
#define NMM_VERIFY_RUN_H

#include "nmm/nmm.h"
#include "test.h"

#include <stdbool.h>

typedef struct run {
    nmm_sim *sim;
    nmm_step_report report; // of the last step
} run;

/// Open a scene of examples/verification: its name, then overrides, then NULL. A scene that does
/// not open fails the test with the library's message.
run run_open(int n_thread, const char *const *scene_and_set);
#define RUN(...) run_open(1, (const char *const[]){__VA_ARGS__, NULL})
void run_close(run *r);

/// Whether the program was given the argument `all`: with the sizes and grids that take long.
bool run_all(void);
/// The main function of a program of tests.
int verify_main(int argc, char **argv, const struct CMUnitTest *test, size_t n);

/// One step; false when the run is complete. Anything else fails the test.
bool run_step(run *r);
/// Steps until `time` or the end.
void run_until(run *r, double time);
void run_to_end(run *r);

nmm_reading run_monitor(const run *r, const char *name);

/// A least-squares fit of a sum of at most 4 functions.
typedef struct fit {
    int n; // functions
    double A[4][4], b[4];
} fit;
/// The functions have the values base[n] where `value` was measured.
void fit_add(fit *f, double weight, const double *base, double value);
/// Their factors.
void fit_solve(fit *f, double *factor);

/// Stress at a place (coordinates of the undeformed scene): a plane through the stresses of the
/// elements within `radius`, each by its area. Second order in the size, where a single element's
/// stress is first order.
void run_stress(const run *r, double x, double y, double radius, double stress[3]);

/// Slope of log |error| over log h by least squares: the observed rate.
double rate_of(int n, const double *h, const double *error);

/// An override from a format; kept until 32 more are made.
const char *set_text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/// Expected and measured within an absolute tolerance.
void row_near(const char *name, double expected, double measured, double tolerance);
/// The same, relative to the expected value.
void row_close(const char *name, double expected, double measured, double tolerance);
/// A magnitude that should vanish: |measured| <= limit.
void row_below(const char *name, double measured, double limit);
/// Something that must be true, in words.
void row_true(const char *name, const char *expected, bool measured);
/// A number without a bound.
void row_note(const char *name, double measured);
/// Slope of log |error| over log h, expected within a tolerance; tolerance 0: reported, not tested.
void row_rate(const char *name, double expected, int n, const double *h, const double *error,
              double tolerance);
/// Why the scene opened last has no rate here: in words, for the book.
void no_rate(const char *why);
/// Residual of the energy ledger against its largest term, at most 1e-8.
void row_ledger(const char *name, const run *r);
/// Fails the test when a row since the last call did.
void rows_end(void);

#endif
