// SPDX-License-Identifier: MIT
//
// Time integration against closed forms: free fall, a thrown body, the decay of an oscillator under
// Shi's scheme, a body that turns freely. Shi's step for an oscillator, W = omega h:
//   x' = (2 x + 2 h v)/(2 + W^2),  h v' = ((2 - W^2) h v - 2 W^2 x)/(2 + W^2)

#include "run.h"

#include "step.h"

#include <stdlib.h>

// --- Constant forces

static void test_free_fall(void **state) {
    (void)state;
    const double dt[] = {0.5, 0.1, 0.0137, 1e-3};
    for (int k = 0; k < 4; k++) {
        run r = RUN("fall.yaml", set_text("time.dt=%.17g", dt[k]));
        run_to_end(&r);
        const nmm_reading centre = run_monitor(&r, "centre");
        row_near(set_text("free fall, dt %g: y(1)", dt[k]), -4.905, centre.displacement[1], 1e-11);
        row_near(set_text("free fall, dt %g: v(1)", dt[k]), -9.81, centre.velocity[1], 1e-10);
        row_ledger(set_text("free fall, dt %g", dt[k]), &r);
        run_close(&r);
    }
    no_rate("exact to rounding in any step");
    rows_end();
}

static void test_projectile(void **state) {
    (void)state;
    run r = RUN("projectile.yaml");
    run_to_end(&r);
    const nmm_reading centre = run_monitor(&r, "centre");
    row_near("projectile: x(1)", 3, centre.displacement[0], 1e-11);
    row_near("projectile: y(1)", -0.905, centre.displacement[1], 1e-11);
    row_ledger("projectile", &r);
    no_rate("exact to rounding in any step");
    run_close(&r);
    rows_end();
}

// --- Oscillator

// Strain of the breathing square: its corners move apart by s strain along x.
static double breathing(const run *r) {
    const nmm_reading a = run_monitor(r, "opposite"), b = run_monitor(r, "corner");
    return (b.displacement[0] - a.displacement[0]) / 0.1;
}

// Distance from equilibrium over that at the start, after each step.
static double *oscillation(double W, int n) {
    const double balance = 1e-3;
    run r = RUN("oscillator.yaml", set_text("time.dt=%.17g", W / 1000),
                set_text("time.end=%.17g", (n + 1) * W / 1000));
    double *x = calloc((size_t)n + 1, sizeof *x);
    x[0] = (balance - breathing(&r)) / balance;
    for (int k = 1; k <= n; k++) {
        run_step(&r);
        x[k] = (balance - breathing(&r)) / balance;
    }
    row_ledger(set_text("oscillator, W %g", W), &r);
    run_close(&r);
    return x;
}

static void test_oscillator(void **state) {
    (void)state;
    const double W[] = {0.1, 0.2, 0.5, 1};
    const double rho[] = {0.9975093361, 0.9901475430, 0.9428090416, 0.8164965809};
    for (int k = 0; k < 4; k++) {
        double *x = oscillation(W[k], 4);
        // x'' = T x' - D x: rho = sqrt(D) from four points.
        const double D = (x[2] * x[2] - x[1] * x[3]) / (x[1] * x[1] - x[0] * x[2]);
        row_near(set_text("oscillator: spectral radius at W %g", W[k]), rho[k], sqrt(D), 1e-9);
        free(x);
    }
    double *x = oscillation(0.1, 628);
    row_near("oscillator: W 0.1 after 628 steps", 0.207200926222, x[628], 1e-9);
    no_rate("compared with what the scheme must do, to rounding; its rate stands under newmark");
    free(x);
    rows_end();
}

// --- Free rotation

static double area_of(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int e = 0; e < model->n_element; e++) {
        const int begin = model->element_start[e], n = model->element_start[e + 1] - begin;
        const int *corner = model->corner_point + begin;
        const double *o = sim->state.position + 2 * (long)corner[0];
        for (int k = 1; k + 1 < n; k++) {
            const double *a = sim->state.position + 2 * (long)corner[k];
            const double *b = sim->state.position + 2 * (long)corner[k + 1];
            sum += 0.5 * ((a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]));
        }
    }
    return sum;
}

