// SPDX-License-Identifier: MIT
//
// The choice of blocks, watched from outside: every run of a solve goes through a hook that notes
// blocks and iterations and counts the work. On series of systems as the passes of a step give them
// it is compared with each fixed choice; what is reused from pass to pass never costs convergence.

#include "choose.h"
#include "direct.h"
#include "systems.h"
#include "test.h"

// Prices of src/solve/choose.c, of whole preparations; only their ratios matter.
static double price_of_iteration(const nmm_solver *s, nmm_solve_blocks blocks) {
    double price = 0.5 * s->n_block + 2.5 * s->n_row;
    if (blocks >= NMM_BLOCKS_CLUSTER) price += 2.0 * s->n_row;
    if (blocks < NMM_BLOCKS_BODY) return price;
    return price + 0.4 * (double)s->coarse.n_factor + 30.0 * s->coarse.n_part + 2.5 * s->n_row;
}

static double price_of_setup(const nmm_solver *s, nmm_solve_blocks blocks, bool first, int setups) {
    if (blocks == NMM_BLOCKS_COVER) return 0;
    double price = 1.0 * s->n_block;
    if (first) price += 11.0 * s->n_block;
    if (setups > 0) price += 150.0 * s->n_row;
    if (blocks < NMM_BLOCKS_BODY) return price;
    if (first) price += 6.0 * s->n_block;
    if (setups > 0) price += 8.0 * s->n_block + 0.15 * s->coarse.work;
    return price;
}

// Kind of a run: its blocks, or the direct method.
#define DIRECT (NMM_BLOCKS_BODY + 1)

static int kind_of(const nmm_solve_report *report) {
    return report->method == NMM_SOLVE_DIRECT ? DIRECT : (int)report->blocks;
}

// A factor is paid in each direct solve, though one may serve several; its order at the first.
static double price_of_run(const nmm_solver *s, const nmm_bsr *K, const nmm_solve_report *report,
                           bool first) {
    double analysis = 0;
    if (kind_of(report) == DIRECT) {
        return nmm_direct_work(s, K, &analysis) + (first ? 30.0 * s->n_block : 0);
    }
    return report->iterations * price_of_iteration(s, report->blocks) +
           price_of_setup(s, report->blocks, first, report->setups);
}

// What the hook has seen, and the run behind it.
static nmm_solve_run *behind;
static struct {
    double work;
    int runs, iterations;
    int first; // kind of the solve's first run
    bool used[DIRECT + 1];
} seen;

static nmm_status watch(nmm_context *context, nmm_solver *solver, const nmm_bsr *K, const double *f,
                        double *u, bool keep_pattern, const nmm_solve_options *options,
                        nmm_solve_report *report) {
    const nmm_status status = behind(context, solver, K, f, u, keep_pattern, options, report);
    const int kind = kind_of(report);
    if (seen.runs++ == 0) seen.first = kind;
    seen.iterations += report->iterations;
    seen.work += price_of_run(solver, K, report, !seen.used[kind]);
    seen.used[kind] = true;
    return status;
}

typedef struct fixture {
    nmm_context context;
    test_system system;
    nmm_solver *solver;
    double *place, *u;
    int *body;
    nmm_solve_options options;
    nmm_solve_report report;
} fixture;

static void allocate(fixture *x, void *block, size_t size) {
    assert_int_equal(nmm_allocate(&x->context, block, (size_t)x->system.K.n_row, size), NMM_OK);
}

static void open_solver(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    assert_int_equal(
        nmm_solve_host()->open(&x->context, &x->solver, x->system.K.n_row, x->system.n_block),
        NMM_OK);
    behind = x->solver->run;
    x->solver->run = watch;
    memset(&seen, 0, sizeof seen);
}

