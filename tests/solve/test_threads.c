// SPDX-License-Identifier: MIT
//
// The same bits for any number of threads, on systems large enough to use them; and the estimate of
// lambda_max against power iteration.

#include "solver.h"
#include "systems.h"
#include "test.h"

typedef struct outcome {
    nmm_solve_report report;
    uint64_t hash;
} outcome;

static outcome solve(nmm_context *context, const test_system *system,
                     const nmm_solve_options *options) {
    outcome result;
    // Rows and padding of the report are compared as bytes.
    memset(&result, 0, sizeof result);
    double *u = NULL;
    nmm_solver *solver = NULL;
    const nmm_solve_backend *host = nmm_solve_host();
    assert_int_equal(nmm_allocate(context, &u, (size_t)system->K.n_row, 2 * sizeof *u), NMM_OK);
    assert_int_equal(host->open(context, &solver, system->K.n_row, system->n_block), NMM_OK);
    assert_int_equal(
        host->solve(context, solver, &system->K, system->f, u, false, options, &result.report),
        NMM_OK);
    result.hash = nmm_hash(NMM_HASH_START, u, 2 * (size_t)system->K.n_row * sizeof *u);
    host->close(context, &solver);
    nmm_release(context, &u);
    return result;
}

static void assert_same(const outcome *a, const outcome *b) {
    assert_int_equal(a->report.end, b->report.end);
    assert_int_equal(a->report.method, b->report.method);
    assert_int_equal(a->report.iterations, b->report.iterations);
    assert_int_equal(a->report.row, b->report.row);
    assert_memory_equal(&a->report.residual, &b->report.residual, sizeof(double));
    assert_memory_equal(&a->report.lambda_max, &b->report.lambda_max, sizeof(double));
    assert_memory_equal(&a->report.lambda_min, &b->report.lambda_min, sizeof(double));
    assert_int_equal(a->report.blocks, b->report.blocks);
    assert_int_equal(a->report.setups, b->report.setups);
    assert_true(a->hash == b->hash);
}

// Everything that threads share.
static const nmm_solve_options kinds[] = {
    {.method = NMM_SOLVE_PCG, .blocks = NMM_BLOCKS_COVER, .tolerance = 1e-8},
    {.method = NMM_SOLVE_PCG, .blocks = NMM_BLOCKS_CLUSTER, .tolerance = 1e-8},
    {.method = NMM_SOLVE_PCG, .blocks = NMM_BLOCKS_BODY, .tolerance = 1e-8},
    {.method = NMM_SOLVE_AUTO, .tolerance = 1e-8},
    {.method = NMM_SOLVE_PCG,
     .blocks = NMM_BLOCKS_CLUSTER,
     .precision = NMM_PRECISION_MIXED,
     .tolerance = 1e-8},
    {.method = NMM_SOLVE_PCG,
     .blocks = NMM_BLOCKS_BODY,
     .precision = NMM_PRECISION_MIXED,
     .tolerance = 1e-8},
    {.method = NMM_SOLVE_CHEBYSHEV, .blocks = NMM_BLOCKS_CLUSTER, .tolerance = 1e-6},
    {.method = NMM_SOLVE_CHEBYSHEV,
     .blocks = NMM_BLOCKS_COVER,
     .precision = NMM_PRECISION_MIXED,
     .tolerance = 1e-6},
    {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-4},
    {.method = NMM_SOLVE_JACOBI, .tolerance = 1e-3, .stop_average_change = true},
};
#define N_KIND ((int)(sizeof kinds / sizeof *kinds))

// What the coarse correction asks of a wall.
static void tell_bodies(nmm_context *context, const rock *wall, int n_row, double **place,
                        int **body) {
    const int n = wall->n_node, n_block_row = n * n;
    assert_int_equal(nmm_allocate(context, place, (size_t)n_row, 2 * sizeof **place), NMM_OK);
    assert_int_equal(nmm_allocate(context, body, (size_t)n_row, sizeof **body), NMM_OK);
    for (int row = 0; row < n_row; row++) {
        const int block = row / n_block_row, node = row % n_block_row;
        (*body)[row] = block;
        (*place)[2 * row] = block % wall->n_across + (double)(node % n) / (n - 1);
        (*place)[2 * row + 1] = block / wall->n_across + (double)(node / n) / (n - 1);
    }
}

