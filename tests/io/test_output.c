// SPDX-License-Identifier: MIT
//
// Write a run by hand, read it back: every number that went in comes out, frames come when they
// are due, and damage to files that are there is none.

#include "test.h"

#include "fixture.h"
#include "io.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static void write_run(const char *path, int n_step, double every) {
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 4, 2);
    f.sim->settings.output_every = every;
    assert_int_equal(nmm_output_create(&output, f.sim, path), NMM_OK);
    for (int i = 0; i < n_step; i++) {
        fixture_step(&f, 0.01, &report);
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    }
    f.sim->summary.end = NMM_END_COMPLETED;
    snprintf(f.sim->summary.reason, sizeof f.sim->summary.reason, "end of time");
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

static void test_round_trip(void **state) {
    (void)state;
    char path[512];
    write_run(fixture_path(path, "round.vtkhdf"), 10, 0.02);
    nmm_file *file = NULL;
    const nmm_status opened = nmm_file_open(&file, path);
    if (opened != NMM_OK) print_error("%s\n", nmm_file_error(file)->message);
    assert_int_equal(opened, NMM_OK);
    // t = 0, 0.02, ... 0.10.
    assert_int_equal(nmm_file_frames(file), 6);
    assert_string_equal(nmm_file_title(file), "Two blocks on a bench, \xc3\xa9tude");
    assert_string_equal(nmm_file_state(file), "completed");
    assert_non_null(strstr(nmm_file_scene_text(file), "nmm: 1\n"));
    nmm_summary summary;
    assert_int_equal(nmm_file_summary(file, &summary), NMM_OK);
    assert_int_equal(summary.steps, 10);
    assert_int_equal(summary.end, NMM_END_COMPLETED);
    assert_string_equal(summary.method, "pcg");
    assert_string_equal(summary.reason, "end of time");
    nmm_file_close(file);
}

static void test_fields(void **state) {
    (void)state;
    char path[512];
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 4, 2);
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, "fields.vtkhdf")),
                     NMM_OK);
    for (int i = 0; i < 3; i++) {
        fixture_step(&f, 0.01, &report);
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    }
    // The file is readable before the run ends, and says that it is running.
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frames(file), 4);
    assert_string_equal(nmm_file_state(file), "running");
    const nmm_file_geometry *g = NULL;
    nmm_file_frame frame = {0};
    assert_int_equal(nmm_file_geometry_read(file, &g), NMM_OK);
    assert_int_equal(nmm_file_frame_read(file, 3, &frame), NMM_OK);
    const nmm_model *m = &f.sim->model;
    assert_int_equal(g->n_point, m->n_point);
    assert_int_equal(g->n_element, m->n_element);
    assert_int_equal(g->n_edge, m->n_vertex);
    assert_int_equal(g->n_block, 3);
    for (int p = 0; p < m->n_point; p++) {
        assert_near(g->point[2 * p], m->point[2 * p] + 1000, 0);
        assert_near(g->point[2 * p + 1], m->point[2 * p + 1] + 2000, 0);
        for (int k = 0; k < 2; k++) {
            const double d = f.sim->state.position[2 * p + k] - m->point[2 * p + k];
            assert_near(frame.displacement[2 * p + k], d, 1e-6 * fabs(d) + 1e-12);
        }
    }
    // The loose block at the right moves as a whole, so its points have its covers' velocity.
    const int last = m->n_point - 1;
    assert_close(frame.velocity[2 * last], 0.5, 1e-6);
    assert_close(frame.velocity[2 * last + 1], 0.1, 1e-6);
    for (int e = 0; e < m->n_element; e++) {
        const double *s = f.sim->state.stress + 3 * e, *r = frame.stress + 6 * e;
        const double zz = e < m->n_element - 2 ? 0.25 * (s[0] + s[1]) : 0;
        assert_close(r[0], s[0], 1e-6);
        assert_close(r[1], s[1], 1e-6);
        assert_near(r[2], zz, 1e-6 * fabs(zz));
        assert_close(r[3], s[2], 1e-6);
        assert_near(r[4], 0, 0);
    }
    nmm_file_frame_destroy(file, &frame);
    nmm_file_close(file);
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
}

