// SPDX-License-Identifier: MIT
//
// analysis.scheme: newmark, whose forces are means over the step, against closed forms; and the
// rates of both schemes. For an oscillator with W = omega h and the share s = 2 beta of the end
//   rho^2 = (2 + (1 - s) W^2) / (2 + s W^2),   beta = 1/4: x_k = cos(2 k atan(W / 2)).

#include "run.h"

#include "step.h"

#include <stdlib.h>

#define GRAVITY 9.81
#define NEWMARK "analysis.scheme=newmark"

// --- Oscillator

// Strain of the breathing square from its balance, over that at the start, after each step.
static double *oscillation(const char *scheme, const char *beta, double W, int n) {
    const double balance = 1e-3;
    run r = RUN("oscillator.yaml", set_text("time.dt=%.17g", W / 1000),
                set_text("time.end=%.17g", (n + 1) * W / 1000), scheme, beta);
    double *x = calloc((size_t)n + 1, sizeof *x);
    x[0] = 1;
    for (int k = 1; k <= n; k++) {
        run_step(&r);
        const nmm_reading a = run_monitor(&r, "opposite"), b = run_monitor(&r, "corner");
        x[k] = 1 - (b.displacement[0] - a.displacement[0]) / (0.1 * balance);
    }
    row_ledger(set_text("newmark: oscillator, W %g", W), &r);
    run_close(&r);
    return x;
}

static void test_oscillator(void **state) {
    (void)state;
    const double W[] = {0.1, 0.5, 1.5};
    for (int k = 0; k < 3; k++) {
        double *x = oscillation(NEWMARK, NULL, W[k], 200);
        row_near(set_text("newmark: oscillator, W %g after 200 steps", W[k]),
                 cos(400 * atan(W[k] / 2)), x[200], 1e-8);
        free(x);
    }
    const double W2 = 0.25, share = 0.6;
    double *x = oscillation(NEWMARK, "analysis.beta=0.3", 0.5, 4);
    const double D = (x[2] * x[2] - x[1] * x[3]) / (x[1] * x[1] - x[0] * x[2]);
    row_near("newmark: spectral radius, beta 0.3, W 0.5",
             sqrt((2 + (1 - share) * W2) / (2 + share * W2)), sqrt(D), 1e-9);
    free(x);
    rows_end();
}

// Largest error over five radians, against the oscillation itself.
static double error_of(const char *scheme, int n) {
    const double W = 5.0 / n;
    double *x = oscillation(scheme, NULL, W, n), worst = 0;
    for (int k = 0; k <= n; k++)
        worst = fmax(worst, fabs(x[k] - cos(k * W)));
    free(x);
    return worst;
}

static void test_rates(void **state) {
    (void)state;
    row_near("newmark: rate in dt", 2, log2(error_of(NEWMARK, 100) / error_of(NEWMARK, 200)), 0.02);
    const char *shi = "analysis.scheme=shi";
    row_near("Shi: rate in dt", 1, log2(error_of(shi, 800) / error_of(shi, 1600)), 0.02);
    rows_end();
}

// --- Rotation

// Angular momentum of a body of order 0, about its centre.
static double angular_momentum(const nmm_sim *sim) {
    const nmm_system *system = &sim->system;
    double sum = 0;
    for (int c = 0; c < sim->model.n_cover; c++) {
        const double x = sim->model.cover_place[2 * c] + sim->state.displacement[2 * c];
        const double y = sim->model.cover_place[2 * c + 1] + sim->state.displacement[2 * c + 1];
        for (int k = system->base_start[c]; k < system->base_start[c + 1]; k++) {
            const double *v = sim->state.velocity + 2 * (long)system->base_col[k];
            sum += system->base_mass[k] * (x * v[1] - y * v[0]);
        }
    }
    return sum;
}

// Smallest and largest of what the shape of a body of one strain is told by.
typedef struct shape_range {
    double low[3], high[3]; // area, half of what the diagonals differ by, of the sides, over length
} shape_range;

static void widen(shape_range *range, const nmm_sim *sim) {
    double d[6];
    memcpy(d, sim->state.displacement, sizeof d);
    const nmm_tensor H = nmm_displacement_gradient(d, sim->model.element_gradient);
    // Green's strain: turns have no part in it, and no digits are lost by one.
    const double xx = H.xx + 0.5 * (H.xx * H.xx + H.yx * H.yx);
    const double yy = H.yy + 0.5 * (H.xy * H.xy + H.yy * H.yy);
    const double xy = 0.5 * (H.xy + H.yx + H.xx * H.xy + H.yx * H.yy);
    const double now[3] = {(1 + H.xx) * (1 + H.yy) - H.xy * H.yx, xy, 0.5 * (xx - yy)};
    for (int k = 0; k < 3; k++) {
        range->low[k] = fmin(range->low[k], now[k]);
        range->high[k] = fmax(range->high[k], now[k]);
    }
}

