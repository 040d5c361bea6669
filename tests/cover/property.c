// SPDX-License-Identifier: MIT
//
// Hundreds of random joint patterns, each checked against slow reference code: areas, Euler's
// formula for each block, covers connected and as large as they can be, points found in exactly one
// element. The first pattern that fails is named by its seed.

#include "stage.h"

#include <stdlib.h>

// --- Reference

// A side of an element's polygon, by its points.
typedef struct side {
    int low, high, element;
} side;

static int compare_sides(const void *a, const void *b) {
    const side *p = a, *q = b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    if (p->high != q->high) return p->high < q->high ? -1 : 1;
    return (p->element > q->element) - (p->element < q->element);
}

static side *list_sides(const nmm_model *m) {
    side *list = calloc((size_t)m->n_corner, sizeof *list);
    for (int e = 0; e < m->n_element; e++) {
        const int begin = m->element_start[e], end = m->element_start[e + 1];
        for (int k = begin; k < end; k++) {
            const int p = m->corner_point[k], q = m->corner_point[k + 1 < end ? k + 1 : begin];
            list[k] = (side){p < q ? p : q, p < q ? q : p, e};
        }
    }
    qsort(list, (size_t)m->n_corner, sizeof *list, compare_sides);
    return list;
}

static bool same_side(const side *a, const side *b) {
    return a->low == b->low && a->high == b->high;
}

// V - E + F = 2 - loops for each block: a piece of the plane with holes.
static void check_euler(const nmm_model *m, const side *sides) {
    int *sum = calloc((size_t)m->n_block, sizeof *sum);
    bool *seen = calloc((size_t)m->n_vertex, sizeof *seen);
    for (int p = 0; p < m->n_point; p++)
        sum[m->element_block[m->point_element[p]]] += 1;
    for (int k = 0; k < m->n_corner; k++) {
        const bool again = k > 0 && same_side(&sides[k - 1], &sides[k]);
        sum[m->element_block[sides[k].element]] -= !again;
    }
    for (int e = 0; e < m->n_element; e++)
        sum[m->element_block[e]] += 1;
    for (int v = 0; v < m->n_vertex; v++) {
        if (!seen[v]) sum[m->vertex_block[v]] += 1;
        for (int w = v; !seen[w]; w = m->vertex_next[w])
            seen[w] = true;
    }
    for (int b = 0; b < m->n_block; b++)
        assert_int_equal(sum[b], 2);
    free(sum);
    free(seen);
}

static int root_of(int *parent, int i) {
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

// Across a side that two elements share (by its points), the covers of the nodes that both have are
// the same; and the elements of a cover hang together across such sides.
static void check_covers(const nmm_model *m, const side *sides) {
    int *parent = calloc(3 * (size_t)m->n_element, sizeof *parent);
    for (int s = 0; s < 3 * m->n_element; s++)
        parent[s] = s;
    for (int k = 1; k < m->n_corner; k++) {
        if (!same_side(&sides[k - 1], &sides[k])) continue;
        const int e = sides[k - 1].element, f = sides[k].element;
        if (e == f) continue;
        assert_int_equal(m->element_block[e], m->element_block[f]);
        int n_common = 0;
        for (int a = 3 * e; a < 3 * e + 3; a++) {
            for (int b = 3 * f; b < 3 * f + 3; b++) {
                const int c = m->element_cover[a], d = m->element_cover[b];
                if (m->cover_node[c] != m->cover_node[d]) continue;
                assert_int_equal(c, d);
                parent[root_of(parent, a)] = root_of(parent, b);
                n_common += 1;
            }
        }
        assert_true(n_common == 2 || n_common == 3);
    }
    for (int c = 0; c < m->n_cover; c++) {
        const int first = root_of(parent, m->cover_element[m->cover_start[c]]);
        for (int k = m->cover_start[c]; k < m->cover_start[c + 1]; k++)
            assert_int_equal(root_of(parent, m->cover_element[k]), first);
    }
    free(parent);
}

// Elements that share no side (by points) are in contact only through loops: the number of sides
// that belong to one element only is the number of loop edges.
static void check_border(const nmm_model *m, const side *sides) {
    int n_single = 0;
    for (int k = 0; k < m->n_corner; k++) {
        const bool before = k > 0 && same_side(&sides[k - 1], &sides[k]);
        const bool after = k + 1 < m->n_corner && same_side(&sides[k], &sides[k + 1]);
        n_single += !before && !after;
    }
    assert_int_equal(n_single, m->n_vertex);
}

static bool in_element(const nmm_model *m, int e, double x, double y) {
    const int begin = m->element_start[e], end = m->element_start[e + 1];
    bool inside = false;
    for (int k = begin; k < end; k++) {
        const double *p = m->point + 2 * m->corner_point[k];
        const double *q = m->point + 2 * m->corner_point[k + 1 < end ? k + 1 : begin];
        if ((p[1] <= y) == (q[1] <= y)) continue;
        if (x < p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0])) inside = !inside;
    }
    return inside;
}

