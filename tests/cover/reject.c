// SPDX-License-Identifier: MIT
//
// Wrong geometry is refused with what is wrong and where; nothing leaks, also when any one
// allocation fails.

#include "stage.h"

#include <stdlib.h>

static const nmm_mark here = {.line = 7, .column = 3};

// The scene must be refused, with these words, at `here` if a line is expected.
static void expect_reject(stage *s, const char *words, int line) {
    const nmm_status status = nmm_cover_build(&s->context, &s->scene, &s->model, &s->report);
    assert_int_equal(status, NMM_ERROR_INPUT);
    if (strstr(s->context.error.message, words) == NULL) {
        print_error("expected '%s' in: %s\n", words, s->context.error.message);
        fail();
    }
    assert_int_equal(s->context.error.line, line);
    nmm_context_clear(&s->context);
    stage_close(s);
}

static void nothing_at_all(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    expect_reject(&s, "no material", 0);
}

static void flat_polygons(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 1, 1);
    stage_domain(&s, 3, (double[]){0, 0, 1, 1, 3, 3}, 0);
    s.scene.domain[1].mark = here;
    expect_reject(&s, "no area", 7);
    stage_open(&s, 1);
    stage_block(&s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "good");
    stage_block(&s, 3, (double[]){5, 0, 6, 0, 7, 0}, "flat");
    s.scene.block[1].area.mark = here;
    expect_reject(&s, "block", 7);
}

static void crossing_outline(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_domain(&s, 4, (double[]){0, 0, 4, 4, 4, 0, 0, 3}, 0);
    s.scene.domain[0].mark = here;
    expect_reject(&s, "crosses itself", 7);
}

static void holes(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 4, 4);
    stage_hole(&s, 3, (double[]){5, 5, 6, 5, 6, 6});
    s.scene.hole[0].mark = here;
    expect_reject(&s, "outside the domain", 7);
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 4, 4);
    stage_hole(&s, 4, (double[]){-1, -1, 5, -1, 5, 5, -1, 5});
    expect_reject(&s, "nothing is left", 0);
    stage_open(&s, 1);
    stage_block(&s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "block");
    stage_hole(&s, 3, (double[]){0, 0, 1, 0, 1, 1});
    s.scene.hole[0].mark = here;
    expect_reject(&s, "no domain", 7);
}

static void numbers(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 4, 4);
    STAGE_JOINT(&s, 1, 0, 1, NAN, 2);
    s.scene.joint[0].mark = here;
    expect_reject(&s, "finite", 7);
    const double sizes[] = {1e-5, 1e7, -1, NAN, INFINITY};
    for (int k = 0; k < 5; k++) {
        stage_open(&s, sizes[k]);
        stage_rectangle(&s, 0, 0, 4, 4);
        expect_reject(&s, "covers.size", 0);
    }
    // Few elements, but finer than map coordinates can tell apart.
    stage_open(&s, 1e-6);
    stage_rectangle(&s, 4e6, 4e6, 4e6 + 1e-3, 4e6 + 1e-3);
    expect_reject(&s, "too small", 0);
}

// --- Memory

static void fill_scene(stage *s) {
    stage_open(s, 1);
    stage_rectangle(s, 0, 0, 5, 4);
    stage_hole(s, 3, (double[]){1, 1, 1.3, 1, 1.3, 1.3});
    stage_region(s, 3, (double[]){0, 0, 5, 0, 5, 4}, 1);
    for (int k = 0; k < 5; k++) {
        stage_line(s, k, -1, k + 0.4, 5);
        stage_line(s, -1, 0.7 * k, 4.5, 0.8 * k + 1e-9);
        stage_line(s, -1, 0.7 * k + 1e-9, 4.5, 0.8 * k);
    }
    stage_block(s, 3, (double[]){6, 0, 8, 0, 7, 3}, "triangle");
    stage_block(s, 3, (double[]){8, 0, 9, 3, 7, 3}, "neighbour");
}

static void run_out_of_memory(nmm_mesh mesh) {
    stage s;
    fill_scene(&s);
    s.scene.settings.mesh = mesh;
    nmm_context limited = {.n_thread = 1, .allocate = test_failing_hook};
    long n = 0;
    for (;; n++) {
        test_failing hook = {.fail_at = n};
        limited.user = &hook;
        nmm_model model = {0};
        const nmm_status status = nmm_cover_build(&limited, &s.scene, &model, NULL);
        nmm_model_destroy(&limited, &model);
        assert_int_equal(limited.n_live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        nmm_context_clear(&limited);
    }
    assert_true(n > 30);
    stage_close(&s);
}

static void memory_runs_out(void **state) {
    (void)state;
    run_out_of_memory(NMM_MESH_LATTICE);
    run_out_of_memory(NMM_MESH_BLOCK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_at_all),   cmocka_unit_test(flat_polygons),
        cmocka_unit_test(crossing_outline), cmocka_unit_test(holes),
        cmocka_unit_test(numbers),          cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
