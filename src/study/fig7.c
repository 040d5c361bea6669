// SPDX-License-Identifier: MIT
//
// Figure 7: how many times faster than the optimised serial method (SOR with factor 1.9) one solve
// is, against the order of the system, for each number of threads and on the target; for each scene
// as it is and with ten times its unknowns, as nearly as the size of its covers allows.
//
// The systems are those of an early step, tolerances as the run asks for them. Each method keeps
// its solver over its solves, as a run does, but makes blocks and factors anew each time. Solves
// take turns; medians are reported.

#include "bench.h"

#include <math.h>
#include <string.h>

#define STEP_OF_SYSTEM 3

/// Solves of each method; solves before them, in which `auto` finds its way; work that SOR may do
/// in one solve [blocks of the matrix].
enum { REPEATS = 5, TRIES = 4, LONG_REPEATS = 1 };
#define MOST_WORK 2e9
#define MOST_WORK_QUICK 5e7
#define LONG_SOLVE 0.5
#define SHORT_SOLVE 0.01

#define NOT_ON_GPU "not run on a GPU"

enum {
    SCENE,
    TIMES,
    ORDER,
    DEVICE,
    THREADS,
    METHOD,
    SOR_MS,
    SERIAL_MS,
    MS,
    SPEEDUP,
    OVER_SERIAL,
    SOR_ITERATIONS,
    ITERATIONS,
    END,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [SCENE] = {"scene", "scene", "", 1, 0},
    [TIMES] = {"times", "times", "", 0, 0},
    [ORDER] = {"order", "order", "", 0, 0},
    [DEVICE] = {"device", "device", "", 1, 0},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [METHOD] = {"method", "method", "", 1, 0},
    [SOR_MS] = {"sor_ms", "SOR", "ms", 0, 3},
    [SERIAL_MS] = {"serial_ms", "our serial", "ms", 0, 3},
    [MS] = {"ms", "ours", "ms", 0, 3},
    [SPEEDUP] = {"speedup_over_sor", "over SOR", "", 0, 3},
    [OVER_SERIAL] = {"speedup_over_serial", "over serial", "", 0, 3},
    [SOR_ITERATIONS] = {"sor_iterations", "SOR it.", "", 0, 0},
    [ITERATIONS] = {"iterations", "it.", "", 0, 0},
    [END] = {"end", "end", "", 1, 0},
    [N_COLUMN] = {0},
};

/// Ways to solve one system: SOR, ours by threads, the target.
enum { MOST_WAYS = NMM_BENCH_THREADS + 3 };
typedef struct way {
    nmm_bench_solver solver;
    double seconds[REPEATS];
    int n;
    double median;
    int n_thread;
    bool on_target;
} way;

typedef struct contest {
    nmm_bench_system captured;
    int n_way;
    way way[MOST_WAYS];
} contest;

static bool solved(const way *w) {
    return w->solver.report.end == NMM_SOLVE_CONVERGED;
}

static nmm_status open_way(nmm_bench *bench, contest *c, int n_thread, bool on_target) {
    way *w = &c->way[c->n_way++];
    TRY(nmm_bench_solver_open(bench, &w->solver, &c->captured, on_target));
    w->on_target = on_target;
    w->n_thread = n_thread;
    w->solver.options.n_thread = n_thread;
    w->solver.options.method = NMM_SOLVE_AUTO;
    w->solver.options.blocks = NMM_BLOCKS_AUTO;
    return NMM_OK;
}

// SOR first, then ours on one thread, whatever thread counts were asked for.
static nmm_status open_ways(nmm_bench *bench, contest *c) {
    const double work = bench->def.quick ? MOST_WORK_QUICK : MOST_WORK;
    TRY(open_way(bench, c, 1, false));
    nmm_solve_options *sor = &c->way[0].solver.options;
    sor->method = NMM_SOLVE_SOR;
    sor->sor_factor = 1.9;
    const nmm_bsr *K = &c->captured.system.K;
    const double most = work / nmm_max_int(1, K->row_start[K->n_row]);
    sor->max_iterations = (int)nmm_max(100, nmm_min(1e6, most));
    TRY(open_way(bench, c, 1, false));
    for (int i = 0; i < bench->n_thread; i++)
        if (bench->thread[i] > 1) TRY(open_way(bench, c, bench->thread[i], false));
    return bench->target ? open_way(bench, c, 1, true) : NMM_OK;
}

