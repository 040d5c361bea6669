// SPDX-License-Identifier: MIT
//
// Stress fields against closed forms: Lame's ring, Kirsch's hole, the Brazilian test, a strip load,
// Hertz's contact. One step of very long dt is a static solution. Stress is uniform in an element,
// so it is read by a plane through the elements around a place (run_stress); what a monitor shows,
// the stress of its one element, is reported beside it.

#include "run.h"

#include "step.h"

#include <stdlib.h>

#define PRESSURE 1e6

// What an element at (x, y) from the middle of a hole has.
typedef struct polar {
    double rr, c2, s2;         // r^2, cos 2t, sin 2t
    double radial, hoop, area; // stresses [Pa]
} polar;

static polar polar_of(const run *r, int e) {
    const nmm_model *model = &r->sim->model;
    const double x = model->element_centre[2 * e] + model->origin.x;
    const double y = model->element_centre[2 * e + 1] + model->origin.y, rr = x * x + y * y;
    const double *s = r->sim->state.stress + 3 * (long)e;
    const double radial = (s[0] * x * x + s[1] * y * y + 2 * s[2] * x * y) / rr;
    return (polar){.rr = rr,
                   .c2 = (x * x - y * y) / rr,
                   .s2 = 2 * x * y / rr,
                   .radial = radial,
                   .hoop = s[0] + s[1] - radial,
                   .area = model->element_area[e]};
}

// --- Lame

// Root mean square error of the stress of all elements over that of the exact one.
static double lame_error(const run *r) {
    double sum = 0, scale = 0;
    for (int e = 0; e < r->sim->model.n_element; e++) {
        const polar p = polar_of(r, e);
        const double radial = PRESSURE / 3 * (1 - 4 / p.rr), hoop = PRESSURE / 3 * (1 + 4 / p.rr);
        sum += p.area * (pow(p.radial - radial, 2) + pow(p.hoop - hoop, 2));
        scale += p.area * (radial * radial + hoop * hoop);
    }
    return sqrt(sum / scale);
}

// Hoop stress of all elements as A + B/r^2, the form that it has in any ring under pressure.
static void lame_hoop(const run *r, double factor[2]) {
    fit f = {.n = 2};
    for (int e = 0; e < r->sim->model.n_element; e++) {
        const polar p = polar_of(r, e);
        fit_add(&f, p.area, (const double[]){1, 1 / p.rr}, p.hoop);
    }
    fit_solve(&f, factor);
}

static void test_lame(void **state) {
    (void)state;
    const double size[] = {0.2, 0.1, 0.05};
    double error[3];
    for (int k = 0; k < 3; k++) {
        const double h = size[k];
        run r = RUN("lame.yaml", set_text("covers.size=%g", h));
        run_to_end(&r);
        double hoop[2];
        lame_hoop(&r, hoop);
        // Stresses are of first order in the size, h over the thickness of 1. The circle is a
        // polygon: u_r lacks 4e-4.
        row_close(set_text("size %g: u_r(a)", h), 1.875e-3,
                  run_monitor(&r, "inside").displacement[0], 0.3 * h * h + 4e-4);
        row_close(set_text("size %g: hoop stress at a", h), 1.666667e6, hoop[0] + hoop[1],
                  0.15 * h);
        row_close(set_text("size %g: hoop stress at b", h), 6.666667e5, hoop[0] + hoop[1] / 4,
                  0.15 * h);
        row_note(set_text("size %g: hoop stress at a, the one element there", h),
                 run_monitor(&r, "inside").stress[1]);
        error[k] = lame_error(&r);
        row_note(set_text("size %g: error of the stress field", h), error[k]);
        run_close(&r);
    }
    row_near("rate of the stress field", 1, rate_of(3, size, error), 0.25);
    rows_end();
}

// --- Kirsch

// Root mean square error of the stress of all elements over the tension far away.
static double kirsch_error(const run *r) {
    double sum = 0, area = 0;
    for (int e = 0; e < r->sim->model.n_element; e++) {
        const polar p = polar_of(r, e);
        const double q = 1 / p.rr;
        const double radial = 0.5 * PRESSURE * (1 - q + (1 - 4 * q + 3 * q * q) * p.c2);
        const double hoop = 0.5 * PRESSURE * (1 + q - (1 + 3 * q * q) * p.c2);
        sum += p.area * (pow(p.radial - radial, 2) + pow(p.hoop - hoop, 2));
        area += p.area;
    }
    return sqrt(sum / area) / PRESSURE;
}

