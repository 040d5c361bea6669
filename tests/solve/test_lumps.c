// SPDX-License-Identifier: MIT
//
// Sweeps by lumps against those of the dense matrix in its own order, in float64: both halves, with
// a coupling; the order of the waves; the same bits with and without AVX2 and AVX-512.

#include "lumps.h"
#include "solver.h"
#include "systems.h"
#include "test.h"

#include <math.h>
#include <string.h>

enum { N = 24, ROWS = 3 * N, SIZE = 6 * N };

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_lumps lumps;
    int body[ROWS];
    double dense[SIZE][SIZE], scale[SIZE];
} fixture;

static double between(nmm_random *random) {
    return 2 * nmm_random_unit(random) - 1;
}

static bool joined(int a, int b, uint64_t seed) {
    nmm_random random = nmm_random_seed(seed + 1000 * (uint64_t)a + (uint64_t)b);
    return nmm_random_unit(&random) < 0.15;
}

// Lumps with random neighbours; unknowns of scales from 2^-20 to 2^20.
static void set_up(fixture *x, uint64_t seed) {
    *x = (fixture){.context.n_thread = 1};
    nmm_random random = nmm_random_seed(seed);
    for (int i = 0; i < SIZE; i++)
        x->scale[i] = ldexp(1, (int)(nmm_random_next(&random) % 41) - 20);
    for (int i = 0; i < SIZE; i++) {
        for (int j = 0; j <= i; j++) {
            const bool there = i / 6 == j / 6 || joined(j / 6, i / 6, seed);
            const double value = i == j ? 30 : there ? between(&random) : 0;
            x->dense[i][j] = x->dense[j][i] = value * x->scale[i] * x->scale[j];
        }
    }
    triplets list = {0};
    for (int row = 0; row < ROWS; row++) {
        x->body[row] = row / 3;
        for (int col = 0; col < ROWS; col++) {
            const double *a = &x->dense[2 * row][2 * col], *b = &x->dense[2 * row + 1][2 * col];
            const double block[4] = {a[0], a[1], b[0], b[1]};
            if (a[0] != 0) triplets_add(&x->context, &list, row, col, block);
        }
    }
    test_system_build(&x->context, &x->system, &list, ROWS);
    assert_int_equal(nmm_lumps_find(&x->context, &x->lumps, &x->system.K, x->body), NMM_OK);
    assert_true(x->lumps.known);
}

static void tear_down(fixture *x) {
    nmm_lumps_destroy(&x->context, &x->lumps);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

// x of lump `lump` from its diagonal block and the right-hand side b.
static void solve_lump(const fixture *x, int lump, const double *b, double *result) {
    double a[6][7];
    for (int i = 0; i < 6; i++) {
        memcpy(a[i], &x->dense[6 * lump + i][6 * lump], 6 * sizeof(double));
        a[i][6] = b[i];
    }
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 6; i++)
            for (int j = 6; i != k && j >= k; j--)
                a[i][j] -= a[i][k] / a[k][k] * a[k][j];
    for (int i = 0; i < 6; i++)
        result[i] = a[i][6] / a[i][i];
}

// result = (D + L)^-1 b, or (D + U)^-1 b.
static void solve_half(const fixture *x, bool lower, const double *b, double *result) {
    for (int k = 0; k < N; k++) {
        const int lump = lower ? k : N - 1 - k;
        double own[6];
        for (int i = 0; i < 6; i++) {
            own[i] = b[6 * lump + i];
            for (int j = 0; j < SIZE; j++)
                if (lower ? j < 6 * lump : j >= 6 * lump + 6)
                    own[i] -= x->dense[6 * lump + i][j] * result[j];
        }
        solve_lump(x, lump, own, result + 6 * lump);
    }
}

// Numbers of a vector of the lumps in the order of the matrix, and the other way.
static void unload(const fixture *x, const float *from, double *to) {
    memset(to, 0, SIZE * sizeof *to);
    nmm_lumps_fastest()->add(&x->lumps, from, 1, to);
}

static void expect_near(const fixture *x, const double *a, const double *b) {
    for (int i = 0; i < SIZE; i++)
        assert_near(a[i] * x->scale[i], b[i] * x->scale[i], 2e-5);
}

// Terms between pairs of lumps that have a block; some with one half only.
enum { N_TERM = 20 };
typedef struct terms {
    int row[N_TERM][6];
    double push[N_TERM][12], pull[N_TERM][12];
    nmm_coupling coupling;
} terms;

