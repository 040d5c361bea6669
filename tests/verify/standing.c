// SPDX-License-Identifier: MIT
//
// Standing, toppling and breaking against closed forms: a stack at rest, the onset of toppling, the
// hinged beam of two blocks, direct shear and the tension cut-off of a bonded joint.

#include "run.h"

#include "step.h"

#define GRAVITY 9.81

// --- Stack

// Sum of the normal forces of contacts whose vertex lies at height y.
static double force_at(const nmm_sim *sim, double y) {
    double sum = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        const int p = sim->model.vertex_point[contact->vertex];
        const double at = sim->state.position[2 * p + 1] + sim->model.origin.y;
        if (contact->mode != NMM_CONTACT_OPEN && fabs(at - y) < 0.1) sum += contact->normal_force;
    }
    return sum;
}

static void test_stack(void **state) {
    (void)state;
    run r = RUN("stack.yaml");
    run_to_end(&r);
    for (int level = 0; level < 5; level++) {
        row_close(set_text("stack of 5: force under block %d", level + 1),
                  (5 - level) * 2500 * GRAVITY, force_at(r.sim, level), 1e-6);
    }
    row_ledger("stack of 5", &r);
    no_rate("a balance of forces, met to analysis.tolerance");
    run_close(&r);
    rows_end();
}

// Augmented contact: the settlement at the end over that of the first penalty, at one length of the
// steps. The whole motion, from gravity setting in to what friction holds at its end, does not
// depend on the penalty.
static void settle_stack(double dt) {
    const double penalty[] = {1, 10, 100, 1000};
    double top[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN("stack.yaml", "contact.method=augmented", set_text("time.dt=%g", dt),
                    set_text("contact.penalty=%g", penalty[k]));
        run_to_end(&r);
        const char *name = set_text("augmented, dt %g ms, penalty %g E", 1e3 * dt, penalty[k]);
        row_close(set_text("%s: force under block 1", name), 5 * 2500 * GRAVITY, force_at(r.sim, 0),
                  1e-4);
        top[k] = run_monitor(&r, "top").displacement[1];
        row_close(set_text("%s: settlement of the top over that at 1 E", name), 1, top[k] / top[0],
                  1e-4);
        run_close(&r);
    }
}

static void test_stack_penalty(void **state) {
    (void)state;
    const double dt[] = {5e-3, 1e-2, 3e-3, 2e-3, 1e-3, 5e-4};
    for (int k = 0; k < (run_all() ? 6 : 1); k++)
        settle_stack(dt[k]);
    rows_end();
}

static void test_stack_drift(void **state) {
    (void)state;
    if (!run_all()) return;
    run r = RUN("stack.yaml", "time.end=10.1");
    run_until(&r, 2);
    const nmm_reading early = run_monitor(&r, "top");
    run_to_end(&r);
    const nmm_reading late = run_monitor(&r, "top");
    assert_true(r.report.step >= 10000);
    row_below("stack of 5: drift of the top in x, 8000 further steps",
              late.displacement[0] - early.displacement[0], 1e-9);
    row_below("stack of 5: drift of the top in y, 8000 further steps",
              late.displacement[1] - early.displacement[1], 1e-9);
    row_below("stack of 5: speed after 1e4 steps", hypot(late.velocity[0], late.velocity[1]), 1e-9);
    run_close(&r);
    rows_end();
}

// --- Toppling

#define SLENDER 0.25 // width of the column over its height
#define RADIUS (0.5 * sqrt(17))

// How far the column has turned over its corner.
static double turn_of(const run *r) {
    const nmm_reading low = run_monitor(r, "low"), high = run_monitor(r, "high");
    return atan2(high.displacement[0] - low.displacement[0],
                 3 + high.displacement[1] - low.displacement[1]);
}

// A rigid column on a base of the angle a turns by theta'' = A sin(beyond + theta), beyond = a -
// atan(b/h), A = (3/4) g/r: near the start theta = sin(beyond)/cos(beyond) (cosh(k t) - 1), with
// k^2 = A cos(beyond).
static double toppled(double beyond, double t) {
    const double k = sqrt(0.75 * GRAVITY / RADIUS * cos(beyond));
    return tan(beyond) * (cosh(k * t) - 1);
}

// Over the closed form, less one.
static double toppling_error(const char *set) {
    run r = RUN("toppling.yaml", set);
    run_to_end(&r);
    const double beyond = 20 * M_PI / 180 - atan(SLENDER);
    const double error = turn_of(&r) / toppled(beyond, r.report.time) - 1;
    run_close(&r);
    return error;
}

static void test_toppling(void **state) {
    (void)state;
    const double modulus[] = {2e10, 2e11, 2e12};
    double give[3], error[3];
    for (int k = run_all() ? 0 : 1; k < (run_all() ? 3 : 2); k++) {
        const char *set = set_text("materials.rock.youngs_modulus=%g", modulus[k]);
        give[k] = 1 / modulus[k];
        error[k] = toppling_error(set);
        row_close(set_text("toppling, E %g Pa: angular acceleration at the onset", modulus[k]),
                  0.370808, 0.370808 * (1 + error[k]), k == 0 ? 0.05 : 1e-2);
    }
    run r = RUN("toppling.yaml");
    run_to_end(&r);
    row_ledger("toppling", &r);
    run_close(&r);
    // The corner on which it turns gives way.
    if (run_all()) row_rate("the acceleration in 1/E", 0, 3, give, error, 0);
    rows_end();
}

