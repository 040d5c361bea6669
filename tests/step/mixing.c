// SPDX-License-Identifier: MIT
//
// Anderson mixing: on a linear map of few dimensions it ends in as many passes, where the plain
// passes gain little; dependent differences do no harm; nothing leaks.

#include "test.h"

#include "mixing.h"

// change = A x + b, a map whose plain passes x += change gain a factor 0.8 and turn.
static void find_change(int n, const double *x, double *change) {
    for (int i = 0; i < n; i++)
        change[i] = 1 - 0.2 * (1 + 0.1 * i) * x[i] + 0.3 * x[(i + 1) % n] / (i + 1);
}

static double length(int n, const double *x) {
    double sum = 0;
    for (int i = 0; i < n; i++)
        sum += x[i] * x[i];
    return sqrt(sum);
}

// Length of the change after `n_pass` passes.
static double left_after(int n, int n_pass, bool mix) {
    nmm_context context = {.n_thread = 1};
    nmm_mixing mixing = {0};
    double x[8] = {0}, change[8];
    assert_int_equal(nmm_mixing_open(&context, &mixing, n), NMM_OK);
    for (int k = 0; k < n_pass; k++) {
        find_change(n, x, change);
        const bool mixed = nmm_mixing_take(&mixing, x, change, mix, 1);
        assert_int_equal(mixed, mix && k > 0);
        for (int i = 0; i < n; i++)
            x[i] += change[i];
    }
    find_change(n, x, change);
    nmm_mixing_close(&context, &mixing);
    assert_int_equal(context.n_live, 0);
    return length(n, change);
}

static void test_linear_map(void **state) {
    (void)state;
    for (int n = 1; n <= NMM_MIXING_DEPTH; n++) {
        assert_true(left_after(n, n + 2, true) < 1e-9);
        assert_true(left_after(n, n + 2, false) > 1e-2);
    }
    // More dimensions than differences: still far better than plain.
    assert_true(left_after(8, 12, true) < 1e-2 * left_after(8, 12, false));
}

// The same pass twice: its difference is nothing, and so is its part.
static void test_dependent(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    nmm_mixing mixing = {0};
    const double x[2] = {1, 2};
    assert_int_equal(nmm_mixing_open(&context, &mixing, 2), NMM_OK);
    for (int k = 0; k < 4; k++) {
        double change[2] = {3, 4};
        nmm_mixing_take(&mixing, x, change, true, 1);
        assert_near(change[0], 3.0, 0.0);
        assert_near(change[1], 4.0, 0.0);
    }
    nmm_mixing_close(&context, &mixing);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linear_map),
        cmocka_unit_test(test_dependent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
