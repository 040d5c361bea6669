// SPDX-License-Identifier: MIT
//
// Linear systems out of a run and out of files, through include/nmm only: what a run dumped gives
// the run's own bits, every way to write one matrix gives one solution, and what is wrong with a
// system is told.

#include "nmm/nmm.h"
#include "own_folder.h"

#include <stdlib.h>

static const char *const scene =
    "nmm: 1\n"
    "gravity: [0, -10]\n"
    "blocks:\n"
    "  - {name: stone, polygon: [[0, 0], [3, 0], [3, 1], [0, 1]], material: rock}\n"
    "materials: {rock: {density: 2000, youngs_modulus: 1e9, poissons_ratio: 0.25}}\n"
    "loads: [{point: [3, 1], force: [1e3, -2e3]}]\n"
    "covers: {size: 0.3}\n"
    "time: {dt: 1e-3, end: 1}\n"
    "analysis: {tolerance: 1e-4}\n"
    "solver: {method: pcg, blocks: cover}\n";

static nmm_linear_report solve(const nmm_linear_def *def) {
    nmm_linear_report report;
    const nmm_status status = nmm_linear_solve(def, &report);
    if (status != NMM_OK) print_error("%s\n", report.error_of_call.message);
    assert_int_equal(status, NMM_OK);
    return report;
}

/// n numbers of an array file that the library wrote.
static void read_numbers(const char *path, int n, double *x) {
    char line[128];
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    do {
        assert_non_null(fgets(line, sizeof line, file));
    } while (line[0] == '%');
    assert_int_equal(atoi(line), n);
    for (int i = 0; i < n; i++) {
        assert_non_null(fgets(line, sizeof line, file));
        x[i] = strtod(line, NULL);
    }
    fclose(file);
}

static nmm_sim *open_scene(nmm_sim_def *def) {
    nmm_sim *sim = NULL;
    def->path = "beam.yaml";
    def->text = scene;
    def->text_length = strlen(scene);
    assert_int_equal(nmm_sim_create(&sim, def), NMM_OK);
    return sim;
}

// --- Out of a run

// The value behind a word of the comments.
static double comment_value(const char *path, const char *word) {
    char line[256];
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    const char *found = NULL;
    while (found == NULL && fgets(line, sizeof line, file) != NULL && line[0] == '%')
        if (strstr(line, word) != NULL) break;
    fclose(file);
    found = strstr(line, word);
    assert_non_null(found);
    return strtod(found + strlen(word), NULL);
}

// The beam's first step is one pass: its solution is what the covers moved by.
static void a_dumped_system_gives_the_bits_of_the_run(void **unused) {
    (void)unused;
    nmm_sim_def def = nmm_default_sim_def();
    nmm_sim *sim = open_scene(&def);
    nmm_step_report step;
    assert_int_equal(nmm_sim_dump_system(sim, 1, 1, "beam"), NMM_OK);
    assert_int_equal(nmm_sim_dumped(sim), 0);
    assert_int_equal(nmm_sim_step(sim, &step), NMM_OK);
    assert_int_equal(nmm_sim_dumped(sim), 1);
    assert_int_equal(step.cuts, 0);
    assert_int_equal(step.passes, 1);
    const nmm_view moved = nmm_sim_view(sim, "displacement");
    const int n = 2 * moved.count;
    double *solution = calloc((size_t)n, sizeof *solution);
    assert_non_null(solution);
    nmm_linear_def linear = nmm_default_linear_def();
    linear.matrix = "beam.mtx";
    linear.rhs = "beam_rhs.mtx";
    linear.guess = "beam_guess.mtx";
    linear.places = "beam_places.mtx";
    linear.output = "beam_solution.mtx";
    linear.method = "pcg";
    linear.blocks = "cover";
    linear.absolute = comment_value("beam.mtx", "absolute ");
    for (int n_thread = 1; n_thread <= 3; n_thread++) {
        linear.n_thread = n_thread;
        const nmm_linear_report report = solve(&linear);
        assert_true(report.converged);
        assert_int_equal(report.order, n);
        assert_int_equal(report.iterations, step.solver_iterations);
        assert_true(report.iterations > 10);
        read_numbers("beam_solution.mtx", n, solution);
        assert_memory_equal(moved.data, solution, (size_t)n * sizeof *solution);
    }
    free(solution);
    nmm_sim_destroy(sim);
}

