// SPDX-License-Identifier: MIT
//
// Experiments through include/nmm/study.h only: each in its short form on two scenes of their own,
// what is wrong with settings and folders, an early end, files, memory.

#include "study.h"

#include <sys/stat.h>

// A stone on a held one: 20 unknowns and a contact.
static const char *const scene =
    "nmm: 1\n"
    "gravity: [0, -10]\n"
    "blocks:\n"
    "  - {name: ground, polygon: [[-1, -1], [3, -1], [3, 0], [-1, 0]]}\n"
    "  - {polygon: [[0, 0], [2, 0], [2, 1], [0, 1]]}\n"
    "materials: {rock: {density: 2000, youngs_modulus: 1e9, poissons_ratio: 0.25}}\n"
    "interfaces: {dry: {friction_angle: 30}}\n"
    "interface: dry\n"
    "supports: [{block: ground, fix: xy}]\n"
    "covers: {%s: %s}\n"
    "time: {dt: 1e-3, end: 0.02}\n"
    "%s";

// `size` of the covers, or "block": one for each block.
static void write_scene(const char *name, const char *size, const char *more) {
    char path[64], text[1024];
    assert_int_equal(mkdir(name, 0777), 0);
    snprintf(path, sizeof path, "%s/scene.yaml", name);
    snprintf(text, sizeof text, scene, strcmp(size, "block") == 0 ? "mesh" : "size", size, more);
    write_text(path, text);
}

static int enter(void **unused) {
    if (own_folder_enter(unused) != 0) return 1;
    assert_int_equal(mkdir("empty", 0777), 0);
    assert_int_equal(mkdir("scenes", 0777), 0);
    write_scene("scenes/coarse", "1", "");
    write_scene("scenes/fine", "0.4", "");
    return 0;
}

static nmm_bench_def definition(const char *name) {
    static const int two[2] = {2, 1};
    nmm_bench_def def = nmm_default_bench_def();
    def.name = name;
    def.scenes = "scenes";
    def.quick = 1;
    def.device = NMM_DEVICE_HOST;
    def.n_thread = 2;
    def.thread = two;
    return def;
}

static nmm_bench *measure(const nmm_bench_def *def) {
    nmm_bench *bench = NULL;
    const nmm_status status = nmm_bench_run(&bench, def);
    return succeeded(bench, status);
}

static nmm_status fails(const nmm_bench_def *def, char message[1024]) {
    nmm_bench *bench = NULL;
    const nmm_status status = nmm_bench_run(&bench, def);
    assert_int_equal(nmm_bench_error(bench)->status, status);
    snprintf(message, 1024, "%s", nmm_bench_error(bench)->message);
    nmm_bench_destroy(bench);
    return status;
}

// --- Each experiment

static void shares_make_a_whole(void **unused) {
    (void)unused;
    const nmm_bench_def def = definition("table1");
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 2);
    // By their number of unknowns.
    assert_string_equal(nmm_bench_text(bench, 0, 0), "coarse");
    assert_string_equal(nmm_bench_text(bench, 1, 0), "fine");
    for (int row = 0; row < 2; row++) {
        double sor = 0, ours = 0;
        static const char *const part[4] = {"contact_share", "assembly_share", "solver_share",
                                            "rest_share"};
        for (int k = 0; k < 4; k++) {
            char name[32];
            snprintf(name, sizeof name, "sor_%s", part[k]);
            sor += number(bench, row, name);
            ours += number(bench, row, part[k]);
        }
        assert_near(sor, 100, 1e-9);
        assert_near(ours, 100, 1e-9);
        assert_true(number(bench, row, "steps") >= 1);
        assert_true(number(bench, row, "speedup") > 0);
        // Both solve to the same tolerance, so the answers are near.
        assert_true(number(bench, row, "difference") < 1e-4);
    }
    assert_non_null(nmm_bench_note(bench, 0));
    nmm_bench_destroy(bench);
}

static void sor_that_makes_no_step_is_told(void **unused) {
    (void)unused;
    char message[1024];
    nmm_bench_def def = definition("table1");
    assert_int_equal(mkdir("never", 0777), 0);
    write_scene("never/steps", "0.4", "solver: {max_iterations: 20}\n");
    def.scenes = "never";
    assert_int_equal(fails(&def, message), NMM_ERROR_INPUT);
    assert_non_null(strstr(message, "SOR makes no step"));
    assert_non_null(strstr(message, "did not converge"));
}

