// SPDX-License-Identifier: MIT
//
// A smooth displacement u of small size and the one that a scene's covers make of it: the forces
//   f_i = sum over elements of  integral stress(u) . grad w_i + 2 / h^2 density u w_i
// are those that hold a body with displacement u in a step from rest; (K + 2 / h^2 M) d = f then
// asks for the element's stiffness and mass alone. Boundaries, cracks and joints are free, so each
// block has to find its part by itself. Integrals by 36 points on signed triangles, of the test's
// own.

#ifndef NMM_VERIFY_SMOOTH_H
#define NMM_VERIFY_SMOOTH_H

#include "step.h"
#include "test.h"

#include <math.h>
#include <stdlib.h>

/// A field: displacement u[2] and its gradient H[4] = xx, xy, yx, yy at x, y.
typedef void smooth_field(double x, double y, double *u, double *H);

/// What is added up at a point of an element.
typedef struct smooth_point {
    const nmm_model *model;
    int element;
    nmm_vec2 place;
    double area;
} smooth_point;

typedef void smooth_visit(const smooth_point *at, void *user);

static inline void smooth_visit_element(const nmm_model *model, int e, smooth_visit *visit,
                                        void *user) {
    static const double node[3] = {0.238619186083196909, 0.661209386466264514,
                                   0.932469514203152028};
    static const double weight[3] = {0.467913934572691047, 0.360761573048138608,
                                     0.171324492379170345};
    const int begin = model->element_start[e], end = model->element_start[e + 1];
    const double *first = model->point + 2 * (long)model->corner_point[begin];
    for (int k = begin + 1; k + 1 < end; k++) {
        const double *p = model->point + 2 * (long)model->corner_point[k];
        const double *q = model->point + 2 * (long)model->corner_point[k + 1];
        const double ax = p[0] - first[0], ay = p[1] - first[1];
        const double bx = q[0] - first[0], by = q[1] - first[1];
        for (int i = 0; i < 36; i++) {
            const int a = i / 6, b = i % 6;
            const double s = 0.5 + (a % 2 == 0 ? 0.5 : -0.5) * node[a / 2];
            const double t = 0.5 + (b % 2 == 0 ? 0.5 : -0.5) * node[b / 2];
            const smooth_point at = {
                .model = model,
                .element = e,
                .place = {first[0] + s * (ax + t * (bx - ax)), first[1] + s * (ay + t * (by - ay))},
                .area = 0.25 * weight[a / 2] * weight[b / 2] * s * (ax * by - ay * bx),
            };
            visit(&at, user);
        }
    }
}

static inline void smooth_visit_all(const nmm_model *model, smooth_visit *visit, void *user) {
    for (int e = 0; e < model->n_element; e++)
        smooth_visit_element(model, e, visit, user);
}

typedef struct smooth_load {
    smooth_field *field;
    double inertia; // 2 / h^2
    double *f;      // [n_cover][2]
} smooth_load;

static inline void smooth_add_load(const smooth_point *at, void *user) {
    const smooth_load *load = user;
    const nmm_model *model = at->model;
    const nmm_material *material = &model->material[model->element_material[at->element]];
    const nmm_elastic elastic = nmm_elastic_of(material);
    double u[2], H[4], linear[3], w[NMM_MOST_LOCAL], g[2 * NMM_MOST_LOCAL];
    load->field(at->place.x, at->place.y, u, H);
    nmm_element_linear(model, at->element, at->place, linear);
    nmm_functions_value(model, at->element, linear, w);
    nmm_functions_gradient(model, at->element, linear, g);
    const double volume = elastic.lambda * (H[0] + H[3]);
    const double sxx = volume + 2 * elastic.mu * H[0], syy = volume + 2 * elastic.mu * H[3];
    const double sxy = elastic.mu * (H[1] + H[2]), mass = load->inertia * material->density;
    for (int i = 0; i < model->n_local; i++) {
        double *f = load->f + 2 * model->element_cover[model->n_local * at->element + i];
        f[0] += at->area * (sxx * g[2 * i] + sxy * g[2 * i + 1] + mass * u[0] * w[i]);
        f[1] += at->area * (sxy * g[2 * i] + syy * g[2 * i + 1] + mass * u[1] * w[i]);
    }
}

