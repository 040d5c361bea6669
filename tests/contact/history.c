// SPDX-License-Identifier: MIT
//
// History: forces, slip and strength pass on when the names of contacts change.

#include "bodies.h"

// Forces on block 1 before and after the list is made anew, at the same place.
static void find_and_compare(bodies *b, double reach, double tolerance) {
    bodies_evaluate(b);
    const nmm_vec2 before = bodies_force(b, 1, 0);
    bodies_find(b, reach);
    bodies_evaluate(b);
    const nmm_vec2 after = bodies_force(b, 1, 0);
    const double scale = fabs(before.x) + fabs(before.y);
    assert_near(after.x, before.x, tolerance * scale);
    assert_near(after.y, before.y, tolerance * scale);
}

static void accept_at(bodies *b, double x, double y, nmm_contact_energy *energy) {
    bodies_put(b, 1, x, y, 0);
    bodies_evaluate(b);
    bodies_commit(b, energy);
}

// --- A corner on a side with a seam

static const nmm_vec2 seamed[5] = {{-2, -2}, {2, -2}, {2, 0}, {0, 0}, {-2, 0}};
static const nmm_vec2 tip[3] = {{0, 0}, {0.5, 1}, {-0.5, 1}};
enum { RIGHT_OF_SEAM = 2, LEFT_OF_SEAM = 3, TIP = 5 };

static bodies tip_at(double x, double y) {
    const loop loops[2] = {{0, 5, seamed}, {1, 3, tip}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_put(&b, 1, x, y, 0);
    return b;
}

// k_n = 5e9, k_s = 2e9; overlap 1e-5: N = 5e4, limit 2.5e4 at a slip of 1.25e-5.
static void test_sticking_over_a_seam(void **unused) {
    (void)unused;
    for (int way = -1; way <= 1; way += 2) {
        bodies b = tip_at(-5e-6 * way, 0);
        bodies_find(&b, 0.01);
        accept_at(&b, -5e-6 * way, -1e-5, NULL);
        find_and_compare(&b, 0.01, 1e-9);
        accept_at(&b, 5e-6 * way, -1e-5, NULL);
        assert_close(bodies_force(&b, 1, 0).x, -2e4 * way, 1e-6);
        find_and_compare(&b, 0.01, 1e-9);
        assert_int_equal(b.state.n_contact, 1);
        assert_int_equal(b.state.contact[0].edge, way > 0 ? RIGHT_OF_SEAM : LEFT_OF_SEAM);
        assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_STICK);
        // Back where it began, on the other edge again: no force left.
        accept_at(&b, -5e-6 * way, -1e-5, NULL);
        find_and_compare(&b, 0.01, 1e-9);
        assert_near(bodies_force(&b, 1, 0).x, 0, 1);
        bodies_close(&b);
    }
}

// The same where the seam is a tiny edge, which has no contacts of its own.
static void test_sticking_over_a_tiny_edge(void **unused) {
    (void)unused;
    static const nmm_vec2 side[6] = {{-2, -2}, {2, -2}, {2, 0}, {1e-7, 0}, {0, 0}, {-2, 0}};
    for (int way = -1; way <= 1; way += 2) {
        const loop loops[2] = {{0, 6, side}, {1, 3, tip}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        bodies_put(&b, 1, -5e-6 * way, 0, 0);
        bodies_find(&b, 0.01);
        accept_at(&b, -5e-6 * way, -1e-5, NULL);
        accept_at(&b, 5e-6 * way, -1e-5, NULL);
        find_and_compare(&b, 0.01, 1e-9);
        assert_int_equal(b.state.n_contact, 1);
        assert_int_equal(b.state.contact[0].edge, way > 0 ? 2 : 4);
        assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_STICK);
        bodies_close(&b);
    }
}

static void test_sliding_over_a_seam(void **unused) {
    (void)unused;
    bodies b = tip_at(-0.05, 0);
    nmm_contact_energy energy = {0};
    bodies_find(&b, 0.05);
    accept_at(&b, -0.05, -1e-5, &energy);
    for (int k = 1; k <= 20; k++) {
        bodies_find(&b, 0.05);
        accept_at(&b, -0.05 + 0.005 * k, -1e-5, &energy);
        assert_close(bodies_force(&b, 1, 0).x, -2.5e4, 1e-6);
    }
    // 0.1 m less the elastic slip.
    assert_close(b.state.contact[0].slid, 0.1 - 1.25e-5, 1e-6);
    assert_close(energy.friction, 2.5e4 * (0.1 - 1.25e-5), 1e-6);
    find_and_compare(&b, 0.05, 1e-9);
    assert_int_equal(b.state.contact[0].edge, RIGHT_OF_SEAM);
    assert_near(b.state.contact[0].rest, 0, 0);
    bodies_close(&b);
}

