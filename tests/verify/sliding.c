// SPDX-License-Identifier: MIT
//
// Sliding and sticking against closed forms: slopes on a grid of friction and angle, push and
// release, slowing down, a shaking base.

#include "run.h"

#include "step.h"

#define GRAVITY 9.81

static double degrees(double radians) {
    return radians * 180 / M_PI;
}

static double radians(double angle) {
    return angle * M_PI / 180;
}

static const char *tilt(double angle) {
    return set_text("gravity=[%.17g, %.17g]", GRAVITY * sin(angle), -GRAVITY * cos(angle));
}

static const char *friction(double angle) {
    return set_text("interfaces.contact.friction_angle=%.17g", degrees(angle));
}

// --- Slope of 30 degrees

static const double incline_way[][2] = {{0, 9.810000},  {5, 8.323444},  {10, 6.813954},
                                        {15, 5.257163}, {20, 3.625629}, {25, 1.886771},
                                        {29, 0.391503}};

static void test_incline(void **state) {
    (void)state;
    for (int k = 0; k < 7; k += run_all() ? 1 : 3) {
        const double phi = incline_way[k][0];
        run r = RUN("incline.yaml", friction(radians(phi)));
        run_to_end(&r);
        row_close(set_text("incline 30 deg, phi %g: way at 2 s", phi), incline_way[k][1],
                  run_monitor(&r, "slider").displacement[0], 1e-3);
        row_ledger(set_text("incline 30 deg, phi %g", phi), &r);
        const nmm_energy *e = &r.report.energy;
        // Nothing bounces and nothing turns: the scheme has next to nothing to lose.
        if (phi > 0)
            row_below(set_text("incline 30 deg, phi %g: numerical over friction work", phi),
                      fabs(e->numerical) / e->friction, 1e-5);
        run_close(&r);
    }
    no_rate("constant acceleration, which any step has exactly");
    rows_end();
}

// A slope below the angle of friction: no creep.
static void test_incline_holds(void **state) {
    (void)state;
    run r = RUN("incline.yaml", friction(radians(35)));
    run_to_end(&r);
    row_below("incline 30 deg, phi 35: way at 2 s", run_monitor(&r, "slider").displacement[0],
              1e-6);
    run_close(&r);
    rows_end();
}

static void test_incline_turned(void **state) {
    (void)state;
    for (int k = 0; k < 7; k += run_all() ? 1 : 4) {
        const double phi = incline_way[k][0];
        run r = RUN("incline_turned.yaml", friction(radians(phi)));
        run_to_end(&r);
        const double *d = run_monitor(&r, "slider").displacement;
        const double way = d[0] * cos(radians(30)) - d[1] * sin(radians(30));
        row_close(set_text("incline 30 deg, turned geometry, phi %g: way at 2 s", phi),
                  incline_way[k][1], way, 1e-3);
        run_close(&r);
    }
    no_rate("constant acceleration, which any step has exactly");
    rows_end();
}

static void test_incline_coarse(void **state) {
    (void)state;
    const char *set[] = {"time.dt=2e-2", "time.dt=1e-3", "contact.penalty=1",
                         "contact.penalty=1000", "contact.method=augmented"};
    for (int k = run_all() ? 0 : 3; k < 5; k++) {
        run r = RUN("incline.yaml", set[k]);
        run_to_end(&r);
        row_close(set_text("incline 30 deg, phi 20, %s: way at 2 s", set[k]), incline_way[4][1],
                  run_monitor(&r, "slider").displacement[0], 1e-3);
        run_close(&r);
    }
    rows_end();
}

// Way in 2 s with augmented contact at mu k/10, so many degrees above the angle of friction.
static double threshold_way(int k, double above, double penalty, double dt) {
    const double phi = atan(0.1 * k);
    run r =
        RUN("incline.yaml", friction(phi), tilt(phi + radians(above)), "contact.method=augmented",
            set_text("contact.penalty=%g", penalty), set_text("time.dt=%g", dt));
    run_to_end(&r);
    const double way = run_monitor(&r, "slider").displacement[0];
    run_close(&r);
    return way;
}

// Augmented contact: answers that do not depend on the penalty.
static void test_incline_penalty(void **state) {
    (void)state;
    const double penalty[] = {1, 10, 100, 1000};
    for (int k = 0; k < (run_all() ? 4 : 0); k++) {
        run r = RUN("incline.yaml", "contact.method=augmented",
                    set_text("contact.penalty=%g", penalty[k]));
        run_to_end(&r);
        row_close(set_text("augmented, penalty %g E: way at 2 s", penalty[k]), incline_way[4][1],
                  run_monitor(&r, "slider").displacement[0], 1e-4);
        run_close(&r);
    }
    for (int k = 0; k < (run_all() ? 4 : 0); k++) {
        row_below(
            set_text("augmented, penalty %g E, mu 0.5, 0.5 deg below: way at 2 s", penalty[k]),
            threshold_way(5, -0.5, penalty[k], 5e-3), 1e-5);
    }
    rows_end();
}

