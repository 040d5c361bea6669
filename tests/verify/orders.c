// SPDX-License-Identifier: MIT
//
// Covers of order 0, 1 and 2 on lattices that fit nothing: their functions are independent, hold
// all polynomials of degree order + 1 exactly, and reach the rates that follow; motions, contact
// and the ledger hold as at order 0.

#include "run.h"

#include "motion.h"
#include "smooth.h"

#define TURN 0.7 // of the pure bending against the axes [rad]

static const char *order_of(int order) {
    return set_text("covers.order=%d", order);
}

// --- Fields

static void uniform(double x, double y, double *u, double *H) {
    u[0] = 0.3 + 0.7 * x - 0.2 * y, H[0] = 0.7, H[1] = -0.2;
    u[1] = -0.1 - 0.4 * x + 0.5 * y, H[2] = -0.4, H[3] = 0.5;
}

// Pure bending of plane strain about an axis that is turned against the scene: stress linear in s.
static void bending(double x, double y, double *u, double *H) {
    const double c = cos(TURN), s = sin(TURN), nu = 0.3 / 0.7;
    const double a = c * x + s * y, b = c * y - s * x;
    const double v[2] = {a * b, -0.5 * a * a - 0.5 * nu * b * b};
    const double G[4] = {b, a, -a, -nu * b};
    u[0] = c * v[0] - s * v[1], u[1] = s * v[0] + c * v[1];
    // H = R G R^T.
    const double RG[4] = {c * G[0] - s * G[2], c * G[1] - s * G[3], s * G[0] + c * G[2],
                          s * G[1] + c * G[3]};
    H[0] = RG[0] * c - RG[1] * s, H[1] = RG[0] * s + RG[1] * c;
    H[2] = RG[2] * c - RG[3] * s, H[3] = RG[2] * s + RG[3] * c;
}

static void cubic(double x, double y, double *u, double *H) {
    u[0] = x * x * x - 2 * x * y * y + y * y * y, u[1] = x * x * y + 0.5 * y * y * y - x * x * x;
    H[0] = 3 * x * x - 2 * y * y, H[1] = -4 * x * y + 3 * y * y;
    H[2] = 2 * x * y - 3 * x * x, H[3] = x * x + 1.5 * y * y;
}

static double field_error(int order, double size, smooth_field *field) {
    run r = RUN("orders.yaml", order_of(order), set_text("covers.size=%.17g", size));
    double *d = smooth_solve(r.sim, field, 0.1);
    const double error = smooth_error(r.sim, field, d);
    free(d);
    run_close(&r);
    return error;
}

// --- Polynomials and rates

static void test_polynomials(void **state) {
    (void)state;
    static smooth_field *const field[] = {uniform, bending, cubic};
    static const char *const name[] = {"uniform stress", "pure bending", "cubic displacement"};
    for (int order = 0; order < 3; order++) {
        for (int k = 0; k <= order; k++)
            row_below(set_text("order %d: %s", order, name[k]), field_error(order, 0.4, field[k]),
                      1e-11);
    }
    // What is beyond the order is not met: the test can tell.
    for (int order = 0; order < 2; order++)
        row_true(set_text("order %d: %s is not met", order, name[order + 1]), "yes",
                 field_error(order, 0.4, field[order + 1]) > 1e-4);
    rows_end();
}

// Coarse lattices come to it slowly: at a size of 0.4 the plate is five covers wide, with a hole of
// less than one. So the rate is that of the four finest sizes.
static void test_rates(void **state) {
    (void)state;
    static const double size[] = {0.4, 0.283, 0.2, 0.141, 0.1, 0.0707, 0.05, 0.0354, 0.025, 0.0177};
    const int most[] = {10, 9, 8};
    for (int order = 0; order < 3; order++) {
        double error[10];
        const int n = run_all() ? most[order] : 6;
        for (int k = 0; k < n; k++) {
            error[k] = field_error(order, size[k], smooth_wave);
            row_note(set_text("order %d, size %g: error of the displacement", order, size[k]),
                     error[k]);
        }
        const char *name = set_text("order %d: rate in the size", order);
        if (run_all()) row_note(set_text("%s, all sizes", name), rate_of(n, size, error));
        row_near(set_text("%s, the four finest", name), order + 2,
                 rate_of(4, size + n - 4, error + n - 4), run_all() ? 0.02 : 0.2);
    }
    rows_end();
}

