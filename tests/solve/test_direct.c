// SPDX-License-Identifier: MIT
//
// The direct method: against elimination of the dense matrix, on scales 24 orders apart, on
// matrices that have no solution, with the factor of an older matrix, on several threads.

#include "systems.h"
#include "test.h"

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_solver *solver;
    nmm_solve_options options;
    nmm_solve_report report;
    double *u; // [n_row][2]
} fixture;

// To be called once x->system is there.
static void open_solver(fixture *x) {
    const int n = x->system.K.n_row;
    x->options = nmm_default_solve_options();
    x->options.method = NMM_SOLVE_DIRECT;
    x->options.tolerance = 1e-10;
    assert_int_equal(nmm_allocate(&x->context, &x->u, (size_t)n, 2 * sizeof *x->u), NMM_OK);
    assert_int_equal(nmm_solve_host()->open(&x->context, &x->solver, n, x->system.n_block), NMM_OK);
}

static void set_up_rock(fixture *x, int n_across, int n_up, double courant) {
    *x = (fixture){.context.n_thread = 1};
    test_system_wall(&x->context, &x->system, n_across, n_up, courant);
    open_solver(x);
}

static void tear_down(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    nmm_release(&x->context, &x->u);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static nmm_status try_solve(fixture *x) {
    return nmm_solve_host()->solve(&x->context, x->solver, &x->system.K, x->system.f, x->u, false,
                                   &x->options, &x->report);
}

static void solve_from_zero(fixture *x) {
    memset(x->u, 0, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
    assert_int_equal(try_solve(x), NMM_OK);
}

static void expect_converged(const fixture *x) {
    assert_int_equal(x->report.end, NMM_SOLVE_CONVERGED);
    assert_int_equal(x->report.method, NMM_SOLVE_DIRECT);
    assert_true(x->report.residual <= x->options.tolerance);
    assert_near(test_true_residual(&x->system, x->u), x->report.residual,
                0.1 * x->options.tolerance);
}

// A spring of this stiffness and direction between two rows that have a block in common.
static void add_spring(test_system *system, int row, int other, double stiffness) {
    nmm_bsr *K = &system->K;
    const double g[2] = {0.6, 0.8};
    const int end[2] = {row, other};
    for (int a = 0; a < 2; a++) {
        for (int k = K->row_start[end[a]]; k < K->row_start[end[a] + 1]; k++) {
            const double sign = K->col[k] == end[a] ? 1 : K->col[k] == end[1 - a] ? -1 : 0;
            for (int i = 0; i < 4; i++)
                K->value[4 * k + i] += sign * stiffness * g[i / 2] * g[i % 2];
        }
    }
}

// `n` springs, between seeded rows and one of their neighbours, as stiff as those of contacts.
static void change_contacts(test_system *system, int n, uint64_t seed) {
    nmm_random random = nmm_random_seed(seed);
    const nmm_bsr *K = &system->K;
    for (int k = 0; k < n; k++) {
        const int row = (int)(nmm_random_unit(&random) * K->n_row);
        const int last = K->col[K->row_start[row + 1] - 1], first = K->col[K->row_start[row]];
        const double stiffness = 10 * K->value[4 * K->diagonal[row]];
        add_spring(system, row, last == row ? first : last, stiffness);
    }
}

// --- Answers

static void test_against_elimination(void **state) {
    (void)state;
    for (int n = 1; n <= 60; n += n < 5 ? 1 : 11) {
        fixture x = {.context.n_thread = 1};
        test_system_random(&x.context, &x.system, n, 4, 30 + (uint64_t)n);
        open_solver(&x);
        solve_from_zero(&x);
        expect_converged(&x);
        assert_int_equal(x.report.setups, 1);
        assert_int_equal(x.report.iterations, 1);
        double *expected = NULL;
        assert_int_equal(nmm_allocate(&x.context, &expected, (size_t)n, 2 * sizeof *expected),
                         NMM_OK);
        test_dense_solve(&x.context, &x.system, expected);
        double largest = 0;
        for (int i = 0; i < 2 * n; i++)
            largest = nmm_max(largest, fabs(expected[i]));
        for (int i = 0; i < 2 * n; i++)
            assert_near(x.u[i], expected[i], 1e-11 * largest);
        nmm_release(&x.context, &expected);
        tear_down(&x);
    }
}

// Known in closed form: a chain of n springs of stiffness 1 held at one end, a unit load at the
// other: u_i = i + 1.
static void test_chain(void **state) {
    (void)state;
    enum { N = 500 };
    fixture x = {.context.n_thread = 1};
    test_system_chain(&x.context, &x.system, N, true);
    x.system.f[2 * N - 1] = 1;
    open_solver(&x);
    solve_from_zero(&x);
    expect_converged(&x);
    for (int row = 0; row < N; row++) {
        assert_near(x.u[2 * row], 0, 0);
        assert_near(x.u[2 * row + 1], row + 1, 1e-8);
    }
    tear_down(&x);
}

// Walls of blocks without mass: the iterative methods' hard case.
static void test_wall(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 4, 4, 0);
    solve_from_zero(&x);
    expect_converged(&x);
    assert_int_equal(x.report.setups, 1);
    assert_true(x.report.iterations <= 3);
    // The solution as first guess: nothing to do.
    assert_int_equal(try_solve(&x), NMM_OK);
    expect_converged(&x);
    assert_int_equal(x.report.setups, 0);
    assert_int_equal(x.report.iterations, 0);
    // A guess that is no number is replaced.
    x.u[7] = NAN;
    assert_int_equal(try_solve(&x), NMM_OK);
    expect_converged(&x);
    tear_down(&x);
}

static void test_scales(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 3, 3, 0.5);
    const int n = 2 * x.system.K.n_row;
    double *scale = NULL;
    assert_int_equal(nmm_allocate(&x.context, &scale, (size_t)n, sizeof *scale), NMM_OK);
    nmm_random random = nmm_random_seed(5);
    for (int i = 0; i < n; i++)
        scale[i] = pow(10, 24 * nmm_random_unit(&random) - 12);
    test_system_scale(&x.system, scale);
    x.options.tolerance = 1e-8;
    solve_from_zero(&x);
    expect_converged(&x);
    nmm_release(&x.context, &scale);
    tear_down(&x);
}

