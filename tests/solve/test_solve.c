// SPDX-License-Identifier: MIT
//
// The methods against dense elimination, and what a solve promises: the residual it reports is the
// true one, both stopping tests, first guesses, limits, trivial systems.

#include "systems.h"
#include "test.h"

#include <stdlib.h>

static const nmm_solve_method all_methods[] = {NMM_SOLVE_AUTO, NMM_SOLVE_JACOBI, NMM_SOLVE_PCG,
                                               NMM_SOLVE_SOR, NMM_SOLVE_GAUSS_SEIDEL};
#define N_METHOD 5

static double *vector_of(nmm_context *context, int n_row) {
    double *u = NULL;
    assert_int_equal(nmm_allocate(context, &u, (size_t)n_row, 2 * sizeof *u), NMM_OK);
    return u;
}

static nmm_solve_report solve(nmm_context *context, const test_system *system,
                              const nmm_solve_options *options, double *u) {
    const nmm_solve_backend *host = nmm_solve_host();
    nmm_solver *solver = NULL;
    nmm_solve_report report;
    assert_int_equal(host->open(context, &solver, system->K.n_row, system->n_block), NMM_OK);
    assert_int_equal(
        host->solve(context, solver, &system->K, system->f, u, false, options, &report), NMM_OK);
    host->close(context, &solver);
    assert_null(solver);
    return report;
}

static double difference(int n, const double *a, const double *b) {
    double sum = 0, size = 0;
    for (int i = 0; i < n; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
        size += b[i] * b[i];
    }
    return sqrt(sum / size);
}

// --- Right answers

static void check_all_methods(nmm_context *context, const test_system *system, double tolerance) {
    const int n = 2 * system->K.n_row;
    double *exact = vector_of(context, system->K.n_row), *u = vector_of(context, system->K.n_row);
    test_dense_solve(context, system, exact);
    for (int k = 0; k < N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = all_methods[k];
        options.tolerance = 1e-12;
        memset(u, 0, (size_t)n * sizeof *u);
        const nmm_solve_report report = solve(context, system, &options, u);
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_true(report.iterations > 0);
        assert_int_equal(report.row, -1);
        assert_false(report.on_device);
        assert_false(report.by_average_change);
        assert_near(report.residual, test_true_residual(system, u), 1e-13);
        assert_near(difference(n, u, exact), 0, tolerance);
        if (options.method != NMM_SOLVE_AUTO) {
            assert_int_equal(report.method, options.method);
        } else {
            assert_true(report.method == NMM_SOLVE_PCG || report.method == NMM_SOLVE_DIRECT);
            assert_true(report.why[0] != '\0');
        }
    }
    nmm_release(context, &exact);
    nmm_release(context, &u);
}

static void test_against_elimination(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 2};
    const rock wall[] = {
        {.n_across = 1, .n_up = 1, .n_node = 5, .courant = 0},
        {.n_across = 2, .n_up = 2, .n_node = 3, .courant = 1, .spring = 50, .seed = 1},
        {.n_across = 3,
         .n_up = 1,
         .n_node = 4,
         .courant = 3,
         .lumped = true,
         .spring = 50,
         .seed = 2},
    };
    for (size_t k = 0; k < sizeof wall / sizeof *wall; k++) {
        test_system system = {0};
        test_system_rock(&context, &system, &wall[k]);
        check_all_methods(&context, &system, 1e-8);
        test_system_destroy(&context, &system);
    }
    for (uint64_t seed = 1; seed <= 20; seed++) {
        test_system system = {0};
        test_system_random(&context, &system, 1 + (int)(3 * seed), 4, seed);
        check_all_methods(&context, &system, 1e-9);
        test_system_destroy(&context, &system);
    }
    assert_int_equal(context.n_live, 0);
}

// One row: [4 1; 1 3] u = [1; 2] has u = [1/11; 7/11].
static void test_one_row(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    int row_start[] = {0, 1}, col[] = {0}, diagonal[] = {0};
    double value[] = {4, 1, 1, 3}, f[] = {1, 2};
    const test_system system = {{1, row_start, col, value, diagonal}, f, 1};
    for (int k = 0; k < N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = all_methods[k];
        options.tolerance = 1e-14;
        double u[2] = {0};
        const nmm_solve_report report = solve(&context, &system, &options, u);
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_near(u[0], 1.0 / 11, 1e-14);
        assert_near(u[1], 7.0 / 11, 1e-14);
        if (options.method == NMM_SOLVE_JACOBI) assert_near(report.lambda_max, 1, 1e-5);
    }
}