static void make_terms(const fixture *x, terms *t, uint64_t seed) {
    nmm_random random = nmm_random_seed(seed);
    for (int k = 0; k < N_TERM; k++) {
        int a = 0, b = 0;
        while (a == b || x->dense[6 * a][6 * b] == 0) {
            a = (int)(nmm_random_next(&random) % N);
            b = (int)(nmm_random_next(&random) % N);
        }
        for (int i = 0; i < 12; i++) {
            const int row = i < 6 ? 3 * a + i / 2 : 3 * b + (i - 6) / 2;
            const bool zero = (k == 3 && i < 6) || (k == 5 && i >= 6);
            t->row[k][i / 2] = zero ? 0 : row;
            t->push[k][i] = zero ? 0 : between(&random) * x->scale[2 * row + i % 2];
            t->pull[k][i] = zero ? 0 : between(&random) * x->scale[2 * row + i % 2];
        }
    }
    t->coupling = (nmm_coupling){
        .n = N_TERM, .n_row = 6, .row = t->row[0], .push = t->push[0], .pull = t->pull[0]};
}

static void random_vector(const fixture *x, uint64_t seed, double *exact, float *v) {
    nmm_random random = nmm_random_seed(seed);
    for (int i = 0; i < SIZE; i++)
        exact[i] = between(&random) / x->scale[i];
    double of_force[SIZE];
    memset(v, 0, 8 * N * sizeof *v);
    // Loading multiplies by the scale, as forces want; displacements are divided by it.
    for (int i = 0; i < SIZE; i++) {
        const double s = x->lumps.scale[8 * x->lumps.place[i / 6] + i % 6];
        of_force[i] = exact[i] / (s * s);
    }
    const double largest = nmm_lumps_fastest()->load(&x->lumps, of_force, v);
    for (int i = 0; i < SIZE; i++)
        exact[i] /= largest;
}

// K t.
static void multiply(const fixture *x, const double *u, double *product) {
    for (int i = 0; i < SIZE; i++) {
        product[i] = 0;
        for (int j = 0; j < SIZE; j++)
            product[i] += x->dense[i][j] * u[j];
    }
}

// The dense matrix has the terms.
static void add_terms(fixture *x, const terms *t) {
    for (int k = 0; k < N_TERM; k++)
        for (int i = 0; i < 12; i++)
            for (int j = 0; j < 12; j++)
                x->dense[2 * t->row[k][i / 2] + i % 2][2 * t->row[k][j / 2] + j % 2] +=
                    t->push[k][i] * t->pull[k][j];
}

static void take(fixture *x, const nmm_lumps_kernels *kernels, const terms *t) {
    bool fit = false;
    assert_int_equal(nmm_lumps_couple(&x->context, &x->lumps, &t->coupling, &fit), NMM_OK);
    assert_true(fit);
    assert_true(kernels->take(&x->lumps, &x->system.K, &t->coupling));
}

static bool take_without_terms(fixture *x) {
    return nmm_lumps_fastest()->take(&x->lumps, &x->system.K, NULL);
}

static void test_sweeps_are_those_of_the_matrix(void **unused) {
    (void)unused;
    static fixture x;
    for (uint64_t seed = 1; seed < 6; seed++) {
        set_up(&x, seed);
        terms list;
        make_terms(&x, &list, seed + 50);
        // Some turn a diagonal block round.
        if (seed % 2 == 1)
            list.push[0][0] = -80 / list.pull[0][0] * pow(x.scale[2 * list.row[0][0]], 2);
        const nmm_lumps_kernels *kernels = nmm_lumps_fastest();
        // What other terms were there does not count.
        terms others;
        make_terms(&x, &others, seed + 70);
        take(&x, kernels, &others);
        take(&x, kernels, &list);
        add_terms(&x, &list);
        float v[8 * N], t[8 * N], ahead[8 * N], y[8 * N];
        double exact[SIZE], load[SIZE], expected[SIZE], found[SIZE];
        random_vector(&x, seed + 9, exact, v);
        // t = (D + U)^-1 D v
        for (int i = 0; i < SIZE; i++) {
            load[i] = 0;
            for (int j = i / 6 * 6; j < i / 6 * 6 + 6; j++)
                load[i] += x.dense[i][j] * exact[j];
        }
        solve_half(&x, false, load, expected);
        kernels->backward(&x.lumps, v, t);
        unload(&x, t, found);
        expect_near(&x, found, expected);
        // y = (D + L)^-1 K t
        multiply(&x, expected, load);
        solve_half(&x, true, load, expected);
        kernels->forward(&x.lumps, v, t, ahead, y);
        unload(&x, y, found);
        expect_near(&x, found, expected);
        // y = (D + L)^-1 f
        const double largest = nmm_lumps_fastest()->load(&x.lumps, load, v);
        kernels->begin(&x.lumps, v, y);
        unload(&x, y, found);
        for (int i = 0; i < SIZE; i++)
            found[i] *= largest;
        expect_near(&x, found, expected);
        tear_down(&x);
    }
}

