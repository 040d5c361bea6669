// SPDX-License-Identifier: MIT
//
// Nested dissection by places: stages hold each row once, what comes last separates the rest, and
// places that tell nothing do no harm.

#include "dissect.h"
#include "systems.h"
#include "test.h"

#include <string.h>

typedef struct fixture {
    nmm_context context;
    test_system system;
    double *place; // [n_row][2]
    nmm_dissect_room room;
    nmm_stages stages;
    int *part; // [n_row] scratch
} fixture;

// To be called once x->system is there.
static void add_places(fixture *x) {
    const size_t n = (size_t)x->system.K.n_row;
    assert_int_equal(nmm_allocate(&x->context, &x->place, n, 2 * sizeof *x->place), NMM_OK);
    assert_int_equal(nmm_allocate(&x->context, &x->part, n, sizeof *x->part), NMM_OK);
}

static void set_up_grid(fixture *x, int n_side, double width, double height) {
    *x = (fixture){.context.n_thread = 1};
    test_system_grid(&x->context, &x->system, n_side);
    add_places(x);
    for (int row = 0; row < n_side * n_side; row++) {
        x->place[2 * row] = width * (row % n_side);
        x->place[2 * row + 1] = height * (row / n_side);
    }
}

static void set_up_random(fixture *x, int n_row, int per_row) {
    *x = (fixture){.context.n_thread = 1};
    test_system_random(&x->context, &x->system, n_row, per_row, 4);
    add_places(x);
    nmm_random random = nmm_random_seed(6);
    for (int i = 0; i < 2 * n_row; i++)
        x->place[i] = nmm_random_unit(&random);
}

static void tear_down(fixture *x) {
    nmm_dissect_release(&x->context, &x->room);
    nmm_release(&x->context, &x->place);
    nmm_release(&x->context, &x->part);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

// Stages that hold each row once.
static void dissect(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    assert_int_equal(
        nmm_dissect(&x->context, &x->room, K->n_row, K->row_start, K->col, x->place, &x->stages),
        NMM_OK);
    memset(x->part, 0, (size_t)K->n_row * sizeof(int));
    assert_int_equal(x->stages.start[0], 0);
    for (int k = 0; k < x->stages.n; k++) {
        assert_true(x->stages.start[k + 1] > x->stages.start[k]);
        for (int i = x->stages.start[k]; i < x->stages.start[k + 1]; i++) {
            assert_in_range(x->stages.row[i], 0, K->n_row - 1);
            assert_int_equal(x->part[x->stages.row[i]]++, 0);
        }
    }
    assert_int_equal(x->stages.start[x->stages.n], K->n_row);
}

static int root_of(const int *part, int row) {
    while (part[row] != row)
        row = part[row];
    return row;
}

// Rows of the largest piece that is left when those of the last stage are taken out.
static int largest_piece(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    const int last = x->stages.start[x->stages.n - 1];
    int *part = x->part, most = 0;
    for (int i = 0; i < K->n_row; i++)
        part[x->stages.row[i]] = i < last ? x->stages.row[i] : -1;
    for (int row = 0; row < K->n_row; row++)
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            if (part[row] >= 0 && part[K->col[k]] >= 0)
                part[root_of(part, K->col[k])] = root_of(part, row);
    int *count = NULL;
    assert_int_equal(nmm_allocate(&x->context, &count, (size_t)K->n_row, sizeof *count), NMM_OK);
    for (int row = 0; row < K->n_row; row++)
        if (part[row] >= 0) most = nmm_max_int(most, ++count[root_of(part, row)]);
    nmm_release(&x->context, &count);
    return most;
}

// A line of a grid, near its middle, whatever the scale and the proportions.
static void test_grid(void **state) {
    (void)state;
    const double width[] = {1, 1e-90, 100, 1}, height[] = {1, 1e-90, 1, 1e98};
    for (int k = 0; k < 4; k++) {
        fixture x;
        set_up_grid(&x, 40, width[k], height[k]);
        dissect(&x);
        const int last = x.stages.start[x.stages.n - 1];
        assert_true(x.stages.n >= 7);
        assert_int_equal(x.system.K.n_row - last, 40);
        assert_in_range(largest_piece(&x), 740, 1000);
        tear_down(&x);
    }
}

// No line separates what is joined at random, and none those of one place; few rows need none.
static void test_nothing_to_cut(void **state) {
    (void)state;
    fixture x;
    set_up_random(&x, 1500, 6);
    dissect(&x);
    assert_int_equal(x.stages.n, 1);
    tear_down(&x);
    set_up_grid(&x, 40, 0, 0);
    dissect(&x);
    assert_int_equal(x.stages.n, 1);
    tear_down(&x);
    set_up_random(&x, 1, 2);
    dissect(&x);
    assert_int_equal(x.stages.n, 1);
    tear_down(&x);
}

// Rows that nothing joins are cut without a line.
static void test_loose_rows(void **state) {
    (void)state;
    fixture x;
    set_up_random(&x, 3000, 0);
    dissect(&x);
    assert_true(x.stages.n >= 6);
    tear_down(&x);
}

static void test_no_memory(void **state) {
    (void)state;
    fixture x;
    set_up_grid(&x, 30, 1, 1);
    const nmm_bsr *K = &x.system.K;
    nmm_context own = x.context;
    test_failing hook = {.fail_at = 0};
    x.context.allocate = test_failing_hook;
    x.context.user = &hook;
    assert_int_equal(
        nmm_dissect(&x.context, &x.room, K->n_row, K->row_start, K->col, x.place, &x.stages),
        NMM_ERROR_MEMORY);
    x.context.allocate = own.allocate;
    nmm_context_clear(&x.context);
    dissect(&x);
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_nothing_to_cut),
        cmocka_unit_test(test_loose_rows),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
