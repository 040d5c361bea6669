// SPDX-License-Identifier: MIT
//
// Marks of what a device does not know yet: ranges and their gaps, and which rows a solver that
// keeps a copy of the matrix marks when values change, in the caller's order and in clusters.

#include "solver.h"
#include "systems.h"
#include "test.h"

#include <string.h>

#define N 12

static void test_ranges(void **state) {
    (void)state;
    const unsigned char given[N] = {0, 1, 3, 0, 0, 2, 1, 0, 0, 0, 1, 2};
    unsigned char mark[N];
    memcpy(mark, given, sizeof mark);
    nmm_range range = {0};
    assert_true(nmm_newer_next(mark, N, NMM_NEWER_WIDE, 2, &range));
    assert_int_equal(range.begin, 1);
    assert_int_equal(range.end, 3);
    assert_true(nmm_newer_next(mark, N, NMM_NEWER_WIDE, 3, &range));
    assert_int_equal(range.begin, 6);
    assert_int_equal(range.end, 11);
    assert_false(nmm_newer_next(mark, N, NMM_NEWER_WIDE, 3, &range));
    // The other marks are still there.
    range = (nmm_range){0};
    assert_true(nmm_newer_next(mark, N, NMM_NEWER_NARROW, 0, &range));
    assert_int_equal(range.begin, 2);
    assert_int_equal(range.end, 3);
    assert_true(nmm_newer_next(mark, N, NMM_NEWER_NARROW, 100, &range));
    assert_int_equal(range.begin, 5);
    assert_int_equal(range.end, N);
    for (int i = 0; i < N; i++)
        assert_int_equal(mark[i], 0);
    range = (nmm_range){0};
    assert_false(nmm_newer_next(mark, N, NMM_NEWER_WIDE, 0, &range));
    assert_false(nmm_newer_next(NULL, N, NMM_NEWER_WIDE, 0, &range));
}

// A solver as a target has it, and what it is asked to take over.
typedef struct subject {
    nmm_context context;
    nmm_solver *solver;
    test_system system;
    nmm_solve_options options;
} subject;

static void take(subject *x, bool keep) {
    double *u = NULL;
    nmm_solve_report report;
    bool ready = false;
    const size_t n = (size_t)x->system.K.n_row;
    assert_int_equal(nmm_allocate(&x->context, &u, n, 2 * sizeof(double)), NMM_OK);
    assert_int_equal(nmm_solver_prepare(&x->context, x->solver, &x->system.K, keep, &x->options),
                     NMM_OK);
    assert_int_equal(
        nmm_solver_start(&x->context, x->solver, &x->system.K, x->system.f, u, &report, &ready),
        NMM_OK);
    assert_true(ready);
    nmm_release(&x->context, &u);
}

// Rows marked, which are unmarked now; the last one of them is `*row`, in the caller's order.
static int count_marks(subject *x, int bit, int *row) {
    int n = 0;
    for (int at = 0; at < x->solver->n; at++) {
        if ((x->solver->newer_row[at] & bit) == 0) continue;
        x->solver->newer_row[at] &= (unsigned char)~bit;
        *row = nmm_solver_row(x->solver, at);
        n++;
    }
    return n;
}

static void change(subject *x, int row, double factor) {
    double *block = x->system.K.value + 4 * (long)x->system.K.diagonal[row];
    block[0] *= factor;
    block[3] *= factor;
}

static void test_rows(void **state) {
    (void)state;
    for (int n_thread = 1; n_thread <= 3; n_thread++) {
        for (nmm_solve_blocks blocks = NMM_BLOCKS_COVER; blocks <= NMM_BLOCKS_CLUSTER; blocks++) {
            subject x = {.context = {.n_thread = n_thread}};
            test_system_wall(&x.context, &x.system, 4, 3, 3);
            x.options = nmm_default_solve_options();
            x.options.method = NMM_SOLVE_PCG;
            x.options.blocks = blocks;
            const int n = x.system.K.n_row;
            assert_int_equal(nmm_solver_create(&x.context, &x.solver, n, x.system.n_block, true),
                             NMM_OK);
            int row = -1;
            take(&x, false);
            assert_int_equal(count_marks(&x, NMM_NEWER_WIDE, &row), x.solver->n);
            take(&x, true);
            assert_int_equal(count_marks(&x, NMM_NEWER_WIDE, &row), 0);
            change(&x, n / 2, 1.5);
            take(&x, true);
            assert_int_equal(count_marks(&x, NMM_NEWER_WIDE, &row), 1);
            assert_int_equal(row, n / 2);
            // Another pattern has other places.
            take(&x, false);
            assert_int_equal(count_marks(&x, NMM_NEWER_WIDE, &row), x.solver->n);
            // What was never sent in float32 still waits.
            assert_int_equal(count_marks(&x, NMM_NEWER_NARROW, &row), x.solver->n);
            nmm_solver_destroy(&x.context, &x.solver);
            test_system_destroy(&x.context, &x.system);
            assert_int_equal(x.context.n_live, 0);
        }
    }
}

// Clusters inverted anew are marked, those kept are not.
static void test_clusters(void **state) {
    (void)state;
    subject x = {.context = {.n_thread = 1}};
    test_system_wall(&x.context, &x.system, 4, 3, 3);
    x.options = nmm_default_solve_options();
    x.options.method = NMM_SOLVE_PCG;
    x.options.blocks = NMM_BLOCKS_CLUSTER;
    const int n = x.system.K.n_row;
    assert_int_equal(nmm_solver_create(&x.context, &x.solver, n, x.system.n_block, true), NMM_OK);
    take(&x, false);
    unsigned char *mark = x.solver->clusters.newer;
    const int n_group = x.solver->clusters.n_group;
    nmm_range range = {0};
    assert_true(nmm_newer_next(mark, n_group, NMM_NEWER_WIDE, 0, &range));
    assert_int_equal(range.end - range.begin, n_group);
    x.options.reuse = true;
    change(&x, 7, 1.5);
    take(&x, true);
    range = (nmm_range){0};
    assert_true(nmm_newer_next(mark, n_group, NMM_NEWER_WIDE, 0, &range));
    assert_int_equal(range.begin, x.solver->clusters.place[7] / NMM_GROUP);
    assert_int_equal(range.end, range.begin + 1);
    assert_false(nmm_newer_next(mark, n_group, NMM_NEWER_WIDE, 0, &range));
    nmm_solver_destroy(&x.context, &x.solver);
    test_system_destroy(&x.context, &x.system);
    assert_int_equal(x.context.n_live, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ranges),
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_clusters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