static void set_up(fixture *x, const rock *wall) {
    *x = (fixture){.context.n_thread = 1};
    test_system_rock(&x->context, &x->system, wall);
    allocate(x, &x->place, 2 * sizeof(double));
    allocate(x, &x->u, 2 * sizeof(double));
    allocate(x, &x->body, sizeof(int));
    const int n_node = wall->n_node;
    for (int row = 0; row < x->system.K.n_row; row++) {
        const int block = row / (n_node * n_node);
        x->body[row] = block;
        x->place[2 * row] = block % wall->n_across * n_node + row % n_node;
        x->place[2 * row + 1] = block / wall->n_across * n_node + row / n_node % n_node;
    }
    x->options = nmm_default_solve_options();
    x->options.method = NMM_SOLVE_PCG;
    x->options.place = x->place;
    x->options.body = x->body;
    open_solver(x);
}

static void tear_down(fixture *x) {
    nmm_solve_host()->close(&x->context, &x->solver);
    nmm_release(&x->context, &x->place);
    nmm_release(&x->context, &x->u);
    nmm_release(&x->context, &x->body);
    test_system_destroy(&x->context, &x->system);
    assert_int_equal(x->context.n_live, 0);
}

// The same wall with other contacts closed; one pattern for all.
static void change_contacts(fixture *x, const rock *wall, uint64_t seed) {
    rock other = *wall;
    other.seed = seed;
    nmm_context own = {.n_thread = 1};
    test_system next = {0};
    test_system_rock(&own, &next, &other);
    assert_int_equal(next.n_block, x->system.n_block);
    assert_memory_equal(next.K.col, x->system.K.col, (size_t)next.n_block * sizeof(int));
    memcpy(x->system.K.value, next.K.value, (size_t)next.n_block * 4 * sizeof(double));
    memcpy(x->system.f, next.f, (size_t)next.K.n_row * 2 * sizeof(double));
    test_system_destroy(&own, &next);
}

// One solve from zero, watched; with blocks left to choose if the options say so.
static void solve(fixture *x, bool keep) {
    memset(x->u, 0, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
    seen.runs = 0;
    const bool chooses = nmm_solver_chooses(&x->options);
    const nmm_status status =
        chooses ? nmm_choose_blocks(&x->context, x->solver, &x->system.K, x->system.f, x->u, keep,
                                    &x->options, &x->report)
                : watch(&x->context, x->solver, &x->system.K, x->system.f, x->u, keep, &x->options,
                        &x->report);
    assert_int_equal(status, NMM_OK);
    assert_int_equal(x->report.end, NMM_SOLVE_CONVERGED);
    assert_true(test_true_residual(&x->system, x->u) <= x->options.tolerance * (1 + 1e-6));
}

// --- Work

// Passes of a few steps: contacts change, what was prepared is reused within a step. The work.
static double work_of_series(fixture *x, const rock *wall, nmm_solve_blocks blocks) {
    x->options.blocks = blocks;
    x->options.max_iterations = 20000;
    open_solver(x);
    for (int pass = 0; pass < 8; pass++) {
        change_contacts(x, wall, 100 + (uint64_t)pass / 2);
        x->options.reuse = pass % 4 > 0;
        solve(x, pass > 0);
    }
    return seen.work;
}

static void test_never_twice_the_best(void **state) {
    (void)state;
    const double courant[] = {0.3, 3, 30}, spring[] = {1, 50, 1e4};
    int best_of[NMM_BLOCKS_BODY + 1] = {0};
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < 6; k++) {
            const rock wall = {.n_across = k % 2 == 0 ? 3 : 8,
                               .n_up = k % 2 == 0 ? 2 : 4,
                               .n_node = 4,
                               .courant = courant[c],
                               .spring = spring[k / 2],
                               .seed = 1};
            fixture x;
            set_up(&x, &wall);
            x.options.tolerance = 1e-7;
            double best = INFINITY;
            int which = 0;
            for (int b = NMM_BLOCKS_COVER; b <= NMM_BLOCKS_BODY; b++) {
                const double work = work_of_series(&x, &wall, (nmm_solve_blocks)b);
                if (work < best) which = b;
                best = nmm_min(best, work);
            }
            best_of[which]++;
            const double work = work_of_series(&x, &wall, NMM_BLOCKS_AUTO);
            // With a hundred rows a preparation costs as much as a solve, and the first iterations
            // of a kind say little of the later ones.
            const double allowed = x.system.K.n_row > 100 ? 2 : 3.5;
            if (!(work <= allowed * best)) {
                print_error("courant %g spring %g: %g times the best, blocks %d\n", wall.courant,
                            wall.spring, work / best, which);
            }
            assert_true(work <= allowed * best);
            // The direct method among the choices, whose work is known beforehand.
            x.options.method = NMM_SOLVE_DIRECT;
            best = nmm_min(best, work_of_series(&x, &wall, NMM_BLOCKS_AUTO));
            x.options.method = NMM_SOLVE_AUTO;
            assert_true(work_of_series(&x, &wall, NMM_BLOCKS_AUTO) <= 1.5 * best);
            tear_down(&x);
        }
    }
    // There was something to choose.
    assert_true(best_of[NMM_BLOCKS_COVER] > 0);
    assert_true(best_of[NMM_BLOCKS_CLUSTER] + best_of[NMM_BLOCKS_BODY] > 4);
}