static void test_waves_keep_the_order_of_neighbours(void **unused) {
    (void)unused;
    static fixture x;
    set_up(&x, 3);
    for (int i = 0; i < N; i++) {
        assert_int_equal(x.lumps.place[x.lumps.order[i]], i);
        for (int k = x.lumps.before_start[i]; k < x.lumps.before_start[i + 1]; k++) {
            assert_true(x.lumps.before[k] < i);
            assert_true(x.lumps.order[x.lumps.before[k]] < x.lumps.order[i]);
        }
        for (int k = x.lumps.behind_start[i + 1]; k < x.lumps.behind_start[i]; k++) {
            assert_true(x.lumps.behind[k] > i);
            assert_true(x.lumps.order[x.lumps.behind[k]] > x.lumps.order[i]);
        }
    }
    // Rows of another body, or not in threes.
    x.body[4] = 0;
    assert_int_equal(nmm_lumps_find(&x.context, &x.lumps, &x.system.K, x.body), NMM_OK);
    assert_false(x.lumps.known);
    assert_int_equal(nmm_lumps_find(&x.context, &x.lumps, &x.system.K, NULL), NMM_OK);
    assert_false(x.lumps.known);
    tear_down(&x);
}

static void test_same_bits_on_any_processor(void **unused) {
    (void)unused;
    static fixture x;
    float y[3][8 * N], inverse[3][48 * N], basis[3][8 * N];
    double part[3][2], length[3];
    set_up(&x, 4);
    terms list;
    make_terms(&x, &list, 8);
    const nmm_lumps_kernels *const fastest = nmm_lumps_fastest();
    const nmm_lumps_kernels *const kernels[3] = {
        &nmm_lumps_plain, fastest == &nmm_lumps_plain ? fastest : &nmm_lumps_avx2, fastest};
    for (int k = 0; k < 3; k++) {
        float t[8 * N], ahead[8 * N];
        double exact[SIZE];
        memset(x.lumps.scale, 0, 8 * N * sizeof *x.lumps.scale);
        take(&x, kernels[k], &list);
        memcpy(inverse[k], x.lumps.inverse, sizeof inverse[k]);
        random_vector(&x, 5, exact, basis[0]);
        random_vector(&x, 6, exact, basis[1]);
        kernels[k]->backward(&x.lumps, basis[0], t);
        kernels[k]->forward(&x.lumps, basis[0], t, ahead, y[k]);
        kernels[k]->begin(&x.lumps, y[k], basis[2]);
        length[k] = kernels[k]->orthogonalise(basis[0], 2, 8 * N, basis[2], part[k]);
        kernels[k]->scale(basis[2], 8 * N, 1 / length[k]);
        kernels[k]->combine(basis[0], 3, 8 * N, (double[]){part[k][0], part[k][1], 1}, y[k]);
    }
    for (int k = 1; k < 3; k++) {
        assert_memory_equal(inverse[0], inverse[k], sizeof inverse[0]);
        assert_memory_equal(y[0], y[k], sizeof y[0]);
        assert_memory_equal(part[0], part[k], sizeof part[0]);
        assert_true(length[0] == length[k] && length[0] > 0);
    }
    tear_down(&x);
}

// f - K u - extra row by row, to the last bit.
static void test_residual_is_that_of_the_matrix(void **unused) {
    (void)unused;
    static fixture x;
    double f[SIZE], u[SIZE], extra[SIZE], r[SIZE];
    set_up(&x, 4);
    nmm_random random = nmm_random_seed(12);
    for (int i = 0; i < SIZE; i++) {
        f[i] = between(&random);
        u[i] = between(&random);
        extra[i] = between(&random);
    }
    const nmm_bsr *K = &x.system.K;
    const nmm_solver solver = {.n = ROWS,
                               .row_start = K->row_start,
                               .col = K->col,
                               .wide = {.value = K->value, .f = f, .u = u, .r = r}};
    const nmm_lumps_kernels *const kernels[2] = {&nmm_lumps_plain, nmm_lumps_fastest()};
    for (int way = 0; way < 2; way++) {
        kernels[way]->residual(&solver, extra);
        for (int row = 0; row < ROWS; row++) {
            double sum[4] = {0};
            for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
                for (int i = 0; i < 4; i++)
                    sum[i] += K->value[4 * (long)k + i] * u[2 * K->col[k] + i % 2];
            assert_true(r[2 * row] == f[2 * row] - (sum[0] + sum[1]) - extra[2 * row]);
            assert_true(r[2 * row + 1] == f[2 * row + 1] - (sum[2] + sum[3]) - extra[2 * row + 1]);
        }
    }
    tear_down(&x);
}

