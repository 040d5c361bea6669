// SPDX-License-Identifier: MIT
//
// The law of a contact: gradients, balance of the force pair, friction, bonds, energies.

#include "bodies.h"

#include <float.h>

// A brick of 2 x 1 on a base of 4 x 1, both upright; vertex 0 of the brick is vertex 4.
static const nmm_vec2 base[4] = BOX(-1, -1, 3, 0);
static const nmm_vec2 brick[4] = BOX(0, 0, 2, 1);
enum { BASE_TOP = 2, BRICK_LEFT = 4, BRICK_RIGHT = 5 };

static bodies brick_on_base(double size) {
    bodies b = {0};
    const loop loops[2] = {{0, 4, base}, {1, 4, brick}};
    assert_int_equal(bodies_open(&b, 2, loops, size), NMM_OK);
    return b;
}

static nmm_contact *left_foot(bodies *b) {
    nmm_contact *c = bodies_contact(b, BRICK_LEFT, BASE_TOP);
    assert_non_null(c);
    return c;
}

// --- Kinematics

// Augmented contact, friction of a half.
static bodies augmented_brick(void) {
    bodies b = brick_on_base(1);
    bodies_options(&b, (nmm_contact_options){.penalty = BODY_PENALTY, .augmented = true});
    b.model.interface[0].friction = 0.5;
    return b;
}

// Gap and slip of contact 0 at the displacements given.
static void measured(bodies *b, double *gap, double *slip) {
    nmm_state_place(&b->model, &b->state, 1);
    bodies_evaluate(b);
    *gap = b->state.contact[0].gap;
    *slip = b->state.contact[0].slip;
}

static void check_row(bodies *b) {
    const nmm_contact_row row = nmm_contact_row_of(&b->model, &b->state, &b->state.contact[0]);
    for (int k = 0; k < 6; k++) {
        for (int x = 0; x < 2; x++) {
            double *d = &b->state.displacement[2 * row.cover[k] + x];
            const double kept = *d, step = 1e-5;
            double gap[2], slip[2];
            *d = kept + step;
            measured(b, &gap[0], &slip[0]);
            *d = kept - step;
            measured(b, &gap[1], &slip[1]);
            *d = kept;
            nmm_state_place(&b->model, &b->state, 1);
            assert_near(row.normal[k][x], (gap[0] - gap[1]) / (2 * step), 1e-9);
            assert_near(row.shear[k][x], (slip[0] - slip[1]) / (2 * step), 1e-9);
        }
    }
}

// Any turn of the edge, any gap, the anchor on or off the edge.
static void test_row_is_the_derivative(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(1);
    for (int trial = 0; trial < 100; trial++) {
        bodies b = brick_on_base(1);
        bodies_find(&b, 0.1);
        assert_true(b.state.n_contact >= 2);
        bodies_put(&b, 0, 0.3, -0.2, 6.3 * nmm_random_unit(&random));
        bodies_put(&b, 1, nmm_random_unit(&random), 0.3, 6.3 * nmm_random_unit(&random));
        bodies_shake(&b, &random, 0.05);
        b.state.contact[0].anchor = 3 * nmm_random_unit(&random) - 1;
        check_row(&b);
        bodies_close(&b);
    }
}

// Work of the pair of forces along a motion of everything.
static void work(const bodies *b, const nmm_contact *c, nmm_vec2 shift, double spin,
                 double out[2]) {
    const nmm_contact_row row = nmm_contact_row_of(&b->model, &b->state, c);
    out[0] = out[1] = 0;
    for (int k = 0; k < 6; k++) {
        const double *place = b->model.cover_place + 2 * (long)row.cover[k];
        const double *moved = b->state.displacement + 2 * (long)row.cover[k];
        const double x = place[0] + moved[0], y = place[1] + moved[1];
        const double v[2] = {shift.x - spin * y, shift.y + spin * x};
        for (int i = 0; i < 2; i++) {
            out[0] += row.normal[k][i] * v[i];
            out[1] += row.shear[k][i] * v[i];
        }
    }
}

