// SPDX-License-Identifier: MIT
//
// Corners: who touches whom, by which side, and who does not.

#include "bodies.h"

// Move block 1 to (x, y) within a step: find where it is, move, accept.
static void step_to(bodies *b, double x, double y, double reach) {
    bodies_find(b, reach);
    bodies_put(b, 1, x, y, 0);
    bodies_evaluate(b);
    bodies_commit(b, NULL);
}

static int count_closed(const bodies *b) {
    int n = 0;
    for (int k = 0; k < b->state.n_contact; k++)
        n += b->state.contact[k].mode != NMM_CONTACT_OPEN;
    return n;
}

// --- Bricks

// A brick that covers the end of another one by d only: it is carried, and not pushed sideways,
// although it overlaps the other's side by d as well.
static void test_corner_over_corner(void **unused) {
    (void)unused;
    const double cover[] = {0.3, 0.05, 1e-2, 2e-3};
    for (int k = 0; k < 4; k++) {
        const double d = cover[k];
        const nmm_vec2 lower[4] = BOX(0, -1, 2, 0), upper[4] = BOX(2 - d, 0, 4 - d, 1);
        const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        bodies_put(&b, 1, 0, 1e-3, 0);
        for (int i = 0; i < 5; i++) {
            step_to(&b, 0, -1e-4 * (1 + i % 2), 0.1);
            const nmm_vec2 force = bodies_force(&b, 1, 0);
            assert_near(force.x, 0, 1e-3);
            // Sides that share less than half a cover count as half a cover.
            assert_close(force.y, 1e10 * nmm_max(d, 0.5) * 1e-4 * (1 + i % 2), 1e-9);
        }
        bodies_close(&b);
    }
}

// The same from rest: blocks drawn with an overlap carry nothing by it, and go on from there.
static void test_drawn_with_an_overlap(void **unused) {
    (void)unused;
    const nmm_vec2 lower[4] = BOX(0, -1, 2, 0), upper[4] = BOX(0.5, -1e-3, 2.5, 1);
    const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_find(&b, 0.1);
    bodies_evaluate(&b);
    assert_near(bodies_force(&b, 1, 0).y, 0, 1e-3);
    step_to(&b, 0, -1e-5, 0.1);
    assert_close(bodies_force(&b, 1, 0).y, 1e10 * 1.5 * 1e-5, 1e-9);
    // Half out, then back: the overlap that is left is the new rest.
    step_to(&b, 0, 5e-4, 0.1);
    assert_near(bodies_force(&b, 1, 0).y, 0, 1e-3);
    step_to(&b, 0, 0, 0.1);
    assert_close(bodies_force(&b, 1, 0).y, 1e10 * 1.5 * 5e-4, 1e-9);
    bodies_close(&b);
}

// Drawn deeply into each other, or soft and pressed so: still the same sides, and no way through.
static void test_deep_overlap(void **unused) {
    (void)unused;
    const double deep[] = {0.02, 0.1, 0.3, 0.45};
    for (int k = 0; k < 8; k++) {
        const double d = deep[k % 4], y = k < 4 ? -d : 0;
        const nmm_vec2 lower[4] = BOX(-1, -1, 3, 0), upper[4] = BOX(0, y, 2, 1);
        const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        if (k < 4) {
            // Drawn: no force, then as much as is added.
            step_to(&b, 0, -1e-3, 0.01);
            assert_close(bodies_force(&b, 1, 0).y, 2e10 * 1e-3, 1e-9);
        } else {
            // Pressed in steps.
            for (double at = 0; at > -d; at -= 0.004)
                step_to(&b, 0, at, 0.01);
            step_to(&b, 0, -d, 0.01);
            assert_close(bodies_force(&b, 1, 0).y, 2e10 * d, 1e-9);
        }
        assert_int_equal(count_closed(&b), 2);
        bodies_close(&b);
    }
}

static const nmm_vec2 left_brick[4] = BOX(0, 0, 1, 1), right_brick[4] = BOX(1, 0, 2, 1);

