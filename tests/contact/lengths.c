// SPDX-License-Identifier: MIT
//
// Tributary lengths, eq. (5.2): the contact patch test on straight sides cut in any way.

#include "bodies.h"

enum { MOST = 40 };

// Base below y = 0 and brick above, each with a cut side; x ascending in both lists.
typedef struct sides {
    int n[2];
    double x[2][MOST];
} sides;

static bodies open_sides(const sides *s, double size) {
    nmm_vec2 corner[2][MOST + 2];
    const int n = s->n[0], m = s->n[1];
    // The base's top runs to the left, the brick's bottom to the right.
    for (int i = 0; i < n; i++)
        corner[0][i] = (nmm_vec2){s->x[0][n - 1 - i], 0};
    corner[0][n] = (nmm_vec2){s->x[0][0], -1};
    corner[0][n + 1] = (nmm_vec2){s->x[0][n - 1], -1};
    for (int i = 0; i < m; i++)
        corner[1][i] = (nmm_vec2){s->x[1][i], 0};
    corner[1][m] = (nmm_vec2){s->x[1][m - 1], 1};
    corner[1][m + 1] = (nmm_vec2){s->x[1][0], 1};
    const loop loops[2] = {{0, n + 2, corner[0]}, {1, m + 2, corner[1]}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, size), NMM_OK);
    return b;
}

// Hat function of point i of n points at x.
static double hat(int n, const double *x, int i, double at) {
    if (at <= x[i]) {
        if (i == 0) return at == x[i];
        return nmm_max(0, (at - x[i - 1]) / (x[i] - x[i - 1]));
    }
    if (i == n - 1) return 0;
    return nmm_max(0, (x[i + 1] - at) / (x[i + 1] - x[i]));
}

// Its integral over [low, high]: quadratic in each half, by Simpson's rule on the clipped half.
static double hat_integral(int n, const double *x, int i, double low, double high) {
    double sum = 0;
    for (int half = 0; half < 2; half++) {
        const int k = i - 1 + half;
        if (k < 0 || k + 1 >= n) continue;
        const double a = nmm_max(low, x[k]), b = nmm_min(high, x[k + 1]);
        if (b <= a) continue;
        const double at_a = half == 0 ? a - x[k] : x[k + 1] - a;
        const double at_b = half == 0 ? b - x[k] : x[k + 1] - b;
        sum += 0.5 * (b - a) * (at_a + at_b) / (x[k + 1] - x[k]);
    }
    return sum;
}

// A unit pressure on the common part gives each point of both sides what the integral says.
static void check_patch(const sides *s, bodies *b, double tolerance) {
    const double low = nmm_max(s->x[0][0], s->x[1][0]);
    const double high = nmm_min(s->x[0][s->n[0] - 1], s->x[1][s->n[1] - 1]);
    assert_near(bodies_length(b, 0, 1), nmm_max(0, high - low), tolerance);
    for (int side = 0; side < 2; side++) {
        for (int i = 0; i < s->n[side]; i++) {
            double sum = 0;
            for (int k = 0; k < b->state.n_contact; k++) {
                const nmm_contact *c = &b->state.contact[k];
                // A vertex that ends the other side's interval may stand off by a rounding.
                const double x = nmm_min(high, nmm_max(low, b->state.position[2 * c->vertex]));
                sum += c->length * hat(s->n[side], s->x[side], i, x);
            }
            const double exact = hat_integral(s->n[side], s->x[side], i, low, high);
            assert_near(sum, exact, tolerance);
        }
    }
}

static void add_point(sides *s, int side, double x) {
    int k = s->n[side]++;
    for (; k > 0 && s->x[side][k - 1] > x; k--)
        s->x[side][k] = s->x[side][k - 1];
    s->x[side][k] = x;
}

static void test_random_partitions(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(4);
    for (int trial = 0; trial < 300; trial++) {
        sides s = {0};
        for (int side = 0; side < 2; side++) {
            add_point(&s, side, nmm_random_unit(&random));
            add_point(&s, side, 2 + nmm_random_unit(&random));
            const int n = (int)(nmm_random_next(&random) % 12);
            for (int k = 0; k < n; k++)
                add_point(&s, side, 1 + nmm_random_unit(&random));
        }
        bodies b = open_sides(&s, 0.3);
        bodies_find(&b, 0.01);
        check_patch(&s, &b, 1e-12);
        bodies_close(&b);
    }
}

