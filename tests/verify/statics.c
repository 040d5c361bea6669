// SPDX-License-Identifier: MIT
//
// Elastostatics against closed forms: columns under their own weight, Timoshenko's cantilever with
// its rate of convergence, contact patch tests. One step of very long dt is a static solution.

#include "run.h"

#include "step.h"

#include "motion.h"

#include <stdlib.h>

// Slope of log(error) over log(h) by least squares.
static double rate_of(int n, const double *h, const double *error) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < n; k++) {
        const double x = log(h[k]), y = log(fabs(error[k]));
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

// --- Gravity column
// --------------------------------------------------------------------------------------

static const char *confined = "supports=[{segment: [[0, 0], [2, 0]], fix: y}, "
                              "{segment: [[0, 0], [0, 10]], fix: x}, "
                              "{segment: [[2, 0], [2, 10]], fix: x}]";
static const char *standing = "supports=[{segment: [[0, 0], [2, 0]], fix: y}, "
                              "{point: [1, 0], fix: x}]";

static void settle(const char *name, const char *plane, const char *supports, double expected) {
    const double size[] = {2, 1, 0.5, 0.25};
    double error[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN("column.yaml", set_text("covers.size=%g", size[k]), plane, supports);
        run_to_end(&r);
        const double settlement = -run_monitor(&r, "top").displacement[1];
        error[k] = settlement / expected - 1;
        // Linear covers and a quadratic solution: an error of the order (h / H)^2.
        row_close(set_text("column, %s, size %g: settlement", name, size[k]), expected, settlement,
                  size[k] * size[k] / 100);
        run_close(&r);
    }
    row_note(set_text("column, %s: rate of convergence", name), rate_of(4, size, error));
}

static void test_column(void **state) {
    (void)state;
    settle("plane stress", "materials.rock.plane=stress", standing, 1.226250e-3);
    settle("plane strain, free sides", "materials.rock.plane=strain", standing, 1.149609e-3);
    settle("confined", "materials.rock.plane=strain", confined, 1.021875e-3);
    rows_end();
}

static void test_column_ratio(void **state) {
    (void)state;
    run r = RUN("column.yaml", "materials.rock.plane=strain", confined, "covers.size=0.5");
    run_to_end(&r);
    const nmm_reading middle = run_monitor(&r, "middle");
    row_close("column, confined: sigma_h over sigma_v", 1.0 / 3,
              middle.stress[0] / middle.stress[1], 1e-2);
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
    run r = RUN("column.yaml", "materials.rock.plane=strain", confined, "analysis.tolerance=1e-13",
                "solver.tolerance=1e-15",
                "initial_stress={kind: gravity, surface: 10, k0: 0.3333333333333333}");
    run_to_end(&r);
    row_below("column: displacement when its stress is the initial stress",
              largest_displacement(&r), 1e-12);
    run_close(&r);
    rows_end();
}

// --- Cantilever
// ------------------------------------------------------------------------------------------

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

// Root mean square of the error at all points over that of the exact displacement.
static double error_of(const nmm_sim *sim) {
    const nmm_model *model = &sim->model;
    double sum = 0, scale = 0;
    for (int p = 0; p < model->n_point; p++) {
        const double *X = model->point + 2 * (long)p, *x = sim->state.position + 2 * (long)p;
        const nmm_vec2 u = bending((nmm_vec2){X[0] + model->origin.x, X[1] + model->origin.y});
        sum +=
            (x[0] - X[0] - u.x) * (x[0] - X[0] - u.x) + (x[1] - X[1] - u.y) * (x[1] - X[1] - u.y);
        scale += u.x * u.x + u.y * u.y;
    }
    return sqrt(sum / scale);
}

static void test_cantilever(void **state) {
    (void)state;
    const double size[] = {4.3, 2.3, 1.1, 0.57};
    double tip[4], error[4];
    for (int k = 0; k < 4; k++) {
        run r = RUN("cantilever.yaml", set_text("covers.size=%g", size[k]));
        motion_give(r.sim, bending);
        bend_loads(r.sim);
        run_to_end(&r);
        tip[k] = -run_monitor(&r, "tip").displacement[1];
        error[k] = error_of(r.sim);
        row_close(set_text("cantilever, size %g: tip", size[k]), 0.0089, tip[k],
                  0.02 * size[k] * size[k]);
        row_note(set_text("cantilever, size %g: error of all points", size[k]), error[k]);
        tip[k] -= 0.0089;
        run_close(&r);
    }
    row_near("cantilever: rate of the tip", 2, rate_of(4, size, tip), 0.25);
    row_near("cantilever: rate of all points", 2, rate_of(4, size, error), 0.25);
    rows_end();
}

// --- Contact patch tests
// ---------------------------------------------------------------------------------

// Largest difference of any element's stress from a uniform pressure, over that pressure.
static double unevenness(const nmm_sim *sim, double pressure) {
    const nmm_view stress = nmm_sim_view(sim, "stress");
    double worst = 0;
    for (int e = 0; e < stress.count; e++) {
        const double *s = stress.data + 3 * (long)e;
        worst = fmax(worst, fabs(s[1] + pressure) / pressure);
        worst = fmax(worst, fabs(s[0]) / pressure);
        worst = fmax(worst, fabs(s[2]) / pressure);
    }
    return worst;
}

static void test_patch_joint(void **state) {
    (void)state;
    run r = RUN("patch_joint.yaml");
    run_to_end(&r);
    row_below("contact patch test, cut by a joint: stress from uniform", unevenness(r.sim, 1e6),
              1e-8);
    run_close(&r);
    rows_end();
}

static void test_patch_blocks(void **state) {
    (void)state;
    run r = RUN("patch_contact.yaml");
    run_to_end(&r);
    row_below("contact patch test, two blocks: stress from uniform", unevenness(r.sim, 1e6), 1e-8);
    run_close(&r);
    rows_end();
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_column),         cmocka_unit_test(test_column_ratio),
        cmocka_unit_test(test_initial_stress), cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_patch_joint),    cmocka_unit_test(test_patch_blocks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
