// SPDX-License-Identifier: MIT
//
// Charts: ranges and ticks of both kinds of axes, files of every kind, the same bytes for the same
// chart, data that have no place, memory, full disks.

#include "test.h"

#include "chart_draw.h"
#include "fixture.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

// The font library keeps its tables for the life of the process.
const char *__lsan_default_suppressions(void) __attribute__((visibility("default")));
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

enum { N = 12 };

/// A chart of two panels: curves with what can go wrong in them, and bars.
typedef struct example {
    double x[N], y[N], value[12];
    nmm_chart_series series[3];
    nmm_chart_level level[1];
    nmm_chart_bars bars;
    nmm_chart_panel panel[2];
    nmm_chart chart;
} example;

static void make_example(example *e) {
    static const char *const category[3] = {"one", "another", "the third"};
    static const char *const bar[2] = {"before", "after"}, *const part[2] = {"a", "b"};
    *e = (example){.level = {{"a level", 2}}};
    for (int i = 0; i < N; i++) {
        e->x[i] = pow(10, 0.3 * i);
        e->y[i] = i == 4 ? NAN : i == 7 ? -1 : 1 / e->x[i];
        e->value[i] = i == 5 ? NAN : 1 + i;
    }
    e->series[0] = (nmm_chart_series){"a curve", e->x, e->y, N, NMM_CHART_LINE};
    e->series[1] = (nmm_chart_series){"marks", e->y, e->x, N, NMM_CHART_MARKS};
    e->series[2] = (nmm_chart_series){"slope 1", e->x, e->x, N, NMM_CHART_SLOPE};
    e->bars = (nmm_chart_bars){3, 2, 2, category, bar, part, e->value};
    e->panel[0] = (nmm_chart_panel){.title = "Curves",
                                    .x = {"x", true, 0, 0},
                                    .y = {"y", true, 0, 0},
                                    .n_series = 3,
                                    .series = e->series,
                                    .n_level = 1,
                                    .level = e->level};
    e->panel[1] = (nmm_chart_panel){
        .x = {"value", false, 0, 0}, .n_level = 1, .level = e->level, .bars = &e->bars};
    e->chart = (nmm_chart){"A chart", "and more on it", 2, e->panel};
}

static size_t read_file(const char *path, unsigned char **bytes) {
    struct stat about;
    assert_int_equal(stat(path, &about), 0);
    *bytes = malloc((size_t)about.st_size + 1);
    FILE *file = fopen(path, "rb");
    assert_int_equal(fread(*bytes, 1, (size_t)about.st_size, file), (size_t)about.st_size);
    fclose(file);
    return (size_t)about.st_size;
}

// --- Scales

static void test_ranges(void **state) {
    (void)state;
    const double x[3] = {10, 1000, NAN}, y[3] = {5, 6, 1e9};
    const nmm_chart_series series = {"s", x, y, 2, NMM_CHART_LINE};
    nmm_chart_panel panel = {.x = {"x", true, 0, 0}, .n_series = 1, .series = &series};
    const nmm_chart_scale across = nmm_chart_scale_x(&panel), up = nmm_chart_scale_y(&panel);
    // The data with a margin, in powers of ten; a linear axis far from 0 does not go there.
    assert_near(across.low, 1 - 0.08, 1e-12);
    assert_near(across.high, 3 + 0.08, 1e-12);
    assert_near(up.low, 5 - 0.04, 1e-12);
    assert_near(up.high, 6 + 0.04, 1e-12);
    assert_near(nmm_chart_part(across, 100), 0.5, 1e-12);
    assert_true(isnan(nmm_chart_part(across, 0)));
    // Near 0 it begins there; what the user says goes.
    const double near_zero[2] = {1, 4};
    const nmm_chart_series other = {"s", x, near_zero, 2, NMM_CHART_LINE};
    panel.series = &other;
    assert_near(nmm_chart_scale_y(&panel).low, 0, 0);
    panel.y = (nmm_chart_axis){"y", true, 1e-3, 1e2};
    assert_near(nmm_chart_scale_y(&panel).low, -3, 1e-12);
    assert_near(nmm_chart_scale_y(&panel).high, 2, 1e-12);
}