static const rock slow_wall = {
    .n_across = 6, .n_up = 4, .n_node = 4, .courant = 100, .spring = 1e4, .seed = 1};
static const rock quick_wall = {
    .n_across = 6, .n_up = 4, .n_node = 4, .courant = 0.1, .spring = 1, .seed = 1};

// The second solve of a slow system begins with larger blocks, and needs one run.
static void test_learns(void **state) {
    (void)state;
    fixture x;
    set_up(&x, &slow_wall);
    x.options.reuse = true;
    solve(&x, false);
    assert_int_equal(seen.first, NMM_BLOCKS_COVER);
    assert_true(seen.runs > 1);
    assert_true(kind_of(&x.report) > NMM_BLOCKS_COVER);
    assert_int_equal(x.report.iterations, seen.iterations);
    assert_true(strlen(x.report.why) > 10);
    const int before = x.report.iterations;
    for (int k = 0; k < 3; k++) {
        solve(&x, true);
        assert_true(seen.first > NMM_BLOCKS_COVER);
        assert_true(x.report.iterations < before);
    }
    tear_down(&x);
    // A quick one never leaves the small ones.
    set_up(&x, &quick_wall);
    for (int k = 0; k < 3; k++) {
        solve(&x, k > 0);
        assert_int_equal(seen.runs, 1);
        assert_int_equal(x.report.blocks, NMM_BLOCKS_COVER);
    }
    tear_down(&x);
}

// What rounding leaves after a factor is left by any kind: small blocks do not follow, which would
// take all the iterations that are allowed.
static void test_rounding_ends_the_search(void **state) {
    (void)state;
    fixture x;
    set_up(&x, &slow_wall);
    x.options.method = NMM_SOLVE_AUTO;
    solve(&x, false);
    assert_int_equal(kind_of(&x.report), DIRECT);
    x.options.tolerance = 1e-17;
    seen.runs = 0;
    assert_int_equal(nmm_choose_blocks(&x.context, x.solver, &x.system.K, x.system.f, x.u, true,
                                       &x.options, &x.report),
                     NMM_OK);
    assert_int_equal(x.report.end, NMM_SOLVE_STAGNATED);
    assert_int_equal(kind_of(&x.report), DIRECT);
    assert_int_equal(seen.runs, 1);
    tear_down(&x);
}

// Larger blocks need fewer iterations: stiff springs fall inside, bodies move as a whole.
static void test_larger_is_faster(void **state) {
    (void)state;
    fixture x;
    const rock wall = {
        .n_across = 6, .n_up = 6, .n_node = 4, .courant = 30, .spring = 1000, .seed = 4};
    set_up(&x, &wall);
    int iterations[NMM_BLOCKS_BODY + 1];
    for (int b = NMM_BLOCKS_COVER; b <= NMM_BLOCKS_BODY; b++) {
        x.options.blocks = (nmm_solve_blocks)b;
        solve(&x, false);
        iterations[b] = x.report.iterations;
    }
    assert_true(2 * iterations[NMM_BLOCKS_CLUSTER] < iterations[NMM_BLOCKS_COVER]);
    assert_true(1.5 * iterations[NMM_BLOCKS_BODY] < iterations[NMM_BLOCKS_CLUSTER]);
    tear_down(&x);
}

// --- The same way every time

