// SPDX-License-Identifier: MIT
//
// Pictures: kinds and errors, same input same bytes, full disk, memory; and the scales they are
// drawn with: round ticks, units, colours that keep their order.

#include "test.h"

#include "fixture.h"
#include "view.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

// The font library keeps its tables for the life of the process.
const char *__lsan_default_suppressions(void) __attribute__((visibility("default")));
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

static char run_path[512];

static void make_run(const char *title) {
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 6, 3);
    f.sim->settings.output_every = 0;
    f.sim->settings.out_velocity = false;
    if (title != NULL) f.sim->scene.title = title;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(run_path, "p.vtkhdf")), NMM_OK);
    for (int i = 0; i < 2; i++) {
        fixture_step(&f, 0.1, &report);
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    }
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

static size_t read_file(const char *path, unsigned char **bytes) {
    struct stat about;
    assert_int_equal(stat(path, &about), 0);
    *bytes = malloc((size_t)about.st_size + 1);
    FILE *file = fopen(path, "rb");
    assert_int_equal(fread(*bytes, 1, (size_t)about.st_size, file), (size_t)about.st_size);
    (*bytes)[about.st_size] = 0;
    fclose(file);
    return (size_t)about.st_size;
}

static nmm_status plot(const char *path, const nmm_plot_def *def, char message[1024]) {
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, run_path), NMM_OK);
    const nmm_status status = nmm_file_plot(file, path, def);
    snprintf(message, 1024, "%s", nmm_file_error(file)->message);
    nmm_file_close(file);
    return status;
}

static void test_kinds(void **state) {
    (void)state;
    static const struct {
        const char *name, *start;
    } table[] = {{"a.png", "\x89PNG"}, {"a.svg", "<?xml"}, {"a.PDF", "%PDF"}};
    const nmm_plot_def def = nmm_default_plot_def();
    make_run(NULL);
    for (int i = 0; i < 3; i++) {
        char path[512], message[1024];
        unsigned char *bytes = NULL;
        assert_int_equal(plot(fixture_path(path, table[i].name), &def, message), NMM_OK);
        const size_t size = read_file(path, &bytes);
        assert_true(size > 5000);
        assert_memory_equal(bytes, table[i].start, strlen(table[i].start));
        free(bytes);
    }
}

// Every field at every size, first and last frame: drawn, and as wide as asked.
static void test_fields_and_sizes(void **state) {
    (void)state;
    static const char *const field[] = {NULL,  "stress",       "sxx",  "syy",
                                        "sxy", "displacement", "block"};
    for (int i = 0; i < 7; i++) {
        char path[512], message[1024];
        unsigned char *bytes = NULL;
        const nmm_plot_def def = {
            .frame = i % 3 - 1, .field = field[i], .scale = i, .width = 300 + 250 * i};
        assert_int_equal(plot(fixture_path(path, "f.png"), &def, message), NMM_OK);
        read_file(path, &bytes);
        const int width = bytes[16] << 24 | bytes[17] << 16 | bytes[18] << 8 | bytes[19];
        assert_int_equal(width, def.width);
        // Eight bits a pixel, with a palette.
        assert_int_equal(bytes[24], 8);
        assert_int_equal(bytes[25], 3);
        free(bytes);
    }
}

static void expect_error(const char *name, nmm_plot_def def, nmm_status expected,
                         const char *word) {
    char path[512], message[1024];
    assert_int_equal(plot(fixture_path(path, name), &def, message), expected);
    if (strstr(message, word) == NULL) {
        print_error("message: %s\n", message);
        fail();
    }
    assert_int_equal(access(path, F_OK), -1);
}