static nmm_status solve_ways(nmm_bench *bench, contest *c) {
    for (int k = 1; k < c->n_way; k++)
        for (int i = 0; i < TRIES; i++)
            TRY(nmm_bench_solve(bench, &c->way[k].solver, &c->captured));
    for (int round = 0; round < REPEATS; round++) {
        for (int k = 0; k < c->n_way; k++) {
            way *w = &c->way[k];
            const bool is_long = w->n >= LONG_REPEATS && w->seconds[0] > LONG_SOLVE;
            if (is_long || (bench->def.quick && round > 0)) continue;
            // A short one right before it, so that each finds its data in the caches.
            if (w->solver.seconds < SHORT_SOLVE)
                TRY(nmm_bench_solve(bench, &w->solver, &c->captured));
            TRY(nmm_bench_solve(bench, &w->solver, &c->captured));
            w->seconds[w->n++] = w->solver.seconds;
        }
    }
    for (int k = 0; k < c->n_way; k++)
        c->way[k].median = nmm_bench_median(c->way[k].n, c->way[k].seconds);
    return NMM_OK;
}

// --- Rows

static nmm_status begin_row(nmm_bench *bench, const nmm_bench_scene *scene, const contest *c,
                            int times) {
    TRY(nmm_bench_add(bench));
    TRY(nmm_bench_say(bench, SCENE, scene->name));
    nmm_bench_set(bench, TIMES, times);
    nmm_bench_set(bench, ORDER, c->captured.unknowns);
    return NMM_OK;
}

static nmm_status say_method(nmm_bench *bench, const nmm_solve_report *report) {
    const char *words = nmm_solve_method_name(report->method);
    if (report->method == NMM_SOLVE_PCG)
        TRY(nmm_bench_words(bench, &words, "pcg %s", nmm_solve_blocks_name(report->blocks)));
    return nmm_bench_say(bench, METHOD, words);
}

static nmm_status write_row(nmm_bench *bench, const contest *c, const way *w) {
    const way *sor = &c->way[0], *serial = &c->way[1];
    const char *device = NULL;
    if (w->on_target && !w->solver.report.on_device)
        device = NOT_ON_GPU;
    else if (w->on_target)
        TRY(nmm_bench_target(bench, &device));
    else
        TRY(nmm_bench_host(bench, &device));
    TRY(nmm_bench_say(bench, DEVICE, device));
    if (!w->on_target) nmm_bench_set(bench, THREADS, w->n_thread);
    TRY(say_method(bench, &w->solver.report));
    nmm_bench_set(bench, SOR_MS, 1e3 * sor->median);
    nmm_bench_set(bench, SERIAL_MS, 1e3 * serial->median);
    nmm_bench_set(bench, MS, 1e3 * w->median);
    // Where SOR did not get there in its share of work, no number can be given.
    if (solved(sor) && solved(w)) nmm_bench_set(bench, SPEEDUP, sor->median / w->median);
    if (solved(serial) && solved(w)) nmm_bench_set(bench, OVER_SERIAL, serial->median / w->median);
    nmm_bench_set(bench, SOR_ITERATIONS, sor->solver.report.iterations);
    nmm_bench_set(bench, ITERATIONS, w->solver.report.iterations);
    const char *end = nmm_solve_end_name(w->solver.report.end);
    if (solved(w) && !solved(sor))
        TRY(nmm_bench_words(bench, &end, "SOR %s", nmm_solve_end_name(sor->solver.report.end)));
    return nmm_bench_say(bench, END, end);
}