// Hoop stress of the elements nearer than 2 a as A + B q + (C + D q^2) cos 2t, q = 1/r^2: the form
// that it has around a free hole, for any A, B, C, D.
static void kirsch_hoop(const run *r, double factor[4]) {
    fit f = {.n = 4};
    for (int e = 0; e < r->sim->model.n_element; e++) {
        const polar p = polar_of(r, e);
        const double q = 1 / p.rr;
        if (p.rr < 4) fit_add(&f, p.area, (const double[]){1, q, p.c2, q * q * p.c2}, p.hoop);
    }
    fit_solve(&f, factor);
}

static void test_kirsch(void **state) {
    (void)state;
    const double size[] = {0.3, 0.15, 0.075};
    double error[3];
    for (int k = 0; k < 3; k++) {
        const double h = size[k];
        run r = RUN("kirsch.yaml", set_text("covers.size=%g", h));
        run_to_end(&r);
        double c[4];
        kirsch_hoop(&r, c);
        // First order; the stress changes by 7 times itself over a radius.
        row_close(set_text("size %g: hoop stress above the hole", h), 3e6,
                  c[0] + c[1] - c[2] - c[3], 0.2 * h);
        row_close(set_text("size %g: hoop stress beside the hole", h), -1e6,
                  c[0] + c[1] + c[2] + c[3], 0.2 * h);
        row_note(set_text("size %g: above, the one element there", h),
                 run_monitor(&r, "above").stress[0]);
        row_note(set_text("size %g: beside, the one element there", h),
                 run_monitor(&r, "beside").stress[1]);
        error[k] = kirsch_error(&r);
        row_note(set_text("size %g: error of the stress field", h), error[k]);
        run_close(&r);
    }
    row_near("rate of the stress field", 1, rate_of(3, size, error), 0.25);
    rows_end();
}

#define RIM 2.8125e-3 // displacement of the hole's rim, at t = 0 [m]

static double rim_of(int order, double size, const char *segments, int *n) {
    run r = RUN("kirsch.yaml", set_text("covers={order: %d, size: %g}", order, size), segments);
    run_to_end(&r);
    const double rim = run_monitor(&r, "beside").displacement[0];
    if (n != NULL) *n = r.sim->scene.hole[0].n;
    run_close(&r);
    return rim;
}

// What a polygon instead of the circle adds to the error of the mesh, which is that of 768 sides.
static void look_at_sides(int order, double size) {
    const char *name = set_text("order %d, size %g", order, size);
    const double round = rim_of(order, size, "holes[0].circle.segments=768", NULL);
    const double mesh = round / RIM - 1;
    row_note(set_text("%s, 768 sides: error of the rim's displacement", name), mesh);
    double side[4], part[4];
    for (int k = 0; k < 4; k++) {
        const int n = 24 << k;
        side[k] = 1.0 / n;
        part[k] = rim_of(order, size, set_text("holes[0].circle.segments=%d", n), NULL) / RIM;
        part[k] -= round / RIM;
        row_note(set_text("%s, %d sides: what they add to it", name, n), part[k]);
    }
    row_near(set_text("%s: rate of that over the length of a side", name), 2,
             rate_of(4, side, part), 0.25);
    int n = 0;
    const double chosen = rim_of(order, size, NULL, &n) / RIM - round / RIM;
    row_below(set_text("%s, %d sides as chosen: what they add over the mesh's own", name, n),
              chosen / mesh, 0.6);
}

static void test_kirsch_sides(void **state) {
    (void)state;
    look_at_sides(0, 0.15);
    if (run_all()) look_at_sides(0, 0.075);
    look_at_sides(1, 0.3);
    if (run_all()) look_at_sides(1, 0.15);
    look_at_sides(2, 0.6);
    rows_end();
}

// --- Brazilian test and strip load

