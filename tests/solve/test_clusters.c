// SPDX-License-Identifier: MIT
//
// Clusters of rows and their dense inverses: every row has one place, groups are full enough, stiff
// pairs fall inside a group, the matrix in the new order is the old one, inverses are inverses, the
// same bits from every variant, and only what changed is made again.

#include "solver.h"
#include "systems.h"
#include "test.h"

#define DENSE ((long)NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS)

// A system, its clusters, and what is made from them.
typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_clusters clusters;
    int *row_start, *col;
    double *value, *scale;
    float *dense;
} fixture;

static void allocate(fixture *x, void *block, long count, size_t size) {
    assert_int_equal(nmm_allocate(&x->context, block, (size_t)count, size), NMM_OK);
}

// Clusters of x->system.
static void find(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    const int room = nmm_clusters_room(K->n_row);
    allocate(x, &x->row_start, room + 1, sizeof(int));
    allocate(x, &x->col, x->system.n_block, sizeof(int));
    allocate(x, &x->value, x->system.n_block, 4 * sizeof(double));
    allocate(x, &x->scale, room / NMM_GROUP, sizeof(double));
    allocate(x, &x->dense, room / NMM_GROUP * DENSE, sizeof(float));
    assert_int_equal(nmm_clusters_find(&x->context, &x->clusters, K), NMM_OK);
    nmm_clusters_pattern(&x->clusters, K, x->row_start, x->col);
    nmm_clusters_take(&x->clusters, K, 1, x->value);
}

static int invert(fixture *x, const nmm_variant *variant, int n_thread, bool keep) {
    nmm_clusters_take(&x->clusters, &x->system.K, n_thread, x->value);
    return variant->invert(&x->clusters, x->row_start, x->col, x->value, n_thread, keep, x->dense,
                           x->scale);
}

