// SPDX-License-Identifier: MIT
//
// Slivers of triangles down to 1e-10 of their area, along a ledge a little above a row of the mesh.
// Condition numbers are those of the matrix scaled to a diagonal of ones, by power iteration and
// inverse iteration; without ties they grow without bound at order 1 and 2, and not at order 0.

#include "run.h"

#include "smooth.h"

#define SIZE 0.3 // of the covers [m]

// The plate with its ledge at a height, with a velocity [vx, vy, spin].
static run open_plate(int order, double ledge, const char *velocity, const char *set) {
    return RUN("slivers.yaml", set_text("covers.order=%d", order),
               set_text("blocks=[{name: plate, polygon: [[0, 0], [3, 0], [3, 2], [1.5, 2], [1.5, "
                        "%.17g], [0, %.17g]], velocity: %s}]",
                        ledge, ledge, velocity),
               set);
}

static run open_ledge(int order, double ledge) {
    return open_plate(order, ledge, "[0, 0, 0]", NULL);
}

// Height of a row of nodes near y.
static double row_near_height(double y) {
    run r = open_ledge(0, y);
    double best = 1e9;
    for (int c = 0; c < r.sim->model.n_cover; c++) {
        const double at = r.sim->model.cover_place[2 * c + 1] + r.sim->model.origin.y;
        if (fabs(at - y) < fabs(best - y)) best = at;
    }
    run_close(&r);
    return best;
}

typedef struct scaled {
    nmm_sim *sim;
    nmm_solver *solver;
    double *root; // of the diagonal
} scaled;

static void multiply(const scaled *s, const double *x, double *y) {
    const nmm_bsr *K = &s->sim->system.K;
    for (int row = 0; row < K->n_row; row++) {
        double sum[2] = {0, 0};
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
            const double *v = K->value + 4 * (long)k;
            const int j = 2 * K->col[k];
            const double a = x[j] / s->root[j], b = x[j + 1] / s->root[j + 1];
            sum[0] += v[0] * a + v[1] * b;
            sum[1] += v[2] * a + v[3] * b;
        }
        y[2 * row] = sum[0] / s->root[2 * row];
        y[2 * row + 1] = sum[1] / s->root[2 * row + 1];
    }
}

static void divide(const scaled *s, const double *x, double *y) {
    const nmm_bsr *K = &s->sim->system.K;
    const int n = 2 * K->n_row;
    double *f = calloc((size_t)n, sizeof *f);
    for (int i = 0; i < n; i++)
        f[i] = x[i] * s->root[i], y[i] = 0;
    nmm_solve_options options = nmm_default_solve_options();
    nmm_solve_report report;
    options.method = NMM_SOLVE_DIRECT;
    options.tolerance = 1e-6;
    options.reuse = true;
    nmm_solve_host()->solve(&s->sim->context, s->solver, K, f, y, true, &options, &report);
    for (int i = 0; i < n; i++)
        y[i] *= s->root[i];
    free(f);
}

static double iterate(const scaled *s, void (*apply)(const scaled *, const double *, double *)) {
    const int n = 2 * s->sim->model.n_cover;
    double *x = calloc((size_t)n, sizeof *x), *y = calloc((size_t)n, sizeof *y), norm = 1;
    for (int i = 0; i < n; i++)
        x[i] = 1 + sin(1.0 + i * 1.7);
    for (int k = 0; k < (run_all() ? 30 : 12); k++) {
        apply(s, x, y);
        norm = 0;
        for (int i = 0; i < n; i++)
            norm += y[i] * y[i];
        norm = sqrt(norm);
        for (int i = 0; i < n; i++)
            x[i] = y[i] / norm;
    }
    free(x);
    free(y);
    return norm;
}

static double condition(nmm_sim *sim, double h) {
    smooth_matrix(sim, h);
    const nmm_bsr *K = &sim->system.K;
    scaled s = {.sim = sim};
    s.root = calloc(2 * (size_t)K->n_row, sizeof *s.root);
    for (int c = 0; c < K->n_row; c++) {
        const double *block = K->value + 4 * (long)K->diagonal[c];
        s.root[2 * c] = sqrt(block[0]);
        s.root[2 * c + 1] = sqrt(block[3]);
    }
    nmm_solve_host()->open(&sim->context, &s.solver, K->n_row, K->row_start[K->n_row]);
    const double largest = iterate(&s, multiply), smallest = 1 / iterate(&s, divide);
    nmm_solve_host()->close(&sim->context, &s.solver);
    free(s.root);
    return largest / smallest;
}