// The turn at the end, and in its second half, on a base whose tangent is a part of b/h.
static double limit_turn(double part, const char *set, double *late) {
    const double angle = atan(part * SLENDER);
    run r = RUN("toppling_limit.yaml",
                set_text("gravity=[%.17g, %.17g]", GRAVITY * sin(angle), -GRAVITY * cos(angle)),
                set, set != NULL ? "covers.size=auto" : NULL);
    run_until(&r, 1);
    const double early = turn_of(&r);
    run_to_end(&r);
    const double turn = turn_of(&r);
    *late = turn - early;
    run_close(&r);
    return turn;
}

static void test_toppling_limit(void **state) {
    (void)state;
    const struct {
        const char *name, *set;
        double tolerance;
    } mesh[] = {{"lattice", NULL, 0.1}, {"whole blocks", "covers.mesh=block", 0.02}};
    for (int k = 0; k < 2; k++) {
        double late = 0, turn = limit_turn(0.99, mesh[k].set, &late);
        const char *name = set_text("%s, 1 %% below the limit", mesh[k].name);
        // It leans by what it is compressed more under one corner than under the other.
        row_below(set_text("%s: turn after 2 s", name), turn, 1e-5);
        row_below(set_text("%s: turn from 1 s to 2 s", name), late, 1e-8);
        turn = limit_turn(1.01, mesh[k].set, &late);
        name = set_text("%s, 1 %% beyond the limit", mesh[k].name);
        const double beyond = atan(1.01 * SLENDER) - atan(SLENDER);
        row_close(set_text("%s: turn after 2 s", name), toppled(beyond, 2), turn,
                  mesh[k].tolerance);
    }
    no_rate("a limit, held between two runs");
    rows_end();
}

// --- Hinged beam

static double fall_of_beam(double phi) {
    run r = RUN("hinged_beam.yaml", set_text("interfaces.contact.friction_angle=%.17g", phi));
    run_to_end(&r);
    const double fall = -run_monitor(&r, "abutment").displacement[1];
    run_close(&r);
    return fall;
}

static void test_hinged_beam(void **state) {
    (void)state;
    // Far from slipping the abutments bear as much friction as balance needs.
    run r = RUN("hinged_beam.yaml", "interfaces.contact.friction_angle=30",
                run_all() ? "time.end=1" : "time.end=0.6");
    run_to_end(&r);
    double normal = 0, shear = 0;
    for (int k = 0; k < r.sim->state.n_contact; k++) {
        const nmm_contact *contact = &r.sim->state.contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        if (r.sim->state.position[2 * r.sim->model.vertex_point[contact->vertex]] > -4) continue;
        normal += contact->normal_force;
        shear += fabs(contact->shear_force);
    }
    row_near("hinged beam: friction angle that the abutments need", 21.80,
             atan2(shear, normal) * 180 / M_PI, 0.01);
    row_close("hinged beam: thrust", 2500 * GRAVITY * 5 * 5 / 2.0, normal, 1e-3);
    no_rate("a balance of forces and a limit, held between two runs");
    run_close(&r);
    if (!run_all()) {
        rows_end();
        return;
    }
    row_true("hinged beam: slips at 21.6 degrees", "slips", fall_of_beam(21.6) > 5e-3);
    row_true("hinged beam: stands at 22.0 degrees", "stands", fall_of_beam(22.0) < 1e-4);
    rows_end();
}

// --- Bonded joint

typedef struct joint_force {
    double normal, shear; // [N], pressure positive
    int bonded;
} joint_force;

static joint_force force_of_joint(const nmm_sim *sim) {
    joint_force sum = {0};
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        sum.bonded += contact->bonded;
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        sum.normal += contact->normal_force;
        sum.shear += fabs(contact->shear_force);
    }
    return sum;
}

static void test_shear(void **state) {
    (void)state;
    run r = RUN("shear.yaml");
    run_until(&r, 0.1);
    row_close("direct shear: normal stress", 1e5, force_of_joint(r.sim).normal, 1e-3);
    double peak = 0;
    while (run_step(&r))
        peak = fmax(peak, force_of_joint(r.sim).shear);
    const double slope = tan(30 * M_PI / 180);
    row_close("direct shear: peak c + sigma tan phi", 5e4 + 1e5 * slope, peak, 2e-3);
    const joint_force last = force_of_joint(r.sim);
    row_close("direct shear: after slip sigma tan phi", 1e5 * slope, last.shear, 1e-3);
    row_true("direct shear: no bond left", "none", last.bonded == 0);
    row_ledger("direct shear", &r);
    no_rate("the peak lies within a step: 0.19 % of it at this dt, in proportion to dt, at most");
    run_close(&r);
    rows_end();
}

static void test_tension(void **state) {
    (void)state;
    run r = RUN("tension.yaml");
    double peak = 0, again = 0;
    while (run_step(&r)) {
        const double pull = -force_of_joint(r.sim).normal;
        if (r.report.time <= 1)
            peak = fmax(peak, pull);
        else
            again = fmax(again, pull);
    }
    row_close("tension cut-off: peak T times length", 2e4, peak, 2e-3);
    row_below("tension cut-off: tension of the broken joint", again, 0);
    row_true("tension cut-off: no bond left", "none", force_of_joint(r.sim).bonded == 0);
    row_ledger("tension cut-off", &r);
    no_rate("the peak lies within a step: 0.2 % of it at this dt, in proportion to dt, at most");
    run_close(&r);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stack),          cmocka_unit_test(test_stack_drift),
        cmocka_unit_test(test_stack_penalty),  cmocka_unit_test(test_toppling),
        cmocka_unit_test(test_toppling_limit), cmocka_unit_test(test_hinged_beam),
        cmocka_unit_test(test_shear),          cmocka_unit_test(test_tension),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
