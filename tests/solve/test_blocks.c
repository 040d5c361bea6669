// SPDX-License-Identifier: MIT
//
// Every iterative method with every kind of blocks and both precisions: against dense elimination,
// the same bits on any number of threads and any processor, rows on scales 24 orders apart, systems
// that cannot be solved, places and bodies that make no sense, memory that runs out on the way.

#include "solver.h"
#include "systems.h"
#include "test.h"

// A method, blocks and precision; jacobi, chebyshev and pcg.
typedef struct choice {
    nmm_solve_method method;
    nmm_solve_blocks blocks;
    nmm_solve_precision precision;
} choice;

#define N_CHOICE 24

// Blocks `auto` as well, where the choice is made on the way.
static choice choice_of(int k) {
    static const nmm_solve_method method[] = {NMM_SOLVE_JACOBI, NMM_SOLVE_CHEBYSHEV, NMM_SOLVE_PCG};
    return (choice){method[k / 8], (nmm_solve_blocks)(k % 4), (nmm_solve_precision)(k / 4 % 2)};
}

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_solver *solver;
    double *place, *u, *exact;
    int *body;
    nmm_solve_options options;
    nmm_solve_report report;
} fixture;

static void allocate(fixture *x, void *block, size_t size) {
    assert_int_equal(nmm_allocate(&x->context, block, (size_t)x->system.K.n_row, size), NMM_OK);
}

static void set_up_wall(fixture *x, const rock *wall) {
    *x = (fixture){.context.n_thread = 1};
    test_system_rock(&x->context, &x->system, wall);
    allocate(x, &x->place, 2 * sizeof(double));
    allocate(x, &x->u, 2 * sizeof(double));
    allocate(x, &x->exact, 2 * sizeof(double));
    allocate(x, &x->body, sizeof(int));
    const int n_node = wall->n_node;
    for (int row = 0; row < x->system.K.n_row; row++) {
        const int block = row / (n_node * n_node);
        x->body[row] = block;
        x->place[2 * row] = block % wall->n_across * n_node + row % n_node;
        x->place[2 * row + 1] = block / wall->n_across * n_node + row / n_node % n_node;
    }
    x->options = nmm_default_solve_options();
    x->options.place = x->place;
    x->options.body = x->body;
    assert_int_equal(
        nmm_solve_host()->open(&x->context, &x->solver, x->system.K.n_row, x->system.n_block),
        NMM_OK);
}

static const rock small_wall = {
    .n_across = 3, .n_up = 2, .n_node = 4, .courant = 3, .spring = 50, .seed = 4};

