// SPDX-License-Identifier: MIT
//
// The coarse correction: parts of bodies, the projected matrix against the dense triple product,
// its factor and the solve, motions that move nothing, and what the correction promises: a residual
// on which no rigid motion of a part does work.

#include "solver.h"
#include "systems.h"
#include "test.h"

// The solve is one of the kernels' texts; these are the words it is written in.
typedef double wide_lanes __attribute__((vector_size(32)));
typedef float lanes_narrow __attribute__((vector_size(16)));
#include "coarse_solve.inl"

typedef struct fixture {
    nmm_context context;
    test_system system;
    double *place; // [n_row][2]
    int *body;     // [n_row]
    nmm_coarse coarse;
    nmm_coarse_source source;
} fixture;

static void allocate(fixture *x, void *block, long count, size_t size) {
    assert_int_equal(nmm_allocate(&x->context, block, (size_t)count, size), NMM_OK);
}

// x->system is there: take it as it is, rows in the caller's order.
static void take(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    allocate(x, &x->place, K->n_row, 2 * sizeof(double));
    allocate(x, &x->body, K->n_row, sizeof(int));
    x->source = (nmm_coarse_source){.n = K->n_row,
                                    .n_thread = 1,
                                    .row_start = K->row_start,
                                    .col = K->col,
                                    .value = K->value,
                                    .place = x->place,
                                    .body = x->body};
}

static void set_up_wall(fixture *x, int n_across, int n_up, int n_node, double courant) {
    const rock wall = {.n_across = n_across,
                       .n_up = n_up,
                       .n_node = n_node,
                       .courant = courant,
                       .spring = 50,
                       .seed = 3};
    *x = (fixture){.context.n_thread = 1};
    test_system_rock(&x->context, &x->system, &wall);
    take(x);
    for (int row = 0; row < x->system.K.n_row; row++) {
        const int block = row / (n_node * n_node);
        x->body[row] = block;
        x->place[2 * row] = block % n_across * (n_node - 1) + row % n_node;
        x->place[2 * row + 1] = block / n_across * (n_node - 1) + row / n_node % n_node;
    }
}

// Rows at random places, in bodies at random.
static void set_up_random(fixture *x, int n_row, int n_body, uint64_t seed) {
    *x = (fixture){.context.n_thread = 1};
    test_system_random(&x->context, &x->system, n_row, 3, seed);
    take(x);
    nmm_random random = nmm_random_seed(seed);
    for (int row = 0; row < n_row; row++) {
        x->body[row] = (int)(nmm_random_unit(&random) * n_body);
        x->place[2 * row] = nmm_random_unit(&random);
        x->place[2 * row + 1] = 3 * nmm_random_unit(&random);
    }
}

static void make(fixture *x) {
    assert_int_equal(nmm_coarse_divide(&x->context, &x->coarse, &x->source), NMM_OK);
    nmm_variant_serial.make_coarse(&x->coarse, &x->source);
}