static nmm_status write_rows(nmm_bench *bench, const nmm_bench_scene *scene, const contest *c,
                             int times) {
    for (int k = 1; k < c->n_way; k++) {
        TRY(begin_row(bench, scene, c, times));
        TRY(write_row(bench, c, &c->way[k]));
        nmm_bench_done(bench);
    }
    if (bench->target || bench->def.device == NMM_DEVICE_HOST) return NMM_OK;
    TRY(begin_row(bench, scene, c, times));
    TRY(nmm_bench_say(bench, DEVICE, NOT_ON_GPU));
    TRY(nmm_bench_say(bench, END, NOT_ON_GPU));
    nmm_bench_done(bench);
    return NMM_OK;
}

// --- Scenes

static nmm_status measure_system(nmm_bench *bench, const nmm_bench_scene *scene, int times) {
    contest c = {.n_way = 0};
    nmm_bench_source source = {.path = scene->path, .n_thread = 1, .device = NMM_DEVICE_HOST};
    if (times > 1) {
        source.n_override = 1;
        TRY(nmm_bench_enlarge(bench, scene, times, &source.override[0]));
    }
    nmm_status status = nmm_bench_capture(bench, &source, STEP_OF_SYSTEM, &c.captured);
    if (status == NMM_OK) status = open_ways(bench, &c);
    if (status == NMM_OK) status = solve_ways(bench, &c);
    if (status == NMM_OK) status = write_rows(bench, scene, &c, times);
    for (int k = 0; k < c.n_way; k++)
        nmm_bench_solver_close(bench, &c.way[k].solver);
    nmm_bench_system_destroy(bench, &c.captured);
    return status;
}

static nmm_status remark_speedups(nmm_bench *bench, int column, int n_thread, int times) {
    const nmm_bench_filter filter[2] = {{THREADS, NULL, n_thread}, {TIMES, NULL, times}};
    double *value = NULL;
    int n = 0;
    TRY(nmm_bench_values(bench, &value, &n, column, filter));
    if (n == 0) return NMM_OK;
    const char *speedups = NULL;
    TRY(nmm_bench_spread(bench, &speedups, n, value, "times as fast"));
    return nmm_bench_remark(bench, "Over %s, %d thread%s, scenes %s: %s.",
                            column == SPEEDUP ? "serial SOR(1.9)" : "ours on 1 thread", n_thread,
                            n_thread > 1 ? "s" : "",
                            times > 1 ? "with ten times the unknowns" : "as they are", speedups);
}

// How many times its unknowns each scene really has.
static nmm_status remark_sizes(nmm_bench *bench) {
    double low = INFINITY, high = 0;
    for (int row = 0; row < bench->n_row; row++) {
        if (!(nmm_bench_number(bench, row, TIMES) > 1)) continue;
        const nmm_bench_filter same[2] = {{SCENE, nmm_bench_text(bench, row, SCENE), 0},
                                          {TIMES, NULL, 1}};
        for (int k = 0; k < row; k++) {
            if (!nmm_bench_matches(bench, k, same)) continue;
            const double ratio =
                nmm_bench_number(bench, row, ORDER) / nmm_bench_number(bench, k, ORDER);
            low = nmm_min(low, ratio);
            high = nmm_max(high, ratio);
        }
    }
    if (high == 0) return NMM_OK;
    const char *range = NULL;
    TRY(nmm_bench_range(bench, &range, 3, low, high));
    return nmm_bench_remark(bench, "\"Ten times the unknowns\" are %s times as many.", range);
}

static nmm_status conclude(nmm_bench *bench) {
    TRY(remark_sizes(bench));
    for (int times = 1; times <= 10; times *= 10) {
        TRY(remark_speedups(bench, SPEEDUP, 1, times));
        for (int i = 0; i < bench->n_thread; i++) {
            if (bench->thread[i] == 1) continue;
            TRY(remark_speedups(bench, SPEEDUP, bench->thread[i], times));
            TRY(remark_speedups(bench, OVER_SERIAL, bench->thread[i], times));
        }
    }
    return nmm_bench_remark(bench, "The paper: 1.6 on 2 cores, 2.5 on 4 to 8, below 1 at order "
                                   "194.");
}

