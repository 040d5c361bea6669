// SPDX-License-Identifier: MIT
//
// Elastostatics against closed forms: columns under their own weight, Timoshenko's cantilever with
// its rate of convergence, contact patch tests. One step of very long dt is a static solution.

#include "run.h"

#include "step.h"

#include "motion.h"

#include <stdlib.h>

// --- Gravity column

#define WEIGHT (2500 * 9.81)
#define HEIGHT 10.0

// Displacement of a column of modulus E and ratio nu of the plane, middle line x = 1.
static nmm_vec2 column(nmm_vec2 X, double E, double nu) {
    const double x = X.x - 1, f = WEIGHT / E;
    return (nmm_vec2){nu * f * (HEIGHT - X.y) * x,
                      f * (0.5 * X.y * X.y - HEIGHT * X.y + 0.5 * nu * x * x)};
}

static nmm_vec2 column_stress(nmm_vec2 X) {
    return column(X, 1e9, 0.25);
}

static nmm_vec2 column_strain(nmm_vec2 X) {
    return column(X, 1e9 / (1 - 0.25 * 0.25), 0.25 / 0.75);
}

static nmm_vec2 column_confined(nmm_vec2 X) {
    return column(X, 1e9 * 0.75 / (1.25 * 0.5), 0);
}

// Root mean square of the error at all points over that of the exact displacement.
static double error_of(const nmm_sim *sim, motion_field exact) {
    const nmm_model *model = &sim->model;
    double sum = 0, scale = 0;
    for (int p = 0; p < model->n_point; p++) {
        const double *X = model->point + 2 * (long)p, *x = sim->state.position + 2 * (long)p;
        const nmm_vec2 u = exact((nmm_vec2){X[0] + model->origin.x, X[1] + model->origin.y});
        sum +=
            (x[0] - X[0] - u.x) * (x[0] - X[0] - u.x) + (x[1] - X[1] - u.y) * (x[1] - X[1] - u.y);
        scale += u.x * u.x + u.y * u.y;
    }
    return sqrt(sum / scale);
}

typedef struct column_case {
    const char *scene, *name, *plane;
    motion_field exact;
    double settlement;
} column_case;

static void settle(const column_case *c) {
    const double size[] = {1.03, 0.53, 0.26, 0.13};
    double error[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN(c->scene, set_text("covers.size=%g", size[k]), c->plane);
        motion_give(r.sim, c->exact, 0);
        run_to_end(&r);
        error[k] = error_of(r.sim, c->exact);
        // Linear covers and a quadratic solution: an error of the order (h / H)^2.
        row_close(set_text("column, %s, size %g: settlement", c->name, size[k]), c->settlement,
                  -run_monitor(&r, "top").displacement[1], 1.5e-3 * size[k] * size[k]);
        run_close(&r);
    }
    row_near(set_text("column, %s: rate of all points", c->name), 2, rate_of(4, size, error), 0.25);
}

static void test_column(void **state) {
    (void)state;
    const column_case cases[] = {
        {"column.yaml", "plane stress", "materials.rock.plane=stress", column_stress, 1.226250e-3},
        {"column.yaml", "plane strain, free sides", "materials.rock.plane=strain", column_strain,
         1.149609e-3},
        {"column_confined.yaml", "confined", NULL, column_confined, 1.021875e-3},
    };
    for (int k = 0; k < 3; k++)
        settle(&cases[k]);
    rows_end();
}

static void test_column_ratio(void **state) {
    (void)state;
    run r = RUN("column_confined.yaml", "covers.size=0.5");
    run_to_end(&r);
    const nmm_reading middle = run_monitor(&r, "middle");
    row_close("column, confined: sigma_h over sigma_v", 1.0 / 3,
              middle.stress[0] / middle.stress[1], 1e-3);
    run_close(&r);
    rows_end();
}

static double largest_displacement(const run *r) {
    const nmm_view d = nmm_sim_view(r->sim, "displacement");
    double largest = 0;
    for (int i = 0; i < d.count * d.width; i++)
        largest = fmax(largest, fabs(d.data[i]));
    return largest;
}

static void test_initial_stress(void **state) {
    (void)state;
    run r = RUN("column_initial_stress.yaml");
    run_to_end(&r);
    row_below("column: displacement when its stress is the initial stress",
              largest_displacement(&r), 1e-12);
    no_rate("exact to rounding");
    run_close(&r);
    rows_end();
}

// --- Cantilever

#define LENGTH 48.0
#define DEPTH 12.0
#define FORCE 1000.0
#define MODULUS 3e7
#define RATIO 0.3
#define INERTIA (DEPTH * DEPTH * DEPTH / 12)

static nmm_vec2 bending(nmm_vec2 X) {
    const double f = FORCE / (6 * MODULUS * INERTIA), x = X.x, y = X.y, L = LENGTH, D = DEPTH;
    return (nmm_vec2){
        f * y * ((6 * L - 3 * x) * x + (2 + RATIO) * (y * y - D * D / 4)),
        -f * (3 * RATIO * y * y * (L - x) + (4 + 5 * RATIO) * D * D * x / 4 + (3 * L - x) * x * x),
    };
}