static void tear_down(fixture *x) {
    nmm_clusters_destroy(&x->context, &x->clusters);
    nmm_release(&x->context, &x->row_start);
    nmm_release(&x->context, &x->col);
    nmm_release(&x->context, &x->value);
    nmm_release(&x->context, &x->scale);
    nmm_release(&x->context, &x->dense);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static void set_up_random(fixture *x, int n_row, int per_row, uint64_t seed) {
    *x = (fixture){.context.n_thread = 1};
    test_system_random(&x->context, &x->system, n_row, per_row, seed);
    find(x);
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
    find(x);
}

// A spring between two rows: [k -k; -k k] on both axes.
static void add_spring(fixture *x, triplets *list, int i, int j, double k) {
    const double there[4] = {k, 0, 0, k}, across[4] = {-k, 0, 0, -k};
    triplets_add(&x->context, list, i, i, there);
    triplets_add(&x->context, list, j, j, there);
    triplets_add(&x->context, list, i, j, across);
    triplets_add(&x->context, list, j, i, across);
}

static void add_ground(fixture *x, triplets *list, int n_row, double k) {
    const double there[4] = {k, 0, 0, k};
    for (int row = 0; row < n_row; row++)
        triplets_add(&x->context, list, row, row, there);
}

static int group_of(const fixture *x, int row) {
    return x->clusters.place[row] / NMM_GROUP;
}

// --- Groups

// Every row in one place, rows ascending from the front of a group, groups by their lowest row, all
// groups but one hold at least 5 rows.
static void check_groups(const fixture *x) {
    const nmm_clusters *c = &x->clusters;
    const int n_row = x->system.K.n_row;
    assert_true(c->n_group * NMM_GROUP <= nmm_clusters_room(n_row));
    int found = 0, small = 0, lowest = -1;
    for (int g = 0; g < c->n_group; g++) {
        const int *order = c->order + (long)g * NMM_GROUP;
        int size = 0;
        while (size < NMM_GROUP && order[size] >= 0) {
            assert_in_range(order[size], 0, n_row - 1);
            assert_int_equal(c->place[order[size]], g * NMM_GROUP + size);
            if (size > 0) assert_true(order[size] > order[size - 1]);
            size++;
        }
        for (int k = size; k < NMM_GROUP; k++)
            assert_int_equal(order[k], -1);
        assert_in_range(size, 1, NMM_GROUP);
        assert_true(order[0] > lowest);
        lowest = order[0];
        found += size;
        small += size < 5;
    }
    assert_int_equal(found, n_row);
    assert_true(small <= 1);
}

static void test_every_row_has_one_place(void **state) {
    (void)state;
    fixture x;
    for (int n_row = 1; n_row <= 40; n_row++) {
        for (int per_row = 0; per_row <= 4; per_row++) {
            // Without couplings as well: rows are packed all the same.
            set_up_random(&x, n_row, per_row, (uint64_t)(7 * n_row + per_row));
            check_groups(&x);
            if (per_row == 0) assert_int_equal(x.clusters.n_group, (n_row + 7) / 8);
            tear_down(&x);
        }
    }
    for (int n_node = 2; n_node <= 6; n_node++) {
        set_up_wall(&x, 4, 3, n_node, 1);
        check_groups(&x);
        tear_down(&x);
    }
}

static void test_no_rows(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    int none = 0;
    x.system.K.row_start = &none;
    find(&x);
    assert_int_equal(x.clusters.n_group, 0);
    assert_int_equal(x.row_start[0], 0);
    x.system.K.row_start = NULL;
    tear_down(&x);
}

// Weak chain in order of rows; stiff pairs of rows that are far apart.
static void test_stiff_pairs_share_a_group(void **state) {
    (void)state;
    enum { N_ROW = 60 };
    for (uint64_t seed = 1; seed <= 20; seed++) {
        fixture x = {.context.n_thread = 1};
        triplets list = {0};
        nmm_random random = nmm_random_seed(seed);
        int row[N_ROW];
        for (int i = 0; i < N_ROW; i++) {
            const int j = (int)(nmm_random_unit(&random) * (i + 1));
            row[i] = row[j];
            row[j] = i;
        }
        add_ground(&x, &list, N_ROW, 1);
        for (int i = 0; i + 1 < N_ROW; i++)
            add_spring(&x, &list, i, i + 1, 1e-2);
        for (int i = 0; i + 1 < N_ROW; i += 2)
            add_spring(&x, &list, row[i], row[i + 1], 1e6);
        test_system_build(&x.context, &x.system, &list, N_ROW);
        find(&x);
        check_groups(&x);
        for (int i = 0; i + 1 < N_ROW; i += 2)
            assert_int_equal(group_of(&x, row[i]), group_of(&x, row[i + 1]));
        tear_down(&x);
    }
}

// Eight rows that hold together become a group of their own, whatever lies between; scaling of the
// rows by powers of two changes nothing.
static void test_eights(void **state) {
    (void)state;
    enum { N_SET = 6, N_ROW = 8 * N_SET };
    for (int scaled = 0; scaled < 2; scaled++) {
        fixture x = {.context.n_thread = 1};
        triplets list = {0};
        add_ground(&x, &list, N_ROW, 1);
        for (int i = 0; i < N_ROW; i++)
            for (int j = 0; j < i; j++)
                add_spring(&x, &list, i, j, i % N_SET == j % N_SET ? 1 : 1e-3);
        test_system_build(&x.context, &x.system, &list, N_ROW);
        double scale[2 * N_ROW];
        for (int i = 0; i < 2 * N_ROW; i++)
            scale[i] = ldexp(1, scaled * (7 * (i / 2) % 41 - 20));
        test_system_scale(&x.system, scale);
        find(&x);
        assert_int_equal(x.clusters.n_group, N_SET);
        for (int i = 0; i < N_ROW; i++)
            assert_int_equal(group_of(&x, i), i % N_SET);
        tear_down(&x);
    }
}

// Along a stiff chain of 16 with one weak link the cut is at the link.
static void test_cut_at_the_weak_link(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    triplets list = {0};
    add_ground(&x, &list, 16, 1);
    for (int i = 0; i + 1 < 16; i++)
        add_spring(&x, &list, i, i + 1, i == 7 ? 1 : 100);
    test_system_build(&x.context, &x.system, &list, 16);
    find(&x);
    assert_int_equal(x.clusters.n_group, 2);
    for (int i = 0; i < 16; i++)
        assert_int_equal(group_of(&x, i), i / 8);
    tear_down(&x);
}

// --- The matrix in the new order

// P K P^T entry by entry.
static void check_order(const fixture *x) {
    const nmm_bsr *K = &x->system.K;
    const nmm_clusters *c = &x->clusters;
    int n = 0;
    for (int p = 0; p < c->n_group * NMM_GROUP; p++) {
        const int row = c->order[p];
        assert_int_equal(x->row_start[p], n);
        if (row < 0) assert_int_equal(c->diagonal[p], -1);
        for (int k = row < 0 ? 0 : K->row_start[row]; row >= 0 && k < K->row_start[row + 1]; k++) {
            assert_in_range(x->col[n], 0, c->n_group * NMM_GROUP - 1);
            assert_int_equal(c->order[x->col[n]], K->col[k]);
            assert_memory_equal(x->value + 4 * (long)n, K->value + 4 * (long)k, 4 * sizeof(double));
            if (K->col[k] == row) assert_int_equal(c->diagonal[p], n);
            n++;
        }
    }
    assert_int_equal(x->row_start[c->n_group * NMM_GROUP], n);
    assert_int_equal(n, x->system.n_block);
}

static void test_new_order(void **state) {
    (void)state;
    fixture x;
    for (int n_row = 1; n_row <= 60; n_row += 3) {
        set_up_random(&x, n_row, 3, (uint64_t)n_row);
        check_order(&x);
        tear_down(&x);
    }
    set_up_wall(&x, 3, 2, 5, 1);
    for (int n_thread = 1; n_thread <= 3; n_thread++) {
        memset(x.value, 0, 4 * (size_t)x.system.n_block * sizeof(double));
        nmm_clusters_take(&x.clusters, &x.system.K, n_thread, x.value);
        check_order(&x);
    }
    tear_down(&x);
}

// --- Inverses

static double entry_of(const nmm_bsr *K, int row, int col, int i, int j) {
    for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
        if (K->col[k] == col) return K->value[4 * (long)k + 2 * i + j];
    return 0;
}

// The block of a group, straight from the caller's matrix; 0 for empty places.
static void block_of(const fixture *x, int group, bool apart, double *a) {
    const int *order = x->clusters.order + (long)group * NMM_GROUP;
    for (int i = 0; i < NMM_GROUP_UNKNOWNS; i++) {
        for (int j = 0; j < NMM_GROUP_UNKNOWNS; j++) {
            const int row = order[i / 2], col = order[j / 2];
            const bool there = row >= 0 && col >= 0 && (!apart || row == col);
            a[NMM_GROUP_UNKNOWNS * i + j] =
                there ? entry_of(&x->system.K, row, col, i % 2, j % 2) : 0;
        }
    }
}

// dense * scale is the inverse of the block, or of its 2x2 blocks apart, each product within the
// rounding of its terms to float32.
static void check_inverse(const fixture *x, int group, bool apart) {
    enum { N = NMM_GROUP_UNKNOWNS };
    double a[N * N];
    block_of(x, group, apart, a);
    const float *d = x->dense + group * DENSE;
    for (int i = 0; i < N; i++) {
        const bool there = a[N * i + i] > 0;
        for (int j = 0; j < N; j++) {
            assert_true(d[N * i + j] == d[N * j + i]);
            if (!there) assert_true(d[N * i + j] == 0);
            double sum = 0, size = 0;
            for (int k = 0; k < N; k++) {
                const double term = a[N * i + k] * (double)d[N * k + j] * x->scale[group];
                sum += term;
                size += fabs(term);
            }
            assert_near(sum, there && i == j ? 1 : 0, 1e-7 * size);
        }
    }
}

static void test_inverses(void **state) {
    (void)state;
    fixture x;
    for (int n_row = 1; n_row <= 60; n_row += 7) {
        set_up_random(&x, n_row, 3, (uint64_t)n_row);
        // Scales of rows and of the whole matter little.
        double scale[2 * 60];
        for (int i = 0; i < 2 * n_row; i++)
            scale[i] = ldexp(1, 50 - i / 2 % 9);
        test_system_scale(&x.system, scale);
        assert_int_equal(invert(&x, &nmm_variant_serial, 1, false), x.clusters.n_group);
        for (int g = 0; g < x.clusters.n_group; g++)
            check_inverse(&x, g, false);
        tear_down(&x);
    }
    set_up_wall(&x, 3, 2, 5, 1);
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, false), x.clusters.n_group);
    for (int g = 0; g < x.clusters.n_group; g++)
        check_inverse(&x, g, false);
    tear_down(&x);
}

