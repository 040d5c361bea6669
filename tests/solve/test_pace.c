// SPDX-License-Identifier: MIT
//
// One thread or several, by times that are made up: a few disturbed solves do not decide for long,
// busy cores do.

#include "pace.h"
#include "test.h"

enum { ITERATIONS = 30 };

// Solves out of n that were shared, of so many seconds each way.
static int run(nmm_pace *pace, int n, double serial, double shared) {
    int n_shared = 0;
    for (int k = 0; k < n; k++) {
        const bool shares = nmm_pace_shares(pace);
        nmm_pace_note(pace, shares, ITERATIONS, shares ? shared : serial);
        n_shared += shares;
    }
    return n_shared;
}

static void test_faster_way(void **state) {
    (void)state;
    nmm_pace two = {0}, one = {0};
    assert_true(run(&two, 1000, 1.8, 1) > 970);
    assert_true(run(&one, 1000, 1, 1.8) < 30);
}

// Whatever else runs while threads are tried first, or for two solves later.
static void test_disturbed(void **state) {
    (void)state;
    nmm_pace pace = {0};
    run(&pace, 2, 1.8, 5);
    assert_true(run(&pace, 60, 1.8, 1) > 45);
    run(&pace, 2, 9, 5);
    assert_true(run(&pace, 60, 1.8, 1) > 50);
}

static void test_busy_cores(void **state) {
    (void)state;
    nmm_pace pace = {0};
    run(&pace, 100, 1.8, 1);
    assert_true(run(&pace, 500, 1.8, 10) < 15);
    assert_true(run(&pace, 1000, 1.8, 1) > 450);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_faster_way),
        cmocka_unit_test(test_disturbed),
        cmocka_unit_test(test_busy_cores),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
