// SPDX-License-Identifier: MIT
//
// Table 1: which share of a step contact, assembly and solver take, for the method of the paper
// (SOR with factor 1.9, one thread) and for ours (auto, the best of the thread counts), and how
// many times faster whole steps are.
//
// Both compute the same time of the scene to the same tolerances. The first run of SOR says how
// far into the scene its share of the clock leads; there all further runs end, with a last step of
// that length, whatever steps were shortened on the way. They take turns; medians are reported.
//
// Where stones strike one another the least difference grows without bound, so how far the answers
// of the two are apart says little alone: beside it stands how far our own is from itself, with a
// balance of forces ten times as close.

#include "bench.h"

#include <math.h>
#include <stdio.h>

/// Runs of each method, their first one by SOR at most so long [s] and so many steps.
enum { ROUNDS = 3, MOST_STEPS = 200 };
#define LONGEST 2.0
#define LONGEST_QUICK 0.15

enum {
    SCENE,
    BLOCKS,
    UNKNOWNS,
    STEPS,
    SOR_CONTACT,
    SOR_ASSEMBLY,
    SOR_SOLVER,
    SOR_REST,
    SOR_STEP,
    CONTACT,
    ASSEMBLY,
    SOLVER,
    REST,
    STEP,
    THREADS,
    SPEEDUP,
    DIFFERENCE,
    OWN_DIFFERENCE,
    SOR_CUTS,
    CUTS,
    DEVICE,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [SCENE] = {"scene", "scene", "", 1, 0},
    [BLOCKS] = {"blocks", "blocks", "", 0, 0},
    [UNKNOWNS] = {"unknowns", "order", "", 0, 0},
    [STEPS] = {"steps", "steps", "", 0, 0},
    [SOR_CONTACT] = {"sor_contact_share", "SOR: cont.", "%", 0, 2},
    [SOR_ASSEMBLY] = {"sor_assembly_share", "ass.", "%", 0, 2},
    [SOR_SOLVER] = {"sor_solver_share", "solver", "%", 0, 3},
    [SOR_REST] = {"sor_rest_share", "rest", "%", 0, 2},
    [SOR_STEP] = {"sor_step_ms", "step", "ms", 0, 3},
    [CONTACT] = {"contact_share", "ours: cont.", "%", 0, 2},
    [ASSEMBLY] = {"assembly_share", "ass.", "%", 0, 2},
    [SOLVER] = {"solver_share", "solver", "%", 0, 2},
    [REST] = {"rest_share", "rest", "%", 0, 2},
    [STEP] = {"step_ms", "step", "ms", 0, 3},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [SPEEDUP] = {"speedup", "times faster", "", 0, 3},
    [DIFFERENCE] = {"difference", "differ", "", 0, 2},
    [OWN_DIFFERENCE] = {"own_difference", "ours alone", "", 0, 2},
    [SOR_CUTS] = {"sor_cuts", "SOR cuts", "", 0, 0},
    [CUTS] = {"cuts", "cuts", "", 0, 0},
    [DEVICE] = {"device", "device", "", 1, 0},
    [N_COLUMN] = {0},
};

/// One scene by SOR (way 0) and by ours on each number of threads.
typedef struct contest {
    const nmm_bench_scene *scene;
    int n_way;
    nmm_bench_limit limit;
    char end[48]; // "time.end=...": where the first run of SOR came to; "": not known yet
    nmm_bench_timing run[NMM_BENCH_THREADS + 1][ROUNDS];
    nmm_sim *sim[2]; // of the first round: SOR and the first of ours
    double difference, own_difference;
    int round; // rounds done
} contest;

static nmm_bench_source source_of(const nmm_bench *bench, const contest *c, int way) {
    nmm_bench_source source = {
        .path = c->scene->path, .n_thread = 1, .device = NMM_DEVICE_HOST, .n_override = 2};
    if (way == 0) {
        source.override[0] = "solver.method=sor";
        source.override[1] = "solver.factor=1.9";
    } else {
        source.n_thread = bench->thread[way - 1];
        if (bench->def.device == NMM_DEVICE_TARGET) source.device = NMM_DEVICE_TARGET;
        source.override[0] = "solver.method=auto";
        source.override[1] = "solver.blocks=auto";
    }
    if (c->end[0]) source.override[source.n_override++] = c->end;
    return source;
}

