// SPDX-License-Identifier: MIT
//
// Damaged and foreign files: bytes flipped, cut off, overwritten, at seeded random places. Every
// reading must end in data that is in range or in an error that names the file; it must not crash.
//
// Each case runs in a child. libhdf5 1.10 itself can fail on damaged metadata; a child that dies is
// counted, and only a handful of such deaths is let through (see docs/output.md, limits).

#include "test.h"

#include "fixture.h"
#include "io.h"

#include <hdf5.h>
#include <math.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// A damaged size makes libhdf5 ask for petabytes; it takes the refusal well.
const char *__asan_default_options(void) __attribute__((visibility("default")));
const char *__asan_default_options(void) {
    return "allocator_may_return_null=1";
}

static unsigned char *original;
static size_t original_size;

static void make_original(const char *path) {
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 3, 2);
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, path), NMM_OK);
    for (int i = 0; i < 4; i++) {
        fixture_step(&f, 0.01, &report);
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    }
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    original_size = (size_t)ftell(file);
    rewind(file);
    original = malloc(original_size);
    assert_int_equal(fread(original, 1, original_size, file), original_size);
    fclose(file);
}

static void save(const char *path, const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

// --- Reading everything

static bool is_told(nmm_status status, const nmm_error *error, const char *path) {
    if (status == NMM_OK) return true;
    const bool kind = status == NMM_ERROR_INPUT || status == NMM_ERROR_FILE;
    const bool named = strstr(error->message, path) != NULL;
    if (!kind || !named) fprintf(stderr, "status %d: %s\n", (int)status, error->message);
    return kind && named && error->status != NMM_OK;
}

static bool frame_is_sane(const nmm_file_geometry *g, const nmm_file_frame *frame) {
    double sum = 0;
    for (long i = 0; frame->displacement != NULL && i < 2L * g->n_point; i++)
        sum += frame->displacement[i] - frame->displacement[i];
    for (int i = 0; i < frame->n_contact; i++)
        sum += g->edge_point[2 * frame->contact[i].vertex] < 0;
    return sum == 0;
}

// 0: everything read was sane, or an error was told as it should be.
static int read_everything(const char *path) {
    nmm_file *file = NULL;
    nmm_summary summary;
    nmm_reading reading;
    const nmm_file_geometry *g = NULL;
    nmm_status status = nmm_file_open(&file, path);
    for (int k = 0; status == NMM_OK && k < nmm_file_frames(file) && k < 100; k++) {
        nmm_file_frame frame = {0};
        status = nmm_file_frame_read(file, k, &frame);
        if (status == NMM_OK) status = nmm_file_geometry_read(file, &g);
        if (status == NMM_OK && !frame_is_sane(g, &frame)) return 2;
        nmm_file_frame_destroy(file, &frame);
    }
    if (status == NMM_OK) status = nmm_file_summary(file, &summary);
    for (int k = 0; status == NMM_OK && k < nmm_file_monitors(file); k++)
        status = nmm_file_monitor(file, k, &reading);
    const bool told = is_told(status, nmm_file_error(file), path);
    nmm_file_close(file);
    return told ? 0 : 3;
}

// Exit status of a child that reads the file; 100 + signal when it died.
static int read_in_child(const char *path) {
    const pid_t child = fork();
    if (child == 0) {
        const struct rlimit no_core = {0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        alarm(20);
        // What the sanitizer prints is told once, by hand, when a death is looked into.
        if (getenv("NMM_SHOW_DEATHS") == NULL && freopen("/dev/null", "w", stderr) == NULL)
            _exit(9);
        _exit(read_everything(path));
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? 100 + WTERMSIG(status) : WEXITSTATUS(status);
}

// --- Mutations

static size_t mutate(nmm_random *random, unsigned char *bytes) {
    size_t size = original_size;
    const int kind = (int)(nmm_random_next(random) % 5);
    const int n = 1 + (int)(nmm_random_next(random) % 8);
    memcpy(bytes, original, size);
    if (kind == 0) return (size_t)(nmm_random_unit(random) * (double)size);
    for (int i = 0; i < n; i++) {
        // Metadata stand mostly in front: half of the changes go there.
        const size_t span = kind < 3 ? size / 8 : size;
        const size_t at = (size_t)(nmm_random_unit(random) * (double)span);
        const size_t length = kind == 4 ? 64 : 1;
        for (size_t k = at; k < at + length && k < size; k++)
            bytes[k] = (unsigned char)(kind == 1 ? bytes[k] ^ (1u << (nmm_random_next(random) % 8))
                                                 : nmm_random_next(random));
    }
    return size;
}

static void test_mutations(void **state) {
    (void)state;
    char path[512];
    enum { N_CASE = 240 };
    int n_death = 0;
    make_original(fixture_path(path, "original.vtkhdf"));
    fixture_path(path, "mutated.vtkhdf");
    unsigned char *bytes = malloc(original_size);
    nmm_random random = nmm_random_seed(7);
    for (int i = 0; i < N_CASE; i++) {
        const size_t size = mutate(&random, bytes);
        save(path, bytes, size);
        const int result = read_in_child(path);
        if (result == 2 || result == 3) print_error("case %d: result %d\n", i, result);
        assert_true(result != 2 && result != 3);
        if (result != 0) print_error("case %d: the child died with %d\n", i, result);
        n_death += result != 0;
    }
    free(bytes);
    free(original);
    assert_true(n_death <= N_CASE / 50);
}

// --- Foreign files

static void expect_input_error(const char *path, const char *word) {
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_ERROR_INPUT);
    const char *message = nmm_file_error(file)->message;
    if (strstr(message, path) == NULL || strstr(message, word) == NULL) {
        print_error("message: %s\n", message);
        fail();
    }
    nmm_file_close(file);
}

static herr_t count_print(hid_t stack, void *data) {
    (void)stack;
    *(int *)data += 1;
    return 0;
}

// Somebody else's HDF5 file; and the host program's own error printing is left as it was.
static void test_foreign(void **state) {
    (void)state;
    char path[512];
    int n_print = 0;
    H5Eset_auto2(H5E_DEFAULT, count_print, &n_print);
    const hid_t file =
        H5Fcreate(fixture_path(path, "foreign.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(file, "nmm", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Gclose(group);
    H5Fclose(file);
    expect_input_error(path, "no run file");
    assert_int_equal(n_print, 0);
    H5E_auto2_t print = NULL;
    void *data = NULL;
    H5Eget_auto2(H5E_DEFAULT, &print, &data);
    assert_true(print == count_print && data == &n_print);
    H5Fopen("/no/such/file", H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_int_equal(n_print, 1);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mutations),
        cmocka_unit_test(test_foreign),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