// A broken bond stays broken on the next edge.
static void test_broken_over_a_seam(void **unused) {
    (void)unused;
    bodies b = tip_at(-0.01, 0);
    b.model.interface[0].residual_friction = 0.1;
    bodies_find(&b, 0.05);
    accept_at(&b, -0.01, -1e-5, NULL);
    b.state.contact[0].broken = true;
    bodies_find(&b, 0.05);
    accept_at(&b, 0.01, -1e-5, NULL);
    bodies_find(&b, 0.05);
    assert_int_equal(b.state.contact[0].edge, RIGHT_OF_SEAM);
    assert_true(b.state.contact[0].broken);
    accept_at(&b, 0.02, -1e-5, NULL);
    assert_close(bodies_force(&b, 1, 0).x, -0.1 * 5e4, 1e-6);
    bodies_close(&b);
}

// Round a convex corner nothing is taken along.
static void test_not_round_a_corner(void **unused) {
    (void)unused;
    const nmm_vec2 box[4] = BOX(-2, -2, 0, 0);
    nmm_vec2 leaning[3];
    for (int k = 0; k < 3; k++) {
        leaning[k].x = 0.7 * tip[k].x + 0.7 * tip[k].y;
        leaning[k].y = -0.7 * tip[k].x + 0.7 * tip[k].y;
    }
    const loop loops[2] = {{0, 4, box}, {1, 3, leaning}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_put(&b, 1, -1e-3, 1e-3, 0);
    bodies_find(&b, 0.01);
    accept_at(&b, -1e-3, -1e-5, NULL);
    assert_non_null(bodies_contact(&b, 4, 2));
    assert_int_equal(bodies_contact(&b, 4, 2)->mode, NMM_CONTACT_STICK);
    // Off the top and, later, against the right side.
    bodies_find(&b, 0.01);
    accept_at(&b, 1e-3, -1e-5, NULL);
    bodies_find(&b, 0.01);
    accept_at(&b, 1e-3, -1e-3, NULL);
    bodies_find(&b, 0.01);
    const nmm_contact *side = bodies_contact(&b, 4, 1);
    assert_non_null(side);
    assert_near(side->slid, 0, 0);
    assert_near(side->normal_force, 0, 0);
    assert_int_equal(side->mode, NMM_CONTACT_OPEN);
    bodies_close(&b);
}

// --- Cut sides

static const nmm_vec2 cut_base[7] = {{-3, -1}, {3, -1},   {3, 0}, {1.1, 0},
                                     {0.2, 0}, {-0.9, 0}, {-3, 0}};
static const nmm_vec2 cut_brick[6] = {{-1, 0}, {-0.3, 0}, {0.5, 0}, {1, 0}, {1, 1}, {-1, 1}};

static bodies brick_on_cut_base(bool augmented) {
    const loop loops[2] = {{0, 7, cut_base}, {1, 6, cut_brick}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_options(&b, (nmm_contact_options){.penalty = BODY_PENALTY, .augmented = augmented});
    return b;
}

// A brick slides over all cuts of the base, many of them passing its own: pressure and friction
// stay uniform, so nothing is lost or doubled at any moment.
static void test_sliding_over_cuts(void **unused) {
    (void)unused;
    bodies b = brick_on_cut_base(false);
    nmm_contact_energy energy = {0};
    bodies_find(&b, 0.01);
    accept_at(&b, 0, -1e-5, &energy);
    for (int k = 1; k <= 130; k++) {
        bodies_find(&b, 0.01);
        accept_at(&b, 0.01 * k, -1e-5, &energy);
        const nmm_vec2 force = bodies_force(&b, 1, 0);
        // A cut that comes under the brick's front brings an edge of its own, pressed from the
        // next step on.
        assert_close(force.y, 2 * 1e5, 1e-2);
        assert_near(force.x, -0.5 * force.y, 1e-2 * force.y);
    }
    assert_close(energy.friction, 1e5 * 1.3, 1e-2);
    bodies_close(&b);
}

static uint64_t hash_names(const bodies *b) {
    uint64_t hash = NMM_HASH_START;
    for (int k = 0; k < b->state.n_contact; k++) {
        hash = nmm_hash(hash, &b->state.contact[k].vertex, sizeof(int));
        hash = nmm_hash(hash, &b->state.contact[k].edge, sizeof(int));
    }
    return hash;
}

// The same by tiny steps back and forth round places where vertices meet, sticking: a force that
// is a function of place, whatever the names of the contacts.
static void test_sticking_over_cuts(void **unused) {
    (void)unused;
    const double meets[] = {0.1, 0.5, -0.3, 0.6};
    for (int k = 0; k < 4; k++) {
        bodies b = brick_on_cut_base(k % 2 == 1);
        bodies_put(&b, 1, meets[k], 0, 0);
        bodies_find(&b, 0.01);
        accept_at(&b, meets[k], -1e-3, NULL);
        int names = 0;
        uint64_t before = hash_names(&b);
        for (int i = 0; i < 40; i++) {
            const double x = 1e-3 * sin(0.9 * i);
            bodies_find(&b, 0.01);
            names += hash_names(&b) != before;
            before = hash_names(&b);
            accept_at(&b, meets[k] + x, -1e-3, NULL);
            const nmm_vec2 force = bodies_force(&b, 1, 0);
            assert_close(force.y, 1e10 * 2 * 1e-3, 1e-3);
            assert_near(force.x, -4e9 * 2 * x, 1e-3 * 8e6);
        }
        assert_true(names > 0);
        bodies_close(&b);
    }
}

// Carried forces, too, are per length and do not depend on names.
static void test_carried_over_cuts(void **unused) {
    (void)unused;
    bodies b = brick_on_cut_base(true);
    bodies_find(&b, 0.01);
    bodies_put(&b, 1, 0, -1e-5, 0);
    bodies_evaluate(&b);
    assert_true(nmm_contact_give(b.search, &b.model, &b.state) > 1e-9);
    nmm_contact_raise(b.search, &b.state, 1);
    bodies_put(&b, 1, 0, 0, 0);
    bodies_evaluate(&b);
    assert_close(bodies_force(&b, 1, 0).y, 2e5, 1e-9);
    bodies_commit(&b, NULL);
    for (int k = 1; k <= 100; k++) {
        bodies_find(&b, 0.01);
        accept_at(&b, 2e-3 * k, 0, NULL);
        const nmm_vec2 force = bodies_force(&b, 1, 0);
        assert_close(force.y, 2e5, 2e-3);
        assert_close(force.x, -1e5, 2e-3);
    }
    bodies_close(&b);
}

// --- Matched bricks

static const nmm_vec2 lower[4] = BOX(0, -1, 2, 0), upper[4] = BOX(0, 0, 2, 1);

// Ends that coincide keep their names through elastic slip, and change them once for good.
static void test_matched_bricks_keep_names(void **unused) {
    (void)unused;
    const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_find(&b, 0.01);
    accept_at(&b, 0, -1e-3, NULL);
    const nmm_contact first = b.state.contact[0], second = b.state.contact[1];
    for (int k = 0; k < 20; k++) {
        bodies_find(&b, 0.01);
        accept_at(&b, 5e-5 * sin(1.0 * k), -1e-3, NULL);
        assert_int_equal(b.state.n_contact, 2);
        assert_int_equal(b.state.contact[0].vertex, first.vertex);
        assert_int_equal(b.state.contact[1].vertex, second.vertex);
    }
    accept_at(&b, 5e-4, -1e-3, NULL);
    find_and_compare(&b, 0.01, 1e-3);
    assert_close(bodies_force(&b, 1, 0).x, -4e9 * 2 * 5e-4, 1e-3);
    // Now each end is the vertex that lies over the other brick: the upper brick's left one, the
    // lower brick's right one.
    assert_non_null(bodies_contact(&b, 4, 2));
    assert_non_null(bodies_contact(&b, 2, 4));
    bodies_close(&b);
}

// Bonded bricks whose ends move apart elastically do not get second contacts beside the bonds.
static void test_bonds_are_not_doubled(void **unused) {
    (void)unused;
    const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    b.model.interface[1].cohesion = 1e12;
    bodies_join(&b, 1);
    bodies_find(&b, 0.01);
    assert_int_equal(b.state.n_contact, 2);
    for (int k = 0; k < 20; k++) {
        const double x = 0.01 * sin(1.0 * k);
        accept_at(&b, x, -1e-3, NULL);
        bodies_find(&b, 0.02);
        bodies_evaluate(&b);
        assert_int_equal(b.state.n_contact, 2);
        assert_close(bodies_force(&b, 1, 0).y, 2e7, 1e-9);
        assert_near(bodies_force(&b, 1, 0).x, -8e9 * x, 1);
    }
    bodies_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sticking_over_a_seam),
        cmocka_unit_test(test_sticking_over_a_tiny_edge),
        cmocka_unit_test(test_sliding_over_a_seam),
        cmocka_unit_test(test_broken_over_a_seam),
        cmocka_unit_test(test_not_round_a_corner),
        cmocka_unit_test(test_sliding_over_cuts),
        cmocka_unit_test(test_sticking_over_cuts),
        cmocka_unit_test(test_carried_over_cuts),
        cmocka_unit_test(test_matched_bricks_keep_names),
        cmocka_unit_test(test_bonds_are_not_doubled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