static void tear_down(fixture *x) {
    nmm_coarse_destroy(&x->context, &x->coarse);
    nmm_release(&x->context, &x->place);
    nmm_release(&x->context, &x->body);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

// --- Parts

static int row_of(const fixture *x, int i) {
    return x->source.order != NULL ? x->source.order[i] : i;
}

// Every row in one part, no part empty or of two bodies; arms from the middle of their part.
static void check_parts(const fixture *x) {
    const nmm_coarse *c = &x->coarse;
    int found = 0;
    for (int i = 0; i < x->source.n; i++)
        assert_int_equal(c->part[i] >= 0, row_of(x, i) >= 0);
    double square = 0;
    assert_int_equal(c->start[0], 0);
    for (int p = 0; p < c->n_part; p++) {
        assert_true(c->start[p + 1] > c->start[p]);
        const double *origin = x->place + 2 * (long)row_of(x, c->row[c->start[p]]);
        const double *from = c->arm + 2 * (long)c->row[c->start[p]];
        double sum[2] = {0};
        for (int k = c->start[p]; k < c->start[p + 1]; k++) {
            const int i = c->row[k];
            assert_int_equal(c->part[i], p);
            assert_int_equal(x->body[row_of(x, i)], x->body[row_of(x, c->row[c->start[p]])]);
            for (int a = 0; a < 2; a++) {
                const double apart = x->place[2 * (long)row_of(x, i) + a] - origin[a];
                assert_near((c->arm[2 * (long)i + a] - from[a]) * c->length, apart, 1e-12);
                sum[a] += c->arm[2 * (long)i + a];
                square += c->arm[2 * (long)i + a] * c->arm[2 * (long)i + a];
            }
        }
        assert_near(sum[0], 0, 1e-10);
        assert_near(sum[1], 0, 1e-10);
        found += c->start[p + 1] - c->start[p];
    }
    assert_int_equal(found, x->system.K.n_row);
    if (square > 0) assert_close(square, (double)found, 1e-9);
}

static void test_parts(void **state) {
    (void)state;
    fixture x;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        set_up_random(&x, 1 + (int)(7 * seed % 83), 1 + (int)(seed % 9), seed);
        make(&x);
        check_parts(&x);
        tear_down(&x);
    }
    // A large body is divided, each part about as large as the next.
    set_up_wall(&x, 1, 1, 40, 1);
    make(&x);
    check_parts(&x);
    assert_in_range(x.coarse.n_part, 40, 400);
    for (int p = 0; p < x.coarse.n_part; p++)
        assert_in_range(x.coarse.start[p + 1] - x.coarse.start[p], 2, 40);
    tear_down(&x);
    set_up_wall(&x, 4, 3, 3, 1);
    make(&x);
    check_parts(&x);
    assert_int_equal(x.coarse.n_part, 12);
    tear_down(&x);
}

// --- The projected matrix and its factor

// Motion m of a part at row i: its move along axis a.
static double motion(const fixture *x, int i, int m, int a) {
    const nmm_coarse *c = &x->coarse;
    if (c->part[i] != m / 3) return 0;
    if (m % 3 < 2) return m % 3 == a ? 1 : 0;
    return a == 0 ? -c->arm[2 * (long)i + 1] : c->arm[2 * (long)i];
}

// P^T K P, dense, [3 n_part][3 n_part].
static double *triple_product(fixture *x) {
    const nmm_coarse_source *s = &x->source;
    const int n = 3 * x->coarse.n_part;
    double *a = NULL;
    allocate(x, &a, (long)n * n, sizeof *a);
    for (int i = 0; i < s->n; i++) {
        for (int k = s->row_start[i]; k < s->row_start[i + 1]; k++) {
            const int j = s->col[k], p = 3 * x->coarse.part[i], q = 3 * x->coarse.part[j];
            for (int e = 0; e < 36; e++) {
                const int l = p + e / 12, m = q + e / 4 % 3;
                a[(long)l * n + m] += motion(x, i, l, e / 2 % 2) * s->value[4 * (long)k + e % 4] *
                                      motion(x, j, m, e % 2);
            }
        }
    }
    return a;
}

static double entry_of_factor(const nmm_coarse *c, int i, int j) {
    if (j > i || j < c->first[i]) return 0;
    if (j == i) return c->inverse[i] > 0 ? 1 / c->inverse[i] / c->unit : 0;
    return c->factor[c->offset[i] + j];
}

// L L^T = P^T K P; motions that move nothing drop out of both.
static void check_factor(fixture *x) {
    const nmm_coarse *c = &x->coarse;
    const int n = 3 * c->n_part;
    double *a = triple_product(x);
    for (int i = 0; i < n; i++) {
        assert_in_range(c->first[i], 0, i);
        for (int j = 0; j <= i; j++) {
            double sum = 0;
            for (int k = 0; k <= j; k++)
                sum += entry_of_factor(c, i, k) * entry_of_factor(c, j, k);
            const double size = sqrt(a[(long)i * n + i] * a[(long)j * n + j]);
            assert_near(sum, a[(long)i * n + j], 1e-9 * size);
        }
        for (int j = c->first[i]; j < i; j++)
            assert_near(c->lower[c->offset[i] + j], c->unit * c->factor[c->offset[i] + j],
                        6e-8 * fabs(c->unit * c->factor[c->offset[i] + j]));
    }
    nmm_release(&x->context, &a);
}

