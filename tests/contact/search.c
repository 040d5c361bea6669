// SPDX-License-Identifier: MIT
//
// The search: pairs of edges and contacts against all pairs, the same contacts for any number of
// threads and whether the index was reused or made anew.

#include "bodies.h"

#include <stdlib.h>

// The search shares loops of more than 4096 edges among threads.
enum { MOST_BLOCKS = 1600, LEAST_SHARED = 4097, MOST_CORNERS = 9 };

typedef struct heap {
    int n;
    loop loops[MOST_BLOCKS];
    nmm_vec2 corner[MOST_BLOCKS][MOST_CORNERS];
} heap;

// Convex polygons on circles of random size, thrown into a box with an area about their own.
static void make_heap(heap *h, int n, nmm_random *random) {
    const double side = 0.8 * sqrt((double)n);
    h->n = n;
    for (int k = 0; k < n; k++) {
        const int corners = 3 + (int)(nmm_random_next(random) % (MOST_CORNERS - 2));
        const double r = 0.1 + 0.5 * nmm_random_unit(random);
        const nmm_vec2 c = {side * nmm_random_unit(random), side * nmm_random_unit(random)};
        const double start = 6.3 * nmm_random_unit(random);
        for (int i = 0; i < corners; i++) {
            const double angle =
                start + 6.283185307179586 * (i + 0.4 * nmm_random_unit(random)) / corners;
            h->corner[k][i] = (nmm_vec2){c.x + r * cos(angle), c.y + r * sin(angle)};
        }
        h->loops[k] = (loop){k, corners, h->corner[k]};
    }
}

static bodies open_heap(const heap *h, double size, int n_thread) {
    bodies b = {.context.n_thread = n_thread};
    assert_int_equal(bodies_open(&b, h->n, h->loops, size), NMM_OK);
    return b;
}

// --- Against all pairs

static double distance(const bodies *b, int vertex, int edge) {
    const nmm_edge_line e = nmm_edge_line_of(&b->model, &b->state, edge);
    const nmm_vec2 off = nmm_vec2_sub(nmm_vertex_place(&b->model, &b->state, vertex), e.p);
    const double along = nmm_min(e.length, nmm_max(0, nmm_vec2_dot(e.t, off)));
    const nmm_vec2 rest = nmm_vec2_sub(off, nmm_vec2_scale(along, e.t));
    return sqrt(nmm_vec2_dot(rest, rest));
}

static int compare_pairs(const void *a, const void *b) {
    const nmm_edge_pair *p = a, *q = b;
    if (p->a != q->a) return p->a < q->a ? -1 : 1;
    return (p->b > q->b) - (p->b < q->b);
}

// Every vertex within reach of an edge of another block has its own edge paired with it, once.
static void check_pairs(const bodies *b, double reach) {
    const nmm_contact_search *s = b->search;
    nmm_edge_pair *pair = calloc((size_t)s->n_pair + 1, sizeof *pair);
    memcpy(pair, s->pair, (size_t)s->n_pair * sizeof *pair);
    for (int k = 0; k < s->n_pair; k++) {
        if (pair[k].a > pair[k].b) pair[k] = (nmm_edge_pair){pair[k].b, pair[k].a, -1, false};
    }
    qsort(pair, (size_t)s->n_pair, sizeof *pair, compare_pairs);
    for (int k = 0; k + 1 < s->n_pair; k++)
        assert_true(compare_pairs(&pair[k], &pair[k + 1]) != 0);
    for (int v = 0; v < b->model.n_vertex; v++) {
        for (int e = 0; e < b->model.n_vertex; e++) {
            if (b->model.vertex_block[v] == b->model.vertex_block[e]) continue;
            if (distance(b, v, e) > reach) continue;
            const nmm_edge_pair wanted = {nmm_min_int(v, e), nmm_max_int(v, e), -1, false};
            assert_non_null(bsearch(&wanted, pair, (size_t)s->n_pair, sizeof *pair, compare_pairs));
        }
    }
    free(pair);
}

static void test_pairs_are_complete(void **unused) {
    (void)unused;
    nmm_random random = nmm_random_seed(5);
    static heap h;
    for (int trial = 0; trial < 12; trial++) {
        make_heap(&h, 10 + 10 * trial, &random);
        bodies b = open_heap(&h, 0.1 + 0.1 * trial, 1);
        for (int step = 0; step < 6; step++) {
            const double reach = 0.1 * nmm_random_unit(&random);
            bodies_shake(&b, &random, 0.02 * step);
            bodies_find(&b, reach);
            check_pairs(&b, reach);
        }
        bodies_close(&b);
    }
}

