// SPDX-License-Identifier: MIT
//
// Exact predicates on integer points: hand-made limits, and random ones against slow reference
// code.

#include "test.h"

#include "integer.h"

#include <stdlib.h>

static const int64_t big = NMM_COORDINATE_MAX;

static void orientation_at_the_limits(void **state) {
    (void)state;
    const nmm_ipoint a = {-big, -big}, b = {big, big - 1};
    // One unit beside a diagonal of 2^41: doubles cannot tell.
    assert_int_equal(nmm_orientation(a, b, (nmm_ipoint){big - 1, big - 2}), -1);
    assert_int_equal(nmm_orientation(a, b, (nmm_ipoint){-big + 1, -big + 1}), 1);
    assert_int_equal(nmm_orientation(a, (nmm_ipoint){big, big}, (nmm_ipoint){7, 7}), 0);
}

static void crossing_segments(void **state) {
    (void)state;
    const nmm_isegment s = {{0, 0}, {10, 10}, 0, 0}, t = {{0, 10}, {10, 0}, 0, 0};
    assert_true(nmm_isegment_cross(s, t));
    const nmm_ipoint p = nmm_isegment_crossing(s, t);
    assert_true(p.x == 5 && p.y == 5);
    // Ends that touch, segments on one line and parallel ones do not cross.
    assert_false(nmm_isegment_cross(s, (nmm_isegment){{5, 5}, {9, 0}, 0, 0}));
    assert_false(nmm_isegment_cross(s, (nmm_isegment){{5, 5}, {20, 20}, 0, 0}));
    assert_false(nmm_isegment_cross(s, (nmm_isegment){{0, 1}, {10, 11}, 0, 0}));
}

static void halves_are_rounded_up(void **state) {
    (void)state;
    const nmm_isegment s = {{0, 0}, {1, 0}, 0, 0};
    // Crossing at (1/2, 0), then at (-1/2, 0).
    nmm_ipoint p = nmm_isegment_crossing(s, (nmm_isegment){{0, -1}, {1, 1}, 0, 0});
    assert_true(p.x == 1 && p.y == 0);
    p = nmm_isegment_crossing((nmm_isegment){{-1, 0}, {0, 0}, 0, 0},
                              (nmm_isegment){{-1, -1}, {0, 1}, 0, 0});
    assert_true(p.x == 0 && p.y == 0);
}

static void crossing_at_the_limits(void **state) {
    (void)state;
    const nmm_isegment s = {{-big, -big}, {big, big}, 0, 0}, t = {{-big, big}, {big, -big}, 0, 0};
    nmm_ipoint p = nmm_isegment_crossing(s, t);
    assert_true(p.x == 0 && p.y == 0);
    // Nearly parallel.
    const nmm_isegment u = {{-big, -big + 1}, {big, big - 1}, 0, 0};
    p = nmm_isegment_crossing(s, u);
    assert_true(p.x == 0 && p.y == 0);
}

// Any order and direction of the two segments gives the same point.
static void crossing_does_not_depend_on_direction(void **state) {
    (void)state;
    nmm_random random = nmm_random_seed(11);
    for (int k = 0; k < 20000; k++) {
        nmm_ipoint p[4];
        const int bits = 4 + (int)(nmm_random_next(&random) % 37);
        for (int i = 0; i < 4; i++) {
            p[i].x =
                (int64_t)(nmm_random_next(&random) >> (64 - bits)) - (INT64_C(1) << (bits - 1));
            p[i].y =
                (int64_t)(nmm_random_next(&random) >> (64 - bits)) - (INT64_C(1) << (bits - 1));
        }
        const nmm_isegment s = {p[0], p[1], 0, 0}, t = {p[2], p[3], 0, 0};
        const nmm_isegment back = {p[1], p[0], 0, 0}, turned = {p[3], p[2], 0, 0};
        const bool cross = nmm_isegment_cross(s, t);
        assert_int_equal(cross, nmm_isegment_cross(turned, back));
        if (!cross) continue;
        const nmm_ipoint c = nmm_isegment_crossing(s, t);
        assert_true(nmm_ipoint_equal(c, nmm_isegment_crossing(t, s)));
        assert_true(nmm_ipoint_equal(c, nmm_isegment_crossing(back, turned)));
        // Both segments meet the pixel of the rounded point: it is a hot pixel of both.
        assert_true(nmm_isegment_meets_pixel(s.a, s.b, c));
        assert_true(nmm_isegment_meets_pixel(turned.a, turned.b, c));
    }
}

