// SPDX-License-Identifier: MIT
//
// Bodies whose forces are far apart, beside and on each other: each falls as it would alone, each
// presses with its own weight, each comes to its own equilibrium. And what the balance of forces is
// made of: groups, weights, a number that is none.

#include "scenes.h"
#include "test.h"

#define GRAVITY 9.81

// Heavy, light, and light and soft.
static const char *const SCENE_APART =
    "nmm: 1\n"
    "blocks:\n"
    "  - {name: heavy, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: heavy}\n"
    "  - {name: light, polygon: [[2, 0], [3, 0], [3, 1], [2, 1]], material: light}\n"
    "  - {name: soft, polygon: [[4, 0], [5, 0], [5, 1], [4, 1]], material: soft}\n"
    "materials:\n"
    "  heavy: {density: 1e5, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "  light: {density: 1e5, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "  soft: {density: 1e5, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "covers: {size: 0.4}\n"
    "monitors:\n"
    "  - {name: heavy, point: [0.5, 0.5]}\n"
    "  - {name: light, point: [2.5, 0.5]}\n"
    "  - {name: soft, point: [4.5, 0.5]}\n"
    "time: {dt: 0.01, end: 0.1, max_move: 1}\n";

// On each other, on a held base.
static const char *const SCENE_STACK =
    "nmm: 1\n"
    "blocks:\n"
    "  - {name: base, polygon: [[-1, -1], [2, -1], [2, 0], [-1, 0]], material: lower}\n"
    "  - {name: lower, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: lower}\n"
    "  - {name: upper, polygon: [[0, 1], [1, 1], [1, 2], [0, 2]], material: upper}\n"
    "materials:\n"
    "  lower: {density: 1e5, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "  upper: {density: 1e5, youngs_modulus: 1e9, poissons_ratio: 0.25}\n"
    "interfaces: {joint: {friction_angle: 30}}\n"
    "covers: {mesh: block}\n"
    "supports: [{block: base, fix: xy}]\n"
    "analysis: {kind: static}\n";

// Side by side, each pressed by its own load.
static const char *const SCENE_PRESSED =
    "nmm: 1\n"
    "gravity: [0, 0]\n"
    "blocks:\n"
    "  - {name: hard, polygon: [[0, 0], [1, 0], [1, 1], [0, 1]], material: hard}\n"
    "  - {name: soft, polygon: [[2, 0], [3, 0], [3, 1], [2, 1]], material: soft}\n"
    "materials:\n"
    "  hard: {density: 1000, youngs_modulus: 1e12, poissons_ratio: 0, plane: stress}\n"
    "  soft: {density: 1000, youngs_modulus: 1, poissons_ratio: 0, plane: stress}\n"
    "supports: [{segment: [[0, 0], [3, 0]], fix: xy}]\n"
    "loads:\n"
    "  - {segment: [[0, 1], [1, 1]], traction: [0, -1e8]}\n"
    "  - {segment: [[2, 1], [3, 1]], traction: [0, -1e-4]}\n"
    "covers: {size: 0.5}\n"
    "analysis: {kind: static}\n"
    "monitors:\n"
    "  - {name: hard, point: [0.5, 1]}\n"
    "  - {name: soft, point: [2.5, 1]}\n";

// --- Beside each other

static const char *set(char *text, size_t size, const char *key, double value) {
    snprintf(text, size, "%s=%.17g", key, value);
    return text;
}

// The way each body fell, over that of free fall from rest; Shi's scheme is exact at its end times.
static void fall(double ratio, const char *covers, const char *method) {
    char light[64], soft[64], modulus[64];
    const char *const changes[] = {
        // With the modulus of the others no more digits than this are left in its strains.
        set(light, sizeof light, "materials.light.density", 1e5 / nmm_min(ratio, 1e7)),
        set(soft, sizeof soft, "materials.soft.density", 1e5 / ratio),
        set(modulus, sizeof modulus, "materials.soft.youngs_modulus", 1e9 / ratio), covers, method};
    nmm_sim *sim = open_scene(SCENE_APART, 5, changes);
    assert_int_equal(take_steps(sim, 1000).end, NMM_END_COMPLETED);
    for (int k = 0; k < 3; k++) {
        nmm_reading reading;
        nmm_sim_monitor(sim, k, &reading);
        const double way = -0.5 * GRAVITY * 0.1 * 0.1;
        if (fabs(reading.displacement[1] / way - 1) > 1e-6) {
            fail_msg("%s, %s, ratio %g: %s fell %.17g m instead of %.17g m", covers, method, ratio,
                     reading.name, reading.displacement[1], way);
        }
    }
    nmm_sim_destroy(sim);
}

static void test_bodies_apart_fall_alike(void **unused) {
    (void)unused;
    const double ratio[] = {1e3, 1e6, 1e9, 1e12};
    for (int k = 0; k < 4; k++) {
        fall(ratio[k], "covers.mesh=lattice", "solver.method=auto");
        fall(ratio[k], "covers.mesh=lattice", "solver.method=pcg");
        fall(ratio[k], "covers.mesh=lattice", "solver.method=direct");
    }
}

static void test_each_comes_to_its_equilibrium(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_PRESSED, 0, NULL);
    assert_int_equal(take_steps(sim, 2000).end, NMM_END_COMPLETED);
    for (int k = 0; k < 2; k++) {
        nmm_reading reading;
        nmm_sim_monitor(sim, k, &reading);
        // A strain of 1e-4 each.
        assert_true(fabs(reading.displacement[1] / -1e-4 - 1) < 1e-4);
    }
    nmm_sim_destroy(sim);
}

