// SPDX-License-Identifier: MIT
//
// The sparse factor by itself: what an order and fronts must be for any pattern, sizes known in
// closed form, the numbers against Cholesky's method on the dense matrix, the same bits on any
// processor, new patterns in old memory.

#include "solver.h"
#include "systems.h"
#include "test.h"

#include <stdlib.h>

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_factor factor;
} fixture;

static void tear_down(fixture *x) {
    nmm_factor_destroy(&x->context, &x->factor);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

static void set_up_random(fixture *x, int n_row, int per_row, uint64_t seed) {
    *x = (fixture){.context.n_thread = 1};
    test_system_random(&x->context, &x->system, n_row, per_row, seed);
}

static void set_up_rock(fixture *x, int n_across, int n_up, double courant) {
    *x = (fixture){.context.n_thread = 1};
    test_system_wall(&x->context, &x->system, n_across, n_up, courant);
}

static void share(fixture *x, int n_thread) {
    assert_int_equal(nmm_factor_reserve(&x->context, &x->factor, n_thread), NMM_OK);
}

static void analyse(fixture *x) {
    assert_int_equal(nmm_factor_analyse(&x->context, &x->factor, &x->system.K, NULL), NMM_OK);
    share(x, 1);
}

// --- Shape

static void expect_permutation(const nmm_factor *f) {
    for (int k = 0; k < f->n_row; k++) {
        assert_in_range(f->order[k], 0, f->n_row - 1);
        assert_int_equal(f->rank[f->order[k]], k);
    }
}

// Fronts: each row a pivot once; children first; rows below ascending, above the pivots, and all of
// them in the parent's front, where `place` says.
static void expect_fronts(const nmm_factor *f) {
    int next = 0;
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        assert_int_equal(front->first, next);
        assert_true(front->n_pivot >= 1);
        next += front->n_pivot;
        assert_true(front->parent == -1 ? front->n_row == 0 : front->parent > i);
        for (int k = 0; k < front->n_row; k++) {
            const int row = f->row[front->row + k], place = f->place[front->row + k];
            assert_in_range(row, k > 0 ? f->row[front->row + k - 1] + 1 : next, f->n_row - 1);
            const nmm_front *p = &f->front[front->parent];
            assert_in_range(place, 0, p->n_pivot + p->n_row - 1);
            const int there =
                place < p->n_pivot ? p->first + place : f->row[p->row + place - p->n_pivot];
            assert_int_equal(there, row);
        }
        for (int c = front->child; c >= 0; c = f->front[c].sibling)
            assert_int_equal(f->front[c].parent, i);
    }
    assert_int_equal(next, f->n_row);
}

// Where what is left of a front waits, if parts take turns with the stacks of the threads.
static double *rest_of(const nmm_factor *f, const nmm_front *front, int kind) {
    const nmm_factor_stack *stack = &f->stack[kind];
    const int thread = front->part < 0 ? 0 : front->part % f->n_thread;
    return stack->number + (front->kept ? 0 : stack->n_kept + thread * stack->n_own) +
           front->rest[kind];
}

// Matrices that a part leaves for another one have their places only while they wait.
static void take_place(nmm_factor *f, nmm_front *front) {
    if (!front->kept || front->part < 0) return;
    front->rest[0] = f->stack[0].n_top + nmm_pool_take(&f->pool, nmm_front_rest(front, 0));
}

static void give_places(nmm_factor *f, const nmm_front *front) {
    for (int c = front->child; c >= 0 && front->part >= 0; c = f->front[c].sibling)
        if (f->front[c].kept) nmm_pool_give(&f->pool, f->front[c].rest[0] - f->stack[0].n_top);
}

// The front finds what its children left, and leaves its own number.
static void pass_front(nmm_factor *f, int i, int kind) {
    nmm_front *front = &f->front[i];
    if (kind == 0) take_place(f, front);
    for (int c = front->child; c >= 0; c = f->front[c].sibling) {
        const nmm_front *child = &f->front[c];
        for (long k = 0; k < nmm_front_rest(child, kind); k++)
            assert_true(rest_of(f, child, kind)[k] == c);
    }
    const long n = nmm_front_rest(front, kind);
    double *rest = rest_of(f, front, kind);
    const nmm_factor_stack *stack = &f->stack[kind];
    assert_in_range(rest + n - stack->number, 0, stack->n_kept + f->n_thread * stack->n_own);
    for (long k = 0; k < n; k++)
        rest[k] = i;
    if (kind == 0) give_places(f, front);
}