// --- Timoshenko's cantilever, as a scene with supports and loads

#define FORCE 1000.0
#define LENGTH 48.0
#define DEPTH 12.0
#define INERTIA (DEPTH * DEPTH * DEPTH / 12)

static nmm_vec2 cantilever(nmm_vec2 X) {
    const double f = FORCE / (6 * 3e7 * INERTIA), nu = 0.3, x = X.x, y = X.y, D2 = DEPTH * DEPTH;
    return (nmm_vec2){f * y * ((6 * LENGTH - 3 * x) * x + (2 + nu) * (y * y - D2 / 4)),
                      -f * (3 * nu * y * y * (LENGTH - x) + (4 + 5 * nu) * D2 * x / 4 +
                            (3 * LENGTH - x) * x * x)};
}

// The parabola of shear on the end, at three Gauss points of each loop edge.
static void put_end_loads(nmm_sim *sim) {
    nmm_model *model = &sim->model;
    nmm_load *load = NULL;
    int n = 0;
    assert_int_equal(nmm_allocate(&sim->context, &load, 3 * (size_t)model->n_vertex, sizeof *load),
                     NMM_OK);
    for (int v = 0; v < model->n_vertex; v++) {
        const double *a = model->point + 2 * (long)model->vertex_point[v];
        const double *b = model->point + 2 * (long)model->vertex_point[model->vertex_next[v]];
        const double end = LENGTH - model->origin.x, length = b[1] - a[1];
        if (fabs(a[0] - end) + fabs(b[0] - end) > 1e-9) continue;
        for (int k = -1; k <= 1; k++, n++) {
            const double y = 0.5 * (a[1] + b[1] + k * sqrt(0.6) * length), Y = y + model->origin.y;
            const double shear = FORCE / (2 * INERTIA) * (0.25 * DEPTH * DEPTH - Y * Y);
            load[n] = (nmm_load){.element = model->edge_element[v], .place = {a[0], y}};
            load[n].force.y = -(k == 0 ? 4.0 : 2.5) / 9 * length * shear;
            load[n].history = -1;
            nmm_element_weights(model, load[n].element, load[n].place, load[n].weight);
        }
    }
    nmm_release(&sim->context, &model->load);
    model->load = load;
    model->n_load = n;
}

static void test_cantilever(void **state) {
    (void)state;
    const double size[] = {4.3, 2.3, 1.1};
    for (int order = 1; order < 3; order++) {
        double error[3];
        for (int k = 0; k < 3; k++) {
            run r = RUN("cantilever.yaml", order_of(order), set_text("covers.size=%g", size[k]));
            motion_give(r.sim, cantilever, 0);
            put_end_loads(r.sim);
            run_to_end(&r);
            error[k] = 1 + run_monitor(&r, "tip").displacement[1] / 0.0089;
            row_note(set_text("order %d, cantilever, size %g, %d unknowns: error of the tip", order,
                              size[k], 2 * r.sim->model.n_cover),
                     error[k]);
            run_close(&r);
        }
        // The solution is a cubic, which order 2 holds; what the displacements are large by is
        // left.
        row_below(set_text("order %d, cantilever: error of the tip at size %g", order, size[2]),
                  error[2], order == 1 ? 1e-5 : 3e-6);
    }
    rows_end();
}

// --- Rank

