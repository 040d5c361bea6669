// SPDX-License-Identifier: MIT
//
// The ladder of nmm compare with solves of our own making: from which size on the target pays, and
// a solve that fails, which ends the ladder and is told with its size, its solver and the reason.

#include "ladder.h"

#include "nmm/nmm.h"
#include "options.h"
#include "test.h"

// What the next solves do: the one that fails, and how.
static int failing_unknowns, failing_runner;
static nmm_status failing_status;
static double target_cost; // seconds a solve; the host's take a microsecond for each unknown

// Instead of the library's.
nmm_status nmm_linear_solve(const nmm_linear_def *def, nmm_linear_report *report) {
    const bool target = def->device == NMM_DEVICE_TARGET;
    const int runner = target ? TARGET_PCG : strcmp(def->method, "pcg") == 0 ? HOST_PCG : HOST_AUTO;
    *report = (nmm_linear_report){.order = def->generate, .converged = 1, .iterations = 7};
    snprintf(report->method, sizeof report->method, "%s", runner == HOST_AUTO ? "direct" : "pcg");
    snprintf(report->blocks, sizeof report->blocks, "cluster");
    report->seconds = target ? target_cost : 1e-6 * def->generate;
    if (def->generate != failing_unknowns || runner != failing_runner) return NMM_OK;
    report->converged = 0;
    snprintf(report->reason, sizeof report->reason, "made to diverge");
    snprintf(report->error_of_call.message, sizeof report->error_of_call.message, "no memory left");
    return failing_status;
}

// What it says, as text and as JSON.
static void told(const ladder *l, char text[4000]) {
    FILE *const standard = stdout;
    FILE *file = tmpfile();
    assert_non_null(file);
    stdout = file;
    ladder_print(l);
    json out = {.file = file};
    json_open(&out, NULL);
    ladder_json(l, &out);
    json_close(&out);
    stdout = standard;
    rewind(file);
    text[fread(text, 1, 3999, file)] = 0;
    fclose(file);
}

static void test_a_solve_that_fails(void **state) {
    (void)state;
    const struct {
        int unknowns, runner;
        nmm_status status;
        int n_rung, exit;
        const char *said, *json;
    } part[] = {{8192, TARGET_PCG, NMM_OK, 2, EXIT_EARLY,
                 "ended at 8192 unknowns, where target pcg failed: made to diverge",
                 "\"failed\": \"target pcg\""},
                {512, HOST_PCG, NMM_OK, 0, EXIT_EARLY,
                 "ended at 512 unknowns, where host pcg failed: made to diverge",
                 "\"failed_unknowns\": 512"},
                {2048, HOST_AUTO, NMM_ERROR_MEMORY, 1, EXIT_SYSTEM,
                 "ended at 2048 unknowns, where host auto failed: no memory left",
                 "\"failed_reason\": \"no memory left\""}};
    char text[4000];
    for (int k = 0; k < 3; k++) {
        failing_unknowns = part[k].unknowns;
        failing_runner = part[k].runner;
        failing_status = part[k].status;
        ladder l = {0};
        target_cost = 0.01;
        ladder_climb(&l, 1);
        assert_int_equal(l.n_rung, part[k].n_rung);
        assert_int_equal(l.status, part[k].exit);
        told(&l, text);
        assert_non_null(strstr(text, part[k].said));
        assert_non_null(strstr(text, part[k].json));
        // No verdict on what was not measured.
        const char *verdict = k == 0   ? "pays from about 1e+04 unknowns on (estimate"
                              : k == 1 ? "the target was not measured"
                                       : "does not pay at the only size measured";
        assert_non_null(strstr(text, verdict));
    }
}

static void test_a_ladder_to_its_end(void **state) {
    (void)state;
    failing_unknowns = 0;
    target_cost = 0.01;
    ladder l = {0};
    ladder_climb(&l, 1);
    // The rung of 524288 unknowns takes half a second.
    assert_int_equal(l.n_rung, 6);
    assert_int_equal(l.status, EXIT_DONE);
    assert_true(l.against_pcg.is_estimated);
    assert_near(l.against_pcg.unknowns, 1e4, 1);
    char text[4000];
    told(&l, text);
    assert_null(strstr(text, "ended at"));
    assert_non_null(strstr(text, "\"failed\": null"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_solve_that_fails),
        cmocka_unit_test(test_a_ladder_to_its_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
