// SPDX-License-Identifier: MIT
//
// What goes wrong around a file: it cannot be made, the disk is full, the run is killed, another
// program holds the lock, memory runs out. Always a clear error, and what was whole stays whole.

#include "test.h"

#include "fixture.h"
#include "io.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

// --- Paths

static void expect_no_output(const char *path, const char *reason) {
    fixture f;
    nmm_output *output = NULL;
    fixture_create(&f, 2, 2);
    assert_int_equal(nmm_output_create(&output, f.sim, path), NMM_ERROR_FILE);
    const char *message = nmm_output_error(output)->message;
    if (strstr(message, path) == NULL || strstr(message, reason) == NULL) {
        print_error("message: %s\n", message);
        fail();
    }
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

static void test_wrong_paths(void **state) {
    (void)state;
    char path[512], file[512];
    expect_no_output(fixture_path(path, "missing/run.vtkhdf"), strerror(ENOENT));
    assert_int_equal(mkdir(fixture_path(path, "folder.vtkhdf"), 0777), 0);
    expect_no_output(path, strerror(EISDIR));
    fclose(fopen(fixture_path(file, "file"), "w"));
    expect_no_output(fixture_path(path, "file/run.vtkhdf"), strerror(ENOTDIR));
    expect_no_output("/proc/run.vtkhdf", strerror(ENOENT));
}

// A folder without write permission; root is let in anywhere, so another user tries.
static void test_unwritable_folder(void **state) {
    (void)state;
    char folder[512], path[512];
    mkdir(fixture_path(folder, "closed"), 0555);
    chmod(folder, 0555);
    fixture_path(path, "closed/run.vtkhdf");
    const pid_t child = fork();
    if (child == 0) {
        if (geteuid() == 0 && setuid(65534) != 0) _exit(0);
        fixture f;
        nmm_output *output = NULL;
        fixture_create(&f, 2, 2);
        const nmm_status status = nmm_output_create(&output, f.sim, path);
        const char *message = nmm_output_error(output)->message;
        _exit(status == NMM_ERROR_FILE && strstr(message, strerror(EACCES)) != NULL ? 0 : 1);
    }
    int status = 1;
    waitpid(child, &status, 0);
    assert_int_equal(status, 0);
}

static void expect_no_file(const char *path, nmm_status expected, const char *reason) {
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), expected);
    const char *message = nmm_file_error(file)->message;
    if (strstr(message, path) == NULL || strstr(message, reason) == NULL) {
        print_error("message: %s\n", message);
        fail();
    }
    nmm_file_close(file);
}

static void test_wrong_files(void **state) {
    (void)state;
    char path[512];
    expect_no_file(fixture_path(path, "none.vtkhdf"), NMM_ERROR_FILE, strerror(ENOENT));
    mkdir(fixture_path(path, "dir.vtkhdf"), 0777);
    expect_no_file(path, NMM_ERROR_FILE, strerror(EISDIR));
    FILE *file = fopen(fixture_path(path, "text.vtkhdf"), "w");
    for (int i = 0; i < 1000; i++)
        fputs("nmm: 1\n", file);
    fclose(file);
    expect_no_file(path, NMM_ERROR_INPUT, "not an HDF5 file");
    fclose(fopen(fixture_path(path, "empty.vtkhdf"), "w"));
    expect_no_file(path, NMM_ERROR_INPUT, "not an HDF5 file");
    expect_no_file("/dev/null", NMM_ERROR_FILE, "not a regular file");
}

// --- Full disk

