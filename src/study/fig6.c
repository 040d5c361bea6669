// SPDX-License-Identifier: MIT
//
// Figure 6: relative error against iteration at one system of the tunnel scene, for the methods of
// the paper and ours.
//
// Each number comes from a solve of its own that is given k iterations and no first guess, and
// whose last iterate is kept however bad it is; the error is |u - u*| / |u*| against a solution to
// rounding, also of u* itself: systems of statics are ill-conditioned, and there a small residual
// says little.

#include "bench.h"

#include <math.h>
#include <string.h>

#define TUNNEL "rings_halfplane"
#define STEP_OF_SYSTEM 5

/// Most iterations; an error this small or this large ends a curve.
enum { MOST = 30000, MOST_QUICK = 300 };
#define SMALL 1e-12
#define LARGE 1e3

/// Corrections of the exact solution, at most; a last one this small [part] is rounding.
enum { MOST_CORRECTIONS = 10 };
#define ROUNDING 1e-15

enum { ITERATION, SOR, GAUSS_SEIDEL, PLAIN, DAMPED, CHEBYSHEV, PCG, BODY, N_COLUMN };
enum { METHODS = N_COLUMN - 1 };

static const nmm_bench_column columns[] = {
    [ITERATION] = {"iteration", "iteration", "", 0, 0},
    [SOR] = {"sor", "SOR(1.9)", "", 0, 3},
    [GAUSS_SEIDEL] = {"gauss_seidel", "Gauss-Seidel", "", 0, 3},
    [PLAIN] = {"jacobi", "Jacobi", "", 0, 3},
    [DAMPED] = {"damped_jacobi", "damped Jacobi", "", 0, 3},
    [CHEBYSHEV] = {"chebyshev", "Chebyshev", "", 0, 3},
    [PCG] = {"pcg", "PCG, 2x2", "", 0, 3},
    [BODY] = {"pcg_body", "PCG, bodies", "", 0, 3},
    [N_COLUMN] = {0},
};

static const struct {
    nmm_solve_method method;
    nmm_solve_blocks blocks;
} way[METHODS] = {
    {NMM_SOLVE_SOR, NMM_BLOCKS_COVER},       {NMM_SOLVE_GAUSS_SEIDEL, NMM_BLOCKS_COVER},
    {NMM_SOLVE_JACOBI, NMM_BLOCKS_COVER},    {NMM_SOLVE_JACOBI, NMM_BLOCKS_COVER},
    {NMM_SOLVE_CHEBYSHEV, NMM_BLOCKS_COVER}, {NMM_SOLVE_PCG, NMM_BLOCKS_COVER},
    {NMM_SOLVE_PCG, NMM_BLOCKS_BODY},
};

enum { PLAIN_WAY = PLAIN - SOR };

typedef struct study {
    nmm_bench_system captured;
    double *exact; // [captured.unknowns]
    double *plain; // [2][captured.unknowns] iterate of plain Jacobi, and the next one
    int n_plain;   // sweeps it has seen
    double norm;
    nmm_bench_solver solver[METHODS];
    bool ended[METHODS];
} study;

// r = f - K u, summed in more digits than u has: what is corrected by it is good to all of u's.
static void find_residual(const nmm_linear *s, const double *f, const double *u, double *r) {
    for (int row = 0; row < s->K.n_row; row++) {
        long double r0 = f[2 * row], r1 = f[2 * row + 1];
        for (int k = s->K.row_start[row]; k < s->K.row_start[row + 1]; k++) {
            const double *v = s->K.value + 4 * (long)k, *x = u + 2 * (long)s->K.col[k];
            r0 -= (long double)v[0] * x[0] + (long double)v[1] * x[1];
            r1 -= (long double)v[2] * x[0] + (long double)v[3] * x[1];
        }
        r[2 * row] = (double)r0;
        r[2 * row + 1] = (double)r1;
    }
}

static double norm_of(const nmm_linear *s, const double *u) {
    return sqrt(nmm_sum_product(2 * s->K.n_row, u, u, 1));
}

// u* += K^-1 (f - K u*), directly, until that is rounding of u*. *change: the last one, a part.
static nmm_status correct(nmm_bench *bench, study *s, nmm_bench_solver *solver, double *change) {
    nmm_linear *system = &s->captured.system;
    const int n = 2 * system->K.n_row;
    double *const f = system->f, *residual = NULL;
    TRY(nmm_allocate(&bench->context, &residual, (size_t)n, sizeof(double)));
    nmm_status status = NMM_OK;
    system->f = residual;
    for (int k = 0; k < MOST_CORRECTIONS && status == NMM_OK && !(*change <= ROUNDING); k++) {
        find_residual(system, f, s->exact, residual);
        status = nmm_bench_solve(bench, solver, &s->captured);
        for (int i = 0; i < n; i++)
            s->exact[i] += system->u[i];
        s->norm = norm_of(system, s->exact);
        *change = norm_of(system, system->u) / s->norm;
    }
    system->f = f;
    nmm_release(&bench->context, &residual);
    return status;
}