// A group of eight rows joined by springs, on ground `soft`, and one as it should be.
static void set_up_two_groups(fixture *x, double soft, int row, int col, const double more[4]) {
    *x = (fixture){.context.n_thread = 1};
    triplets list = {0};
    add_ground(x, &list, 16, soft);
    const double strong[4] = {1e3, 0, 0, 1e3};
    for (int i = 8; i < 16; i++)
        triplets_add(&x->context, &list, i, i, strong);
    for (int i = 0; i < 16; i++)
        for (int j = i / 8 * 8; j < i; j++)
            add_spring(x, &list, i, j, 1);
    triplets_add(&x->context, &list, row, col, more);
    if (row != col) triplets_add(&x->context, &list, col, row, more);
    test_system_build(&x->context, &x->system, &list, 16);
    find(x);
    assert_int_equal(x->clusters.n_group, 2);
    assert_int_equal(invert(x, &nmm_variant_serial, 1, false), 2);
}

// Blocks that are not positive definite, or whose 2x2 blocks are nearly singular, fall apart into
// these; other groups do not.
static void test_bad_pivots(void **state) {
    (void)state;
    fixture x;
    const double pair[4] = {-20, 0, 0, -20}, flat[4] = {0, 8, 8, 1e-12};
    set_up_two_groups(&x, 1, 2, 5, pair);
    check_inverse(&x, 0, true);
    check_inverse(&x, 1, false);
    tear_down(&x);
    set_up_two_groups(&x, 1, 3, 3, flat);
    check_inverse(&x, 1, false);
    for (long i = 0; i < DENSE; i++)
        assert_true(isfinite(x.dense[i]));
    tear_down(&x);
}