static void test_factor(void **state) {
    (void)state;
    fixture x;
    for (uint64_t seed = 1; seed <= 25; seed++) {
        set_up_random(&x, 1 + (int)(13 * seed % 97), 1 + (int)(seed % 7), seed);
        make(&x);
        check_factor(&x);
        tear_down(&x);
    }
    set_up_wall(&x, 4, 3, 4, 1);
    make(&x);
    check_factor(&x);
    // New values in the same parts.
    for (int i = 0; i < 4 * x.system.n_block; i++)
        x.system.K.value[i] *= 3;
    nmm_variant_serial.make_coarse(&x.coarse, &x.source);
    check_factor(&x);
    tear_down(&x);
}

// In the order of clusters, with empty rows among them.
static void test_in_order_of_clusters(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, 3, 3, 3, 1);
    nmm_clusters clusters = {0};
    assert_int_equal(nmm_clusters_find(&x.context, &clusters, &x.system.K), NMM_OK);
    int *row_start = NULL, *col = NULL;
    double *value = NULL;
    x.source.n = NMM_GROUP * clusters.n_group;
    allocate(&x, &row_start, x.source.n + 1, sizeof(int));
    allocate(&x, &col, x.system.n_block, sizeof(int));
    allocate(&x, &value, x.system.n_block, 4 * sizeof(double));
    nmm_clusters_pattern(&clusters, &x.system.K, row_start, col);
    nmm_clusters_take(&clusters, &x.system.K, 1, value);
    x.source.order = clusters.order;
    x.source.row_start = row_start;
    x.source.col = col;
    x.source.value = value;
    assert_true(x.source.n > x.system.K.n_row);
    make(&x);
    check_parts(&x);
    assert_int_equal(x.coarse.n_part, 9);
    check_factor(&x);
    nmm_release(&x.context, &row_start);
    nmm_release(&x.context, &col);
    nmm_release(&x.context, &value);
    nmm_clusters_destroy(&x.context, &clusters);
    tear_down(&x);
}

// --- The correction

// load = P^T r.
static void restrict_to(fixture *x, const double *r) {
    nmm_coarse *c = &x->coarse;
    for (int m = 0; m < 3 * c->n_part; m++) {
        c->load[m] = 0;
        for (int k = c->start[m / 3]; k < c->start[m / 3 + 1]; k++)
            for (int a = 0; a < 2; a++)
                c->load[m] += motion(x, c->row[k], m, a) * r[2 * (long)c->row[k] + a];
    }
}

// Residual after one correction from u = 0; every motion's work on it, over that before.
static double work_left(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    nmm_coarse *c = &x->coarse;
    double *u = NULL, *r = NULL;
    allocate(x, &u, K->n_row, 2 * sizeof *u);
    allocate(x, &r, K->n_row, 2 * sizeof *r);
    restrict_to(x, x->system.f);
    double before = 0, after = 0;
    for (int m = 0; m < 3 * c->n_part; m++)
        before = nmm_max(before, fabs(c->load[m]));
    solve_coarse(c);
    for (int m = 0; m < 3 * c->n_part; m++)
        for (int k = c->start[m / 3]; k < c->start[m / 3 + 1]; k++)
            for (int a = 0; a < 2; a++)
                u[2 * (long)c->row[k] + a] += motion(x, c->row[k], m, a) * c->move[m];
    for (int i = 0; i < K->n_row; i++) {
        for (int a = 0; a < 2; a++) {
            double sum = x->system.f[2 * i + a];
            for (int k = K->row_start[i]; k < K->row_start[i + 1]; k++)
                for (int b = 0; b < 2; b++)
                    sum -= K->value[4 * (long)k + 2 * a + b] * u[2 * (long)K->col[k] + b];
            r[2 * i + a] = sum;
        }
    }
    restrict_to(x, r);
    for (int m = 0; m < 3 * c->n_part; m++)
        after = nmm_max(after, fabs(c->load[m]));
    nmm_release(&x->context, &u);
    nmm_release(&x->context, &r);
    return after / before;
}

