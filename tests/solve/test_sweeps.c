// SPDX-License-Identifier: MIT
//
// Weights of sweeps on systems whose spectrum is known, where every sweep is two lines: Chebyshev's
// error is 1 / T_k, wrong bounds are found out and corrected, rounding and growth end a run.

#include "sweeps.h"
#include "test.h"

#define N 64

// D^-1 K diagonal, eigenvalues as they are; the load of each unknown 1. e: error over the first.
typedef struct model {
    double lambda[N], u[N], p[N];
    int n;
    double floor; // what rounding leaves of a residual
} model;

static model spread(int n, double low, double high) {
    model m = {.n = n};
    for (int i = 0; i < n; i++)
        m.lambda[i] = n > 1 ? low + (high - low) * i / (n - 1) : low;
    return m;
}

static void sweep(model *m, const double weight[2]) {
    for (int i = 0; i < m->n; i++) {
        const double r = 1 - m->lambda[i] * m->u[i];
        m->p[i] = weight[0] * m->p[i] + weight[1] * r;
        m->u[i] += m->p[i];
    }
}

static double norm_of(const model *m) {
    double sum = m->floor * m->floor;
    for (int i = 0; i < m->n; i++) {
        const double r = 1 - m->lambda[i] * m->u[i];
        sum += r * r;
    }
    return sqrt(sum);
}

// Sweeps by batches until the residual is below `limit` of the first; their number, or minus the
// verdict that ended them.
static int run(sweeps *plan, model *m, double limit, int most) {
    const double first = norm_of(m);
    plan_start(plan, first, first * first);
    for (int done = 8; done <= most; done += 8) {
        double weight[8][2];
        plan_batch(plan, 8, weight);
        for (int k = 0; k < 8; k++)
            sweep(m, weight[k]);
        const double norm = norm_of(m);
        if (norm <= limit * first) return done;
        const sweeps_verdict verdict = plan_judge(plan, norm, norm * norm);
        // Nothing rounds here.
        if (verdict != SWEEPS_GO_ON && verdict != SWEEPS_DOUBT) return -(int)verdict;
    }
    return most + 1;
}

// T_k(x) for x >= 1 by the recursion.
static double chebyshev(int k, double x) {
    double before = 1, now = x;
    for (int i = 1; i < k; i++) {
        const double next = 2 * x * now - before;
        before = now;
        now = next;
    }
    return k == 0 ? 1 : now;
}

// The error at both ends of the spectrum is 1 / T_k(middle / radius), nowhere larger, and
// T_k(x) / T_k(middle / radius) in between.
static void test_error_is_one_over_T(void **state) {
    (void)state;
    const double bounds[][2] = {{0.5, 1.5}, {0.1, 2}, {0.01, 3}, {1e-3, 7}};
    for (int b = 0; b < 4; b++) {
        const double low = bounds[b][0], high = bounds[b][1];
        model m = spread(N, low, high);
        sweeps plan = {.chebyshev = true, .bounds = {low, high}};
        plan_start(&plan, norm_of(&m), 1);
        const double middle = 0.5 * (low + high) / (0.5 * (high - low));
        for (int k = 1; k <= 30; k++) {
            double weight[1][2];
            plan_batch(&plan, 1, weight);
            sweep(&m, weight[0]);
            const double size = 1 / chebyshev(k, middle);
            assert_near(1 - m.lambda[0] * m.u[0], size, 1e-11);
            assert_near(fabs(1 - m.lambda[N - 1] * m.u[N - 1]), size, 1e-11);
            for (int i = 0; i < N; i++)
                assert_true(fabs(1 - m.lambda[i] * m.u[i]) <= size + 1e-11);
        }
    }
}

// Damped Jacobi: the error of each part is (1 - damping lambda)^k.
static void test_damped(void **state) {
    (void)state;
    model m = spread(N, 0.1, 3);
    sweeps plan = {.damping = 0.6};
    plan_start(&plan, norm_of(&m), 1);
    for (int k = 1; k <= 24; k++) {
        double weight[1][2];
        plan_batch(&plan, 1, weight);
        sweep(&m, weight[0]);
        for (int i = 0; i < N; i++)
            assert_near(1 - m.lambda[i] * m.u[i], pow(1 - 0.6 * m.lambda[i], k), 1e-13);
    }
}