static void test_force_pair_has_no_resultant_and_no_moment(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(2);
    for (int trial = 0; trial < 200; trial++) {
        bodies b = brick_on_base(1);
        bodies_find(&b, 0.1);
        bodies_put(&b, 0, 0, 0, 6.3 * nmm_random_unit(&random));
        bodies_put(&b, 1, nmm_random_unit(&random), 0.3, 6.3 * nmm_random_unit(&random));
        bodies_shake(&b, &random, 0.3);
        nmm_contact *c = &b.state.contact[0];
        c->anchor = 3 * nmm_random_unit(&random) - 1;
        const nmm_vec2 shift[3] = {{1, 0}, {0, 1}, {0, 0}};
        for (int k = 0; k < 3; k++) {
            double w[2];
            work(&b, c, shift[k], k == 2, w);
            assert_near(w[0], 0, 1e-13);
            assert_near(w[1], 0, 1e-13);
        }
        bodies_close(&b);
    }
}

// --- Springs and friction

static void test_springs(void **unused) {
    (void)unused;
    bodies b = brick_on_base(0.5);
    bodies_find(&b, 0.1);
    assert_int_equal(b.state.n_contact, 2);
    const nmm_contact *c = left_foot(&b);
    assert_near(c->length, 1, 1e-14);
    // penalty E / h times the length, and 2.5 times less.
    assert_close(c->normal_stiffness, 10 * 1e9 / 0.5, 1e-14);
    assert_close(c->shear_stiffness, 4 * 1e9 / 0.5, 1e-14);
    bodies_put(&b, 1, 0.25e-6, -1e-6, 0);
    const nmm_contact_verdict verdict = bodies_evaluate(&b);
    assert_near(c->gap, -1e-6, 1e-15);
    assert_close(c->normal_force, 2e10 * 1e-6, 1e-9);
    // The base's top runs to the left: the brick moved against t, the spring pulls it along t.
    assert_close(c->shear_force, 8e9 * 0.25e-6, 1e-9);
    assert_int_equal(c->mode, NMM_CONTACT_STICK);
    assert_int_equal(verdict.n_closed, 2);
    const nmm_vec2 force = bodies_force(&b, 1, 0);
    assert_close(force.x, -2 * 8e9 * 0.25e-6, 1e-5);
    assert_close(force.y, 2 * 2e10 * 1e-6, 1e-5);
    bodies_close(&b);
}

// Bodies that have moved together have not moved against each other: a gap has the digits of
// displacements, not those of places.
static void test_gap_has_the_digits_of_displacements(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    bodies_find(&b, 0.01);
    bodies_put(&b, 0, 0.3e-9, -0.7e-9, 0);
    bodies_put(&b, 1, 0.3e-9, -0.7e-9, 0);
    bodies_evaluate(&b);
    for (int k = 0; k < b.state.n_contact; k++) {
        assert_near(b.state.contact[k].gap, 0, 1e-24);
        assert_near(b.state.contact[k].normal_force, 0, 1e-13);
    }
    bodies_put(&b, 1, 0.3e-9, -0.7e-9 - 1e-18, 0);
    bodies_evaluate(&b);
    assert_near(left_foot(&b)->gap, -1e-18, 1e-24);
    bodies_close(&b);
}

static void test_harmonic_mean_and_interface_stiffness(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    b.model.n_material = 2;
    nmm_material two[2] = {b.model.material[0], b.model.material[0]};
    two[1].youngs_modulus = 3e9;
    nmm_material *kept = b.model.material;
    b.model.material = two;
    b.model.element_material[1] = 1;
    bodies_find(&b, 0.1);
    assert_close(left_foot(&b)->normal_stiffness, 10 * 1.5e9, 1e-14);
    b.model.interface[0].normal_stiffness = 7e6;
    bodies_find(&b, 0.1);
    assert_close(left_foot(&b)->normal_stiffness, 7e6, 1e-14);
    assert_close(left_foot(&b)->shear_stiffness, 2.8e6, 1e-14);
    b.model.interface[0].shear_stiffness = 5e6;
    bodies_find(&b, 0.1);
    assert_close(left_foot(&b)->shear_stiffness, 5e6, 1e-14);
    b.model.material = kept;
    bodies_close(&b);
}