// A brick on the joint of two others presses both down and does not drive them apart.
static void test_side_by_side(void **unused) {
    (void)unused;
    const nmm_vec2 top[4] = BOX(0.4, 1, 1.7, 2);
    const loop loops[3] = {{0, 4, left_brick}, {1, 4, top}, {2, 4, right_brick}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 3, loops, 0.5), NMM_OK);
    for (int k = 0; k < 5; k++) {
        step_to(&b, 0, -1e-4 * (1 + k), 0.3);
        const nmm_vec2 left = bodies_force(&b, 1, 0), right = bodies_force(&b, 1, 2);
        assert_near(left.x, 0, 1e-3);
        assert_near(right.x, 0, 1e-3);
        assert_close(left.y, 2e10 * 0.6 * 1e-4 * (1 + k), 1e-9);
        assert_close(right.y, 2e10 * 0.7 * 1e-4 * (1 + k), 1e-9);
        assert_near(bodies_force(&b, 0, 2).x, 0, 1e-3);
        assert_near(bodies_length(&b, 0, 2), 1, 1e-12);
    }
    bodies_close(&b);
}

enum { ROWS = 5, COLUMNS = 4, BRICKS = ROWS * COLUMNS };

// A wall in running bond, each row pressed into the one below.
static void test_running_bond(void **unused) {
    (void)unused;
    static nmm_vec2 corner[BRICKS][4];
    loop loops[BRICKS];
    double low[BRICKS];
    for (int k = 0; k < BRICKS; k++) {
        const int row = k / COLUMNS, column = k % COLUMNS;
        low[k] = 2 * column + (row % 2 == 0 ? 0 : 0.7);
        const nmm_vec2 box[4] = BOX(low[k], row, low[k] + 2, row + 1);
        memcpy(corner[k], box, sizeof box);
        loops[k] = (loop){k, 4, corner[k]};
    }
    bodies b = {0};
    assert_int_equal(bodies_open(&b, BRICKS, loops, 1), NMM_OK);
    for (int i = 0; i < 4; i++) {
        bodies_find(&b, 0.2);
        for (int k = 0; k < BRICKS; k++)
            bodies_put(&b, k, 0, -1e-4 * (k / COLUMNS) * (1 + i), 0);
        bodies_evaluate(&b);
        bodies_commit(&b, NULL);
    }
    bodies_find(&b, 0.2);
    for (int p = 0; p < BRICKS; p++) {
        for (int q = p + 1; q < BRICKS; q++) {
            const int rows = q / COLUMNS - p / COLUMNS;
            const double shared = nmm_min(low[p], low[q]) + 2 - nmm_max(low[p], low[q]);
            const nmm_vec2 force = bodies_force(&b, q, p);
            assert_near(force.x, 0, 1e-2);
            if (rows == 1 && shared > 1e-9) {
                assert_near(bodies_length(&b, p, q), shared, 1e-12);
                assert_close(force.y, 1e10 * 4e-4 * shared, 1e-8);
            } else if (rows == 0 && shared > -1e-9) {
                assert_near(bodies_length(&b, p, q), 1, 1e-12);
            } else {
                assert_int_equal(bodies_count(&b, p, q), 0);
            }
        }
    }
    bodies_close(&b);
}

