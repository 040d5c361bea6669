// SPDX-License-Identifier: MIT
//
// Joint sets: direction, spacing, persistence and pattern against the definitions of
// docs/format.md; random sets within their bounds, repeatable, and independent of the domain's
// size.

#include "scene.h"
#include "test.h"

#include <stdlib.h>

#define PI 3.14159265358979323846

static nmm_context context = {.n_thread = 1};

// A square domain of `size` with one joint set.
static nmm_scene read_set(double size, const char *set) {
    char text[1000];
    snprintf(text, sizeof text,
             "nmm: 1\n"
             "domain: [{polygon: [[0,0],[%g,0],[%g,%g],[0,%g]]}]\n"
             "materials: {rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}}\n"
             "time: {dt: 1e-3, end: 1}\n"
             "joint_sets: [{%s}]\n",
             size, size, size, size, set);
    nmm_scene scene = {0};
    if (nmm_scene_parse(&context, &scene, "set.yaml", text, strlen(text), 0, NULL) != NMM_OK)
        fail_msg("%s", scene.report);
    return scene;
}

static double length_of(const nmm_scene_joint *joint) {
    const nmm_vec2 way = nmm_vec2_sub(joint->corner[1], joint->corner[0]);
    return sqrt(nmm_vec2_dot(way, way));
}

// Offset of a joint's first end from the origin, across a direction in degrees.
static double across(nmm_vec2 p, double dip) {
    return p.y * cos(dip * PI / 180) - p.x * sin(dip * PI / 180);
}
static double along(nmm_vec2 p, double dip) {
    return p.x * cos(dip * PI / 180) + p.y * sin(dip * PI / 180);
}

static void through_going_lines(void **unused) {
    (void)unused;
    static const double dip[] = {0, 30, 90, -45, 150, 180, -90, 89.999, 1e-3};
    for (size_t i = 0; i < sizeof dip / sizeof *dip; i++) {
        char set[100];
        snprintf(set, sizeof set, "dip: %g, spacing: 1.5, origin: [3, 4]", dip[i]);
        nmm_scene scene = read_set(10, set);
        double before = -INFINITY;
        for (int k = 0; k < scene.n_joint; k++) {
            const nmm_vec2 *end = scene.joint[k].corner;
            const nmm_vec2 origin = {3, 4};
            const nmm_vec2 a = nmm_vec2_sub(end[0], origin), b = nmm_vec2_sub(end[1], origin);
            // A whole number of spacings from the origin, in the direction of the dip.
            const double offset = across(a, dip[i]) / 1.5;
            assert_near(offset, round(offset), 1e-9);
            assert_near(across(b, dip[i]) / 1.5, offset, 1e-9);
            assert_true(along(b, dip[i]) > along(a, dip[i]));
            assert_true(k == 0 || fabs(offset - before - 1) < 1e-9);
            before = offset;
            // Both ends lie outside the open domain.
            for (int e = 0; e < 2; e++) {
                const bool inside = end[e].x > 0 && end[e].x < 10 && end[e].y > 0 && end[e].y < 10;
                assert_false(inside);
            }
        }
        // As many as the width of the box across the lines asks for, give or take an edge.
        const double width = 10 * (fabs(cos(dip[i] * PI / 180)) + fabs(sin(dip[i] * PI / 180)));
        assert_near(scene.n_joint, width / 1.5, 1.01);
        nmm_scene_destroy(&context, &scene);
    }
    assert_int_equal(context.n_live, 0);
}

static void exact_where_the_axes_are(void **unused) {
    (void)unused;
    nmm_scene scene = read_set(10, "dip: 90, spacing: 2");
    // x = 2, 4, 6, 8; the domain's own edges at 0 and 10 are no joints.
    assert_int_equal(scene.n_joint, 4);
    for (int k = 0; k < 4; k++) {
        assert_near(fabs(scene.joint[k].corner[0].x - scene.joint[k].corner[1].x), 0, 0);
        assert_near(scene.joint[k].corner[0].x, 8 - 2 * k, 0);
    }
    nmm_scene_destroy(&context, &scene);
}

