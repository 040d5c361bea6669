// SPDX-License-Identifier: MIT
//
// Cost of the cutting: printed, not asserted. Asserted is what the tables must be at these sizes.
// Argument: largest number of elements, about (default 1e4; 1e5 and more in a release build).

#include "stage.h"

#include <stdlib.h>

static double largest = 1e4;

static void report(const char *what, stage *s) {
    const double start = nmm_clock();
    stage_build(s);
    const double seconds = nmm_clock() - start;
    const nmm_model *m = &s->model;
    print_message("%-8s %8d elements %8d covers %7d blocks %8.3f s %8.1f MB\n", what, m->n_element,
                  m->n_cover, m->n_block, seconds, (double)s->context.peak_bytes / 1e6);
}

static void joints(void **state) {
    (void)state;
    for (double n = 1000; n <= largest; n *= 10) {
        stage s;
        stage_open(&s, 100 / sqrt(n / 4));
        stage_rectangle(&s, 0, 0, 100, 100);
        nmm_random random = nmm_random_seed(3);
        for (int k = 0; k < 100; k++) {
            double end[4];
            for (int i = 0; i < 4; i++)
                end[i] = 100 * nmm_random_unit(&random);
            stage_line(&s, end[0], end[1], end[2], end[3]);
        }
        report("joints", &s);
        assert_close(s.report.area, 1e4, 1e-11);
        stage_close(&s);
    }
}

static void blocks(void **state) {
    (void)state;
    for (double n = 1000; n <= largest; n *= 10) {
        stage s;
        stage_open(&s, 5);
        const int side = (int)sqrt(n);
        for (int k = 0; k < side * side; k++) {
            const double x = 1.1 * (k % side), y = 1.1 * floor((double)k / side);
            stage_block(&s, 4, (double[]){x, y, x + 1, y, x + 1, y + 1, x, y + 1}, "unit");
        }
        report("blocks", &s);
        assert_int_equal(s.model.n_block, side * side);
        assert_close(s.report.area, (double)(side * side), 1e-9);
        stage_close(&s);
    }
}

int main(int n_argument, char **argument) {
    if (n_argument > 1) largest = strtod(argument[1], NULL);
    const struct CMUnitTest tests[] = {cmocka_unit_test(joints), cmocka_unit_test(blocks)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
