// SPDX-License-Identifier: MIT
//
// Systems with the coupling of friction: the residual of the whole system, with sweeps by single
// rows and by threes, and with the factor, new or kept; the same bits on any number of threads;
// what cannot be solved goes without its coupling and says so.

#include "gauss.h"
#include "systems.h"
#include "test.h"

#include <math.h>
#include <string.h>

enum { N_TERM = 40 };

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_solver *solver;
    int row[N_TERM][6];
    double push[N_TERM][6][2], pull[N_TERM][6][2];
    nmm_coupling coupling;
    nmm_solve_options options;
    nmm_solve_report report;
    int *body;
    double *u; // [n_row][2]
} fixture;

// -1 .. 1.
static double between(nmm_random *random) {
    return 2 * nmm_random_unit(random) - 1;
}

static double diagonal_of(const nmm_bsr *K, int row) {
    return K->value[4 * (long)K->diagonal[row]];
}

// Terms between rows that have a block in common; `strength` beside the diagonal.
static void couple(fixture *x, double strength, uint64_t seed) {
    nmm_random random = nmm_random_seed(seed);
    const nmm_bsr *K = &x->system.K;
    for (int k = 0; k < N_TERM; k++) {
        const int row = (int)(nmm_random_next(&random) % (uint64_t)K->n_row);
        const int n = K->row_start[row + 1] - K->row_start[row];
        for (int i = 0; i < 6; i++) {
            x->row[k][i] = K->col[K->row_start[row] + i % n];
            for (int c = 0; c < 2; c++) {
                x->push[k][i][c] = between(&random);
                x->pull[k][i][c] = strength * diagonal_of(K, row) * between(&random) / 6;
            }
        }
    }
    x->coupling = (nmm_coupling){.n = N_TERM,
                                 .n_row = 6,
                                 .tolerance = 1e-9,
                                 .row = x->row[0],
                                 .push = x->push[0][0],
                                 .pull = x->pull[0][0]};
}

static void open_solver(fixture *x, double strength) {
    const size_t n = (size_t)x->system.K.n_row;
    couple(x, strength, 5);
    x->options = nmm_default_solve_options();
    x->options.tolerance = 1e-9;
    x->options.coupling = &x->coupling;
    assert_int_equal(nmm_allocate(&x->context, &x->u, n, 2 * sizeof *x->u), NMM_OK);
    assert_int_equal(nmm_allocate(&x->context, &x->body, n, sizeof *x->body), NMM_OK);
    assert_int_equal(
        nmm_solve_host()->open(&x->context, &x->solver, x->system.K.n_row, x->system.n_block),
        NMM_OK);
}

static void set_up_rock(fixture *x, double strength) {
    const rock wall = {
        .n_across = 4, .n_up = 4, .n_node = 3, .courant = 0.5, .spring = 10, .seed = 3};
    *x = (fixture){.context.n_thread = 1};
    test_system_rock(&x->context, &x->system, &wall);
    open_solver(x, strength);
}

// Bodies with three rows each, all of whose blocks are there, each joined to the one `reach`
// before.
static void build_threes(fixture *x, int n_body, int reach) {
    nmm_random random = nmm_random_seed(9);
    triplets list = {0};
    for (int row = 0; row < 3 * n_body; row++) {
        for (int col = row - row % 3; col <= row; col++) {
            const double a = between(&random), d = col == row ? 9 : 0;
            const double block[4] = {a + d, 0.5 * a, 0.5 * a, d - a};
            triplets_add(&x->context, &list, row, col, block);
            if (col < row) triplets_add(&x->context, &list, col, row, block);
        }
        if (row < 3 * reach) continue;
        for (int i = 0; i < 3; i++) {
            const int col = row - row % 3 - 3 * reach + i;
            const double part = i == row % 3 ? 1 : 0.1;
            const double far[4] = {-2 * part, 0.3 * part, 0.3 * part, -part};
            triplets_add(&x->context, &list, row, col, far);
            triplets_add(&x->context, &list, col, row, far);
        }
    }
    test_system_build(&x->context, &x->system, &list, 3 * n_body);
    for (int i = 0; i < 6 * n_body; i++)
        x->system.f[i] = between(&random);
}

