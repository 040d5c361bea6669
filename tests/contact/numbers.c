// SPDX-License-Identifier: MIT
//
// What decides where several answers would do: geometry and history, never the order in which
// things are listed. Reduced from random scenes whose turned, mirrored and renumbered copies
// differed.

#include "bodies.h"

// --- Two corners at one place

// Blocks of the same width on each other, listed upwards or downwards. Returns the block whose
// corners stand for both where the blocks `lower` and `upper`, counted upwards, meet.
static int owner_of(int n, const double *height, bool upwards, int lower) {
    nmm_vec2 corner[3][4];
    loop loops[3];
    double y = 0;
    for (int k = 0; k < n; k++) {
        const int block = upwards ? k : n - 1 - k;
        const nmm_vec2 box[4] = BOX(0, y, 2, y + height[k]);
        memcpy(corner[block], box, sizeof box);
        loops[block] = (loop){block, 4, corner[block]};
        y += height[k];
    }
    bodies b = {0};
    assert_int_equal(bodies_open(&b, n, loops, 1), NMM_OK);
    bodies_find(&b, 0.05);
    int owner = -1;
    for (int k = 0; k < b.state.n_contact; k++) {
        const int of_vertex = b.model.vertex_block[b.state.contact[k].vertex];
        const int of_edge = b.model.vertex_block[b.state.contact[k].edge];
        const int i = upwards ? of_vertex : n - 1 - of_vertex;
        const int j = upwards ? of_edge : n - 1 - of_edge;
        if (nmm_min_int(i, j) != lower || nmm_max_int(i, j) != lower + 1) continue;
        assert_true(owner == -1 || owner == i);
        owner = i;
    }
    bodies_close(&b);
    return owner;
}

// Of the block on the side of the middle of all.
static void test_owner_of_corners(void **unused) {
    (void)unused;
    const double two[][2] = {{1, 2}, {2, 1}, {1, 1.001}}, three[3] = {1, 1, 1};
    for (int upwards = 0; upwards < 2; upwards++) {
        for (int k = 0; k < 3; k++)
            assert_int_equal(owner_of(2, two[k], upwards, 0), two[k][0] < two[k][1] ? 1 : 0);
        assert_int_equal(owner_of(3, three, upwards, 0), 1);
        assert_int_equal(owner_of(3, three, upwards, 1), 1);
    }
}

// The corner at `seam` of block 0 moves by `way`, its far corner by a fifth of that the other way.
static void creep(bodies *b, double seam, double way) {
    const double middle = b->model.element_centre[0];
    for (int i = 0; i < 3; i++) {
        const double along = (b->model.cover_place[2 * i] - middle) / (seam - middle);
        b->state.displacement[2 * i] = way * (0.4 + 0.6 * along);
        b->state.displacement[2 * i + 1] = -4.9e-7;
    }
    nmm_state_place(&b->model, &b->state, 1);
}

// A block with a corner on the seam of the other one's top creeps over it: the little that it then
// shares with the next edge must not take the place of what the corner has carried so far, nor take
// what the far corner carries for it.
static void test_creep_over_seam(void **unused) {
    (void)unused;
    const nmm_vec2 seamed[5] = {{-2, -2}, {2, -2}, {2, 0}, {0, 0}, {-2, 0}};
    const nmm_vec2 right[4] = BOX(0, 0, 2, 1), left[4] = BOX(-2, 0, 0, 1);
    for (int k = 0; k < 2; k++) {
        const loop loops[2] = {{0, 4, k == 0 ? right : left}, {1, 5, seamed}};
        const double way = k == 0 ? -5e-7 : 5e-7;
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        for (int i = 0; i < 5; i++) {
            bodies_find(&b, 0.05);
            creep(&b, 0, way);
            bodies_evaluate(&b);
            bodies_commit(&b, NULL);
            // Springs of 4e9 N/m for each of the two corners.
            assert_close(bodies_force(&b, 0, 1).x, -4e9 * way * (1 - 0.2), 1e-5);
        }
        bodies_close(&b);
    }
}

// --- Borders of materials

// Two edges of a side have different materials: the springs of the vertex between them do not go by
// the one that is called by its number.
static void test_springs_on_border(void **unused) {
    (void)unused;
    const nmm_vec2 floor[4] = BOX(-1, -1, 3, 0), far[4] = BOX(10, 10, 11, 11);
    const nmm_vec2 seamed[5] = {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {0, 1}};
    const loop loops[3] = {{0, 4, floor}, {1, 5, seamed}, {2, 4, far}};
    double stiffness[2];
    for (int k = 0; k < 2; k++) {
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 3, loops, 1), NMM_OK);
        nmm_material soft = b.model.material[0];
        soft.youngs_modulus = 1e-3 * BODY_MODULUS;
        const nmm_material both[2] = {b.model.material[0], soft};
        nmm_material *const own = b.model.material;
        b.model.material = (nmm_material *)both;
        b.model.element_material[2] = 1;
        const int first = bodies_vertex(&b, 1);
        b.model.edge_element[first + k] = 2;
        bodies_find(&b, 0.05);
        const nmm_contact *contact = bodies_contact(&b, first + 1, 2);
        assert_non_null(contact);
        stiffness[k] = contact->normal_stiffness;
        b.model.material = own;
        bodies_close(&b);
    }
    assert_true(stiffness[0] > 0);
    assert_close(stiffness[0], stiffness[1], 1e-12);
}

// --- Not in front of each other

// Two blocks side by side, cut by the mesh near the joint between them: nothing on the top of one
// meets the top of the other, by whichever rounding one of them is the lower.
static void test_flush_tops(void **unused) {
    (void)unused;
    const nmm_vec2 left[6] = {{0, -1}, {1, -1}, {1, 0}, {0.98, 0}, {0.95, 0}, {0, 0}};
    const nmm_vec2 right[6] = {{1, -1}, {2, -1}, {2, 0}, {1.05, 0}, {1.02, 0}, {1, 0}};
    const loop loops[2] = {{0, 6, left}, {1, 6, right}};
    const double up[] = {0, 1e-8, -1e-8, 1e-5, -1e-5};
    for (int k = 0; k < 5; k++) {
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        bodies_put(&b, 1, 0, up[k], 0);
        bodies_find(&b, 0.2);
        for (int i = 0; i < b.state.n_contact; i++) {
            const nmm_contact_row row = nmm_contact_row_of(&b.model, &b.state, &b.state.contact[i]);
            assert_near(row.normal[0][1], 0, 1e-12);
        }
        bodies_close(&b);
    }
}

// --- One block

// The two sides of a wedge, cut by the mesh near its tip, look away from each other: the tip lies
// on the line of either, and meets neither, whatever the angle.
static void test_wedge(void **unused) {
    (void)unused;
    const double angle[] = {0.2, 0.03, 1e-2, 1e-3, 1e-5};
    for (int k = 0; k < 5; k++) {
        const double a = angle[k];
        const nmm_vec2 wedge[7] = {{0, 0}, {0.02, 0},        {0.04, 0},       {1, 0},
                                   {1, a}, {0.04, 0.04 * a}, {0.02, 0.02 * a}};
        const loop loops[1] = {{0, 7, wedge}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 1, loops, 0.1), NMM_OK);
        bodies_find(&b, 0.05);
        assert_int_equal(b.state.n_contact, 0);
        bodies_close(&b);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_owner_of_corners),
        cmocka_unit_test(test_creep_over_seam),
        cmocka_unit_test(test_springs_on_border),
        cmocka_unit_test(test_flush_tops),
        cmocka_unit_test(test_wedge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
