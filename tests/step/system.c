// SPDX-License-Identifier: MIT
//
// Matrix and residual of a pass: the matrix is the derivative of the residual (elements, inertia,
// contacts, supports), symmetric, and the assembly does not depend on threads.

#include "scenes.h"
#include "test.h"

#include <stdlib.h>

// Residual at the displacement as it is, contacts evaluated, in a step of length h from `moved`.
static void residual_of(nmm_sim *sim, double h, double *out) {
    nmm_state_place(&sim->model, &sim->state, 1);
    if (sim->search != NULL) nmm_contact_evaluate(sim->search, &sim->model, &sim->state, 1);
    const nmm_step_state step = {h, sim->state.time + h, sim->moved};
    nmm_system_load(&sim->system, &sim->model, step.end);
    nmm_system_residual(&sim->context, &sim->system, &sim->model, &sim->state, &step, NULL);
    memcpy(out, sim->system.residual, 2 * (size_t)sim->model.n_cover * sizeof *out);
}

// A new matrix, without weights.
static void assemble(nmm_sim *sim, double h) {
    nmm_system_prepare(&sim->context, &sim->system, &sim->model, &sim->state, h);
    nmm_system_assemble(&sim->context, &sim->system, &sim->model, NULL);
}

static double entry_of(const nmm_bsr *K, int i, int j) {
    for (int k = K->row_start[i / 2]; k < K->row_start[i / 2 + 1]; k++) {
        if (K->col[k] == j / 2) return K->value[4 * (long)k + 2 * (i % 2) + j % 2];
    }
    return 0;
}

// Column j of K against central differences of the residual. Contacts must not change mode.
static void check_matrix(nmm_sim *sim, double h, double tolerance) {
    const int n = 2 * sim->model.n_cover;
    double *up = calloc((size_t)n, sizeof *up), *down = calloc((size_t)n, sizeof *down);
    residual_of(sim, h, up);
    assemble(sim, h);
    double largest = 0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, entry_of(&sim->system.K, i, i));
    const double eps = 1e-8;
    for (int j = 0; j < n; j++) {
        if (sim->system.fixed != NULL && (sim->system.fixed[j / 2] >> j % 2 & 1)) continue;
        const double d = sim->state.displacement[j], m = sim->moved[j];
        sim->state.displacement[j] = d + eps, sim->moved[j] = m + eps;
        residual_of(sim, h, up);
        sim->state.displacement[j] = d - eps, sim->moved[j] = m - eps;
        residual_of(sim, h, down);
        sim->state.displacement[j] = d, sim->moved[j] = m;
        for (int i = 0; i < n; i++) {
            if (sim->system.fixed != NULL && (sim->system.fixed[i / 2] >> i % 2 & 1)) continue;
            const double slope = -(up[i] - down[i]) / (2 * eps);
            assert_near(entry_of(&sim->system.K, i, j), slope, tolerance * largest);
            assert_near(entry_of(&sim->system.K, i, j), entry_of(&sim->system.K, j, i),
                        1e-14 * largest);
        }
    }
    free(up);
    free(down);
}

static void test_free_body(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_FALL, 0, NULL);
    take_steps(sim, 2);
    check_matrix(sim, 1e-3, 1e-6);
    nmm_sim_destroy(sim);
}

static void test_lumped_and_damped(void **unused) {
    (void)unused;
    const char *const changes[] = {"analysis.mass=lumped", "analysis.damping=30"};
    nmm_sim *sim = open_scene(SCENE_FALL, 2, changes);
    take_steps(sim, 2);
    check_matrix(sim, 1e-4, 1e-6);
    // Lumped: no coupling by mass; the diagonal holds (2/h^2 + 2 alpha/h) m.
    const double inertia = 2 / 1e-8 + 60 / 1e-4;
    double mass = 0;
    for (int c = 0; c < sim->model.n_cover; c++)
        mass += sim->system.cover_mass[c];
    assert_close(mass, 5000.0, 1e-12);
    for (int c = 0; c < sim->model.n_cover; c++) {
        assert_true(entry_of(&sim->system.K, 2 * c, 2 * c) > inertia * sim->system.cover_mass[c]);
    }
    nmm_sim_destroy(sim);
}