// What is left over is at right angles to directions of length 1.
static void test_directions_become_orthogonal(void **unused) {
    (void)unused;
    enum { LONG = 8 * 700 };
    static float basis[3][LONG];
    nmm_random random = nmm_random_seed(11);
    const nmm_lumps_kernels *kernels = nmm_lumps_fastest();
    for (int m = 0; m < 3; m++) {
        double part[2] = {0, 0}, square = 0;
        for (int i = 0; i < LONG; i++) {
            basis[m][i] = (float)between(&random);
            square += (double)basis[m][i] * basis[m][i];
        }
        const double length = kernels->orthogonalise(basis[0], m, LONG, basis[m], part);
        for (int j = 0; j < m; j++)
            square -= part[j] * part[j];
        assert_near(length, sqrt(square), 1e-5 * length);
        kernels->scale(basis[m], LONG, 1 / length);
    }
    for (int m = 0; m < 3; m++) {
        for (int k = 0; k <= m; k++) {
            double product = 0;
            for (int i = 0; i < LONG; i++)
                product += (double)basis[m][i] * basis[k][i];
            assert_near(product, m == k, 1e-6);
        }
    }
}

// Numbers that are taken again: those that a first take would find.
static void assert_as_fresh(fixture *x, const nmm_coupling *coupling) {
    enum { MOST = 48 * N * N };
    static float before[MOST], behind[MOST], inverse[48 * N];
    nmm_lumps *lumps = &x->lumps;
    const size_t n_before = 48 * (size_t)lumps->before_start[N] * sizeof(float);
    const size_t n_behind = 48 * (size_t)lumps->behind_start[0] * sizeof(float);
    assert_true(n_before > 0 && n_before <= sizeof before && n_behind <= sizeof behind);
    memcpy(before, lumps->before_value, n_before);
    memcpy(behind, lumps->behind_value, n_behind);
    memcpy(inverse, lumps->inverse, sizeof inverse);
    memset(lumps->scale, 0, 8 * N * sizeof *lumps->scale);
    assert_true(nmm_lumps_fastest()->take(lumps, &x->system.K, coupling));
    assert_memory_equal(before, lumps->before_value, n_before);
    assert_memory_equal(behind, lumps->behind_value, n_behind);
    assert_memory_equal(inverse, lumps->inverse, sizeof inverse);
}

// The lump of the matrix whose block is the first of those before a diagonal block.
static int lump_with_first_block(const fixture *x) {
    int i = 0;
    while (x->lumps.before_start[i + 1] == 0)
        i += 1;
    return x->lumps.order[i];
}

static void test_takes_again_what_has_changed(void **unused) {
    (void)unused;
    static fixture x;
    set_up(&x, 2);
    assert_true(take_without_terms(&x));
    assert_as_fresh(&x, NULL);
    // Other scales of one lump are those of the blocks beside it.
    for (int i = 0; i < 3; i++) {
        double *block = x.system.K.value + 4 * (long)x.system.K.diagonal[3 * 7 + i];
        block[0] *= 64;
        block[3] *= 64;
    }
    assert_true(take_without_terms(&x));
    assert_as_fresh(&x, NULL);
    // What joins two lumps changes with the diagonal blocks of both, here without new scales.
    const int a = 3 * x.lumps.order[x.lumps.before[0]], b = 3 * lump_with_first_block(&x);
    int at = x.system.K.row_start[a];
    while (x.system.K.col[at] != b)
        at += 1;
    x.system.K.value[4 * (long)at] *= 1.5;
    for (at = x.system.K.row_start[b]; x.system.K.col[at] != a;)
        at += 1;
    x.system.K.value[4 * (long)at] *= 1.5;
    x.system.K.value[4 * (long)x.system.K.diagonal[a]] *= 1.001;
    x.system.K.value[4 * (long)x.system.K.diagonal[b]] *= 1.001;
    assert_true(take_without_terms(&x));
    assert_as_fresh(&x, NULL);
    // Where there were terms.
    terms list;
    make_terms(&x, &list, 9);
    bool fit = false;
    take(&x, nmm_lumps_fastest(), &list);
    const nmm_coupling none = {0};
    assert_int_equal(nmm_lumps_couple(&x.context, &x.lumps, &none, &fit), NMM_OK);
    assert_true(take_without_terms(&x));
    assert_as_fresh(&x, NULL);
    // What was found before a take failed counts as well.
    double *first = x.system.K.value + 4 * (long)x.system.K.diagonal[3 * x.lumps.order[0]];
    double *last = x.system.K.value + 4 * (long)x.system.K.diagonal[3 * x.lumps.order[N - 1]];
    const double was = last[0];
    first[0] *= 64;
    last[0] = -was;
    assert_false(take_without_terms(&x));
    last[0] = was;
    assert_true(take_without_terms(&x));
    assert_as_fresh(&x, NULL);
    tear_down(&x);
}