// Blocks far away, far apart and on top of each other in the grid's last cells.
static void test_far_away(void **unused) {
    (void)unused;
    const nmm_vec2 a[4] = BOX(0, 0, 1, 1), c[4] = BOX(0.5, 1, 1.5, 2);
    const double away[] = {-1e3, 1e6, 1e9, -1e12};
    for (int k = 0; k < 4; k++) {
        const loop loops[2] = {{0, 4, a}, {1, 4, c}};
        bodies b = {0};
        assert_int_equal(bodies_open(&b, 2, loops, 1), NMM_OK);
        bodies_put(&b, 1, away[k], 0, 0);
        bodies_find(&b, 0.01);
        assert_int_equal(b.state.n_contact, 0);
        bodies_put(&b, 0, away[k], 0, 0);
        bodies_find(&b, 0.01);
        assert_true(b.state.n_contact >= 2);
        bodies_close(&b);
    }
}

// --- The same list

static void assert_same_lists(const bodies *a, const bodies *b) {
    assert_int_equal(a->state.n_contact, b->state.n_contact);
    for (int k = 0; k < a->state.n_contact; k++) {
        const nmm_contact *x = &a->state.contact[k], *y = &b->state.contact[k];
        assert_int_equal(x->vertex, y->vertex);
        assert_int_equal(x->edge, y->edge);
        assert_int_equal(x->mode, y->mode);
        assert_true(x->length == y->length);
        assert_true(x->gap == y->gap);
        assert_true(x->anchor == y->anchor);
        assert_true(x->slip == y->slip);
        assert_true(x->normal_force == y->normal_force);
        assert_true(x->shear_force == y->shear_force);
    }
}

// One step of a made-up motion.
static void step(bodies *b, nmm_random *random, double amount, double reach) {
    bodies_find(b, reach);
    bodies_shake(b, random, amount);
    bodies_evaluate(b);
    bodies_commit(b, NULL);
}

static void test_threads(void **unused) {
    (void)unused;
    static heap h;
    nmm_random random = nmm_random_seed(6);
    make_heap(&h, MOST_BLOCKS, &random);
    bodies b[3];
    nmm_random own[3];
    for (int t = 0; t < 3; t++) {
        b[t] = open_heap(&h, 0.2, t + 1);
        own[t] = nmm_random_seed(7);
    }
    for (int k = 0; k < 10; k++) {
        for (int t = 0; t < 3; t++)
            step(&b[t], &own[t], 0.01, 0.1);
        assert_true(b[0].model.n_vertex >= LEAST_SHARED && b[0].state.n_contact > 100);
        assert_same_lists(&b[0], &b[1]);
        assert_same_lists(&b[0], &b[2]);
    }
    for (int t = 0; t < 3; t++)
        bodies_close(&b[t]);
}

static void test_reused_or_new_index(void **unused) {
    (void)unused;
    static heap h;
    nmm_random random = nmm_random_seed(8);
    make_heap(&h, MOST_BLOCKS, &random);
    bodies reused = open_heap(&h, 0.3, 1), anew = open_heap(&h, 0.3, 1);
    nmm_random one = nmm_random_seed(9), two = nmm_random_seed(9);
    int kept = 0;
    for (int k = 0; k < 20; k++) {
        const double at = reused.search->built_at[0];
        step(&reused, &one, 0.004, 0.03);
        kept += reused.search->built_at[0] == at;
        // As after a resume: the state with its list, and no index.
        bodies_options(&anew, anew.options);
        step(&anew, &two, 0.004, 0.03);
        assert_same_lists(&reused, &anew);
    }
    assert_true(kept > 5);
    bodies_close(&reused);
    bodies_close(&anew);
}

/// Velocity and spin of each block in a step.
typedef struct drift {
    double v[MOST_BLOCKS][3];
} drift;

// Where they are in step k.
static void put_drifting(bodies *b, const heap *h, const drift *d, int k) {
    for (int block = 0; block < h->n; block++) {
        const double *v = d->v[block];
        bodies_put(b, block, k * v[0], k * v[1], k * v[2]);
    }
}

static void step_drifting(bodies *b, const heap *h, const drift *d, int k, double reach) {
    put_drifting(b, h, d, k);
    bodies_find(b, reach);
    bodies_evaluate(b);
    bodies_commit(b, NULL);
}

