// SPDX-License-Identifier: MIT
//
// Impacts against closed forms: a block on a penalty spring under Shi's scheme, a bar on a rigid
// wall.

#include "run.h"

#include <stdlib.h>

static void test_restitution(void **state) {
    (void)state;
    const double W[] = {0.025, 0.05, 0.1, 0.5, 1};
    const double expected[] = {0.98063, 0.96166, 0.92571, 0.70462, 0.55556};
    double lost[5];
    for (int k = 0; k < 5; k++) {
        run r = RUN("drop.yaml", set_text("time.dt=%.17g", W[k] / 10));
        run_to_end(&r);
        row_near(set_text("block on a spring, W %g: restitution", W[k]), expected[k],
                 run_monitor(&r, "block").velocity[1] / 0.2, 1e-5);
        row_ledger(set_text("block on a spring, W %g", W[k]), &r);
        lost[k] = 1 - run_monitor(&r, "block").velocity[1] / 0.2;
        run_close(&r);
    }
    row_rate("the restitution lost, in dt", 1, 3, W, lost, 0.05);
    rows_end();
}

// Contact time and mean stress at a quarter of the bar while the first wave has passed it.
// Returns the error of the contact time.
static double hit(double size, double dt, double tolerance) {
    run r = RUN("bar.yaml", set_text("covers.size=%.17g", size), set_text("time.dt=%.17g", dt));
    const double c = sqrt(1e9 / 2500), whole = 20 / c;
    double first = -1, last = -1, sum = 0;
    int n = 0;
    while (run_step(&r)) {
        if (r.report.closed > 0) {
            if (first < 0) first = r.report.time - 0.5 * r.report.dt;
            last = r.report.time + 0.5 * r.report.dt;
        }
        // The wave passes x = 2.5 at an eighth, comes back at seven eighths of the contact.
        if (r.report.time < 0.25 * whole || r.report.time > 0.75 * whole) continue;
        sum += -run_monitor(&r, "quarter").stress[0];
        n += 1;
    }
    const char *name = set_text("bar on a wall, size %g, dt %g", size, dt);
    row_close(set_text("%s: stress", name), 1.581139e6, sum / n, tolerance);
    row_close(set_text("%s: contact time", name), 0.0316228, last - first, tolerance);
    row_note(set_text("%s: speed of the free end afterwards", name),
             run_monitor(&r, "free end").velocity[0]);
    row_ledger(name, &r);
    run_close(&r);
    return (last - first) / 0.0316228 - 1;
}

static void test_bar(void **state) {
    (void)state;
    const double size[] = {1, 0.5, 0.25};
    double error[3] = {hit(1, 1e-4, 0.02)};
    if (run_all()) {
        error[1] = hit(0.5, 5e-5, 0.012);
        error[2] = hit(0.25, 2e-5, 0.007);
        // A discrete front widens like (h^2 L)^(1/3).
        row_rate("the contact time in the size, dt with it", 2.0 / 3, 3, size, error, 0.1);
    }
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_restitution),
        cmocka_unit_test(test_bar),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