static void pass_part(nmm_factor *f, const nmm_factor_part *part, int kind) {
    for (int i = part->first; i < part->end; i++)
        pass_front(f, i, kind);
}

// What is left of a front stays until its parent takes it, whichever order the parts come in: as
// they are numbered, or first those that wait for no others, backwards.
static void expect_stacks(nmm_factor *f) {
    for (int kind = 0; kind < 2; kind++) {
        for (int pass = 0; pass < 2; pass++) {
            nmm_pool_clear(&f->pool);
            for (int k = f->n_part - 1; pass == 1 && k >= 0; k--)
                if (f->part[k].n_below == 0) pass_part(f, &f->part[k], kind);
            for (int k = 0; k < f->n_part; k++)
                if (pass == 0 || f->part[k].n_below > 0) pass_part(f, &f->part[k], kind);
            for (int k = 0; k < f->n_top; k++)
                pass_front(f, f->top[k], kind);
        }
    }
}

// Each front is in one part or in the top; what leaves a part goes to the one above it or to the
// top; parts wait for as many as they have below, and come before the one above.
static void expect_shares(const nmm_factor *f) {
    int n = f->n_top, n_below = 0, n_above = 0;
    for (int k = 0; k < f->n_part; k++) {
        const nmm_factor_part *part = &f->part[k];
        n += part->end - part->first;
        n_below += part->n_below;
        n_above += part->above >= 0;
        assert_true(k == 0 || part->path <= f->part[k - 1].path);
        assert_true(part->above < 0 || part->above > k);
        assert_true(part->n_below == 0 || part->end == part->first + 1);
        for (int i = part->first; i < part->end; i++)
            assert_int_equal(f->front[i].part, k);
    }
    assert_int_equal(n_below, n_above);
    assert_int_equal(n, f->n_front);
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        const int above = front->parent < 0 ? -1 : f->front[front->parent].part;
        assert_true(above == front->part || front->part < 0 || above == f->part[front->part].above);
        assert_true(front->part >= 0 || above < 0);
    }
}

// No two fronts have numbers of the factor in common.
static void expect_apart(fixture *x) {
    nmm_factor *f = &x->factor;
    memset(f->value, 0, (size_t)f->n_value * sizeof *f->value);
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        const long n = 2 * front->n_pivot, m = front->padded;
        assert_true(m % 4 == 0 && m >= 2 * front->n_row && m < 2 * front->n_row + 4);
        assert_int_equal((front->column + n) % 4, 0);
        assert_int_equal(front->stride % 4, 0);
        assert_in_range(front->column + (n - 1) * front->stride + n + m, 0, f->n_value);
        for (long j = 0; j < n; j++) {
            double *column = f->value + front->column + j * front->stride;
            for (long k = 0; k < n + m; k++) {
                assert_true(column[k] == 0);
                column[k] = 1;
            }
        }
    }
}

static void expect_shape(fixture *x) {
    expect_permutation(&x->factor);
    expect_fronts(&x->factor);
    expect_apart(x);
    for (int n_thread = 1; n_thread <= 5; n_thread++) {
        share(x, n_thread);
        expect_shares(&x->factor);
        expect_stacks(&x->factor);
    }
}

static void test_shape(void **state) {
    (void)state;
    for (int n = 1; n <= 400; n += n < 12 ? 1 : 37) {
        for (int per_row = 0; per_row <= 4; per_row++) {
            fixture x;
            set_up_random(&x, n, per_row, 7 * (uint64_t)n + (uint64_t)per_row);
            analyse(&x);
            expect_shape(&x);
            tear_down(&x);
        }
    }
    fixture x;
    set_up_rock(&x, 7, 5, 1);
    analyse(&x);
    expect_shape(&x);
    tear_down(&x);
}