// Puts all pairs of edges into the place of those of the grid, as if found right now and for the
// same distance as another index. None of them rests.
static void take_all_pairs(bodies *b, const bodies *other) {
    nmm_contact_search *s = b->search;
    const int n = b->model.n_vertex, most = n * (n - 1) / 2;
    assert_int_equal(nmm_grow(&b->context, &s->pair, &s->pair_capacity, most, sizeof *s->pair),
                     NMM_OK);
    s->n_pair = 0;
    s->n_chunk = 0;
    s->built_for = other->search->built_for;
    for (int e = 0; e < n; e++) {
        for (int k = e + 1; k < n; k++)
            if (nmm_edges_can_meet(&b->model, e, k))
                s->pair[s->n_pair++] = (nmm_edge_pair){e, k, -1, false};
    }
    assert_int_equal(nmm_pairs_number(&b->context, s), NMM_OK);
    for (int v = 0; v < n; v++) {
        const nmm_vec2 place = nmm_vertex_place(&b->model, &b->state, v);
        s->built_at[2 * v] = s->rests_at[2 * v] = place.x;
        s->built_at[2 * v + 1] = s->rests_at[2 * v + 1] = place.y;
    }
    s->rests_for = INFINITY;
}

static int count_resting(const bodies *b) {
    int n = 0;
    for (int k = 0; k < b->search->n_pair; k++)
        n += b->search->pair[k].rests;
    return n;
}

// An index that serves several steps, at different numbers of threads, against all pairs in each.
// Returns how many of its pairs rested, over all steps.
static long check_against_all_pairs(const heap *h, const drift *d, int steps, int least_contacts) {
    bodies reused = open_heap(h, 0.3, 1), shared = open_heap(h, 0.3, 3);
    bodies all = open_heap(h, 0.3, 1);
    int kept = 0, n_most = 0, n_all = -1;
    long resting = 0;
    for (int k = 0; k < steps; k++) {
        const double at = reused.search->built_at[1];
        step_drifting(&reused, h, d, k, 0.03);
        step_drifting(&shared, h, d, k, 0.03);
        kept += reused.search->built_at[1] == at;
        resting += count_resting(&reused);
        // The first step makes an index in any case.
        put_drifting(&all, h, d, k);
        if (k > 0) take_all_pairs(&all, &reused);
        if (k > 0) n_all = all.search->n_pair;
        step_drifting(&all, h, d, k, 0.03);
        if (k > 0) assert_int_equal(all.search->n_pair, n_all);
        n_most = nmm_max_int(n_most, all.state.n_contact);
        assert_same_lists(&reused, &all);
        assert_same_lists(&shared, &all);
    }
    assert_true(n_most >= least_contacts);
    assert_in_range(kept, steps / 4, steps - 1);
    bodies_close(&reused);
    bodies_close(&shared);
    bodies_close(&all);
    return resting;
}

static void test_heap_against_all_pairs(void **unused) {
    (void)unused;
    static heap h;
    static drift d;
    nmm_random random = nmm_random_seed(11);
    make_heap(&h, 60, &random);
    for (int k = 0; k < h.n; k++) {
        for (int i = 0; i < 3; i++)
            d.v[k][i] = 0.008 * (nmm_random_unit(&random) - 0.5);
    }
    check_against_all_pairs(&h, &d, 60, 30);
}

// Couples of boxes that come straight at each other, all at one speed and from distances up to
// beyond the index: some are just within it when it is made, and touch when it is made anew.
static void test_couples_against_all_pairs(void **unused) {
    (void)unused;
    enum { COUPLES = 30 };
    static heap h;
    static drift d;
    h.n = 2 * COUPLES;
    for (int k = 0; k < h.n; k++) {
        const double gap = 0.06 + 0.07 * (k / 2) / COUPLES, side = k % 2;
        const nmm_vec2 low = {3 * (k / 2), side * (1 + gap)};
        const nmm_vec2 box[4] = BOX(low.x, low.y, low.x + 1, low.y + 1);
        memcpy(h.corner[k], box, sizeof box);
        h.loops[k] = (loop){k, 4, h.corner[k]};
        d.v[k][1] = (0.5 - side) * 0.002;
    }
    check_against_all_pairs(&h, &d, 60, 2 * COUPLES);
}

// Boxes of a stack that slowly turn and part, so that pairs rest for several steps: sides that
// were parallel are not any more, and corners come down on them.
static void test_slow_against_all_pairs(void **unused) {
    (void)unused;
    enum { COLUMNS = 3, ROWS = 3, STEPS = 400 };
    static heap h;
    static drift d;
    h.n = COLUMNS * ROWS;
    nmm_random random = nmm_random_seed(12);
    for (int k = 0; k < h.n; k++) {
        const double x = k % COLUMNS + 0.5 * (k / COLUMNS % 2), y = k / COLUMNS;
        const nmm_vec2 box[4] = BOX(x, y, x + 1, y + 1);
        memcpy(h.corner[k], box, sizeof box);
        h.loops[k] = (loop){k, 4, h.corner[k]};
        for (int i = 0; i < 3; i++)
            d.v[k][i] = 4e-4 * (nmm_random_unit(&random) - 0.5);
    }
    const long resting = check_against_all_pairs(&h, &d, STEPS, 20);
    assert_true(resting > 10L * STEPS);
}