static nmm_status solve_exactly(nmm_bench *bench, study *s) {
    nmm_linear *system = &s->captured.system;
    const size_t n = (size_t)system->K.n_row;
    nmm_bench_solver solver = {0};
    double change = INFINITY;
    TRY(nmm_allocate(&bench->context, &s->exact, n, 2 * sizeof(double)));
    // Corrections begin at 0; so does every curve, at an error of 1.
    memset(system->guess, 0, 2 * n * sizeof(double));
    nmm_status status = nmm_bench_solver_open(bench, &solver, &s->captured, false);
    solver.options.method = NMM_SOLVE_DIRECT;
    solver.options.tolerance = 1e-15;
    solver.options.absolute = 0;
    solver.options.keep_last = true;
    if (status == NMM_OK) status = correct(bench, s, &solver, &change);
    nmm_bench_solver_close(bench, &solver);
    TRY(status);
    if (change < SMALL) return NMM_OK;
    return nmm_fail(&bench->context, NMM_ERROR_NUMERIC,
                    "fig6: the exact solution was not found: %s, and it still changes by a part "
                    "of %.3g",
                    nmm_solve_end_name(solver.report.end), change);
}

static double error_of(const study *s, const double *u) {
    double sum = 0;
    for (int i = 0; i < s->captured.unknowns; i++) {
        const double off = u[i] - s->exact[i];
        sum += off * off;
    }
    return sqrt(sum) / s->norm;
}

// next = u + D^-1 (f - K u) with the 2x2 blocks D of the diagonal.
static void sweep_plain(const nmm_linear *s, const double *u, double *next) {
    for (int row = 0; row < s->K.n_row; row++) {
        double r0 = s->f[2 * row], r1 = s->f[2 * row + 1];
        for (int k = s->K.row_start[row]; k < s->K.row_start[row + 1]; k++) {
            const double *v = s->K.value + 4 * (long)k, *x = u + 2 * (long)s->K.col[k];
            r0 -= v[0] * x[0] + v[1] * x[1];
            r1 -= v[2] * x[0] + v[3] * x[1];
        }
        const double *d = s->K.value + 4 * (long)s->K.diagonal[row];
        const double determinant = d[0] * d[3] - d[1] * d[2];
        next[2 * row] = u[2 * row] + (d[3] * r0 - d[1] * r1) / determinant;
        next[2 * row + 1] = u[2 * row + 1] + (d[0] * r1 - d[2] * r0) / determinant;
    }
}

// Plain Jacobi is swept here: the solver gives it up as soon as it is known to diverge, and this
// picture is to show what happens then.
static nmm_status measure_plain(nmm_bench *bench, study *s, int iterations) {
    const int n = s->captured.unknowns;
    if (s->plain == NULL) {
        TRY(nmm_allocate(&bench->context, &s->plain, 2 * (size_t)n, sizeof(double)));
    }
    for (; s->n_plain < iterations; s->n_plain++) {
        const long now = s->n_plain % 2 * (long)n, then = n - now;
        sweep_plain(&s->captured.system, s->plain + now, s->plain + then);
    }
    const double error = error_of(s, s->plain + s->n_plain % 2 * (long)n);
    s->ended[PLAIN_WAY] = !(error > SMALL && error < LARGE);
    if (isfinite(error)) nmm_bench_set(bench, PLAIN, error);
    return NMM_OK;
}

static nmm_status measure_method(nmm_bench *bench, study *s, int m, int iterations) {
    nmm_bench_solver *solver = &s->solver[m];
    if (s->ended[m]) return NMM_OK;
    if (m == PLAIN_WAY) return measure_plain(bench, s, iterations);
    if (solver->solver == NULL) {
        TRY(nmm_bench_solver_open(bench, solver, &s->captured, false));
        solver->options = (nmm_solve_options){.method = way[m].method,
                                              .blocks = way[m].blocks,
                                              .sor_factor = 1.9,
                                              .tolerance = 1e-16,
                                              .place = s->captured.options.place,
                                              .body = s->captured.options.body,
                                              .n_thread = 1,
                                              .keep_last = true};
    }
    solver->options.max_iterations = iterations;
    TRY(nmm_bench_solve(bench, solver, &s->captured));
    // It ended by itself: diverged, or at the bounds of rounding.
    s->ended[m] = solver->report.iterations != iterations;
    const double error = error_of(s, s->captured.system.u);
    if (!isfinite(error) || s->ended[m]) return NMM_OK;
    nmm_bench_set(bench, SOR + m, error);
    s->ended[m] = error < SMALL || error > LARGE;
    return NMM_OK;
}