static void traces_and_gaps_alternate(void **unused) {
    (void)unused;
    // Trace 3, gap 1: persistence 3/4; odd lines shifted by 2.
    nmm_scene scene =
        read_set(20, "dip: 0, spacing: 1, persistence: 0.75, trace_length: 3, origin: [1, 0]");
    int n_line[20] = {0};
    for (int k = 0; k < scene.n_joint; k++) {
        const nmm_vec2 *end = scene.joint[k].corner;
        assert_near(length_of(&scene.joint[k]), 3, 1e-12);
        const int line = (int)lround(end[0].y);
        assert_near(end[0].y, line, 1e-12);
        assert_in_range(line, 1, 19);
        const double phase = fmod(end[0].x - 1 - (line % 2) * 2 + 400, 4);
        assert_near(fmin(phase, 4 - phase), 0, 1e-9);
        // Some of it is inside.
        assert_true(end[1].x > 0 && end[0].x < 20);
        n_line[line] += 1;
    }
    for (int line = 1; line < 20; line++)
        assert_in_range(n_line[line], 5, 6);
    nmm_scene_destroy(&context, &scene);
}

static void persistence_is_trace_over_period(void **unused) {
    (void)unused;
    static const double persistence[] = {0.1, 0.5, 0.9};
    for (int i = 0; i < 3; i++) {
        char set[200];
        snprintf(set, sizeof set,
                 "dip: 27, spacing: 0.5, persistence: %g, trace_length: 1.2, "
                 "spread: {position: 1}, inside: [[20,20],[180,20],[180,180],[20,180]]",
                 persistence[i]);
        nmm_scene scene = read_set(200, set);
        double length = 0;
        for (int k = 0; k < scene.n_joint; k++)
            length += length_of(&scene.joint[k]);
        // Length per area times spacing.
        assert_near(length * 0.5 / (160. * 160.), persistence[i], 0.002);
        nmm_scene_destroy(&context, &scene);
    }
}

static void spread_stays_within_bounds(void **unused) {
    (void)unused;
    nmm_scene scene = read_set(100, "dip: 30, spacing: 1, persistence: 0.5, trace_length: 2, "
                                    "spread: {dip: 10, spacing: 0.8, position: 0.3}, seed: 5");
    double least = INFINITY, most = -INFINITY, sum = 0;
    double line = -INFINITY;
    for (int k = 0; k < scene.n_joint; k++) {
        const nmm_vec2 *end = scene.joint[k].corner;
        const nmm_vec2 way = nmm_vec2_sub(end[1], end[0]);
        const double dip = atan2(way.y, way.x) * 180 / PI;
        least = fmin(least, dip);
        most = fmax(most, dip);
        sum += dip;
        assert_near(length_of(&scene.joint[k]), 2, 1e-12);
        // The middle keeps its line; lines keep their order and distance.
        const double offset = across(nmm_vec2_mix(end[0], end[1], 0.5), 30);
        if (fabs(offset - line) > 1e-9 && k > 0) {
            assert_true(offset - line >= 0.2 - 1e-9);
        }
        line = offset;
    }
    assert_true(least >= 20 && least < 20.2 && most <= 40 && most > 39.8);
    assert_near(sum / scene.n_joint, 30, 0.3);
    nmm_scene_destroy(&context, &scene);
}

static void seeds_repeat_and_differ(void **unused) {
    (void)unused;
    const char *set = "dip: 30, spacing: 1, spread: {dip: 5, spacing: 0.5}, seed: 5";
    nmm_scene a = read_set(20, set), b = read_set(20, set);
    nmm_scene c = read_set(20, "dip: 30, spacing: 1, spread: {dip: 5, spacing: 0.5}, seed: 6");
    assert_int_equal(a.n_joint, b.n_joint);
    int n_same = 0;
    for (int k = 0; k < a.n_joint; k++) {
        assert_memory_equal(a.joint[k].corner, b.joint[k].corner, 2 * sizeof(nmm_vec2));
        if (k < c.n_joint) n_same += memcmp(a.joint[k].corner, c.joint[k].corner, 32) == 0 ? 1 : 0;
    }
    assert_int_equal(n_same, 0);
    nmm_scene_destroy(&context, &a);
    nmm_scene_destroy(&context, &b);
    nmm_scene_destroy(&context, &c);
}