// Put the brick at x, settle, accept the step, find again.
static void accept_at(bodies *b, double x, double y, nmm_contact_energy *energy) {
    bodies_put(b, 1, x, y, 0);
    bodies_evaluate(b);
    bodies_commit(b, energy);
    bodies_find(b, 0.01);
}

// k_n = 1e10, k_s = 4e9 at each foot, mu = 0.5, overlap 1e-6: N = 1e4, slips at 1.25e-6.
static void test_friction_loads_slides_and_unloads(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    nmm_contact_energy energy = {0};
    bodies_find(&b, 0.01);
    accept_at(&b, 0, -1e-6, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_STICK);
    accept_at(&b, 1e-6, -1e-6, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_STICK);
    assert_close(left_foot(&b)->shear_force, 4e3, 1e-8);
    assert_near(energy.friction, 0, 0);

    // Beyond the limit: slides; the way is what lies beyond the elastic slip.
    accept_at(&b, 3e-6, -1e-6, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_SLIDE);
    assert_close(left_foot(&b)->shear_force, 5e3, 1e-8);
    assert_close(left_foot(&b)->slid, 1.75e-6, 1e-8);
    assert_close(energy.friction, 2 * 5e3 * 1.75e-6, 1e-8);

    // At rest there: nothing more happens, whatever often.
    for (int k = 0; k < 5; k++) {
        accept_at(&b, 3e-6, -1e-6, &energy);
        assert_close(left_foot(&b)->shear_force, 5e3, 1e-7);
        assert_near(left_foot(&b)->slid, 1.75e-6, 1e-15);
    }

    // Unloading is elastic from the limit: no force after going back 1.25e-6, then the other way.
    accept_at(&b, 2.5e-6, -1e-6, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_STICK);
    assert_close(left_foot(&b)->shear_force, 3e3, 1e-7);
    accept_at(&b, 1.75e-6, -1e-6, &energy);
    assert_near(left_foot(&b)->shear_force, 0, 1e-3);
    accept_at(&b, 0, -1e-6, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_SLIDE);
    assert_close(left_foot(&b)->shear_force, -5e3, 1e-7);
    assert_close(left_foot(&b)->slid, 2.25e-6, 1e-7);
    assert_close(energy.friction, 2 * 5e3 * 2.25e-6, 1e-7);
    bodies_close(&b);
}

// The answer of a step does not depend on the passes between.
static void test_return_mapping_is_from_the_start(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    bodies_find(&b, 0.01);
    accept_at(&b, 0, -1e-6, NULL);
    bodies_put(&b, 1, 1e-6, -1e-6, 0);
    bodies_evaluate(&b);
    const nmm_contact straight = *left_foot(&b);
    const double way[4] = {5e-6, -4e-6, 2e-6, 1e-6};
    for (int k = 0; k < 4; k++) {
        bodies_put(&b, 1, way[k], k == 1 ? 1e-6 : -1e-6, 0);
        bodies_evaluate(&b);
    }
    assert_near(left_foot(&b)->shear_force, straight.shear_force, 0);
    assert_near(left_foot(&b)->anchor, straight.anchor, 0);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_STICK);
    bodies_close(&b);
}

static void test_open_contact_forgets(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    bodies_find(&b, 0.01);
    accept_at(&b, 0, -1e-6, NULL);
    accept_at(&b, 1e-6, -1e-6, NULL);
    accept_at(&b, 1e-6, 1e-6, NULL);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_OPEN);
    assert_near(left_foot(&b)->normal_force, 0, 0);
    // Down again elsewhere: the spring starts from there.
    accept_at(&b, 5e-3, 1e-6, NULL);
    bodies_put(&b, 1, 5e-3, -1e-6, 0);
    bodies_evaluate(&b);
    assert_near(left_foot(&b)->shear_force, 0, 1e-5);
    bodies_close(&b);
}