static void test_supported_body(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_COLUMN, 0, NULL);
    take_steps(sim, 1);
    check_matrix(sim, 1e-3, 1e-5);
    nmm_sim_destroy(sim);
}

// What springs alone put between two blocks is symmetric to the last bit.
static void check_between_blocks(const nmm_sim *sim) {
    const nmm_bsr *K = &sim->system.K;
    int n = 0;
    for (int i = 0; i < 2 * sim->model.n_cover; i++) {
        for (int j = 0; j < i; j++) {
            if (sim->model.cover_block[i / 2] == sim->model.cover_block[j / 2]) continue;
            assert_true(entry_of(K, i, j) == entry_of(K, j, i));
            n += entry_of(K, i, j) != 0;
        }
    }
    assert_true(n > 0);
}

static void check_contacts(const char *text, bool both_move) {
    nmm_sim *sim = open_scene(text, 0, NULL);
    take_steps(sim, 60);
    nmm_contact_find(&sim->context, sim->search, &sim->model, &sim->state, 0.02);
    nmm_system_pattern(&sim->context, &sim->system, &sim->model, &sim->state);
    memset(sim->moved, 0, 2 * (size_t)sim->model.n_cover * sizeof *sim->moved);
    int stuck = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        stuck += sim->state.contact[k].mode == NMM_CONTACT_STICK;
    }
    assert_true(stuck > 3);
    check_matrix(sim, 1e-3, 1e-5);
    if (both_move) check_between_blocks(sim);
    nmm_sim_destroy(sim);
}

static void test_contacts(void **unused) {
    (void)unused;
    check_contacts(SCENE_BLOCK_ON_BASE, false);
    check_contacts(SCENE_BLOCK_ON_BED, true);
}

// The parts of a traction stand for the whole segment, each with its length and the history; a
// force at a point stands for no length.
static void test_loads(void **unused) {
    (void)unused;
    static const char text[] =
        "nmm: 1\n"
        "domain:\n"
        "  - {polygon: [[0, 0], [2, 0], [2, 6], [0, 6]]}\n"
        "materials:\n"
        "  rock: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
        "covers: {size: 0.7}\n"
        "supports:\n"
        "  - {segment: [[0, 0], [2, 0]], fix: xy}\n"
        "loads:\n"
        "  - {segment: [[0, 1], [0, 4.5]], traction: [3e3, -4e3], history: [[0, 0], [1, 1]]}\n"
        "  - {point: [2, 6], force: [0, -7]}\n"
        "time: {dt: 1e-3, end: 1}\n";
    nmm_sim *sim = open_scene(text, 0, NULL);
    const nmm_model *model = &sim->model;
    double length = 0;
    assert_true(model->n_load > 4);
    for (int k = 0; k < model->n_load - 1; k++) {
        const nmm_load *load = &model->load[k];
        assert_true(load->length > 0 && load->history == 0);
        assert_close(load->force.x, 3e3 * load->length, 1e-12);
        assert_close(load->force.y, -4e3 * load->length, 1e-12);
        length += load->length;
    }
    assert_close(length, 3.5, 1e-9);
    const nmm_load *last = &model->load[model->n_load - 1];
    assert_true(last->length == 0 && last->history == -1 && last->force.y == -7);
    nmm_sim_destroy(sim);
}

// All that is free goes by this in x.
static void shift(nmm_sim *sim, double way) {
    for (int c = 0; c < sim->model.n_cover; c++) {
        if (sim->system.fixed[c] == 3) continue;
        sim->state.displacement[2 * c] += way;
        sim->moved[2 * c] += way;
    }
}

