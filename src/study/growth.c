// SPDX-License-Identifier: MIT
//
// Time by phase and memory of a step from 10^3 to 10^6 unknowns, for two scenes that grow: a square
// wall of bricks and a jointed rock slope, both with lattice covers. The first steps of each.
//
// Memory is the peak of what passes the allocation hook: model, state, system and solver with its
// factors.

#include "bench.h"

#include <math.h>

enum { STEPS = 3, FITTED_FROM = 3000, SIZES = 7, SIZES_QUICK = 2 };

enum { WALL, SLOPE, FAMILIES };
static const char *const family_name[FAMILIES] = {"brick wall", "rock slope"};

enum {
    FAMILY,
    BLOCKS,
    UNKNOWNS,
    CONTACTS,
    THREADS,
    CREATE,
    CONTACT,
    ASSEMBLY,
    SOLVER,
    REST,
    STEP,
    PASSES,
    SOLVES_BY,
    MEGABYTES,
    DEVICE,
    N_COLUMN
};

static const nmm_bench_column columns[] = {
    [FAMILY] = {"scene", "scene", "", 1, 0},
    [BLOCKS] = {"blocks", "blocks", "", 0, 0},
    [UNKNOWNS] = {"unknowns", "unknowns", "", 0, 0},
    [CONTACTS] = {"contacts", "contacts", "", 0, 0},
    [THREADS] = {"threads", "threads", "", 0, 0},
    [CREATE] = {"create_ms", "create", "ms", 0, 3},
    [CONTACT] = {"contact_ms", "contact", "ms", 0, 3},
    [ASSEMBLY] = {"assembly_ms", "assembly", "ms", 0, 3},
    [SOLVER] = {"solver_ms", "solver", "ms", 0, 3},
    [REST] = {"rest_ms", "rest", "ms", 0, 3},
    [STEP] = {"step_ms", "a step", "ms", 0, 3},
    [PASSES] = {"passes", "passes", "", 0, 2},
    [SOLVES_BY] = {"direct_share", "direct", "%", 0, 2},
    [MEGABYTES] = {"megabytes", "memory", "MB", 0, 3},
    [DEVICE] = {"device", "device", "", 1, 0},
    [N_COLUMN] = {0},
};

// About so many unknowns: 12 a brick, 4.7 a square metre of the slope's bounding square.
static nmm_status make_text(nmm_bench *bench, const char **text, int family, double unknowns) {
    if (family == SLOPE) return nmm_bench_slope_text(bench, text, sqrt(unknowns / 4.7));
    const int side = nmm_max_int(2, (int)(sqrt(unknowns / 12) + 0.5));
    return nmm_bench_wall_text(bench, text, side, side, "{size: 1.2}");
}

static nmm_status write_row(nmm_bench *bench, nmm_sim *sim, int family, const nmm_bench_timing *run,
                            double create) {
    nmm_summary s;
    nmm_sim_summary(sim, &s);
    const double steps = (double)run->steps;
    TRY(nmm_bench_add(bench));
    TRY(nmm_bench_say(bench, FAMILY, family_name[family]));
    nmm_bench_set(bench, BLOCKS, s.blocks);
    nmm_bench_set(bench, UNKNOWNS, s.unknowns);
    nmm_bench_set(bench, CONTACTS, s.contacts);
    nmm_bench_set(bench, THREADS, sim->context.n_thread);
    nmm_bench_set(bench, CREATE, 1e3 * create);
    for (int phase = 0; phase < NMM_PHASES; phase++)
        nmm_bench_set(bench, CONTACT + phase, 1e3 * run->phase[phase] / steps);
    nmm_bench_set(bench, STEP, 1e3 * run->seconds / steps);
    nmm_bench_set(bench, PASSES, (double)s.open_close_iterations / steps);
    if (s.solves > 0)
        nmm_bench_set(bench, SOLVES_BY, 100.0 * (double)s.with_direct / (double)s.solves);
    nmm_bench_set(bench, MEGABYTES, 1e-6 * (double)sim->context.peak_bytes);
    TRY(nmm_bench_say_machine(bench, DEVICE, s.on_device));
    nmm_bench_done(bench);
    return NMM_OK;
}

static nmm_status measure_size(nmm_bench *bench, int family, double unknowns, int n_thread) {
    nmm_bench_source source = {
        .path = family_name[family], .n_thread = n_thread, .device = NMM_DEVICE_HOST};
    nmm_bench_timing run;
    nmm_sim *sim = NULL;
    if (bench->def.device == NMM_DEVICE_TARGET) source.device = NMM_DEVICE_TARGET;
    TRY(make_text(bench, &source.text, family, unknowns));
    const double start = nmm_clock();
    nmm_status status = nmm_bench_open(bench, &sim, &source);
    const double create = nmm_clock() - start;
    if (status == NMM_OK)
        status = nmm_bench_steps(bench, sim, (nmm_bench_limit){.steps = STEPS}, &run);
    if (status == NMM_OK && run.steps > 0) status = write_row(bench, sim, family, &run, create);
    nmm_bench_close(&sim);
    return status;
}

