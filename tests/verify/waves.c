// SPDX-License-Identifier: MIT
//
// Waves against closed forms: two bars that meet, the speeds of P and S waves and their reflection,
// frequencies of a bar and of a cantilever.

#include "run.h"

#include "step.h"

#include <stdlib.h>

// --- Two bars

// Mean velocity along x of the covers of a block, by their mass.
static double mean_velocity(const run *r, int block) {
    const nmm_model *model = &r->sim->model;
    double mass = 0, momentum = 0;
    for (int e = 0; e < model->n_element; e++) {
        if (model->element_block[e] != block) continue;
        for (int k = 0; k < 9; k++) {
            const int j = model->element_cover[3 * e + k % 3];
            const double m =
                r->sim->system.element_mass[6 * (long)e + nmm_pair_index(3, k / 3, k % 3)];
            mass += m;
            momentum += m * r->sim->state.velocity[2 * j];
        }
    }
    return momentum / mass;
}

// A discrete front is not sharp: it widens like (h^2 L)^(1/3). The bars part when the pressure
// first falls to nothing, and what the tail of the front carries, a part of (h/L)^(2/3), is not
// handed over.
// Returns the velocity that the first bar keeps.
static double meet(double size, double dt, double tolerance) {
    const double tail = 0.2 * pow(size / 10, 2.0 / 3);
    run r = RUN("bars.yaml", set_text("covers.size=%g", size), set_text("time.dt=%.17g", dt));
    const double c = sqrt(1e9 / 2500), whole = 20 / c;
    double sum = 0, last = 0;
    int n = 0;
    while (run_step(&r)) {
        if (r.report.closed > 0) last = r.report.time + 0.5 * r.report.dt;
        // Both quarters are under full stress from an eighth to seven eighths of the contact.
        if (r.report.time < 0.25 * whole || r.report.time > 0.75 * whole) continue;
        sum -= run_monitor(&r, "first").stress[0] + run_monitor(&r, "second").stress[0];
        n += 2;
    }
    const char *name = set_text("size %g, dt %g", size, dt);
    row_close(set_text("%s: stress", name), 7.90569e5, sum / n, tolerance);
    row_close(set_text("%s: contact time", name), 0.0316228, last, tolerance);
    row_near(set_text("%s: velocity of the first bar afterwards", name), 0, mean_velocity(&r, 0),
             tail);
    row_near(set_text("%s: velocity of the second bar afterwards", name), 1, mean_velocity(&r, 1),
             tail);
    row_ledger(name, &r);
    const double kept = mean_velocity(&r, 0);
    run_close(&r);
    return kept;
}

static void test_bars(void **state) {
    (void)state;
    const double size[] = {1, 0.5, 0.25};
    double kept[3] = {meet(1, 1e-4, 0.02)};
    if (run_all()) {
        kept[1] = meet(0.5, 5e-5, 0.012);
        kept[2] = meet(0.25, 2e-5, 0.007);
        row_rate("the velocity that is not handed over, in the size, dt with it", 2.0 / 3, 3, size,
                 kept, 0.1);
    }
    rows_end();
}

// --- Pulses

// A pulse that passes a monitor: integrals of velocity and stress over time, and its middle. Shi's
// scheme rounds pulses but keeps these.
typedef struct pulse {
    double velocity, stress, moment;
} pulse;

static double middle_of(const pulse *p) {
    return p->moment / p->velocity;
}

// On the way there and back.
typedef struct passage {
    pulse there, back;
} passage;

static void add(pulse *p, const run *r, int axis) {
    const nmm_reading now = run_monitor(r, "middle");
    const double v = now.velocity[axis], dt = r->report.dt;
    p->velocity += v * dt;
    p->moment += v * (r->report.time - 0.5 * dt) * dt;
    p->stress += now.stress[axis == 0 ? 0 : 2] * dt;
}

typedef struct strip {
    const char *scene, *fixed; // the setting that holds its far end
    double speed;
    int axis; // of the motion
    // Stiffness over that with sides that do not give; `give`: of both over the height, per stress.
    double (*soft)(double give);
} strip;

// The pulse of 0.01 s passes x = 20, turns at x = 30 and comes back.
static passage pass(const strip *s, const char *set, const char *name, double h) {
    run r = RUN(s->scene, set, set_text("covers.size=%g", h), set_text("time.dt=%g", 1e-4 * h));
    passage p = {0};
    bool more = true;
    while (more) {
        more = run_step(&r);
        const double turn = 30 / s->speed + 0.005;
        add(r.report.time < turn ? &p.there : &p.back, &r, s->axis);
    }
    row_ledger(name, &r);
    run_close(&r);
    return p;
}

