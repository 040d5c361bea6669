// SPDX-License-Identifier: MIT
//
// Times of a solve, ours and other libraries', all from u = 0 to the same true residual. Each
// method is first calibrated: where its own measure of the residual is too kind, it is asked for
// less until the true one holds. Then the methods take turns, round by round, so that whatever
// else the machine does meets all of them. One line per method: median and least of the rounds.
//
// Usage: bench_peers [-t TOLERANCE]... [-j THREADS]... [-r ROUNDS] [-b SECONDS] [-o NAME]... [-x
// NAME]...
//                    FILE...
//     -r  rounds at most (9); at least 5 where a solve takes less than 0.3 s, 3 up to 2 s, else 1
//     -b  seconds for one method in one system (0.5)
//     -s  a method that took longer is not tried again on the same system (5)
//     -o  only methods whose name contains NAME; -x  none whose name contains NAME

#include "bench.h"

#include "base.h"

#include <dlfcn.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MAX_METHODS 64
#define MAX_ROUNDS 99
// Time of a batch of solves, which the clock can measure.
#define BATCH_SECONDS 2e-3
// Solves after which automatic choice has tried what it wants to try.
#define LEARNING 3
// Systems above this many rows are not all held open at once: one method after the other.
#define ROWS_TOGETHER 20000

typedef struct choices {
    double tolerance[8];
    int n_tolerance;
    int threads[8];
    int n_threads;
    int rounds;
    double budget, too_slow;
    const char *only[16], *without[16];
    int n_only, n_without;
} choices;

// The longest solve of each method on a system so far, by its place in the whole list.
typedef double slowest[MAX_METHODS];

typedef struct entry {
    const bench_method *method;
    double *slowest;
    void *state; // NULL: closed
    double asked;
    int iterations;
    double residual;
    int n_repeat, n_round;
    double seconds[MAX_ROUNDS];
    char note[400];
} entry;

// --- The methods

static bool matches(const char *name, const char *const *part, int n) {
    for (int k = 0; k < n; k++) {
        if (strstr(name, part[k]) != NULL) return true;
    }
    return false;
}

static bool wanted(const choices *c, const bench_method *method) {
    if (matches(method->name, c->without, c->n_without)) return false;
    return c->n_only == 0 || matches(method->name, c->only, c->n_only);
}

// Those for `n_thread` threads: with more than one, only methods that can use them.
static int list_methods(const choices *c, const bench_system *s, int n_thread, double *slowest_of,
                        entry *list) {
    const bench_method *(*const maker[])(int *) = {bench_ours, bench_petsc, bench_eigen,
                                                   bench_cholmod};
    int n = 0, at = 0;
    for (size_t k = 0; k < sizeof maker / sizeof *maker; k++) {
        int n_here = 0;
        const bench_method *method = maker[k](&n_here);
        for (int i = 0; i < n_here && at < MAX_METHODS; i++, at++) {
            if (!wanted(c, &method[i]) || (n_thread > 1 && !method[i].threads)) continue;
            if (method[i].largest > 0 && 2 * s->n_row > method[i].largest) continue;
            list[n++] = (entry){.method = &method[i], .slowest = &slowest_of[at]};
        }
    }
    return n;
}

// OpenMP's threads and those of the BLAS, where it has a number to set.
static void set_threads(int n_thread) {
    omp_set_num_threads(n_thread);
    void (*set_blas)(int) = NULL;
    *(void **)&set_blas = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (set_blas != NULL) set_blas(n_thread);
}

// --- One method

static void keep_note(entry *e) {
    const char *note = e->method->note != NULL ? e->method->note(e->state) : "";
    snprintf(e->note, sizeof e->note, "%s", note);
}

// What it says of its last solve stays: automatic choice may have turned elsewhere by then.
static void close_entry(entry *e) {
    if (e->state != NULL && e->n_round > 0) keep_note(e);
    if (e->state != NULL) e->method->close(e->state);
    e->state = NULL;
}

// Solve until the true residual holds, asking for less where it does not; seconds of the last
// solve.
static double find_tolerance(entry *e, const choices *c, const bench_system *s, double tolerance,
                             double *u) {
    double took = 0;
    e->asked = tolerance;
    for (int k = 0; k < 8; k++) {
        const double start = nmm_clock();
        e->iterations = e->method->solve(e->state, e->asked, u);
        took = nmm_clock() - start;
        *e->slowest = nmm_max(*e->slowest, took);
        if (took > c->too_slow) fprintf(stderr, "  %s: %.0f s\n", e->method->name, took);
        if (e->iterations < 0) break;
        e->residual = bench_true_residual(s, u);
        if (e->residual <= tolerance * (1 + 1e-9)) break;
        e->asked *= 0.5;
        // Far off: rounding, which no smaller tolerance helps against.
        if (e->residual > 100 * tolerance || took > c->too_slow) break;
    }
    return took;
}

