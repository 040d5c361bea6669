// SPDX-License-Identifier: MIT
//
// One linear system from its files to its solution: read or generate, solve as often as it is to
// be measured, judge, write. Each solve has a solver of its own and starts from nothing but the
// first guess: orders, blocks, bounds and factors are made anew, and auto knows nothing yet.

#include "linear.h"
#include "step.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

// Words of the settings, at the place of their value.
static const char *const stop_word[] = {"residual", "average_change", NULL};

nmm_linear_def nmm_default_linear_def(void) {
    return (nmm_linear_def){.method = "auto",
                            .blocks = "auto",
                            .precision = "auto",
                            .stop = "residual",
                            .tolerance = 1e-8,
                            .n_repeat = 1};
}

// --- Settings

static nmm_status take_word(nmm_context *context, const char *what, const char *word,
                            const char *const *allowed, int *value) {
    char list[128] = "";
    for (int k = 0; allowed[k] != NULL; k++) {
        *value = k;
        if (word == NULL || strcmp(word, allowed[k]) == 0) return NMM_OK;
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", k > 0 ? ", " : "", allowed[k]);
    }
    return nmm_fail(context, NMM_ERROR_ARGUMENT, "%s must be one of %s, found '%s'", what, list,
                    word);
}

static nmm_status take_options(nmm_context *context, const nmm_linear_def *def,
                               nmm_solve_options *options) {
    int method = 0, blocks = 0, precision = 0, stop = 0;
    TRY(take_word(context, "method", def->method, nmm_solve_method_word, &method));
    TRY(take_word(context, "blocks", def->blocks, nmm_solve_blocks_word, &blocks));
    TRY(take_word(context, "precision", def->precision, nmm_solve_precision_word, &precision));
    TRY(take_word(context, "stop", def->stop, stop_word, &stop));
    const bool residual =
        method == NMM_SOLVE_AUTO || method == NMM_SOLVE_PCG || method == NMM_SOLVE_DIRECT;
    if (stop == 1 && residual) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "stop average_change is for jacobi, chebyshev, sor and gauss-seidel; "
                        "method %s tests the residual",
                        nmm_solve_method_word[method]);
    }
    if (def->n_repeat < 1 || (def->matrix == NULL && def->generate < 8)) {
        return nmm_fail(context, NMM_ERROR_ARGUMENT,
                        "a linear system needs a matrix, or 8 unknowns or more to be generated, "
                        "and one solve or more; found %d unknowns and %d solves",
                        def->generate, def->n_repeat);
    }
    *options = (nmm_solve_options){.method = (nmm_solve_method)method,
                                   .blocks = (nmm_solve_blocks)blocks,
                                   .precision = (nmm_solve_precision)precision,
                                   .stop_average_change = stop == 1,
                                   .tolerance = def->tolerance,
                                   .absolute = def->absolute,
                                   .jacobi_damping = def->damping,
                                   .sor_factor = def->sor_factor,
                                   .max_iterations = def->max_iterations,
                                   .n_thread = context->n_thread};
    return NMM_OK;
}

// --- The system

// A table of `rows` rows and `columns` columns, or an error that names what is there.
static nmm_status read_table(nmm_context *context, const char *path, int rows, int columns,
                             nmm_columns *table) {
    TRY(nmm_columns_read(context, table, path));
    if (table->n_row == rows && table->n_column == columns) return NMM_OK;
    return nmm_fail(context, NMM_ERROR_INPUT,
                    "%s: must have %d rows and %d columns to go with the matrix, found %d and %d",
                    path, rows, columns, table->n_row, table->n_column);
}

static nmm_status read_vector(nmm_context *context, const nmm_linear *system, const char *path,
                              double *x) {
    nmm_columns table = {0};
    const nmm_status status = read_table(context, path, system->order, 1, &table);
    if (status == NMM_OK) memcpy(x, table.value, (size_t)system->order * sizeof(double));
    nmm_columns_destroy(context, &table);
    return status;
}

// x, y and body of each two unknowns.
static nmm_status take_places(nmm_context *context, nmm_linear *system, const nmm_columns *table,
                              const char *path) {
    const int n = table->n_row;
    TRY(nmm_allocate(context, &system->place, (size_t)n, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &system->body, (size_t)n, sizeof(int)));
    for (int row = 0; row < n; row++) {
        const double body = table->value[2 * (long)n + row];
        system->place[2 * row] = table->value[row];
        system->place[2 * row + 1] = table->value[n + row];
        if (!(body >= -1 && body < n) || body != floor(body)) {
            return nmm_fail(context, NMM_ERROR_INPUT,
                            "%s: body of row %d must be a whole number from -1 to %d, found %.17g",
                            path, row + 1, n - 1, body);
        }
        system->body[row] = (int)body;
    }
    return NMM_OK;
}

