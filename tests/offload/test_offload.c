// SPDX-License-Identifier: MIT
//
// The target backend: absent in a host build, refused where no device runs, and where one runs the
// same bits as the host in solution and report.

#include "agreement.h"
#include "test.h"

#include <stdlib.h>

static void test_devices(void **state) {
    (void)state;
    const int n = nmm_solve_target_devices();
    if (nmm_solve_target() == NULL) {
        assert_int_equal(n, 0);
        return;
    }
    assert_true(n >= 0);
    assert_string_equal(nmm_solve_target()->name, "target");
    // A build for the fake device says that there must be one.
    if (getenv("NMM_EXPECT_DEVICE") != NULL) assert_true(n > 0);
}

static void test_no_device(void **state) {
    (void)state;
    if (nmm_solve_target() == NULL || nmm_solve_target_devices() > 0) skip();
    nmm_context context = {.n_thread = 1};
    nmm_solver *solver = NULL;
    assert_int_equal(nmm_solve_target()->open(&context, &solver, 10, 50), NMM_ERROR_DEVICE);
    assert_null(solver);
    assert_int_equal(context.n_live, 0);
}

static void test_same_as_host(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    nmm_context context = {.n_thread = 1};
    // One after the other, so that a solver is opened at other addresses or the same.
    for (int launches = 0; launches < 2; launches++) {
        const agreement how = {.launches = launches == 1, .loud = true};
        printf("--- %s\n", how.launches ? "one launch for each kernel" : "one team");
        assert_int_equal(test_agreement(&context, &how), 0);
        assert_int_equal(context.n_live, 0);
    }
    printf("%d solves, each by both ways\n", test_agreement_cases());
}

// The same line in every build, with a target or without: tests/offload/preset.cmake compares them.
static void test_host_bits(void **state) {
    (void)state;
    printf("solutions on the host: %016llx\n", (unsigned long long)test_host_hash());
}

static void test_serial_methods(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    nmm_context context = {.n_thread = 1};
    nmm_solver *solver = NULL;
    int row_start[] = {0, 1}, col[] = {0}, diagonal[] = {0};
    double value[] = {4, 1, 1, 3}, f[] = {1, 2}, u[] = {0, 0};
    const nmm_bsr K = {1, row_start, col, value, diagonal};
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_SOR;
    nmm_solve_report report;
    assert_int_equal(nmm_solve_target()->open(&context, &solver, 1, 1), NMM_OK);
    assert_int_equal(
        nmm_solve_target()->solve(&context, solver, &K, f, u, false, &options, &report),
        NMM_ERROR_ARGUMENT);
    nmm_solve_target()->close(&context, &solver);
    assert_int_equal(context.n_live, 0);
}

static void test_no_memory(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    for (long at = 0;; at++) {
        test_failing hook = {.fail_at = at};
        nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
        nmm_solver *solver = NULL;
        const nmm_status status = nmm_solve_target()->open(&context, &solver, 50, 500);
        if (status == NMM_OK) {
            assert_true(at >= 12);
            nmm_solve_target()->close(&context, &solver);
            assert_int_equal(context.n_live, 0);
            break;
        }
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_null(solver);
        assert_int_equal(context.n_live, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_devices),      cmocka_unit_test(test_no_device),
        cmocka_unit_test(test_same_as_host), cmocka_unit_test(test_serial_methods),
        cmocka_unit_test(test_no_memory),    cmocka_unit_test(test_host_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
