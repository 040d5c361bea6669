// SPDX-License-Identifier: MIT
//
// Loads in run files and pictures: their factor at each frame, arrows of loads that share a place,
// tractions whatever the mesh makes of them; files of older versions and damaged tables.

#include "test.h"

#include "file.h"
#include "fixture.h"
#include "view.h"

#include <stdlib.h>

// The font library keeps its tables for the life of the process.
const char *__lsan_default_suppressions(void) __attribute__((visibility("default")));
const char *__lsan_default_suppressions(void) {
    return "leak:libfontconfig\n";
}

// Two histories of width 1 (the first of no load) around one of a support: full at the start,
// nothing from 0.15 s on. Frames at 0, 0.1, 0.2, 0.3 s.
static double other[] = {0, 7}, support[] = {0, 0, 0, 1, 1, 1}, fading[] = {0, -2, 0.15, 0};

static void make_run(char path[512], const char *name) {
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 6, 3);
    nmm_model *m = &f.sim->model;
    assert_int_equal(nmm_allocate(&f.sim->context, &m->history, 3, sizeof *m->history), NMM_OK);
    m->history[0] = (nmm_history){1, 1, other};
    m->history[1] = (nmm_history){2, 2, support};
    m->history[2] = (nmm_history){2, 1, fading};
    m->n_history = 3;
    m->load[0].history = 2;
    m->load[0].length = 0.5;
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, name)), NMM_OK);
    for (int i = 0; i < 3; i++) {
        fixture_step(&f, 0.1, &report);
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    }
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

// --- Factors

static void test_factors(void **state) {
    (void)state;
    static const double expected[4] = {-2, -2.0 / 3, 0, 0};
    char path[512];
    nmm_file *file = NULL;
    const nmm_file_geometry *g = NULL;
    make_run(path, "factor.vtkhdf");
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_geometry_read(file, &g), NMM_OK);
    assert_int_equal(g->load[0].history, 2);
    assert_near(g->load[0].length, 0.5, 0);
    for (int k = 0; k < 4; k++) {
        nmm_file_frame frame = {0};
        assert_int_equal(nmm_file_frame_read(file, k, &frame), NMM_OK);
        assert_near(frame.load_factor[0], expected[k], 1e-12);
        assert_near(frame.load_most[0], 2, 1e-12);
        nmm_file_frame_destroy(file, &frame);
    }
    nmm_file_close(file);
}

// How often the colour of loads stands in the picture of frame k.
static int count_colour(const char *run, int k) {
    char path[512];
    nmm_file *file = NULL;
    const nmm_plot_def def = {.frame = k, .field = "block"};
    assert_int_equal(nmm_file_open(&file, run), NMM_OK);
    assert_int_equal(nmm_file_plot(file, fixture_path(path, "load.svg"), &def), NMM_OK);
    nmm_file_close(file);
    FILE *picture = fopen(path, "r");
    char line[4096];
    int n = 0;
    while (fgets(line, sizeof line, picture) != NULL)
        n += strstr(line, "rgb(72%,5%,38%)") != NULL || strstr(line, "rgb(72%, 5%, 38%)") != NULL;
    fclose(picture);
    return n;
}

// No arrow and no entry of the legend where the load is zero.
static void test_drawn(void **state) {
    (void)state;
    char path[512];
    make_run(path, "drawn.vtkhdf");
    assert_true(count_colour(path, 0) > 0);
    assert_true(count_colour(path, 1) > 0);
    assert_int_equal(count_colour(path, 2), 0);
    assert_int_equal(count_colour(path, -1), 0);
}

// --- Arrows

// A picture of these loads with these factors.
static void gather(nmm_picture *picture, int n, nmm_load_row *load, double *factor) {
    static nmm_file_geometry g;
    g = (nmm_file_geometry){.n_load = n, .load = load};
    *picture = (nmm_picture){.file = picture->file,
                             .geometry = &g,
                             .frame = {.load_factor = factor, .load_most = factor}};
    assert_int_equal(nmm_loads_gather(picture, 10), NMM_OK);
}

static void drop(nmm_picture *picture) {
    nmm_release(nmm_file_context(picture->file), &picture->arrow);
}

static void expect_arrow(const nmm_arrow *a, nmm_load_kind kind, double x, double y) {
    assert_int_equal(a->kind, kind);
    assert_near(a->value.x, x, 1e-6 * (fabs(x) + fabs(y)));
    assert_near(a->value.y, y, 1e-6 * (fabs(x) + fabs(y)));
}

static void test_one_place(void **state) {
    (void)state;
    char path[512];
    nmm_picture p = {0};
    make_run(path, "place.vtkhdf");
    assert_int_equal(nmm_file_open(&p.file, path), NMM_OK);
    double one[4] = {1, 1, 1, 1};
    // Across and along: an arrow each.
    nmm_load_row load[4] = {{.x = 2, .y = 3, .fx = 25e3}, {.x = 2, .y = 3, .fy = -50e3}};
    gather(&p, 2, load, one);
    assert_int_equal(p.n_arrow, 2);
    expect_arrow(&p.arrow[0], NMM_LOAD_FORCE, 25e3, 0);
    expect_arrow(&p.arrow[1], NMM_LOAD_FORCE, 0, -50e3);
    assert_near(p.load_largest[NMM_LOAD_FORCE], 50e3, 1e-6);
    assert_false(p.load_summed[NMM_LOAD_FORCE]);
    drop(&p);
    // Against each other: two arrows. The same way, with another place between them: one, the sum.
    load[2] = (nmm_load_row){.x = 5, .y = 3, .fx = 1e3};
    load[3] = (nmm_load_row){.x = 2 + 1e-12, .y = 3, .fx = 10e3, .fy = 1e3};
    load[1] = (nmm_load_row){.x = 2, .y = 3, .fx = -7e3};
    gather(&p, 4, load, one);
    assert_int_equal(p.n_arrow, 3);
    expect_arrow(&p.arrow[0], NMM_LOAD_FORCE, 35e3, 1e3);
    expect_arrow(&p.arrow[1], NMM_LOAD_FORCE, -7e3, 0);
    expect_arrow(&p.arrow[2], NMM_LOAD_FORCE, 1e3, 0);
    assert_near(p.load_largest[NMM_LOAD_FORCE], hypot(35e3, 1e3), 1e-6);
    assert_near(p.load_peak[NMM_LOAD_FORCE], 25e3, 1e-6);
    assert_true(p.load_summed[NMM_LOAD_FORCE]);
    drop(&p);
    nmm_file_close(p.file);
}

