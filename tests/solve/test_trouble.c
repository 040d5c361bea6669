// SPDX-License-Identifier: MIT
//
// Systems that cannot be solved, options that make no sense, memory that is not there: each ends
// with a reason and a row, u stays as it was, nothing leaks, nothing is ever NaN.

#include "systems.h"
#include "test.h"

static const nmm_solve_method methods[] = {NMM_SOLVE_JACOBI, NMM_SOLVE_PCG,
                                           NMM_SOLVE_SOR,    NMM_SOLVE_GAUSS_SEIDEL,
                                           NMM_SOLVE_DIRECT, NMM_SOLVE_CHEBYSHEV};
#define N_METHOD 6
#define N_ROW 30

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_solver *solver;
    double u[2 * N_ROW];
} fixture;

static void set_up(fixture *x) {
    memset(x, 0, sizeof *x);
    x->context.n_thread = 1;
    test_system_random(&x->context, &x->system, N_ROW, 4, 17);
    assert_int_equal(nmm_solve_host()->open(&x->context, &x->solver, N_ROW, x->system.n_block),
                     NMM_OK);
    for (int i = 0; i < 2 * N_ROW; i++)
        x->u[i] = 1e-6 * i;
}

static void tear_down(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static void expect_of(fixture *x, nmm_solve_method method, nmm_solve_precision precision,
                      nmm_solve_end end, int row) {
    double before[2 * N_ROW];
    memcpy(before, x->u, sizeof before);
    nmm_solve_options options = nmm_default_solve_options();
    options.method = method;
    options.precision = precision;
    nmm_solve_report report;
    assert_int_equal(nmm_solve_host()->solve(&x->context, x->solver, &x->system.K, x->system.f,
                                             x->u, false, &options, &report),
                     NMM_OK);
    assert_int_equal(report.end, end);
    assert_int_equal(report.row, row);
    if (method != NMM_SOLVE_AUTO) assert_int_equal(report.method, method);
    assert_memory_equal(before, x->u, sizeof before);
    assert_true(isfinite(report.residual));
}

// Every method, auto too, ends so in any precision and names the row; u is untouched.
static void expect(fixture *x, nmm_solve_end end, int row) {
    const nmm_solve_precision precision[] = {NMM_PRECISION_AUTO, NMM_PRECISION_DOUBLE,
                                             NMM_PRECISION_MIXED};
    for (int p = 0; p < 3; p++) {
        for (int k = 0; k < N_METHOD; k++)
            expect_of(x, methods[k], precision[p], end, row);
        expect_of(x, NMM_SOLVE_AUTO, precision[p], end, row);
    }
}

static void test_numbers_not_finite(void **state) {
    (void)state;
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 3; k++) {
        fixture x;
        set_up(&x);
        // First the right-hand side, then an entry away from the diagonal.
        const double f = x.system.f[2 * 11 + 1];
        x.system.f[2 * 11 + 1] = bad[k];
        expect(&x, NMM_SOLVE_NOT_FINITE, 11);
        x.system.f[2 * 11 + 1] = f;
        x.system.K.value[4 * x.system.K.row_start[21] + 2] = bad[k];
        expect(&x, NMM_SOLVE_NOT_FINITE, 21);
        // The lowest row is named.
        x.system.K.value[4 * x.system.K.diagonal[8]] = bad[k];
        expect(&x, NMM_SOLVE_NOT_FINITE, 8);
        tear_down(&x);
    }
}

// Where u = 0 is near enough nothing is multiplied by the matrix; it is looked at all the same.
static void test_numbers_nobody_needs(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    memset(x.u, 0, sizeof x.u);
    x.system.K.value[4 * x.system.K.row_start[21] + 2] = NAN;
    for (int k = 0; k <= N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = k < N_METHOD ? methods[k] : NMM_SOLVE_AUTO;
        options.absolute = 1e300;
        nmm_solve_report report;
        assert_int_equal(nmm_solve_host()->solve(&x.context, x.solver, &x.system.K, x.system.f, x.u,
                                                 false, &options, &report),
                         NMM_OK);
        assert_int_equal(report.end, NMM_SOLVE_NOT_FINITE);
        assert_int_equal(report.row, 21);
    }
    tear_down(&x);
}