// The scene's uniform traction on the end becomes the parabola: each load stands for a part of the
// edge with a linear weight, so two Gauss points carry it exactly.
static void bend_loads(nmm_sim *sim) {
    nmm_model *model = &sim->model;
    const int n = model->n_load;
    nmm_load *load = NULL;
    assert_int_equal(nmm_allocate(&sim->context, &load, 2 * (size_t)n, sizeof *load), NMM_OK);
    for (int k = 0; k < 2 * n; k++) {
        load[k] = model->load[k / 2];
        const double length = -load[k].force.y / (FORCE / DEPTH);
        load[k].place.y += (k % 2 - 0.5) * length / sqrt(3);
        const double y = load[k].place.y + model->origin.y;
        const double shear = FORCE / (2 * INERTIA) * (DEPTH * DEPTH / 4 - y * y);
        load[k].force.y = -0.5 * length * shear;
        nmm_element_weights(model, load[k].element, load[k].place, load[k].weight);
    }
    nmm_release(&sim->context, &model->load);
    model->load = load;
    model->n_load = 2 * n;
}

static void test_cantilever(void **state) {
    (void)state;
    const double size[] = {4.3, 2.3, 1.1, 0.57};
    double tip[4], error[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN("cantilever.yaml", set_text("covers.size=%g", size[k]));
        motion_give(r.sim, bending, 0);
        bend_loads(r.sim);
        run_to_end(&r);
        tip[k] = -run_monitor(&r, "tip").displacement[1];
        error[k] = error_of(r.sim, bending);
        row_close(set_text("cantilever, size %g: tip", size[k]), 0.0089, tip[k],
                  0.012 * size[k] * size[k]);
        row_note(set_text("cantilever, size %g: error of all points", size[k]), error[k]);
        tip[k] -= 0.0089;
        run_close(&r);
    }
    row_near("cantilever: rate of the tip", 2, rate_of(4, size, tip), 0.25);
    row_near("cantilever: rate of all points", 2, rate_of(4, size, error), 0.25);
    rows_end();
}

// --- Contact patch tests

// Largest difference of any element's stress from that of element 0, over the pressure 1e6 Pa.
static double from_uniform(const nmm_sim *sim) {
    const nmm_view stress = nmm_sim_view(sim, "stress");
    double worst = 0;
    for (int i = 0; i < 3 * stress.count; i++)
        worst = fmax(worst, fabs(stress.data[i] - stress.data[i % 3]) / 1e6);
    return worst;
}

// The load stands on the width before it grows: yy of element 0 is checked within 1e-3.
static void check_uniform(const char *name, const nmm_sim *sim, double limit) {
    const nmm_view stress = nmm_sim_view(sim, "stress");
    row_below(
        set_text("%s, %d elements: stress from uniform, the worst", name, sim->model.n_element),
        from_uniform(sim), limit);
    row_close(set_text("%s: vertical stress", name), -1e6, stress.data[1], 1e-3);
}

static void test_patch_joint(void **state) {
    (void)state;
    static const char *const bond[] = {
        "title=open",
        "interfaces.smooth={friction_angle: 0, cohesion: 1e8, tensile_strength: 1e8}"};
    for (int order = 0; order < 3; order++) {
        for (int k = 0; k < 2; k++) {
            run r = RUN("patch_joint.yaml", set_text("covers.order=%d", order), bond[k]);
            run_to_end(&r);
            check_uniform(set_text("order %d, %s joint", order, k == 0 ? "open" : "bonded"), r.sim,
                          1e-8);
            run_close(&r);
        }
    }
    no_rate("uniform on any mesh; the yy is that of the load on its width before it grows");
    rows_end();
}

static void test_patch_blocks(void **state) {
    (void)state;
    run r = RUN("patch_contact.yaml");
    run_to_end(&r);
    check_uniform("contact patch test, two blocks", r.sim, 1e-8);
    no_rate("uniform on any mesh; the yy is that of the load on its width before it grows");
    run_close(&r);
    rows_end();
}

// Augmented contact: answers that do not depend on the penalty.
static void test_patch_penalty(void **state) {
    (void)state;
    const double penalty[] = {1, 10, 100, 1000};
    double top[4];
    for (int k = 0; k < (run_all() ? 4 : 1); k++) {
        run r = RUN("patch_contact.yaml", "contact.method=augmented",
                    set_text("contact.penalty=%g", penalty[k]));
        run_to_end(&r);
        const char *name = set_text("augmented, penalty %g E", penalty[k]);
        row_below(set_text("%s: stress from uniform", name), from_uniform(r.sim), 1e-4);
        top[k] = run_monitor(&r, "top").displacement[1];
        row_close(set_text("%s: settlement of the top over that at 1 E", name), 1, top[k] / top[0],
                  1e-4);
        run_close(&r);
    }
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_column),         cmocka_unit_test(test_column_ratio),
        cmocka_unit_test(test_initial_stress), cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_patch_joint),    cmocka_unit_test(test_patch_blocks),
        cmocka_unit_test(test_patch_penalty),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