static void test_verdict_counts(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    bodies_find(&b, 0.01);
    const nmm_contact_verdict none = bodies_evaluate(&b);
    assert_int_equal(none.worst, -1);
    bodies_put(&b, 1, 0, -1e-6, 0);
    const nmm_contact_verdict closed = bodies_evaluate(&b);
    assert_int_equal(closed.n_closed, 2);
    assert_true(closed.worst >= 0);
    bodies_put(&b, 1, 1e-5, -1e-6, 0);
    assert_int_equal(bodies_evaluate(&b).n_slipped, 2);
    bodies_put(&b, 1, 0, -1e-6, 0);
    const nmm_contact_verdict stuck = bodies_evaluate(&b);
    assert_int_equal(stuck.n_stuck, 2);
    // Turned about its middle by a little: one foot up, the other down.
    bodies_put(&b, 1, 0, 0, 1e-6);
    const nmm_contact_verdict turned = bodies_evaluate(&b);
    assert_int_equal(turned.n_opened, 1);
    bodies_close(&b);
}

// --- Bonds

static const nmm_vec2 bonded_base[4] = BOX(0, -1, 2, 0);

// Brick and base of the same width, one joint.
static bodies brick_beside_base(void) {
    bodies b = {0};
    const loop loops[2] = {{0, 4, bonded_base}, {1, 4, brick}};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    return b;
}

// Strength c = 3e4, T = 1e4 Pa, mu 0.5, then 0.25.
static bodies bonded_brick(void) {
    bodies b = brick_beside_base();
    b.model.interface[1] = (nmm_interface){
        .friction = 0.5, .residual_friction = 0.25, .cohesion = 3e4, .tensile_strength = 1e4};
    bodies_join(&b, 1);
    bodies_find(&b, 0.01);
    assert_int_equal(b.state.n_contact, 2);
    for (int k = 0; k < 2; k++) {
        assert_true(b.state.contact[k].bonded);
        assert_near(b.state.contact[k].length, 1, 1e-14);
        assert_int_equal(b.state.contact[k].mode, NMM_CONTACT_STICK);
    }
    return b;
}

static bool all_bonded(const bodies *b) {
    return b->state.contact[0].bonded && b->state.contact[1].bonded;
}

// k_n = 1e10: tension 1e4 N at 1e-6 m.
static void test_bond_breaks_in_tension_at_its_strength(void **unused) {
    (void)unused;
    bodies b = bonded_brick();
    nmm_contact_energy energy = {0};
    accept_at(&b, 0, 1e-6 * (1 - 1e-8), &energy);
    assert_true(all_bonded(&b));
    assert_close(b.state.contact[0].normal_force, -1e4, 1e-7);
    assert_close(bodies_force(&b, 1, 0).y, -2e4, 1e-7);
    assert_close(energy.elastic, 2 * 0.5 * 1e4 * 1e-6, 1e-6);
    assert_near(energy.fracture, 0, 0);
    accept_at(&b, 0, 1e-6 * (1 + 1e-8), &energy);
    for (int k = 0; k < 2; k++) {
        const nmm_contact *c = &b.state.contact[k];
        assert_false(c->bonded);
        assert_true(c->broken);
        assert_int_equal(c->mode, NMM_CONTACT_OPEN);
        assert_near(c->normal_force, 0, 0);
    }
    assert_close(energy.fracture, 2 * 0.5 * 1e4 * 1e-6, 1e-6);
    assert_near(energy.elastic, 0, 0);

    // Never again, and with the residual friction.
    accept_at(&b, 0, -1e-6, &energy);
    accept_at(&b, 0, 1e-7, &energy);
    assert_near(b.state.contact[0].normal_force, 0, 0);
    accept_at(&b, 0, -1e-6, &energy);
    accept_at(&b, 1e-5, -1e-6, &energy);
    // The brick moved by 1e-5: so much shorter is the common length.
    assert_close(fabs(b.state.contact[0].shear_force), 0.25 * 1e4, 1e-5);
    bodies_close(&b);
}