static void test_empty_and_unloaded(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    int row_start[1] = {0};
    x.system.K.row_start = row_start;
    open_solver(&x);
    assert_int_equal(try_solve(&x), NMM_OK);
    assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
    x.system.K.row_start = NULL;
    tear_down(&x);
    set_up_rock(&x, 1, 1, 0.5);
    memset(x.system.f, 0, 2 * (size_t)x.system.K.n_row * sizeof(double));
    x.u[3] = 5;
    assert_int_equal(try_solve(&x), NMM_OK);
    assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
    assert_int_equal(x.report.setups, 0);
    assert_near(x.u[3], 0, 0);
    tear_down(&x);
}

// --- Trouble

// Rows 0 .. N - 1 are joined to the row in the middle alone, which is therefore eliminated last:
// its pivot is 1 - (N - 1) * coupling^2.
static void test_row_of_pivot(void **state) {
    (void)state;
    enum { N = 9, MIDDLE = 4 };
    for (int k = 0; k < 2; k++) {
        const bool definite = k == 0;
        const double coupling = definite ? 0.3 : 0.4;
        fixture x = {.context.n_thread = 1};
        test_system_star(&x.context, &x.system, N, MIDDLE, coupling);
        // Across the negative direction: u = f would solve even the indefinite system.
        x.system.f[0] = 1;
        x.system.f[2] = -1;
        open_solver(&x);
        solve_from_zero(&x);
        if (definite) expect_converged(&x);
        if (!definite) {
            assert_int_equal(x.report.end, NMM_SOLVE_INDEFINITE);
            assert_int_equal(x.report.row, MIDDLE);
            assert_near(x.report.residual, 1, 1e-15);
            for (int i = 0; i < 2 * N; i++)
                assert_near(x.u[i], 0, 0);
        }
        tear_down(&x);
    }
}

