// SPDX-License-Identifier: MIT
//
// What must not matter: order and direction of joints, shifts of the scene, units.

#include "stage.h"

#include <stdlib.h>

// Random joints, all in one order or another, some turned round; shifted and scaled; then the whole
// scene turned about the origin of coordinates.
typedef struct variant {
    bool reversed, turned;
    double shift_x, shift_y, scale;
    double cosine, sine; // both 0: not turned
} variant;

static void turn_points(variant v, int n, double *point) {
    for (int i = 0; i < n && (v.cosine != 0 || v.sine != 0); i++) {
        const double x = point[2 * i], y = point[2 * i + 1];
        point[2 * i] = v.cosine * x - v.sine * y;
        point[2 * i + 1] = v.sine * x + v.cosine * y;
    }
}

static double raster(nmm_random *random, int n) {
    return (double)(nmm_random_next(random) % (uint64_t)n) / 16;
}

static void build_variant(stage *s, uint64_t seed, variant v) {
    enum { N = 12 };
    nmm_random random = nmm_random_seed(seed);
    double line[N][4];
    for (int k = 0; k < N; k++) {
        line[k][0] = raster(&random, 8 * 16);
        line[k][1] = raster(&random, 5 * 16);
        line[k][2] = raster(&random, 8 * 16);
        line[k][3] = raster(&random, 5 * 16);
    }
    const double f = v.scale, x = v.shift_x, y = v.shift_y;
    stage_open(s, 0.75 * f);
    double box[] = {x, y, x + 8 * f, y, x + 8 * f, y + 5 * f, x, y + 5 * f};
    double hole[] = {x + 2 * f, y + 2 * f, x + 4 * f, y + 2 * f, x + 3 * f, y + 3 * f};
    turn_points(v, 4, box);
    turn_points(v, 3, hole);
    stage_domain(s, 4, box, 0);
    stage_hole(s, 3, hole);
    for (int i = 0; i < N; i++) {
        const double *l = line[v.reversed ? N - 1 - i : i];
        const int a = v.turned && i % 2 == 0 ? 2 : 0;
        double end[] = {x + f * l[a], y + f * l[a + 1], x + f * l[2 - a], y + f * l[3 - a]};
        turn_points(v, 2, end);
        stage_line(s, end[0], end[1], end[2], end[3]);
    }
    stage_build(s);
}

static const variant plain = {.scale = 1};

static void order_and_direction(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        stage first, second;
        build_variant(&first, seed, plain);
        build_variant(&second, seed, (variant){.scale = 1, .reversed = true, .turned = true});
        assert_true(stage_hash(&first) == stage_hash(&second));
        assert_int_equal(first.model.n_block, second.model.n_block);
        assert_int_equal(first.report.n_trimmed, second.report.n_trimmed);
        // Numbering is the same too.
        const nmm_model *m = &first.model, *n = &second.model;
        assert_memory_equal(m->element_cover, n->element_cover,
                            3 * (size_t)m->n_element * sizeof(int));
        assert_memory_equal(m->point, n->point, 2 * (size_t)m->n_point * sizeof(double));
        stage_close(&first);
        stage_close(&second);
    }
}

// Shifted by what doubles can add exactly: the same model, to the bit, with another origin.
static void shifts(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 30; seed++) {
        stage first, second;
        build_variant(&first, seed, plain);
        build_variant(&second, seed, (variant){.scale = 1, .shift_x = 512, .shift_y = -1024});
        assert_true(stage_hash(&first) == stage_hash(&second));
        assert_near(second.model.origin.x, first.model.origin.x + 512, 0);
        stage_close(&first);
        stage_close(&second);
    }
}

// Map coordinates: the lattice is as fine as the coordinates, blocks and areas stay.
static void map_coordinates(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 30; seed++) {
        stage first, second;
        build_variant(&first, seed, plain);
        build_variant(&second, seed, (variant){.scale = 1, .shift_x = 5e5, .shift_y = 4.2e6});
        assert_int_equal(first.model.n_block, second.model.n_block);
        assert_int_equal(first.model.n_element, second.model.n_element);
        assert_int_equal(first.model.n_cover, second.model.n_cover);
        assert_int_equal(first.model.n_vertex, second.model.n_vertex);
        assert_close(second.report.area, first.report.area, 1e-9);
        for (int e = 0; e < first.model.n_element; e++) {
            assert_near(second.model.element_centre[2 * e], first.model.element_centre[2 * e],
                        1e-7);
        }
        stage_close(&first);
        stage_close(&second);
    }
}

// The same scene in millimetres and kilometres, by powers of two: everything scales exactly.
static void units(void **state) {
    (void)state;
    const double scale[] = {1024, 1.0 / 1024};
    for (uint64_t seed = 1; seed <= 20; seed++) {
        for (int k = 0; k < 2; k++) {
            stage first, second;
            build_variant(&first, seed, plain);
            build_variant(&second, seed, (variant){.scale = scale[k]});
            const nmm_model *m = &first.model, *n = &second.model;
            assert_int_equal(m->n_element, n->n_element);
            assert_memory_equal(m->element_cover, n->element_cover,
                                3 * (size_t)m->n_element * sizeof(int));
            for (int p = 0; p < 2 * m->n_point; p++)
                assert_near(n->point[p], m->point[p] * scale[k], 0);
            for (int e = 0; e < m->n_element; e++)
                assert_near(n->element_area[e], m->element_area[e] * scale[k] * scale[k], 0);
            stage_close(&first);
            stage_close(&second);
        }
    }
}

static int compare_numbers(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// Areas of all blocks, ascending; to be freed.
static double *block_areas(const stage *s) {
    const nmm_model *m = &s->model;
    double *area = calloc((size_t)m->n_block, sizeof *area);
    for (int e = 0; e < m->n_element; e++)
        area[m->element_block[e]] += m->element_area[e];
    qsort(area, (size_t)m->n_block, sizeof *area, compare_numbers);
    return area;
}

static void compare_blocks(const stage *first, const stage *second) {
    assert_int_equal(first->model.n_block, second->model.n_block);
    assert_close(second->report.area, first->report.area, 1e-9);
    double *a = block_areas(first), *b = block_areas(second);
    for (int k = 0; k < first->model.n_block; k++)
        assert_near(b[k], a[k], 1e-7);
    free(a);
    free(b);
}

// The mesh keeps the axes. Half a turn maps it onto itself: the same counts. By a quarter or an odd
// angle it cuts the blocks otherwise: the blocks and their areas stay.
static void rotations(void **state) {
    (void)state;
    const struct { double cosine, sine; } turn[] = {{-1, 0}, {0, 1}, {0, -1}, {cos(0.7), sin(0.7)}};
    for (uint64_t seed = 1; seed <= 30; seed++) {
        stage first;
        build_variant(&first, seed, plain);
        for (int k = 0; k < 4; k++) {
            stage second;
            build_variant(&second, seed,
                          (variant){.scale = 1, .cosine = turn[k].cosine, .sine = turn[k].sine});
            compare_blocks(&first, &second);
            if (k == 0) {
                assert_int_equal(first.model.n_element, second.model.n_element);
                assert_int_equal(first.model.n_cover, second.model.n_cover);
                assert_int_equal(first.model.n_vertex, second.model.n_vertex);
            }
            stage_close(&second);
        }
        stage_close(&first);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(order_and_direction), cmocka_unit_test(shifts),
        cmocka_unit_test(map_coordinates),     cmocka_unit_test(units),
        cmocka_unit_test(rotations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
