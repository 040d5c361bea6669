// SPDX-License-Identifier: MIT
//
// covers.mesh: block. Each block has the linear functions of a cover of its own: they add to one,
// reproduce places, and make the mass matrix a multiple of the identity, for blocks of any shape.

#include "stage.h"

#include "mechanics.h"

static void open_whole(stage *s) {
    stage_open(s, 0);
    s->scene.settings.mesh = NMM_MESH_BLOCK;
}

// Mass of block b, density 1, from its elements: m[3][3].
static void mass_of(const nmm_model *m, int b, double mass[9]) {
    memset(mass, 0, 9 * sizeof *mass);
    for (int e = 0; e < m->n_element; e++) {
        if (m->element_block[e] != b) continue;
        double part[6];
        nmm_mass_of(1, m->element_area[e], m->element_moment + 3 * e, m->element_weight + 3 * e,
                    m->element_gradient + 6 * e, part);
        for (int k = 0; k < 9; k++) {
            assert_int_equal(m->element_cover[3 * e + k / 3], 3 * b + k / 3);
            mass[k] += part[nmm_pair_index(3, k / 3, k % 3)];
        }
    }
}

static double area_of(const nmm_model *m, int b) {
    double area = 0;
    for (int e = 0; e < m->n_element; e++)
        area += m->element_block[e] == b ? m->element_area[e] : 0;
    return area;
}

static void assert_diagonal_mass(const stage *s, double tolerance) {
    const nmm_model *m = &s->model;
    assert_true(m->whole_blocks);
    assert_int_equal(m->n_cover, 3 * m->n_block);
    for (int b = 0; b < m->n_block; b++) {
        double mass[9];
        mass_of(m, b, mass);
        const double third = area_of(m, b) / 3;
        for (int k = 0; k < 9; k++)
            assert_near(mass[k] / third, k % 4 == 0 ? 1.0 : 0.0, tolerance);
    }
}

// --- Shapes

static void rectangle(void **state) {
    (void)state;
    stage s;
    open_whole(&s);
    stage_rectangle(&s, 100, 50, 110, 51);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 1);
    assert_int_equal(s.model.n_element, 1);
    assert_int_equal(s.model.n_vertex, 4);
    assert_diagonal_mass(&s, 1e-12);
    assert_close(s.model.size, sqrt(10.0), 1e-14);
    assert_close(s.report.size_chosen, sqrt(10.0), 1e-14);
    // sqrt(2 / A) J^(1/2): the nodes of a bar lie ten times further apart along it.
    assert_near(s.model.cover_place[1] * 10, s.model.cover_place[0] / sqrt(3.0) * -1, 1e-10);
    stage_close(&s);
}

// A ring of two materials, an L and a triangle.
static void odd_shapes(void **state) {
    (void)state;
    stage s;
    open_whole(&s);
    stage_rectangle(&s, 0, 0, 6, 6);
    stage_hole(&s, 4, (double[]){1, 2, 4, 2, 4, 5, 1, 5});
    stage_region(&s, 4, (double[]){-1, -1, 3, -1, 3, 9, -1, 9}, 1);
    stage_block(&s, 6, (double[]){10, 0, 14, 0, 14, 1, 11, 1, 11, 4, 10, 4}, "angle");
    stage_block(&s, 3, (double[]){20, 0, 27, 1, 21, 5}, "triangle");
    stage_build(&s);
    assert_int_equal(s.model.n_block, 3);
    assert_true(s.model.n_element > 3);
    assert_diagonal_mass(&s, 1e-12);
    stage_close(&s);
}

static void slivers(void **state) {
    (void)state;
    for (int k = 0; k <= 6; k++) {
        stage s;
        open_whole(&s);
        const double thin = pow(10, -k);
        stage_block(&s, 4, (double[]){0, 0, 1, 0, 1, 1, 0, 1}, "square");
        stage_block(&s, 4, (double[]){2, 0, 3, 1, 3, 1 + thin, 2, thin}, "sliver");
        stage_build(&s);
        assert_diagonal_mass(&s, k < 4 ? 1e-6 : 1);
        stage_close(&s);
    }
}

// --- Joints

// Joints that divide make blocks; one that ends inside, and a slit along a change of material, do
// not and are counted as trimmed.
static void joints(void **state) {
    (void)state;
    stage s;
    open_whole(&s);
    stage_rectangle(&s, 0, 0, 8, 4);
    stage_region(&s, 4, (double[]){0, 0, 8, 0, 8, 2, 0, 2}, 1);
    stage_line(&s, 3, -1, 3, 5);
    stage_line(&s, 5, 1, 5, 2.5);
    stage_line(&s, 4, 2, 6, 2);
    stage_build(&s);
    assert_int_equal(s.model.n_block, 2);
    assert_int_equal(s.model.n_cover, 6);
    assert_close(area_of(&s.model, 0), 12.0, 1e-12);
    assert_true(s.report.n_trimmed >= 1);
    assert_near(s.report.trimmed_length, 3.5, 1e-6);
    assert_diagonal_mass(&s, 1e-12);
    int n_mate = 0;
    for (int v = 0; v < s.model.n_vertex; v++)
        n_mate += s.model.edge_mate[v] >= 0;
    assert_int_equal(n_mate, 4);
    stage_close(&s);
}

// The size that lengths are measured by is that of the usual block, not of the largest.
static void usual_size(void **state) {
    (void)state;
    stage s;
    open_whole(&s);
    stage_block(&s, 4, (double[]){0, -10, 100, -10, 100, 0, 0, 0}, "ground");
    for (int k = 0; k < 3; k++) {
        const double x = 2 * k;
        stage_block(&s, 4, (double[]){x, 0, x + 1, 0, x + 1, 1, x, 1}, "stone");
    }
    stage_build(&s);
    assert_close(s.model.size, 1.0, 1e-9);
    // Places far from the centre of a large block are found.
    const nmm_vec2 corner = {99.5 - s.model.origin.x, -9.5 - s.model.origin.y};
    assert_int_equal(nmm_model_find_element(&s.model, corner, 1e-6), 0);
    stage_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangle), cmocka_unit_test(odd_shapes), cmocka_unit_test(slivers),
        cmocka_unit_test(joints),    cmocka_unit_test(usual_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