// Blocks that nothing holds and that have no mass: no equilibrium, whatever sign rounding gives the
// last pivot, and a row of such a block is named. What is left of a guess that is no number is
// zero.
static void test_floating_block(void **state) {
    (void)state;
    for (int n_node = 2; n_node <= 9; n_node++) {
        fixture x = {.context.n_thread = 1};
        const rock wall = {.n_across = 1, .n_up = 2, .n_node = n_node, .seed = 1};
        test_system_rock(&x.context, &x.system, &wall);
        open_solver(&x);
        x.u[3] = NAN;
        assert_int_equal(try_solve(&x), NMM_OK);
        assert_int_equal(x.report.end, NMM_SOLVE_INDEFINITE);
        assert_in_range(x.report.row, n_node * n_node, 2 * n_node * n_node - 1);
        assert_true(x.report.residual <= 1 + 1e-12);
        for (int i = 0; i < 2 * x.system.K.n_row; i++)
            assert_true(isfinite(x.u[i]));
        tear_down(&x);
    }
}

// Chains of seeded springs that nothing holds, pulled: the last pivot is rounding of either sign.
static void test_floating_chain(void **state) {
    (void)state;
    enum { N = 12 };
    for (uint64_t seed = 0; seed < 40; seed++) {
        fixture x = {.context.n_thread = 1};
        triplets list = {0};
        nmm_random random = nmm_random_seed(seed);
        for (int row = 1; row < N; row++) {
            const double k = 0.1 + nmm_random_unit(&random);
            const double spring[4] = {k, 0, 0, k}, back[4] = {-k, 0, 0, -k};
            triplets_add(&x.context, &list, row, row, spring);
            triplets_add(&x.context, &list, row - 1, row - 1, spring);
            triplets_add(&x.context, &list, row, row - 1, back);
            triplets_add(&x.context, &list, row - 1, row, back);
        }
        test_system_build(&x.context, &x.system, &list, N);
        x.system.f[4] = 1;
        open_solver(&x);
        x.u[3] = NAN;
        assert_int_equal(try_solve(&x), NMM_OK);
        assert_int_equal(x.report.end, NMM_SOLVE_INDEFINITE);
        assert_in_range(x.report.row, 0, N - 1);
        // At a u of 10^16 no residual can be measured well; but no number is lost.
        assert_true(x.report.residual <= 1 + 1e-12);
        for (int i = 0; i < 2 * N; i++)
            assert_true(isfinite(x.u[i]));
        tear_down(&x);
    }
}

// What rounding does not allow is not called converged.
static void test_never_too_good(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 2, 2, 0.5);
    x.options.tolerance = 1e-300;
    solve_from_zero(&x);
    assert_int_equal(x.report.end, NMM_SOLVE_STAGNATED);
    assert_true(x.report.residual < 1e-13);
    assert_near(test_true_residual(&x.system, x.u), x.report.residual, 1e-14);
    x.options.max_iterations = 1;
    solve_from_zero(&x);
    assert_int_equal(x.report.end, NMM_SOLVE_TOO_SLOW);
    assert_int_equal(x.report.iterations, 1);
    // After trouble the solver is as good as new.
    x.options.max_iterations = 0;
    x.options.tolerance = 1e-10;
    solve_from_zero(&x);
    expect_converged(&x);
    tear_down(&x);
}

// --- Reuse

// Contacts change, the answer is that of a new factor to the tolerance; no change needs none.
static void test_changed_contacts(void **state) {
    (void)state;
    const int changed[] = {0, 1, 2, 4, 16, 64, 256};
    for (int k = 0; k < 7; k++) {
        fixture x, fresh;
        set_up_rock(&x, 8, 6, 1);
        set_up_rock(&fresh, 8, 6, 1);
        x.options.reuse = true;
        solve_from_zero(&x);
        assert_int_equal(x.report.setups, 1);
        change_contacts(&x.system, changed[k], 3);
        change_contacts(&fresh.system, changed[k], 3);
        solve_from_zero(&x);
        expect_converged(&x);
        if (changed[k] == 0) assert_int_equal(x.report.setups, 0);
        if (changed[k] >= 64) assert_int_equal(x.report.setups, 1);
        if (changed[k] == 0) assert_int_equal(x.report.iterations, 1);
        solve_from_zero(&fresh);
        assert_int_equal(fresh.report.setups, 1);
        double difference = 0, size = 0;
        for (int i = 0; i < 2 * x.system.K.n_row; i++) {
            difference = nmm_max(difference, fabs(x.u[i] - fresh.u[i]));
            size = nmm_max(size, fabs(fresh.u[i]));
        }
        // Tolerance times what the condition of this wall allows.
        assert_true(difference <= 1e-6 * size);
        // Without reuse nothing is left of the matrix before.
        change_contacts(&x.system, 1, 4);
        change_contacts(&fresh.system, 1, 4);
        x.options.reuse = false;
        nmm_solve_host()->close(&fresh.context, &fresh.solver);
        assert_int_equal(nmm_solve_host()->open(&fresh.context, &fresh.solver, fresh.system.K.n_row,
                                                fresh.system.n_block),
                         NMM_OK);
        solve_from_zero(&x);
        solve_from_zero(&fresh);
        assert_int_equal(x.report.setups, 1);
        assert_memory_equal(x.u, fresh.u, 2 * (size_t)x.system.K.n_row * sizeof *x.u);
        tear_down(&fresh);
        tear_down(&x);
    }
}