// --- On each other

// Pressure between two blocks [N].
static double pressure(const nmm_sim *sim, int a, int b) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        const int first = model->vertex_block[contact->vertex];
        const int second = model->vertex_block[contact->edge];
        if ((first == a && second == b) || (first == b && second == a)) {
            sum += contact->normal_force;
        }
    }
    return sum;
}

// Each surface carries what lies on it, to the tolerance of the forces of its block.
static void rest(double lower, double upper, const char *kind) {
    char density[2][64], modulus[64];
    const char *const changes[] = {
        set(density[0], sizeof density[0], "materials.lower.density", lower),
        set(density[1], sizeof density[1], "materials.upper.density", upper),
        // As stiff as heavy, so that rounding of places is no force.
        set(modulus, sizeof modulus, "materials.upper.youngs_modulus", 1e4 * upper), kind};
    nmm_sim *sim = open_scene(SCENE_STACK, 4, changes);
    assert_int_equal(take_steps(sim, 2000).end, NMM_END_COMPLETED);
    const double on_lower = pressure(sim, 1, 2) / (upper * GRAVITY);
    const double on_base = pressure(sim, 0, 1) / ((upper + lower) * GRAVITY);
    if (fabs(on_lower - 1) > 1e-5 || fabs(on_base - 1) > 1e-5) {
        fail_msg("%g on %g kg/m3: %.9g and %.9g of the weights above", upper, lower, on_lower,
                 on_base);
    }
    nmm_sim_destroy(sim);
}

static void test_bodies_on_each_other(void **unused) {
    (void)unused;
    const double ratio[] = {1e3, 1e6, 1e9};
    for (int k = 0; k < 3; k++) {
        rest(1e5, 1e5 / ratio[k], "analysis.kind=static");
        rest(1e5 / ratio[k], 1e5, "analysis.kind=static");
    }
}

// --- What it is made of

static void test_a_number_that_is_none_is_never_settled(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_APART, 0, NULL);
    take_steps(sim, 1);
    nmm_balance *balance = &sim->balance;
    nmm_system *system = &sim->system;
    assert_true(nmm_balance_worst(balance, system, &sim->model, 1e-6) <= 1);
    for (int c = 0; c < sim->model.n_cover; c += sim->model.n_cover - 1) {
        const double before = system->residual[2 * c];
        system->residual[2 * c] = NAN;
        assert_true(nmm_balance_worst(balance, system, &sim->model, 1e-6) == INFINITY);
        system->residual[2 * c] = before;
    }
    nmm_sim_destroy(sim);
}