// The first run of SOR is done: all others go as far, and end there by themselves.
static nmm_status set_end(nmm_bench *bench, contest *c) {
    const double time = c->run[0][0].time;
    if (c->run[0][0].steps == 0) {
        nmm_summary summary;
        nmm_sim_summary(c->sim[0], &summary);
        return nmm_fail(&bench->context, NMM_ERROR_INPUT, "%s: SOR makes no step: %s",
                        c->scene->path, summary.reason);
    }
    c->limit = (nmm_bench_limit){.time = time};
    snprintf(c->end, sizeof c->end, "time.end=%.17g", time);
    return NMM_OK;
}

// Largest difference of displacements over the largest displacement, at the same time of the scene;
// NaN where a run ended before that.
static double distance(const nmm_sim *a, const nmm_sim *b) {
    if (!(fabs(a->state.time - b->state.time) <= 1e-9 * a->state.time)) return NAN;
    double apart = 0, largest = 0;
    for (int i = 0; i < 2 * a->model.n_cover; i++) {
        apart = nmm_max(apart, fabs(a->state.displacement[i] - b->state.displacement[i]));
        largest = nmm_max(largest, fabs(a->state.displacement[i]));
    }
    return largest > 0 ? apart / largest : 0;
}

// Both answers are there: how far they are apart, and ours from one with a closer balance.
static nmm_status compare(nmm_bench *bench, contest *c) {
    nmm_bench_source source = source_of(bench, c, 1);
    nmm_bench_timing run;
    nmm_sim *closer = NULL;
    char tolerance[48];
    snprintf(tolerance, sizeof tolerance, "analysis.tolerance=%.17g",
             0.1 * c->sim[1]->settings.tolerance);
    source.override[source.n_override++] = tolerance;
    nmm_status status = nmm_bench_open(bench, &closer, &source);
    if (status == NMM_OK) status = nmm_bench_steps(bench, closer, c->limit, &run);
    if (status == NMM_OK) {
        c->difference = distance(c->sim[0], c->sim[1]);
        c->own_difference = distance(c->sim[1], closer);
    }
    nmm_bench_close(&closer);
    return status;
}

static nmm_status run_once(nmm_bench *bench, contest *c, int way, int round) {
    nmm_sim *own = NULL;
    // Both answers are kept until they are compared.
    nmm_sim **sim = round == 0 && way < 2 ? &c->sim[way] : &own;
    const nmm_bench_source source = source_of(bench, c, way);
    nmm_status status = nmm_bench_open(bench, sim, &source);
    if (status == NMM_OK) status = nmm_bench_steps(bench, *sim, c->limit, &c->run[way][round]);
    if (status == NMM_OK && round == 0 && way == 0) status = set_end(bench, c);
    if (status == NMM_OK && round == 0 && way == 1) status = compare(bench, c);
    nmm_bench_close(&own);
    return status;
}

static nmm_status run_rounds(nmm_bench *bench, contest *c) {
    const int rounds = bench->def.quick ? 1 : ROUNDS;
    for (int round = 0; round < rounds; round++) {
        if (!nmm_bench_goes_on(bench, "table1: %s, round %d of %d", c->scene->name, round + 1,
                               rounds))
            return NMM_OK;
        for (int way = 0; way < c->n_way; way++)
            TRY(run_once(bench, c, way, round));
        c->round = round + 1;
        nmm_bench_close(&c->sim[0]);
        nmm_bench_close(&c->sim[1]);
    }
    return NMM_OK;
}

// The run of a way that took the middle of its times, so that its parts make a whole.
static const nmm_bench_timing *median_run(const contest *c, int way) {
    const nmm_bench_timing *run = c->run[way];
    for (int i = 0; i < c->round; i++) {
        int faster = 0;
        for (int k = 0; k < c->round; k++)
            faster +=
                run[k].seconds < run[i].seconds || (run[k].seconds == run[i].seconds && k < i);
        if (faster == c->round / 2) return &run[i];
    }
    return run;
}