static void dumps_that_cannot_be(void **unused) {
    (void)unused;
    nmm_sim_def def = nmm_default_sim_def();
    const struct {
        long step;
        int iteration;
        const char *prefix;
    } wrong[] = {{0, 1, "a"}, {1, 0, "a"}, {1, 1, ""}, {1, 1, NULL}};
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        nmm_sim *sim = open_scene(&def);
        assert_int_equal(
            nmm_sim_dump_system(sim, wrong[k].step, wrong[k].iteration, wrong[k].prefix),
            NMM_ERROR_ARGUMENT);
        nmm_sim_destroy(sim);
    }
    nmm_sim *sim = open_scene(&def);
    assert_int_equal(nmm_sim_dump_system(sim, 1, 1, "none/a"), NMM_OK);
    assert_int_equal(nmm_sim_step(sim, NULL), NMM_ERROR_FILE);
    assert_non_null(strstr(nmm_sim_error(sim)->message, "none/a_rhs.mtx"));
    assert_int_equal(nmm_sim_dumped(sim), 0);
    nmm_sim_destroy(sim);
}

// --- Out of files

#define GENERAL "%%MatrixMarket matrix coordinate real general\n"
#define SYMMETRIC "%%MatrixMarket matrix coordinate real symmetric\n"
#define ARRAY "%%MatrixMarket matrix array real general\n"

// [4 1 0; 1 3 -1; 0 -1 2] u = f, in three ways, odd order.
static void one_matrix_in_three_ways(void **unused) {
    (void)unused;
    static const char *const text[] = {
        SYMMETRIC "3 3 5\n1 1 4\n2 1 1\n2 2 3\n3 2 -1\n3 3 2\n",
        SYMMETRIC "3 3 5\n3 3 2\n3 2 -1\n2 2 3\n2 1 1\n1 1 4\n",
        GENERAL "3 3 9\n1 1 4\n1 2 1\n1 3 0\n2 1 1\n2 2 3\n2 3 -1\n3 1 0\n3 2 -1\n3 3 2\n",
    };
    write_text("f.mtx", ARRAY "3 1\n4\n4\n1\n");
    nmm_linear_def def = nmm_default_linear_def();
    def.matrix = "a.mtx";
    def.rhs = "f.mtx";
    def.output = "u.mtx";
    def.tolerance = 1e-13;
    for (int k = 0; k < 3; k++) {
        double u[3];
        write_text("a.mtx", text[k]);
        const nmm_linear_report report = solve(&def);
        assert_true(report.converged);
        assert_int_equal(report.order, 3);
        assert_int_equal(report.padded, 1);
        assert_int_equal(report.entries, k < 2 ? 7 : 9);
        assert_near(report.error, -1, 0);
        // By Cramer's rule: determinant 18.
        read_numbers("u.mtx", 3, u);
        assert_near(u[0], 11.0 / 18, 1e-12);
        assert_near(u[1], 28.0 / 18, 1e-12);
        assert_near(u[2], 23.0 / 18, 1e-12);
        assert_near(report.solution_norm, sqrt(11 * 11 + 28 * 28 + 23 * 23) / 18, 1e-12);
    }
    def.rhs = NULL;
    const nmm_linear_report ones = solve(&def);
    assert_true(ones.error >= 0 && ones.error < 1e-12);
}

// The last of several solves is like the first: nothing was learned or kept.
static void each_solve_is_from_the_start(void **unused) {
    (void)unused;
    nmm_linear_def def = nmm_default_linear_def();
    def.generate = 2000;
    def.n_thread = 1;
    const nmm_linear_report once = solve(&def);
    def.n_repeat = 9;
    const nmm_linear_report often = solve(&def);
    assert_string_equal(once.method, often.method);
    assert_string_equal(once.blocks, often.blocks);
    assert_int_equal(once.iterations, often.iterations);
    assert_close(once.solution_norm, often.solution_norm, 0);
}