// No load asks nothing of the matrix; it is looked at all the same.
static void test_numbers_without_load(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    memset(x.system.f, 0, sizeof(double) * 2 * N_ROW);
    x.system.K.value[4 * x.system.K.row_start[21] + 2] = NAN;
    expect(&x, NMM_SOLVE_NOT_FINITE, 21);
    tear_down(&x);
}

// |f - K u| / |f| in a wider range of numbers than that of u.
static long double wide_residual(const test_system *system, const double *u) {
    const nmm_bsr *K = &system->K;
    long double left = 0, load = 0;
    for (int i = 0; i < 2 * K->n_row; i++) {
        long double r = system->f[i];
        load += r * r;
        for (int k = K->row_start[i / 2]; k < K->row_start[i / 2 + 1]; k++)
            for (int j = 0; j < 2; j++)
                r -= (long double)K->value[4 * (long)k + 2 * (i % 2) + j] * u[2 * K->col[k] + j];
        left += r * r;
    }
    return sqrtl(left / load);
}

// From zero; the answer is left in u.
static nmm_solve_report converges(fixture *x, nmm_solve_method method) {
    nmm_solve_options options = nmm_default_solve_options();
    options.method = method;
    nmm_solve_report report;
    memset(x->u, 0, sizeof x->u);
    assert_int_equal(nmm_solve_host()->solve(&x->context, x->solver, &x->system.K, x->system.f,
                                             x->u, false, &options, &report),
                     NMM_OK);
    assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
    return report;
}

// Loads so small, or a matrix so large, that displacements are next to the smallest number or below
// it: no false residual, no other cause. Above that nothing is special.
static void test_below_the_range_of_numbers(void **state) {
    (void)state;
    const struct {
        double matrix, load;
        bool special;
    } part[] = {{1, 1e-300, false}, {1, 1e-316, true},    {1, 1e-322, true},
                {1e60, 1, false},   {1e60, 1e-256, true}, {1e60, 1e-300, true}};
    for (int k = 0; k < 6; k++) {
        fixture x;
        set_up(&x);
        for (int i = 0; i < 4 * x.system.n_block; i++)
            x.system.K.value[i] *= part[k].matrix;
        for (int i = 0; i < 2 * N_ROW; i++)
            x.system.f[i] = part[k].load * (1 + i % 3);
        for (int m = 0; m < N_METHOD; m++) {
            const nmm_solve_report report = converges(&x, methods[m]);
            assert_int_equal(strstr(report.why, "smallest number") != NULL, part[k].special);
            if (!part[k].special) assert_true(report.residual <= 1e-8);
            assert_true(wide_residual(&x.system, x.u) <= 1.001L * report.residual + 1e-14L);
        }
        tear_down(&x);
    }
}

// Displacements that no number holds: told as such, u stays as it was. Large ones are found.
static void test_beyond_the_range_of_numbers(void **state) {
    (void)state;
    const double load[] = {1e100, 1e90};
    for (int k = 0; k < 2; k++) {
        fixture x;
        set_up(&x);
        for (int i = 0; i < 4 * x.system.n_block; i++)
            x.system.K.value[i] *= 1e-210;
        for (int i = 0; i < 2 * N_ROW; i++)
            x.system.f[i] = load[k] * (1 + i % 3);
        memset(x.u, 0, sizeof x.u);
        if (k == 0) expect(&x, NMM_SOLVE_OUT_OF_RANGE, -1);
        for (int m = 0; k > 0 && m < N_METHOD; m++) {
            converges(&x, methods[m]);
            assert_true(wide_residual(&x.system, x.u) <= 1.001e-8L);
        }
        tear_down(&x);
    }
}

static void test_diagonal_not_positive(void **state) {
    (void)state;
    const double block[][4] = {{0, 0, 0, 0},  {1, 0, 0, 0},      {0, 0, 0, 1},        {-1, 0, 0, 1},
                               {1, 0, 0, -1}, {-2, 0, 0, -2},    {1, 1, 1, 1},        {1, 2, 2, 1},
                               {0, 1, 1, 0},  {4e9, 2, 2, 1e-9}, {1, 1, 1, 1 + 1e-15}};
    for (size_t k = 0; k < sizeof block / sizeof *block; k++) {
        fixture x;
        set_up(&x);
        memcpy(x.system.K.value + 4 * x.system.K.diagonal[13], block[k], sizeof block[k]);
        expect(&x, NMM_SOLVE_INDEFINITE, 13);
        tear_down(&x);
    }
}