static void test_contacts(void **state) {
    (void)state;
    char path[512];
    write_run(fixture_path(path, "contacts.vtkhdf"), 3, 0);
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    static const int expected[4] = {0, 0, 3, 2};
    for (int k = 0; k < 4; k++) {
        nmm_file_frame frame = {0};
        assert_int_equal(nmm_file_frame_read(file, k, &frame), NMM_OK);
        assert_int_equal(frame.n_contact, expected[k]);
        for (int i = 0; i < frame.n_contact; i++) {
            // The touched edge runs to -x along the bench's top: normal up, shear to the left.
            const nmm_file_contact *c = &frame.contact[i];
            assert_int_equal(c->mode, i);
            assert_int_equal(c->edge_block, 0);
            assert_near(c->normal_force, 1e4 * i, 1e-2);
            assert_near(c->normal[0], 0, 1e-3);
            assert_near(c->normal[1], 1, 1e-3);
            assert_near(c->force[1], 1e4 * i, 20);
            assert_near(c->force[0], -3e3 * i, 20);
            assert_near(c->slid, 0.01 * i, 1e-8);
        }
        nmm_file_frame_destroy(file, &frame);
    }
    nmm_file_close(file);
}

static void test_supports_and_monitors(void **state) {
    (void)state;
    char path[512];
    write_run(fixture_path(path, "supports.vtkhdf"), 4, 0.1);
    nmm_file *file = NULL;
    const nmm_file_geometry *g = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_geometry_read(file, &g), NMM_OK);
    // Five points below the bench and one held block, at its centroid.
    assert_int_equal(g->n_support, 6);
    assert_int_equal(g->support[0].fix_x, 1);
    assert_int_equal(g->support[1].fix_x, 0);
    assert_near(g->support[4].x, 1008, 1e-12);
    assert_int_equal(g->support[5].held, 1);
    assert_int_equal(g->support[5].block, 1);
    assert_near(g->support[5].x, 1002, 1e-9);
    assert_near(g->support[5].y, 2000.5, 1e-9);
    assert_int_equal(g->n_load, 1);
    assert_near(g->load[0].fy, -1e5, 0);
    assert_int_equal(nmm_file_monitors(file), 2);
    nmm_reading reading;
    assert_int_equal(nmm_file_monitor(file, 0, &reading), NMM_OK);
    assert_string_equal(reading.name, "crest");
    assert_int_equal(reading.has_stress, 1);
    assert_near(reading.stress[1], 4e5 * -2 * 5.0 / 6, 1e-6);
    assert_int_equal(nmm_file_monitor(file, 1, &reading), NMM_OK);
    assert_string_equal(reading.name, "a/b");
    assert_int_equal(reading.has_velocity, 0);
    assert_int_equal(nmm_file_monitor(file, 2, &reading), NMM_ERROR_ARGUMENT);
    nmm_file_close(file);
}

// Frames at the multiples of `every`, the first, the last, and no two of one step.
static void test_cadence(void **state) {
    (void)state;
    static const struct {
        double every;
        int steps, frames;
    } table[] = {{0, 5, 6}, {0.02, 5, 4},   {0.03, 9, 4}, {0.05, 4, 2},
                 {1, 7, 2}, {0.025, 10, 5}, {0.03, 0, 1}};
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++) {
        char path[512];
        nmm_file *file = NULL;
        write_run(fixture_path(path, "cadence.vtkhdf"), table[i].steps, table[i].every);
        assert_int_equal(nmm_file_open(&file, path), NMM_OK);
        assert_int_equal(nmm_file_frames(file), table[i].frames);
        assert_near(nmm_file_time(file, table[i].frames - 1), 0.01 * table[i].steps, 1e-12);
        nmm_file_close(file);
    }
}