// --- Threshold

static void test_threshold_below(void **state) {
    (void)state;
    for (int k = 1; k <= 10; k += run_all() ? 1 : 3) {
        const double phi = atan(0.1 * k), angle = phi - radians(0.5);
        run r = RUN("incline.yaml", friction(phi), tilt(angle));
        run_until(&r, 1);
        const double early = run_monitor(&r, "slider").displacement[0];
        run_to_end(&r);
        const double late = run_monitor(&r, "slider").displacement[0];
        row_below(set_text("threshold, mu %.1f, 0.5 deg below: way at 2 s", 0.1 * k), late, 1e-5);
        row_below(set_text("threshold, mu %.1f, 0.5 deg below: way from 1 s to 2 s", 0.1 * k),
                  late - early, 1e-9);
        run_close(&r);
    }
    rows_end();
}

static void test_threshold_above(void **state) {
    (void)state;
    for (int k = 1; k <= 10; k += run_all() ? 1 : 3) {
        const double phi = atan(0.1 * k), angle = phi + radians(0.5);
        run r = RUN("incline.yaml", friction(phi), tilt(angle));
        run_to_end(&r);
        const double way = 0.5 * GRAVITY * (sin(angle) - cos(angle) * 0.1 * k) * 4;
        row_close(set_text("threshold, mu %.1f, 0.5 deg above: way at 2 s", 0.1 * k), way,
                  run_monitor(&r, "slider").displacement[0], 1e-2);
        run_close(&r);
    }
    rows_end();
}

// Augmented contact: the worst way of the grid at each penalty.
static void test_threshold_below_augmented(void **state) {
    (void)state;
    for (double penalty = 1; run_all() && penalty <= 1000; penalty *= 10) {
        double worst = 0;
        for (int k = 1; k <= 10; k++)
            worst = fmax(worst, fabs(threshold_way(k, -0.5, penalty, 5e-3)));
        row_below(set_text("augmented, penalty %g E, all mu, 0.5 deg below: longest way", penalty),
                  worst, 1e-5);
    }
    rows_end();
}

// The quick part is one where stiff springs open and close for ever in the first step.
static void test_threshold_above_augmented(void **state) {
    (void)state;
    const int first = run_all() ? 1 : 8, last = run_all() ? 10 : 8;
    for (double penalty = run_all() ? 1 : 1000; penalty <= 1000; penalty *= 10) {
        double worst = 0;
        for (int k = first; k <= last; k++) {
            const double angle = atan(0.1 * k) + radians(0.5);
            const double way = 0.5 * GRAVITY * (sin(angle) - cos(angle) * 0.1 * k) * 4;
            worst = fmax(worst, fabs(threshold_way(k, 0.5, penalty, 5e-3) / way - 1));
        }
        row_below(set_text("augmented, penalty %g E, all mu, 0.5 deg above: worst error", penalty),
                  worst, 1e-4);
    }
    rows_end();
}

// In steps that are short against a wave's time through a cover: impacts while the load sets in are
// another way than that of a rigid block, but the same one at any penalty.
static void test_threshold_short(void **state) {
    (void)state;
    for (int k = 2; run_all() && k <= 8; k += 3) {
        const double one = threshold_way(k, 0.5, 1, 5e-4);
        for (double penalty = 10; penalty <= 1000; penalty *= 10)
            row_close(
                set_text("augmented, dt 0.5 ms, mu %.1f, 0.5 deg above: way at %g E over that "
                         "at 1 E",
                         0.1 * k, penalty),
                1, threshold_way(k, 0.5, penalty, 5e-4) / one, 1e-4);
        row_below(set_text("augmented, dt 0.5 ms, mu %.1f, 0.5 deg below: way at 1 E", 0.1 * k),
                  threshold_way(k, -0.5, 1, 5e-4), 1e-5);
        row_below(set_text("augmented, dt 0.5 ms, mu %.1f, 0.5 deg below: way at 1000 E", 0.1 * k),
                  threshold_way(k, -0.5, 1000, 5e-4), 1e-5);
    }
    rows_end();
}

// --- Strength reduction

