// SPDX-License-Identifier: MIT
//
// Whole runs: a pile of random polygons falls into a box. The overlap of blocks is measured
// independently of the contacts, as the depth of vertices inside other blocks' polygons.

#include "step.h"
#include "test.h"

#include <stdlib.h>

enum { COLUMNS = 3, ROWS = 3, TEXT = 1 << 14 };

typedef struct text {
    char at[TEXT];
    int n;
} text;

static void put(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(text *t, const char *format, ...) {
    va_list list;
    va_start(list, format);
    t->n += vsnprintf(t->at + t->n, (size_t)(TEXT - t->n), format, list);
    va_end(list);
    assert_true(t->n < TEXT);
}

static void put_box(text *t, const char *name, double x0, double y0, double x1, double y1) {
    put(t, "  - {name: %s, polygon: [[%g,%g],[%g,%g],[%g,%g],[%g,%g]], material: rock}\n", name, x0,
        y0, x1, y0, x1, y1, x0, y1);
}

// Convex polygons with three to seven corners on circles that do not touch yet.
static void put_stones(text *t, uint64_t seed) {
    nmm_random random = nmm_random_seed(seed);
    for (int k = 0; k < COLUMNS * ROWS; k++) {
        const int n = 3 + (int)(nmm_random_next(&random) % 5);
        const double start = 6.3 * nmm_random_unit(&random);
        put(t, "  - {polygon: [");
        for (int i = 0; i < n; i++) {
            const double angle =
                start + 6.283185307179586 * (i + 0.5 * nmm_random_unit(&random)) / n;
            put(t, "%s[%.6f,%.6f]", i == 0 ? "" : ",",
                0.65 + 1.3 * (k % COLUMNS) + 0.55 * cos(angle),
                0.6 + 1.2 * (k / COLUMNS) + 0.55 * sin(angle));
        }
        put(t, "], material: rock}\n");
    }
}

static void make_scene(text *t, uint64_t seed, const char *method) {
    const double width = 1.3 * COLUMNS;
    t->n = 0;
    put(t, "nmm: 1\ngravity: [0, -9.81]\n");
    put(t, "materials:\n  rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.2}\n");
    put(t, "interfaces:\n  rough: {friction_angle: 25}\ninterface: rough\nblocks:\n");
    put_box(t, "floor", -1, -1, width + 1, 0);
    put_box(t, "left", -1, 0, 0, 4);
    put_box(t, "right", width, 0, width + 1, 4);
    put_stones(t, seed);
    put(t, "covers: {size: 1}\ncontact: {method: %s}\n", method);
    put(t, "supports:\n  - {block: floor, fix: xy}\n  - {block: left, fix: xy}\n");
    put(t, "  - {block: right, fix: xy}\ntime: {dt: 4e-3, end: 0.8}\n");
}

static nmm_sim *open_scene(const text *t, int n_thread) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "pile.yaml";
    def.text = t->at;
    def.text_length = (size_t)t->n;
    def.n_thread = n_thread;
    nmm_sim *sim = NULL;
    if (nmm_sim_create(&sim, &def) != NMM_OK) {
        print_error("%s\n%s\n", nmm_sim_error(sim)->message, nmm_sim_mistakes(sim));
        fail();
    }
    return sim;
}

// --- Overlap
// -----------------------------------------------------------------------------------------------

static nmm_vec2 place_of(const nmm_sim *sim, int vertex) {
    const double *p = sim->state.position + 2 * (long)sim->model.vertex_point[vertex];
    return (nmm_vec2){p[0], p[1]};
}

static double distance_to_edge(nmm_vec2 at, nmm_vec2 p, nmm_vec2 q) {
    const nmm_vec2 along = nmm_vec2_sub(q, p), off = nmm_vec2_sub(at, p);
    const double t = nmm_vec2_dot(along, off) / nmm_vec2_dot(along, along);
    const nmm_vec2 foot = nmm_vec2_scale(nmm_min(1, nmm_max(0, t)), along);
    const nmm_vec2 rest = nmm_vec2_sub(off, foot);
    return sqrt(nmm_vec2_dot(rest, rest));
}

// How deep the place is inside a block; 0 outside.
static double depth_in(const nmm_sim *sim, nmm_vec2 at, int block) {
    bool inside = false;
    double nearest = INFINITY;
    for (int v = 0; v < sim->model.n_vertex; v++) {
        if (sim->model.vertex_block[v] != block) continue;
        const nmm_vec2 p = place_of(sim, v), q = place_of(sim, sim->model.vertex_next[v]);
        if ((p.y > at.y) != (q.y > at.y) && at.x < p.x + (at.y - p.y) / (q.y - p.y) * (q.x - p.x)) {
            inside = !inside;
        }
        nearest = nmm_min(nearest, distance_to_edge(at, p, q));
    }
    return inside ? nearest : 0;
}

static double largest_depth(const nmm_sim *sim) {
    double largest = 0;
    for (int v = 0; v < sim->model.n_vertex; v++) {
        for (int b = 0; b < sim->model.n_block; b++) {
            if (sim->model.vertex_block[v] == b) continue;
            largest = nmm_max(largest, depth_in(sim, place_of(sim, v), b));
        }
    }
    return largest;
}

// --- Tests
// ------------------------------------------------------------------------------------------------

// No vertex is inside another block deeper than the contacts report, and that is little.
static void test_pile(void **unused) {
    (void)unused;
    static text t;
    for (uint64_t seed = 1; seed <= 3; seed++) {
        make_scene(&t, seed, seed % 2 == 0 ? "augmented" : "penalty");
        nmm_sim *sim = open_scene(&t, 1);
        nmm_step_report report = {.end = NMM_END_RUNNING};
        while (report.end == NMM_END_RUNNING) {
            assert_int_equal(nmm_sim_step(sim, &report), NMM_OK);
            if (report.step % 10 != 0) continue;
            const double depth = largest_depth(sim);
            assert_true(depth <= report.penetration + 1e-4);
            assert_true(depth <= 0.01);
        }
        assert_int_equal(report.end, NMM_END_COMPLETED);
        const nmm_energy *e = &report.energy;
        assert_true(e->friction > 0);
        assert_near(e->residual, 0, 1e-5 * e->external);
        // At the bottom of the box, and nothing has left it.
        assert_true(e->external > 1e4);
        for (int v = 0; v < sim->model.n_vertex; v++) {
            const nmm_vec2 p = nmm_vec2_add(place_of(sim, v), sim->model.origin);
            assert_true(p.x > -1.1 && p.x < 1.3 * COLUMNS + 1.1 && p.y > -1.1);
        }
        nmm_sim_destroy(sim);
    }
}

static void test_pile_on_threads(void **unused) {
    (void)unused;
    static text t;
    make_scene(&t, 5, "penalty");
    uint64_t hash[3];
    for (int k = 0; k < 3; k++) {
        nmm_sim *sim = open_scene(&t, k + 1);
        nmm_step_report report = {.end = NMM_END_RUNNING};
        for (int i = 0; i < 80; i++)
            assert_int_equal(nmm_sim_step(sim, &report), NMM_OK);
        assert_true(report.contacts > 20);
        hash[k] = nmm_state_hash(&sim->model, &sim->state);
        nmm_sim_destroy(sim);
    }
    assert_true(hash[0] == hash[1]);
    assert_true(hash[0] == hash[2]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pile),
        cmocka_unit_test(test_pile_on_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