// Pivots of Cholesky's factorisation with complete pivoting, of the matrix scaled to a diagonal of
// ones, that are below `least`; *gap is the smallest of the others. Destroys A.
static int missing_rank(double *A, int n, double least, double *gap) {
    double *scale = calloc((size_t)n, sizeof *scale);
    bool *done = calloc((size_t)n, sizeof *done);
    for (int i = 0; i < n; i++)
        scale[i] = 1 / sqrt(A[(long)i * n + i]);
    for (long k = 0; k < (long)n * n; k++)
        A[k] *= scale[k / n] * scale[k % n];
    int rank = 0;
    for (; rank < n; rank++) {
        int p = -1;
        for (int i = 0; i < n; i++) {
            if (!done[i] && (p < 0 || A[(long)i * n + i] > A[(long)p * n + p])) p = i;
        }
        const double pivot = A[(long)p * n + p];
        if (pivot < least) break;
        *gap = pivot;
        done[p] = true;
        for (int i = 0; i < n; i++) {
            const double part = A[(long)i * n + p] / pivot;
            for (int j = 0; j < n && !done[i]; j++) {
                if (!done[j]) A[(long)i * n + j] -= part * A[(long)p * n + j];
            }
        }
    }
    free(scale);
    free(done);
    return n - rank;
}

static double *dense(const nmm_bsr *K) {
    const long n = 2 * (long)K->n_row;
    double *A = calloc((size_t)(n * n), sizeof *A);
    for (int row = 0; row < K->n_row; row++) {
        for (int k = K->row_start[row]; k < K->row_start[row + 1]; k++) {
            for (int x = 0; x < 4; x++)
                A[(2 * row + x / 2) * n + 2 * K->col[k] + x % 2] = K->value[4 * (long)k + x];
        }
    }
    return A;
}

// The stiffness without inertia: three motions of each block cost nothing, nothing else does.
static void stiffness_rank(const char *name, const char *scene, const char *set, int order) {
    run r = RUN(scene, order_of(order), "covers.size=0.55", set);
    const int n = 2 * r.sim->model.n_cover, n_block = r.sim->model.n_block;
    smooth_matrix(r.sim, 1e12);
    double *A = dense(&r.sim->system.K), gap = 0;
    row_near(set_text("order %d, %s, %d unknowns: motions without energy", order, name, n),
             3 * n_block, missing_rank(A, n, 1e-13, &gap), 0);
    // Slivers at the corners make it small.
    row_note(set_text("order %d, %s: smallest other pivot", order, name), gap);
    row_true(set_text("order %d, %s: it is above 1e-10", order, name), "yes", gap > 1e-10);
    free(A);
    run_close(&r);
}

static void test_stiffness_rank(void **state) {
    (void)state;
    for (int order = 0; order < 3; order++) {
        stiffness_rank("whole plate", "plate.yaml", "holes=[]", order);
        stiffness_rank("plate with a hole", "plate.yaml", "gravity=[0, 0]", order);
        stiffness_rank("plate with joint, crack, hole", "orders.yaml", "gravity=[0, 0]", order);
    }
    rows_end();
}

// Products of all functions w_i x^a y^b, a + b <= degree, about the nodes: those of the classical
// method for this order.
typedef struct naive_sum {
    int n, n_each;
    double *A;
} naive_sum;

static void add_naive(const smooth_point *at, void *user) {
    naive_sum *sum = user;
    const nmm_model *model = at->model;
    double w[NMM_MOST_LOCAL], value[18];
    int index[18], n = 0;
    nmm_element_linear(model, at->element, at->place, w);
    for (int i = 0; i < 3; i++) {
        const int c = model->element_cover[model->n_local * at->element + i];
        const double x = (at->place.x - model->cover_place[2 * c]) / model->size;
        const double y = (at->place.y - model->cover_place[2 * c + 1]) / model->size;
        const double power[6] = {1, x, y, x * x, x * y, y * y};
        for (int k = 0; k < sum->n_each; k++) {
            index[n] = sum->n_each * c + k;
            value[n++] = w[i] * power[k];
        }
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++)
            sum->A[(long)index[i] * sum->n + index[j]] += at->area * value[i] * value[j];
    }
}