static void test_strength_reduction(void **state) {
    (void)state;
    const double strength = tan(radians(30)), a = radians(20), factor = strength / tan(a);
    const double part[] = {0.999, 1.001};
    for (int k = 0; k < 2; k++) {
        const double F = part[k] * factor;
        run r = RUN("strength_reduction.yaml", friction(atan(strength / F)));
        run_until(&r, 1);
        const nmm_reading early = run_monitor(&r, "block");
        run_to_end(&r);
        const nmm_reading late = run_monitor(&r, "block");
        const char *name = set_text("strength divided by %.6f", F);
        if (k == 0) {
            row_below(set_text("%s, 0.1 %% below the factor: way", name), late.displacement[0],
                      1e-6);
        } else {
            // Gravity acts at once: the first steps leave a speed of 4e-5 m/s.
            const double exact = GRAVITY * cos(a) * (tan(a) - strength / F);
            row_close(set_text("%s, 0.1 %% above the factor: acceleration", name), exact,
                      (late.velocity[0] - early.velocity[0]), 1e-2);
        }
        run_close(&r);
    }
    no_rate("a limit, held between two runs");
    rows_end();
}

// --- Moving and stopping

static void test_push(void **state) {
    (void)state;
    run r = RUN("push.yaml");
    double furthest = 0;
    while (run_step(&r))
        furthest = fmax(furthest, run_monitor(&r, "pushed").displacement[0]);
    const double last = run_monitor(&r, "pushed").displacement[0];
    row_close("push and release: way", 0.1, last, 5e-3);
    row_below("push and release: creep back", furthest - last, 1e-6);
    row_ledger("push and release", &r);
    no_rate("constant acceleration, which any step has exactly");
    run_close(&r);
    rows_end();
}

static void test_slowing(void **state) {
    (void)state;
    run r = RUN("slowing.yaml");
    double stop = 0, before = 5;
    while (run_step(&r)) {
        const double speed = run_monitor(&r, "slider").velocity[0];
        // The speed falls on a straight line: where that meets zero.
        if (speed > 0.05) stop = r.report.time + speed * r.report.dt / (before - speed);
        before = speed;
    }
    row_close("slowing down: way", 2.548420, run_monitor(&r, "slider").displacement[0], 1e-3);
    row_close("slowing down: time", 1.019368, stop, 1e-3);
    row_ledger("slowing down", &r);
    no_rate("constant acceleration, which any step has exactly");
    run_close(&r);
    rows_end();
}

// Every closed contact slides.
static bool slides(const run *r) {
    const nmm_state *state = &r->sim->state;
    int n = 0;
    for (int k = 0; k < state->n_contact; k++) {
        if (state->contact[k].mode == NMM_CONTACT_STICK) return false;
        n += state->contact[k].mode == NMM_CONTACT_SLIDE;
    }
    return n > 0;
}

static void test_base_motion(void **state) {
    (void)state;
    run r = RUN("base_motion.yaml");
    double largest = 0, first = -1;
    // The first slip is enough for a quick look.
    bool more = true;
    while (more && (run_all() || r.report.time < 0.1)) {
        more = run_step(&r);
        largest = fmax(largest, fabs(run_monitor(&r, "slider").displacement[0]));
        if (first < 0 && r.report.time > 0.02 && slides(&r)) first = r.report.time;
    }
    if (run_all()) {
        row_close("shaking base: largest slip", 0.251355882, largest, 1e-3);
        row_close("shaking base: slip at 3 s", -0.104949953,
                  run_monitor(&r, "slider").displacement[0], 2e-3);
    }
    row_near("shaking base: first slip (step 5e-4)", 0.065494940, first, 1e-3);
    row_ledger("shaking base", &r);
    run_close(&r);
    rows_end();
}

// In shorter steps than these the blocks' own vibrations are what is left.
static void test_base_motion_rate(void **state) {
    (void)state;
    const double dt[] = {4e-3, 2e-3, 1e-3};
    double error[3];
    if (!run_all()) return;
    for (int k = 0; k < 3; k++) {
        run r = RUN("base_motion.yaml", set_text("time.dt=%g", dt[k]));
        run_to_end(&r);
        error[k] = run_monitor(&r, "slider").displacement[0] + 0.104949953;
        row_note(set_text("shaking base, dt %g: error of the slip at 3 s [m]", dt[k]), error[k]);
        run_close(&r);
    }
    row_rate("the slip at 3 s in dt", 1, 3, dt, error, 0.25);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_incline),
        cmocka_unit_test(test_incline_holds),
        cmocka_unit_test(test_strength_reduction),
        cmocka_unit_test(test_incline_turned),
        cmocka_unit_test(test_incline_coarse),
        cmocka_unit_test(test_incline_penalty),
        cmocka_unit_test(test_threshold_below),
        cmocka_unit_test(test_threshold_above),
        cmocka_unit_test(test_threshold_below_augmented),
        cmocka_unit_test(test_threshold_above_augmented),
        cmocka_unit_test(test_threshold_short),
        cmocka_unit_test(test_push),
        cmocka_unit_test(test_slowing),
        cmocka_unit_test(test_base_motion),
        cmocka_unit_test(test_base_motion_rate),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