// A hundred turns of a hundred steps: nothing is lost, and the shape stays. An initial stress of
// density spin^2 / 12 holds the body together: one that begins to turn unstretched would breathe by
// its centrifugal growth, density (spin side)^2 / (12 (lambda + mu)). What is left of breathing is
// about 1/40 of that, goes on for ever with beta = 1/4, and is smaller with more, or in a stiffer
// body: below 1e-10 where the growth is below 4e-9.
static void spin(const char *beta, const char *modulus, int turns, double range) {
    run r = RUN("rotation.yaml", NEWMARK, "covers.mesh=block", "covers.size=auto",
                set_text("materials.stiff.youngs_modulus=%s", modulus), "analysis.tolerance=1e-13",
                "solver.tolerance=1e-12",
                "initial_stress={kind: uniform, xx: 83.3333333333333, yy: 83.3333333333333, xy: 0}",
                set_text("time.end=%.17g", 2 * turns * M_PI), beta);
    const double before = angular_momentum(r.sim);
    row_close("newmark: free rotation, angular momentum at the start", 1000 / 6.0, before, 1e-12);
    shape_range shape = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    bool more = true;
    while (more) {
        more = run_step(&r);
        if (r.report.step >= 1000) widen(&shape, r.sim);
    }
    const char *name = set_text("newmark: %s, E %s Pa, %d turns", beta, modulus, turns);
    const char *what[] = {"area", "shear strain (diagonals)", "difference of the sides"};
    for (int k = 0; k < 3; k++)
        row_below(set_text("%s, range of the %s", name, what[k]), shape.high[k] - shape.low[k],
                  range);
    row_below(set_text("%s, loss of angular momentum", name), angular_momentum(r.sim) / before - 1,
              1e-10);
    row_note(set_text("%s, change of kinetic energy", name),
             r.report.energy.kinetic / (1000 / 12.0));
    row_below(set_text("%s, ledger residual over kinetic energy", name),
              r.report.energy.residual / (1000 / 12.0), 1e-8);
    run_close(&r);
}

// The same of many covers, whose rounding is a torque step after step.
static void spin_lattice(int turns) {
    run r = RUN("rotation.yaml", NEWMARK, "materials.stiff.youngs_modulus=1e11",
                "analysis.tolerance=1e-13", "solver.tolerance=1e-12",
                set_text("time.end=%.17g", 2 * turns * M_PI));
    const double before = angular_momentum(r.sim);
    row_close("newmark: free rotation of a lattice, angular momentum at the start", 1000 / 6.0,
              before, 1e-12);
    run_to_end(&r);
    row_below(set_text("newmark: lattice, E 1e11 Pa, %d turns, loss of angular momentum", turns),
              angular_momentum(r.sim) / before - 1, 1e-9);
    run_close(&r);
}

static void test_rotation(void **state) {
    (void)state;
    spin_lattice(run_all() ? 100 : 10);
    spin("analysis.beta=0.25", "1e7", 100, 1e-6);
    spin("analysis.beta=0.3", "1e7", 100, 1e-7);
    spin("analysis.beta=0.25", "1e11", run_all() ? 100 : 15, 1e-10);
    no_rate("what must not change does not, in any step");
    rows_end();
}

// --- With contact

static void test_contact(void **state) {
    (void)state;
    run r = RUN("incline.yaml", NEWMARK);
    run_to_end(&r);
    row_close("newmark: incline 30 deg, phi 20: way at 2 s", 3.625629,
              run_monitor(&r, "slider").displacement[0], 1e-3);
    row_ledger("newmark: incline", &r);
    no_rate("constant acceleration, which any step has exactly");
    run_close(&r);
    r = RUN("stack.yaml", NEWMARK);
    run_to_end(&r);
    const nmm_reading top = run_monitor(&r, "top");
    // Stiff modes do not fade by themselves here: damping alone brings it to rest.
    row_below("newmark: stack of 5, speed at rest", hypot(top.velocity[0], top.velocity[1]), 1e-4);
    row_ledger("newmark: stack of 5", &r);
    no_rate("a balance of forces");
    run_close(&r);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_oscillator),
        cmocka_unit_test(test_rates),
        cmocka_unit_test(test_rotation),
        cmocka_unit_test(test_contact),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