static nmm_status read_places(nmm_context *context, nmm_linear *system, const char *path) {
    nmm_columns table = {0};
    nmm_status status = read_table(context, path, system->K.n_row, 3, &table);
    if (status == NMM_OK) status = take_places(context, system, &table, path);
    nmm_columns_destroy(context, &table);
    return status;
}

// f = K (1, 1, ...); the load on the unknown that only fills up an odd order stays 0.
static void load_of_ones(nmm_linear *system) {
    const nmm_bsr *K = &system->K;
    for (int row = 0; row < K->n_row; row++) {
        double x = 0, y = 0;
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
            const double *v = K->value + 4 * (long)k;
            x += v[0] + v[1];
            y += v[2] + v[3];
        }
        system->f[2 * row] = x;
        system->f[2 * row + 1] = y;
    }
    if (system->order % 2 != 0) system->f[system->order] = 0;
}

// What a uniform load, and with it a rigid motion, would leave out: all wave lengths.
static void load_at_random(nmm_linear *system) {
    nmm_random random = nmm_random_seed(1);
    for (int i = 0; i < 2 * system->K.n_row; i++)
        system->f[i] = nmm_random_unit(&random) - 0.5;
}

static nmm_status load_system(nmm_context *context, nmm_linear *system, const nmm_linear_def *def) {
    if (def->matrix != NULL)
        TRY(nmm_linear_read_matrix(context, system, def->matrix));
    else
        TRY(nmm_linear_generate(context, system, def->generate));
    const size_t n = (size_t)system->K.n_row;
    TRY(nmm_allocate(context, &system->f, n, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &system->u, n, 2 * sizeof(double)));
    TRY(nmm_allocate(context, &system->guess, n, 2 * sizeof(double)));
    if (def->rhs != NULL)
        TRY(read_vector(context, system, def->rhs, system->f));
    else if (def->matrix != NULL)
        load_of_ones(system);
    else
        load_at_random(system);
    if (def->guess != NULL) TRY(read_vector(context, system, def->guess, system->guess));
    // A generated system knows its places.
    if (def->matrix != NULL && def->places != NULL) TRY(read_places(context, system, def->places));
    return NMM_OK;
}

// --- Solving

static int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/// A system, what to do with it and how it went.
typedef struct job {
    nmm_context context;
    const nmm_linear_def *def;
    nmm_linear system;
    nmm_solve_options options;
    const nmm_solve_backend *backend;
    nmm_solver *solver;
    nmm_solve_report solved;
    double read_seconds;
    double *seconds; // [def->n_repeat]
} job;

static nmm_status solve_once(job *j, double *seconds) {
    nmm_linear *s = &j->system;
    memcpy(s->u, s->guess, 2 * (size_t)s->K.n_row * sizeof(double));
    j->backend->close(&j->context, &j->solver);
    TRY(j->backend->open(&j->context, &j->solver, s->K.n_row, s->K.row_start[s->K.n_row]));
    const double start = nmm_clock();
    TRY(j->backend->solve(&j->context, j->solver, &s->K, s->f, s->u, false, &j->options,
                          &j->solved));
    *seconds = nmm_clock() - start;
    return NMM_OK;
}

static nmm_status do_job(job *j) {
    const nmm_linear_def *def = j->def;
    nmm_linear *s = &j->system;
    TRY(take_options(&j->context, def, &j->options));
    TRY(nmm_step_backend(&j->context, def->device, &j->backend));
    const double start = nmm_clock();
    TRY(load_system(&j->context, s, def));
    j->read_seconds = nmm_clock() - start;
    j->options.place = s->place;
    j->options.body = s->body;
    TRY(nmm_allocate(&j->context, &j->seconds, (size_t)def->n_repeat, sizeof(double)));
    for (int k = 0; k < def->n_repeat; k++)
        TRY(solve_once(j, &j->seconds[k]));
    if (def->output == NULL || j->solved.end != NMM_SOLVE_CONVERGED) return NMM_OK;
    return nmm_linear_write_vector(&j->context, s->order, s->u, def->output, NULL);
}

// --- The report

static const char *end_word(nmm_solve_end end) {
    static const char *const word[] = {"converged",  "diverged",  "too_slow",    "indefinite",
                                       "not_finite", "stagnated", "bad_pattern", "out_of_range"};
    return -end >= 0 && -end < (int)(sizeof word / sizeof *word) ? word[-end] : "unknown";
}