// Sweeps that the right bounds need for the same.
static int best(double low, double high, double limit) {
    model m = spread(N, low, high);
    sweeps plan = {.chebyshev = true, .bounds = {low, high}};
    const int n = run(&plan, &m, limit, 100000);
    assert_in_range(n, 8, 100000);
    // Right bounds are left alone.
    assert_near(plan.bounds[0], low, 0);
    assert_near(plan.bounds[1], high, 0);
    return n;
}

// A smallest eigenvalue taken for 3 to 1000 times what it is: found, at a bounded price.
static void test_low_bound_is_found(void **state) {
    (void)state;
    for (double low = 0.1; low > 5e-5; low /= 3) {
        for (double wrong = 3; wrong < 2000 && wrong * low < 1; wrong *= 7) {
            model m = spread(N, low, 3);
            sweeps plan = {.chebyshev = true, .bounds = {wrong * low, 3}};
            const int n = run(&plan, &m, 1e-8, 100000);
            assert_in_range(n, 8, 3 * best(low, 3, 1e-8) + 320);
            assert_near(plan.bounds[1], 3, 0);
            assert_true(plan.bounds[0] < wrong * low);
            // Not below what is there by much: a bound too low is slow.
            assert_true(plan.bounds[0] > 0.3 * low);
        }
    }
}

// A largest eigenvalue taken for too small: the run grows first, and comes back.
static void test_high_bound_is_found(void **state) {
    (void)state;
    const double part[] = {0.99, 0.95, 0.9};
    for (int k = 0; k < 3; k++) {
        model m = spread(N, 0.02, 3);
        sweeps plan = {.chebyshev = true, .bounds = {0.02, part[k] * 3}};
        const int n = run(&plan, &m, 1e-8, 100000);
        assert_in_range(n, 8, 6 * best(0.02, 3, 1e-8) + 320);
        assert_true(plan.bounds[1] >= 3 * (1 - 1e-3));
        assert_true(plan.bounds[1] < 3 * 3);
    }
    // So much too small that nothing can be saved.
    model m = spread(N, 0.02, 3);
    sweeps plan = {.chebyshev = true, .bounds = {0.02, 1}};
    assert_int_equal(run(&plan, &m, 1e-8, 100000), -(int)SWEEPS_DIVERGE);
}

// What rounding leaves ends a run within a few hundred sweeps.
static void test_stagnation(void **state) {
    (void)state;
    for (int chebyshev_too = 0; chebyshev_too < 2; chebyshev_too++) {
        model m = spread(N, 0.5, 1.5);
        m.floor = 1e-6;
        sweeps plan = {.chebyshev = chebyshev_too == 1, .damping = 1 / 1.5, .bounds = {0.5, 1.5}};
        const double first = norm_of(&m);
        plan_start(&plan, first, first * first);
        int done = 0;
        sweeps_verdict verdict = SWEEPS_GO_ON;
        while (verdict == SWEEPS_GO_ON && done < 2000) {
            double weight[8][2];
            plan_batch(&plan, 8, weight);
            for (int k = 0; k < 8; k++)
                sweep(&m, weight[k]);
            done += 8;
            // The last digits do as they like.
            m.floor = 1e-6 * (1 + 1e-3 * (done / 32));
            const double norm = norm_of(&m);
            verdict = plan_judge(&plan, norm, norm * norm);
        }
        assert_int_equal(verdict, chebyshev_too == 1 ? SWEEPS_DOUBT : SWEEPS_STAGNATE);
        assert_in_range(done, 6 * 32, 400);
    }
}