typedef struct worst_gradient {
    const double *d;
    double worst;
} worst_gradient;

static void compare_gradient(const smooth_point *at, void *user) {
    worst_gradient *sum = user;
    const nmm_model *model = at->model;
    double u[2], H[4], linear[3], g[2 * NMM_MOST_LOCAL];
    smooth_wave(at->place.x, at->place.y, u, H);
    nmm_element_linear(model, at->element, at->place, linear);
    nmm_functions_gradient(model, at->element, linear, g);
    for (int i = 0; i < model->n_local; i++) {
        const double *d = sum->d + 2 * model->element_cover[model->n_local * at->element + i];
        for (int k = 0; k < 4; k++)
            H[k] -= d[k / 2] * g[2 * i + k % 2];
    }
    for (int k = 0; k < 4; k++)
        sum->worst = fmax(sum->worst, fabs(H[k]));
}

// Largest error of the displacement gradient anywhere, of a field whose gradient is up to 1.9.
static double worst_error(nmm_sim *sim, double *error) {
    double *d = smooth_solve(sim, smooth_wave, 0.01);
    worst_gradient sum = {.d = d};
    smooth_visit_all(&sim->model, compare_gradient, &sum);
    *error = smooth_error(sim, smooth_wave, d);
    free(d);
    return sum.worst;
}

// As if there were no ties.
static void untie(nmm_sim *sim) {
    nmm_system *system = &sim->system;
    for (int k = 0; k < system->base_start[sim->model.n_cover] && sim->model.n_tie > 0; k++) {
        system->base_mass[k] -= system->tie_mass[k];
        system->tie_mass[k] = system->tie_stiffness[k] = 0;
    }
}

// --- Tests

static const double cut_of[] = {0.3, 0.1, 0.01, 1e-3, 3e-5};
enum { N_CUT = sizeof cut_of / sizeof *cut_of };

// Worst over all cuts.
typedef struct worst_of {
    double condition, short_step, gradient, displacement;
} worst_of;

static worst_of look_at(int order, double row, const char *what) {
    worst_of worst = {0};
    for (int k = 0; k < N_CUT; k += run_all() ? 1 : 4) {
        run r = open_ledge(order, row + SIZE * cut_of[k]);
        double error = 0;
        const double long_step = condition(r.sim, 0.01), short_step = condition(r.sim, 1e-7);
        row_note(
            set_text("order %d, %s %g of a cover high: condition number", order, what, cut_of[k]),
            long_step);
        worst.condition = fmax(worst.condition, long_step);
        worst.short_step = fmax(worst.short_step, short_step);
        worst.gradient = fmax(worst.gradient, worst_error(r.sim, &error));
        worst.displacement = fmax(worst.displacement, error);
        run_close(&r);
    }
    return worst;
}

static void test_slivers(void **state) {
    (void)state;
    const double row = row_near_height(1.1);
    // About twice what the lattices without slivers come to.
    const worst_of limit[] = {{3e3, 10, 1.4, 0.1}, {6e3, 3e3, 0.12, 2e-3}, {3e4, 4e5, 0.02, 6e-5}};
    for (int order = 0; order < 3; order++) {
        const worst_of worst = look_at(order, row, "slivers");
        const char *name = set_text("order %d, worst of all cuts", order);
        row_below(set_text("%s: condition number", name), worst.condition, limit[order].condition);
        row_below(set_text("%s: condition number in a very short step", name), worst.short_step,
                  limit[order].short_step);
        row_below(set_text("%s: error of any displacement gradient, of 1.9", name), worst.gradient,
                  limit[order].gradient);
        row_below(set_text("%s: error of the displacement", name), worst.displacement,
                  limit[order].displacement);
    }
    rows_end();
}

// What the ties are for.
static void test_without_ties(void **state) {
    (void)state;
    const double row = row_near_height(1.1);
    for (int order = 1; order < 3; order++) {
        run r = open_ledge(order, row + SIZE * 0.03);
        const double with = condition(r.sim, 0.01);
        untie(r.sim);
        const double without = condition(r.sim, 0.01);
        row_note(set_text("order %d, slivers 0.03 of a cover high: condition without ties", order),
                 without);
        row_true(set_text("order %d: ties gain a factor of 50 or more", order), "yes",
                 without > 50 * with);
        run_close(&r);
    }
    rows_end();
}