// Forces on each of two blocks that go down together: the part of them along the way.
static double left_along(nmm_sim *sim, double x, double upper, double lower) {
    const double of_block[] = {0, lower, upper};
    nmm_system *system = &sim->system;
    for (int c = 0; c < sim->model.n_cover; c++) {
        system->residual[2 * c] = x * of_block[sim->model.cover_block[c]];
        system->residual[2 * c + 1] = (1 - x) * of_block[sim->model.cover_block[c]];
        sim->moved[2 * c] = 0;
        sim->moved[2 * c + 1] = -1e-3;
    }
    nmm_balance_worst(&sim->balance, system, &sim->model, 1e-6);
    const nmm_balance_sums *whole = &sim->balance.whole[sim->balance.group[1]];
    return nmm_balance_along(&sim->balance, system, &sim->model, sim->moved) * whole->allowed /
           sqrt(whole->left);
}

// What is left counts along the way of all blocks of a group, not across and not against each
// other.
static void test_only_what_is_left_along_the_way_does_work(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_STACK, 0, NULL);
    take_steps(sim, 1);
    assert_near(left_along(sim, 0, 1, 1), 1, 1e-12);
    assert_near(left_along(sim, 0, -1, -1), 1, 1e-12);
    assert_true(left_along(sim, 0, 1, -1) < 1e-12);
    assert_true(left_along(sim, 1, 1, 1) == 0);
    nmm_sim_destroy(sim);
}

static nmm_sim *open_weighted(const char *scene, const char *change) {
    nmm_sim *sim = open_scene(scene, 1, &change);
    take_steps(sim, 1);
    assert_true(sim->balance.weighted);
    assert_true(sim->balance.n_class > 1);
    return sim;
}

static void test_weights_are_taken_back_to_the_bit(void **unused) {
    (void)unused;
    nmm_sim *sim = open_weighted(SCENE_APART, "materials.light.density=1e-3");
    nmm_system *system = &sim->system;
    assert_true(sim->balance.exponent[0] == 0);
    assert_true(sim->balance.exponent[1] > 20);
    const size_t size = 2 * (size_t)system->K.n_row * sizeof(double);
    double *before = malloc(size);
    assert_non_null(before);
    memcpy(before, system->residual, size);
    nmm_balance_put_weights(&sim->balance, system, &sim->model);
    assert_memory_not_equal(before, system->residual, size);
    nmm_balance_take_weights(&sim->balance, system, &sim->model);
    assert_memory_equal(before, system->residual, size);
    free(before);
    nmm_sim_destroy(sim);
}

// The matrix for all contacts in mode `from`, weighted, and then changed to `to`.
static void change_modes(nmm_sim *sim, nmm_contact_mode from, nmm_contact_mode to) {
    nmm_system *system = &sim->system;
    const double h = sim->report.dt;
    memset(system->mode, (int)from, (size_t)sim->state.n_contact);
    nmm_system_prepare(&sim->context, system, &sim->model, &sim->state, h);
    nmm_system_assemble(&sim->context, system, &sim->model, nmm_balance_weights(&sim->balance));
    memset(system->mode, (int)to, (size_t)sim->state.n_contact);
    assert_true(nmm_system_follow(system, &sim->model, &sim->state) == (from != to));
}

