// SPDX-License-Identifier: MIT
//
// The benchmark of docs/solvers.md: a linear system read from a file, and the methods that solve
// it, our own and those of other libraries, behind one small interface. What is kept between two
// solves of one pattern (storage, ordering, symbolic analysis) is made by `open` and not timed;
// what new numbers in that pattern ask for (diagonals, factors, levels) is done by every `solve`.
// Plain C, as a C++ file includes it too.

#ifndef NMM_BENCH_H
#define NMM_BENCH_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A system of 2x2 blocks as one pass of a step made it; both halves are stored.
typedef struct bench_system {
    int n_row, n_block;      // block rows, blocks
    int n_contact, n_closed; // contacts listed; of them closed
    double dt, courant;      // [s] length of the step; c_p dt / h
    int *row_start;          // [n_row + 1]
    int *col;                // [n_block]
    int *diagonal;           // [n_row]
    double *value;           // [n_block][2][2]
    double *f;               // [n_row][2]
    double *place;           // [n_row][2] m
    int *body;               // [n_row]
} bench_system;

/// Both end the program with a message when the file is not as it must be.
void bench_system_read(bench_system *system, const char *path);
void bench_system_write(const bench_system *system, const char *path);
void bench_system_release(bench_system *system);
/// |f - K u| / |f|, summed in long double.
double bench_true_residual(const bench_system *system, const double *u);

typedef enum bench_family { BENCH_OURS, BENCH_ITERATIVE, BENCH_DIRECT } bench_family;

typedef struct bench_method {
    const char *name; // without blanks
    bench_family family;
    int largest;  // unknowns above which it would take minutes; 0: none
    bool threads; // can use more than one
    /// Everything that may be kept while the pattern stays. NULL: cannot do it.
    void *(*open)(const bench_system *system, const struct bench_method *method, int n_thread);
    /// Set-up for the numbers as they are and a solve from zero, until its own measure of
    /// |f - K u| / |f| is at most `tolerance`. Returns the iterations (direct: solves with the
    /// factor), or -1: failed.
    int (*solve)(void *state, double tolerance, double *u);
    void (*close)(void *state);
    /// What the last solve did or why it failed; without tabs. NULL: nothing to say.
    const char *(*note)(const void *state);
    int choice[3]; // for the file that made it
    double number; // the same
} bench_method;

/// The lists; *n is their length.
const bench_method *bench_ours(int *n);
const bench_method *bench_petsc(int *n);
const bench_method *bench_eigen(int *n);
const bench_method *bench_cholmod(int *n);

void bench_petsc_start(void);
void bench_petsc_stop(void);

#ifdef __cplusplus
}
#endif

#endif
