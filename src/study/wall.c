// SPDX-License-Identifier: MIT
//
// A brick wall in running bond, one cover for each block, as in discontinuous deformation analysis:
// milliseconds a step on one thread beside those of a public program of that method.
//
// 1 x 0.5 m bricks on a fixed base, E 1e9, density 2500, friction 30 degrees, dt 1e-3; from the
// sudden start of gravity on. Growth is fitted to the first steps, which walls of all sizes make,
// with and without the very first one: that waits for memory, which the machine has to hand out.
// Runs shorter than a second are made five times, and the middle one counts.

#include "bench.h"

#include <math.h>
#include <stdlib.h>

#define COVERS "{mesh: block}"

/// Balance of forces that ends a step: as it comes, and what nine of ten steps have at least where
/// a step ends as soon as no contact changes its mode, all that other programs of the method ask.
static const struct {
    double tolerance;
    const char *setting, *name;
} balance[] = {{1e-6, "analysis.tolerance=1e-6", "ours"},
               {1e-3, "analysis.tolerance=1e-3", "ours, balance 1e-3"}};
enum { N_BALANCE = sizeof balance / sizeof *balance };

/// Steps in all; those that growth is fitted to; from which size on.
enum { STEPS = 100, FIRST_STEPS = 10, FIRST_STEPS_QUICK = 2, LARGEST = 200, FITTED_FROM = 200 };

/// Runs of which the middle one counts, where one is shorter than this [s].
enum { ROUNDS = 5 };
#define SHORT 1.0

/// Columns and courses of a square wall, and what a public program takes a step [ms]; 0: not known.
static const struct {
    int side;
    double public_ms;
} wall[] = {{4, 0.16}, {8, 1.8}, {16, 8.4}, {32, 149}, {45, 461}, {64, 0}, {LARGEST, 0}};

enum {
    BLOCKS,
    UNKNOWNS,
    CONTACTS,
    THREADS,
    BALANCE,
    STEPS_DONE,
    STEP,
    FIRST_STEP,
    NEXT,
    FIRST,
    CONTACT,
    ASSEMBLY,
    SOLVER,
    REST,
    PASSES,
    PUBLIC,
    PART,
    CUTS,
    DEVICE,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [BLOCKS] = {"blocks", "blocks", "", 0, 0},
    [UNKNOWNS] = {"unknowns", "unknowns", "", 0, 0},
    [CONTACTS] = {"contacts", "contacts", "", 0, 0},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [BALANCE] = {"balance", "balance", "", 0, 1},
    [STEPS_DONE] = {"steps", "steps", "", 0, 0},
    [STEP] = {"step_ms", "a step", "ms", 0, 3},
    [FIRST_STEP] = {"first_step_ms", "first step", "ms", 0, 3},
    [NEXT] = {"next_steps_ms", "next steps", "ms", 0, 3},
    [FIRST] = {"first_steps_ms", "first steps", "ms", 0, 3},
    [CONTACT] = {"contact_ms", "contact", "ms", 0, 3},
    [ASSEMBLY] = {"assembly_ms", "assembly", "ms", 0, 3},
    [SOLVER] = {"solver_ms", "solver", "ms", 0, 3},
    [REST] = {"rest_ms", "rest", "ms", 0, 3},
    [PASSES] = {"passes", "passes", "", 0, 2},
    [PUBLIC] = {"public_dda_ms", "public DDA", "ms", 0, 3},
    [PART] = {"part_of_public_dda", "part of it", "", 0, 2},
    [CUTS] = {"cuts", "cuts", "", 0, 0},
    [DEVICE] = {"device", "device", "", 1, 0},
    [N_COLUMN] = {0},
};

/// Parts of a run: the very first step, those up to the last of the first ones, the others.
enum { PARTS = 3 };