// Random places: inside the domain they are in one element, whose weights there are a partition of
// unity and give the place back; outside they are in none.
static void check_places(const stage *s, nmm_random *random, double width, double height,
                         const double hole[4]) {
    const nmm_model *m = &s->model;
    for (int k = 0; k < 60; k++) {
        const double x = (1.2 * nmm_random_unit(random) - 0.1) * width;
        const double y = (1.2 * nmm_random_unit(random) - 0.1) * height;
        const bool in_hole = x > hole[0] && x < hole[1] && y > hole[2] && y < hole[3];
        const bool inside = x > 0 && x < width && y > 0 && y < height && !in_hole;
        const nmm_vec2 place = {x - m->origin.x, y - m->origin.y};
        int n = 0;
        for (int e = 0; e < m->n_element; e++) {
            if (!in_element(m, e, place.x, place.y)) continue;
            n += 1;
            double w[3];
            nmm_element_weights(m, e, place, w);
            assert_near(w[0] + w[1] + w[2], 1, 1e-13);
            assert_true(w[0] > -1e-7 && w[1] > -1e-7 && w[2] > -1e-7);
        }
        assert_int_equal(n, inside);
    }
}

static void check_against_reference(const stage *s) {
    side *sides = list_sides(&s->model);
    check_euler(&s->model, sides);
    check_covers(&s->model, sides);
    check_border(&s->model, sides);
    free(sides);
}

// --- Patterns

static double random_in(nmm_random *random, double low, double high) {
    return low + (high - low) * nmm_random_unit(random);
}

// Joints of many kinds: long, short, polylines, parallel to the sides, from shared ends, closed.
static void random_joint(stage *s, nmm_random *random, double width, double height) {
    const double x = random_in(random, -1, width + 1), y = random_in(random, -1, height + 1);
    const double u = random_in(random, -1, width + 1), v = random_in(random, -1, height + 1);
    switch (nmm_random_next(random) % 8) {
    case 0:
        stage_line(s, -1, y, width + 1, y);
        break;
    case 1:
        stage_line(s, floor(x), -1, floor(x), height + 1);
        break;
    case 2:
        STAGE_JOINT(s, 2, x, y, u, y, u, v);
        break;
    case 3: {
        const double d = random_in(random, 0.05, 1.5);
        STAGE_JOINT(s, 1, x, y, x + d, y, x + d, y + d, x, y + d, x, y);
        break;
    }
    case 4:
        // From the corner and the middle of a side of the domain.
        stage_line(s, 0, 0, u, v);
        stage_line(s, width / 2, 0, u, v);
        break;
    default:
        stage_line(s, x, y, u, v);
    }
}

static void one_pattern(uint64_t seed) {
    nmm_random random = nmm_random_seed(seed);
    const double width = random_in(&random, 3, 9), height = random_in(&random, 3, 9);
    const double hole[4] = {width / 3, width / 2, height / 3, height / 2};
    stage s;
    stage_open(&s, exp(random_in(&random, log(0.4), log(12))));
    stage_rectangle(&s, 0, 0, width, height);
    stage_hole(&s, 4,
               (double[]){hole[0], hole[2], hole[1], hole[2], hole[1], hole[3], hole[0], hole[3]});
    const int n_joint = (int)(nmm_random_next(&random) % 14);
    for (int k = 0; k < n_joint; k++)
        random_joint(&s, &random, width, height);
    if (seed % 3 == 0) stage_region(&s, 3, (double[]){-1, -1, width, 1, 1, height}, 1);
    stage_build(&s);
    const double area = width * height - (hole[1] - hole[0]) * (hole[3] - hole[2]);
    assert_near(s.report.area, area, 4 * (width + height) * s.report.snap);
    check_against_reference(&s);
    check_places(&s, &random, width, height, hole);
    stage_close(&s);
}

static void random_patterns(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 300; seed++) {
        const int before = (int)seed;
        one_pattern(seed);
        assert_int_equal(before, (int)seed);
    }
}

// Everything on a coarse raster, so that joints, outlines and each other coincide all the time.
static void raster_patterns(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 200; seed++) {
        nmm_random random = nmm_random_seed(1000 + seed);
        stage s;
        stage_open(&s, 0.5 + (double)(seed % 5));
        stage_rectangle(&s, 0, 0, 4, 4);
        for (int k = 0; k < 10; k++) {
            double c[4];
            for (int i = 0; i < 4; i++)
                c[i] = (double)(nmm_random_next(&random) % 11) / 2 - 0.5;
            stage_line(&s, c[0], c[1], c[2], c[3]);
        }
        stage_build(&s);
        assert_close(s.report.area, 16.0, 1e-11);
        check_against_reference(&s);
        stage_close(&s);
    }
}

// Joints that coincide up to a random error around the reach of welding.
static void nearly_coincident(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 150; seed++) {
        nmm_random random = nmm_random_seed(2000 + seed);
        stage s;
        stage_open(&s, 0.7);
        stage_rectangle(&s, 0, 0, 5, 4);
        const double error = pow(10, -random_in(&random, 6, 13));
        for (int k = 0; k < 6; k++) {
            const double y[] = {1, 2.3, 3};
            const double a = y[nmm_random_next(&random) % 3], b = y[nmm_random_next(&random) % 3];
            const double e = random_in(&random, -error, error);
            const double f = random_in(&random, -error, error);
            const double from = random_in(&random, -1, 3), to = random_in(&random, 2, 6);
            stage_line(&s, from, a + e, to, b + f);
            stage_line(&s, e, a, 5 + f, b);
        }
        stage_build(&s);
        assert_close(s.report.area, 20.0, 1e-8);
        check_against_reference(&s);
        stage_close(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_patterns),
        cmocka_unit_test(raster_patterns),
        cmocka_unit_test(nearly_coincident),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