// Matrices that drift away from the factor: each solve is right, factors are made now and then.
static void test_drift(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 6, 5, 1);
    x.options.reuse = true;
    x.options.tolerance = 1e-8;
    const int n = 2 * x.system.K.n_row;
    double *scale = NULL;
    assert_int_equal(nmm_allocate(&x.context, &scale, (size_t)n, sizeof *scale), NMM_OK);
    nmm_random random = nmm_random_seed(9);
    int setups = 0, iterations = 0;
    enum { STEPS = 40 };
    for (int k = 0; k < STEPS; k++) {
        for (int i = 0; i < n; i++)
            scale[i] = 1 + 6.5e-4 * (nmm_random_unit(&random) - 0.5);
        test_system_scale(&x.system, scale);
        solve_from_zero(&x);
        expect_converged(&x);
        setups += x.report.setups;
        iterations += x.report.iterations;
    }
    assert_in_range(setups, 2, STEPS / 2);
    assert_in_range(iterations, STEPS, 4 * STEPS);
    nmm_release(&x.context, &scale);
    tear_down(&x);
}

// A matrix that is no longer positive definite is found out in spite of the old factor.
static void test_reuse_and_trouble(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 3, 2, 1);
    x.options.reuse = true;
    solve_from_zero(&x);
    expect_converged(&x);
    const int row = 40, other = x.system.K.col[x.system.K.row_start[row + 1] - 1];
    const double least = nmm_min(x.system.K.value[4 * x.system.K.diagonal[row]],
                                 x.system.K.value[4 * x.system.K.diagonal[other]]);
    add_spring(&x.system, row, other, -0.9 * least);
    solve_from_zero(&x);
    assert_int_equal(x.report.end, NMM_SOLVE_INDEFINITE);
    assert_in_range(x.report.row, 0, x.system.K.n_row - 1);
    // Sound again, and again.
    add_spring(&x.system, row, other, 0.9 * least);
    for (int k = 0; k < 2; k++) {
        solve_from_zero(&x);
        expect_converged(&x);
        assert_int_equal(x.report.setups, 1 - k);
    }
    tear_down(&x);
}

// Without reuse the bits of a solve do not depend on those before; nor does another pattern,
// another size or another method in between leave a trace.
static void test_no_trace(void **state) {
    (void)state;
    fixture x, first;
    set_up_rock(&x, 5, 4, 1);
    set_up_rock(&first, 5, 4, 1);
    solve_from_zero(&first);
    fixture small, loose = {.context.n_thread = 1};
    set_up_rock(&small, 2, 4, 1);
    test_system_random(&loose.context, &loose.system, x.system.K.n_row, 2, 8);
    open_solver(&loose);
    for (int k = 0; k < 8; k++) {
        nmm_solver *const own[2] = {small.solver, loose.solver};
        // The same solver object sees other systems, then the first one again.
        small.solver = loose.solver = x.solver;
        if (k % 4 == 1) solve_from_zero(&small);
        if (k % 4 == 2) solve_from_zero(&loose);
        if (k % 4 == 3) {
            x.options.method = NMM_SOLVE_PCG;
            solve_from_zero(&x);
            x.options.method = NMM_SOLVE_DIRECT;
        }
        small.solver = own[0];
        loose.solver = own[1];
        x.options.reuse = k >= 4;
        solve_from_zero(&x);
        expect_converged(&x);
        const size_t n = 2 * (size_t)x.system.K.n_row * sizeof *x.u;
        if (k < 4) assert_memory_equal(x.u, first.u, n);
    }
    tear_down(&loose);
    tear_down(&small);
    tear_down(&first);
    tear_down(&x);
}