static void test_residual_does_no_work(void **state) {
    (void)state;
    fixture x;
    for (uint64_t seed = 1; seed <= 25; seed++) {
        set_up_random(&x, 1 + (int)(13 * seed % 97), 1 + (int)(seed % 7), seed);
        make(&x);
        assert_true(work_left(&x) < 1e-5);
        tear_down(&x);
    }
    set_up_wall(&x, 5, 4, 5, 3);
    make(&x);
    assert_true(work_left(&x) < 1e-4);
    tear_down(&x);
}

// A matrix of any scale has the same correction over the scale, to the bit: float32 never sees it.
static void test_any_scale(void **state) {
    (void)state;
    const int exponent[] = {-900, -300, 200, 300, 900};
    for (int k = 0; k < 5; k++) {
        fixture x;
        set_up_wall(&x, 5, 4, 4, 1);
        make(&x);
        restrict_to(&x, x.system.f);
        solve_coarse(&x.coarse);
        const int n = 3 * x.coarse.n_part;
        double *move = NULL;
        allocate(&x, &move, n, sizeof *move);
        memcpy(move, x.coarse.move, (size_t)n * sizeof *move);
        for (int i = 0; i < 4 * x.system.n_block; i++)
            x.system.K.value[i] = ldexp(x.system.K.value[i], exponent[k]);
        nmm_variant_serial.make_coarse(&x.coarse, &x.source);
        solve_coarse(&x.coarse);
        for (int i = 0; i < n; i++)
            assert_true(ldexp(x.coarse.move[i], exponent[k]) == move[i]);
        nmm_release(&x.context, &move);
        tear_down(&x);
    }
}

// A chain of ten thousand pairs of rows, each a body; springs between them.
static void test_many_bodies(void **state) {
    (void)state;
    enum { N_BODY = 10000 };
    fixture x = {.context.n_thread = 1};
    triplets list = {0};
    for (int i = 0; i < 2 * N_BODY; i++) {
        const double there[4] = {2.1, 0.5, 0.5, 2.2}, across[4] = {-1, -0.25, -0.25, -1};
        triplets_add(&x.context, &list, i, i, there);
        if (i + 1 < 2 * N_BODY) triplets_add(&x.context, &list, i, i + 1, across);
        if (i > 0) triplets_add(&x.context, &list, i, i - 1, across);
    }
    test_system_build(&x.context, &x.system, &list, 2 * N_BODY);
    take(&x);
    for (int i = 0; i < 2 * N_BODY; i++) {
        // Bodies numbered out of order.
        x.body[i] = (int)(7919L * (i / 2) % N_BODY);
        x.place[2 * i] = i;
        x.place[2 * i + 1] = i % 2;
        x.system.f[2 * i] = i % 5 - 2;
        x.system.f[2 * i + 1] = i % 3;
    }
    make(&x);
    check_parts(&x);
    assert_int_equal(x.coarse.n_part, N_BODY);
    // The order of the parts keeps neighbours together: three unknowns to the left of each part.
    assert_true(x.coarse.n_factor <= 6L * 3 * N_BODY);
    assert_true(work_left(&x) < 1e-5);
    tear_down(&x);
}

// --- Motions that move nothing