static void every_method(void **unused) {
    (void)unused;
    static const char *const method[] = {"auto", "jacobi", "chebyshev",   "pcg",
                                         "sor",  "direct", "gauss-seidel"};
    nmm_linear_def def = nmm_default_linear_def();
    def.generate = 300;
    def.n_repeat = 3;
    double norm = 0;
    for (size_t k = 0; k < sizeof method / sizeof *method; k++) {
        nmm_linear_report report;
        def.method = method[k];
        const nmm_status status = nmm_linear_solve(&def, &report);
        // An optional part may be missing.
        if (status == NMM_ERROR_ARGUMENT && strcmp(method[k], "direct") == 0) continue;
        assert_int_equal(status, NMM_OK);
        assert_true(report.converged);
        assert_true(report.residual <= 1e-8);
        assert_int_equal(report.order, 288);
        assert_true(report.least_seconds <= report.seconds);
        if (k == 0) norm = report.solution_norm;
        assert_close(report.solution_norm, norm, 1e-6);
        if (k > 0) assert_string_equal(report.method, method[k]);
    }
}

static void solves_that_fail_say_why(void **unused) {
    (void)unused;
    nmm_linear_def def = nmm_default_linear_def();
    def.matrix = "a.mtx";
    def.output = "none.mtx";
    def.method = "pcg";
    // Third unknown without stiffness; its block is rows 3 and 4.
    write_text("a.mtx", SYMMETRIC "4 4 4\n1 1 1\n2 2 1\n3 3 0\n4 4 1\n");
    nmm_linear_report report = solve(&def);
    assert_false(report.converged);
    assert_string_equal(report.end, "indefinite");
    assert_int_equal(report.row, 3);
    // Plain Jacobi diverges: lambda_max of D^-1 K is 2.8.
    write_text("a.mtx", SYMMETRIC "6 6 9\n1 1 1\n2 2 1\n3 3 1\n4 4 1\n5 5 1\n6 6 1\n3 1 .9\n"
                                  "5 1 .9\n5 3 .9\n");
    def.method = "jacobi";
    def.damping = 1;
    def.guess = "g.mtx";
    write_text("g.mtx", ARRAY "6 1\n1\n2\n3\n-4\n5\n6\n");
    report = solve(&def);
    assert_false(report.converged);
    assert_string_equal(report.end, "diverged");
    assert_true(report.reason[0] != 0);
    assert_int_not_equal(access("none.mtx", F_OK), 0);
    def.method = "pcg";
    def.guess = NULL;
    def.generate = 2000;
    def.matrix = NULL;
    def.max_iterations = 2;
    report = solve(&def);
    assert_string_equal(report.end, "too_slow");
    assert_int_equal(report.iterations, 2);
}

typedef struct mistake {
    const char *matrix, *rhs, *places;
    nmm_status status;
    int line, column;
    const char *words;
} mistake;

#define TWO SYMMETRIC "2 2 2\n1 1 1\n2 2 1\n"

static void wrong_files_are_told(void **unused) {
    (void)unused;
    static const mistake wrong[] = {
        {GENERAL "2 2 4\n1 1 2\n1 2 1\n2 1 -1\n2 2 2\n", NULL, NULL, NMM_ERROR_INPUT, 0, 0,
         "a.mtx: the matrix must be symmetric: row 1, column 2 is 1, but row 2, column 1 is -1"},
        {GENERAL "4 4 6\n1 1 2\n2 2 2\n3 3 2\n4 4 2\n3 2 1\n4 1 1\n", NULL, NULL, NMM_ERROR_INPUT,
         0, 0, "row 1, column 4 is 0, but row 4, column 1 is 1"},
        {SYMMETRIC "2 2 3\n1 1 2\n2 2 2\n1 1 2\n", NULL, NULL, NMM_ERROR_INPUT, 5, 1,
         "row 1, column 1 is given a second time"},
        {GENERAL "2 2 3\n1 1 2\n\n2 2 2\n1 1 2\n", NULL, NULL, NMM_ERROR_INPUT, 0, 0,
         "row 1, column 1 is given a second time"},
        {TWO, ARRAY "3 1\n1\n2\n3\n", NULL, NMM_ERROR_INPUT, 0, 0,
         "f.mtx: must have 2 rows and 1 columns"},
        {TWO, ARRAY "2 1\n1\nx\n", NULL, NMM_ERROR_INPUT, 4, 1, "found 'x'"},
        {TWO, NULL, ARRAY "1 2\n1\n1\n", NMM_ERROR_INPUT, 0, 0, "must have 1 rows and 3 columns"},
        {TWO, NULL, ARRAY "1 3\n1\n1\n0.5\n", NMM_ERROR_INPUT, 0, 0, "body of row 1 must be"},
        {TWO, NULL, ARRAY "1 3\n1\n1\n-2\n", NMM_ERROR_INPUT, 0, 0, "body of row 1 must be"},
        {NULL, NULL, NULL, NMM_ERROR_FILE, 0, 0, "cannot read a.mtx"},
    };
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        const mistake *w = &wrong[k];
        nmm_linear_report report;
        nmm_linear_def def = nmm_default_linear_def();
        def.matrix = "a.mtx";
        if (w->matrix != NULL) write_text("a.mtx", w->matrix);
        if (w->rhs != NULL) write_text(def.rhs = "f.mtx", w->rhs);
        if (w->places != NULL) write_text(def.places = "p.mtx", w->places);
        if (w->matrix == NULL) unlink("a.mtx");
        const nmm_status status = nmm_linear_solve(&def, &report);
        const nmm_error *error = &report.error_of_call;
        if (status == w->status && error->line == w->line && error->column == w->column &&
            strstr(error->message, w->words) != NULL)
            continue;
        print_error("found %d, %d:%d: %s\nexpected %d:%d: %s\n", (int)status, error->line,
                    error->column, error->message, w->line, w->column, w->words);
        fail();
    }
}