// --- What follows

static nmm_status exponent_of(nmm_bench *bench, int family, int column, double *exponent) {
    const nmm_bench_filter filter[2] = {{FAMILY, family_name[family], 0},
                                        {THREADS, NULL, bench->thread[0]}};
    nmm_chart_series series = {0};
    TRY(nmm_bench_series(bench, &series, UNKNOWNS, column, filter));
    *exponent = nmm_bench_exponent(&series, bench->def.quick ? 0 : FITTED_FROM);
    return NMM_OK;
}

static nmm_status conclude(nmm_bench *bench) {
    static const int column[] = {CONTACT, ASSEMBLY, SOLVER, REST, STEP, CREATE, MEGABYTES};
    for (int family = 0; family < FAMILIES && bench->n_row > 0; family++) {
        double p[7] = {0};
        for (int k = 0; k < 7; k++)
            TRY(exponent_of(bench, family, column[k], &p[k]));
        if (!isfinite(p[4])) continue;
        TRY(nmm_bench_remark(bench,
                             "Powers of the number of unknowns, %s, %d thread%s: contact %.2f, "
                             "assembly %.2f, solver %.2f, rest %.2f, a whole step %.2f, creation "
                             "%.2f, memory %.2f.",
                             family_name[family], bench->thread[0], bench->thread[0] > 1 ? "s" : "",
                             p[0], p[1], p[2], p[3], p[4], p[5], p[6]));
    }
    return NMM_OK;
}

static nmm_status measure(nmm_bench *bench) {
    const int n = bench->def.quick ? SIZES_QUICK : SIZES;
    if (bench->def.n_thread == 0) bench->n_thread = 1;
    for (int family = 0; family < FAMILIES; family++) {
        for (int k = 0; k < n; k++) {
            const double unknowns = 1000 * pow(10, k / 2) * (k % 2 == 1 ? 3 : 1);
            for (int i = 0; i < bench->n_thread; i++) {
                if (!nmm_bench_goes_on(bench, "growth: %s, about %.0f unknowns",
                                       family_name[family], unknowns))
                    return conclude(bench);
                TRY(measure_size(bench, family, unknowns, bench->thread[i]));
            }
        }
    }
    return conclude(bench);
}

// --- The picture

enum { CURVES = 5 };

static nmm_status draw_family(nmm_bench *bench, int family, nmm_chart_series series[CURVES + 1],
                              double slope[2][2]) {
    static const int column[CURVES] = {CONTACT, ASSEMBLY, SOLVER, REST, MEGABYTES};
    static const char *const name[CURVES] = {"contact", "assembly", "solver", "rest",
                                             "memory [MB]"};
    const nmm_bench_filter filter[2] = {{FAMILY, family_name[family], 0},
                                        {THREADS, NULL, bench->thread[0]}};
    for (int k = 0; k < CURVES; k++) {
        double p = 0;
        TRY(nmm_bench_series(bench, &series[k], UNKNOWNS, column[k], filter));
        TRY(exponent_of(bench, family, column[k], &p));
        if (isfinite(p))
            TRY(nmm_bench_words(bench, &series[k].name, "%s: power %.2f", name[k], p));
        else
            series[k].name = name[k];
    }
    const nmm_chart_series *first = &series[1];
    const double x = first->n > 0 ? first->x[0] : 1000, y = first->n > 0 ? first->y[0] : 1;
    slope[0][0] = x;
    slope[0][1] = 1e4 * x;
    slope[1][0] = y;
    slope[1][1] = 1e4 * y;
    series[CURVES] = (nmm_chart_series){"slope 1", slope[0], slope[1], 2, NMM_CHART_SLOPE};
    return NMM_OK;
}

static nmm_status draw(nmm_bench *bench, const char *path) {
    nmm_chart_series series[FAMILIES][CURVES + 1] = {{{0}}};
    double slope[FAMILIES][2][2];
    nmm_chart_panel panel[FAMILIES];
    for (int family = 0; family < FAMILIES; family++) {
        TRY(draw_family(bench, family, series[family], slope[family]));
        panel[family] = (nmm_chart_panel){.title = family_name[family],
                                          .x = {"unknowns", true, 0, 0},
                                          .y = {"a step [ms], memory [MB]", true, 0, 0},
                                          .n_series = CURVES + 1,
                                          .series = series[family]};
    }
    const nmm_chart chart = {.title = "Growth with the number of unknowns",
                             .subtitle = "Time of a step by phase, and memory; powers by least "
                                         "squares of the logarithms.",
                             .n_panel = FAMILIES,
                             .panel = panel};
    return nmm_chart_write(&bench->context, &chart, path, 0);
}

const nmm_bench_kind nmm_bench_growth = {
    .name = {"growth", "time by phase and memory from 10^3 to 10^6 unknowns", 0},
    .title = "Growth: time of a step by phase, and memory",
    .column = columns,
    .measure = measure,
    .draw = draw,
};
