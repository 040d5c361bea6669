// SPDX-License-Identifier: MIT
//
// Slivers

#include "run.h"

#include "smooth.h"

static run open_ledge(int order, double ledge) {
    return RUN("slivers.yaml", set_text("covers.order=%d", order),
               set_text("domain=[{polygon: [[0, 0], [3, 0], [3, 2], [1.5, 2], [1.5, %.17g], "
                        "[0, %.17g]]}]", ledge, ledge));
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
    for (int k = 0; k < 60; k++) {
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

int main(int argc, char **argv) {
    (void)argc; (void)argv;
    const double row = row_near_height(1.1);
    const double cut[] = {0.3, 1e-1, 3e-2, 1e-2, 1e-3, 1e-4, 3e-5};
    for (int order = 0; order < 3; order++)
        for (int k = 0; k < 7; k++) {
            run r = open_ledge(order, row + 0.3 * cut[k]);
            double least = 1;
            for (int e = 0; e < r.sim->model.n_element; e++)
                least = fmin(least, r.sim->model.element_area[e] / (0.3 * 0.3 * sqrt(3) / 4));
            printf("order %d cut %g least area %.2e n %d condition %.3g\n", order, cut[k], least, 2 * r.sim->model.n_cover,
                   condition(r.sim, 0.01));
            run_close(&r);
        }
    return 0;
}
