// SPDX-License-Identifier: MIT
//
// Time of the contact search against the number of blocks, 10^2 to 10^5 of them with up to 10^6
// edges: walls of bricks whose points shake a little in each step, so that the index is used, and
// now and then made anew, as in a run.
//
// Only the search is measured: no system is assembled or solved.

#include "bench.h"

#include <math.h>

/// Steps of each wall, after a first one that makes the index.
enum { STEPS = 20, STEPS_QUICK = 4 };

/// A step shakes each point by this much, and the search reaches so far [m].
#define SHAKE 1e-3
#define REACH 0.02

enum { BLOCKS, EDGES, CONTACTS, THREADS, FIRST, STEP, PER_BLOCK, SLOWEST, BYTES, DEVICE, N_COLUMN };

static const nmm_bench_column columns[] = {
    [BLOCKS] = {"blocks", "blocks", "", 0, 0},
    [EDGES] = {"edges", "edges", "", 0, 0},
    [CONTACTS] = {"contacts", "contacts", "", 0, 0},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [FIRST] = {"first_ms", "first search", "ms", 0, 3},
    [STEP] = {"step_ms", "step, mean", "ms", 0, 3},
    [PER_BLOCK] = {"step_us_per_block", "per block", "us", 0, 3},
    [SLOWEST] = {"slowest_ms", "slowest step", "ms", 0, 3},
    [BYTES] = {"bytes_per_block", "bytes a block", "", 0, 0},
    [DEVICE] = {"device", "device", "", 1, 0},
    [N_COLUMN] = {0},
};

static void shake(nmm_sim *sim, nmm_random *random) {
    for (int i = 0; i < 2 * sim->model.n_point; i++)
        sim->state.position[i] += SHAKE * (nmm_random_unit(random) - 0.5);
}

static nmm_status search_once(nmm_bench *bench, nmm_sim *sim, double *seconds) {
    const double start = nmm_clock();
    const nmm_status status =
        nmm_contact_find(&sim->context, sim->search, &sim->model, &sim->state, REACH);
    *seconds = nmm_clock() - start;
    if (status != NMM_OK) bench->context.error = sim->context.error;
    return status;
}

static nmm_status measure_threads(nmm_bench *bench, nmm_sim *sim, int n_thread, double bytes) {
    const int steps = bench->def.quick ? STEPS_QUICK : STEPS;
    nmm_random random = nmm_random_seed(1);
    double first = 0, sum = 0, slowest = 0;
    const char *device = NULL;
    sim->context.n_thread = n_thread;
    TRY(search_once(bench, sim, &first));
    for (int k = 0; k < steps; k++) {
        double seconds = 0;
        shake(sim, &random);
        TRY(search_once(bench, sim, &seconds));
        sum += seconds;
        slowest = nmm_max(slowest, seconds);
    }
    const int n = sim->model.n_block;
    TRY(nmm_bench_add(bench));
    nmm_bench_set(bench, BLOCKS, n);
    nmm_bench_set(bench, EDGES, sim->model.n_vertex);
    nmm_bench_set(bench, CONTACTS, sim->state.n_contact);
    nmm_bench_set(bench, THREADS, n_thread);
    nmm_bench_set(bench, FIRST, 1e3 * first);
    nmm_bench_set(bench, STEP, 1e3 * sum / steps);
    nmm_bench_set(bench, PER_BLOCK, 1e6 * sum / steps / n);
    nmm_bench_set(bench, SLOWEST, 1e3 * slowest);
    nmm_bench_set(bench, BYTES, floor(((double)sim->context.live_bytes - bytes) / n));
    TRY(nmm_bench_host(bench, &device));
    TRY(nmm_bench_say(bench, DEVICE, device));
    nmm_bench_done(bench);
    return NMM_OK;
}

