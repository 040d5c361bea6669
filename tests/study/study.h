// SPDX-License-Identifier: MIT
//
// What tests of experiments and trades share: a study that must succeed, cells of its table by the
// names of columns.

#ifndef NMM_TEST_STUDY_H
#define NMM_TEST_STUDY_H

#include "nmm/study.h"
#include "own_folder.h"

#include <stdbool.h>

// The font library keeps its tables for the life of the process.
const char *__lsan_default_suppressions(void) __attribute__((visibility("default")));
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

/// The study that came with this status, which must be a good one.
static nmm_bench *succeeded(nmm_bench *bench, nmm_status status) {
    if (status != NMM_OK) print_error("%s\n", nmm_bench_error(bench)->message);
    assert_int_equal(status, NMM_OK);
    return bench;
}

static int column_named(const nmm_bench *bench, const char *name) {
    for (int k = 0; nmm_bench_column_of(bench, k).name != NULL; k++)
        if (strcmp(nmm_bench_column_of(bench, k).name, name) == 0) return k;
    fail_msg("no column %s", name);
    return -1;
}

static double number(const nmm_bench *bench, int row, const char *name) {
    return nmm_bench_number(bench, row, column_named(bench, name));
}

#endif