// Points of both sides that nearly or exactly coincide.
static void test_near_points(void **unused) {
    (void)unused;
    const double off[] = {0, 1e-15, 1e-9, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2};
    for (size_t k = 0; k < sizeof off / sizeof off[0]; k++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const double d = sign * off[k];
            const sides s = {{4, 4}, {{0, 1, 2, 3}, {0 + d, 1 - d, 2 + d, 3 + d}}};
            bodies b = open_sides(&s, 1);
            bodies_find(&b, 0.02);
            // Points nearer than 1e-9 h count as one.
            check_patch(&s, &b, off[k] > 1e-8 ? 1e-12 : 4e-9);
            bodies_close(&b);
        }
    }
}

static void test_bricks(void **unused) {
    (void)unused;
    const double x0[] = {0, 0.5, 1.5, -1.25, 2, 2.5, -3};
    const double expected[] = {2, 1.5, 0.5, 0.75, 0, 0, 0};
    for (int k = 0; k < 7; k++) {
        const sides s = {{2, 2}, {{0, 2}, {x0[k], x0[k] + 2}}};
        bodies b = open_sides(&s, 1);
        bodies_find(&b, 0.01);
        assert_near(bodies_length(&b, 0, 1), expected[k], 1e-14);
        bodies_close(&b);
    }
}

// Turned by any angle, and with a slight gap or overlap: the same lengths.
static void test_turned_and_apart(void **unused) {
    (void)unused;
    const sides s = {{5, 4}, {{0, 0.3, 1.1, 1.7, 3}, {0.2, 0.9, 1.6, 2.8}}};
    for (int k = 0; k < 24; k++) {
        const double angle = 0.27 * k, gap = 1e-3 * (k % 3 - 1);
        bodies b = open_sides(&s, 1);
        // Both about the base's centre: the brick's own turn and the way of its centre.
        const double *c = b.model.element_centre;
        const double rx = c[2] - c[0], ry = c[3] - c[1] + gap;
        bodies_put(&b, 0, 0, 0, angle);
        bodies_put(&b, 1, cos(angle) * rx - sin(angle) * ry - c[2] + c[0],
                   sin(angle) * rx + cos(angle) * ry - c[3] + c[1], angle);
        bodies_find(&b, 0.01);
        assert_int_equal(bodies_count(&b, 0, 1), 7);
        assert_near(bodies_length(&b, 0, 1), 2.6, 1e-12);
        for (int i = 0; i < b.state.n_contact; i++)
            assert_near(b.state.contact[i].gap, gap, 1e-12);
        bodies_close(&b);
    }
}

// From parallel to slanted: the length goes over from the interval to the corner without a jump.
static void test_slanted(void **unused) {
    (void)unused;
    const sides s = {{2, 2}, {{0, 4}, {1, 3}}};
    double before = -1;
    for (int k = 0; k <= 600; k++) {
        const double angle = 1e-4 * k * 3;
        bodies b = open_sides(&s, 1);
        // About the left foot (1, 0), which is at (-1, -0.5) from the centre.
        bodies_put(&b, 1, -1 + cos(angle) - 0.5 * sin(angle), -0.5 + sin(angle) + 0.5 * cos(angle),
                   angle);
        bodies_find(&b, 0.2);
        const nmm_contact *foot = bodies_contact(&b, bodies_vertex(&b, 1), 0);
        assert_non_null(foot);
        assert_near(foot->gap, 0, 1e-12);
        if (k == 0) assert_near(foot->length, 1, 1e-12);
        if (angle > 0.08) assert_near(foot->length, 0.5, 1e-12);
        if (before >= 0) assert_near(foot->length, before, 0.01);
        before = foot->length;
        bodies_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_partitions),
        cmocka_unit_test(test_near_points),
        cmocka_unit_test(test_bricks),
        cmocka_unit_test(test_turned_and_apart),
        cmocka_unit_test(test_slanted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