typedef struct trace {
    uint64_t hash;
    int iterations[8];
    int kind[8];
} trace;

static trace trace_of(fixture *x, const rock *wall, int n_thread) {
    trace t = {.hash = NMM_HASH_START};
    open_solver(x);
    x->options.n_thread = n_thread;
    for (int pass = 0; pass < 8; pass++) {
        change_contacts(x, wall, 7 + (uint64_t)pass / 2);
        x->options.reuse = pass % 4 > 0;
        solve(x, pass > 0);
        t.hash = nmm_hash(t.hash, x->u, 2 * (size_t)x->system.K.n_row * sizeof *x->u);
        t.iterations[pass] = x->report.iterations;
        t.kind[pass] = kind_of(&x->report);
    }
    return t;
}

static void assert_same(const trace *a, const trace *b) {
    assert_memory_equal(a->iterations, b->iterations, sizeof a->iterations);
    assert_memory_equal(a->kind, b->kind, sizeof a->kind);
    assert_true(a->hash == b->hash);
}

static void test_same_way_every_time(void **state) {
    (void)state;
    fixture x;
    set_up(&x, &slow_wall);
    const trace first = trace_of(&x, &slow_wall, 1), again = trace_of(&x, &slow_wall, 1);
    assert_same(&first, &again);
    tear_down(&x);
    // Large enough for threads.
    const rock wall = {
        .n_across = 14, .n_up = 10, .n_node = 4, .courant = 5, .spring = 50, .seed = 1};
    set_up(&x, &wall);
    assert_true(x.system.K.n_row > 2200);
    const trace one = trace_of(&x, &wall, 1);
    const int n_thread[] = {2, 7};
    for (int k = 0; k < 2; k++) {
        const trace many = trace_of(&x, &wall, n_thread[k]);
        assert_same(&one, &many);
    }
    tear_down(&x);
}

// Without reuse a fixed choice leaves no trace in the next solve.
static void test_no_trace(void **state) {
    (void)state;
    const nmm_solve_method method[] = {NMM_SOLVE_PCG, NMM_SOLVE_CHEBYSHEV, NMM_SOLVE_JACOBI};
    fixture x;
    rock wall = slow_wall;
    wall.courant = 1;
    wall.spring = 50;
    set_up(&x, &wall);
    x.options.tolerance = 1e-3;
    const size_t size = 2 * (size_t)x.system.K.n_row * sizeof *x.u;
    for (int m = 0; m < 3; m++) {
        for (int b = NMM_BLOCKS_COVER; b <= NMM_BLOCKS_BODY; b++) {
            x.options.method = method[m];
            x.options.blocks = (nmm_solve_blocks)b;
            open_solver(&x);
            change_contacts(&x, &wall, 5);
            solve(&x, false);
            const uint64_t fresh = nmm_hash(NMM_HASH_START, x.u, size);
            change_contacts(&x, &wall, 6);
            solve(&x, false);
            assert_true(nmm_hash(NMM_HASH_START, x.u, size) != fresh);
            change_contacts(&x, &wall, 5);
            solve(&x, false);
            assert_true(nmm_hash(NMM_HASH_START, x.u, size) == fresh);
        }
    }
    tear_down(&x);
}

// --- Reuse