// SOR misses its tolerance in so few iterations, which shortens its step and no other: both come to
// the same time all the same, and are compared there.
static void answers_are_compared_where_steps_were_shortened(void **unused) {
    (void)unused;
    nmm_bench_def def = definition("table1");
    assert_int_equal(mkdir("short", 0777), 0);
    write_scene("short/steps", "0.4", "solver: {max_iterations: 155}\n");
    def.scenes = "short";
    nmm_bench *bench = measure(&def);
    assert_true(number(bench, 0, "sor_cuts") > 0);
    assert_near(number(bench, 0, "cuts"), 0, 0);
    // Other steps have other errors of time; with no steps in common it would be 1.
    assert_true(number(bench, 0, "difference") > 1e-9);
    assert_true(number(bench, 0, "difference") < 0.5);
    assert_true(number(bench, 0, "own_difference") < 1e-4);
    nmm_bench_destroy(bench);
}

static void errors_fall(void **unused) {
    (void)unused;
    const nmm_bench_def def = definition("fig6");
    nmm_bench *bench = measure(&def);
    const int n = nmm_bench_rows(bench);
    static const char *const method[] = {"sor",       "gauss_seidel", "damped_jacobi",
                                         "chebyshev", "pcg",          "pcg_body"};
    assert_true(n > 5);
    assert_near(number(bench, 0, "iteration"), 1, 0);
    for (int m = 0; m < 6; m++) {
        double last = NAN;
        for (int row = 0; row < n; row++) {
            const double error = number(bench, row, method[m]);
            if (isfinite(error)) last = error;
            assert_false(error < 0);
        }
        assert_true(last < number(bench, 0, method[m]));
    }
    // Conjugate gradients end in at most as many iterations as there are unknowns, but for
    // rounding.
    for (int row = 0; row < n; row++)
        if (number(bench, row, "iteration") > 200) assert_false(number(bench, row, "pcg") > 1e-9);
    // The last scene is the largest; there is no tunnel.
    assert_non_null(strstr(nmm_bench_note(bench, 0), "fine"));
    nmm_bench_destroy(bench);
}

static bool is_noted(const nmm_bench *bench, const char *words) {
    for (int k = 0; nmm_bench_note(bench, k) != NULL; k++)
        if (strstr(nmm_bench_note(bench, k), words) != NULL) return true;
    return false;
}

static void speedups_are_quotients(void **unused) {
    (void)unused;
    nmm_bench_def def = definition("fig7");
    def.device = NMM_DEVICE_CHOOSE;
    nmm_bench *bench = measure(&def);
    const int device = column_named(bench, "device");
    // Two scenes in two sizes, each by one and two threads, and on a target where there is one.
    assert_int_equal(nmm_bench_rows(bench), 12);
    for (int row = 0; row < 12; row++) {
        const double ms = number(bench, row, "ms");
        if (!isfinite(ms)) {
            assert_string_equal(nmm_bench_text(bench, row, device), "not run on a GPU");
            continue;
        }
        assert_close(number(bench, row, "speedup_over_sor"), number(bench, row, "sor_ms") / ms,
                     1e-12);
        if (number(bench, row, "threads") == 1 && row % 3 == 0)
            assert_near(number(bench, row, "speedup_over_serial"), 1, 0);
    }
    // Ten times the unknowns, in a coarse mesh as nearly as its nodes allow.
    const double coarse = number(bench, 6, "order") / number(bench, 0, "order");
    const double fine = number(bench, 9, "order") / number(bench, 3, "order");
    assert_near(coarse, 10, 1);
    assert_near(fine, 10, 0.4);
    assert_non_null(strstr(nmm_bench_note(bench, 0), "Ten times the unknowns"));
    assert_true(is_noted(bench, "Over serial SOR(1.9), 2 threads, scenes as they are"));
    assert_true(is_noted(bench, "Over ours on 1 thread, 2 threads, scenes with ten times"));
    nmm_bench_destroy(bench);
}

// Such a scene is measured as it is, and said to have no other size; its neighbour has both.
static void whole_blocks_have_one_size(void **unused) {
    (void)unused;
    nmm_bench_def def = definition("fig7");
    assert_int_equal(mkdir("whole", 0777), 0);
    write_scene("whole/blocks", "block", "");
    write_scene("whole/lattice", "1", "");
    def.scenes = "whole";
    def.n_thread = 1;
    def.thread = &def.quick;
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 3);
    assert_string_equal(nmm_bench_text(bench, 0, 0), "blocks");
    assert_string_equal(nmm_bench_text(bench, 2, 0), "lattice");
    assert_near(number(bench, 2, "times"), 10, 0);
    assert_true(is_noted(bench, "one cover for each block: blocks."));
    nmm_bench_destroy(bench);
}