// Reference for the pixel test: walk along the segment in exact fractions. x and y in units of
// 1 / (2 n), at the parameters where a pixel border of x or y is crossed, and between them.
static bool slow_meets(nmm_ipoint a, nmm_ipoint b, nmm_ipoint p) {
    const int64_t dx = b.x - a.x, dy = b.y - a.y;
    const int64_t n = 2 * (dx != 0 ? llabs(dx) : 1) * (dy != 0 ? llabs(dy) : 1);
    // Parameters k / (2 n): all border crossings are multiples of 1 / n, middles lie between.
    for (int64_t k = 0; k <= 2 * n; k++) {
        const int64_t x = 2 * n * (a.x - p.x) + k * dx, y = 2 * n * (a.y - p.y) + k * dy;
        if (x >= -n && x < n && y >= -n && y < n) return true;
    }
    return false;
}

static void pixels_against_reference(void **state) {
    (void)state;
    nmm_random random = nmm_random_seed(5);
    int n_met = 0;
    for (int k = 0; k < 4000; k++) {
        nmm_ipoint p[3];
        for (int i = 0; i < 3; i++) {
            p[i].x = (int64_t)(nmm_random_next(&random) % 9);
            p[i].y = (int64_t)(nmm_random_next(&random) % 9);
        }
        const bool meets = nmm_isegment_meets_pixel(p[0], p[1], p[2]);
        assert_int_equal(meets, slow_meets(p[0], p[1], p[2]));
        assert_int_equal(meets, nmm_isegment_meets_pixel(p[1], p[0], p[2]));
        n_met += meets;
    }
    assert_true(n_met > 300);
}

static void angles_in_order(void **state) {
    (void)state;
    const nmm_ipoint o = {3, -2};
    const int64_t step[][2] = {{5, 0},  {7, 1},   {1, 1},   {0, 4},  {-1, 9}, {-6, 1},
                               {-2, 0}, {-5, -1}, {-1, -9}, {0, -1}, {4, -4}, {9, -1}};
    const int n = (int)(sizeof step / sizeof step[0]);
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            const nmm_ipoint a = {o.x + step[i][0], o.y + step[i][1]};
            const nmm_ipoint b = {o.x + step[j][0], o.y + step[j][1]};
            assert_int_equal(nmm_ipoint_compare_angle(o, a, b), (i > j) - (i < j));
        }
    }
    assert_int_equal(nmm_ipoint_compare_angle(o, (nmm_ipoint){4, -1}, (nmm_ipoint){9, 4}), 0);
}

static void sorting(void **state) {
    (void)state;
    nmm_random random = nmm_random_seed(8);
    for (int n = 0; n < 40; n++) {
        nmm_ipoint point[40], spare[40];
        for (int i = 0; i < n; i++) {
            point[i].x = (int64_t)(nmm_random_next(&random) % 5);
            point[i].y = (int64_t)(nmm_random_next(&random) % 5);
        }
        const nmm_ipoint *sorted = nmm_ipoint_sort(n, point, spare);
        for (int i = 1; i < n; i++)
            assert_true(nmm_ipoint_compare(sorted[i - 1], sorted[i]) <= 0);
    }
}

static void polygon_area(void **state) {
    (void)state;
    const nmm_ipoint corner[4] = {{-big, -big}, {big, -big}, {big, big}, {-big, big}};
    const double area = (double)nmm_ipolygon_area(4, corner);
    assert_near(area, 2 * 4.0 * (double)big * (double)big, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(orientation_at_the_limits),
        cmocka_unit_test(crossing_segments),
        cmocka_unit_test(halves_are_rounded_up),
        cmocka_unit_test(crossing_at_the_limits),
        cmocka_unit_test(crossing_does_not_depend_on_direction),
        cmocka_unit_test(pixels_against_reference),
        cmocka_unit_test(angles_in_order),
        cmocka_unit_test(sorting),
        cmocka_unit_test(polygon_area),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