// The parts of a traction differ with the mesh; the traction does not. Zero loads have no arrow.
static void test_tractions(void **state) {
    (void)state;
    char path[512];
    nmm_picture p = {0};
    make_run(path, "traction.vtkhdf");
    assert_int_equal(nmm_file_open(&p.file, path), NMM_OK);
    nmm_load_row load[4] = {{.x = 0, .fy = 29430 * 0.6, .length = 0.6},
                            {.x = 1, .fx = 5},
                            {.x = 2, .fy = 29430 * 0.013, .length = 0.013},
                            {.x = 3, .fy = 1e6, .length = 1}};
    double factor[4] = {0.5, 1, 0.5, 0};
    gather(&p, 4, load, factor);
    assert_int_equal(p.n_arrow, 3);
    expect_arrow(&p.arrow[0], NMM_LOAD_TRACTION, 0, 14715);
    expect_arrow(&p.arrow[1], NMM_LOAD_TRACTION, 0, 14715);
    expect_arrow(&p.arrow[2], NMM_LOAD_FORCE, 5, 0);
    assert_close(p.load_largest[NMM_LOAD_TRACTION], 14715.0, 1e-12);
    drop(&p);
    nmm_file_close(p.file);
}

// --- Other files

// Replace the table of loads or histories in a run.
static void replace_table(const char *path, const char *name, const nmm_h5_record *record, int n,
                          const void *row) {
    nmm_context context = {.n_thread = 1};
    nmm_h5 h5 = {.context = &context, .path = path, .name = path};
    assert_int_equal(nmm_h5_open(&h5, NMM_H5_APPEND), NMM_OK);
    assert_true(H5Ldelete(h5.file, name, H5P_DEFAULT) >= 0);
    if (record != NULL) {
        const hsize_t range[2] = {0, (hsize_t)n};
        assert_int_equal(nmm_h5_record_create(&h5, name, record, NULL, 8), NMM_OK);
        assert_int_equal(nmm_h5_record_put(&h5, name, record, NULL, range, row), NMM_OK);
    }
    assert_int_equal(nmm_h5_close(&h5), NMM_OK);
}

// Five columns and no histories: forces at points that do not change.
static void test_older_file(void **state) {
    (void)state;
    char path[512];
    nmm_file *file = NULL;
    nmm_file_frame frame = {0};
    const nmm_file_geometry *g = NULL;
    const nmm_load_row row = {
        .x = 1005, .y = 2002, .fy = -3, .element = 0, .length = 9, .history = 9};
    const nmm_h5_record older = {nmm_record_load.size, 5, nmm_record_load.column};
    make_run(path, "older.vtkhdf");
    replace_table(path, NMM_META "/loads", &older, 1, &row);
    replace_table(path, NMM_META "/histories", NULL, 0, NULL);
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frame_read(file, 2, &frame), NMM_OK);
    assert_int_equal(nmm_file_geometry_read(file, &g), NMM_OK);
    assert_int_equal(g->load[0].history, -1);
    assert_near(g->load[0].length, 0, 0);
    assert_near(frame.load_factor[0], 1, 0);
    nmm_file_frame_destroy(file, &frame);
    nmm_file_close(file);
    assert_true(count_colour(path, 2) > 0);
}

static void expect_refused(const char *path, const char *name) {
    nmm_file *file = NULL;
    const nmm_file_geometry *g = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_geometry_read(file, &g), NMM_ERROR_INPUT);
    assert_non_null(strstr(nmm_file_error(file)->message, name));
    nmm_file_close(file);
}

static void test_damaged(void **state) {
    (void)state;
    char path[512];
    static const nmm_load_row load[] = {
        {.history = 1}, {.history = 3}, {.history = -2}, {.history = 0, .length = -1}};
    for (int i = 0; i < 4; i++) {
        make_run(path, "damaged.vtkhdf");
        replace_table(path, NMM_META "/loads", &nmm_record_load, 1, &load[i]);
        expect_refused(path, "nmm/loads");
    }
    static const nmm_history_row history[][2] = {
        {{0, 1, 1}, {0, 0, 1}}, {{1, 0, 1}, {0, 1, 1}}, {{-1, 0, 1}, {0, 0, 1}}};
    for (int i = 0; i < 3; i++) {
        make_run(path, "damaged.vtkhdf");
        replace_table(path, NMM_META "/histories", &nmm_record_history, 2, history[i]);
        expect_refused(path, "nmm/histories");
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_factors),    cmocka_unit_test(test_drawn),
        cmocka_unit_test(test_one_place),  cmocka_unit_test(test_tractions),
        cmocka_unit_test(test_older_file), cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