// Two plates thinner than the reach: the upper side of one is near the lower side of the other, and
// seems deep behind it.
static void test_thin_plates(void **unused) {
    (void)unused;
    const double thick[] = {0.1, 1e-2, 1e-3};
    for (int k = 0; k < 3; k++) {
        const nmm_vec2 lower[4] = BOX(0, -thick[k], 2, 0), upper[4] = BOX(0.5, 0, 1.5, thick[k]);
        const loop loops[2] = {{0, 4, lower}, {1, 4, upper}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        for (int i = 0; i < 3; i++) {
            step_to(&b, 0, -1e-5, 0.4);
            assert_int_equal(b.state.n_contact, 2);
            assert_int_equal(count_closed(&b), 2);
            assert_close(bodies_force(&b, 1, 0).y, 1e10 * 1e-5, 1e-9);
        }
        bodies_close(&b);
    }
}

// --- Points

// A block with a tip at the origin that points along `angle` + 180 degrees; half opening 0.4 rad.
static void make_tip(nmm_vec2 corner[3], double angle) {
    corner[0] = (nmm_vec2){0, 0};
    corner[1] = (nmm_vec2){cos(angle - 0.4), sin(angle - 0.4)};
    corner[2] = (nmm_vec2){cos(angle + 0.4), sin(angle + 0.4)};
}

// A box whose right upper corner is the origin; edge 1 is its right side, edge 2 its top.
static const nmm_vec2 box[4] = BOX(-2, -2, 0, 0);
enum { BOX_RIGHT = 1, BOX_TOP = 2, TIP = 4 };

static bodies tip_at_box(double angle, double x, double y) {
    nmm_vec2 tip[3];
    make_tip(tip, angle);
    const loop loops[2] = {{0, 4, box}, {1, 3, tip}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_put(&b, 1, x, y, 0);
    return b;
}

// From the space in front of the corner to the inside: one contact, by the smaller overlap.
static void test_tip_into_corner(void **unused) {
    (void)unused;
    const double from[][2] = {{4e-3, 6e-3}, {6e-3, 4e-3}, {1e-3, 9e-3}, {-1e-3, 5e-3}};
    const double to[][2] = {{-3e-3, -1e-3}, {-1e-3, -3e-3}, {-4e-3, -1e-3}, {-5e-3, -1e-3}};
    const int expected[] = {BOX_TOP, BOX_RIGHT, BOX_TOP, BOX_TOP};
    for (int k = 0; k < 4; k++) {
        bodies b = tip_at_box(0.785, from[k][0], from[k][1]);
        step_to(&b, to[k][0], to[k][1], 0.05);
        assert_int_equal(count_closed(&b), 1);
        const nmm_contact *c = bodies_contact(&b, TIP, expected[k]);
        assert_non_null(c);
        assert_int_not_equal(c->mode, NMM_CONTACT_OPEN);
        // It stays the one that was pressed, also when it becomes the deeper one.
        step_to(&b, to[k][1], to[k][0], 0.05);
        assert_int_equal(count_closed(&b), 1);
        assert_non_null(bodies_contact(&b, TIP, expected[k]));
        bodies_close(&b);
    }
}

// Past the corner without touching: never a force.
static void test_tip_past_corner(void **unused) {
    (void)unused;
    bodies b = tip_at_box(0.785, 0.01, 0.05);
    for (int k = 0; k < 20; k++) {
        step_to(&b, 0.01, 0.05 - 0.01 * k, 0.05);
        assert_int_equal(count_closed(&b), 0);
    }
    for (int k = 0; k < 20; k++) {
        step_to(&b, 0.01 + 0.02 * k, -0.15 + 0.02 * k, 0.05);
        assert_int_equal(count_closed(&b), 0);
    }
    // All in one step.
    step_to(&b, 0.01, 0.03, 0.05);
    step_to(&b, 0.01, -0.02, 0.05);
    assert_int_equal(count_closed(&b), 0);
    bodies_close(&b);
}

// Off the end of the top: the contact ends where the top ends.
static void test_tip_slides_off(void **unused) {
    (void)unused;
    bodies b = tip_at_box(1.5, -0.02, 1e-3);
    step_to(&b, -0.02, -1e-4, 0.02);
    assert_int_equal(count_closed(&b), 1);
    step_to(&b, -0.005, -1e-4, 0.02);
    assert_int_equal(count_closed(&b), 1);
    step_to(&b, 0.005, -1e-4, 0.02);
    step_to(&b, 0.006, -1e-4, 0.02);
    assert_int_equal(count_closed(&b), 0);
    step_to(&b, 0.006, -1e-2, 0.02);
    assert_int_equal(count_closed(&b), 0);
    bodies_close(&b);
}

// Two corners with their points on one line: pushed together they hold, whichever is the lower one
// by a rounding, and do not slip under each other.
static void test_tip_to_tip(void **unused) {
    (void)unused;
    const nmm_vec2 left[3] = {{-1, 0}, {0, 0}, {-0.4, 1}}, right[3] = {{0, 0}, {1, 0}, {0.2, 1}};
    const loop loops[2] = {{0, 3, left}, {1, 3, right}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_put(&b, 1, 1e-4, 0, 0);
    for (int k = 0; k < 40; k++) {
        step_to(&b, -1e-4, 1e-4 * sin(0.7 * k), 0.02);
        assert_true(count_closed(&b) >= 1);
        assert_true(bodies_force(&b, 1, 0).x > 1e5);
    }
    bodies_close(&b);
}

// Four blocks at a crossing of joints that is off by a rounding: those across the crossing share
// 1e-8 of a side, and carry no more than that.
static void test_crossing(void **unused) {
    (void)unused;
    const double e = 1e-8;
    const nmm_vec2 sw[5] = {{-1, -1}, {0, -1}, {0, 0}, {-e, 0}, {-1, 0}};
    const nmm_vec2 se[4] = BOX(0, -1, 1, 0);
    const nmm_vec2 ne[5] = {{-e, 0}, {0, 0}, {1, 0}, {1, 1}, {-e, 1}};
    const nmm_vec2 nw[4] = BOX(-1, 0, -e, 1);
    const loop loops[4] = {{0, 5, sw}, {1, 4, ne}, {2, 4, se}, {3, 4, nw}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 4, loops, 0.5), NMM_OK);
    bodies_join(&b, 1);
    bodies_options(&b, b.options);
    for (int k = 0; k < 3; k++) {
        bodies_find(&b, 0.05);
        bodies_put(&b, 1, 0, -1e-4, 0);
        bodies_put(&b, 3, 0, -1e-4, 0);
        bodies_evaluate(&b);
        bodies_commit(&b, NULL);
        assert_close(bodies_force(&b, 1, 2).y, 2e10 * 1e-4, 1e-6);
        assert_near(bodies_force(&b, 1, 0).y, 0, 2e10 * 1e-4 * e * (1 + 1e-6));
    }
    bodies_close(&b);
}

// A corner slides onto a corner: it has sunk by 1e-6, so that at first the sides overlap less than
// the top does. They must give way once it has gone further than it has sunk.
static void test_corner_slides_on(void **unused) {
    (void)unused;
    const nmm_vec2 below[4] = BOX(0, 0, 1, 1), above[4] = BOX(-1, 1, 0, 2);
    const loop loops[2] = {{0, 4, below}, {1, 4, above}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 0.5), NMM_OK);
    step_to(&b, 1e-7, -1e-6, 0.3);
    for (int k = 1; k < 6; k++) {
        const double slid = 1e-3 * k;
        step_to(&b, slid, -1e-6, 0.3);
        step_to(&b, slid, -1e-6, 0.3);
        assert_near(bodies_force(&b, 1, 0).x, 0, 1);
    }
    bodies_close(&b);
}

// In a notch both sides act, and the tip is carried even below the point where they meet.
static void test_tip_in_notch(void **unused) {
    (void)unused;
    const nmm_vec2 notched[7] = {{-2, -2}, {2, -2},     {2, 1.5}, {1.5, 1.5},
                                 {0, 0},   {-1.5, 1.5}, {-2, 1.5}};
    nmm_vec2 tip[3];
    make_tip(tip, 1.5707963267948966);
    const loop loops[2] = {{0, 7, notched}, {1, 3, tip}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    bodies_put(&b, 1, 0, 1e-3, 0);
    for (int k = 0; k < 5; k++) {
        step_to(&b, 0, -1e-4, 0.05);
        assert_int_equal(count_closed(&b), 2);
        const nmm_vec2 force = bodies_force(&b, 1, 0);
        assert_near(force.x, 0, 1e-3);
        // Each side: overlap 1e-4 / sqrt 2, spring 1e10 * 0.5.
        assert_true(force.y >= 5e9 * 1e-4 * (1 - 1e-9));
    }
    bodies_close(&b);
}

// A tip over the seam of two edges in line, any turn: exactly one contact, at any rounding.
static void test_tip_over_seam(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(20);
    const nmm_vec2 seamed[5] = {{-2, -2}, {2, -2}, {2, 0}, {0, 0}, {-2, 0}};
    nmm_vec2 tip[3];
    make_tip(tip, 1.5707963267948966);
    const loop loops[2] = {{0, 5, seamed}, {1, 3, tip}};
    for (int trial = 0; trial < 300; trial++) {
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        const double angle = 6.3 * nmm_random_unit(&random), height = 1e-3 * (trial % 3 - 1);
        const double *c = b.model.element_centre;
        bodies_put(&b, 0, 0, 0, angle);
        const double rx = c[2] - c[0], ry = c[3] - c[1] + height;
        bodies_put(&b, 1, cos(angle) * rx - sin(angle) * ry - c[2] + c[0],
                   sin(angle) * rx + cos(angle) * ry - c[3] + c[1], angle);
        bodies_find(&b, 0.05);
        assert_int_equal(b.state.n_contact, 1);
        assert_near(b.state.contact[0].gap, height, 1e-12);
        bodies_close(&b);
    }
}

// The seam bends by a little, either way: the tip is never lost while it passes, and never doubled.
static void test_tip_over_bent_seam(void **unused) {
    (void)unused;
    const double bend[] = {1e-2, 1e-4, 1e-8, -1e-8, -1e-4, -1e-2};
    nmm_vec2 tip[3];
    make_tip(tip, 1.5707963267948966);
    for (int k = 0; k < 6; k++) {
        const nmm_vec2 seamed[5] = {
            {-2, -2}, {2, -2}, {2, -2 * bend[k]}, {0, 0}, {-2, -2 * bend[k]}};
        const loop loops[2] = {{0, 5, seamed}, {1, 3, tip}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        for (int i = -40; i <= 40; i++) {
            const double x = 5e-4 * i;
            step_to(&b, x, -bend[k] * fabs(x) - (i > -40 ? 1e-4 : -1e-4), 0.05);
            if (i == -40) continue;
            assert_int_equal(count_closed(&b), 1);
        }
        bodies_close(&b);
    }
}

// --- One block

// A crack from the left side to the middle: contacts along its faces, and none at its tip.
static void test_crack(void **unused) {
    (void)unused;
    const nmm_vec2 cracked[9] = {{0, 0},     {2, 0},   {2, 1},     {0, 1},  {0, 0.5},
                                 {0.5, 0.5}, {1, 0.5}, {0.5, 0.5}, {0, 0.5}};
    const loop loops[1] = {{0, 9, cracked}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 1, loops, 0.5), NMM_OK);
    bodies_join(&b, 1);
    b.model.interface[1].cohesion = 1e5;
    bodies_find(&b, 0.1);
    assert_int_equal(b.state.n_contact > 0, 1);
    double sum = 0;
    for (int k = 0; k < b.state.n_contact; k++) {
        const nmm_contact *c = &b.state.contact[k];
        assert_near(c->gap, 0, 1e-14);
        assert_int_equal(c->interface, 1);
        assert_true(c->bonded);
        assert_true(b.state.position[2 * c->vertex] < 0.9);
        sum += c->length;
    }
    // All of it but what belongs to the tip.
    assert_near(sum, 0.75, 1e-12);
    bodies_close(&b);
}

// Nothing touches itself: a thin bar, a ring, a star.
static void test_no_self_contact(void **unused) {
    (void)unused;
    const nmm_vec2 bar[8] = {{0, 0},    {1, 0},    {2, 0},    {3, 0},
                             {3, 0.01}, {2, 0.01}, {1, 0.01}, {0, 0.01}};
    const nmm_vec2 outer[4] = BOX(5, 0, 6, 1),
                   inner[4] = {{5.05, 0.05}, {5.05, 0.95}, {5.95, 0.95}, {5.95, 0.05}};
    nmm_vec2 star[10];
    for (int k = 0; k < 10; k++) {
        const double r = k % 2 == 0 ? 1 : 0.2, angle = 0.6283185307179586 * k;
        star[k] = (nmm_vec2){10 + r * cos(angle), r * sin(angle)};
    }
    const loop loops[4] = {{0, 8, bar}, {1, 4, outer}, {1, 4, inner}, {2, 10, star}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 4, loops, 0.5), NMM_OK);
    bodies_find(&b, 0.2);
    assert_int_equal(b.state.n_contact, 0);
    bodies_close(&b);
}

// A block in the hole of another one touches it from inside.
static void test_block_in_hole(void **unused) {
    (void)unused;
    const nmm_vec2 outer[4] = BOX(0, 0, 4, 4), hole[4] = {{1, 1}, {1, 3}, {3, 3}, {3, 1}};
    const nmm_vec2 plug[4] = BOX(1, 1, 3, 3);
    const loop loops[3] = {{0, 4, outer}, {0, 4, hole}, {1, 4, plug}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 3, loops, 1), NMM_OK);
    bodies_find(&b, 0.1);
    assert_near(bodies_length(&b, 0, 1), 8, 1e-12);
    step_to(&b, 0, -1e-5, 0.1);
    assert_close(bodies_force(&b, 1, 0).y, 1e10 * 2 * 1e-5, 1e-4);
    bodies_close(&b);
}