static void set_shares(nmm_bench *bench, const nmm_bench_timing *run, int column) {
    for (int phase = 0; phase < NMM_PHASES; phase++)
        nmm_bench_set(bench, column + phase, 100 * run->phase[phase] / run->seconds);
    nmm_bench_set(bench, column + NMM_PHASES, 1e3 * run->seconds / (double)run->steps);
}

static nmm_status write_row(nmm_bench *bench, const contest *c) {
    int best = 1;
    for (int way = 2; way < c->n_way; way++)
        if (median_run(c, way)->seconds < median_run(c, best)->seconds) best = way;
    const nmm_bench_timing *sor = median_run(c, 0), *ours = median_run(c, best);
    TRY(nmm_bench_add(bench));
    TRY(nmm_bench_say(bench, SCENE, c->scene->name));
    nmm_bench_set(bench, BLOCKS, c->scene->blocks);
    nmm_bench_set(bench, UNKNOWNS, c->scene->unknowns);
    nmm_bench_set(bench, STEPS, (double)sor->steps);
    set_shares(bench, sor, SOR_CONTACT);
    set_shares(bench, ours, CONTACT);
    nmm_bench_set(bench, THREADS, bench->thread[best - 1]);
    nmm_bench_set(bench, SPEEDUP, sor->seconds / ours->seconds);
    nmm_bench_set(bench, DIFFERENCE, c->difference);
    nmm_bench_set(bench, OWN_DIFFERENCE, c->own_difference);
    nmm_bench_set(bench, SOR_CUTS, (double)sor->cuts);
    nmm_bench_set(bench, CUTS, (double)ours->cuts);
    TRY(nmm_bench_say_machine(bench, DEVICE, bench->def.device == NMM_DEVICE_TARGET));
    nmm_bench_done(bench);
    return NMM_OK;
}

static nmm_status measure_scene(nmm_bench *bench, const nmm_bench_scene *scene) {
    contest c = {
        .scene = scene, .n_way = bench->n_thread + 1, .difference = NAN, .own_difference = NAN};
    c.limit.steps = bench->def.quick ? 5 : MOST_STEPS;
    c.limit.seconds = bench->def.quick ? LONGEST_QUICK : LONGEST;
    nmm_status status = run_rounds(bench, &c);
    nmm_bench_close(&c.sim[0]);
    nmm_bench_close(&c.sim[1]);
    if (status == NMM_OK && c.round > 0 && c.run[0][0].steps > 0) status = write_row(bench, &c);
    return status;
}

// --- What follows

static nmm_status remark_range(nmm_bench *bench, int column, const char *what, const char *paper) {
    double *value = NULL;
    int n = 0;
    TRY(nmm_bench_values(bench, &value, &n, column, NULL));
    const char *shares = NULL;
    TRY(nmm_bench_spread(bench, &shares, n, value, "%"));
    return nmm_bench_remark(bench, "%s: %s%s.", what, shares, paper);
}

static nmm_status remark_difference(nmm_bench *bench, int column, const char *what) {
    double *value = NULL;
    int n = 0;
    TRY(nmm_bench_values(bench, &value, &n, column, NULL));
    const double median = nmm_bench_median(n, value);
    if (n == 0) return NMM_OK;
    return nmm_bench_remark(bench, "%s; %.2g in the median, %.2g at most.", what, median,
                            value[n - 1]);
}

static nmm_status conclude(nmm_bench *bench) {
    double *value = NULL;
    const char *words = NULL;
    int n = 0, slower = 0;
    if (bench->n_row == 0) return NMM_OK;
    TRY(nmm_bench_values(bench, &value, &n, UNKNOWNS, NULL));
    nmm_bench_median(n, value); // sorts them
    TRY(nmm_bench_range(bench, &words, 9, value[0], value[n - 1]));
    TRY(nmm_bench_remark(bench, "Orders: %s unknowns (the paper: 194 to 2193).", words));
    TRY(remark_range(bench, SOR_SOLVER, "Solver's share with SOR(1.9)",
                     " (the paper: 56 to 97 %)"));
    TRY(remark_range(bench, SOLVER, "Solver's share with ours", ""));
    TRY(nmm_bench_values(bench, &value, &n, SPEEDUP, NULL));
    TRY(nmm_bench_spread(bench, &words, n, value, "times as fast"));
    for (int i = 0; i < n; i++)
        slower += value[i] < 1;
    TRY(remark_difference(bench, DIFFERENCE,
                          "Differ: largest difference of the two answers' "
                          "displacements over the largest displacement, at the "
                          "same time of the scene"));
    TRY(remark_difference(bench, OWN_DIFFERENCE,
                          "Ours alone: the same between ours and ours with "
                          "a balance of forces ten times as close"));
    return nmm_bench_remark(bench,
                            "Whole steps, ours against SOR(1.9) on one thread: %s; slower in %d "
                            "of %d scene%s.",
                            words, slower, n, n > 1 ? "s" : "");
}

