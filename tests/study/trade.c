// SPDX-License-Identifier: MIT
//
// Speed against accuracy through include/nmm/study.h: ladders that converge, the Pareto set, the
// setting named for an error wanted, references without a closed form, rows of runs that fail, what
// is wrong with settings, an early end, memory.

#include "study.h"

// A column under its own weight, as examples/verification/column.yaml but without Poisson's effect,
// so that the closed form holds: settlement density g H^2 / (2 E).
static const char *const column =
    "nmm: 1\n"
    "domain: [{polygon: [[0, 0], [2, 0], [2, 10], [0, 10]]}]\n"
    "materials: {rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0}}\n"
    "covers: {size: 0.85}\n"
    "supports: [{segment: [[0, 0], [2, 0]], fix: y}, {point: [1, 0], fix: x}]\n"
    "analysis: {tolerance: 1e-9}\n"
    "solver: {tolerance: 1e-12}\n"
    "time: {dt: 1e4, end: 1e4, max_move: 1}\n"
    "monitors: [{name: top, point: [1, 10]}]\n";

// A bar that is pulled at its end and swings: the error is one of time.
static const char *const swing =
    "nmm: 1\n"
    "gravity: [0, 0]\n"
    "domain: [{polygon: [[0, 0], [2, 0], [2, 1], [0, 1]]}]\n"
    "materials: {rock: {density: 2500, youngs_modulus: 1e8, poissons_ratio: 0}}\n"
    "covers: {size: 1}\n"
    "supports: [{segment: [[0, 0], [0, 1]], fix: xy}]\n"
    "loads: [{segment: [[2, 0], [2, 1]], traction: [1e4, 0]}]\n"
    "time: {dt: 1e-4, end: 0.02, dt_max: 1e-4}\n"
    "monitors: [{name: end, point: [2, 0.5], record: [displacement]}]\n";

// A stone on a held one: contact.
static const char *const stone =
    "nmm: 1\n"
    "gravity: [0, -10]\n"
    "blocks:\n"
    "  - {name: ground, polygon: [[-1, -1], [3, -1], [3, 0], [-1, 0]]}\n"
    "  - {polygon: [[0, 0], [2, 0], [2, 1], [0, 1]]}\n"
    "materials: {rock: {density: 2000, youngs_modulus: 1e9, poissons_ratio: 0.25}}\n"
    "interfaces: {dry: {friction_angle: 30}}\n"
    "interface: dry\n"
    "supports: [{block: ground, fix: xy}]\n"
    "covers: {size: 1}\n"
    "time: {dt: 1e-3, end: 0.02}\n"
    "monitors: [{point: [1, 0.5]}]\n";

static int enter(void **unused) {
    if (own_folder_enter(unused) != 0) return 1;
    write_text("column.yaml", column);
    write_text("swing.yaml", swing);
    write_text("stone.yaml", stone);
    return 0;
}

static nmm_trade_def definition(const char *path) {
    nmm_trade_def def = nmm_default_trade_def();
    def.path = path;
    def.quick = 1;
    def.n_thread = 1;
    def.device = NMM_DEVICE_HOST;
    return def;
}

static nmm_bench *measure(const nmm_trade_def *def) {
    nmm_bench *bench = NULL;
    const nmm_status status = nmm_trade_run(&bench, def);
    return succeeded(bench, status);
}

static const char *word(const nmm_bench *bench, int row, const char *name) {
    return nmm_bench_text(bench, row, column_named(bench, name));
}

// The note with these words.
static const char *said_of(const nmm_bench *bench, const char *words) {
    for (int k = 0; nmm_bench_note(bench, k) != NULL; k++)
        if (strstr(nmm_bench_note(bench, k), words) != NULL) return nmm_bench_note(bench, k);
    fail_msg("no note with '%s'", words);
    return "";
}

static int row_named(const nmm_bench *bench, const char *setting) {
    for (int row = 0; row < nmm_bench_rows(bench); row++)
        if (strcmp(word(bench, row, "setting"), setting) == 0) return row;
    fail_msg("no row %s", setting);
    return -1;
}

// --- Ladders

static const char *const settlement = "monitors.top.displacement[1]=-1.22625e-3";