// Scaling of rows over 24 decades changes nothing but the rounding; nor do units of f and K.
static void test_badly_scaled(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    nmm_random random = nmm_random_seed(5);
    const double load[] = {1, 1e-300, 1e250};
    const double unit[] = {1, 1e-75, 1e100};
    for (int k = 0; k < 3; k++) {
        test_system system = {0};
        test_system_random(&context, &system, 40, 3, 11);
        const int n = 2 * system.K.n_row;
        double *exact = vector_of(&context, 40), *u = vector_of(&context, 40);
        double *scale = vector_of(&context, 40);
        test_dense_solve(&context, &system, exact);
        for (int row = 0; row < 40; row++) {
            // By powers of two, so that the scaled system is the same but for its scale.
            const double s = ldexp(1, (int)(40 * (nmm_random_unit(&random) - 0.5)));
            scale[2 * row] = scale[2 * row + 1] = s;
        }
        test_system_scale(&system, scale);
        for (int i = 0; i < 4 * system.n_block; i++)
            system.K.value[i] *= unit[k];
        for (int i = 0; i < n; i++)
            system.f[i] *= load[k];
        nmm_solve_options options = nmm_default_solve_options();
        options.tolerance = 1e-15;
        const nmm_solve_report report = solve(&context, &system, &options, u);
        assert_true(report.end == NMM_SOLVE_CONVERGED || report.end == NMM_SOLVE_STAGNATED);
        assert_true(report.residual < 1e-14);
        for (int i = 0; i < n; i++)
            u[i] *= scale[i] * unit[k] / load[k];
        assert_near(difference(n, u, exact), 0, 1e-5);
        nmm_release(&context, &exact);
        nmm_release(&context, &u);
        nmm_release(&context, &scale);
        test_system_destroy(&context, &system);
    }
}

// --- Stopping

static void make_wall(nmm_context *context, test_system *system, double courant, bool lumped) {
    const rock wall = {.n_across = 3,
                       .n_up = 2,
                       .n_node = 6,
                       .courant = courant,
                       .lumped = lumped,
                       .spring = 50,
                       .seed = 9};
    test_system_rock(context, system, &wall);
}

static void test_tolerance_is_kept(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 3, false);
    double *u = vector_of(&context, system.K.n_row);
    for (int k = 0; k < N_METHOD; k++) {
        int before = 0;
        for (double tolerance = 1e-2; tolerance > 1e-11; tolerance *= 1e-3) {
            nmm_solve_options options = nmm_default_solve_options();
            options.method = all_methods[k];
            options.tolerance = tolerance;
            memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
            const nmm_solve_report report = solve(&context, &system, &options, u);
            assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
            assert_true(test_true_residual(&system, u) <= tolerance * (1 + 1e-6) + 1e-14);
            assert_near(report.residual, test_true_residual(&system, u), 1e-14 + 1e-6 * tolerance);
            assert_true(report.iterations >= before);
            before = report.iterations;
        }
    }
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

// The absolute limit in newtons replaces the relative one where it is larger.
static void test_absolute_limit(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 3, false);
    double *u = vector_of(&context, system.K.n_row);
    double load = 0;
    for (int i = 0; i < 2 * system.K.n_row; i++)
        load += system.f[i] * system.f[i];
    load = sqrt(load);
    nmm_solve_options options = nmm_default_solve_options();
    options.method = NMM_SOLVE_PCG;
    options.tolerance = 1e-12;
    options.absolute = 1e-3 * load;
    nmm_solve_report report = solve(&context, &system, &options, u);
    assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
    assert_true(report.residual <= 1e-3 && report.residual > 1e-6);
    // Loads below it need no iteration.
    memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
    options.absolute = 1.01 * load;
    report = solve(&context, &system, &options, u);
    assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
    assert_int_equal(report.iterations, 0);
    assert_near(report.residual, 1, 1e-12);
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

// The paper's test ends early, says so, and reports how far from balance that is.
static void test_average_change(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 10, false);
    double *u = vector_of(&context, system.K.n_row);
    const nmm_solve_method sweeping[] = {NMM_SOLVE_JACOBI, NMM_SOLVE_SOR, NMM_SOLVE_GAUSS_SEIDEL};
    for (int k = 0; k < 3; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = sweeping[k];
        options.tolerance = 1e-6;
        options.stop_average_change = true;
        memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
        const nmm_solve_report report = solve(&context, &system, &options, u);
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_true(report.by_average_change);
        assert_close(report.residual, test_true_residual(&system, u), 1e-6);
        assert_true(report.residual > 1e-6);
    }
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

static void test_too_slow(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 3, false);
    double *u = vector_of(&context, system.K.n_row);
    for (int k = 0; k < N_METHOD; k++) {
        for (int most = 1; most < 20; most += 6) {
            nmm_solve_options options = nmm_default_solve_options();
            options.method = all_methods[k];
            options.max_iterations = most;
            memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
            const nmm_solve_report report = solve(&context, &system, &options, u);
            assert_int_equal(report.end, NMM_SOLVE_TOO_SLOW);
            assert_int_equal(report.iterations, most);
            assert_close(report.residual, test_true_residual(&system, u), 1e-9);
            assert_true(report.residual <= 1 + 1e-12);
        }
    }
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