static void test_bad_patterns(void **state) {
    (void)state;
    for (int k = 0; k < 6; k++) {
        fixture x;
        set_up(&x);
        nmm_bsr *K = &x.system.K;
        const int begin = K->row_start[9];
        if (k == 0) K->col[begin] = -1;
        if (k == 1) K->col[K->row_start[10] - 1] = N_ROW;
        if (k == 2) K->col[begin + 1] = K->col[begin];
        if (k == 3) K->diagonal[9] += 1;
        if (k == 4) K->row_start[10] = begin;
        if (k == 5) K->diagonal[9] = -1;
        expect(&x, NMM_SOLVE_BAD_PATTERN, 9);
        tear_down(&x);
    }
    fixture x;
    set_up(&x);
    x.system.K.row_start[0] = 1;
    expect(&x, NMM_SOLVE_BAD_PATTERN, 0);
    tear_down(&x);
}

// As many blocks above the diagonal as below, but not the same ones: row 0 asks for one of row 1,
// which asks for none, and row 3 for one of row 2.
static void test_one_sided(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    int row_start[] = {0, 2, 3, 4, 6}, col[] = {0, 1, 1, 2, 2, 3}, diagonal[] = {0, 2, 3, 5};
    double value[24], f[8];
    for (int i = 0; i < 24; i++)
        value[i] = i % 4 == 0 || i % 4 == 3 ? 4 : 1;
    for (int i = 0; i < 8; i++)
        f[i] = 1;
    const nmm_bsr K = {4, row_start, col, value, diagonal};
    nmm_solver *solver = NULL;
    assert_int_equal(nmm_solve_host()->open(&context, &solver, 4, 6), NMM_OK);
    for (int k = 0; k < N_METHOD; k++) {
        double u[8] = {0};
        nmm_solve_options options = nmm_default_solve_options();
        options.method = methods[k];
        nmm_solve_report report;
        assert_int_equal(
            nmm_solve_host()->solve(&context, solver, &K, f, u, false, &options, &report), NMM_OK);
        assert_int_equal(report.end, NMM_SOLVE_BAD_PATTERN);
        assert_int_equal(report.row, 0);
    }
    nmm_solve_host()->close(&context, &solver);
    assert_int_equal(context.n_live, 0);
}

// Positive diagonal blocks, but a negative direction: K = [1 2; 2 1] on each axis of two rows.
static void test_negative_curvature(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    int row_start[] = {0, 2, 4}, col[] = {0, 1, 0, 1}, diagonal[] = {0, 3};
    double value[] = {1, 0, 0, 1, 2, 0, 0, 2, 2, 0, 0, 2, 1, 0, 0, 1}, f[] = {1, 0, -1, 0};
    const nmm_bsr K = {2, row_start, col, value, diagonal};
    nmm_solver *solver = NULL;
    assert_int_equal(nmm_solve_host()->open(&context, &solver, 2, 4), NMM_OK);
    for (int k = 0; k < N_METHOD; k++) {
        double u[4] = {0};
        nmm_solve_options options = nmm_default_solve_options();
        options.method = methods[k];
        nmm_solve_report report;
        assert_int_equal(
            nmm_solve_host()->solve(&context, solver, &K, f, u, false, &options, &report), NMM_OK);
        const bool sees = methods[k] != NMM_SOLVE_SOR && methods[k] != NMM_SOLVE_GAUSS_SEIDEL;
        assert_int_equal(report.end, sees ? NMM_SOLVE_INDEFINITE : NMM_SOLVE_DIVERGED);
        if (sees) assert_in_range(report.row, 0, 1);
        assert_true(report.iterations <= 100);
        for (int i = 0; i < 4; i++)
            assert_near(u[i], 0, 0);
        assert_near(report.residual, 1, 1e-15);
    }
    nmm_solve_host()->close(&context, &solver);
    assert_int_equal(context.n_live, 0);
}

