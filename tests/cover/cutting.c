// SPDX-License-Identifier: MIT
//
// The cutting: hand-made scenes whose blocks, covers, loops and areas are known.

#include "stage.h"

// Sum of the areas of elements of one material, or of one block.
static double area_of(const int *kind, const nmm_model *m, int which) {
    double sum = 0;
    for (int e = 0; e < m->n_element; e++) {
        if (kind[e] == which) sum += m->element_area[e];
    }
    return sum;
}

// Length of the loop edges that a joint of this interface made.
static double joint_length(const stage *s, int interface) {
    const nmm_model *m = &s->model;
    double sum = 0;
    for (int v = 0; v < m->n_vertex; v++) {
        if (m->edge_interface[v] != interface) continue;
        const double *p = m->point + 2 * m->vertex_point[v];
        const double *q = m->point + 2 * m->vertex_point[m->vertex_next[v]];
        sum += hypot(q[0] - p[0], q[1] - p[1]);
    }
    return sum;
}

static int n_mates(const stage *s) {
    int n = 0;
    for (int v = 0; v < s->model.n_vertex; v++)
        n += s->model.edge_mate[v] >= 0;
    return n;
}

// --- Blocks

static void rectangle_alone(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(stage_loops(&s), 1);
    assert_int_equal(n_mates(&s), 0);
    assert_close(s.report.area, 60.0, 1e-12);
    assert_near(s.model.origin.x, 5, 0);
    assert_near(s.model.height, 5, 0);
    assert_near(s.model.box.low.x, -5, 0);
    assert_near(s.model.box.high.y, 3, 0);
    assert_near(s.model.size, 1, 1e-9);
    stage_close(&s);
}

// A block that fits into one triangle is one element of three covers.
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
    assert_close(s.model.element_moment[0], 1.0 / 12, 1e-14);
    stage_close(&s);
}

static void chosen_size(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0);
    stage_rectangle(&s, 0, 0, 48, 12);
    stage_build(&s);
    assert_near(s.report.size_chosen, 2, 1e-9);
    assert_near(s.model.size, s.report.size_chosen, 0);
    assert_true(s.model.n_element > 200 && s.model.n_element < 600);
    stage_close(&s);
}

static void through_joint(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_line(&s, -1, 2.2, 11, 3.4);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(stage_loops(&s), 2);
    assert_int_equal(s.report.n_trimmed, 0);
    assert_int_equal(s.report.n_joint_outside, 0);
    assert_close(s.report.area, 60.0, 1e-12);
    // Lower part: from 2.3 to 3.3 over 10 m. The lowest element comes first, so block 0 is below.
    assert_close(area_of(s.model.element_block, &s.model, 0), 28.0, 1e-11);
    // Both sides of the joint are loop edges, and each other's mates.
    assert_close(joint_length(&s, 1), 2 * sqrt(101), 1e-11);
    assert_true(n_mates(&s) > 20);
    stage_close(&s);
}

// A joint that ends inside is a crack: one block, one loop that runs along both sides.
static void crack(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_line(&s, 0, 3.1, 5.3, 3.1);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(stage_loops(&s), 1);
    assert_int_equal(s.report.n_trimmed, 1);
    const double length = joint_length(&s, 1);
    assert_close(length, 2 * (5.3 - s.report.trimmed_length), 1e-8);
    assert_true(s.report.trimmed_length < 1 && length > 8.6);
    stage_close(&s);
}

// A joint inside one element vanishes; one that misses the domain is counted.
static void useless_joints(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 5);
    stage_rectangle(&s, 0, 0, 20, 20);
    stage_build(&s);
    const uint64_t hash = stage_hash(&s);
    const double *centre = s.model.element_centre;
    const double x = centre[0] + 10, y = centre[1] + 10;
    stage_forget(&s);
    stage_line(&s, x - 0.02, y, x + 0.03, y);
    stage_line(&s, 21, 0, 30, 0);
    stage_line(&s, -5, -5, 100, -5);
    stage_build(&s);
    assert_true(stage_hash(&s) == hash);
    assert_int_equal(s.report.n_trimmed, 1);
    assert_close(s.report.trimmed_length, 0.05, 1e-6);
    assert_close(s.report.longest_trimmed, 0.05, 1e-6);
    assert_int_equal(s.report.n_joint_outside, 2);
    stage_close(&s);
}

static void polyline_and_tee(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    STAGE_JOINT(&s, 1, 0, 1, 4, 2.5, 7, 2, 10, 3);
    // Ends on the polyline, and just short of it: both meet it.
    STAGE_JOINT(&s, 2, 2, 1.75, 2, 6);
    STAGE_JOINT(&s, 2, 5.5, 6, 5.5, 2.25 + 1e-9);
    stage_build(&s);
    assert_close(s.report.area, 60.0, 1e-12);
    assert_int_equal(s.model.n_block, 4);
    assert_int_equal(s.report.n_trimmed, 0);
    assert_close(joint_length(&s, 2), 2 * (4.25 + 3.75), 1e-9);
    stage_close(&s);
}

