// SPDX-License-Identifier: MIT
//
// Every allocation of a simulation fails once: creation or step says so, and nothing stays behind.

#include "scenes.h"
#include "test.h"

#include <stdlib.h>

typedef struct counter {
    long left; // calls until the one that fails
    long live; // blocks not given back
} counter;

static void *failing(void *user, void *old, size_t size) {
    counter *count = user;
    if (size == 0) {
        count->live -= old != NULL;
        free(old);
        return NULL;
    }
    if (count->left-- == 0) return NULL;
    count->live += old == NULL;
    return realloc(old, size);
}

static nmm_status run_with(counter *count, const char *text) {
    nmm_sim_def def = nmm_default_sim_def();
    def.path = "test.yaml";
    def.text = text;
    def.text_length = strlen(text);
    def.n_thread = 1;
    def.allocate = failing;
    def.user = count;
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
        counter count = {.left = n};
        status = run_with(&count, text);
        assert_true(status == NMM_OK || status == NMM_ERROR_MEMORY);
        assert_int_equal(count.live, 0);
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