// What rests at one reach is asked again at a larger one, with nothing moved.
static void test_larger_reach(void **unused) {
    (void)unused;
    const nmm_vec2 below[4] = BOX(0, 0, 1, 1);
    const nmm_vec2 above[4] = {{0.5, 1.02}, {1, 1.52}, {0.5, 2.02}, {0, 1.52}};
    const loop loops[] = {{0, 4, below}, {1, 4, above}};
    bodies b = {.context.n_thread = 1};
    assert_int_equal(bodies_open(&b, 2, loops, 0.3), NMM_OK);
    for (int k = 0; k < 3; k++)
        bodies_find(&b, 0.01);
    assert_int_equal(b.state.n_contact, 0);
    assert_true(b.search->n_pair > 0 && count_resting(&b) == b.search->n_pair);
    const double built_for = b.search->built_for;
    bodies_find(&b, 0.025);
    assert_int_equal(b.state.n_contact, 1);
    assert_true(b.search->built_for == built_for);
    bodies_close(&b);
}

// Sorted by vertex, then edge, without repetition; vertex and edge of different places.
static void test_sorted(void **unused) {
    (void)unused;
    static heap h;
    nmm_random random = nmm_random_seed(10);
    make_heap(&h, 200, &random);
    bodies b = open_heap(&h, 0.3, 2);
    for (int k = 0; k < 5; k++) {
        step(&b, &random, 0.01, 0.1);
        for (int i = 0; i < b.state.n_contact; i++) {
            const nmm_contact *c = &b.state.contact[i];
            assert_true(c->length > 0);
            assert_true(isfinite(c->gap) && isfinite(c->anchor));
            assert_int_not_equal(b.model.vertex_block[c->vertex], b.model.vertex_block[c->edge]);
            if (i == 0) continue;
            const nmm_contact *last = c - 1;
            assert_true(last->vertex < c->vertex ||
                        (last->vertex == c->vertex && last->edge < c->edge));
        }
    }
    bodies_close(&b);
}

// --- Memory

static nmm_status whole_life(test_failing *f, long *n_live) {
    static heap h;
    nmm_random random = nmm_random_seed(11);
    make_heap(&h, 40, &random);
    bodies b = {.context = {.n_thread = 1, .allocate = test_failing_hook, .user = f}};
    nmm_status status = bodies_open(&b, h.n, h.loops, 0.3);
    for (int k = 0; k < 3 && status == NMM_OK; k++) {
        status = nmm_contact_find(&b.context, b.search, &b.model, &b.state, 0.02 * (1 + k));
        if (status != NMM_OK) break;
        bodies_evaluate(&b);
        bodies_commit(&b, NULL);
        bodies_shake(&b, &random, 0.02);
    }
    bodies_close(&b);
    *n_live = b.context.n_live;
    return status;
}

