// SPDX-License-Identifier: MIT
//
// What the benchmark asks of our solver alone, without other libraries:
//
// bench_sweeps bandwidth FILE...   bytes of a damped Jacobi sweep over its time, beside a stream
//                                  triad over as many bytes, on 1 and 2 threads
// bench_sweeps jacobi FILE...      sweeps of plain and damped Jacobi to 1e-6, and lambda_max
// bench_sweeps threads FILE...     a solve on one thread, on two, and two solves at once that have
//                                  nothing to do with each other, which is what the machine allows
// bench_sweeps sums FILE...        a sum in fixed chunks beside OpenMP's own, and beside one
//                                  iteration of pcg, which has two sums
// bench_sweeps fused FILE...       numbers of the direct method's factor as the program makes them,
//                                  and with multiply and add fused, which has other bits

#include "bench.h"
#include "factor.h"
#include "solve.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROUNDS 7
#define MOST_ROUNDS 199
#define LONG_TURNS 4.0 // s
#define SWEEPS 200000

typedef struct ours {
    nmm_context context;
    nmm_solver *solver;
    nmm_bsr K;
    const double *f;
    double *u;
} ours;

static void must(const nmm_context *context, nmm_status status) {
    if (status == NMM_OK) return;
    fprintf(stderr, "%s\n", context->error.message);
    exit(1);
}

static void open_ours(ours *o, const bench_system *s) {
    *o = (ours){.context = {.n_thread = 2}, .f = s->f};
    o->K = (nmm_bsr){.n_row = s->n_row,
                     .row_start = s->row_start,
                     .col = s->col,
                     .value = s->value,
                     .diagonal = s->diagonal};
    must(&o->context, nmm_solve_host()->open(&o->context, &o->solver, s->n_row, s->n_block));
    must(&o->context, nmm_allocate(&o->context, &o->u, (size_t)s->n_row, 2 * sizeof(double)));
}

static void close_ours(ours *o) {
    nmm_release(&o->context, &o->u);
    nmm_solve_host()->close(&o->context, &o->solver);
}

// Seconds of one solve from zero.
static double solve_once(ours *o, const nmm_solve_options *options, nmm_solve_report *report) {
    memset(o->u, 0, 2 * (size_t)o->K.n_row * sizeof *o->u);
    const double start = nmm_clock();
    must(&o->context, nmm_solve_host()->solve(&o->context, o->solver, &o->K, o->f, o->u, false,
                                              options, report));
    return nmm_clock() - start;
}

static double median(double *x, int n) {
    for (int i = 1; i < n; i++) {
        for (int j = i; j > 0 && x[j] < x[j - 1]; j--) {
            const double swap = x[j];
            x[j] = x[j - 1], x[j - 1] = swap;
        }
    }
    return 0.5 * (x[n / 2] + x[(n - 1) / 2]);
}

// As many as fit into the time, within limits.
static int affordable(double seconds, int least, int most) {
    return nmm_max_int(least, (int)nmm_min(LONG_TURNS / seconds, most));
}

// --- Bandwidth

static nmm_solve_options sweeps_only(int n_thread) {
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_JACOBI;
    options.blocks = NMM_BLOCKS_COVER;
    options.tolerance = 1e-300;
    options.jacobi_damping = 0.2;
    options.n_thread = n_thread;
    return options;
}

// Seconds of a sweep: many sweeps less few.
static double time_sweep(ours *o, int n_thread, int n_sweep) {
    nmm_solve_options options = sweeps_only(n_thread);
    nmm_solve_report report;
    options.max_iterations = n_sweep / 4;
    const double few = solve_once(o, &options, &report);
    options.max_iterations = n_sweep / 4 + n_sweep;
    return (solve_once(o, &options, &report) - few) / n_sweep;
}

// Seconds of a[i] = b[i] + x * c[i] over arrays of n numbers.
static double time_triad(double *a, const double *b, const double *c, long n, int n_thread) {
    const int repeat = (int)nmm_max(1, 2e7 / (double)n);
    const double start = nmm_clock();
    for (int k = 0; k < repeat; k++) {
        const double x = 1e-3 * k;
#pragma omp parallel for num_threads(n_thread) schedule(static)
        for (long i = 0; i < n; i++)
            a[i] = b[i] + x * c[i];
    }
    return (nmm_clock() - start) / repeat;
}

// Bytes that a sweep must move at least when nothing stays in a cache: blocks and columns, row
// starts, inverted diagonals, right-hand side, old and new u.
static double bytes_of_sweep(const bench_system *s) {
    const double numbers = 4.0 * s->n_block + (4 + 2 + 2 + 2) * (double)s->n_row;
    return 8 * numbers + 4 * ((double)s->n_block + s->n_row);
}

