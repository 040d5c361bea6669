// SPDX-License-Identifier: MIT
//
// Memory that CHOLMOD asks for and does not get, at its first request, its second, and so on: the
// solve ends with NMM_ERROR_MEMORY, nothing leaks, and the next solve is right. Its allocator is
// one per process, so that only a test like this one may replace it.

#include "systems.h"
#include "test.h"

#include <stdlib.h>

#include <SuiteSparse_config.h>

static long n_left; // requests still served; below zero: all

static bool refused(void) {
    return n_left >= 0 && n_left-- == 0;
}

static void *failing_malloc(size_t size) {
    return refused() ? NULL : malloc(size);
}

static void *failing_calloc(size_t count, size_t size) {
    return refused() ? NULL : calloc(count, size);
}

static void *failing_realloc(void *old, size_t size) {
    return refused() ? NULL : realloc(old, size);
}

static void test_cholmod_without_memory(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    const rock wall = {
        .n_across = 2, .n_up = 2, .n_node = 4, .courant = 1, .spring = 50, .seed = 2};
    test_system_rock(&context, &system, &wall);
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_DIRECT;
    const nmm_solve_backend *host = nmm_solve_host();
    double *u = NULL;
    assert_int_equal(nmm_allocate(&context, &u, (size_t)system.K.n_row, 2 * sizeof *u), NMM_OK);
    int failures = 0;
    nmm_status status = NMM_ERROR_MEMORY;
    for (long at = 0; status != NMM_OK; at++) {
        nmm_solver *solver = NULL;
        nmm_solve_report report;
        assert_int_equal(host->open(&context, &solver, system.K.n_row, system.n_block), NMM_OK);
        memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
        n_left = at;
        status = host->solve(&context, solver, &system.K, system.f, u, false, &options, &report);
        n_left = -1;
        if (status != NMM_OK) {
            failures++;
            assert_int_equal(status, NMM_ERROR_MEMORY);
            assert_non_null(strstr(context.error.message, "memory"));
            nmm_context_clear(&context);
            assert_int_equal(
                host->solve(&context, solver, &system.K, system.f, u, true, &options, &report),
                NMM_OK);
        }
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_true(test_true_residual(&system, u) <= options.tolerance);
        host->close(&context, &solver);
    }
    assert_true(failures > 20);
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

int main(void) {
    SuiteSparse_config.malloc_func = failing_malloc;
    SuiteSparse_config.calloc_func = failing_calloc;
    SuiteSparse_config.realloc_func = failing_realloc;
    n_left = -1;
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_cholmod_without_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