static void test_brazilian(void **state) {
    (void)state;
    const double size[] = {0.08, 0.04, 0.02};
    double error[3];
    for (int k = 0; k < 3; k++) {
        const double h = size[k];
        run r = RUN("brazilian.yaml", set_text("covers.size=%g", h));
        run_to_end(&r);
        double stress[3];
        run_stress(&r, 0, 0, 2 * h, stress);
        // Second order, by symmetry; the stress changes over a few tenths of D.
        row_close(set_text("size %g: tension at the centre", h), 6.366198e5, stress[0], 20 * h * h);
        row_close(set_text("size %g: pressure at the centre", h), -1.909859e6, stress[1],
                  20 * h * h);
        error[k] = stress[0] / 6.366198e5 - 1;
        run_close(&r);
    }
    row_near("rate of the tension", 2, rate_of(3, size, error), 0.3);
    rows_end();
}

static void test_strip(void **state) {
    (void)state;
    const double size[] = {0.5, 0.25, 0.125};
    double error[3];
    for (int k = 0; k < 3; k++) {
        const double h = size[k];
        run r = RUN("strip.yaml", set_text("covers.size=%g", h));
        run_to_end(&r);
        double stress[3];
        // First order; the stress changes over about 1 m.
        run_stress(&r, 0, -1, 2 * h, stress);
        row_close(set_text("size %g: stress at a depth of 1", h), -0.818310 * PRESSURE, stress[1],
                  0.1 * h);
        run_stress(&r, 0, -2, 2 * h, stress);
        row_close(set_text("size %g: stress at a depth of 2", h), -0.549815 * PRESSURE, stress[1],
                  0.1 * h);
        error[k] = stress[1] / (-0.549815 * PRESSURE) - 1;
        run_close(&r);
    }
    // A plane through the stresses around a place is of second order where nothing is near.
    row_rate("the stress at a depth of 2", 2, 3, size, error, 0.3);
    rows_end();
}

// --- Hertz

#define CHORD (1.076405e-2 / 6) // side of the polygon that stands for the cylinder [m]
#define CHORDS 7

// The half width is that of the ellipse with the second moment of the contact forces: a^2 = 4
// <x^2>. The cylinder is a polygon and its corners bear most, so pressures are forces gathered from
// half a side before to half a side behind each corner; at the peak, as p^2 = A + B x^2 of these.
// Returns the error of the half width.
static double hertz(double h) {
    // The profile is resolved to the second order in h over the half width.
    const double tolerance = 1.2 * pow(h / 1.076405e-2, 2);
    run r = RUN("hertz.yaml", set_text("covers.size=%g", h));
    run_to_end(&r);
    double gathered[CHORDS] = {0}, force = 0, moment = 0;
    for (int k = 0; k < r.sim->state.n_contact; k++) {
        const nmm_contact *contact = &r.sim->state.contact[k];
        if (contact->mode == NMM_CONTACT_OPEN) continue;
        const int p = r.sim->model.vertex_point[contact->vertex];
        const double x = r.sim->state.position[2 * p] + r.sim->model.origin.x;
        const int corner = (int)(fabs(x) / CHORD + 0.5);
        if (corner < CHORDS) gathered[corner] += contact->normal_force;
        force += contact->normal_force;
        moment += contact->normal_force * x * x;
    }
    fit f = {.n = 2};
    double c[2];
    for (int k = 0; k < CHORDS - 1; k++) {
        const double x = k * CHORD, pressure = gathered[k] / (k > 0 ? CHORD : CHORD / 2);
        fit_add(&f, 1, (const double[]){1, x * x}, pressure * pressure);
    }
    fit_solve(&f, c);
    row_close(set_text("size a/%.1f: force", 1.076405e-2 / h), 5e4, force, 1e-4);
    row_close(set_text("size a/%.1f: half width", 1.076405e-2 / h), 1.076405e-2,
              2 * sqrt(moment / force), tolerance);
    row_close(set_text("size a/%.1f: peak pressure", 1.076405e-2 / h), 5.914314e6, sqrt(c[0]),
              tolerance);
    run_close(&r);
    return 2 * sqrt(moment / force) / 1.076405e-2 - 1;
}

static void test_hertz(void **state) {
    (void)state;
    const double size[] = {3.6e-3, 2.2e-3, 1.4e-3};
    double error[3] = {hertz(size[0])};
    if (run_all()) {
        error[1] = hertz(size[1]);
        error[2] = hertz(size[2]);
        row_rate("the half width, 2 or better", 2, 3, size, error, 0);
    }
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_lame),         cmocka_unit_test(test_kirsch),
        cmocka_unit_test(test_kirsch_sides), cmocka_unit_test(test_brazilian),
        cmocka_unit_test(test_strip),        cmocka_unit_test(test_hertz),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
