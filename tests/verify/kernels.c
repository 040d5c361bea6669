// SPDX-License-Identifier: MIT
//
// Kernels: the cut domain keeps its area, linear displacements give constant stress on any lattice
// and any cuts, the stiffness matrix is symmetric and semidefinite with three motions without
// energy.

#include "run.h"

#include "step.h"

#include "motion.h"

#include <stdlib.h>

// --- Patch test

// Gradient of the prescribed displacement u = a + b x + c y, v = d + e x + f y: b c e f.
static const double slope_of[4] = {2e-2, -1.5e-2, 4e-2, -1e-2};

static nmm_vec2 linear(nmm_vec2 X) {
    return (nmm_vec2){0.01 + slope_of[0] * X.x + slope_of[1] * X.y,
                      -0.02 + slope_of[2] * X.x + slope_of[3] * X.y};
}

// Cauchy stress of plane strain for F = I + slope: turn back, Hooke's law on U - I, turn forth.
static void exact_stress(double E, double nu, double stress[3]) {
    const double F[4] = {1 + slope_of[0], slope_of[1], slope_of[2], 1 + slope_of[3]};
    const double angle = atan2(F[2] - F[1], F[0] + F[3]), c = cos(angle), s = sin(angle);
    const double exx = c * F[0] + s * F[2] - 1, eyy = -s * F[1] + c * F[3] - 1;
    const double exy = c * F[1] + s * F[3];
    const double mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
    const double txx = lambda * (exx + eyy) + 2 * mu * exx;
    const double tyy = lambda * (exx + eyy) + 2 * mu * eyy, txy = 2 * mu * exy;
    const double P[4] = {c * txx - s * txy, c * txy - s * tyy, s * txx + c * txy,
                         s * txy + c * tyy};
    const double J = F[0] * F[3] - F[1] * F[2];
    stress[0] = (P[0] * F[0] + P[1] * F[1]) / J;
    stress[1] = (P[2] * F[2] + P[3] * F[3]) / J;
    stress[2] = (P[0] * F[2] + P[1] * F[3]) / J;
}

// Largest difference of any element's stress from the exact one, over the latter. The boundary
// moves in 20 steps; strains are large, because points are held to a part of the scene's size.
static double patch_error(run *r) {
    double exact[3], worst = 0;
    exact_stress(1e9, 0.3, exact);
    motion_give(r->sim, linear, 2e5);
    run_to_end(r);
    const nmm_view stress = nmm_sim_view(r->sim, "stress");
    for (int i = 0; i < 3 * stress.count; i++)
        worst = fmax(worst, fabs(stress.data[i] - exact[i % 3]) / fabs(exact[0]));
    return worst;
}

static void test_patch(void **state) {
    (void)state;
    const double size[] = {0.9, 0.5, 0.37, 0.171};
    for (int k = 0; k < 4; k++) {
        run r = RUN("patch.yaml", set_text("covers.size=%g", size[k]));
        motion_hold_each(r.sim);
        const double error = patch_error(&r);
        row_below(set_text("patch test, cut by joints, size %g, %d elements: stress", size[k],
                           r.sim->model.n_element),
                  error, 1e-10);
        run_close(&r);
    }
    no_rate("exact to rounding on any mesh");
    rows_end();
}

// The supports as any scene has them, on the outer boundary: springs and a uniform traction for
// each group. Corners are snapped to about 1e-12 of the scene, which slivers feel.
static void test_patch_groups(void **state) {
    (void)state;
    const double size[] = {0.9, 0.5, 0.37, 0.171};
    for (int k = 0; k < 4; k++) {
        run r = RUN("patch.yaml", set_text("covers.size=%g", size[k]), "joints=[]",
                    "supports=[{segment: [[0, 0], [2.1, -0.2]], fix: xy}, "
                    "{segment: [[2.1, -0.2], [2.4, 1.3]], fix: xy}, "
                    "{segment: [[2.4, 1.3], [1.1, 1.9]], fix: xy}, "
                    "{segment: [[1.1, 1.9], [-0.3, 1.2]], fix: xy}, "
                    "{segment: [[-0.3, 1.2], [0, 0]], fix: xy}]");
        const double error = patch_error(&r);
        row_below(set_text("patch test, groups of supports, size %g, %d elements: stress", size[k],
                           r.sim->model.n_element),
                  error, 1e-8);
        run_close(&r);
    }
    rows_end();
}

// --- Cutting