// c l + mu N = 3e4 + 5e3 at an overlap of 1e-6; k_s = 4e9: slip 8.75e-6.
static void test_bond_breaks_in_shear_at_its_strength(void **unused) {
    (void)unused;
    bodies b = bonded_brick();
    nmm_contact_energy energy = {0};
    accept_at(&b, 8.75e-6 * (1 - 1e-8), -1e-6, &energy);
    assert_true(all_bonded(&b));
    assert_close(fabs(b.state.contact[0].shear_force), 3.5e4, 1e-7);
    accept_at(&b, 8.75e-6 * (1 + 1e-8), -1e-6, &energy);
    assert_false(b.state.contact[0].bonded);
    assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_SLIDE);
    assert_close(fabs(b.state.contact[0].shear_force), 2.5e3, 1e-5);
    assert_true(energy.fracture > 0);
    bodies_close(&b);
}

// Loaded and broken in one step, a bond has drawn nothing from the bodies: nothing is lost in it.
static void test_bond_loses_what_it_stored(void **unused) {
    (void)unused;
    for (int augmented = 0; augmented < 2; augmented++) {
        bodies b = bonded_brick();
        nmm_contact_energy energy = {0};
        bodies_options(&b, (nmm_contact_options){.penalty = BODY_PENALTY, .augmented = augmented});
        accept_at(&b, 0, 3e-6, &energy);
        assert_false(all_bonded(&b));
        assert_near(energy.fracture, 0, 0);
        assert_near(energy.elastic, 0, 0);
        bodies_close(&b);
    }
}

// Shear that breaks a bond falls to friction without a way: what is left of its triangle is lost in
// the bond, the rest in friction, and nothing twice. c l + mu N = 3e4 at N = 0; residual friction.
static void test_bond_loses_nothing_twice(void **unused) {
    (void)unused;
    bodies b = bonded_brick();
    nmm_contact_energy energy = {0};
    accept_at(&b, 8e-6, -1e-6, &energy);
    assert_true(all_bonded(&b));
    const double before = energy.elastic;
    // At the same place, without the cohesion.
    b.model.interface[1].cohesion = 1;
    bodies_evaluate(&b);
    nmm_contact_break(&b.model, &b.state);
    accept_at(&b, 8e-6, -1e-6, &energy);
    assert_false(b.state.contact[0].bonded);
    // From 3.2e4 N to 2.5e3 N, at 4e9 N/m, both feet.
    assert_close(energy.fracture, 2 * 0.5 * 2.95e4 * 2.95e4 / 4e9, 1e-4);
    assert_close(energy.friction + energy.fracture, before - energy.elastic, 1e-6);
    bodies_close(&b);
}

// A joint shorter than half a cover: its own length, for strength, initial stress and springs.
static void test_bond_of_a_short_joint(void **unused) {
    (void)unused;
    const nmm_vec2 low[4] = BOX(0, -1, 0.1, 0), high[4] = BOX(0, 0, 0.1, 1);
    const loop loops[2] = {{0, 4, low}, {1, 4, high}};
    for (int k = 0; k < 2; k++) {
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        b.model.interface[1].tensile_strength = 1e4;
        bodies_join(&b, 1);
        bodies_options(&b, b.options);
        for (int e = 0; e < 2; e++)
            b.state.initial_stress[3 * e + 1] = -2e4;
        bodies_find(&b, 0.01);
        bodies_evaluate(&b);
        assert_close(bodies_force(&b, 1, 0).y, 2e4 * 0.1, 1e-9);
        // Springs of 0.1 m: the pull of 1e4 * 0.1 is reached 3e3 N above the start.
        const double up = 3e3 / (1e10 * 0.1);
        accept_at(&b, 0, up * (k == 0 ? 1 - 1e-8 : 1 + 1e-8), NULL);
        assert_int_equal(b.state.contact[0].bonded, k == 0);
        bodies_close(&b);
    }
}