static void tear_down(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    nmm_release(&x->context, &x->place);
    nmm_release(&x->context, &x->u);
    nmm_release(&x->context, &x->exact);
    nmm_release(&x->context, &x->body);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static nmm_status solve_with(fixture *x, choice c) {
    x->options.method = c.method;
    x->options.blocks = c.blocks;
    x->options.precision = c.precision;
    memset(x->u, 0, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
    memset(&x->report, 0, sizeof x->report);
    return nmm_solve_host()->solve(&x->context, x->solver, &x->system.K, x->system.f, x->u, false,
                                   &x->options, &x->report);
}

static double difference(const fixture *x) {
    double sum = 0, size = 0;
    for (int i = 0; i < 2 * x->system.K.n_row; i++) {
        sum += (x->u[i] - x->exact[i]) * (x->u[i] - x->exact[i]);
        size += x->exact[i] * x->exact[i];
    }
    return sqrt(sum / size);
}

// What rounding can do to a measured residual.
static double rounding_of(const fixture *x) {
    const nmm_bsr *K = &x->system.K;
    double sum = 0, load = 0;
    for (int row = 0; row < K->n_row; row++) {
        for (int i = 0; i < 2; i++) {
            double size = fabs(x->system.f[2 * row + i]);
            load += size * size;
            for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
                for (int j = 0; j < 2; j++)
                    size += fabs(K->value[4 * (long)k + 2 * i + j] * x->u[2 * K->col[k] + j]);
            sum += size * size;
        }
    }
    return 1e-15 * sqrt(sum / load);
}

// What is promised however a solve ends: the residual is that of u, u is no NaN, converged means
// below the tolerance.
static void check_promises(const fixture *x) {
    for (int i = 0; i < 2 * x->system.K.n_row; i++)
        assert_true(isfinite(x->u[i]));
    const double residual = test_true_residual(&x->system, x->u);
    assert_near(x->report.residual, residual, rounding_of(x) + 1e-12 * residual);
    const bool reached = residual <= x->options.tolerance * (1 + 1e-12) + rounding_of(x);
    if (x->report.end == NMM_SOLVE_CONVERGED) assert_true(reached);
    assert_true(residual <= 1 + 1e-9);
}

// --- Right answers

static void test_against_elimination(void **state) {
    (void)state;
    const double courant[] = {0.3, 3, 30};
    for (int w = 0; w < 3; w++) {
        fixture x;
        rock wall = small_wall;
        wall.courant = courant[w];
        wall.lumped = w == 1;
        set_up_wall(&x, &wall);
        test_dense_solve(&x.context, &x.system, x.exact);
        x.options.tolerance = 1e-10;
        for (int k = 0; k < N_CHOICE; k++) {
            const choice c = choice_of(k);
            assert_int_equal(solve_with(&x, c), NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            check_promises(&x);
            assert_near(difference(&x), 0, 1e-6);
            assert_int_equal(x.report.method, c.method);
            // Bodies help conjugate gradients alone; float32 was good enough.
            nmm_solve_blocks blocks = c.blocks;
            if (blocks == NMM_BLOCKS_BODY && c.method != NMM_SOLVE_PCG) blocks = NMM_BLOCKS_CLUSTER;
            if (c.blocks != NMM_BLOCKS_AUTO) assert_int_equal(x.report.blocks, blocks);
            assert_true(x.report.blocks != NMM_BLOCKS_AUTO);
            assert_int_equal(x.report.precision, c.precision);
        }
        tear_down(&x);
    }
}

// Rows, or the two unknowns of a row, on scales up to 24 orders apart, the whole on any scale.
static void test_badly_scaled(void **state) {
    (void)state;
    const double unit[] = {1e-12, 1, 1e12};
    for (int decades = 4; decades <= 24; decades += 4) {
        for (int apart = 0; apart < 2; apart++) {
            fixture x;
            set_up_wall(&x, &small_wall);
            nmm_random random = nmm_random_seed(5);
            double scale[2 * 96];
            assert_int_equal(x.system.K.n_row, 96);
            for (int i = 0; i < 2 * 96; i++) {
                const bool anew = i % 2 == 0 || apart == 1;
                const double luck = nmm_random_unit(&random) - 0.5;
                scale[i] = anew ? pow(10, decades * luck) : scale[i - 1];
            }
            test_system_scale(&x.system, scale);
            for (int i = 0; i < 4 * x.system.n_block; i++)
                x.system.K.value[i] *= unit[decades / 4 % 3];
            for (int k = 0; k < N_CHOICE; k++) {
                assert_int_equal(solve_with(&x, choice_of(k)), NMM_OK);
                check_promises(&x);
                // Scaling does not change a 2x2 block's job; float32 gives way with a word.
                assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
                const bool asked = choice_of(k).precision == NMM_PRECISION_MIXED;
                if (asked && x.report.precision == NMM_PRECISION_DOUBLE) {
                    assert_true(strlen(x.report.why) > 10);
                }
                if (decades == 24 && asked) {
                    assert_int_equal(x.report.precision, NMM_PRECISION_DOUBLE);
                }
            }
            tear_down(&x);
        }
    }
}

// A matrix times a power of two is solved in the same iterations: neither the blocks in float32 nor
// the estimate of the spectrum know a unit.
static void test_one_scale_for_all(void **state) {
    (void)state;
    const nmm_solve_method method[] = {NMM_SOLVE_PCG, NMM_SOLVE_JACOBI, NMM_SOLVE_CHEBYSHEV};
    for (int k = 0; k < 6; k++) {
        const choice c = {method[k / 2], k % 2 == 0 ? NMM_BLOCKS_COVER : NMM_BLOCKS_CLUSTER,
                          NMM_PRECISION_DOUBLE};
        int iterations[3] = {0};
        for (int power = -1; power <= 1; power++) {
            fixture x;
            set_up_wall(&x, &small_wall);
            for (int i = 0; i < 4 * x.system.n_block; i++)
                x.system.K.value[i] = ldexp(x.system.K.value[i], 400 * power);
            assert_int_equal(solve_with(&x, c), NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            check_promises(&x);
            iterations[1 + power] = x.report.iterations;
            tear_down(&x);
        }
        assert_int_equal(iterations[0], iterations[1]);
        assert_int_equal(iterations[2], iterations[1]);
    }
}

// One row, and a limit on iterations that no switch of blocks exceeds.
static void test_iterations_are_limited(void **state) {
    (void)state;
    fixture x;
    rock wall = small_wall;
    wall.courant = 300;
    wall.spring = 1e5;
    set_up_wall(&x, &wall);
    x.options.tolerance = 1e-12;
    for (int most = 1; most < 90; most += 11) {
        for (int k = 0; k < N_CHOICE; k++) {
            x.options.max_iterations = most;
            assert_int_equal(solve_with(&x, choice_of(k)), NMM_OK);
            check_promises(&x);
            assert_true(x.report.iterations <= most);
            if (x.report.end != NMM_SOLVE_CONVERGED) {
                assert_int_equal(x.report.end, NMM_SOLVE_TOO_SLOW);
                assert_int_equal(x.report.iterations, most);
            }
        }
    }
    tear_down(&x);
}

static void test_one_row_and_none(void **state) {
    (void)state;
    int row_start[] = {0, 1}, col[] = {0}, diagonal[] = {0}, body[] = {0};
    double value[] = {4, 1, 1, 3}, f[] = {1, 2}, place[] = {5, 7};
    for (int n_row = 0; n_row <= 1; n_row++) {
        const nmm_bsr K = {n_row, row_start, col, value, diagonal};
        for (int k = 0; k < N_CHOICE; k++) {
            nmm_context context = {.n_thread = 1};
            nmm_solver *solver = NULL;
            nmm_solve_options options = nmm_default_solve_options();
            options.method = choice_of(k).method;
            options.blocks = choice_of(k).blocks;
            options.precision = choice_of(k).precision;
            options.place = place;
            options.body = body;
            options.tolerance = 1e-13;
            nmm_solve_report report;
            double u[2] = {0};
            assert_int_equal(nmm_solve_host()->open(&context, &solver, n_row, n_row), NMM_OK);
            assert_int_equal(
                nmm_solve_host()->solve(&context, solver, &K, f, u, false, &options, &report),
                NMM_OK);
            assert_int_equal(report.end, NMM_SOLVE_CONVERGED);
            assert_near(u[0], n_row / 11.0, 1e-13);
            assert_near(u[1], n_row * 7 / 11.0, 1e-13);
            nmm_solve_host()->close(&context, &solver);
            assert_int_equal(context.n_live, 0);
        }
    }
}

// --- Precision

// Where float32 gains nothing, float64 goes on, to the same end, and says so: what float64 alone
// reaches within half of the iterations allowed, both together reach.
static void test_mixed_gives_way(void **state) {
    (void)state;
    int gave_way = 0, compared = 0;
    for (double spring = 1e2; spring < 2e7; spring *= 10) {
        fixture x;
        rock wall = small_wall;
        wall.courant = 30;
        wall.spring = spring;
        set_up_wall(&x, &wall);
        x.options.tolerance = 1e-6;
        x.options.max_iterations = 3000;
        for (int b = NMM_BLOCKS_AUTO; b <= NMM_BLOCKS_BODY; b++) {
            choice c = {NMM_SOLVE_PCG, (nmm_solve_blocks)b, NMM_PRECISION_DOUBLE};
            assert_int_equal(solve_with(&x, c), NMM_OK);
            if (x.report.iterations > 1500) continue;
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            c.precision = NMM_PRECISION_MIXED;
            assert_int_equal(solve_with(&x, c), NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            check_promises(&x);
            const bool fell_back = x.report.precision == NMM_PRECISION_DOUBLE;
            assert_int_equal(fell_back, strstr(x.report.why, "float") != NULL);
            if (spring <= 1e2) assert_false(fell_back);
            gave_way += fell_back;
            compared++;
        }
        tear_down(&x);
    }
    assert_true(gave_way > 2);
    assert_true(compared > 20);
}

// --- Bits

typedef struct outcome {
    uint64_t hash;
    int iterations;
    double residual;
} outcome;

static outcome outcome_of(const fixture *x) {
    const size_t size = 2 * (size_t)x->system.K.n_row * sizeof *x->u;
    return (outcome){nmm_hash(NMM_HASH_START, x->u, size), x->report.iterations,
                     x->report.residual};
}

static void assert_same(outcome a, outcome b) {
    assert_int_equal(a.iterations, b.iterations);
    assert_memory_equal(&a.residual, &b.residual, sizeof a.residual);
    assert_true(a.hash == b.hash);
}

static void test_same_bits_on_threads(void **state) {
    (void)state;
    fixture x;
    const rock wall = {
        .n_across = 12, .n_up = 8, .n_node = 5, .courant = 0.5, .spring = 50, .seed = 4};
    set_up_wall(&x, &wall);
    assert_true(x.system.K.n_row > 2200);
    x.options.tolerance = 1e-6;
    for (int k = 0; k < N_CHOICE; k++) {
        outcome one = {0};
        const int n_thread[] = {1, 2, 3, 7};
        for (int t = 0; t < 4; t++) {
            // What the choice learned is forgotten with the solver.
            nmm_solve_host()->close(&x.context, &x.solver);
            assert_int_equal(
                nmm_solve_host()->open(&x.context, &x.solver, x.system.K.n_row, x.system.n_block),
                NMM_OK);
            x.options.n_thread = n_thread[t];
            assert_int_equal(solve_with(&x, choice_of(k)), NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            if (t == 0) one = outcome_of(&x);
            assert_same(one, outcome_of(&x));
        }
    }
    tear_down(&x);
}

// As the host's backend does, by a given variant.
static void solve_by(fixture *x, const nmm_variant *variant, choice c) {
    x->options.method = c.method;
    x->options.blocks = c.blocks;
    x->options.precision = c.precision;
    memset(x->u, 0, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
    assert_int_equal(nmm_solver_prepare(&x->context, x->solver, &x->system.K, false, &x->options),
                     NMM_OK);
    x->solver->variant = variant;
    bool ready = false;
    assert_int_equal(nmm_solver_start(&x->context, x->solver, &x->system.K, x->system.f, x->u,
                                      &x->report, &ready),
                     NMM_OK);
    assert_true(ready);
    const double norm = variant->run(x->solver, x->u, &x->report);
    nmm_solver_finish(x->solver, norm, x->u, &x->report);
    assert_int_equal(x->report.end, NMM_SOLVE_CONVERGED);
}

static void test_same_bits_on_processors(void **state) {
    (void)state;
    if (!test_has_avx2()) skip();
    fixture x;
    const rock wall = {
        .n_across = 5, .n_up = 4, .n_node = 5, .courant = 1, .spring = 50, .seed = 4};
    set_up_wall(&x, &wall);
    for (int k = 0; k < N_CHOICE; k++) {
        const choice c = choice_of(k);
        if (c.blocks == NMM_BLOCKS_AUTO) continue;
        solve_by(&x, &nmm_variant_serial, c);
        const outcome plain = outcome_of(&x);
        solve_by(&x, &nmm_variant_serial_avx2, c);
        assert_same(plain, outcome_of(&x));
    }
    tear_down(&x);
}

// --- Trouble

// Ends so, names the row, leaves u alone; then the solver is as good as before.
static void expect_trouble(fixture *x, nmm_solve_end end, int row, double *number, double wrong) {
    const double right = *number;
    for (int k = 0; k < N_CHOICE; k++) {
        *number = wrong;
        assert_int_equal(solve_with(x, choice_of(k)), NMM_OK);
        assert_int_equal(x->report.end, end);
        assert_int_equal(x->report.row, row);
        for (int i = 0; i < 2 * x->system.K.n_row; i++)
            assert_true(x->u[i] == 0);
        *number = right;
        assert_int_equal(solve_with(x, choice_of(k)), NMM_OK);
        assert_int_equal(x->report.end, NMM_SOLVE_CONVERGED);
    }
}

static void test_trouble_has_a_row(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, &small_wall);
    const nmm_bsr *K = &x.system.K;
    double *diagonal = K->value + 4 * (long)K->diagonal[41];
    expect_trouble(&x, NMM_SOLVE_NOT_FINITE, 17, &x.system.f[35], NAN);
    expect_trouble(&x, NMM_SOLVE_NOT_FINITE, 17, &x.system.f[35], -INFINITY);
    expect_trouble(&x, NMM_SOLVE_NOT_FINITE, 30, K->value + 4 * (long)K->row_start[30] + 1, NAN);
    expect_trouble(&x, NMM_SOLVE_NOT_FINITE, 30, K->value + 4 * (long)K->row_start[30], INFINITY);
    expect_trouble(&x, NMM_SOLVE_INDEFINITE, 41, diagonal, -1);
    expect_trouble(&x, NMM_SOLVE_INDEFINITE, 41, diagonal, 0);
    tear_down(&x);
}

// A block above the diagonal whose mirror image is missing: no method may read it as symmetric.
static void test_one_sided_pattern(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    // Everything below the diagonal, nothing above.
    enum { N = 12 };
    test_system system = {0};
    triplets list = {0};
    const double strong[4] = {9, 0, 0, 9}, weak[4] = {1, 0, 0, 1};
    for (int i = 0; i < N; i++) {
        triplets_add(&context, &list, i, i, strong);
        for (int j = 0; j < i; j++)
            triplets_add(&context, &list, i, j, weak);
    }
    test_system_build(&context, &system, &list, N);
    for (int i = 0; i < 2 * N; i++)
        system.f[i] = 1;
    nmm_solver *solver = NULL;
    assert_int_equal(nmm_solve_host()->open(&context, &solver, N, system.n_block), NMM_OK);
    for (int k = 0; k < N_CHOICE; k++) {
        double u[2 * N] = {0};
        nmm_solve_options options = nmm_default_solve_options();
        options.method = choice_of(k).method;
        options.blocks = choice_of(k).blocks;
        nmm_solve_report report;
        assert_int_equal(nmm_solve_host()->solve(&context, solver, &system.K, system.f, u, false,
                                                 &options, &report),
                         NMM_OK);
        assert_int_equal(report.end, NMM_SOLVE_BAD_PATTERN);
        assert_int_equal(report.row, 1);
    }
    nmm_solve_host()->close(&context, &solver);
    test_system_destroy(&context, &system);
    assert_int_equal(context.n_live, 0);
}

// Bodies on nothing, without mass; and a stiff pair with negative curvature between bodies.
static void test_singular_and_indefinite(void **state) {
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        fixture x;
        rock wall = small_wall;
        if (kind == 0) wall.courant = wall.spring = 0;
        set_up_wall(&x, &wall);
        const nmm_bsr *K = &x.system.K;
        if (kind == 1) {
            for (int k = K->row_start[5]; k < K->row_start[6]; k++)
                if (K->col[k] == 6) K->value[4 * (long)k] *= 40;
            for (int k = K->row_start[6]; k < K->row_start[7]; k++)
                if (K->col[k] == 5) K->value[4 * (long)k] *= 40;
        }
        x.options.max_iterations = 2000;
        for (int k = 0; k < N_CHOICE; k++) {
            assert_int_equal(solve_with(&x, choice_of(k)), NMM_OK);
            assert_int_not_equal(x.report.end, NMM_SOLVE_CONVERGED);
            check_promises(&x);
            if (kind == 1) assert_int_equal(x.report.end, NMM_SOLVE_INDEFINITE);
            if (kind == 1) assert_in_range(x.report.row, 0, K->n_row - 1);
        }
        tear_down(&x);
    }
}

// --- Places and bodies

static void test_hints_are_checked(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, &small_wall);
    const int wrong_body[] = {-2, INT32_MIN, 96, INT32_MAX};
    const double wrong_place[] = {NAN, INFINITY, -INFINITY, 1e200};
    for (int b = 0; b <= NMM_BLOCKS_BODY; b++) {
        const choice c = {NMM_SOLVE_PCG, (nmm_solve_blocks)b, NMM_PRECISION_DOUBLE};
        for (int k = 0; k < 4; k++) {
            x.body[50] = wrong_body[k];
            assert_int_equal(solve_with(&x, c), NMM_ERROR_ARGUMENT);
            assert_non_null(strstr(x.context.error.message, "row 50"));
            nmm_context_clear(&x.context);
            x.body[50] = 3;
            const double right = x.place[77];
            x.place[77] = wrong_place[k];
            assert_int_equal(solve_with(&x, c), NMM_ERROR_ARGUMENT);
            assert_non_null(strstr(x.context.error.message, "row 38"));
            nmm_context_clear(&x.context);
            x.place[77] = right;
            assert_int_equal(solve_with(&x, c), NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
        }
    }
    // Without both there is no coarse correction, and nothing to check.
    const choice body = {NMM_SOLVE_PCG, NMM_BLOCKS_BODY, NMM_PRECISION_DOUBLE};
    x.body[50] = -2;
    x.options.place = NULL;
    assert_int_equal(solve_with(&x, body), NMM_OK);
    assert_int_equal(x.report.blocks, NMM_BLOCKS_CLUSTER);
    assert_string_equal(x.report.why, "clusters: blocks body need places and bodies of the rows");
    x.options.place = x.place;
    x.options.body = NULL;
    assert_int_equal(solve_with(&x, body), NMM_OK);
    assert_int_equal(x.report.blocks, NMM_BLOCKS_CLUSTER);
    const choice sweeps = {NMM_SOLVE_CHEBYSHEV, NMM_BLOCKS_BODY, NMM_PRECISION_DOUBLE};
    assert_int_equal(solve_with(&x, sweeps), NMM_OK);
    assert_string_equal(x.report.why, "clusters: blocks body are for pcg");
    tear_down(&x);
}

// Hints that are wrong but possible cost iterations, never the answer.
static void test_misleading_hints(void **state) {
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        fixture x;
        set_up_wall(&x, &small_wall);
        nmm_random random = nmm_random_seed(3);
        for (int row = 0; row < 96; row++) {
            if (kind == 0) x.body[row] = (int)(96 * nmm_random_unit(&random));
            if (kind == 1) x.body[row] = 95;
            if (kind == 2) x.place[2 * row] = x.place[2 * row + 1] = 1e99;
            if (kind == 3) x.place[2 * row] = 1e99 * nmm_random_unit(&random);
        }
        const choice c = {NMM_SOLVE_PCG, NMM_BLOCKS_BODY, NMM_PRECISION_DOUBLE};
        assert_int_equal(solve_with(&x, c), NMM_OK);
        assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
        check_promises(&x);
        tear_down(&x);
    }
}

// --- Memory

// Memory that fails at call 0, 1, 2, ... of a solve: told, nothing lost, the next solve is right.
static void test_no_memory(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, &small_wall);
    const size_t size = 2 * (size_t)x.system.K.n_row * sizeof(double);
    int failures = 0;
    for (int k = 0; k < N_CHOICE; k++) {
        assert_int_equal(solve_with(&x, choice_of(k)), NMM_OK);
        memcpy(x.exact, x.u, size);
        for (long at = 0; at < 100; at++) {
            test_failing hook = {.fail_at = -1};
            nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
            nmm_solver *solver = NULL;
            assert_int_equal(nmm_solve_host()->open(&context, &solver, 96, x.system.n_block),
                             NMM_OK);
            hook = (test_failing){.fail_at = at};
            memset(x.u, 0, size);
            nmm_status status = nmm_solve_host()->solve(&context, solver, &x.system.K, x.system.f,
                                                        x.u, false, &x.options, &x.report);
            const bool failed = status != NMM_OK;
            if (failed) assert_int_equal(status, NMM_ERROR_MEMORY);
            failures += failed;
            hook.fail_at = -1;
            // With what is there, as with a pattern that was sent.
            nmm_context_clear(&context);
            memset(x.u, 0, size);
            status = nmm_solve_host()->solve(&context, solver, &x.system.K, x.system.f, x.u, true,
                                             &x.options, &x.report);
            assert_int_equal(status, NMM_OK);
            assert_int_equal(x.report.end, NMM_SOLVE_CONVERGED);
            // Where blocks are chosen the first solve has taught the second.
            if (x.options.blocks != NMM_BLOCKS_AUTO) assert_memory_equal(x.u, x.exact, size);
            nmm_solve_host()->close(&context, &solver);
            assert_int_equal(context.n_live, 0);
            if (!failed) break;
        }
    }
    assert_true(failures > 200);
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_elimination),
        cmocka_unit_test(test_badly_scaled),
        cmocka_unit_test(test_one_scale_for_all),
        cmocka_unit_test(test_iterations_are_limited),
        cmocka_unit_test(test_one_row_and_none),
        cmocka_unit_test(test_mixed_gives_way),
        cmocka_unit_test(test_same_bits_on_threads),
        cmocka_unit_test(test_same_bits_on_processors),
        cmocka_unit_test(test_trouble_has_a_row),
        cmocka_unit_test(test_one_sided_pattern),
        cmocka_unit_test(test_singular_and_indefinite),
        cmocka_unit_test(test_hints_are_checked),
        cmocka_unit_test(test_misleading_hints),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