// Contacts close and open, nearly half of them each time, springs a thousand times stiffer than
// elements: what is reused may cost some iterations, never the convergence.
static void test_reuse_with_other_contacts(void **state) {
    (void)state;
    const nmm_solve_method method[] = {NMM_SOLVE_PCG, NMM_SOLVE_CHEBYSHEV, NMM_SOLVE_JACOBI};
    const double spring[] = {50, 1000};
    for (int k = 0; k < 2; k++) {
        rock wall = slow_wall;
        wall.spring = spring[k];
        wall.courant = 3;
        fixture x;
        set_up(&x, &wall);
        x.options.tolerance = 1e-5;
        for (int m = 0; m < 3; m++) {
            for (int b = NMM_BLOCKS_AUTO; b <= NMM_BLOCKS_BODY; b++) {
                if (m == 2 && (k == 1 || b % 2 == 1)) continue;
                x.options.method = method[m];
                x.options.blocks = (nmm_solve_blocks)b;
                int fresh[6];
                x.options.reuse = false;
                for (int pass = 0; pass < 6; pass++) {
                    open_solver(&x);
                    change_contacts(&x, &wall, 20 + (uint64_t)pass);
                    solve(&x, false);
                    fresh[pass] = x.report.iterations;
                }
                open_solver(&x);
                x.options.reuse = true;
                for (int pass = 0; pass < 6; pass++) {
                    change_contacts(&x, &wall, 20 + (uint64_t)pass);
                    solve(&x, pass > 0);
                    // Clusters are those of the first contacts: Jacobi pays the condition of that
                    // in full, the others its root. Bounds have to be corrected.
                    int most = (m < 2 ? 3 : 6) * fresh[pass] + (m == 0 ? 40 : 160);
                    // Iterations of one kind of blocks against those of another say nothing.
                    if (m == 0 && b == NMM_BLOCKS_AUTO) most = 2000;
                    if (x.report.iterations > most) {
                        print_error("method %d blocks %d spring %g pass %d: %d after %d\n", m, b,
                                    wall.spring, pass, x.report.iterations, fresh[pass]);
                    }
                    assert_true(x.report.iterations <= most);
                }
            }
        }
        tear_down(&x);
    }
}

// Nothing changed: nothing is made again, and the answer has the same bits.
static void test_reuse_of_all(void **state) {
    (void)state;
    fixture x;
    set_up(&x, &slow_wall);
    x.options.reuse = true;
    const size_t size = 2 * (size_t)x.system.K.n_row * sizeof *x.u;
    for (int b = NMM_BLOCKS_CLUSTER; b <= NMM_BLOCKS_BODY; b++) {
        x.options.blocks = (nmm_solve_blocks)b;
        open_solver(&x);
        solve(&x, false);
        assert_int_equal(x.report.setups, b == NMM_BLOCKS_BODY ? 2 : 1);
        const uint64_t first = nmm_hash(NMM_HASH_START, x.u, size);
        solve(&x, true);
        assert_int_equal(x.report.setups, 0);
        assert_true(nmm_hash(NMM_HASH_START, x.u, size) == first);
    }
    tear_down(&x);
}

// A failure between two solves spoils nothing that is reused.
static void test_reuse_after_trouble(void **state) {
    (void)state;
    fixture x;
    rock wall = slow_wall;
    wall.courant = 3;
    wall.spring = 50;
    set_up(&x, &wall);
    x.options.reuse = true;
    x.options.tolerance = 1e-4;
    const nmm_solve_method method[] = {NMM_SOLVE_PCG, NMM_SOLVE_CHEBYSHEV};
    for (int m = 0; m < 2; m++) {
        for (int b = NMM_BLOCKS_COVER; b <= NMM_BLOCKS_BODY; b++) {
            x.options.method = method[m];
            x.options.blocks = (nmm_solve_blocks)b;
            open_solver(&x);
            solve(&x, false);
            const int iterations = x.report.iterations;
            // A number that is none; then a tolerance that rounding does not allow.
            nmm_solve_options options = x.options;
            const double f = x.system.f[9];
            for (int trouble = 0; trouble < 2; trouble++) {
                x.system.f[9] = trouble == 0 ? NAN : f;
                options.tolerance = trouble == 0 ? 1e-4 : 1e-25;
                options.max_iterations = 4 * iterations;
                memset(x.u, 0, 2 * (size_t)x.system.K.n_row * sizeof *x.u);
                assert_int_equal(nmm_solve_host()->solve(&x.context, x.solver, &x.system.K,
                                                         x.system.f, x.u, true, &options,
                                                         &x.report),
                                 NMM_OK);
                assert_int_not_equal(x.report.end, NMM_SOLVE_CONVERGED);
                x.system.f[9] = f;
                solve(&x, true);
                if (x.report.iterations > iterations + 8)
                    print_error("method %d blocks %d trouble %d: %d after %d\n", m, b, trouble,
                                x.report.iterations, iterations);
                assert_true(x.report.iterations <= iterations + 8);
            }
        }
    }
    tear_down(&x);
}