static void test_range_without_data(void **state) {
    (void)state;
    const double x[1] = {3}, none[1] = {NAN};
    const nmm_chart_series empty = {"s", none, none, 1, NMM_CHART_LINE};
    const nmm_chart_series one = {"s", x, x, 1, NMM_CHART_LINE};
    const nmm_chart_panel nothing = {.n_series = 1, .series = &empty};
    const nmm_chart_panel point = {.x = {"x", true, 0, 0}, .n_series = 1, .series = &one};
    assert_true(nmm_chart_scale_x(&nothing).high > nmm_chart_scale_x(&nothing).low);
    assert_true(nmm_chart_scale_x(&point).high > nmm_chart_scale_x(&point).low);
    assert_true(nmm_chart_scale_y(&point).high > nmm_chart_scale_y(&point).low);
}

static int labelled(int n, const nmm_chart_tick *tick) {
    int count = 0;
    for (int i = 0; i < n; i++)
        count += tick[i].text[0] != 0;
    return count;
}

static void test_log_ticks(void **state) {
    (void)state;
    nmm_chart_tick tick[NMM_MOST_TICK];
    // Three powers of ten: a number at each, small ticks between.
    int n = nmm_chart_ticks((nmm_chart_scale){true, 0, 3}, 8, tick);
    assert_int_equal(labelled(n, tick), 4);
    assert_int_equal(n, 28);
    assert_string_equal(tick[0].text, "1");
    assert_string_equal(tick[n - 1].text, "1000");
    // Many powers: raised numbers, and no more than have room.
    n = nmm_chart_ticks((nmm_chart_scale){true, -12, 3}, 6, tick);
    assert_true(labelled(n, tick) <= 7 && labelled(n, tick) >= 4);
    assert_string_equal(tick[0].text, "10\xe2\x81\xbb\xc2\xb9\xc2\xb2");
    // Less than two: 1, 2 and 5 times a power.
    n = nmm_chart_ticks((nmm_chart_scale){true, log10(150), log10(2500)}, 8, tick);
    assert_int_equal(labelled(n, tick), 4);
    for (int i = 0; i < n; i++)
        assert_true(tick[i].value >= 150 && tick[i].value <= 2500);
    // Absurd ranges stay within the table.
    n = nmm_chart_ticks((nmm_chart_scale){true, -300, 300}, 8, tick);
    assert_true(n > 0 && n <= NMM_MOST_TICK);
}

// --- Names of levels

static void test_level_keeps_clear_of_marks(void **state) {
    (void)state;
    cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, 10, 10);
    cairo_t *cairo = cairo_create(surface);
    const double x[2] = {0.95, 0.5}, y[2] = {0.52, 0.9};
    const nmm_chart_series series = {"s", x, y, 2, NMM_CHART_MARKS};
    const nmm_chart_level low = {"a level", 0.2}, middle = {"a level", 0.5};
    const nmm_chart_panel panel = {.n_series = 1, .series = &series};
    const nmm_chart_view view = {.panel = &panel,
                                 .cairo = cairo,
                                 .unit = 1,
                                 .plot = {0, 0, 800, 600},
                                 .x = {false, 0, 1},
                                 .y = {false, 0, 1}};
    // To the right as a rule; to the left where a mark is in the way there.
    assert_false(nmm_chart_level_left(&view, &low));
    assert_true(nmm_chart_level_left(&view, &middle));
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
}

// --- Files

static void test_kinds(void **state) {
    (void)state;
    static const struct {
        const char *name, *start;
    } table[] = {{"c.png", "\x89PNG"}, {"c.svg", "<?xml"}, {"c.pdf", "%PDF"}};
    nmm_context context = {.n_thread = 1};
    example e;
    make_example(&e);
    for (int i = 0; i < 3; i++) {
        char path[512];
        unsigned char *first = NULL, *second = NULL;
        fixture_path(path, table[i].name);
        assert_int_equal(nmm_chart_write(&context, &e.chart, path, 0), NMM_OK);
        const size_t size = read_file(path, &first);
        assert_int_equal(nmm_chart_write(&context, &e.chart, path, 0), NMM_OK);
        assert_int_equal(read_file(path, &second), size);
        assert_true(size > 4000);
        assert_memory_equal(first, table[i].start, strlen(table[i].start));
        // Cairo numbers the surfaces of a process, and writes the number into SVG.
        if (i != 1) assert_memory_equal(first, second, size);
        free(first);
        free(second);
    }
    assert_int_equal(context.n_live, 0);
}