static void test_errors(void **state) {
    (void)state;
    const nmm_plot_def plain = nmm_default_plot_def();
    nmm_plot_def def = plain;
    expect_error("b.jpg", plain, NMM_ERROR_ARGUMENT, ".png, .svg or .pdf");
    expect_error("png", plain, NMM_ERROR_ARGUMENT, ".png, .svg or .pdf");
    expect_error("none/b.png", plain, NMM_ERROR_FILE, strerror(ENOENT));
    def.field = "pressure";
    expect_error("b.png", def, NMM_ERROR_ARGUMENT, "unknown field 'pressure'");
    def.field = "velocity";
    expect_error("b.png", def, NMM_ERROR_INPUT, "holds no velocity");
    def = plain;
    def.frame = 3;
    expect_error("b.png", def, NMM_ERROR_ARGUMENT, "frame 3");
    def = plain;
    def.width = 20000;
    expect_error("b.png", def, NMM_ERROR_ARGUMENT, "width");
    def = plain;
    def.scale = NAN;
    expect_error("b.png", def, NMM_ERROR_ARGUMENT, "scale");
}

// Two processes, the same bytes.
static void test_same_bytes(void **state) {
    (void)state;
    static const char *const ending[] = {"png", "svg", "pdf"};
    for (int i = 0; i < 3; i++) {
        char path[2][512], name[32];
        unsigned char *bytes[2];
        size_t size[2];
        for (int k = 0; k < 2; k++) {
            snprintf(name, sizeof name, "same%d.%s", k, ending[i]);
            fixture_path(path[k], name);
            const pid_t child = fork();
            if (child == 0) {
                char message[1024];
                const nmm_plot_def def = nmm_default_plot_def();
                _exit(plot(path[k], &def, message) != NMM_OK);
            }
            int status = 1;
            waitpid(child, &status, 0);
            assert_int_equal(status, 0);
            size[k] = read_file(path[k], &bytes[k]);
        }
        assert_int_equal(size[0], size[1]);
        assert_memory_equal(bytes[0], bytes[1], size[0]);
        free(bytes[0]);
        free(bytes[1]);
    }
}

// 0: the full disk is told, and neither a picture nor a temporary is left.
static int plot_with_limit(const char *path, rlim_t limit) {
    char message[1024];
    const struct rlimit size = {limit, limit};
    const nmm_plot_def def = nmm_default_plot_def();
    signal(SIGXFSZ, SIG_IGN);
    if (setrlimit(RLIMIT_FSIZE, &size) != 0) return 1;
    if (plot(path, &def, message) != NMM_ERROR_FILE) return 2;
    if (strstr(message, strerror(EFBIG)) == NULL || strstr(message, path) == NULL) return 3;
    nmm_file *file = NULL;
    if (nmm_file_open(&file, run_path) != NMM_OK) return 4;
    char folder[520];
    snprintf(folder, sizeof folder, "%s.d", path);
    if (nmm_file_export_vtu(file, folder) != NMM_ERROR_FILE) return 5;
    nmm_file_close(file);
    return access(path, F_OK) == 0 ? 6 : 0;
}

static void test_full_disk(void **state) {
    (void)state;
    static const char *const name[] = {"full.png", "full.svg", "full.pdf"};
    for (int i = 0; i < 3; i++) {
        char path[512];
        fixture_path(path, name[i]);
        const pid_t child = fork();
        if (child == 0) _exit(plot_with_limit(path, 3000));
        int status = 1;
        waitpid(child, &status, 0);
        assert_int_equal(status, 0);
    }
}

// Every allocation of ours fails once.
static void test_no_memory(void **state) {
    (void)state;
    char path[512];
    const nmm_plot_def def = nmm_default_plot_def();
    fixture_path(path, "memory.png");
    for (long fail_at = 0;; fail_at++) {
        test_failing hook = {.fail_at = fail_at};
        nmm_file *file = NULL;
        nmm_status status = nmm_file_open_with(&file, run_path, test_failing_hook, &hook);
        if (status == NMM_OK) status = nmm_file_plot(file, path, &def);
        nmm_file_close(file);
        assert_int_equal(hook.live, 0);
        if (status == NMM_OK) break;
        assert_int_equal(status, NMM_ERROR_MEMORY);
        assert_true(fail_at < 200);
    }
}