// A factor that a hundred solves did without gives its memory back.
static void test_unused_factor(void **state) {
    (void)state;
    const rock wall = {
        .n_across = 2, .n_up = 2, .n_node = 4, .courant = 100, .spring = 20, .seed = 3};
    fixture x;
    set_up(&x, &wall);
    x.options.method = NMM_SOLVE_AUTO;
    solve(&x, false);
    assert_int_equal(x.report.method, NMM_SOLVE_DIRECT);
    assert_non_null(x.solver->direct);
    // Mixed precision has no factor.
    x.options.precision = NMM_PRECISION_MIXED;
    for (int k = 0; k < 100; k++)
        solve(&x, true);
    const size_t with = x.context.live_bytes;
    assert_non_null(x.solver->direct);
    solve(&x, true);
    assert_null(x.solver->direct);
    assert_true(x.context.live_bytes < with);
    // It is made again where it is wanted.
    x.options.precision = NMM_PRECISION_DOUBLE;
    solve(&x, false);
    assert_int_equal(x.report.method, NMM_SOLVE_DIRECT);
    tear_down(&x);
}

// What a solver knows that has used all kinds.
static void tell_rates(fixture *x) {
    x->solver->experience.rate[NMM_BLOCKS_COVER] = 0.02;
    x->solver->experience.rate[NMM_BLOCKS_CLUSTER] = 0.1;
    x->solver->experience.rate[NMM_BLOCKS_BODY] = 0.05;
    x->solver->experience.wide_only = false;
}

// A system that caches do not hold is iterated in float32 where nobody asked for double, with the
// same bits on any number of threads; a small one is not.
static void test_float32_of_large_systems(void **state) {
    (void)state;
    rock wall = {.n_across = 30, .n_up = 30, .n_node = 9, .courant = 0.3, .spring = 2, .seed = 5};
    fixture x;
    set_up(&x, &wall);
    tell_rates(&x);
    solve(&x, false);
    assert_int_equal(x.report.precision, NMM_PRECISION_MIXED);
    assert_int_equal(x.report.blocks, NMM_BLOCKS_CLUSTER);
    const size_t bytes = 2 * (size_t)x.system.K.n_row * sizeof *x.u;
    const uint64_t hash = nmm_hash(NMM_HASH_START, x.u, bytes);
    tell_rates(&x);
    x.options.n_thread = 3;
    solve(&x, true);
    assert_int_equal(x.report.precision, NMM_PRECISION_MIXED);
    assert_true(hash == nmm_hash(NMM_HASH_START, x.u, bytes));
    tell_rates(&x);
    x.options.precision = NMM_PRECISION_DOUBLE;
    solve(&x, true);
    assert_int_equal(x.report.precision, NMM_PRECISION_DOUBLE);
    // Numbers that float32 does not hold: said once, and not tried again.
    x.options.precision = NMM_PRECISION_AUTO;
    for (long k = 0; k < 4L * x.system.n_block; k++)
        x.system.K.value[k] *= 0x1p100;
    for (int k = 0; k < 2; k++) {
        if (k == 0) tell_rates(&x);
        solve(&x, true);
        assert_int_equal(x.report.precision, NMM_PRECISION_DOUBLE);
        assert_true((strstr(x.report.why, "float32") != NULL) == (k == 0));
        assert_true(x.solver->experience.wide_only);
    }
    tear_down(&x);
    wall.n_across = wall.n_up = 3;
    set_up(&x, &wall);
    tell_rates(&x);
    solve(&x, false);
    assert_int_equal(x.report.precision, NMM_PRECISION_DOUBLE);
    tear_down(&x);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_never_twice_the_best),      cmocka_unit_test(test_learns),
        cmocka_unit_test(test_rounding_ends_the_search),  cmocka_unit_test(test_larger_is_faster),
        cmocka_unit_test(test_same_way_every_time),       cmocka_unit_test(test_no_trace),
        cmocka_unit_test(test_reuse_with_other_contacts), cmocka_unit_test(test_reuse_of_all),
        cmocka_unit_test(test_reuse_after_trouble),       cmocka_unit_test(test_unused_factor),
        cmocka_unit_test(test_float32_of_large_systems),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