// Statics have no time at which two runs could be compared.
static void static_scenes_are_left_out_of_table1(void **unused) {
    (void)unused;
    char message[1024];
    nmm_bench_def def = definition("table1");
    assert_int_equal(mkdir("still", 0777), 0);
    write_scene("still/statics", "1", "analysis: {kind: static}\n");
    def.scenes = "still";
    assert_int_equal(fails(&def, message), NMM_ERROR_INPUT);
    assert_non_null(strstr(message, "static"));
    write_scene("still/motion", "1", "");
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_rows(bench), 1);
    assert_string_equal(nmm_bench_text(bench, 0, 0), "motion");
    assert_true(is_noted(bench, "without a time to compare at: statics."));
    nmm_bench_destroy(bench);
}

// Of two first steps, of a quick wall, one is the very first.
static void assert_first_steps(const nmm_bench *bench, int row) {
    const double first = number(bench, row, "first_step_ms");
    const double next = number(bench, row, "next_steps_ms");
    const double mean = number(bench, row, "first_steps_ms");
    assert_true(first > 0 && next > 0);
    assert_near(0.5 * (first + next), mean, 1e-9 * mean);
}

// Every number that is there is a number, and positive where it is a time.
static void walls_are_measured(void **unused) {
    (void)unused;
    static const char *const name[] = {"contact", "wall", "growth"};
    for (int b = 0; b < 3; b++) {
        nmm_bench_def def = definition(name[b]);
        def.scenes = NULL;
        def.n_thread = 1;
        def.thread = &def.quick;
        nmm_bench *bench = measure(&def);
        assert_true(nmm_bench_rows(bench) >= 3);
        for (int row = 0; row < nmm_bench_rows(bench); row++) {
            assert_true(number(bench, row, "blocks") >= 10);
            assert_true(number(bench, row, "contacts") > 0);
            assert_true(number(bench, row, "step_ms") > 0);
            assert_near(number(bench, row, "threads"), 1, 0);
            if (b == 1) assert_first_steps(bench, row);
            if (row == 0) continue;
            const double before = number(bench, row - 1, "blocks");
            // The wall is measured twice at each size.
            const int again = b == 2 || (b == 1 && row % 2 == 1);
            assert_true(number(bench, row, "blocks") > before || again);
        }
        nmm_bench_destroy(bench);
    }
}

static void public_dda_walls_have_its_number_of_blocks(void **unused) {
    (void)unused;
    nmm_bench_def def = definition("wall");
    nmm_bench *bench = measure(&def);
    // One row for each number of threads and each balance.
    static const int blocks[3] = {19, 69, 265};
    for (int k = 0; k < 3; k++) {
        assert_near(number(bench, 4 * k, "blocks"), blocks[k], 0);
        // Six unknowns a block; the base is held and counts.
        assert_near(number(bench, 4 * k, "unknowns"), 6 * blocks[k], 0);
        assert_true(number(bench, 4 * k, "public_dda_ms") > 0);
        assert_true(number(bench, 4 * k, "balance") < number(bench, 4 * k + 1, "balance"));
        assert_true(number(bench, 4 * k, "passes") >= number(bench, 4 * k + 1, "passes"));
    }
    nmm_bench_destroy(bench);
}

// --- What is wrong

static void wrong_settings_are_told(void **unused) {
    (void)unused;
    char message[1024];
    nmm_bench_def def = definition("table2");
    assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
    assert_non_null(strstr(message, "table1, fig6"));
    def = definition(NULL);
    assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
    def = definition("table1");
    const int none = 0;
    def.thread = &none;
    def.n_thread = 1;
    assert_int_equal(fails(&def, message), NMM_ERROR_ARGUMENT);
    def = definition("fig7");
    def.scenes = "nowhere";
    assert_int_equal(fails(&def, message), NMM_ERROR_FILE);
    assert_non_null(strstr(message, "nowhere"));
    def.scenes = "empty";
    assert_int_equal(fails(&def, message), NMM_ERROR_FILE);
    assert_non_null(strstr(message, "scene.yaml"));
    assert_null(nmm_bench_list(99).name);
}

