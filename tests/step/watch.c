// SPDX-License-Identifier: MIT
//
// The watch of the energy ledger: energy from nowhere and a ledger that does not close are told
// with amount, step and place; neither where there is none, nor what the run outgrows.

#include "scenes.h"
#include "test.h"

static nmm_summary summary_of(nmm_sim *sim) {
    nmm_summary summary;
    nmm_sim_summary(sim, &summary);
    return summary;
}

static void test_nothing_to_tell(void **unused) {
    (void)unused;
    const char *const scenes[] = {SCENE_BLOCK_ON_BASE, SCENE_FALL, SCENE_COLUMN};
    const char *const kinds[] = {"analysis.kind=dynamic", "analysis.kind=static"};
    for (int k = 0; k < 6; k++) {
        if (k == 4) continue; // statics of what falls
        nmm_sim *sim = open_scene(scenes[k % 3], 1, &kinds[k / 3]);
        take_steps(sim, 100);
        const nmm_ledger ledger = summary_of(sim).ledger;
        assert_int_equal(ledger.gain_step, 0);
        assert_int_equal(ledger.residual_step, 0);
        assert_string_equal(ledger.warning, "");
        assert_true(ledger.gain <= 1e-3 * ledger.largest);
        assert_true(ledger.rounding < 1e-4 * ledger.largest || k % 3 == 2);
        nmm_sim_destroy(sim);
    }
}

static void test_largest_energy_counts_the_start(void **unused) {
    (void)unused;
    const char *const changes[] = {"blocks.0.velocity=[3, 4, 0]", "gravity=[0, 0]"};
    nmm_sim *sim = open_scene(SCENE_FALL, 2, changes);
    take_steps(sim, 3);
    assert_close(summary_of(sim).ledger.largest, 0.5 * 2500 * 2 * 25, 1e-12);
    nmm_sim_destroy(sim);
}

// Springs that become four times as stiff between two steps store four times as much, and nothing
// has put it into them; in a step too short for motion that is all that happens.
static void test_springs_that_grow(void **unused) {
    (void)unused;
    const char *const changes[] = {"interfaces.joint.normal_stiffness=1e6", "time.dt=2e-3",
                                   "time.max_move=0.1"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 3, changes);
    take_steps(sim, 50);
    const double stored = sim->contact_energy.elastic;
    assert_int_equal(summary_of(sim).ledger.gain_step, 0);
    assert_true(stored > 0.1 * summary_of(sim).ledger.largest);
    sim->model.interface[0].normal_stiffness *= 4;
    sim->state.dt = 1e-6;
    const nmm_step_report report = take_steps(sim, 1);
    nmm_ledger ledger = summary_of(sim).ledger;
    assert_close(ledger.gain, 3 * stored, 1e-3);
    assert_int_equal(ledger.gain_step, report.step);
    assert_true(ledger.gain_time == report.time);
    assert_int_equal(ledger.residual_step, 0);
    assert_non_null(strstr(ledger.warning, "energy from nowhere"));
    assert_non_null(strstr(ledger.warning, "most of it by contacts: block "));
    assert_non_null(strstr(ledger.warning, "'top'"));
    assert_non_null(strstr(ledger.warning, "time.dt_max"));
    // It stays told, with the step where it came.
    take_steps(sim, 20);
    ledger = summary_of(sim).ledger;
    assert_int_equal(ledger.gain_step, report.step);
    nmm_sim_destroy(sim);
}

// What came while there was next to nothing is no matter any more when the run has much more.
static void test_gain_that_is_outgrown(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_FALL, 0, NULL);
    take_steps(sim, 1);
    const double gain = 0.5 * summary_of(sim).ledger.largest;
    // As if as much strain energy had not been there before.
    sim->strain -= gain;
    sim->strain0 -= gain;
    take_steps(sim, 1);
    nmm_ledger ledger = summary_of(sim).ledger;
    assert_close(ledger.gain, gain, 1e-6);
    assert_int_equal(ledger.gain_step, 2);
    assert_non_null(strstr(ledger.warning, "by elements: block 0 'body' near ("));
    take_steps(sim, 100);
    ledger = summary_of(sim).ledger;
    assert_close(ledger.gain, gain, 1e-6);
    assert_int_equal(ledger.gain_step, 0);
    assert_string_equal(ledger.warning, "");
    nmm_sim_destroy(sim);
}

// What the scheme lost first and gives back later has come from nowhere, too.
static void test_gain_after_a_loss(void **unused) {
    (void)unused;
    nmm_sim *sim = open_scene(SCENE_FALL, 0, NULL);
    take_steps(sim, 50);
    const double part = 0.1 * summary_of(sim).ledger.largest;
    sim->strain += part, sim->strain0 += part;
    take_steps(sim, 1);
    assert_int_equal(summary_of(sim).ledger.gain_step, 0);
    sim->strain -= part, sim->strain0 -= part;
    take_steps(sim, 1);
    assert_int_equal(summary_of(sim).ledger.gain_step, 52);
    assert_close(summary_of(sim).ledger.gain, part, 1e-6);
    nmm_sim_destroy(sim);
}

static void test_ledger_that_does_not_close(void **unused) {
    (void)unused;
    const char *const changes[] = {"analysis.tolerance=0.1", "gravity=[5, -9]"};
    nmm_sim *sim = open_scene(SCENE_BLOCK_ON_BASE, 2, changes);
    take_steps(sim, 50);
    const nmm_ledger ledger = summary_of(sim).ledger;
    assert_true(ledger.residual > 1e-5 * ledger.largest);
    assert_true(ledger.residual_step > 0 && ledger.residual_step <= 50);
    assert_non_null(strstr(ledger.warning, "the energy ledger does not close"));
    assert_non_null(strstr(ledger.warning, "a smaller analysis.tolerance than 0.1"));
    nmm_sim_destroy(sim);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_to_tell),
        cmocka_unit_test(test_largest_energy_counts_the_start),
        cmocka_unit_test(test_springs_that_grow),
        cmocka_unit_test(test_gain_that_is_outgrown),
        cmocka_unit_test(test_gain_after_a_loss),
        cmocka_unit_test(test_ledger_that_does_not_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