// A chain of such bodies.
static void set_up_threes(fixture *x, int n_body, double strength) {
    *x = (fixture){.context.n_thread = 1};
    build_threes(x, n_body, 1);
    open_solver(x, strength);
    for (int row = 0; row < 3 * n_body; row++)
        x->body[row] = row / 3;
    x->options.place = x->system.f; // any numbers will do
    x->options.body = x->body;
}

static void tear_down(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    nmm_release(&x->context, &x->u);
    nmm_release(&x->context, &x->body);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static void solve(fixture *x) {
    memset(x->u, 0, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
    assert_int_equal(nmm_solve_host()->solve(&x->context, x->solver, &x->system.K, x->system.f,
                                             x->u, false, &x->options, &x->report),
                     NMM_OK);
    assert_int_equal(x->report.end, NMM_SOLVE_CONVERGED);
}

// |f - (K + coupling) u| / |f|.
static double residual_with_coupling(const fixture *x) {
    test_system rest = x->system;
    const int n = 2 * rest.K.n_row;
    double *f = NULL, square = 0, all = 0;
    nmm_context own = {.n_thread = 1};
    assert_int_equal(nmm_allocate(&own, &f, (size_t)n, sizeof *f), NMM_OK);
    memcpy(f, x->system.f, (size_t)n * sizeof *f);
    for (int k = 0; k < x->coupling.n; k++) {
        double sum = 0;
        for (int i = 0; i < 12; i++)
            sum += x->pull[k][i / 2][i % 2] * x->u[2 * x->row[k][i / 2] + i % 2];
        for (int i = 0; i < 12; i++)
            f[2 * x->row[k][i / 2] + i % 2] -= sum * x->push[k][i / 2][i % 2];
    }
    for (int i = 0; i < n; i++) {
        square += f[i] * f[i];
        all += x->system.f[i] * x->system.f[i];
    }
    rest.f = f;
    const double residual = test_true_residual(&rest, x->u) * sqrt(square / all);
    nmm_release(&own, &f);
    return residual;
}

// Solved by the kind whose rate is made to look best.
static void expect_solved_by(fixture *x, int kind) {
    solve(x);
    nmm_gauss *gauss = x->solver->gauss;
    for (int k = 0; k < NMM_GAUSS_KINDS; k++)
        gauss->rate[k] = k == kind ? 1e6 : 1e-6;
    x->options.reuse = kind == NMM_GAUSS_KEPT;
    solve(x);
    assert_true(x->report.coupled);
    assert_int_equal(x->report.method, kind == NMM_GAUSS_SWEEPS ? NMM_SOLVE_PCG : NMM_SOLVE_DIRECT);
    const bool kept = strstr(x->report.why, "earlier pass") != NULL;
    assert_int_equal(kept, kind == NMM_GAUSS_KEPT);
    assert_true(x->report.residual <= 1e-9);
    assert_near(residual_with_coupling(x), x->report.residual, 1e-10);
    // The coupling matters: without it the residual would be another one.
    assert_true(test_true_residual(&x->system, x->u) > 1e-3);
}

static void test_solved_by_sweeps_and_by_the_factor(void **unused) {
    (void)unused;
    fixture x;
    set_up_rock(&x, 0.5);
    expect_solved_by(&x, NMM_GAUSS_SWEEPS);
    assert_int_equal(x.solver->gauss->lump, 1);
    expect_solved_by(&x, NMM_GAUSS_FACTOR);
    tear_down(&x);
    set_up_threes(&x, 50, 0.5);
    expect_solved_by(&x, NMM_GAUSS_SWEEPS);
    assert_int_equal(x.solver->gauss->lump, 3);
    expect_solved_by(&x, NMM_GAUSS_FACTOR);
    tear_down(&x);
}

// Diagonal blocks of every `stride`-th row `times` as stiff.
static void stiffen(fixture *x, int stride, double times) {
    const nmm_bsr *K = &x->system.K;
    for (int row = 0; row < K->n_row; row += stride)
        for (int i = 0; i < 4; i++)
            K->value[4 * (long)K->diagonal[row] + i] *= times;
}

// The factor of another matrix does where that is near, and where it is far a new one is made.
static void test_solved_by_the_factor_kept(void **unused) {
    (void)unused;
    for (int far = 0; far < 2; far++) {
        fixture x;
        set_up_rock(&x, 0.5);
        expect_solved_by(&x, NMM_GAUSS_FACTOR);
        const int fresh = x.report.iterations;
        stiffen(&x, far ? 2 : 1, far ? 1e6 : 1.3);
        x.options.reuse = true;
        x.solver->gauss->rate[NMM_GAUSS_KEPT] = 1e6;
        solve(&x);
        assert_true(x.report.coupled);
        assert_true(x.report.iterations > fresh);
        assert_int_equal(strstr(x.report.why, "earlier pass") != NULL, !far);
        assert_near(residual_with_coupling(&x), x.report.residual, 1e-10);
        assert_true(x.report.residual <= 1e-9);
        tear_down(&x);
    }
}

// While solves are left out the pattern may change.
static void test_knows_a_pattern_that_came_in_a_pause(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 40, 0.5);
    expect_solved_by(&x, NMM_GAUSS_SWEEPS);
    test_system_destroy(&x.context, &x.system);
    build_threes(&x, 40, 7);
    couple(&x, 0.5, 6);
    x.options.place = x.system.f;
    x.solver->gauss->pause = 1;
    solve(&x);
    assert_false(x.report.coupled);
    assert_int_equal(nmm_solve_host()->solve(&x.context, x.solver, &x.system.K, x.system.f, x.u,
                                             true, &x.options, &x.report),
                     NMM_OK);
    assert_true(x.report.coupled);
    assert_int_equal(x.report.method, NMM_SOLVE_PCG);
    assert_true(residual_with_coupling(&x) <= 1e-9);
    tear_down(&x);
}

// Terms whose rows are not those of two bodies, and rows of any scale.
static void test_solves_what_lumps_are_not_made_for(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 50, 0.5);
    for (int i = 0; i < 6; i++)
        x.row[3][i] = 3 * i + 1;
    expect_solved_by(&x, NMM_GAUSS_SWEEPS);
    assert_int_equal(x.solver->gauss->lump, 1);
    tear_down(&x);
}

