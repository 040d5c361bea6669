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
    run_close(&r);
    rows_end();
}

// Augmented contact in steps that are long enough for forces to be carried: the whole motion, from
// gravity setting in to what friction holds at its end, does not depend on the penalty.
static void test_stack_penalty(void **state) {
    (void)state;
    const double penalty[] = {1, 10, 100, 1000};
    double top[4];
    for (int k = 0; k < (run_all() ? 4 : 0); k++) {
        run r = RUN("stack.yaml", "contact.method=augmented", "time.dt=5e-3",
                    set_text("contact.penalty=%g", penalty[k]));
        run_to_end(&r);
        const char *name = set_text("augmented, dt 5 ms, penalty %g E", penalty[k]);
        row_close(set_text("%s: force under block 1", name), 5 * 2500 * GRAVITY, force_at(r.sim, 0),
                  1e-4);
        top[k] = run_monitor(&r, "top").displacement[1];
        row_close(set_text("%s: settlement of the top over that at 1 E", name), 1, top[k] / top[0],
                  1e-4);
        run_close(&r);
    }
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

static void test_toppling(void **state) {
    (void)state;
    run r = RUN("toppling.yaml");
    run_to_end(&r);
    const nmm_reading low = run_monitor(&r, "low"), high = run_monitor(&r, "high");
    const double turn = -atan2(high.displacement[0] - low.displacement[0],
                               3 + high.displacement[1] - low.displacement[1]);
    // theta'' = a sin(s + theta), near s: theta = alpha / k (cosh(sqrt(k) t) - 1).
    const double r0 = 0.5 * sqrt(17), a = 0.75 * GRAVITY / r0;
    const double s = 20 * M_PI / 180 - atan(0.25), k = a * cos(s), t = r.report.time;
    row_close("toppling: angular acceleration at the onset", 0.370808,
              -turn * k / (cosh(sqrt(k) * t) - 1), 1e-2);
    row_ledger("toppling", &r);
    run_close(&r);
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
    run_close(&r);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_stack),         cmocka_unit_test(test_stack_drift),
        cmocka_unit_test(test_stack_penalty), cmocka_unit_test(test_toppling),
        cmocka_unit_test(test_hinged_beam),   cmocka_unit_test(test_shear),
        cmocka_unit_test(test_tension),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
