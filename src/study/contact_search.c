// SPDX-License-Identifier: MIT
//
// Time of the contact search against the number of blocks, from 10^2 of them to 10^5 with 10^6
// edges: walls of bricks whose points shake a little in each step, so that the index is used, as in
// a run; now and then the wall is shifted as a whole, and the index has to be made anew.
//
// Only the search is measured: no system is assembled or solved. The numbers of threads take turns
// on one wall; medians are reported.

#include "bench.h"

#include <math.h>

/// Times the index is made anew, and steps with it after each; for walls of up to so many blocks.
enum { ROUNDS = 5, STEPS = 5, MANY = 50000, ROUNDS_OF_MANY = 2, STEPS_OF_MANY = 3 };

/// A step shakes each point by this much, and the search reaches so far [m].
#define SHAKE 2e-5
#define REACH 0.02

enum {
    BLOCKS,
    EDGES,
    CONTACTS,
    THREADS,
    STEP,
    PER_BLOCK,
    INDEX,
    INDEX_PER_BLOCK,
    BYTES,
    DEVICE,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [BLOCKS] = {"blocks", "blocks", "", 0, 0},
    [EDGES] = {"edges", "edges", "", 0, 0},
    [CONTACTS] = {"contacts", "contacts", "", 0, 0},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [STEP] = {"step_ms", "a step", "ms", 0, 3},
    [PER_BLOCK] = {"step_us_per_block", "a block", "us", 0, 3},
    [INDEX] = {"index_ms", "with new index", "ms", 0, 3},
    [INDEX_PER_BLOCK] = {"index_us_per_block", "a block", "us", 0, 3},
    [BYTES] = {"bytes_per_block", "bytes a block", "", 0, 0},
    [DEVICE] = {"device", "device", "", 1, 0},
    [N_COLUMN] = {0},
};

/// Seconds by thread count: searches with the index as it is, and with a new one.
typedef struct times {
    double step[NMM_BENCH_THREADS][ROUNDS * STEPS], index[NMM_BENCH_THREADS][ROUNDS];
    int n_step, n_index;
} times;

static void shake(nmm_sim *sim, nmm_random *random) {
    for (int i = 0; i < 2 * sim->model.n_point; i++)
        sim->state.position[i] += SHAKE * (nmm_random_unit(random) - 0.5);
}

// Farther than any index reaches; to and fro.
static void shift(nmm_sim *sim, int round) {
    for (int i = 0; i < sim->model.n_point; i++)
        sim->state.position[2 * i] += round % 2 == 0 ? 10 : -10;
}

static nmm_status search_once(nmm_bench *bench, nmm_sim *sim, double *seconds) {
    const double start = nmm_clock();
    const nmm_status status =
        nmm_contact_find(&sim->context, sim->search, &sim->model, &sim->state, REACH);
    *seconds = nmm_clock() - start;
    if (status != NMM_OK) bench->context.error = sim->context.error;
    return status;
}

static nmm_status measure_rounds(nmm_bench *bench, nmm_sim *sim, times *t) {
    const bool many = sim->model.n_block > MANY;
    const int rounds = bench->def.quick ? 1 : many ? ROUNDS_OF_MANY : ROUNDS;
    const int steps = many ? STEPS_OF_MANY : STEPS;
    nmm_random random = nmm_random_seed(1);
    double first = 0;
    TRY(search_once(bench, sim, &first));
    for (int round = 0; round < rounds; round++) {
        for (int k = 0; k < bench->n_thread; k++) {
            sim->context.n_thread = bench->thread[k];
            shift(sim, round * bench->n_thread + k);
            TRY(search_once(bench, sim, &t->index[k][round]));
            for (int i = 0; i < steps; i++) {
                shake(sim, &random);
                TRY(search_once(bench, sim, &t->step[k][round * steps + i]));
            }
        }
    }
    t->n_index = rounds;
    t->n_step = rounds * steps;
    return NMM_OK;
}

static nmm_status write_row(nmm_bench *bench, const nmm_sim *sim, times *t, int k, double bytes) {
    const int n = sim->model.n_block;
    const double step = nmm_bench_median(t->n_step, t->step[k]);
    const double index = nmm_bench_median(t->n_index, t->index[k]);
    TRY(nmm_bench_add(bench));
    nmm_bench_set(bench, BLOCKS, n);
    nmm_bench_set(bench, EDGES, sim->model.n_vertex);
    nmm_bench_set(bench, CONTACTS, sim->state.n_contact);
    nmm_bench_set(bench, THREADS, bench->thread[k]);
    nmm_bench_set(bench, STEP, 1e3 * step);
    nmm_bench_set(bench, PER_BLOCK, 1e6 * step / n);
    nmm_bench_set(bench, INDEX, 1e3 * index);
    nmm_bench_set(bench, INDEX_PER_BLOCK, 1e6 * index / n);
    nmm_bench_set(bench, BYTES, floor(bytes / n));
    TRY(nmm_bench_say_machine(bench, DEVICE, false));
    nmm_bench_done(bench);
    return NMM_OK;
}

static nmm_status measure_rows(nmm_bench *bench, nmm_sim *sim) {
    times t = {.n_step = 0};
    const size_t before = sim->context.live_bytes;
    TRY(measure_rounds(bench, sim, &t));
    const double bytes = (double)(sim->context.live_bytes - before);
    for (int k = 0; k < bench->n_thread; k++)
        TRY(write_row(bench, sim, &t, k, bytes));
    return NMM_OK;
}

// A wall about as high as wide; its loops carry the points where the lattice of covers cuts them.
static nmm_status measure_wall(nmm_bench *bench, int blocks) {
    const int columns_of_wall = nmm_max_int(2, (int)(sqrt(0.5 * blocks) + 0.5));
    const int courses = nmm_max_int(1, (int)((double)blocks / columns_of_wall + 0.5));
    nmm_bench_source source = {.path = "wall", .n_thread = 1, .device = NMM_DEVICE_HOST};
    nmm_sim *sim = NULL;
    if (!nmm_bench_goes_on(bench, "contact: %d blocks", blocks)) return NMM_OK;
    TRY(nmm_bench_wall_text(bench, &source.text, columns_of_wall, courses, "{size: 1.2}"));
    nmm_status status = nmm_bench_open(bench, &sim, &source);
    if (status == NMM_OK) status = measure_rows(bench, sim);
    nmm_bench_close(&sim);
    return status;
}

static nmm_status conclude(nmm_bench *bench) {
    for (int i = 0; i < bench->n_thread && bench->n_row > 0; i++) {
        const nmm_bench_filter filter[2] = {{THREADS, NULL, bench->thread[i]}, {0}};
        nmm_chart_series all = {0}, anew = {0};
        TRY(nmm_bench_series(bench, &all, BLOCKS, STEP, filter));
        TRY(nmm_bench_series(bench, &anew, BLOCKS, INDEX, filter));
        if (all.n < 2) continue;
        TRY(nmm_bench_remark(bench,
                             "Time of a step's search with %d thread%s grows with the number of "
                             "blocks to the power %.2f, with a new index %.2f.",
                             bench->thread[i], bench->thread[i] > 1 ? "s" : "",
                             nmm_bench_exponent(&all, 0), nmm_bench_exponent(&anew, 0)));
    }
    return NMM_OK;
}

static nmm_status measure(nmm_bench *bench) {
    static const int sizes[] = {100, 300, 1000, 3000, 10000, 30000, 111000};
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
    .name = {"contact", "contact search against the number of blocks, up to 10^6 edges", 0},
    .title = "Contact search: brick walls that shake",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
