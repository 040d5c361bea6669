// SPDX-License-Identifier: MIT
//
// A test that writes files does it in a new folder of its own, below the one it was started in, and
// removes it at its end.

#ifndef NMM_TEST_OWN_FOLDER_H
#define NMM_TEST_OWN_FOLDER_H

#include "test.h"

#include <unistd.h>

static char own_folder[] = "test_XXXXXX";

/// Go into the new folder. Both take and return what the begin and the end of a test group do.
static inline int own_folder_enter(void **unused) {
    (void)unused;
    return mkdtemp(own_folder) == NULL || chdir(own_folder) != 0;
}

static inline int own_folder_leave(void **unused) {
    (void)unused;
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", own_folder);
    return chdir("..") != 0 || system(command) != 0;
}

static inline void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

#endif
