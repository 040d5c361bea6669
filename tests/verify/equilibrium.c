// SPDX-License-Identifier: MIT
//
// analysis.kind: static: equilibria against closed forms, and blocks that have none.

#include "run.h"

#include "step.h"

#define GRAVITY 9.81
#define STATIC "analysis.kind=static"

static nmm_end find(run *r) {
    while (r->report.end == NMM_END_RUNNING)
        assert_int_equal(nmm_sim_step(r->sim, &r->report), NMM_OK);
    return r->report.end;
}

static void test_column(void **state) {
    (void)state;
    run r = RUN("column.yaml", STATIC, "materials.rock.plane=stress", "covers.size=0.5");
    row_true("statics: column", "completed", find(&r) == NMM_END_COMPLETED);
    row_close("statics: column, settlement of the top", 1.226250e-3,
              -run_monitor(&r, "top").displacement[1], 2e-3);
    row_ledger("statics: column", &r);
    run_close(&r);
    rows_end();
}

// Supports hold whatever a body weighs next to its modulus: one law for settlement over strain.
static void test_light_load(void **state) {
    (void)state;
    const double modulus[] = {1e9, 1e11, 1e13};
    double first = 0;
    for (int k = 0; k < 3; k++) {
        run r = RUN("column.yaml", STATIC, "analysis.tolerance=1e-6", "materials.rock.plane=stress",
                    set_text("materials.rock.youngs_modulus=%g", modulus[k]), "covers.size=0.5");
        find(&r);
        const double scaled = -run_monitor(&r, "top").displacement[1] * modulus[k] / 1.22625e6;
        if (k == 0) first = scaled;
        row_close(set_text("statics: column of %g Pa, settlement over that by the closed form",
                           modulus[k]),
                  1, scaled, 1e-3);
        row_close(set_text("statics: column of %g Pa, the same over that at 1e9 Pa", modulus[k]), 1,
                  scaled / first, 1e-5);
        run_close(&r);
    }
    rows_end();
}

// A column between two supports that gain little in a round: no equilibrium before they stand. Each
// has half of the weight.
static void test_slow_supports(void **state) {
    (void)state;
    run r = RUN("column.yaml", STATIC, "covers.size=0.5",
                "supports=[{segment: [[0, 0], [2, 0]], fix: xy}, "
                "{segment: [[0, 10], [2, 10]], fix: xy}]");
    for (int s = 0; s < r.sim->model.n_support; s++)
        r.sim->model.support[s].stiffness *= 1e-4;
    row_true("statics: column between soft supports", "completed", find(&r) == NMM_END_COMPLETED);
    double top = 0;
    for (int s = 0; s < r.sim->model.n_support; s++)
        if (r.sim->model.support[s].place.y > 0) top += r.sim->state.support_force[2 * s + 1];
    row_close("statics: column between soft supports, force at the top", 10 * 2500 * GRAVITY, top,
              2e-3);
    run_close(&r);
    rows_end();
}

static double force_on_base(const nmm_sim *sim) {
    double sum = 0;
    for (int k = 0; k < sim->state.n_contact; k++) {
        const nmm_contact *contact = &sim->state.contact[k];
        const int p = sim->model.vertex_point[contact->vertex];
        const double y = sim->state.position[2 * p + 1] + sim->model.origin.y;
        if (contact->mode != NMM_CONTACT_OPEN && fabs(y) < 0.1) sum += contact->normal_force;
    }
    return sum;
}

static void test_stack(void **state) {
    (void)state;
    run r = RUN("stack.yaml", STATIC);
    row_true("statics: stack of 5", "completed", find(&r) == NMM_END_COMPLETED);
    row_close("statics: stack of 5, force on the base", 5 * 2500 * GRAVITY, force_on_base(r.sim),
              1e-6);
    row_ledger("statics: stack of 5", &r);
    run_close(&r);
    rows_end();
}

// Augmented contact: answers that do not depend on the penalty.
static void test_stack_penalty(void **state) {
    (void)state;
    const double penalty[] = {1, 10, 100, 1000};
    double top[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN("stack.yaml", STATIC, "contact.method=augmented",
                    set_text("contact.penalty=%g", penalty[k]));
        const char *name = set_text("statics: augmented stack, penalty %g E", penalty[k]);
        row_true(name, "completed", find(&r) == NMM_END_COMPLETED);
        row_close(set_text("%s, force on the base", name), 5 * 2500 * GRAVITY, force_on_base(r.sim),
                  1e-6);
        top[k] = run_monitor(&r, "top").displacement[1];
        row_close(set_text("%s, settlement of the top over that at 1 E", name), 1, top[k] / top[0],
                  1e-4);
        run_close(&r);
    }
    rows_end();
}

// A block on a slope of 30 degrees, a beam of two blocks between abutments: each side of the limit.
static void test_limits(void **state) {
    (void)state;
    const struct {
        const char *scene, *name;
        double friction;
        bool holds;
    } cases[] = {
        {"incline.yaml", "slope of 30 deg", 29.9, false},
        {"incline.yaml", "slope of 30 deg", 30.1, true},
        {"hinged_beam.yaml", "hinged beam (limit 21.80 deg)", 20, false},
        {"hinged_beam.yaml", "hinged beam (limit 21.80 deg)", 22.5, true},
    };
    for (int k = 0; k < 4; k++) {
        run r = RUN(cases[k].scene, STATIC,
                    set_text("interfaces.contact.friction_angle=%g", cases[k].friction));
        const nmm_end expected = cases[k].holds ? NMM_END_COMPLETED : NMM_END_NO_EQUILIBRIUM;
        row_true(set_text("statics: %s, friction %g", cases[k].name, cases[k].friction),
                 cases[k].holds ? "holds" : "no equilibrium", find(&r) == expected);
        run_close(&r);
    }
    rows_end();
}

// Which block, and where to; and a block that touches nothing.
static void test_reason(void **state) {
    (void)state;
    run r = RUN("incline.yaml", STATIC, "interfaces.contact.friction_angle=10");
    find(&r);
    row_true("statics: the free block is named", "slider",
             strstr(r.report.reason, "'slider'") != NULL);
    row_true("statics: and its way", "along x", strstr(r.report.reason, "along (1.00,") != NULL);
    run_close(&r);
    r = RUN("fall.yaml", STATIC);
    row_true("statics: a body in the air", "no equilibrium", find(&r) == NMM_END_NO_EQUILIBRIUM);
    run_close(&r);
    // Nothing acts: it is where it should be.
    r = RUN("fall.yaml", STATIC, "gravity=[0, 0]");
    row_true("statics: no load, no support", "completed", find(&r) == NMM_END_COMPLETED);
    run_close(&r);
    rows_end();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_column),        cmocka_unit_test(test_light_load),
        cmocka_unit_test(test_slow_supports), cmocka_unit_test(test_stack),
        cmocka_unit_test(test_stack_penalty), cmocka_unit_test(test_limits),
        cmocka_unit_test(test_reason),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