// What was asked for and not used, in words, after what the solve has to say itself.
static void explain(nmm_linear_report *report, const job *j) {
    const nmm_solve_report *solved = &j->solved;
    const nmm_solve_options *asked = &j->options;
    char *why = report->why;
    const size_t size = sizeof report->why;
    snprintf(why, size, "%s", solved->why != NULL ? solved->why : "");
    const bool mixed = asked->precision == NMM_PRECISION_MIXED;
    if (mixed && solved->precision != NMM_PRECISION_MIXED && !solved->fell_back) {
        snprintf(why + strlen(why), size - strlen(why), "%sdouble: %s has no single precision form",
                 why[0] ? "; " : "", nmm_solve_method_name(solved->method));
    }
    if (asked->blocks == NMM_BLOCKS_AUTO || asked->blocks == solved->blocks) return;
    // Why clusters stand in for bodies the solver has said itself.
    const bool inverts = solved->blocks == NMM_BLOCKS_CLUSTER;
    snprintf(why + strlen(why), size - strlen(why), "%s%s blocks were not used%s",
             why[0] ? "; " : "", nmm_solve_blocks_name(asked->blocks),
             inverts ? "" : ": the method inverts none");
}

static void copy_words(nmm_linear_report *report, const job *j) {
    const nmm_solve_report *solved = &j->solved;
    snprintf(report->end, sizeof report->end, "%s", end_word(solved->end));
    snprintf(report->reason, sizeof report->reason, "%s", nmm_solve_end_name(solved->end));
    snprintf(report->method, sizeof report->method, "%s", nmm_solve_method_name(solved->method));
    snprintf(report->blocks, sizeof report->blocks, "%s", nmm_solve_blocks_name(solved->blocks));
    snprintf(report->precision, sizeof report->precision, "%s",
             nmm_solve_precision_word[solved->precision]);
    snprintf(report->device, sizeof report->device, "%s", j->backend->name);
    explain(report, j);
}

// |u|, of squares that neither over- nor underflow.
static double norm_of(int n, const double *u) {
    double largest = 0, sum = 0;
    for (int i = 0; i < n; i++)
        largest = nmm_max(largest, fabs(u[i]));
    if (largest == 0) return 0;
    for (int i = 0; i < n; i++)
        sum += u[i] / largest * (u[i] / largest);
    return largest * sqrt(sum);
}

static void measure_solution(nmm_linear_report *report, const job *j) {
    const int n = j->system.order;
    const double *u = j->system.u;
    report->solution_norm = norm_of(n, u);
    report->error = -1;
    const bool is_known = j->def->rhs == NULL && j->def->matrix != NULL;
    for (int i = 0; is_known && i < n; i++)
        report->error = nmm_max(report->error, fabs(u[i] - 1));
}

static void fill_report(nmm_linear_report *report, job *j) {
    const nmm_solve_report *solved = &j->solved;
    const int n = j->def->n_repeat;
    qsort(j->seconds, (size_t)n, sizeof(double), compare_numbers);
    *report = (nmm_linear_report){
        .order = j->system.order,
        .padded = j->system.order % 2,
        .entries = j->system.entries,
        .converged = solved->end == NMM_SOLVE_CONVERGED,
        .row = solved->row >= 0 ? 2 * solved->row + 1 : 0,
        .on_device = solved->on_device,
        .n_thread = solved->n_thread > 0 ? solved->n_thread : j->options.n_thread,
        .setups = solved->setups,
        .transfers = solved->transfers,
        .transfer_bytes = solved->transfer_bytes,
        .transfer_seconds = solved->transfer_seconds,
        .iterations = solved->iterations,
        .by_average_change = solved->by_average_change,
        .residual = solved->residual,
        .lambda_min = solved->lambda_min,
        .lambda_max = solved->lambda_max,
        .read_seconds = j->read_seconds,
        .seconds = 0.5 * (j->seconds[(n - 1) / 2] + j->seconds[n / 2]),
        .least_seconds = j->seconds[0],
    };
    copy_words(report, j);
    measure_solution(report, j);
}

static void end_job(job *j) {
    if (j->backend != NULL) j->backend->close(&j->context, &j->solver);
    nmm_release(&j->context, &j->seconds);
    nmm_linear_destroy(&j->context, &j->system);
}

nmm_status nmm_linear_solve(const nmm_linear_def *def, nmm_linear_report *report) {
    job j = {.context = {.allocate = def->allocate, .user = def->user}, .def = def};
    j.context.n_thread = def->n_thread > 0 ? def->n_thread : nmm_max_int(1, omp_get_max_threads());
    const nmm_status status = do_job(&j);
    *report = (nmm_linear_report){.residual = -1, .error = -1};
    if (status == NMM_OK)
        fill_report(report, &j);
    else
        report->error_of_call = j.context.error;
    end_job(&j);
    NMM_ASSERT(j.context.n_live == 0);
    return status;
}