static void test_cutting(void **state) {
    (void)state;
    // Shoelace of patch.yaml's polygon.
    const double x[] = {0, 2.1, 2.4, 1.1, -0.3}, y[] = {0, -0.2, 1.3, 1.9, 1.2};
    double area = 0;
    for (int k = 0; k < 5; k++)
        area += 0.5 * (x[k] * y[(k + 1) % 5] - x[(k + 1) % 5] * y[k]);
    const double size[] = {0.9, 0.5, 0.37, 0.171};
    for (int k = 0; k < 4; k++) {
        run r = RUN("patch.yaml", set_text("covers.size=%g", size[k]));
        nmm_check check;
        assert_int_equal(nmm_sim_check(r.sim, &check), NMM_OK);
        row_close(set_text("cutting, size %g: sum of element areas", size[k]), area, check.area,
                  1e-11);
        row_near(set_text("cutting, size %g: blocks", size[k]), 2, check.blocks, 0);
        run_close(&r);
    }
    rows_end();
}

static void test_splitting(void **state) {
    (void)state;
    const struct {
        const char *name, *joints;
        int blocks, split;
    } cut[] = {
        {"no joint", "joints=[]", 1, 1},
        {"a joint that ends inside", "joints=[{polyline: [[-1, -0.01], [0.01, 0.005]]}]", 1, 1},
        {"a joint that passes through", "title=as given", 2, 2},
        {"a cross", "joints[1]={polyline: [[0.01, -1], [-0.02, 1]]}", 4, 4},
        {"a closed loop",
         "joints=[{polyline: [[-0.02, -0.02], [0.03, -0.01], [0.0, 0.03], [-0.02, -0.02]]}]", 2, 2},
    };
    for (int k = 0; k < 5; k++) {
        run r = RUN("cutting.yaml", cut[k].joints);
        row_near(set_text("%s: blocks", cut[k].name), cut[k].blocks, r.sim->model.n_block, 0);
        row_near(set_text("%s: covers of a node", cut[k].name), cut[k].split,
                 r.sim->model.n_cover / 3.0, 0);
        run_close(&r);
    }
    no_rate("counts");
    rows_end();
}

// --- Moments

// Integral of x^p y^q, p + q <= 2, over all elements, from their moments about their centroids.
static double sum_of_elements(const nmm_model *model, int p, int q) {
    double sum = 0;
    for (int e = 0; e < model->n_element; e++) {
        const double area = model->element_area[e];
        const double x = model->element_centre[2 * e] + model->origin.x;
        const double y = model->element_centre[2 * e + 1] + model->origin.y;
        const double *own = model->element_moment + 3 * (long)e;
        sum += area * (p > 0 ? x : 1) * (p > 1 ? x : 1) * (q > 0 ? y : 1) * (q > 1 ? y : 1);
        if (p + q == 2) sum += own[q];
    }
    return sum;
}

typedef struct integral {
    int p, q;
    double exact;
} integral;

static const integral table[] = {
    {0, 0, 45 / 2.0},     {1, 0, 265 / 6.0},      {0, 1, 383 / 6.0},   {2, 0, 1565 / 12.0},
    {1, 1, 1073 / 8.0},   {0, 2, 2659 / 12.0},    {3, 0, 1717 / 4.0},  {2, 1, 23999 / 60.0},
    {1, 2, 5779 / 12.0},  {0, 3, 3447 / 4.0},     {4, 0, 9185 / 6.0},  {3, 1, 159083 / 120.0},
    {2, 2, 85081 / 60.0}, {1, 3, 229039 / 120.0}, {0, 4, 21631 / 6.0},
};

static void test_moments(void **state) {
    (void)state;
    const nmm_vec2 corner[] = {{0, 0}, {4, 1}, {5, 4}, {2, 6}, {-1, 3}};
    nmm_vec2 far[5];
    for (int k = 0; k < 5; k++)
        far[k] = (nmm_vec2){corner[k].x + 1e7, corner[k].y + 1e7};
    run r = RUN("polygon.yaml");
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        const integral *i = &table[k];
        const char *name = set_text("x^%d y^%d", i->p, i->q);
        row_close(name, i->exact, nmm_polygon_integral(5, corner, (nmm_vec2){0, 0}, i->p, i->q),
                  1e-14);
        row_close(set_text("%s, polygon moved by 1e7", name), i->exact,
                  nmm_polygon_integral(5, far, (nmm_vec2){1e7, 1e7}, i->p, i->q), 1e-14);
        // Corners are snapped to about 1e-12 of the scene.
        if (i->p + i->q <= 2)
            row_close(set_text("%s, sum of %d elements", name, r.sim->model.n_element), i->exact,
                      sum_of_elements(&r.sim->model, i->p, i->q), 1e-11);
    }
    no_rate("exact to rounding on any mesh");
    run_close(&r);
    rows_end();
}

// --- Stiffness