// Halving cover size of linear functions takes a quarter of the error, roughly: the lattice does
// not fit the column.
static void errors_fall_with_the_size(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("column.yaml");
    def.quick = 0;
    def.knobs = "size";
    def.expect = settlement;
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 5);
    static const char *const row[5] = {"covers.size=3.4", "covers.size=1.7", "as it stands",
                                       "covers.size=0.425", "covers.size=0.2125"};
    double before = INFINITY;
    for (int k = 0; k < 5; k++) {
        const double error = number(bench, row_named(bench, row[k]), "error");
        assert_true(error > 0 && error < before / 1.5);
        before = error;
    }
    assert_true(before < 2e-3);
    const nmm_trade_result result = nmm_trade_result_of(bench);
    assert_string_equal(result.source, "closed form");
    assert_string_equal(result.quantity, "monitors.top.displacement[1]");
    assert_string_equal(result.unit, "m");
    assert_int_equal(result.width, 1);
    assert_near(result.reference[0], -1.22625e-3, 0);
    assert_near(result.unsure, 0, 0);
    assert_int_equal(result.cheapest, -1);
    assert_string_equal(result.why, "");
    nmm_bench_destroy(bench);
}

// On this column the coarsest lattice happens to hit the end exactly.
static void luck_is_called_so(void **unused) {
    (void)unused;
    static const char *const override[1] = {"covers.size=1.7"};
    nmm_trade_def def = definition("column.yaml");
    def.quick = 0;
    def.knobs = "size";
    def.expect = settlement;
    def.n_override = 1;
    def.override = override;
    nmm_bench *bench = measure(&def);
    int said = 0;
    for (int k = 0; nmm_bench_note(bench, k) != NULL; k++)
        said += strstr(nmm_bench_note(bench, k), "finer size the error grows") != NULL;
    assert_int_equal(said, 1);
    // It is not named as the cheapest: the finer one is further off than what is wanted.
    const double lucky = number(bench, row_named(bench, "covers.size=6.8"), "error");
    const double finer = number(bench, row_named(bench, "covers.size=3.4"), "error");
    assert_true(lucky < finer);
    nmm_bench_destroy(bench);
    def.want = 0.01 * 0.5 * (lucky + finer);
    bench = measure(&def);
    const int cheapest = nmm_trade_result_of(bench).cheapest;
    assert_true(cheapest >= 0);
    assert_int_not_equal(cheapest, row_named(bench, "covers.size=6.8"));
    assert_true(number(bench, cheapest, "error") <= 100 * def.want);
    nmm_bench_destroy(bench);
}

// Shi's scheme is of first order. dt_max stands in the scene and has to follow dt.
static void a_ladder_of_time_is_extrapolated(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("swing.yaml");
    def.quick = 0;
    def.knobs = "dt,scheme";
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 7);
    const nmm_trade_result result = nmm_trade_result_of(bench);
    assert_string_equal(result.source, "extrapolated");
    assert_string_equal(result.quantity, "monitors.end.displacement");
    assert_int_equal(result.width, 2);
    const char *told = strstr(nmm_bench_note(bench, 0), "order ");
    assert_non_null(told);
    assert_near(atof(told + 6), 0.9, 0.2);
    static const char *const row[5] = {
        "time.dt=0.0004 time.dt_max=0.0004", "time.dt=0.0002 time.dt_max=0.0002", "as it stands",
        "time.dt=5e-05 time.dt_max=5e-05", "time.dt=2.5e-05 time.dt_max=2.5e-05"};
    double before = INFINITY;
    for (int k = 0; k < 5; k++) {
        const int at = row_named(bench, row[k]);
        assert_near(number(bench, at, "steps"), 50 << k, 2);
        assert_true(number(bench, at, "error") < before);
        before = number(bench, at, "error");
    }
    // The other scheme has the same limit, but for what it is off itself.
    assert_true(0.00999 * before <= result.unsure && result.unsure < 0.03 * before);
    assert_non_null(strstr(said_of(bench, "is known to"), "not in it: size"));
    // Second order at the same step is nearer to the limit than first order.
    const int newmark = row_named(bench, "analysis.scheme=newmark");
    assert_true(number(bench, newmark, "error") <
                number(bench, row_named(bench, "as it stands"), "error") / 3);
    nmm_bench_destroy(bench);
}