static void wrong_settings_are_told(void **unused) {
    (void)unused;
    nmm_linear_def def[6];
    for (int k = 0; k < 6; k++) {
        def[k] = nmm_default_linear_def();
        def[k].generate = 100;
    }
    def[0].method = "magic";
    def[1].blocks = "brick";
    def[2].precision = "half";
    def[3].stop = "never";
    def[4].n_repeat = 0;
    def[5].generate = 0;
    for (int k = 0; k < 6; k++) {
        nmm_linear_report report;
        assert_int_equal(nmm_linear_solve(&def[k], &report), NMM_ERROR_ARGUMENT);
        assert_true(report.error_of_call.message[0] != 0);
    }
}

// --- Memory

static void memory_may_end(void **unused) {
    (void)unused;
    write_text("a.mtx", GENERAL "3 3 5\n1 1 4\n2 1 1\n1 2 1\n2 2 3\n3 3 2\n");
    write_text("f.mtx", ARRAY "3 1\n4\n4\n1\n");
    write_text("p.mtx", ARRAY "2 3\n0\n1\n0\n1\n0\n0\n");
    nmm_linear_def def = nmm_default_linear_def();
    def.matrix = "a.mtx";
    def.rhs = def.guess = "f.mtx";
    def.places = "p.mtx";
    def.output = "u.mtx";
    def.allocate = test_failing_hook;
    for (int allowed = 0;; allowed++) {
        nmm_linear_report report;
        test_failing hook = {.fail_at = allowed};
        def.user = &hook;
        const nmm_status status = nmm_linear_solve(&def, &report);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) {
            assert_true(report.converged && allowed > 20);
            return;
        }
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_int_equal(report.error_of_call.status, NMM_ERROR_MEMORY);
    }
}

static void memory_may_end_in_a_dump(void **unused) {
    (void)unused;
    nmm_sim_def def = nmm_default_sim_def();
    def.allocate = test_failing_hook;
    for (int allowed = 0;; allowed++) {
        test_failing hook = {.fail_at = -1};
        def.user = &hook;
        nmm_sim *sim = open_scene(&def);
        nmm_status status = nmm_sim_dump_system(sim, 1, 1, "memory");
        hook.fail_at = hook.calls + allowed;
        if (status == NMM_OK) status = nmm_sim_step(sim, NULL);
        const int dumped = nmm_sim_dumped(sim);
        nmm_sim_destroy(sim);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) {
            assert_int_equal(dumped, 1);
            return;
        }
        assert_int_equal(status, NMM_ERROR_MEMORY);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_dumped_system_gives_the_bits_of_the_run),
        cmocka_unit_test(dumps_that_cannot_be),
        cmocka_unit_test(one_matrix_in_three_ways),
        cmocka_unit_test(each_solve_is_from_the_start),
        cmocka_unit_test(every_method),
        cmocka_unit_test(solves_that_fail_say_why),
        cmocka_unit_test(wrong_files_are_told),
        cmocka_unit_test(wrong_settings_are_told),
        cmocka_unit_test(memory_may_end),
        cmocka_unit_test(memory_may_end_in_a_dump),
    };
    return cmocka_run_group_tests(tests, own_folder_enter, own_folder_leave);
}
