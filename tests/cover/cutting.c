// SPDX-License-Identifier: MIT
//
// The cutting: hand-made scenes whose blocks, covers and loops are known.

#include "stage.h"

static void rectangle_alone(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(stage_loops(&s), 1);
    assert_close(s.report.area, 60.0, 1e-12);
    assert_near(s.model.origin.x, 5, 0);
    assert_near(s.model.size, 1, 1e-9);
    stage_close(&s);
}

static void single_element(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 10);
    stage_rectangle(&s, 0, 0, 1, 1);
    stage_build(&s);
    assert_int_equal(s.model.n_element, 1);
    assert_int_equal(s.model.n_cover, 3);
    assert_int_equal(s.model.n_point, 4);
    assert_int_equal(s.model.n_vertex, 4);
    stage_close(&s);
}

static void through_joint(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_line(&s, -1, 2.2, 11, 3.7);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(stage_loops(&s), 2);
    assert_int_equal(s.report.n_trimmed, 0);
    assert_int_equal(s.report.n_joint_outside, 0);
    assert_close(s.report.area, 60.0, 1e-12);
    stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangle_alone),
        cmocka_unit_test(single_element),
        cmocka_unit_test(through_joint),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