// Titles that are long, no UTF-8, or cut in a character; they must not spoil the picture.
static void test_titles(void **state) {
    (void)state;
    static char longest[900];
    memset(longest, 0xc3, sizeof longest - 1);
    for (size_t i = 1; i < sizeof longest - 1; i += 2)
        longest[i] = (char)0xa9;
    const char *const title[] = {"", "\xff\xfe bad \xc3", longest, "\xe2\x82", "a\tb\nc"};
    const nmm_plot_def def = nmm_default_plot_def();
    for (int i = 0; i < 5; i++) {
        char path[512], message[1024];
        make_run(title[i]);
        const nmm_status status = plot(fixture_path(path, "title.svg"), &def, message);
        if (status != NMM_OK) print_error("%s\n", message);
        assert_int_equal(status, NMM_OK);
    }
}

// --- Scales

static void test_ticks(void **state) {
    (void)state;
    nmm_ticks t = nmm_ticks_of(0, 10, 6);
    assert_near(t.step, 2, 1e-12);
    assert_int_equal(t.n, 6);
    t = nmm_ticks_of(-0.3, 0.31, 9);
    assert_near(t.step, 0.1, 1e-12);
    assert_int_equal(t.n, 7);
    assert_near(t.first, -0.3, 1e-12);
    assert_int_equal(nmm_ticks_of(1, 1, 5).n, 0);
    assert_int_equal(nmm_ticks_of(0, INFINITY, 5).n, 0);
    nmm_random random = nmm_random_seed(3);
    for (int i = 0; i < 2000; i++) {
        const double low =
            (nmm_random_unit(&random) - 0.5) * pow(10, 12 * nmm_random_unit(&random) - 6);
        const double span = pow(10, 12 * nmm_random_unit(&random) - 6);
        if (span < 1e-9 * fabs(low)) continue;
        const int most = 2 + (int)(8 * nmm_random_unit(&random));
        t = nmm_ticks_of(low, low + span, most);
        assert_true(t.n >= 1 && t.n <= most);
        assert_true(t.first >= low - 1e-6 * span);
        assert_true(t.first + (t.n - 1) * t.step <= low + span * (1 + 1e-6));
    }
}

static void test_tick_texts(void **state) {
    (void)state;
    char text[32];
    assert_string_equal(nmm_tick_text(text, 0.30000000000000004, 0.1), "0.3");
    assert_string_equal(nmm_tick_text(text, -1e-17, 0.1), "0.0");
    assert_string_equal(nmm_tick_text(text, 1500, 500), "1500");
    assert_string_equal(nmm_tick_text(text, -2.5, 0.5), "\xe2\x88\x92"
                                                        "2.5");
    assert_string_equal(nmm_tick_text(text, 1e12, 1e11), "1e+12");
}

static double lightness(nmm_colour c) {
    return 0.2126 * c.r * c.r + 0.7152 * c.g * c.g + 0.0722 * c.b * c.b;
}

// Magnitudes get lighter all the way; signed colours are white in the middle and dark at the ends.
static void test_colours(void **state) {
    (void)state;
    for (int i = 0; i < 100; i++) {
        const nmm_colour a = nmm_colour_at(NMM_COLOURS_RISING, i / 100.0);
        const nmm_colour b = nmm_colour_at(NMM_COLOURS_RISING, (i + 1) / 100.0);
        assert_true(lightness(b) > lightness(a));
        const nmm_colour c = nmm_colour_at(NMM_COLOURS_DIVERGING, i / 100.0);
        const nmm_colour d = nmm_colour_at(NMM_COLOURS_DIVERGING, (i + 1) / 100.0);
        assert_true(i < 50 ? lightness(d) > lightness(c) : lightness(d) < lightness(c));
    }
    const nmm_colour low = nmm_colour_at(NMM_COLOURS_DIVERGING, -3),
                     high = nmm_colour_at(NMM_COLOURS_DIVERGING, 3);
    assert_true(low.b > low.r && high.r > high.b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kinds),      cmocka_unit_test(test_fields_and_sizes),
        cmocka_unit_test(test_errors),     cmocka_unit_test(test_same_bytes),
        cmocka_unit_test(test_full_disk),  cmocka_unit_test(test_no_memory),
        cmocka_unit_test(test_titles),     cmocka_unit_test(test_ticks),
        cmocka_unit_test(test_tick_texts), cmocka_unit_test(test_colours),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