static void test_allocation_failures(void **unused) {
    (void)unused;
    long n_live = 0;
    int failures = 0;
    for (;; failures++) {
        test_failing f = {.fail_at = failures};
        const nmm_status status = whole_life(&f, &n_live);
        assert_int_equal(n_live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_true(failures < 500);
    }
    assert_true(failures > 50);
}

// A steady loop does not allocate.
static void test_no_allocation_in_a_steady_loop(void **unused) {
    (void)unused;
    static heap h;
    nmm_random random = nmm_random_seed(12);
    make_heap(&h, 100, &random);
    bodies b = open_heap(&h, 0.3, 1);
    for (int k = 0; k < 40; k++) {
        for (int block = 0; block < h.n; block++)
            bodies_put(&b, block, 0.02 * (k % 4), 0.1 * (block % 3) * (k % 2), 0);
        const long before = b.context.n_call;
        step(&b, &random, 0, 0.05);
        if (k >= 12) assert_int_equal(b.context.n_call, before);
    }
    bodies_close(&b);
}

// --- Can there be a contact at all?

enum { MOST_EDGES = 20000, MORE_EDGES = 16 };

static bool can_be(int n, const nmm_vec2 *corner) {
    bodies b = {.context.n_thread = 1};
    bool answer = false;
    assert_int_equal(bodies_open(&b, 1, &(loop){0, n, corner}, 0.3), NMM_OK);
    assert_int_equal(nmm_contact_can_be(&b.context, &b.model, &answer), NMM_OK);
    bodies_close(&b);
    return answer;
}

// A disc of radius 1 whose rim is wavy, by `depth` to both sides.
static void make_disc(int n, int waves, double depth, nmm_vec2 *corner) {
    const double turn = 6.283185307179586;
    for (int i = 0; i < n; i++) {
        const double angle = turn * i / n, r = 1 + depth * cos(waves * angle);
        corner[i] = (nmm_vec2){r * cos(angle), r * sin(angle)};
    }
}

// A slot of one edge's width, cut into the rim before corner `at` of a disc.
static int cut_slot(int n, int at, nmm_vec2 *corner) {
    const nmm_vec2 a = corner[at - 1], b = corner[at];
    memmove(corner + at + 2, corner + at, (size_t)(n - at) * sizeof *corner);
    corner[at] = nmm_vec2_scale(0.9, a);
    corner[at + 1] = nmm_vec2_scale(0.9, b);
    return n + 2;
}

// Gentle waves face nobody, deep ones each other; one slot is enough. All pairs of so many edges
// would be two hundred millions.
static void test_sides_of_one_block(void **unused) {
    (void)unused;
    static nmm_vec2 corner[MOST_EDGES + MORE_EDGES];
    make_disc(MOST_EDGES, 50, 0.005, corner);
    assert_false(can_be(MOST_EDGES, corner));
    make_disc(MOST_EDGES, 50, 0.05, corner);
    assert_true(can_be(MOST_EDGES, corner));
    make_disc(MOST_EDGES, 50, 0.005, corner);
    assert_true(can_be(cut_slot(MOST_EDGES, 19990, corner), corner));
    // The two sides of the slot are the last edge and the first but one.
    make_disc(MOST_EDGES, 50, 0.005, corner);
    assert_true(can_be(cut_slot(MOST_EDGES, 1, corner), corner));
}

static bool one_faces_another(int n, const nmm_vec2 *corner) {
    for (int a = 0; a < n; a++) {
        for (int b = a + 2; b < n - (a == 0); b++) {
            const nmm_vec2 p = corner[a], q = corner[(a + 1) % n], r = corner[b],
                           s = corner[(b + 1) % n];
            const nmm_vec2 one = nmm_vec2_sub(q, p), other = nmm_vec2_sub(s, r);
            const nmm_vec2 way = nmm_vec2_sub(nmm_vec2_mix(r, s, 0.5), nmm_vec2_mix(p, q, 0.5));
            const double size = sqrt(nmm_vec2_dot(one, one) * nmm_vec2_dot(other, other));
            if (nmm_vec2_cross(way, one) > 0 && nmm_vec2_cross(way, other) < 0 &&
                nmm_vec2_dot(one, other) < -0.2 * size)
                return true;
        }
    }
    return false;
}

// Stars with more and less deep notches, against all pairs.
static void test_sides_against_all_pairs(void **unused) {
    (void)unused;
    enum { TRIES = 300, MOST_OF_STAR = 60 };
    nmm_random random = nmm_random_seed(5);
    int n_facing = 0;
    for (int k = 0; k < TRIES; k++) {
        const int n = 4 + (int)(nmm_random_next(&random) % (MOST_OF_STAR - 3));
        const double depth = 0.9 * nmm_random_unit(&random);
        nmm_vec2 corner[MOST_OF_STAR];
        for (int i = 0; i < n; i++) {
            const double angle = 6.283185307179586 * i / n;
            const double r = 1 - depth * nmm_random_unit(&random);
            corner[i] = (nmm_vec2){r * cos(angle), r * sin(angle)};
        }
        const bool faces = one_faces_another(n, corner);
        assert_int_equal(can_be(n, corner), faces);
        n_facing += faces;
    }
    assert_in_range(n_facing, TRIES / 10, TRIES - TRIES / 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pairs_are_complete),
        cmocka_unit_test(test_far_away),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_reused_or_new_index),
        cmocka_unit_test(test_heap_against_all_pairs),
        cmocka_unit_test(test_couples_against_all_pairs),
        cmocka_unit_test(test_slow_against_all_pairs),
        cmocka_unit_test(test_larger_reach),
        cmocka_unit_test(test_sorted),
        cmocka_unit_test(test_allocation_failures),
        cmocka_unit_test(test_no_allocation_in_a_steady_loop),
        cmocka_unit_test(test_sides_of_one_block),
        cmocka_unit_test(test_sides_against_all_pairs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