// --- The Pareto set

// Errors below what the reference is known to are the same.
static double known_error(const nmm_bench *bench, int row) {
    const double error = number(bench, row, "error");
    const double unsure = 100 * nmm_trade_result_of(bench).unsure;
    return error < unsure ? unsure : error;
}

static bool is_dominated(const nmm_bench *bench, int row) {
    for (int k = 0; k < nmm_bench_rows(bench); k++) {
        const double faster = number(bench, row, "seconds") - number(bench, k, "seconds");
        const double own = known_error(bench, row), other = known_error(bench, k);
        if (faster > 0 && other <= 1.05 * own) return true;
        if (faster >= 0 && other < own) return true;
    }
    return false;
}

static void the_pareto_set_is_one(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("stone.yaml");
    nmm_bench *bench = measure(&def);
    int members = 0;
    for (int row = 0; row < nmm_bench_rows(bench); row++) {
        const bool member = strcmp(word(bench, row, "pareto"), "yes") == 0;
        if (isfinite(number(bench, row, "error")))
            assert_int_equal(member, !is_dominated(bench, row));
        else
            assert_false(member);
        members += member;
    }
    assert_true(members >= 1);
    // All knobs mean something here.
    static const char *const knob[] = {"size",      "dt",     "size with dt", "mesh",   "scheme",
                                       "tolerance", "solver", "precision",    "penalty"};
    for (int k = 0; k < 9; k++) {
        int rows = 0;
        for (int row = 0; row < nmm_bench_rows(bench); row++)
            rows += strcmp(word(bench, row, "knob"), knob[k]) == 0;
        assert_true(rows >= 1);
    }
    assert_int_equal(nmm_bench_plot(bench, "stone.svg"), NMM_OK);
    assert_int_equal(nmm_bench_write_csv(bench, "stone.csv"), NMM_OK);
    nmm_bench_destroy(bench);
}

// --- The error wanted

static void the_setting_named_reaches_the_error(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("column.yaml");
    def.knobs = "size,tolerance";
    def.expect = settlement;
    def.want = 1e-3;
    nmm_bench *bench = measure(&def);
    const nmm_trade_result result = nmm_trade_result_of(bench);
    assert_in_range(result.cheapest, 0, nmm_bench_rows(bench) - 1);
    assert_true(number(bench, result.cheapest, "error") <= 0.1);
    for (int row = 0; row < nmm_bench_rows(bench); row++)
        if (number(bench, row, "error") <= 0.1)
            assert_true(number(bench, row, "seconds") >= number(bench, result.cheapest, "seconds"));
    assert_string_equal(result.why, "");
    nmm_bench_destroy(bench);
}

static void options_and_lines_are_the_setting(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("column.yaml");
    def.knobs = "mesh";
    def.expect = settlement;
    // One body of uniform strain is exact here, the lattice is not.
    def.want = 1e-8;
    nmm_bench *bench = measure(&def);
    const nmm_trade_result result = nmm_trade_result_of(bench);
    assert_int_equal(result.cheapest, 1);
    assert_string_equal(result.options, "--set covers.mesh=block --set covers.size=auto");
    assert_string_equal(result.lines, "covers: {mesh: block, size: auto}");
    nmm_bench_destroy(bench);
}

static void what_cannot_be_reached_or_told_is_said(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("column.yaml");
    def.knobs = "size";
    def.expect = settlement;
    def.want = 1e-12;
    nmm_bench *bench = measure(&def);
    nmm_trade_result result = nmm_trade_result_of(bench);
    assert_int_equal(result.cheapest, -1);
    assert_non_null(strstr(result.why, "no setting comes within"));
    nmm_bench_destroy(bench);
    // Without a closed form nobody knows so many digits.
    def.expect = NULL;
    bench = measure(&def);
    result = nmm_trade_result_of(bench);
    assert_int_equal(result.cheapest, -1);
    assert_true(result.unsure > 1e-12);
    assert_non_null(strstr(said_of(bench, "is known to"), "not in it: dt, scheme."));
    assert_non_null(strstr(result.why, "cannot be told"));
    assert_non_null(strstr(result.why, "due to dt, scheme"));
    nmm_bench_destroy(bench);
    // Statics has neither.
    static const char *const at_rest[1] = {"analysis.kind=static"};
    def.override = at_rest;
    def.n_override = 1;
    bench = measure(&def);
    result = nmm_trade_result_of(bench);
    assert_null(strstr(said_of(bench, "is known to"), "not in it"));
    assert_non_null(strstr(result.why, "the reference is known to"));
    nmm_bench_destroy(bench);
}