// Joints that miss a slanted side by rounding are moved onto it; the side stays where it is.
static void outline_stays(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_domain(&s, 3, (double[]){0, 0, 8, 0, 0, 6}, 0);
    for (int k = 1; k < 8; k++) {
        const double error = 4e-9 * (k % 3 - 1);
        stage_line(&s, k, 0, k, 6 - 0.75 * k + error);
    }
    stage_build(&s);
    assert_int_equal(s.model.n_block, 8);
    assert_int_equal(s.report.n_trimmed, 0);
    assert_close(s.report.area, 24.0, 1e-12);
    for (int p = 0; p < s.model.n_point; p++) {
        const double x = s.model.point[2 * p] + 4, y = s.model.point[2 * p + 1] + 3;
        assert_true(0.75 * x + y - 6 < 2 * s.report.snap);
    }
    stage_close(&s);
}

// --- Holes, regions, several polygons

static void hole_with_joint(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_hole(&s, 4, (double[]){4, 2, 6, 2, 6, 4, 4, 4});
    stage_build(&s);
    assert_close(s.report.area, 56.0, 1e-12);
    assert_int_equal(stage_loops(&s), 2);
    stage_forget(&s);
    // A joint to the hole on one side only leaves one block, on both sides gives two.
    stage_line(&s, 0, 3, 4, 3);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(stage_loops(&s), 1);
    stage_forget(&s);
    stage_line(&s, 6, 3, 10, 3);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(stage_loops(&s), 2);
    stage_close(&s);
}

// Holes inside one element: its polygon is joined by cuts, moments are those of the difference.
static void holes_inside_one_element(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 40);
    stage_rectangle(&s, -2, -2, 2, 2);
    stage_hole(&s, 4, (double[]){-1, -1, 1, -1, 1, 0, -1, 0});
    stage_hole(&s, 4, (double[]){-1, 0.5, 1, 0.5, 1, 1.5, -1, 1.5});
    stage_build(&s);
    const nmm_model *m = &s.model;
    assert_int_equal(m->n_element, 1);
    assert_int_equal(m->n_corner, 4 + 2 * (4 + 2));
    assert_int_equal(m->n_point, 12);
    assert_int_equal(stage_loops(&s), 3);
    assert_close(m->element_area[0], 12.0, 1e-14);
    // Centroid: -(2 * -0.5 + 2 * 1) / 12.
    assert_close(m->element_centre[1], -1.0 / 12, 1e-13);
    const double xx = 4 * 64.0 / 12 - 2 * (1 * 8.0 / 12);
    assert_close(m->element_moment[0], xx, 1e-13);
    // No cut runs through a hole: each stays within the element.
    for (int k = 0; k < m->n_corner; k++) {
        const double *p = m->point + 2 * m->corner_point[k];
        const double *q = m->point + 2 * m->corner_point[(k + 1) % m->n_corner];
        const double x = (p[0] + q[0]) / 2, y = (p[1] + q[1]) / 2;
        const bool first = fabs(x) < 1 && y > -1 && y < 0;
        const bool second = fabs(x) < 1 && y > 0.5 && y < 1.5;
        assert_false(first || second);
    }
    stage_close(&s);
}

// The corner nearest to the hole lies behind a slot: the cut goes to one that can be seen.
static void hidden_corner(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 40);
    stage_domain(&s, 11, (double[]){-2, -2, -0.6, -2, -0.6, 0.5, -0.5, 0.5,  -0.5, -2, 2,
                                    -2, 2,  2,    -2, 2,    -2,  0.05, -0.7, 0,    -2, -0.05},
                 0);
    stage_hole(&s, 3, (double[]){-0.4, 0, 0, -0.2, 0, 0.2});
    stage_build(&s);
    const nmm_model *m = &s.model;
    assert_int_equal(m->n_element, 1);
    int n_cut = 0;
    for (int k = 0; k < m->n_corner; k++) {
        const double *p = m->point + 2 * m->corner_point[k];
        const double *q = m->point + 2 * m->corner_point[(k + 1) % m->n_corner];
        const bool from_hole = fabs(p[0] + 0.4) < 1e-9 && fabs(p[1]) < 1e-9;
        if (from_hole && q[0] < -0.45) n_cut += fabs(q[0] + 0.5) < 1e-9 && q[1] > 0.4;
        if (from_hole) assert_false(fabs(q[0] + 0.7) < 1e-9);
    }
    assert_int_equal(n_cut, 1);
    stage_close(&s);
}

static void regions_split_but_connect(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_rectangle(&s, 0, 0, 10, 6);
    stage_region(&s, 4, (double[]){-1e6, -1e6, 1e6, -1e6, 1e6, 2.25, -1e6, 2.25}, 1);
    stage_region(&s, 4, (double[]){2, 1, 4, 1, 4, 3, 2, 3}, 2);
    stage_region(&s, 3, (double[]){50, 1, 60, 1, 60, 3}, 2);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(stage_loops(&s), 1);
    assert_int_equal(s.report.n_region_outside, 1);
    assert_non_null(strstr(s.scene.warnings,
                           "warning: no material lies inside this region: it changes nothing"));
    assert_close(area_of(s.model.element_material, &s.model, 2), 4.0, 1e-11);
    assert_close(area_of(s.model.element_material, &s.model, 1), 22.5 - 2.5, 1e-11);
    assert_close(s.report.area, 60.0, 1e-12);
    stage_close(&s);
}

