// SPDX-License-Identifier: MIT
//
// The same scene gives the same bits with 1, 2 and 3 threads.

#include "run.h"

#include <inttypes.h>

typedef struct scene_steps {
    const char *scene;
    int steps;
} scene_steps;

static int largest; // covers of the largest scene

static uint64_t hash_of(const scene_steps *s, int n_thread) {
    run r = run_open(n_thread, (const char *const[]){s->scene, NULL});
    nmm_check check;
    assert_int_equal(nmm_sim_check(r.sim, &check), NMM_OK);
    largest = check.covers > largest ? check.covers : largest;
    for (int k = 0; k < s->steps && run_step(&r); k++)
        continue;
    nmm_summary summary;
    nmm_sim_summary(r.sim, &summary);
    run_close(&r);
    return summary.state_hash;
}

static void test_threads(void **state) {
    (void)state;
    const scene_steps scenes[] = {
        {"rotation.yaml", 50},  {"incline_turned.yaml", 50}, {"stack.yaml", 50},
        {"toppling.yaml", 50},  {"shear.yaml", 400},         {"bar.yaml", 100},
        {"cantilever.yaml", 1}, {"slope.yaml", 5},
    };
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        const uint64_t one = hash_of(&scenes[k], 1);
        for (int n_thread = 2; n_thread <= 3; n_thread++) {
            row_true(set_text("%s, %d steps: bits with %d threads", scenes[k].scene,
                              scenes[k].steps, n_thread),
                     set_text("%016" PRIx64, one), hash_of(&scenes[k], n_thread) == one);
        }
    }
    // Work is only shared from 2048 rows on.
    row_true("largest scene has more than 2048 covers", "yes", largest > 2048);
    rows_end();
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads),
    };
    return verify_main(argc, argv, tests, sizeof tests / sizeof *tests);
}