// In one try a bond gives way once; going back to the start of the step mends it.
static void test_bond_in_a_try(void **unused) {
    (void)unused;
    bodies b = bonded_brick();
    nmm_contact start[2];
    memcpy(start, b.state.contact, sizeof start);
    bodies_put(&b, 1, 0, 3e-6, 0);
    bodies_evaluate(&b);
    assert_true(b.state.contact[0].breaking);
    bodies_put(&b, 1, 0, 0.5e-6, 0);
    bodies_evaluate(&b);
    assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_OPEN);
    memcpy(b.state.contact, start, sizeof start);
    bodies_evaluate(&b);
    assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_STICK);
    bodies_commit(&b, NULL);
    assert_true(b.state.contact[0].bonded);
    bodies_close(&b);
}

// Bonds stay in the list however far the search looks.
static void test_bond_outside_the_reach(void **unused) {
    (void)unused;
    bodies b = bonded_brick();
    b.model.interface[1].tensile_strength = 1e12;
    accept_at(&b, 0, 0.05, NULL);
    bodies_find(&b, 1e-4);
    bodies_find(&b, 1e-4);
    assert_int_equal(b.state.n_contact, 2);
    assert_true(all_bonded(&b));
    bodies_evaluate(&b);
    assert_close(b.state.contact[0].normal_force, -1e10 * 0.05, 1e-9);
    bodies_close(&b);
}

// --- Carried forces

// A joint without strength under initial stress, at the start.
static bodies stressed_brick(double sxx, double syy, double sxy) {
    bodies b = brick_beside_base();
    bodies_join(&b, 0);
    for (int e = 0; e < 2; e++) {
        b.state.initial_stress[3 * e] = sxx;
        b.state.initial_stress[3 * e + 1] = syy;
        b.state.initial_stress[3 * e + 2] = sxy;
    }
    bodies_find(&b, 0.01);
    bodies_evaluate(&b);
    return b;
}

static void test_initial_stress_is_in_balance(void **unused) {
    (void)unused;
    bodies b = stressed_brick(-1e5, -3e5, 5e4);
    // On the brick's lower side, n = (0, -1): force -sigma n times 2 m, from below.
    const nmm_vec2 force = bodies_force(&b, 1, 0);
    assert_close(force.x, -5e4 * 2, 1e-12);
    assert_close(force.y, 3e5 * 2, 1e-12);
    assert_int_equal(b.state.contact[0].mode, NMM_CONTACT_STICK);
    bodies_close(&b);
}

// A joint that cannot hold the initial shear holds what it can from the start: nothing has slid, so
// no work was done.
static void test_initial_shear_beyond_friction(void **unused) {
    (void)unused;
    bodies b = stressed_brick(0, -1e5, 8e4);
    nmm_contact_energy energy = {0};
    bodies_commit(&b, &energy);
    assert_close(bodies_force(&b, 1, 0).x, -0.5 * 1e5 * 2, 1e-9);
    assert_close(bodies_force(&b, 1, 0).y, 1e5 * 2, 1e-9);
    assert_near(energy.friction, 0, 1e-9);
    bodies_close(&b);
}

static void test_initial_tension_opens(void **unused) {
    (void)unused;
    bodies b = stressed_brick(0, 3e5, 0);
    assert_near(bodies_force(&b, 1, 0).y, 0, 1e-6);
    bodies_close(&b);
}