// In a child whose files may not grow beyond `limit` bytes: 0 when every error is told as it
// should be and the file, where there is one, holds only whole frames.
static int write_with_limit(const char *path, rlim_t limit) {
    signal(SIGXFSZ, SIG_IGN);
    const struct rlimit size = {limit, limit};
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 12, 12);
    f.sim->settings.output_every = 0;
    if (setrlimit(RLIMIT_FSIZE, &size) != 0) return 10;
    nmm_status status = nmm_output_create(&output, f.sim, path);
    for (int i = 0; i < 60 && status == NMM_OK; i++) {
        fixture_step(&f, 0.01, &report);
        status = nmm_output_step(output, f.sim, &report);
    }
    if (status != NMM_ERROR_FILE) return 11;
    if (strstr(nmm_output_error(output)->message, strerror(EFBIG)) == NULL) {
        fprintf(stderr, "%s\n", nmm_output_error(output)->message);
        return 12;
    }
    if (nmm_output_finish(output, f.sim) != NMM_ERROR_FILE) return 13;
    nmm_output_destroy(output);
    nmm_file *file = NULL;
    if (access(path, F_OK) != 0) return 0;
    if (nmm_file_open(&file, path) != NMM_OK) {
        fprintf(stderr, "%s\n", nmm_file_error(file)->message);
        return 14;
    }
    for (int k = 0; k < nmm_file_frames(file); k++) {
        nmm_file_frame frame = {0};
        if (nmm_file_frame_read(file, k, &frame) != NMM_OK) return 15;
        nmm_file_frame_destroy(file, &frame);
    }
    nmm_file_close(file);
    fixture_destroy(&f);
    return 0;
}

static void test_full_disk(void **state) {
    (void)state;
    char path[512];
    for (rlim_t limit = 1000; limit < 300000; limit += limit < 20000 ? 9001 : 37003) {
        fixture_path(path, "full.vtkhdf");
        unlink(path);
        const pid_t child = fork();
        if (child == 0) {
            alarm(60);
            _exit(write_with_limit(path, limit));
        }
        int status = 1;
        waitpid(child, &status, 0);
        if (status != 0) print_error("limit %ld: %d\n", (long)limit, status);
        assert_int_equal(status, 0);
    }
}

// --- Killed runs

static void write_for_ever(const char *path) {
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 10, 10);
    f.sim->settings.output_every = 0;
    if (nmm_output_create(&output, f.sim, path) != NMM_OK) _exit(1);
    for (;;) {
        fixture_step(&f, 0.01, &report);
        if (nmm_output_step(output, f.sim, &report) != NMM_OK) _exit(2);
    }
}

static void check_all_frames(const char *path, int *n_unreadable) {
    nmm_file *file = NULL;
    const nmm_status status = nmm_file_open(&file, path);
    if (status != NMM_OK) print_error("%s\n", nmm_file_error(file)->message);
    assert_int_equal(status, NMM_OK);
    const int n = nmm_file_frames(file);
    for (int k = 0; k < n; k++) {
        nmm_file_frame frame = {0};
        const bool read = nmm_file_frame_read(file, k, &frame) == NMM_OK;
        if (!read && k < n - 1) print_error("%s\n", nmm_file_error(file)->message);
        assert_true(read || k == n - 1);
        *n_unreadable += !read;
        nmm_file_frame_destroy(file, &frame);
    }
    nmm_file_close(file);
}

// A kill leaves a file that opens, with every frame but at most the newest.
static void test_killed_run(void **state) {
    (void)state;
    char path[512];
    int n_unreadable = 0;
    nmm_random random = nmm_random_seed(20);
    for (int i = 0; i < 24; i++) {
        fixture_path(path, "killed.vtkhdf");
        unlink(path);
        const pid_t child = fork();
        if (child == 0) write_for_ever(path);
        while (access(path, F_OK) != 0)
            nanosleep(&(struct timespec){.tv_nsec = 1000 * 1000}, NULL);
        const long wait = (long)(nmm_random_unit(&random) * 120e6);
        nanosleep(&(struct timespec){.tv_nsec = wait}, NULL);
        kill(child, SIGKILL);
        waitpid(child, NULL, 0);
        check_all_frames(path, &n_unreadable);
    }
    assert_true(n_unreadable <= 4);
    // The next run of the same name is not hindered by what the killed one left.
    fixture f;
    nmm_output *output = NULL;
    fixture_create(&f, 2, 2);
    assert_int_equal(nmm_output_create(&output, f.sim, path), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

// --- Locks

// A child that holds a lock on `path` until it is killed.
static pid_t hold_lock(const char *path, int kind) {
    int ready[2];
    char byte = 0;
    assert_int_equal(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        const int file = open(path, O_RDWR);
        byte = flock(file, kind) == 0;
        if (write(ready[1], &byte, 1) != 1) _exit(1);
        for (;;)
            pause();
    }
    assert_int_equal(read(ready[0], &byte, 1), 1);
    assert_int_equal(byte, 1);
    close(ready[0]);
    close(ready[1]);
    return child;
}

static void release_lock(pid_t child) {
    kill(child, SIGKILL);
    waitpid(child, NULL, 0);
}

// A reader that keeps its lock delays a run by two seconds, and does not stop it.
static void test_reader_holds_lock(void **state) {
    (void)state;
    char path[512];
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 2, 2);
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, "lock.vtkhdf")), NMM_OK);
    const pid_t child = hold_lock(path, LOCK_SH);
    fixture_step(&f, 0.01, &report);
    const double start = nmm_clock();
    const nmm_status status = nmm_output_step(output, f.sim, &report);
    const double waited = nmm_clock() - start;
    release_lock(child);
    assert_int_equal(status, NMM_OK);
    assert_true(waited >= 1.9 && waited < 4);
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frames(file), 2);
    // A program that keeps the writer's lock is waited for, then named as the reason.
    nmm_file *second = NULL;
    const pid_t writer = hold_lock(path, LOCK_EX);
    const nmm_status opened = nmm_file_open(&second, path);
    release_lock(writer);
    assert_int_equal(opened, NMM_ERROR_FILE);
    assert_non_null(strstr(nmm_file_error(second)->message, "locked"));
    nmm_file_close(second);
    nmm_file_close(file);
}

