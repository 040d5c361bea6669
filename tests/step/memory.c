// SPDX-License-Identifier: MIT
//
// Every allocation of a simulation fails once: creation or step says so, and nothing stays behind.

#include "scenes.h"
#include "test.h"

static nmm_status run_with(test_failing *hook, const char *text) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "test.yaml";
    def.text = text;
    def.text_length = strlen(text);
    def.n_thread = 1;
    def.allocate = test_failing_hook;
    def.user = hook;
    nmm_sim *sim = NULL;
    nmm_status status = nmm_sim_create(&sim, &def);
    for (int k = 0; k < 2 && status == NMM_OK; k++)
        status = nmm_sim_step(sim, NULL);
    if (status != NMM_OK) assert_int_equal(nmm_sim_error(sim)->status, NMM_ERROR_MEMORY);
    nmm_sim_destroy(sim);
    return status;
}

static void fail_each(const char *text) {
    nmm_status status = NMM_ERROR_MEMORY;
    int n = 0;
    for (; status != NMM_OK; n++) {
        test_failing hook = {.fail_at = n};
        status = run_with(&hook, text);
        assert_true(status == NMM_OK || status == NMM_ERROR_MEMORY);
        assert_int_equal(hook.live, 0);
        assert_true(n < 5000);
    }
    assert_true(n > 40);
}

static void test_block_on_base(void **unused) {
    (void)unused;
    fail_each(SCENE_BLOCK_ON_BASE);
}

static void test_column(void **unused) {
    (void)unused;
    fail_each(SCENE_COLUMN);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_block_on_base),
        cmocka_unit_test(test_column),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