// The rows of a star are eliminated before its middle, without fill but for what joining fronts
// adds: 7 numbers for a row by itself, and 400 with all rows in one front.
static void test_star(void **state) {
    (void)state;
    enum { N = 200, MIDDLE = 70 };
    fixture x = {.context.n_thread = 1};
    test_system_star(&x.context, &x.system, N, MIDDLE, 0.01);
    analyse(&x);
    assert_true(x.factor.rank[MIDDLE] >= N - 2);
    assert_in_range(x.factor.n_number, 7 * (N - 1), 50 * N);
    tear_down(&x);
}

// Grids: the fill of good orders grows as n log n; 31 n log2 n / 4 numbers of 1x1 blocks is
// George's bound for nested dissection (SIAM J. Numer. Anal. 10, 1973), 4 numbers to a block here.
static void test_grid(void **state) {
    (void)state;
    for (int n_side = 8; n_side <= 64; n_side *= 2) {
        fixture x = {.context.n_thread = 1};
        test_system_grid(&x.context, &x.system, n_side);
        analyse(&x);
        const double n = n_side * n_side;
        assert_true(x.factor.n_number <= 4 * 31.0 / 4 * n * log2(n));
        // Rows in a row would take n_side blocks for each.
        if (n_side >= 32) assert_true(x.factor.n_number < 0.6 * 4 * n * n_side);
        tear_down(&x);
    }
}

// Places make the factor of a large system smaller, and the work of two threads even.
static void test_places(void **state) {
    (void)state;
    enum { SIDE = 26, NODES = 5 };
    fixture x;
    set_up_rock(&x, SIDE, SIDE, 1);
    const nmm_bsr *K = &x.system.K;
    double *place = NULL;
    assert_int_equal(nmm_allocate(&x.context, &place, (size_t)K->n_row, 2 * sizeof *place), NMM_OK);
    for (int row = 0; row < K->n_row; row++) {
        const int block = row / (NODES * NODES), node = row % (NODES * NODES);
        place[2 * row] = (NODES - 1) * (block % SIDE) + node % NODES;
        place[2 * row + 1] = (NODES - 1) * (block / SIDE) + node / NODES;
    }
    assert_int_equal(nmm_factor_analyse(&x.context, &x.factor, K, NULL), NMM_OK);
    const double without = x.factor.work;
    x.factor.n_row = -1;
    assert_int_equal(nmm_factor_analyse(&x.context, &x.factor, K, place), NMM_OK);
    expect_permutation(&x.factor);
    expect_fronts(&x.factor);
    assert_true(x.factor.work < 0.85 * without);
    assert_int_equal(nmm_factor_share(&x.context, &x.factor, 2), NMM_OK);
    assert_true(x.factor.time < 0.55 * x.factor.work);
    expect_shares(&x.factor);
    nmm_release(&x.context, &place);
    tear_down(&x);
}

// The same pattern gives the same order, and is recognised; another one is not.
static void test_known(void **state) {
    (void)state;
    fixture x, y;
    set_up_rock(&x, 3, 3, 1);
    set_up_rock(&y, 3, 3, 0);
    assert_false(nmm_factor_knows(&x.factor, &x.system.K));
    analyse(&x);
    analyse(&y);
    assert_memory_equal(x.factor.order, y.factor.order, (size_t)x.factor.n_row * sizeof(int));
    assert_true(nmm_factor_knows(&x.factor, &y.system.K));
    const long calls = x.context.n_call;
    analyse(&x);
    assert_int_equal(x.context.n_call, calls);
    // Another column, the same counts.
    nmm_bsr *K = &y.system.K;
    K->col[K->row_start[5]] += 1000;
    assert_false(nmm_factor_knows(&x.factor, K));
    K->col[K->row_start[5]] -= 1000;
    tear_down(&y);
    tear_down(&x);
}

// --- Numbers

// The dense matrix in the order of the factor, and its Cholesky factor.
static double *dense_factor(fixture *x) {
    const nmm_bsr *K = &x->system.K;
    const int *rank = x->factor.rank, n = 2 * K->n_row;
    double *a = NULL;
    assert_int_equal(nmm_allocate(&x->context, &a, (size_t)n * (size_t)n, sizeof *a), NMM_OK);
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++)
            for (int i = 0; i < 4; i++)
                a[(2 * rank[row] + i / 2) * n + 2 * rank[K->col[k]] + i % 2] = K->value[4 * k + i];
    }
    for (int j = 0; j < n; j++) {
        for (int i = j; i < n; i++) {
            double sum = a[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= a[i * n + k] * a[j * n + k];
            a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
        }
    }
    return a;
}