// The elastic stiffness at rest as a dense matrix [n][n].
static double *dense_stiffness(nmm_sim *sim, int n) {
    const nmm_step_state step = {1e9, 1e9, sim->moved};
    assert_int_equal(nmm_system_pattern(&sim->context, &sim->system, &sim->model, &sim->state),
                     NMM_OK);
    nmm_system_load(&sim->system, &sim->model, 0);
    nmm_system_residual(&sim->context, &sim->system, &sim->model, &sim->state, &step, NULL);
    nmm_system_prepare(&sim->context, &sim->system, &sim->model, &sim->state, step.h);
    nmm_system_assemble(&sim->context, &sim->system, &sim->model, NULL);
    double *K = calloc((size_t)n * (size_t)n, sizeof *K);
    const nmm_bsr *bsr = &sim->system.K;
    for (int row = 0; row < bsr->n_row; row++) {
        for (int k = bsr->row_start[row]; k < bsr->row_start[row + 1]; k++) {
            for (int x = 0; x < 4; x++) {
                K[(2 * row + x / 2) * n + 2 * bsr->col[k] + x % 2] = bsr->value[4 * (long)k + x];
            }
        }
    }
    return K;
}

// Energy of a motion over sum_i |K_ii| d_i^2.
static double energy_ratio(const double *K, const double *d, int n) {
    double energy = 0, scale = 0;
    for (int i = 0; i < n; i++) {
        scale += fabs(K[i * n + i]) * d[i] * d[i];
        for (int j = 0; j < n; j++)
            energy += d[i] * K[i * n + j] * d[j];
    }
    return energy / scale;
}

// One rotation of Jacobi's method that clears entry (p, q).
static void rotate(double *A, int n, int p, int q) {
    const double theta = (A[q * n + q] - A[p * n + p]) / (2 * A[p * n + q]);
    const double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(t * t + 1), s = t * c;
    for (int k = 0; k < n; k++) {
        const double a = A[k * n + p], b = A[k * n + q];
        A[k * n + p] = c * a - s * b;
        A[k * n + q] = s * a + c * b;
    }
    for (int k = 0; k < n; k++) {
        const double a = A[p * n + k], b = A[q * n + k];
        A[p * n + k] = c * a - s * b;
        A[q * n + k] = s * a + c * b;
    }
}

// Diagonalises the symmetric A.
static void jacobi(double *A, int n, double scale) {
    for (int sweep = 0; sweep < 30; sweep++) {
        double largest = 0;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                largest = fmax(largest, fabs(A[p * n + q]));
                if (fabs(A[p * n + q]) > 1e-15 * scale) rotate(A, n, p, q);
            }
        }
        if (largest <= 1e-15 * scale) return;
    }
}

static void test_stiffness(void **state) {
    (void)state;
    run r = RUN("plate.yaml");
    const int n = 2 * r.sim->model.n_cover;
    double *K = dense_stiffness(r.sim, n), scale = 0, skew = 0;
    for (int i = 0; i < n * n; i++) {
        scale = fmax(scale, fabs(K[i]));
        skew = fmax(skew, fabs(K[i] - K[i % n * n + i / n]));
    }
    row_below(set_text("stiffness, %d unknowns: skew part over largest entry", n), skew / scale,
              1e-14);
    double *d = calloc(3 * (size_t)n, sizeof *d);
    for (int i = 0; i < n; i += 2) {
        d[i] = d[n + i + 1] = 1;
        d[2 * n + i] = -r.sim->model.cover_place[i + 1];
        d[2 * n + i + 1] = r.sim->model.cover_place[i];
    }
    row_below("stiffness: energy of a move along x", energy_ratio(K, d, n), 1e-12);
    row_below("stiffness: energy of a move along y", energy_ratio(K, d + n, n), 1e-12);
    row_below("stiffness: energy of a turn", energy_ratio(K, d + 2 * n, n), 1e-12);
    jacobi(K, n, scale);
    double least = 0;
    int n_zero = 0;
    for (int i = 0; i < n; i++) {
        least = fmin(least, K[i * n + i]);
        n_zero += fabs(K[i * n + i]) < 1e-12 * scale;
    }
    row_below("stiffness: most negative eigenvalue over largest entry", least / scale, 1e-14);
    row_near("stiffness: eigenvalues that vanish", 3, n_zero, 0);
    no_rate("exact to rounding on any mesh");
    free(d);
    free(K);
    run_close(&r);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_patch),   cmocka_unit_test(test_patch_groups),
        cmocka_unit_test(test_cutting), cmocka_unit_test(test_splitting),
        cmocka_unit_test(test_moments), cmocka_unit_test(test_stiffness),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