// --- What is claimed

// Breathing of a square in one mesh triangle, as examples/verification/oscillator.yaml: the corner
// is at 5e-5 (1 - cos 1000 t), whatever the mesh.
static const char *const oscillator =
    "nmm: 1\n"
    "gravity: [0, 0]\n"
    "domain: [{polygon: [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]}]\n"
    "materials: {r: {density: 2400, youngs_modulus: 1.25e6, poissons_ratio: 0.25, "
    "plane: strain}}\n"
    "covers: {size: 1}\n"
    "initial_stress: {kind: uniform, xx: -2000, yy: -2000, xy: 0}\n"
    "analysis: {tolerance: 1e-11}\n"
    "solver: {tolerance: 1e-12}\n"
    "time: {dt: 1e-4, end: 1, max_move: 1}\n"
    "monitors: [{name: corner, point: [0.05, 0.05], record: [displacement]}]\n";

// Quick and in full, with either scheme, from few short steps to many that have damped all away or
// have lost the phase: the reference is as near as it is said to be, a setting that is named has
// the error wanted, and both happen, a setting and none.
static void a_claim_holds_against_the_closed_form(void **unused) {
    (void)unused;
    static const struct {
        const char *scheme, *dt, *end;
        double time, want;
        int quick, named;
    } one[] = {{"shi", "time.dt=1e-4", "time.end=0.1", 0.1, 0.001, 1, 0},
               {"shi", "time.dt=1e-4", "time.end=0.1", 0.1, 0.001, 0, 0},
               {"newmark", "time.dt=1e-4", "time.end=0.1", 0.1, 0.01, 0, 0},
               {"shi", "time.dt=1e-5", "time.end=0.003", 0.003, 0.02, 1, 1},
               {"shi", "time.dt=1e-5", "time.end=0.003", 0.003, 0.001, 0, 1},
               {"newmark", "time.dt=4e-6", "time.end=0.003", 0.003, 0.002, 0, 1},
               {"newmark", "time.dt=1e-5", "time.end=0.003", 0.003, 0.01, 0, 1}};
    write_text("oscillator.yaml", oscillator);
    for (size_t k = 0; k < sizeof one / sizeof *one; k++) {
        char scheme[64];
        snprintf(scheme, sizeof scheme, "analysis.scheme=%s", one[k].scheme);
        const char *const override[3] = {scheme, one[k].dt, one[k].end};
        nmm_trade_def def = definition("oscillator.yaml");
        def.quick = one[k].quick;
        def.knobs = "size,dt,scheme";
        def.quantity = "monitors.corner.displacement[0]";
        def.n_override = 3;
        def.override = override;
        def.want = one[k].want;
        nmm_bench *bench = measure(&def);
        const nmm_trade_result result = nmm_trade_result_of(bench);
        const double truth = 5e-5 * (1 - cos(1000 * one[k].time));
        // Amplitudes of millimetres and strains of 1e-3 leave 1e-5 of the closed form.
        assert_true(fabs(result.reference[0] - truth) <=
                    (result.unsure + 1e-5) * fabs(result.reference[0]));
        assert_int_equal(result.cheapest >= 0, one[k].named);
        if (result.cheapest >= 0) {
            const double value = atof(word(bench, result.cheapest, "value"));
            assert_true(fabs(value / truth - 1) <= def.want);
            assert_true(0.01 * number(bench, result.cheapest, "error") + result.unsure <= def.want);
        } else {
            assert_true(result.unsure > def.want);
            assert_non_null(strstr(result.why, "cannot be told"));
        }
        nmm_bench_destroy(bench);
    }
}

