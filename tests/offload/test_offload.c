// SPDX-License-Identifier: MIT
//
// The target backend: absent in a host build, refused where no device runs, and where one runs the
// same bits as the host in solution and report.

#include "agreement.h"
#include "solver.h"
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

// --- Counting

enum { ROWS = 3, BLOCKS = 7 };

// Three rows in a chain.
typedef struct chain {
    int row_start[ROWS + 1], col[BLOCKS], diagonal[ROWS];
    double value[BLOCKS][4];
} chain;

static const chain links = {.row_start = {0, 2, 5, 7},
                            .col = {0, 1, 0, 1, 2, 1, 2},
                            .diagonal = {0, 3, 6},
                            .value = {{4, 1, 1, 3},
                                      {-1, 0, 0, -1},
                                      {-1, 0, 0, -1},
                                      {5, 1, 1, 6},
                                      {-1, 0, 0, -1},
                                      {-1, 0, 0, -1},
                                      {4, 0, 0, 3}}};

typedef struct counting {
    nmm_context context;
    nmm_solver *solver;
    chain system;
    nmm_solve_options options;
} counting;

static nmm_solve_report count_solve(counting *c, bool keep) {
    const nmm_bsr K = {ROWS, c->system.row_start, c->system.col, c->system.value[0],
                       c->system.diagonal};
    const double f[2 * ROWS] = {1, 2, -1, 3, 0.5, 1};
    double u[2 * ROWS] = {0};
    nmm_solve_report report;
    assert_int_equal(
        nmm_solve_target()->solve(&c->context, c->solver, &K, f, u, keep, &c->options, &report),
        NMM_OK);
    assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
    // Iterations of one batch: the scalars come back once for all of them.
    assert_in_range(report.iterations, 1, NMM_BATCH);
    assert_true(report.transfer_seconds > 0);
    return report;
}

static void open_counting(counting *c, nmm_solve_blocks blocks, nmm_solve_precision precision) {
    *c = (counting){.context = {.n_thread = 1}, .system = links};
    c->options = nmm_default_solve_options();
    c->options.method = NMM_SOLVE_PCG;
    c->options.blocks = blocks;
    c->options.precision = precision;
    assert_int_equal(nmm_solve_target()->open(&c->context, &c->solver, ROWS, BLOCKS), NMM_OK);
}

static void close_counting(counting *c) {
    nmm_solve_target()->close(&c->context, &c->solver);
    assert_int_equal(c->context.n_live, 0);
}

// A solve, and what it moves. Every one: load, guess and scalars there, the result back, and the
// scalars after the guess, the batch and the last residual.
static void expect(counting *c, bool keep, int n_row, int more, double more_bytes) {
    const nmm_solve_report report = count_solve(c, keep);
    const double vector = 16.0 * n_row, scalars = sizeof(nmm_iteration);
    assert_int_equal(report.transfers, 7 + more);
    assert_true(report.transfer_bytes == 3 * vector + 4 * scalars + more_bytes);
}

// Copies and bytes of solves with 2x2 blocks, counted by hand: what stays on the device, the
// pattern above all, is not sent again, and of the matrix goes what has changed.
static void test_counted(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    counting c;
    open_counting(&c, NMM_BLOCKS_COVER, NMM_PRECISION_DOUBLE);
    const double pattern = 4 * (ROWS + 1) + 4 * BLOCKS;
    const double matrix = 32 * BLOCKS, inverse = 32 * ROWS;
    expect(&c, false, ROWS, 4, pattern + matrix + inverse);
    expect(&c, true, ROWS, 0, 0);
    // The row in the middle has three blocks.
    c.system.value[3][0] = 7;
    expect(&c, true, ROWS, 2, 3 * 32 + 32);
    expect(&c, true, ROWS, 0, 0);
    expect(&c, false, ROWS, 4, pattern + matrix + inverse);
    close_counting(&c);
}

// The same with one cluster of 8 rows, of which 5 are empty.
static void test_counted_clusters(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    counting c;
    open_counting(&c, NMM_BLOCKS_CLUSTER, NMM_PRECISION_DOUBLE);
    const double pattern = 4 * (NMM_GROUP + 1) + 4 * BLOCKS;
    const double matrix = 32 * BLOCKS, inverse = 32 * NMM_GROUP, cluster = 4 * 16 * 16 + 8;
    expect(&c, false, NMM_GROUP, 6, pattern + matrix + inverse + cluster);
    c.options.reuse = true;
    expect(&c, true, NMM_GROUP, 0, 0);
    // Little enough to keep the cluster, then too much.
    c.system.value[3][0] *= 1.001;
    expect(&c, true, NMM_GROUP, 2, 3 * 32 + 32);
    c.system.value[3][0] *= 2;
    expect(&c, true, NMM_GROUP, 4, 3 * 32 + 32 + cluster);
    close_counting(&c);
}

// In mixed precision the matrix goes in float32 as well, and also what changed while it was not
// asked for.
static void test_counted_mixed(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    counting c;
    open_counting(&c, NMM_BLOCKS_COVER, NMM_PRECISION_MIXED);
    const double pattern = 4 * (ROWS + 1) + 4 * BLOCKS;
    const double first = count_solve(&c, false).transfer_bytes;
    const double again = count_solve(&c, true).transfer_bytes;
    assert_true(first - again == pattern + (32 + 16) * (BLOCKS + ROWS));
    c.options.precision = NMM_PRECISION_DOUBLE;
    c.system.value[3][0] *= 2;
    expect(&c, true, ROWS, 2, 3 * 32 + 32);
    c.options.precision = NMM_PRECISION_MIXED;
    const double changed = count_solve(&c, true).transfer_bytes;
    const double settled = count_solve(&c, true).transfer_bytes;
    assert_true(changed - settled == 3 * 16 + 16);
    close_counting(&c);
}

// --- Limits

// Blocks that only the host has: others, with a word.
static void test_bodies(void **state) {
    (void)state;
    if (nmm_solve_target_devices() == 0) skip();
    counting c;
    open_counting(&c, NMM_BLOCKS_BODY, NMM_PRECISION_DOUBLE);
    const double place[2 * ROWS] = {0, 0, 1, 0, 2, 1};
    const int body[ROWS] = {0, 0, 0};
    c.options.place = place;
    c.options.body = body;
    const nmm_solve_report report = count_solve(&c, false);
    assert_int_equal(report.blocks, NMM_BLOCKS_CLUSTER);
    assert_string_equal(report.why, "clusters: blocks body run on the host only");
    close_counting(&c);
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
        cmocka_unit_test(test_devices),       cmocka_unit_test(test_no_device),
        cmocka_unit_test(test_same_as_host),  cmocka_unit_test(test_serial_methods),
        cmocka_unit_test(test_no_memory),     cmocka_unit_test(test_host_bits),
        cmocka_unit_test(test_counted),       cmocka_unit_test(test_counted_clusters),
        cmocka_unit_test(test_counted_mixed), cmocka_unit_test(test_bodies),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