static nmm_status measure_curves(nmm_bench *bench, study *s) {
    const int most = bench->def.quick ? MOST_QUICK : MOST;
    bool all_ended = false;
    for (int k = 1; k <= most && !all_ended; k = nmm_max_int(k + 1, (int)(1.15 * k))) {
        if (!nmm_bench_goes_on(bench, "fig6: %d iterations", k)) return NMM_OK;
        TRY(nmm_bench_add(bench));
        nmm_bench_set(bench, ITERATION, k);
        all_ended = true;
        for (int m = 0; m < METHODS; m++) {
            TRY(measure_method(bench, s, m, k));
            all_ended = all_ended && s->ended[m];
        }
        nmm_bench_done(bench);
    }
    return NMM_OK;
}

// --- What follows

// First iteration from which on the error stays below a limit; 0: none.
static double first_below(const nmm_bench *bench, int column, double limit) {
    double first = 0;
    for (int row = 0; row < bench->n_row; row++) {
        const double error = nmm_bench_number(bench, row, column);
        if (!isfinite(error)) continue;
        if (error > limit)
            first = 0;
        else if (first == 0)
            first = nmm_bench_number(bench, row, ITERATION);
    }
    return first;
}

static nmm_status conclude(nmm_bench *bench) {
    for (int column = SOR; column < N_COLUMN && bench->n_row > 0; column++) {
        const double some = first_below(bench, column, 1e-3),
                     many = first_below(bench, column, 1e-6);
        double largest = 0;
        for (int row = 0; row < bench->n_row; row++) {
            const double error = nmm_bench_number(bench, row, column);
            if (isfinite(error)) largest = nmm_max(largest, error);
        }
        const char *title = columns[column].title;
        if (some > 0 && many > 0)
            TRY(nmm_bench_remark(bench, "%s: error 1e-3 at iteration %g, 1e-6 at %g.", title, some,
                                 many));
        else if (some > 0)
            TRY(nmm_bench_remark(bench, "%s: error 1e-3 at iteration %g, 1e-6 is not reached.",
                                 title, some));
        else if (largest > 10)
            TRY(nmm_bench_remark(bench, "%s diverges.", title));
        else
            TRY(nmm_bench_remark(bench, "%s: error 1e-3 is not reached.", title));
    }
    return NMM_OK;
}

// The tunnel; where it is not in the folder, the largest scene there.
static nmm_status choose_scene(nmm_bench *bench, const char **path) {
    nmm_bench_scenes scenes = {0};
    const nmm_status status = nmm_bench_find_scenes(bench, &scenes);
    const nmm_bench_scene *chosen = scenes.n > 0 ? &scenes.scene[scenes.n - 1] : NULL;
    for (int i = 0; i < scenes.n; i++)
        if (strcmp(scenes.scene[i].name, TUNNEL) == 0) chosen = &scenes.scene[i];
    if (status == NMM_OK) *path = chosen->path;
    const nmm_status said = status == NMM_OK
                                ? nmm_bench_remark(bench, "System: step %d of %s, %d unknowns.",
                                                   STEP_OF_SYSTEM, chosen->name, chosen->unknowns)
                                : status;
    nmm_release(&bench->context, &scenes.scene);
    return said;
}

static nmm_status measure(nmm_bench *bench) {
    study s = {0};
    nmm_bench_source source = {.n_thread = 1, .device = NMM_DEVICE_HOST};
    TRY(choose_scene(bench, &source.path));
    nmm_status status = nmm_bench_capture(bench, &source, STEP_OF_SYSTEM, &s.captured);
    if (status == NMM_OK) status = solve_exactly(bench, &s);
    if (status == NMM_OK) status = measure_curves(bench, &s);
    for (int m = 0; m < METHODS; m++)
        nmm_bench_solver_close(bench, &s.solver[m]);
    nmm_release(&bench->context, &s.plain);
    nmm_release(&bench->context, &s.exact);
    nmm_bench_system_destroy(bench, &s.captured);
    return status == NMM_OK ? conclude(bench) : status;
}

static nmm_status draw(nmm_bench *bench, const char *path) {
    nmm_chart_series series[METHODS] = {{0}};
    for (int m = 0; m < METHODS; m++) {
        TRY(nmm_bench_series(bench, &series[m], ITERATION, SOR + m, NULL));
        series[m].name = columns[SOR + m].title;
    }
    const nmm_chart_panel panel = {.x = {"iteration", true, 0, 0},
                                   .y = {"relative error", true, 1e-12, 1e3},
                                   .n_series = METHODS,
                                   .series = series};
    const nmm_chart chart = {.title = "Figure 6: error against iteration",
                             .subtitle = nmm_bench_note(bench, 0),
                             .n_panel = 1,
                             .panel = &panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_fig6 = {
    .name = {"fig6", "error against iteration of each method at one step of a tunnel", 1},
    .title = "Figure 6: relative error against iteration",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