static void a_wrong_scene_is_told_with_its_place(void **unused) {
    (void)unused;
    nmm_bench_def def = definition("table1");
    nmm_bench *bench = NULL;
    assert_int_equal(mkdir("wrong", 0777), 0);
    write_scene("wrong/scene", "1, sise: 2", "");
    def.scenes = "wrong";
    assert_int_equal(nmm_bench_run(&bench, &def), NMM_ERROR_INPUT);
    assert_int_equal(nmm_bench_error(bench)->line, 10);
    assert_non_null(strstr(nmm_bench_error(bench)->file, "wrong/scene"));
    nmm_bench_destroy(bench);
}

// --- An early end

typedef struct listener {
    int rows, words, most;
} listener;

static int listen_to(void *user, const nmm_bench *bench, const char *what, int row) {
    listener *l = user;
    if (what != NULL) {
        assert_int_equal(row, -1);
        l->words += 1;
        return 0;
    }
    assert_int_equal(row, nmm_bench_rows(bench) - 1);
    l->rows += 1;
    return l->rows >= l->most;
}

static void it_ends_where_the_caller_wants(void **unused) {
    (void)unused;
    listener l = {.most = 1};
    nmm_bench_def def = definition("table1");
    def.report = listen_to;
    def.user = &l;
    nmm_bench *bench = measure(&def);
    assert_int_equal(nmm_bench_stopped(bench), 1);
    assert_int_equal(nmm_bench_rows(bench), 1);
    assert_int_equal(l.rows, 1);
    assert_true(l.words > 0);
    // What is there can be drawn.
    assert_int_equal(nmm_bench_plot(bench, "early.png"), NMM_OK);
    nmm_bench_destroy(bench);
}

// --- Files

static void files_hold_the_table(void **unused) {
    (void)unused;
    const nmm_bench_def def = definition("table1");
    nmm_bench *bench = measure(&def);
    char line[1024];
    assert_int_equal(nmm_bench_write_csv(bench, "t.csv"), NMM_OK);
    assert_int_equal(nmm_bench_plot(bench, "t.svg"), NMM_OK);
    FILE *file = fopen("t.csv", "r");
    assert_non_null(fgets(line, sizeof line, file));
    assert_memory_equal(line, "scene,blocks,unknowns,", 22);
    assert_non_null(fgets(line, sizeof line, file));
    assert_memory_equal(line, "coarse,2,", 9);
    fclose(file);
    assert_int_equal(nmm_bench_plot(bench, "t.bmp"), NMM_ERROR_ARGUMENT);
    nmm_bench_destroy(bench);
    bench = measure(&def);
    assert_int_equal(nmm_bench_write_csv(bench, "nowhere/t.csv"), NMM_ERROR_FILE);
    nmm_bench_destroy(bench);
    nmm_bench_destroy(NULL);
}

// --- Memory

// Each allocation fails once: at first every one, then fewer and fewer, for there are thousands.
static void memory_may_fail_anywhere(void **unused) {
    (void)unused;
    static const char *const name[] = {"table1", "fig6", "fig7"};
    for (int b = 0; b < 3; b++) {
        nmm_status status = NMM_ERROR_MEMORY;
        long failed = 0;
        for (long at = 0; status != NMM_OK; at += 1 + at / 12) {
            test_failing h = {.fail_at = at};
            nmm_bench_def def = definition(name[b]);
            nmm_bench *bench = NULL;
            def.n_thread = 1;
            def.allocate = test_failing_hook;
            def.allocate_user = &h;
            status = nmm_bench_run(&bench, &def);
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
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shares_make_a_whole),
        cmocka_unit_test(sor_that_makes_no_step_is_told),
        cmocka_unit_test(answers_are_compared_where_steps_were_shortened),
        cmocka_unit_test(errors_fall),
        cmocka_unit_test(speedups_are_quotients),
        cmocka_unit_test(whole_blocks_have_one_size),
        cmocka_unit_test(static_scenes_are_left_out_of_table1),
        cmocka_unit_test(walls_are_measured),
        cmocka_unit_test(public_dda_walls_have_its_number_of_blocks),
        cmocka_unit_test(wrong_settings_are_told),
        cmocka_unit_test(a_wrong_scene_is_told_with_its_place),
        cmocka_unit_test(it_ends_where_the_caller_wants),
        cmocka_unit_test(files_hold_the_table),
        cmocka_unit_test(memory_may_fail_anywhere),
    };
    return cmocka_run_group_tests(tests, enter, own_folder_leave);
}