/// The matrix of a step of length h from rest, in sim->system.K.
static inline void smooth_matrix(nmm_sim *sim, double h) {
    assert_int_equal(nmm_system_pattern(&sim->context, &sim->system, &sim->model, &sim->state),
                     NMM_OK);
    nmm_system_prepare(&sim->context, &sim->system, &sim->model, &sim->state, h);
    nmm_system_assemble(&sim->context, &sim->system, &sim->model, NULL);
}

/// Displacements of the covers, [n_cover][2], to be freed.
static inline double *smooth_solve(nmm_sim *sim, smooth_field *field, double h) {
    const size_t n = 2 * (size_t)sim->model.n_cover;
    double *d = calloc(n, sizeof *d), *f = calloc(n, sizeof *f);
    smooth_load load = {field, 2 / (h * h), f};
    smooth_visit_all(&sim->model, smooth_add_load, &load);
    smooth_matrix(sim, h);
    const nmm_bsr *K = &sim->system.K;
    const int n_block = K->row_start[K->n_row];
    nmm_solver *solver = NULL;
    nmm_solve_options options = nmm_default_solve_options();
    nmm_solve_report report;
    options.method = NMM_SOLVE_DIRECT;
    options.tolerance = 1e-13;
    const nmm_solve_backend *host = nmm_solve_host();
    assert_int_equal(host->open(&sim->context, &solver, K->n_row, n_block), NMM_OK);
    assert_int_equal(host->solve(&sim->context, solver, K, f, d, false, &options, &report), NMM_OK);
    host->close(&sim->context, &solver);
    // Rounding may keep the residual above what was asked for.
    assert_true(report.residual < 1e-11);
    free(f);
    return d;
}

typedef struct smooth_difference {
    smooth_field *field;
    const double *d;
    double square, whole; // integrals of |u_h - u|^2 and of |u|^2
} smooth_difference;

static inline void smooth_add_difference(const smooth_point *at, void *user) {
    smooth_difference *sum = user;
    const nmm_model *model = at->model;
    double u[2], H[4], w[NMM_MOST_LOCAL];
    sum->field(at->place.x, at->place.y, u, H);
    sum->whole += at->area * (u[0] * u[0] + u[1] * u[1]);
    nmm_element_weights(model, at->element, at->place, w);
    for (int i = 0; i < model->n_local; i++) {
        const double *d = sum->d + 2 * model->element_cover[model->n_local * at->element + i];
        u[0] -= w[i] * d[0], u[1] -= w[i] * d[1];
    }
    sum->square += at->area * (u[0] * u[0] + u[1] * u[1]);
}

/// Root mean square of the difference over that of the field.
static inline double smooth_error(const nmm_sim *sim, smooth_field *field, const double *d) {
    smooth_difference sum = {.field = field, .d = d};
    smooth_visit_all(&sim->model, smooth_add_difference, &sum);
    return sqrt(fmax(0, sum.square) / sum.whole);
}

// A field without end of its Taylor series, with its gradient.
static inline void smooth_wave(double x, double y, double *u, double *H) {
    u[0] = sin(1.7 * x + 0.4) * cos(1.3 * y);
    H[0] = 1.7 * cos(1.7 * x + 0.4) * cos(1.3 * y);
    H[1] = -1.3 * sin(1.7 * x + 0.4) * sin(1.3 * y);
    u[1] = cos(1.1 * x) * sin(1.9 * y + 0.3);
    H[2] = -1.1 * sin(1.1 * x) * sin(1.9 * y + 0.3);
    H[3] = 1.9 * cos(1.1 * x) * cos(1.9 * y + 0.3);
}

#endif