static void test_two_runs(void **state) {
    (void)state;
    char path[512];
    fixture f;
    nmm_output *first = NULL, *second = NULL;
    fixture_create(&f, 2, 2);
    assert_int_equal(nmm_output_create(&first, f.sim, fixture_path(path, "two.vtkhdf")), NMM_OK);
    assert_int_equal(nmm_output_create(&second, f.sim, path), NMM_ERROR_FILE);
    assert_non_null(strstr(nmm_output_error(second)->message, "another run"));
    nmm_output_destroy(second);
    assert_int_equal(nmm_output_finish(first, f.sim), NMM_OK);
    nmm_output_destroy(first);
    fixture_destroy(&f);
}

// --- Memory

// Every allocation of a whole run fails once.
static void test_no_memory_to_write(void **state) {
    (void)state;
    char path[512];
    fixture_path(path, "memory.vtkhdf");
    for (long fail_at = 0;; fail_at++) {
        test_failing hook = {.fail_at = fail_at};
        fixture f;
        nmm_output *output = NULL;
        nmm_step_report report;
        fixture_create(&f, 2, 2);
        const nmm_context kept = f.sim->context;
        f.sim->context.allocate = test_failing_hook;
        f.sim->context.user = &hook;
        nmm_status status = nmm_output_create(&output, f.sim, path);
        f.sim->context = kept;
        for (int i = 0; i < 3 && status == NMM_OK; i++) {
            fixture_step(&f, 0.02, &report);
            status = nmm_output_step(output, f.sim, &report);
        }
        if (status == NMM_OK) status = nmm_output_finish(output, f.sim);
        if (status != NMM_OK) assert_int_equal(nmm_output_error(output)->status, NMM_ERROR_MEMORY);
        nmm_output_destroy(output);
        fixture_destroy(&f);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_true(fail_at < 200);
    }
}

static void test_no_memory_to_read(void **state) {
    (void)state;
    char path[512];
    fixture_path(path, "memory.vtkhdf");
    for (long fail_at = 0;; fail_at++) {
        test_failing hook = {.fail_at = fail_at};
        nmm_file *file = NULL;
        nmm_file_frame frame = {0};
        nmm_status status = nmm_file_open_with(&file, path, test_failing_hook, &hook);
        if (status == NMM_OK) status = nmm_file_frame_read(file, 1, &frame);
        if (file != NULL) nmm_file_frame_destroy(file, &frame);
        if (status != NMM_OK) assert_int_equal(nmm_file_error(file)->status, NMM_ERROR_MEMORY);
        nmm_file_close(file);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_true(fail_at < 200);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong_paths),       cmocka_unit_test(test_unwritable_folder),
        cmocka_unit_test(test_wrong_files),       cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_killed_run),        cmocka_unit_test(test_reader_holds_lock),
        cmocka_unit_test(test_two_runs),          cmocka_unit_test(test_no_memory_to_write),
        cmocka_unit_test(test_no_memory_to_read),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