// Every number of the dense factor is in the sparse one, or below `tolerance`.
static void expect_factor(const nmm_factor *f, double *dense, double tolerance) {
    const int n = 2 * f->n_row;
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        for (int j = 0; j < 2 * front->n_pivot; j++) {
            const double *column = f->value + front->column + (long)j * front->stride;
            for (int k = j; k < 2 * (front->n_pivot + front->n_row); k++) {
                const int block = k / 2 - front->n_pivot;
                const int row = block < 0 ? front->first + k / 2 : f->row[front->row + block];
                double *d = &dense[(2 * row + k % 2) * n + 2 * front->first + j];
                assert_near(k == j ? 1 / column[k] : column[k], *d, tolerance);
                *d = 0;
            }
        }
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++)
            assert_near(dense[i * n + j], 0, tolerance);
}

static void test_numbers(void **state) {
    (void)state;
    for (int n = 1; n <= 140; n += n < 20 ? 1 : 40) {
        for (int per_row = 1; per_row <= 5; per_row += 2) {
            fixture x;
            set_up_random(&x, n, per_row, 100 + (uint64_t)(n * per_row));
            analyse(&x);
            double *dense = dense_factor(&x);
            assert_int_equal(nmm_factor_plain.make(&x.factor, x.system.K.value), -1);
            expect_factor(&x.factor, dense, 1e-11);
            nmm_release(&x.context, &dense);
            tear_down(&x);
        }
    }
}

// Kernels of this processor.
static int list_kernels(const nmm_factor_kernels *kernels[3]) {
    int n = 0;
    kernels[n++] = &nmm_factor_plain;
    if (test_has_avx2()) kernels[n++] = &nmm_factor_avx2;
    if (nmm_factor_fastest() == &nmm_factor_avx512) kernels[n++] = &nmm_factor_avx512;
    return n;
}

// A factor and a solution, to be compared.
typedef struct numbers {
    double *value, *z;
    int trouble;
} numbers;

// From memory that holds no numbers.
static void make_numbers(fixture *x, const nmm_factor_kernels *kernels, int n_thread, numbers *to) {
    nmm_factor *f = &x->factor;
    share(x, n_thread);
    memset(f->value, 0xff, (size_t)f->n_value * sizeof(double));
    for (int k = 0; k < 2; k++) {
        const long n = f->stack[k].n_kept + n_thread * f->stack[k].n_own;
        memset(f->stack[k].number, 0xff, (size_t)n * sizeof(double));
    }
    const size_t n = 2 * (size_t)f->n_row;
    assert_int_equal(nmm_allocate(&x->context, &to->value, (size_t)f->n_value, sizeof(double)),
                     NMM_OK);
    assert_int_equal(nmm_allocate(&x->context, &to->z, n, sizeof(double)), NMM_OK);
    to->trouble = kernels->solve(f, x->system.K.value, x->system.f, to->z);
    if (n_thread == 2) assert_int_equal(kernels->make(f, x->system.K.value), to->trouble);
    if (to->trouble >= 0) return;
    // In two passes the same bits.
    double *again = NULL;
    assert_int_equal(nmm_allocate(&x->context, &again, n, sizeof(double)), NMM_OK);
    kernels->apply(f, x->system.f, again);
    assert_memory_equal(again, to->z, n * sizeof(double));
    nmm_release(&x->context, &again);
    memcpy(to->value, f->value, (size_t)f->n_value * sizeof(double));
}

static void release_numbers(fixture *x, numbers *a) {
    nmm_release(&x->context, &a->value);
    nmm_release(&x->context, &a->z);
}