// Only what was asked for is in the file.
static void test_fields_not_asked(void **state) {
    (void)state;
    char path[512], pointer[512];
    fixture f;
    nmm_output *output = NULL;
    fixture_create(&f, 2, 2);
    f.sim->settings.out_velocity = f.sim->settings.out_stress = f.sim->settings.out_contact = false;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, "few.vtkhdf")), NMM_OK);
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
    nmm_file *file = NULL;
    nmm_file_frame frame = {0};
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frame_read(file, 0, &frame), NMM_OK);
    assert_non_null(frame.displacement);
    assert_null(frame.velocity);
    assert_null(frame.stress);
    assert_false(frame.has_contact);
    assert_int_equal(access(fixture_path(pointer, "few.contacts.vtkhdf"), F_OK), -1);
    nmm_file_frame_destroy(file, &frame);
    nmm_file_close(file);
}

// A number that single precision cannot hold is an error, not an infinity in the file.
static void test_not_finite(void **state) {
    (void)state;
    char path[512];
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 2, 2);
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, "nan.vtkhdf")), NMM_OK);
    fixture_step(&f, 0.01, &report);
    f.sim->state.stress[4] = 1e300;
    assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_ERROR_NUMERIC);
    assert_non_null(strstr(nmm_output_error(output)->message, "stress"));
    // The error stays, and what was whole stays readable.
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_ERROR_NUMERIC);
    nmm_output_destroy(output);
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frames(file), 1);
    nmm_file_close(file);
    fixture_destroy(&f);
}

// A report of a step that was given up adds nothing.
static void test_step_given_up(void **state) {
    (void)state;
    char path[512];
    fixture f;
    nmm_output *output = NULL;
    nmm_step_report report;
    fixture_create(&f, 2, 2);
    f.sim->settings.output_every = 0;
    assert_int_equal(nmm_output_create(&output, f.sim, fixture_path(path, "up.vtkhdf")), NMM_OK);
    fixture_step(&f, 0.01, &report);
    for (int i = 0; i < 3; i++)
        assert_int_equal(nmm_output_step(output, f.sim, &report), NMM_OK);
    f.sim->summary.end = NMM_END_STEP_TOO_SMALL;
    assert_int_equal(nmm_output_finish(output, f.sim), NMM_OK);
    nmm_output_destroy(output);
    fixture_destroy(&f);
    nmm_file *file = NULL;
    assert_int_equal(nmm_file_open(&file, path), NMM_OK);
    assert_int_equal(nmm_file_frames(file), 2);
    assert_string_equal(nmm_file_state(file), "step_too_small");
    nmm_file_close(file);
}

// Equal runs give equal datasets, however often rows were flushed; nothing is left beside.
static void test_nothing_left(void **state) {
    (void)state;
    char path[512], other[512];
    write_run(fixture_path(path, "left.vtkhdf"), 2, 0);
    static const char *const leftover[] = {"left.vtkhdf.part", "left.vtkhdf.lock",
                                           "left.contacts.part"};
    for (int i = 0; i < 3; i++)
        assert_int_equal(access(fixture_path(other, leftover[i]), F_OK), -1);
    assert_int_equal(access(fixture_path(other, "left.contacts.vtkhdf"), F_OK), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),    cmocka_unit_test(test_fields),
        cmocka_unit_test(test_contacts),      cmocka_unit_test(test_supports_and_monitors),
        cmocka_unit_test(test_cadence),       cmocka_unit_test(test_fields_not_asked),
        cmocka_unit_test(test_not_finite),    cmocka_unit_test(test_nothing_left),
        cmocka_unit_test(test_step_given_up),
    };
    return cmocka_run_group_tests(tests, NULL, fixture_clean);
}