static nmm_status write_row(nmm_bench *bench, nmm_sim *sim, int k, int b,
                            const nmm_bench_timing run[PARTS]) {
    nmm_summary summary;
    nmm_sim_summary(sim, &summary);
    // Steps and phases of a part are those from the start to its end.
    const double steps = (double)run[2].steps, first = (double)run[1].steps;
    const double of_first = run[0].seconds + run[1].seconds;
    const double ms = 1e3 * (of_first + run[2].seconds) / steps;
    TRY(nmm_bench_add(bench));
    nmm_bench_set(bench, BLOCKS, summary.blocks);
    nmm_bench_set(bench, UNKNOWNS, summary.unknowns);
    nmm_bench_set(bench, CONTACTS, summary.contacts);
    nmm_bench_set(bench, THREADS, sim->context.n_thread);
    nmm_bench_set(bench, BALANCE, balance[b].tolerance);
    nmm_bench_set(bench, PASSES, (double)summary.open_close_iterations / (double)summary.steps);
    nmm_bench_set(bench, STEPS_DONE, steps);
    nmm_bench_set(bench, STEP, ms);
    nmm_bench_set(bench, FIRST_STEP, 1e3 * run[0].seconds);
    nmm_bench_set(bench, NEXT, 1e3 * run[1].seconds / (first - 1));
    nmm_bench_set(bench, FIRST, 1e3 * of_first / first);
    double rest = ms;
    for (int phase = 0; phase < NMM_PHASE_REST; phase++) {
        nmm_bench_set(bench, CONTACT + phase, 1e3 * run[2].phase[phase] / steps);
        rest -= 1e3 * run[2].phase[phase] / steps;
    }
    nmm_bench_set(bench, REST, rest);
    if (wall[k].public_ms > 0) {
        nmm_bench_set(bench, PUBLIC, wall[k].public_ms);
        nmm_bench_set(bench, PART, ms / wall[k].public_ms);
    }
    nmm_bench_set(bench, CUTS, (double)summary.dt_cuts);
    TRY(nmm_bench_say_machine(bench, DEVICE, summary.on_device));
    nmm_bench_done(bench);
    return NMM_OK;
}

typedef struct parts {
    nmm_bench_timing run[PARTS];
    double seconds;
} parts;

static int compare_parts(const void *a, const void *b) {
    const double x = ((const parts *)a)->seconds, y = ((const parts *)b)->seconds;
    return (x > y) - (x < y);
}

static nmm_status run_wall(nmm_bench *bench, const nmm_bench_source *source, bool is_short,
                           nmm_sim **sim, parts *done) {
    const int first = bench->def.quick ? FIRST_STEPS_QUICK : FIRST_STEPS;
    const nmm_bench_limit limit[PARTS] = {
        {.steps = 1}, {.steps = first}, {.steps = is_short ? first + 1 : STEPS}};
    nmm_status status = nmm_bench_open(bench, sim, source);
    done->seconds = 0;
    for (int part = 0; part < PARTS && status == NMM_OK; part++) {
        status = nmm_bench_steps(bench, *sim, limit[part], &done->run[part]);
        done->seconds += done->run[part].seconds;
    }
    return status;
}

static nmm_status measure_wall(nmm_bench *bench, int k, int b, int n_thread) {
    const int side = wall[k].side;
    const bool is_short = bench->def.quick || side == LARGEST;
    nmm_bench_source source = {.path = "wall",
                               .n_thread = n_thread,
                               .device = NMM_DEVICE_HOST,
                               .n_override = 1,
                               .override = {balance[b].setting}};
    parts done[ROUNDS] = {0};
    nmm_status status = NMM_OK;
    nmm_sim *sim = NULL;
    int n = 0;
    if (bench->def.device == NMM_DEVICE_TARGET) source.device = NMM_DEVICE_TARGET;
    TRY(nmm_bench_wall_text(bench, &source.text, side, side, COVERS));
    do {
        nmm_bench_close(&sim);
        status = run_wall(bench, &source, is_short, &sim, &done[n++]);
    } while (status == NMM_OK && n < ROUNDS && !bench->def.quick && done[0].seconds < SHORT);
    qsort(done, (size_t)n, sizeof *done, compare_parts);
    if (status == NMM_OK) status = write_row(bench, sim, k, b, done[n / 2].run);
    nmm_bench_close(&sim);
    return status;
}