static void test_functions_rank(void **state) {
    (void)state;
    static const int n_each[] = {1, 3, 6};
    // The classical functions on covers of order 0.
    for (int order = 1; order < 3; order++) {
        run r = RUN("plate.yaml", order_of(0), "covers.size=0.55");
        naive_sum sum = {.n = r.sim->model.n_cover * n_each[order], .n_each = n_each[order]};
        sum.A = calloc((size_t)sum.n * (size_t)sum.n, sizeof *sum.A);
        smooth_visit_all(&r.sim->model, add_naive, &sum);
        double gap = 0;
        const int missing = missing_rank(sum.A, sum.n, 1e-11, &gap);
        if (order == 1) {
            row_near("classical functions w_i (1, x, y): dependent ones", 3, missing, 0);
        } else {
            row_note("classical functions w_i (1, x, y, x2, xy, y2): dependent ones", missing);
        }
        free(sum.A);
        run_close(&r);
    }
    // The mass matrix of ours: twice the same, for x and y.
    for (int order = 0; order < 3; order++) {
        run r = RUN("plate.yaml", order_of(order), "covers.size=0.55");
        const int n = 2 * r.sim->model.n_cover;
        smooth_matrix(r.sim, 1e-9);
        double *A = dense(&r.sim->system.K), gap = 0;
        row_near(set_text("functions of order %d: dependent ones", order), 0,
                 missing_rank(A, n, 1e-11, &gap), 0);
        free(A);
        run_close(&r);
    }
    rows_end();
}

// --- Motions and contact

// A fall with spin, seen after two thirds of a second: straight on, without strain.
static void test_motions(void **state) {
    (void)state;
    for (int order = 1; order < 3; order++) {
        run r =
            RUN("rotation.yaml", order_of(order), "gravity=[0, -9.81]", "analysis.scheme=newmark",
                "time.end=3.141592653589793", "materials.stiff.youngs_modulus=1e8");
        run_to_end(&r);
        const nmm_reading centre = run_monitor(&r, "centre");
        const char *name = set_text("order %d: free fall with spin, half a turn", order);
        row_close(set_text("%s, way of the centre", name), -0.5 * 9.81 * M_PI * M_PI,
                  centre.displacement[1], 1e-9);
        row_below(set_text("%s, aside", name), centre.displacement[0], 1e-9);
        const double energy = 1000 * (0.5 * pow(9.81 * M_PI, 2));
        row_close(set_text("%s, kinetic energy", name), energy, r.report.energy.kinetic, 1e-8);
        row_ledger(name, &r);
        run_close(&r);
    }
    rows_end();
}

static void test_contact(void **state) {
    (void)state;
    for (int order = 1; order < 3; order++) {
        run r = RUN("patch_contact.yaml", order_of(order));
        run_to_end(&r);
        const nmm_view stress = nmm_sim_view(r.sim, "stress");
        double worst = 0;
        for (int e = 0; e < stress.count; e++) {
            const double *s = stress.data + 3 * (long)e;
            worst = fmax(worst, fabs(s[0]) + fabs(s[1] / -999687.6 - 1) * 1e6 + fabs(s[2]));
        }
        row_below(set_text("order %d: contact patch, stress off uniform over 1e6", order),
                  worst / 1e6, 1e-6);
        row_ledger(set_text("order %d: contact patch", order), &r);
        run_close(&r);
    }
    run r = RUN("incline.yaml", order_of(1));
    run_to_end(&r);
    row_close("order 1: incline 30 deg, phi 20: way at 2 s", 3.625629,
              run_monitor(&r, "slider").displacement[0], 1e-3);
    row_ledger("order 1: incline", &r);
    run_close(&r);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_polynomials),    cmocka_unit_test(test_rates),
        cmocka_unit_test(test_cantilever),     cmocka_unit_test(test_stiffness_rank),
        cmocka_unit_test(test_functions_rank), cmocka_unit_test(test_motions),
        cmocka_unit_test(test_contact),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