// A tolerance beyond what rounding allows is not called reached.
static void test_stagnation(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 1000, false);
    double *u = vector_of(&context, system.K.n_row);
    nmm_solve_options options = nmm_default_solve_options();
    options.tolerance = 1e-20;
    const nmm_solve_report report = solve(&context, &system, &options, u);
    assert_int_equal(report.end, NMM_SOLVE_STAGNATED);
    assert_true(report.residual < 1e-7 && report.residual > 1e-20);
    assert_near(report.residual, test_true_residual(&system, u), 0.5 * report.residual);
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

// --- First guesses

static void test_first_guess(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 3, false);
    const int n = 2 * system.K.n_row;
    double *u = vector_of(&context, system.K.n_row), *good = vector_of(&context, system.K.n_row);
    for (int k = 0; k < N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = all_methods[k];
        options.tolerance = 1e-9;
        memset(good, 0, (size_t)n * sizeof *u);
        const nmm_solve_report cold = solve(&context, &system, &options, good);
        // The answer as guess: nothing to do, not a bit changes.
        memcpy(u, good, (size_t)n * sizeof *u);
        const nmm_solve_report warm = solve(&context, &system, &options, u);
        assert_int_equal(warm.end, NMM_SOLVE_CONVERGED);
        assert_int_equal(warm.iterations, 0);
        assert_memory_equal(u, good, (size_t)n * sizeof *u);
        // Worse than zero, or no number: as from zero, bit by bit.
        const double bad[] = {1e3, NAN, INFINITY};
        for (int b = 0; b < 3; b++) {
            for (int i = 0; i < n; i++)
                u[i] = i == 5 ? bad[b] : 0;
            const nmm_solve_report report = solve(&context, &system, &options, u);
            assert_int_equal(report.iterations, cold.iterations);
            assert_memory_equal(u, good, (size_t)n * sizeof *u);
        }
    }
    nmm_release(&context, &u);
    nmm_release(&context, &good);
    test_system_destroy(&context, &system);
}

static void test_no_load_no_rows(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    make_wall(&context, &system, 3, false);
    const int n = 2 * system.K.n_row;
    double *u = vector_of(&context, system.K.n_row);
    memset(system.f, 0, (size_t)n * sizeof *u);
    test_system empty = {0};
    int none = 0;
    empty.K.row_start = &none;
    for (int k = 0; k < N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = all_methods[k];
        for (int i = 0; i < n; i++)
            u[i] = 1 + i;
        nmm_solve_report report = solve(&context, &system, &options, u);
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_int_equal(report.iterations, 0);
        assert_near(report.residual, 0, 0);
        for (int i = 0; i < n; i++)
            assert_near(u[i], 0, 0);
        report = solve(&context, &empty, &options, NULL);
        assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
    }
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
}

// One solver for systems of several sizes, with and without keep_pattern.
static void test_solver_is_used_again(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    const nmm_solve_backend *host = nmm_solve_host();
    nmm_solver *solver = NULL;
    assert_int_equal(host->open(&context, &solver, 100, 2000), NMM_OK);
    const nmm_solve_options options = nmm_default_solve_options();
    const long calls = context.n_call;
    for (int round = 0; round < 6; round++) {
        nmm_context own = {.n_thread = 1};
        test_system system = {0};
        test_system_random(&own, &system, 100 - 13 * round, 4, (uint64_t)round);
        double u[200] = {0};
        for (int again = 0; again < 2; again++) {
            nmm_solve_report report;
            for (int i = 0; i < 2 * system.K.n_row; i++)
                system.f[i] += again;
            assert_int_equal(
                host->solve(&context, solver, &system.K, system.f, u, again > 0, &options, &report),
                NMM_OK);
            assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
            assert_true(test_true_residual(&system, u) <= 1e-8);
        }
        test_system_destroy(&own, &system);
    }
    // A solve allocates nothing.
    assert_int_equal(context.n_call, calls);
    host->close(&context, &solver);
    assert_int_equal(context.n_live, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_elimination),
        cmocka_unit_test(test_one_row),
        cmocka_unit_test(test_badly_scaled),
        cmocka_unit_test(test_tolerance_is_kept),
        cmocka_unit_test(test_absolute_limit),
        cmocka_unit_test(test_average_change),
        cmocka_unit_test(test_too_slow),
        cmocka_unit_test(test_stagnation),
        cmocka_unit_test(test_first_guess),
        cmocka_unit_test(test_no_load_no_rows),
        cmocka_unit_test(test_solver_is_used_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