// Two vertices at one place: no division by the length between them.
static void test_edge_without_length(void **unused) {
    (void)unused;
    const nmm_vec2 lower[6] = {{-2, -2}, {2, -2}, {2, 0}, {0.5, 0}, {0.5, 0}, {-2, 0}};
    nmm_vec2 tip[3];
    make_tip(tip, 1.5707963267948966);
    const loop loops[2] = {{0, 6, lower}, {1, 3, tip}};
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    for (int k = 0; k <= 20; k++) {
        step_to(&b, 0.05 * k, -1e-4, 0.05);
        for (int i = 0; i < b.state.n_contact; i++) {
            assert_true(isfinite(b.state.contact[i].anchor));
            assert_true(isfinite(b.state.contact[i].shear_force));
        }
    }
    bodies_close(&b);
}

// A box pressed flat on the ground, then tipped over its left corner, which stays as deep as it
// was. An edge of a tenth of a micrometre at that corner points anywhere: the box is carried all
// the way.
static void test_tiny_edge_at_corner(void **unused) {
    (void)unused;
    const double pi = 3.14159265358979323846;
    for (int k = 0; k < 16; k++) {
        const double angle = pi * k / 8, tiny = 1e-7, deep = 1e-5;
        const nmm_vec2 ground[4] = BOX(-3, -2, 3, 0);
        const nmm_vec2 tipped[5] = {
            {-1, 0}, {-1 + tiny * cos(angle), tiny * sin(angle)}, {1, 0}, {1, 1}, {-1, 1}};
        const loop loops[2] = {{0, 4, ground}, {1, 5, tipped}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        for (int i = 0; i <= 40; i++) {
            const double turn = 0.01 * i;
            const double *centre = b.model.element_centre + 2;
            const double rx = -1 - centre[0], ry = -centre[1];
            const double x = rx - (cos(turn) * rx - sin(turn) * ry);
            const double y = ry - (sin(turn) * rx + cos(turn) * ry);
            bodies_find(&b, 0.1);
            bodies_put(&b, 1, x, y - deep, turn);
            bodies_evaluate(&b);
            bodies_commit(&b, NULL);
            assert_true(bodies_force(&b, 1, 0).y > 0.3 * 1e10 * 0.5 * deep);
        }
        bodies_close(&b);
    }
}

// --- Joints at a corner

// Block 1 at rest on edge 2, which no joint made: interfaces of the sides that begin at its first
// vertex and end there, 0 or 1, the weak one of friction 0.1; friction of the contact of that
// vertex.
static double friction_at(const loop *loops, int weak, int after, int before) {
    bodies b = {0};
    assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
    b.model.interface[weak].friction = 0.1;
    const int v = bodies_vertex(&b, 1);
    b.model.edge_interface[v] = after;
    b.model.edge_interface[b.model.vertex_prev[v]] = before;
    bodies_find(&b, 0.1);
    const nmm_contact *c = bodies_contact(&b, v, 2);
    assert_non_null(c);
    const double friction = b.model.interface[c->interface].friction;
    bodies_close(&b);
    return friction;
}

// A corner between two joints meets by the weaker one, whichever is listed first; a side by its
// own.
static void test_two_joints_at_corner(void **unused) {
    (void)unused;
    const nmm_vec2 floor[4] = BOX(-2, -1, 2, 0), brick[4] = BOX(0, 0, 1, 1);
    const nmm_vec2 tip[3] = {{0, 0}, {1, 1}, {-1, 1}};
    const loop of_tip[2] = {{0, 4, floor}, {1, 3, tip}}, of_box[2] = {{0, 4, floor}, {1, 4, brick}};
    for (int weak = 0; weak < 2; weak++) {
        const double friction[2] = {weak == 0 ? 0.1 : 0.5, weak == 1 ? 0.1 : 0.5};
        assert_close(friction_at(of_tip, weak, 0, 1), 0.1, 1e-15);
        assert_close(friction_at(of_tip, weak, 1, 0), 0.1, 1e-15);
        assert_close(friction_at(of_tip, weak, -1, 1), friction[1], 1e-15);
        assert_close(friction_at(of_tip, weak, -1, -1), friction[0], 1e-15);
        assert_close(friction_at(of_box, weak, 0, 1), friction[0], 1e-15);
        assert_close(friction_at(of_box, weak, 1, 0), friction[1], 1e-15);
    }
}

// Sides of two joints that lie on each other meet by the weaker one, whichever side has it.
static void test_sides_of_two_joints(void **unused) {
    (void)unused;
    const nmm_vec2 floor[4] = BOX(-2, -1, 2, 0), brick[4] = BOX(0, 0, 1, 1);
    const loop loops[2] = {{0, 4, floor}, {1, 4, brick}};
    for (int below = 0; below < 2; below++) {
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        b.model.interface[1].friction = 0.1;
        const int v = bodies_vertex(&b, 1);
        b.model.edge_interface[2] = below;
        b.model.edge_interface[v] = 1 - below;
        bodies_find(&b, 0.1);
        int n = 0;
        for (int k = 0; k < 2; k++) {
            const nmm_contact *c = bodies_contact(&b, v + k, 2);
            assert_non_null(c);
            n += b.model.interface[c->interface].friction == 0.1;
        }
        assert_int_equal(n, 2);
        bodies_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_corner_over_corner),
        cmocka_unit_test(test_drawn_with_an_overlap),
        cmocka_unit_test(test_deep_overlap),
        cmocka_unit_test(test_side_by_side),
        cmocka_unit_test(test_running_bond),
        cmocka_unit_test(test_thin_plates),
        cmocka_unit_test(test_tip_into_corner),
        cmocka_unit_test(test_tip_past_corner),
        cmocka_unit_test(test_tip_slides_off),
        cmocka_unit_test(test_tip_to_tip),
        cmocka_unit_test(test_crossing),
        cmocka_unit_test(test_corner_slides_on),
        cmocka_unit_test(test_tip_in_notch),
        cmocka_unit_test(test_tip_over_seam),
        cmocka_unit_test(test_tip_over_bent_seam),
        cmocka_unit_test(test_crack),
        cmocka_unit_test(test_no_self_contact),
        cmocka_unit_test(test_block_in_hole),
        cmocka_unit_test(test_edge_without_length),
        cmocka_unit_test(test_tiny_edge_at_corner),
        cmocka_unit_test(test_two_joints_at_corner),
        cmocka_unit_test(test_sides_of_two_joints),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