// Open it, and find what to ask it for and how often; leaves it closed when it cannot solve the
// system. A solve of more than two seconds is a round by itself.
static void calibrate(entry *e, const choices *c, const bench_system *s, int n_thread,
                      double tolerance, double *u) {
    if (*e->slowest > c->too_slow) {
        snprintf(e->note, sizeof e->note, "left out: took %.0f s before", *e->slowest);
        return;
    }
    e->state = e->method->open(s, e->method, n_thread);
    snprintf(e->note, sizeof e->note, "cannot be opened");
    if (e->state == NULL) return;
    double took = find_tolerance(e, c, s, tolerance, u);
    keep_note(e);
    if (e->iterations < 0 || !(e->residual <= tolerance * (1 + 1e-9))) {
        if (e->iterations >= 0) snprintf(e->note, sizeof e->note, "residual %.1e", e->residual);
        close_entry(e);
        return;
    }
    // The first solve of all has more to do; a second one tells how many a batch may hold.
    if (took < c->too_slow) {
        const double start = nmm_clock();
        e->method->solve(e->state, e->asked, u);
        took = nmm_clock() - start;
    }
    const bool learns = e->method->family == BENCH_OURS && took < c->too_slow / 4;
    for (int k = 0; learns && k < LEARNING; k++) {
        const double start = nmm_clock();
        e->iterations = e->method->solve(e->state, e->asked, u);
        took = nmm_clock() - start;
    }
    e->n_repeat = nmm_max_int(1, nmm_min_int(200, (int)(BATCH_SECONDS / took)));
    const int affordable = (int)nmm_min(MAX_ROUNDS, c->budget / (took * e->n_repeat));
    e->seconds[0] = took;
    const int least = took > 2 ? 1 : took > 0.3 ? 3 : 5;
    e->n_round = nmm_max_int(least, nmm_min_int(c->rounds, affordable));
}

static void run_round(entry *e, int round, double *u) {
    if (e->n_round == 1) return; // measured already
    // Wakes its threads and fills the caches, unless a solve is long by itself.
    if (e->n_repeat > 1) e->method->solve(e->state, e->asked, u);
    const double start = nmm_clock();
    for (int k = 0; k < e->n_repeat; k++)
        e->iterations = e->method->solve(e->state, e->asked, u);
    e->seconds[round] = (nmm_clock() - start) / e->n_repeat;
}

// --- One system

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print_entry(entry *e, const char *name, const bench_system *s, double tolerance,
                        int n_thread) {
    static const char *const family[] = {"ours", "iterative", "direct"};
    printf("%s\t%d\t%d\t%d\t%d\t%.3g\t%.3g\t%.0e\t%d\t%s\t%s\t", name, 2 * s->n_row, s->n_block,
           s->n_contact, s->n_closed, s->dt, s->courant, tolerance, n_thread, e->method->name,
           family[e->method->family]);
    if (e->n_round == 0) {
        printf("-\t-\t-\t-\t%s\n", e->note);
        return;
    }
    qsort(e->seconds, (size_t)e->n_round, sizeof *e->seconds, compare);
    const double median = 0.5 * (e->seconds[e->n_round / 2] + e->seconds[(e->n_round - 1) / 2]);
    printf("%.5g\t%.5g\t%d\t%.2e\t%s\n", 1e3 * median, 1e3 * e->seconds[0], e->iterations,
           e->residual, e->note);
}

static void measure(const choices *c, const bench_system *s, const char *name, double tolerance,
                    int n_thread, double *slowest_of) {
    entry *list = calloc(MAX_METHODS, sizeof *list);
    double *u = calloc(2 * (size_t)s->n_row, sizeof *u);
    set_threads(n_thread);
    const int n = list_methods(c, s, n_thread, slowest_of, list);
    const bool together = s->n_row <= ROWS_TOGETHER;
    for (int k = 0; k < n; k++) {
        calibrate(&list[k], c, s, n_thread, tolerance, u);
        for (int round = 0; !together && round < list[k].n_round; round++)
            run_round(&list[k], round, u);
        if (!together) close_entry(&list[k]);
    }
    for (int round = 0; together && round < MAX_ROUNDS; round++) {
        for (int k = 0; k < n; k++) {
            if (round < list[k].n_round) run_round(&list[k], round, u);
        }
    }
    for (int k = 0; k < n; k++) {
        close_entry(&list[k]);
        print_entry(&list[k], name, s, tolerance, n_thread);
    }
    fflush(stdout);
    free(list);
    free(u);
}

// --- The command line

static choices read_choices(int argc, char **argv) {
    choices c = {.rounds = 9, .budget = 0.5, .too_slow = 5};
    for (int option; (option = getopt(argc, argv, "t:j:r:b:s:o:x:")) != -1;) {
        if (option == 't' && c.n_tolerance < 8)
            c.tolerance[c.n_tolerance++] = strtod(optarg, NULL);
        else if (option == 'j' && c.n_threads < 8)
            c.threads[c.n_threads++] = nmm_max_int(1, atoi(optarg));
        else if (option == 'r')
            c.rounds = nmm_max_int(1, nmm_min_int(MAX_ROUNDS, atoi(optarg)));
        else if (option == 'b')
            c.budget = strtod(optarg, NULL);
        else if (option == 's')
            c.too_slow = strtod(optarg, NULL);
        else if (option == 'o' && c.n_only < 16)
            c.only[c.n_only++] = optarg;
        else if (option == 'x' && c.n_without < 16)
            c.without[c.n_without++] = optarg;
        else
            exit(2);
    }
    if (c.n_tolerance == 0) c.tolerance[c.n_tolerance++] = 1e-6;
    if (c.n_threads == 0) c.threads[c.n_threads++] = 1;
    return c;
}

// Name of a file without folder and ending.
static void base_name(const char *path, char *name, size_t size) {
    const char *slash = strrchr(path, '/');
    snprintf(name, size, "%s", slash != NULL ? slash + 1 : path);
    char *dot = strrchr(name, '.');
    if (dot != NULL) *dot = 0;
}

int main(int argc, char **argv) {
    const choices c = read_choices(argc, argv);
    bench_petsc_start();
    for (int k = optind; k < argc; k++) {
        char name[100];
        bench_system system;
        slowest of_system = {0};
        base_name(argv[k], name, sizeof name);
        bench_system_read(&system, argv[k]);
        for (int t = 0; t < c.n_tolerance; t++) {
            for (int j = 0; j < c.n_threads; j++)
                measure(&c, &system, name, c.tolerance[t], c.threads[j], of_system);
        }
        bench_system_release(&system);
    }
    bench_petsc_stop();
    return 0;
}