// A term that takes a pivot away: sweeps by single rows leave it beside the matrix. One that turns
// a diagonal block round is nothing special.
static void test_solves_where_a_block_has_no_inverse(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 50, 0);
    memset(x.push, 0, sizeof x.push);
    x.coupling.n = 1;
    for (int times = 1; times <= 2; times++) {
        x.push[0][0][0] = -times;
        x.pull[0][0][0] = diagonal_of(&x.system.K, x.row[0][0]);
        expect_solved_by(&x, NMM_GAUSS_SWEEPS);
        assert_int_equal(x.solver->gauss->lump, times == 1 ? 1 : 3);
    }
    tear_down(&x);
}

static void test_sweeps_hold_rows_of_any_scale(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 50, 0.3);
    const nmm_bsr *K = &x.system.K;
    for (int row = 0; row < K->n_row; row++) {
        // Bodies from 1e-60 to 1e60; f grows with the rows, u shrinks.
        const double own = ldexp(1, row / 3 % 5 * 100 - 200);
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                K->value[4 * (long)k + i] *= own * ldexp(1, K->col[k] / 3 % 5 * 100 - 200);
    }
    for (int k = 0; k < N_TERM; k++)
        for (int i = 0; i < 12; i++) {
            const double own = ldexp(1, x.row[k][i / 2] / 3 % 5 * 100 - 200);
            x.push[k][i / 2][i % 2] *= own;
            x.pull[k][i / 2][i % 2] *= own;
        }
    // Stiffest bodies alone are loaded: their residual is what is asked for.
    for (int i = 0; i < 2 * K->n_row; i++)
        x.system.f[i] *= i / 6 % 5 == 4 ? ldexp(1, 200) : 0;
    expect_solved_by(&x, NMM_GAUSS_SWEEPS);
    assert_int_equal(x.solver->gauss->lump, 3);
    tear_down(&x);
}