static void test_augmented_removes_the_overlap(void **unused) {
    (void)unused;
    bodies b = brick_on_base(1);
    bodies_options(&b, (nmm_contact_options){.penalty = BODY_PENALTY, .augmented = true});
    bodies_find(&b, 0.01);
    // The brick as a point on two springs under a weight of 2e4 N: y follows from the forces.
    double y = 0;
    for (int pass = 0; pass < 5; pass++) {
        bodies_put(&b, 1, 0, y - 1e-6, 0);
        bodies_evaluate(&b);
        const double force = bodies_force(&b, 1, 0).y;
        y += (force - 2e4) / 2e10;
        bodies_put(&b, 1, 0, y - 1e-6, 0);
        bodies_evaluate(&b);
        nmm_contact_raise(b.search, &b.state, 1);
    }
    assert_near(left_foot(&b)->gap, 0, 1e-12);
    assert_close(bodies_force(&b, 1, 0).y, 2e4, 1e-6);
    assert_true(nmm_contact_give(b.search, &b.model, &b.state) < 1e-5);
    nmm_contact_energy energy = {0};
    bodies_commit(&b, &energy);
    assert_near(energy.elastic, 0, 1e-12);
    bodies_close(&b);
}

// What is carried along the edge follows a contact that slides: else a force that was larger would
// push the brick on, by friction, over the way of its spring.
static void test_carried_friction_follows_its_limit(void **unused) {
    (void)unused;
    bodies b = augmented_brick();
    nmm_contact_energy energy = {0};
    bodies_find(&b, 0.01);
    for (int k = 0; k < 2; k++) {
        nmm_contact *c = &b.state.contact[k];
        c->carried_normal = 1e4;
        c->carried_shear = 5e3;
    }
    // A fifth of the pressure is left; the limit of the friction falls to 1e3.
    bodies_put(&b, 1, 0, 0.8e-6, 0);
    bodies_evaluate(&b);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_SLIDE);
    assert_close(left_foot(&b)->shear_force, 1e3, 1e-6);
    bodies_put(&b, 1, -0.1e-6, 0.8e-6, 0);
    bodies_evaluate(&b);
    // Friction along the way: it gives.
    assert_true(left_foot(&b)->shear_force * left_foot(&b)->slip > 0);
    assert_true(nmm_contact_give(b.search, &b.model, &b.state) > 0.1);
    nmm_contact_raise(b.search, &b.state, 1);
    assert_close(left_foot(&b)->carried_shear, 1e3, 1e-6);
    bodies_commit(&b, &energy);
    bodies_close(&b);
}

// What short steps leave in a spring is stored, also where the contact slides.
static void test_sliding_spring_stores(void **unused) {
    (void)unused;
    bodies b = augmented_brick();
    nmm_contact_energy energy = {0};
    bodies_find(&b, 0.01);
    b.state.contact[0].hasty = b.state.contact[1].hasty = true;
    bodies_put(&b, 1, 1e-5, -1e-6, 0);
    bodies_evaluate(&b);
    bodies_commit(&b, &energy);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_SLIDE);
    // N 1e4 and k_n 1e10, T 5e3 and k_s 4e9, at both feet; the rest of the way is lost.
    assert_close(energy.elastic, 2 * (0.5 * 1e4 * 1e-6 + 0.5 * 5e3 * 1.25e-6), 1e-5);
    assert_close(energy.friction, 2 * 5e3 * (1e-5 - 1.25e-6), 1e-5);
    bodies_close(&b);
}

// A spring made stiffer holds until the next step; a carried force acts whatever it is then.
static void test_raise_makes_springs_stiffer(void **unused) {
    (void)unused;
    bodies b = augmented_brick();
    bodies_find(&b, 0.01);
    const double stiffness = left_foot(&b)->normal_stiffness;
    bodies_put(&b, 1, 1e-4, -1e-6, 0);
    bodies_evaluate(&b);
    assert_int_equal(left_foot(&b)->mode, NMM_CONTACT_SLIDE);
    const double pressure = left_foot(&b)->normal_force;
    // How far rounding is from mattering: both feet press alike.
    assert_close(nmm_contact_rounding(b.search, &b.model, &b.state),
                 DBL_EPSILON * 1e-4 * stiffness / pressure, 1e-6);
    nmm_contact_raise(b.search, &b.state, 10);
    assert_close(left_foot(&b)->normal_stiffness, 10 * stiffness, 1e-15);
    bodies_evaluate(&b);
    assert_close(left_foot(&b)->normal_force, 11 * pressure, 1e-9);
    const double friction = left_foot(&b)->shear_force;
    nmm_contact_energy energy = {0};
    bodies_commit(&b, &energy);
    bodies_find(&b, 0.01);
    assert_close(left_foot(&b)->normal_stiffness, stiffness, 1e-15);
    // Slid to the limit: the same friction with the soft spring as with the stiff one.
    nmm_contact *foot = left_foot(&b);
    assert_close(foot->carried_shear - foot->shear_stiffness * foot->slip, friction, 1e-9);
    bodies_close(&b);
}

