// SPDX-License-Identifier: MIT
//
// Physical covers: how joints divide the star of a lattice node, and degenerate positions of joints
// and mesh. The node at hand is the one nearest to the middle of a large square.

#include "stage.h"

enum { SIDE = 24, SIZE = 4 };

typedef struct node_stage {
    stage s;
    double x, y;   // scene coordinates of the node
    double mx, my; // model coordinates
} node_stage;

static void node_open(node_stage *n) {
    stage_open(&n->s, SIZE);
    stage_rectangle(&n->s, 0, 0, SIDE, SIDE);
    stage_build(&n->s);
    const nmm_model *m = &n->s.model;
    double least = INFINITY;
    for (int c = 0; c < m->n_cover; c++) {
        const double d = hypot(m->cover_place[2 * c], m->cover_place[2 * c + 1]);
        if (d >= least) continue;
        least = d;
        n->mx = m->cover_place[2 * c];
        n->my = m->cover_place[2 * c + 1];
    }
    n->x = n->mx + m->origin.x;
    n->y = n->my + m->origin.y;
    assert_int_equal(stage_covers_at(&n->s, n->mx, n->my), 1);
    stage_forget(&n->s);
}

// A joint with places relative to the node.
static void node_line(node_stage *n, double x0, double y0, double x1, double y1) {
    stage_line(&n->s, n->x + x0, n->y + y0, n->x + x1, n->y + y1);
}

static int node_covers(node_stage *n) {
    stage_build(&n->s);
    return stage_covers_at(&n->s, n->mx, n->my);
}

static void tip_through_tee_and_cross(void **state) {
    (void)state;
    const struct {
        int covers, n_line;
        double line[4][4];
    } cases[] = {
        {1, 1, {{-9, 0.3, 0.7, 0.4}}},                           // ends inside the star
        {2, 1, {{-9, 0.3, 9, 0.4}}},                             // through
        {3, 2, {{-9, 0.3, 9, 0.4}, {0.2, 9, 0.3, 0.2}}},         // a tee
        {4, 2, {{-9, 0.3, 9, 0.4}, {0.2, 9, 0.3, -9}}},          // a cross
        {3, 2, {{-9, 0.3, 9, 0.4}, {-9, -0.5, 9, -0.6}}},        // two that do not meet
        {2, 1, {{-9, 0, 9, 0}}},                                 // along a line of the mesh
        {2, 1, {{0, -9, 0, 9}}},                                 // through the node, between lines
        {4, 2, {{-9, 0, 9, 0}, {0, -9, 0, 9}}},                  // a cross in the node
        {6, 3, {{-9, 0, 9, 0}, {-9, -7, 9, 7}, {-9, 7, 9, -7}}}, // three joints in the node
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        node_stage n;
        node_open(&n);
        for (int k = 0; k < cases[i].n_line; k++) {
            const double *l = cases[i].line[k];
            node_line(&n, l[0], l[1], l[2], l[3]);
        }
        const int covers = node_covers(&n);
        if (covers != cases[i].covers) print_error("case %zu\n", i);
        assert_int_equal(covers, cases[i].covers);
        assert_close(n.s.report.area, (double)SIDE * SIDE, 1e-12);
        stage_close(&n.s);
    }
}

// A loop inside the star makes an inner and an outer cover: within one triangle, and round the
// node.
static void closed_loops(void **state) {
    (void)state;
    const double loops[2][5][2] = {
        {{1, 0.5}, {1.5, 0.5}, {1.5, 1}, {1, 1}, {1, 0.5}},
        {{-0.5, -0.4}, {0.6, -0.4}, {0.6, 0.5}, {-0.5, 0.5}, {-0.5, -0.4}},
    };
    for (int i = 0; i < 2; i++) {
        node_stage n;
        node_open(&n);
        double corner[10];
        for (int k = 0; k < 5; k++) {
            corner[2 * k] = n.x + loops[i][k][0];
            corner[2 * k + 1] = n.y + loops[i][k][1];
        }
        stage_joint(&n.s, 5, corner, 1);
        assert_int_equal(node_covers(&n), 2);
        assert_int_equal(n.s.model.n_block, 2);
        assert_int_equal(stage_loops(&n.s), 3);
        assert_int_equal(n.s.report.n_trimmed, 0);
        stage_close(&n.s);
    }
}

// A joint along the mesh cuts nothing more: as many elements as without it, no slivers.
static void joint_along_the_mesh(void **state) {
    (void)state;
    node_stage n;
    node_open(&n);
    stage_build(&n.s);
    const int n_element = n.s.model.n_element;
    stage_forget(&n.s);
    node_line(&n, -99, 0, 99, 0);
    stage_build(&n.s);
    assert_int_equal(n.s.model.n_element, n_element);
    assert_int_equal(n.s.model.n_block, 2);
    stage_close(&n.s);
}