// Springs that come and go have the weights of the matrix that they come into.
static void test_matrix_stays_weighted(void **unused) {
    (void)unused;
    nmm_sim *sim = open_weighted(SCENE_STACK, "materials.upper.density=1e-3");
    const nmm_bsr *K = &sim->system.K;
    const size_t n = 4 * (size_t)K->row_start[K->n_row];
    double *changed = malloc(n * sizeof *changed), largest = 0;
    assert_true(sim->state.n_contact > 0);
    assert_non_null(changed);
    for (int to = NMM_CONTACT_OPEN; to <= NMM_CONTACT_STICK; to++) {
        const nmm_contact_mode from = to == NMM_CONTACT_OPEN ? NMM_CONTACT_STICK : NMM_CONTACT_OPEN;
        change_modes(sim, from, (nmm_contact_mode)to);
        memcpy(changed, K->value, n * sizeof *changed);
        change_modes(sim, (nmm_contact_mode)to, (nmm_contact_mode)to);
        for (size_t i = 0; i < n; i++)
            largest = nmm_max(largest, fabs(K->value[i]));
        for (size_t i = 0; i < n; i++)
            assert_near(changed[i], K->value[i], 1e-14 * largest);
    }
    free(changed);
    nmm_sim_destroy(sim);
}

// Rows and columns times the weights of their blocks, to the last bit: these are powers of two.
static void test_matrix_is_weighted(void **unused) {
    (void)unused;
    nmm_sim *sim = open_weighted(SCENE_STACK, "materials.upper.density=1e-3");
    const nmm_bsr *K = &sim->system.K;
    const double *weight = nmm_balance_weights(&sim->balance);
    const size_t n = 4 * (size_t)K->row_start[K->n_row];
    double *plain = malloc(n * sizeof *plain);
    assert_non_null(weight);
    assert_non_null(plain);
    for (int k = 0; k < 2; k++) {
        nmm_system_prepare(&sim->context, &sim->system, &sim->model, &sim->state, sim->report.dt);
        nmm_system_assemble(&sim->context, &sim->system, &sim->model, k == 0 ? NULL : weight);
        if (k == 0) memcpy(plain, K->value, n * sizeof *plain);
    }
    for (int c = 0; c < K->n_row; c++) {
        for (int i = 4 * K->row_start[c]; i < 4 * K->row_start[c + 1]; i++) {
            const int block = sim->model.cover_block[c];
            const int other = sim->model.cover_block[K->col[i / 4]];
            assert_true(K->value[i] == weight[block] * weight[other] * plain[i]);
        }
    }
    free(plain);
    nmm_sim_destroy(sim);
}

static void test_what_may_touch_is_a_group(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_STACK, 0, NULL);
    take_steps(sim, 1);
    // The held base joins nothing.
    assert_true(sim->balance.held[0]);
    assert_int_equal(sim->balance.group[1], sim->balance.group[2]);
    assert_int_not_equal(sim->balance.group[0], sim->balance.group[1]);
    assert_int_equal(sim->balance.count[sim->balance.group[1]], 2);
    nmm_sim_destroy(sim);
}

// Rounding in the springs of a block that balances is no reason for another one that does not.
static void test_rounding_counts_where_it_is(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_STACK, 0, NULL);
    take_steps(sim, 1);
    char text[200];
    for (int clouded = 1; clouded < 3; clouded++) {
        for (int b = 1; b < 3; b++)
            sim->balance.block[b] = (nmm_balance_sums){
                .force = 1, .load = 1, .left = b == 2 ? 1e-4 : 0, .gaps = b == clouded ? 1 : 0};
        nmm_say_clouded(sim, text, sizeof text);
        assert_int_equal(text[0] != 0, clouded == 2);
    }
    nmm_sim_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bodies_apart_fall_alike),
        cmocka_unit_test(test_each_comes_to_its_equilibrium),
        cmocka_unit_test(test_bodies_on_each_other),
        cmocka_unit_test(test_a_number_that_is_none_is_never_settled),
        cmocka_unit_test(test_only_what_is_left_along_the_way_does_work),
        cmocka_unit_test(test_weights_are_taken_back_to_the_bit),
        cmocka_unit_test(test_matrix_stays_weighted),
        cmocka_unit_test(test_matrix_is_weighted),
        cmocka_unit_test(test_what_may_touch_is_a_group),
        cmocka_unit_test(test_rounding_counts_where_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
