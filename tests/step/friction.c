// SPDX-License-Identifier: MIT
//
// How closely friction is followed: whichever way takes the least work is found, whatever the work
// grows or shrinks by beside, and found again when another one takes less; trials in vain cost
// little; steps without friction change nothing.

#include "test.h"

#include "friction.h"

// Work of a step that goes each way, next to which the ways differ.
typedef struct costs {
    double way[NMM_FRICTION_WAYS];
} costs;

// One step of so much work; the way it went.
static nmm_friction_way go_step(nmm_friction *friction, const costs *cost, double scale,
                                int n_row) {
    nmm_friction_begin(friction, n_row);
    const nmm_friction_way way = friction->way;
    nmm_friction_pass(friction, 0, scale * cost->way[way], true);
    nmm_friction_end(friction);
    return way;
}

// Steps of 100 that go the way `best`, after 100 steps to find it. From one step to the next the
// work of all ways grows by a factor.
static int count_best(nmm_friction *friction, const costs *cost, double growth, int best) {
    double scale = 1;
    int n = 0;
    for (int step = 0; step < 200; step++, scale *= growth) {
        const bool is_best = (int)go_step(friction, cost, scale, 100) == best;
        n += step >= 100 && is_best;
    }
    return n;
}

static void test_finds_cheapest(void **state) {
    (void)state;
    static const double growth[] = {1, 1.02, 0.98};
    for (int best = 0; best < NMM_FRICTION_WAYS; best++) {
        for (int k = 0; k < 3; k++) {
            nmm_friction friction = {0};
            costs cost = {{1, 1, 1}};
            cost.way[best] = 0.75;
            assert_true(count_best(&friction, &cost, growth[k], best) >= 85);
            assert_int_equal(friction.usual, best);
            // The scene changes.
            const int other = (best + 1) % NMM_FRICTION_WAYS;
            cost.way[other] = 0.4;
            for (int step = 0; step < 400; step++)
                go_step(&friction, &cost, 1, 100);
            assert_int_equal(friction.usual, other);
        }
    }
}

// One step of a hundred times the work does not decide.
static void test_one_hard_step(void **state) {
    (void)state;
    for (int hard = 0; hard < 12; hard++) {
        nmm_friction friction = {0};
        const costs cost = {{1, 1.2, 2}};
        for (int step = 0; step < 200; step++)
            go_step(&friction, &cost, step == hard ? 100 : 1, 100);
        assert_int_equal(friction.usual, NMM_FRICTION_LOOSE);
    }
}

static void test_trials_are_cheap(void **state) {
    (void)state;
    nmm_friction friction = {0};
    const costs cost = {{1, 2, 3}};
    double work = 0;
    for (int step = 0; step < 1000; step++)
        work += cost.way[go_step(&friction, &cost, 1, 100)];
    assert_true(work > 1000 && work < 1030);
}

static void test_without_friction(void **state) {
    (void)state;
    nmm_friction friction = {0};
    for (int step = 0; step < 500; step++) {
        nmm_friction_begin(&friction, 100);
        assert_int_equal(friction.way, NMM_FRICTION_LOOSE);
        nmm_friction_pass(&friction, 100, 1, false);
        nmm_friction_end(&friction);
    }
}

// Where there are many rows it begins closely.
static void test_begins_by_size(void **state) {
    (void)state;
    nmm_friction friction = {0};
    nmm_friction_begin(&friction, 1000000);
    assert_int_equal(friction.way, NMM_FRICTION_CLOSE);
    nmm_friction_pass(&friction, 1000000, 5, true);
    assert_true(friction.work > 1000000);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_finds_cheapest),   cmocka_unit_test(test_one_hard_step),
        cmocka_unit_test(test_trials_are_cheap), cmocka_unit_test(test_without_friction),
        cmocka_unit_test(test_begins_by_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