static void expect_same(const nmm_factor *f, const numbers *a, const numbers *b) {
    assert_int_equal(a->trouble, b->trouble);
    if (a->trouble >= 0) return;
    for (int i = 0; i < f->n_front; i++) {
        const nmm_front *front = &f->front[i];
        const size_t rows = 2 * (size_t)(front->n_pivot + front->n_row);
        for (int j = 0; j < 2 * front->n_pivot; j++) {
            const long at = front->column + (long)j * front->stride + j;
            assert_memory_equal(a->value + at, b->value + at, (rows - (size_t)j) * sizeof(double));
        }
    }
    assert_memory_equal(a->z, b->z, 2 * (size_t)f->n_row * sizeof(double));
}

// Any kernels on so many threads: the same bits, or the same row in trouble.
static void expect_same_bits_on(fixture *x, int most_threads) {
    const nmm_factor_kernels *kernels[3];
    const int n = list_kernels(kernels);
    numbers first = {0};
    analyse(x);
    make_numbers(x, kernels[0], 1, &first);
    if (first.trouble < 0) assert_true(test_true_residual(&x->system, first.z) < 1e-8);
    for (int k = 0; k < n; k++) {
        for (int n_thread = 1; n_thread <= most_threads; n_thread += n_thread < 3 ? 1 : 3) {
            numbers other = {0};
            make_numbers(x, kernels[k], n_thread, &other);
            expect_same(&x->factor, &first, &other);
            release_numbers(x, &other);
        }
    }
    release_numbers(x, &first);
}

static void expect_same_bits(fixture *x) {
    expect_same_bits_on(x, 3);
}

// Parts that wait for others.
static int count_waiting(const nmm_factor *f) {
    int n = 0;
    for (int k = 0; k < f->n_part; k++)
        n += f->part[k].n_below > 0;
    return n;
}

static void test_same_bits(void **state) {
    (void)state;
    fixture x;
    for (int n = 1; n <= 130; n += n < 8 ? 1 : 61) {
        // From rows by themselves, which are zero, to a matrix that is nearly full.
        for (int per_row = 0; per_row <= 64; per_row = 4 * per_row + 1) {
            set_up_random(&x, n, per_row, 300 + (uint64_t)(n * per_row));
            expect_same_bits(&x);
            tear_down(&x);
        }
    }
    set_up_rock(&x, 11, 10, 1);
    expect_same_bits(&x);
    // Something to share for three.
    assert_true(count_waiting(&x.factor) > 3 && x.factor.n_part > 6);
    tear_down(&x);
    // Fronts that threads share, above others that wait.
    set_up_rock(&x, 16, 15, 1);
    expect_same_bits_on(&x, 6);
    assert_true(x.factor.n_top > 2 && count_waiting(&x.factor) > 3);
    tear_down(&x);
    // One front, so large that threads share its columns in the solution as well.
    set_up_random(&x, 260, 40, 17);
    expect_same_bits(&x);
    assert_true(x.factor.n_top > 0 && x.factor.front[x.factor.n_front - 1].n_pivot > 200);
    tear_down(&x);
}

// Two such fronts, which do not need each other, below another one.
static void test_same_bits_of_large_fronts(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    test_system_lumps(&x.context, &x.system, 3, 240, 60);
    x.system.f[5] = 1;
    expect_same_bits(&x);
    share(&x, 8);
    assert_true(x.factor.n_top > 2);
    assert_int_equal(x.factor.round_start[1], 2);
    tear_down(&x);
}

// Nothing joins some parts to others; a tree without branches; one with many leaves.
static void test_same_bits_of_graphs(void **state) {
    (void)state;
    fixture x = {.context.n_thread = 1};
    const rock loose = {.n_across = 40, .n_up = 1, .n_node = 5, .courant = 1, .seed = 3};
    test_system_rock(&x.context, &x.system, &loose);
    expect_same_bits(&x);
    tear_down(&x);
    test_system_chain(&x.context, &x.system, 3000, true);
    memset(x.system.f, 0, 6000 * sizeof(double));
    x.system.f[77] = 1;
    expect_same_bits(&x);
    tear_down(&x);
    test_system_star(&x.context, &x.system, 500, 3, 0.02);
    x.system.f[7] = 1;
    expect_same_bits(&x);
    tear_down(&x);
}