// |r| may grow for as long as it likes while r.D^-1 r falls, however little; the other way round
// nothing is gained. What does not change at all cannot be solved, by any weights.
static void test_only_the_weighted_residual_counts(void **state) {
    (void)state;
    sweeps plan = {.damping = 0.5};
    plan_start(&plan, 1, 1);
    double weight[8][2];
    for (int batch = 1; batch < 400; batch++) {
        plan_batch(&plan, 8, weight);
        assert_int_equal(plan_judge(&plan, 1 + batch, 1 - 1e-9 * batch), SWEEPS_GO_ON);
    }
    plan_start(&plan, 1, 1);
    sweeps_verdict verdict = SWEEPS_GO_ON;
    int batches = 0;
    for (; verdict == SWEEPS_GO_ON && batches < 400; batches++) {
        plan_batch(&plan, 8, weight);
        verdict = plan_judge(&plan, 1 / (1.0 + batches), 1 + 1e-6 * batches);
    }
    assert_int_equal(verdict, SWEEPS_STAGNATE);
    assert_in_range(batches, 20, 30);
    sweeps free = {.chebyshev = true, .bounds = {1e-6, 1}};
    plan_start(&free, 1, 1);
    verdict = SWEEPS_GO_ON;
    for (batches = 0; verdict == SWEEPS_GO_ON && batches < 400; batches++) {
        plan_batch(&free, 8, weight);
        verdict = plan_judge(&free, 1 - 1e-11 * batches, 1);
    }
    assert_int_equal(verdict, SWEEPS_STAGNATE);
}

// Two soft parts under the right bounds, nearly all in the upper one, which swings so slowly that
// the residual grows for hundreds of sweeps. That is a doubt, never the end.
static void test_slow_swing(void **state) {
    (void)state;
    model m = spread(2, 1e-7, 4e-7);
    m.u[0] = (1 - 1e-3) / m.lambda[0];
    sweeps plan = {.chebyshev = true, .bounds = {1e-7, 1}};
    plan_start(&plan, norm_of(&m), norm_of(&m) * norm_of(&m));
    int doubts = 0;
    for (int done = 0; norm_of(&m) > 1e-6 && done < 60000; done += 8) {
        double weight[8][2];
        plan_batch(&plan, 8, weight);
        for (int k = 0; k < 8; k++)
            sweep(&m, weight[k]);
        const sweeps_verdict verdict = plan_judge(&plan, norm_of(&m), norm_of(&m) * norm_of(&m));
        assert_true(verdict == SWEEPS_GO_ON || verdict == SWEEPS_DOUBT);
        doubts += verdict == SWEEPS_DOUBT;
    }
    assert_true(norm_of(&m) <= 1e-6);
    assert_true(doubts > 0);
}

// Growth of r.D^-1 r by more than two is proof of divergence under a fixed damping, at once; any
// method ends where the residual is beyond all bounds or no number.
static void test_divergence(void **state) {
    (void)state;
    model m = spread(N, 0.5, 4);
    sweeps plan = {.damping = 1};
    assert_int_equal(run(&plan, &m, 1e-8, 1000), -(int)SWEEPS_DIVERGE);
    plan_start(&plan, 1, 1);
    assert_int_equal(plan_judge(&plan, 1, 1.99), SWEEPS_GO_ON);
    assert_int_equal(plan_judge(&plan, 1, 0.5), SWEEPS_GO_ON);
    assert_int_equal(plan_judge(&plan, 1, 1.01), SWEEPS_DIVERGE);
    sweeps free = {.chebyshev = true, .bounds = {0.1, 2}};
    plan_start(&free, 1, 1);
    assert_int_equal(plan_judge(&free, 10, 100), SWEEPS_GO_ON);
    assert_int_equal(plan_judge(&free, NAN, 1), SWEEPS_DIVERGE);
    assert_int_equal(plan_judge(&free, INFINITY, 1), SWEEPS_DIVERGE);
    assert_int_equal(plan_judge(&free, 1.01e10, 1), SWEEPS_GO_ON);
    assert_int_equal(plan_judge(&free, 1, 1.01e20), SWEEPS_DIVERGE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_is_one_over_T),
        cmocka_unit_test(test_damped),
        cmocka_unit_test(test_low_bound_is_found),
        cmocka_unit_test(test_high_bound_is_found),
        cmocka_unit_test(test_stagnation),
        cmocka_unit_test(test_divergence),
        cmocka_unit_test(test_only_the_weighted_residual_counts),
        cmocka_unit_test(test_slow_swing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