// A cantilever under a couple at its end: the tip goes M L^2 / (2 E I) = 6 mm down. Sizes of order
// 0 are far from it, those of order 1 and 2 are not.
static const char *const couple =
    "nmm: 1\n"
    "gravity: [0, 0]\n"
    "domain: [{polygon: [[0, -0.5], [10, -0.5], [10, 0.5], [0, 0.5]]}]\n"
    "materials: {m: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25, plane: stress}}\n"
    "covers: {size: 0.7}\n"
    "supports: [{segment: [[0, -0.5], [0, 0.5]], fix: x}, {point: [0, 0], fix: y}]\n"
    "loads:\n"
    "  - {point: [10, 0.5], force: [1e4, 0]}\n"
    "  - {point: [10, -0.5], force: [-1e4, 0]}\n"
    "analysis: {kind: static}\n"
    "monitors: [{name: tip, point: [10, 0]}]\n";

static void higher_orders_are_the_reference(void **unused) {
    (void)unused;
    write_text("couple.yaml", couple);
    for (int orders = 0; orders < 2; orders++) {
        nmm_trade_def def = definition("couple.yaml");
        def.quick = 0;
        def.knobs = orders != 0 ? "size,order" : "size";
        def.want = 0.01;
        nmm_bench *bench = measure(&def);
        const nmm_trade_result result = nmm_trade_result_of(bench);
        const double off = hypot(result.reference[0], result.reference[1] + 0.006) / 0.006;
        assert_true(off <= result.unsure);
        assert_true(orders != 0 ? result.unsure < 2e-3 : result.unsure > 0.05);
        assert_int_equal(result.cheapest >= 0, orders);
        if (orders != 0) {
            said_of(bench, "size with order 2");
            assert_true(0.01 * number(bench, result.cheapest, "error") < def.want);
        }
        nmm_bench_destroy(bench);
    }
}

// A scene that is right by luck is so with another tolerance or precision as well: there its finer
// meshes tell. What it comes to is given as the closed form here.
static void luck_has_no_other_name(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("column.yaml");
    def.knobs = "tolerance,solver,precision";
    def.expect = settlement;
    nmm_bench *bench = measure(&def);
    char own[128];
    snprintf(own, sizeof own, "monitors.top.displacement[1]=%s", word(bench, 0, "value"));
    nmm_bench_destroy(bench);
    def.expect = own;
    def.want = 1e-4;
    bench = measure(&def);
    assert_true(nmm_trade_result_of(bench).cheapest >= 0);
    nmm_bench_destroy(bench);
    def.knobs = "size,tolerance,solver,precision";
    bench = measure(&def);
    const nmm_trade_result result = nmm_trade_result_of(bench);
    assert_int_equal(result.cheapest, -1);
    assert_non_null(strstr(result.why, "by luck only"));
    nmm_bench_destroy(bench);
}

// Error and what is not known of the reference together.
static void the_error_wanted_counts_the_reference(void **unused) {
    (void)unused;
    static const char *const at_rest[1] = {"analysis.kind=static"};
    nmm_trade_def def = definition("column.yaml");
    def.quick = 0;
    def.knobs = "size";
    def.quantity = "monitors.top.displacement[1]";
    def.n_override = 1;
    def.override = at_rest;
    nmm_bench *bench = measure(&def);
    const double unsure = nmm_trade_result_of(bench).unsure;
    const double error = 0.01 * number(bench, row_named(bench, "covers.size=0.425"), "error");
    nmm_bench_destroy(bench);
    assert_true(unsure > 0 && error > 0);
    def.want = 1.001 * (error + unsure);
    bench = measure(&def);
    const int cheapest = nmm_trade_result_of(bench).cheapest;
    assert_in_range(cheapest, 0, nmm_bench_rows(bench) - 1);
    assert_true(0.01 * number(bench, cheapest, "error") + unsure <= def.want);
    const double value = atof(word(bench, cheapest, "value"));
    assert_true(fabs(value / -1.22625e-3 - 1) <= def.want);
    nmm_bench_destroy(bench);
    // The finest alone would do, but for the reference.
    def.want = 1.001 * unsure;
    bench = measure(&def);
    assert_int_equal(nmm_trade_result_of(bench).cheapest, -1);
    assert_non_null(strstr(nmm_trade_result_of(bench).why, "of a reference that is known to"));
    nmm_bench_destroy(bench);
}

// --- Rows that fail