// x . dense x over the largest entry of dense, for x = 1 -1 0 0 ... on the first axis.
static double stiff_part(const fixture *x, int group) {
    const float *d = x->dense + group * DENSE;
    const int i = NMM_GROUP_UNKNOWNS;
    return ((double)d[0] - d[2] - d[2 * i] + d[2 * i + 2]) / d[0];
}

// Springs on ground so soft that float32 cannot tell 1 from 1 + soft: stiffened, and positive in
// the stiff direction as well. By the closed form for 8 rows, with d = 7 + soft + stiffening of it,
// the inverse has 1 / (d + 1) there, and 1 / (d - 7) for a move of all.
static void test_stiffened(void **state) {
    (void)state;
    const double none[4] = {0};
    for (int k = 0; k <= 14; k++) {
        fixture x;
        const double soft = pow(10, -k);
        set_up_two_groups(&x, soft, 0, 0, none);
        const double added = k < 7 ? 0 : 1e-6 * (7 + soft), d = 7 + soft + added;
        const double stiff = 1 / (d + 1), all = 1 / (d - 7);
        const double first = stiff + (all - stiff) / 8;
        assert_close(x.dense[0] * x.scale[0], first, 1e-6);
        assert_close(stiff_part(&x, 0), 2 * stiff / first, 2e-7 * first / stiff);
        assert_true(stiff_part(&x, 0) > 0);
        tear_down(&x);
    }
}

