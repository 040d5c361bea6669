// SPDX-License-Identifier: MIT
//
// What tests of experiments and trades share: a folder of their own to run in, a study that must
// succeed, cells of its table by the names of columns.

#ifndef NMM_TEST_STUDY_H
#define NMM_TEST_STUDY_H

#include "nmm/study.h"
#include "test.h"

#include <stdbool.h>
#include <unistd.h>

// The font library keeps its tables for the life of the process.
const char *__lsan_default_suppressions(void) __attribute__((visibility("default")));
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

static char test_folder[] = "study_XXXXXX";

/// Go into a new folder; true: it is there.
static bool enter_folder(void) {
    return mkdtemp(test_folder) != NULL && chdir(test_folder) == 0;
}

static int leave(void **unused) {
    (void)unused;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", test_folder);
    return chdir("..") != 0 || system(command) != 0;
}

static void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
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