// Whatever joint a small domain has, a larger one has too.
static void larger_domain_keeps_joints(void **unused) {
    (void)unused;
    const char *set = "dip: 20, spacing: 1, persistence: 0.6, trace_length: 2, origin: [0,0], "
                      "spread: {dip: 8, spacing: 0.5, position: 0.5}, seed: 11";
    nmm_scene small = read_set(10, set), large = read_set(17, set);
    assert_true(large.n_joint > small.n_joint);
    for (int k = 0; k < small.n_joint; k++) {
        bool found = false;
        for (int j = 0; j < large.n_joint && !found; j++) {
            const nmm_vec2 *p = small.joint[k].corner, *q = large.joint[j].corner;
            found = fabs(p[0].x - q[0].x) + fabs(p[0].y - q[0].y) + fabs(p[1].x - q[1].x) < 1e-9;
        }
        assert_true(found);
    }
    nmm_scene_destroy(&context, &small);
    nmm_scene_destroy(&context, &large);
}

static void inside_cuts_traces(void **unused) {
    (void)unused;
    // A U: the traces of its legs are cut in two, those of its foot are whole.
    nmm_scene scene = read_set(10, "dip: 0, spacing: 1, origin: [0, 0.5], "
                                   "inside: [[1,1],[9,1],[9,8],[7,8],[7,3],[3,3],[3,8],[1,8]]");
    assert_int_equal(scene.n_joint, 2 + 2 * 5);
    for (int k = 0; k < scene.n_joint; k++) {
        const nmm_vec2 *end = scene.joint[k].corner;
        const bool foot = end[0].y < 3;
        assert_near(length_of(&scene.joint[k]), foot ? 8 : 2, 1e-12);
        assert_near(end[0].x, foot || k % 2 == 0 ? 1 : 7, 1e-12);
    }
    nmm_scene_destroy(&context, &scene);
    // Two polygons that share a side hold one trace, not two.
    scene = read_set(10, "dip: 0, spacing: 20, origin: [0, 2], "
                         "inside: [[[1,1],[4,1],[4,3],[1,3]], [[4,1],[6,1],[6,3],[4,3]]]");
    assert_int_equal(scene.n_joint, 1);
    assert_near(length_of(&scene.joint[0]), 5, 1e-12);
    nmm_scene_destroy(&context, &scene);
}

static void far_coordinates_keep_the_pattern(void **unused) {
    (void)unused;
    char text[600];
    snprintf(text, sizeof text,
             "nmm: 1\ndomain: [{circle: {center: [4.2e6, 5e5], radius: 20}}]\n"
             "materials: {rock: {density: 2500, youngs_modulus: 5e9, poissons_ratio: 0.25}}\n"
             "time: {dt: 1e-3, end: 1}\n"
             "joint_sets: [{name: far, dip: 40, spacing: 2, origin: [0, 0]}]\n");
    nmm_scene scene = {0};
    assert_int_equal(nmm_scene_parse(&context, &scene, "far", text, strlen(text), 0, NULL), NMM_OK);
    assert_in_range(scene.n_joint, 20, 30);
    for (int k = 0; k < scene.n_joint; k++) {
        assert_string_equal(scene.joint[k].name, "far");
        assert_int_equal(scene.joint[k].set, 0);
        const double offset = across(scene.joint[k].corner[0], 40) / 2;
        assert_near(offset, round(offset), 1e-8);
    }
    nmm_scene_destroy(&context, &scene);
}

static int nothing_is_left(void **unused) {
    (void)unused;
    return context.n_live == 0 ? 0 : 1;
}

int main(void) {
    const struct CMUnitTest test[] = {
        cmocka_unit_test(through_going_lines),
        cmocka_unit_test(exact_where_the_axes_are),
        cmocka_unit_test(traces_and_gaps_alternate),
        cmocka_unit_test(persistence_is_trace_over_period),
        cmocka_unit_test(spread_stays_within_bounds),
        cmocka_unit_test(seeds_repeat_and_differ),
        cmocka_unit_test(larger_domain_keeps_joints),
        cmocka_unit_test(inside_cuts_traces),
        cmocka_unit_test(far_coordinates_keep_the_pattern),
    };
    return cmocka_run_group_tests(test, NULL, nothing_is_left);
}