// A block that was to slide to the right and slid to the left: what is solved next is the system of
// a block that sticks, and that of one that slides for what slides on.
static void test_caught(void **unused) {
    (void)unused;
    const double h = 1e-3;
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 0, NULL);
    nmm_system *system = &sim->system;
    take_steps(sim, 3);
    const int n = 2 * sim->model.n_cover;
    const size_t n_value = 4 * (size_t)system->K.row_start[sim->model.n_cover];
    double *r = calloc((size_t)n, sizeof *r), *value = calloc(n_value, sizeof *value);
    shift(sim, 1e-3);
    residual_of(sim, h, r);
    assemble(sim, h);
    assert_false(nmm_system_catch(system, &sim->model, &sim->state));
    shift(sim, 1e-4);
    residual_of(sim, h, r);
    assert_false(nmm_system_follow(system, &sim->model, &sim->state));
    shift(sim, -2.2e-3);
    residual_of(sim, h, r);
    assert_true(nmm_system_follow(system, &sim->model, &sim->state));
    assert_true(nmm_system_catch(system, &sim->model, &sim->state));
    memcpy(value, system->K.value, n_value * sizeof *value);
    for (int k = 0; k < sim->model.n_interface; k++)
        sim->model.interface[k].friction = 1e9;
    residual_of(sim, h, r);
    assemble(sim, h);
    double largest = 0, most = 0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(r[i]));
    for (size_t i = 0; i < n_value; i++)
        most = fmax(most, fabs(value[i]));
    for (int i = 0; i < n; i++)
        assert_near(system->caught[i], r[i], 1e-12 * largest);
    for (size_t i = 0; i < n_value; i++)
        assert_near(value[i], system->K.value[i], 1e-4 * most);
    free(r);
    free(value);
    nmm_sim_destroy(sim);
}

// Threads share rows and couples: the same bits as one thread.
static void check_threads(const char *text, int n_change, const char *const *changes) {
    nmm_sim *sim = open_scene(text, n_change, changes);
    take_steps(sim, 2);
    const int n = 2 * sim->model.n_cover;
    assert_true(n > 4096 && sim->system.couples.n > 0);
    const size_t n_value = 4 * (size_t)sim->system.K.row_start[sim->model.n_cover];
    double *one = calloc((size_t)n, sizeof *one), *value = calloc(n_value, sizeof *value);
    residual_of(sim, 1e-3, one);
    assemble(sim, 1e-3);
    memcpy(value, sim->system.K.value, n_value * sizeof *value);
    for (int threads = 2; threads <= 5; threads++) {
        sim->context.n_thread = threads;
        residual_of(sim, 1e-3, sim->system.change);
        assemble(sim, 1e-3);
        assert_memory_equal(one, sim->system.change, (size_t)n * sizeof *one);
        assert_memory_equal(value, sim->system.K.value, n_value * sizeof *value);
    }
    free(one);
    free(value);
    nmm_sim_destroy(sim);
}

// In the wall every row has springs: one that two threads count, or none, is noticed.
static void test_threads(void **unused) {
    (void)unused;
    static const char wall[] =
        "nmm: 1\n"
        "gravity: [0, -9.81]\n"
        "materials:\n"
        "  brick: {density: 2500, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
        "supports: [{block: base, fix: xy}]\n"
        "covers: {mesh: block}\n"
        "blocks:\n"
        "  - {name: base, polygon: [[-1, -1], [31, -1], [31, 0], [-1, 0]]}\n"
        "  - {polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], repeat: {count: [30, 24], step: [1, 1]}}\n"
        "time: {dt: 1e-3, end: 1}\n";
    const char *const fine[] = {"covers.size=0.06"};
    check_threads(SCENE_BLOCK_ON_BED, 1, fine);
    check_threads(wall, 0, NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_body),      cmocka_unit_test(test_lumped_and_damped),
        cmocka_unit_test(test_supported_body), cmocka_unit_test(test_contacts),
        cmocka_unit_test(test_loads),          cmocka_unit_test(test_threads),
        cmocka_unit_test(test_caught),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