// A front so large that its columns are eliminated in several strips, with pivots in trouble here
// and there.
static void test_same_trouble(void **state) {
    (void)state;
    for (int k = 0; k < 12; k++) {
        fixture x;
        set_up_random(&x, 260, 40, 17);
        for (int row = 5 + 20 * k; row < 260; row += 19)
            x.system.K.value[4 * x.system.K.diagonal[row] + 3] *= k % 3 == 0 ? -1 : 1e-9;
        if (k == 11) x.system.K.value[4 * x.system.K.diagonal[130]] = NAN;
        expect_same_bits(&x);
        tear_down(&x);
    }
}

// A pivot in the middle of this front.
static void expect_same_trouble_in(fixture *x, int i, int most_threads) {
    const nmm_front *front = &x->factor.front[i];
    const int row = x->factor.order[front->first + front->n_pivot / 2];
    double *d = &x->system.K.value[4 * x->system.K.diagonal[row]];
    d[0] = -d[0];
    expect_same_bits_on(x, most_threads);
    d[0] = -d[0];
}

// The same in fronts that wait for others, and in those that threads share.
static void test_same_trouble_at_the_top(void **state) {
    (void)state;
    fixture x;
    set_up_rock(&x, 9, 8, 1);
    analyse(&x);
    share(&x, 3);
    assert_true(count_waiting(&x.factor) > 8);
    for (int k = 0; k < x.factor.n_part; k += 7) {
        expect_same_trouble_in(&x, x.factor.part[k].end - 1, 3);
        share(&x, 3);
    }
    tear_down(&x);
    set_up_random(&x, 260, 40, 17);
    analyse(&x);
    share(&x, 3);
    assert_true(x.factor.n_top > 0);
    expect_same_trouble_in(&x, x.factor.top[x.factor.n_top - 1], 6);
    tear_down(&x);
}

// The pivot that is not positive is named, wherever in a front it is.
static void test_pivots(void **state) {
    (void)state;
    for (int row = 0; row < 48; row++) {
        fixture x;
        set_up_random(&x, 48, 3, 5);
        analyse(&x);
        double *d = x.system.K.value + 4 * x.system.K.diagonal[row];
        d[3] = d[1] * d[1] / d[0] - 1;
        const int found = nmm_factor_plain.make(&x.factor, x.system.K.value);
        // Rows joined to it may carry the trouble away, never before its own turn.
        assert_in_range(found, 0, 47);
        assert_true(x.factor.rank[found] <= x.factor.rank[row]);
        d[0] = NAN;
        assert_in_range(nmm_factor_plain.make(&x.factor, x.system.K.value), 0, 47);
        tear_down(&x);
    }
}

// --- Memory

// One factor for one pattern after the other, large and small.
static void test_patterns_in_turn(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    nmm_factor factor = {0};
    for (int k = 0; k < 40; k++) {
        test_system system = {0};
        const int n = k % 2 == 0 ? 4 + 5 * k : 220 - 4 * k;
        test_system_random(&context, &system, n, k % 5, 60 + (uint64_t)k);
        double *z = NULL;
        assert_int_equal(nmm_allocate(&context, &z, (size_t)n, 2 * sizeof *z), NMM_OK);
        assert_int_equal(nmm_factor_analyse(&context, &factor, &system.K, NULL), NMM_OK);
        assert_int_equal(nmm_factor_reserve(&context, &factor, 1), NMM_OK);
        const int trouble = nmm_factor_plain.make(&factor, system.K.value);
        // Rows that nothing joins are zero.
        assert_true(k % 5 == 0 ? trouble >= 0 : trouble == -1);
        if (trouble < 0) {
            nmm_factor_plain.apply(&factor, system.f, z);
            assert_true(test_true_residual(&system, z) < 1e-9);
        }
        nmm_release(&context, &z);
        test_system_destroy(&context, &system);
    }
    nmm_factor_destroy(&context, &factor);
    assert_int_equal(context.n_live, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shape),
        cmocka_unit_test(test_star),
        cmocka_unit_test(test_grid),
        cmocka_unit_test(test_known),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_same_bits_of_large_fronts),
        cmocka_unit_test(test_same_bits_of_graphs),
        cmocka_unit_test(test_same_trouble),
        cmocka_unit_test(test_same_trouble_at_the_top),
        cmocka_unit_test(test_places),
        cmocka_unit_test(test_pivots),
        cmocka_unit_test(test_patterns_in_turn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