// Angular momentum about the model's origin; velocities and places have the same weights.
static double angular_momentum(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double sum = 0;
    for (int e = 0; e < model->n_element; e++) {
        for (int k = 0; k < 9; k++) {
            const int i = model->element_cover[3 * e + k / 3];
            const int j = model->element_cover[3 * e + k % 3];
            const double m =
                sim->system.element_mass[6 * (long)e + nmm_pair_index(3, k / 3, k % 3)];
            const double x = model->cover_place[2 * i] + sim->state.displacement[2 * i];
            const double y = model->cover_place[2 * i + 1] + sim->state.displacement[2 * i + 1];
            const double *v = sim->state.velocity + 2 * (long)j;
            sum += m * (x * v[1] - y * v[0]);
        }
    }
    return sum;
}

// Growth of the area in a steady turn: the virtual work of a uniform dilatation gives the mean of
// the area strain, density spin^2 side^2 / (12 (lambda + mu)), on any mesh.
static double centrifugal_growth(double spin) {
    const double E = 1e10, density = 1000;
    return density * spin * spin / (12 * 0.8 * E);
}

static double turn_of(const nmm_sim *sim, double before) {
    const double angle = atan2(sim->state.rotation[1], sim->state.rotation[0]);
    return remainder(angle - before, 2 * M_PI);
}

// Returns the momentum that is left.
static double turn(int steps_per_turn) {
    run r = RUN("rotation.yaml", set_text("time.dt=%.17g", 2 * M_PI / steps_per_turn));
    const double area = area_of(r.sim), start = angular_momentum(r.sim), inertia = 1000 / 6.0;
    const char *name = set_text("free rotation, %d steps a turn", steps_per_turn);
    row_close(set_text("%s: angular momentum at the start", name), inertia, start, 1e-12);
    double worst = 0, turned = 0;
    bool more = true;
    while (more) {
        more = run_step(&r);
        const double spin = angular_momentum(r.sim) / inertia;
        const double growth = area_of(r.sim) / area - 1;
        worst = fmax(worst, fabs(growth - centrifugal_growth(spin)));
        turned += turn_of(r.sim, turned);
    }
    row_below(set_text("%s: change of area over %ld steps", name, r.report.step), worst, 1e-10);
    row_note(set_text("%s: turns in 62.8 s at 1 rad/s", name), turned / (2 * M_PI));
    row_note(set_text("%s: relative change of kinetic energy", name),
             r.report.energy.kinetic / (0.5 * inertia));
    const double left = angular_momentum(r.sim) / start;
    row_note(set_text("%s: relative change of angular momentum", name), left - 1);
    row_ledger(name, &r);
    run_close(&r);
    return left;
}

// A hundred turns. A step of h takes (spin h)^2 / 2 of the spin, so that after the angle a it is
// 1 / (1 + h a / 2) of what it was, and the time is (1 / spin^2 - 1) / h. A body of one strain:
// what is lost does not depend on the mesh. A hundred steps a turn would leave 1/20 of the spin.
static void turn_hundred(int steps_per_turn) {
    const double h = 2 * M_PI / steps_per_turn, slower = 1 + 0.5 * h * 200 * M_PI;
    run r = RUN("rotation.yaml", set_text("time.dt=%.17g", h), "covers.mesh=block",
                "covers.size=auto", set_text("time.end=%.17g", (slower * slower - 1) / h));
    const double area = area_of(r.sim), start = angular_momentum(r.sim), inertia = 1000 / 6.0;
    const char *name = set_text("free rotation, %d steps a turn at first", steps_per_turn);
    double worst = 0, turned = 0;
    bool more = true;
    while (more) {
        more = run_step(&r);
        const double spin = angular_momentum(r.sim) / inertia;
        worst = fmax(worst, fabs(area_of(r.sim) / area - 1 - centrifugal_growth(spin)));
        turned += turn_of(r.sim, turned);
    }
    row_close(set_text("%s: turns in %ld steps", name, r.report.step), 100, turned / (2 * M_PI),
              1e-2);
    row_below(set_text("%s: change of area", name), worst, 1e-10);
    row_near(set_text("%s: relative change of angular momentum", name), 1 / slower - 1,
             angular_momentum(r.sim) / start - 1, 1e-2);
    row_ledger(name, &r);
    run_close(&r);
}

static void test_rotation(void **state) {
    (void)state;
    const double h[] = {1.0 / 100, 1.0 / 1000}, left[] = {turn(100), turn(1000)};
    const double lost[] = {1 / (left[0] * left[0]) - 1, 1 / (left[1] * left[1]) - 1};
    row_rate("1/L^2 - 1 in dt, L the momentum left of 1", 1, 2, h, lost, 0.02);
    turn_hundred(1000);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_free_fall),
        cmocka_unit_test(test_projectile),
        cmocka_unit_test(test_oscillator),
        cmocka_unit_test(test_rotation),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