// A crack along the mesh ends at nodes: what lies beyond the last ones has the same functions on
// both sides. So it is the shorter crack, with the same points and loops.
static void crack_along_the_mesh(void **state) {
    (void)state;
    for (int order = 0; order <= 2; order++) {
        node_stage n;
        int n_vertex[2], n_cover[2];
        for (int k = 0; k < 2; k++) {
            node_open(&n);
            n.s.scene.settings.order = order;
            node_line(&n, k == 0 ? -2.3 * SIZE : -2 * SIZE, 0, k == 0 ? 1.6 * SIZE : SIZE, 0);
            stage_build(&n.s);
            n_vertex[k] = n.s.model.n_vertex;
            n_cover[k] = n.s.model.n_cover;
            assert_int_equal(stage_loops(&n.s), 2);
            assert_int_equal(n.s.report.n_trimmed, k == 0 ? 2 : 0);
            assert_near(n.s.report.trimmed_length, k == 0 ? 0.9 * SIZE : 0, 1e-6);
            stage_close(&n.s);
        }
        assert_int_equal(n_vertex[0], n_vertex[1]);
        assert_int_equal(n_cover[0], n_cover[1]);
    }
}

static void duplicates_and_overlaps(void **state) {
    (void)state;
    node_stage n;
    node_open(&n);
    node_line(&n, -20, 0.3, 20, 1.7);
    stage_build(&n.s);
    const uint64_t hash = stage_hash(&n.s);
    stage_forget(&n.s);
    // The same once more, and backwards.
    node_line(&n, -20, 0.3, 20, 1.7);
    node_line(&n, 20, 1.7, -20, 0.3);
    stage_build(&n.s);
    assert_true(stage_hash(&n.s) == hash);
    const int n_element = n.s.model.n_element, n_cover = n.s.model.n_cover;
    const int n_vertex = n.s.model.n_vertex;
    const double smallest = n.s.report.smallest_area;
    stage_forget(&n.s);
    // Two parts that overlap: their ends are corners on both sides of the joint, nothing else.
    node_line(&n, -20, 0.3, 0, 1);
    node_line(&n, -10, 0.65, 20, 1.7);
    stage_build(&n.s);
    assert_int_equal(n.s.model.n_element, n_element);
    assert_int_equal(n.s.model.n_cover, n_cover);
    assert_int_equal(n.s.model.n_block, 2);
    assert_in_range(n.s.model.n_vertex, n_vertex + 4, n_vertex + 8);
    assert_close(n.s.report.smallest_area, smallest, 1e-8);
    stage_close(&n.s);
}

// Two joints that part at 0.01 degrees: the wedge between them is a block of the exact area.
static void small_angle(void **state) {
    (void)state;
    node_stage n;
    node_open(&n);
    const double rise = SIDE * tan(0.01 * M_PI / 180);
    stage_line(&n.s, 0, 10, SIDE, 10);
    stage_line(&n.s, 0, 10, SIDE, 10 + rise);
    stage_build(&n.s);
    const nmm_model *m = &n.s.model;
    assert_int_equal(m->n_block, 3);
    double area[3] = {0};
    for (int e = 0; e < m->n_element; e++)
        area[m->element_block[e]] += m->element_area[e];
    const double smallest = fmin(area[0], fmin(area[1], area[2]));
    assert_close(smallest, SIDE * rise / 2, 1e-7);
    stage_close(&n.s);
}

// Thin slivers live; what is thinner than welding reaches vanishes.
static void slivers(void **state) {
    (void)state;
    for (int k = 6; k <= 16; k++) {
        node_stage n;
        node_open(&n);
        const double gap = pow(10, -k);
        stage_line(&n.s, -1, 10, SIDE + 1, 10);
        stage_line(&n.s, -1, 10 + gap, SIDE + 1, 10 + gap);
        stage_build(&n.s);
        assert_int_equal(n.s.model.n_block, gap > n.s.report.weld ? 3 : 2);
        if (k == 6) assert_true(n.s.report.smallest_area < 1e-5);
        assert_true(n.s.report.smallest_area > 0);
        stage_close(&n.s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tip_through_tee_and_cross),
        cmocka_unit_test(closed_loops),
        cmocka_unit_test(joint_along_the_mesh),
        cmocka_unit_test(crack_along_the_mesh),
        cmocka_unit_test(duplicates_and_overlaps),
        cmocka_unit_test(small_angle),
        cmocka_unit_test(slivers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