// Width and height as a PNG's head tells them.
static void read_size(const char *path, unsigned size[2]) {
    unsigned char *bytes = NULL;
    read_file(path, &bytes);
    for (int k = 0; k < 2; k++)
        size[k] = (unsigned)bytes[16 + 4 * k] << 24 | (unsigned)bytes[17 + 4 * k] << 16 |
                  (unsigned)bytes[18 + 4 * k] << 8 | bytes[19 + 4 * k];
    free(bytes);
}

static void test_size(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    char path[512];
    unsigned small[2], large[2];
    example e;
    make_example(&e);
    fixture_path(path, "size.png");
    assert_int_equal(nmm_chart_write(&context, &e.chart, path, 800), NMM_OK);
    read_size(path, small);
    assert_int_equal(nmm_chart_write(&context, &e.chart, path, 0), NMM_OK);
    read_size(path, large);
    assert_int_equal(small[0], 800);
    assert_int_equal(large[0], 1600);
    assert_near(2.0 * small[1], large[1], 4);
}

static void test_wrong(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    char path[512];
    example e;
    make_example(&e);
    assert_int_equal(nmm_chart_write(&context, &e.chart, "c.gif", 0), NMM_ERROR_ARGUMENT);
    nmm_context_clear(&context);
    assert_int_equal(nmm_chart_write(&context, &e.chart, fixture_path(path, "w.png"), 20),
                     NMM_ERROR_ARGUMENT);
    nmm_context_clear(&context);
    assert_int_equal(nmm_chart_write(&context, &e.chart, "/no/such/folder/c.png", 0),
                     NMM_ERROR_FILE);
    assert_non_null(strstr(context.error.message, "/no/such/folder/c.png"));
    nmm_context_clear(&context);
    if (access("/dev/full", W_OK) == 0) {
        // The temporary cannot be made in /dev; a full disk is tested with frames.
        assert_int_equal(nmm_chart_write(&context, &e.chart, "/dev/full/c.png", 0), NMM_ERROR_FILE);
        nmm_context_clear(&context);
    }
    e.chart.n_panel = 0;
    assert_int_equal(nmm_chart_write(&context, &e.chart, path, 0), NMM_ERROR_ARGUMENT);
    assert_int_equal(context.n_live, 0);
}

static void test_nothing_to_draw(void **state) {
    (void)state;
    nmm_context context = {.n_thread = 1};
    char path[512];
    const nmm_chart_bars bars = {0};
    const nmm_chart_panel panel[2] = {{.x = {"x", true, 0, 0}, .y = {"y", true, 0, 0}},
                                      {.x = {"x", false, 0, 0}, .bars = &bars}};
    const nmm_chart chart = {NULL, NULL, 2, panel};
    assert_int_equal(nmm_chart_write(&context, &chart, fixture_path(path, "empty.svg"), 0), NMM_OK);
}

static void test_memory(void **state) {
    (void)state;
    char path[512];
    example e;
    make_example(&e);
    fixture_path(path, "memory.svg");
    nmm_status status = NMM_ERROR_MEMORY;
    for (long fail_at = 0; status != NMM_OK && fail_at < 50; fail_at++) {
        test_failing hook = {.fail_at = fail_at};
        nmm_context context = {.allocate = test_failing_hook, .user = &hook, .n_thread = 1};
        status = nmm_chart_write(&context, &e.chart, path, 0);
        assert_true(status == NMM_OK || status == NMM_ERROR_MEMORY);
        assert_int_equal(hook.live, 0);
        assert_int_equal(context.n_live, 0);
    }
    assert_int_equal(status, NMM_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ranges),    cmocka_unit_test(test_range_without_data),
        cmocka_unit_test(test_log_ticks), cmocka_unit_test(test_level_keeps_clear_of_marks),
        cmocka_unit_test(test_kinds),     cmocka_unit_test(test_size),
        cmocka_unit_test(test_wrong),     cmocka_unit_test(test_nothing_to_draw),
        cmocka_unit_test(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