// Where nothing is a sliver, or all is, there is nothing to tie; order 0 has no ties.
static void test_only_where_needed(void **state) {
    (void)state;
    const double row = row_near_height(1.1);
    run r = open_ledge(0, row + SIZE * 0.01);
    row_near("order 0: ties", 0, r.sim->model.n_tie, 0);
    assert_null(r.sim->system.tie_stiffness);
    run_close(&r);
    r = RUN("slivers.yaml", "covers.order=2",
            "blocks=[{polygon: [[0, 0], [3, 0], [3, 0.01], [0, 0.01]]}]");
    row_near("order 2, a strip of a thirtieth of a cover: ties", 0, r.sim->model.n_tie, 0);
    assert_null(r.sim->system.tie_stiffness);
    run_close(&r);
    rows_end();
}

// A block much smaller than a triangle: as good as at order 0, where its free motions alone make
// the condition number.
static void test_crumb(void **state) {
    (void)state;
    double number[3];
    for (int order = 0; order < 3; order++) {
        run r = RUN("slivers.yaml", set_text("covers.order=%d", order),
                    "blocks=[{polygon: [[0, 0], [3, 0], [3, 2], [0, 2]]}, "
                    "{polygon: [[1.501, 2.5], [1.506, 2.5], [1.503, 2.506]]}]");
        number[order] = condition(r.sim, 0.01);
        row_note(set_text("order %d, a crumb of 5 mm: condition number", order), number[order]);
        if (order > 0)
            row_true(set_text("order %d: less than ten times that of order 0", order), "yes",
                     r.sim->model.n_tie > 0 && number[order] < 10 * number[0]);
        run_close(&r);
    }
    rows_end();
}

// Polynomials of the order's degree pass, whatever is tied: a tie feels no polynomial that is the
// same on both sides.
static void linear(double x, double y, double *u, double *H) {
    u[0] = 0.3 + 0.7 * x - 0.2 * y, H[0] = 0.7, H[1] = -0.2;
    u[1] = -0.1 - 0.4 * x + 0.5 * y, H[2] = -0.4, H[3] = 0.5;
}

static void quadratic(double x, double y, double *u, double *H) {
    u[0] = x * x - x * y, H[0] = 2 * x - y, H[1] = -x;
    u[1] = y * y + 0.5 * x * y - x * x, H[2] = 0.5 * y - 2 * x, H[3] = 2 * y + 0.5 * x;
}

static void test_patch(void **state) {
    (void)state;
    const double row = row_near_height(1.1);
    for (int order = 0; order < 3; order++) {
        for (int k = 0; k < N_CUT; k += run_all() ? 2 : 4) {
            run r = open_ledge(order, row + SIZE * cut_of[k]);
            smooth_field *field = order == 0 ? linear : quadratic;
            double *d = smooth_solve(r.sim, field, 0.01);
            row_below(set_text("order %d, slivers %g of a cover high: %s", order, cut_of[k],
                               order == 0 ? "uniform stress" : "stress linear in the place"),
                      smooth_error(r.sim, field, d), 1e-11);
            free(d);
            run_close(&r);
        }
    }
    rows_end();
}

// A body with slivers that flies, turns and swings: ties cost neither momentum nor energy.
static void test_flight(void **state) {
    (void)state;
    const double row = row_near_height(1.1);
    for (int order = 1; order < 3; order++) {
        run r = open_plate(order, row + SIZE * 1e-3, "[1, 2, 1.5]",
                           "analysis={scheme: newmark, tolerance: 1e-9}");
        assert_true(r.sim->model.n_tie > 0);
        const double kinetic = r.sim->kinetic0;
        run_to_end(&r);
        const nmm_energy *e = &r.report.energy;
        row_close(set_text("order %d: flight with slivers, energy at the end", order), kinetic,
                  kinetic + e->kinetic + e->strain, 1e-8);
        row_below(set_text("order %d: flight with slivers, ledger residual over kinetic", order),
                  e->residual / kinetic, 1e-9);
        run_close(&r);
    }
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slivers),
        cmocka_unit_test(test_without_ties),
        cmocka_unit_test(test_only_where_needed),
        cmocka_unit_test(test_patch),
        cmocka_unit_test(test_flight),
        cmocka_unit_test(test_crumb),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