static void test_without_terms_it_is_the_symmetric_system(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 30, 0);
    x.coupling.n = 0;
    solve(&x);
    assert_true(x.report.coupled);
    assert_near(test_true_residual(&x.system, x.u), x.report.residual, 1e-10);
    tear_down(&x);
}

static void test_same_bits_on_any_number_of_threads(void **unused) {
    (void)unused;
    fixture one, many;
    set_up_threes(&one, 60, 0.5);
    set_up_threes(&many, 60, 0.5);
    many.context.n_thread = many.options.n_thread = 3;
    for (int kind = 0; kind < NMM_GAUSS_KINDS; kind++) {
        expect_solved_by(&one, kind);
        expect_solved_by(&many, kind);
        assert_memory_equal(one.u, many.u, 2 * (size_t)one.system.K.n_row * sizeof *one.u);
    }
    tear_down(&one);
    tear_down(&many);
}

// A coupling that takes a row out of the matrix: no solution with it, one without.
static void test_goes_without_what_has_no_solution(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 20, 0);
    const nmm_bsr *K = &x.system.K;
    memset(x.row, 0, sizeof x.row);
    memset(x.push, 0, sizeof x.push);
    memset(x.pull, 0, sizeof x.pull);
    const int begin = K->row_start[30], end = K->row_start[31];
    assert_int_equal(end - begin, 9);
    int *row = x.row[0];
    double *push = x.push[0][0], *pull = x.pull[0][0];
    for (int k = begin; k < end; k++) {
        row[k - begin] = K->col[k];
        push[2 * (k - begin)] = K->col[k] == 30;
        pull[2 * (k - begin)] = -K->value[4 * k];
        pull[2 * (k - begin) + 1] = -K->value[4 * k + 1];
    }
    x.coupling.n_row = 9;
    x.coupling.n = 1;
    solve(&x);
    assert_false(x.report.coupled);
    assert_true(test_true_residual(&x.system, x.u) <= 1e-9);
    tear_down(&x);
}

static void test_limits_ask_for_the_symmetric_methods(void **unused) {
    (void)unused;
    fixture x;
    set_up_threes(&x, 20, 0.1);
    x.options.max_iterations = 500;
    solve(&x);
    assert_false(x.report.coupled);
    x.options.max_iterations = 0;
    x.options.method = NMM_SOLVE_DIRECT;
    solve(&x);
    assert_false(x.report.coupled);
    tear_down(&x);
}

static void test_no_memory(void **unused) {
    (void)unused;
    int failures = 0;
    for (long at = 0;; at++) {
        fixture x;
        set_up_threes(&x, 10, 0.3);
        const nmm_context own = x.context;
        test_failing hook = {.fail_at = at};
        x.context.allocate = test_failing_hook;
        x.context.user = &hook;
        const nmm_status status = nmm_solve_host()->solve(
            &x.context, x.solver, &x.system.K, x.system.f, x.u, false, &x.options, &x.report);
        x.context.allocate = own.allocate;
        x.context.user = own.user;
        if (status != NMM_OK) {
            failures++;
            assert_int_equal(status, NMM_ERROR_MEMORY);
            nmm_context_clear(&x.context);
        }
        solve(&x);
        tear_down(&x);
        if (status == NMM_OK) break;
    }
    assert_true(failures >= 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_solved_by_sweeps_and_by_the_factor),
        cmocka_unit_test(test_solved_by_the_factor_kept),
        cmocka_unit_test(test_knows_a_pattern_that_came_in_a_pause),
        cmocka_unit_test(test_solves_what_lumps_are_not_made_for),
        cmocka_unit_test(test_solves_where_a_block_has_no_inverse),
        cmocka_unit_test(test_sweeps_hold_rows_of_any_scale),
        cmocka_unit_test(test_without_terms_it_is_the_symmetric_system),
        cmocka_unit_test(test_same_bits_on_any_number_of_threads),
        cmocka_unit_test(test_goes_without_what_has_no_solution),
        cmocka_unit_test(test_limits_ask_for_the_symmetric_methods),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