static void test_idle_motions(void **state) {
    (void)state;
    // Bodies of one row; all rows of a body at one place; a row on a line, which can turn.
    for (int kind = 0; kind < 4; kind++) {
        fixture x;
        set_up_random(&x, 12, 1, 5);
        for (int i = 0; i < 12; i++) {
            x.body[i] = kind == 0 ? i : i / 4;
            x.place[2 * i] = kind == 3 ? 0 : i;
            x.place[2 * i + 1] = kind == 3 ? i : 0;
            if (kind == 1) x.place[2 * i] = 7;
        }
        make(&x);
        check_parts(&x);
        check_factor(&x);
        const double left = work_left(&x);
        assert_true(left < 1e-5);
        for (int p = 0; p < x.coarse.n_part; p++) {
            const bool turns = kind >= 2;
            assert_int_equal(x.coarse.inverse[3 * p + 2] > 0, turns);
            if (!turns) assert_near(x.coarse.move[3 * p + 2], 0, 0);
            assert_true(x.coarse.inverse[3 * p] > 0 && x.coarse.inverse[3 * p + 1] > 0);
        }
        tear_down(&x);
    }
}

// Two bodies, nothing holds the second against a turn: K is singular, the factor is not a NaN.
static void test_singular(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    triplets list = {0};
    const double k[4] = {1, 0, 0, 1}, minus[4] = {-1, 0, 0, -1};
    for (int i = 0; i < 5; i++) {
        triplets_add(&x.context, &list, i, i, k);
        triplets_add(&x.context, &list, i + 1, i + 1, k);
        triplets_add(&x.context, &list, i, i + 1, minus);
        triplets_add(&x.context, &list, i + 1, i, minus);
    }
    test_system_build(&x.context, &x.system, &list, 6);
    take(&x);
    for (int i = 0; i < 6; i++) {
        x.body[i] = i / 3;
        x.place[2 * i] = i;
        x.system.f[2 * i] = i - 2.5;
    }
    make(&x);
    check_factor(&x);
    // A load without resultant can be carried all the same.
    assert_true(work_left(&x) < 1e-6);
    // The last translation along each axis is that of all the bodies.
    assert_near(x.coarse.inverse[3], 0, 0);
    assert_near(x.coarse.inverse[4], 0, 0);
    tear_down(&x);
}

// --- Bits and memory

static void test_same_bits(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, 5, 4, 4, 1);
    make(&x);
    const size_t n_factor = (size_t)x.coarse.n_factor, n = 3 * (size_t)x.coarse.n_part;
    uint64_t first = 0;
    const nmm_variant *const variant[] = {&nmm_variant_serial, &nmm_variant_threads,
                                          &nmm_variant_serial_avx2, &nmm_variant_threads_avx2};
    for (int k = 0; k < (test_has_avx2() ? 4 : 2); k++) {
        for (int n_thread = 1; n_thread <= (k % 2 == 1 ? 7 : 1); n_thread += 2) {
            x.source.n_thread = n_thread;
            memset(x.coarse.factor, 1, n_factor * sizeof(double));
            variant[k]->make_coarse(&x.coarse, &x.source);
            uint64_t hash = nmm_hash(NMM_HASH_START, x.coarse.factor, n_factor * sizeof(double));
            hash = nmm_hash(hash, x.coarse.inverse, n * sizeof(double));
            if (first == 0) first = hash;
            assert_true(hash == first);
        }
    }
    tear_down(&x);
}

static void test_no_memory(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, 3, 2, 3, 1);
    int failures = 0;
    for (long at = 0; at == failures; at++) {
        test_failing hook = {.fail_at = at};
        nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
        nmm_coarse coarse = {0};
        const nmm_status status = nmm_coarse_divide(&context, &coarse, &x.source);
        failures += status != NMM_OK;
        if (status != NMM_OK) assert_int_equal(status, NMM_ERROR_MEMORY);
        // Once more with what is left of it.
        hook.fail_at = -1;
        nmm_context_clear(&context);
        assert_int_equal(nmm_coarse_divide(&context, &coarse, &x.source), NMM_OK);
        nmm_coarse_destroy(&context, &coarse);
        assert_int_equal(context.n_live, 0);
    }
    assert_true(failures >= 14);
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parts),
        cmocka_unit_test(test_factor),
        cmocka_unit_test(test_in_order_of_clusters),
        cmocka_unit_test(test_residual_does_no_work),
        cmocka_unit_test(test_any_scale),
        cmocka_unit_test(test_many_bodies),
        cmocka_unit_test(test_idle_motions),
        cmocka_unit_test(test_singular),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