static int count_changed(const nmm_lumps *lumps) {
    int n = 0;
    for (int i = 0; i < N; i++)
        n += lumps->changed[i] != NMM_LUMP_SAME;
    return n;
}

// Terms are the same but for rounding, or other ones: then their two lumps are.
static void test_keeps_what_float32_cannot_tell_from_what_is_there(void **unused) {
    (void)unused;
    static fixture x;
    set_up(&x, 2);
    terms list;
    make_terms(&x, &list, 9);
    take(&x, nmm_lumps_fastest(), &list);
    assert_int_equal(count_changed(&x.lumps), N);
    take(&x, nmm_lumps_fastest(), &list);
    assert_int_equal(count_changed(&x.lumps), 0);
    for (int k = 0; k < N_TERM; k++)
        list.pull[k][2] *= 1 + 1e-12;
    x.system.K.value[4 * (long)x.system.K.diagonal[0]] *= 1 + 1e-12;
    take(&x, nmm_lumps_fastest(), &list);
    assert_int_equal(count_changed(&x.lumps), 0);
    assert_as_fresh(&x, &list.coupling);
    for (int i = 0; i < 12; i++)
        list.pull[0][i] *= 1.01;
    take(&x, nmm_lumps_fastest(), &list);
    assert_int_equal(count_changed(&x.lumps), 2);
    assert_as_fresh(&x, &list.coupling);
    tear_down(&x);
}

// A term that takes a pivot away, and one between lumps that have no block.
static void test_leaves_terms_that_do_not_fit(void **unused) {
    (void)unused;
    static fixture x;
    set_up(&x, 2);
    terms list, none;
    make_terms(&x, &list, 9);
    none = list;
    memset(none.push, 0, sizeof none.push);
    memset(none.pull, 0, sizeof none.pull);
    const int i = 2 * list.row[0][0];
    none.push[0][0] = -x.dense[i][i];
    none.pull[0][0] = 1;
    none.coupling.row = none.row[0];
    none.coupling.push = none.push[0];
    none.coupling.pull = none.pull[0];
    bool fit = false;
    assert_int_equal(nmm_lumps_couple(&x.context, &x.lumps, &none.coupling, &fit), NMM_OK);
    assert_true(fit);
    assert_false(nmm_lumps_fastest()->take(&x.lumps, &x.system.K, &none.coupling));
    none.push[0][0] *= 2;
    take(&x, nmm_lumps_fastest(), &none);
    take(&x, nmm_lumps_fastest(), &list);
    int a = 0, b = 1;
    while (x.dense[6 * a][6 * b] != 0)
        b += 1;
    for (int k = 0; k < 6; k++)
        list.row[1][k] = k < 3 ? 3 * a + k : 3 * b + k - 3;
    assert_int_equal(nmm_lumps_couple(&x.context, &x.lumps, &list.coupling, &fit), NMM_OK);
    assert_false(fit);
    tear_down(&x);
}

static void test_names_a_block_that_is_not_positive(void **unused) {
    (void)unused;
    static fixture x;
    set_up(&x, 2);
    assert_true(take_without_terms(&x));
    double *block = x.system.K.value + 4 * (long)x.system.K.diagonal[3 * 7 + 2];
    const double was = block[3];
    block[3] = -was;
    assert_false(take_without_terms(&x));
    block[3] = was;
    assert_true(take_without_terms(&x));
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sweeps_are_those_of_the_matrix),
        cmocka_unit_test(test_waves_keep_the_order_of_neighbours),
        cmocka_unit_test(test_same_bits_on_any_processor),
        cmocka_unit_test(test_directions_become_orthogonal),
        cmocka_unit_test(test_residual_is_that_of_the_matrix),
        cmocka_unit_test(test_takes_again_what_has_changed),
        cmocka_unit_test(test_keeps_what_float32_cannot_tell_from_what_is_there),
        cmocka_unit_test(test_leaves_terms_that_do_not_fit),
        cmocka_unit_test(test_names_a_block_that_is_not_positive),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