static void test_same_bits(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    test_system system = {0};
    const rock wall = {
        .n_across = 10, .n_up = 8, .n_node = 6, .courant = 0.3, .spring = 50, .seed = 4};
    test_system_rock(&context, &system, &wall);
    assert_true(system.K.n_row > 2500);
    double *place = NULL;
    int *body = NULL;
    tell_bodies(&context, &wall, system.K.n_row, &place, &body);
    nmm_solve_options options[N_KIND];
    for (int k = 0; k < N_KIND; k++) {
        options[k] = kinds[k];
        options[k].place = place;
        options[k].body = body;
    }
    for (int k = 0; k < N_KIND; k++) {
        options[k].n_thread = 1;
        const outcome one = solve(&context, &system, &options[k]);
        assert_int_equal(one.report.end, NMM_SOLVE_CONVERGED);
        if (kinds[k].blocks != NMM_BLOCKS_AUTO) {
            assert_int_equal(one.report.blocks, kinds[k].blocks);
        }
        assert_int_equal(one.report.precision, kinds[k].precision);
        const int threads[] = {2, 3, 8};
        for (int t = 0; t < 3; t++) {
            options[k].n_thread = threads[t];
            const outcome many = solve(&context, &system, &options[k]);
            assert_same(&one, &many);
        }
        // 0: those of the context.
        options[k].n_thread = 0;
        context.n_thread = 2;
        const outcome own = solve(&context, &system, &options[k]);
        assert_same(&one, &own);
    }
    // Trouble is the same as well: two bad rows in the parts of different threads.
    system.K.value[4 * system.K.diagonal[2700]] = -1;
    system.K.value[4 * system.K.diagonal[2000]] = -1;
    for (int n_thread = 1; n_thread <= 3; n_thread++) {
        options[0].n_thread = n_thread;
        const outcome bad = solve(&context, &system, &options[0]);
        assert_int_equal(bad.report.end, NMM_SOLVE_INDEFINITE);
        assert_int_equal(bad.report.row, 2000);
    }
    nmm_release(&context, &place);
    nmm_release(&context, &body);
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// Is x D - K positive definite, that is, x above every eigenvalue of D^-1 K? By dense elimination.
static bool is_above(nmm_context *context, const test_system *system, double x) {
    const nmm_bsr *K = &system->K;
    const int n = 2 * K->n_row;
    double *a = NULL;
    assert_int_equal(nmm_allocate(context, &a, (size_t)n * (size_t)n, sizeof *a), NMM_OK);
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
            const double factor = K->col[k] == row ? x - 1 : -1;
            for (int i = 0; i < 4; i++)
                a[(2 * row + i / 2) * n + 2 * K->col[k] + i % 2] = factor * K->value[4 * k + i];
        }
    }
    bool positive = true;
    for (int k = 0; k < n && positive; k++) {
        positive = a[k * n + k] > 0;
        for (int i = k + 1; i < n; i++) {
            const double factor = a[i * n + k] / a[k * n + k];
            for (int j = k; j < n && factor != 0; j++)
                a[i * n + j] -= factor * a[k * n + j];
        }
    }
    nmm_release(context, &a);
    return positive;
}

// The estimate comes from below, and so near that 1.9 / estimate damps what has to be damped.
static void test_lambda_estimate(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    for (uint64_t seed = 1; seed <= 12; seed++) {
        test_system system = {0};
        const rock wall = {.n_across = 2 + (int)(seed % 3),
                           .n_up = 1 + (int)(seed % 2),
                           .n_node = 3 + (int)(seed % 3),
                           .courant = seed % 5 == 0 ? 0.1 : 10,
                           .lumped = seed % 2 == 0,
                           .spring = 50,
                           .seed = seed};
        test_system_rock(&context, &system, &wall);
        nmm_solve_options options = nmm_default_solve_options();
        options.method = NMM_SOLVE_JACOBI;
        options.tolerance = 1e-2;
        const outcome result = solve(&context, &system, &options);
        assert_int_equal(result.report.end, NMM_SOLVE_CONVERGED);
        const double lambda = result.report.lambda_max;
        assert_false(is_above(&context, &system, lambda * (1 - 1e-4)));
        assert_true(is_above(&context, &system, lambda * 1.04));
        test_system_destroy(&context, &system);
    }
    assert_int_equal(context.n_live, 0);
}

// The 1-2-1 matrix of n rows has 2 -+ 2 cos(pi / (n + 1)) as its outermost eigenvalues: alpha and
// beta of an L D L^T factor of it, eq. (6.9) read backwards.
static void test_tridiagonal(void **state) {
    (void)state;
    double history[NMM_LANCZOS][2];
    double pivot = 2;
    for (int k = 0; k < NMM_LANCZOS; k++) {
        history[k][0] = 1 / pivot;
        history[k][1] = 1 / (pivot * pivot);
        pivot = 2 - 1 / pivot;
    }
    double bounds[2];
    for (int n = 1; n <= NMM_LANCZOS; n++) {
        const double part = cos(3.14159265358979323846 / (n + 1));
        nmm_lanczos_bounds(n, history, bounds);
        assert_close(bounds[0], 2 - 2 * part, 2e-6);
        assert_close(bounds[1], 2 + 2 * part, 2e-6);
    }
    nmm_lanczos_bounds(0, history, bounds);
    assert_near(bounds[0], 0, 0);
    assert_near(bounds[1], 0, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_lambda_estimate),
        cmocka_unit_test(test_tridiagonal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