// Polygons that share a border are one piece, also where only a part of the border is common.
static void welded_polygons(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_domain(&s, 4, (double[]){0, 0, 10, 0, 10, 6, 0, 6}, 0);
    stage_domain(&s, 4, (double[]){2, 6, 8, 6, 8, 9, 2, 9}, 1);
    stage_domain(&s, 4, (double[]){20, 0, 22, 0, 22, 2, 20, 2}, 2);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(stage_loops(&s), 2);
    assert_close(area_of(s.model.element_material, &s.model, 1), 18.0, 1e-11);
    assert_close(s.report.area, 82.0, 1e-12);
    stage_close(&s);
}

// Two squares that touch in one point are two blocks, each with its own point there.
static void touching_in_a_point(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0.5);
    stage_rectangle(&s, 0, 0, 1, 1);
    stage_rectangle(&s, 1, 1, 2, 2);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(stage_loops(&s), 2);
    int n = 0;
    for (int p = 0; p < s.model.n_point; p++)
        n += s.model.point[2 * p] == 0 && s.model.point[2 * p + 1] == 0;
    assert_int_equal(n, 2);
    stage_close(&s);
}

static void clockwise_input(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 1);
    stage_domain(&s, 4, (double[]){0, 6, 10, 6, 10, 0, 0, 0}, 0);
    stage_hole(&s, 4, (double[]){4, 4, 6, 4, 6, 2, 4, 2});
    stage_build(&s);
    assert_close(s.report.area, 56.0, 1e-12);
    stage_close(&s);
}

// Corners that are no multiples of a power of two.
static void circle_area(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0.31);
    double corner[96];
    for (int i = 0; i < 48; i++) {
        corner[2 * i] = 1.7 + 2.3 * cos(2 * M_PI * i / 48);
        corner[2 * i + 1] = -0.9 + 2.3 * sin(2 * M_PI * i / 48);
    }
    stage_domain(&s, 48, corner, 0);
    stage_build(&s);
    assert_close(s.report.area, 24 * 2.3 * 2.3 * sin(2 * M_PI / 48), 1e-12);
    stage_close(&s);
}

// Separate blocks: no points in common, no mates; joints, holes and regions leave them alone.
static void separate_blocks(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0.4);
    stage_block(&s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "left");
    stage_block(&s, 4, (double[]){1, 0, 2, 0, 2, 1, 1, 1}, "right");
    stage_block(&s, 3, (double[]){0, 1, 2, 1, 1, 2}, NULL);
    stage_line(&s, -1, 0.5, 3, 0.5);
    stage_region(&s, 4, (double[]){-1, -1, 3, -1, 3, 3, -1, 3}, 1);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 3);
    assert_int_equal(stage_loops(&s), 3);
    assert_int_equal(n_mates(&s), 0);
    assert_int_equal(s.report.n_joint_outside, 1);
    assert_string_equal(s.model.block_name[0], "left");
    assert_string_equal(s.model.block_name[1], "right");
    assert_null(s.model.block_name[2]);
    assert_close(area_of(s.model.element_block, &s.model, 2), 1.0, 1e-12);
    assert_close(area_of(s.model.element_material, &s.model, 0), 3.0, 1e-12);
    stage_close(&s);
}

static void domain_and_blocks(void **state) {
    (void)state;
    stage s;
    stage_open(&s, 0.5);
    stage_rectangle(&s, 0, 0, 4, 1);
    stage_line(&s, 2, 0, 2, 1);
    stage_block(&s, 4, (double[]){1, 1, 2, 1, 2, 2, 1, 2}, "slider");
    stage_build(&s);
    assert_int_equal(s.model.n_block, 3);
    assert_null(s.model.block_name[0]);
    assert_string_equal(s.model.block_name[2], "slider");
    stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangle_alone),
        cmocka_unit_test(single_element),
        cmocka_unit_test(chosen_size),
        cmocka_unit_test(through_joint),
        cmocka_unit_test(crack),
        cmocka_unit_test(useless_joints),
        cmocka_unit_test(polyline_and_tee),
        cmocka_unit_test(outline_stays),
        cmocka_unit_test(hole_with_joint),
        cmocka_unit_test(holes_inside_one_element),
        cmocka_unit_test(hidden_corner),
        cmocka_unit_test(regions_split_but_connect),
        cmocka_unit_test(welded_polygons),
        cmocka_unit_test(touching_in_a_point),
        cmocka_unit_test(clockwise_input),
        cmocka_unit_test(circle_area),
        cmocka_unit_test(separate_blocks),
        cmocka_unit_test(domain_and_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