// Plain, AVX2, one thread, several: the same bits.
static void test_same_bits(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, 3, 3, 6, 1);
    // Bad pivots among them.
    for (int i = 0; i < 4; i++)
        x.system.K.value[4 * (long)x.system.K.row_start[30] + i] *= 100;
    const size_t n_dense = (size_t)(x.clusters.n_group * DENSE) * sizeof(float);
    const size_t n_scale = (size_t)x.clusters.n_group * sizeof(double);
    uint64_t first = 0;
    const nmm_variant *const variant[] = {&nmm_variant_serial, &nmm_variant_threads,
                                          &nmm_variant_serial_avx2, &nmm_variant_threads_avx2};
    for (int k = 0; k < (test_has_avx2() ? 4 : 2); k++) {
        for (int n_thread = 1; n_thread <= (k % 2 == 1 ? 7 : 1); n_thread += 2) {
            memset(x.dense, 1, n_dense);
            assert_int_equal(invert(&x, variant[k], n_thread, false), x.clusters.n_group);
            uint64_t hash = nmm_hash(NMM_HASH_START, x.dense, n_dense);
            hash = nmm_hash(hash, x.scale, n_scale);
            if (first == 0) first = hash;
            assert_true(hash == first);
        }
    }
    tear_down(&x);
}

// What is kept, and what is made again.
static void test_keep(void **state) {
    (void)state;
    fixture x;
    set_up_wall(&x, 3, 2, 5, 1);
    nmm_bsr *K = &x.system.K;
    const int n_group = x.clusters.n_group;
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, false), n_group);
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, true), 0);
    // A little, even time after time, is nothing until it adds up.
    double *diagonal = K->value + 4 * (long)K->diagonal[17];
    float before[NMM_GROUP_UNKNOWNS * NMM_GROUP_UNKNOWNS];
    memcpy(before, x.dense + group_of(&x, 17) * DENSE, sizeof before);
    diagonal[3] *= 1.02;
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, true), 0);
    assert_memory_equal(before, x.dense + group_of(&x, 17) * DENSE, sizeof before);
    diagonal[3] *= 1.02;
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, true), 1);
    check_inverse(&x, group_of(&x, 17), false);
    // Springs that open count as those that close; two groups of many, on threads.
    int other = 0;
    while (group_of(&x, other) == group_of(&x, 17))
        other++;
    diagonal[0] *= 0.9;
    K->value[4 * (long)K->diagonal[other] + 3] *= 10;
    assert_int_equal(invert(&x, &nmm_variant_threads, 3, true), 2);
    check_inverse(&x, group_of(&x, 17), false);
    check_inverse(&x, group_of(&x, other), false);
    // All of it when nothing is to be kept.
    assert_int_equal(invert(&x, &nmm_variant_serial, 1, false), n_group);
    tear_down(&x);
}

// --- Memory

static void test_no_memory(void **state) {
    (void)state;
    int failures = 0;
    for (long at = 0;; at++) {
        test_failing hook = {.fail_at = at};
        nmm_context context = {.n_thread = 1, .allocate = test_failing_hook, .user = &hook};
        nmm_clusters clusters = {0};
        nmm_status status = nmm_clusters_reserve(&context, &clusters, 30, 200);
        failures += status != NMM_OK;
        if (status != NMM_OK) assert_int_equal(status, NMM_ERROR_MEMORY);
        // Once more from where it failed, then larger.
        hook.fail_at = -1;
        nmm_context_clear(&context);
        assert_int_equal(nmm_clusters_reserve(&context, &clusters, 30, 200), NMM_OK);
        const long calls = context.n_call;
        assert_int_equal(nmm_clusters_reserve(&context, &clusters, 29, 199), NMM_OK);
        assert_int_equal(context.n_call, calls);
        assert_int_equal(nmm_clusters_reserve(&context, &clusters, 31, 20), NMM_OK);
        assert_true(context.n_call > calls);
        nmm_clusters_destroy(&context, &clusters);
        assert_int_equal(context.n_live, 0);
        if (status == NMM_OK) break;
    }
    assert_int_equal(failures, 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_row_has_one_place),
        cmocka_unit_test(test_no_rows),
        cmocka_unit_test(test_stiff_pairs_share_a_group),
        cmocka_unit_test(test_eights),
        cmocka_unit_test(test_cut_at_the_weak_link),
        cmocka_unit_test(test_new_order),
        cmocka_unit_test(test_inverses),
        cmocka_unit_test(test_bad_pivots),
        cmocka_unit_test(test_stiffened),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_keep),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