static void a_run_that_fails_is_a_row(void **unused) {
    (void)unused;
    static const char *const override[1] = {"time.dt_min=8e-4"};
    nmm_trade_def def = definition("stone.yaml");
    def.knobs = "dt";
    def.n_override = 1;
    def.override = override;
    nmm_bench *bench = measure(&def);
    // dt_min above dt is a mistake of that setting only.
    const int bad = row_named(bench, "time.dt=0.0005");
    assert_non_null(strstr(word(bench, bad, "end"), "error: "));
    assert_true(isnan(number(bench, bad, "error")));
    assert_true(isnan(number(bench, bad, "seconds")));
    assert_string_equal(word(bench, bad, "pareto"), "");
    // The finest that is left has nothing to be compared with.
    assert_string_equal(word(bench, 0, "end"), "completed: the reference");
    assert_true(isnan(number(bench, 0, "error")));
    nmm_bench_destroy(bench);
    // A run that ends early is one too.
    static const char *const tight[2] = {"time.max_move=1e-9", "time.dt_min=1e-5"};
    def.n_override = 2;
    def.override = tight;
    bench = measure(&def);
    for (int row = 0; row < nmm_bench_rows(bench); row++) {
        assert_non_null(strstr(word(bench, row, "end"), "step_too_small"));
        assert_true(isnan(number(bench, row, "error")));
    }
    assert_string_equal(nmm_trade_result_of(bench).source, "");
    assert_int_equal(nmm_bench_plot(bench, "none.svg"), NMM_OK);
    nmm_bench_destroy(bench);
}

static void long_runs_are_left_out(void **unused) {
    (void)unused;
    nmm_trade_def def = definition("stone.yaml");
    def.quick = 0;
    def.knobs = "dt";
    def.longest = 1e-9;
    nmm_bench *bench = measure(&def);
    assert_non_null(strstr(word(bench, 0, "end"), "took longer than 1e-09 s"));
    assert_non_null(strstr(word(bench, nmm_bench_rows(bench) - 1, "end"), "left out"));
    nmm_bench_destroy(bench);
    // Order 2 is not tried where order 1 took too long on the same lattice.
    def.knobs = "order";
    bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 7);
    assert_non_null(strstr(word(bench, 1, "end"), "took longer"));
    for (int row = 2; row < 7; row++)
        assert_non_null(strstr(word(bench, row, "end"), "left out"));
    nmm_bench_destroy(bench);
}

// --- What is wrong

static nmm_status fails(const nmm_trade_def *def, char message[1024]) {
    nmm_bench *bench = NULL;
    const nmm_status status = nmm_trade_run(&bench, def);
    assert_int_equal(nmm_bench_error(bench)->status, status);
    snprintf(message, 1024, "%s", nmm_bench_error(bench)->message);
    nmm_bench_destroy(bench);
    return status;
}

static void wrong_settings_are_told(void **unused) {
    (void)unused;
    static const struct {
        const char *knobs, *quantity, *expect;
        double want;
        const char *said;
    } wrong[] = {
        {"siz", NULL, NULL, 0, "no knob 'siz'"},
        {"", NULL, NULL, 0, "no knob ''"},
        {"penalty", NULL, NULL, 0, "nothing to be traded"},
        {NULL, "top.displacement", NULL, 0, "must be monitors.NAME.displacement"},
        {NULL, "monitors.foot.displacement", NULL, 0, "there are: top"},
        {NULL, "monitors.top.place", NULL, 0, "no such field"},
        {NULL, "monitors.top.displacement[2]", NULL, 0, "no such field or component"},
        {NULL, "monitors.top.displacement[1", NULL, 0, "no such field or component"},
        {NULL, NULL, "monitors.top.displacement", 0, "QUANTITY=NUMBER"},
        {NULL, NULL, "monitors.top.displacement=1", 0, "two numbers"},
        {NULL, NULL, "monitors.top.stress=[1,2]", 0, "three numbers"},
        {NULL, NULL, "monitors.top.displacement[0]=1e", 0, "one number"},
        {NULL, NULL, "monitors.top.displacement[0]=nan", 0, "one number"},
        {NULL, NULL, "monitors.top.displacement[0]=0", 0, "is 0"},
        {NULL, "monitors.top.velocity", "monitors.top.displacement[0]=1", 0, "another quantity"},
        {NULL, NULL, NULL, -1, "error wanted"},
        {NULL, NULL, NULL, NAN, "error wanted"},
    };
    char message[1024];
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        nmm_trade_def def = definition("column.yaml");
        def.knobs = wrong[k].knobs;
        def.quantity = wrong[k].quantity;
        def.expect = wrong[k].expect;
        def.want = wrong[k].want;
        assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
        if (strstr(message, wrong[k].said) == NULL)
            fail_msg("'%s' instead of '%s'", message, wrong[k].said);
    }
    nmm_trade_def def = definition(NULL);
    assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
    def = definition("nowhere.yaml");
    assert_int_equal(fails(&def, message), NMM_ERROR_FILE);
    static const char *const override[1] = {"covers.sise=1"};
    def = definition("column.yaml");
    def.n_override = 1;
    def.override = override;
    assert_int_equal(fails(&def, message), NMM_ERROR_INPUT);
    static const char *const silent[1] = {"monitors=[]"};
    def.override = silent;
    assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
    assert_non_null(strstr(message, "no monitor"));
    // Nothing was traded.
    assert_int_equal(nmm_trade_result_of(NULL).cheapest, -1);
}