static bool has_no_size(const nmm_bench_scene *scene) {
    return scene->whole_blocks;
}

static nmm_status measure(nmm_bench *bench) {
    nmm_bench_scenes scenes = {0};
    nmm_status status = nmm_bench_find_scenes(bench, &scenes);
    for (int times = 1; times <= 10; times *= 10) {
        for (int i = 0; status == NMM_OK && i < scenes.n; i++) {
            const nmm_bench_scene *scene = &scenes.scene[i];
            if (bench->stopped || (times > 1 && has_no_size(scene))) continue;
            if (!nmm_bench_goes_on(bench, "fig7: %s, %s", scene->name,
                                   times > 1 ? "ten times the unknowns" : "as it is"))
                break;
            status = measure_system(bench, scene, times);
        }
    }
    if (status == NMM_OK)
        status = nmm_bench_left_out(bench, &scenes, has_no_size,
                                    "As it is only, with one cover for each block");
    nmm_release(&bench->context, &scenes.scene);
    return status == NMM_OK ? conclude(bench) : status;
}

// --- The picture

// One for each size and number of threads, and the target's.
enum { MOST_SERIES = 2 * NMM_BENCH_THREADS + 1 };

static nmm_status draw_series(nmm_bench *bench, nmm_chart_series *series, int column, int *n) {
    *n = 0;
    for (int k = 0; k < 2 * bench->n_thread; k++) {
        const int threads = bench->thread[k / 2], times = k % 2 > 0 ? 10 : 1;
        const nmm_bench_filter filter[2] = {{THREADS, NULL, threads}, {TIMES, NULL, times}};
        nmm_chart_series *one = &series[*n];
        TRY(nmm_bench_series(bench, one, ORDER, column, filter));
        if (one->n == 0) continue;
        TRY(nmm_bench_words(bench, &one->name, "%d thread%s%s", threads, threads > 1 ? "s" : "",
                            times > 1 ? ", ten times the unknowns" : ""));
        one->style = NMM_CHART_MARKS;
        *n += 1;
    }
    if (!bench->target) return NMM_OK;
    nmm_chart_series *last = &series[(*n)++];
    const char *device = NULL;
    TRY(nmm_bench_target(bench, &device));
    const nmm_bench_filter filter[2] = {{DEVICE, device, 0}, {0}};
    TRY(nmm_bench_series(bench, last, ORDER, column, filter));
    last->style = NMM_CHART_MARKS;
    last->name = device;
    return NMM_OK;
}

static nmm_status draw(nmm_bench *bench, const char *path) {
    nmm_chart_series series[2][MOST_SERIES] = {{{0}}};
    int n[2];
    const nmm_chart_level level[3] = {
        {"the paper, 2 cores: 1.6", 1.6}, {"the paper, 4 to 8 cores: 2.5", 2.5}, {"", 1}};
    TRY(draw_series(bench, series[0], SPEEDUP, &n[0]));
    TRY(draw_series(bench, series[1], OVER_SERIAL, &n[1]));
    const nmm_chart_panel panel[2] = {{.title = "Over serial SOR(1.9)",
                                       .x = {"order", true, 0, 0},
                                       .y = {"times as fast", true, 0, 0},
                                       .n_series = n[0],
                                       .series = series[0],
                                       .n_level = 3,
                                       .level = level},
                                      {.title = "Over ours on one thread",
                                       .x = {"order", true, 0, 0},
                                       .y = {"times as fast", false, 0, 0},
                                       .n_series = n[1],
                                       .series = series[1],
                                       .n_level = 3,
                                       .level = level}};
    const nmm_chart chart = {
        .title = "Figure 7: speed-up of a solve against order",
        .subtitle = bench->target ? NULL : "Not run on a GPU.",
        .n_panel = 2,
        .panel = panel,
    };
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_fig7 = {
    .name = {"fig7", "speed-up of a solve against order, by threads and device", 1},
    .title = "Figure 7: speed-up of one solve over serial SOR(1.9)",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
