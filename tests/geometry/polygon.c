// SPDX-License-Identifier: MIT
//
// Moments of polygons by simplex integration: exact fractions, far coordinates, thin polygons.

#include "test.h"

#include "geometry.h"

static const nmm_vec2 pentagon[5] = {{0, 0}, {4, 1}, {5, 4}, {2, 6}, {-1, 3}};
static const nmm_vec2 zero = {0, 0};

// The fractions were computed with rational arithmetic.
static void exact_fractions(void **state) {
    (void)state;
    static const struct {
        int p, q;
        double value;
    } expected[] = {
        {0, 0, 45.0 / 2},     {1, 0, 265.0 / 6},      {0, 1, 383.0 / 6},   {2, 0, 1565.0 / 12},
        {1, 1, 1073.0 / 8},   {0, 2, 2659.0 / 12},    {3, 0, 1717.0 / 4},  {2, 1, 23999.0 / 60},
        {1, 2, 5779.0 / 12},  {0, 3, 3447.0 / 4},     {4, 0, 9185.0 / 6},  {3, 1, 159083.0 / 120},
        {2, 2, 85081.0 / 60}, {1, 3, 229039.0 / 120}, {0, 4, 21631.0 / 6},
    };
    for (size_t i = 0; i < sizeof expected / sizeof expected[0]; i++) {
        const double value = nmm_polygon_integral(5, pentagon, zero, expected[i].p, expected[i].q);
        assert_close(value, expected[i].value, 1e-14);
    }
}

// Rectangle [1, 3] x [2, 5]: products of one-dimensional integrals, all degrees up to 8.
static void rectangle_to_degree_eight(void **state) {
    (void)state;
    const nmm_vec2 corner[4] = {{1, 2}, {3, 2}, {3, 5}, {1, 5}};
    for (int p = 0; p <= 8; p++) {
        for (int q = 0; p + q <= 8; q++) {
            const double x = (pow(3, p + 1) - 1) / (p + 1);
            const double y = (pow(5, q + 1) - pow(2, q + 1)) / (q + 1);
            assert_close(nmm_polygon_integral(4, corner, zero, p, q), x * y, 1e-14);
        }
    }
}

static void centred_moments(void **state) {
    (void)state;
    const nmm_moments m = nmm_polygon_moments(5, pentagon);
    const double area = 45.0 / 2, cx = 265.0 / 6 / area, cy = 383.0 / 6 / area;
    assert_close(m.area, area, 1e-15);
    assert_close(m.centre.x, cx, 1e-14);
    assert_close(m.centre.y, cy, 1e-14);
    assert_close(m.xx, 1565.0 / 12 - area * cx * cx, 1e-14);
    assert_close(m.xy, 1073.0 / 8 - area * cx * cy, 1e-13);
    assert_close(m.yy, 2659.0 / 12 - area * cy * cy, 1e-14);
    assert_close(nmm_polygon_integral(5, pentagon, m.centre, 2, 0), m.xx, 1e-14);
    assert_near(nmm_polygon_integral(5, pentagon, m.centre, 1, 0), 0, 1e-13);
}

// Shifted by 1e7: the same moments about the centroid, to the bit.
static void far_away(void **state) {
    (void)state;
    nmm_vec2 far[5];
    for (int i = 0; i < 5; i++)
        far[i] = (nmm_vec2){pentagon[i].x + 1e7, pentagon[i].y - 1e7};
    const nmm_moments near = nmm_polygon_moments(5, pentagon);
    const nmm_moments m = nmm_polygon_moments(5, far);
    assert_near(m.area, near.area, 0);
    assert_near(m.xx, near.xx, 0);
    assert_near(m.xy, near.xy, 0);
    assert_near(m.yy, near.yy, 0);
    assert_near(m.centre.x - 1e7, near.centre.x, 2e-9);
    const nmm_vec2 origin = {1e7, -1e7};
    assert_close(nmm_polygon_integral(5, far, origin, 2, 2), 85081.0 / 60, 1e-14);
}

static void clockwise_is_negative(void **state) {
    (void)state;
    nmm_vec2 turned[5];
    for (int i = 0; i < 5; i++)
        turned[i] = pentagon[4 - i];
    assert_close(nmm_polygon_moments(5, turned).area, -22.5, 1e-15);
}

static void no_area(void **state) {
    (void)state;
    const nmm_vec2 line[3] = {{1, 1}, {2, 2}, {6, 6}};
    const nmm_moments m = nmm_polygon_moments(3, line);
    assert_near(m.area, 0, 0);
    assert_near(m.centre.x, 3, 1e-15);
    assert_near(nmm_polygon_moments(0, NULL).area, 0, 0);
}

// A triangle as long as 2^36 and half a unit large: area and centroid keep their digits.
static void sliver(void **state) {
    (void)state;
    const double L = 68719476736.0;
    const nmm_vec2 corner[3] = {{3, 5}, {L + 3, L + 4}, {L + 4, L + 5}};
    const nmm_moments m = nmm_polygon_moments(3, corner);
    // J = L * L - (L - 1) (L + 1) + ... = L (L + 0) - (L - 1) (L + 1) = 1.
    assert_near(m.area, 0.5, 0);
    assert_close(m.centre.x, (2 * L + 10) / 3, 1e-15);
    assert_true(m.xx > 0 && m.yy > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_fractions),
        cmocka_unit_test(rectangle_to_degree_eight),
        cmocka_unit_test(centred_moments),
        cmocka_unit_test(far_away),
        cmocka_unit_test(clockwise_is_negative),
        cmocka_unit_test(no_area),
        cmocka_unit_test(sliver),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