// --- Energy

// While it sticks, the force is minus the derivative of the stored energy.
static void test_force_is_the_derivative_of_the_energy(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(3);
    bodies b = brick_on_base(1);
    b.model.interface[0].friction = 100;
    bodies_find(&b, 0.1);
    accept_at(&b, 0, -0.02, NULL);
    for (int trial = 0; trial < 30; trial++) {
        bodies_put(&b, 0, 0, 0, 0);
        bodies_put(&b, 1, 0.01, -0.02, 0);
        bodies_shake(&b, &random, 0.003);
        bodies_evaluate(&b);
        double force[12] = {0};
        for (int k = 0; k < b.state.n_contact; k++) {
            const nmm_contact *c = &b.state.contact[k];
            assert_int_equal(c->mode, NMM_CONTACT_STICK);
            const nmm_contact_row row = nmm_contact_row_of(&b.model, &b.state, c);
            for (int i = 0; i < 12; i++) {
                force[2 * row.cover[i / 2] + i % 2] += c->normal_force * row.normal[i / 2][i % 2] +
                                                       c->shear_force * row.shear[i / 2][i % 2];
            }
        }
        for (int i = 0; i < 12; i++) {
            const double kept = b.state.displacement[i], step = 1e-6;
            double energy[2];
            for (int side = 0; side < 2; side++) {
                b.state.displacement[i] = kept + (side == 0 ? step : -step);
                nmm_state_place(&b.model, &b.state, 1);
                bodies_evaluate(&b);
                energy[side] = nmm_contact_stored(b.search, &b.state);
            }
            b.state.displacement[i] = kept;
            nmm_state_place(&b.model, &b.state, 1);
            assert_near(force[i], -(energy[0] - energy[1]) / (2 * step), 20);
        }
    }
    bodies_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_row_is_the_derivative),
        cmocka_unit_test(test_force_pair_has_no_resultant_and_no_moment),
        cmocka_unit_test(test_springs),
        cmocka_unit_test(test_gap_has_the_digits_of_displacements),
        cmocka_unit_test(test_harmonic_mean_and_interface_stiffness),
        cmocka_unit_test(test_friction_loads_slides_and_unloads),
        cmocka_unit_test(test_return_mapping_is_from_the_start),
        cmocka_unit_test(test_open_contact_forgets),
        cmocka_unit_test(test_verdict_counts),
        cmocka_unit_test(test_bond_breaks_in_tension_at_its_strength),
        cmocka_unit_test(test_bond_breaks_in_shear_at_its_strength),
        cmocka_unit_test(test_bond_of_a_short_joint),
        cmocka_unit_test(test_bond_in_a_try),
        cmocka_unit_test(test_bond_outside_the_reach),
        cmocka_unit_test(test_initial_stress_is_in_balance),
        cmocka_unit_test(test_initial_shear_beyond_friction),
        cmocka_unit_test(test_initial_tension_opens),
        cmocka_unit_test(test_bond_loses_what_it_stored),
        cmocka_unit_test(test_bond_loses_nothing_twice),
        cmocka_unit_test(test_augmented_removes_the_overlap),
        cmocka_unit_test(test_carried_friction_follows_its_limit),
        cmocka_unit_test(test_sliding_spring_stores),
        cmocka_unit_test(test_raise_makes_springs_stiffer),
        cmocka_unit_test(test_force_is_the_derivative_of_the_energy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