// --- An early end

static int stop_after_two(void *user, const nmm_bench *bench, const char *what, int row) {
    int *rows = user;
    if (what == NULL) assert_int_equal(row, nmm_bench_rows(bench) - 1);
    *rows += what == NULL;
    return *rows >= 2;
}

static void it_ends_where_the_caller_wants(void **unused) {
    (void)unused;
    int rows = 0;
    nmm_trade_def def = definition("stone.yaml");
    def.report = stop_after_two;
    def.user = &rows;
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_stopped(bench), 1);
    assert_int_equal(nmm_bench_rows(bench), 2);
    assert_int_equal(nmm_bench_plot(bench, "early.png"), NMM_OK);
    nmm_bench_destroy(bench);
}

// --- Memory

// Each allocation fails once: at first every one, then fewer and fewer, for there are thousands.
static void memory_may_fail_anywhere(void **unused) {
    (void)unused;
    nmm_status status = NMM_ERROR_MEMORY;
    long failed = 0;
    for (long at = 0; status != NMM_OK; at += 1 + at / 16) {
        test_failing h = {.fail_at = at};
        nmm_trade_def def = definition("column.yaml");
        nmm_bench *bench = NULL;
        def.knobs = "size,dt";
        def.want = 0.5;
        def.allocate = test_failing_hook;
        def.allocate_user = &h;
        status = nmm_trade_run(&bench, &def);
        if (status == NMM_OK) status = nmm_bench_plot(bench, "memory.svg");
        if (status == NMM_OK) status = nmm_bench_write_csv(bench, "memory.csv");
        assert_true(status == NMM_OK || status == NMM_ERROR_MEMORY);
        assert_int_equal(nmm_bench_error(bench)->status, status);
        nmm_bench_destroy(bench);
        assert_int_equal(h.live, 0);
        failed += status != NMM_OK;
    }
    assert_true(failed > 20);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_fall_with_the_size),
        cmocka_unit_test(luck_is_called_so),
        cmocka_unit_test(a_ladder_of_time_is_extrapolated),
        cmocka_unit_test(the_pareto_set_is_one),
        cmocka_unit_test(the_setting_named_reaches_the_error),
        cmocka_unit_test(options_and_lines_are_the_setting),
        cmocka_unit_test(what_cannot_be_reached_or_told_is_said),
        cmocka_unit_test(a_claim_holds_against_the_closed_form),
        cmocka_unit_test(higher_orders_are_the_reference),
        cmocka_unit_test(luck_has_no_other_name),
        cmocka_unit_test(the_error_wanted_counts_the_reference),
        cmocka_unit_test(a_run_that_fails_is_a_row),
        cmocka_unit_test(long_runs_are_left_out),
        cmocka_unit_test(wrong_settings_are_told),
        cmocka_unit_test(it_ends_where_the_caller_wants),
        cmocka_unit_test(memory_may_fail_anywhere),
    };
    return cmocka_run_group_tests(tests, enter, own_folder_leave);
}