// In steps shorter than a wave needs through a cover supports are springs of 50 E over the cover
// size: the sides give, of first order in the size. With their give the speed is as exact as the
// lattice.
static double travel(const strip *s, double h) {
    double error = 0;
    const double give = 2 * h / (50 * 1e9);
    for (int fixed = 0; fixed < 2; fixed++) {
        const char *name = set_text("size %g, %s end", h, fixed ? "fixed" : "free");
        const passage p = pass(s, fixed ? s->fixed : "title=free end", name, h);
        const double sign = fixed ? -1 : 1;
        const double speed = 20 / (middle_of(&p.back) - middle_of(&p.there));
        if (!fixed) {
            error = speed / s->speed - 1;
            row_close(set_text("size %g: speed", h), s->speed, speed, 0.01 * h);
            row_close(set_text("size %g: speed, give of the sides accounted for", h),
                      s->speed * sqrt(s->soft(give)), speed, 2e-3 * h);
        }
        // What trails behind the pulse, of second order.
        row_near(set_text("%s: velocity sent back over arriving", name), sign,
                 p.back.velocity / p.there.velocity, 0.05 * h * h);
        row_near(set_text("%s: stress sent back over arriving", name), -sign,
                 p.back.stress / p.there.stress, 0.05 * h * h);
    }
    return error;
}

static void travel_all(const strip *s) {
    const double size[] = {1, 0.5};
    double error[2] = {travel(s, 1)};
    if (!run_all()) return;
    error[1] = travel(s, 0.5);
    row_rate("the speed in the size, dt with it", 1, 2, size, error, 0.25);
}

static double soft_p(double give) {
    const double M = 1.2e9, lambda = 4e8;
    return 1 - lambda * lambda * give / (1 + M * give) / M;
}

static double soft_s(double give) {
    return 1 / (1 + 4e8 * give);
}

static void test_p_wave(void **state) {
    (void)state;
    const strip s = {"p_wave.yaml", "supports[2]={segment: [[30, 0], [30, 1]], fix: x}", 692.820323,
                     0, soft_p};
    travel_all(&s);
    rows_end();
}

static void test_s_wave(void **state) {
    (void)state;
    const strip s = {"s_wave.yaml", "supports[2]={segment: [[30, 0], [30, 1]], fix: y}", 400, 1,
                     soft_s};
    travel_all(&s);
    rows_end();
}

// --- Frequencies

// Frequency of the motion of `end` about `mean` along an axis: from the first to the last time it
// passes upwards.
static double frequency(run *r, int axis, double mean) {
    double first = 0, last = 0, before = -mean;
    int n = -1;
    bool more = true;
    while (more) {
        more = run_step(r);
        const double now = run_monitor(r, "end").displacement[axis] - mean;
        if (before < 0 && now >= 0) {
            last = r->report.time - r->report.dt * now / (now - before);
            if (n++ < 0) first = last;
        }
        before = now;
    }
    return n / (last - first);
}

static void test_bar_frequency(void **state) {
    (void)state;
    const double size[] = {1, 0.5};
    double error[2];
    for (int k = 0; k < (run_all() ? 2 : 1); k++) {
        const double h = size[k];
        run r = RUN("bar_frequency.yaml", set_text("covers.size=%g", h),
                    set_text("time.dt=%g", 4e-4 * h));
        // The held end is a spring of 50 E over the cover size: the bar is longer by h/50.
        const double f = frequency(&r, 0, 1e-3);
        row_close(set_text("size %g: first frequency", h), 15.811388, f, 3e-3 * h);
        error[k] = f / 15.811388 - 1;
        row_ledger(set_text("size %g", h), &r);
        run_close(&r);
    }
    if (run_all()) row_rate("the frequency in the size, dt with it", 1, 2, size, error, 0.25);
    rows_end();
}

static void test_cantilever_frequency(void **state) {
    (void)state;
    // Mean: the static deflection F L^3/(3 E I) of the tip, with shear.
    const double mean = -1e3 * (1e3 / (3 * 1e9 / 12) + 1.2 * 10 / 5e8);
    const double size[] = {0.4, 0.28, 0.2, 0.1};
    const int n = run_all() ? 4 : 2;
    double error[4];
    for (int k = 0; k < n; k++) {
        run r = RUN("cantilever_frequency.yaml", set_text("covers.size=%g", size[k]));
        const double f = frequency(&r, 1, mean);
        row_close(set_text("size %g: first frequency", size[k]), 1.015022, f,
                  1.2 * size[k] * size[k] + 1e-3);
        error[k] = f / 1.015022 - 1;
        run_close(&r);
    }
    row_near("rate of the frequency", 2, rate_of(n, size, error), 0.25);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bars),
        cmocka_unit_test(test_p_wave),
        cmocka_unit_test(test_s_wave),
        cmocka_unit_test(test_bar_frequency),
        cmocka_unit_test(test_cantilever_frequency),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