// What a series of solves comes to, for any number of threads.
static void expect_same_series(void (*series)(fixture *, int n_thread)) {
    fixture one, many;
    series(&one, 1);
    for (int n_thread = 2; n_thread <= 3; n_thread++) {
        series(&many, n_thread);
        assert_int_equal(many.report.end, one.report.end);
        assert_int_equal(many.report.row, one.report.row);
        assert_int_equal(many.report.iterations, one.report.iterations);
        assert_int_equal(many.report.setups, one.report.setups);
        assert_memory_equal(many.u, one.u, 2 * (size_t)one.system.K.n_row * sizeof *one.u);
        tear_down(&many);
    }
    tear_down(&one);
}

// The same in all bits; a solve that several threads are worth uses them.
static void solve_changes(fixture *x, int n_thread) {
    set_up_rock(x, 12, 10, 1);
    assert_true(x->system.K.n_row > 2500);
    x->options.reuse = true;
    x->options.n_thread = n_thread;
    solve_from_zero(x);
    assert_int_equal(x->report.n_thread, n_thread);
    change_contacts(&x->system, 5, 1);
    solve_from_zero(x);
    expect_converged(x);
}

// Several rows with a pivot that is not positive: the first one in order of elimination is named.
static void solve_indefinite(fixture *x, int n_thread) {
    set_up_rock(x, 10, 8, 1);
    x->options.n_thread = n_thread;
    for (int row = 100; row < x->system.K.n_row; row += 300)
        add_spring(&x->system, row, x->system.K.col[x->system.K.row_start[row + 1] - 1],
                   -0.9 * x->system.K.value[4 * x->system.K.diagonal[row]]);
    solve_from_zero(x);
    assert_int_equal(x->report.end, NMM_SOLVE_INDEFINITE);
}

// Blocks that nothing holds: the row with the smallest pivot is named.
static void solve_singular(fixture *x, int n_thread) {
    *x = (fixture){.context.n_thread = 1};
    const rock wall = {.n_across = 30, .n_up = 3, .n_node = 5, .seed = 1};
    test_system_rock(&x->context, &x->system, &wall);
    open_solver(x);
    x->options.n_thread = n_thread;
    solve_from_zero(x);
    assert_int_equal(x->report.end, NMM_SOLVE_INDEFINITE);
}

static void test_threads(void **state) {
    (void)state;
    expect_same_series(solve_changes);
    expect_same_series(solve_indefinite);
    expect_same_series(solve_singular);
}

// --- Memory

static void fail_each_allocation(int n_across, int n_thread, int least_failures) {
    int failures = 0;
    for (long at = 0;; at++) {
        fixture x;
        set_up_rock(&x, n_across, n_across, 1);
        x.options.n_thread = n_thread;
        nmm_context own = x.context;
        test_failing hook = {.fail_at = at};
        x.context.allocate = test_failing_hook;
        x.context.user = &hook;
        const nmm_status status = try_solve(&x);
        x.context.allocate = own.allocate;
        if (status != NMM_OK) {
            failures++;
            assert_int_equal(status, NMM_ERROR_MEMORY);
            nmm_context_clear(&x.context);
            // The next attempt finds everything in order.
            assert_int_equal(try_solve(&x), NMM_OK);
        }
        expect_converged(&x);
        tear_down(&x);
        if (status == NMM_OK) break;
    }
    assert_true(failures >= least_failures);
}

static void test_no_memory(void **state) {
    (void)state;
    fail_each_allocation(2, 1, 12);
    fail_each_allocation(8, 2, 12);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_elimination),
        cmocka_unit_test(test_chain),
        cmocka_unit_test(test_wall),
        cmocka_unit_test(test_scales),
        cmocka_unit_test(test_empty_and_unloaded),
        cmocka_unit_test(test_row_of_pivot),
        cmocka_unit_test(test_floating_block),
        cmocka_unit_test(test_floating_chain),
        cmocka_unit_test(test_never_too_good),
        cmocka_unit_test(test_changed_contacts),
        cmocka_unit_test(test_drift),
        cmocka_unit_test(test_reuse_and_trouble),
        cmocka_unit_test(test_no_trace),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
