// SPDX-License-Identifier: MIT
//
// Opens scenes, steps through them and keeps the rows of comparisons. Rows of a failing test are
// all printed before it fails.

#include "run.h"

#include "step.h"

#include <stdlib.h>

static int n_failed;
static bool all;

// --- Programs

bool run_all(void) {
    return all;
}

int verify_main(int argc, char **argv, const struct CMUnitTest *test, size_t n) {
    all = argc > 1 && strcmp(argv[1], "all") == 0;
    return _cmocka_run_group_tests("verify", test, n, NULL, NULL);
}

// --- Runs

static void stop(const run *r, const char *scene) {
    const nmm_error *error = nmm_sim_error(r->sim);
    const char *mistakes = nmm_sim_mistakes(r->sim);
    print_error("%s: %s\n%s", scene, error->message, mistakes != NULL ? mistakes : "");
    fail();
}

run run_open(int n_thread, const char *const *scene_and_set) {
    const char *scene = scene_and_set[0], *const *set = scene_and_set + 1;
    char path[512];
    snprintf(path, sizeof path, "%s/%s", NMM_SCENES, scene);
    printf("scene: %s\n", scene);
    nmm_sim_def def = nmm_default_sim_def();
    def.path = path;
    def.override = set;
    while (set[def.n_override] != NULL)
        def.n_override += 1;
    def.n_thread = n_thread;
    def.device = NMM_DEVICE_HOST;
    run r = {0};
    if (nmm_sim_create(&r.sim, &def) != NMM_OK) stop(&r, scene);
    return r;
}

void run_close(run *r) {
    nmm_sim_destroy(r->sim);
    *r = (run){0};
}

bool run_step(run *r) {
    if (nmm_sim_step(r->sim, &r->report) != NMM_OK) stop(r, nmm_sim_title(r->sim));
    if (r->report.end < 0) {
        print_error("%s ended at t = %g: %s\n", nmm_sim_title(r->sim), r->report.time,
                    r->report.reason);
        fail();
    }
    return r->report.end == NMM_END_RUNNING;
}

void run_until(run *r, double time) {
    while (r->report.time < time * (1 - 1e-12) && run_step(r))
        continue;
}

void run_to_end(run *r) {
    while (run_step(r))
        continue;
}

nmm_reading run_monitor(const run *r, const char *name) {
    nmm_reading reading = {0};
    for (int k = 0; k < nmm_sim_monitors(r->sim); k++) {
        assert_int_equal(nmm_sim_monitor(r->sim, k, &reading), NMM_OK);
        if (strcmp(reading.name, name) == 0) return reading;
    }
    print_error("no monitor '%s'\n", name);
    fail();
    return reading;
}

// --- Fits

void fit_add(fit *f, double weight, const double *base, double value) {
    for (int i = 0; i < f->n; i++) {
        for (int j = 0; j < f->n; j++)
            f->A[i][j] += weight * base[i] * base[j];
        f->b[i] += weight * base[i] * value;
    }
}

// Gauss-Jordan: the matrix is positive definite where the functions are independent.
void fit_solve(fit *f, double *factor) {
    for (int k = 0; k < f->n; k++) {
        assert_true(f->A[k][k] > 0);
        for (int i = 0; i < f->n; i++) {
            const double part = f->A[i][k] / f->A[k][k];
            if (i == k) continue;
            for (int j = 0; j < f->n; j++)
                f->A[i][j] -= part * f->A[k][j];
            f->b[i] -= part * f->b[k];
        }
    }
    for (int k = 0; k < f->n; k++)
        factor[k] = f->b[k] / f->A[k][k];
}

void run_stress(const run *r, double x, double y, double radius, double stress[3]) {
    const nmm_model *model = &r->sim->model;
    fit plane[3] = {{.n = 3}, {.n = 3}, {.n = 3}};
    for (int e = 0; e < model->n_element; e++) {
        const double u = (model->element_centre[2 * e] + model->origin.x - x) / radius;
        const double v = (model->element_centre[2 * e + 1] + model->origin.y - y) / radius;
        if (u * u + v * v > 1) continue;
        const double base[3] = {1, u, v};
        for (int k = 0; k < 3; k++) {
            fit_add(&plane[k], model->element_area[e], base, r->sim->state.stress[3 * (long)e + k]);
        }
    }
    for (int k = 0; k < 3; k++) {
        double factor[3];
        fit_solve(&plane[k], factor);
        stress[k] = factor[0];
    }
}

double rate_of(int n, const double *h, const double *error) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (int k = 0; k < n; k++) {
        const double x = log(h[k]), y = log(fabs(error[k]));
        sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

const char *set_text(const char *format, ...) {
    static char text[32][512];
    static int next;
    char *at = text[next++ % 32];
    va_list list;
    va_start(list, format);
    vsnprintf(at, sizeof text[0], format, list);
    va_end(list);
    return at;
}

// --- Rows

static void row(const char *name, double expected, double measured, double error,
                double tolerance) {
    const bool good = fabs(error) <= tolerance;
    n_failed += !good;
    printf("| %s | %.10g | %.10g | %.2e | %.1e | %s |\n", name, expected, measured, error,
           tolerance, good ? "ok" : "**fails**");
    fflush(stdout);
}

void row_near(const char *name, double expected, double measured, double tolerance) {
    row(name, expected, measured, measured - expected, tolerance);
}

void row_close(const char *name, double expected, double measured, double tolerance) {
    row(name, expected, measured, measured / expected - 1, tolerance);
}

void row_below(const char *name, double measured, double limit) {
    row(name, 0, measured, measured, limit);
}

void row_true(const char *name, const char *expected, bool measured) {
    n_failed += !measured;
    printf("| %s | %s | %s | | | %s |\n", name, expected, measured ? "yes" : "no",
           measured ? "ok" : "**fails**");
    fflush(stdout);
}

void row_note(const char *name, double measured) {
    printf("| %s | | %.6g | | | |\n", name, measured);
    fflush(stdout);
}

void row_rate(const char *name, double expected, int n, const double *h, const double *error,
              double tolerance) {
    const double rate = rate_of(n, h, error);
    if (tolerance > 0)
        row_near(set_text("rate of %s", name), expected, rate, tolerance);
    else
        row_note(set_text("rate of %s", name), rate);
}

void no_rate(const char *why) {
    printf("| no rate: %s | | - | | | |\n", why);
    fflush(stdout);
}

void row_ledger(const char *name, const run *r) {
    const nmm_energy *e = &r->report.energy;
    const double term[] = {e->kinetic, e->strain,  e->contact,  e->friction, e->fracture,
                           e->support, e->damping, e->external, e->numerical};
    double largest = 0;
    for (size_t i = 0; i < sizeof term / sizeof *term; i++)
        largest = fmax(largest, fabs(term[i]));
    row_below(set_text("%s: ledger residual over largest term", name), e->residual / largest, 1e-8);
}

void rows_end(void) {
    const int n = n_failed;
    n_failed = 0;
    if (n > 0) print_error("%d of the rows above fail\n", n);
    assert_int_equal(n, 0);
}
