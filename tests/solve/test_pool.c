// SPDX-License-Identifier: MIT
//
// Places that are taken and given back: never two blocks at one place, always the lowest place that
// is free; by several threads at once, too.

#include "pool.h"
#include "test.h"

enum { MOST = 40, LARGEST = 1000, TEAM = 4, EACH = 9 };

typedef struct fixture {
    nmm_context context;
    nmm_pool pool;
} fixture;

static void set_up(fixture *x) {
    *x = (fixture){0};
    assert_int_equal(nmm_pool_reserve(&x->context, &x->pool, MOST), NMM_OK);
}

static void tear_down(fixture *x) {
    nmm_pool_release(&x->context, &x->pool);
    assert_int_equal(x->context.n_live, 0);
}

// Sizes 4, 6, 3: the gap that 6 leaves takes 5 and 1, but no 7.
static void test_places(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    assert_int_equal(nmm_pool_take(&x.pool, 4), 0);
    assert_int_equal(nmm_pool_take(&x.pool, 6), 4);
    assert_int_equal(nmm_pool_take(&x.pool, 3), 10);
    nmm_pool_give(&x.pool, 4);
    assert_int_equal(nmm_pool_take(&x.pool, 7), 13);
    assert_int_equal(nmm_pool_take(&x.pool, 5), 4);
    assert_int_equal(nmm_pool_take(&x.pool, 1), 9);
    nmm_pool_give(&x.pool, 0);
    assert_int_equal(nmm_pool_take(&x.pool, 4), 0);
    nmm_pool_clear(&x.pool);
    assert_int_equal(nmm_pool_take(&x.pool, 100), 0);
    tear_down(&x);
}

// Places by a table of who has which number.
static void test_random(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    static int owner[MOST * LARGEST];
    long first[MOST], size[MOST] = {0};
    nmm_random random = nmm_random_seed(5);
    for (int turn = 0; turn < 4000; turn++) {
        const int k = (int)(nmm_random_next(&random) % MOST);
        if (size[k] > 0) {
            nmm_pool_give(&x.pool, first[k]);
            for (long i = 0; i < size[k]; i++)
                owner[first[k] + i] = 0;
            size[k] = 0;
            continue;
        }
        size[k] = 1 + (long)(nmm_random_next(&random) % LARGEST);
        first[k] = nmm_pool_take(&x.pool, size[k]);
        assert_in_range(first[k] + size[k], 0, MOST * LARGEST);
        for (long i = 0; i < size[k]; i++) {
            assert_int_equal(owner[first[k] + i], 0);
            owner[first[k] + i] = k + 1;
        }
        // No lower gap would do.
        for (long i = 0, gap = 0; i < first[k]; i++) {
            gap = owner[i] == 0 ? gap + 1 : 0;
            assert_true(gap < size[k]);
        }
    }
    tear_down(&x);
}

// Blocks of different sizes, all of one turn at a time.
static long size_of(int turn, int k) {
    return 1 + (7 * turn + 131 * k) % LARGEST;
}

// Nobody writes where another one does.
static void test_threads(void **state) {
    (void)state;
    fixture x;
    set_up(&x);
    static int owner[MOST * LARGEST];
    int wrong = 0;
#pragma omp parallel for num_threads(TEAM) schedule(dynamic, 1) reduction(+ : wrong)
    for (int turn = 1; turn <= 400; turn++) {
        long first[EACH];
        for (int k = 0; k < EACH; k++) {
            first[k] = nmm_pool_take(&x.pool, size_of(turn, k));
            for (long i = 0; i < size_of(turn, k); i++)
                owner[first[k] + i] = EACH * turn + k;
        }
        for (int k = EACH - 1; k >= 0; k--) {
            for (long i = 0; i < size_of(turn, k); i++)
                wrong += owner[first[k] + i] != EACH * turn + k;
            nmm_pool_give(&x.pool, first[k]);
        }
    }
    assert_int_equal(wrong, 0);
    assert_int_equal(x.pool.n_used, 0);
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