static void bandwidth(const bench_system *s, const char *path) {
    ours o;
    open_ours(&o, s);
    const double bytes = bytes_of_sweep(s);
    const long n = (long)(bytes / 24);
    double *a = calloc((size_t)n, sizeof *a), *b = calloc((size_t)n, sizeof *b),
           *c = calloc((size_t)n, sizeof *c);
    const int n_sweep = (int)nmm_max(12, nmm_min(2000, 4e8 / bytes));
    for (int n_thread = 1; n_thread <= 2 && c != NULL; n_thread++) {
        double sweep[ROUNDS], triad[ROUNDS];
        // Pages are placed by the threads that will use them.
        time_triad(b, a, c, n, n_thread), time_triad(c, b, a, n, n_thread);
        for (int k = 0; k < ROUNDS; k++) {
            sweep[k] = time_sweep(&o, n_thread, n_sweep);
            triad[k] = time_triad(a, b, c, n, n_thread);
        }
        printf("bandwidth\t%s\t%d\t%.3g\t%d\t%.5g\t%.4g\t%.4g\n", path, 2 * s->n_row, bytes,
               n_thread, 1e6 * median(sweep, ROUNDS), 1e-9 * bytes / median(sweep, ROUNDS),
               1e-9 * 24.0 * (double)n / median(triad, ROUNDS));
    }
    free(a), free(b), free(c);
    close_ours(&o);
}

// --- Jacobi's region of convergence

static void jacobi(const bench_system *s, const char *path) {
    ours o;
    open_ours(&o, s);
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_JACOBI;
    options.blocks = NMM_BLOCKS_COVER;
    options.tolerance = 1e-6;
    options.max_iterations = SWEEPS;
    nmm_solve_report plain, damped;
    options.jacobi_damping = 1;
    solve_once(&o, &options, &plain);
    options.jacobi_damping = 0;
    solve_once(&o, &options, &damped);
    printf("jacobi\t%s\t%d\t%.4g\t%.4g\t%d\t%s\t%d\t%s\n", path, 2 * s->n_row, s->courant,
           damped.lambda_max, plain.iterations, nmm_solve_end_name(plain.end), damped.iterations,
           nmm_solve_end_name(damped.end));
    close_ours(&o);
}

// --- Cost of sums in a fixed order