// A wall about as high as wide; its loops carry the points where the lattice of covers cuts them.
static nmm_status measure_wall(nmm_bench *bench, int blocks) {
    const int columns_of_wall = nmm_max_int(2, (int)(sqrt(0.5 * blocks) + 0.5));
    const int courses = nmm_max_int(1, (int)((double)blocks / columns_of_wall + 0.5));
    for (int i = 0; i < bench->n_thread; i++) {
        nmm_bench_source source = {
            .path = "wall", .n_thread = bench->thread[i], .device = NMM_DEVICE_HOST};
        nmm_sim *sim = NULL;
        if (!nmm_bench_goes_on(bench, "contact: %d blocks, %d threads", blocks, bench->thread[i]))
            return NMM_OK;
        TRY(nmm_bench_wall_text(bench, &source.text, columns_of_wall, courses, "{size: 1.2}"));
        nmm_status status = nmm_bench_open(bench, &sim, &source);
        if (status == NMM_OK)
            status = measure_threads(bench, sim, bench->thread[i], (double)sim->context.live_bytes);
        nmm_bench_close(&sim);
        TRY(status);
    }
    return NMM_OK;
}

static nmm_status conclude(nmm_bench *bench) {
    for (int i = 0; i < bench->n_thread && bench->n_row > 0; i++) {
        const nmm_bench_filter filter[2] = {{THREADS, NULL, bench->thread[i]}, {0}};
        nmm_chart_series all = {0};
        TRY(nmm_bench_series(bench, &all, BLOCKS, STEP, filter));
        if (all.n < 2) continue;
        TRY(nmm_bench_remark(bench,
                             "Time of a step's search with %d thread%s grows with the number of "
                             "blocks to the power %.2f.",
                             bench->thread[i], bench->thread[i] > 1 ? "s" : "",
                             nmm_bench_exponent(&all, 0)));
    }
    return NMM_OK;
}

static nmm_status measure(nmm_bench *bench) {
    static const int sizes[] = {100, 300, 1000, 3000, 10000, 30000, 100000};
    const int n = bench->def.quick ? 3 : 7;
    for (int i = 0; i < n && !bench->stopped; i++)
        TRY(measure_wall(bench, sizes[i]));
    return conclude(bench);
}

static nmm_status draw(nmm_bench *bench, const char *path) {
    nmm_chart_series series[NMM_BENCH_THREADS + 2] = {{0}};
    int n = 0;
    for (; n < bench->n_thread; n++) {
        const nmm_bench_filter filter[2] = {{THREADS, NULL, bench->thread[n]}, {0}};
        TRY(nmm_bench_series(bench, &series[n], BLOCKS, STEP, filter));
        TRY(nmm_bench_words(bench, &series[n].name, "%d thread%s", bench->thread[n],
                            bench->thread[n] > 1 ? "s" : ""));
    }
    // What all pairs would cost from the first point on, and what growth in proportion costs.
    const double x0 = nmm_bench_number(bench, 0, BLOCKS), y0 = nmm_bench_number(bench, 0, STEP);
    const double x[2] = {x0, 1000 * x0}, one[2] = {y0, 1e3 * y0}, two[2] = {y0, 1e6 * y0};
    series[n++] =
        (nmm_chart_series){"slope 1, and slope 2 as of all pairs", x, one, 2, NMM_CHART_SLOPE};
    series[n++] = (nmm_chart_series){NULL, x, two, 2, NMM_CHART_SLOPE};
    const nmm_chart_panel panel = {.x = {"blocks", true, 0, 0},
                                   .y = {"contact search of a step [ms]", true, 0, 0},
                                   .n_series = n,
                                   .series = series};
    const nmm_chart chart = {.title = "Contact search: growth with the number of blocks",
                             .subtitle = nmm_bench_note(bench, 0),
                             .n_panel = 1,
                             .panel = &panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_contact = {
    .name = {"contact", "contact search against the number of blocks, up to 100 000", 0},
    .title = "Contact search: brick walls that shake",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
