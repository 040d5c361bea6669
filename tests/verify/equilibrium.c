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

// A wedge of a millimetre between two joints that meet the walls: its supports hardly move it, and
// exact ones would need forces of any size.
static void test_wedge(void **state) {
    (void)state;
    const double modulus[] = {1e9, 1e11, 1e13};
    double first = 0;
    for (int k = 0; k < 3; k++) {
        run r =
            RUN("column_confined.yaml", STATIC, "time={end: 1}", "contact.method=augmented",
                set_text("materials.rock.youngs_modulus=%g", modulus[k]),
                "interfaces={clean: {friction_angle: 30}}",
                "joints=[{polyline: [[-1, 4], [3, 4]]}, {polyline: [[-1, 3.999], [3, 4.0025]]}]");
        find(&r);
        const char *name = set_text("statics: column of %g Pa with a thin wedge", modulus[k]);
        const double scaled = -run_monitor(&r, "top").displacement[1] * modulus[k] / 1.021875e6;
        if (k == 0) first = scaled;
        nmm_summary summary;
        nmm_sim_summary(r.sim, &summary);
        row_close(set_text("%s, settlement over that by the closed form", name), 1, scaled, 2e-3);
        row_close(set_text("%s, the same over that at 1e9 Pa", name), 1, scaled / first, 1e-4);
        row_below(set_text("%s, passes", name), (double)summary.open_close_iterations, 600);
        run_close(&r);
    }
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

// A block without a name is told by a point in it: here the lower part of a column that hangs.
static void test_place(void **state) {
    (void)state;
    run r = RUN("column.yaml", STATIC, "joints=[{polyline: [[-1, 4.2], [3, 4.2]]}]",
                "supports=[{segment: [[0, 10], [2, 10]], fix: xy}]");
    row_true("statics: half of a column falls", "no equilibrium",
             find(&r) == NMM_END_NO_EQUILIBRIUM);
    const char *point = strstr(r.report.reason, "which has the point (");
    double x = -1, y = -1;
    if (point != NULL) sscanf(point, "which has the point (%lf, %lf)", &x, &y);
    row_true("statics: which half is told by a point in it", "yes",
             x > 0 && x < 2 && y > 0 && y < 4.2);
    run_close(&r);
    rows_end();
}

// Elastica: a clamped cantilever under a force at its end, P L^2 / (E I) = 1 (Bisshopp and Drucker,
// Q. Appl. Math. 3, 1945). It bends by many covers and is not free.
static void test_elastica(void **state) {
    (void)state;
    const double force = 1e9 * 0.25 * 0.25 * 0.25 / 12 / 100;
    run r = RUN("cantilever.yaml", STATIC, "time={end: 1}", "covers={size: 0.5, order: 1}",
                "domain=[{polygon: [[0, -0.125], [10, -0.125], [10, 0.125], [0, 0.125]]}]",
                "materials.metal={density: 2500, youngs_modulus: 1e9, poissons_ratio: 0}",
                "supports=[{segment: [[0, -0.125], [0, 0.125]], fix: xy}]",
                set_text("loads=[{point: [10, 0], force: [0, -%.17g]}]", force),
                "monitors=[{name: tip, point: [10, 0]}]");
    row_true("statics: slender cantilever", "completed", find(&r) == NMM_END_COMPLETED);
    const nmm_reading tip = run_monitor(&r, "tip");
    row_close("statics: slender cantilever, deflection of the tip over its length", 0.30172,
              -0.1 * tip.displacement[1], 1e-3);
    row_close("statics: slender cantilever, way of the tip along it over its length", 0.05643,
              -0.1 * tip.displacement[0], 1e-3);
    run_close(&r);
    rows_end();
}

// A column under its own weight falls over beyond rho g A H^3 / (E I) = 7.84 (Greenhill 1881); here
// that is 147. It is clamped, so nothing of it is free.
static void test_buckling(void **state) {
    (void)state;
    run r =
        RUN("column.yaml", STATIC, "time={end: 1}", "covers={size: 1, order: 0}",
            "domain=[{polygon: [[0, 0], [1, 0], [1, 10], [0, 10]]}]",
            "materials.rock.youngs_modulus=2e6", "supports=[{segment: [[0, 0], [1, 0]], fix: xy}]",
            "loads=[{point: [0.5, 9.9], force: [100, 0]}]", "monitors=[]");
    row_true("statics: slender column of soft rock", "no equilibrium",
             find(&r) == NMM_END_NO_EQUILIBRIUM);
    row_true("statics: which buckles and is not free", "yes",
             strstr(r.report.reason, "buckles") != NULL);
    run_close(&r);
    rows_end();
}

#define LAID                                                                                       \
    STATIC, "time={end: 1}", "domain=[{polygon: [[0, 0], [4, 0], [4, 2], [0, 2]]}]",               \
        "joints=[{polyline: [[-1, 1.1], [5, 1.1]]}]", "interfaces={laid: {friction_angle: 40}}",   \
        "supports=[{segment: [[0, 0], [4, 0]], fix: xy}]",                                         \
        "monitors=[{name: top, point: [2, 2]}]", "materials.rock.youngs_modulus=1e8",              \
        "covers.size=0.25", "analysis.tolerance=1e-6"

// Contact springs up to the stiffest that a scene may ask for, and springs that double precision
// cannot hold.
static void test_stiff_contact(void **state) {
    (void)state;
    const double penalty[] = {1e4, 1e6, 1e7};
    double first = 0;
    for (int k = 0; k < 3; k++) {
        run r = RUN("column.yaml", LAID, set_text("contact.penalty=%g", penalty[k]));
        row_true(set_text("statics: two blocks, penalty %g E", penalty[k]), "completed",
                 find(&r) == NMM_END_COMPLETED);
        const double top = run_monitor(&r, "top").displacement[1];
        if (k == 0) first = top;
        row_close(set_text("statics: two blocks, penalty %g E, settlement over that at 1e4 E",
                           penalty[k]),
                  1, top / first, 1e-4);
        run_close(&r);
    }
    run r = RUN("column.yaml", LAID, "interfaces.laid.normal_stiffness=1e19");
    row_true("statics: two blocks, springs of 1e19 Pa/m", "completed",
             find(&r) == NMM_END_COMPLETED);
    row_close("statics: two blocks, springs of 1e19 Pa/m, settlement over that at 1e4 E", 1,
              run_monitor(&r, "top").displacement[1] / first, 1e-4);
    run_close(&r);
    r = RUN("column.yaml", LAID, "interfaces.laid.normal_stiffness=1e21",
            "materials.rock.youngs_modulus=1e6");
    row_true("statics: two soft blocks, springs of 1e21 Pa/m", "no answer",
             find(&r) != NMM_END_COMPLETED);
    row_true("statics: the reason names the key", "yes",
             strstr(r.report.reason, "normal_stiffness") != NULL);
    run_close(&r);
    rows_end();
}

// Rows of the far corner of the square: it comes by 2.5e-3 m, small strains but for their square.
static void corner_rows(const run *r, const char *name) {
    const double *moved = run_monitor(r, "corner").displacement;
    row_close(set_text("%s, way of the far corner along x", name), -2.5e-3, moved[0], 1e-3);
    row_close(set_text("%s, way of the far corner along y", name), -2.5e-3, moved[1], 1e-3);
}

// Supports that bear nothing: what the balance of forces leaves is all that their springs hold.
static void test_gauge_points(void **state) {
    (void)state;
    static const struct {
        const char *name, *set;
    } cases[] = {
        {"covers of 0.25 m", "covers={size: 0.25}"},
        {"covers of 0.2 m", "covers={size: 0.2}"},
        {"order 1", "covers={size: 0.5, order: 1}"},
        {"1e13 Pa", "materials.rock.youngs_modulus=1e13"},
        {"mixed precision", "solver={method: pcg, precision: mixed}"},
    };
    for (int k = 0; k < 5; k++) {
        run r = RUN("gauge.yaml", cases[k].set);
        const char *name = set_text("statics: square on gauge points, %s", cases[k].name);
        row_true(name, "completed", find(&r) == NMM_END_COMPLETED);
        row_below(set_text("%s, steps", name), (double)r.sim->state.step, 20);
        if (k != 3) corner_rows(&r, name);
        const double *stress = run_monitor(&r, "corner").stress;
        row_close(set_text("%s, stress across x", name), -1e6, stress[0], 2e-3);
        double force = 0;
        for (int s = 0; s < 2 * r.sim->model.n_support; s++)
            force = nmm_max(force, fabs(r.sim->state.support_force[s]));
        row_below(set_text("%s, force on a support over that on a side", name), force / 4e6, 1e-4);
        run_close(&r);
    }
    rows_end();
}

// The forces on a disc act where two points of it are held, and balance by themselves.
static void test_disc(void **state) {
    (void)state;
    const double size[] = {0.06, 0.04};
    for (int k = 0; k < 2; k++) {
        run r = RUN("brazilian.yaml", STATIC, "analysis.tolerance=1e-6", "time={end: 1}",
                    "supports=[{point: [0, -0.5], fix: xy}, {point: [0, 0.5], fix: x}]",
                    "solver={}", set_text("covers.size=%g", size[k]));
        const char *name = set_text("statics: disc on gauge points, covers of %g m", size[k]);
        row_true(name, "completed", find(&r) == NMM_END_COMPLETED);
        row_below(set_text("%s, steps", name), (double)r.sim->state.step, 20);
        double stress[3];
        run_stress(&r, 0, 0, 1.5 * size[k], stress);
        row_close(set_text("%s, pressure along at the centre", name), -1.909859e6, stress[1], 0.03);
        row_close(set_text("%s, tension across at the centre", name), 6.366198e5, stress[0], 0.05);
        run_close(&r);
    }
    rows_end();
}

// Where nothing acts in the end all forces are rounding: stress that is let go, by one body and by
// two that touch, and bodies that their supports carry along.
static void test_nothing_acts(void **state) {
    (void)state;
    static const char *const parts[] = {"joints=[]", "joints=[{polyline: [[-1, 2.1], [5, 2.1]]}]"};
    for (int k = 0; k < 2; k++) {
        const char *name = set_text("statics: %s", k == 0 ? "one body" : "two bodies that touch");
        run r = RUN("gauge.yaml", "loads=[]", "supports=[]", parts[k],
                    "interfaces={clean: {friction_angle: 30}}",
                    "initial_stress={kind: uniform, xx: -1e6, yy: -1e6}");
        row_true(set_text("%s, released", name), "completed", find(&r) == NMM_END_COMPLETED);
        row_below(set_text("%s, released, stress left", name),
                  fabs(run_monitor(&r, "corner").stress[0]), 1);
        run_close(&r);
        r = RUN("gauge.yaml", "loads=[]", parts[k], "interfaces={clean: {friction_angle: 30}}",
                "supports=[{segment: [[0, 0], [4, 0]], fix: xy, motion: [[0, 0.1, 0]]}, "
                "{segment: [[0, 4], [4, 4]], fix: xy, motion: [[0, 0.1, 0]]}]");
        row_true(set_text("%s, carried along", name), "completed", find(&r) == NMM_END_COMPLETED);
        row_close(set_text("%s, carried along by", name), 0.1,
                  run_monitor(&r, "corner").displacement[0], 1e-9);
        run_close(&r);
    }
    rows_end();
}

// A cart on rollers that is pushed by a hundred thousandth of its weight: it is not called free,
// and after all steps it is told how far it went.
static void test_slow(void **state) {
    (void)state;
    run r = RUN("fall.yaml", STATIC, "time={end: 1}", "analysis.tolerance=1e-6",
                "supports=[{segment: [[0, 0], [20, 0]], fix: y}]",
                "loads=[{point: [20, 10], force: [100, 0]}]");
    row_true("statics: pushed slowly", "no equilibrium", find(&r) == NMM_END_NO_EQUILIBRIUM);
    row_true("statics: pushed slowly, named", "yes", strstr(r.report.reason, "'body'") != NULL);
    row_true("statics: pushed slowly, its way", "along x",
             strstr(r.report.reason, "along (1.00,") != NULL);
    run_close(&r);
    rows_end();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_column),        cmocka_unit_test(test_light_load),
        cmocka_unit_test(test_slow_supports), cmocka_unit_test(test_stack),
        cmocka_unit_test(test_stack_penalty), cmocka_unit_test(test_limits),
        cmocka_unit_test(test_reason),        cmocka_unit_test(test_place),
        cmocka_unit_test(test_wedge),         cmocka_unit_test(test_elastica),
        cmocka_unit_test(test_buckling),      cmocka_unit_test(test_stiff_contact),
        cmocka_unit_test(test_gauge_points),  cmocka_unit_test(test_disc),
        cmocka_unit_test(test_nothing_acts),  cmocka_unit_test(test_slow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