static double plain_sum(int n, const double *x, const double *y, int n_thread) {
    double sum = 0;
#pragma omp parallel for simd num_threads(n_thread) schedule(static) reduction(+ : sum)
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static double time_sum(double (*sum)(int, const double *, const double *, int), ours *o,
                       int n_thread) {
    const int n = 2 * o->K.n_row, repeat = nmm_max_int(5, 10000000 / n);
    double total = 0;
    const double start = nmm_clock();
    for (int k = 0; k < repeat; k++)
        total += sum(n, o->f, o->u, n_thread);
    const double seconds = (nmm_clock() - start) / repeat;
    return isfinite(total) ? seconds : NAN;
}

static void sums(const bench_system *s, const char *path) {
    ours o;
    open_ours(&o, s);
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_PCG;
    options.blocks = NMM_BLOCKS_COVER;
    options.tolerance = 1e-10;
    for (int n_thread = 1; n_thread <= 2; n_thread++) {
        double iteration[ROUNDS], fixed[ROUNDS], plain[ROUNDS];
        options.n_thread = n_thread;
        for (int k = 0; k < ROUNDS; k++) {
            nmm_solve_report report;
            const double seconds = solve_once(&o, &options, &report);
            iteration[k] = seconds / nmm_max_int(1, report.iterations);
            fixed[k] = time_sum(nmm_sum_product, &o, n_thread);
            plain[k] = time_sum(plain_sum, &o, n_thread);
        }
        printf("sums\t%s\t%d\t%d\t%.4g\t%.4g\t%.4g\n", path, 2 * s->n_row, n_thread,
               1e6 * median(fixed, ROUNDS), 1e6 * median(plain, ROUNDS),
               1e6 * median(iteration, ROUNDS));
    }
    close_ours(&o);
}

// --- Cost of separate multiplication and addition

extern const nmm_factor_kernels nmm_factor_fused;

// Seconds to make the numbers of a factor.
static double time_factor(const nmm_factor_kernels *kernels, nmm_factor *factor, const nmm_bsr *K) {
    const double start = nmm_clock();
    if (kernels->make(factor, K->value) >= 0) fprintf(stderr, "not positive definite\n"), exit(1);
    return nmm_clock() - start;
}

static void fused(const bench_system *s, const char *path) {
    // Both by the same instructions but for the fused ones.
    if (nmm_factor_fastest() != &nmm_factor_avx512) return;
    ours o;
    nmm_factor factor = {0};
    open_ours(&o, s);
    must(&o.context, nmm_factor_analyse(&o.context, &factor, &o.K, s->place));
    must(&o.context, nmm_factor_reserve(&o.context, &factor, 1));
    const double first = time_factor(&nmm_factor_avx512, &factor, &o.K);
    const int n = affordable(first, ROUNDS, MOST_ROUNDS);
    double apart[MOST_ROUNDS], together[MOST_ROUNDS];
    for (int k = 0; k < n; k++) {
        apart[k] = time_factor(&nmm_factor_avx512, &factor, &o.K);
        together[k] = time_factor(&nmm_factor_fused, &factor, &o.K);
    }
    printf("fused\t%s\t%d\t%.4g\t%.4g\n", path, 2 * s->n_row, 1e6 * median(apart, n),
           1e6 * median(together, n));
    nmm_factor_destroy(&o.context, &factor);
    close_ours(&o);
}

// --- Two threads

// Solves that a solver needs until it has learned what is fast, and rounds after them; at least,
// where they take long.
#define LEARNED 12
#define LEARNED_AT_LEAST 4
#define TURNS 15
#define TURNS_AT_LEAST 3

// Conjugate gradients alone are for steps up to this Courant number.
#define DYNAMIC 10

static nmm_solve_options options_for(const bench_system *s, nmm_solve_method method, int n_thread) {
    nmm_solve_options options = nmm_default_solve_options();
    options.method = method;
    options.blocks = method == NMM_SOLVE_PCG ? NMM_BLOCKS_CLUSTER : NMM_BLOCKS_AUTO;
    options.tolerance = 1e-6;
    options.n_thread = n_thread;
    options.place = s->place;
    options.body = s->body;
    return options;
}

// Seconds of a solve in a pattern that is known.
static double solve_again(ours *o, const nmm_solve_options *options, nmm_solve_report *report) {
    memset(o->u, 0, 2 * (size_t)o->K.n_row * sizeof *o->u);
    const double start = nmm_clock();
    must(&o->context,
         nmm_solve_host()->solve(&o->context, o->solver, &o->K, o->f, o->u, true, options, report));
    return nmm_clock() - start;
}

// Seconds until both are done.
static double solve_both(ours pair[2], const nmm_solve_options *options) {
    const double start = nmm_clock();
#pragma omp parallel for num_threads(2) schedule(static)
    for (int k = 0; k < 2; k++) {
        nmm_solve_report report;
        solve_again(&pair[k], options, &report);
    }
    return nmm_clock() - start;
}

// Solvers that have learned what they can; seconds of a solve on one thread.
static double open_three(ours o[3], const bench_system *s, const nmm_solve_options *one,
                         const nmm_solve_options *two) {
    nmm_solve_report report;
    double seconds = 0;
    for (int k = 0; k < 3; k++) {
        open_ours(&o[k], s);
        solve_once(&o[k], k < 2 ? one : two, &report);
        const int n = k == 0 ? LEARNED_AT_LEAST : affordable(seconds, LEARNED_AT_LEAST, LEARNED);
        for (int i = 0; i < n; i++)
            seconds = solve_again(&o[k], k < 2 ? one : two, &report);
    }
    return seconds;
}

static void threads_of(const bench_system *s, const char *path, nmm_solve_method method) {
    const nmm_solve_options one = options_for(s, method, 1), two = options_for(s, method, 2);
    nmm_solve_report report;
    ours o[3];
    double alone[TURNS], shared[TURNS], both[TURNS];
    const int n = affordable(open_three(o, s, &one, &two), TURNS_AT_LEAST, TURNS);
    // Each after one like it: three solvers do not fit into a cache together.
    for (int k = 0; k < n; k++) {
        solve_again(&o[0], &one, &report);
        alone[k] = solve_again(&o[0], &one, &report);
        solve_both(o, &one);
        both[k] = solve_both(o, &one);
        solve_again(&o[2], &two, &report);
        shared[k] = solve_again(&o[2], &two, &report);
    }
    const double t1 = median(alone, n), t2 = median(shared, n);
    printf("threads\t%s\t%d\t%.3g\t%s\t%s\t%.5g\t%.5g\t%.3g\t%.3g\n", path, 2 * s->n_row,
           s->courant, nmm_solve_method_name(method), nmm_solve_method_name(report.method),
           1e3 * t1, 1e3 * t2, t1 / t2, 2 * t1 / median(both, n));
    fflush(stdout);
    for (int k = 0; k < 3; k++)
        close_ours(&o[k]);
}

static void threads(const bench_system *s, const char *path) {
    threads_of(s, path, NMM_SOLVE_AUTO);
    threads_of(s, path, NMM_SOLVE_DIRECT);
    if (s->courant <= DYNAMIC) threads_of(s, path, NMM_SOLVE_PCG);
}

int main(int argc, char **argv) {
    static const struct {
        const char *name;
        void (*run)(const bench_system *system, const char *path);
    } part[] = {{"bandwidth", bandwidth},
                {"jacobi", jacobi},
                {"threads", threads},
                {"sums", sums},
                {"fused", fused}};
    void (*run)(const bench_system *system, const char *path) = NULL;
    for (size_t k = 0; argc > 2 && k < sizeof part / sizeof *part; k++) {
        if (strcmp(argv[1], part[k].name) == 0) run = part[k].run;
    }
    if (run == NULL) {
        fprintf(stderr, "usage: bench_sweeps bandwidth|jacobi|threads|sums|fused FILE...\n");
        return 2;
    }
    for (int k = 2; k < argc; k++) {
        bench_system system;
        bench_system_read(&system, argv[k]);
        run(&system, argv[k]);
        fflush(stdout);
        bench_system_release(&system);
    }
    return 0;
}