// A floating block without mass, pushed: no equilibrium exists, and no method claims one.
static void test_floating_block(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    const rock wall = {.n_across = 1, .n_up = 2, .n_node = 4, .courant = 0, .spring = 0, .seed = 1};
    test_system_rock(&context, &system, &wall);
    double *u = NULL;
    assert_int_equal(nmm_allocate(&context, &u, (size_t)system.K.n_row, 2 * sizeof *u), NMM_OK);
    nmm_solver *solver = NULL;
    assert_int_equal(nmm_solve_host()->open(&context, &solver, system.K.n_row, system.n_block),
                     NMM_OK);
    for (int k = 0; k < N_METHOD; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.method = methods[k];
        options.max_iterations = 3000;
        nmm_solve_report report;
        memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
        assert_int_equal(nmm_solve_host()->solve(&context, solver, &system.K, system.f, u, false,
                                                 &options, &report),
                         NMM_OK);
        assert_int_not_equal(report.end, NMM_SOLVE_CONVERGED);
        assert_true(report.residual <= 1 + 1e-12);
        for (int i = 0; i < 2 * system.K.n_row; i++)
            assert_true(isfinite(u[i]));
    }
    nmm_solve_host()->close(&context, &solver);
    nmm_release(&context, &u);
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// Plain Jacobi diverges where lambda_max > 2, and says so soon; damped by the estimate it does not.
static void test_plain_jacobi(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    const bool lumped[] = {false, true};
    for (int k = 0; k < 2; k++) {
        test_system system = {0};
        const rock wall = {.n_across = 3,
                           .n_up = 2,
                           .n_node = 5,
                           .courant = lumped[k] ? 0.01 : 1,
                           .lumped = lumped[k],
                           .spring = 50,
                           .seed = 2};
        test_system_rock(&context, &system, &wall);
        double *u = NULL;
        assert_int_equal(nmm_allocate(&context, &u, (size_t)system.K.n_row, 2 * sizeof *u), NMM_OK);
        nmm_solver *solver = NULL;
        assert_int_equal(nmm_solve_host()->open(&context, &solver, system.K.n_row, system.n_block),
                         NMM_OK);
        nmm_solve_options options = nmm_default_solve_options();
        options.method = NMM_SOLVE_JACOBI;
        nmm_solve_report damped, plain;
        assert_int_equal(nmm_solve_host()->solve(&context, solver, &system.K, system.f, u, false,
                                                 &options, &damped),
                         NMM_OK);
        assert_int_equal(damped.end, NMM_SOLVE_CONVERGED);
        options.jacobi_damping = 1;
        memset(u, 0, 2 * (size_t)system.K.n_row * sizeof *u);
        // From a guess that is no number: what is left is zero, never the NaN.
        u[3] = NAN;
        assert_int_equal(nmm_solve_host()->solve(&context, solver, &system.K, system.f, u, false,
                                                 &options, &plain),
                         NMM_OK);
        // Consistent mass and springs: lambda_max > 2; lumped mass and a short step: below.
        assert_int_equal(damped.lambda_max > 2, !lumped[k]);
        assert_int_equal(plain.end, lumped[k] ? NMM_SOLVE_CONVERGED : NMM_SOLVE_DIVERGED);
        if (!lumped[k]) {
            assert_true(plain.iterations < 400);
            for (int i = 0; i < 2 * system.K.n_row; i++)
                assert_near(u[i], 0, 0);
        }
        nmm_solve_host()->close(&context, &solver);
        nmm_release(&context, &u);
        test_system_destroy(&context, &system);
    }
    assert_int_equal(context.n_live, 0);
}

// --- Slow, ended by rounding, without a solution

static const nmm_solve_method by_sweeps[] = {NMM_SOLVE_JACOBI, NMM_SOLVE_CHEBYSHEV, NMM_SOLVE_SOR,
                                             NMM_SOLVE_GAUSS_SEIDEL};

// The end of a solve from u = 0 on 2x2 blocks, to a tolerance within so many iterations (0:
// chosen).
static nmm_solve_report end_of(test_system *system, nmm_solve_method method, double tolerance,
                               int most) {
    nmm_context context = {.n_thread = 1};
    nmm_solver *solver = NULL;
    double *u = NULL;
    nmm_solve_report report;
    const nmm_solve_options options = {.method = method,
                                       .blocks = NMM_BLOCKS_COVER,
                                       .tolerance = tolerance,
                                       .max_iterations = most};
    assert_int_equal(nmm_allocate(&context, &u, (size_t)system->K.n_row, 2 * sizeof *u), NMM_OK);
    assert_int_equal(nmm_solve_host()->open(&context, &solver, system->K.n_row, system->n_block),
                     NMM_OK);
    assert_int_equal(nmm_solve_host()->solve(&context, solver, &system->K, system->f, u, false,
                                             &options, &report),
                     NMM_OK);
    // Where rounding is all there is, two ways to sum it differ.
    assert_near(report.residual, test_true_residual(system, u), 0.5 * report.residual);
    nmm_solve_host()->close(&context, &solver);
    nmm_release(&context, &u);
    return report;
}

// Consistent mass and a long step: |f - K u| grows for hundreds of sweeps of damped Jacobi, which
// converges all the same. Cut short it was too slow; asked for what numbers cannot hold it
// stagnates, and the residual is what rounding leaves.
static void test_slow_is_not_stagnated(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    const rock wall = {
        .n_across = 3, .n_up = 2, .n_node = 4, .courant = 10, .spring = 50, .seed = 2};
    test_system_rock(&context, &system, &wall);
    for (int k = 0; k < 4; k++) {
        const nmm_solve_report slow = end_of(&system, by_sweeps[k], 1e-6, 0);
        assert_int_equal(slow.end, NMM_SOLVE_CONVERGED);
        const nmm_solve_report cut = end_of(&system, by_sweeps[k], 1e-6, slow.iterations / 2);
        assert_int_equal(cut.end, NMM_SOLVE_TOO_SLOW);
        const nmm_solve_report rounded = end_of(&system, by_sweeps[k], 1e-30, 0);
        assert_int_equal(rounded.end, NMM_SOLVE_STAGNATED);
        assert_true(rounded.residual < 1e-8);
    }
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// Rows whose scales lie 12 decades apart: rounding makes r.D^-1 r swing far up, long after it was
// small. No method diverges.
static void test_rounding_is_not_divergence(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    test_system_chain(&context, &system, 60, true);
    double scale[120];
    for (int i = 0; i < 60; i++)
        scale[2 * i] = scale[2 * i + 1] = pow(10, (i * 37) % 60 / 5.0 - 6);
    test_system_scale(&system, scale);
    for (int i = 0; i < 120; i++)
        system.f[i] = 1;
    for (int k = 0; k < 4; k++) {
        if (by_sweeps[k] == NMM_SOLVE_SOR) continue;
        assert_int_equal(end_of(&system, by_sweeps[k], 1e-10, 0).end, NMM_SOLVE_STAGNATED);
    }
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// A chain held nowhere, pulled one way: what no displacement can balance stays, and the sweeps end
// long before the iterations allowed. Chebyshev's may swing on, and are too slow then.
static void test_no_solution(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    test_system_chain(&context, &system, 20, false);
    for (int i = 0; i < 40; i++)
        system.f[i] = 1 + i % 3;
    for (int k = 0; k < 4; k++) {
        const nmm_solve_report report = end_of(&system, by_sweeps[k], 1e-6, 0);
        assert_true(report.residual > 0.1);
        assert_int_not_equal(report.end, NMM_SOLVE_CONVERGED);
        if (by_sweeps[k] == NMM_SOLVE_CHEBYSHEV) continue;
        assert_int_equal(report.end, NMM_SOLVE_STAGNATED);
        assert_in_range(report.iterations, 100, 50000);
    }
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// --- Arguments and memory

static void expect_refused(const nmm_solve_options *options) {
    fixture x;
    set_up(&x);
    nmm_solve_report report;
    assert_int_equal(nmm_solve_host()->solve(&x.context, x.solver, &x.system.K, x.system.f, x.u,
                                             false, options, &report),
                     NMM_ERROR_ARGUMENT);
    assert_true(strlen(x.context.error.message) > 10);
    tear_down(&x);
}

static void test_options_out_of_range(void **state) {
    (void)state;
    const double wrong[] = {-1, 2, 3, NAN, INFINITY};
    for (int k = 0; k < 5; k++) {
        nmm_solve_options options = nmm_default_solve_options();
        options.tolerance = wrong[k];
        expect_refused(&options);
        options = nmm_default_solve_options();
        options.sor_factor = wrong[k];
        expect_refused(&options);
        options = nmm_default_solve_options();
        options.jacobi_damping = wrong[k];
        expect_refused(&options);
    }
    nmm_solve_options options = nmm_default_solve_options();
    options.tolerance = 0;
    expect_refused(&options);
    options.absolute = -1;
    expect_refused(&options);
    options.absolute = NAN;
    expect_refused(&options);
    options = nmm_default_solve_options();
    options.method = (nmm_solve_method)17;
    expect_refused(&options);
    options.method = (nmm_solve_method)-1;
    expect_refused(&options);
    options = nmm_default_solve_options();
    options.max_iterations = -5;
    expect_refused(&options);
}

static void test_larger_than_opened(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    const nmm_solve_options options = nmm_default_solve_options();
    nmm_solve_report report;
    for (int k = 0; k < 2; k++) {
        nmm_solve_host()->close(&x.context, &x.solver);
        assert_int_equal(
            nmm_solve_host()->open(&x.context, &x.solver, N_ROW - k, x.system.n_block - (1 - k)),
            NMM_OK);
        assert_int_equal(nmm_solve_host()->solve(&x.context, x.solver, &x.system.K, x.system.f, x.u,
                                                 false, &options, &report),
                         NMM_ERROR_ARGUMENT);
    }
    nmm_solve_host()->close(&x.context, &x.solver);
    assert_int_equal(nmm_solve_host()->open(&x.context, &x.solver, -1, 5), NMM_ERROR_ARGUMENT);
    assert_null(x.solver);
    tear_down(&x);
}

static void test_no_memory(void **state) {
    (void)state;
    int failures = 0;
    for (long at = 0;; at++) {
        test_failing hook = {.fail_at = at};
        nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
        nmm_solver *solver = NULL;
        const nmm_status status = nmm_solve_host()->open(&context, &solver, 50, 500);
        if (status == NMM_OK) {
            nmm_solve_host()->close(&context, &solver);
            assert_int_equal(context.n_live, 0);
            break;
        }
        failures++;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_null(solver);
        assert_int_equal(context.n_live, 0);
    }
    assert_true(failures >= 9);
}

static void test_names(void **state) {
    (void)state;
    assert_string_equal(nmm_solve_method_name(NMM_SOLVE_PCG), "pcg");
    assert_string_equal(nmm_solve_method_name((nmm_solve_method)99), "unknown");
    for (int end = NMM_SOLVE_OUT_OF_RANGE; end <= NMM_SOLVE_CONVERGED; end++)
        assert_string_not_equal(nmm_solve_end_name((nmm_solve_end)end), "unknown");
    assert_string_equal(nmm_solve_end_name((nmm_solve_end)5), "unknown");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_numbers_not_finite),
        cmocka_unit_test(test_numbers_nobody_needs),
        cmocka_unit_test(test_numbers_without_load),
        cmocka_unit_test(test_below_the_range_of_numbers),
        cmocka_unit_test(test_beyond_the_range_of_numbers),
        cmocka_unit_test(test_diagonal_not_positive),
        cmocka_unit_test(test_bad_patterns),
        cmocka_unit_test(test_one_sided),
        cmocka_unit_test(test_negative_curvature),
        cmocka_unit_test(test_floating_block),
        cmocka_unit_test(test_plain_jacobi),
        cmocka_unit_test(test_slow_is_not_stagnated),
        cmocka_unit_test(test_rounding_is_not_divergence),
        cmocka_unit_test(test_no_solution),
        cmocka_unit_test(test_options_out_of_range),
        cmocka_unit_test(test_larger_than_opened),
        cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