static nmm_status conclude_growth(nmm_bench *bench, int n_thread, int column, const char *what) {
    const nmm_bench_filter filter[2] = {{THREADS, NULL, n_thread},
                                        {BALANCE, NULL, balance[0].tolerance}};
    nmm_chart_series series = {0};
    TRY(nmm_bench_series(bench, &series, BLOCKS, column, filter));
    const double exponent = nmm_bench_exponent(&series, FITTED_FROM);
    if (!isfinite(exponent)) return NMM_OK;
    return nmm_bench_remark(bench,
                            "Time of %s with %d thread%s grows with the number of blocks to the "
                            "power %.2f, from %d blocks on.",
                            what, n_thread, n_thread > 1 ? "s" : "", exponent, FITTED_FROM);
}

static nmm_status conclude(nmm_bench *bench) {
    for (int i = 0; i < bench->n_thread && bench->n_row > 0; i++) {
        TRY(conclude_growth(bench, bench->thread[i], NEXT, "the steps after the first one"));
        TRY(conclude_growth(bench, bench->thread[i], FIRST, "the first steps, that one included,"));
    }
    return NMM_OK;
}

static nmm_status measure(nmm_bench *bench) {
    const int n = bench->def.quick ? 3 : (int)(sizeof wall / sizeof *wall);
    // The figures to compare with are those of one core.
    if (bench->def.n_thread == 0) bench->n_thread = 1;
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < N_BALANCE * bench->n_thread; i++) {
            const int n_thread = bench->thread[i / N_BALANCE];
            if (!nmm_bench_goes_on(bench, "wall: %d x %d bricks, %d threads", wall[k].side,
                                   wall[k].side, n_thread))
                return conclude(bench);
            TRY(measure_wall(bench, k, i % N_BALANCE, n_thread));
        }
    }
    return conclude(bench);
}

static nmm_status draw(nmm_bench *bench, const char *path) {
    nmm_chart_series series[N_BALANCE * NMM_BENCH_THREADS + 2] = {{0}};
    int n = 0;
    TRY(nmm_bench_series(bench, &series[n], BLOCKS, PUBLIC, NULL));
    series[n++].name = "a public DDA, one core";
    for (int i = 0; i < N_BALANCE * bench->n_thread; i++) {
        const int n_thread = bench->thread[i / N_BALANCE];
        const nmm_bench_filter filter[2] = {{THREADS, NULL, n_thread},
                                            {BALANCE, NULL, balance[i % N_BALANCE].tolerance}};
        TRY(nmm_bench_series(bench, &series[n], BLOCKS, STEP, filter));
        TRY(nmm_bench_words(bench, &series[n++].name, "%s, %d thread%s",
                            balance[i % N_BALANCE].name, n_thread, n_thread > 1 ? "s" : ""));
    }
    const double y0 = nmm_bench_number(bench, 0, STEP);
    const double x[2] = {19, 190000}, y[2] = {y0, 1e4 * y0};
    series[n++] = (nmm_chart_series){"slope 1", x, y, 2, NMM_CHART_SLOPE};
    const nmm_chart_panel panel = {.x = {"blocks", true, 0, 0},
                                   .y = {"a step [ms]", true, 0, 0},
                                   .n_series = n,
                                   .series = series};
    const nmm_chart chart = {.title = "Brick wall: time of a step",
                             .subtitle = nmm_bench_note(bench, 0),
                             .n_panel = 1,
                             .panel = &panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_wall = {
    .name = {"wall", "a brick wall, one cover a block, beside a public DDA program", 0},
    .title = "Brick wall in running bond, one cover for each block",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