static bool is_static(const nmm_bench_scene *scene) {
    return scene->is_static;
}

static nmm_status measure(nmm_bench *bench) {
    nmm_bench_scenes scenes = {0};
    nmm_status status = nmm_bench_find_scenes(bench, &scenes);
    int n = 0;
    for (int i = 0; status == NMM_OK && i < scenes.n && !bench->stopped; i++) {
        // Where the clock cuts the way to an equilibrium says nothing about what is left of it.
        if (scenes.scene[i].is_static) continue;
        status = measure_scene(bench, &scenes.scene[i]);
        n += 1;
    }
    if (status == NMM_OK && n == 0) {
        status =
            nmm_fail(&bench->context, NMM_ERROR_INPUT,
                     "table1 compares runs at the same time of a scene; all scenes in '%s' are "
                     "static and have none",
                     bench->def.scenes);
    }
    if (status == NMM_OK)
        status = nmm_bench_left_out(bench, &scenes, is_static,
                                    "Left out, static and without a time to compare at");
    nmm_release(&bench->context, &scenes.scene);
    return status == NMM_OK ? conclude(bench) : status;
}

// --- The picture

static nmm_status draw(nmm_bench *bench, const char *path) {
    static const char *const part[NMM_PHASES] = {"contact", "assembly", "solver", "rest"};
    static const char *const bar[2] = {"SOR", "ours"};
    const nmm_chart_level share[2] = {{"56 %", 56}, {"97 %", 97}};
    const nmm_chart_level alike = {"1", 1};
    nmm_arena *arena = &bench->arena;
    const int n = bench->n_row;
    const char **name = NULL;
    double *shares = NULL, *times = NULL;
    TRY(nmm_arena_take(&bench->context, arena, &name, (size_t)n, sizeof *name));
    TRY(nmm_arena_take(&bench->context, arena, &shares, (size_t)n, 8 * sizeof(double)));
    TRY(nmm_arena_take(&bench->context, arena, &times, (size_t)n, sizeof(double)));
    for (int row = 0; row < n; row++) {
        name[row] = nmm_bench_text(bench, row, SCENE);
        times[row] = nmm_bench_number(bench, row, SPEEDUP);
        for (int k = 0; k < NMM_PHASES; k++) {
            shares[8 * row + k] = nmm_bench_number(bench, row, SOR_CONTACT + k);
            shares[8 * row + 4 + k] = nmm_bench_number(bench, row, CONTACT + k);
        }
    }
    const nmm_chart_bars left = {n, 2, NMM_PHASES, name, bar, part, shares};
    const nmm_chart_bars right = {n, 1, 1, name, NULL, NULL, times};
    const nmm_chart_panel panel[2] = {
        {.title = "What a step spends its time on",
         .x = {"share of a step [%]; dashed: the paper's solver", false, 0, 100},
         .n_level = 2,
         .level = share,
         .bars = &left},
        {.title = "Whole steps, ours against SOR(1.9)",
         .x = {"times faster", true, 0, 0},
         .n_level = 1,
         .level = &alike,
         .bars = &right}};
    const nmm_chart chart = {.title = "Table 1: shares of the time of a step",
                             .subtitle = "SOR: factor 1.9, one thread, as in the paper.  Ours: "
                                         "method auto, best number of threads.",
                             .n_panel = 2,
                             .panel = panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_table1 = {
    .name = {"table1", "shares of contact, assembly and solver; whole steps against SOR", 1},
    .title = "Table 1: shares of the time of a step, SOR(1.9) on one thread and ours",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
